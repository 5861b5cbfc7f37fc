//! One volume in every format: the same voxels in the same places.

use std::fs;

use nalgebra::{Matrix3, Vector3};
use pliant_imaging::{Image, ImageFormat, ReadOptions, Scalar, read, read_bytes};

use pliant_testing::image_files::*;

/// Asserts that the voxels of `image` equal the voxels of `volume`, each at its position to `tolerance` [m].
/// Axes may be reversed (slices are sorted), so voxels are found by position.
fn assert_same(image: &Image, volume: &Volume, tolerance: f64) {
    assert_eq!(image.grid.len(), volume.values.len());
    for at in 0..image.grid.len() {
        let place = image.grid.position(&Vector3::from(image.grid.triple(at).map(|i| i as f64)));
        let index = volume.axes.try_inverse().unwrap() * (place * 1e3 - volume.origin);
        let rounded = index.map(f64::round);
        let expected = (volume.axes * rounded + volume.origin) * 1e-3;
        assert!((place - expected).norm() < tolerance, "{}: {place} for {expected}", image.format);
        let [i, j, k] = [0, 1, 2].map(|axis| rounded[axis] as usize);
        let value = volume.values[i + volume.dims[0] * (j + volume.dims[1] * k)];
        assert_eq!(image.value(at), f64::from(value), "{} at ({i}, {j}, {k})", image.format);
    }
}

