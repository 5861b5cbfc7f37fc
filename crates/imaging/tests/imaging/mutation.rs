//! Images with bytes changed, removed, or truncated at random with a fixed seed, and a corpus of earlier
//! problem files. Each gives an error or an image, never a panic, and no memory beyond the content of the
//! file.

use std::fs;
use std::path::Path;

use pliant_imaging::{ImageFormat, ReadOptions, read_bytes};
use pliant_testing::{PeakMemory, Random};

use pliant_testing::image_files::*;

/// One file of each format and variant.
fn seeds() -> Vec<(ImageFormat, Vec<u8>)> {
    let volume = Volume::oblique();
    let mut seeds = Vec::new();
    for big in [false, true] {
        seeds.extend([Form::Sform, Form::Qform].map(|form| (ImageFormat::Nifti, nifti1(&volume, form, big))));
        seeds.push((ImageFormat::Nifti, nifti2(&volume, big)));
    }
    seeds.push((ImageFormat::Nifti, gzip(&nifti1(&volume, Form::Sform, false))));
    seeds
        .extend(["raw", "gzip", "ascii"].map(|encoding| (ImageFormat::Nrrd, nrrd(&volume, encoding, false))));
    seeds.extend(
        [false, true].map(|packed| (ImageFormat::MetaImage, metaimage(&volume, packed, false, "LOCAL"))),
    );
    seeds.push((ImageFormat::Gipl, gipl(&volume)));
    for syntax in [Syntax::Implicit, Syntax::Explicit, Syntax::Deflated, Syntax::BigEndian] {
        seeds.push((ImageFormat::Dicom, dicom(&volume, 1, syntax, "1.2")));
    }
    let labels =
        Volume { values: volume.values.iter().map(|value| value.rem_euclid(3)).collect(), ..volume.clone() };
    for kind in [Segments::Bits, Segments::Fractions, Segments::Labels] {
        seeds.push((ImageFormat::Dicom, segmentation(&labels, kind, &["a", "b"], Syntax::Explicit)));
    }
    seeds.push((ImageFormat::Dicom, segmentation(&labels, Segments::Bits, &["a", "b"], Syntax::Implicit)));
    seeds
}

