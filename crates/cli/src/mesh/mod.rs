//! `pliant labels` and `pliant mesh`: the labels of a segmented image, and volume meshes of an image or a
//! closed surface. `skin.rs` makes surfaces and shells, `coupled.rs` scenes.

mod coupled;
mod input;
mod skin;

use std::collections::BTreeMap;

use pliant_format::foreign_file;
use pliant_geometry::io::{self, Format};
use pliant_geometry::words::number;
use pliant_geometry::{CellKind, Mesh, QualityReport, Vector3, diagnose};
use pliant_imaging::{LabelChoice, LabelError, RegionReport, Smoothing};
use pliant_mechanics::tissue::{elastic, law, liver_matrix, soft_tissue};
use pliant_meshing::{
    Anatomy, Assessment, Closing, Deviation, Enclosed, LabelReport, MeshingError, Missed, OrganTets,
    SurfaceCheck, TetReport, Voxels, require_room_for,
};
use pliant_scene::element_bound;
use serde_json::{Value as Json, json};

use self::input::{
    PARTS, Segmented, Source, anatomy, cell_limit, image_line, image_object, is_mesh_file, label_failure,
    mesh_file, meshing_failure, protected, regions, tets,
};
use crate::SUCCESS;
use crate::arguments::{Labels, MeshCells, MeshImage, Tissue};
use crate::report::{Bar, Failure, failed_output, say};

pub fn labels(arguments: &Labels) -> Result<u8, Failure> {
    let bar = Bar::new();
    let source = Source {
        files: std::iter::once(&arguments.image).chain(&arguments.masks).collect(),
        names: arguments.names.as_deref(),
        series: arguments.series.clone(),
        threshold: None,
        force: arguments.force,
    };
    let found = source.read(&bar, 0.7).and_then(|image| {
        let regions = image.regions(&|done| bar.show(0.7 + 0.3 * done, "finding the labels"));
        Ok((regions.map_err(|error| label_failure(&error))?, image))
    });
    bar.finish();
    let (regions, image) = found?;
    if arguments.json {
        let mut object = image_object(&image);
        object["labels"] = json!(regions);
        say(object)?;
    } else {
        let mut lines = vec![format!("{}: {}", arguments.image.display(), image_line(&image))];
        lines.extend(image.notes.iter().chain(&image.rounding()).map(|note| format!("note: {note}")));
        lines.extend(regions.iter().map(RegionReport::to_string));
        if regions.is_empty() {
            lines.push("no labels: only background (0)".into());
        }
        say(lines.join("\n"))?;
    }
    Ok(SUCCESS)
}

pub fn mesh(arguments: &MeshImage) -> Result<u8, Failure> {
    if let Some(scale) = arguments.scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        let message = format!("`--scale` is {scale}; it must be positive and finite");
        return Err(Failure::plain(message, "for example `--scale 0.001` for a file in millimetres"));
    }
    if let Some([what, help]) = foreign_file(&arguments.image).filter(|_| !is_mesh_file(arguments)) {
        return Err(Failure::plain(format!("`{}` is {what}", arguments.image.display()), help));
    }
    if coupled::is_scene(arguments) {
        return coupled::scene(arguments);
    }
    refuse_idle(arguments)?;
    if matches!(arguments.cells, MeshCells::Surface | MeshCells::Shells) {
        return skin::mesh(arguments);
    }
    require_volume_format(arguments)?;
    let bar = Bar::new();
    let made = make(arguments, &bar);
    bar.finish();
    let made = made?;
    if !arguments.json {
        say(made.page())?;
    }
    made.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    if let Err(error) = io::write(&arguments.out, &made.mesh) {
        return failed_output(&error, arguments.json);
    }
    eprintln!("wrote {}", arguments.out.display());
    if arguments.json {
        let mut object = made.object();
        object["files"] = json!([arguments.out]);
        say(object)?;
    }
    Ok(SUCCESS)
}

