//! Bad images: each gives an error with the problem, its position and a remedy.

use std::fs;

use pliant_imaging::{ImageError, ImageFormat, ImageProblem, ReadOptions, read, read_bytes};

use pliant_testing::image_files::*;

fn error(bytes: &[u8], format: ImageFormat) -> String {
    read_bytes(bytes, format, &ReadOptions::default()).expect_err("the image is bad").to_string()
}

/// Returns the error of a NIfTI file after some bytes of a good one are replaced.
fn nifti_with(at: usize, bytes: &[u8]) -> String {
    let mut file = nifti1(&Volume::oblique(), Form::Qform, false);
    file[at..at + bytes.len()].copy_from_slice(bytes);
    error(&file, ImageFormat::Nifti)
}

fn says(error: &str, parts: &[&str]) {
    println!("{error}");
    for part in parts {
        assert!(error.contains(part), "`{error}` lacks `{part}`");
    }
}

#[test]
fn a_file_that_is_no_image_is_named_with_the_formats_that_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.txt");
    fs::write(&path, "dear reader").unwrap();
    says(
        &read(&path, &ReadOptions::default()).unwrap_err().to_string(),
        &["notes.txt` is not a supported image", "DICOM"],
    );
    let missing = read(&folder.path().join("none.nii"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(missing, ImageError::Open { .. }));
    let named = folder.path().join("notes.nii.gz");
    fs::write(&named, "dear reader").unwrap();
    says(
        &read(&named, &ReadOptions::default()).unwrap_err().to_string(),
        &["the file ends while reading the header"],
    );
    says(
        &read(folder.path(), &ReadOptions::default()).unwrap_err().to_string(),
        &["no DICOM slice among 2 files"],
    );
}

#[test]
fn truncated_files_say_how_much_is_missing() {
    let whole = nifti1(&Volume::oblique(), Form::Sform, false);
    says(&error(&whole[..400], ImageFormat::Nifti), &["byte 352", "120 bytes are needed, 48 exist"]);
    let packed = gzip(&whole);
    says(
        &error(&packed[..packed.len() / 2], ImageFormat::Nifti),
        &["cannot be decompressed after", "truncated or damaged"],
    );
    // Damaged in the middle: the checksum or the decompression fails.
    let mut damaged = packed.clone();
    let middle = packed.len() - 20;
    damaged[middle] ^= 0x55;
    let _ = read_bytes(&damaged, ImageFormat::Nifti, &ReadOptions::default());
    let volume = Volume::oblique();
    for file in [nrrd(&volume, "raw", false), metaimage(&volume, false, false, "LOCAL")] {
        let format = if file.starts_with(b"NRRD") { ImageFormat::Nrrd } else { ImageFormat::MetaImage };
        says(&error(&file[..file.len() - 7], format), &["120 bytes are needed, 113 exist"]);
    }
    says(&error(&gipl(&volume)[..256], ImageFormat::Gipl), &["120 bytes are needed, 0 exist"]);
    let ascii = nrrd(&volume, "ascii", false);
    says(&error(&ascii[..ascii.len() - 9], ImageFormat::Nrrd), &["60 bytes are needed"]);
    let slice = dicom(&volume, 0, Syntax::Explicit, "1");
    says(
        &error(&slice[..slice.len() - 3], ImageFormat::Dicom),
        &["the pixels", "40 bytes are needed, 37 exist"],
    );
}

#[test]
fn a_wrong_byte_order_is_found() {
    let mut mixed = nifti1(&Volume::oblique(), Form::Sform, true);
    mixed[..4].copy_from_slice(&348_i32.to_le_bytes());
    says(&error(&mixed, ImageFormat::Nifti), &["dim[0]", "mixes two byte orders"]);
    let mut little = gipl(&Volume::oblique());
    little[252..].iter_mut().take(4).zip(0xEFFF_E9B0_u32.to_le_bytes()).for_each(|(to, from)| *to = from);
    says(&error(&little, ImageFormat::Gipl), &["byte 252", "little-endian"]);
}

