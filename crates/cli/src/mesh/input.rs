//! Inputs of `pliant mesh` and `pliant labels`: images with their labels, and closed surfaces.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pliant_geometry::io::{self, Format, MeshFile};
use pliant_geometry::words::number;
use pliant_geometry::{CellLabel, Labels as CellLabels, UnknownLabel};
use pliant_imaging::{
    Border, Choice, Cleaned, Cleaning, Image, ImageError, ImageProblem, LabelChoice, LabelError, LabelImage,
    LabelNames, ReadOptions, Smoothing, read_with,
};
use pliant_meshing::{Anatomy, DEFAULT_CELL_LIMIT, MeshingError, OrganTets};
use pliant_scene::SizeDoubt;
use serde_json::{Value as Json, json};

use crate::arguments::MeshImage;
use crate::report::{Bar, Failure};

/// The requested image: a file or folder, or several masks.
pub struct Source<'a> {
    pub files: Vec<&'a PathBuf>,
    pub names: Option<&'a Path>,
    pub series: Option<String>,
    pub threshold: Option<f64>,
    pub force: bool,
}

impl Source<'_> {
    /// Reads the image; the bar moves up to `share` of the whole work.
    pub fn read(&self, bar: &Bar, share: f64) -> Result<Image, Failure> {
        let table = self.names.map(LabelNames::read).transpose().map_err(|error| image_failure(&error))?;
        let each = share / self.files.len() as f64;
        let read = |(at, path): (usize, &&PathBuf)| {
            let progress = |done: f64| bar.show(each * (at as f64 + done), "reading the image");
            read_with(path, &self.options(), &progress).map_err(|error| image_failure(&error))
        };
        let mut images = self.files.iter().enumerate().map(read).collect::<Result<Vec<_>, _>>()?;
        let mut image = if images.len() == 1 {
            images.remove(0)
        } else {
            let masks: Vec<(PathBuf, Image)> =
                self.files.iter().map(|&path| path.clone()).zip(images).collect();
            Image::of_masks(&masks, self.threshold).map_err(|error| label_failure(&error))?
        };
        if let Some(table) = table {
            image.names.extend(&table);
        }
        Ok(image)
    }

    fn options(&self) -> ReadOptions {
        let usual = ReadOptions { series: self.series.clone(), ..ReadOptions::default() };
        if self.force {
            ReadOptions { byte_limit: u64::MAX, voxel_limit: u32::MAX.into(), ..usual }
        } else {
            usual
        }
    }
}

/// True if the input is a mesh file, by its extension or its first bytes.
pub(crate) fn is_mesh_file(arguments: &MeshImage) -> bool {
    Format::of_file(&arguments.image).is_some()
}

/// The mesh of a file in metres; doubts about its size become warnings.
pub fn mesh_file(arguments: &MeshImage, warnings: &mut Vec<String>) -> Result<MeshFile, Failure> {
    let mut file = io::read(&arguments.image).map_err(|error| Failure::plain(error, ""))?;
    file.mesh.points.iter_mut().for_each(|point| *point *= arguments.scale.unwrap_or(1.0));
    let is_meant = |doubt: &SizeDoubt| arguments.scale.is_some() && doubt.is_possible();
    if let Some(doubt) = SizeDoubt::of(&file.mesh).filter(|doubt| !is_meant(doubt)) {
        let message = format!("`{}` measures {doubt}", arguments.image.display());
        if arguments.scale.is_none() && doubt.is_large() {
            return Err(Failure::plain(
                message,
                format!("{}; `--scale 1` if it is in metres", doubt.advice("--scale ")),
            ));
        }
        warnings.push(format!("{message}; {}", doubt.advice("--scale ")));
    }
    Ok(file)
}

/// The chosen labels of an image, cropped to the body.
pub struct Segmented {
    pub labels: LabelImage,
    pub chosen: Vec<i32>,
    /// Names of the chosen labels that have one.
    pub names: BTreeMap<i32, String>,
    /// Labels with smaller cells, and their edges [m].
    pub protect: Vec<(i32, Option<f64>)>,
    /// Least step from voxel to voxel [m].
    pub voxel: f64,
    /// The source as text and as JSON.
    pub lines: Vec<String>,
    pub object: Json,
    pub warnings: Vec<String>,
}

/// Share of reading and of cropping in the work on an image, for the bar.
const READING: f64 = 0.1;

/// The chosen labels of an image, or all voxels from a threshold. Very many voxels are resampled to suit the
/// cells.
pub fn regions(arguments: &MeshImage, bar: &Bar) -> Result<Segmented, Failure> {
    regions_in(image(arguments, bar)?, arguments, bar)
}