/// Rejects options without effect.
fn refuse_idle(arguments: &MeshImage) -> Result<(), Failure> {
    let skin = matches!(arguments.cells, MeshCells::Surface | MeshCells::Shells);
    let tets = matches!(arguments.cells, MeshCells::Tets);
    let file = is_mesh_file(arguments);
    let cleans = arguments.close_gaps != 0.0 || arguments.fill_holes || arguments.keep_largest;
    let tissue = arguments.law.is_some() || arguments.young.is_some();
    let masks = !arguments.masks.is_empty();
    let (labels, threshold) = (!arguments.label.is_empty(), arguments.threshold.is_some());
    let idle = [
        (file && threshold, "`--threshold` is for images"),
        (file && arguments.series.is_some(), "`--series` is for images"),
        (file && arguments.names.is_some(), "`--names` is for images"),
        (file && masks, "several inputs must be masks, which are images"),
        (file && arguments.label.len() > 1, "`--label` can be repeated for images only"),
        (file && skin && labels, "`--label` is for images, and for tets and hexes"),
        (
            file && skin && cleans,
            "`--close-gaps`, `--fill-holes` and `--keep-largest` are for images, and for tets and hexes",
        ),
        (!file && arguments.scale.is_some(), "`--scale` is for mesh files: images store their lengths"),
        (!arguments.vessels.is_empty(), "`--vessels` is for a scene, such as `-o scene.toml`"),
        (arguments.capsule.is_some(), "`--capsule` is for a scene, such as `-o scene.toml`"),
        (!tets && arguments.distance.is_some(), "`--distance` is for tets"),
        (!tets && arguments.inner_edge.is_some(), "`--inner-edge` is for tets"),
        (!tets && !arguments.protect.is_empty(), "`--protect` is for tets"),
        (skin && tissue, "`--law` and `--young` are for tets and hexes"),
        (arguments.add.is_some() && file, "`--add` is for images"),
        (
            arguments.add.is_some() && !threshold,
            "`--add` needs `--threshold`: it adds values, and labels are not values (list several masks one after the other)",
        ),
        (arguments.add.is_some() && masks, "`--add` works with one image, not with several masks"),
        (labels && threshold && !masks, "`--label` and `--threshold` both choose voxels: give only one"),
    ];
    match idle.into_iter().find(|(idle, _)| *idle) {
        Some((_, message)) => Err(Failure::plain(message, "leave it out")),
        None => Ok(()),
    }
}

/// Rejects an output name without a volume mesh format, before any work.
fn require_volume_format(arguments: &MeshImage) -> Result<(), Failure> {
    match Format::of_path(&arguments.out) {
        Some(Format::Vtu | Format::Gmsh) => Ok(()),
        _ => {
            let message = format!("`{}` is not a name for a mesh of volume cells", arguments.out.display());
            Err(Failure::plain(message, "choose a name that ends in .vtu or .msh"))
        }
    }
}

fn make(arguments: &MeshImage, bar: &Bar) -> Result<MadeMesh, Failure> {
    if arguments.edge.is_none() && arguments.distance.is_none() {
        let help =
            "for example `--edge 8mm`, or 0.008 in metres; for tets, `--distance 1mm` chooses the edge";
        return Err(Failure::plain("the edge of the cells is missing", help));
    }
    let force = arguments.force;
    let found = if is_mesh_file(arguments) { enclosed(arguments, bar) } else { segmented(arguments, bar) }?;
    let (anatomy, edge) = (&found.anatomy, found.edge);
    let filling = |done: f64| bar.show(PARTS[0] + PARTS[1] * done, "making cells");
    let cell_limit = cell_limit(arguments);
    let refused = |error: MeshingError| meshing_failure(&error, force);
    let (mesh, cells) = match arguments.cells {
        MeshCells::Tets => {
            let request = OrganTets { cell_limit, ..tets(arguments, edge, &found.protect) };
            let made = request.mesh(anatomy, &filling).map_err(refused)?;
            (made.mesh, Cells::Tets(Box::new(made.report)))
        }
        cells => {
            let (voxels, field) = (Voxels { edge, cell_limit }, anatomy.field());
            let immersed = matches!(cells, MeshCells::ImmersedHexes);
            let made = if immersed { voxels.immersed(field) } else { voxels.mesh(field) };
            let mut made = made.map_err(refused)?;
            anatomy.label(&mut made.mesh);
            let surface = SurfaceCheck::of(&made.mesh).with_body(field, edge);
            let dropped = [made.dropped_components, made.dropped_cells];
            (made.mesh, Cells::Hexes { immersed, dropped, surface })
        }
    };
    bar.show(PARTS[0] + PARTS[1], "measuring distances");
    let assessment = Assessment::of(&mesh, anatomy, edge).map_err(refused)?;
    let mut warnings = found.warnings;
    warnings.extend(assessment.missed.iter().map(warning));
    match &cells {
        Cells::Tets(report) => warnings.extend(report.doubts()),
        Cells::Hexes { surface, .. } => warnings.extend(surface.doubt()),
    }
    Ok(MadeMesh {
        quality: QualityReport::new(&mesh),
        components: diagnose(&mesh).components,
        steps: steps(arguments, &mesh),
        warnings,
        mesh: Mesh { label_names: found.names, ..mesh },
        cells,
        lines: found.lines,
        object: found.object,
        assessment,
    })
}

