//! Splits a scene into its participants: each becomes a scene of its own, with the tables about its bodies.

use std::collections::BTreeMap;

use crate::diagnostic::{Diagnostic, SceneErrors};
use crate::nearest::{SCENE, suggestion};
use crate::registry::{ConstraintTable, LawTable, OutputTable};
use crate::scene::Scene;
use crate::tables::{
    BodyModel, BodyTable, ColourBy, ContactTable, DeviceName, FieldName, ParticipantTable, RunTable,
    SolverName, TieTable, ViewTable,
};

impl ConstraintTable {
    /// The body whose nodes the table concerns.
    pub fn body(&self) -> &str {
        match self {
            Self::Fix(table) => &table.body,
            Self::Move(table) => &table.body,
            Self::Spring(table) => &table.body,
            Self::Mean(table) => &table.body,
            Self::Rigid(table) => &table.body,
            Self::Volume(table) => &table.body,
        }
    }
}

/// The participant of each name of a body, a surface or a constraint.
struct Owners {
    of: BTreeMap<String, usize>,
    constraints: BTreeMap<String, usize>,
}

/// Index of the group of a body.
fn group_of<'g>(groups: &'g [(String, Vec<String>)], body: &String) -> Option<&'g (String, Vec<String>)> {
    groups.iter().find(|(_, bodies)| bodies.contains(body))
}

/// The tables for which a condition holds.
fn those<T: Clone>(tables: &[(String, T)], holds: impl Fn(&String, &T) -> bool) -> Vec<(String, T)> {
    tables.iter().filter(|(name, table)| holds(name, table)).cloned().collect()
}

/// True if a body uses a law, in a layer or as a whole.
fn uses(bodies: &[(String, BodyTable)], law: &String) -> bool {
    let layered = |body: &BodyTable| body.layers.iter().any(|layer| layer.law.as_ref() == Some(law));
    bodies.iter().any(|(_, body)| body.law.values().contains(&law) || layered(body))
}

/// Tables of a scene that belong to one participant. A table that is wrong and belongs to no participant goes
/// to the first one, so that the mistake is reported once.
struct Part<'s> {
    scene: &'s Scene,
    index: usize,
    owners: &'s Owners,
    bodies: Vec<(String, BodyTable)>,
    models: Vec<BodyModel>,
    contacts: Vec<(String, ContactTable)>,
    /// Contacts with bodies of other participants.
    meets: Vec<(String, ContactTable)>,
}

impl<'s> Part<'s> {
    fn new(scene: &'s Scene, index: usize, owners: &'s Owners) -> Self {
        let owns = |on: &str| owners.of.get(on) == Some(&index);
        let is_known = |name: &String| owners.of.contains_key(name);
        let bodies = those(&scene.bodies, |body, _| owns(body));
        let apart = |ContactTable { between: [first, second], .. }: &ContactTable| {
            is_known(first) && is_known(second) && owns(first) != owns(second)
        };
        let is_own = |between: &[String; 2]| match between.iter().find(|name| is_known(name)) {
            Some(name) => owns(name),
            None => index == 0 || between.iter().any(|name| name == "all"),
        };
        Self {
            models: bodies.iter().map(|(_, body)| body.model).collect(),
            contacts: those(&scene.contacts, |_, table| !apart(table) && is_own(&table.between)),
            meets: those(&scene.contacts, |_, table| apart(table)),
            scene,
            index,
            owners,
            bodies,
        }
    }

    fn owns(&self, on: &str) -> bool {
        self.owners.of.get(on) == Some(&self.index)
    }

    fn touches_something(&self) -> bool {
        !(self.contacts.is_empty() && self.meets.is_empty())
    }

    /// True if this part writes a field: one of its bodies has the field. A field that no body of the scene
    /// has goes to the first part.
    fn shows(&self, field: FieldName) -> bool {
        let Scene { bodies, contacts, .. } = self.scene;
        let can_be = |touches: bool| touches || !field.is_of_contact();
        let has = can_be(self.touches_something()) && self.models.iter().any(|&model| field.is_of(model));
        let is_known = can_be(!contacts.is_empty()) && bodies.iter().any(|(_, body)| field.is_of(body.model));
        has || (self.index == 0 && !is_known)
    }

    /// The laws that its bodies use. A law that no body of the scene uses goes to the first part.
    fn laws(&self) -> Vec<(String, LawTable)> {
        let is_spare = |law: &String| self.index == 0 && !uses(&self.scene.bodies, law);
        those(&self.scene.laws, |law, _| uses(&self.bodies, law) || is_spare(law))
    }

