//! A program that looks at an instant, takes a state there and continues from it changes no bit of later
//! states. Scenes that resume ([`scenes::resumes`]) are held to it, too.

use pliant_testing::scenes;

fn world(element: &str, run: &str) -> pliant_scene::World {
    scenes::world(&scenes::resumable(element, run, true)).unwrap()
}

#[test]
fn laws_relax_once_in_every_element() {
    for element in ["tet4", "tet4-anp", "tet4-ianp", "hex8", "hex8-full"] {
        for precision in ["single", "double"] {
            scenes::looks_change_nothing(&world(element, &format!("precision = '{precision}'")));
        }
    }
    scenes::looks_change_nothing(&world("hex8-full", "solver = 'quasi-static'\nload-steps = 4"));
    scenes::looks_change_nothing(&world("tet4", "solver = 'implicit'\nstep = 5e-3"));
}

#[cfg(feature = "gpu")]
#[test]
fn laws_relax_once_on_a_device_which_takes_no_forces_on_nodes() {
    if !crate::has_gpu() {
        return;
    }
    let world = world("tet4", "device = 'gpu'\ndesign = 'gather'");
    scenes::looks_change_nothing(&world);
    let mut simulation = world.simulation().unwrap();
    let forces = vec![[0.0, 0.0, 1.0]; world.only().unwrap().built.model.node_count()];
    let refused = simulation.push(&forces).unwrap_err();
    assert!(refused.kind.word() == "device" && refused.message.contains("on the CPU only"), "{refused}");
    simulation.push(&[]).unwrap();
}