/// The edge of the cells [m], or the first edge if a distance is given, from the box of the body [m].
fn edge_of(arguments: &MeshImage, bounds: [Vector3; 2]) -> f64 {
    let chosen = arguments.distance.map_or(0.0, |distance| OrganTets::edge_for(distance, bounds));
    arguments.edge.unwrap_or(chosen)
}

/// The missed feature and a remedy.
fn warning(missed: &Missed) -> String {
    let remedy = match missed {
        Missed::Label { label } | Missed::LabelVolume { label, .. } | Missed::LabelAway { label, .. } => {
            format!("`--protect {label}` makes smaller cells there")
        }
        _ => "use a shorter edge".into(),
    };
    format!("{missed}; {remedy}")
}

/// The smallest element bound [s] for the requested tissue, or for two by name.
fn steps(arguments: &MeshImage, mesh: &Mesh) -> Vec<(String, f64)> {
    let brain = ("brain-like".to_owned(), soft_tissue());
    let liver = ("liver-like".to_owned(), liver_matrix());
    let laws = match (arguments.young, arguments.law) {
        (Some(young), _) => {
            let poisson = arguments.poisson;
            let parameters = json!({ "young-modulus": young, "poisson-ratio": poisson });
            vec![(format!("E = {young} Pa, ν = {poisson}"), law("neo-hookean", parameters))]
        }
        (None, Some(Tissue::BrainLike)) => vec![brain],
        (None, Some(Tissue::LiverLike)) => vec![liver],
        (None, None) => vec![brain, liver],
    };
    let bound = |(name, law)| {
        let mut material = elastic(law);
        material.density = arguments.density;
        (name, element_bound(mesh, &material).unwrap_or(0.0))
    };
    laws.into_iter().map(bound).collect()
}

/// A body to fill, with notes on its source.
struct Input {
    anatomy: Anatomy<'static>,
    names: BTreeMap<i32, String>,
    protect: Vec<(i32, Option<f64>)>,
    /// Edge of the cells [m].
    edge: f64,
    lines: Vec<String>,
    object: Json,
    warnings: Vec<String>,
}

/// The body of the chosen labels of an image.
fn segmented(arguments: &MeshImage, bar: &Bar) -> Result<Input, Failure> {
    let found = regions(arguments, bar)?;
    if let Some(edge) = arguments.edge {
        let voxels = found.labels.labels.iter().filter(|&&label| label != 0).count();
        require_few(arguments, edge, voxels as f64 * found.labels.grid.voxel_volume())?;
    }
    let (anatomy, cleaned) = anatomy(arguments, &found, &Smoothing::default(), bar)?;
    let Segmented { mut lines, object, warnings, names, protect, .. } = found;
    lines.push(format!("cleaned          {cleaned}"));
    let edge = edge_of(arguments, anatomy.field().bounds().into());
    let object = json!({ "image": object, "cleaned": cleaned });
    Ok(Input { anatomy, names, protect, edge, lines, object, warnings })
}

