//! A specimen: a mesh of one material, held, moved and loaded by its faces. The faces of its bounding box are
//! called `x-min`, `x-max`, `y-min`, `y-max`, `z-min` and `z-max`.

use pliant_explicit::critical_step;
use pliant_geometry::{CellKind, Mesh, Selection, boundary};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE};
use pliant_mechanics::model::{Averaging, Body, Cells, Constraint, Material, Model, Motion, Solid};
use pliant_mechanics::tensor::Vector;
use pliant_meshing::{Block, Resolution, VolumeCell, Voxels};

/// The hourglass coefficient of all hexahedra, the default of a scene.
pub const HOURGLASS: f64 = 0.2;

/// The element that tetrahedra become.
#[derive(Clone, Copy, Debug)]
pub enum Tets {
    /// `tet4`
    Plain,
    /// `tet4-anp` and its kin.
    Averaged(Averaging),
}

/// The element that hexahedra become.
#[derive(Clone, Copy, Debug)]
pub enum Hexes {
    /// `hex8` with an hourglass coefficient.
    UniformStrain(f64),
    /// `hex8-full`
    Full,
}

/// A body under test.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its model.
    pub model: Model,
}

impl Specimen {
    /// The volume cells of a mesh as plain `tet4` and `hex8`, with the fibre direction of every cell for a
    /// law that has one.
    pub fn new(mesh: Mesh, material: &Material, fibre: Vector<f64>) -> Self {
        Self::of_elements(mesh, Tets::Plain, Hexes::UniformStrain(HOURGLASS), material, fibre)
    }

    /// The volume cells of a mesh as given elements. Immersed cubes are filled by their fractions.
    pub fn of_elements(
        mesh: Mesh,
        tets: Tets,
        hexes: Hexes,
        material: &Material,
        fibre: Vector<f64>,
    ) -> Self {
        let nodes = mesh.points.len();
        let mut model = Model {
            rest: mesh.points.iter().map(|p| [p.x, p.y, p.z]).collect(),
            mass: vec![0.0; nodes],
            ..Model::default()
        };
        model.bodies.push(Body {
            name: "specimen".into(),
            nodes: 0..nodes as u32,
            shared: vec![],
            damping: 0.0,
        });
        for block in mesh.volume_blocks() {
            let cells = match block.kind {
                CellKind::Tet => {
                    let nodes = block.cells().map(nodes_of).collect();
                    match tets {
                        Tets::Plain => Cells::tet4(nodes, &model.rest),
                        Tets::Averaged(averaging) => Cells::averaged_tet4(nodes, &model.rest, averaging),
                    }
                }
                _ => {
                    let nodes = block.cells().map(nodes_of).collect();
                    match hexes {
                        Hexes::UniformStrain(hourglass) => {
                            Cells::hex8(nodes, &model.rest, hourglass, material.law.small_strain().shear)
                        }
                        Hexes::Full => Cells::full_hex8(nodes, &model.rest),
                    }
                }
            };
            let cells = match block.data.get(Voxels::FRACTION) {
                Some(fractions) => cells.filled(&fractions.values),
                None => cells,
            };
            let count = cells.len() * material.law.families();
            let original = (0..cells.len() as u32).collect();
            let (fibre, material) = (vec![fibre; count], material.clone());
            model.add_solid(Solid { body: 0, material, cells, fibre, original });
        }
        Self { mesh, model }
    }

    /// A block from the origin to `size` [m], with `counts` cells (of six tets each, if tets) along the axes.
    ///
    /// # Panics
    /// If a size or count is 0.
    pub fn block(
        size: [f64; 3],
        counts: [usize; 3],
        cells: VolumeCell,
        material: &Material,
        fibre: Vector<f64>,
    ) -> Self {
        Self::new(block(size, counts, cells), material, fibre)
    }

