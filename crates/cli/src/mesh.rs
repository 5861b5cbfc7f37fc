//! `pliant labels` and `pliant mesh`: what a segmented image holds, and cells of it. Surfaces and shells are in `skin.rs`.

use std::collections::BTreeMap;
use std::process::ExitCode;

use pliant_bench::{elastic, liver_matrix, soft_tissue};
use pliant_geometry::io::{self, Format};
use pliant_geometry::{Mesh, QualityReport, Vector3, diagnose, volume};
use pliant_imaging::{
    Cleaned, Cleaning, Image, LabelError, LabelImage, ReadOptions, RegionReport, Smoothing, read,
};
use pliant_meshing::{
    Anatomy, DEFAULT_CELL_LIMIT, Deviation, MeshingError, Missed, OrganTets, TetReport, Voxels,
};
use pliant_scene::{element_bound, number};
use serde_json::{Value as Json, json};

use crate::arguments::{Labels, MeshCells, MeshImage};
use crate::report::{Bar, Failure, failed_output, say};
use crate::skin;

pub fn labels(arguments: &Labels) -> Result<ExitCode, Failure> {
    let options = ReadOptions { series: arguments.series.clone(), ..ReadOptions::default() };
    let image = read(&arguments.image, &options).map_err(|error| Failure::plain(error, ""))?;
    let labels = image.labels().map_err(|error| label_failure(&error))?;
    let regions = labels.regions();
    if arguments.json {
        let mut object = image_object(&image);
        object["labels"] = json!(regions);
        say(object)?;
    } else {
        let mut lines = vec![format!("{}: {}", arguments.image.display(), image_line(&image))];
        lines.extend(image.notes.iter().map(|note| format!("note: {note}")));
        lines.extend(regions.iter().map(RegionReport::to_string));
        if regions.is_empty() {
            lines.push("no labels: only background (0)".into());
        }
        say(lines.join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

pub fn mesh(arguments: &MeshImage) -> Result<ExitCode, Failure> {
    if matches!(arguments.cells, MeshCells::Surface | MeshCells::Shells) {
        return skin::mesh(arguments);
    }
    require_volume_format(arguments)?;
    let (image, labels, chosen) = regions(arguments)?;
    let bar = Bar::new();
    let made = make(arguments, &labels, &chosen, &bar);
    bar.finish();
    let made = made?;
    if !arguments.json {
        let mut lines = vec![format!("{}: {}", arguments.image.display(), image_line(&image))];
        lines.extend(image.notes.iter().map(|note| format!("note: {note}")));
        lines.push(made.page());
        say(lines.join("\n"))?;
    }
    made.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    if let Err(error) = io::write(&arguments.out, &made.mesh) {
        return failed_output(&error, arguments.json);
    }
    eprintln!("wrote {}", arguments.out.display());
    if arguments.json {
        let mut object = made.object();
        object["image"] = image_object(&image);
        object["files"] = json!([arguments.out]);
        say(object)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The image, what is segmented in it, and the labels chosen.
pub fn regions(arguments: &MeshImage) -> Result<(Image, LabelImage, Vec<i32>), Failure> {
    let options = ReadOptions { series: arguments.series.clone(), ..ReadOptions::default() };
    let image = read(&arguments.image, &options).map_err(|error| Failure::plain(error, ""))?;
    let (labels, chosen) = match arguments.threshold {
        Some(least) => (image.threshold(least..=f64::INFINITY), vec![1]),
        None => (image.labels().map_err(|error| label_failure(&error))?, arguments.label.clone()),
    };
    Ok((image, labels, chosen))
}

/// Refuses a name whose ending no volume mesh can be written to, before any work.
fn require_volume_format(arguments: &MeshImage) -> Result<(), Failure> {
    match Format::of_path(&arguments.out) {
        Some(Format::Vtu | Format::Gmsh) => Ok(()),
        _ => {
            let message = format!("`{}` is no name for a mesh of volume cells", arguments.out.display());
            Err(Failure::plain(message, "choose a name that ends in .vtu or .msh"))
        }
    }
}

fn label_failure(error: &LabelError) -> Failure {
    let help = match error {
        LabelError::NotWhole { .. } => "`pliant mesh --threshold 0.5` takes a map of probabilities",
        LabelError::NoneChosen { .. } => "choose with `--label N`, several times for several materials",
        LabelError::Absent { .. } | LabelError::Background { .. } => {
            "`pliant labels IMAGE` lists the labels with their sizes"
        }
        LabelError::BadLength { .. } => "`--close-gaps` is in metres: 0.003 closes gaps of 3 mm",
        LabelError::TooManyVoxels { .. } => {
            "where gaps are closed, `--close-gaps` is in metres: 0.003 closes gaps of 3 mm"
        }
        _ => "",
    };
    Failure::plain(error, help)
}

pub fn meshing_failure(error: &MeshingError, force: bool) -> Failure {
    let help = match error {
        MeshingError::TooManyCells { .. } | MeshingError::LatticeTooLarge { .. } if !force => {
            "lengths are in metres: `--edge 0.008` makes cells of 8 mm; `--force` makes so many all the same"
        }
        MeshingError::NotPositive { .. } => "for example `--edge 0.008`, in metres",
        _ => "",
    };
    Failure::plain(error, help)
}

/// The parts of the whole work, for the bar: the field, the cells, the distances.
const PARTS: [f64; 3] = [0.3, 0.6, 0.1];

fn make(arguments: &MeshImage, labels: &LabelImage, chosen: &[i32], bar: &Bar) -> Result<Made, Failure> {
    let Some(edge) = arguments.edge else {
        return Err(Failure::plain("no edge for the cells", "for example `--edge 0.008`, in metres"));
    };
    let force = arguments.force;
    let (anatomy, cleaned) = anatomy(arguments, labels, chosen, bar)?;
    let filling = |done: f64| bar.update_mesh(PARTS[0] + PARTS[1] * done, "making cells");
    let cell_limit = if force { usize::MAX } else { DEFAULT_CELL_LIMIT };
    let refused = |error: MeshingError| meshing_failure(&error, force);
    let (mesh, cells) = match arguments.cells {
        MeshCells::Tets => {
            let request = OrganTets { cell_limit, ..OrganTets::new(edge) };
            let made = request.mesh(&anatomy, &filling).map_err(refused)?;
            (made.mesh, Cells::Tets(Box::new(made.report)))
        }
        _ => {
            let mut made = Voxels { edge, cell_limit }.mesh(anatomy.field()).map_err(refused)?;
            anatomy.label(&mut made.mesh);
            (made.mesh, Cells::Hexes { dropped: [made.dropped_components, made.dropped_cells] })
        }
    };
    bar.update_mesh(PARTS[0] + PARTS[1], "measuring distances");
    let deviation = Deviation::new(&mesh, anatomy.field(), edge).map_err(refused)?;
    // Steps of cubes stay behind the body by up to half of their diagonal.
    let allowed = if matches!(arguments.cells, MeshCells::Tets) { edge / 2.0 } else { edge };
    let missed = Missed::of(&mesh, anatomy.field(), edge, &deviation, allowed).map_err(refused)?;
    Ok(Made {
        materials: materials(&mesh, &anatomy),
        quality: QualityReport::new(&mesh),
        components: diagnose(&mesh).components,
        steps: [("brain-like", soft_tissue()), ("liver-like", liver_matrix())]
            .map(|(name, law)| (name, element_bound(&mesh, &elastic(law)).unwrap_or(0.0))),
        warnings: missed.iter().map(|missed| format!("{missed}; use a shorter edge")).collect(),
        mesh,
        cells,
        cleaned,
        deviation,
    })
}

/// The chosen regions, cleaned and smoothed.
pub fn anatomy(
    arguments: &MeshImage,
    labels: &LabelImage,
    chosen: &[i32],
    bar: &Bar,
) -> Result<(Anatomy<'static>, Cleaned), Failure> {
    let cleaning = Cleaning {
        close_gaps: arguments.close_gaps,
        fill_holes: arguments.fill_holes,
        keep_largest: arguments.keep_largest,
    };
    let field = |done: f64| bar.update_mesh(PARTS[0] * done, "smoothing the surface");
    Anatomy::from_image(labels, chosen, &cleaning, &Smoothing::default(), &field).map_err(|error| {
        match (&error, arguments.threshold) {
            (LabelError::Absent { .. }, Some(least)) => {
                let message = format!("no voxel is {least} or more");
                Failure::plain(message, "use a lower `--threshold`")
            }
            _ => label_failure(&error),
        }
    })
}

/// One material of a mesh.
struct Material {
    label: i32,
    cells: usize,
    volume: f64,
    voxel_volume: Option<f64>,
}

/// Cells and volume of each label of a mesh, beside the volume of its voxels after cleaning.
fn materials(mesh: &Mesh, anatomy: &Anatomy<'_>) -> Vec<Material> {
    let mut found: BTreeMap<i32, (usize, f64)> = BTreeMap::new();
    for block in &mesh.blocks {
        let labels = block.data.get("label").map_or(&[][..], |labels| &labels.values);
        for (cell, label) in block.cells().zip(labels) {
            let corners: Vec<Vector3> = cell.iter().map(|&node| mesh.points[node as usize]).collect();
            let (cells, sum) = found.entry(*label as i32).or_default();
            *cells += 1;
            *sum += volume(block.kind, &corners);
        }
    }
    let of_label = |(label, &voxel_volume): (i32, &Option<f64>)| {
        let (cells, volume) = found.get(&label).copied().unwrap_or_default();
        Material { label, cells, volume, voxel_volume }
    };
    anatomy.labels().into_iter().zip(anatomy.volumes()).map(of_label).collect()
}

/// What is known of the cells of each kind.
enum Cells {
    Tets(Box<TetReport>),
    /// Loose parts left out, and the cells in them.
    Hexes {
        dropped: [usize; 2],
    },
}

/// A mesh of an image, and what there is to know about it.
struct Made {
    mesh: Mesh,
    cells: Cells,
    cleaned: Cleaned,
    materials: Vec<Material>,
    quality: QualityReport,
    deviation: Deviation,
    components: usize,
    /// The smallest element bound [s] for tissues by name.
    steps: [(&'static str, f64); 2],
    warnings: Vec<String>,
}

impl Made {
    fn page(&self) -> String {
        let mut lines = vec![format!("cleaned          {}", self.cleaned)];
        match &self.cells {
            Cells::Tets(report) => lines.push(report.to_string()),
            Cells::Hexes { dropped: [parts, cells] } => {
                lines.push(format!("nodes            {}", self.quality.nodes));
                lines.push(format!("hexes            {}", self.cell_count()));
                lines.extend(self.materials.iter().map(Material::line));
                if let Some([low, high]) = self.quality.dihedral {
                    lines.push(format!("dihedral angle   {low:.1}° to {high:.1}°"));
                }
                if let Some(length) = self.quality.acoustic_length {
                    lines.push(format!("acoustic length  {:.4e} m at least", length.min));
                }
                if *parts > 0 {
                    lines.push(format!("left out         {cells} cells in {parts} loose parts"));
                }
            }
        }
        lines.push(format!("pieces           {}", self.components));
        let Deviation { largest_from_mesh, rms_from_mesh, largest_from_body, rms_from_body, .. } =
            self.deviation;
        for (way, rms, most) in [
            ("mesh to body    ", rms_from_mesh, largest_from_mesh),
            ("body to mesh    ", rms_from_body, largest_from_body),
        ] {
            lines.push(format!("{way} {:.3} mm rms, {:.3} mm at most", rms * 1e3, most * 1e3));
        }
        let steps = self.steps.map(|(name, step)| format!("{} s {name}", number(step)));
        lines.push(format!("stable step      {} (least element bound)", steps.join(", ")));
        lines.join("\n")
    }

    fn object(&self) -> Json {
        let materials: Vec<Json> = self.materials.iter().map(Material::object).collect();
        let mut object = json!({
            "status": "done",
            "nodes": self.quality.nodes,
            "cells": self.cell_count(),
            "materials": materials,
            "components": self.components,
            "dihedral": self.quality.dihedral,
            "acoustic_length": self.quality.acoustic_length.map(|length| length.min),
            "distances": self.deviation,
            "element_bound": { self.steps[0].0: self.steps[0].1, self.steps[1].0: self.steps[1].1 },
            "cleaned": self.cleaned,
            "warnings": self.warnings,
        });
        match &self.cells {
            Cells::Tets(report) => {
                object["as"] = json!("tets");
                object["acoustic_part"] = json!(report.acoustic_part);
                object["repairs"] = json!(report.repairs);
                object["crowded_edges_left"] = json!(report.crowded_edges_left);
                object["optimiser"] = json!(report.steps);
            }
            Cells::Hexes { dropped: [parts, cells] } => {
                object["as"] = json!("hexes");
                object["repairs"] = json!({ "dropped_pieces": parts, "dropped_cells": cells });
            }
        }
        object
    }

    fn cell_count(&self) -> usize {
        self.mesh.volume_blocks().map(|block| block.len()).sum()
    }
}

impl Material {
    fn line(&self) -> String {
        let own = format!("label {:<10} {} cells, {:.2} ml", self.label, self.cells, self.volume * 1e6);
        match self.voxel_volume {
            Some(voxels) => format!("{own} ({:+.2} % of its voxels)", (self.volume / voxels - 1.0) * 100.0),
            None => own,
        }
    }

    fn object(&self) -> Json {
        json!({
            "label": self.label, "cells": self.cells, "volume": self.volume, "voxel_volume": self.voxel_volume,
            "volume_error": self.voxel_volume.map(|voxels| self.volume / voxels - 1.0),
        })
    }
}

pub fn image_line(image: &Image) -> String {
    let [nx, ny, nz] = image.grid.dims;
    let [hx, hy, hz] = image.grid.spacing().map(|h| number(h * 1e3));
    format!("{}, {nx} × {ny} × {nz} voxels of {hx} × {hy} × {hz} mm", image.format)
}

pub fn image_object(image: &Image) -> Json {
    json!({
        "format": image.format, "size": image.grid.dims, "spacing": image.grid.spacing(), "notes": image.notes,
    })
}
