//! Meshes of segmented images and of surface files: read, cut out, cleaned and meshed with the requested
//! cells, or read from the cache.

use std::cell::Cell;
use std::f64::consts::FRAC_PI_3;
use std::path::{Path, PathBuf};

use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{Cells, CleanTable, Label, MeshTable};
use pliant_geometry::io::MeshFile;
use pliant_geometry::{CellKind, CellLabel, Labels, Mesh, Vector3, labels};
use pliant_imaging::{
    Border, Choice, Cleaning, Image, ImageError, LabelChoice, LabelError, LabelNames, ReadOptions, Smoothing,
};
use pliant_meshing::{
    Anatomy, Assessment, Closing, DEFAULT_CELL_LIMIT, Enclosed, Fewer, FieldMesh, FitProgress, FittedShells,
    MeshingError, Missed, OrganTets, SURFACE_SMOOTHING, ShellGoal, SurfaceCheck, SurfaceRepairs,
    TriangleMesh, Voxels, require_room_for,
};

use super::MeshOrigin;
use super::files::{MeshFault, words};
use crate::assemble::{Context, Meshing};
use crate::cache::{Kept, Key};

/// Faces that meet at more than this angle meet at a crease, which even triangles keep [rad].
const CREASE: f64 = FRAC_PI_3;

/// Voxels may be made coarser up to this part of the edge of the cells.
const COARSEST: f64 = 0.25;

/// Parts of the whole work that are done once the input is read, the body is cut out, and its shape is found.
const DONE: [f64; 3] = [0.2, 0.3, 0.5];

/// Name of the last part of the work.
const MAKING: &str = "making cells";

