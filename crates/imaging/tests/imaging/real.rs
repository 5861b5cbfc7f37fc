//! Images of real organs in the folder PLIANT_DATA: sizes, positions and counts from nibabel, SimpleITK and
//! ITK-SNAP (`README.md` of that folder).

use std::path::PathBuf;

use pliant_imaging::{ReadOptions, read};

fn data(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: set PLIANT_DATA to the folder that holds {name}");
        return None;
    };
    Some(PathBuf::from(folder).join(name))
}

#[test]
fn the_abdomen_has_its_liver() {
    let Some(path) = data("abdomen-totalseg/example_seg.nii.gz") else { return };
    let image = read(&path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let regions = image.labels().unwrap().regions();
    for region in &regions {
        println!("{region}");
    }
    let voxels = |label| regions.iter().find(|region| region.label == label).map(|region| region.voxels);
    assert_eq!((voxels(5), voxels(20)), (Some(38_634), Some(12_993)));
    let liver = regions.iter().find(|region| region.label == 5).unwrap();
    assert!((liver.volume - 1.04e-3).abs() < 0.01e-3);
}

#[test]
fn the_brain_crop_has_eight_labels() {
    let Some(path) = data("brain-itksnap/MRIcrop-seg.gipl.gz") else { return };
    let image = read(&path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((image.grid.dims, image.grid.spacing()), ([78, 110, 64], [1e-3; 3]));
    assert_eq!(image.labels().unwrap().present(), (1..=8).collect::<Vec<_>>());
}

#[test]
fn the_aorta_is_read_with_its_orientation() {
    let Some(path) = data("aorta-vmtk/aorta.mha") else { return };
    let image = read(&path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(image.grid.dims, [157, 393, 34]);
    // TransformMatrix −1 0 0 0 −1 0 0 0 1 in LPS is the identity in RAS.
    let expected = nalgebra::Vector3::new(0.156445, 0.0246094, 0.0);
    assert!((image.grid.origin - expected).norm() < 1e-9, "{}", image.grid.origin);
    assert!((image.grid.axes.column(0) - nalgebra::Vector3::new(0.878906e-3, 0.0, 0.0)).norm() < 1e-9);
    let level_set =
        read(&data("aorta-vmtk/aorta-final-levelset.mha").unwrap(), &ReadOptions::default()).unwrap();
    let inside = level_set.threshold(f64::NEG_INFINITY..=0.0).regions();
    println!("{}", inside[0]);
    assert!(inside[0].components >= 1 && inside[0].volume > 10e-6);
}

#[test]
fn the_average_brain_is_selected_by_thresholds() {
    let Some(path) = data("brain-mni152/mni_icbm152_t1_2009a_sym.nii.gz") else { return };
    let image = read(&path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(image.grid.dims, [197, 233, 189]);
    let brain = image.threshold(f64::MIN_POSITIVE..=f64::INFINITY).regions();
    println!("{}", brain[0]);
    assert!((1.5e-3..2.2e-3).contains(&brain[0].volume));
}
