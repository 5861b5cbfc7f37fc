//! Bodies tied to others whose meshes do not match, with every solver, and refusals.

use pliant_format::Scene;
#[cfg(feature = "gpu")]
use pliant_scene::World;
#[cfg(feature = "gpu")]
use pliant_testing::scenes::taken_up;
use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, world};

use super::static_solids::{MATRIX, block};

/// A block of 40 × 20 × 10 mm of tissue, its width held, stretched along x, and a coat on its top on another
/// mesh.
pub fn coated(solver: &str, coat: &str, more: &str) -> String {
    format!(
        "[scene]\nuntil = 1\n[run]\n{solver}\n\
         [law.tissue]\ntype = 'neo-hookean'\nyoung-modulus = 3e3\npoisson-ratio = 0.45\n\
         [law.coat]\ntype = 'st-venant-kirchhoff'\nyoung-modulus = 1e6\npoisson-ratio = 0.3\n\
         [body.block]\nmesh = {{ block = {{ size = [0.04, 0.02, 0.01], cells = [8, 4, 2] }}, as = 'hexes' }}\n\
         law = 'tissue'\ndensity = 1000\n\
         [body.coat]\nmodel = 'membrane'\nmesh = {{ plate = {{ size = [0.04, 0.02], {coat} }}, at = [0, 0, 0.01] }}\n\
         law = 'coat'\ndensity = 1000\nthickness = 1e-4\n\
         [tie.glue]\nbetween = ['coat', 'block']\n\
         [constraint.start]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'x-min' }}\ncomponents = ['x']\n\
         [constraint.sides]\ntype = 'fix'\nbody = 'block'\nnodes = 'all'\ncomponents = ['y']\n\
         [constraint.base]\ntype = 'fix'\nbody = 'block'\nnodes = {{ set = 'z-min' }}\ncomponents = ['z']\n\
         [constraint.end]\ntype = 'move'\nbody = 'block'\nnodes = {{ set = 'x-max' }}\ncomponents = ['x']\nby = [0.004, 0, 0]\nto = 1\n\
         [output.history]\ntype = 'csv'\nevery = 1\n\
         probes.coat = {{ on = 'coat', at = [0.021, 0.011, 0.01], data = ['displacement', 'membrane-force'] }}\n{more}"
    )
}

/// The closed form for a coat on the same nodes holds for any mesh of the coat: the deformation is
/// homogeneous. The reference set `coupling` has 0.319980499 N for coat A at 10 %.
#[test]
fn a_coat_on_another_mesh_pulls_as_in_closed_form() {
    for coat in ["cells = [8, 4]", "cells = [7, 5]", "cells = [13, 3], pattern = 'crossed', distortion = 0.2"]
    {
        for solver in [
            "solver = 'static'\nload-steps = 4\ntolerance = 1e-10",
            "solver = 'quasi-static'\ntolerance = 1e-9",
        ] {
            let row = last_row(&coated(solver, coat, ""));
            let force = row["reaction.end.x"];
            println!("{coat} {solver}: {:e}", force / 0.319_980_499 - 1.0);
            assert!((force / 0.319_980_499 - 1.0).abs() < 1e-6, "{coat}: {force}");
            let stretched = row["probe.coat.displacement.x"];
            assert!((stretched - 0.1 * 0.021).abs() < 1e-9, "{coat}: {stretched}");
        }
    }
}

/// A vessel through a block that is bent, turned and pressed. Newton's method, dynamic relaxation, and rest
/// after a damped motion agree. As a shell in the systems of equations its rotations are free.
pub fn vessel(solver: &str, more: &str, model: &str) -> String {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let text = block(solver, "tet4", &law, more);
    format!(
        "{text}[law.vessel]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.3\n\
         [body.vessel]\n{model}\nmesh = {{ cylinder = {{ radius = 0.01, length = 0.05, cells = [12, 5] }}, at = [0.05, 0.025, 0] }}\n\
         law = 'vessel'\ndensity = 1050\nthickness = 1e-3\n\
         [tie.ingrown]\nbetween = ['vessel', 'block']\n"
    )
}

