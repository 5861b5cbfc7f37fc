//! Names, ranges, masks and units in `pliant labels`, `pliant mesh` and scenes of scans, and the replies.

use crate::support::{BLOCK, Said, Workshop};
#[allow(dead_code)]
use pliant_geometry::io;
use pliant_meshing::sphere;
use pliant_testing::image_files::{
    Form, Segments, Syntax, Volume, metaimage, nifti1, segmentation, structure_set,
};

/// Voxels of 2 mm along each side.
const SIDE: usize = 20;

/// Labels by the place of a voxel.
fn volume(label: impl Fn([usize; 3]) -> i16) -> Volume {
    let at = |n: usize| [n % SIDE, n / SIDE % SIDE, n / SIDE / SIDE];
    let axes = nalgebra::Matrix3::identity() * 2.0;
    let values = (0..SIDE.pow(3)).map(|n| label(at(n))).collect();
    Volume { dims: [SIDE; 3], origin: nalgebra::Vector3::zeros(), axes, values }
}

/// A box of label 1 with a core of label 2, and one of label 3 that the head side of the image cuts off.
fn organ() -> Volume {
    volume(|[i, j, k]| match [i, j, k] {
        [6..=9, 6..=9, 6..=9] => 2,
        [3..=12, 3..=12, 3..=12] => 1,
        [14..=17, 3..=12, 8..=19] => 3,
        _ => 0,
    })
}

fn workshop() -> Workshop {
    let workshop = Workshop::new(BLOCK);
    workshop.write("seg.nii", nifti1(&organ(), Form::Sform, false));
    workshop.write(
        "seg.dcm",
        segmentation(&organ(), Segments::Bits, &["Liver", "tumour", "heart"], Syntax::Explicit),
    );
    workshop
}

/// `pliant mesh … --edge 8mm -o out.vtu --json`
fn mesh(workshop: &Workshop, more: &[&str]) -> Said {
    workshop.pliant(&[&["mesh", "--edge", "8mm", "-o", "out.vtu", "--json"], more].concat())
}

#[track_caller]
fn refused(output: &Said, says: &[&str]) {
    assert_eq!(output.code, 2, "{}{}", output.err, output.out);
    for part in says {
        assert!(output.words().contains(part), "no `{part}` in: {}", output.err);
    }
}

/// Labels of the materials of a mesh that was made.
#[track_caller]
fn materials(output: &Said) -> Vec<i64> {
    assert_eq!(output.code, 0, "{}", output.err);
    output.json()["materials"].as_array().unwrap().iter().map(|one| one["label"].as_i64().unwrap()).collect()
}

