//! Meshes the real organs of a folder in tets of two edges each (a 16th and a 32nd of the diagonal). Prints
//! how sound the meshes are: `PLIANT_DATA=FOLDER cargo run --release -p pliant-meshing --example bodies --
//! [OUT] [NAME…]`. OUT gets the meshes (`-` for none). Only bodies whose names contain one of the NAMEs are
//! meshed. The tests describe the layout of the folder.

use std::path::{Path, PathBuf};
use std::time::Instant;

use pliant_geometry::io;
use pliant_imaging::{Choice, Cleaning, LabelChoice, ReadOptions, Smoothing};
use pliant_meshing::{Anatomy, Closing, Enclosed, OrganTets, SurfaceCheck, TriangleMesh, Voxels};

/// Parts of the diagonal that are edges.
const PARTS: [f64; 2] = [16.0, 32.0];

type Failed = Box<dyn std::error::Error>;

/// A body in a file.
enum Body {
    /// A closed surface, with the size of its unit [m].
    Surface(f64),
    Labels(&'static [i32]),
    /// Two maps of probabilities, added, from a value on; the second one is a file.
    From(f64, Option<&'static str>),
}

const MNI: &str = "brain-mni152/mni_icbm152_wm_2009a_sym.nii.gz";

const BODIES: &[(&str, &str, Body)] = &[
    ("liver-openhelp", "organs-openhelp/Liver.stl", Body::Surface(1e-3)),
    ("spleen-openhelp", "organs-openhelp/Spleen.stl", Body::Surface(1e-3)),
    ("kidney-openhelp", "organs-openhelp/Kidney_left.stl", Body::Surface(1e-3)),
    ("pancreas-openhelp", "organs-openhelp/Pancreas.stl", Body::Surface(1e-3)),
    ("duodenum-openhelp", "organs-openhelp/Duodenum.stl", Body::Surface(1e-3)),
    ("trachea-openhelp", "organs-openhelp/Trachea.stl", Body::Surface(1e-3)),
    ("rectum-openhelp", "organs-openhelp/Rectum_Lumen.stl", Body::Surface(1e-3)),
    ("wall-openhelp", "organs-openhelp/Abdominal_wall.stl", Body::Surface(1e-3)),
    ("aneurysm", "aneurysm-sofa/aneurysm3D_1.off", Body::Surface(1e-3)),
    ("liver-smooth", "liver-sofa/liver-smooth.obj", Body::Surface(1e-2)),
    ("liver2", "liver-sofa/liver2.obj", Body::Surface(1e-2)),
    ("liver-msh", "liver-sofa/liver.msh", Body::Surface(1e-2)),
    ("aorta-vmtk", "aorta-vmtk/aorta-surface.vtp", Body::Surface(1e-3)),
    ("gallbladder", "organs-sofa-env/glt_gallbladder_visual.stl", Body::Surface(1e-3)),
    ("gallbladder-coarse", "organs-sofa-env/glt_gallbladder_collision.stl", Body::Surface(1e-3)),
    ("ventricles", "brain-itksnap/MRIcrop-ventricle-mesh.vtk", Body::Surface(1e-3)),
    ("liver-registration", "liver-registration/liver.msh", Body::Surface(1.0)),
    ("spleen", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[1])),
    ("kidney-right", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[2])),
    ("liver", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[5])),
    ("stomach", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[6])),
    ("pancreas", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[7])),
    ("lung-lower", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[14])),
    ("small-bowel", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[18])),
    ("duodenum", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[19])),
    ("colon", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[20])),
    ("vertebra", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[30])),
    ("vena-cava", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[63])),
    ("muscle", "abdomen-totalseg/example_seg.nii.gz", Body::Labels(&[86])),
    ("aorta-fast", "abdomen-totalseg/fast_aorta.nii.gz", Body::Labels(&[1])),
    ("portal-vein-fast", "abdomen-totalseg/fast_portal_vein_and_splenic_vein.nii.gz", Body::Labels(&[1])),
    ("stomach-fast", "abdomen-totalseg/fast_stomach.nii.gz", Body::Labels(&[1])),
    ("colon-fast", "abdomen-totalseg/fast_colon.nii.gz", Body::Labels(&[1])),
    ("aorta-dissected", "abdomen-totalseg/report_aorta.nii.gz", Body::Labels(&[1])),
    ("lumen-false", "abdomen-totalseg/report_aorta_false_lumen.nii.gz", Body::Labels(&[1])),
    ("lumen-true", "abdomen-totalseg/report_aorta_true_lumen.nii.gz", Body::Labels(&[1])),
    ("deep-brain", "brain-itksnap/MRIcrop-seg.gipl.gz", Body::Labels(&[8, 7, 1, 2, 3])),
    ("ventricles-labels", "brain-itksnap/MRIcrop-seg.gipl.gz", Body::Labels(&[1, 2, 3])),
    ("white-matter", MNI, Body::From(128.0, None)),
    ("brain", "brain-mni152/mni_icbm152_gm_2009a_sym.nii.gz", Body::From(128.0, Some(MNI))),
];

