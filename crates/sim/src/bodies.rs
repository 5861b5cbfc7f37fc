//! Shells, and solids whose equations are solved, beside the model of all solvers.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use pliant_implicit::{Carried, CurvedSurface, Model, Motion, State};
use pliant_mechanics::{fingerprint, model};

/// Bodies of the implicit solvers. They share the nodes of [`Part::model`](crate::Part::model), which keeps names, and fields of solids.
#[derive(Clone, Debug)]
pub struct ImplicitBodies {
    /// Their model.
    pub model: Arc<Model>,
    /// The cells of each body, in the order of the bodies.
    pub cells: Vec<BodyCells>,
    /// What a static run prescribes instead of the size of a load.
    pub control: Option<Control>,
    /// The state that a run starts from.
    pub start: State,
    /// The curved surface of the shells, if something is carried by it.
    pub surface: Option<CurvedSurface>,
    /// The points of each surface of the model that a shell carries.
    pub carried: BTreeMap<usize, Vec<Carried>>,
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
pub enum Control {
    /// A component (0 to 2) of a node moves by a distance [m] in all.
    Displacement {
        /// The node.
        node: u32,
        /// x, y or z as 0, 1, 2.
        component: usize,
        /// The distance [m].
        by: f64,
    },
    /// All translations together move by a length [m] in each load step.
    ArcLength {
        /// The length [m].
        length: f64,
        /// Where the path ends.
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

/// Where a path by arc length ends: at the first state that meets one of these.
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
    /// No bodies on no nodes.
    pub fn none() -> Self {
        let model = Model::default();
        Self {
            start: State::at_rest(&model),
            model: Arc::new(model),
            cells: Vec::new(),
            control: None,
            surface: None,
            carried: BTreeMap::new(),
        }
    }

    /// Their model, to be added to before it is simulated.
    pub fn model_mut(&mut self) -> &mut Model {
        Arc::make_mut(&mut self.model)
    }

    /// One body of all that a model holds, starting at rest; and the model of its nodes, with the names of its constraints.
    pub(crate) fn alone(name: &str, model: Arc<Model>) -> (model::Model, Self) {
        let mut nodes = model::Model::default();
        let rest: Vec<[f64; 3]> = model.rest.iter().map(|&place| place.into()).collect();
        nodes.add_body(name, &rest);
        nodes.mass.clone_from(&model.mass);
        nodes.solids.clone_from(&model.solids);
        nodes.constraints.extend(model.constraints.iter().map(|constraint| {
            let [x, y, z, ..] = constraint.components;
            let motion = match &constraint.motion {
                Motion::Fixed => model::Motion::Fixed,
                Motion::Moved { by: [x, y, z, ..], curve } => {
                    model::Motion::Displacement([*x, *y, *z], curve.clone())
                }
                Motion::Displaced(motion) => motion.clone(),
            };
            let (name, nodes) = (constraint.name.clone(), constraint.nodes.clone());
            model::Constraint { name, nodes, components: [x, y, z], motion }
        }));
        let cells = match model.facets.len() as u32 {
            0 => BodyCells::Solids,
            facets => BodyCells::Facets(0..facets),
        };
        let start = State::at_rest(&model);
        (nodes, Self { model, cells: vec![cells], start, ..Self::none() })
    }

    /// How many triangles a shell has, and their volume at rest [m³]; `None` of a solid.
    pub fn size(&self, body: usize) -> Option<(usize, f64)> {
        let BodyCells::Facets(range) = self.cells.get(body)? else { return None };
        let facets = &self.model.facets[range.start as usize..range.end as usize];
        Some((range.len(), facets.iter().map(|facet| facet.area * facet.thickness).sum()))
    }

    /// Each part of the model in words, with its [`fingerprint`].
    pub fn fingerprints(&self) -> Vec<(String, u64)> {
        let model = &self.model;
        vec![
            ("the mesh, thickness or material of shells".into(), fingerprint(&model.facets)),
            ("constraints".into(), fingerprint(&(&model.constraints, &model.springs))),
            ("loads or their control".into(), fingerprint(&(&model.loads, &self.control))),
            ("creases".into(), fingerprint(&(&model.normals, &model.corner_normals))),
            ("damping".into(), fingerprint(&[model.mass_damping, model.stiffness_damping])),
        ]
    }

    /// Whether only membranes hold a node.
    pub(crate) fn is_slack(&self, node: u32) -> bool {
        let mut facets = self.model.facets.iter().filter(|facet| facet.nodes.contains(&node)).peekable();
        facets.peek().is_some() && facets.all(|facet| !facet.bends())
    }

    /// The facet or the cell of a solid that an error names: its body and its number in the body's mesh.
    pub(crate) fn cell(&self, number: usize) -> Option<(usize, u32)> {
        let facets = self.model.facets.len();
        if number < facets {
            let own = number as u32;
            return self.cells.iter().enumerate().find_map(|(body, cells)| match cells {
                BodyCells::Facets(range) if range.contains(&own) => Some((body, own - range.start)),
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
