//! Writes the scene of a segmented organ. Its tissue is meshed with tets, vessels of other labels are
//! membranes tied to the tissue, and a capsule covers its boundary.

use pliant_geometry::Vector3;

use super::of_mesh::calming;

/// Young's modulus [Pa] and Poisson's ratio of tissue, capsule and vessels.
const TISSUE: [f64; 2] = [5e3, 0.45];
const CAPSULE: [f64; 2] = [5e6, 0.5];
const VESSEL: [f64; 2] = [0.6e6, 0.5];
/// Density of tissue [kg/m³].
const DENSITY: f64 = 1060.0;

/// A segmented organ with its walls.
#[derive(Clone, Debug, PartialEq)]
pub struct OrganScene {
    /// Title of the scene.
    pub title: String,
    /// Source of the tissue, as in the `mesh` of a body: `image = "seg.nii.gz", labels = [5], vessels = [6]`,
    /// with names and cleaning.
    pub source: String,
    /// Edge of the tets [m].
    pub edge: f64,
    /// Source of each vessel, `image = "seg.nii.gz", label = 6`, with its thickness [m].
    pub vessels: Vec<(String, f64)>,
    /// Thickness of the capsule [m].
    pub capsule: Option<f64>,
    /// Corners of the box around the bulk of the tissue [m].
    pub bounds: [Vector3; 2],
}

impl OrganScene {
    /// Text of the scene, with comments. The organ is held at its lowest tenth along its longest side and
    /// pulled at the other end. Damping is half of the critical damping of the slowest vibration along that
    /// side.
    ///
    /// ```
    /// use pliant_geometry::Vector3;
    /// let organ = pliant_format::OrganScene {
    ///     title: "liver".into(),
    ///     source: "image = \"seg.nii.gz\", labels = [5], vessels = [6]".into(),
    ///     edge: 0.008,
    ///     vessels: vec![("image = \"seg.nii.gz\", label = 6".into(), 1e-3)],
    ///     capsule: Some(1e-4),
    ///     bounds: [Vector3::zeros(), Vector3::new(0.2, 0.1, 0.1)],
    /// };
    /// let text = organ.text();
    /// assert!(text.contains("[tie.vessel-1]") && text.contains("on = \"organ\""));
    /// ```
    pub fn text(&self) -> String {
        let [low, high] = &self.bounds;
        let size = high - low;
        let axis = size.imax();
        let length = size[axis];
        let damping = rounded(calming(TISSUE[0], DENSITY, length));
        let mut along = [0.0; 3];
        along[axis] = 1.0;
        let plane = |part: f64, sign: f64| {
            let mut point = <[f64; 3]>::from(*low);
            point[axis] += part * length;
            let normal = along.map(|x| sign * x + 0.0);
            format!("{{ half-space = {{ point = {:?}, normal = {normal:?} }} }}", point.map(rounded))
        };
        let by = along.map(|x| rounded(0.1 * length * x));
        let law = |name: &str, [young, poisson]: [f64; 2]| {
            format!(
                "[law.{name}]\ntype = \"neo-hookean\"\nyoung-modulus = {young:?}      # Pa\npoisson-ratio = {poisson:?}\n\n"
            )
        };
        let title = serde_json::Value::from(self.title.as_str());
        let mut text = format!(
            "# Made by `pliant mesh`. Moduli are common values: take those of your tissue.\n\n\
             [scene]\ntitle = {title}\nuntil = 3.0                     # s\n\n{}",
            law("tissue", TISSUE)
        );
        if self.capsule.is_some() {
            text += &law("capsule", CAPSULE);
        }
        if !self.vessels.is_empty() {
            text += &law("vessel", VESSEL);
        }
        text += &format!(
            "[body.organ]\nmesh = {{ {}, edge = {:?} }}\nelement = \"tet4-anp\"\nlaw = \"tissue\"\n\
             density = {DENSITY:?}                # kg/m³\ndamping = {damping:?}                  # 1/s\n\n",
            self.source, self.edge
        );
        if let Some(thickness) = self.capsule {
            text += &format!(
                "# A wall on the boundary of the organ, with its nodes.\n\
                 [body.capsule]\non = \"organ\"\nlaw = \"capsule\"\ndensity = 1100.0\nthickness = {thickness:?}              # m\n\n"
            );
        }
        for (index, (source, thickness)) in self.vessels.iter().enumerate() {
            let name = format!("vessel-{}", index + 1);
            text += &format!(
                "# The wall of a vessel, tied to the tissue round it; outside of the organ it is free.\n\
                 [body.{name}]\nmodel = \"membrane\"\nmesh = {{ {source}, as = \"surface\", edge = {:?} }}\n\
                 law = \"vessel\"\ndensity = 1100.0\nthickness = {thickness:?}\ndamping = {damping:?}\n\n\
                 [tie.{name}]\nbetween = [\"{name}\", \"organ\"]\n\n",
                rounded(0.5 * self.edge)
            );
        }
        text += &format!(
            "[constraint.held]\ntype = \"fix\"\nbody = \"organ\"\nnodes = {}\n\n\
             [constraint.pull]\ntype = \"move\"\nbody = \"organ\"\nnodes = {}\nby = {by:?}\ncurve = \"smooth-step\"\nto = 2.0\n\n\
             [output.bodies]\ntype = \"vtu\"\nevery = 0.1\ndata = [\"displacement\", \"von-mises\"]\n\n\
             [output.history]\ntype = \"csv\"\nevery = 0.01\n\n[view]\nghost = true\n",
            plane(0.1, -1.0),
            plane(0.9, 1.0)
        );
        text
    }
}

/// Rounds to three digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