    /// The outputs of its bodies and surfaces.
    fn outputs(&self) -> Vec<(String, OutputTable)> {
        let mut outputs = self.scene.outputs.clone();
        outputs.retain_mut(|(_, output)| match output {
            OutputTable::Vtu(table) => {
                if table.on.is_none() {
                    table.data.retain(|&field| self.shows(field));
                    let is_shell = |(_, body): &(String, BodyTable)| body.model == BodyModel::Shell;
                    if !self.bodies.iter().any(is_shell) && self.scene.bodies.iter().any(is_shell) {
                        table.curved = None;
                    }
                }
                table.on.as_deref().is_none_or(|on| self.owns(on))
            }
            OutputTable::Csv(table) => {
                let is_own =
                    |constraint: &String| self.owners.constraints.get(constraint) == Some(&self.index);
                table.reactions.iter_mut().for_each(|reactions| reactions.retain(is_own));
                table.probes.retain(|_, probe| self.owns(&probe.on));
                true
            }
        });
        outputs
    }

    /// The view, reduced to its bodies and fields.
    fn view(&self) -> ViewTable {
        let mut view = self.scene.view.clone();
        let seen = view.on.as_deref().is_none_or(|on| self.owns(on));
        let is_hidden = |colour: &ColourBy| matches!(colour, ColourBy::Field(field) if !self.shows(*field));
        if !seen {
            view = ViewTable { on: None, colour: None, ..view };
        } else if view.colour.as_ref().is_some_and(is_hidden) {
            view.colour = None;
        }
        view.contacts &=
            seen && (self.touches_something() || self.scene.contacts.is_empty() && self.index == 0);
        view
    }
}

impl Scene {
    /// Returns the participants with their names, or the scene itself if all bodies go together.
    ///
    /// # Errors
    /// If a participant names no body, a body that does not exist, or a body of another participant. If a
    /// table of a scene of several participants names a body or a surface that does not exist.
    pub fn split(&self) -> Result<Vec<(String, Self)>, SceneErrors> {
        let mut out = Vec::new();
        let groups = self.groups(&mut out);
        if !out.is_empty() {
            return Err(self.source.errors(out));
        }
        if groups.len() == 1 && self.participants.is_empty() {
            return Ok(vec![(String::new(), self.clone())]);
        }
        let owners = self.owners(&groups, &mut out);
        if !out.is_empty() {
            return Err(self.source.errors(out));
        }
        let part = |(index, (name, _)): (usize, &(String, Vec<String>))| {
            (name.clone(), self.part(index, name, &owners))
        };
        Ok(groups.iter().enumerate().map(part).collect())
    }

    /// The bodies of each participant, with its name.
    fn groups(&self, out: &mut Vec<Diagnostic>) -> Vec<(String, Vec<String>)> {
        let known: Vec<&str> = self.bodies.iter().map(|(name, _)| name.as_str()).collect();
        let mut groups: Vec<(String, Vec<String>)> = Vec::new();
        for (name, table) in &self.participants {
            let path = ["participant", name.as_str(), "bodies"];
            if table.bodies.is_empty() {
                let message = format!("participant `{name}` has no body");
                let help = "name one or more, or leave the participant out";
                out.push(Diagnostic::error(message).at(self.source.span(&path), "empty").help(help));
            }
            for (at, body) in table.bodies.iter().enumerate() {
                let index = at.to_string();
                let place = self.source.span(&[path[0], path[1], path[2], &index]);
                if !known.contains(&body.as_str()) {
                    let help = suggestion(body, &known, SCENE, "bodies");
                    let message = format!("there is no body `{body}`");
                    out.push(Diagnostic::error(message).at(place, "no such body").help(help));
                } else if table.bodies[..at].contains(body) {
                    let message = format!("`{body}` is named twice");
                    let help = "leave one of them out";
                    out.push(Diagnostic::error(message).at(place, "again").help(help));
                } else if let Some((other, _)) = group_of(&groups, body) {
                    let message = format!("`{body}` already belongs to participant `{other}`");
                    let help = "a body belongs to one participant: remove it from the others";
                    out.push(Diagnostic::error(message).at(place, "named twice").help(help));
                }
            }
            groups.push((name.clone(), table.bodies.clone()));
        }
        // Equations are solved for solids and shells together.
        let kinds = match self.run.solver.solves_equations() {
            true => vec![(
                "bodies",
                vec![BodyModel::Solid, BodyModel::Membrane, BodyModel::Bar, BodyModel::Shell],
            )],
            false => vec![
                ("solids", vec![BodyModel::Solid, BodyModel::Membrane, BodyModel::Bar]),
                ("shells", vec![BodyModel::Shell]),
            ],
        };
        for (word, kind) in kinds {
            let of_kind = self.bodies.iter().filter(|(_, body)| kind.contains(&body.model));
            let free = of_kind.filter(|(name, _)| !groups.iter().any(|(_, bodies)| bodies.contains(name)));
            let bodies: Vec<String> = free.map(|(name, _)| name.clone()).collect();
            if bodies.is_empty() {
                continue;
            }
            if self.participants.iter().any(|(name, _)| name == word) {
                let place = self.source.key_span(&["participant", word]);
                let message = format!(
                    "`{}` belongs to no participant, and the default name for such bodies, `{word}`, is taken",
                    bodies[0]
                );
                let help = "add the body to this participant, or rename the participant";
                out.push(Diagnostic::error(message).at(place, "taken").help(help));
            }
            groups.push((word.into(), bodies));
        }
        self.check_walls(&groups, out);
        self.check_ties(&known, out);
        groups
    }

