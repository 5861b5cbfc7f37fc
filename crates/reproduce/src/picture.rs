//! Pictures of deformed bodies: surfaces painted with a z-buffer on the CPU, a map of colours from a value at the nodes,
//! the outline of the shape at rest, and a bar of the colours; several bodies seen alike in one SVG.

use std::fmt::Write;

use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use pliant_geometry::io::encode_base64;
use pliant_geometry::{Face, Mesh, Vector3, boundary};
use pliant_mechanics::tensor::Vector;

use crate::CaseError;
use crate::case::Figure;

/// Width of a picture in the SVG, and height of what stands under it.
const WIDTH: f64 = 340.0;
const LABEL: f64 = 30.0;
const BAR: f64 = 62.0;
/// Pixels of the image per unit of the SVG, and samples per pixel and direction.
const DENSITY: usize = 2;
const SAMPLES: usize = 2;
/// Where light comes from, seen by the camera: right, up, towards it.
const LIGHT: [f64; 3] = [-0.35, 0.65, 0.67];

/// A body in a certain state.
pub(crate) struct Body<'a> {
    pub label: String,
    pub mesh: &'a Mesh,
    pub displacement: Vec<Vector<f64>>,
    /// What the colour tells, at the nodes.
    pub value: Vec<f64>,
}

/// How bodies are looked at.
pub(crate) struct View<'a> {
    /// Towards the camera.
    pub from: Vector<f64>,
    /// The direction that is up.
    pub up: Vector<f64>,
    /// Whether the edges of the faces are drawn.
    pub edges: bool,
    /// What the colour tells, with its unit.
    pub quantity: &'a str,
    /// Factor from the values to the unit.
    pub factor: f64,
    /// Pictures side by side.
    pub columns: usize,
}

/// The axes of a camera without perspective.
struct Camera {
    axes: [Vector3; 3],
    /// Lower left corner and units of the SVG per metre.
    corner: [f64; 2],
    scale: f64,
    height: f64,
}

impl Camera {
    /// Shows all points.
    fn new(view: &View<'_>, points: impl Iterator<Item = Vector3>) -> Self {
        let towards = Vector3::from(view.from).normalize();
        let right = Vector3::from(view.up).cross(&towards).normalize();
        let axes = [right, towards.cross(&right), towards];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            for c in 0..2 {
                let at = axes[c].dot(&point);
                (low[c], high[c]) = (low[c].min(at), high[c].max(at));
            }
        }
        let size = [high[0] - low[0], high[1] - low[1]];
        let margin = 0.04 * size[0].max(size[1]);
        let scale = WIDTH / (size[0] + 2.0 * margin);
        Self { axes, corner: low.map(|c| c - margin), scale, height: (size[1] + 2.0 * margin) * scale }
    }

    /// Right and down in the SVG, and towards the camera in metres.
    fn place(&self, point: &Vector3) -> Vector3 {
        let [x, y, z] = [0, 1, 2].map(|c| self.axes[c].dot(point));
        Vector3::new(
            (x - self.corner[0]) * self.scale,
            self.height - (y - self.corner[1]) * self.scale,
            z,
        )
    }

    /// A direction as the camera sees it: right, up, towards it.
    fn turn(&self, direction: &Vector3) -> Vector3 {
        Vector3::from([0, 1, 2].map(|c| self.axes[c].dot(direction)))
    }
}

/// The bodies side by side, in one scale of colours.
pub(crate) fn figure(
    bodies: &[Body<'_>],
    view: &View<'_>,
    caption: impl Into<String>,
) -> Result<Figure, CaseError> {
    let places: Vec<[Vec<Vector3>; 2]> = (bodies.iter())
        .map(|body| {
            let moved = body.mesh.points.iter().zip(&body.displacement);
            [body.mesh.points.clone(), moved.map(|(point, &u)| point + Vector3::from(u)).collect()]
        })
        .collect();
    let camera = Camera::new(view, places.iter().flatten().flatten().copied());
    let surfaces: Vec<Vec<Face>> = bodies.iter().map(|body| boundary(body.mesh).faces).collect();
    let shown = || {
        let faces = bodies.iter().zip(&surfaces);
        faces.flat_map(|(body, faces)| faces.iter().flat_map(|f| f.nodes()).map(|&n| body.value[n as usize]))
    };
    let scale = [shown().fold(f64::INFINITY, f64::min), shown().fold(f64::NEG_INFINITY, f64::max)];
    let columns = view.columns.min(bodies.len());
    let cell = camera.height + LABEL;
    let (width, height) =
        (WIDTH * columns as f64, cell * bodies.len().div_ceil(columns) as f64 + BAR);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         font-family=\"sans-serif\" font-size=\"16\" fill=\"#222\">\n"
    );
    for (index, (body, [rest, now])) in bodies.iter().zip(&places).enumerate() {
        let (x, y) = ((index % columns) as f64 * WIDTH, (index / columns) as f64 * cell);
        let image = paint(&surfaces[index], now, &body.value, scale, &camera, view.edges)?;
        let (middle, base) = (0.5 * WIDTH, camera.height + 20.0);
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<g transform=\"translate({x:.1} {y:.1})\"><image width=\"{WIDTH}\" height=\"{:.1}\" href=\"{image}\"/>\
             <path d=\"{}\" fill=\"none\" stroke=\"#555\" stroke-width=\"1.2\" stroke-dasharray=\"5 4\"/>\
             <text x=\"{middle}\" y=\"{base:.1}\" text-anchor=\"middle\">{}</text></g>\n",
            camera.height,
            outline(&surfaces[index], rest, &camera),
            body.label,
        );
    }
    svg.push_str(&bar(view, scale.map(|value| value * view.factor), width, height - BAR));
    svg.push_str("</svg>\n");
    Ok(Figure { svg, caption: caption.into() })
}

