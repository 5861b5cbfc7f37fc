//! The run of a simulation in Python, its displayed data, and its displacements if the stepper keeps none.

use std::sync::Arc;

use pliant_format::tables::{At, FieldName, VtuTable};
use pliant_geometry::{Mesh, SurfaceLocator, Vector3, patch};
use pliant_mechanics::grip::Grip;
use pliant_run::{FieldReader, Live, field_named};
use pliant_scene::World;
use pliant_sim::{Reals, Simulation};

use crate::errors::Trouble;

/// A run under way.
pub struct Running {
    pub live: Live,
    pub world: Arc<World>,
    /// Displacements [m] in the binding's own memory, of solvers that keep none; filled after each call.
    copied: Option<Vec<[f64; 3]>>,
    /// Address of the displacements, fixed as long as the run lives.
    address: usize,
    shown: VtuTable,
    /// Readers of the fields that were asked for.
    readers: Vec<((FieldName, String, At), FieldReader)>,
    /// Hands on it.
    pub grips: Vec<Grip>,
}

impl Running {
    pub fn new(live: Live, world: Arc<World>) -> Self {
        let shown = world.scene.shown(1.0);
        let mut running =
            Self { live, world, copied: None, address: 0, shown, readers: Vec::new(), grips: Vec::new() };
        if running.stepper_s_own().is_none() {
            running.copied = Some(vec![[0.0; 3]; running.nodes()]);
        }
        running.refresh();
        running.address = running.displacement().address();
        running
    }

    pub fn nodes(&self) -> usize {
        self.world.participants.iter().map(|part| part.built.model.node_count()).sum()
    }

