//! Real scans, each meshed by one command and simulated for 1 s. Results are the quality of the mesh, its
//! critical time step, and the cost of a second. Prints a table in Markdown and leaves each scene with its
//! results in a folder: `PLIANT_DATA=… cargo run --release -p pliant-validation --example scans -- FOLDER
//! [NAME …]`.
//!
//! The body lies on its back, held there over a fifth of its depth, and its weight grows over the second.

use std::collections::HashMap;
use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use pliant_format::Scene;
use pliant_format::source::Source;
use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};
use pliant_imaging::{Cleaning, Image, LabelImage, ReadOptions, Region, read};
use pliant_meshing::{Hausdorff, TriangleMesh};
use pliant_run::{OutputFolder, run};
use pliant_scene::{World, build, plan};

/// Density of all tissue [kg/m³].
const DENSITY: f64 = 1060.0;

/// One body of one image.
struct Scan {
    name: &'static str,
    file: &'static str,
    /// An image to be added to the first.
    add: Option<&'static str>,
    labels: &'static [i32],
    /// Value at and above which voxels are taken, instead of labels.
    threshold: Option<f64>,
    /// Edge of the cells [m].
    edge: f64,
    cells: &'static str,
    tissue: Tissue,
    /// Labels of ventricles, softer than the tissue.
    soft: &'static [i32],
}

#[derive(Clone, Copy)]
enum Tissue {
    Liver,
    Brain,
}

impl Tissue {
    /// Young's modulus [Pa]; Poisson's ratio is 0.45. The tissues for which `pliant mesh` shows the critical
    /// time step.
    fn young(self) -> f64 {
        match self {
            Self::Liver => 2.0 * 6568.0 * 1.45,
            Self::Brain => 3000.0,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Liver => "liver-like",
            Self::Brain => "brain-like",
        }
    }
}

const ABDOMEN: &str = "abdomen-totalseg/example_seg.nii.gz";

const SCANS: [Scan; 9] = [
    abdomen("liver", &[5], 0.008, "tets"),
    abdomen("liver-immersed", &[5], 0.008, "immersed-hexes"),
    abdomen("spleen", &[1], 0.008, "tets"),
    abdomen("stomach", &[6], 0.006, "tets"),
    abdomen("colon", &[20], 0.006, "tets"),
    Scan {
        file: "abdomen-totalseg/report_aorta_true_lumen.nii.gz",
        ..abdomen("aorta-true-lumen", &[1], 0.004, "tets")
    },
    Scan {
        file: "brain-itksnap/MRIcrop-seg.gipl.gz",
        labels: &[8, 7, 1, 2, 3],
        tissue: Tissue::Brain,
        soft: &[1, 2, 3],
        ..abdomen("deep-brain", &[8], 0.004, "immersed-hexes")
    },
    Scan {
        file: "brain-mni152/mni_icbm152_gm_2009a_sym.nii.gz",
        add: Some("brain-mni152/mni_icbm152_wm_2009a_sym.nii.gz"),
        threshold: Some(128.0),
        tissue: Tissue::Brain,
        ..abdomen("brain", &[1], 0.008, "tets")
    },
    Scan {
        file: "brain-mni152/mni_icbm152_gm_2009a_sym.nii.gz",
        add: Some("brain-mni152/mni_icbm152_wm_2009a_sym.nii.gz"),
        threshold: Some(128.0),
        tissue: Tissue::Brain,
        ..abdomen("brain-immersed", &[1], 0.008, "immersed-hexes")
    },
];

/// A liver-like organ of the abdomen.
const fn abdomen(name: &'static str, labels: &'static [i32], edge: f64, cells: &'static str) -> Scan {
    Scan {
        name,
        file: ABDOMEN,
        add: None,
        labels,
        threshold: None,
        edge,
        cells,
        tissue: Tissue::Liver,
        soft: &[],
    }
}

impl Scan {
    fn image(&self, data: &Path) -> Result<Image, Box<dyn Error>> {
        let options = ReadOptions::default();
        let first = read(&data.join(self.file), &options)?;
        Ok(match self.add {
            Some(second) => first.plus(&read(&data.join(second), &options)?)?,
            None => first,
        })
    }

