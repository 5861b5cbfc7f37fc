//! Pictures of deformed bodies: surfaces painted with a z-buffer on the CPU, a map of colours from a value at the nodes,
//! the outline of the shape at rest, and a bar of the colours; several bodies seen alike in one SVG.

use std::fmt::Write;

use pliant_geometry::io::encode_base64;
use pliant_geometry::{Face, Mesh, Vector3, boundary};
use pliant_mechanics::tensor::Vector;
use plotters::style::RGBColor;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

use crate::CaseError;
use crate::case::Figure;
use crate::report::significant;

/// Width of a picture in the SVG, and height of what stands under it.
const WIDTH: f64 = 340.0;
const LABEL: f64 = 30.0;
const BAR: f64 = 62.0;
/// Pixels of the image per unit of the SVG, and samples per pixel and direction.
const DENSITY: usize = 2;
const SAMPLES: usize = 2;
/// Samples per unit of the SVG.
const FINE: f64 = (DENSITY * SAMPLES) as f64;
/// Where light comes from, seen by the camera: right, up, towards it.
const LIGHT: [f64; 3] = [-0.35, 0.65, 0.67];

/// A body in a certain state.
pub(crate) struct Body<'a> {
    pub label: String,
    pub mesh: &'a Mesh,
    pub displacement: Vec<Vector<f64>>,
    /// What the colour tells, at the nodes; grey without.
    pub value: Option<Vec<f64>>,
    /// Whether the edges of the faces are drawn.
    pub edges: bool,
}

impl<'a> Body<'a> {
    /// A body where the points of its mesh are, grey, with its edges.
    pub fn still(label: impl Into<String>, mesh: &'a Mesh) -> Self {
        Self {
            label: label.into(),
            mesh,
            displacement: vec![[0.0; 3]; mesh.points.len()],
            value: None,
            edges: true,
        }
    }
}

/// How bodies are looked at.
pub(crate) struct View<'a> {
    /// Towards the camera.
    pub from: Vector<f64>,
    /// The direction that is up.
    pub up: Vector<f64>,
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
        Vector3::new((x - self.corner[0]) * self.scale, self.height - (y - self.corner[1]) * self.scale, z)
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
        faces.flat_map(|(body, faces)| {
            let nodes = faces.iter().flat_map(|face| face.nodes());
            nodes.filter_map(|&node| body.value.as_ref().map(|value| value[node as usize]))
        })
    };
    let scale = [shown().fold(f64::INFINITY, f64::min), shown().fold(f64::NEG_INFINITY, f64::max)];
    let columns = view.columns.min(bodies.len());
    let cell = camera.height + LABEL;
    let rows = bodies.len().div_ceil(columns);
    // A place that no body takes is that of the bar, which nobody needs where nothing has a value.
    let (free, coloured) = (rows * columns > bodies.len(), scale[0] <= scale[1]);
    let below = if coloured && !free { BAR } else { 0.0 };
    let (width, height) = (WIDTH * columns as f64, cell * rows as f64 + below);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
         font-family=\"sans-serif\" font-size=\"16\" fill=\"#222\">\n"
    );
    for (index, (body, [rest, now])) in bodies.iter().zip(&places).enumerate() {
        let (x, y) = ((index % columns) as f64 * WIDTH, (index / columns) as f64 * cell);
        let (faces, value) = (&surfaces[index], body.value.as_deref());
        let image = png(&paint(faces, now, value, scale, &camera, body.edges))?;
        let cover = paint(faces, rest, None, scale, &camera, false);
        let (middle, base) = (0.5 * WIDTH, camera.height + 20.0);
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<g transform=\"translate({x:.1} {y:.1})\"><image width=\"{WIDTH}\" height=\"{:.1}\" href=\"{image}\"/>\
             <path d=\"{}\" fill=\"none\" stroke=\"#d1495b\" stroke-width=\"1.3\" stroke-linecap=\"round\"/>\
             <text x=\"{middle}\" y=\"{base:.1}\" text-anchor=\"middle\">{}</text></g>",
            camera.height,
            outline(faces, rest, &camera, &cover),
            body.label,
        );
    }
    let scale = scale.map(|value| value * view.factor);
    if coloured {
        let corner = if free {
            [width - WIDTH, height - 0.5 * (cell + BAR), WIDTH]
        } else {
            [0.0, height - BAR, width]
        };
        svg.push_str(&bar(view, scale, corner));
    }
    svg.push_str("</svg>\n");
    Ok(Figure { svg, caption: caption.into() })
}

