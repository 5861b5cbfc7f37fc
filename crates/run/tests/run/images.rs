//! Scenes of segmented images: labels by number and by name, the cache of meshes, walls and hexes, and
//! mistakes.

use std::fs;

use pliant_geometry::Labels;
use pliant_testing::image_files::{Volume, layered_segmentation};
use pliant_testing::scenes::{FROM_IMAGE, Workshop, changed, from_names};

use crate::support::close;

fn workshop(mesh: &str, law: &str) -> Workshop {
    let scene = changed(FROM_IMAGE, "{ image = \"seg.nii.gz\", label = 5, edge = 0.006 }", mesh);
    let workshop = Workshop::new(&changed(&scene, "law = \"tissue\"", &format!("law = {law}")));
    workshop.write("case/seg.nii.gz", Volume::ball_with_a_core().packed());
    workshop
}

#[test]
fn a_scene_names_an_image_and_laws_by_label() {
    let mesh = "{ image = \"seg.nii.gz\", labels = [5, 8], edge = 0.006, as = \"tets\", clean = { keep-largest = true } }";
    let workshop = workshop(mesh, "{ 5 = \"tissue\", 8 = \"core\" }");
    let output = workshop.check(&[]);
    assert_eq!(output.status(), "checked", "{}", output.err);
    assert!(output.out.contains("seg.nii.gz (NIfTI-1), label 5, 8, tets of 0.006 m"), "{}", output.out);
    let ran = workshop.run(&[]);
    let json = ran.done();
    assert!(ran.words().contains("1 voxels removed in 1 smaller pieces"), "{}", ran.err);
    // 14.137 ml of water's density, with facets.
    assert!(close(&json["mass"], 14.1e-3, 0.05), "{json}");
}

/// A vessel inside of the organ is tissue, one outside of it is not.
#[test]
fn vessels_belong_to_the_organ_where_they_run_inside_of_it() {
    let mass = |vessels: &str| {
        let mesh = format!(
            "{{ image = \"seg.nii.gz\", label = 5, edge = 0.006, clean = {{ keep-largest = true }}{vessels} }}"
        );
        let output = workshop(&mesh, "\"tissue\"").run(&["scene.until=1e-5"]);
        (output.done()["mass"].as_f64().unwrap(), output.words())
    };
    // A ball of 15 mm, hollow for the core of 7 mm, which 6 mm hardly resolve; of water's density.
    let (hollow, _) = mass("");
    assert!((hollow / 12.7e-3 - 1.0).abs() < 0.07, "{hollow}");
    let (whole, words) = mass(", vessels = [8]");
    assert!((whole / 14.1e-3 - 1.0).abs() < 0.05, "{whole}");
    assert!(words.contains("1.47 ml of the vessels run inside of the organ"), "{words}");
    let (without, words) = mass(", vessels = [9]");
    assert_eq!(without, hollow);
    assert!(words.contains("0.00 ml of the vessels run inside of the organ"), "{words}");
}

/// The keys `inner-edge` and `distance` of a scene: larger cells inside, and smaller ones where the surface
/// asks for them.
#[test]
fn a_scene_asks_for_larger_cells_inside_and_for_a_distance() {
    let elements = |edge: &str, more: &str| {
        let mesh = format!("{{ image = \"seg.nii.gz\", threshold = 5, edge = {edge}{more} }}");
        let output = workshop(&mesh, "\"tissue\"").run(&["scene.until=1e-5"]);
        (output.done()["elements"].as_u64().unwrap(), output.words())
    };
    let (even, _) = elements("0.0015", "");
    let (graded, _) = elements("0.0015", ", inner-edge = 0.006");
    assert!(4 * graded < 3 * even, "{graded} of {even}");
    let (coarse, _) = elements("0.014", "");
    let (close, words) = elements("0.014", ", distance = 0.001");
    assert!(close > 2 * coarse, "{close} of {coarse}");
    assert!(!words.contains("not reached"), "{words}");
}

#[test]
fn a_scene_with_hexes_of_an_image_runs() {
    let workshop = workshop(
        "{ image = \"seg.nii.gz\", threshold = 5, edge = 0.006, as = \"hexes\", clean = { keep-largest = true } }",
        "\"tissue\"",
    );
    workshop.run(&[]).done();
}