fn of_bytes(bytes: &[u8], format: ImageFormat) -> Image {
    read_bytes(bytes, format, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Single-precision headers hold 1e-7 of 130 mm.
const SINGLE: f64 = 3e-8;
const DOUBLE: f64 = 1e-12;

#[test]
fn an_oblique_left_handed_volume_is_the_same_in_every_format() {
    let volume = Volume::oblique();
    assert!(volume.axes.determinant() < 0.0);
    for big in [false, true] {
        for form in [Form::Sform, Form::Qform] {
            assert_same(&of_bytes(&nifti1(&volume, form, big), ImageFormat::Nifti), &volume, SINGLE);
        }
        assert_same(&of_bytes(&nifti2(&volume, big), ImageFormat::Nifti), &volume, DOUBLE);
        for encoding in ["raw", "gzip", "ascii"] {
            assert_same(&of_bytes(&nrrd(&volume, encoding, big), ImageFormat::Nrrd), &volume, DOUBLE);
        }
        for compressed in [false, true] {
            let file = metaimage(&volume, compressed, big, "LOCAL");
            assert_same(&of_bytes(&file, ImageFormat::MetaImage), &volume, DOUBLE);
        }
    }
    for syntax in [Syntax::Implicit, Syntax::Explicit, Syntax::Deflated, Syntax::BigEndian] {
        let folder = tempfile::tempdir().unwrap();
        dicom_folder(folder.path(), &volume, syntax);
        fs::write(folder.path().join("readme.txt"), "no slice").unwrap();
        let image = read(folder.path(), &ReadOptions::default())
            .unwrap_or_else(|error| panic!("{syntax:?}: {error}"));
        assert_same(&image, &volume, DOUBLE);
        assert_eq!(image.notes.len(), 1);
    }
}

#[test]
fn gzip_round_a_whole_file_is_unpacked() {
    let volume = Volume::oblique();
    let image = of_bytes(&gzip(&nifti1(&volume, Form::Sform, false)), ImageFormat::Nifti);
    assert_same(&image, &volume, SINGLE);
    assert_eq!((image.scalar(), image.format.as_str()), (Scalar::I16, "NIfTI-1"));
}

/// GIPL holds no orientation.
#[test]
fn gipl_keeps_spacing_and_origin() {
    let mut volume = Volume::oblique();
    volume.axes = Matrix3::from_diagonal(&Vector3::new(-0.75, -1.25, 2.5));
    for bytes in [gipl(&volume), gzip(&gipl(&volume))] {
        assert_same(&of_bytes(&bytes, ImageFormat::Gipl), &volume, SINGLE);
    }
}

#[test]
fn data_beside_a_header_are_found() {
    let volume = Volume::oblique();
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let mut header = nifti1(&volume, Form::Sform, false);
    let voxels = header.split_off(352);
    header[344..348].copy_from_slice(b"ni1\0");
    header[108..112].copy_from_slice(&0_f32.to_le_bytes());
    write("plain.hdr", &header);
    write("plain.img", &voxels);
    write("packed.hdr.gz", &gzip(&header));
    write("packed.img.gz", &gzip(&voxels));
    write("scan.mhd", &metaimage(&volume, false, true, "scan.raw"));
    write("scan.raw", &metaimage_data(&volume, false, true));
    write("zipped.mhd", &metaimage(&volume, true, false, "scan.zraw"));
    write("scan.zraw", &metaimage_data(&volume, true, false));
    write(
        "scan.nhdr",
        format!("{}data file: raw.gz\nbyte skip: 0\n", nrrd_header(&volume, "gzip", false)).as_bytes(),
    );
    write("raw.gz", &gzip(&metaimage_data(&volume, false, false)));
    for name in ["plain.hdr", "packed.hdr.gz", "scan.mhd", "zipped.mhd", "scan.nhdr"] {
        let image = read(&folder.path().join(name), &ReadOptions::default())
            .unwrap_or_else(|error| panic!("{error}"));
        assert_same(&image, &volume, SINGLE);
    }
}

/// A series of a tilted gantry: its slices step along their normal and sideways.
#[test]
fn a_tilted_gantry_shears_the_grid() {
    let mut volume = Volume::oblique();
    volume.axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.6, 0.0, 0.0, 2.0);
    let folder = tempfile::tempdir().unwrap();
    dicom_folder(folder.path(), &volume, Syntax::Explicit);
    assert_same(&read(folder.path(), &ReadOptions::default()).unwrap(), &volume, DOUBLE);
}

#[test]
fn one_of_two_series_is_read_by_its_uid() {
    let volume = Volume::oblique();
    let folder = tempfile::tempdir().unwrap();
    dicom_folder(folder.path(), &volume, Syntax::Explicit);
    let mut other = volume.clone();
    other.values.iter_mut().for_each(|x| *x += 1);
    for k in 0..2 {
        fs::write(folder.path().join(format!("other{k}")), dicom(&other, k, Syntax::Implicit, "9.9"))
            .unwrap();
    }
    let error = read(folder.path(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("2 series: 1.2.3.4 (a test, 3 slices); 9.9 (a test, 2 slices)"), "{error}");
    let asked = |uid: &str| ReadOptions { series: Some(uid.to_owned()), ..ReadOptions::default() };
    assert_same(&read(folder.path(), &asked("1.2.3.4")).unwrap(), &volume, DOUBLE);
    assert_eq!(read(folder.path(), &asked("9.9")).unwrap().grid.dims, [5, 4, 2]);
    assert!(
        read(folder.path(), &asked("7")).unwrap_err().to_string().contains("no slice belongs to series 7")
    );
}

/// Every type of number, its least and its largest value.
#[test]
fn every_type_of_number_is_read_exactly() {
    let header = |datatype: i16, bits: i16| {
        let mut file =
            nifti1(&Volume { dims: [2, 1, 1], values: vec![], ..Volume::oblique() }, Form::Sform, false);
        file[70..72].copy_from_slice(&datatype.to_le_bytes());
        file[72..74].copy_from_slice(&bits.to_le_bytes());
        file
    };
    macro_rules! check {
        ($number:ty, $datatype:expr) => {
            let numbers = [<$number>::MIN, <$number>::MAX];
            let mut file = header($datatype, 8 * size_of::<$number>() as i16);
            numbers.iter().for_each(|x| file.extend(x.to_le_bytes()));
            let image = of_bytes(&file, ImageFormat::Nifti);
            assert_eq!([image.value(0), image.value(1)], numbers.map(|x| x as f64));
        };
    }
    check!(u8, 2);
    check!(i16, 4);
    check!(i32, 8);
    check!(f32, 16);
    check!(f64, 64);
    check!(i8, 256);
    check!(u16, 512);
    check!(u32, 768);
    check!(i64, 1024);
    check!(u64, 1280);
}

#[test]
fn slope_and_intercept_scale_values_and_labels_stay_whole() {
    let mut file = nifti1(&Volume::oblique(), Form::Sform, false);
    let plain = of_bytes(&file, ImageFormat::Nifti);
    assert_eq!(plain.labels().unwrap().labels[1], -863);
    file[112..116].copy_from_slice(&0.5_f32.to_le_bytes());
    file[116..120].copy_from_slice(&10.0_f32.to_le_bytes());
    let scaled = of_bytes(&file, ImageFormat::Nifti);
    assert_eq!(scaled.value(1), -863.0 * 0.5 + 10.0);
    let error = scaled.labels().unwrap_err().to_string();
    assert!(error.starts_with("voxel [1, 0, 0] is -421.5, which is not a label"), "{error}");
}

/// NIfTI-1, method 1: no orientation.
#[test]
fn without_orientation_the_axes_are_taken_as_they_are() {
    let image = of_bytes(&nifti1(&Volume::oblique(), Form::Neither, false), ImageFormat::Nifti);
    assert_eq!(image.notes.len(), 1);
    let spacing = Vector3::new(0.9e-3, 1.25e-3, 2.5e-3);
    assert!((image.grid.axes - Matrix3::from_diagonal(&spacing)).norm() < 1e-9);
}

/// 3D Slicer's segmentations carry an axis of layers; one layer is an image.
#[test]
fn an_axis_of_one_layer_without_direction_is_dropped() {
    let volume = Volume::oblique();
    let text = String::from_utf8_lossy(&nrrd(&volume, "ascii", false)).into_owned();
    let layered = text
        .replace("dimension: 3", "dimension: 4")
        .replace("sizes: ", "sizes: 1 ")
        .replace("space directions: ", "space directions: none ");
    assert_same(&of_bytes(layered.as_bytes(), ImageFormat::Nrrd), &volume, DOUBLE);
    let two = layered.replace("sizes: 1 ", "sizes: 2 ");
    let error =
        read_bytes(two.as_bytes(), ImageFormat::Nrrd, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("several values per voxel"), "{error}");
}