fn source(arguments: &MeshImage) -> Source<'_> {
    Source {
        files: std::iter::once(&arguments.image).chain(&arguments.masks).collect(),
        names: arguments.names.as_deref(),
        series: arguments.series.clone(),
        threshold: arguments.threshold,
        force: arguments.force,
    }
}

/// The image of the arguments, before labels are chosen.
pub fn image(arguments: &MeshImage, bar: &Bar) -> Result<Image, Failure> {
    source(arguments).read(bar, READING)
}

/// [`regions`] of an image that is read.
pub(crate) fn regions_in(mut image: Image, arguments: &MeshImage, bar: &Bar) -> Result<Segmented, Failure> {
    let refused = |error: LabelError| label_failure(&error);
    let masks = !arguments.masks.is_empty();
    let choice = match arguments.threshold {
        Some(least) if !masks => {
            if let Some(path) = &arguments.add {
                let added = read_with(path, &source(arguments).options(), &|_| {});
                image = image.plus(&added.map_err(|error| image_failure(&error))?).map_err(refused)?;
            }
            Choice::From(least)
        }
        _ if masks && arguments.label.is_empty() => {
            let every_mask = LabelChoice::Range(1, arguments.masks.len() as i32 + 1);
            image.choose(&[every_mask]).map_err(refused)?
        }
        _ => image.choose(&arguments.label).map_err(refused)?,
    };
    let chosen = if let Choice::Labels(labels) = &choice { &labels[..] } else { &[1] };
    let names = if matches!(choice, Choice::Labels(_)) { image.names.of(chosen) } else { BTreeMap::new() };
    let protect = protected(arguments, chosen, &names)?;
    let finest = arguments.edge.or(arguments.distance).map(|edge| tets(arguments, edge, &protect).finest());
    let coarsest = finest.map_or(f64::INFINITY, |finest| finest * COARSEST);
    let progress = |done: f64| bar.show(READING * (1.0 + done), "cutting the body out");
    let cut = image.cut(&choice, coarsest, &progress).map_err(|error| match (&error, &choice) {
        (LabelError::Absent { .. }, Choice::From(least)) => {
            Failure::plain(format!("no voxel is {least} or more"), "use a lower `--threshold`")
        }
        _ => label_failure(&error),
    })?;
    let mut lines = vec![format!("{}: {}", arguments.image.display(), image_line(&image))];
    lines.extend(image.notes.iter().chain(&cut.note()).map(|note| format!("note: {note}")));
    let named: Vec<String> = cut
        .chosen
        .iter()
        .filter(|&&label| image.names.get(label).is_some())
        .map(|&label| image.names.shown(label))
        .collect();
    if !named.is_empty() {
        lines.push(format!("labels           {}", named.join(", ")));
    }
    let mut object = image_object(&image);
    object["names"] = json!(
        cut.chosen
            .iter()
            .filter_map(|&label| Some((label.to_string(), image.names.get(label)?)))
            .collect::<BTreeMap<_, _>>()
    );
    let warning = |(label, border): (i32, Border)| {
        let what = if matches!(choice, Choice::From(_)) {
            "the body".into()
        } else {
            format!("label {}", image.names.shown(label))
        };
        format!("{what} lies at the border of the image ({border}) and may be cut off there")
    };
    let warnings = image.border(&choice).into_iter().map(warning).collect();
    let voxel = cut.labels.grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
    Ok(Segmented { labels: cut.labels, chosen: cut.chosen, names, protect, voxel, lines, object, warnings })
}

/// Labels with smaller cells from the command line, as numbers among the labels of the cells.
pub fn protected(
    arguments: &MeshImage,
    labels: &[i32],
    names: &BTreeMap<i32, String>,
) -> Result<Vec<(i32, Option<f64>)>, Failure> {
    let known: CellLabels = labels.iter().map(|label| (*label, names.get(label).cloned())).collect();
    let number = |(label, edge): &(CellLabel, Option<f64>)| match label {
        // The mesher rejects numbers without cells.
        CellLabel::Number(label) => Ok((*label, *edge)),
        CellLabel::Name(_) => Ok((known.find(label)?, *edge)),
    };
    let help = "`--label` selects the labels that are meshed; `pliant labels IMAGE` lists them, and `--names TABLE` names them";
    let found: Result<_, UnknownLabel> = arguments.protect.iter().map(number).collect();
    found.map_err(|error| Failure::plain(error, help))
}

fn image_failure(error: &ImageError) -> Failure {
    let help = match error {
        ImageError::Content { problem, .. } => match **problem {
            ImageProblem::MixedSeries { .. } => "`--series UID` selects one",
            ImageProblem::TooManyBytes { .. } | ImageProblem::TooManyVoxels { .. } => {
                "`--force` reads it anyway"
            }
            _ => "",
        },
        _ => "",
    };
    Failure::plain(error, help)
}