#[test]
fn numbers_that_cannot_be_are_named() {
    says(
        &nifti_with(80, &(-1.5_f32).to_le_bytes()),
        &["`pixdim` is `[-1.5, 1.25, 2.5]`", "must be positive"],
    );
    says(&nifti_with(84, &f32::NAN.to_le_bytes()), &["pixdim", "NaN"]);
    says(&nifti_with(256, &5_f32.to_le_bytes()), &["quatern", "at most 1"]);
    says(&nifti_with(70, &128_i16.to_le_bytes()), &["byte 70", "datatype 128", "convert"]);
    says(&nifti_with(70, &777_i16.to_le_bytes()), &["`datatype` is `777`"]);
    says(&nifti_with(72, &8_i16.to_le_bytes()), &["`bitpix` is `8`"]);
    says(&nifti_with(108, &300_f32.to_le_bytes()), &["`vox_offset` is `300`"]);
    says(&nifti_with(42, &(-2_i16).to_le_bytes()), &["`dim` is `[-2,"]);
    says(&nifti_with(42, &[0; 2]), &["`dim` is `[0,"]);
    says(&nifti_with(344, b"abc\0"), &["byte 344", "not NIfTI"]);
    says(&nifti_with(344, &[0; 4]), &["ANALYZE 7.5"]);
    says(&nifti_with(0, &[1; 4]), &["its first number is 16843009"]);
    let mut four = nifti1(&Volume::oblique(), Form::Sform, false);
    four[40] = 4;
    four[48] = 2;
    says(&error(&four, ImageFormat::Nifti), &["an image of 2 volumes"]);
}

#[test]
fn steps_that_span_no_volume_are_refused() {
    let mut file = nifti1(&Volume::oblique(), Form::Sform, false);
    file[280..328].fill(0);
    says(&error(&file, ImageFormat::Nifti), &["span no volume", "orientation"]);
    let mut flat = Volume::oblique();
    let first = flat.axes.column(0).into_owned();
    flat.axes.set_column(1, &first);
    says(&error(&nrrd(&flat, "raw", false), ImageFormat::Nrrd), &["line 7", "span no volume"]);
    says(
        &error(&metaimage(&flat, false, false, "LOCAL"), ImageFormat::MetaImage),
        &["line 6", "span no volume"],
    );
}

/// Announced sizes are held against the limit and the bytes that are there.
#[test]
fn absurd_sizes_are_refused_before_memory_is_taken() {
    let mut file = nifti1(&Volume::oblique(), Form::Sform, false);
    for at in [42, 44, 46] {
        file[at..at + 2].copy_from_slice(&i16::MAX.to_le_bytes());
    }
    says(
        &error(&file, ImageFormat::Nifti),
        &["35181150961663 voxels, more than the 536870912 allowed", "crop"],
    );
    let mut file = nifti2(&Volume::oblique(), false);
    for at in [24, 32, 40] {
        file[at..at + 8].copy_from_slice(&i64::MAX.to_le_bytes());
    }
    says(&error(&file, ImageFormat::Nifti), &["18446744073709551615 voxels"]);
    let volume = Volume { dims: [1 << 20, 1 << 20, 1 << 20], ..Volume::oblique() };
    says(&error(&nrrd(&volume, "gzip", false), ImageFormat::Nrrd), &["line 6", "voxels, more than"]);
    says(
        &error(&metaimage(&volume, true, false, "LOCAL"), ImageFormat::MetaImage),
        &["line 10", "voxels, more than"],
    );
    // Within the limit, but not in the file: 1 GiB is announced.
    let volume = Volume { dims: [1 << 13, 1 << 8, 1 << 8], ..Volume::oblique() };
    let announced = &(1_u64 << 30).to_string();
    says(&error(&nrrd(&volume, "raw", false), ImageFormat::Nrrd), &[announced, "120 exist"]);
}

