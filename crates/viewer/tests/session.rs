//! A session without a window. A scene is played on its own thread, picked, pulled and pinned. Replays repeat
//! the actions.

mod support;

use std::sync::Arc;
use std::time::{Duration, Instant};

use pliant_format::tables::ViewTable;
use pliant_geometry::{CellLabel, Vector3};
use pliant_picture::{Camera, Projection, Subject};
use pliant_run::Column;
use pliant_scene::World;
use pliant_sim::StopFlag;
use pliant_testing::pressed_cube;
use pliant_viewer::{
    Done, Frame, Hand, Lags, Number, Order, Point, Recording, Sample, Samples, Session, Which, parameters,
    pick, replay, replay_in_real_time, with_numbers,
};
use support::{BALL, shell, subject, wait, world};

/// A triangle at the far end from the base.
fn tip(subject: &Subject) -> Point {
    let middle = |t: [u32; 3]| t.map(|p| subject.points[p as usize].x).iter().sum::<f64>();
    let triangles = subject.triangles().map(middle).zip(0..);
    let (_, triangle) = triangles.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    Point { triangle, weights: [0.5, 0.25, 0.25] }
}

#[test]
fn a_hundred_known_pixels_pick_the_right_triangles() {
    let world = world(BALL);
    let subject = subject(&world);
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let mut camera = Camera { projection, azimuth: 30.0, ..Camera::default() };
        camera.fit(&subject.points, 1.6);
        let mut picked = 0;
        for (corners, triangle) in subject.triangles().zip(0..) {
            let [a, b, c] = corners.map(|point| subject.points[point as usize]);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(&(c - a)).normalize());
            // On a convex body the points that face the eye are visible.
            let (from, along) = camera.ray(camera.place(&middle, 1.6).unwrap(), 1.6);
            if normal.dot(&along) > -0.2 {
                continue;
            }
            let (point, place) =
                pick(&subject, &subject.points, &from, &along, |_| true).expect("a triangle");
            assert_eq!(point.triangle, triangle);
            assert!(
                (place - middle).norm() < 1e-9 && point.weights.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-6)
            );
            picked += 1;
        }
        assert!(picked >= 100, "only {picked} triangles face the eye");
        let (from, along) = camera.ray([-0.999, 0.999], 1.6);
        assert!(
            pick(&subject, &subject.points, &from, &along, |_| true).is_none(),
            "nothing is in the corner"
        );
    }
}

#[test]
fn what_is_taken_away_by_a_section_is_not_picked() {
    let subject = subject(&world(BALL));
    let (from, along) = (Vector3::new(0.5, 0.001, 0.002), -Vector3::x());
    let (_, near) = pick(&subject, &subject.points, &from, &along, |_| true).unwrap();
    let (_, far) = pick(&subject, &subject.points, &from, &along, |point| point.x < 0.0).unwrap();
    assert!(near.x > 0.04 && far.x < -0.04);
}

#[test]
fn hidden_labels_show_what_lies_inside_and_are_repeated() {
    let brain = BALL
        .lines()
        .map(|line| if line.starts_with("mesh") { "mesh = { organ = 'brain', edge = 0.012 }" } else { line })
        .collect::<Vec<_>>();
    let world = world(&brain.join("\n"));
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    let whole = wait(&mut session, |frame| !frame.points.is_empty());
    let hide = vec![CellLabel::Name("tissue".into())];
    session.order(Order::Show(Box::new(ViewTable { hide, ..world.scene.view.clone() })));
    let count = whole.subject.triangle_count();
    let inside = wait(&mut session, |frame| frame.subject.triangle_count() != count);
    let reach = |frame: &Frame| {
        let points = frame.subject.surface_points();
        points.iter().map(|&point| frame.points[point as usize].norm()).fold(0.0, f64::max)
    };
    assert!(inside.subject.triangle_count() > 0 && reach(&inside) < reach(&whole));
    session.order(Order::Step(3));
    wait(&mut session, |frame| frame.steps == 3);
    let recording = session.end().unwrap();
    assert_eq!(Recording::from_bytes(&recording.to_bytes().unwrap()).unwrap(), recording);
    assert!(matches!(&recording.moves[0].done, Done::Surface(surface) if surface.hide == ["tissue"]));
    replay(&world, &recording).unwrap();
}

#[test]
fn it_plays_stands_still_steps_and_starts_anew() {
    let mut session = Session::start(world(BALL), || ()).unwrap();
    let first = wait(&mut session, |frame| !frame.points.is_empty());
    assert_eq!((first.steps, first.playing), (0, false));
    session.order(Order::Step(3));
    wait(&mut session, |frame| frame.steps == 3);
    session.order(Order::Play(true));
    let going = wait(&mut session, |frame| frame.playing && frame.steps > 30 && frame.real_time_factor > 0.0);
    assert!(going.step_seconds > 0.0 && going.prepare_seconds > 0.0 && going.possible_factor > 0.0);
    session.order(Order::Play(false));
    let still = wait(&mut session, |frame| !frame.playing);
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(session.look().1.steps, still.steps);
    session.order(Order::Reset);
    wait(&mut session, |frame| frame.steps == 0 && frame.time == 0.0);
}

