//! Meshes of segmented images and of surface files: read, cut out, cleaned and made of the cells asked for, or taken from the cache.

use std::f64::consts::FRAC_PI_3;
use std::path::Path;

use pliant_geometry::io::{self, MeshFile, MeshFileError};
use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_imaging::{Cleaning, Image, ImageError, LabelError, ReadOptions, Smoothing};
use pliant_meshing::{
    Anatomy, Assessment, Closing, DEFAULT_CELL_LIMIT, Enclosed, Fewer, FieldMesh, FittedShells, MeshingError,
    Missed, OrganTets, SURFACE_PAIRS, SURFACE_SMOOTHING, ShellGoal, SurfaceRepairs, TriangleMesh, Voxels,
    require_room_for,
};

use super::{Builder, MeshOrigin};
use crate::cache::{Kept, Key};
use crate::diagnostic::Diagnostic;
use crate::format::{Cells, CleanTable, MeshTable, Protected};

/// Faces that meet at more than this angle meet at a crease, which even triangles keep [rad].
const CREASE: f64 = FRAC_PI_3;

/// All that a mesh is made by, but for the image. Its debug text is its part of the key in the cache.
#[derive(Clone, Debug)]
struct Recipe {
    cleaning: Cleaning,
    cells: Goal,
}

/// What a body is made of.
enum Scan {
    Image(Image, Cut),
    /// Triangles or quads in metres, and what is said about their file.
    Surface(MeshFile),
}

/// What of an image is the body.
#[derive(Clone, Debug)]
enum Cut {
    Labels(Vec<i32>),
    /// Voxels of at least this value.
    From(f64),
}

/// How fine tets or hexes are.
#[derive(Clone, Debug)]
struct Fineness {
    /// Their edge [m], if it is given.
    edge: Option<f64>,
    /// Edge of tets inside [m].
    inner_edge: Option<f64>,
    /// Labels with smaller tets, and their edges [m].
    protect: Vec<(i32, Option<f64>)>,
    /// Largest distance of tets from the body [m].
    distance: Option<f64>,
}

/// The cells and how fine they are.
#[derive(Clone, Debug)]
enum Goal {
    /// Tets or hexes.
    Volume(Cells, Fineness),
    /// Even triangles of this edge [m].
    Even(f64),
    Triangles(u32),
    /// Triangles as fine as the voxels.
    Finest,
    Shells(ShellGoal),
}

/// Why no mesh could be made: the key to point at, the message and what to do.
struct Fault {
    key: &'static str,
    message: String,
    help: &'static str,
}

impl Builder<'_> {
    /// The mesh of what is segmented in an image, or of what the surface of a file encloses.
    pub(super) fn scanned(&mut self, file: &Path, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let made = recipe(table).and_then(|recipe| Ok((self.scan(file, table)?, recipe)));
        let name = file.display().to_string();
        let made = made.and_then(|(scan, recipe)| {
            let key = self.cache.is_on().then(|| Key::new(|sink| scan.content(sink), &recipe));
            let kept = match key.as_ref().and_then(|key| self.cache.get(key)) {
                Some(kept) => (kept, Some("from the cache".into())),
                None => {
                    let made = recipe.make(&scan)?;
                    let put = key.map(|key| self.cache.put(&key, &made));
                    let how = put.map(|put| match put {
                        Ok(()) => "made, and kept in the cache".into(),
                        Err(error) => format!("made, but not kept in the cache: {error}"),
                    });
                    (made, how)
                }
            };
            Ok((scan, recipe, kept))
        });
        let (scan, recipe, (kept, how)) = match made {
            Ok(made) => made,
            Err(Fault { key, message, help }) => {
                self.error(&[path, &[key]].concat(), message, "here", help);
                return None;
            }
        };
        let (format, notes) = match &scan {
            Scan::Image(image, _) => (image.format.to_string(), &image.notes),
            Scan::Surface(file) => (file.format.clone(), &file.notes),
        };
        self.notes.extend(how.map(|how| format!("mesh of {name}: {how}")));
        self.notes.extend(notes.iter().chain(&kept.notes).map(|note| format!("{name}: {note}")));
        let place = self.source().span(path);
        self.out.extend(kept.doubts.into_iter().map(|doubt| {
            let help = "use finer cells, or `clean = { keep-largest = true }` for small pieces";
            Diagnostic::warning(doubt).at(place.clone(), "this mesh").help(help)
        }));
        let origin = format!("{name} ({format}), {}", recipe.words(&scan));
        Some(MeshOrigin { mesh: kept.mesh, origin })
    }

    fn scan(&self, file: &Path, table: &MeshTable) -> Result<Scan, Fault> {
        if table.image.is_some() {
            let cut = cut(table)?;
            return self.read_images(file, table).map(|image| Scan::Image(image, cut));
        }
        let mut read = io::read(&self.scene.folder.join(file)).map_err(|error| {
            let help = match error {
                MeshFileError::Open { .. } => "file names are relative to the scene file",
                _ => "`pliant info` reads a mesh file on its own",
            };
            Fault { key: "file", message: error.to_string(), help }
        })?;
        read.mesh.points.iter_mut().for_each(|point| *point *= table.scale);
        Ok(Scan::Surface(read))
    }

    /// The image, with the one that is added to it.
    fn read_images(&self, image: &Path, table: &MeshTable) -> Result<Image, Fault> {
        let read = |key, file: &Path| {
            pliant_imaging::read(&self.scene.folder.join(file), &ReadOptions::default()).map_err(|error| {
                let help = match error {
                    ImageError::Open { .. } => "file names are relative to the scene file",
                    _ => "`pliant labels` reads an image on its own",
                };
                Fault { key, message: error.to_string(), help }
            })
        };
        let first = read("image", image)?;
        let Some(second) = &table.add else { return Ok(first) };
        first.plus(&read("add", second)?).map_err(|error| Fault {
            key: "add",
            message: error.to_string(),
            help: "",
        })
    }
}

