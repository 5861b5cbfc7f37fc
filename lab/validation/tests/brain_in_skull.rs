//! A brain free in its skull, while gravity turns by a right angle. The skull is the brain's own surface half
//! a millimetre outward. No node leaves the skull, the skull carries the weight, and the step is as long as
//! the free brain's.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_geometry::{SurfaceLocator, boundary, io};
use pliant_scene::World;
use pliant_validation::claim;

fn world(source: Source, folder: &Path) -> World {
    let scene = Scene::from_source(source, folder.to_owned()).unwrap_or_else(|e| panic!("{}", e.plain()));
    World::new(&scene).unwrap_or_else(|e| panic!("{}", e.plain()))
}

/// Plays a scene of a body `brain` in an obstacle `skull` to its end, at rest on its side; gravity ends along
/// −y.
fn check(name: &str, text: &str, folder: &Path, grow: f64) {
    let source = |text: &str| Source::parse("scene.toml", text.to_owned()).unwrap();
    let free = text.split_once("[contact.rests]").unwrap();
    let free = format!("{}{}", free.0, free.1.split_once("friction = 0\n").unwrap().1);
    let world = world(source(text), folder);
    let without = self::world(source(&free), folder);
    assert_eq!(world.step(), without.step(), "{name}: contact changes the step");

    let part = &world.participants[0].built;
    let contacts = part.contacts.as_ref().unwrap();
    let (rigid, nodes) = (&contacts.rigids[0], &contacts.contacts[0].surface.nodes);
    let stance = rigid.stance(0.0, None);
    let mesh = &part.bodies[0].mesh;
    let surface = boundary(mesh);
    let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
    let at_rest = SurfaceLocator::new(&surface, &faces, &mesh.points);
    let weight = 9.81 * part.model.mass.iter().sum::<f64>();
    println!("{name}: {} nodes, {} of them on the surface, {weight:.4} N", mesh.points.len(), nodes.len());

    let mut simulation = world.simulation().unwrap();
    let until = world.scene.scene.until;
    let (mut outside, mut out_of_triangles, mut off_weight, mut seen) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    let mut sunk = 0.0_f64;
    let looked = simulation.run(until, |frame| {
        let time = frame.time();
        let displacements = frame.displacements("brain").unwrap();
        let places = nodes
            .iter()
            .map(|&node| mesh.points[node as usize] + Vector3::from(displacements[node as usize]));
        let places: Vec<Vector3<f64>> = places.collect();
        for place in &places {
            outside = outside.max(-rigid.near(&stance, place).distance);
        }
        if time >= seen {
            seen += 0.05;
            for place in &places {
                let closest = at_rest.closest(place).unwrap();
                let away = (place - closest.position).norm();
                if (place - closest.position).dot(&closest.normal) > 0.0 {
                    out_of_triangles = out_of_triangles.max(away - grow);
                }
            }
        }
        if time > until - 0.3 {
            let force = Vector3::from(frame.contact_force("rests").unwrap());
            off_weight = off_weight.max((force + Vector3::y() * weight).norm() / weight);
            sunk = displacements.iter().map(|u| -u[1]).fold(0.0, f64::max);
        }
    });
    looked.unwrap_or_else(|failure| panic!("{name}: {}", failure.message));
    println!("{name}: sinks by up to {:.2} mm when it lies on its side", 1e3 * sunk);
    claim(&format!("{name}: out of the skull as sampled, any node in any step [m]"), outside, 1e-6);
    println!("{name}: out of the grown triangles by {out_of_triangles:.2e} m at most");
    claim(&format!("{name}: reaction off the weight, over the weight"), off_weight, 0.01);
}

#[test]
fn an_ellipsoid_stays_in_its_skull() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/brain-in-skull");
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    check("ellipsoid", &text, &folder, 0.0005);
}

/// Tests the grey and white matter of the MNI152 average brain, in tets of 12 mm. The brain and its skull are
/// made of one file.
#[test]
#[ignore = "takes minutes"]
fn a_real_brain_stays_in_its_skull() {
    let Some(data) = std::env::var_os("PLIANT_DATA").map(PathBuf::from) else {
        println!("skipped: PLIANT_DATA is not set");
        return;
    };
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/brain-in-skull/scene.toml");
    let text = std::fs::read_to_string(scene).unwrap();
    let matter = data.join("brain-mni152");
    let [grey, white] = ["gm", "wm"].map(|part| {
        let file = matter.join(format!("mni_icbm152_{part}_2009a_sym.nii.gz"));
        file.display().to_string()
    });
    let mesh_line = "mesh = { file = \"../brain-shift/ellipsoid.vtu\" }";
    let image = format!(
        "mesh = {{ image = '{grey}', add = '{white}', threshold = 0.5, edge = 0.012, \
         clean = {{ close-gaps = 0.004, fill-holes = true, keep-largest = true }} }}"
    );
    assert!(text.contains(mesh_line));
    // The first world is there for its mesh.
    let (before, contact) = text.split_once("[obstacle.skull]").unwrap();
    let after = contact.split_once("friction = 0\n").unwrap().1;
    let meshed = world(
        Source::parse("scene.toml", format!("{before}{after}").replace(mesh_line, &image)).unwrap(),
        Path::new("."),
    );
    let folder = tempfile::tempdir().unwrap();
    let body = &meshed.participants[0].built.bodies[0].mesh;
    io::write(&folder.path().join("brain.vtu"), body).unwrap();
    let [low, high] = body.bounds().map(|(low, high)| [low, high]).unwrap();
    println!("MNI152 brain of {:?} mm", ((high - low) * 1e3).map(f64::round).as_slice());
    let middle = (low + high) / 2.0;
    let text = text
        .replace("../brain-shift/ellipsoid.vtu", "brain.vtu")
        .replace("at = [0, 0, 0]", &format!("at = [{}, {}, {}]", middle.x, middle.y, middle.z));
    check("MNI152", &text, folder.path(), 0.0005);
}