/// Receives the finished part of the work, from 0 to 1, and the name of the present work.
type Watch<'w> = &'w dyn Fn(f64, &'static str);

/// Parameters of a mesh besides the image. Their debug text is a part of the key in the cache.
#[derive(Clone, Debug)]
struct Recipe {
    cleaning: Cleaning,
    cells: Goal,
}

/// Source of a body.
enum Scan {
    Image(Image, Choice),
    /// Triangles or quads in metres, and the notes about their file.
    Surface(MeshFile),
}

/// Fineness of tets or hexes.
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

impl Context<'_> {
    /// Makes the mesh of a segmentation in an image, or of the inside of the surface in a file.
    pub(in crate::assemble) fn scanned(&mut self, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let body = path.get(1).copied().unwrap_or_default();
        let heard = self.watch;
        let watch: Watch<'_> = &|part, now| heard(Meshing { body, part, now });
        let made = recipe(table).and_then(|mut recipe| {
            let scan = self.scan(table, watch)?;
            recipe.protect(&scan, table)?;
            Ok((scan, recipe))
        });
        let name = match (&table.file, &table.given, &table.image, &table.masks) {
            (Some(file), ..) | (None, None, Some(file), _) => file.display().to_string(),
            (None, Some(name), ..) => name.clone(),
            (None, None, None, masks) => {
                let names = masks.iter().flatten().map(|mask| mask.display().to_string());
                names.collect::<Vec<_>>().join(", ")
            }
        };
        let made = made.and_then(|(scan, recipe)| {
            let key = self.cache.is_on().then(|| Key::new(|sink| scan.content(sink), &recipe));
            let kept = match key.as_ref().and_then(|key| self.cache.get(key)) {
                Some(kept) => (kept, Some("from the cache".into())),
                None => {
                    let made = recipe.make(&scan, watch)?;
                    let put = key.map(|key| self.cache.put(&key, &made));
                    let how = put.map(|put| match put {
                        Ok(()) => "made and stored in the cache".into(),
                        Err(error) => format!("made, but not stored in the cache: {error}"),
                    });
                    (made, how)
                }
            };
            Ok((scan, recipe, kept))
        });
        let (scan, recipe, (kept, how)) = match made {
            Ok(made) => made,
            Err(MeshFault { key, message, help }) => {
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
        let doubt = |message: String| Diagnostic::warning(message).at(place.clone(), "this mesh");
        self.out.extend(kept.doubts.into_iter().map(doubt));
        let whole = "if the organ extends beyond the image, its mesh ends there with a flat face";
        self.out.extend(scan.cut_off().into_iter().map(|message| doubt(message).help(whole)));
        let origin = format!("{name} ({format}), {}", recipe.words(&scan));
        let mut mesh = kept.mesh;
        let present = labels(&mesh).into_iter();
        mesh.label_names = present.filter_map(|label| Some((label, scan.name(label)?))).collect();
        Some(MeshOrigin { mesh, origin })
    }

    fn scan(&self, table: &MeshTable, watch: Watch<'_>) -> Result<Scan, MeshFault> {
        if table.own_cells().is_some() {
            return Ok(Scan::Surface(self.mesh_file(table)?.1));
        }
        require_one_cut(table)?;
        let mut image = self.read_images(table, watch)?;
        let choice = choice(&mut image, table)?;
        let image = with_vessels(image, &choice, table)?;
        Ok(Scan::Image(image, choice))
    }

    /// Reads the image, with the image that is added to it, or several masks as one image; with the names of
    /// its labels.
    fn read_images(&self, table: &MeshTable, watch: Watch<'_>) -> Result<Image, MeshFault> {
        let failed = |key, error: ImageError| {
            let help = match error {
                ImageError::Open { .. } => "file names are relative to the scene file",
                _ => "run `pliant labels` on the image for details",
            };
            MeshFault { key, message: error.to_string(), help: help.into() }
        };
        let within = self.scene.source.reads().folder().map(Path::to_owned);
        let options = ReadOptions { within, ..ReadOptions::default() };
        let allowed = |file: &Path| {
            let opened = |source| ImageError::Open { path: file.to_owned(), source };
            self.scene.file(file).map_err(opened)
        };
        let files = table.masks.as_ref().map_or(1, Vec::len).max(1) + usize::from(table.add.is_some());
        let each = DONE[0] / files as f64;
        let before = Cell::new(0.0);
        let given = &self.source().given().images;
        let read = |key, file: &Path| {
            if let Some(image) = file.to_str().and_then(|name| given.get(name)) {
                return Ok((**image).clone());
            }
            let progress = |done: f64| watch(before.get() + each * done, "reading the image");
            let image = allowed(file).and_then(|path| pliant_imaging::read_with(&path, &options, &progress));
            before.set(before.get() + each);
            image.map_err(|error| failed(key, error))
        };
        let mut image = match (&table.image, &table.masks) {
            (Some(image), _) => read("image", image)?,
            (None, masks) => {
                let one = |mask: &PathBuf| Ok((mask.clone(), read("masks", mask)?));
                let masks = masks.iter().flatten().map(one).collect::<Result<Vec<_>, MeshFault>>()?;
                Image::of_masks(&masks, table.threshold)
                    .map_err(|error| label_fault("masks", table, &error))?
            }
        };
        if let Some(second) = &table.add {
            image = image.plus(&read("add", second)?).map_err(|error| label_fault("add", table, &error))?;
        }
        if let Some(names) = &table.names {
            let word = Path::new("totalsegmentator");
            let names = if names == word { Ok(word.to_owned()) } else { allowed(names) };
            let names = names.and_then(|names| LabelNames::read(&names));
            image.names.extend(&names.map_err(|error| failed("names", error))?);
        }
        Ok(image)
    }
}

/// Chooses the labels that a table requests and the image has, or the threshold above which voxels are
/// inside.
fn choice(image: &mut Image, table: &MeshTable) -> Result<Choice, MeshFault> {
    if let (Some(threshold), None) = (table.threshold, &table.masks) {
        return Ok(Choice::From(threshold));
    }
    let (key, labels) = match (&table.label, &table.labels, &table.masks) {
        (Some(label), ..) => ("label", label.choices()),
        (None, Some(labels), _) => ("labels", labels.iter().map(Label::choice).collect()),
        (None, None, Some(masks)) => ("masks", vec![LabelChoice::Range(1, masks.len() as i32)]),
        (None, None, None) => ("image", Vec::new()),
    };
    image.choose(&labels).map_err(|error| {
        let whole = matches!(error, LabelError::Grey { .. } | LabelError::NotWhole { .. });
        label_fault(if whole { "image" } else { key }, table, &error)
    })
}

/// Returns the image with the vessels inside of the chosen labels as a part of those labels.
fn with_vessels(mut image: Image, choice: &Choice, table: &MeshTable) -> Result<Image, MeshFault> {
    let Some(vessels) = &table.vessels else { return Ok(image) };
    let Choice::Labels(organ) = choice else {
        let help = "select the organ by `label` or `labels`";
        let message = "`vessels` lie inside of labels, but this body is chosen by `threshold`".into();
        return Err(MeshFault { key: "vessels", message, help: help.into() });
    };
    let choices: Vec<LabelChoice> = vessels.iter().map(Label::choice).collect();
    let chosen = image.choose(&choices).map_err(|error| label_fault("vessels", table, &error))?;
    let Choice::Labels(vessels) = chosen else { return Ok(image) };
    let (mut filled, voxels) = image.with_vessels_inside(organ, &vessels);
    let [inside, outside] = voxels.map(|voxels| voxels as f64 * image.grid.voxel_volume() * 1e6);
    filled.notes.push(format!(
        "{inside:.2} ml of the vessels run inside of the organ and belong to it, {outside:.2} ml outside do not"
    ));
    Ok(filled)
}

fn label_fault(key: &'static str, table: &MeshTable, error: &LabelError) -> MeshFault {
    let help = match error {
        LabelError::NoneChosen { .. } => "add `label = 1`, `labels = [1, 2]`, or `threshold = 0.5`",
        LabelError::NotWhole { .. } => "`threshold = 0.5` takes a map of probabilities",
        LabelError::Grey { .. } => {
            "`threshold` takes all voxels with at least this value, such as 200 for bone in a CT"
        }
        LabelError::NoMask { .. } => {
            "`threshold = 0.5` takes the voxels of each mask with at least this value"
        }
        LabelError::NoSuchName { .. } | LabelError::AmbiguousName { .. } => {
            "`names = \"table.txt\"` gives the labels names; `pliant labels` lists them"
        }
        LabelError::Absent { .. } if table.threshold.is_some() => {
            "no voxel is as large as that; use a lower threshold"
        }
        LabelError::OtherVoxels { .. } => "",
        _ => "`pliant labels` lists the labels of an image",
    };
    let key = if matches!(error, LabelError::BadLength { .. }) { "clean" } else { key };
    MeshFault { key, message: error.to_string(), help: help.into() }
}

impl Scan {
    /// The labels that the cells get.
    fn labels(&self) -> &[i32] {
        match self {
            Self::Image(_, Choice::Labels(labels)) => labels,
            Self::Image(_, Choice::From(_)) | Self::Surface(_) => &[1],
        }
    }

    fn name(&self, label: i32) -> Option<String> {
        match self {
            Self::Image(image, Choice::Labels(_)) => image.names.get(label).map(str::to_owned),
            _ => None,
        }
    }

    /// Returns warnings about parts of the body that the border of the image may cut off.
    fn cut_off(&self) -> Vec<String> {
        let Self::Image(image, choice) = self else { return Vec::new() };
        let message = |(label, border): (i32, Border)| {
            let what = match choice {
                Choice::Labels(_) => format!("label {}", image.names.shown(label)),
                Choice::From(_) => "the body".into(),
            };
            format!("{what} lies at the border of the image ({border}): it may be cut off there")
        };
        image.border(choice).into_iter().map(message).collect()
    }

    /// Gives all bytes that a mesh can depend on, in pieces.
    fn content(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Image(image, choice) => {
                sink(format!("{choice:?}").as_bytes());
                image.content(sink);
            }
            Self::Surface(file) => {
                content_of(&file.mesh, sink);
            }
        }
    }
}

/// Gives all bytes of a mesh that its shape depends on, in pieces.
pub(in crate::assemble) fn content_of(mesh: &Mesh, sink: &mut dyn FnMut(&[u8])) {
    let points = mesh.points.iter().flat_map(|x| [x.x, x.y, x.z]);
    sink(&points.flat_map(f64::to_le_bytes).collect::<Vec<u8>>());
    for block in &mesh.blocks {
        sink(format!("{:?}", block.kind).as_bytes());
        sink(&block.nodes.iter().flat_map(|node| node.to_le_bytes()).collect::<Vec<u8>>());
    }
}

/// The request of a table.
fn recipe(table: &MeshTable) -> Result<Recipe, MeshFault> {
    let refuse =
        |key, message: &str, help: &str| Err(MeshFault { key, message: message.into(), help: help.into() });
    let CleanTable { close_gaps, fill_holes, keep_largest } = table.clean.unwrap_or_default();
    let cleaning = Cleaning { close_gaps, fill_holes, keep_largest };
    let cells = goal(table)?;
    if table.fix.is_some() {
        return refuse(
            "fix",
            "`fix` repairs the cells of a mesh file",
            "leave it out: `clean` cleans an image or a surface before new cells are made",
        );
    }
    if table.file.is_some() {
        if table.clean.is_some() && !matches!(cells, Goal::Volume(..)) {
            let help = "leave it out: Pliant repairs the surface and changes nothing else";
            return refuse("clean", "`clean` is for tets and hexes in the surface of a file", help);
        }
        return Ok(Recipe { cleaning, cells });
    }
    if table.factor() != 1.0 {
        return refuse("scale", "`scale` does not go with `image`", "an image states its own unit");
    }
    Ok(Recipe { cleaning, cells })
}

/// Checks that a table chooses the part of an image in exactly one way.
fn require_one_cut(table: &MeshTable) -> Result<(), MeshFault> {
    let refuse =
        |key, message: &str, help: &str| Err(MeshFault { key, message: message.into(), help: help.into() });
    let ways =
        [table.label.is_some(), table.labels.is_some(), table.threshold.is_some() && table.masks.is_none()];
    match &table.masks {
        Some(masks) if masks.is_empty() => {
            return refuse("masks", "`masks` names no image", "name at least one");
        }
        Some(masks) if masks.len() > 1000 => {
            return refuse("masks", "`masks` names more than 1000 images", "mesh them in parts");
        }
        _ => {}
    }
    if ways.iter().filter(|way| **way).count() > 1 {
        let message = "exactly one of `label`, `labels` and `threshold` selects the body in an image";
        return refuse(
            if table.image.is_some() { "image" } else { "masks" },
            message,
            "leave the others out",
        );
    }
    if table.add.is_some() && table.masks.is_some() {
        return refuse("add", "`add` goes with `image`, not with `masks`", "name it among the `masks`");
    }
    if table.add.is_some() && table.threshold.is_none() {
        return refuse(
            "add",
            "`add` goes with `threshold` only",
            "labels are not added up; `masks` takes several masks",
        );
    }
    Ok(())
}

/// The cells that a table requests, with exactly one size that fits them.
fn goal(table: &MeshTable) -> Result<Goal, MeshFault> {
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
        return Err(MeshFault { key, message, help: "leave it out: it is for tets".into() });
    }
    let source = match (&table.file, &table.masks) {
        (Some(_), _) => "file",
        (None, Some(_)) => "masks",
        (None, None) => "image",
    };
    if let Some(key) = given.iter().copied().find(|key| !fitting.contains(key)) {
        let help = match cells {
            Cells::Shells => "give the number of `shells`, or their largest `error`",
            Cells::Surface => "give `edge` for even triangles, or their number in `triangles`",
            _ => "give their size in `edge`, in metres",
        };
        return Err(MeshFault {
            key,
            message: format!("`{key}` does not go with {words}"),
            help: help.into(),
        });
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
            let MeshTable { inner_edge, distance, .. } = *table;
            Ok(Goal::Volume(cells, Fineness { edge, inner_edge, protect: Vec::new(), distance }))
        }
        (Cells::Tets | Cells::Hexes | Cells::ImmersedHexes, None, ..) => Err(MeshFault {
            key: source,
            message: format!("{words} of an image or a surface need `edge`"),
            help: "add `edge`, the size of a cell in metres, for example `edge = 0.008`".into(),
        }),
        _ => Err(MeshFault {
            key: source,
            message: format!(
                "{words} of an image or a surface need exactly one of {}",
                fitting.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
            ),
            help: "for example `error = 0.005`, half a percent of the diagonal, or `shells = 800`".into(),
        }),
    }
}

