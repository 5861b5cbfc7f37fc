//! Table 8.2 and figures 8.6 to 8.8: an intra-ocular lens is folded, pushed through an injector and unfolds
//! in a bag. The case runs `scenes/lens`: the thesis gives neither its meshes nor its injector.

use std::fs;
use std::time::Instant;

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_scene::World;
use pliant_sim::{Frame, Simulation};

use crate::case::{Case, CaseError, Findings, Row};
use crate::largest;
use crate::picture::{Body, View, figure};

/// Table 8.2 and figure 8.6.
pub const MESH: Case = Case {
    id: "fig-8.6",
    title: "Table 8.2, Fig. 8.6: an intra-ocular lens and its mesh",
    shows: "An acrylic lens with two haptics, given as 743 triangles with 473 nodes, and its material: E = 1 MPa, ν = 0.42, \
            1.2 g/cm³. The thesis's mesh is finer where haptics meet the optic; it was made by hand and is not published. \
            Here the mesh is even, of a usual design: an optic of 6 mm, 12.5 mm over all, 0.3 mm thick.",
    corrections: &[],
    seconds: 1.0,
    compute: mesh,
};

/// Figures 8.7 and 8.8.
pub(crate) const INJECTION: Case = Case {
    id: "fig-8.8",
    title: "Figs. 8.7, 8.8: the lens is folded, injected, and unfolds",
    shows: "The haptics are folded onto the optic, the optic is bent about them, and the lens is pushed through an injector into \
            the capsular bag: steps of 10 ms with a direct solver, with contact and friction of the lens with itself, the \
            injector and the bag, at about 5 frames a second on a CPU of 2.4 GHz. Here a fork folds the lens in two, and a \
            plunger pushes it through a tube of 2.6 mm at 10 mm/s into a rigid bag of 11 mm. The solver ends a step when \
            every node is within 1 mm/s of its solution, and no edge crosses a triangle in any step. Times of this machine are not judged.",
    corrections: &[],
    seconds: 45.0,
    compute: injection,
};

/// Area [m²] and mass [kg] of the design, in closed form and by quadrature over its outline.
const AREA: f64 = 40.983_906_3e-6;
const MASS: f64 = 14.754_206_3e-6;
/// Ends [s] of folding and of the way of the plunger.
const FOLDED: f64 = 2.0;
const PUSHED: f64 = 4.14;
/// End of the tube along y [m].
const TUBE_END: f64 = 30e-3;
/// Time [s] from the exit of the lens to the measurement of its shape.
const REST: f64 = 2.0;
/// Radius [m] of the optic.
const OPTIC: f64 = 3e-3;

fn scene() -> Result<World, CaseError> {
    let unwritable = |error: std::io::Error| CaseError::Run(error.to_string());
    let place = tempfile::tempdir().map_err(unwritable)?;
    for (name, table) in [
        ("left.csv", include_str!("../../../../scenes/lens/left.csv")),
        ("middle.csv", include_str!("../../../../scenes/lens/middle.csv")),
        ("plunger.csv", include_str!("../../../../scenes/lens/plunger.csv")),
        ("right.csv", include_str!("../../../../scenes/lens/right.csv")),
    ] {
        fs::write(place.path().join(name), table).map_err(unwritable)?;
    }
    let text = include_str!("../../../../scenes/lens/scene.toml");
    let scene = Scene::from_source(Source::parse("scenes/lens/scene.toml", text)?, place.path().into())?;
    Ok(World::new(&scene)?)
}

fn triangles(mesh: &Mesh) -> impl Iterator<Item = [u32; 3]> + '_ {
    let cells = mesh.block(CellKind::Triangle).into_iter().flat_map(|block| block.cells());
    cells.map(|corners| [corners[0], corners[1], corners[2]])
}

/// Areas [m²] of triangles.
fn areas(mesh: &Mesh, points: &[Vector3]) -> Vec<f64> {
    let area = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    triangles(mesh).map(area).collect()
}