#[test]
fn simulated_time_follows_wall_time_and_not_faster_than_asked() {
    let mut session = Session::start(world(BALL), || ()).unwrap();
    session.order(Order::Speed(0.1));
    session.order(Order::Play(true));
    let started = Instant::now();
    wait(&mut session, |frame| frame.time > 0.02);
    // A tenth of real time: 0.02 s take 0.2 s at the least.
    assert!(started.elapsed() > Duration::from_millis(180), "{:?}", started.elapsed());
}

#[test]
fn the_hand_pulls_with_its_spring_and_the_base_holds_against_it() {
    let world = world(BALL);
    let tip = tip(&subject(&world));
    let mut session = Session::start(world, || ()).unwrap();
    session.order(Order::Record);
    let first = wait(&mut session, |frame| !frame.points.is_empty());
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    let taken = wait(&mut session, |frame| frame.held.len() == 1);
    let [point, force] = taken.held[0].map(Vector3::from);
    assert!(force.norm() < 1e-9, "it pulls from where it was taken");
    let place = point + Vector3::new(0.01, 0.0, 0.005);
    session.order(Order::Hand(Hand::Pull(place.into())));
    session.order(Order::Step(3000));
    let pulled = wait(&mut session, |frame| frame.steps == 3000);
    let [point, force] = pulled.held[0].map(Vector3::from);
    assert!((force - (place - point) * 20.0).norm() < 1e-9 * force.norm());
    assert!(force.norm() > 0.01, "{force:?}");
    assert_ne!(pulled.points, first.points);
    session.order(Order::Hand(Hand::Release));
    wait(&mut session, |frame| frame.held.is_empty());
    let recording = session.end().unwrap();
    assert_eq!((recording.steps, recording.moves.len()), (3000, 3));

    // Two replays give the same bits, and the force of the hand equals the reaction at the base.
    let world = support::world(BALL);
    let mut held = recording;
    held.moves.pop();
    let once = replay(&world, &held).unwrap();
    assert_eq!(once, replay(&world, &held).unwrap());
    let [_, force] = once.held.unwrap().map(Vector3::from);
    let base = Vector3::from(once.reactions[0]);
    assert!((force + base).norm() < 1e-3 * force.norm(), "{force:?} {base:?}");
    let again = pliant_viewer::Recording::from_bytes(&held.to_bytes().unwrap()).unwrap();
    assert_eq!(again, held);
}

#[test]
fn pins_hold_what_is_pulled() {
    let world = world(BALL);
    let tip = tip(&subject(&world));
    let pulled = |pinned: bool| {
        let mut session = Session::start(world.clone(), || ()).unwrap();
        if pinned {
            session.order(Order::Hand(Hand::Pin(tip)));
        }
        session.order(Order::Hand(Hand::Take(tip, 10.0)));
        let taken = wait(&mut session, |frame| frame.held.len() == 1 + usize::from(pinned));
        let [point, _] = taken.held[0].map(Vector3::from);
        session.order(Order::Hand(Hand::Pull((point + Vector3::new(0.01, 0.0, 0.0)).into())));
        session.order(Order::Step(3000));
        let frame = wait(&mut session, |frame| frame.steps == 3000);
        if pinned {
            session.order(Order::Hand(Hand::Unpin(0)));
            wait(&mut session, |frame| frame.held.len() == 1);
        }
        (Vector3::from(frame.held[0][0]) - point).norm()
    };
    let (free, pinned) = (pulled(false), pulled(true));
    assert!(pinned < 0.5 * free, "{pinned} m pinned, {free} m free");
}

#[test]
fn a_run_that_breaks_tells_body_and_element_and_keeps_the_last_good_picture() {
    let text = format!(
        "{BALL}[constraint.crush]\ntype = 'move'\nbody = 'ball'\nby = [-0.2, 0, 0]\nto = 0.02\n\
         nodes = {{ half-space = {{ point = [0.03, 0, 0], normal = [1, 0, 0] }} }}\n"
    );
    let mut session = Session::start(world(&text), || ()).unwrap();
    session.order(Order::Play(true));
    let broken = wait(&mut session, |frame| frame.failure.is_some());
    let message = broken.failure.clone().unwrap();
    let element = message.split("element ").nth(1).and_then(|rest| rest.split(' ').next());
    assert!(message.contains("`ball`") && element.is_some_and(|e| e.parse::<u32>().is_ok()), "{message}");
    let (_, remedy) = message.split_once("; ").expect("a remedy");
    assert!(remedy.contains("step") || remedy.contains("mesh"), "{message}");
    assert!(!broken.playing && !broken.points.is_empty());
    assert!(broken.points.iter().all(|point| point.iter().all(|x| x.is_finite())));
    session.order(Order::Reset);
    wait(&mut session, |frame| frame.failure.is_none() && frame.steps == 0);
}

