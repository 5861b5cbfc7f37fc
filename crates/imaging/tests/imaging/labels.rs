//! Labels and their names: segmentations in DICOM, names in NRRD and NIfTI, masks, scans without labels,
//! paths that are not files.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use nalgebra::Vector3;
use pliant_imaging::{
    Choice, Image, ImageError, ImageFormat, LabelChoice, LabelError, LabelNames, ReadOptions, Scalar, read,
    read_bytes, read_with,
};

use pliant_testing::image_files::*;

/// Labels 1 to 3 in slices 1, 2 and 4 of six, so frames are missing at both ends and in between.
fn labelled() -> Volume {
    let dims = [5, 4, 6];
    let label = |at: usize| match (at % 5, at / 5 % 4, at / 20) {
        (0..=2, 1, 1 | 2) => 1,
        (3, 0..=2, 2) => 2,
        (4, 3, 4) => 3,
        _ => 0,
    };
    Volume { dims, values: (0..120).map(label).collect(), ..Volume::oblique() }
}

/// Asserts that the voxels with labels equal the voxels of a volume, in position.
fn assert_same(image: &Image, volume: &Volume) {
    let inverse = volume.axes.try_inverse().unwrap();
    let mut found = 0;
    for at in 0..image.grid.len() {
        let label = image.value(at) as i16;
        let place = image.grid.position(&Vector3::from(image.grid.triple(at).map(|i| i as f64))) * 1e3;
        let index = (inverse * (place - volume.origin)).map(f64::round);
        assert!((volume.axes * index + volume.origin - place).norm() < 1e-4, "{place}");
        let [i, j, k] = [0, 1, 2].map(|axis| index[axis] as usize);
        assert_eq!(label, volume.values[i + 5 * (j + 4 * k)], "{i} {j} {k}");
        found += usize::from(label != 0);
    }
    assert_eq!(found, volume.values.iter().filter(|value| **value != 0).count());
}

#[test]
fn a_segmentation_is_a_label_image_with_names() {
    let volume = labelled();
    let names = ["liver", "tumour", "vessel"];
    for syntax in [Syntax::Explicit, Syntax::Implicit, Syntax::BigEndian] {
        for kind in [Segments::Bits, Segments::Fractions, Segments::Labels] {
            let bytes = segmentation(&volume, kind, &names, syntax);
            let image = read_bytes(&bytes, ImageFormat::Dicom, &ReadOptions::default())
                .unwrap_or_else(|error| panic!("{kind:?} {syntax:?}: {error}"));
            assert_same(&image, &volume);
            assert_eq!(
                image.grid.dims,
                [5, 4, 6],
                "slices without any voxel are there, between the others and at either end"
            );
            let regions = image.regions(&|_| {}).unwrap();
            assert_eq!(
                regions.iter().map(|region| region.name.as_deref().unwrap()).collect::<Vec<_>>(),
                names
            );
        }
    }
}

#[test]
fn a_segmentation_is_found_as_a_file_and_beside_the_series_it_was_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("seg.dcm");
    let volume = labelled();
    fs::write(&file, segmentation(&volume, Segments::Bits, &["liver", "tumour", "vessel"], Syntax::Explicit))
        .unwrap();
    assert_same(&read(&file, &ReadOptions::default()).unwrap(), &volume);
    assert_same(&read(folder.path(), &ReadOptions::default()).unwrap(), &volume);
    dicom_folder(folder.path(), &volume, Syntax::Explicit);
    let message = read(folder.path(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("1.9 (segmentation, seg.dcm)") && message.contains("1.2.3.4"), "{message}");
    for (series, format) in [("1.9", "DICOM segmentation"), ("1.2.3.4", "DICOM")] {
        let options = ReadOptions { series: Some(series.into()), ..ReadOptions::default() };
        assert_eq!(read(folder.path(), &options).unwrap().format, format);
    }
}