/// The edges at which a surface turns away from the camera or ends, with nothing of it on one side, as an SVG path.
fn outline(faces: &[Face], points: &[Vector3], camera: &Camera, cover: &Samples) -> String {
    let mut edges: Vec<([u32; 2], bool)> = Vec::new();
    for face in faces {
        let (nodes, seen) = (face.nodes(), camera.turn(&face.vector_area(points)).z > 0.0);
        for (at, &a) in nodes.iter().enumerate() {
            let b = nodes[(at + 1) % nodes.len()];
            edges.push(([a.min(b), a.max(b)], seen));
        }
    }
    edges.sort_unstable();
    let mut path = String::new();
    for pair in edges.chunk_by(|a, b| a.0 == b.0) {
        let edge = match pair {
            [(edge, false), (_, true)] | [(edge, _)] => edge,
            _ => continue,
        };
        let [a, b] = edge.map(|node| camera.place(&points[node as usize]));
        if cover.ends_near(0.5 * (a + b)) {
            let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y);
        }
    }
    path
}

/// A bar of colours with its ends and its middle, from a corner on and as wide as told.
fn bar(view: &View<'_>, [low, high]: [f64; 2], [corner, top, width]: [f64; 3]) -> String {
    let (left, length) = (corner + 0.15 * width, 0.7 * width);
    let mut svg = String::from("<defs><linearGradient id=\"viridis\">");
    for stop in 0..=10 {
        let [r, g, b] = colour(f64::from(stop) / 10.0);
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
        text(left + part * length, top + 37.0, &significant(low + part * (high - low), 3));
    }
    text(corner + 0.5 * width, top + 56.0, view.quantity);
    svg
}

/// Grey, where there is no value.
const GREY: [f64; 3] = [205.0, 208.0, 212.0];

/// Viridis from 0 to 1: red, green and blue up to 255. What is not a number is grey.
fn colour(part: f64) -> [f64; 3] {
    if part.is_nan() {
        return GREY;
    }
    let RGBColor(r, g, b) = ViridisRGB.get_color(part.clamp(0.0, 1.0));
    [r, g, b].map(f64::from)
}

/// What one sample sees.
#[derive(Clone, Copy)]
struct Sample {
    depth: f64,
    colour: [f64; 3],
}

/// An image before it is reduced to pixels.
struct Samples {
    columns: usize,
    rows: usize,
    all: Vec<Sample>,
}

impl Samples {
    fn new(camera: &Camera) -> Self {
        let count = |length: f64| (length * DENSITY as f64).ceil() as usize * SAMPLES;
        let (columns, rows) = (count(WIDTH), count(camera.height));
        let nothing = Sample { depth: f64::NEG_INFINITY, colour: [255.0; 3] };
        Self { columns, rows, all: vec![nothing; columns * rows] }
    }

    /// Whether nothing is painted close to a place of the SVG.
    fn ends_near(&self, place: Vector3) -> bool {
        let near = 1.2 * FINE;
        let (x, y) = (place.x * FINE, place.y * FINE);
        [(-near, 0.0), (near, 0.0), (0.0, -near), (0.0, near)].into_iter().any(|(dx, dy)| {
            let (column, row) = ((x + dx).max(0.0) as usize, (y + dy).max(0.0) as usize);
            let at = row.min(self.rows - 1) * self.columns + column.min(self.columns - 1);
            self.all[at].depth == f64::NEG_INFINITY
        })
    }
}

/// The surface; grey without a value.
fn paint(
    faces: &[Face],
    points: &[Vector3],
    value: Option<&[f64]>,
    scale: [f64; 2],
    camera: &Camera,
    edges: bool,
) -> Samples {
    let mut samples = Samples::new(camera);
    let normals = corner_normals(faces, points);
    for (face, normals) in faces.iter().zip(&normals) {
        let nodes = face.nodes();
        let seen = camera.turn(&face.vector_area(points)).z > 0.0;
        let at = |k: usize| {
            let place = camera.place(&points[nodes[k] as usize]);
            Vector3::new(place.x * FINE, place.y * FINE, place.z)
        };
        let colour = |k: usize| match value {
            Some(value) => colour((value[nodes[k] as usize] - scale[0]) / (scale[1] - scale[0])),
            None => GREY,
        };
        let light = |k: usize| {
            let normal = camera.turn(&normals[k]) * if seen { 1.0 } else { -1.0 };
            0.55 + 0.45 * normal.dot(&Vector3::from(LIGHT)).max(0.0)
        };
        for k in 1..nodes.len() - 1 {
            // Which sides of the triangle, each opposite to a corner, are edges of the face. From behind, the other way round.
            let mut drawn = [true, k + 2 == nodes.len(), k == 1];
            let mut corners = [0, k, k + 1];
            if !seen {
                drawn.swap(1, 2);
                corners.swap(1, 2);
            }
            let triangle = Triangle {
                corners: corners.map(at),
                colour: corners.map(colour),
                light: corners.map(light),
                edges: drawn.map(|side| side && edges),
            };
            triangle.paint(&mut samples);
        }
    }
    samples
}

