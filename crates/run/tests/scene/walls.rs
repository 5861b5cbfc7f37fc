//! Thin walls on solids: membranes with every solver of solids, shells with solvers of equations, and
//! refusals.

use std::fs;

use pliant_geometry::{CellKind, io};
use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run};

use super::static_solids::{MATRIX, block};
use crate::assert_refused;

/// A capsule on the block, one law for all solvers.
const CAPSULE: &str = "[law.capsule]\ntype = 'neo-hookean'\nyoung-modulus = 2e5\npoisson-ratio = 0.5\n\
    [body.capsule]\non = 'block'\nlaw = 'capsule'\ndensity = 1100\nthickness = 1e-3\n";

/// The probes of the block and one of the capsule.
fn coated(solver: &str, element: &str, more: &str, capsule: &str) -> String {
    let law = format!("type = 'neo-hookean'\n{MATRIX}");
    let text = block(solver, element, &law, more);
    let probe =
        "probes.d = { on = 'capsule', at = [0.05, 0.05, 0.03], data = ['displacement', 'membrane-force'] }\n";
    // The last table of the text is the output.
    format!("{text}{probe}{capsule}")
}

fn compare(one: &str, other: &str, limits: &[(&str, f64)]) {
    let (one, other) = (last_row(one), last_row(other));
    assert_rows_agree("walls", [&one, &other], limits);
}

/// A coated block by Newton's method, by dynamic relaxation, and at rest after a damped motion.
#[test]
fn coated_solids_stand_where_every_solver_puts_them() {
    let relaxed = coated("solver = 'quasi-static'\nload-steps = 4\ntolerance = 1e-9", "hex8", "", CAPSULE);
    let newton = coated("solver = 'static'\nload-steps = 4\ntolerance = 1e-10", "hex8", "", CAPSULE);
    compare(&newton, &relaxed, &[("displacement", 1e-6), ("membrane-force", 1e-5), ("reaction.", 1e-5)]);
    for solver in ["solver = 'explicit'", "solver = 'implicit'\nstep = 0.05\ntolerance = 1e-10"] {
        let moving = coated(solver, "hex8", "damping = 40", CAPSULE)
            .replace("until = 1", "until = 4")
            .replace("every = 1", "every = 4");
        compare(&newton, &moving, &[("displacement", 1e-5), ("membrane-force", 1e-4)]);
    }
}

/// A resumed run of a coated solid with a law that relaxes, in single precision.
#[test]
fn a_resumed_run_of_a_coated_solid_ends_in_the_same_bits() {
    let relaxing = CAPSULE.replace(
        "poisson-ratio = 0.5\n",
        "poisson-ratio = 0.5\nprony = [{ part = 'isochoric', weight = 0.4, time = 0.2 }]\n",
    );
    for solver in ["precision = 'single'\nstep = 1e-4", "solver = 'quasi-static'\nstep = 0.1"] {
        resumes(&coated(&format!("{solver}\ncheckpoint = {{ every = 0.4 }}"), "tet4", "", &relaxing));
    }
}

/// A wall of the same thickness and linear elasticity, as membrane and as shell without and with bending,
/// which is next to nothing here.
#[test]
fn a_shell_on_a_solid_is_a_membrane_with_bending() {
    let solver = "solver = 'static'\nload-steps = 4\ntolerance = 1e-10";
    let linear = CAPSULE.replace("neo-hookean", "st-venant-kirchhoff").replace("= 0.5", "= 0.3");
    let small = |capsule: &str| {
        coated(solver, "hex8", "", capsule)
            .replace("angle = 0.3", "angle = 0.003")
            .replace("pressure = 400", "pressure = 4")
            .replace("-9.81", "-0.1")
            .replace(
                "'capsule', at = [0.05, 0.05, 0.03], data = ['displacement', 'membrane-force']",
                "'capsule', at = [0.05, 0.05, 0.03]",
            )
    };
    let as_shell = |element: &str| {
        small(
            &linear.replace("on = 'block'", &format!("on = 'block'\nmodel = 'shell'\nelement = '{element}'")),
        )
    };
    compare(&small(&linear), &as_shell("membrane"), &[("displacement", 2e-3)]);
    // Bending of 1 mm of 0.2 MPa beside 50 mm of 10 kPa.
    compare(&small(&linear), &as_shell("dkt-cst"), &[("displacement", 0.02)]);
    // A wall of a tenth of the height, pressed: what bends less gives way less.
    let pressed = |element: &str| {
        let text = as_shell(element)
            .replace("angle = 0.003", "angle = 0")
            .replace("thickness = 1e-3", "thickness = 5e-3");
        last_row(&text)["probe.c.displacement.z"]
    };
    let [slack, stiff] = [pressed("membrane"), pressed("dkt-cst")];
    assert!(slack < 0.0 && stiff < 0.0 && stiff > 0.97 * slack, "{stiff} m and {slack} m");
}

