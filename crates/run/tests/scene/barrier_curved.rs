//! Contact on the curved surface of shells, from the text of a scene.

use pliant_testing::scenes::{last_row, resumes, world};

use super::barriers::{cloth, pressed};

/// Cloth falls on a ball and on itself by its curved surface. In no step an edge intersects a triangle of the
/// surface, and a resumed run has the same bits.
#[test]
fn cloth_falls_by_its_curved_surface() {
    let text = cloth("").replace("friction = 0.5\n", "friction = 0.5\nsubdivision = 1\n");
    assert!(text.matches("subdivision").count() == 2);
    resumes(&text);
}

/// The force of a ball on a plate comes out at the rim of the plate. The plate has flat triangles or a curved
/// surface, and steps are static or implicit.
#[test]
fn a_plate_bears_a_ball_by_its_curved_surface() {
    let plate = |run: &str, more: &str| {
        format!(
            "[scene]\nuntil = 1\n[run]\n{run}\n\
             [law.rubber]\ntype = 'neo-hookean'\nyoung-modulus = 1e6\npoisson-ratio = 0.4\n\
             [body.plate]\nmodel = 'shell'\nmesh = {{ plate = {{ size = [0.04, 0.04], cells = [6, 6] }} }}\nlaw = 'rubber'\ndensity = 1000\n\
             thickness = 1e-3\ndamping = 100\n\
             [constraint.rim]\ntype = 'fix'\nbody = 'plate'\nnodes = {{ union = [{{ set = 'x-min' }}, {{ set = 'x-max' }}, {{ set = 'y-min' }}, {{ set = 'y-max' }}] }}\n\
             [tool.ball]\nshape = {{ sphere = {{ radius = 0.01 }} }}\nat = [0.021, 0.0195, 0.0107]\nby = [0, 0, -0.004]\nto = 0.5\n\
             [contact.above]\nbetween = ['plate', 'ball']\nfriction = 0.2\nbarrier-distance = 2e-4\ncheck-intersections = true\n{more}\n\
             [output.history]\ntype = 'csv'\nevery = 0.2\n"
        )
    };
    for run in ["solver = 'static'\nload-steps = 20", "solver = 'implicit'\nstep = 0.02"] {
        let forces = ["subdivision = 0", "subdivision = 1", "subdivision = 2"].map(|level| {
            let row = last_row(&plate(run, level));
            let (up, down) = (row["contact.above.z"], row["reaction.rim.z"]);
            println!("{run} {level}: {up} N on the ball, {down} N at the rim");
            // The last has a thousandth of its motion yet to lose.
            assert!(up > 0.1 && (up / down.abs() - 1.0).abs() < 1e-3, "{up} {down}");
            up
        });
        assert_eq!(forces[0], last_row(&plate(run, ""))["contact.above.z"]);
        assert!((forces[2] / forces[1] - 1.0).abs() < (forces[1] / forces[0] - 1.0).abs(), "{forces:?}");
    }
}

#[test]
fn a_curved_surface_that_is_none_is_refused() {
    let with = |run: &str, key: &str| pressed(run, "").replace("check-intersections = true", key);
    let implicit = "solver = 'implicit'\nstep = 0.02";
    for (text, pieces) in [
        (
            with("", "subdivision = 1"),
            ["`subdivision` of a contact is for the solvers `implicit` and `static`", "`explicit`"],
        ),
        (
            with(implicit, "subdivision = 1"),
            ["only shells have a curved surface, and `block` is none", "leave it out"],
        ),
        (
            with(implicit, "subdivision = 3"),
            ["`contact.above.subdivision` must be at least 0 and at most 2, found 3", ""],
        ),
    ] {
        crate::assert_refused(&text, &pieces);
    }
    let coated = pressed(
        implicit,
        "[law.coat]\ntype = 'neo-hookean'\nyoung-modulus = 1e5\npoisson-ratio = 0.4\n\
         [body.coat]\nmodel = 'shell'\nmesh = { plate = { size = [0.04, 0.04], cells = [4, 4] }, at = [0, 0, 0.02] }\n\
         law = 'coat'\ndensity = 1000\nthickness = 5e-4\n[tie.glue]\nbetween = ['coat', 'block']\n",
    )
    .replace("['block', 'ball']\n", "['coat', 'ball']\nthickness = 0\nsubdivision = 1\n");
    let message = world(&coated).err().unwrap();
    assert!(message.contains("of `coat` follows others by a tie"), "{message}");
}