/// The body inside a closed surface.
fn enclosed(arguments: &MeshImage, bar: &Bar) -> Result<Input, Failure> {
    let refused = |error| meshing_failure(&error, arguments.force);
    let closing = Closing {
        holes: arguments.close_gaps,
        fill_cavities: arguments.fill_holes,
        keep_largest: arguments.keep_largest,
    };
    if !(closing.holes >= 0.0 && closing.holes.is_finite()) {
        return Err(label_failure(&LabelError::BadLength { what: "gaps to close", value: closing.holes }));
    }
    let mut warnings = Vec::new();
    let file = mesh_file(arguments, &mut warnings)?;
    bar.show(0.0, "repairing the surface");
    let edge = edge_of(arguments, file.mesh.bounds().unwrap_or_default().into());
    let surface = Enclosed::new(&file.mesh, edge, &closing).map_err(refused)?;
    require_few(arguments, edge, surface.volume())?;
    let progress = |done: f64| bar.show(PARTS[0] * done, "measuring distances from the surface");
    let label = match arguments.label.first() {
        None => 1,
        Some(LabelChoice::One(label)) => *label,
        Some(other) => {
            let message = format!("`--label {other}` is not a number");
            return Err(Failure::plain(
                message,
                "give the label of the cells of a surface as a number, such as `--label 5`",
            ));
        }
    };
    let names = BTreeMap::new();
    let protect = protected(arguments, &[label], &names)?;
    let finest = tets(arguments, edge, &protect).finest();
    let anatomy = surface.fine_anatomy(label, edge, finest, &progress).map_err(refused)?;
    let report = &surface.report;
    let mut lines =
        vec![format!("{}: {}, {} triangles", arguments.image.display(), file.format, report.triangles)];
    lines.extend(file.notes.iter().map(|note| format!("note: {note}")));
    lines.push(format!("mended           {report}"));
    if report.shells > 1 {
        let cavities = report.cavities;
        let word = if cavities == 1 { "cavity" } else { "cavities" };
        let fill = if cavities > 0 { "; `--fill-holes` fills them" } else { "" };
        let solid = report.shells - cavities;
        let largest = if solid > 1 { "; `--keep-largest` leaves out all but the largest piece" } else { "" };
        lines.push(format!(
            "surface          {} pieces, of which {cavities} {word}{fill}{largest}",
            report.shells
        ));
    }
    let object = json!({ "surface": { "format": file.format, "notes": file.notes }, "mended": report });
    Ok(Input { anatomy, names, protect, edge, lines, object, warnings })
}

/// Rejects too many cells for a volume [m³], before meshing.
fn require_few(arguments: &MeshImage, edge: f64, volume: f64) -> Result<(), Failure> {
    let kind = if matches!(arguments.cells, MeshCells::Tets) { CellKind::Tet } else { CellKind::Hex };
    require_room_for(kind, edge, volume, cell_limit(arguments))
        .map_err(|error| meshing_failure(&error, arguments.force))
}

/// The cells of each kind with their report.
enum Cells {
    Tets(Box<TetReport>),
    /// Hexes: true if fractions weight them; numbers of dropped loose parts and cells; their boundary.
    Hexes {
        immersed: bool,
        dropped: [usize; 2],
        surface: SurfaceCheck,
    },
}

/// A mesh with its report.
struct MadeMesh {
    mesh: Mesh,
    cells: Cells,
    /// The source of the body, as text and as JSON.
    lines: Vec<String>,
    object: Json,
    quality: QualityReport,
    assessment: Assessment,
    components: usize,
    /// The smallest element bound [s] for tissues by name.
    steps: Vec<(String, f64)>,
    warnings: Vec<String>,
}

impl MadeMesh {
    fn page(&self) -> String {
        let mut lines = self.lines.clone();
        match &self.cells {
            Cells::Tets(report) => lines.push(report.to_string()),
            Cells::Hexes { dropped: [parts, cells], surface, .. } => {
                lines.push(format!("nodes            {}", self.quality.nodes));
                lines.push(format!("hexes            {}", self.cell_count()));
                lines.extend(self.assessment.regions.labels.iter().map(label_line));
                if let Some([low, high]) = self.quality.dihedral {
                    lines.push(format!("dihedral angle   {low:.1}° to {high:.1}°"));
                }
                if let Some(length) = self.quality.acoustic_length {
                    lines.push(format!("acoustic length  {:.4e} m at least", length.min));
                }
                lines.push(surface.line());
                if *parts > 0 {
                    lines.push(format!("left out         {cells} cells in {parts} loose parts"));
                }
            }
        }
        lines.push(format!("pieces           {}", self.components));
        let Assessment { deviation, regions, .. } = &self.assessment;
        lines.push(format!("distances to     {}", deviation.to));
        lines.extend(both_ways(deviation));
        for region in &regions.labels {
            lines.extend(
                region.distances.map(|found| largest_line(&format!("label {}", region.label), &found)),
            );
        }
        for interface in regions.interfaces.iter().filter(|interface| interface.labels[0] != 0) {
            let [a, b] = interface.labels;
            lines.extend(
                interface.distances.map(|found| largest_line(&format!("between {a} and {b}"), &found)),
            );
        }
        let steps: Vec<String> =
            self.steps.iter().map(|(name, step)| format!("{} s {name}", number(*step))).collect();
        lines.push(format!("stable step      {} (least element bound)", steps.join(", ")));
        lines.join("\n")
    }