#[test]
fn a_wall_is_written_with_its_own_fields_and_the_whole_mass_is_that_of_both() {
    let fields = "[output.fields]\ntype = 'vtu'\non = 'capsule'\nevery = 1\n\
        data = ['displacement', 'membrane-force', 'cauchy-stress', 'current-thickness', 'von-mises', 'green-strain']\n\
        [output.both]\ntype = 'vtu'\nevery = 1\ndata = ['displacement', 'membrane-force', 'von-mises']\n";
    let part = CAPSULE.replace("thickness = 1e-3", "thickness = 1e-3\nfaces = { set = 'z-max' }");
    for solver in ["solver = 'quasi-static'\nload-steps = 2", "solver = 'static'\nload-steps = 2"] {
        let text = coated(solver, "hex8", "", &part).replace("probes.d", "#") + fields;
        let out = tempfile::tempdir().unwrap();
        let summary = run(&text, out.path());
        let frame = |name: &str| {
            let files = fs::read_dir(out.path().join(name)).unwrap().map(|entry| entry.unwrap().path());
            io::read(&files.max().unwrap()).unwrap().mesh
        };
        let capsule = frame("fields");
        let triangles = capsule.block(CellKind::Triangle).unwrap();
        assert_eq!((capsule.points.len(), triangles.len()), (15, 16));
        for (name, components) in
            [("membrane-force", 9), ("cauchy-stress", 9), ("current-thickness", 1), ("green-strain", 9)]
        {
            let data = &triangles.data[name];
            assert!(data.components == components && data.values.iter().all(|x| x.is_finite()), "{name}");
        }
        // Force per length over thickness is stress.
        for cell in 0..16 {
            let force = triangles.data["membrane-force"].item(cell)[0];
            let stress = triangles.data["cauchy-stress"].item(cell)[0];
            let thickness = triangles.data["current-thickness"].item(cell)[0];
            assert!((force / thickness - stress).abs() < 1e-9 * stress.abs());
        }
        let both = frame("both");
        assert!(both.block(CellKind::Hex).is_some() && both.block(CellKind::Triangle).unwrap().len() == 16);
        let [block, wall] = [&summary.bodies[0], &summary.bodies[1]];
        assert_eq!((block.name.as_str(), wall.name.as_str()), ("block", "capsule"));
        assert!((wall.mass - 1100.0 * 1e-3 * 0.1 * 0.05).abs() < 1e-12, "{}", wall.mass);
        assert!((block.mass - 1000.0 * 0.1 * 0.05 * 0.05).abs() < 1e-12, "{}", block.mass);
        assert!((summary.mass - block.mass - wall.mass).abs() < 1e-12 && summary.nodes == 45);
    }
}

/// A sheet of rubber as a body of its own, pulled by an eighth, agrees with the closed form. It carries a
/// probe and a surface.
#[test]
fn a_sheet_by_itself_is_pulled_as_in_closed_form() {
    let sheet = |solver: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{solver}\n[law.rubber]\ntype = 'neo-hookean'\nyoung-modulus = 3e6\npoisson-ratio = 0.5\n\
             [body.sheet]\nmodel = 'membrane'\nmesh = {{ plate = {{ size = [0.1, 0.1], cells = [4, 4] }} }}\nlaw = 'rubber'\n\
             density = 1000\nthickness = 1e-3\n\
             [surface.mark]\non = 'sheet'\nmesh = {{ plate = {{ size = [0.04, 0.04], cells = [2, 2] }}, at = [0.03, 0.03, 0] }}\n\
             [constraint.flat]\ntype = 'fix'\nbody = 'sheet'\nnodes = 'all'\ncomponents = ['z']\n\
             [constraint.side]\ntype = 'fix'\nbody = 'sheet'\nnodes = {{ set = 'x-min' }}\ncomponents = ['x']\n\
             [constraint.base]\ntype = 'fix'\nbody = 'sheet'\nnodes = {{ set = 'y-min' }}\ncomponents = ['y']\n\
             [constraint.pull]\ntype = 'move'\nbody = 'sheet'\nnodes = {{ set = 'x-max' }}\ncomponents = ['x']\nby = [0.05, 0, 0]\nto = 1\n\
             [output.history]\ntype = 'csv'\nevery = 1\n\
             probes.mark = {{ on = 'mark', at = [0.05, 0.05, 0] }}\n\
             probes.middle = {{ on = 'sheet', at = [0.05, 0.05, 0], data = ['displacement', 'current-thickness', 'cauchy-stress'] }}\n"
        )
    };
    for solver in
        ["solver = 'quasi-static'\ntolerance = 1e-9", "solver = 'static'\nload-steps = 2\ntolerance = 1e-10"]
    {
        let row = last_row(&sheet(solver));
        let stretch = 1.5_f64;
        // P = μ (λ − λ⁻²) on 1 mm × 100 mm.
        let force = 1e6 * (stretch - stretch.powi(-2)) * 1e-4;
        assert!((row["reaction.pull.x"] / force - 1.0).abs() < 1e-6, "{}", row["reaction.pull.x"]);
        assert!((row["probe.middle.displacement.x"] - 0.025).abs() < 1e-8);
        assert!((row["probe.middle.current-thickness"] / (1e-3 / stretch.sqrt()) - 1.0).abs() < 1e-6);
        let stress = 1e6 * (stretch * stretch - 1.0 / stretch);
        assert!((row["probe.middle.cauchy-stress.xx"] / stress - 1.0).abs() < 1e-6);
        for axis in ["x", "y", "z"] {
            let [mark, middle] =
                ["mark", "middle"].map(|name| row[&format!("probe.{name}.displacement.{axis}")]);
            assert!((mark - middle).abs() < 1e-9, "{axis}: {mark} {middle}");
        }
    }
}

