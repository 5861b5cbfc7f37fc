//! An hour of a restless hand, in a few seconds; in a process of its own, whose memory is watched.

mod support;

use pliant_geometry::Vector3;
use pliant_viewer::{Hand, Order, Point, Session};
use support::{BALL, stage, subject, wait};

/// Pages of memory that the process holds; `None` where nobody tells.
fn resident() -> Option<usize> {
    std::fs::read_to_string("/proc/self/statm").ok()?.split(' ').nth(1)?.parse().ok()
}

#[test]
fn random_dragging_breaks_nothing_and_takes_no_more_memory() {
    let stage = stage(&BALL.replace("young-modulus = 5e3", "young-modulus = 20e3"));
    let subject = subject(&stage);
    let triangles = subject.triangle_count() as u64;
    let mut session = Session::start(stage, || ()).unwrap();
    let mut seed = 1_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(1_u32 << 31)
    };
    let mut before = None;
    for drag in 0..150 {
        let triangle = (random() * triangles as f64) as u32;
        session.order(Order::Hand(Hand::Take(
            Point { triangle, weights: [0.2, 0.3, 0.5] },
            10.0 + 40.0 * random(),
        )));
        let corners = subject.triangles().nth(triangle as usize).unwrap();
        let mut place = subject.points[corners[0] as usize];
        for _ in 0..10 {
            place += Vector3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 0.005;
            session.order(Order::Hand(Hand::Pull(place.into())));
            session.order(Order::Step(10));
        }
        session.order(Order::Hand(Hand::Release));
        let frame = wait(&mut session, |frame| frame.steps >= 100 * (drag + 1));
        assert_eq!(frame.failure, None);
        assert!(frame.points.iter().flat_map(|point| point.iter()).all(|x| x.is_finite()));
        if drag == 30 {
            before = resident();
        }
    }
    if let (Some(before), Some(after)) = (before, resident()) {
        assert!(after < before + 2048, "{before} pages before, {after} after");
    }
}
