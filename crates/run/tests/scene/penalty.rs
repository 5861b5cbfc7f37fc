//! Ties between participants: each side at its own step.

use pliant_testing::scenes::{assert_rows_agree, last_row, resumes, run, world};

use super::ties::{coated, vessel};

const SHELL: &str = "model = 'shell'\nelement = 'dkt-cst'";

/// The vessel of the other tests as a shell of its own participant, damped to rest.
fn apart(walls: &str) -> String {
    vessel(
        "solver = 'explicit'",
        &format!("damping = 40\n[participant.walls]\nbodies = ['vessel']\n{walls}"),
        SHELL,
    )
    .replace("thickness = 1e-3", "thickness = 1e-3\ndamping = 40")
    .replace("until = 1", "until = 2")
    .replace("every = 1", "every = 2")
}

#[test]
fn a_vessel_of_another_participant_stands_nearly_where_one_solver_puts_it() {
    let one = last_row(&vessel("solver = 'static'\nload-steps = 4\ntolerance = 1e-10", "", SHELL));
    for walls in ["", "solver = 'implicit'"] {
        let text = apart(walls);
        let out = tempfile::tempdir().unwrap();
        let summary = run(&text, out.path());
        let [tie] = &summary.ties[..] else { panic!("one tie: {:?}", summary.ties) };
        println!("{tie:?}, {:?}", summary.participants.iter().map(|p| p.steps).collect::<Vec<_>>());
        let other = last_row(&text);
        assert_rows_agree(walls, [&one, &other], &[("displacement", 0.02), ("reaction.", 2e-3)]);
        assert!(tie.points == 72 && tie.gap > 0.0 && tie.widest < 5e-4, "{tie:?}");
    }
}

#[test]
fn a_resumed_run_of_participants_that_are_tied_ends_in_the_same_bits() {
    for walls in ["step = 5e-5", "solver = 'implicit'\nstep = 1e-3"] {
        let text = apart(walls).replace("until = 2", "until = 1").replace("every = 2", "every = 1");
        resumes(&text.replace("[run]", "[run]\nstep = 1e-3\ncheckpoint = { every = 0.4 }"));
    }
}

#[test]
fn solvers_that_no_spring_ties_are_refused_with_the_line() {
    let message = |text: &str| world(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
    let quasi_static =
        coated("solver = 'quasi-static'", "cells = [7, 5]", "[participant.coat]\nbodies = ['coat']\n");
    for (text, pieces) in [
        (
            quasi_static,
            ["finds equilibria, which have no steps in common", "put both bodies into one participant"],
        ),
        (
            apart("solver = 'static'"),
            ["`vessel` is free in 6 rigid motions of 6", "participants hold nothing in a static run"],
        ),
        (
            apart("solver = 'implicit'\nstep = 0.01"),
            ["`walls` is implicit with longer steps than `solids`", "give it a `step` of at most"],
        ),
        (
            apart("").replace("['vessel', 'block']", "['vesel', 'block']"),
            ["there is no body `vesel`", "did you mean `vessel`?"],
        ),
        (
            apart("").replace("['vessel', 'block']", "['vessel', 'block']\nnodes = { set = 'nose' }"),
            ["no set is named `nose`", ""],
        ),
    ] {
        let message = message(&text);
        assert!(pieces.iter().all(|piece| message.contains(piece)), "{message}");
    }
}