fn view(quantity: &'static str, columns: usize) -> View<'static> {
    View { from: [0.9, -1.0, 0.8], up: [0.0, 0.0, 1.0], quantity, factor: 1.0, columns }
}

fn mesh() -> Result<Findings, CaseError> {
    let world = scene()?;
    let built = &world.participants[0].built;
    let mesh = &built.bodies[0].mesh;
    let source = "Table 8.2 and section 8.5";
    let mut findings = Findings::default();
    let count = |name: &str, printed: f64, found: usize| Row {
        reference: Some(printed),
        ..Row::shown(name, "", found as f64, source)
    };
    findings.rows.push(count("nodes", 473.0, mesh.points.len()));
    findings.rows.push(count("triangles", 743.0, triangles(mesh).count()));
    let area: f64 = areas(mesh, &mesh.points).iter().sum();
    // The outline of the mesh is a polygon with edges of 0.36 mm.
    let outline = "the outline of the design, closed form and quadrature";
    findings.rows.push(Row::judged("area", "mm²", [1e6 * AREA, 3e3 * AREA], 1e6 * area, outline));
    if let Some(bodies) = &built.implicit {
        let mass: f64 = bodies.model.mass.iter().sum();
        findings.rows.push(Row::judged("mass", "mg", [1e6 * MASS, 3e3 * MASS], 1e6 * mass, outline));
    }
    let body = [Body::still("", mesh)];
    let view = View { from: [0.0, 0.0, 1.0], up: [0.0, 1.0, 0.0], ..view("", 1) };
    findings.figures.push(figure(&body, &view, "The mesh of the lens, edges of 0.36 mm.")?);
    Ok(findings)
}

/// The lens on its way.
struct Way {
    mesh: Mesh,
    rest: Vec<f64>,
    /// Time [s] when the whole lens was beyond the tube.
    left: Option<f64>,
    /// The largest change of its whole area, and of the area of a triangle. Last, the largest part of the
    /// area in triangles that changed by more than 5 %.
    whole: f64,
    triangle: f64,
    beyond: f64,
}

impl Way {
    fn points(&self, frame: &Frame<'_>) -> Vec<Vector3> {
        let moved = frame.displacements("lens").unwrap_or_default();
        self.mesh.points.iter().zip(moved).map(|(x, u)| x + Vector3::from(u)).collect()
    }

    fn look(&mut self, frame: &Frame<'_>) {
        let points = self.points(frame);
        let now = areas(&self.mesh, &points);
        let rest_area: f64 = self.rest.iter().sum();
        self.whole = self.whole.max((now.iter().sum::<f64>() / rest_area - 1.0).abs());
        let changes = || now.iter().zip(&self.rest).map(|(now, rest)| (now / rest - 1.0).abs());
        self.triangle = self.triangle.max(largest(changes()));
        let beyond = changes().zip(&self.rest).filter(|(change, _)| *change > 0.05).map(|(_, rest)| rest);
        self.beyond = self.beyond.max(beyond.sum::<f64>() / rest_area);
        if self.left.is_none() && points.iter().all(|x| x.y > TUBE_END) {
            self.left = Some(frame.time());
        }
    }

    /// Current shape of the lens, about its middle.
    fn shape(&self, frame: &Frame<'_>) -> Mesh {
        let points = self.points(frame);
        let middle = points.iter().sum::<Vector3>() / points.len() as f64;
        Mesh { points: points.into_iter().map(|x| x - middle).collect(), ..self.mesh.clone() }
    }

    /// The least and the largest diameter of the optic over its diameter at rest, between opposite nodes of
    /// its rim.
    fn diameters(&self, frame: &Frame<'_>) -> [f64; 2] {
        let points = self.points(frame);
        let rest = &self.mesh.points;
        let rim: Vec<usize> =
            (0..rest.len()).filter(|&node| (rest[node].norm() - OPTIC).abs() < 0.02 * OPTIC).collect();
        let ratio = |&node: &usize| {
            let off = |other: &usize| (rest[node] + rest[*other]).norm();
            let opposite = rim.iter().min_by(|a, b| off(a).total_cmp(&off(b))).copied().unwrap_or(node);
            (points[node] - points[opposite]).norm() / (rest[node] - rest[opposite]).norm()
        };
        let ratios = || rim.iter().map(ratio);
        [ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max)]
    }
}