/// A run that breaks by itself goes back and continues with halved steps. A replay gives the same bits.
#[test]
fn a_run_whose_step_fails_goes_back_and_halves_its_steps() {
    let world = world(&pressed_cube(3.003));
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    session.order(Order::Step(4000));
    let back = wait(&mut session, |frame| frame.note.is_some() || frame.failure.is_some());
    let note = back.note.unwrap();
    assert!(note.contains("the run went back to t = ") && note.contains("halved its steps"), "{note}");
    assert_eq!((back.failure, back.breaks), (None, 0));
    // The kept state but one before the pressing at 3 s.
    assert!(back.time > 2.0 && back.time < 3.0, "{} s", back.time);
    session.order(Order::Step(2000));
    let end = wait(&mut session, |frame| frame.time > 3.999 || frame.failure.is_some());
    assert_eq!((end.failure, end.breaks), (None, 0));
    let mut samples = Samples::default();
    session.samples().for_each(|sample| samples.take(sample));
    let times: Vec<f64> = samples.curve(0).map(|[time, _]| time).collect();
    assert!(times.is_sorted_by(|a, b| a < b) && times.len() > 700, "each instant once");
    let recording = session.end().unwrap();
    assert_eq!(recording.moves.iter().filter(|then| then.done == Done::Halve).count(), 1);
    assert_eq!(replay(&world, &recording).unwrap(), replay(&world, &recording).unwrap());
}

/// A pull that tears the ball does not end the run. The run goes back to an earlier state, where the hand
/// lets go, and continues. A replay gives the same bits, and contains the break.
#[test]
fn a_pull_that_breaks_a_run_is_undone() {
    let world = world(BALL);
    let subject = subject(&world);
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    session.order(Order::Step(300));
    session.order(Order::Hand(Hand::Take(tip(&subject), 1e6)));
    let taken = wait(&mut session, |frame| !frame.held.is_empty());
    let place = Vector3::from(taken.held[0][0]);
    for pull in 1..=200 {
        let place = place + Vector3::x() * 0.05 * f64::from(pull);
        session.order(Order::Hand(Hand::Pull(place.into())));
        session.order(Order::Step(20));
    }
    let broken = wait(&mut session, |frame| frame.breaks > 0).clone();
    session.order(Order::Step(50));
    let after = wait(&mut session, |frame| !frame.playing && frame.number > broken.number + 2).clone();
    assert_eq!((&broken.failure, &after.failure), (&None, &None));
    assert!(after.held.is_empty() && after.points.iter().all(|point| point.iter().all(|x| x.is_finite())));
    let note = after.note.unwrap();
    assert!(note.starts_with("the hand let go, and the run went back to t = "), "{note}");
    let recording = session.end().unwrap();
    let [once, twice] = [(); 2].map(|()| replay(&world, &recording).unwrap());
    assert_eq!(once, twice);
    assert_eq!(once.breaks.len() as u64, after.breaks);
    let [at, back] = once.breaks[0].times;
    println!("broke at {at} s, went back to {back} s: {}", once.breaks[0].message);
    assert!(at > back && at - back < 0.6);
}

/// The hand pulls with its stiffness times two edges at most, also while the body gives way. After undo, the
/// run continues from before the pull with the bits of an undisturbed run. A picked point shows its position
/// and the data of its place.
#[test]
fn a_pull_is_taken_back_and_a_picked_point_is_read() {
    let world = world(BALL);
    let tip = tip(&subject(&world));
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    session.order(Order::Probe(tip));
    session.order(Order::Step(1500));
    let free = wait(&mut session, |frame| frame.steps == 1500).clone();
    let picked = &free.followed[0];
    assert!(picked.about.starts_with("ball, element "), "{}", picked.about);
    assert!(picked.place.x > 0.04 && picked.value.is_some_and(|value| value >= 0.0), "{picked:?}");
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    session.order(Order::Hand(Hand::Pull([0.2, 0.0, 0.0])));
    session.order(Order::Step(500));
    let pulled = wait(&mut session, |frame| frame.steps == 2000).clone();
    assert!(pulled.followed[0].place.x > picked.place.x);
    session.order(Order::Back(1500));
    let back = wait(&mut session, |frame| frame.steps <= 1500).clone();
    assert!(back.held.is_empty() && back.time <= free.time && back.failure.is_none());
    session.order(Order::Step(2000 - back.steps));
    let after = wait(&mut session, |frame| frame.steps == 2000).clone();
    let mut other = Session::start(world.clone(), || ()).unwrap();
    other.order(Order::Step(2000));
    assert_eq!(after.points, wait(&mut other, |frame| frame.steps == 2000).points);
    let recording = session.end().unwrap();
    assert!(recording.breaks.is_empty() && replay(&world, &recording).unwrap().held.is_none());
}

