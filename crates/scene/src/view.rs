//! The part of a scene that its table `[view]` shows.

use std::collections::BTreeMap;

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::ViewTable;
use pliant_geometry::{CellLabel, Labels, Region, RegionNames};
use pliant_mechanics::load::{LoadKind, NO_NODE, face_areas};
use pliant_mechanics::tensor::{add, scale};

use crate::assemble::{Built, labels_of, touches};
use crate::world::World;

impl Built {
    /// The forces [N] of loads on each node at a time [s] and displacements [m], without weights. Pressures
    /// on shells give a third of their force to each corner of a facet.
    pub fn load_forces(&self, time: f64, displacement: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut forces = self.model.load_forces(time, displacement);
        let Some(implicit) = &self.implicit else { return forces };
        for load in &self.model.loads {
            let LoadKind::ShellPressure { facets, pressure, .. } = &load.kind else { continue };
            let place = |node: u32| add(self.model.rest[node as usize], displacement[node as usize]);
            let factor = pressure * load.curve.value(time);
            for &facet in facets {
                let [a, b, c] = implicit.model.facets[facet as usize].nodes;
                for (node, area) in face_areas(&[a, b, c, NO_NODE], place) {
                    forces[node as usize] = add(forces[node as usize], scale(area, factor));
                }
            }
        }
        forces
    }

    /// True if a body of a name, or any body, touches something.
    pub fn touches(&self, on: Option<&str>) -> bool {
        let Some(contacts) = &self.contacts else { return false };
        let mut bodies = self.model.bodies.iter();
        bodies.any(|body| on.is_none_or(|on| body.name == on) && touches(contacts, body))
    }

    /// The labels of a body or a surface by name, or of all bodies.
    pub fn labels(&self, on: Option<&str>) -> Labels {
        labels_of(&self.model, &self.bodies, &self.surfaces, on)
    }

    /// The obstacles and tools that its bodies can touch, in the order of their numbers.
    pub fn rigid_names(&self) -> impl Iterator<Item = &str> {
        self.contacts.iter().flat_map(|contacts| &contacts.rigids).map(|rigid| rigid.name.as_str())
    }
}

impl World {
    /// The labels of a body or a surface by name, or of all bodies.
    pub fn labels(&self, on: Option<&str>) -> Labels {
        let mut labels = Labels::default();
        self.participants
            .iter()
            .filter(|part| part.shows(on))
            .for_each(|part| labels.join(part.built.labels(on)));
        labels
    }

    /// Returns names by number in the view of a body by name, or of all bodies: the bodies, then obstacles
    /// and tools. For a surface returns the surface's name.
    pub fn body_names(&self, on: Option<&str>) -> BTreeMap<i32, String> {
        if let Some(surface) = on.filter(|on| self.scene.surfaces.iter().any(|(name, _)| name == on)) {
            return [(0, surface.to_owned())].into();
        }
        let shown = self.participants.iter().filter(|part| part.shows(on));
        let bodies = shown.flat_map(|part| part.built.bodies.iter().map(|body| body.name.as_str()));
        let things =
            self.participants.iter().filter(|_| on.is_none()).flat_map(|part| part.built.rigid_names());
        let named = (0..).zip(bodies.chain(things).map(str::to_owned));
        named.filter(|(_, name)| on.is_none_or(|on| on == name)).collect()
    }

    /// Labels and bodies of a body or a surface by name, or of all bodies, obstacles and tools.
    pub fn region_names(&self, on: Option<&str>) -> RegionNames {
        RegionNames { labels: self.labels(on), bodies: self.body_names(on) }
    }

    /// The regions that a view hides.
    pub fn hidden(&self, view: &ViewTable) -> Vec<Region> {
        if view.hide.is_empty() { Vec::new() } else { view.hidden(&self.region_names(view.on.as_deref())) }
    }

    /// True if a body of a name, or any body, touches something.
    pub fn touches(&self, on: Option<&str>) -> bool {
        self.participants.iter().any(|part| part.built.touches(on))
    }