impl Scan {
    /// Gives all bytes that a mesh can depend on, in pieces.
    fn content(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Image(image, cut) => {
                sink(format!("{cut:?}").as_bytes());
                image.content(sink);
            }
            Self::Surface(file) => {
                let points = file.mesh.points.iter().flat_map(|x| [x.x, x.y, x.z]);
                sink(&points.flat_map(f64::to_le_bytes).collect::<Vec<u8>>());
                for block in &file.mesh.blocks {
                    sink(format!("{:?}", block.kind).as_bytes());
                    sink(&block.nodes.iter().flat_map(|node| node.to_le_bytes()).collect::<Vec<u8>>());
                }
            }
        }
    }
}

/// What a table asks for.
fn recipe(table: &MeshTable) -> Result<Recipe, Fault> {
    let refuse = |key, message: &str, help| Err(Fault { key, message: message.into(), help });
    let CleanTable { close_gaps, fill_holes, keep_largest } = table.clean.unwrap_or_default();
    let cleaning = Cleaning { close_gaps, fill_holes, keep_largest };
    let cells = goal(table)?;
    if table.fix.is_some() {
        return refuse(
            "fix",
            "`fix` repairs the cells of a mesh file",
            "`clean` cleans what new cells are made of",
        );
    }
    if table.file.is_some() {
        if table.clean.is_some() && !matches!(cells, Goal::Volume(..)) {
            let help = "leave it out: a surface is mended, and stays as it is otherwise";
            return refuse("clean", "`clean` is for tets and hexes in the surface of a file", help);
        }
        return Ok(Recipe { cleaning, cells });
    }
    if table.scale != 1.0 {
        return refuse("scale", "`scale` does not go with `image`", "an image tells its own unit");
    }
    Ok(Recipe { cleaning, cells })
}

/// What of an image a table asks for.
fn cut(table: &MeshTable) -> Result<Cut, Fault> {
    let refuse = |key, message: &str, help| Err(Fault { key, message: message.into(), help });
    let cut = match (table.label, &table.labels, table.threshold) {
        (Some(label), None, None) => Cut::Labels(vec![label]),
        (None, Some(labels), None) => Cut::Labels(labels.clone()),
        (None, None, Some(threshold)) => Cut::From(threshold),
        (None, None, None) => Cut::Labels(Vec::new()),
        _ => {
            let message = "an image is cut out by exactly one of `label`, `labels`, `threshold`";
            return refuse("image", message, "leave the others out");
        }
    };
    if table.add.is_some() && table.threshold.is_none() {
        return refuse("add", "`add` goes with `threshold` only", "labels are not added up");
    }
    Ok(cut)
}