    /// Reports ties of bodies that do not exist.
    fn check_ties(&self, known: &[&str], out: &mut Vec<Diagnostic>) {
        for (name, table) in &self.ties {
            for (index, body) in table.between.iter().enumerate() {
                if !known.contains(&body.as_str()) {
                    let place = self.source.span(&["tie", name, "between", &index.to_string()]);
                    let help = suggestion(body, known, SCENE, "bodies");
                    let message = format!("there is no body `{body}`");
                    out.push(Diagnostic::error(message).at(place, "no such body").help(help));
                }
            }
        }
    }

    /// Reports walls on bodies of other participants: their common nodes have one solver.
    fn check_walls(&self, groups: &[(String, Vec<String>)], out: &mut Vec<Diagnostic>) {
        for (name, table) in &self.bodies {
            let Some(host) = &table.on else { continue };
            let (Some((wall_group, _)), Some((other, _))) = (group_of(groups, name), group_of(groups, host))
            else {
                continue;
            };
            if wall_group == other {
                continue;
            }
            let named = |group| self.participants.iter().any(|(known, _)| known == group);
            let (message, label, help) = match table.model == BodyModel::Shell
                && !(named(wall_group) && named(other))
            {
                true => (
                    format!(
                        "`{name}` is a shell on `{host}`, but the solver `{}` steps shells separately from solids",
                        self.run.solver.word()
                    ),
                    "bending needs another solver",
                    "remove `model` for a membrane without bending, or set `solver = \"implicit\"` or `\"static\"`",
                ),
                false => (
                    format!(
                        "`{name}` shares the nodes of `{host}`, but belongs to participant `{wall_group}`, and `{host}` to `{other}`"
                    ),
                    "different participants",
                    "name both in one participant",
                ),
            };
            let place = self.source.span(&["body", name, "on"]);
            out.push(Diagnostic::error(message).at(place, label).help(help));
        }
    }

    fn owners(&self, groups: &[(String, Vec<String>)], out: &mut Vec<Diagnostic>) -> Owners {
        let mut of = BTreeMap::new();
        for (index, (_, bodies)) in groups.iter().enumerate() {
            of.extend(bodies.iter().map(|body| (body.clone(), index)));
        }
        for (name, surface) in &self.surfaces {
            match of.get(&surface.on).copied() {
                Some(index) => {
                    of.insert(name.clone(), index);
                }
                None => self.unknown(&surface.on, &["surface", name, "on"], &of, out),
            }
        }
        let mut constraints = BTreeMap::new();
        for (name, table) in &self.constraints {
            match of.get(table.body()) {
                Some(&index) => {
                    constraints.insert(name.clone(), index);
                }
                None => self.unknown(table.body(), &["constraint", name, "body"], &of, out),
            }
        }
        for (name, load) in &self.loads {
            if let Some(on) = load.on().filter(|on| !of.contains_key(*on)) {
                self.unknown(on, &["load", name, "on"], &of, out);
            }
        }
        for (name, output) in &self.outputs {
            match output {
                OutputTable::Vtu(table) => {
                    if let Some(on) = table.on.as_ref().filter(|on| !of.contains_key(*on)) {
                        self.unknown(on, &["output", name, "on"], &of, out);
                    }
                }
                OutputTable::Csv(table) => {
                    for (probe, place) in table.probes.iter().filter(|(_, place)| !of.contains_key(&place.on))
                    {
                        self.unknown(&place.on, &["output", name, "probes", probe, "on"], &of, out);
                    }
                    for (index, reaction) in table.reactions.iter().flatten().enumerate() {
                        if !constraints.contains_key(reaction) {
                            let known: Vec<&str> = constraints.keys().map(String::as_str).collect();
                            let index = index.to_string();
                            let place = self.source.span(&["output", name, "reactions", &index]);
                            let message = format!("there is no constraint `{reaction}`");
                            let help = suggestion(reaction, &known, SCENE, "constraints");
                            out.push(Diagnostic::error(message).at(place, "no such constraint").help(help));
                        }
                    }
                }
            }
        }
        if let Some(on) = self.view.on.as_ref().filter(|on| !of.contains_key(*on)) {
            self.unknown(on, &["view", "on"], &of, out);
        }
        Owners { of, constraints }
    }

