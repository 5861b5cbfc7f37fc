//! `pliant mesh IMAGE -o scene.toml`: the scene of an organ with vessels and capsule.

use std::fs;
use std::path::{Path, PathBuf};

use pliant_format::OrganScene;
use pliant_geometry::Vector3;
use pliant_imaging::{Choice, Image, LabelChoice};

use super::input::{image, is_mesh_file, label_failure, regions_in};
use crate::SUCCESS;
use crate::arguments::{MeshCells, MeshImage};
use crate::report::{Bar, Failure, say};

/// True if the output is a scene.
pub(crate) fn is_scene(arguments: &MeshImage) -> bool {
    arguments.out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
}

/// Writes the scene; images are meshed when it runs.
pub fn scene(arguments: &MeshImage) -> Result<u8, Failure> {
    let Some(edge) = arguments.edge else {
        return Err(Failure::plain("the edge of the cells is missing", "for example `--edge 8mm`"));
    };
    without_effect(arguments)?;
    if arguments.out.exists() && !arguments.force {
        let message = format!("`{}` exists already", arguments.out.display());
        return Err(Failure::plain(message, "choose another name, or overwrite it with `--force`"));
    }
    let sources = Sources::of(arguments)?;
    let bar = Bar::new();
    let vessels: Vec<LabelChoice> = arguments.vessels.iter().map(|(label, _)| label.clone()).collect();
    let organ = MeshImage { label: sources.organ, ..arguments.clone() };
    let found = image(arguments, &bar).and_then(|image| {
        let (image, volumes) = with_vessels(image, &organ, &vessels)?;
        Ok((regions_in(image, &organ, &bar)?, volumes))
    });
    bar.finish();
    let (found, volumes) = found?;
    for line in &found.lines {
        say(line)?;
    }
    if let Some([inside, outside]) = volumes {
        let voxels = found.labels.labels.iter().filter(|&&label| label != 0).count();
        let tissue = voxels as f64 * found.labels.grid.voxel_volume();
        say(format_args!(
            "tissue           {:.2} ml, including {:.2} ml of vessels; {:.2} ml of vessels lie outside",
            tissue * 1e6,
            inside * 1e6,
            outside * 1e6
        ))?;
    }
    found.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let grid = &found.labels.grid;
    let inside = (found.labels.labels.iter().enumerate()).filter(|(_, label)| **label != 0);
    let places = inside.map(|(at, _)| grid.position(&grid.triple(at).map(|x| x as f64).into()));
    let Some(bounds) = bulk(places.collect()) else {
        return Err(Failure::plain(
            "no voxel has any of the chosen labels",
            "`pliant labels IMAGE` lists them",
        ));
    };
    let folder = arguments.out.parent().unwrap_or(Path::new(""));
    let source = |files: &[&PathBuf], labels: &str| source(arguments, folder, files, labels);
    let with_thickness = |((files, label), (_, thickness)): (&(Vec<&PathBuf>, String), &(_, f64))| {
        (source(files, &format!("label = {label}")), *thickness)
    };
    let organ = OrganScene {
        title: folder_name(&arguments.out),
        source: source(&sources.files, &sources.labels),
        edge,
        vessels: sources.vessels.iter().zip(&arguments.vessels).map(with_thickness).collect(),
        capsule: arguments.capsule,
        bounds,
    };
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(&arguments.out, organ.text()));
    written.map_err(|error| {
        let message = format!("`{}` cannot be written: {error}", arguments.out.display());
        Failure::plain(
            message,
            "check the folder, its permissions and the free space, or choose another name",
        )
    })?;
    let out = arguments.out.display();
    say(format_args!("wrote {out}; try: pliant check {out} && pliant run {out}"))?;
    Ok(SUCCESS)
}

