//! A restless hand: random drags, each of a second in sixty pulls, as a mouse sends them. In a process of its own, whose memory is
//! watched. An hour of it takes minutes: `cargo test -p pliant -p pliant-viewer --features pliant/viewer --test dragging -- --ignored`.

#![allow(unsafe_code)] // The allocator that counts hands every call on.

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pliant_geometry::Vector3;
use pliant_testing::Random;
use pliant_viewer::{Frame, Hand, Order, Point, Session};
use support::{BALL, LIVER, subject, wait, wait_up_to, world};

/// Pulls of a drag, a sixtieth of a second each.
const PULLS: u32 = 60;
/// A drag takes that long at most, on a machine that does much else.
const PATIENCE: Duration = Duration::from_secs(900);
/// Bytes by which the most that is allocated may differ: lists of held nodes are some KB long, and a leak of 100 bytes a drag would show
/// within 700.
const GROWTH: usize = 64 << 10;
/// Drags in a row after which all states are kept that ever are: sixteen, of a quarter of a second each.
const FULL: u64 = 5;
/// Part of the body's longest side that a hand moves from pull to pull, at most along each axis.
const WALK: f64 = 0.02;

/// The allocator of the system, which counts.
struct Counted;

/// Bytes that are allocated at the moment.
static ALLOCATED: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static COUNTED: Counted = Counted;

// SAFETY: every call goes on to the allocator of the system as it is.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATED.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        ALLOCATED.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATED.fetch_add(size, Ordering::Relaxed);
        ALLOCATED.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.realloc(memory, layout, size) }
    }
}

/// Bodies are dragged one after the other: they share the memory that is watched.
static ALONE: Mutex<()> = Mutex::new(());

/// Pages of memory that the process holds; `None` where nobody tells.
fn resident() -> Option<usize> {
    std::fs::read_to_string("/proc/self/statm").ok()?.split(' ').nth(1)?.parse().ok()
}

/// A step of a walk in any direction, up to 1 along each axis.
fn walk(random: &mut Random) -> Vector3 {
    Vector3::from_fn(|_, _| random.part() - 0.5) * 2.0
}

/// How long a body is dragged.
enum Until {
    Drags(u64),
    Wall(Duration),
}

impl Until {
    /// The part of it that is done.
    fn part(&self, drags: u64, began: Instant) -> f64 {
        match self {
            Self::Drags(all) => drags as f64 / *all as f64,
            Self::Wall(all) => began.elapsed().as_secs_f64() / all.as_secs_f64(),
        }
    }
}