    /// The voxels of the body, its largest piece without holes.
    fn region(&self, image: &Image) -> Result<Region, Box<dyn Error>> {
        let labels: LabelImage = match self.threshold {
            Some(least) => image.threshold(least..=f64::INFINITY),
            None => image.labels()?,
        };
        let cleaning = Cleaning { fill_holes: true, keep_largest: true, ..Cleaning::default() };
        Ok(labels.region(self.labels, 2)?.clean(&cleaning)?.0)
    }

    fn scene(&self, data: &Path, [low, high]: [Vector3; 2]) -> String {
        let path = |file: &str| data.join(file).display().to_string();
        let cut = match self.threshold {
            Some(least) => format!("threshold = {least:?}"),
            None => format!("labels = {:?}", self.labels),
        };
        let add = self.add.map_or(String::new(), |file| format!(", add = \"{}\"", path(file)));
        let law = if self.soft.is_empty() {
            "\"tissue\"".to_owned()
        } else {
            let of = |label: &i32| if self.soft.contains(label) { "ventricle" } else { "tissue" };
            let pairs: Vec<String> =
                self.labels.iter().map(|label| format!("{label} = \"{}\"", of(label))).collect();
            format!("{{ {} }}", pairs.join(", "))
        };
        let ventricle = if self.soft.is_empty() {
            String::new()
        } else {
            "[law.ventricle]\ntype = \"neo-hookean\"\nyoung-modulus = 500\npoisson-ratio = 0.45\n\n"
                .to_owned()
        };
        let element = if self.cells == "tets" { "tet4-anp" } else { "hex8" };
        let back = low.y + 0.2 * (high.y - low.y);
        format!(
            "[scene]\nuntil = 1.0\n\n[run]\nprecision = \"single\"\n\n\
             [law.tissue]\ntype = \"neo-hookean\"\nyoung-modulus = {young:?}\npoisson-ratio = 0.45\n\n{ventricle}\
             [body.organ]\nmesh = {{ image = \"{image}\"{add}, {cut}, edge = {edge}, as = \"{cells}\", \
             clean = {{ fill-holes = true, keep-largest = true }} }}\n\
             element = \"{element}\"\nlaw = {law}\ndensity = {DENSITY:?}\ndamping = 5\n\n\
             [surface.skin]\non = \"organ\"\nmesh = {{ image = \"{image}\"{add}, {cut}, edge = {skin}, as = \"surface\", \
             clean = {{ fill-holes = true, keep-largest = true }} }}\n\n\
             [constraint.back]\ntype = \"fix\"\nbody = \"organ\"\n\
             nodes = {{ half-space = {{ point = [0, {back:?}, 0], normal = [0, -1, 0] }} }}\n\n\
             [load.weight]\ntype = \"gravity\"\non = \"organ\"\nacceleration = [0, -9.81, 0]\n\n\
             [output.fields]\ntype = \"vtu\"\nevery = 0.5\ndata = [\"displacement\", \"von-mises\"]\n\n\
             [output.skin]\ntype = \"vtu\"\non = \"skin\"\nevery = 0.5\ndata = [\"displacement\"]\n",
            young = self.tissue.young(),
            image = path(self.file),
            edge = self.edge,
            skin = self.edge / 2.0,
            cells = self.cells,
        )
    }