/// The edges at which a surface turns away from the camera, and its creases, as an SVG path.
fn outline(faces: &[Face], points: &[Vector3], camera: &Camera) -> String {
    let mut edges: Vec<([u32; 2], Vector3)> = Vec::new();
    for face in faces {
        let (nodes, normal) = (face.nodes(), camera.turn(&face.normal(points)));
        for (at, &a) in nodes.iter().enumerate() {
            let b = nodes[(at + 1) % nodes.len()];
            edges.push(([a.min(b), a.max(b)], normal));
        }
    }
    edges.sort_unstable_by_key(|(edge, _)| *edge);
    let mut path = String::new();
    for pair in edges.chunk_by(|a, b| a.0 == b.0) {
        let [(edge, n), (_, m)] = pair else { continue };
        if (n.z > 0.0) != (m.z > 0.0) {
            let [a, b] = edge.map(|node| camera.place(&points[node as usize]));
            let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y);
        }
    }
    path
}

/// A bar of colours with its ends and its middle.
fn bar(view: &View<'_>, [low, high]: [f64; 2], width: f64, top: f64) -> String {
    let (left, length) = (0.2 * width, 0.6 * width);
    let mut svg = String::from("<defs><linearGradient id=\"viridis\">");
    for stop in 0..=10 {
        let RGB(r, g, b) = colour(f64::from(stop) / 10.0);
        let _ = write!(svg, "<stop offset=\"{}%\" stop-color=\"rgb({r},{g},{b})\"/>", 10 * stop);
    }
    let _ = write!(
        svg,
        "</linearGradient></defs><rect x=\"{left:.0}\" y=\"{:.0}\" width=\"{length:.0}\" height=\"12\" \
         fill=\"url(#viridis)\"/>",
        top + 8.0
    );
    let mut text = |x: f64, y: f64, words: &str| {
        let _ = write!(svg, "<text x=\"{x:.0}\" y=\"{y:.0}\" text-anchor=\"middle\">{words}</text>");
    };
    for part in [0.0, 0.5, 1.0] {
        text(left + part * length, top + 37.0, &short(low + part * (high - low)));
    }
    text(0.5 * width, top + 56.0, view.quantity);
    svg
}

/// Three digits, or a plain 0.
fn short(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    if value.abs() < 1e-9 { "0".into() } else { format!("{value:.digits$}") }
}

struct RGB(u8, u8, u8);

/// Viridis from 0 to 1.
fn colour(part: f64) -> RGB {
    let plotters::style::RGBColor(r, g, b) = ViridisRGB.get_color(part.clamp(0.0, 1.0));
    RGB(r, g, b)
}

/// What one sample sees.
#[derive(Clone, Copy)]
struct Sample {
    depth: f64,
    colour: [f64; 3],
}

