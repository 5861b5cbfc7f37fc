//! A scene with its participants, built and planned: all that a run needs, and nothing that changes while it
//! runs.

use std::sync::Arc;

#[cfg(feature = "gpu")]
use pliant_sim::gpu::Device;
use pliant_sim::{CoupledSurface, Failure, PenaltyTie, Simulation};

use crate::assemble::{Built, Meshing, build_watched};
use crate::cache::MeshCache;
use crate::method::method;
use crate::plan::{Plan, plan, steps};
use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::tables::FieldName;

/// A scene with its participants.
#[derive(Clone, Debug)]
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// Bodies that one stepper advances together. One of them where all bodies go together.
    pub participants: Vec<PlannedParticipant>,
    /// Ties between them.
    pub ties: Vec<PenaltyTie>,
    /// Nodes of participants that others touch.
    pub coupled_surfaces: Vec<CoupledSurface>,
}

/// A participant: some bodies of a scene, with their model and how it is stepped.
#[derive(Clone, Debug)]
pub struct PlannedParticipant {
    /// Its name; empty where all bodies go together.
    pub name: String,
    /// The tables of the scene that are about it.
    pub scene: Scene,
    /// Its model.
    pub built: Arc<Built>,
    /// Its steps: a whole number of them between the common instants of all participants.
    pub plan: Plan,
}

impl World {
    /// Builds a scene and chooses its steps; meshes of images are made anew.
    ///
    /// # Errors
    /// All mistakes that were found, with their places.
    pub fn new(scene: &Scene) -> Result<Self, SceneErrors> {
        Self::assemble(scene, &MeshCache::off(), &|_| {})
    }