#[test]
fn a_vessel_in_a_solid_stands_where_every_solver_puts_it() {
    let membrane = "model = 'membrane'";
    let newton = last_row(&vessel("solver = 'static'\nload-steps = 4\ntolerance = 1e-10", "", membrane));
    let compare = |other: &str, fields: &[(&str, f64)]| {
        let other = last_row(other);
        assert_rows_agree("ties", [&newton, &other], fields);
    };
    let relaxed = vessel("solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9", "", membrane);
    compare(&relaxed, &[("displacement", 1e-5), ("reaction.", 1e-5)]);
    for solver in ["solver = 'explicit'", "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10"] {
        let moving = vessel(solver, "damping = 40", membrane)
            .replace("thickness = 1e-3", "thickness = 1e-3\ndamping = 40")
            .replace("until = 1", "until = 4")
            .replace("every = 1", "every = 4");
        compare(&moving, &[("displacement", 1e-5)]);
    }
    // A thin shell bends next to nothing, and a vessel in it makes a difference.
    let shell = vessel(
        "solver = 'static'\nload-steps = 4\ntolerance = 1e-10",
        "",
        "model = 'shell'\nelement = 'dkt-cst'",
    );
    compare(&shell, &[("displacement", 0.05)]);
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let without = last_row(&block("solver = 'static'\nload-steps = 4", "tet4", &law, ""));
    let off = newton
        .iter()
        .filter(|(name, _)| name.contains("displacement"))
        .map(|(name, x)| (x - without[name]).abs());
    assert!(off.fold(0.0, f64::max) > 1e-5);
}

#[test]
fn energies_of_tied_bodies_balance_and_the_critical_step_is_that_of_the_whole() {
    let out = tempfile::tempdir().unwrap();
    let text = vessel("solver = 'explicit'", "", "model = 'membrane'").replace("until = 1", "until = 0.3");
    let summary = pliant_testing::scenes::run(&text, out.path());
    assert!(summary.energy_balance.unwrap().abs() < 0.01, "{:?}", summary.energy_balance);
    let critical = summary.critical_step.unwrap();
    assert!((summary.step / critical - 0.9).abs() < 0.01);
    let broken = text.replace(
        "solver = 'explicit'",
        &format!("solver = 'explicit'\nstep = {}\non-unstable = 'report'", 1.05 * critical),
    );
    let world = world(&broken);
    let failed = match world {
        Err(message) => message.contains("stable"),
        Ok(world) => {
            let folder =
                pliant_run::OutputFolder::prepare(out.path().join("again"), &world.scene, false).unwrap();
            pliant_run::run(&world, &folder, &mut |_| ()).unwrap().status == "failed"
        }
    };
    assert!(failed);
}

#[test]
fn a_resumed_run_of_tied_bodies_ends_in_the_same_bits() {
    for solver in [
        "precision = 'single'\nstep = 1e-4",
        "solver = 'static'\nstep = 0.1",
        "solver = 'implicit'\nstep = 0.1",
    ] {
        resumes(&vessel(&format!("{solver}\ncheckpoint = {{ every = 0.4 }}"), "", "model = 'membrane'"));
    }
}

/// Another coat, and the start of its tie.
const SECOND: &str = "[body.second]\nmodel = 'membrane'\nmesh = { plate = { size = [0.04, 0.02], cells = [3, 2] }, at = [0, 0, 0.01] }\n\
                      law = 'coat'\ndensity = 1000\nthickness = 1e-4\n[tie.more]\n";