/// Undo of an old pull does not go to the start. It goes back before the pull by at most a part of the steps
/// since.
#[test]
fn a_pull_of_long_ago_is_taken_back_without_going_to_the_start() {
    let mut session = Session::start(world(BALL), || ()).unwrap();
    for pulled in [3000, 9000] {
        let steps = wait(&mut session, |frame| !frame.playing).steps;
        session.order(Order::Step(2 * pulled - steps));
        wait(&mut session, |frame| frame.steps == 2 * pulled);
        session.order(Order::Back(pulled));
        let back = wait(&mut session, |frame| frame.steps < 2 * pulled);
        assert!((pulled / 2..=pulled).contains(&back.steps), "back at step {} of {pulled}", back.steps);
    }
    // Step by step, it ends at the oldest kept state, and says so.
    loop {
        let now = session.look().1.clone();
        session.order(Order::Back(now.steps.saturating_sub(1)));
        let back = wait(&mut session, |frame| frame.number > now.number);
        assert!(back.steps > 0);
        if back.steps == now.steps {
            assert!(back.note.unwrap().contains("the oldest kept state"));
            break;
        }
    }
}

/// A number that breaks the run at once is taken back. The run continues from the same state with the earlier
/// numbers.
#[test]
fn numbers_that_ruin_a_run_are_taken_back() {
    let world = calm();
    let tip = tip(&subject(&world));
    for ruin in [number("body.ball.density", 1e-6), number("law.tissue.young-modulus", 1e12)] {
        let mut session = Session::start(world.clone(), || ()).unwrap();
        session.order(Order::Record);
        let [held, _] = pull(&mut session, tip, 600);
        change(&session, &world, &[ruin]);
        session.order(Order::Play(true));
        let refused = wait(&mut session, |frame| frame.failure.is_some() || frame.refusals == 1);
        assert_eq!((refused.failure, refused.numbers.len()), (None, 0));
        let note = refused.note.unwrap();
        assert!(note.contains("the former numbers are back") && note.contains("is inverted"), "{note}");
        session.order(Order::Play(false));
        let after = wait(&mut session, |frame| !frame.playing);
        assert!(after.steps >= 600 && (after.hand(Which::First).unwrap()[0][0] - held.x).abs() < 1e-2);
        let recording = session.end().unwrap();
        assert_eq!((recording.moves.len(), recording.breaks.len()), (2, 0), "a pull, and no number");
        replay(&world, &recording).unwrap();
    }
}

/// A recording is written each second, whole, and not only when the window closes.
#[test]
fn a_recording_is_written_while_it_grows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drag");
    let world = world(BALL);
    let tip = tip(&subject(&world));
    let session = Session::start(world, || ()).unwrap();
    session.order(Order::RecordTo(path.clone()));
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    session.order(Order::Play(true));
    let began = Instant::now();
    let written = || Recording::from_bytes(&std::fs::read(&path).ok()?).ok();
    while written().is_none_or(|recording| recording.moves.is_empty()) {
        assert!(began.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(written().unwrap().moves.len(), 1);
    assert!(Recording::try_path(&path).is_ok() && written().is_some(), "a try leaves the file as it is");
    for wrong in [folder.path().to_owned(), folder.path().join("nowhere/drag")] {
        assert!(Recording::try_path(&wrong).is_err());
    }
}

#[test]
fn the_force_of_a_hand_has_a_limit() {
    let world = world(BALL);
    let subject = subject(&world);
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    session.order(Order::Hand(Hand::Take(tip(&subject), 20.0)));
    let taken = wait(&mut session, |frame| !frame.held.is_empty());
    let place = Vector3::from(taken.held[0][0]);
    session.order(Order::Hand(Hand::Pull((place + Vector3::x()).into())));
    let mut forces = Vec::new();
    for steps in 1..=40 {
        session.order(Order::Step(10));
        let frame = wait(&mut session, |frame| frame.steps >= 10 * steps);
        forces.push(Vector3::from(frame.held[0][1]).norm());
    }
    let (least, most) = forces.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &f| (a.min(f), b.max(f)));
    let edge = 0.012;
    println!("{least} to {most} N, {} edges times 20 N/m", most / 20.0 / edge);
    assert!(least > 0.97 * most && most < 20.0 * 2.0 * 1.5 * edge, "{least} to {most} N");
    let recording = session.end().unwrap();
    let [once, twice] = [(); 2].map(|()| replay(&world, &recording).unwrap());
    assert_eq!(once, twice);
    assert!((once.largest_force / most - 1.0).abs() < 1e-2, "{} N", once.largest_force);
}

fn number(path: &str, value: f64) -> Number {
    Number { path: path.split('.').map(str::to_owned).collect(), value }
}

fn change(session: &Session, world: &World, numbers: &[Number]) {
    let other = with_numbers(&world.scene, numbers).unwrap();
    session.order(Order::Change(Box::new(other), numbers.to_vec()));
}

/// The ball, so damped that it comes to rest soon.
fn calm() -> World {
    world(&BALL.replace("damping = 60", "damping = 150"))
}

/// Pulls at the tip until the ball is at rest; the point held [m] and the force [N].
fn pull(session: &mut Session, tip: Point, steps: u64) -> [Vector3; 2] {
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    session.order(Order::Hand(Hand::Pull([0.06, 0.0, 0.01])));
    session.order(Order::Step(steps));
    wait(session, |frame| frame.steps == steps).held[0].map(Vector3::from)
}