#[test]
fn labels_are_listed_with_names_and_where_the_image_cuts_them_off() {
    let workshop = workshop();
    let output = workshop.pliant(&["labels", "seg.dcm"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for part in [
        "DICOM segmentation",
        "label 1 (Liver): 936 voxels",
        "label 2 (tumour): 64 voxels",
        "label 3 (heart)",
    ] {
        assert!(output.out.contains(part), "no `{part}` in: {}", output.out);
    }
    let output = workshop.pliant(&["labels", "seg.nii"]);
    assert!(output.out.contains("at the border of the image: 40 voxels on the head side"), "{}", output.out);
    assert_eq!(output.out.matches("border").count(), 1, "{}", output.out);
    let json = workshop.pliant(&["labels", "seg.dcm", "--json"]).json();
    assert_eq!(
        (&json["labels"][1]["name"], &json["labels"][1]["border"]),
        (&"tumour".into(), &serde_json::json!({}))
    );
    workshop
        .write("names.txt", "# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n 1 255 0 0 1 1 1 \"right lobe\"\n");
    let output = workshop.pliant(&["labels", "seg.nii", "--names", "names.txt"]);
    assert!(output.out.contains("label 1 (right lobe)"), "{}", output.out);
    let output = workshop.pliant(&["labels", "seg.nii", "--names", "totalsegmentator"]);
    assert!(output.out.contains("label 3 (kidney_left)"), "{}", output.out);
    refused(&workshop.pliant(&["labels", "seg.nii", "--names", "seg.nii"]), &["not a table of names"]);
}

#[test]
fn a_label_is_chosen_by_name_and_range() {
    let workshop = workshop();
    let output = mesh(&workshop, &["seg.dcm", "--label", "liver", "--label", "Tumour"]);
    assert_eq!(materials(&output), [1, 2]);
    assert_eq!(output.json()["image"]["names"], serde_json::json!({ "1": "Liver", "2": "tumour" }));
    assert_eq!(materials(&mesh(&workshop, &["seg.nii", "--label", "1-2"])), [1, 2]);
    assert_eq!(
        materials(&mesh(&workshop, &["seg.nii", "--names", "totalsegmentator", "--label", "kidney_right"])),
        [2]
    );
    refused(&mesh(&workshop, &["seg.dcm", "--label", "lung"]), &["no label is named `lung`", "Liver (1)"]);
    refused(&mesh(&workshop, &["seg.nii", "--label", "liver"]), &["have no names", "--names TABLE"]);
    refused(
        &mesh(&workshop, &["seg.nii", "--label", "7-9"]),
        &["no voxel has a label in 7-9; the image has 1, 2, 3"],
    );
}

#[test]
fn an_organ_that_the_image_cuts_off_is_warned_of() {
    let workshop = workshop();
    let output = mesh(&workshop, &["seg.nii", "--label", "3"]);
    assert_eq!(materials(&output), [3]);
    assert!(
        output.err.contains("warning: label 3 lies at the border of the image (40 voxels on the head side)"),
        "{}",
        output.err
    );
    let output = mesh(&workshop, &["seg.nii", "--label", "1"]);
    assert!(!output.err.contains("border"), "{}", output.err);
}

#[test]
fn masks_are_one_image_of_labels() {
    let workshop = workshop();
    for (name, label) in [("liver.nii", 1), ("tumour.nii", 2)] {
        let mask = Volume {
            values: organ().values.iter().map(|&voxel| i16::from(voxel == label)).collect(),
            ..organ()
        };
        workshop.write(name, nifti1(&mask, Form::Sform, false));
    }
    let output = mesh(&workshop, &["liver.nii", "tumour.nii"]);
    assert_eq!(materials(&output), [1, 2]);
    let expected = materials(&mesh(&workshop, &["seg.nii", "--label", "1-2"]));
    assert_eq!(materials(&output), expected);
    assert_eq!(materials(&mesh(&workshop, &["liver.nii", "tumour.nii", "--label", "tumour"])), [2]);
    let output = workshop.pliant(&["labels", "liver.nii", "tumour.nii"]);
    assert!(output.out.contains("label 2 (tumour): 64 voxels"), "{}", output.out);
    refused(
        &mesh(&workshop, &["liver.nii", "seg.nii"]),
        &["`seg.nii` is not a mask: it has the labels 1, 2, 3"],
    );
}

#[test]
fn what_would_be_ignored_or_is_no_label_image_is_refused() {
    let workshop = workshop();
    refused(
        &mesh(&workshop, &["seg.nii", "--add", "seg.nii", "--label", "1"]),
        &["`--add` needs `--threshold`", "labels are not"],
    );
    refused(&mesh(&workshop, &["seg.nii", "--label", "1", "--threshold", "2"]), &["both choose voxels"]);
    let scan = volume(
        |[i, j, k]| if i < 5 { -1024 } else { ((i * 7919 + j * 104_729 + k * 1_299_709) % 901) as i16 },
    );
    workshop.write("ct.mha", metaimage(&scan, false, false, "LOCAL"));
    for output in [workshop.pliant(&["labels", "ct.mha"]), mesh(&workshop, &["ct.mha", "--label", "7"])] {
        refused(&output, &["this is not a label image", "values from -1024 to 900", "--threshold VALUE"]);
    }
    workshop.write("rtss.dcm", structure_set());
    refused(&workshop.pliant(&["labels", "rtss.dcm"]), &["RTSTRUCT", "contours", "SlicerRT"]);
}

#[test]
fn a_surface_in_millimetres_is_not_taken_for_one_in_metres() {
    let workshop = workshop();
    let ball = sphere(60.0, 4, 100_000).expect("a sphere");
    io::write(&workshop.path("ball.stl"), &ball).expect("the mesh is written");
    let plain = ["ball.stl", "--edge", "8"];
    let output = workshop.pliant(&[&["mesh"], &plain[..], &["-o", "out.vtu"]].concat());
    refused(
        &output,
        &["measures 207.8", "probably millimetres", "--scale 0.001", "`--scale 1` if it is in metres"],
    );
    assert!(!workshop.path("out.vtu").exists());
    let output = mesh(&workshop, &["ball.stl", "--scale", "0.001"]);
    assert!(output.code == 0 && !output.err.contains("larger than"), "{}", output.err);
    let output = workshop.pliant(&[&["mesh"], &plain[..], &["--scale", "1", "-o", "out.vtu"]].concat());
    assert!(output.code == 0 && output.err.contains("larger than any organ"), "{}", output.err);
}

/// A tumour of 4 mm in millimetres measures as much as a machine in metres: both are possible, and the user
/// is asked.
#[test]
fn a_small_organ_in_millimetres_is_noted() {
    let workshop = workshop();
    io::write(&workshop.path("tumour.stl"), &sphere(2.0, 3, 100_000).expect("a sphere")).expect("written");
    let asked = ["measures 6.928 m across, larger than a person", "may be millimetres", "`--scale 0.001`"];
    let made = ["mesh", "tumour.stl", "--edge", "0.8", "-o", "out.vtu"];
    let output = workshop.pliant(&made);
    assert!(output.code == 0 && asked.iter().all(|piece| output.words().contains(piece)), "{}", output.err);
    let output = workshop.pliant(&[&made[..], &["--scale", "1"]].concat());
    assert!(output.code == 0 && !output.err.contains("larger than"), "{}", output.err);
    let output = workshop.pliant(&["info", "tumour.stl"]);
    assert!(output.out.contains("may be millimetres or centimetres"), "{}", output.out);
}

/// Files of other programs are named, with a remedy; a scene in XML is one mistake, not five of TOML.
#[test]
fn files_of_other_programs_are_named() {
    let workshop = workshop();
    for (name, text, says) in [
        ("model.inp", "*NODE\n1, 0, 0, 0\n", ["an input deck of Abaqus", "meshio convert"]),
        ("model.feb", "<febio_spec version=\"4.0\">\n", ["a model of FEBio", "VTK"]),
        ("model.scn", "<Node name=\"root\">\n", ["a scene of SOFA", "`filename`"]),
    ] {
        workshop.write(name, text);
        for output in [workshop.pliant(&["info", name]), mesh(&workshop, &[name, "--label", "1"])] {
            refused(&output, &says);
        }
    }
    let scenes = [
        (
            "a.feb",
            "<?xml version=\"1.0\"?>\n<febio_spec version=\"4.0\">\n</febio_spec>\n",
            "a model of FEBio",
        ),
        ("a.scn", "<Node name=\"root\" dt=\"0.01\">\n</Node>\n", "a scene of SOFA"),
    ];
    for (name, text, says) in scenes {
        workshop.write(name, text);
        let output = workshop.pliant(&["check", name]);
        refused(&output, &[says, "not a scene in TOML"]);
        assert!(!output.err.contains("mistakes"), "{}", output.err);
    }
}

/// A mesh is turned about the origin before it is shifted: half a turn about z takes LPS to RAS.
#[test]
fn a_mesh_of_a_scene_takes_a_turn() {
    let whole = "{ file = \"ball.stl\", as = \"tets\", edge = 0.008, scale = 0.001, at = [0.1, 0, 0]";
    let centre = |mesh: &str| {
        let workshop = scene(mesh);
        let mut ball = sphere(60.0, 3, 100_000).expect("a sphere");
        ball.points.iter_mut().for_each(|point| *point += nalgebra::Vector3::new(70.0, -40.0, 20.0));
        io::write(&workshop.path("case/ball.stl"), &ball).expect("the mesh is written");
        let meshed =
            workshop.pliant(&["mesh", "case/ball.stl", "--scale", "0.001", "--edge", "8mm", "-o", "x.vtu"]);
        assert_eq!(meshed.code, 0, "{}", meshed.err);
        let output = "[output.fields]\ntype = \"vtu\"\nevery = 0.001\n";
        let text = workshop.read("case/scene.toml") + output;
        workshop.write("case/scene.toml", text);
        let ran = workshop.pliant(&["run", "case", "--out", "out"]);
        assert_eq!(ran.code, 0, "{}", ran.err);
        let (low, high) = io::read(&workshop.path("out/fields/000000.vtu")).unwrap().mesh.bounds().unwrap();
        (low + high) / 2.0
    };
    for (turn, x, y) in [("", 0.17, -0.04), (", turn = [0, 0, 3.141592653589793]", 0.03, 0.04)] {
        let found = centre(&format!("{whole}{turn} }}"));
        assert!((found - nalgebra::Vector3::new(x, y, 0.02)).norm() < 1e-3, "{turn}: {found}");
    }
}

/// A scene of one body with this mesh.
fn scene(mesh: &str) -> Workshop {
    let text = format!(
        "[scene]\nuntil = 0.001\n[law.tissue]\ntype = \"neo-hookean\"\nyoung-modulus = 3e3\npoisson-ratio = 0.45\n\
         [body.organ]\nmesh = {mesh}\nlaw = \"tissue\"\ndensity = 1000\n"
    );
    let workshop = Workshop::new(&text);
    workshop.write(
        "case/seg.dcm",
        segmentation(&organ(), Segments::Bits, &["Liver", "tumour", "heart"], Syntax::Explicit),
    );
    workshop.write("case/seg.nii", nifti1(&organ(), Form::Sform, false));
    for (name, label) in [("liver.nii", 1), ("tumour.nii", 2)] {
        let mask = Volume {
            values: organ().values.iter().map(|&voxel| i16::from(voxel == label)).collect(),
            ..organ()
        };
        workshop.write(&format!("case/{name}"), nifti1(&mask, Form::Sform, false));
    }
    let ball = sphere(60.0, 3, 100_000).expect("a sphere");
    io::write(&workshop.path("case/ball.stl"), &ball).expect("the mesh is written");
    workshop
}

#[test]
fn a_scene_says_labels_by_name_and_masks_and_is_asked_about_units() {
    for (mesh, code, says) in [
        ("{ image = \"seg.dcm\", label = \"liver\", edge = 0.008 }", 0, "label 1 (Liver), tets"),
        (
            "{ image = \"seg.dcm\", labels = [\"tumour\", \"1-1\"], edge = 0.008 }",
            0,
            "label 2 (tumour), 1 (Liver)",
        ),
        ("{ masks = [\"liver.nii\", \"tumour.nii\"], edge = 0.008 }", 0, "label 1 (liver), 2 (tumour)"),
        ("{ image = \"seg.nii\", label = 3, edge = 0.008 }", 0, "40 voxels on the head side"),
        ("{ image = \"seg.dcm\", label = \"lung\", edge = 0.008 }", 2, "no label is named `lung`"),
        ("{ image = \"seg.dcm\", label = 1, names = \"none.txt\", edge = 0.008 }", 2, "cannot open"),
        ("{ file = \"ball.stl\", as = \"tets\", edge = 8.0 }", 2, "probably millimetres"),
        ("{ file = \"ball.stl\", as = \"tets\", edge = 0.008, scale = 0.001 }", 0, "its interior"),
    ] {
        let output = scene(mesh).pliant(&["check", "case"]);
        assert_eq!(output.code, code, "{mesh}: {}", output.err);
        let printed = format!("{} {}", output.words(), output.out);
        assert!(printed.contains(says), "{mesh}: no `{says}` in: {printed}");
    }
}

#[test]
#[cfg(unix)]
fn pipes_are_refused_at_once() {
    let workshop = workshop();
    for name in ["pipe.stl", "pipe.nii"] {
        let made = std::process::Command::new("mkfifo").arg(workshop.path(name)).status();
        assert!(made.is_ok_and(|status| status.success()));
        refused(&mesh(&workshop, &[name, "--label", "1"]), &["not a regular file"]);
    }
}