#[test]
fn ties_that_cannot_be_are_refused_by_name_and_gaps_are_told() {
    let explicit = "solver = 'explicit'";
    let plain = coated(explicit, "cells = [7, 5]", "");
    let with = |from: &str, to: &str| plain.replace(from, to);
    for (text, pieces) in [
        (with("['coat', 'block']", "['coat', 'blok']"), ["there is no body `blok`", "did you mean `block`?"]),
        (with("['coat', 'block']", "['block', 'block']"), ["would be tied to itself", "name two bodies"]),
        (
            with("at = [0, 0, 0.01]", "at = [0, 0, 0.02]"),
            ["no node of `coat` lies within", "the nearest is 0.01"],
        ),
        (
            with("['coat', 'block']\n", "['coat', 'block']\nnodes = 'all'\ntolerance = 1e-4\n")
                .replace("at = [0, 0, 0.01]", "at = [0.001, 0, 0.01]"),
            ["of `coat` lie farther than", "larger `tolerance`"],
        ),
        (
            plain.clone() + "[tie.again]\nbetween = ['coat', 'block']\n",
            ["is tied already, by `glue`", "leave those nodes out"],
        ),
        (
            plain.clone() + "[tie.back]\nbetween = ['block', 'coat']\n",
            ["follow others by `back`: ties cannot form chains or circles", "leave one of the two ties out"],
        ),
        (
            plain.clone() + SECOND + "between = ['second', 'coat']\n",
            [
                "node 0 of `second` would follow nodes that follow others by `glue`",
                "tie `second` to `block`, as `coat` is",
            ],
        ),
        (
            format!("{SECOND}between = ['second', 'coat']\n{plain}"),
            ["follow others by `glue`", "tie `second` to `block`, as `coat` is"],
        ),
        (
            with(
                "[constraint.start]\ntype = 'fix'\nbody = 'block'",
                "[constraint.start]\ntype = 'fix'\nbody = 'coat'",
            ),
            ["`start` and `glue`", "constrain `block`, which the node follows"],
        ),
        (
            with(
                "[constraint.start]\ntype = 'fix'\nbody = 'block'\nnodes = { set = 'x-min' }\ncomponents = ['x']",
                "[constraint.start]\ntype = 'rigid'\nbody = 'coat'\nnodes = { set = 'x-min' }",
            ),
            ["`start` and `glue`", "constrain `block`, which the node follows"],
        ),
        (
            with(
                "model = 'membrane'\nmesh = { plate = { size = [0.04, 0.02], cells = [7, 5] }, at = [0, 0, 0.01] }",
                "on = 'block'\nfaces = { set = 'z-max' }",
            ),
            ["share their nodes already", "leave the tie out"],
        ),
        (with("between = ['coat', 'block']", "between = ['coat']"), ["between", ""]),
    ] {
        crate::assert_refused(&text, &pieces);
    }
    // A coat that hangs over: the nodes that are not tied are reported with their largest gap.
    let over = world(&with("at = [0, 0, 0.01]", "at = [0.01, 0, 0.01]")).unwrap();
    let warnings: Vec<String> = over.warnings().map(ToString::to_string).collect();
    assert!(
        warnings
            .iter()
            .any(|message| message.contains("up to 0.01") && message.contains("of `coat` lie farther than")),
        "{warnings:?}"
    );
    let notes = &over.participants[0].built.notes;
    assert!(
        notes.iter().any(|note| note.contains("`glue`: ") && note.contains("follow `block`")),
        "{notes:?}"
    );
}

/// The block of [`coated`] as crooked tets: its nodes are moved along the faces that they are on, by up to
/// 0.8 of 5 mm.
fn crooked() -> pliant_geometry::Mesh {
    let block = pliant_meshing::Block::new(BLOCK);
    let counts = pliant_meshing::Resolution::Counts([8, 4, 2]);
    let mut mesh = block.mesh(counts, pliant_meshing::VolumeCell::Tet, usize::MAX).unwrap();
    let mut random = pliant_testing::Random::new(3);
    for point in &mut mesh.points {
        for (c, size) in BLOCK.into_iter().enumerate() {
            let by = 8e-4 * random.number();
            if point[c] > 1e-9 && point[c] < size - 1e-9 {
                point[c] += by;
            }
        }
    }
    mesh
}

