//! Shells, and solids whose equations are solved, in addition to the model of all solvers.

use std::ops::Range;
use std::sync::Arc;

use pliant_implicit::{Assembly, AssemblyState, CurvedSurface};
use pliant_mechanics::fingerprint;

/// Bodies of the implicit solvers, on the nodes of the model of a
/// [`ParticipantSetup`](crate::ParticipantSetup).
#[derive(Clone, Debug)]
pub struct ImplicitBodies {
    /// Their shells, with the model of their nodes.
    pub model: Arc<Assembly>,
    /// The cells of each body, in the order of the bodies.
    pub cells: Vec<BodyCells>,
    /// Quantity that a static run prescribes instead of the size of a load.
    pub control: Option<RunControl>,
    /// The state that a run starts from.
    pub start: AssemblyState,
    /// The curved surface of the shells, if something is carried by it.
    pub surface: Option<CurvedSurface>,
}

/// The cells of a body, in the order of its mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BodyCells {
    /// Facets of the model.
    Facets(Range<u32>),
    /// Solids of the model that are of the body.
    Solids,
}

/// A control of a whole static run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunControl {
    /// A component (0 to 2) of a node moves by a distance [m] in all.
    Displacement {
        /// The node.
        node: u32,
        /// x, y or z as 0, 1, 2.
        component: usize,
        /// The distance [m].
        by: f64,
    },
    /// Length [m] by which all translations together move in each load step.
    ArcLength {
        /// The length [m].
        length: f64,
        /// Condition that ends the path.
        stop: Stop,
    },
    /// The pressurised facets enclose a volume [m³] in the end, and another at the start.
    Volume {
        /// At the start [m³].
        from: f64,
        /// At the end [m³].
        to: f64,
    },
}

/// Conditions that end a path by arc length: it ends at the first state that meets one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Size of the load factor.
    pub load_factor: Option<f64>,
    /// A node, a component (0 to 2) of its displacement, and how large that is [m], with its sign.
    pub displacement: Option<(u32, usize, f64)>,
    /// Limit points passed.
    pub limit_points: Option<u32>,
}

impl ImplicitBodies {
    /// Returns the bodies of an assembly, starting at rest; its shells are of its first body.
    pub(crate) fn alone(model: Arc<Assembly>) -> Self {
        let cells = match model.facets.len() as u32 {
            0 => BodyCells::Solids,
            facets => BodyCells::Facets(0..facets),
        };
        let start = AssemblyState::at_rest(&model);
        Self { model, cells: vec![cells], start, control: None, surface: None }
    }

    /// Number of triangles of a shell, and their volume at rest [m³]; `None` for a solid.
    pub fn size(&self, body: usize) -> Option<(usize, f64)> {
        let BodyCells::Facets(range) = self.cells.get(body)? else { return None };
        let facets = &self.model.facets[range.start as usize..range.end as usize];
        Some((range.len(), facets.iter().map(|facet| facet.area * facet.thickness).sum()))
    }

    /// The mass of a shell [kg]; `None` of another body.
    pub fn mass(&self, body: usize) -> Option<f64> {
        let BodyCells::Facets(range) = self.cells.get(body)? else { return None };
        let facets = &self.model.facets[range.start as usize..range.end as usize];
        Some(3.0 * facets.iter().map(|facet| facet.mass).sum::<f64>())
    }

    /// Each part of the model in words, with its [`fingerprint`].
    pub fn fingerprints(&self) -> Vec<(String, u64)> {
        let model = &self.model;
        let turns: Vec<_> = model.turns.iter().map(|turn| (turn.node, &turn.gradient)).collect();
        vec![
            ("the mesh, thickness or material of shells".into(), fingerprint(&model.facets)),
            ("springs".into(), fingerprint(&model.springs)),
            ("limits of forces".into(), fingerprint(&model.force_limits)),
            ("the control of a load".into(), fingerprint(&self.control)),
            ("creases".into(), fingerprint(&(&model.normals, &model.corner_normals))),
            (
                "barriers of contacts".into(),
                fingerprint(&model.contact.as_ref().map(|contact| &contact.settings)),
            ),
            ("rotations that follow solids".into(), fingerprint(&turns)),
            ("damping by stiffness".into(), fingerprint(&model.stiffness_damping)),
        ]
    }

    /// True if only membranes hold a node.
    pub(crate) fn is_slack(&self, node: u32) -> bool {
        let mut facets = self.model.facets.iter().filter(|facet| facet.nodes.contains(&node)).peekable();
        facets.peek().is_some() && facets.all(|facet| !facet.bends())
    }

    /// The facet or the cell of a solid that an error names: its body and its number in the body's mesh.
    pub(crate) fn cell(&self, number: usize) -> Option<(usize, u32)> {
        let facets = self.model.facets.len();
        if number < facets {
            let facet = number as u32;
            return self.cells.iter().enumerate().find_map(|(body, cells)| match cells {
                BodyCells::Facets(range) if range.contains(&facet) => Some((body, facet - range.start)),
                _ => None,
            });
        }
        let mut left = number - facets;
        for solid in &self.model.solids {
            if let Some(&original) = solid.original.get(left) {
                return Some((solid.body, original));
            }
            left -= solid.original.len();
        }
        None
    }
}