    /// Displacements of the only participant, where its stepper keeps them.
    fn stepper_s_own(&self) -> Option<Reals<'_>> {
        let mut instants = self.live.simulation.instants();
        let first = instants.next()?;
        if instants.next().is_some() { None } else { first.displacements() }
    }

    /// Displacements [m] of all nodes.
    pub fn displacement(&self) -> Reals<'_> {
        match &self.copied {
            Some(copied) => Reals::Double(copied),
            None => self.stepper_s_own().unwrap_or(Reals::Double(&[])),
        }
    }

    /// Fills the binding's own displacements, if the stepper keeps none.
    pub fn refresh(&mut self) {
        let Some(copied) = &mut self.copied else { return };
        let parts = self.world.participants.iter().zip(self.live.simulation.instants());
        let displacements = parts.flat_map(|(part, now)| {
            (0..part.built.model.node_count()).map(move |node| now.displacement(node))
        });
        copied.iter_mut().zip(displacements).for_each(|(target, now)| *target = now);
    }

    /// True if displacements lie where views look for them.
    pub fn is_in_place(&self) -> bool {
        self.displacement().address() == self.address
    }

    /// Finds forces, and with them all that can be asked, at the instant.
    pub fn evaluate(&mut self) -> Result<(), Trouble> {
        self.live.simulation.frame()?;
        Ok(())
    }

    /// A vector of each node.
    pub fn nodal(
        &self,
        of: impl Fn(&dyn pliant_sim::Instant, &pliant_mechanics::Model, usize) -> [f64; 3],
    ) -> Vec<f64> {
        let mut values = Vec::with_capacity(3 * self.nodes());
        for (part, now) in self.world.participants.iter().zip(self.live.simulation.instants()) {
            let model = &part.built.model;
            (0..model.node_count()).for_each(|node| values.extend(of(now, model, node)));
        }
        values
    }

    /// Positions [m] of all nodes.
    pub fn positions(&self) -> Vec<f64> {
        self.nodal(|now, model, node| {
            let (rest, moved) = (model.rest[node], now.displacement(node));
            [0, 1, 2].map(|c| rest[c] + moved[c])
        })
    }

    /// A mesh of a body, of a surface or of all, at rest, with fields.
    pub fn mesh(&mut self, fields: &[FieldName], on: Option<&str>, at: At) -> Result<&Mesh, Trouble> {
        let has = |shown: &VtuTable| {
            shown.on.as_deref() == on
                && shown.at == at
                && shown.curved.is_none()
                && fields.iter().all(|field| shown.data.contains(field))
        };
        if !has(&self.shown) {
            if let Some(name) = on
                && !self.world.participants.iter().any(|part| part.shows(Some(name)))
            {
                let known: Vec<&str> =
                    self.world.scene.bodies.iter().map(|(name, _)| name.as_str()).collect();
                let message = format!("there is no body or surface `{name}`; bodies: {}", known.join(", "));
                return Err(Trouble::Value(message));
            }
            let data = fields.to_vec();
            self.show(VtuTable { on: on.map(str::to_owned), every: 1.0, data, at, curved: None });
        }
        Ok(self.live.mesh()?)
    }

    /// Shows another series.
    pub fn show(&mut self, shown: VtuTable) {
        if self.shown.on != shown.on
            || self.shown.at != shown.at
            || self.shown.curved != shown.curved
            || self.shown.data != shown.data
        {
            self.live.show(&shown);
            self.shown = shown;
        }
    }

    /// A field of a body or a surface: numbers, and how many each point or cell has; where it is, if no place
    /// is given.
    pub fn field(&mut self, name: &str, on: &str, at: Option<At>) -> Result<(Vec<f64>, usize), Trouble> {
        let field = field_named(name)?;
        let at = at.unwrap_or(if field.is_nodal() { At::Points } else { At::Cells });
        let has = self.world.scene.fields_on(Some(on));
        if !has.contains(&field) {
            let has: Vec<&str> = has.iter().map(|field| field.name()).collect();
            return Err(Trouble::Value(format!("`{on}` has no field `{name}`; it has {}", has.join(", "))));
        }
        let known =
            self.readers.iter().position(|(key, _)| (key.0, key.1.as_str(), key.2) == (field, on, at));
        let known = match known {
            Some(known) => known,
            None => {
                let reader = FieldReader::new(&self.world, Some(on), name, at)?;
                self.readers.push(((field, on.to_owned(), at), reader));
                self.readers.len() - 1
            }
        };
        self.evaluate()?;
        let reader = &mut self.readers[known].1;
        reader.fill(&self.world, &self.live.simulation);
        Ok((reader.values()?.into_owned(), reader.components()))
    }

    /// The surface around the point of bodies that is nearest to a place [m]: nodes, counted over all, with
    /// weights that sum to 1.
    pub fn around(
        &self,
        at: [f64; 3],
        on: Option<&str>,
        radius: Option<f64>,
    ) -> Result<Vec<(u32, f64)>, Trouble> {
        if let Some(radius) = radius.filter(|radius| radius.is_nan() || *radius < 0.0) {
            return Err(Trouble::Value(format!("`radius` is {radius} m: it must be at least 0")));
        }
        let at = Vector3::from(at);
        let mut nearest: Option<(f64, Vec<(u32, f64)>)> = None;
        for (index, (part, now)) in
            self.world.participants.iter().zip(self.live.simulation.instants()).enumerate()
        {
            let bodies = part.built.model.bodies.iter().zip(&part.built.bodies);
            for (body, built) in bodies.filter(|(body, _)| on.is_none_or(|on| on == body.name)) {
                let node = |number: u32| body.node(number);
                let place = |(number, rest): (u32, &Vector3)| {
                    rest + Vector3::from(now.displacement(node(number) as usize))
                };
                let places: Vec<Vector3> = (0..).zip(&built.mesh.points).map(place).collect();
                let faces: Vec<u32> = (0..built.boundary.faces.len() as u32).collect();
                let Some(found) = SurfaceLocator::new(&built.boundary, &faces, &places).closest(&at) else {
                    continue;
                };
                let distance = (found.position - at).norm();
                if nearest.as_ref().is_some_and(|(known, _)| *known <= distance) {
                    continue;
                }
                let triangles = built.boundary.triangles();
                let corners = patch(&built.mesh.points, &triangles, found.nodes, found.weights, radius);
                let nodes = corners
                    .into_iter()
                    .map(|(number, weight)| (self.live.simulation.node(index, node(number)), weight));
                nearest = Some((distance, nodes.collect()));
            }
        }
        nearest.map(|(_, nodes)| nodes).ok_or_else(|| {
            Trouble::Value(match on {
                Some(on) => format!("there is no body `{on}` with a surface"),
                None => "no body has a surface".into(),
            })
        })
    }

    /// Takes hold of all that is gripped.
    pub fn grip(&mut self) -> Result<(), Trouble> {
        if self.live.simulation.grip(&self.grips) {
            return Ok(());
        }
        self.grips.clear();
        Err(Trouble::Value(
            "the solver of this body does not support grips, or a grip holds nodes of several participants"
                .into(),
        ))
    }

    pub fn simulation(&self) -> &Simulation {
        &self.live.simulation
    }

    /// After another world has taken over: the series that is shown belongs to the one before.
    pub fn show_again(&mut self) {
        self.shown = self.world.scene.shown(1.0);
        self.readers.clear();
    }
}
