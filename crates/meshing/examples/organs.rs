//! Prints size, quality and time of meshes of the label images of the analytic organs (128³ voxels of 1.6 mm)
//! for eight lattices each: `cargo run --release -p pliant-meshing --example organs [LATTICES]`

use std::time::Instant;

use pliant_geometry::Vector3;
use pliant_imaging::{Cleaning, Smoothing};
use pliant_meshing::{Anatomy, OrganTets};
use pliant_testing::{Random, mesh_checks, organs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lattices: usize = std::env::args().nth(1).map_or(Ok(8), |text| text.parse())?;
    let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
    for (name, image, labels, edges) in [
        ("liver", organs::liver(), vec![1], vec![0.010, 0.005]),
        ("brain", organs::brain(), vec![1, 2, 3], vec![0.010, 0.005]),
        ("brain of one label", organs::whole_brain(), vec![1], vec![0.010, 0.008]),
    ] {
        let start = Instant::now();
        let (anatomy, _) = Anatomy::from_image(&image, &labels, &cleaning, &Smoothing::default(), &|_| {})?;
        println!("{name}: field in {:.3} s", start.elapsed().as_secs_f64());
        let truth = organs::truth(name);
        for edge in edges {
            let mut random = Random::new(5);
            for number in 0..lattices {
                let origin =
                    if number == 0 { Vector3::zeros() } else { mesh_checks::offset(&mut random, edge) };
                let start = Instant::now();
                let request = OrganTets { origin: Some(origin), ..OrganTets::new(edge) };
                let made = request.mesh(&anatomy, &|_| {})?;
                let seconds = start.elapsed().as_secs_f64();
                let [forth, back, rms] = organs::distances(&made.mesh, &truth);
                if number > 0 {
                    let r = &made.report;
                    println!(
                        "    lattice {number}: {seconds:.2} s, {} tets, least {:.3} (raw {:.3}), dihedral {:.1}, RMS {:.3} a, H {:.2} / {:.2} mm, {} left, {:?}",
                        r.tets,
                        r.acoustic_part,
                        r.raw_acoustic_part,
                        r.dihedral[0],
                        rms / edge,
                        forth * 1e3,
                        back * 1e3,
                        r.crowded_edges_left,
                        r.materials
                            .iter()
                            .map(|m| m.volume / m.voxel_volume.unwrap_or(f64::NAN))
                            .collect::<Vec<_>>()
                    );
                    continue;
                }
                println!(
                    "  {:.0} mm: {seconds:.2} s, H {:.2} / {:.2} mm, RMS {:.3} mm ({:.3} a)\n    {}",
                    edge * 1e3,
                    forth * 1e3,
                    back * 1e3,
                    rms * 1e3,
                    rms / edge,
                    made.report.to_string().replace('\n', "\n    ")
                );
            }
        }
    }
    Ok(())
}