#[test]
fn a_law_made_stiffer_while_it_is_pulled_ends_as_if_it_had_been_from_the_start() {
    let (soft, stiffer) = (calm(), [number("law.tissue.young-modulus", 20e3)]);
    let tip = tip(&subject(&soft));
    let mut session = Session::start(soft.clone(), || ()).unwrap();
    session.order(Order::Record);
    let [point, force] = pull(&mut session, tip, 3000);
    change(&session, &soft, &stiffer);
    session.order(Order::Step(6000));
    let after = wait(&mut session, |frame| frame.steps == 9000);
    assert_eq!((after.failure, after.note), (None, None));
    let [held, pulls] = after.held[0].map(Vector3::from);
    assert!(pulls.norm() > 1.1 * force.norm() && (held - point).norm() > 1e-4, "{force:?} {pulls:?}");
    let mut other = Session::start(with_numbers(&soft.scene, &stiffer).unwrap(), || ()).unwrap();
    let [expected, _] = pull(&mut other, tip, 6000);
    // Motion that remains after the damping.
    assert!((held - expected).norm() < 1e-6, "{held:?} {expected:?}");

    // The replay gives the same bits, with the change in its place.
    let recording = session.end().unwrap();
    assert!(recording.moves.iter().any(|then| then.done == Done::Numbers(stiffer.to_vec())));
    let once = replay(&soft, &recording).unwrap();
    assert_eq!(once, replay(&soft, &recording).unwrap());
    assert_eq!(once.held.unwrap().map(|x| x.map(f64::to_bits)), after.held[0].map(|x| x.map(f64::to_bits)));
}

#[test]
fn a_change_to_the_same_numbers_changes_no_bit() {
    let world = calm();
    let tip = tip(&subject(&world));
    let ended = |changed: bool| {
        let mut session = Session::start(world.clone(), || ()).unwrap();
        session.order(Order::Hand(Hand::Take(tip, 20.0)));
        session.order(Order::Hand(Hand::Pull([0.06, 0.0, 0.01])));
        for _ in 0..20 {
            session.order(Order::Step(25));
            if changed {
                change(&session, &world, &[number("law.tissue.young-modulus", 5e3)]);
            }
        }
        wait(&mut session, |frame| frame.steps == 500).points
    };
    assert_eq!(ended(false), ended(true));
}

#[test]
fn numbers_that_cannot_be_are_refused_in_the_words_of_the_scene() {
    let world = calm();
    let refused = with_numbers(&world.scene, &[number("law.tissue.young-modulus", -1.0)]).unwrap_err();
    assert!(refused.contains("young-modulus") && refused.contains("-1"), "{refused}");
    let numbers = parameters(&world.scene);
    let paths: Vec<String> = numbers.iter().map(|parameter| parameter.number.path.join(".")).collect();
    assert_eq!(
        paths,
        ["law.tissue.young-modulus", "law.tissue.poisson-ratio", "body.ball.density", "body.ball.damping"]
    );
    assert_eq!((numbers[0].number.value, numbers[0].unit.as_str()), (5e3, "Pa"));
    assert!(numbers.iter().all(|parameter| !parameter.meaning.is_empty()));
}

#[test]
fn another_mesh_starts_anew_and_says_so() {
    let mut session = Session::start(calm(), || ()).unwrap();
    session.order(Order::Step(10));
    let finer = world(&BALL.replace("edge = 0.012", "edge = 0.01"));
    session.order(Order::Change(Box::new(finer), Vec::new()));
    session.order(Order::Step(1));
    let frame = wait(&mut session, |frame| frame.note.is_some());
    assert!(frame.note.unwrap().contains("starts anew") && frame.steps <= 1);
}

#[test]
fn what_is_sampled_has_names_and_units_and_is_written_once() {
    let text = format!(
        "{BALL}[output.h]\ntype = 'csv'\nevery = 1\nprobes.end = {{ on = 'ball', at = [0.04, 0, 0] }}\n"
    );
    let world = world(&text);
    let world_step = world.step();
    let subject = subject(&world);
    let tip = tip(&subject);
    let mut session = Session::start(world, || ()).unwrap();
    wait(&mut session, |frame| !frame.points.is_empty());
    session.order(Order::Probe(tip));
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    session.order(Order::Hand(Hand::Pull([0.06, 0.0, 0.0])));
    session.order(Order::Step(200));
    let frame = wait(&mut session, |frame| frame.steps == 200);
    let mut samples = Samples::default();
    session.samples().for_each(|sample| samples.take(sample));
    // Each 5 ms of simulated time, whatever the frames are: the start, five steps each, and the end.
    let steps = (0.005 / world_step).round();
    assert_eq!(samples.len(), (200.0 / steps).ceil() as usize + 1);
    let column = |name: &str| samples.columns().iter().position(|column| column.name == name).expect(name);
    let last = |name: &str| samples.curve(column(name)).last().unwrap()[1];
    assert_eq!(last("hand.x"), frame.held[0][1][0]);
    assert_eq!(last("energy.kinetic"), frame.energies.kinetic);
    assert!(last("probe.end.displacement.x") > 1e-4 && last("point.1.displacement.x") > 1e-4);
    assert!(last("reaction.base.x") != 0.0);
    assert!(samples.curve(column("point.1.displacement.x")).next().unwrap()[1].is_nan(), "not yet followed");

    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("ball.toml");
    let path = samples.write_beside(&scene).unwrap();
    assert_eq!(path.file_name().unwrap(), "ball-probes.csv");
    let table = std::fs::read_to_string(&path).unwrap();
    let mut lines = table.lines();
    let header = lines.next().unwrap();
    assert!(
        header.starts_with("time [s],hand.x [N],") && header.contains(",probe.end.displacement.x [m],"),
        "{header}"
    );
    let count = |line: &str| line.split(',').count();
    assert!(lines.clone().count() == samples.len() && lines.all(|line| count(line) == count(header)));
    let again = samples.write_beside(&scene).unwrap();
    assert_eq!(again.file_name().unwrap(), "ball-probes-2.csv");
}

