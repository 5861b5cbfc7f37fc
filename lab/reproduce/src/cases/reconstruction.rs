//! Figures 9.1 to 9.3: fine surfaces as few curved shells. The thesis prints no numbers beside its maps of
//! the distance from shells to surface; here both directions are measured, densely. The capsule and the
//! aneurysm are analytic, since the thesis's are not published. If `PLIANT_DATA` names a folder of organs,
//! organs of patients are shown as well.

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use pliant_geometry::{Vector3, io};
use pliant_meshing::{
    DEFAULT_CELL_LIMIT, Fewer, FittedShells, ImplicitField, Organ, Pattern, Phantom, Sheet, ShellGoal,
    TriangleMesh,
};

use crate::case::{Case, CaseError, Correction, Findings, Row};
use crate::picture::{Body, View, figure};

/// Figure 9.1.
pub const CYLINDER: Case = Case {
    id: "fig-9.1",
    title: "Fig. 9.1: a cylinder by 12 and 48 shells",
    shows: "A cylinder of 16,384 triangles (a), 12 flat triangles (b), the same as curved shells (c), and 48 shells \
            (d); colours show the distance from the cylinder.",
    corrections: &[ONE_WAY],
    seconds: 2.0,
    compute: cylinder,
};

/// Figure 9.2.
pub const CAPSULE: Case = Case {
    id: "fig-9.2",
    title: "Fig. 9.2: Glisson's capsule by 1,200 shells",
    shows: "The membrane around the liver, 8,000 triangles (a), and the distance of 1,200 shells from it (b).",
    corrections: &[ONE_WAY, PLACEMENT],
    seconds: 20.0,
    compute: capsule,
};

/// Figure 9.3.
pub(crate) const ANEURYSM: Case = Case {
    id: "fig-9.3",
    title: "Fig. 9.3: an aneurysm by 772 shells",
    shows: "An aneurysm of 28,368 triangles (a), and the distance of 772 shells from it (b).",
    corrections: &[ONE_WAY, PLACEMENT],
    seconds: 20.0,
    compute: aneurysm,
};

const ONE_WAY: Correction = Correction {
    printed: "section 9.2: one-sided distances, from the shells to the surface",
    correct: "Distances in both directions.",
    why: "Parts missed by the shells show only from surface to shells: on a sphere of 80 shells of the thesis's polynomial this distance is 2.5 to 8 times larger.",
};

const PLACEMENT: Correction = Correction {
    printed: "section 9.2.1: a node moves to the mean of the centres of its three closest triangles",
    correct: "Vertices and normals are fitted to signed distances over the whole shells.",
    why: "A mean of centres lies inside a curved surface, and its normal is arbitrary.",
};

const SOURCE: &str = "required of this reconstruction";

/// A surface to fit, and the required accuracy.
struct Study<'a> {
    name: &'a str,
    target: &'a TriangleMesh,
    /// Largest distance allowed, in percent of the diagonal.
    allowed: Option<f64>,
}

impl Study<'_> {
    /// Rows of numbers of the fitted shells, which took some seconds.
    fn rows(&self, fitted: &FittedShells, seconds: f64) -> Vec<Row> {
        let report = &fitted.report;
        let percent = |length: f64| 100.0 * length / report.diagonal;
        let of = |what: &str| format!("{}, {} shells: {what}", self.name, report.shells);
        let found = &report.distances;
        let mut rows = vec![Row::shown(
            of("flat triangles instead: largest distance"),
            "%",
            percent(report.flat.largest()),
            "",
        )];
        for (what, most, rms) in [
            ("shells to surface", found.largest_forward, found.rms_forward),
            ("surface to shells", found.largest_backward, found.rms_backward),
        ] {
            let quantity = of(&format!("{what}, largest distance"));
            rows.push(match self.allowed {
                Some(allowed) => Row::judged(quantity, "%", [0.0, allowed], percent(most), SOURCE),
                None => Row::shown(quantity, "%", percent(most), ""),
            });
            rows.push(Row::shown(of(&format!("{what}, rms")), "%", percent(rms), ""));
        }
        rows.push(Row::shown(of("worst triangle shape (1: equilateral)"), "", report.shape[0], ""));
        rows.push(Row::timed(of("time"), "s", None, seconds, ""));
        rows
    }

    /// Fits a body by a number of shells: adds its rows, and a picture of the target, the shells and the
    /// distances.
    fn by_shells(&self, shells: usize, from: [f64; 3], findings: &mut Findings) -> Result<(), CaseError> {
        let start = Instant::now();
        let fitted = FittedShells::new(self.target, ShellGoal::Shells(shells), &|_| {})?;
        findings.rows.extend(self.rows(&fitted, start.elapsed().as_secs_f64()));
        let target = self.target.to_mesh();
        let bodies = [
            Body::still(format!("(a) {} triangles", self.target.len()), &target),
            Body::still(format!("{} shells, drawn flat", fitted.report.shells), &fitted.mesh),
            map("(b) curved shells, distance".into(), &fitted),
        ];
        let view = View { from, up: [0.0, 0.0, 1.0], quantity: QUANTITY, factor: 1.0, columns: 3 };
        findings.figures.push(figure(&bodies, &view, format!("{}.", self.name))?);
        Ok(())
    }
}

