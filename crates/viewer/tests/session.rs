//! The window without a window: a scene is played on its own thread, picked, pulled and pinned; what was done is repeated.

mod support;

use std::time::{Duration, Instant};

use pliant_geometry::Vector3;
use pliant_picture::{Camera, Projection, Subject};
use pliant_viewer::{Hand, Order, Point, Session, pick, replay};
use support::{BALL, stage, subject, wait};

/// A triangle at the far end from the base.
fn tip(subject: &Subject) -> Point {
    let middle = |t: [u32; 3]| t.map(|p| subject.points[p as usize].x).iter().sum::<f64>();
    let triangles = subject.triangles().map(middle).zip(0..);
    let (_, triangle) = triangles.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    Point { triangle, weights: [0.5, 0.25, 0.25] }
}

#[test]
fn a_hundred_known_pixels_pick_the_right_triangles() {
    let stage = stage(BALL);
    let subject = subject(&stage);
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let mut camera = Camera { projection, azimuth: 30.0, ..Camera::default() };
        camera.fit(&subject.points, 1.6);
        let mut picked = 0;
        for (corners, triangle) in subject.triangles().zip(0..) {
            let [a, b, c] = corners.map(|point| subject.points[point as usize]);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(&(c - a)).normalize());
            // On a convex body what faces the eye is seen.
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
    let subject = subject(&stage(BALL));
    let (from, along) = (Vector3::new(0.5, 0.001, 0.002), -Vector3::x());
    let (_, near) = pick(&subject, &subject.points, &from, &along, |_| true).unwrap();
    let (_, far) = pick(&subject, &subject.points, &from, &along, |point| point.x < 0.0).unwrap();
    assert!(near.x > 0.04 && far.x < -0.04);
}

#[test]
fn it_plays_stands_still_steps_and_starts_anew() {
    let mut session = Session::start(stage(BALL), || ()).unwrap();
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
    let mut session = Session::start(stage(BALL), || ()).unwrap();
    session.order(Order::Speed(0.1));
    session.order(Order::Play(true));
    let started = Instant::now();
    wait(&mut session, |frame| frame.time > 0.02);
    // A tenth of real time: 0.02 s take 0.2 s at the least.
    assert!(started.elapsed() > Duration::from_millis(180), "{:?}", started.elapsed());
}

#[test]
fn the_hand_pulls_with_its_spring_and_the_base_holds_against_it() {
    let stage = stage(BALL);
    let tip = tip(&subject(&stage));
    let mut session = Session::start(stage, || ()).unwrap();
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
    assert!(pulled.input_lag.is_some());
    assert_ne!(pulled.points, first.points);
    session.order(Order::Hand(Hand::Release));
    wait(&mut session, |frame| frame.held.is_empty());
    let recording = session.end().unwrap();
    assert_eq!((recording.steps, recording.moves.len()), (3000, 3));

    // Repeated twice: the same bits, and the force of the hand is what the base holds.
    let stage = support::stage(BALL);
    let mut held = recording;
    held.moves.pop();
    let once = replay(&stage, &held).unwrap();
    assert_eq!(once, replay(&stage, &held).unwrap());
    let [_, force] = once.held.unwrap().map(Vector3::from);
    let base = Vector3::from(once.reactions[0]);
    assert!((force + base).norm() < 1e-3 * force.norm(), "{force:?} {base:?}");
    let again = pliant_viewer::Recording::from_bytes(&held.to_bytes().unwrap()).unwrap();
    assert_eq!(again, held);
}

#[test]
fn pins_hold_what_is_pulled() {
    let stage = stage(BALL);
    let tip = tip(&subject(&stage));
    let pulled = |pinned: bool| {
        let mut session = Session::start(stage.clone(), || ()).unwrap();
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
    let mut session = Session::start(stage(&text), || ()).unwrap();
    session.order(Order::Play(true));
    let broken = wait(&mut session, |frame| frame.failure.is_some());
    let told = broken.failure.clone().unwrap();
    assert!(told.contains("`ball`"), "{told}");
    assert!(!broken.playing && !broken.points.is_empty());
    assert!(broken.points.iter().all(|point| point.iter().all(|x| x.is_finite())));
    session.order(Order::Reset);
    wait(&mut session, |frame| frame.failure.is_none() && frame.steps == 0);
}