const BLOCK: [f64; 3] = [0.04, 0.02, 0.01];

/// The nodes on a side of the block as a selection.
fn side(component: usize, far: bool) -> String {
    let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
    (point[component], normal[component]) = if far { (BLOCK[component] - 1e-6, 1.0) } else { (1e-6, -1.0) };
    format!("{{ half-space = {{ point = {point:?}, normal = {normal:?} }} }}")
}

/// Places at rest [m] and displacements [m] of all nodes at the end of a run, and its last row.
fn moved(text: &str) -> (Vec<[[f64; 3]; 2]>, std::collections::BTreeMap<String, f64>) {
    let text = format!("{text}[output.all]\ntype = 'vtu'\nevery = 1\ndata = ['displacement']\n");
    let out = tempfile::tempdir().unwrap();
    pliant_testing::scenes::run(&text, out.path());
    let files = std::fs::read_dir(out.path().join("all")).unwrap().map(|entry| entry.unwrap().path());
    let frame = pliant_geometry::io::read(&files.max().unwrap()).unwrap().mesh;
    let moved = &frame.point_data["displacement"];
    let item = |at: usize| moved.item(at).try_into().unwrap();
    let points = frame.points.iter().enumerate().map(|(at, &point)| [point.into(), item(at)]);
    (points.collect(), pliant_testing::scenes::last_row_in(out.path()))
}

/// A block of crooked tets is stretched freely, with a wall of no stiffness tied to its top, on its triangles
/// and on others. The strain is uniform, and the wall takes it on.
#[test]
fn a_uniform_strain_passes_through_ties() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("block.vtu");
    pliant_geometry::io::write(&file, &crooked()).unwrap();
    for (coat, solver) in [
        ("cells = [8, 4]", "solver = 'static'\ntolerance = 1e-12"),
        ("cells = [7, 5], distortion = 0.2", "solver = 'static'\ntolerance = 1e-12"),
        ("cells = [7, 5], distortion = 0.2", "solver = 'quasi-static'\ntolerance = 1e-12"),
    ] {
        for model in ["membrane", "shell"] {
            if model == "shell" && !solver.contains("'static'") {
                continue;
            }
            let text = from_file(&coated(solver, coat, ""), &file)
                .replace("young-modulus = 1e6", "young-modulus = 1e-9")
                .replace("model = 'membrane'", &format!("model = '{model}'"))
                .replace("'block'\nnodes = 'all'", &format!("'block'\nnodes = {}", side(1, false)));
            let (points, _) = moved(&text);
            let far = points.iter().find(|[x, _]| (0..3).all(|c| (x[c] - BLOCK[c]).abs() < 1e-9)).unwrap();
            let strain = [0, 1, 2].map(|c| far[1][c] / far[0][c]);
            assert!(
                (strain[0] - 0.1).abs() < 1e-12
                    && strain[1] < -0.03
                    && (strain[1] / strain[2] - 1.0).abs() < 1e-9
            );
            for [point, moved] in points {
                for c in 0..3 {
                    let off = (moved[c] - strain[c] * point[c]).abs();
                    assert!(off < 1e-10 * 0.04, "{coat} {model} {solver}: {off:e} m at {point:?}");
                }
            }
        }
    }
}

/// The scene of [`coated`] with its block from a file.
fn from_file(text: &str, file: &std::path::Path) -> String {
    text.replace(
        "block = { size = [0.04, 0.02, 0.01], cells = [8, 4, 2] }, as = 'hexes'",
        &format!("file = '{}'", file.display()),
    )
    .replace("{ set = 'x-min' }", &side(0, false))
    .replace("{ set = 'x-max' }", &side(0, true))
    .replace("{ set = 'z-min' }", &side(2, false))
}

