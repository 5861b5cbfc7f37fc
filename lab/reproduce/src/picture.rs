//! Pictures of deformed bodies, drawn by the renderer of `pliant render`. One SVG shows several bodies in a
//! common view, the shape at rest as a ghost, and a colour bar. Without the feature `viewer` or an adapter,
//! the page explains their absence.

use pliant_geometry::Mesh;
use pliant_mechanics::tensor::Vector;

use crate::CaseError;
use crate::case::Figure;

/// A body in a certain state.
#[cfg_attr(not(feature = "viewer"), expect(dead_code, reason = "only pictures read it"))]
#[derive(Clone)]
pub(crate) struct Body<'a> {
    pub label: String,
    pub mesh: &'a Mesh,
    pub displacement: Vec<Vector<f64>>,
    /// The quantity shown by colour, at the nodes; without it the body has the colour of tissue.
    pub value: Option<Vec<f64>>,
    /// True to draw the edges of the faces.
    pub edges: bool,
    /// True if it has the texture of moist tissue.
    pub skin: bool,
}

impl<'a> Body<'a> {
    /// A body at the points of its mesh, with its edges.
    pub fn still(label: impl Into<String>, mesh: &'a Mesh) -> Self {
        Self {
            label: label.into(),
            mesh,
            displacement: vec![[0.0; 3]; mesh.points.len()],
            value: None,
            edges: true,
            skin: false,
        }
    }
}

/// The view of bodies.
#[cfg_attr(not(feature = "viewer"), expect(dead_code, reason = "only pictures read it"))]
pub(crate) struct View<'a> {
    /// Towards the camera.
    pub from: Vector<f64>,
    /// The direction that is up.
    pub up: Vector<f64>,
    /// The quantity shown by colour, with its unit.
    pub quantity: &'a str,
    /// Factor from the values to the unit.
    pub factor: f64,
    /// Pictures side by side.
    pub columns: usize,
}

