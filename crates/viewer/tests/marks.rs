//! Constraints and loads are marked where the body is now.

mod support;

use pliant_geometry::Vector3;
use pliant_picture::Marked;
use pliant_viewer::{Order, Session};
use support::{wait, world};

/// A bar that is held at one end, moved at the other one, and pressed from above.
const BAR: &str = include_str!("support/bar.toml");

#[test]
fn held_moved_and_loaded_nodes_are_marked_where_they_are() {
    let mut session = Session::start(world(BAR), || ()).unwrap();
    session.order(Order::Step(1));
    let frame = wait(&mut session, |frame| frame.steps >= 1);
    assert!(frame.marks.is_empty());
    // Where the driven end will be is known at once.
    let at_rest = frame.subject.points.iter().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
    let farthest = frame.ways.iter().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
    assert!((farthest - at_rest - 0.02).abs() < 1e-12, "{farthest} after {at_rest}");
    session.order(Order::Marks(true));
    session.order(Order::Step(2000));
    let frame = wait(&mut session, |frame| frame.time > 0.1 && !frame.marks.is_empty());
    let of = |is: fn(&Marked) -> bool| -> Vec<(Vector3, Marked)> {
        frame.marks.iter().filter(|(_, marked)| is(marked)).copied().collect()
    };
    let (held, moved) = (of(|m| *m == Marked::Held), of(|m| *m == Marked::Moved));
    assert_eq!((held.len(), moved.len()), (9, 9));
    let [low, high] = [&held, &moved].map(|marks| marks.iter().map(|(place, _)| place.x).collect::<Vec<_>>());
    assert!(low.iter().all(|x| (x - low[0]).abs() < 1e-12));
    assert!(high.iter().all(|x| (x - low[0] - 0.22).abs() < 1e-6), "{high:?}");
    let weight: Vec<(Vector3, Marked)> = of(|m| matches!(m, Marked::Weight(_)));
    let [(middle, Marked::Weight(weight))] = weight[..] else { panic!("{weight:?}") };
    // 2 kg under 0.01 m/s², in the middle of the bar, which is longer by a tenth.
    assert!((weight.z + 0.02).abs() < 1e-12 && (middle.x - low[0] - 0.11).abs() < 2e-3, "{middle:?}");
    let force: Vector3 = (of(|m| matches!(m, Marked::Loaded(_))).iter())
        .map(|(_, marked)| if let Marked::Loaded(force) = marked { *force } else { Vector3::zeros() })
        .sum();
    // The pressure times the area of the upper side, which the pull stretches by a tenth and thins, and
    // slopes a little.
    assert!(force.z < -0.9 && force.z > -1.2 && force.y.abs() < 1e-3, "{force:?}");
}
