//! Labels and meshes of segmented images, through the real binary. The images are
//! small and written here; one of a patient is used where `PLIANT_DATA` names a folder that has it.

use std::path::Path;

use pliant_geometry::io;
use pliant_testing::image_files::{Form, Volume, nifti1};
use serde_json::Value;

use crate::support::{FROM_IMAGE, Said, Workshop, changed};

fn with_image() -> Workshop {
    let workshop = Workshop::new(FROM_IMAGE);
    workshop.write("case/seg.nii.gz", Volume::ball_with_a_core().packed());
    workshop
}

/// Runs `pliant mesh case/seg.nii.gz …`.
fn mesh(workshop: &Workshop, more: &[&str]) -> Said {
    workshop.pliant(&[&["mesh", "case/seg.nii.gz"], more].concat())
}

fn close(value: &Value, expected: f64, within: f64) -> bool {
    value.as_f64().is_some_and(|value| (value - expected).abs() <= within * expected.abs())
}

/// Tissue, a vessel and a capsule from an image: a scene that is checked and runs.
#[test]
fn an_image_becomes_a_scene_with_walls_and_ties() {
    let workshop = with_image();
    let more =
        ["--label", "5", "--vessels", "8=0.5mm", "--capsule", "0.1mm", "--edge", "4mm", "--keep-largest"];
    let output = mesh(&workshop, &[&more[..], &["-o", "organ/scene.toml"]].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.contains("wrote organ/scene.toml"), "{}", output.out);
    // The whole core is inside the ball.
    assert!(output.out.contains("1.47 ml of vessels; 0.00 ml of vessels lie outside"), "{}", output.out);
    let text = workshop.read("organ/scene.toml");
    for piece in [
        "labels = [5], vessels = [8]",
        "label = 8, clean = { keep-largest = true }, as = \"surface\"",
        "on = \"organ\"",
        "[tie.vessel-1]",
        "thickness = 0.0005",
    ] {
        assert!(text.contains(piece), "no `{piece}` in:\n{text}");
    }
    let output = workshop.pliant(&["run", "organ", "--until", "0.005"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let output = workshop.pliant(&["check", "organ"]);
    assert!(output.out.contains("body `capsule`: the boundary of `organ`"), "{}", output.out);
    assert!(output.out.contains("follow `organ`"), "{}", output.out);
    // Masks stand for themselves, and are named after their files.
    let ball =
        |radius: f64| Volume::of_labels(move |[x, y, z]| i16::from(x * x + y * y + z * z < radius * radius));
    workshop.write("shell.nii", ball(15.0).nifti());
    workshop.write("core.nii", ball(7.0).nifti());
    let masks =
        ["mesh", "shell.nii", "core.nii", "--vessels", "core=1mm", "--edge", "4mm", "-o", "masks.toml"];
    let output = workshop.pliant(&masks);
    assert_eq!(output.code, 0, "{}", output.err);
    let text = workshop.read("masks.toml");
    assert!(text.contains("masks = [\"shell.nii\"], labels = [1]"), "{text}");
    assert!(text.contains("masks = [\"core.nii\"], label = 1") && !text.contains("capsule"), "{text}");
    assert_eq!(workshop.pliant(&["check", "masks.toml"]).code, 0);
    for (given, out, pieces) in [
        (&["--vessels", "8"][..], "a.toml", ["8", "thickness"]),
        (&["--vessels", "8=0"], "a.toml", ["above 0", ""]),
        (&["--vessels", "77=1mm"], "a.toml", ["77", ""]),
        (&["--capsule", "-1mm"], "a.toml", ["above 0", ""]),
        (&["--capsule", "1mm"], "a.vtu", ["`--capsule` is for a scene", "leave it out"]),
        (&["--vessels", "8=1mm"], "a.vtu", ["`--vessels` is for a scene", ""]),
        (&["--as", "hexes"], "a.toml", ["tissue with tets", "leave it out"]),
        (&[], "masks.toml", ["exists already", "--force"]),
    ] {
        let output = mesh(&workshop, &[&["--label", "5", "--edge", "4mm", "-o", out], given].concat());
        assert_eq!(output.code, 2, "{given:?}: {}", output.err);
        assert!(pieces.iter().all(|piece| output.err.contains(piece)), "{given:?}: {}", output.err);
    }
    let none = workshop.pliant(&[
        "mesh",
        "shell.nii",
        "core.nii",
        "--vessels",
        "vein=1mm",
        "--edge",
        "4mm",
        "-o",
        "b.toml",
    ]);
    assert!(
        none.code == 2
            && none.err.contains("no mask has the number or name")
            && none.err.contains("shell, core"),
        "{}",
        none.err
    );
}

#[test]
fn labels_are_listed_with_volume_place_and_pieces() {
    let workshop = with_image();
    let output = workshop.pliant(&["labels", "case/seg.nii.gz"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for piece in [
        "NIfTI-1",
        "40 × 40 × 40 voxels of 1.000 × 1.000 × 1.000 mm",
        "label 5:",
        "in 2 pieces",
        "label 8:",
        "label 9: 1 voxels",
    ] {
        assert!(output.out.contains(piece), "no `{piece}` in:\n{}", output.out);
    }
    let json = workshop.pliant(&["labels", "case/seg.nii.gz", "--json"]).json();
    assert_eq!(json["size"], serde_json::json!([40, 40, 40]));
    assert_eq!(json["labels"].as_array().map(Vec::len), Some(3));
    let core = &json["labels"][1];
    assert_eq!((&core["label"], &core["components"]), (&8.into(), &1.into()));
    assert!(close(&core["volume"], 1.4368e-6, 0.03), "{core}");
    assert!(close(&core["low"][0], -7e-3, 0.01) && close(&core["high"][2], 7e-3, 0.01), "{core}");
}

/// Several labels as one material, on the command line and in a scene, with the name of the group.
#[test]
fn groups_of_labels_are_one_material_each() {
    let workshop = with_image();
    let groups = ["--label", "tissue=5,9", "--label", "core=6-8"];
    let output = mesh(&workshop, &[&groups[..], &["--edge", "4mm", "-o", "two.vtu"]].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.out.contains("labels           5 (tissue), 8 (core)"), "{}", output.out);
    let made = io::read(&workshop.path("two.vtu")).unwrap().mesh;
    assert_eq!(made.label_names, [(5, "tissue".into()), (8, "core".into())].into());
    let twice = mesh(&workshop, &["--label", "a=5,8", "--label", "8", "--edge", "4mm", "-o", "two.vtu"]);
    assert!(twice.code == 2 && twice.err.contains("label 8 is named twice"), "{}", twice.err);

    let grouped = "label = { tissue = [5, 9], core = \"6-8\" }";
    let scene = changed(FROM_IMAGE, "label = 5", grouped);
    let scene = changed(&scene, "law = \"tissue\"", "law = { tissue = \"tissue\", core = \"core\" }");
    workshop.write("case/scene.toml", &scene);
    let output = workshop.pliant(&["check", "case"]);
    assert!(
        output.code == 0 && output.out.contains("label 8 (core), 5 (tissue)"),
        "{} {}",
        output.out,
        output.err
    );
    // As `pliant mesh` writes it, and labels and groups do not mix there.
    let output = mesh(&workshop, &[&groups[..], &["--edge", "4mm", "-o", "organ/scene.toml"]].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    let text = workshop.read("organ/scene.toml");
    assert!(text.contains("label = { \"tissue\" = [5, 9], \"core\" = [\"6-8\"] }"), "{text}");
    assert_eq!(workshop.pliant(&["check", "organ"]).code, 0);
    let mixed = mesh(&workshop, &["--label", "a=5", "--label", "8", "--edge", "4mm", "-o", "b/scene.toml"]);
    assert!(mixed.code == 2 && mixed.err.contains("mixes labels and groups"), "{}", mixed.err);
}

#[test]
fn two_labels_become_one_mesh_of_two_materials() {
    let workshop = with_image();
    let arguments = [
        "--label",
        "5",
        "--label",
        "8",
        "--edge",
        "0.005",
        "--keep-largest",
        "--fill-holes",
        "-o",
        "two.vtu",
    ];
    let output = mesh(&workshop, &[&arguments[..], &["--json"]].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    let json = output.json();
    assert_eq!(json["cleaned"]["holes"], 1);
    assert_eq!(json["cleaned"]["pieces_removed"], 1);
    assert_eq!(json["components"], 1);
    assert_eq!(json["files"][0], "two.vtu");
    assert!(json["acoustic_part"].as_f64().unwrap() > 0.6, "{json}");
    assert!(json["distances"]["largest_from_body"].as_f64().unwrap() < 2.5e-3, "{json}");
    for material in json["materials"].as_array().unwrap() {
        assert!(material["volume_error"].as_f64().unwrap().abs() < 0.05, "{material}");
    }
    // c = √((λ + 2μ)/ρ) = 3.37 m/s for E = 3 kPa, ν = 0.45.
    let expected = json["acoustic_length"].as_f64().unwrap() / (11379.3_f64 / 1000.0).sqrt();
    assert!(close(&json["element_bound"]["brain-like"], expected, 0.3), "{json}");

    let read = io::read(&workshop.path("two.vtu")).expect("a mesh");
    assert_eq!(read.mesh.points.len(), json["nodes"].as_u64().unwrap() as usize);
    let block = read.mesh.volume_blocks().next().expect("cells");
    let core: Vec<_> =
        block.cells().zip(&block.data["label"].values).filter(|(_, label)| **label == 8.0).collect();
    assert_eq!(core.len() as u64, json["materials"][1]["cells"].as_u64().unwrap());
    for node in core.iter().flat_map(|(cell, _)| cell.iter()) {
        assert!(read.mesh.points[*node as usize].norm() < 9e-3);
    }

    let page = mesh(&workshop, &arguments);
    assert_eq!(page.code, 0, "{}", page.err);
    for piece in [
        "cleaned",
        "label 8",
        "dihedral angle",
        "acoustic length",
        "body to mesh",
        "stable step",
        "brain-like",
    ] {
        assert!(page.out.contains(piece), "no `{piece}` in:\n{}", page.out);
    }
    assert!(page.err.contains("wrote two.vtu"), "{}", page.err);
}

/// The mesh is measured to the faces of the voxels; a protected label gets smaller cells and a distance is
/// held.
#[test]
fn tets_come_in_several_sizes_and_within_a_distance() {
    let workshop = with_image();
    let two = ["--label", "5", "--label", "8", "--keep-largest", "--fill-holes", "--json"];
    let coarse = mesh(&workshop, &[&two[..], &["--edge", "8mm", "-o", "coarse.vtu"]].concat());
    assert_eq!(coarse.code, 0, "{}", coarse.err);
    let fine = [&two[..], &["--edge", "8mm", "--protect", "8=2mm", "-o", "fine.vtu"]].concat();
    let fine = mesh(&workshop, &fine);
    assert_eq!(fine.code, 0, "{}", fine.err);
    let [coarse, fine] = [coarse, fine].map(|output| output.json());
    assert_eq!(fine["distances"]["to"], "voxels");
    let off = |json: &Value| json["materials"][1]["distances"]["p95_from_mesh"].as_f64().expect("a distance");
    assert!(off(&fine) < off(&coarse), "{} {}", off(&fine), off(&coarse));
    assert!(fine["materials"][1]["volume_error"].as_f64().unwrap().abs() < 0.02, "{fine}");
    assert!(
        fine["interfaces"].as_array().unwrap().iter().any(|of| of["labels"] == serde_json::json!([5, 8]))
    );
    assert!(fine["edges"]["longest_part"].as_f64().unwrap() <= 1.6 + 1e-9, "{fine}");
    let held = mesh(&workshop, &["--threshold", "5", "--distance", "1mm", "-o", "held.vtu", "--json"]).json();
    assert!(held["distance"]["reached"].as_f64().unwrap() <= 1e-3, "{held}");
    // A tenth of the ball's radius at its surface and up to four times that inside.
    let cells = |more: &[&str]| {
        let output =
            mesh(&workshop, &[&["--threshold", "5", "--edge", "1.5mm", "--json"][..], more].concat());
        assert_eq!(output.code, 0, "{}", output.err);
        output.json()
    };
    let even = cells(&["-o", "even.vtu"]);
    let graded = cells(&["--inner-edge", "6mm", "-o", "graded.vtu"]);
    let [many, fewer] = [&even, &graded].map(|json| json["cells"].as_u64().expect("a number of cells"));
    assert!(4 * fewer < 3 * many, "{fewer} of {many}");
    // Longer than any edge of one size may be.
    let longest = graded["edges"]["longest"].as_f64().unwrap();
    assert!(longest > 1.6 * 1.5e-3 && longest < 1.6 * 6e-3, "{graded}");
    assert!(close(&graded["materials"][0]["volume"], even["materials"][0]["volume"].as_f64().unwrap(), 0.01));
    for (option, message) in [
        (["--distance", "1mm"], "`--distance` is for tets"),
        (["--inner-edge", "8mm"], "`--inner-edge` is for tets"),
        (["--protect", "5"], "`--protect` is for tets"),
    ] {
        let output = mesh(
            &workshop,
            &[&["--label", "5", "--edge", "4mm", "--as", "hexes", "-o", "x.vtu"][..], &option].concat(),
        );
        assert!(output.code != 0 && output.err.contains(message), "{}", output.err);
    }
    let output = mesh(&workshop, &["--label", "5", "--edge", "4mm", "--protect", "8", "-o", "x.vtu"]);
    assert!(output.code != 0 && output.err.contains("the mesh has no label 8 to protect"), "{}", output.err);
}

#[test]
fn hexes_and_thresholds_work_and_go_to_gmsh() {
    let workshop = with_image();
    let output =
        mesh(&workshop, &["--threshold", "5", "--edge", "0.004", "--as", "hexes", "-o", "all.msh", "--json"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let json = output.json();
    assert!(close(&json["materials"][0]["volume"], 1.4137e-5, 0.06), "{json}");
    assert_eq!((&json["as"], &json["materials"][0]["label"]), (&"hexes".into(), &1.into()));
    let read = io::read(&workshop.path("all.msh")).expect("a mesh");
    assert_eq!(
        read.mesh.volume_blocks().map(|block| block.len()).sum::<usize>() as u64,
        json["cells"].as_u64().unwrap()
    );
}

#[test]
fn what_is_wrong_is_refused_with_a_remedy_and_nothing_is_written() {
    let workshop = with_image();
    let packed = Volume::ball_with_a_core().packed();
    workshop.write("cut.nii.gz", &packed[..packed.len() / 2]);
    workshop.write("text.txt", "no image\n");
    // Without an orientation the spacings count.
    let mut negative = nifti1(&Volume::ball_with_a_core(), Form::Neither, false);
    negative[84..88].copy_from_slice(&(-1_f32).to_le_bytes());
    workshop.write("negative.nii", &negative);
    workshop.write("empty.nii", Volume::of_labels(|_| 0).nifti());
    let seg = "case/seg.nii.gz";
    let chosen = ["--label", "5", "--edge", "0.006"];
    let cases: [(&str, &[&str], &[&str]); 16] = [
        ("missing.nii", &chosen, &["cannot open `missing.nii`", "check the path"]),
        ("text.txt", &chosen, &["not a supported image", "NIfTI"]),
        ("cut.nii.gz", &chosen, &["cut.nii.gz", "copy it again"]),
        ("negative.nii", &chosen, &["pixdim"]),
        ("empty.nii", &chosen, &["no voxel has label 5", "only background (0)"]),
        (seg, &["--label", "6", "--edge", "0.006"], &["no voxel has label 6; the image has 5, 8, 9"]),
        (seg, &["--label", "0", "--edge", "0.006"], &["label 0 is the background; the image has 5, 8, 9"]),
        (seg, &["--label", "5", "--label", "5", "--edge", "0.006"], &["label 5 is named twice"]),
        (seg, &["--edge", "0.006"], &["no label was chosen; the image has 5, 8, 9", "--label"]),
        (seg, &["--threshold", "50", "--edge", "0.006"], &["no voxel is 50 or more", "lower"]),
        (seg, &["--label", "5", "--edge", "-1"], &["edge is -1", "positive"]),
        (seg, &["--label", "5", "--edge", "nan"], &["edge is NaN", "positive"]),
        (seg, &["--label", "5", "--edge", "5e-5"], &["limit", "--force"]),
        (
            seg,
            &["--label", "9", "--edge", "0.01"],
            &["nothing is left of label 9 after smoothing", "finer voxels"],
        ),
        (seg, &["--label", "5", "--edge", "0.006", "--close-gaps", "-1"], &["gaps to close is -1", "metres"]),
        (seg, &["--label", "5", "--edge", "0.006", "--close-gaps", "30"], &["voxels", "3 mm"]),
    ];
    for (image, more, says) in cases {
        let output = workshop.pliant(&[&["mesh", image], more, &["-o", "out.vtu", "--json"]].concat());
        assert_eq!(output.code, 2, "{image} {more:?}: {}{}", output.err, output.out);
        assert_eq!(output.json()["error"]["kind"], "input");
        for piece in says {
            assert!(output.words().contains(piece), "{image} {more:?}: no `{piece}` in: {}", output.err);
        }
        assert_eq!(output.err.matches("error:").count(), 1, "{}", output.err);
        assert!(!workshop.path("out.vtu").exists());
    }
    for name in ["out.stl", "out.vtk", "out"] {
        let output = mesh(&workshop, &[&chosen[..], &["-o", name]].concat());
        assert_eq!(output.code, 2, "{}", output.err);
        assert!(output.err.contains("ends in .vtu or .msh"), "{}", output.err);
        assert!(!workshop.path(name).exists());
    }
    let output = workshop.pliant(&["labels", "text.txt", "--json"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("not a supported image"), "{}", output.err);
}

#[test]
fn a_part_thinner_than_the_cells_is_told_with_its_place() {
    let workshop = with_image();
    workshop.write("rod.nii", Volume::ball_with_a_rod(1).nifti());
    let output =
        workshop.pliant(&["mesh", "rod.nii", "--label", "1", "--edge", "0.008", "-o", "rod.vtu", "--json"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let json = output.json();
    assert!(
        output.words().contains("warning: the mesh misses a part of the body")
            && output.err.contains("shorter edge"),
        "{}",
        output.err
    );
    assert!(close(&json["distances"]["farthest"][0], 0.0175, 0.06), "{json}");
    assert!(output.words().contains("the mesh lacks parts of the body: "), "{}", output.err);
    assert_eq!(json["warnings"].as_array().map(Vec::len), Some(2));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_a_failure_of_the_output() {
    let workshop = with_image();
    // A file may have 8 blocks of 512 or 1024 bytes: then writing fails, as on a full disk.
    let limited = "trap '' XFSZ; ulimit -f 8; exec \"$0\" mesh case/seg.nii.gz --label 5 --edge 0.006 -o out.vtu --json";
    let output: Said = std::process::Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_pliant")])
        .current_dir(workshop.path(""))
        .output()
        .expect("a shell")
        .into();
    assert_eq!(output.code, 1, "{}", output.err);
    assert!(output.words().contains("free space"), "{}", output.err);
    assert_eq!(output.json()["error"]["kind"], "output");
    assert!(!workshop.path("out.vtu").exists());
    let left: Vec<_> = std::fs::read_dir(workshop.path("")).expect("a folder").collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn immersed_hexes_weigh_what_the_organ_weighs() {
    let workshop = with_image();
    let labels = ["--label", "5", "--label", "8", "--keep-largest", "--fill-holes"];
    let more = ["--edge", "0.004", "--as", "immersed-hexes", "-o", "cubes.vtu", "--json"];
    let json = mesh(&workshop, &[&labels[..], &more].concat()).json();
    assert_eq!(json["as"], "immersed-hexes");
    let volume: f64 =
        json["materials"].as_array().unwrap().iter().map(|part| part["volume"].as_f64().unwrap()).sum();
    assert!((volume / 14.137e-6 - 1.0).abs() < 0.01, "{json}");
    let fractions = io::read(&workshop.path("cubes.vtu")).unwrap().mesh.blocks[0].data["fraction"].clone();
    assert_eq!(fractions.len() as u64, json["cells"].as_u64().unwrap());
}

#[test]
fn the_cache_of_meshes_is_used_unless_it_is_off() {
    let workshop = with_image();
    let output = |more: &[&str]| {
        let output = workshop.run(&[&["--force", "--until", "1e-3"], more].concat());
        output.done();
        output.err
    };
    assert!(output(&[]).contains("stored in the cache"));
    assert!(output(&[]).contains("seg.nii.gz: from the cache"));
    assert!(!output(&["--no-cache"]).contains("cache"));
    let output =
        workshop.command(&["run", "case", "--force"]).env("PLIANT_CACHE", "off").output().expect("it starts");
    assert!(output.status.success() && !String::from_utf8_lossy(&output.stderr).contains("cache"));
}

/// The liver of a patient, where `PLIANT_DATA` has it: meshed by one command.
#[test]
fn a_liver_of_a_patient_is_meshed() {
    const NAME: &str = "abdomen-totalseg/example_seg.nii.gz";
    let Some(image) = std::env::var_os("PLIANT_DATA")
        .map(|folder| Path::new(&folder).join(NAME))
        .filter(|path| path.exists())
    else {
        println!("skipped: set PLIANT_DATA to the folder that holds {NAME}");
        return;
    };
    let image = image.to_str().expect("a path of text");
    let workshop = with_image();
    let output = workshop.pliant(&[
        "mesh",
        image,
        "--label",
        "5",
        "--edge",
        "0.012",
        "--keep-largest",
        "-o",
        "liver.vtu",
        "--json",
    ]);
    assert_eq!(output.code, 0, "{}", output.err);
    let json = output.json();
    assert!(json["acoustic_part"].as_f64().unwrap() > 0.5, "{json}");
    assert!(json["materials"][0]["volume_error"].as_f64().unwrap().abs() < 0.03, "{json}");
}

/// A ball of 15 mm: 14.1 ml, 28.3 cm², closed; then from that file fewer triangles, and shells.
#[test]
fn a_surface_of_an_image_becomes_fewer_triangles_and_shells() {
    let workshop = with_image();
    let labels = ["--label", "5", "--label", "8", "--keep-largest", "--fill-holes"];
    let even = [&labels[..], &["--as", "surface", "--edge", "0.003", "-o", "even.ply", "--json"]].concat();
    let json = mesh(&workshop, &even).json();
    assert!(close(&json["volume"], 14.14e-6, 0.04) && close(&json["area"], 28.27e-4, 0.04), "{json}");
    assert_eq!((&json["border_edges"], &json["components"]), (&0.into(), &1.into()));
    // It has the volume of its voxels, and says so label by label.
    let inputs: f64 = [0, 1].iter().map(|&at| json["labels"][at]["input_volume"].as_f64().unwrap()).sum();
    assert!(close(&json["volume"], inputs, 1e-3), "{json}");
    assert!(
        close(&json["labels"][1]["volume"], 1.472e-6, 1e-3) && json["lost"] == serde_json::json!([]),
        "{json}"
    );
    assert!(json["least_angle"].as_f64().unwrap() > 20.0, "{json}");

    let fewer = workshop
        .pliant(&["mesh", "even.ply", "--as", "surface", "--cells", "200", "-o", "few.stl", "--json"]);
    let json = fewer.json();
    assert_eq!(json["cells"], 200);
    // Edges of 5.7 mm on a radius of 15 mm: h²/6R = 0.36 mm at the centres of triangles.
    assert!(json["distances"]["largest_forward"].as_f64().unwrap() < 0.8e-3, "{json}");

    let shells = [
        "mesh",
        "even.ply",
        "--as",
        "shells",
        "--shells",
        "80",
        "-o",
        "shells.vtu",
        "--error-map",
        "off.vtu",
        "--json",
    ];
    let json = workshop.pliant(&shells).json();
    assert!(json["report"]["shells"].as_u64().unwrap() <= 80, "{json}");
    let distances = &json["report"]["distances"];
    // Shells follow the ball; the target's own facets are h²/6R = 0.1 mm off it.
    assert!(distances["largest_forward"].as_f64().unwrap() < 0.3e-3, "{json}");
    assert!(io::read(&workshop.path("shells.vtu")).unwrap().mesh.point_data.contains_key("normal"));
    assert!(io::read(&workshop.path("off.vtu")).unwrap().mesh.point_data.contains_key("distance"));
}

#[test]
fn what_a_surface_or_shells_need_is_told() {
    let workshop = with_image();
    let output = mesh(&workshop, &["--label", "5", "--as", "shells", "-o", "a.vtu"]);
    assert!(output.code == 2 && output.err.contains("--error 0.5%"), "{}", output.err);
    let output = mesh(&workshop, &["--label", "5", "--as", "surface", "-o", "a.vtu"]);
    assert!(output.code == 2 && output.err.contains("--cells 8000"), "{}", output.err);
    let output = mesh(&workshop, &["--label", "5", "-o", "a.vtu"]);
    assert!(output.code == 2 && output.err.contains("--edge 8mm"), "{}", output.err);
    let output = mesh(&workshop, &["--label", "5", "--as", "shells", "--error", "3", "-o", "a.vtu"]);
    assert!(output.code == 2 && output.err.contains("0.5%"), "{}", output.err);
}