#[test]
fn text_headers_name_the_line() {
    let volume = Volume::oblique();
    let changed = |from: &str, to: &str| {
        let text = String::from_utf8_lossy(&nrrd(&volume, "ascii", false)).replace(from, to);
        error(text.as_bytes(), ImageFormat::Nrrd)
    };
    says(&changed("type: short", "type: block"), &["line 3", "`type` is `block`"]);
    says(&changed("sizes: 5 4 3", "sizes: 5 4"), &["line 6", "one size for each"]);
    says(&changed("encoding: ascii", "encoding: bzip2"), &["line 10", "gzip"]);
    says(&changed("space: left-posterior-superior", "space: mars"), &["line 5", "`space` is `mars`"]);
    says(&changed("-863 ", "many "), &["`a voxel` is `many`"]);
    says(&changed("NRRD0004", "NRRD4"), &["line 1", "not NRRD"]);
    says(&changed("dimension: 3\n", ""), &["no `dimension`"]);
    says(&changed("(", "["), &["line 7", "vectors of three numbers"]);
    let changed = |from: &str, to: &str| {
        let text = String::from_utf8_lossy(&metaimage(&volume, false, false, "LOCAL")).replace(from, to);
        error(text.as_bytes(), ImageFormat::MetaImage)
    };
    says(&changed("ElementSpacing = 0", "ElementSpacing = -0"), &["line 9", "positive"]);
    says(&changed("MET_SHORT", "MET_OTHER"), &["line 11", "MET_OTHER"]);
    says(&changed("LOCAL", "LIST"), &["line 12", "single .mha"]);
    says(&changed("LOCAL", "voxels.raw"), &["data in another file"]);
    says(&changed("NDims = 3", "NDims = 4"), &["line 2", "extract one volume"]);
    says(
        &error(b"ObjectType = Image\nNDims = 3\n", ImageFormat::MetaImage),
        &["line 2", "no `ElementDataFile`"],
    );
    says(&error(b"ObjectType = Image\nand so on", ImageFormat::MetaImage), &["line 2", "not `Key = Value`"]);
}

#[test]
fn a_series_must_be_whole_and_one() {
    let volume = Volume { dims: [5, 2, 6], ..Volume::oblique() };
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, k: usize, volume: &Volume| {
        fs::write(folder.path().join(name), dicom(volume, k, Syntax::Explicit, "1")).unwrap();
    };
    let fails = || match read(folder.path(), &ReadOptions::default()) {
        Err(ImageError::Content { problem, .. }) => *problem,
        other => panic!("{other:?}"),
    };
    for k in [0, 1, 2, 4, 5] {
        put(&format!("{k}"), k, &volume);
    }
    let ImageProblem::MissingSlices { before, after, gap, expected } = fails() else {
        panic!("a slice is missing")
    };
    // The axis of slices points against the normal of the rows and columns.
    assert_eq!((after.as_str(), before.as_str()), ("2", "4"));
    assert!((gap - 5.0).abs() < 1e-6 && (expected - 2.5).abs() < 1e-6);
    put("3", 3, &volume);
    assert!(read(folder.path(), &ReadOptions::default()).is_ok());
    put("3b", 3, &volume);
    says(&fails().to_string(), &["`3` and `3b` lie at the same position"]);
    fs::remove_file(folder.path().join("3b")).unwrap();
    put("5", 5, &Volume { dims: [2, 5, 6], ..volume.clone() });
    says(&fails().to_string(), &["`5` has size [2, 5], the first slice [5, 2]"]);
    let mut turned = volume.clone();
    turned.axes.swap_columns(0, 1);
    put("5", 5, &turned);
    says(&fails().to_string(), &["`5` has row step"]);
}

#[test]
fn compressed_slices_are_refused_with_the_tool_that_helps() {
    let text = dicom(&Volume::oblique(), 0, Syntax::Explicit, "1");
    let at = text.windows(19).position(|w| w == b"1.2.840.10008.1.2.1").unwrap();
    let mut packed = text.clone();
    packed[at + 17..at + 19].copy_from_slice(b".5");
    says(&error(&packed, ImageFormat::Dicom), &["transfer syntax 1.2.840.10008.1.2.5", "gdcmconv"]);
}