#[test]
fn contours_are_named_with_what_turns_them_into_labels() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rtss.dcm");
    fs::write(&file, structure_set()).unwrap();
    for path in [&file, &folder.path().to_owned()] {
        let message = read(path, &ReadOptions::default()).unwrap_err().to_string();
        for part in ["RTSTRUCT", "contours", "SlicerRT", "plastimatch"] {
            assert!(message.contains(part), "{message}");
        }
    }
    // Beside a series they are passed over, and noted.
    dicom_folder(folder.path(), &Volume::oblique(), Syntax::Explicit);
    let image = read(folder.path(), &ReadOptions::default()).unwrap();
    assert!(image.notes.iter().any(|note| note.contains("RT structure sets")), "{:?}", image.notes);
}

#[test]
fn names_stand_in_the_headers_of_nrrd_and_nifti() {
    let text = String::from_utf8(nrrd(&labelled(), "ascii", false)).unwrap();
    let pairs = "Segment0_LabelValue:=2\nSegment0_Name:=tumour\nSegment1_Name:=liver\nSegment1_LabelValue:=1\nSegment2_Name:=lost\n";
    let slicer = text.replace("key:=value\n", pairs);
    let mut nifti = nifti1(&labelled(), Form::Sform, false);
    let xml = b"<?xml version=\"1.0\"?> <CaretExtension><VolumeInformation Index=\"0\"><LabelTable>\n<Label Key=\"1\" Red=\"1.0\" \
                Alpha=\"1\"><![CDATA[liver]]></Label>\n<Label Key=\"2\" Red=\"0.0\"><![CDATA[tumour]]></Label></LabelTable>";
    let padded = xml.len().div_ceil(16) * 16 + 8;
    let mut extension = vec![1, 0, 0, 0];
    extension.extend((padded as i32).to_le_bytes());
    extension.extend(0_i32.to_le_bytes());
    extension.extend(xml);
    extension.resize(4 + padded, 0);
    nifti.splice(348..352, extension);
    nifti[108..112].copy_from_slice(&((352 + padded) as f32).to_le_bytes());
    for (bytes, format) in [(slicer.into_bytes(), ImageFormat::Nrrd), (nifti, ImageFormat::Nifti)] {
        let mut image =
            read_bytes(&bytes, format, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_same(&image, &labelled());
        assert_eq!(
            (image.names.get(1), image.names.get(2), image.names.get(3)),
            (Some("liver"), Some("tumour"), None)
        );
        let choice = image.choose(&[LabelChoice::Named("Tumour".into()), LabelChoice::Range(1, 1)]);
        assert_eq!(choice, Ok(Choice::Labels(vec![2, 1])));
    }
}

/// Labels that a program stored as scaled integers are half a step of the scale off at most. Labels that a
/// program interpolated between equal ones are a little off. Both are rounded, with a note; a value between
/// labels is no label.
#[test]
fn labels_off_by_their_storage_are_rounded() {
    let (slope, intercept) = (0.216_296_65_f32, 7087.5_f32);
    let stored = [0, 2, 1001, 14175]
        .map(|label| ((f64::from(label) - f64::from(intercept)) / f64::from(slope)).round() as i16);
    let volume = Volume { dims: [4, 1, 1], values: stored.to_vec(), ..Volume::oblique() };
    let mut bytes = nifti1(&volume, Form::Sform, false);
    bytes[112..116].copy_from_slice(&slope.to_le_bytes());
    bytes[116..120].copy_from_slice(&intercept.to_le_bytes());
    let scaled = read_bytes(&bytes, ImageFormat::Nifti, &ReadOptions::default()).unwrap();
    assert_eq!(scaled.labels().unwrap().labels, [0, 2, 1001, 14175]);
    let note = scaled.rounding().unwrap();
    assert!(note.starts_with("4 voxels differ from whole numbers by up to 1.08e-1: rounded"), "{note}");
    // From a step of 1 on, several labels have one number.
    bytes[112..116].copy_from_slice(&1.5_f32.to_le_bytes());
    let coarse = read_bytes(&bytes, ImageFormat::Nifti, &ReadOptions::default()).unwrap();
    assert!(matches!(coarse.labels().unwrap_err(), LabelError::NotWhole { .. }));

    let of = |values: [f64; 4]| {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let grid = pliant_geometry::Grid::along_axes([4, 1, 1], Vector3::zeros(), [1e-3; 3]).unwrap();
        Image::new(grid, Scalar::F64, bytes, LabelNames::default()).unwrap()
    };
    let mut resampled = of([0.0, 7014.9999, 7002.977, 7015.0]);
    let choice = resampled.choose(&["7003".parse().unwrap(), "7015".parse().unwrap()]).unwrap();
    assert_eq!(choice, Choice::Labels(vec![7003, 7015]));
    assert!(resampled.notes[0].contains("by up to 2.30e-2"), "{:?}", resampled.notes);
    let between = of([0.0, 7014.9, 7003.0, 7015.0]).labels().unwrap_err().to_string();
    assert!(between.contains("resampled by nearest neighbours"), "{between}");
    assert_eq!(of([0.0, 1.0, 2.0, 3.0]).rounding(), None);
}

/// The box of a ball in an oblique image is the box of its voxels. The box of the corners of its voxel range
/// is larger.
#[test]
fn boxes_of_oblique_labels_are_true() {
    let dims = [24, 20, 16];
    let ball = |at: usize| {
        let [i, j, k] = [at % 24, at / 24 % 20, at / 480].map(|i| i as f64);
        i16::from((i - 12.0).powi(2) + (j - 10.0).powi(2) + (k - 8.0).powi(2) < 36.0)
    };
    let values = (0..dims.iter().product()).map(ball).collect();
    let volume = Volume { dims, values, ..Volume::oblique() };
    let image = read_bytes(&nifti1(&volume, Form::Sform, false), ImageFormat::Nifti, &ReadOptions::default())
        .unwrap();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for at in (0..image.grid.len()).filter(|&at| image.value(at) > 0.5) {
        let here = Vector3::from(image.grid.triple(at).map(|i| i as f64)).add_scalar(-0.5);
        for corner in 0..8 {
            let corner = Vector3::from([corner & 1, corner >> 1 & 1, corner >> 2].map(f64::from));
            let place = image.grid.position(&(here + corner));
            for axis in 0..3 {
                (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
            }
        }
    }
    let region = &image.regions(&|_| {}).unwrap()[0];
    for axis in 0..3 {
        assert!((region.low[axis] - low[axis]).abs() < 1e-12, "{region} {low:?}");
        assert!((region.high[axis] - high[axis]).abs() < 1e-12, "{region} {high:?}");
    }
}

/// Programs take one of the two: an image that has both says so where they differ.
#[test]
fn an_image_placed_twice_says_so() {
    let mut bytes = nifti1(&labelled(), Form::Sform, false);
    let notes = |bytes: &[u8]| read_bytes(bytes, ImageFormat::Nifti, &ReadOptions::default()).unwrap().notes;
    assert_eq!(notes(&bytes), Vec::<String>::new());
    let x = f32::from_le_bytes(bytes[268..272].try_into().unwrap());
    bytes[268..272].copy_from_slice(&(x + 12.5).to_le_bytes());
    let expected = "sform and qform place the image differently, by up to 12.5 mm: the sform is taken";
    assert_eq!(notes(&bytes), [expected]);
}

/// The labels of a group are one label with the name of the group, in every type of number.
#[test]
fn groups_of_labels_become_one() {
    let read = || {
        let bytes = nifti1(&labelled(), Form::Sform, true);
        read_bytes(&bytes, ImageFormat::Nifti, &ReadOptions::default()).unwrap()
    };
    let choices =
        |typed: &[&str]| -> Vec<LabelChoice> { typed.iter().map(|typed| typed.parse().unwrap()).collect() };
    let mut image = read();
    let before = image.labels().unwrap().labels;
    assert_eq!(image.choose(&choices(&["rest=3,1", "2"])), Ok(Choice::Labels(vec![3, 2])));
    let expected: Vec<i32> = before.iter().map(|&label| if label == 1 { 3 } else { label }).collect();
    assert_eq!(image.labels().unwrap().labels, expected);
    assert_eq!(image.names.get(3), Some("rest"));
    let error = |typed: &[&str]| read().choose(&choices(typed)).unwrap_err();
    assert_eq!(error(&["a=1-2", "b=2,3"]), LabelError::Repeated { label: 2 });
    assert!(matches!(error(&["a=1,9"]), LabelError::Absent { label: 9, .. }));
    assert!(matches!(error(&["a=0,1"]), LabelError::Background { .. }));
    assert!(matches!(error(&["a=7-9"]), LabelError::EmptyRange { .. }));
}

/// Layers of segments as 3D Slicer writes them: two numbers for each of the 2 × 2 × 1 voxels.
fn layered(values: &str, segments: &str) -> Result<Image, String> {
    let text = format!(
        "NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 2 2 1\n\
         space directions: none (-1,0,0) (0,-1,0) (0,0,2)\nkinds: list domain domain domain\nencoding: ascii\n\
         space origin: (0,0,0)\n{segments}\n{values}\n"
    );
    read_bytes(text.as_bytes(), ImageFormat::Nrrd, &ReadOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn layers_of_segments_become_one_image() {
    let segment = |number: u32, layer: u32, value: i32, name: &str| {
        format!(
            "Segment{number}_Layer:={layer}\nSegment{number}_Name:={name}\nSegment{number}_LabelValue:={value}\n"
        )
    };
    let labels = |image: &Image| image.labels().unwrap().labels;
    // Distinct values stay; the tumour, which comes later, lies in the liver.
    let segments = segment(1, 1, 7, "tumour") + &segment(0, 0, 5, "liver");
    let image = layered("5 0  5 7  0 7  0 0", &segments).unwrap();
    assert_eq!((image.grid.dims, labels(&image)), ([2, 2, 1], vec![5, 7, 7, 0]));
    assert_eq!((image.names.get(5), image.names.get(7)), (Some("liver"), Some("tumour")));
    assert_eq!(image.notes, ["segments overlap in 1 voxels, which belong to the later one"]);
    assert!((image.grid.spacing()[2] - 2e-3).abs() < 1e-12);
    // The same value in two layers: numbers from 1 on.
    let again = segment(0, 0, 1, "liver") + &segment(1, 1, 1, "tumour") + &segment(2, 0, 2, "vein");
    let image = layered("1 0  2 1  0 1  2 0", &again).unwrap();
    assert_eq!(labels(&image), [1, 3, 2, 3], "the vein comes after the tumour");
    assert_eq!(image.names.get(3), Some("vein"));
    assert!(image.notes[0].contains("share a value") && image.notes[1].contains("overlap in 1"));
    // A number of no segment is background; a note counts it.
    let image = layered("9 0  5 0  0 0  0 3", &segments).unwrap();
    assert_eq!(labels(&image), [0, 5, 0, 0]);
    assert_eq!(image.notes, ["2 values belong to no segment and were ignored"]);
}

#[test]
fn layers_without_segments_or_with_too_few_numbers_are_refused() {
    let message = layered("5 0 5 7 0 7 0 0", "").unwrap_err();
    assert!(message.contains("several values per voxel"), "{message}");
    let odd = "Segment0_LabelValue:=5\nSegment0_Layer:=-1\nSegmentx_Layer:=1\nSegment1_LabelValue:=many\n";
    assert_eq!(layered("5 0 5 0 0 0 0 0", odd).unwrap().labels().unwrap().labels, [0; 4]);
    let message = layered("5 0 5", "Segment0_LabelValue:=5\n").unwrap_err();
    assert!(message.contains("the voxels"), "{message}");
}

fn image(value: impl Fn(usize) -> i16, dims: [usize; 3]) -> Image {
    let values = (0..dims.iter().product()).map(value).collect();
    let bytes = nifti1(&Volume { dims, values, ..Volume::oblique() }, Form::Sform, false);
    read_bytes(&bytes, ImageFormat::Nifti, &ReadOptions::default()).unwrap()
}

#[test]
fn a_scan_is_no_label_image() {
    // Air around a patient of noise, as in a CT.
    let scan = image(
        |at| if at % 30 < 8 { -1024 } else { (at.wrapping_mul(2_654_435_761) >> 7) as i16 % 700 },
        [30, 30, 12],
    );
    let error = scan.labels().unwrap_err();
    assert!(matches!(error, LabelError::Grey { values: 500.., more: false, range: [-1024, _] }), "{error}");
    assert!(
        error.to_string().contains("not a label image") && error.to_string().contains("from -1024 to 69"),
        "{error}"
    );
    // Many labels of a few voxels each are labels.
    let atlas = image(|at| (at / 5) as i16, [30, 30, 12]);
    assert_eq!(atlas.labels().unwrap().present().len(), 2159);
}

#[test]
fn masks_become_one_image_in_which_the_last_counts() {
    let [first, second] =
        [0, 2].map(|from| image(move |at| i16::from((from..from + 4).contains(&(at % 10))), [10, 4, 3]));
    let masks = [(PathBuf::from("a/liver.nii.gz"), first), (PathBuf::from("tumour.nrrd"), second)];
    let both = Image::of_masks(&masks, None).unwrap();
    let regions = both.regions(&|_| {}).unwrap();
    let found: Vec<_> =
        regions.iter().map(|region| (region.label, region.voxels, region.name.as_deref().unwrap())).collect();
    assert_eq!(found, [(1, 24, "liver"), (2, 48, "tumour")]);
    assert!(both.notes[0].contains("overlap in 24 voxels"), "{:?}", both.notes);
    let labels = (PathBuf::from("seg.nii"), image(|at| (at % 4) as i16, [10, 4, 3]));
    let [mask, _] = masks;
    let masks = [mask, labels];
    let message = Image::of_masks(&masks, None).unwrap_err().to_string();
    assert!(message.contains("`seg.nii` is not a mask: it has the labels 1, 2, 3"), "{message}");
    assert_eq!(Image::of_masks(&masks, Some(3.0)).unwrap().regions(&|_| {}).unwrap()[0].label, 2);
    let other = image(|_| 1, [4, 10, 3]);
    let masks = [masks.into_iter().next().unwrap(), (PathBuf::from("other.nii"), other)];
    assert!(matches!(Image::of_masks(&masks, None), Err(LabelError::OtherVoxels { .. })));
}

#[test]
fn images_of_too_many_bytes_are_refused_before_they_are_read() {
    let options = ReadOptions { byte_limit: 239, ..ReadOptions::default() };
    for (bytes, format) in [
        (nifti1(&labelled(), Form::Sform, false), ImageFormat::Nifti),
        (nrrd(&labelled(), "gzip", false), ImageFormat::Nrrd),
        (nrrd(&labelled(), "ascii", false), ImageFormat::Nrrd),
        (metaimage(&labelled(), true, false, "LOCAL"), ImageFormat::MetaImage),
        (gipl(&labelled()), ImageFormat::Gipl),
    ] {
        let message = read_bytes(&bytes, format, &options).unwrap_err().to_string();
        assert!(message.contains("uncompressed, more than") && message.contains("crop"), "{message}");
        assert!(read_bytes(&bytes, format, &ReadOptions { byte_limit: 240, ..options.clone() }).is_ok());
    }
}

#[test]
#[cfg(unix)]
fn pipes_and_devices_are_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.nii");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let zero = folder.path().join("zero.nii.gz");
    std::os::unix::fs::symlink("/dev/zero", &zero).unwrap();
    for path in [&pipe, &zero] {
        let error = read(path, &ReadOptions::default()).unwrap_err();
        assert!(
            matches!(error, ImageError::Open { .. }) && error.to_string().contains("not a regular file"),
            "{error}"
        );
    }
    for (name, bytes) in [
        ("device.mhd", metaimage(&labelled(), false, false, "/dev/zero")),
        ("pipe.mhd", metaimage(&labelled(), false, false, "pipe.nii")),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let message = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("ElementDataFile") && message.contains("not a regular file"), "{message}");
    }
}

/// While images of more than 16 MB are read and cut, progress is reported, from nothing to the end and never
/// back.
#[test]
fn reading_and_cutting_a_large_image_tell_how_far_they_are() {
    let dims = [260, 260, 160];
    let label = |at: usize| i16::from((100..160).contains(&(at % 260)) && (40..100).contains(&(at / 67_600)));
    let values: Vec<i16> = (0..dims.iter().product()).map(label).collect();
    let volume = Volume { dims, values, ..Volume::oblique() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.nii.gz");
    fs::write(&path, gzip(&volume.nifti())).unwrap();
    let heard = std::cell::RefCell::new(Vec::new());
    let progress = |done: f64| heard.borrow_mut().push(done);
    let image = read_with(&path, &ReadOptions::default(), &progress).unwrap();
    let reading = heard.take();
    let cut = image.cut(&Choice::Labels(vec![1]), 1e-3, &progress).unwrap();
    let cutting = heard.take();
    println!("{reading:?} {cutting:?}");
    for steps in [&reading, &cutting] {
        assert!(steps.len() > 1 && steps.windows(2).all(|pair| pair[0] <= pair[1]), "{steps:?}");
        assert!(steps[0] > 0.0 && steps[0] < 1.0 && *steps.last().unwrap() == 1.0, "{steps:?}");
    }
    assert_eq!(cut.labels.grid.dims, [60, 260, 60]);
}

/// 760³ labels of one byte are 0.44 GB. Reading them from a gzip file and cutting a body out takes half as
/// much again at most.
#[test]
#[ignore = "half a GB of memory and ten seconds"]
fn a_large_packed_image_takes_little_more_memory_than_its_voxels() {
    let name = "labels::a_large_packed_image_takes_little_more_memory_than_its_voxels";
    let Some(before) = pliant_testing::PeakMemory::alone(name) else { return };
    let edge = 760_usize;
    let small = Volume { dims: [edge; 3], values: Vec::new(), ..Volume::oblique() };
    let mut header = nifti1(&small, Form::Sform, false);
    header.truncate(352);
    // One byte a voxel.
    header[70..74].copy_from_slice(&[2, 0, 8, 0]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.nii.gz");
    let mut file =
        flate2::write::GzEncoder::new(fs::File::create(&path).unwrap(), flate2::Compression::fast());
    file.write_all(&header).unwrap();
    for k in 0..edge {
        let inside = (300..400).contains(&k);
        let slice: Vec<u8> = (0..edge * edge)
            .map(|at| {
                u8::from(inside && (200..320).contains(&(at % edge)) && (100..300).contains(&(at / edge)))
            })
            .collect();
        file.write_all(&slice).unwrap();
    }
    file.finish().unwrap();
    let image = read_with(&path, &ReadOptions::default(), &|_| {}).unwrap();
    let cut = image.cut(&Choice::Labels(vec![1]), 1e-3, &|_| {}).unwrap();
    assert_eq!(cut.labels.grid.dims, [120, 200, 100]);
    before.assert_rise_below((1.5 * (edge * edge * edge) as f64 / 1024.0) as u64);
}