    /// The row of the table; the scene and its results go to a folder.
    fn row(&self, data: &Path, folder: &Path) -> Result<String, Box<dyn Error>> {
        let region = self.region(&self.image(data)?)?;
        let voxels = voxel_surface(&region);
        let bounds = voxels.bounds().ok_or("no voxels")?;
        let text = self.scene(data, [bounds.0, bounds.1]);
        fs::create_dir_all(folder)?;
        fs::write(folder.join("scene.toml"), &text)?;
        // The mesh alone, without its skin, for the time that it takes.
        let alone = text[..text.find("[surface.skin]").unwrap_or(0)].to_owned();
        let started = Instant::now();
        build(&Scene::from_source(Source::parse("alone", alone)?, folder.into())?)?;
        let seconds = started.elapsed().as_secs_f64();
        let scene = Scene::from_source(Source::parse("scene.toml", text)?, folder.into())?;
        let built = Arc::new(build(&scene)?);
        for warning in &built.warnings {
            println!("<!-- {}: {} -->", self.name, warning.message);
        }
        let plan = plan(&scene, &built)?;
        let limits = plan.limits.as_ref().ok_or("no limits")?;
        let modulus = self.tissue.young() * 0.55 / (1.45 * 0.1);
        let model = &built.model;
        let volume: f64 =
            model.solids.iter().flat_map(|solid| (0..solid.cells.len()).map(|c| solid.cells.volume(c))).sum();
        let spacing = (volume / model.node_count() as f64).cbrt();
        let tau = limits.critical.assembled.step * (modulus / DENSITY).sqrt() / spacing;
        // Tets are seen by their own surface, hexes by the surface that they carry.
        let seen = if self.cells == "tets" { &built.bodies[0].mesh } else { &built.surfaces[0] };
        let [seen, voxels] =
            [seen, &voxels].map(|mesh| TriangleMesh::from_mesh(mesh).map(|(surface, _)| surface));
        let (seen, voxels) = (seen?, voxels?);
        let off = Hausdorff::between(&seen, &voxels, voxels.diagonal() / 300.0);
        let results = OutputFolder::prepare(folder.join("out"), &scene, true)?;
        let summary = run(&World::of(&scene, &built, &plan), &results, &mut |_| {})?;
        let mut row = String::new();
        write!(
            row,
            "| {} | {} of {} mm | {} / {} | {:+.1} % | {tau:.2} | {:.1} / {:.1} | {} {:.2} / {:.2} | {:.1} | {} | {:.1} |",
            self.name,
            self.cells,
            self.edge * 1e3,
            model.cell_count(),
            model.node_count(),
            (volume / region.volume() - 1.0) * 100.0,
            off.largest() * 1e3,
            off.rms_forward.max(off.rms_backward) * 1e3,
            self.tissue.word(),
            limits.critical.bound.step * 1e3,
            limits.critical.assembled.step * 1e3,
            seconds,
            summary.status,
            summary.wall_seconds,
        )?;
        if let Some(error) = &summary.error {
            println!("<!-- {}: {} -->", self.name, error.message);
        }
        Ok(row)
    }
}

/// The faces of voxels between inside and outside.
fn voxel_surface(region: &Region) -> Mesh {
    let dims = region.grid.dims;
    let inside = |at: [i64; 3]| {
        let within = at.iter().zip(dims).all(|(&i, n)| (0..n as i64).contains(&i));
        within && region.inside[at[0] as usize + dims[0] * (at[1] as usize + dims[1] * at[2] as usize)]
    };
    let (mut numbers, mut points, mut quads) = (HashMap::new(), Vec::new(), Vec::new());
    for at in (0..region.inside.len()).filter(|&at| region.inside[at]) {
        let cell = region.grid.triple(at).map(|i| i as i64);
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut neighbour = cell;
            neighbour[axis] += 2 * side - 1;
            if inside(neighbour) {
                continue;
            }
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            let turns =
                if side == 1 { [[0, 0], [1, 0], [1, 1], [0, 1]] } else { [[0, 0], [0, 1], [1, 1], [1, 0]] };
            for [shift_b, shift_c] in turns {
                let mut corner = cell;
                corner[axis] += side;
                corner[b] += shift_b;
                corner[c] += shift_c;
                quads.push(*numbers.entry(corner).or_insert_with(|| {
                    points.push(region.grid.position(&Vector3::from(corner.map(|i| i as f64 - 0.5))));
                    points.len() as u32 - 1
                }));
            }
        }
    }
    Mesh { points, blocks: vec![CellBlock::new(CellKind::Quad, quads)], ..Mesh::default() }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(data) = std::env::var_os("PLIANT_DATA").map(PathBuf::from) else {
        println!("PLIANT_DATA is not set: nothing is measured");
        return Ok(());
    };
    let data = data.canonicalize()?;
    let mut arguments = std::env::args().skip(1);
    let folder =
        PathBuf::from(arguments.next().ok_or("a folder for the scenes and their results is missing")?);
    let chosen: Vec<String> = arguments.collect();
    println!(
        "| body | cells | elements / nodes | volume | τ | distance to voxels: largest / rms [mm] | \
         step: element bound / critical [ms] | \
         mesh [s] | 1 s | wall [s] |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    for scan in SCANS.iter().filter(|scan| chosen.is_empty() || chosen.iter().any(|name| name == scan.name)) {
        match scan.row(&data, &folder.join(scan.name)) {
            Ok(row) => println!("{row}"),
            Err(error) => println!("| {} | failed: {error} |", scan.name),
        }
    }
    Ok(())
}