/// Curves do not depend on how often the window looks: two runs of the same steps have the same samples.
#[test]
fn samples_are_those_of_the_run_and_not_of_frames() {
    let taken = |strides: &[u64]| {
        let mut session = Session::start(world(BALL), || ()).unwrap();
        let mut steps = 0;
        for stride in strides {
            session.order(Order::Step(*stride));
            steps += stride;
            wait(&mut session, |frame| frame.steps == steps);
        }
        let samples: Vec<_> =
            session.samples().map(|sample| (sample.time.to_bits(), sample.values)).collect();
        samples
    };
    let [whole, parts] = [taken(&[700]), taken(&[350, 350])];
    assert!(whole.len() > 100 && whole.iter().all(|sample| parts.contains(sample)), "{}", whole.len());
}

#[test]
fn samples_stay_few_however_long_a_run_lasts() {
    let mut samples = Samples::default();
    let column = |name: &str| Column { name: name.into(), unit: "J" };
    let columns: Arc<[Column]> = ["a", "b"].map(column).into();
    for number in 0..100_000 {
        let time = f64::from(number);
        samples.take(Sample { time, columns: Arc::clone(&columns), values: vec![time; 2] });
        assert!(samples.len() <= 4001);
    }
    assert!(samples.len() > 1500);
    let curve: Vec<[f64; 2]> = samples.curve(1).collect();
    assert!(curve.iter().all(|[time, value]| time == value) && curve.is_sorted_by(|a, b| a[0] < b[0]));
}

#[test]
fn a_mouse_is_felt_within_a_frame_and_a_replay_of_it_has_the_same_bits_twice() {
    let world = calm();
    let tip = tip(&subject(&world));
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    session.order(Order::Play(true));
    session.order(Order::Hand(Hand::Take(tip, 20.0)));
    for part in 0..60 {
        std::thread::sleep(Duration::from_millis(8));
        let angle = f64::from(part) * 0.1;
        session.order(Order::Hand(Hand::Pull([0.05 + 0.01 * angle.sin(), 0.0, 0.01 * angle.cos()])));
    }
    wait(&mut session, |frame| frame.input_lag.is_some());
    let recording = session.end().unwrap();
    assert_eq!(recording.moves.len(), 61);
    let bytes = recording.to_bytes().unwrap();
    assert_eq!(Recording::from_bytes(&bytes).unwrap(), recording);
    assert_eq!(replay(&world, &recording).unwrap(), replay(&world, &recording).unwrap());

    let played = replay_in_real_time(&world, &recording, &StopFlag::default()).unwrap();
    let lags = Lags::of(&played);
    println!("{lags:?}");
    assert!(lags.moves >= 60, "{lags:?}");
    assert!(lags.median <= 1.0 / 60.0, "{lags:?}");
}

#[test]
fn hand_and_pins_hold_shells_with_every_solver() {
    for solver in ["implicit", "static", "explicit"] {
        let world = shell(solver);
        let tip = tip(&subject(&world));
        let mut session = Session::start(world, || ()).unwrap();
        session.order(Order::Hand(Hand::Take(tip, 5.0)));
        let taken = wait(&mut session, |frame| frame.held.len() == 1);
        assert_eq!(taken.note, None, "{solver}");
        let [point, _] = taken.held[0].map(Vector3::from);
        let place = point + Vector3::new(0.0, 0.0, 0.005);
        session.order(Order::Hand(Hand::Pull(place.into())));
        session.order(Order::Step(5));
        let frame = wait(&mut session, |frame| frame.steps == 5);
        assert_eq!(frame.failure, None, "{solver}");
        let [_, force] = frame.held[0];
        assert!(force[2] > 0.0, "{solver}: {force:?}");
        session.order(Order::Hand(Hand::Release));
        session.order(Order::Hand(Hand::Pin(tip)));
        let pinned = wait(&mut session, |frame| frame.note.is_none() && frame.held.len() == 1);
        assert_eq!(pinned.failure, None, "{solver}");
        session.order(Order::Reset);
        wait(&mut session, |frame| frame.steps == 0 && frame.time == 0.0);
    }
}