/// A normal for every corner of every face: the mean of those of the faces around the node that are not across a
/// crease of more than sixty degrees.
fn corner_normals(faces: &[Face], points: &[Vector3]) -> Vec<Vec<Vector3>> {
    let mut around = vec![Vec::new(); points.len()];
    for face in faces {
        for &node in face.nodes() {
            around[node as usize].push(face.vector_area(points));
        }
    }
    let corner = |own: &Vector3, node: u32| {
        let smooth = around[node as usize].iter().filter(|area| area.normalize().dot(own) > 0.5);
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
    colour: [[f64; 3]; 3],
    light: [f64; 3],
    edges: [bool; 3],
}

impl Triangle {
    fn paint(&self, samples: &mut Samples) {
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
        let sides = [[b, c], [c, a], [a, b]];
        // Height of the triangle over each side, to measure the distance from the side in samples.
        let height = sides.map(|[p, q]| area.abs() / (q - p).xy().norm());
        let columns = span(|p| p.x, samples.columns);
        for row in span(|p| p.y, samples.rows) {
            for column in columns.clone() {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let weight = sides.map(|[p, q]| ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) / area);
                if weight.iter().any(|&w| w < 0.0) {
                    continue;
                }
                let mix = |values: [f64; 3]| (0..3).map(|k| weight[k] * values[k]).sum::<f64>();
                let depth = mix([a.z, b.z, c.z]);
                let sample = &mut samples.all[row * samples.columns + column];
                if depth <= sample.depth {
                    continue;
                }
                let near = (0..3).any(|k| self.edges[k] && weight[k] * height[k] < 0.2 * FINE);
                let light = mix(self.light);
                let face = [0, 1, 2].map(|channel| light * mix(self.colour.map(|colour| colour[channel])));
                // Edges show on bright and on dark faces alike.
                let dark = face.iter().sum::<f64>() < 180.0;
                let colour = match near {
                    true if dark => face.map(|c| c + 38.0),
                    true => face.map(|c| 0.72 * c),
                    false => face,
                };
                *sample = Sample { depth, colour };
            }
        }
    }
}

/// The mean of the samples of each pixel, as a data URI.
fn png(samples: &Samples) -> Result<String, CaseError> {
    let (width, height) = (samples.columns / SAMPLES, samples.rows / SAMPLES);
    let mut pixels = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let inside = (0..SAMPLES * SAMPLES).map(|k| {
                let (i, j) = (row * SAMPLES + k / SAMPLES, column * SAMPLES + k % SAMPLES);
                samples.all[i * samples.columns + j].colour
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

#[cfg(test)]
mod tests {
    use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};

    use super::*;

    fn cube() -> (Mesh, Vec<Face>, Camera) {
        let block = Block::new([1.0; 3]);
        let mesh = block.mesh(Resolution::Counts([2; 3]), VolumeCell::Hex, DEFAULT_CELL_LIMIT).unwrap();
        let view = View { from: [1.0; 3], up: [0.0, 0.0, 1.0], quantity: "", factor: 1.0, columns: 1 };
        let camera = Camera::new(&view, mesh.points.iter().copied());
        let faces = boundary(&mesh).faces;
        (mesh, faces, camera)
    }

    #[test]
    fn the_nearer_face_hides_the_farther_whatever_their_order() {
        let (mesh, mut faces, camera) = cube();
        let value: Vec<f64> = mesh.points.iter().map(|point| point.x + point.y + point.z).collect();
        let colours = |faces: &[Face]| -> Vec<[f64; 3]> {
            let samples = paint(faces, &mesh.points, Some(&value), [0.0, 3.0], &camera, false);
            samples.all.iter().map(|sample| sample.colour).collect()
        };
        let seen = colours(&faces);
        faces.reverse();
        assert_eq!(seen, colours(&faces));
        let samples = paint(&faces, &mesh.points, None, [0.0, 1.0], &camera, false);
        let middle = camera.place(&Vector3::repeat(0.5)) * FINE;
        let sample = samples.all[middle.y as usize * samples.columns + middle.x as usize];
        // The corner (1, 1, 1) stands before the centre, at √3 along the view.
        assert!((sample.depth - 3.0_f64.sqrt()).abs() < 0.01, "{}", sample.depth);
        assert_eq!(samples.all[0].colour, [255.0; 3], "a corner of the image is empty");
    }

    #[test]
    fn a_cube_seen_along_its_diagonal_has_an_outline_of_six_edges() {
        let (mesh, faces, camera) = cube();
        let cover = paint(&faces, &mesh.points, None, [0.0, 1.0], &camera, false);
        // Each of two elements.
        assert_eq!(outline(&faces, &mesh.points, &camera, &cover).matches('M').count(), 12);
    }
}
