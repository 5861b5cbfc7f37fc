//! Images that cannot be meshed, through the real binary: malformed files of every format, series with slices
//! missing or mixed.

#[allow(dead_code)]
use std::fs;
use std::path::Path;

use pliant_testing::image_files::{Form, Syntax, Volume, dicom, nifti1, nifti2};

use crate::support::{BLOCK, Said, Workshop};

fn assert_refused(workshop: &Workshop, image: &str, says: &[&str]) {
    let mesh = ["mesh", image, "--label", "1", "--edge", "5mm", "-o", "out.vtu", "--json"];
    let output: [Said; 2] = [workshop.pliant(&mesh), workshop.pliant(&["labels", image, "--json"])];
    for output in output {
        assert_eq!(output.code, 2, "{image}: {}{}", output.err, output.out);
        assert_eq!(output.json()["error"]["kind"], "input");
        assert_eq!(output.err.matches("error:").count(), 1, "{image}: {}", output.err);
        for piece in says {
            assert!(output.words().contains(piece), "{image}: no `{piece}` in: {}", output.err);
        }
    }
    assert!(!workshop.path("out.vtu").exists());
}

/// Truncated, of wrong byte order, with negative spacing, singular, not finite, with lengths that nothing
/// bears out.
#[test]
fn malformed_images_are_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../imaging/tests/corpus");
    let workshop = Workshop::new(BLOCK);
    let mut count = 0;
    for entry in fs::read_dir(corpus).expect("the corpus") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let ending = match name.split('-').next() {
            Some("nifti") => "nii",
            Some("nrrd") => "nrrd",
            Some("meta") => "mha",
            Some("gipl") => "gipl",
            Some("dicom") => "dcm",
            _ => continue,
        };
        let image = format!("{name}.{ending}");
        workshop.write(&image, fs::read(&path).expect("a file"));
        assert_refused(&workshop, &image, &[&image]);
        count += 1;
    }
    assert!(count >= 20, "{count}");
}

/// A box of label 1 that fills the volume except its rim.
fn box_of_labels() -> Volume {
    let dims = [12, 12, 12];
    let inner = |i: usize| (2..10).contains(&i);
    let label = |at: usize| i16::from(inner(at % 12) && inner(at / 12 % 12) && inner(at / 144));
    let values = (0..1728).map(label).collect();
    let axes = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(2.0, 2.0, 2.5));
    Volume { dims, values, axes, ..Volume::oblique() }
}

#[test]
fn either_byte_order_and_both_versions_of_nifti_give_the_same_mesh() {
    let workshop = Workshop::new(BLOCK);
    let volume = box_of_labels();
    let mut cells = Vec::new();
    for (name, bytes) in [
        ("little.nii", nifti1(&volume, Form::Sform, false)),
        ("big.nii", nifti1(&volume, Form::Sform, true)),
        ("two.nii", nifti2(&volume, false)),
    ] {
        workshop.write(name, bytes);
        let output =
            workshop.pliant(&["mesh", name, "--label", "1", "--edge", "5mm", "-o", "out.vtu", "--json"]);
        assert_eq!(output.code, 0, "{}", output.err);
        cells.push(output.json()["cells"].clone());
    }
    assert!(cells[0].as_u64() > Some(50) && cells.iter().all(|one| *one == cells[0]), "{cells:?}");
}

#[test]
fn a_series_with_slices_missing_or_mixed_is_refused() {
    let workshop = Workshop::new(BLOCK);
    let volume = box_of_labels();
    let put = |folder: &str, k: usize, series: &str| {
        workshop.write(&format!("{folder}/{series}-{k:02}"), dicom(&volume, k, Syntax::Explicit, series));
    };
    (0..12).filter(|k| *k != 5).for_each(|k| put("missing", k, "1.2"));
    assert_refused(&workshop, "missing", &["1.2-04", "1.2-06"]);
    (0..12).for_each(|k| put("mixed", k, "1.2"));
    (0..12).for_each(|k| put("mixed", k, "1.3"));
    assert_refused(&workshop, "mixed", &["1.2", "1.3", "--series"]);
    let chosen = ["labels", "mixed", "--series", "1.3", "--json"];
    assert_eq!(workshop.pliant(&chosen).code, 0);
    workshop.write("none/notes.txt", "no image\n");
    assert_refused(&workshop, "none", &["none"]);
}

/// More than 2 GiB of voxels are refused by the header alone; with `--force` reading continues, here to the
/// end of a file without voxels.
#[test]
fn images_of_more_than_two_gigabytes_ask_for_force() {
    let workshop = Workshop::new(BLOCK);
    let large = Volume { dims: [800; 3], values: Vec::new(), ..box_of_labels() };
    let mut bytes = nifti1(&large, Form::Sform, false);
    // Eight bytes a voxel.
    bytes[70..74].copy_from_slice(&[64, 0, 64, 0]);
    workshop.write("large.nii", bytes);
    let mesh = ["mesh", "large.nii", "--label", "1", "--edge", "5mm", "-o", "out.vtu"];
    let output = workshop.pliant(&mesh);
    assert!(output.code == 2 && output.words().contains("`--force` reads it anyway"), "{}", output.err);
    let output = workshop.pliant(&[&mesh[..], &["--force"]].concat());
    let words = output.words();
    assert!(output.code == 2 && !words.contains("--force") && words.contains("large.nii"), "{}", output.err);
}