#[test]
fn immersed_hexes_weigh_what_the_organ_weighs_and_carry_its_smooth_surface() {
    let workshop = workshop(
        "{ image = \"seg.nii.gz\", labels = [5, 8], edge = 0.004, as = \"immersed-hexes\", \
         clean = { keep-largest = true, fill-holes = true } }",
        "\"tissue\"",
    );
    let skin = "[surface.skin]\non = \"organ\"\nmesh = { image = \"seg.nii.gz\", labels = [5, 8], as = \"surface\", \
                edge = 0.002, clean = { keep-largest = true, fill-holes = true } }\n\
                [output.skin]\ntype = \"vtu\"\non = \"skin\"\nevery = 0.01\ndata = [\"displacement\"]\n";
    workshop.write("case/scene.toml", format!("{}{skin}", workshop.read("case/scene.toml")));
    let json = workshop.run_into("out", &[]).done();
    assert!(close(&json["mass"], 14.137e-3, 0.015), "{json}");
    // At rest the skin is the ball of 15 mm, not its cubes.
    let first = &workshop.series("out/skin.pvd")[0].1.mesh;
    assert!(first.points.len() > 500);
    let off = first.points.iter().map(|x| (x.norm() - 0.015).abs()).fold(0.0, f64::max);
    assert!(off < 0.5e-3, "{off}");
}

#[test]
fn shells_of_an_image_become_a_wall() {
    let mesh = "{ image = \"seg.nii.gz\", labels = [5, 8], as = \"shells\", shells = 80, \
                clean = { keep-largest = true, fill-holes = true } }\nmodel = \"shell\"\nthickness = 1e-3";
    let workshop = workshop(mesh, "\"tissue\"");
    let text = workshop
        .read("case/scene.toml")
        .replace("[law.tissue]", "[run]\nsolver = \"static\"\n\n[law.tissue]");
    workshop.write("case/scene.toml", text);
    let output = workshop.check(&[]);
    assert_eq!(output.status(), "checked", "{}", output.err);
    assert!(output.out.contains("label 5, 8, 80 shells"), "{}", output.out);
}

/// True if the mesh of a run came from the cache, false if the run stored the mesh there, else `None`.
fn cached(workshop: &Workshop, set: &[&str]) -> Option<bool> {
    let output = workshop.run(set);
    output.done();
    match (output.err.contains("seg.nii.gz: from the cache"), output.err.contains("stored in the cache")) {
        (false, false) => None,
        (hit, _) => Some(hit),
    }
}

#[test]
fn the_mesh_of_an_image_is_kept_and_made_anew_where_anything_changes() {
    let workshop = workshop("{ image = \"seg.nii.gz\", label = 5, edge = 0.006 }", "\"tissue\"");
    assert_eq!(cached(&workshop, &[]), Some(false));
    let whole = workshop.run(&[]).done();
    assert_eq!(cached(&workshop, &[]), Some(true));
    for change in ["body.organ.mesh.edge=0.007", "body.organ.mesh.clean.keep-largest=true"] {
        assert_eq!(cached(&workshop, &[change]), Some(false), "{change}");
        assert_eq!(cached(&workshop, &[change]), Some(true), "{change}");
    }
    // The cached mesh gives the same bits.
    assert_eq!(workshop.run(&[]).done()["reactions"], whole["reactions"]);
    for entry in fs::read_dir(workshop.path("cache")).unwrap() {
        let path = entry.unwrap().path();
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    }
    assert_eq!(cached(&workshop, &[]), Some(false));
    assert_eq!(cached(&workshop, &[]), Some(true));
    let mut other = Volume::ball_with_a_core();
    other.values[0] = 5;
    workshop.write("case/seg.nii.gz", other.packed());
    assert_eq!(cached(&workshop, &[]), Some(false));
}

#[test]
fn a_kept_mesh_still_warns() {
    let workshop = workshop("{ image = \"seg.nii.gz\", label = 5, edge = 0.008 }", "\"tissue\"");
    workshop.write("case/seg.nii.gz", Volume::ball_with_a_rod(5).packed());
    for kept in ["stored in the cache", "from the cache"] {
        let output = workshop.run(&[]);
        assert!(
            output.words().contains(kept) && output.words().contains("the mesh misses a part of the body"),
            "{}",
            output.err
        );
    }
}