    fn unknown(&self, name: &str, path: &[&str], of: &BTreeMap<String, usize>, out: &mut Vec<Diagnostic>) {
        let known: Vec<&str> = of.keys().map(String::as_str).collect();
        let message = format!("there is no body or surface `{name}`");
        let help = suggestion(name, &known, SCENE, "bodies and surfaces");
        let place = self.source.span(path);
        out.push(Diagnostic::error(message).at(place, "no such body or surface").help(help));
    }

    /// The scene of one participant.
    fn part(&self, index: usize, name: &str, owners: &Owners) -> Self {
        let part = Part::new(self, index, owners);
        let table = self.participants.iter().find(|(known, _)| known == name);
        let owns = |on: &str| part.owns(on);
        let is_whole = |tie: &TieTable| tie.between.iter().all(|on| owns(on));
        Self {
            run: self.run_of(table.map(|(_, table)| table), &part.models),
            participant: table.map(|(name, _)| name.clone()),
            is_part: true,
            participants: Vec::new(),
            laws: part.laws(),
            ties: those(&self.ties, |_, tie| is_whole(tie)),
            tied_outside: (self.ties.iter().filter(|(_, tie)| !is_whole(tie)))
                .flat_map(|(_, tie)| tie.between.clone())
                .collect(),
            surfaces: those(&self.surfaces, |_, surface| owns(&surface.on)),
            constraints: those(&self.constraints, |_, table| owns(table.body())),
            obstacles: self.obstacles.clone(),
            tools: self.tools.clone(),
            loads: those(&self.loads, |_, load| load.on().is_none_or(owns)),
            outputs: part.outputs(),
            view: part.view(),
            doubts: if index == 0 { self.doubts.clone() } else { Vec::new() },
            source: self.source.clone(),
            folder: self.folder.clone(),
            scene: self.scene.clone(),
            bodies: part.bodies,
            contacts: part.contacts,
            meets: part.meets,
        }
    }

    /// The run of a participant: its own keys, and the keys of `[run]` that apply to its bodies and its
    /// solver.
    fn run_of(&self, table: Option<&ParticipantTable>, models: &[BodyModel]) -> RunTable {
        let solver = table.and_then(|table| table.solver).unwrap_or(self.run.solver);
        let total_lagrangian = !models.contains(&BodyModel::Shell) && !solver.solves_equations();
        let mut run = self.run.clone();
        let usual = || RunTable::default();
        if solver != run.solver {
            run = RunTable { step: usual().step, load_steps: usual().load_steps, tolerance: None, ..run };
        }
        if !total_lagrangian || solver != SolverName::Explicit {
            (run.on_unstable, run.mass_scaling) = (None, None);
        }
        if !total_lagrangian {
            (run.precision, run.device, run.adapter) = (None, DeviceName::Cpu, None);
            run.design = None;
        }
        if !solver.solves_equations() {
            run = RunTable {
                iterations: None,
                speed_tolerance: None,
                accept_unconverged: None,
                integrator: None,
                control: None,
                linear: usual().linear,
                ..run
            };
        }
        match table {
            Some(table) => table.over(&run),
            None => run,
        }
    }

    /// True if the run of this scene, or of this participant, has a key of its own.
    pub fn gives(&self, key: &str) -> bool {
        match &self.participant {
            Some(participant) => self.source.node(&["participant", participant, key]).is_some(),
            None => !self.is_part && self.source.node(&["run", key]).is_some(),
        }
    }

    /// Path of a key of the run: in the table of the participant if it is given there, else in `[run]`.
    pub fn run_at<'k>(&'k self, key: &'k str) -> Vec<&'k str> {
        if let Some(participant) = &self.participant {
            let path = vec!["participant", participant.as_str(), key];
            if self.source.node(&path).is_some() {
                return path;
            }
        }
        vec!["run", key]
    }

    /// True if its bodies use the implicit solvers' model: shells, and solids whose equations are solved.
    pub fn is_implicit(&self) -> bool {
        self.run.solver.solves_equations()
            || self.bodies.iter().any(|(_, body)| body.model == BodyModel::Shell)
    }

    /// True if one of its bodies or surfaces has this name.
    pub fn has(&self, name: &str) -> bool {
        self.bodies.iter().any(|(known, _)| known == name)
            || self.surfaces.iter().any(|(known, _)| known == name)
    }
}