const EXPLICIT: &str = "solver = 'explicit'";
const ON: &str = "on = 'block'";

/// The coated block with another text in place of one of its capsule.
fn with(from: &str, to: &str) -> String {
    coated(EXPLICIT, "hex8", "", &CAPSULE.replace(from, to))
}

#[test]
fn walls_on_what_is_no_solid_of_theirs_are_refused_by_name() {
    for (text, pieces) in [
        (with(ON, "on = 'blok'"), ["there is no body `blok`", "did you mean `block`?"]),
        (with(ON, "on = 'capsule'"), ["`capsule` would be a wall on itself", "name a solid"]),
        (with(ON, "on = 'block'\nfaces = { set = 'top' }"), ["top", "x-max"]),
        (
            with(
                "thickness = 1e-3\n",
                "thickness = 1e-3\n[body.film]\non = 'capsule'\nlaw = 'capsule'\ndensity = 1\nthickness = 1e-4\n",
            ),
            ["is of model `membrane`", "walls do not lie on walls"],
        ),
        (
            with(
                "[law.capsule]",
                "[participant.a]\nbodies = ['block']\n[participant.b]\nbodies = ['capsule']\n[law.capsule]",
            ),
            ["whose nodes it shares, with `a`", "name both in one participant"],
        ),
        (with("on = 'block'\n", ""), ["missing key `mesh` in `body.capsule`", "`on`"]),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn keys_that_walls_lack_or_do_not_have_are_refused_by_name() {
    for (text, pieces) in [
        (
            with(ON, "on = 'block'\nmesh = { plate = { size = [1, 1] }, edge = 1 }"),
            ["has a mesh of its own", "leave `mesh` out"],
        ),
        (with(ON, "on = 'block'\nmodel = 'solid'"), ["where a solid has no place", "`model = \"membrane\"`"]),
        (with(ON, "on = 'block'\nmodel = 'shell'"), ["is a shell on `block`", "`solver = \"implicit\"`"]),
        (with(ON, "on = 'block'\nelement = 'dkt-opt'"), ["has one element only", "leave `element` out"]),
        (
            with(ON, "on = 'block'\ndamping = 1"),
            ["`damping` is for a body with nodes of its own", "remove it"],
        ),
        (with("thickness = 1e-3", "thickness = 0"), ["thickness", "greater than 0"]),
        (with("thickness = 1e-3\n", ""), ["needs a `thickness`", "add `thickness"]),
        (
            with(
                "[body.capsule]",
                "[load.weight]\ntype = 'gravity'\non = 'capsule'\nacceleration = [0, 0, 1]\n[body.capsule]",
            ),
            ["has no nodes of its own", "name that body"],
        ),
    ] {
        assert_refused(&text, &pieces);
    }
}

#[test]
fn laws_that_no_wall_can_have_are_refused_by_name() {
    for (text, pieces) in [
        (
            with("'neo-hookean'", "'st-venant-kirchhoff'"),
            ["has no version that keeps the volume", "below 0.5"],
        ),
        (
            with(
                "poisson-ratio = 0.5\n",
                "poisson-ratio = 0.5\nprony = [{ part = 'volumetric', weight = 0.5, time = 1 }]\n",
            ),
            ["relaxes in volume", "`part = \"isochoric\"`"],
        ),
        (
            with(
                "type = 'neo-hookean'\nyoung-modulus = 2e5\npoisson-ratio = 0.5",
                "type = 'transversely-isotropic'\nyoung-modulus = 2e5\npoisson-ratio = 0.5\nfibre-modulus = 1e5\nfibre = [0, 0, 1]",
            ),
            ["stands across the wall", "another direction"],
        ),
        (
            coated(EXPLICIT, "hex8", "", CAPSULE).replace("poisson-ratio = 0.45", "poisson-ratio = 0.5"),
            ["keeps the volume exactly", "0.49 or less"],
        ),
    ] {
        assert_refused(&text, &pieces);
    }
}