fn main() -> Result<(), Failed> {
    let folder = PathBuf::from(std::env::var("PLIANT_DATA")?);
    let mut words = std::env::args().skip(1);
    let out = words.next().filter(|out| out != "-").map(PathBuf::from);
    let names: Vec<String> = words.collect();
    out.as_deref().map(std::fs::create_dir_all).transpose()?;
    let (mut meshes, mut crossing, mut crossing_triangles) = (0, 0, 0);
    for (name, file, body) in BODIES {
        if !names.is_empty() && !names.iter().any(|wanted| name.contains(wanted.as_str())) {
            continue;
        }
        let (read, diagonal) = read(&folder, file, body)?;
        for part in PARTS {
            // Rounded to what one types.
            let edge = (diagonal / part * 1e5).round() / 1e5;
            let start = Instant::now();
            let anatomy = read.anatomy(edge)?;
            let made = OrganTets::new(edge).mesh(&anatomy, &|_| {})?;
            let report = &made.report;
            let volumes = report
                .materials
                .iter()
                .filter_map(|material| Some((material.volume, material.voxel_volume?)));
            let [meshed, given] =
                volumes.fold([0.0; 2], |sums, (meshed, given)| [sums[0] + meshed, sums[1] + given]);
            println!(
                "{name:<20} {:6.2} mm {:6} tets, acoustic {:.3}, volume {:+.2} %, Euler number {:4} (body {:4}), \
                 {:3} faces cross, {} tears closed, {} left, {} touch, {:.1} s",
                edge * 1e3,
                report.tets,
                report.acoustic_part,
                (meshed / given - 1.0) * 100.0,
                report.surface.euler_number,
                report.surface.of_body.unwrap_or(0),
                report.surface.self_intersections,
                report.repairs.closed_tears,
                report.tears.number,
                report.crowded_edges_left + report.pinched_points.len(),
                start.elapsed().as_secs_f64()
            );
            meshes += 1;
            crossing += usize::from(report.surface.self_intersections > 0);
            let hexes = SurfaceCheck::of(&Voxels::new(edge).mesh(anatomy.field())?.mesh);
            let mut surface = TriangleMesh::of_field(anatomy.field(), 0.5 * edge, usize::MAX)?;
            surface.remesh(edge, usize::MAX)?;
            let surface = SurfaceCheck::of(&surface.to_mesh());
            let of = |check: &SurfaceCheck| {
                format!("Euler number {}, {} faces cross", check.euler_number, check.self_intersections)
            };
            println!("{:<20} hexes: {}; triangles: {}", "", of(&hexes), of(&surface));
            crossing_triangles += usize::from(surface.self_intersections > 0);
            if let Some(out) = &out {
                io::write(&out.join(format!("{name}-{part:.0}.vtu")), &made.mesh)?;
            }
        }
    }
    println!("{crossing} of {meshes} meshes of tets and {crossing_triangles} surfaces intersect themselves");
    Ok(())
}

/// A body as read.
enum Read {
    Surface(pliant_geometry::Mesh),
    Image(pliant_imaging::Image, Choice),
}

/// A body and the diagonal of its box [m].
fn read(folder: &Path, file: &str, body: &Body) -> Result<(Read, f64), Failed> {
    let path = folder.join(file);
    if let Body::Surface(scale) = body {
        let mut mesh = io::read(&path)?.mesh;
        mesh.points.iter_mut().for_each(|point| *point *= *scale);
        let (low, high) = mesh.bounds().ok_or("no points")?;
        return Ok((Read::Surface(mesh), (high - low).norm()));
    }
    let mut image = pliant_imaging::read(&path, &ReadOptions::default())?;
    let choice = match body {
        Body::From(least, added) => {
            if let Some(added) = added {
                image = image.plus(&pliant_imaging::read(&folder.join(added), &ReadOptions::default())?)?;
            }
            Choice::From(*least)
        }
        Body::Labels(labels) => {
            let labels: Vec<LabelChoice> = labels.iter().map(|&label| LabelChoice::One(label)).collect();
            image.choose(&labels)?
        }
        Body::Surface(_) => unreachable!("handled above"),
    };
    let read = Read::Image(image, choice);
    let (low, high) = read.anatomy(f64::INFINITY)?.field().bounds();
    Ok((read, (high - low).norm()))
}

impl Read {
    /// For cells of `edge` [m].
    fn anatomy(&self, edge: f64) -> Result<Anatomy<'static>, Failed> {
        Ok(match self {
            Self::Surface(mesh) => {
                Enclosed::new(mesh, edge, &Closing::default())?.anatomy(1, edge, &|_| {})?
            }
            Self::Image(image, choice) => {
                let cut = image.cut(choice, edge / 4.0, &|_| {})?;
                let cleaning = Cleaning::default();
                Anatomy::from_image(&cut.labels, &cut.chosen, &cleaning, &Smoothing::default(), &|_| {})?.0
            }
        })
    }
}