/// The cells that a table asks for: of the sizes that it gives exactly one that goes with them.
fn goal(table: &MeshTable) -> Result<Goal, Fault> {
    let cells = table.made_of();
    let sizes = [
        ("edge", table.edge.is_some()),
        ("triangles", table.triangles.is_some()),
        ("shells", table.shells.is_some()),
        ("error", table.error.is_some()),
    ];
    let fitting: &[&str] = match cells {
        Cells::Tets | Cells::Hexes | Cells::ImmersedHexes => &["edge"],
        Cells::Surface => &["edge", "triangles"],
        Cells::Shells => &["shells", "error"],
    };
    let given: Vec<&'static str> =
        sizes.into_iter().filter(|(_, given)| *given).map(|(key, _)| key).collect();
    let words = words(cells);
    let of_tets = [
        ("inner-edge", table.inner_edge.is_some()),
        ("protect", table.protect.is_some()),
        ("distance", table.distance.is_some()),
    ];
    if let Some((key, _)) = of_tets.into_iter().find(|(_, given)| *given && cells != Cells::Tets) {
        let message = format!("`{key}` does not go with {words}");
        return Err(Fault { key, message, help: "it is for tets" });
    }
    let source = if table.file.is_some() { "file" } else { "image" };
    if let Some(key) = given.iter().copied().find(|key| !fitting.contains(key)) {
        let help = match cells {
            Cells::Shells => "shells are as many as `shells`, or as close as `error`",
            Cells::Surface => "a surface has even triangles of `edge`, or as few as `triangles`",
            _ => "their size is `edge`, in metres",
        };
        return Err(Fault { key, message: format!("`{key}` does not go with {words}"), help });
    }
    match (cells, table.edge, table.triangles, table.shells, table.error) {
        (Cells::Surface, Some(edge), None, ..) => Ok(Goal::Even(edge)),
        (Cells::Surface, None, Some(number), ..) => Ok(Goal::Triangles(number)),
        (Cells::Surface, None, None, ..) => Ok(Goal::Finest),
        (Cells::Shells, _, _, Some(number), None) => Ok(Goal::Shells(ShellGoal::Shells(number as usize))),
        (Cells::Shells, _, _, None, Some(error)) => Ok(Goal::Shells(ShellGoal::Error(error))),
        (Cells::Tets | Cells::Hexes | Cells::ImmersedHexes, edge, ..)
            if edge.is_some() || table.distance.is_some() =>
        {
            let protect = table.protect.iter().flatten().map(Protected::label_and_edge).collect();
            let MeshTable { inner_edge, distance, .. } = *table;
            Ok(Goal::Volume(cells, Fineness { edge, inner_edge, protect, distance }))
        }
        (Cells::Tets | Cells::Hexes | Cells::ImmersedHexes, None, ..) => Err(Fault {
            key: source,
            message: format!("{words} of an image or a surface need `edge`"),
            help: "add `edge`, the size of a cell in metres, for example `edge = 0.008`",
        }),
        _ => Err(Fault {
            key: source,
            message: format!(
                "{words} of an image or a surface need exactly one of {}",
                fitting.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
            ),
            help: "for example `error = 0.005`, half a percent of the diagonal, or `shells = 800`",
        }),
    }
}

/// The word for cells in messages.
pub(super) fn words(cells: Cells) -> &'static str {
    match cells {
        Cells::Tets => "tets",
        Cells::Hexes => "hexes",
        Cells::ImmersedHexes => "immersed hexes",
        Cells::Surface => "a surface",
        Cells::Shells => "shells",
    }
}

impl Fineness {
    /// The edge of the cells [m], or of the first ones where a distance is asked for, given the box of the body [m].
    fn edge_in(&self, bounds: [Vector3; 2]) -> f64 {
        let chosen = self.distance.map_or(0.0, |distance| OrganTets::edge_for(distance, bounds));
        self.edge.unwrap_or(chosen)
    }

    /// Tets as fine as this.
    fn tets(&self, edge: f64) -> OrganTets {
        let Self { inner_edge, distance, .. } = *self;
        OrganTets { inner_edge, distance, ..OrganTets::new(edge) }.protecting(&self.protect)
    }

    fn words(&self) -> String {
        let edge = self.edge.map(|edge| format!("of {edge} m"));
        let inner = self.inner_edge.map(|edge| format!("of {edge} m inside"));
        let distance = self.distance.map(|distance| format!("within {distance} m"));
        let protected = self.protect.iter().map(|(label, edge)| match edge {
            Some(edge) => format!("of {edge} m in label {label}"),
            None => format!("finer in label {label}"),
        });
        let all: Vec<String> = edge.into_iter().chain(inner).chain(protected).chain(distance).collect();
        all.join(", ")
    }
}