    /// The nodes of a face of the bounding box.
    ///
    /// # Panics
    /// If the face does not exist.
    pub fn face(&self, name: &str) -> Vec<u32> {
        let (low, high) = self.mesh.bounds().unwrap_or_else(|| panic!("a mesh without points"));
        let (axis, side) = name.split_once('-').unwrap_or_else(|| panic!("no face is called `{name}`"));
        let mut normal = [0.0; 3];
        normal["xyz".find(axis).unwrap_or_else(|| panic!("no axis is called `{axis}`"))] = 1.0;
        let point = if side == "min" { low } else { high };
        let plane = Selection::Plane { point: point.into(), normal, tolerance: None };
        plane.nodes(&self.mesh, &boundary(&self.mesh)).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Adds mass-proportional damping α [1/s].
    #[must_use]
    pub fn damped(mut self, alpha: f64) -> Self {
        self.model.bodies[0].damping = alpha;
        self
    }

    /// Holds the marked components of a face: the constraint `fix x-min` and so on.
    #[must_use]
    pub fn fix(self, face: &str, components: [bool; 3]) -> Self {
        self.constrain("fix", face, components, Motion::Fixed)
    }

    /// Holds x on `x-min`, y on `y-min` and z on `z-min`. This makes an eighth of a symmetric body, or a
    /// block that may change its width.
    #[must_use]
    pub fn on_rollers(self) -> Self {
        let [x, y, z] = [0, 1, 2].map(|axis| [0, 1, 2].map(|c| c == axis));
        self.fix("x-min", x).fix("y-min", y).fix("z-min", z)
    }

    /// Displaces a face along x: the constraint `move x-max` and so on.
    #[must_use]
    pub fn shift(self, face: &str, along_x: f64, curve: Curve) -> Self {
        self.constrain("move", face, [true, false, false], Motion::Displacement([along_x, 0.0, 0.0], curve))
    }

    /// Displaces a face as a whole: the constraint `move x-max` and so on.
    #[must_use]
    pub fn carry(self, face: &str, by: Vector<f64>, curve: Curve) -> Self {
        self.constrain("move", face, [true; 3], Motion::Displacement(by, curve))
    }

    fn constrain(mut self, verb: &str, face: &str, [x, y, z]: [bool; 3], motion: Motion) -> Self {
        let (name, nodes) = (format!("{verb} {face}"), self.face(face));
        let components = [x, y, z, false, false, false];
        self.model.constraints.push(Constraint { name, nodes, components, motion });
        self
    }

    /// Adds gravity [m/s²] from the start.
    #[must_use]
    pub fn falling(self, acceleration: Vector<f64>) -> Self {
        let curve = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
        self.loaded(LoadKind::Gravity { body: 0, acceleration }, curve)
    }

    /// Adds a load.
    #[must_use]
    pub fn loaded(mut self, kind: LoadKind, curve: Curve) -> Self {
        self.model.loads.push(Load::new("load", kind, curve));
        self
    }

    /// The faces of its surface, outward.
    pub fn surface(&self) -> Vec<Face> {
        let faces = boundary(&self.mesh).faces;
        faces
            .iter()
            .map(|face| std::array::from_fn(|k| face.nodes().get(k).copied().unwrap_or(NO_NODE)))
            .collect()
    }

    /// The element bound of the step at rest [s].
    ///
    /// # Panics
    /// Without cells.
    pub fn element_bound(&self) -> f64 {
        critical_step::element_bound(&self.model)
            .map_or_else(|| panic!("a model without cells"), |bound| bound.step)
    }

    /// The critical time step of the model at rest [s].
    ///
    /// # Panics
    /// If constraints contradict each other.
    pub fn critical_step(&self) -> f64 {
        critical_step::assembled(&self.model).unwrap_or_else(|error| panic!("{error}")).step
    }

    /// The node closest to a point [m] at rest.
    pub fn node_at(&self, point: Vector<f64>) -> usize {
        let distance = |x: &Vector<f64>| (0..3).map(|c| (x[c] - point[c]).powi(2)).sum::<f64>();
        let closest =
            (self.model.rest.iter().enumerate()).min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        closest.map_or(0, |(node, _)| node)
    }
}

/// The mesh of [`Specimen::block`].
pub(crate) fn block(size: [f64; 3], counts: [usize; 3], cells: VolumeCell) -> Mesh {
    // Cases choose their own sizes: cubes for GPUs have more cells than the default limit for a user's mesh.
    let mesh = Block::new(size).mesh(Resolution::Counts(counts), cells, usize::MAX);
    mesh.unwrap_or_else(|error| panic!("{error}"))
}

fn nodes_of<const N: usize>(cell: &[u32]) -> [u32; N] {
    std::array::from_fn(|k| cell[k])
}
