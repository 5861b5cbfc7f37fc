//! Cost of the border: a step through C next to the same step in Rust, and vertices copied out.
//! `cargo test --release -p pliant-c --test times -- --ignored --nocapture`

use std::ffi::CString;
use std::ptr;
use std::time::Instant;

use pliant_c::*;
use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_scene::World;

/// A block of the given cells; a few cells make steps that take next to no time.
fn block(cells: &str) -> String {
    format!(
        r#"[scene]
until = 1e6
gravity = [0, 0, -9.81]
[run]
threads = 1
step = 1e-4
on-unstable = "report"
[law.tissue]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.45
[body.block]
mesh = {{ block = {{ size = [0.1, 0.1, 0.1], cells = {cells} }}, as = "hexes" }}
law = "tissue"
density = 1000
damping = 50
[constraint.base]
type = "fix"
body = "block"
nodes = {{ set = "z-min" }}
"#
    )
}

struct Opened {
    context: *mut PliantContext,
    simulation: u64,
}

fn open(text: &str) -> Opened {
    let (mut context, mut scene, mut simulation) = (ptr::null_mut(), 0, 0);
    let none = ptr::null_mut();
    // SAFETY: all pointers are to live values of their types, and the length of the text is right.
    unsafe {
        assert_eq!(pliant_context_open(PLIANT_ABI, &raw mut context, none), PliantStatus::Ok);
        let parsed = pliant_scene_parse(
            context,
            text.as_ptr().cast(),
            text.len(),
            ptr::null(),
            ptr::null(),
            &raw mut scene,
            none,
        );
        assert_eq!(parsed, PliantStatus::Ok);
        assert_eq!(pliant_simulation_open(context, scene, 1, &raw mut simulation, none), PliantStatus::Ok);
    }
    Opened { context, simulation }
}

/// The median of times [µs].
fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn timed(what: &mut dyn FnMut()) -> f64 {
    let begun = Instant::now();
    what();
    1e6 * begun.elapsed().as_secs_f64()
}

#[test]
#[ignore = "prints times; half a minute"]
fn the_border_costs_less_than_a_microsecond_a_step() {
    let text = block("[2, 2, 2]");
    let Opened { context, simulation } = open(&text);
    let scene = Scene::from_source(Source::parse("block.toml", text).unwrap(), ".".into()).unwrap();
    let mut rust_simulation = World::new(&scene).unwrap().simulation().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    // SAFETY: the context is open.
    let mut through_c = || unsafe {
        let status = pliant_step(context, simulation, 1, ptr::null_mut(), ptr::null_mut());
        assert_eq!(status, PliantStatus::Ok);
    };
    let mut in_rust = || {
        pool.install(|| rust_simulation.step(1)).unwrap();
    };
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..20_000 {
        ours.push(timed(&mut through_c));
        theirs.push(timed(&mut in_rust));
    }
    let [ours, theirs] = [ours, theirs].map(median);
    println!("a step of 8 elements on a thread of its own: {ours:.2} µs through C, {theirs:.2} µs in Rust");
    let mut thousand_through_c = || unsafe {
        // SAFETY: the context is open.
        let status = pliant_step(context, simulation, 1000, ptr::null_mut(), ptr::null_mut());
        assert_eq!(status, PliantStatus::Ok);
    };
    let mut thousand_in_rust = || {
        pool.install(|| {
            for _ in 0..1000 {
                rust_simulation.step(1).unwrap();
            }
        });
    };
    let (mut ours_of_many, mut theirs_of_many) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        ours_of_many.push(timed(&mut thousand_through_c) / 1000.0);
        theirs_of_many.push(timed(&mut thousand_in_rust) / 1000.0);
    }
    let [many, same] = [ours_of_many, theirs_of_many].map(median);
    println!("one of a thousand in a call: {many:.3} µs through C, {same:.3} µs in Rust");
    // Cost of a call without a step: the handle, the lock and the error.
    let now = &mut PliantNow { time: 0.0, step: 0.0, steps: 0, nodes: 0 };
    let looks = (0..20_000).map(|_| {
        // SAFETY: the context is open.
        timed(&mut || unsafe {
            pliant_now(context, simulation, &raw mut *now, ptr::null_mut());
        })
    });
    println!("a call that computes nothing: {:.3} µs", median(looks.collect()));
    assert!(ours - theirs < 1.0);
    // SAFETY: nothing uses it any more.
    unsafe { pliant_context_close(context) };
}

#[test]
#[ignore = "prints times; some seconds"]
fn ten_thousand_vertices_are_copied_within_fifty_microseconds() {
    let Opened { context, simulation } = open(&block("[41, 41, 40]"));
    let mut surface = PliantSurface { number: 0, vertices: 0, triangles: 0 };
    let name = CString::new("block").unwrap();
    let none = ptr::null_mut();
    // SAFETY: all pointers are to live values of their types.
    unsafe {
        assert_eq!(
            pliant_surface_open(context, simulation, name.as_ptr(), &raw mut surface, none),
            PliantStatus::Ok
        );
        assert_eq!(pliant_step(context, simulation, 3, ptr::null_mut(), none), PliantStatus::Ok);
    }
    let mut vertices = vec![[0.0_f32; 6]; surface.vertices as usize];
    for (what, numbers, stride) in [("floats with a stride", PLIANT_F32, 24), ("doubles", PLIANT_F64, 0)] {
        let mut doubles = vec![[0.0_f64; 3]; surface.vertices as usize];
        let data =
            if numbers == PLIANT_F32 { vertices.as_mut_ptr().cast() } else { doubles.as_mut_ptr().cast() };
        let buffer = PliantBuffer { data, count: surface.vertices as usize, stride, numbers };
        let times = (0..1000).map(|_| {
            timed(&mut || {
                // SAFETY: the context is open, and the buffer has room for all vertices.
                let status = unsafe { pliant_surface_positions(context, simulation, 0, buffer, none) };
                assert_eq!(status, PliantStatus::Ok);
            })
        });
        let each = median(times.collect());
        let of_ten_thousand = each * 1e4 / f64::from(surface.vertices);
        println!(
            "{} positions as {what}: {each:.1} µs, {of_ten_thousand:.1} µs for 10,000",
            surface.vertices
        );
        assert!(of_ten_thousand < 50.0);
        let data =
            if numbers == PLIANT_F32 { vertices.as_mut_ptr().cast() } else { doubles.as_mut_ptr().cast() };
        let buffer = PliantBuffer { data, ..buffer };
        let times = (0..300).map(|_| {
            timed(&mut || {
                // SAFETY: as above.
                let status = unsafe { pliant_surface_normals(context, simulation, 0, buffer, none) };
                assert_eq!(status, PliantStatus::Ok);
            })
        });
        let each = median(times.collect());
        println!("{} normals as {what}: {each:.1} µs", surface.vertices);
    }
    // SAFETY: nothing uses it any more.
    unsafe { pliant_context_close(context) };
}