/// Refuses options that have no effect on a scene.
fn without_effect(arguments: &MeshImage) -> Result<(), Failure> {
    let idle = [
        (is_mesh_file(arguments), "a scene as output needs images as input"),
        (
            !matches!(arguments.cells, MeshCells::Tets),
            "a scene meshes its tissue with tets: `--as` has no effect",
        ),
        (arguments.threshold.is_some(), "`--threshold` is for meshes: a scene needs labels"),
        (arguments.distance.is_some(), "`--distance` is for meshes"),
        (arguments.inner_edge.is_some(), "`--inner-edge` is for meshes"),
        (!arguments.protect.is_empty(), "`--protect` is for meshes"),
        (arguments.series.is_some(), "`--series` is for meshes"),
        (arguments.json, "`--json` is for meshes"),
    ];
    match idle.into_iter().find(|(idle, _)| *idle) {
        Some((_, message)) => Err(Failure::plain(message, "leave it out, or name a mesh file as output")),
        None => Ok(()),
    }
}

/// The image with the vessels inside of the organ as tissue, and their volumes inside and outside [m³]. Masks
/// stay as they are.
fn with_vessels(
    mut image: Image,
    organ: &MeshImage,
    vessels: &[LabelChoice],
) -> Result<(Image, Option<[f64; 2]>), Failure> {
    let mut chosen = |labels: &[LabelChoice]| match image.choose(labels) {
        Ok(Choice::Labels(labels)) => Ok(labels),
        Ok(Choice::From(_)) => Ok(Vec::new()),
        Err(error) => Err(label_failure(&error)),
    };
    if vessels.is_empty() || !organ.masks.is_empty() {
        return Ok((image, None));
    }
    let [organ, vessels] = [chosen(&organ.label)?, chosen(vessels)?];
    let (filled, voxels) = image.with_vessels_inside(&organ, &vessels);
    Ok((filled, Some(voxels.map(|voxels| voxels as f64 * image.grid.voxel_volume()))))
}

/// Corners of a box around most places: along each axis one in two hundred is left out at either end. Loose
/// voxels do not count.
fn bulk(places: Vec<Vector3>) -> Option<[Vector3; 2]> {
    let last = places.len().checked_sub(1)?;
    let mut bounds = [Vector3::zeros(); 2];
    for axis in 0..3 {
        let mut along: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        along.sort_unstable_by(f64::total_cmp);
        bounds[0][axis] = along[last / 200];
        bounds[1][axis] = along[last - last / 200];
    }
    Some(bounds)
}

/// Sources of organ and vessels.
struct Sources<'a> {
    /// Labels that choose the organ in the input.
    organ: Vec<LabelChoice>,
    /// Its files, and its labels as the keys of a scene.
    files: Vec<&'a PathBuf>,
    labels: String,
    /// Files and labels of each vessel.
    vessels: Vec<(Vec<&'a PathBuf>, String)>,
}

impl<'a> Sources<'a> {
    /// Finds the sources. In one image the tissue takes the voxels of the vessels inside; masks overlap, and
    /// each is a source by itself.
    fn of(arguments: &'a MeshImage) -> Result<Self, Failure> {
        let vessels = || arguments.vessels.iter().map(|(label, _)| label);
        if arguments.masks.is_empty() {
            let list = |names: Vec<String>| names.join(", ");
            let groups =
                arguments.label.iter().filter(|label| matches!(label, LabelChoice::Group(..))).count();
            if groups > 0 && groups < arguments.label.len() {
                return Err(Failure::plain(
                    "`--label` mixes labels and groups",
                    "make each label a group, such as `--label liver=5`",
                ));
            }
            let listed = list(arguments.label.iter().map(typed).collect());
            let mut labels =
                if groups > 0 { format!("label = {{ {listed} }}") } else { format!("labels = [{listed}]") };
            if !arguments.vessels.is_empty() {
                labels += &format!(", vessels = [{}]", list(vessels().map(typed).collect()));
            }
            let files = vec![&arguments.image];
            let vessels = vessels().map(|label| (files.clone(), typed(label))).collect();
            return Ok(Self { organ: arguments.label.clone(), files, labels, vessels });
        }
        let files: Vec<&PathBuf> = std::iter::once(&arguments.image).chain(&arguments.masks).collect();
        let number = |label: &LabelChoice| {
            let found = match label {
                LabelChoice::One(number) => usize::try_from(*number).ok().and_then(|n| n.checked_sub(1)),
                LabelChoice::Named(name) => {
                    files.iter().position(|file| stem(file).eq_ignore_ascii_case(name))
                }
                LabelChoice::Range(..) | LabelChoice::Group(..) => None,
            };
            found.filter(|&at| at < files.len()).ok_or_else(|| {
                let names: Vec<String> = files.iter().map(|file| stem(file)).collect();
                let message = format!("no mask has the number or name `{label}`");
                Failure::plain(
                    message,
                    format!("choose a mask by its number from 1, or by its name: {}", names.join(", ")),
                )
            })
        };
        let walls = vessels().map(number).collect::<Result<Vec<usize>, Failure>>()?;
        let of_organ: Vec<usize> = match &arguments.label[..] {
            [] => (0..files.len()).filter(|at| !walls.contains(at)).collect(),
            labels => labels.iter().map(number).collect::<Result<_, _>>()?,
        };
        if of_organ.is_empty() {
            return Err(Failure::plain("no mask is left for the tissue", "add the mask of the organ"));
        }
        Ok(Self {
            organ: of_organ.iter().map(|&at| LabelChoice::One(at as i32 + 1)).collect(),
            labels: {
                let numbers: Vec<String> = (1..=of_organ.len()).map(|label| label.to_string()).collect();
                format!("labels = [{}]", numbers.join(", "))
            },
            files: of_organ.iter().map(|&at| files[at]).collect(),
            vessels: walls.iter().map(|&at| (vec![files[at]], "1".into())).collect(),
        })
    }
}