#[test]
fn mistakes_about_images_are_underlined_in_the_scene() {
    for (mesh, says) in [
        ("{ image = \"seg.nii.gz\", label = 6, edge = 0.006 }", "the image has 5, 8, 9"),
        ("{ image = \"seg.nii.gz\", labels = [5, 0], edge = 0.006 }", "label 0 is the background"),
        ("{ image = \"seg.nii.gz\", labels = [], edge = 0.006 }", "no label was chosen"),
        ("{ image = \"seg.nii.gz\", edge = 0.006 }", "add `label = 1`"),
        ("{ image = \"other.nii.gz\", label = 5, edge = 0.006 }", "relative to the scene file"),
        ("{ image = \"scene.toml\", label = 5, edge = 0.006 }", "not a supported image"),
        ("{ image = \"seg.nii.gz\", label = 5, edge = 5e-5 }", "exceed"),
        ("{ image = \"seg.nii.gz\", threshold = 50, edge = 0.006 }", "lower threshold"),
        ("{ image = \"seg.nii.gz\", label = 5, edge = 0.006, clean = { close-gaps = -1 } }", "close-gaps"),
        ("{ image = \"seg.nii.gz\", label = 5, edge = 0.006, fix = \"merge\" }", "`clean` cleans"),
        ("{ image = \"seg.nii.gz\", label = 5, vessels = [6], edge = 0.006 }", "the image has 5, 8, 9"),
        ("{ image = \"seg.nii.gz\", label = 5, vessels = 8, edge = 0.006 }", "array"),
        ("{ image = \"seg.nii.gz\", label = 5, vesels = [8], edge = 0.006 }", "`vessels`"),
        ("{ image = \"seg.nii.gz\", threshold = 5, vessels = [8], edge = 0.006 }", "chosen by `threshold`"),
    ] {
        let output = workshop(mesh, "\"tissue\"").check(&[]);
        assert_eq!(output.status(), "invalid", "{mesh}: {}", output.err);
        assert!(output.underlines(&format!("mesh = {mesh}")), "{mesh}: {}", output.err);
        assert!(output.words().contains(says), "{mesh}: no `{says}` in {}", output.err);
    }
}

fn by_names(changes: &[[&str; 2]]) -> Workshop {
    let workshop = Workshop::new(&from_names(changes));
    workshop.write("case/organs.seg.nrrd", layered_segmentation());
    workshop
}

#[test]
fn a_scene_goes_by_the_names_of_a_segmentation_and_its_files_keep_them() {
    let workshop = by_names(&[]);
    let ran = workshop.run(&[]);
    ran.done();
    assert!(ran.words().contains("segments overlap in 512 voxels"), "{}", ran.err);
    let frame = &workshop.series("out/case/fields.pvd")[0].1.mesh;
    assert_eq!(Labels::of(frame).all_shown(), ["1 (liver)", "2 (spleen)", "3 (tumour)"]);
    // The same from the cache, where names are not kept, and by number.
    let again = workshop.run(&[]);
    again.done();
    let frame = &workshop.series("out/case/fields.pvd")[0].1.mesh;
    assert_eq!(Labels::of(frame).all_shown(), ["1 (liver)", "2 (spleen)", "3 (tumour)"]);
}

#[test]
fn unknown_names_are_refused_where_they_stand_with_those_there_are() {
    for ([from, to], piece) in [
        (["Tumour = \"stiff\"", "tumor = \"stiff\""], "no label is named `tumor`; did you mean `tumour`?"),
        (
            ["{ label = \"liver\" }", "{ label = \"livr\" }"],
            "no label is named `livr`; did you mean `liver`?",
        ),
        (["[\"spleen\", \"tumour\"] }\ntotal", "[\"colon\", 3] }\ntotal"], "no label is named `colon`"),
        (
            ["protect = [\"tumour\"]", "protect = [{ label = \"tumer\", edge = 0.002 }]"],
            "did you mean `tumour`?",
        ),
        (
            ["density = { liver = 1060", "density = { 1 = 1000, liver = 1060"],
            "`liver` is label 1, which has a value",
        ),
    ] {
        let output = by_names(&[[from, to]]).check(&[]);
        let words = output.words();
        assert_eq!(output.status(), "invalid", "{to}: {}", output.err);
        assert!(words.contains(piece), "{to}: {words}");
        let lists = words.contains("1 (liver), 2 (spleen), 3 (tumour)") || to.contains("density");
        assert!(lists, "{to}: {words}");
    }
}