impl Fineness {
    /// The edge of the cells [m], or of the first ones where a distance is requested, given the box of the
    /// body [m].
    fn edge_in(&self, bounds: [Vector3; 2]) -> f64 {
        let chosen = self.distance.map_or(0.0, |distance| OrganTets::edge_for(distance, bounds));
        self.edge.unwrap_or(chosen)
    }

    /// The shortest edge, or the distance that is to be held [m].
    fn finest(&self) -> f64 {
        self.tets(self.edge.or(self.distance).unwrap_or(f64::INFINITY)).finest()
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
        let parts: Vec<String> = edge.into_iter().chain(inner).chain(protected).chain(distance).collect();
        parts.join(", ")
    }
}

impl Recipe {
    /// Takes the labels with smaller tets, by their numbers.
    fn protect(&mut self, scan: &Scan, table: &MeshTable) -> Result<(), MeshFault> {
        let Goal::Volume(_, fineness) = &mut self.cells else { return Ok(()) };
        let named = |label: i32| (label, scan.name(label));
        let known: Labels = scan.labels().iter().copied().map(named).collect();
        for protected in table.protect.iter().flatten() {
            let (label, edge) = protected.label_and_edge();
            let number = match label {
                // The mesher rejects a number that no cell gets.
                CellLabel::Number(number) => *number,
                CellLabel::Name(_) => known.find(label).map_err(|error| {
                    let help =
                        "`names = \"table.txt\"` gives the labels of an image names; `pliant labels` lists them";
                    MeshFault { key: "protect", message: error.to_string(), help: help.into() }
                })?,
            };
            fineness.protect.push((number, edge));
        }
        Ok(())
    }