    /// Reports names in the view that nothing has, and a view that shows nothing.
    pub(crate) fn check_view(&self, found: &mut Vec<Diagnostic>) {
        let view = &self.scene.view;
        let names = self.region_names(view.on.as_deref());
        let mut refuse = |path: &[&str], message: String, label: &str, help: &str| {
            found.push(Diagnostic::error(message).at(self.scene.source.span(path), label).help(help));
        };
        let mut hidden = Vec::new();
        for (index, name) in view.hide.iter().enumerate() {
            match names.find(name) {
                Ok(regions) => hidden.extend(regions),
                Err(error) => {
                    refuse(
                        &["view", "hide", &index.to_string()],
                        error.to_string(),
                        "nothing of this name",
                        NAMED,
                    );
                }
            }
        }
        for name in view.look.keys() {
            if let Err(error) = names.find(&CellLabel::Name(name.clone())) {
                refuse(&["view", "look", name], error.to_string(), "nothing of this name", NAMED);
            }
        }
        let labels: Vec<Region> = names.labels.iter().map(|(label, _)| Region::Label(label)).collect();
        let bodies: Vec<Region> = names.bodies.keys().map(|&body| Region::Body(body)).collect();
        for (regions, what) in [(labels, "labels"), (bodies, "bodies")] {
            if !regions.is_empty() && regions.iter().all(|region| hidden.contains(region)) {
                let message = format!("all {what} are hidden: nothing is left to be seen");
                refuse(&["view", "hide"], message, "all", "hide fewer");
            }
        }
    }
}

/// Help text: names and numbers that a view accepts.
const NAMED: &str =
    "give labels of elements by number, name or range; give bodies, obstacles and tools by name";

#[cfg(test)]
mod tests {
    use pliant_format::Scene;
    use pliant_format::tables::{At, FieldName};

    use super::*;
    use crate::testing::{built, built_alone, labelled, mistakes, scene};
    use pliant_format::source::Source;