/// A stretched coat, stiffer than the block of crooked tets under it, on the triangles of the block and on
/// others. Both sides of the block are held across, and with them the rim of the coat; its top is free. The
/// uniform strain is the exact solution of the discrete system. The forces f of a uniform stress vanish on
/// each inner node of the coat, and so does Jᵀ f.
#[test]
fn coats_in_equilibrium_keep_a_uniform_strain() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("block.vtu");
    pliant_geometry::io::write(&file, &crooked()).unwrap();
    for coat in [
        "cells = [8, 4]",
        "cells = [7, 5], distortion = 0.2",
        "cells = [23, 13], pattern = 'crossed', distortion = 0.2",
        "cells = [3, 2]",
    ] {
        for solver in [
            "solver = 'static'\nload-steps = 4\ntolerance = 1e-12",
            "solver = 'quasi-static'\ntolerance = 1e-12",
        ] {
            let wide = format!(
                "[constraint.far]\ntype = 'move'\nbody = 'block'\nnodes = {}\ncomponents = ['y']\nby = [0, 0.001, 0]\nto = 1\n",
                side(1, true)
            );
            let text = from_file(&coated(solver, coat, &wide), &file)
                .replace("'block'\nnodes = 'all'", &format!("'block'\nnodes = {}", side(1, false)));
            let (points, row) = moved(&text);
            let across = stretch_across([1.1, 1.05]);
            let strain = [0.1, 0.05, across - 1.0];
            let off = points.iter().flat_map(|[x, u]| [0, 1, 2].map(|c| (u[c] - strain[c] * x[c]).abs()));
            let off = off.fold(0.0, f64::max) / 0.04;
            let force = row["reaction.end.x"] / pull([1.1, 1.05, across]) - 1.0;
            println!("{coat} {solver}: {off:.1e} of the length, force {force:.1e}");
            assert!(off < 1e-8 && force.abs() < 1e-8);
        }
    }
    assert!((pull([1.1, 1.0, stretch_across([1.1, 1.0])]) / 0.319_980_499 - 1.0).abs() < 1e-8);
}

/// An oblique stiff sheet of crooked triangles in a block of crooked tets, tied to it, from side to side. The
/// surface of the block is stretched, sheared and turned by one gradient, which its inside and the sheet
/// follow.
#[test]
fn a_sheet_across_a_block_keeps_a_uniform_strain() {
    const GRADIENT: [[f64; 3]; 3] = [[0.1, 0.02, 0.03], [-0.05, 0.08, 0.02], [0.02, 0.01, -0.05]];
    let affine = |x: &[f64]| GRADIENT.map(|row| row.iter().zip(x).map(|(g, x)| g * x).sum::<f64>());
    let place = tempfile::tempdir().unwrap();
    let (file, sheet) = (place.path().join("block.vtu"), place.path().join("sheet.vtu"));
    let mut block = crooked();
    let values = block.points.iter().flat_map(|point| affine(point.as_slice())).collect();
    block.point_data.insert("affine".into(), pliant_geometry::DataArray { components: 3, values });
    pliant_geometry::io::write(&file, &block).unwrap();
    let plate = pliant_meshing::Sheet::Plate { size: [BLOCK[0], BLOCK[1]] };
    let distortion = Some(pliant_meshing::Distortion { amount: 0.2, seed: 0 });
    let mut oblique = plate.mesh([7, 5], pliant_meshing::Pattern::Crossed, distortion, usize::MAX).unwrap();
    oblique.points.iter_mut().for_each(|point| point.z = 0.002 + 0.1 * (point.x + point.y));
    pliant_geometry::io::write(&sheet, &oblique).unwrap();
    for solver in
        ["solver = 'static'\nload-steps = 4\ntolerance = 1e-12", "solver = 'quasi-static'\ntolerance = 1e-12"]
    {
        let text = coated(solver, "cells = [1, 1]", "");
        let (bodies, rest) = text.split_once("[constraint.start]").unwrap();
        let (_, outputs) = rest.split_once("[output.history]").unwrap();
        let outputs = outputs.replace("[0.021, 0.011, 0.01]", "[0.021, 0.011, 0.0052]");
        let text = format!(
            "{bodies}[constraint.surface]\ntype = 'move'\nbody = 'block'\nnodes = 'boundary'\nby = {{ point-data = 'affine' }}\nto = 1\n\
             [output.history]{outputs}"
        );
        let text = from_file(&text, &file).replace(
            "mesh = { plate = { size = [0.04, 0.02], cells = [1, 1] }, at = [0, 0, 0.01] }",
            &format!("mesh = {{ file = '{}' }}", sheet.display()),
        );
        let (points, row) = moved(&text);
        let off = points.iter().flat_map(|[x, u]| affine(x).into_iter().zip(u).map(|(a, b)| (a - b).abs()));
        let off = off.fold(0.0, f64::max) / 0.04;
        println!("{solver}: {off:.1e} of the length");
        assert!(off < 1e-8 && row["probe.coat.membrane-force.xx"] > 10.0, "{row:?}");
    }
}