/// Drags of a second each at a body, each at a place of its own, with a stiffness between 20 and 500 N/m. The run never ends: after a pull
/// that would break it, it is where it was before. All that is shown is a number, and after the first tenth memory no longer
/// grows. Returns how often the run went back, and how many drags there were.
fn drag(text: &str, until: &Until) -> [u64; 2] {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let world = world(text);
    let steps = (1.0 / 60.0 / world.step()).ceil() as u64;
    let subject = subject(&world);
    let surface = subject.surface_points();
    let extent = |axis: usize| {
        let along = surface.iter().map(|&point| subject.points[point as usize][axis]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    let size = (0..3).map(extent).fold(0.0, f64::max);
    let mut session = Session::start(world, || ()).unwrap();
    let (mut random, mut before, mut strongest) = (Random::new(1), None, 0.0_f64);
    let (mut total, mut broken, mut drag) = (0, 0, 0);
    // Drags in a row that broke nothing, and the most bytes after a drag before and after the first tenth.
    let (mut whole, mut warm, mut most) = (0, false, [0; 2]);
    let began = Instant::now();
    while until.part(drag, began) < 1.0 {
        drag += 1;
        let triangle = (random.part() * subject.triangle_count() as f64) as u32;
        let stiffness = 20.0 * 25.0_f64.powf(random.part());
        session.order(Order::Hand(Hand::Take(Point { triangle, weights: [0.2, 0.3, 0.5] }, stiffness)));
        let taken = wait(&mut session, |frame| !frame.held.is_empty() || frame.failure.is_some());
        assert_eq!(taken.failure, None, "before drag {drag}");
        // What the last steps of a broken drag did counts, too.
        broken = taken.breaks;
        let mut place = Vector3::from(taken.held[0][0]);
        let goal = taken.steps + steps * u64::from(PULLS);
        for _ in 0..PULLS {
            place += walk(&mut random) * WALK * size;
            session.order(Order::Hand(Hand::Pull(place.into())));
            session.order(Order::Step(steps));
            total += steps;
        }
        let ends = |frame: &Frame| frame.steps >= goal || frame.breaks > broken || frame.failure.is_some();
        let frame = wait_up_to(PATIENCE, &mut session, ends);
        assert_eq!(frame.failure, None, "in drag {drag}");
        assert!(frame.points.iter().flat_map(|point| point.iter()).all(|x| x.is_finite()));
        assert!(frame.values.iter().all(|x| x.is_finite()));
        assert!(session.samples().all(|sample| sample.values.iter().all(|x| x.is_finite())));
        if frame.breaks > broken {
            broken = frame.breaks;
            let told = frame.note.as_deref().unwrap_or_default();
            // It is turned inside out, squeezed until it is too stiff for the step, or gains energy.
            let is_told =
                ["is inverted", "the largest stable step has fallen", "the energies are off balance"]
                    .iter()
                    .any(|why| told.contains(why));
            assert!(is_told && told.contains("went back to"), "in drag {drag}: {told}");
            session.order(Order::Hand(Hand::Release));
            whole = 0;
            continue;
        }
        strongest = strongest.max(Vector3::from(frame.held[0][1]).norm());
        session.order(Order::Hand(Hand::Release));
        wait(&mut session, |frame| frame.held.is_empty());
        whole += 1;
        let most = &mut most[usize::from(warm)];
        *most = (*most).max(ALLOCATED.load(Ordering::Relaxed));
        if !warm {
            // Going back makes a second simulation before the first one is dropped: where runs break, memory takes that much once.
            if matches!(until, Until::Wall(_)) {
                session.order(Order::Back(u64::MAX));
                wait(&mut session, |frame| {
                    frame.note.as_deref().is_some_and(|told| told.contains("went back to"))
                });
            }
            if until.part(drag, began) >= 0.1 && whole >= FULL {
                (warm, before) = (true, resident());
            }
        }
    }
    let drags = drag;
    println!(
        "{drags} drags in {:.0} s, {total} steps, up to {strongest:.2} N, went back {broken} times",
        began.elapsed().as_secs_f64()
    );
    let [early, late] = most;
    println!("at most {early} bytes allocated in the first tenth, {late} later");
    assert!(late < early + GROWTH, "{early} bytes before, {late} after");
    if let (Some(before), Some(after)) = (before, resident()) {
        println!("{before} pages after the first tenth, {after} in the end");
        // The allocator's heap has holes between blocks of many lengths: it grows by some percent until they suffice.
        assert!(after < before + before / 4, "{before} pages before, {after} after");
    }
    [broken, drags]
}

#[test]
fn random_dragging_breaks_nothing_and_takes_no_more_memory() {
    assert_eq!(drag(BALL, &Until::Drags(30))[0], 0);
    assert_eq!(drag(LIVER, &Until::Drags(10))[0], 0);
}

#[test]
#[ignore = "takes minutes"]
fn an_hour_of_random_dragging() {
    // Larger cells than usual take longer steps: an hour goes by in minutes.
    let ball = BALL.replace("edge = 0.012", "edge = 0.02");
    let [broken, drags] = drag(&ball, &Until::Drags(3600));
    assert!(broken <= drags / 100, "broken {broken} times in {drags} drags");
}

/// The usual scenes as they are, for `PLIANT_DRAG_MINUTES` of wall time each;
/// without this variable not at all. Their runs never end either; how often they go back is printed.
#[test]
#[ignore = "takes PLIANT_DRAG_MINUTES"]
fn random_dragging_of_the_usual_scenes() {
    let minutes = std::env::var("PLIANT_DRAG_MINUTES").ok().and_then(|text| text.parse::<f64>().ok());
    let Some(minutes) = minutes else { return };
    for scene in [
        include_str!("../../../scenes/stretched-cube/scene.toml"),
        include_str!("../../../scenes/liver/scene.toml"),
    ] {
        drag(scene, &Until::Wall(Duration::from_secs_f64(60.0 * minutes)));
    }
}