impl Recipe {
    fn words(&self, scan: &Scan) -> String {
        let cut = match scan {
            Scan::Surface(_) => "what it encloses".into(),
            Scan::Image(_, Cut::From(least)) => format!("from {least} on"),
            Scan::Image(_, Cut::Labels(labels)) => {
                format!("label {}", labels.iter().map(i32::to_string).collect::<Vec<_>>().join(", "))
            }
        };
        let cells = match &self.cells {
            Goal::Volume(cells, fineness) => format!("{} {}", words(*cells), fineness.words()),
            Goal::Even(edge) => format!("surface in triangles of {edge} m"),
            Goal::Triangles(number) => format!("surface in {number} triangles"),
            Goal::Finest => "surface as fine as it is given".into(),
            Goal::Shells(ShellGoal::Shells(number)) => format!("{number} shells"),
            Goal::Shells(ShellGoal::Error(error)) => format!("shells within {} %", 100.0 * error),
        };
        format!("{cut}, {cells}")
    }

    /// Cuts the body out, cleans it and makes its cells.
    fn make(&self, scan: &Scan) -> Result<Kept, Fault> {
        let key = match (&self.cells, scan) {
            (Goal::Volume(_, Fineness { edge: None, .. }), _) => "distance",
            (Goal::Volume(..) | Goal::Even(_), _) => "edge",
            (Goal::Triangles(_), _) => "triangles",
            (Goal::Finest, Scan::Image(..)) => "image",
            (Goal::Finest, Scan::Surface(_)) => "file",
            (Goal::Shells(ShellGoal::Shells(_)), _) => "shells",
            (Goal::Shells(ShellGoal::Error(_)), _) => "error",
        };
        let fault = |error: MeshingError| {
            let key = if matches!(error, MeshingError::NoSuchLabel { .. }) { "protect" } else { key };
            Fault { key, message: error.to_string(), help: "" }
        };
        let mut notes = Vec::new();
        let (mesh, doubts) = match (scan, &self.cells) {
            (Scan::Image(image, cut), goal) => {
                let (anatomy, cleaned) = self.anatomy(image, cut)?;
                if self.cleaning != Cleaning::default() {
                    notes.push(cleaned.to_string());
                }
                match goal {
                    Goal::Volume(cells, fineness) => {
                        let edge = fineness.edge_in(anatomy.field().bounds().into());
                        fill(&anatomy, *cells, &fineness.tets(edge), &mut notes)
                    }
                    goal => {
                        let voxel = image.grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
                        extracted(&anatomy, voxel).and_then(|surface| cover(surface, goal))
                    }
                }
            }
            (Scan::Surface(file), Goal::Volume(cells, fineness)) => {
                let edge = fineness.edge_in(file.mesh.bounds().unwrap_or_default().into());
                let request = fineness.tets(edge);
                self.enclosed(&file.mesh, &request, &mut notes)
                    .map_err(|error| Fault { key: "file", ..fault(error) })
                    .map(|anatomy| fill(&anatomy, *cells, &request, &mut notes))?
            }
            (Scan::Surface(file), goal) => {
                TriangleMesh::from_mesh(&file.mesh).and_then(|(surface, repairs)| {
                    if repairs != SurfaceRepairs::default() {
                        notes.push(repairs.to_string());
                    }
                    cover(surface, goal)
                })
            }
        }
        .map_err(fault)?;
        Ok(Kept { mesh, notes, doubts })
    }