/// E [Pa] and ν of the tissue and of the coat of [`coated`].
const TISSUE: [f64; 2] = [3e3, 0.45];
const COAT: [f64; 2] = [1e6, 0.3];

/// The first Piola–Kirchhoff stress [Pa] of the tissue along each axis, Ψ = μ/2 (J^(−2/3) I₁ − 3) + κ/2 (J −
/// 1)².
fn tissue_stress(stretch: [f64; 3]) -> [f64; 3] {
    let [young, nu] = TISSUE;
    let (shear, bulk) = (young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)));
    let j: f64 = stretch.iter().product();
    let trace: f64 = stretch.iter().map(|l| l * l).sum();
    stretch.map(|l| shear * j.powf(-2.0 / 3.0) * (l - trace / (3.0 * l)) + bulk * (j - 1.0) * j / l)
}

/// The stretch of the tissue along z at which no stress acts there, by bisection.
fn stretch_across([x, y]: [f64; 2]) -> f64 {
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if tissue_stress([x, y, middle])[2] > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// The force [N] along x of the block and of its coat of 0.1 mm, S = E/(1 − ν²) (e_xx + ν e_yy).
fn pull(stretch: [f64; 3]) -> f64 {
    let [young, nu] = COAT;
    let strain = stretch.map(|l| 0.5 * (l * l - 1.0));
    let coat = stretch[0] * young / (1.0 - nu * nu) * (strain[0] + nu * strain[1]);
    BLOCK[1] * (BLOCK[2] * tissue_stress(stretch)[0] + 1e-4 * coat)
}

/// Runs a scene on the CPU in double precision and on a GPU until a time [s]. Displacements of all bodies
/// differ by at most 1e-5, energies and the reaction of a constraint by 1e-4. Steps are cut at the same
/// instants; returns the number of cuts.
#[cfg(feature = "gpu")]
pub fn agrees_on_a_device([cpu, gpu]: [&World; 2], until: f64, constraint: &str) -> u32 {
    let mut runs = [cpu, gpu].map(|world| world.simulation().unwrap());
    runs.iter_mut().for_each(|run| run.run(until, |_| ()).unwrap());
    let [a, b] = runs.each_mut().map(|run| {
        let frame = run.frame().unwrap();
        let bodies = cpu.participants[0].built.model.bodies.iter();
        let moved = bodies.flat_map(|body| frame.displacements(&body.name).unwrap_or_default());
        (moved.collect::<Vec<_>>(), frame.reaction(constraint).unwrap(), frame.energies(), frame.time())
    });
    assert_eq!(a.3, b.3);
    let norm = |v: &[[f64; 3]]| v.as_flattened().iter().map(|x| x * x).sum::<f64>().sqrt();
    let apart = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let off: Vec<_> = a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|c| a[c] - b[c])).collect();
        norm(&off) / norm(a)
    };
    let (moved, force) = (apart(&a.0, &b.0), apart(&[a.1], &[b.1]));
    let energy = ((a.2.internal - b.2.internal) / a.2.internal).abs();
    println!(
        "{} steps: displacements {moved:.1e}, reaction {force:.1e}, energy {energy:.1e}",
        runs[0].steps()
    );
    assert!(runs[0].steps() >= 200 && !a.0.is_empty());
    assert!(moved <= 1e-5, "displacements are off by {moved:.1e}");
    assert!(force <= 1e-4, "the reaction is off by {force:.1e}");
    assert!(energy <= 1e-4, "the internal energy is off by {energy:.1e}");
    let [a, b] = runs.each_ref().map(|run| run.instants().next().unwrap().stability());
    let cut = |at: &pliant_explicit::stability::Stability| {
        (at.cuts, at.first_cut, at.last_cut, at.most_substeps, at.extra_steps)
    };
    println!("checks {} and {}, steps cut: {:?} and {:?}", a.checks, b.checks, cut(&a), cut(&b));
    assert_eq!(cut(&a), cut(&b));
    a.cuts
}