pub(crate) fn label_failure(error: &LabelError) -> Failure {
    let help = match error {
        LabelError::NotWhole { .. } => "`pliant mesh --threshold 0.5` reads a probability map",
        LabelError::Grey { .. } => {
            "`pliant mesh --threshold VALUE` takes all voxels with at least this value, such as 200 for bone in a CT"
        }
        LabelError::NoMask { .. } => {
            "`--threshold 0.5` takes the voxels of each mask with at least this value"
        }
        LabelError::NoSuchName { .. } | LabelError::AmbiguousName { .. } => {
            "`pliant labels IMAGE` lists the labels with their names; `--names TABLE` gives them names"
        }
        LabelError::NoneChosen { .. } => "choose with `--label N`, several times for several materials",
        LabelError::Absent { .. } | LabelError::Background { .. } | LabelError::EmptyRange { .. } => {
            "`pliant labels IMAGE` lists the labels with their sizes"
        }
        LabelError::BadLength { .. } => {
            "`--close-gaps 3mm` closes gaps of 3 mm; a length without a unit is in metres"
        }
        LabelError::TooManyVoxels { .. } => {
            "if `--close-gaps` is given: `--close-gaps 3mm` closes gaps of 3 mm; a length without a unit is in metres"
        }
        _ => "",
    };
    Failure::plain(error, help)
}

pub(crate) fn meshing_failure(error: &MeshingError, force: bool) -> Failure {
    if let MeshingError::OpenSurface { widest, .. } = error {
        // The width is a multiple of whole or tenth millimetres.
        let unit = if *widest > 1e-3 { 1e-3 } else { 1e-4 };
        let width = number((1e3 * unit * (widest / unit * (1.0 + 1e-9)).ceil() * 1e6).round() / 1e6);
        let help = format!(
            "`--close-gaps {width}mm` closes holes as wide as this one; a file in millimetres needs `--scale 0.001`"
        );
        return Failure::plain(error, help);
    }
    let help = match error {
        MeshingError::TooManyCells { .. } | MeshingError::LatticeTooLarge { .. } if !force => {
            "lengths without a unit are in metres: `--edge 8mm` or 0.008; `--force` makes that many anyway"
        }
        MeshingError::NothingEnclosed => "`pliant info` lists the contents of the file",
        MeshingError::NoSuchLabel { .. } => "`--label` selects the labels that are meshed",
        MeshingError::TooFine { .. } => "use a shorter `--edge` with it",
        MeshingError::NotPositive { .. } => "for example `--edge 8mm`, or 0.008 in metres",
        _ => "",
    };
    Failure::plain(error, help)
}

pub fn cell_limit(arguments: &MeshImage) -> usize {
    if arguments.force { usize::MAX } else { DEFAULT_CELL_LIMIT }
}

/// The chosen regions, cleaned and smoothed.
pub fn anatomy(
    arguments: &MeshImage,
    found: &Segmented,
    smoothing: &Smoothing,
    bar: &Bar,
) -> Result<(Anatomy<'static>, Cleaned), Failure> {
    let cleaning = Cleaning {
        close_gaps: arguments.close_gaps,
        fill_holes: arguments.fill_holes,
        keep_largest: arguments.keep_largest,
    };
    let rest = PARTS[0] - 2.0 * READING;
    let field = |done: f64| bar.show(2.0 * READING + rest * done, "smoothing the surface");
    Anatomy::from_image(&found.labels, &found.chosen, &cleaning, smoothing, &field)
        .map_err(|error| label_failure(&error))
}

/// The requested tets, with labels of smaller tets and their edges [m].
pub fn tets(arguments: &MeshImage, edge: f64, protect: &[(i32, Option<f64>)]) -> OrganTets {
    let MeshImage { inner_edge, distance, .. } = *arguments;
    OrganTets { inner_edge, distance, ..OrganTets::new(edge) }.protecting(protect)
}

/// Coarsest voxels, as a fraction of the edge of the cells.
pub const COARSEST: f64 = 0.25;

/// Shares of the whole work, for the bar: the field, the cells, the distances.
pub const PARTS: [f64; 3] = [0.3, 0.6, 0.1];

pub(crate) fn image_line(image: &Image) -> String {
    let [nx, ny, nz] = image.grid.dims;
    let [hx, hy, hz] = image.grid.spacing().map(|h| number(h * 1e3));
    format!("{}, {nx} × {ny} × {nz} voxels of {hx} × {hy} × {hz} mm", image.format)
}

pub(crate) fn image_object(image: &Image) -> Json {
    json!({
        "format": image.format, "size": image.grid.dims, "spacing": image.grid.spacing(), "notes": image.notes,
    })
}