#[test]
fn the_examples_start_and_play() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let entries = std::fs::read_dir(&scenes).unwrap().map(|entry| entry.unwrap());
    let folders = entries.filter(|entry| entry.path().is_dir());
    for name in folders.map(|folder| folder.file_name().into_string().unwrap()) {
        let name = name.as_str();
        let (mut source, folder) = pliant_format::open(&scenes.join(name)).unwrap();
        let settings: &[(&[&str], f64)] = match name {
            "colon" => &[(&["body", "colon", "mesh", "edge"], 0.008)],
            "liver" => {
                &[(&["body", "liver", "mesh", "edge"], 0.04), (&["surface", "skin", "mesh", "edge"], 0.03)]
            }
            _ => &[],
        };
        settings.iter().for_each(|(path, value)| source.set(path, *value).unwrap());
        let steps = if name == "brain-shift" { 2 } else { 5 };
        let mut session = Session::start(support::staged(source, folder), || ()).unwrap();
        session.order(Order::Step(steps));
        let frame = wait(&mut session, |frame| frame.steps == steps);
        assert_eq!((frame.failure, name), (None, name));
    }
}

/// A block on a table, and jaws over it.
const GRASPED: &str = include_str!("support/grasped.toml");

/// Forces of contacts come with the frames if a view asks for them. The forces of the floor carry the weight
/// of the things on it.
#[test]
fn forces_of_contacts_are_shown_where_they_are_asked_for() {
    let world = world(GRASPED);
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Step(2000));
    let before = wait(&mut session, |frame| frame.steps == 2000);
    assert!(before.contacts.is_empty() && world.touches(None));
    session.order(Order::Show(Box::new(ViewTable { contacts: true, ..world.scene.view.clone() })));
    let frame = wait(&mut session, |frame| !frame.contacts.is_empty());
    let up: f64 = frame.contacts.iter().map(|[_, force]| force.z).sum();
    let weight = 0.03 * 0.006 * 0.02 * 1000.0 * 9.81;
    assert!((up / weight - 1.0).abs() < 0.1, "{up} N, weight {weight} N");
    assert!(frame.contacts.iter().all(|[point, _]| frame.points.contains(point)));
}

/// The hand takes a tool at its visible place, closes its jaws, turns and lifts it. Obstacles are not taken.
/// A replay gives the same bits.
#[test]
fn a_tool_is_led_by_hand_and_repeated() {
    let world = world(GRASPED);
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    let first = wait(&mut session, |frame| !frame.points.is_empty());
    let middle = |t: [u32; 3]| t.map(|p| first.points[p as usize]).iter().sum::<Vector3>() / 3.0;
    let at = |wanted: &dyn Fn(Vector3) -> bool| {
        first.subject.triangles().position(|corners| wanted(middle(corners))).unwrap()
    };
    let (floor, jaw) =
        (at(&|place| place.z.abs() < 1e-9 && place.x.min(place.y) < 0.0), at(&|place| place.z > 0.03));
    assert!(
        first.movable.len() == first.subject.triangle_count() && !first.movable[floor] && first.movable[jaw]
    );
    assert!(first.movable[at(&|place| (place.z - 0.02).abs() < 1e-9 && (place.y - 0.003).abs() < 0.003)]);

    let point = Point { triangle: jaw as u32, weights: [1.0 / 3.0; 3] };
    let taken = middle(first.subject.triangles().nth(jaw).unwrap());
    session.order(Order::Hand(Hand::Take(point, 100.0)));
    session.order(Order::Hand(Hand::Open(-0.22)));
    session.order(Order::Step(400));
    let closed = wait(&mut session, |frame| frame.steps == 400);
    assert_eq!(closed.tools, [Some("grasper".to_owned()), None]);
    for step in 1..=20 {
        let place = taken + Vector3::z() * (0.001 * f64::from(step));
        session.order(Order::Hand(Hand::Pull(place.into())));
        session.order(Order::Hand(Hand::Turn([0.0, 0.0, 0.01])));
        session.order(Order::Step(84));
    }
    session.order(Order::Step(2500));
    let steps = 400 + 20 * 84 + 2500;
    let lifted = wait(&mut session, |frame| frame.steps == steps);
    // The point that was taken is where it was led, about which the jaws have turned.
    let [place, force] = lifted.held[0].map(Vector3::from);
    assert!((place - taken - Vector3::z() * 0.02).norm() < 1e-9, "{place:?}");
    let weight = 0.03 * 0.006 * 0.02 * 1000.0 * 9.81;
    assert!((force.z / weight - 1.0).abs() < 0.05, "{force:?} N, weight {weight} N");
    let lowest = (0..264).map(|point| lifted.points[point].z).fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.015, "{lowest} m");
    session.order(Order::Hand(Hand::Release));
    session.order(Order::Step(1));
    assert!(wait(&mut session, |frame| frame.steps == steps + 1).tools == [None, None]);
    let recording = session.end().unwrap();
    let once = replay(&world, &recording).unwrap();
    assert_eq!(once, replay(&world, &recording).unwrap());
    assert!(once.largest_force > 0.9 * weight, "{once:?}");
}