/// Name of a mask: the name of its file, without endings.
fn stem(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    name.split_once('.').map_or(&*name, |(stem, _)| stem).to_owned()
}

/// A label as a scene writes it: a number, a text in quotes, or a key with several labels.
fn typed(label: &LabelChoice) -> String {
    let quoted = |text: String| serde_json::Value::from(text).to_string();
    match label {
        LabelChoice::One(number) => number.to_string(),
        LabelChoice::Range(..) | LabelChoice::Named(_) => quoted(label.to_string()),
        LabelChoice::Group(name, labels) => {
            let labels: Vec<String> = labels.iter().map(typed).collect();
            format!("{} = [{}]", quoted(name.clone()), labels.join(", "))
        }
    }
}

/// The source of a body in its `mesh`, with names and cleaning.
fn source(arguments: &MeshImage, folder: &Path, files: &[&PathBuf], labels: &str) -> String {
    let path = |path: &Path| serde_json::Value::from(from_folder(path, folder).to_string_lossy()).to_string();
    let paths: Vec<String> = files.iter().map(|file| path(file)).collect();
    let paths = paths.join(", ");
    let mut source =
        if arguments.masks.is_empty() { format!("image = {paths}") } else { format!("masks = [{paths}]") };
    source += &format!(", {labels}");
    if let Some(names) = &arguments.names {
        let known = names.as_os_str() == "totalsegmentator";
        let names = if known { "\"totalsegmentator\"".into() } else { path(names) };
        source += &format!(", names = {names}");
    }
    let mut clean = Vec::new();
    if arguments.close_gaps > 0.0 {
        clean.push(format!("close-gaps = {:?}", arguments.close_gaps));
    }
    if arguments.fill_holes {
        clean.push("fill-holes = true".into());
    }
    if arguments.keep_largest {
        clean.push("keep-largest = true".into());
    }
    if !clean.is_empty() {
        source += &format!(", clean = {{ {} }}", clean.join(", "));
    }
    source
}

/// A path as a scene in a folder names it: below the folder without it, elsewhere in full.
fn from_folder(path: &Path, folder: &Path) -> PathBuf {
    if folder.as_os_str().is_empty() {
        return path.to_owned();
    }
    match path.strip_prefix(folder) {
        Ok(below) => below.to_owned(),
        Err(_) => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// Name of a scene: the name of its folder if the file is a `scene.toml`, else the file's name.
fn folder_name(out: &Path) -> String {
    let stem = out.file_stem().unwrap_or_default();
    let folder = out.parent().and_then(Path::file_name).filter(|_| stem == "scene");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}