    #[test]
    fn a_surface_has_the_fields_of_its_body_and_a_section_shows_that_body() {
        let skin =
            "[surface.skin]\non = 'cube'\nmesh = { block = { size = [0.2, 0.1, 0.1], cells = [3, 2, 2] } }\n";
        let clip = "[view]\non = 'skin'\nclip = { point = [0, 0, 0], normal = [1, 0, 0] }\n";
        let scene = scene(&format!("{skin}{clip}"));
        let [on_skin, on_cube] = ["skin", "cube"].map(|on| scene.fields_on(Some(on)));
        assert!(on_skin.contains(&FieldName::VonMises) && on_skin.contains(&FieldName::Displacement));
        assert!(!on_skin.contains(&FieldName::Reaction) && on_cube.contains(&FieldName::Reaction));
        assert_eq!(scene.shown(0.1).on.as_deref(), Some("cube"));
        assert_eq!(scene.shown_as(&scene.view, 0.1).on.as_deref(), Some("skin"));
        let world = World::new(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
        assert_eq!(world.body_names(Some("skin")), [(0, "skin".to_owned())].into());
    }

    #[test]
    fn shells_are_loaded_by_pressures_and_have_a_weight() {
        let built = built_alone(
            "[scene]\nuntil = 1\ngravity = [0, 0, -10]\n[run]\nsolver = 'static'\n[law.wall]\ntype = 'st-venant-kirchhoff'\n\
             young-modulus = 1e6\npoisson-ratio = 0.3\n[body.wall]\nmodel = 'shell'\n\
             mesh = { plate = { size = [0.2, 0.1], cells = [4, 2] } }\nlaw = 'wall'\ndensity = 1000\nthickness = 0.002\n\
             [constraint.base]\ntype = 'fix'\nbody = 'wall'\nnodes = { set = 'x-min' }\n\
             [load.push]\ntype = 'pressure'\non = 'wall'\nfaces = 'all'\npressure = 50\ncurve = 'hold'\n",
        );
        let at_rest = vec![[0.0; 3]; built.model.node_count()];
        let sum = |forces: Vec<[f64; 3]>| forces.into_iter().fold([0.0; 3], add);
        let [x, y, z] = sum(built.load_forces(1.0, &at_rest));
        // 50 Pa on 0.02 m².
        assert!(x == 0.0 && y == 0.0 && (z.abs() - 1.0).abs() < 1e-12, "{z}");
        // 40 g.
        assert!((sum(built.model.weights(1.0))[2] + 0.4).abs() < 1e-12);
    }

    #[test]
    fn axes_are_those_of_a_patient_where_all_bodies_are_meshed_from_images() {
        let of = |meshes: &[&str]| {
            let body = |(number, mesh): (usize, &&str)| {
                format!(
                    "[body.b{number}]\nmesh = {{ {mesh}, edge = 0.005 }}\nlaw = 'tissue'\ndensity = 1000\n"
                )
            };
            let bodies: String = meshes.iter().enumerate().map(body).collect();
            let law = "[law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 1e3\npoisson-ratio = 0.4\n";
            let source = Source::parse("scene.toml", format!("[scene]\nuntil = 1\n{law}{bodies}"));
            let scene = Scene::from_source(source.unwrap(), ".".into());
            scene.unwrap_or_else(|error| panic!("{}", error.plain())).is_of_patient()
        };
        let (image, shape) = ("image = 'organ.nii.gz'", "organ = 'liver'");
        assert!(of(&[image]) && of(&[image, image]));
        assert!(!of(&[shape]) && !of(&[image, shape]));
    }

    #[test]
    fn a_view_shows_what_it_names_and_von_mises_stresses_otherwise() {
        let skin =
            "[surface.skin]\non = 'cube'\nmesh = { block = { size = [0.2, 0.1, 0.1], cells = [3, 2, 2] } }\n";
        built(&format!("{skin}[view]\non = 'skin'\ncolour = 'pressure'\n"));
        let table = |more: &str| scene(more).shown(0.1);
        assert_eq!(table("").data, [FieldName::Displacement, FieldName::VonMises]);
        assert_eq!(table("[view]\ncolour = 'none'\n").data, [FieldName::Displacement]);
        assert_eq!(table("[view]\ncolour = 'pressure'\non = 'cube'\n").data[1], FieldName::Pressure);
        assert_eq!((table("").curved, table("").at), (None, At::Points), "a solid");
        let marked = table("[view]\ncritical = true\nfibres = true\n");
        assert_eq!(
            (&marked.data[2..], marked.at),
            (&[FieldName::ElementStep, FieldName::Fibre][..], At::Cells)
        );
        built(
            "[view]\ncolour = 'displacement'\ncomponent = 'z'\nclip = { point = [0, 0, 0], normal = [1, 0, 0] }\n",
        );
        built("[view]\ncolour = 'cauchy-stress'\ncomponent = 'xy'\n");
    }

    #[test]
    fn labels_are_shown_and_hidden_by_number_name_and_range() {
        let folder = tempfile::tempdir().unwrap();
        let bar = |view: &str| {
            labelled(folder.path(), &format!("law = 'tissue'\ndensity = 1000\n[view]\n{view}\n"))
        };
        let scene = bar("colour = 'label'\nhide = ['Tumour', 5]");
        let world = World::new(&scene).unwrap_or_else(|error| panic!("{}", error.plain()));
        assert!(scene.view.shows_labels() && scene.shown_field().is_none());
        assert_eq!(scene.shown(0.1).data, [FieldName::Displacement]);
        assert_eq!(world.hidden(&scene.view), [2, 5].map(Region::Label));
        assert_eq!(world.labels(None).all_shown(), ["1 (liver)", "2 (tumour)", "5"]);
        let [on_bar, on_none] = [Some("bar"), None].map(|on| world.body_names(on));
        assert_eq!((on_bar, world.body_names(Some("skin")).len()), (on_none.clone(), 0));
        assert_eq!(on_none, [(0, "bar".to_owned())].into());
        let range = ViewTable { hide: vec![CellLabel::Name("2-9".into())], ..scene.view.clone() };
        assert_eq!(world.hidden(&range), [2, 5].map(Region::Label));
        for (view, piece) in [
            ("hide = ['tumor']", "no label is named `tumor`; did you mean `tumour`?"),
            ("hide = [1, 7]", "no cell has label 7: the mesh has 1 (liver), 2 (tumour), 5"),
            ("hide = [1, '2-5']", "all labels are hidden"),
            ("hide = ['bar']", "all bodies are hidden"),
            ("look.bat = { opacity = 0.5 }", "nothing that is shown is named `bat`; did you mean `bar`?"),
        ] {
            let message = World::new(&bar(view)).unwrap_err().plain().to_string();
            assert!(message.contains(piece) && message.contains("bar.toml:"), "{view}: {message}");
        }
        let message = mistakes("[view]\ncolour = 'label'\n").plain().to_string();
        assert!(message.contains("have no labels") && message.contains("cell data `label`"), "{message}");
        let message =
            World::new(&crate::testing::scene("[view]\nhide = [1]\n")).unwrap_err().plain().to_string();
        assert!(
            message.contains("no cell has label 1") && message.contains("obstacles and tools by name"),
            "{message}"
        );
    }

    #[test]
    fn a_view_of_what_there_is_not_is_refused_with_a_remedy() {
        for (view, piece) in [
            ("on = 'cub'", "did you mean `cube`?"),
            ("colour = 'bending-moment'", "have no `bending-moment`"),
            ("colour = 'cauchy-stress'", "give `component = \"xx\"`"),
            ("colour = 'von-mises'\ncomponent = 'x'", "leave `component` out"),
            ("colour = 'displacement'\ncomponent = 'xx'", "`x`, `y` or `z`"),
            ("clip = { point = [0, 0, 0], normal = [0, 0, 0] }", "a plane needs a normal"),
            ("range = [2, 1]", "the range must increase"),
        ] {
            let message = mistakes(&format!("[view]\n{view}\n")).plain().to_string();
            assert!(message.contains(piece), "{view}: {message}");
        }
    }
}
