//! Mass scaling: the critical time steps for added masses, and the changes of motion and equilibrium.

use pliant_explicit::critical_step::assembled;
use pliant_explicit::mass_scaling::{Goal, scale_mass};
use pliant_explicit::stability::OnUnstable;
use pliant_mechanics::Model;
use pliant_mechanics::element::Cord;
use pliant_mechanics::mapping::Weights;
use pliant_mechanics::model::{Cells, Motion, Solid};
use pliant_mechanics::tensor::{Vector, add, dot, scale, sub};
use pliant_meshing::{Organ, Phantom, Stuffing, VolumeCell};
use pliant_validation::{
    Hexes, Specimen, Tets, claim, elastic, law, liver, run_watched, settle, smooth_step, soft_tissue,
};
use serde_json::json;

/// An organ in stuffed tets, held where a coordinate lies below a place [m].
fn organ(organ: Organ, edge: f64, (axis, below): (usize, f64)) -> Specimen {
    let mesh = Stuffing::new(edge).mesh(&Phantom::new(organ, 1.0).unwrap()).unwrap().mesh;
    let tissue = if organ == Organ::Liver { liver() } else { soft_tissue() };
    let mut specimen = Specimen::new(mesh, &elastic(tissue), [0.0, 1.0, 0.0]);
    let held = nodes(&specimen.model, |x| x[axis] < below);
    specimen.model.fix("base", held);
    specimen
}

fn nodes(model: &Model, chosen: impl Fn(&Vector<f64>) -> bool) -> Vec<u32> {
    (0..).zip(&model.rest).filter(|(_, x)| chosen(x)).map(|(node, _)| node).collect()
}

fn brain() -> Specimen {
    organ(Organ::Brain, 0.014, (2, -0.045))
}

fn block(cells: VolumeCell) -> Specimen {
    Specimen::block([0.1, 0.05, 0.05], [8, 4, 4], cells, &elastic(soft_tissue()), [0.0; 3])
        .fix("x-min", [true; 3])
}

fn scaled(model: &Model, goal: Goal) -> Model {
    let mut model = model.clone();
    scale_mass(&mut model, goal).unwrap();
    model
}

/// Added mass over the mass of the material.
fn share(model: &Model) -> f64 {
    model.mass_scaling.as_ref().unwrap().total() / model.mass.iter().sum::<f64>()
}

fn limit(model: &Model) -> f64 {
    assembled(model).unwrap().step
}

#[test]
fn the_critical_step_reaches_its_target_with_little_mass() {
    let hexes = block(VolumeCell::Hex);
    let full = Specimen::of_elements(
        hexes.mesh.clone(),
        Tets::Plain,
        Hexes::Full,
        &elastic(soft_tissue()),
        [0.0; 3],
    )
    .fix("x-min", [true; 3]);
    for (name, specimen, factor, most) in [
        ("stuffed brain", brain(), 1.5, 0.02),
        ("stuffed liver", organ(Organ::Liver, 0.016, (0, -0.075)), 1.5, 0.03),
        ("block of tets", block(VolumeCell::Tet), 1.4, 0.96),
        ("block of hexes", hexes, 1.4, 0.96),
        ("block of full hexes", full, 1.4, 0.96),
    ] {
        let before = specimen.critical_step();
        let model = scaled(&specimen.model, Goal::TargetStep(factor * before));
        let (reached, added) = (limit(&model) / before, share(&model));
        println!("{name}: {reached:.3} × the critical time step with {:.2} % of mass", 100.0 * added);
        assert!((factor..1.011 * factor).contains(&reached), "{name}: {reached}");
        // Heavier everywhere, a body would take factor² − 1.
        assert!(added > 0.0 && added <= most, "{name}: {added}");
        assert_eq!(model.mass_scaling.as_ref().unwrap().unscaled_critical_step, before);
    }
}

#[test]
fn a_share_of_mass_goes_to_nodes_that_can_move_and_enlarges_the_step() {
    let specimen = brain();
    let before = specimen.critical_step();
    let mut last = before;
    for goal in [0.001, 0.01, 0.05] {
        let model = scaled(&specimen.model, Goal::Share(goal));
        let step = limit(&model);
        println!("{} % of mass: {:.3} × the critical time step", 100.0 * goal, step / before);
        claim("added mass over its share, off by", (share(&model) / goal - 1.0).abs(), 1e-5);
        assert!(step > 1.1 * last);
        last = step;
        let scaling = model.mass_scaling.as_ref().unwrap();
        assert!(specimen.model.constraints[0].nodes.iter().all(|&held| scaling.added[held as usize] == 0.0));
    }
}

#[test]
fn a_goal_that_is_reached_and_a_body_without_freedom_get_no_mass() {
    let block = block(VolumeCell::Tet);
    let easy = scaled(&block.model, Goal::TargetStep(0.9 * block.critical_step()));
    let mut held = block.model;
    held.constraints.clear();
    held.fix("all", nodes(&held, |_| true));
    for model in [easy, scaled(&held, Goal::TargetStep(1.0)), scaled(&held, Goal::Share(0.1))] {
        assert_eq!(model.mass_scaling.as_ref().unwrap().nodes(), 0);
    }
}