    fn words(&self, scan: &Scan) -> String {
        let cut = match scan {
            Scan::Surface(_) => "its interior".into(),
            Scan::Image(_, Choice::From(least)) => format!("from {least} on"),
            Scan::Image(image, Choice::Labels(labels)) => {
                let shown = labels.iter().map(|&label| image.names.shown(label));
                format!("label {}", shown.collect::<Vec<_>>().join(", "))
            }
        };
        let cells = match &self.cells {
            Goal::Volume(cells, fineness) => format!("{} {}", words(*cells), fineness.words()),
            Goal::Even(edge) => format!("surface in triangles of {edge} m"),
            Goal::Triangles(number) => format!("surface in {number} triangles"),
            Goal::Finest => "surface at full resolution".into(),
            Goal::Shells(ShellGoal::Shells(number)) => format!("{number} shells"),
            Goal::Shells(ShellGoal::Error(error)) => format!("shells within {} %", 100.0 * error),
        };
        format!("{cut}, {cells}")
    }

    /// Cuts the body out, cleans it and makes its cells.
    fn make(&self, scan: &Scan, watch: Watch<'_>) -> Result<Kept, MeshFault> {
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
            MeshFault { key, message: error.to_string(), help: String::new() }
        };
        let mut notes = Vec::new();
        let (mesh, doubts) = match (scan, &self.cells) {
            (Scan::Image(image, choice), goal) => {
                let (anatomy, cleaned, voxel) = self.anatomy(image, choice, &mut notes, watch)?;
                if self.cleaning != Cleaning::default() {
                    notes.push(cleaned.to_string());
                }
                match goal {
                    Goal::Volume(cells, fineness) => {
                        let edge = fineness.edge_in(anatomy.field().bounds().into());
                        fill(&anatomy, *cells, &fineness.tets(edge), &mut notes, watch)
                    }
                    goal => TriangleMesh::of_image(&anatomy, voxel, DEFAULT_CELL_LIMIT)
                        .and_then(|surface| cover(surface, goal, Some(&anatomy), &mut notes, watch)),
                }
            }
            (Scan::Surface(file), Goal::Volume(cells, fineness)) => {
                let edge = fineness.edge_in(file.mesh.bounds().unwrap_or_default().into());
                let request = fineness.tets(edge);
                self.enclosed(&file.mesh, &request, &mut notes, watch)
                    .map_err(|error| MeshFault { key: "file", ..fault(error) })
                    .map(|anatomy| fill(&anatomy, *cells, &request, &mut notes, watch))?
            }
            (Scan::Surface(file), goal) => {
                TriangleMesh::from_mesh(&file.mesh).and_then(|(surface, repairs)| {
                    if repairs != SurfaceRepairs::default() {
                        notes.push(repairs.to_string());
                    }
                    cover(surface, goal, None, &mut notes, watch)
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
        watch: Watch<'_>,
    ) -> Result<Anatomy<'static>, MeshingError> {
        watch(0.0, "mending the surface");
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
        surface.fine_anatomy(1, edge, request.finest(), &|done| watch(DONE[2] * done, "finding the shape"))
    }

    /// Cuts the body out of an image. Returns it, the changes by cleaning, and the least step of its voxels
    /// [m].
    fn anatomy(
        &self,
        image: &Image,
        choice: &Choice,
        notes: &mut Vec<String>,
        watch: Watch<'_>,
    ) -> Result<(Anatomy<'static>, pliant_imaging::Cleaned, f64), MeshFault> {
        let key = match choice {
            Choice::From(_) => "threshold",
            Choice::Labels(labels) => ["image", "label", "labels"][labels.len().min(2)],
        };
        let table =
            MeshTable { threshold: matches!(choice, Choice::From(_)).then_some(0.0), ..MeshTable::default() };
        let fault = |error: LabelError| label_fault(key, &table, &error);
        let (smoothing, coarsest) = match &self.cells {
            Goal::Volume(_, fineness) => (Smoothing::default(), fineness.finest() * COARSEST),
            Goal::Even(edge) => (SURFACE_SMOOTHING, edge * COARSEST),
            _ => (SURFACE_SMOOTHING, f64::INFINITY),
        };
        let [read, cut_out, found] = DONE;
        let cutting = |done: f64| watch(read + (cut_out - read) * done, "cutting the body out");
        let cut = image.cut(choice, coarsest, &cutting).map_err(fault)?;
        notes.extend(cut.note());
        let voxel = cut.labels.grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let finding = |done: f64| watch(cut_out + (found - cut_out) * done, "finding the shape");
        let (anatomy, cleaned) =
            Anatomy::from_image(&cut.labels, &cut.chosen, &self.cleaning, &smoothing, &finding)
                .map_err(fault)?;
        Ok((anatomy, cleaned, voxel))
    }
}

/// Fills an anatomy with labelled tets or hexes; returns warnings about them.
fn fill(
    anatomy: &Anatomy<'_>,
    cells: Cells,
    request: &OrganTets,
    notes: &mut Vec<String>,
    watch: Watch<'_>,
) -> Result<(Mesh, Vec<String>), MeshingError> {
    watch(DONE[2], MAKING);
    let edge = request.edge;
    let mut doubts = Vec::new();
    let (mesh, dropped, pieces) = if cells == Cells::Tets {
        let made = request.mesh(anatomy, &|done| watch(DONE[2] + (1.0 - DONE[2]) * done, MAKING))?;
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

/// Covers a surface with the requested triangles or shells, with warnings. The surface of an image keeps its
/// volume.
fn cover(
    mut surface: TriangleMesh,
    goal: &Goal,
    anatomy: Option<&Anatomy<'_>>,
    notes: &mut Vec<String>,
    watch: Watch<'_>,
) -> Result<(Mesh, Vec<String>), MeshingError> {
    watch(DONE[2], MAKING);
    let input = surface.clone();
    match goal {
        Goal::Shells(goal) => {
            let fitting = |now: FitProgress| watch(DONE[2] + (1.0 - DONE[2]) * now.part, "fitting shells");
            let FittedShells { mesh, report, .. } = FittedShells::new(&surface, *goal, &fitting)?;
            return Ok((mesh, report.warnings()));
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
    let mut warnings = match anatomy.and_then(|anatomy| surface.keep_volume(anatomy)) {
        Some(kept) => {
            notes.extend(kept.note());
            kept.warnings()
        }
        None => surface.volume_warning(&input).into_iter().collect(),
    };
    let mesh = surface.to_parted_mesh();
    warnings.extend(SurfaceCheck::of(&mesh).doubt());
    Ok((mesh, warnings))
}
