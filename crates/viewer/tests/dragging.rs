//! A restless hand: random drags, each of a second in sixty pulls, as a mouse sends them. The tests have
//! their own process, whose memory is measured. An hour of dragging takes minutes: `cargo test -p pliant -p
//! pliant-viewer --features pliant/viewer --test dragging -- --ignored`.

#![allow(unsafe_code)] // The allocator that counts hands every call on.

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pliant_geometry::Vector3;
use pliant_picture::Subject;
use pliant_scene::World;
use pliant_testing::Random;
use pliant_viewer::{Frame, Hand, Order, Point, Session};
use support::{BALL, LIVER, subject, wait, wait_up_to, world};

/// Pulls of a drag, a sixtieth of a second each.
const PULLS: u32 = 60;
/// Largest duration of a drag, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(900);
/// Bytes by which the peak of the allocated memory may differ. Lists of held nodes are some KB long. A leak
/// of 100 bytes a drag would show within 700 drags.
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

// SAFETY: every call is passed unchanged to the allocator of the system.
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

/// Returns the pages of memory that the process holds; `None` if the system does not report them.
fn resident() -> Option<usize> {
    std::fs::read_to_string("/proc/self/statm").ok()?.split(' ').nth(1)?.parse().ok()
}

/// A step of a walk in any direction, up to 1 along each axis.
fn walk(random: &mut Random) -> Vector3 {
    Vector3::from_fn(|_, _| random.part() - 0.5) * 2.0
}

/// Duration of the dragging.
enum Until {
    Drags(u64),
    Wall(Duration),
}

impl Until {
    /// The part of it that is done.
    fn part(&self, drags: u64, began: Instant) -> f64 {
        match self {
            Self::Drags(count) => drags as f64 / *count as f64,
            Self::Wall(duration) => began.elapsed().as_secs_f64() / duration.as_secs_f64(),
        }
    }
}

/// A dragged body, with its results so far.
struct Dragged {
    session: Session,
    subject: Subject,
    /// Its longest side [m].
    size: f64,
    /// Steps of a pull.
    steps: u64,
    random: Random,
    /// Number of times that the run went back, and the strongest pull [N].
    broken: u64,
    strongest: f64,
}

impl Dragged {
    fn new(world: World) -> Self {
        let steps = (1.0 / 60.0 / world.step()).ceil() as u64;
        let subject = subject(&world);
        let surface = subject.surface_points();
        let extent = |axis: usize| {
            let along = surface.iter().map(|&point| subject.points[point as usize][axis]);
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        let size = (0..3).map(extent).fold(0.0, f64::max);
        let session = Session::start(world, || ()).unwrap();
        Self { session, subject, size, steps, random: Random::new(1), broken: 0, strongest: 0.0 }
    }

    /// Drags for a second at a random place with a random stiffness. Returns true if the run is where the
    /// hand brought it.
    fn drag(&mut self, drag: u64) -> bool {
        let Self { session, random, .. } = self;
        let triangle = (random.part() * self.subject.triangle_count() as f64) as u32;
        let stiffness = 20.0 * 25.0_f64.powf(random.part());
        session.order(Order::Hand(Hand::Take(Point { triangle, weights: [0.2, 0.3, 0.5] }, stiffness)));
        let taken = wait(session, |frame| !frame.held.is_empty() || frame.failure.is_some());
        assert_eq!(taken.failure, None, "before drag {drag}");
        // The last steps of a broken drag count, too.
        self.broken = taken.breaks;
        let mut place = Vector3::from(taken.held[0][0]);
        let goal = taken.steps + self.steps * u64::from(PULLS);
        for _ in 0..PULLS {
            place += walk(random) * WALK * self.size;
            session.order(Order::Hand(Hand::Pull(place.into())));
            session.order(Order::Step(self.steps));
        }
        let ends =
            |frame: &Frame| frame.steps >= goal || frame.breaks > taken.breaks || frame.failure.is_some();
        let frame = wait_up_to(PATIENCE, session, ends);
        assert_eq!(frame.failure, None, "in drag {drag}");
        assert!(frame.points.iter().flat_map(|point| point.iter()).all(|x| x.is_finite()));
        assert!(frame.values.iter().all(|x| x.is_finite()));
        assert!(session.samples().all(|sample| sample.values.iter().all(|x| x.is_finite())));
        session.order(Order::Hand(Hand::Release));
        if frame.breaks > self.broken {
            self.broken = frame.breaks;
            assert_is_told(frame.note.as_deref().unwrap_or_default(), drag);
            return false;
        }
        self.strongest = self.strongest.max(Vector3::from(frame.held[0][1]).norm());
        wait(session, |frame| frame.held.is_empty());
        true
    }

    /// Goes back: that makes a second simulation before the first one is dropped, so where runs break, memory
    /// takes that much once.
    fn go_back(&mut self) {
        self.session.order(Order::Back(u64::MAX));
        wait(&mut self.session, |frame| {
            frame.note.as_deref().is_some_and(|message| message.contains("went back to"))
        });
    }
}

/// Checks that the message names the reason of a break. The body is turned inside out, squeezed until it is
/// too stiff for the step, or gains energy.
fn assert_is_told(message: &str, drag: u64) {
    let reasons = ["is inverted", "the largest stable step has fallen", "the energies are off balance"];
    let is_told = reasons.iter().any(|why| message.contains(why));
    assert!(is_told && message.contains("went back to"), "in drag {drag}: {message}");
}

/// Drags a body for a second each, at random places, with a stiffness between 20 and 500 N/m. The run never
/// ends: after a pull that would break it, it goes back to an earlier state. Every shown value is a number,
/// and after the first tenth memory no longer grows. Returns how often the run went back, and the number of
/// drags.
fn drag(text: &str, until: &Until) -> [u64; 2] {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut dragged = Dragged::new(world(text));
    let (mut before, mut drags) = (None, 0);
    // Drags in a row that broke nothing, and the most bytes after a drag before and after the first tenth.
    let (mut whole, mut warm, mut most) = (0, false, [0; 2]);
    let began = Instant::now();
    while until.part(drags, began) < 1.0 {
        drags += 1;
        if !dragged.drag(drags) {
            whole = 0;
            continue;
        }
        whole += 1;
        let most = &mut most[usize::from(warm)];
        *most = (*most).max(ALLOCATED.load(Ordering::Relaxed));
        if !warm {
            if matches!(until, Until::Wall(_)) {
                dragged.go_back();
            }
            if until.part(drags, began) >= 0.1 && whole >= FULL {
                (warm, before) = (true, resident());
            }
        }
    }
    let Dragged { broken, strongest, steps, .. } = dragged;
    println!(
        "{drags} drags in {:.0} s, {} steps, up to {strongest:.2} N, went back {broken} times",
        began.elapsed().as_secs_f64(),
        drags * steps * u64::from(PULLS)
    );
    let [early, late] = most;
    println!("at most {early} bytes allocated in the first tenth, {late} later");
    assert!(late < early + GROWTH, "{early} bytes before, {late} after");
    if let (Some(before), Some(after)) = (before, resident()) {
        println!("{before} pages after the first tenth, {after} in the end");
        // The allocator's heap has holes between blocks of many lengths: it grows by some percent until they
        // suffice.
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