/// The curved shells in colours of their distance in percent of the diagonal.
fn map(label: String, fitted: &FittedShells) -> Body<'_> {
    let distance = &fitted.error_map.point_data["distance"].values;
    let value = distance.iter().map(|d| 100.0 * d / fitted.report.diagonal).collect();
    Body { value: Some(value), edges: false, ..Body::still(label, &fitted.error_map) }
}

const QUANTITY: &str = "distance, % of the diagonal";

fn cylinder() -> Result<Findings, CaseError> {
    let sheet = Sheet::Cylinder { radius: 1.0, length: 2.0, from: 0.0, span: TAU };
    let made = |counts| -> Result<TriangleMesh, CaseError> {
        let mesh = sheet.mesh(counts, Pattern::default(), None, DEFAULT_CELL_LIMIT)?;
        Ok(TriangleMesh::from_mesh(&mesh)?.0)
    };
    let target = made([256, 32])?;
    let mut findings = Findings::default();
    let mut fitted = Vec::new();
    for (counts, allowed) in [([6, 1], 0.25), ([12, 2], 0.02)] {
        let study = Study { name: "open cylinder", target: &target, allowed: Some(allowed) };
        let start = Instant::now();
        let shells = FittedShells::on(&target, &made(counts)?);
        findings.rows.extend(study.rows(&shells, start.elapsed().as_secs_f64()));
        fitted.push(shells);
    }
    let (fine, flat) = (target.to_mesh(), made([6, 1])?.to_mesh());
    let bodies = [
        Body::still(format!("(a) {} triangles", target.len()), &fine),
        Body::still("(b) 12 flat triangles", &flat),
        map("(c) 12 shells".into(), &fitted[0]),
        map("(d) 48 shells".into(), &fitted[1]),
    ];
    let view =
        View { from: [0.9, -1.0, 0.7], up: [0.0, 0.0, 1.0], quantity: QUANTITY, factor: 1.0, columns: 4 };
    findings.figures.push(figure(&bodies, &view, "An open cylinder, as long as it is wide.")?);
    Ok(findings)
}

/// A surface of a patient in millimetres, where `PLIANT_DATA` names a folder that holds it.
fn patient(path: &str) -> Result<Option<TriangleMesh>, CaseError> {
    let Some(folder) = std::env::var_os("PLIANT_DATA") else { return Ok(None) };
    let path = Path::new(&folder).join(path);
    if !path.exists() {
        return Ok(None);
    }
    let mut mesh = io::read(&path).map_err(|error| CaseError::Run(error.to_string()))?.mesh;
    mesh.points.iter_mut().for_each(|point| *point *= 1e-3);
    Ok(Some(TriangleMesh::from_mesh(&mesh)?.0))
}

fn capsule() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let liver = Phantom::new(Organ::Liver, 1.0)?;
    let mut target = TriangleMesh::of_field(&liver, 2.5e-3, DEFAULT_CELL_LIMIT)?;
    target.decimate(Fewer::Triangles(8000))?;
    let study = Study { name: "capsule of the analytic liver", target: &target, allowed: Some(0.2) };
    study.by_shells(1200, [0.3, -1.0, 0.5], &mut findings)?;
    if let Some(mut target) = patient("organs-openhelp/Liver.stl")? {
        target.decimate(Fewer::Triangles(8000))?;
        let study = Study { name: "capsule of a patient (OpenHELP)", target: &target, allowed: Some(0.2) };
        study.by_shells(1200, [0.0, -1.0, 0.3], &mut findings)?;
    }
    Ok(findings)
}

/// A bent vessel with a sac: a torus's arc of 4 mm and a ball of 9 mm, joined smoothly; the vessel's ends are
/// closed.
struct Sac;

impl ImplicitField for Sac {
    fn value(&self, point: &Vector3) -> f64 {
        const BEND: f64 = 0.03;
        let angle = point.z.atan2(point.x).clamp(-1.1, 1.1);
        let axis = Vector3::new(angle.cos(), 0.0, angle.sin()) * BEND;
        let vessel = 0.004 + 0.0004 * (6.0 * angle).sin() - (point - axis).norm();
        let sac = 0.009 - (point - Vector3::new(BEND + 0.009, 0.002, 0.002)).norm();
        let (most, least) = (vessel.max(sac), vessel.min(sac));
        // Smooth maximum (Quílez): 3 mm wide.
        let h = (1.0 - (most - least) / 0.003).max(0.0);
        most + 0.25 * h * h * 0.003
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(0.005, -0.01, -0.035), Vector3::new(0.05, 0.014, 0.035))
    }
}

fn aneurysm() -> Result<Findings, CaseError> {
    let mut findings = Findings::default();
    let mut target = TriangleMesh::of_field(&Sac, 4e-4, DEFAULT_CELL_LIMIT)?;
    target.decimate(Fewer::Triangles(28_368))?;
    let study = Study { name: "analytic aneurysm", target: &target, allowed: Some(0.5) };
    study.by_shells(772, [0.4, -1.0, 0.3], &mut findings)?;
    if let Some(target) = patient("aneurysm-sofa/aneurysm3D_1.off")? {
        let study = Study { name: "aneurysm of a patient (SOFA)", target: &target, allowed: Some(0.5) };
        study.by_shells(772, [0.4, -1.0, 0.3], &mut findings)?;
    }
    Ok(findings)
}