/// The bodies side by side, in one scale of colours.
pub(crate) fn figure(
    bodies: &[Body<'_>],
    view: &View<'_>,
    caption: impl Into<String>,
) -> Result<Figure, CaseError> {
    Ok(Figure { svg: drawn::svg(bodies, view)?, caption: caption.into() })
}

/// The text in place of a picture.
pub(crate) const NO_PICTURE: &str = if cfg!(feature = "viewer") {
    "Pictures are missing: they need a driver for Vulkan, Metal or Direct3D 12, such as Mesa's software Vulkan."
} else {
    "Pictures need a build with `cargo build --release --features viewer`."
};

#[cfg(not(feature = "viewer"))]
mod drawn {
    use super::{Body, CaseError, View};

    pub(super) fn svg(_bodies: &[Body<'_>], _view: &View<'_>) -> Result<Option<String>, CaseError> {
        Ok(None)
    }
}

#[cfg(feature = "viewer")]
mod drawn {
    use std::fmt::Write;
    use std::sync::OnceLock;

    use pliant_geometry::Vector3;
    use pliant_geometry::io::encode_base64;
    use pliant_picture::{
        Axis, Background, Camera, ColourMap, Frame, Graphics, Offscreen, PictureError, Projection, Regions,
        Style, Subject, Texture,
    };

    use super::{Body, CaseError, View};
    use crate::digits::significant;

    /// Width of a picture in the SVG, and height of the text below it.
    const WIDTH: f64 = 340.0;
    const LABEL: f64 = 30.0;
    const BAR: f64 = 62.0;
    /// Pixels per unit of the SVG.
    const DENSITY: f64 = 2.0;
    /// Room around the bodies, over their size.
    const MARGIN: f64 = 0.05;

    /// The adapter, opened once; its absence is reported once.
    fn graphics() -> Option<&'static Graphics> {
        use std::io::Write as _;
        static GRAPHICS: OnceLock<Option<Graphics>> = OnceLock::new();
        let open = || {
            let note = |error: &PictureError| {
                // Nobody reads it where standard error can't be written.
                let _ = writeln!(std::io::stderr(), "note: no pictures: {error}; {}", error.remedy());
            };
            Graphics::open().inspect_err(note).ok()
        };
        GRAPHICS.get_or_init(open).as_ref()
    }

    pub(super) fn svg(bodies: &[Body<'_>], view: &View<'_>) -> Result<Option<String>, CaseError> {
        let Some(graphics) = graphics() else { return Ok(None) };
        let subjects: Vec<Subject> = bodies.iter().map(|body| Subject::new(body.mesh)).collect();
        let frames: Vec<Frame> = bodies.iter().map(frame).collect();
        let seen = || subjects.iter().zip(&frames).map(|(subject, frame)| (subject.surface_points(), frame));
        let still = |body: &Body<'_>| Frame { points: body.mesh.points.clone(), ..Frame::default() };
        let resting: Vec<Frame> = bodies.iter().map(still).collect();
        let rest = subjects.iter().zip(&resting).map(|(subject, frame)| (subject.surface_points(), frame));
        let (camera, height) = camera(view, seen().chain(rest));
        let shown = || {
            let values = seen()
                .flat_map(|(points, frame)| points.into_iter().filter_map(|p| frame.values.get(p as usize)));
            values.copied().filter(|value| value.is_finite())
        };
        let scale = [shown().fold(f64::INFINITY, f64::min), shown().fold(f64::NEG_INFINITY, f64::max)];
        let columns = view.columns.min(bodies.len());
        let cell = height + LABEL;
        let rows = bodies.len().div_ceil(columns);
        // A free cell of the grid takes the bar, which is unnecessary if no body has values.
        let (free, coloured) = (rows * columns > bodies.len(), scale[0] <= scale[1]);
        let below = if coloured && !free { BAR } else { 0.0 };
        let (all_width, all_height) = (WIDTH * columns as f64, cell * rows as f64 + below);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {all_width:.0} {all_height:.0}\" \
             font-family=\"sans-serif\" font-size=\"16\" fill=\"#222\">\n"
        );
        for (index, (body, (subject, frame))) in bodies.iter().zip(subjects.iter().zip(&frames)).enumerate() {
            let (x, y) = ((index % columns) as f64 * WIDTH, (index / columns) as f64 * cell);
            let style = Style {
                range: (coloured && body.value.is_some()).then_some(scale),
                edges: body.edges,
                texture: if body.skin { Texture::Skin } else { Texture::None },
                ghost: body.displacement.iter().flatten().any(|u| *u != 0.0),
                background: Background::White,
                ..Style::default()
            };
            let size = [WIDTH, height].map(|length| (DENSITY * length).ceil() as u32);
            let image = image(graphics, subject, frame, &camera, &style, size)
                .map_err(|error| CaseError::Drawing(error.to_string()))?;
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<g transform=\"translate({x:.1} {y:.1})\"><image width=\"{WIDTH}\" height=\"{height:.1}\" \
                 href=\"{image}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text></g>",
                0.5 * WIDTH,
                height + 20.0,
                body.label,
            );
        }
        if coloured {
            let corner = if free {
                [all_width - WIDTH, all_height - 0.5 * (cell + BAR), WIDTH]
            } else {
                [0.0, all_height - BAR, all_width]
            };
            svg.push_str(&bar(view, scale.map(|value| value * view.factor), corner));
        }
        svg.push_str("</svg>\n");
        Ok(Some(svg))
    }

    fn frame(body: &Body<'_>) -> Frame {
        let moved = body.mesh.points.iter().zip(&body.displacement);
        Frame {
            points: moved.map(|(point, &u)| point + Vector3::from(u)).collect(),
            values: body.value.clone().unwrap_or_default(),
            critical: None,
        }
    }

    /// A camera that shows all bodies alike, without perspective, and the height of their pictures in the
    /// SVG.
    fn camera<'f>(view: &View<'_>, seen: impl Iterator<Item = (Vec<u32>, &'f Frame)>) -> (Camera, f64) {
        let mut camera = Camera {
            projection: Projection::Orthographic,
            ..Camera::looking(&Vector3::from(view.from), Axis::nearest(&Vector3::from(view.up)))
        };
        let points: Vec<Vector3> = seen
            .flat_map(|(points, frame)| points.into_iter().map(|point| frame.points[point as usize]))
            .collect();
        let axes = camera.axes();
        let extent = |axis: &Vector3| {
            let along = points.iter().map(|point| axis.dot(point));
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        let [across, upwards] = [extent(&axes[0]), extent(&axes[1])];
        let margin = MARGIN * across.max(upwards);
        let height = WIDTH * (upwards + 2.0 * margin) / (across + 2.0 * margin);
        camera.fit(&points, WIDTH / height);
        camera.height = upwards + 2.0 * margin;
        (camera, height)
    }

    /// A picture as a data URI.
    fn image(
        graphics: &Graphics,
        subject: &Subject,
        frame: &Frame,
        camera: &Camera,
        style: &Style,
        size: [u32; 2],
    ) -> Result<String, PictureError> {
        let picture =
            Offscreen::new(graphics, subject, size)?.draw(frame, camera, style, &Regions::default())?;
        let mut uri = b"data:image/png;base64,".to_vec();
        encode_base64(&picture.png()?, &mut uri);
        Ok(uri.into_iter().map(char::from).collect())
    }

    /// A colour bar with its ends and its middle, from a corner, with a given width.
    fn bar(view: &View<'_>, [low, high]: [f64; 2], [corner, top, width]: [f64; 3]) -> String {
        let (left, length) = (corner + 0.15 * width, 0.7 * width);
        let mut svg = String::from("<defs><linearGradient id=\"viridis\">");
        for stop in 0..=10 {
            let [r, g, b] = ColourMap::Viridis.at(f64::from(stop) / 10.0);
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

    #[cfg(test)]
    mod tests {
        use pliant_meshing::{Block, DEFAULT_CELL_LIMIT, Resolution, VolumeCell};

        use super::*;

        #[test]
        fn bodies_are_seen_alike_with_labels_and_one_bar() {
            if graphics().is_none() {
                assert!(std::env::var_os("PLIANT_REQUIRE_GPU").is_none(), "nothing draws here");
                return;
            }
            let block = Block::new([1.0, 1.0, 2.0]);
            let mesh = block.mesh(Resolution::Counts([2; 3]), VolumeCell::Hex, DEFAULT_CELL_LIMIT).unwrap();
            let value: Vec<f64> = mesh.points.iter().map(|point| point.z).collect();
            let bodies = [
                Body::still("(a) plain", &mesh),
                Body { value: Some(value), ..Body::still("(b) coloured", &mesh) },
            ];
            let view = View {
                from: [1.0, 0.0, 0.0],
                up: [0.0, 0.0, 1.0],
                quantity: "height [mm]",
                factor: 1e3,
                columns: 2,
            };
            let drawn = svg(&bodies, &view).unwrap().unwrap();
            assert_eq!(drawn.matches("data:image/png").count(), 2);
            for piece in ["(a) plain", "(b) coloured", "height [mm]", ">2000<", ">0<"] {
                assert!(drawn.contains(piece), "{piece}");
            }
            // From the side it is 1 wide and 2 high, with a margin of a twentieth of that all around.
            let frames = bodies.iter().map(frame).collect::<Vec<_>>();
            let (camera, height) = camera(&view, frames.iter().map(|frame| ((0..27).collect(), frame)));
            assert!((height / WIDTH - 2.2 / 1.2).abs() < 1e-9 && (camera.height - 2.2).abs() < 1e-9);
        }
    }
}