    /// The body in a closed surface, which was mended where it had to be.
    fn enclosed(
        &self,
        mesh: &Mesh,
        request: &OrganTets,
        notes: &mut Vec<String>,
    ) -> Result<Anatomy<'static>, MeshingError> {
        let edge = request.edge;
        let Cleaning { close_gaps, fill_holes, keep_largest } = self.cleaning;
        let closing = Closing { holes: close_gaps, fill_cavities: fill_holes, keep_largest };
        let surface = Enclosed::new(mesh, edge, &closing)?;
        if surface.report.is_mended() {
            notes.push(format!("mended: {}", surface.report));
        }
        let kind =
            if matches!(self.cells, Goal::Volume(Cells::Tets, _)) { CellKind::Tet } else { CellKind::Hex };
        require_room_for(kind, edge, surface.volume(), DEFAULT_CELL_LIMIT)?;
        surface.fine_anatomy(1, edge, request.finest(), &|_| {})
    }

    fn anatomy(
        &self,
        image: &Image,
        cut: &Cut,
    ) -> Result<(Anatomy<'static>, pliant_imaging::Cleaned), Fault> {
        let (key, labels, chosen) = match cut {
            Cut::From(least) => ("threshold", Ok(image.threshold(*least..=f64::INFINITY)), vec![1]),
            Cut::Labels(labels) => {
                let key = ["image", "label", "labels"][labels.len().min(2)];
                (key, image.labels(), labels.clone())
            }
        };
        let fault = |key, error: LabelError| {
            let help = match error {
                LabelError::NoneChosen { .. } => "add `label = 1`, `labels = [1, 2]`, or `threshold = 0.5`",
                LabelError::NotWhole { .. } => "`threshold = 0.5` takes a map of probabilities",
                LabelError::Absent { .. } if matches!(cut, Cut::From(_)) => {
                    "no voxel is as large as that; use a lower threshold"
                }
                _ => "`pliant labels` lists the labels of an image",
            };
            let key = if matches!(error, LabelError::BadLength { .. }) { "clean" } else { key };
            Fault { key, message: error.to_string(), help }
        };
        let labels = labels.map_err(|error| fault("image", error))?;
        let smoothing = match self.cells {
            Goal::Volume(..) => Smoothing::default(),
            _ => SURFACE_SMOOTHING,
        };
        Anatomy::from_image(&labels, &chosen, &self.cleaning, &smoothing, &|_| {})
            .map_err(|error| fault(key, error))
    }
}

/// Fills an anatomy with labelled tets or hexes; what is doubtful about them comes along.
fn fill(
    anatomy: &Anatomy<'_>,
    cells: Cells,
    request: &OrganTets,
    notes: &mut Vec<String>,
) -> Result<(Mesh, Vec<String>), MeshingError> {
    let edge = request.edge;
    let mut doubts = Vec::new();
    let (mesh, dropped, pieces) = if cells == Cells::Tets {
        let made = request.mesh(anatomy, &|_| {})?;
        doubts = made.report.doubts();
        (made.mesh, made.report.repairs.dropped_cells, made.report.repairs.dropped_pieces)
    } else {
        let voxels = Voxels::new(edge);
        let immersed = cells == Cells::ImmersedHexes;
        let made = if immersed { voxels.immersed(anatomy.field()) } else { voxels.mesh(anatomy.field()) };
        let FieldMesh { mut mesh, dropped_cells, dropped_components, .. } = made?;
        anatomy.label(&mut mesh);
        (mesh, dropped_cells, dropped_components)
    };
    if pieces > 0 {
        notes.push(format!("{dropped} cells in {pieces} loose parts were dropped"));
    }
    let assessment = Assessment::of(&mesh, anatomy, edge)?;
    doubts.splice(0..0, assessment.missed.iter().map(Missed::to_string));
    Ok((mesh, doubts))
}

/// The surface of an anatomy as fine as its voxels [m].
fn extracted(anatomy: &Anatomy<'_>, voxel: f64) -> Result<TriangleMesh, MeshingError> {
    let mut surface = TriangleMesh::of_field(anatomy.field(), voxel, DEFAULT_CELL_LIMIT)?;
    surface.smooth(SURFACE_PAIRS);
    Ok(surface)
}

/// A surface in the triangles or shells asked for, and what is doubtful about it.
fn cover(mut surface: TriangleMesh, goal: &Goal) -> Result<(Mesh, Vec<String>), MeshingError> {
    match goal {
        Goal::Shells(goal) => {
            let FittedShells { mesh, report, .. } = FittedShells::new(&surface, *goal, &|_| {})?;
            let missed =
                "the error asked for was not reached: the surface may pass through itself or have creases";
            return Ok((mesh, if report.reached { Vec::new() } else { vec![missed.into()] }));
        }
        Goal::Even(edge) => {
            surface.mark_creases(CREASE);
            surface.remesh(*edge, DEFAULT_CELL_LIMIT)?;
        }
        Goal::Triangles(number) => {
            surface.decimate(Fewer::Triangles(*number as usize))?;
        }
        Goal::Finest | Goal::Volume(..) => {}
    }
    Ok((surface.to_mesh(), Vec::new()))
}