    /// Builds a scene, with the meshes of images that are kept, and chooses its steps. `watch` hears how far
    /// meshes are.
    ///
    /// # Errors
    /// All mistakes that were found, with their places.
    pub fn assemble(
        scene: &Scene,
        cache: &MeshCache,
        watch: &dyn Fn(Meshing<'_>),
    ) -> Result<Self, SceneErrors> {
        let mut mistakes = Vec::new();
        let mut built = Vec::new();
        for (name, part) in scene.split()? {
            match build_watched(&part, cache, watch) {
                Ok(assembled) => built.push((name, part, assembled)),
                Err(errors) => mistakes.extend_from_slice(errors.diagnostics()),
            }
        }
        if !mistakes.is_empty() {
            return Err(scene.source.errors(mistakes));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(scene.run.threads as usize).build();
        let planned = |(name, part, built): (String, Scene, Built)| {
            let plan = match &pool {
                Ok(pool) => pool.install(|| plan(&part, &built)),
                Err(_) => plan(&part, &built),
            };
            Ok(PlannedParticipant { name, plan: plan?, scene: part, built: Arc::new(built) })
        };
        let participants = built.into_iter().map(planned).collect::<Result<Vec<_>, SceneErrors>>()?;
        let mut world =
            Self { scene: scene.clone(), participants, ties: Vec::new(), coupled_surfaces: Vec::new() };
        if world.only().is_none() {
            world.check_load_steps()?;
        }
        let mut found = Vec::new();
        world.find_ties(&mut found);
        world.find_coupled_surfaces(&mut found);
        world.meet();
        world.check_ties(&mut found);
        world.check_coupled_surfaces(&mut found);
        world.check_view(&mut found);
        world.check_rigid_things(&mut found);
        if found.iter().any(Diagnostic::is_error) {
            return Err(scene.source.errors(found));
        }
        found.into_iter().for_each(|doubt| world.doubt(doubt));
        Ok(world)
    }

    /// Warns of obstacles and tools that no contact names.
    fn check_rigid_things(&self, found: &mut Vec<Diagnostic>) {
        let scene = &self.scene;
        let is_named = |thing: &str| {
            let mut names = scene.contacts.iter().flat_map(|(_, table)| &table.between);
            names.any(|name| name == "all" || name.split('.').next() == Some(thing))
        };
        for (kind, tables) in [("obstacle", &scene.obstacles), ("tool", &scene.tools)] {
            for (name, _) in tables.iter().filter(|(name, _)| !is_named(name)) {
                let message = format!("{kind} `{name}` is in no contact, so bodies pass through it");
                let help = format!("name `{name}` in `between` of a `[contact.NAME]`");
                let place = scene.source.span(&[kind, name]);
                found.push(Diagnostic::warning(message).at(place, "touches nothing").help(help));
            }
        }
    }

    /// Refuses unequal load steps in a scene with several participants.
    fn check_load_steps(&self) -> Result<(), SceneErrors> {
        let Some(part) = self.participants.iter().find(|part| part.plan.steps.ends.is_some()) else {
            return Ok(());
        };
        let place = self.scene.source.span(&part.scene.run_at("load-steps"));
        let message = "participants need equal load steps, and these load steps are unequal";
        let help = "give a number of load steps, or run the bodies in scenes of their own";
        let diagnostic = Diagnostic::error(message).at(place, "unequal").help(help);
        Err(self.scene.source.errors(vec![diagnostic]))
    }

    /// Makes the world of a scene with one participant.
    pub fn of(scene: &Scene, built: &Arc<Built>, plan: &Plan) -> Self {
        let part = PlannedParticipant {
            name: String::new(),
            scene: scene.clone(),
            built: Arc::clone(built),
            plan: plan.clone(),
        };
        Self {
            scene: scene.clone(),
            participants: vec![part],
            ties: Vec::new(),
            coupled_surfaces: Vec::new(),
        }
    }

    /// Returns this world with another duration [s].
    pub fn lasting(&self, until: f64) -> Self {
        let mut world = self.clone();
        world.scene.scene.until = until;
        for part in &mut world.participants {
            part.plan.steps = steps(part.plan.limits.as_ref(), &part.scene, &part.built, until);
        }
        world.meet();
        world
    }

    /// Makes the steps of each participant a multiple of the steps of the participant with the fewest.
    fn meet(&mut self) {
        self.shorten_tied();
        let (until, common) = (self.scene.scene.until, self.steps());
        self.participants.iter_mut().for_each(|part| part.plan.steps.meet(common, until));
    }

    /// The participant where all bodies go together.
    pub fn only(&self) -> Option<&PlannedParticipant> {
        match &self.participants[..] {
            [part] => Some(part),
            _ => None,
        }
    }

    /// The participant that has the least steps, and so the common instants of all.
    pub fn slowest(&self) -> &PlannedParticipant {
        let steps = |part: &&PlannedParticipant| part.plan.steps.number;
        // A world has a participant: a scene without bodies is refused when it is read.
        self.participants.iter().min_by_key(steps).unwrap_or(&self.participants[0])
    }

    /// Common instants after the start.
    pub fn steps(&self) -> u64 {
        self.slowest().plan.steps.number
    }

    /// The time [s] from one common instant to the next, at a time.
    pub fn step_from(&self, time: f64) -> f64 {
        self.slowest().plan.steps.step_from(time)
    }

    /// The time [s] from one common instant to the next; of unequal ones the mean.
    pub fn step(&self) -> f64 {
        self.slowest().plan.steps.step
    }

    /// Makes a simulation of this world, at its start.
    ///
    /// # Errors
    /// If a stepper can't be made.
    pub fn simulation(&self) -> Result<Simulation, Failure> {
        Simulation::new(self.simulated())
    }

    /// Its participants without their tables.
    pub fn simulated(&self) -> pliant_sim::Setup {
        let parts = self.participants.iter().map(PlannedParticipant::simulated).collect();
        pliant_sim::Setup { parts, ties: self.ties.clone(), coupled_surfaces: self.coupled_surfaces.clone() }
    }

    /// Adds a doubt to those that did not keep the models from being built.
    pub fn doubt(&mut self, warning: Diagnostic) {
        Arc::make_mut(&mut self.participants[0].built).warnings.push(warning);
    }

    /// Adds a remark to those on how the models were built.
    pub(crate) fn note(&mut self, note: String) {
        Arc::make_mut(&mut self.participants[0].built).notes.push(note);
    }

    /// Remarks on how the scene was built and is stepped.
    pub fn notes(&self) -> impl Iterator<Item = &String> {
        let of = |part| {
            let PlannedParticipant { built, plan, .. }: &PlannedParticipant = part;
            built.notes.iter().chain(&plan.note).chain(&plan.target.note)
        };
        self.participants.iter().flat_map(of)
    }

    /// Doubts that did not keep the models from being built.
    pub fn warnings(&self) -> impl Iterator<Item = &Diagnostic> {
        self.participants.iter().flat_map(|part| &part.built.warnings)
    }
}

#[cfg(feature = "gpu")]
impl World {
    /// The GPU of the scene, where all bodies move together on one and stay there. A GPU that solves the
    /// equations of implicit steps moves none, and explicit shells are read back whenever somebody looks.
    pub fn device(&self) -> Option<&Device> {
        let part = self.only().filter(|part| part.built.implicit.is_none())?;
        part.plan.target.device.as_ref()
    }

    /// Uses an open device, if it is the one that the participant asks for.
    pub fn share(&mut self, open: Option<&Device>) {
        for part in &mut self.participants {
            if let (Some(open), Some(asked)) = (open, &mut part.plan.target.device)
                && open.adapter() == asked.adapter()
                && open.check().is_ok()
            {
                *asked = open.clone();
            }
        }
    }
}

impl PlannedParticipant {
    /// Returns the participant without its tables.
    fn simulated(&self) -> pliant_sim::ParticipantSetup {
        let Self { name, scene, built, plan } = self;
        pliant_sim::ParticipantSetup {
            name: name.clone(),
            model: Arc::clone(&built.model),
            method: method(built, &scene.run, plan),
            steps: plan.steps.clone(),
        }
    }

    /// True if the participant has the body or the surface of a name, or if no name is given.
    pub fn shows(&self, on: Option<&str>) -> bool {
        on.is_none_or(|on| self.scene.has(on))
    }

    /// The fields of some that its bodies have.
    pub fn fields(&self, fields: &[FieldName]) -> Vec<FieldName> {
        let has = |field: &FieldName| {
            let is_of_bodies = self.scene.bodies.iter().any(|(_, body)| field.is_of(body.model));
            is_of_bodies && (self.built.contacts.is_some() || !field.is_of_contact())
        };
        fields.iter().copied().filter(has).collect()
    }

    /// Name of the participant in messages and columns.
    pub fn prefix(&self) -> Option<&str> {
        (!self.name.is_empty()).then_some(self.name.as_str())
    }
}