/// Two hands pull at opposite sides of a ball. Each continues while the other one is led or lets go. A replay
/// gives the same bits.
#[test]
fn two_hands_pull_each_on_its_own_and_are_repeated() {
    let world = world(BALL);
    let mut session = Session::start(world.clone(), || ()).unwrap();
    session.order(Order::Record);
    let first = wait(&mut session, |frame| !frame.points.is_empty());
    let place = |t: u32| {
        let corners = first.subject.triangles().nth(t as usize).unwrap();
        corners.map(|p| first.points[p as usize]).iter().sum::<Vector3>() / 3.0
    };
    let count = first.subject.triangle_count() as u32;
    let extreme = |sign: f64| (0..count).max_by(|&a, &b| (sign * place(a).y).total_cmp(&(sign * place(b).y)));
    let sides = [1.0, -1.0].map(|sign| extreme(sign).unwrap());
    let point = |triangle| Point { triangle, weights: [1.0 / 3.0; 3] };
    session.order(Order::Second(Hand::Take(point(sides[1]), 50.0)));
    let frame = wait(&mut session, |frame| frame.held.len() == 1);
    assert_eq!((frame.hands, frame.hand(Which::First)), ([None, Some(0)], None));
    session.order(Order::Hand(Hand::Take(point(sides[0]), 50.0)));
    wait(&mut session, |frame| frame.hands == [Some(0), Some(1)]);
    session.order(Order::Hand(Hand::Pin(point(count / 2))));
    let pull = |t: u32, by: f64| Hand::Pull((place(t) + Vector3::y() * by).into());
    session.order(Order::Hand(pull(sides[0], 0.01)));
    session.order(Order::Second(pull(sides[1], -0.02)));
    session.order(Order::Step(200));
    let both = wait(&mut session, |frame| frame.steps == 200);
    let [up, down] = Which::BOTH.map(|which| both.hand(which).unwrap()[1][1]);
    assert!(up > 0.0 && down < 0.0 && both.pins().len() == 1, "{up} N, {down} N");
    let sample = session.samples().last().unwrap();
    let last =
        |name: &str| sample.values[sample.columns.iter().position(|column| column.name == name).unwrap()];
    assert_eq!([last("hand.y"), last("second-hand.y")], [up, down]);
    session.order(Order::Hand(Hand::Release));
    session.order(Order::Step(50));
    let one = wait(&mut session, |frame| frame.steps == 250);
    assert_eq!((one.hands, one.held.len()), ([None, Some(0)], 2));
    assert!(one.hand(Which::Second).unwrap()[1][1] < 0.0, "the second hand still pulls");
    let recording = session.end().unwrap();
    let once = replay(&world, &recording).unwrap();
    assert_eq!(once, replay(&world, &recording).unwrap());
    let end = one.hand(Which::Second).unwrap();
    assert!(once.held == Some(end) && once.largest_force >= up.max(-down));
    let read = Recording::from_bytes(&recording.to_bytes().unwrap()).unwrap();
    assert_eq!(read, recording);
}

/// A hand keeps the tissue while the other one leads the tool, and takes the tool over.
#[test]
fn a_tool_is_in_one_hand_and_tissue_in_the_other() {
    let mut session = Session::start(world(GRASPED), || ()).unwrap();
    let first = wait(&mut session, |frame| !frame.points.is_empty());
    let middle = |t: [u32; 3]| t.map(|p| first.points[p as usize]).iter().sum::<Vector3>() / 3.0;
    let at = |wanted: &dyn Fn(Vector3) -> bool| {
        let triangle = first.subject.triangles().position(|corners| wanted(middle(corners))).unwrap();
        Point { triangle: triangle as u32, weights: [1.0 / 3.0; 3] }
    };
    let jaw = at(&|place| place.z > 0.03);
    let body = at(&|place| (place.z - 0.02).abs() < 1e-9 && (place.y - 0.003).abs() < 0.003);
    session.order(Order::Second(Hand::Take(jaw, 100.0)));
    session.order(Order::Hand(Hand::Take(body, 20.0)));
    let frame = wait(&mut session, |frame| frame.hands == [Some(0), Some(1)]);
    assert_eq!(frame.tools, [None, Some("grasper".to_owned())]);
    let place = Vector3::from(frame.hand(Which::Second).unwrap()[0]) + Vector3::z() * 0.01;
    session.order(Order::Second(Hand::Pull(place.into())));
    session.order(Order::Step(100));
    let led = wait(&mut session, |frame| frame.steps == 100);
    let place_now = Vector3::from(led.hand(Which::Second).unwrap()[0]);
    assert!((place_now - place).norm() < 1e-9, "{place_now:?} {place:?}");
    assert_eq!(led.tool_triangles.len(), 1, "two jaws are one tool");
    session.order(Order::Hand(Hand::Take(jaw, 100.0)));
    let taken = wait(&mut session, |frame| frame.tools[0].is_some());
    assert_eq!((taken.tools[1].clone(), taken.hands), (None, [Some(0), None]));
}