/// The surface as a data URI of a PNG.
fn paint(
    faces: &[Face],
    points: &[Vector3],
    value: &[f64],
    scale: [f64; 2],
    camera: &Camera,
    edges: bool,
) -> Result<String, CaseError> {
    let finest = (DENSITY * SAMPLES) as f64;
    let size = [WIDTH, camera.height].map(|length| (length * DENSITY as f64).ceil() as usize);
    let (columns, rows) = (size[0] * SAMPLES, size[1] * SAMPLES);
    let mut samples = vec![Sample { depth: f64::NEG_INFINITY, colour: [255.0; 3] }; columns * rows];
    let normals = node_normals(faces, points);
    for (face, corners) in faces.iter().zip(&normals) {
        let nodes = face.nodes();
        let at = |k: usize| {
            let place = camera.place(&points[nodes[k] as usize]);
            Vector3::new(place.x * finest, place.y * finest, place.z)
        };
        let part = |k: usize| (value[nodes[k] as usize] - scale[0]) / (scale[1] - scale[0]);
        let light = |k: usize| {
            let normal = camera.turn(&corners[k]);
            0.45 + 0.55 * normal.dot(&Vector3::from(LIGHT)).max(0.0)
        };
        for k in 1..nodes.len() - 1 {
            // Sides of the triangle that are edges of the face, each opposite to a corner.
            let drawn = [true, k + 2 == nodes.len(), k == 1];
            let corners = [0, k, k + 1];
            let triangle = Triangle {
                corners: corners.map(at),
                part: corners.map(part),
                light: corners.map(light),
                edges: drawn.map(|side| side && edges),
            };
            triangle.paint(&mut samples, columns, rows, finest);
        }
    }
    png(&samples, size)
}

/// A normal for every corner of every face: the mean of those of the faces around the node that are not across a
/// crease of more than forty degrees.
fn node_normals(faces: &[Face], points: &[Vector3]) -> Vec<Vec<Vector3>> {
    let mut around = vec![Vec::new(); points.len()];
    for face in faces {
        for &node in face.nodes() {
            around[node as usize].push(face.vector_area(points));
        }
    }
    let corner = |own: &Vector3, node: u32| {
        let smooth = around[node as usize].iter().filter(|area| area.normalize().dot(own) > 0.77);
        smooth.sum::<Vector3>().try_normalize(0.0).unwrap_or(*own)
    };
    (faces.iter())
        .map(|face| {
            let own = face.normal(points);
            face.nodes().iter().map(|&node| corner(&own, node)).collect()
        })
        .collect()
}

/// A triangle in samples of the image.
struct Triangle {
    corners: [Vector3; 3],
    part: [f64; 3],
    light: [f64; 3],
    edges: [bool; 3],
}

impl Triangle {
    fn paint(&self, samples: &mut [Sample], columns: usize, rows: usize, finest: f64) {
        let [a, b, c] = self.corners;
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        // Turned away: down is positive in an image.
        if area >= 0.0 {
            return;
        }
        let span = |of: fn(&Vector3) -> f64, count: usize| {
            let ends = self.corners.each_ref().map(of);
            let low = ends.into_iter().fold(f64::INFINITY, f64::min).floor().max(0.0);
            let high = ends.into_iter().fold(0.0, f64::max).ceil().min(count as f64);
            low as usize..high as usize
        };
        // Height of the triangle over each side, to measure the distance from the side in samples.
        let height = [[b, c], [c, a], [a, b]].map(|[p, q]| area.abs() / (q - p).xy().norm());
        let columns_in = span(|p| p.x, columns);
        for row in span(|p| p.y, rows) {
            for column in columns_in.clone() {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let weight = [[b, c], [c, a], [a, b]]
                    .map(|[p, q]| ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) / area);
                if weight.iter().any(|&w| w < 0.0) {
                    continue;
                }
                let mix = |values: [f64; 3]| (0..3).map(|k| weight[k] * values[k]).sum::<f64>();
                let depth = mix([a.z, b.z, c.z]);
                let sample = &mut samples[row * columns + column];
                if depth <= sample.depth {
                    continue;
                }
                let near = (0..3).any(|k| self.edges[k] && weight[k] * height[k] < 0.35 * finest / 2.0);
                let light = mix(self.light) * if near { 0.55 } else { 1.0 };
                let RGB(r, g, b) = colour(mix(self.part));
                *sample = Sample { depth, colour: [r, g, b].map(|c| f64::from(c) * light) };
            }
        }
    }
}

/// The mean of the samples of each pixel, as a data URI.
fn png(samples: &[Sample], [width, height]: [usize; 2]) -> Result<String, CaseError> {
    let columns = width * SAMPLES;
    let mut pixels = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let inside = (0..SAMPLES * SAMPLES).map(|k| {
                let (i, j) = (row * SAMPLES + k / SAMPLES, column * SAMPLES + k % SAMPLES);
                samples[i * columns + j].colour
            });
            let sum = inside.fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
            pixels.extend(sum.map(|c| (c / (SAMPLES * SAMPLES) as f64).round().clamp(0.0, 255.0) as u8));
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels));
    written.map_err(|error| CaseError::Drawing(error.to_string()))?;
    let mut uri = b"data:image/png;base64,".to_vec();
    encode_base64(&bytes, &mut uri);
    Ok(uri.into_iter().map(char::from).collect())
}