fn injection() -> Result<Findings, CaseError> {
    let world = scene()?;
    let mesh = world.participants[0].built.bodies[0].mesh.clone();
    let step = world.step();
    let mut simulation = world.simulation()?;
    let rest = areas(&mesh, &mesh.points);
    let mut way = Way { mesh, rest, left: None, whole: 0.0, triangle: 0.0, beyond: 0.0 };
    let mut shapes = Vec::new();
    let until = |simulation: &mut Simulation, way: &mut Way, time: f64| -> Result<Mesh, CaseError> {
        simulation.run(time, |frame| way.look(frame))?;
        Ok(way.shape(&simulation.frame()?))
    };
    let start = Instant::now();
    for (label, time) in [
        ("(a) at rest", 0.0),
        ("(b) 1.0 s", 1.0),
        ("(c) 1.4 s", 1.4),
        ("(d) 1.6 s", 1.6),
        ("(e) folded", FOLDED),
    ] {
        shapes.push((label, until(&mut simulation, &mut way, time)?));
    }
    let folding = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let mut unfolding = Vec::new();
    for (label, time) in [("(a) in the tube", 3.4), ("(b) leaving it", 3.78)] {
        unfolding.push((label, until(&mut simulation, &mut way, time)?));
    }
    until(&mut simulation, &mut way, PUSHED)?;
    let pushing = start.elapsed().as_secs_f64();
    let left = way.left.ok_or_else(|| CaseError::Run("the lens did not leave the tube".into()))?;
    unfolding.push(("(c) 2 s later", until(&mut simulation, &mut way, left + REST)?));
    let [least, most] = way.diameters(&simulation.frame()?);

    let mut findings = Findings::default();
    let rows = &mut findings.rows;
    let frames = |seconds: f64, from: f64, to: f64| (to - from) / step / seconds;
    let source = "about 5, 2.4 GHz";
    rows.push(Row::timed("folding: frames a second", "", None, frames(folding, 0.0, FOLDED), ""));
    let rate = frames(pushing, FOLDED, PUSHED);
    rows.push(Row::timed("injection: frames a second", "", Some(5.0), rate, source));
    rows.push(Row::shown("the whole lens is out of the tube at", "s", left, ""));
    let elastic = "it is elastic: whatever it went through, it comes back";
    for (which, ratio) in [("least", least), ("largest", most)] {
        let quantity = format!("{which} diameter of the optic 2 s later, over that at rest");
        rows.push(Row::judged(quantity, "", [1.0, 0.02], ratio, elastic));
    }
    let thin = "shells of small strain";
    rows.push(Row::deviation("largest change of the whole area", 0.05, way.whole, thin));
    rows.push(Row::shown(
        "largest part of it in triangles that changed by more than 5 %",
        "",
        way.beyond,
        "",
    ));
    rows.push(Row::shown(
        "largest change of the area of a triangle",
        "",
        way.triangle,
        "where haptics meet the optic",
    ));
    for (shapes, caption, columns) in
        [(&shapes, "Folding.", 3), (&unfolding, "Injection and unfolding, each about its own middle.", 3)]
    {
        let bodies: Vec<Body<'_>> = shapes.iter().map(|(label, mesh)| Body::still(*label, mesh)).collect();
        findings.figures.push(figure(&bodies, &view("", columns), caption)?);
    }
    Ok(findings)
}