#[cfg(feature = "gpu")]
#[test]
fn tied_bodies_move_on_a_device_as_on_the_processor() {
    if !crate::has_gpu() {
        return;
    }
    let vessel_text = |run: &str| vessel(run, "", "model = 'membrane'");
    // The critical step falls below the automatic one, so that steps are cut.
    let vessel = |run: &str| world(&vessel_text(run)).unwrap();
    let cuts = agrees_on_a_device([&vessel("precision = 'double'"), &vessel("device = 'gpu'")], 1.0, "end");
    assert!(cuts > 0);
    let coat = |run: &str| world(&coated(run, "cells = [7, 5]", "")).unwrap();
    agrees_on_a_device([&coat("precision = 'double'"), &coat("device = 'gpu'")], 1.0, "end");
    // A checkpoint of a GPU is continued there. Work is summed from one look to the next: of energies the
    // last bits differ.
    let whole = vessel_text("device = 'gpu'\nstep = 2e-3\ncheckpoint = { every = 0.4 }");
    let half = world(&whole.replace("until = 1", "until = 0.4")).unwrap();
    let place = tempfile::tempdir().unwrap();
    let tables = taken_up(&world(&whole).unwrap(), &half, place.path()).1;
    let [a, b] = tables.each_ref().map(|table| {
        let names = table.lines().next().unwrap().split(',');
        let row = names.zip(table.lines().last().unwrap().split(','));
        row.filter(|(name, _)| name.starts_with("probe.") || name.starts_with("reaction."))
            .collect::<Vec<_>>()
    });
    assert!(a.len() > 30 && a == b, "{a:?}\n{b:?}");
    let refused = world(&vessel_text("device = 'gpu'\ndesign = 'blocks'")).err().unwrap();
    assert!(refused.contains("`blocks` does not support ties") && refused.contains("`gather`"), "{refused}");
}

#[cfg(feature = "gpu")]
#[test]
fn a_liver_in_its_capsule_with_its_vessels_moves_on_a_device_as_on_the_processor() {
    if !crate::has_gpu() {
        return;
    }
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/liver-with-capsule");
    let text = std::fs::read_to_string(folder.join("scene.toml")).unwrap();
    assert!(text.contains("precision = \"single\""));
    let worlds = ["precision = \"double\"", "device = \"gpu\""].map(|run| {
        let text = text.replace("precision = \"single\"", run);
        let source = pliant_format::source::Source::parse("scene.toml", text).unwrap();
        World::new(&Scene::from_source(source, folder.clone()).unwrap()).unwrap()
    });
    agrees_on_a_device(worlds.each_ref(), 0.1, "pull");
}