#[test]
fn mutated_images_give_an_image_or_an_error() {
    let Some(before) = PeakMemory::alone("mutation::mutated_images_give_an_image_or_an_error") else {
        return;
    };
    let mut noise = Random::new(20_260_101);
    let mut outcomes = [0; 2];
    for (format, seed) in seeds() {
        for _ in 0..2000 {
            let bytes = noise.damaged(&seed);
            match read_bytes(&bytes, format, &ReadOptions::default()) {
                Ok(image) => {
                    outcomes[0] += 1;
                    assert!(image.grid.len() <= 60 * 600, "{:?}", image.grid);
                    assert!(image.grid.axes.determinant().is_finite());
                    let last = image.value(image.grid.len() - 1);
                    let _ = (last, image.labels().map(|labels| labels.regions()));
                }
                Err(error) => {
                    outcomes[1] += 1;
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
    }
    println!("{} images, {} errors", outcomes[0], outcomes[1]);
    assert!(outcomes[0] > 1000 && outcomes[1] > 1000);
    // The files are below 4 KiB.
    before.assert_rise_below(8 << 10);
}

/// Names of the corpus are FORMAT-what.bin.
#[test]
fn the_corpus_gives_errors() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let format = match name.split('-').next() {
            Some("nifti") => ImageFormat::Nifti,
            Some("nrrd") => ImageFormat::Nrrd,
            Some("meta") => ImageFormat::MetaImage,
            Some("gipl") => ImageFormat::Gipl,
            Some("dicom") => ImageFormat::Dicom,
            _ => continue,
        };
        count += 1;
        let error = read_bytes(&fs::read(&path).unwrap(), format, &ReadOptions::default());
        println!("{name}: {}", error.as_ref().err().map_or("read".to_owned(), ToString::to_string));
        assert!(error.is_err(), "{name}");
    }
    assert!(count >= 20, "{count}");
}

/// Regenerates the corpus: `cargo test -p pliant-imaging write_the_corpus -- --ignored`.
#[test]
#[ignore = "writes files"]
fn write_the_corpus() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    fs::create_dir_all(&folder).unwrap();
    let volume = Volume::oblique();
    let save = |name: &str, bytes: &[u8]| fs::write(folder.join(format!("{name}.bin")), bytes).unwrap();
    let with = |mut bytes: Vec<u8>, at: usize, new: &[u8]| {
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let nii = nifti1(&volume, Form::Qform, false);
    save("nifti-empty", b"");
    save("nifti-truncated-gzip", &gzip(&nii)[..90]);
    save("nifti-gzip-of-nothing", &gzip(b""));
    save("nifti-negative-pixdim", &with(nii.clone(), 80, &(-1_f32).to_le_bytes()));
    save("nifti-mixed-endian", &with(nifti1(&volume, Form::Sform, true), 0, &348_i32.to_le_bytes()));
    save("nifti-singular-sform", &with(nifti1(&volume, Form::Sform, false), 280, &[0; 48]));
    save("nifti-nan-sform", &with(nifti1(&volume, Form::Sform, false), 280, &f32::NAN.to_le_bytes()));
    save("nifti-huge", &with(nii.clone(), 42, &[0xFF, 0x7F, 0xFF, 0x7F, 0xFF, 0x7F]));
    save("nifti-offset-nan", &with(nii.clone(), 108, &f32::NAN.to_le_bytes()));
    save("nifti-2-huge", &with(nifti2(&volume, false), 24, &[0x7F; 24]));
    save("nrrd-no-data", nrrd_header(&volume, "raw", false).as_bytes());
    save("nrrd-huge", &nrrd(&Volume { dims: [usize::MAX >> 1, 9, 9], ..volume.clone() }, "gzip", false));
    save(
        "nrrd-bad-vectors",
        &String::from_utf8_lossy(&nrrd(&volume, "ascii", false)).replace(')', "").into_bytes(),
    );
    save("nrrd-no-newline", b"NRRD0004");
    save(
        "nrrd-gzip-is-raw",
        &String::from_utf8_lossy(&nrrd(&volume, "ascii", false)).replace("ascii", "gzip").into_bytes(),
    );
    save("meta-cut-header", &metaimage(&volume, false, false, "LOCAL")[..200]);
    save("meta-other-file", &metaimage(&volume, false, false, "/dev/zero"));
    save(
        "meta-zlib-is-raw",
        &String::from_utf8_lossy(&metaimage(&volume, false, false, "LOCAL"))
            .replace("Data = False", "Data = True")
            .into_bytes(),
    );
    save("gipl-little-endian", &with(gipl(&volume), 252, &0xEFFF_E9B0_u32.to_le_bytes()));
    save("gipl-huge", &with(gipl(&volume), 0, &[0xFF; 6]));
    save("gipl-nan-spacing", &with(gipl(&volume), 10, &f32::NAN.to_be_bytes()));
    let slice = dicom(&volume, 0, Syntax::Explicit, "1");
    save("dicom-cut", &slice[..300]);
    // An element that announces 4 GiB.
    save(
        "dicom-long-element",
        &[&slice[..slice.len() - 52], b"\xE0\x7F\x08\x00OB\0\0\xF0\xFF\xFF\xFF"].concat(),
    );
    save("dicom-deep", &[&slice[..160], &b"\x08\0\x40\x11SQ\0\0\xFF\xFF\xFF\xFF".repeat(100)[..]].concat());
    let labels =
        Volume { values: volume.values.iter().map(|value| value.rem_euclid(3)).collect(), ..volume.clone() };
    let seg = segmentation(&labels, Segments::Bits, &["a", "b"], Syntax::Explicit);
    save("dicom-contours", &structure_set());
    save("dicom-seg-cut", &seg[..seg.len() - 30]);
    let frames = seg.windows(4).position(|tag| tag == [0x28, 0, 8, 0]).expect("NumberOfFrames");
    save("dicom-seg-frames", &with(seg.clone(), frames + 8, b"9"));
    let segment = seg.windows(4).position(|tag| tag == [0x62, 0, 0x0B, 0]).expect("ReferencedSegmentNumber");
    save("dicom-seg-zero", &with(seg.clone(), segment + 8, &[0, 0]));
    save("dicom-deflated-cut", &dicom(&volume, 0, Syntax::Deflated, "1")[..250]);
}