#[test]
fn a_stiff_bar_whose_nodes_follow_a_cell_from_outside_gets_its_step() {
    let mut model = block(VolumeCell::Tet).model;
    let before = limit(&model);
    let rows = {
        let cells = &model.solids[0].cells;
        let inner = |cell: &usize| cells.nodes(*cell).iter().all(|&node| model.rest[node as usize][0] > 0.04);
        let cell = (0..cells.len()).find(inner).unwrap();
        let row = |weights: [f64; 4]| cells.nodes(cell).iter().copied().zip(weights).collect::<Vec<_>>();
        [row([1.4, -0.2, -0.1, -0.1]), row([-0.2, 1.4, -0.1, -0.1])]
    };
    let place = |row: &Vec<(u32, f64)>| {
        row.iter().fold([0.0; 3], |sum, &(node, weight)| add(sum, scale(model.rest[node as usize], weight)))
    };
    let places = [place(&rows[0]), place(&rows[1])];
    let first = model.node_count() as u32;
    let bar = model.add_body("bar", &places);
    let stiff = elastic(law("neo-hookean", json!({ "young-modulus": 1e9, "poisson-ratio": 0.45 })));
    let cells = Cells::bar(vec![[first, first + 1]], &model.rest, 1e-6, Cord::default());
    model.add_solid(Solid::new(bar, stiff, cells));
    model.tie("outside", vec![first, first + 1], Weights::from_rows(rows.iter().map(Vec::as_slice))).unwrap();
    assert!(limit(&model) < 0.5 * before);
    for target in [0.8 * before, before] {
        assert!(limit(&scaled(&model, Goal::TargetStep(target))) >= target);
    }
}

#[test]
fn a_body_comes_to_rest_where_it_does_without_added_mass() {
    let hanging = block(VolumeCell::Tet).damped(15.0).falling([0.0, 0.0, -2.0]);
    let step = 0.9 * hanging.critical_step();
    let rest = [hanging.model.clone(), scaled(&hanging.model, Goal::Share(0.05))]
        .map(|model| settle(&model, step, 4.0));
    let [plain, heavy] = &rest;
    let off = farthest(&heavy.displacement, &plain.displacement) / plain.largest;
    claim("displacement at rest, off by", off, 1e-7);
}

/// The largest distance [m] between the places of a node in two states.
fn farthest(a: &[Vector<f64>], b: &[Vector<f64>]) -> f64 {
    let distances = a.iter().zip(b).map(|(a, b)| sub(*a, *b)).map(|d| dot(d, d).sqrt());
    distances.fold(0.0, f64::max)
}

/// Displacements [m] of a run every so often [s], until a time [s].
fn motion(model: &Model, every: f64, until: f64) -> Vec<Vec<Vector<f64>>> {
    let step = every / (every / (0.9 * limit(model))).ceil();
    let mut seen = Vec::new();
    run_watched::<f64>(model, step, OnUnstable::Substep, until * (1.0 - 1e-9), |_, state| {
        if state.time >= (seen.len() as f64 + 1.0 - 1e-9) * every {
            seen.push(state.displacement.clone());
        }
    })
    .unwrap();
    seen
}

/// The deviation of a motion from the motion without added mass, over the largest displacement.
fn deviation(model: &Model, added: f64, until: f64) -> f64 {
    let every = until / 20.0;
    let [plain, heavy] =
        [motion(model, every, until), motion(&scaled(model, Goal::Share(added)), every, until)];
    assert_eq!((plain.len(), heavy.len()), (20, 20));
    let still = vec![[0.0; 3]; model.node_count()];
    let largest = plain.iter().map(|u| farthest(u, &still)).fold(0.0, f64::max);
    plain.iter().zip(&heavy).map(|(plain, heavy)| farthest(plain, heavy)).fold(0.0, f64::max) / largest
}

#[test]
fn a_brain_that_is_shaken_and_a_liver_that_is_pulled_move_nearly_as_without_added_mass() {
    let shaken = brain().damped(5.0).falling([3.0, 0.0, 0.0]);
    let mut pulled = organ(Organ::Liver, 0.016, (0, -0.075)).damped(5.0);
    let tip = nodes(&pulled.model, |x| x[0] > 0.075);
    pulled.model.constrain("pull", tip, Motion::Displacement([0.02, 0.0, 0.02], smooth_step(0.5)));
    for (added, most) in [(0.001, [0.002, 0.0005]), (0.01, [0.02, 0.005]), (0.05, [0.1, 0.02])] {
        let percent = 100.0 * added;
        claim(&format!("brain, {percent} % added"), deviation(&shaken.model, added, 0.5), most[0]);
        claim(&format!("liver, {percent} % added"), deviation(&pulled.model, added, 1.0), most[1]);
    }
}