    fn object(&self) -> Json {
        let Assessment { deviation, regions, .. } = &self.assessment;
        let materials: Vec<Json> = regions.labels.iter().map(label_object).collect();
        let mut object = json!({
            "status": "done",
            "nodes": self.quality.nodes,
            "cells": self.cell_count(),
            "materials": materials,
            "components": self.components,
            "dihedral": self.quality.dihedral,
            "acoustic_length": self.quality.acoustic_length.map(|length| length.min),
            "distances": deviation,
            "interfaces": regions.interfaces,
            "element_bound": self.steps.iter().cloned().collect::<BTreeMap<_, _>>(),
            "warnings": self.warnings,
        });
        if let (Json::Object(object), Json::Object(input)) = (&mut object, &self.object) {
            object.extend(input.clone());
        }
        match &self.cells {
            Cells::Tets(report) => {
                object["as"] = json!("tets");
                object["acoustic_part"] = json!(report.acoustic_part);
                object["repairs"] = json!(report.repairs);
                object["edges"] = json!(report.edges);
                object["crowded_edges_left"] = json!(report.crowded_edges_left);
                object["pinched_points"] = json!(report.pinched_points);
                object["surface_check"] = json!(report.surface);
                object["tears"] = json!(report.tears);
                object["lost"] = json!(report.lost);
                object["optimiser"] = json!(report.steps);
                object["distance"] = json!(report.distance);
            }
            Cells::Hexes { immersed, dropped: [parts, cells], surface } => {
                object["surface_check"] = json!(surface);
                object["as"] = json!(if *immersed { "immersed-hexes" } else { "hexes" });
                object["repairs"] = json!({ "dropped_pieces": parts, "dropped_cells": cells });
            }
        }
        object
    }

    fn cell_count(&self) -> usize {
        self.mesh.volume_blocks().map(|block| block.len()).sum()
    }
}

/// Distances in both directions, the largest with its location.
fn both_ways(found: &Deviation) -> [String; 2] {
    let line = |way: &str, [rms, median, p95, most]: [f64; 4], [x, y, z]: [f64; 3]| {
        let [rms, median, p95, most] = [rms, median, p95, most].map(|length| length * 1e3);
        let [x, y, z] = [x, y, z].map(|x| x * 1e3);
        format!(
            "{way} {rms:.3} mm rms, half within {median:.3}, 95 % within {p95:.3}, {most:.3} mm at most, at ({x:.1}, {y:.1}, {z:.1}) mm"
        )
    };
    let Deviation { rms_from_mesh, median_from_mesh, p95_from_mesh, largest_from_mesh, .. } = *found;
    let Deviation { rms_from_body, median_from_body, p95_from_body, largest_from_body, .. } = *found;
    let from_mesh = [rms_from_mesh, median_from_mesh, p95_from_mesh, largest_from_mesh];
    let from_body = [rms_from_body, median_from_body, p95_from_body, largest_from_body];
    [
        line("mesh to body    ", from_mesh, found.farthest_of_mesh),
        line("body to mesh    ", from_body, found.farthest),
    ]
}

/// The larger distance of both directions for the surface of a label or an interface.
fn largest_line(name: &str, found: &Deviation) -> String {
    let (most, [x, y, z]) = found.largest();
    let median = found.median_from_mesh.max(found.median_from_body);
    let p95 = found.p95_from_mesh.max(found.p95_from_body);
    format!(
        "{name:<16} off by {:.3} mm (median), {:.3} mm at 95 %, {:.3} mm at most, at ({:.1}, {:.1}, {:.1}) mm",
        median * 1e3,
        p95 * 1e3,
        most * 1e3,
        x * 1e3,
        y * 1e3,
        z * 1e3
    )
}

fn label_line(region: &LabelReport) -> String {
    let line = format!("label {:<10} {} cells, {:.2} ml", region.label, region.cells, region.volume * 1e6);
    match region.volume_error() {
        Some(error) => format!("{line} ({:+.2} % of the input)", error * 100.0),
        None => line,
    }
}

fn label_object(region: &LabelReport) -> Json {
    json!({
        "label": region.label, "cells": region.cells, "volume": region.volume, "input_volume": region.input_volume,
        "volume_error": region.volume_error(), "distances": region.distances,
    })
}
