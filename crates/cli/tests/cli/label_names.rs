//! Labels by name, and pictures of labels, through the real binary: a segmentation with names becomes a mesh that keeps them, values and
//! selections of a scene go by name, and pictures show and hide labels.

use crate::support::{Told, Workshop};
use pliant_geometry::{Labels, io};

/// A block of 24 × 12 × 12 voxels of 1 mm as 3D Slicer writes it: the left half is liver, the right one spleen, and a tumour lies in the
/// middle on a separate layer.
fn segmentation() -> Vec<u8> {
    let mut bytes =
        b"NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 32 20 20\n\
        space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: list domain domain domain\nencoding: raw\n\
        space origin: (0,0,0)\n\
        Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\
        Segment1_Name:=spleen\nSegment1_LabelValue:=2\nSegment1_Layer:=0\n\
        Segment2_Name:=tumour\nSegment2_LabelValue:=1\nSegment2_Layer:=1\n\n"
            .to_vec();
    for (k, j, i) in (0..20 * 20 * 32).map(|n| (n / 640, n / 32 % 20, n % 32)) {
        let inside = [(i, 4..28), (j, 4..16), (k, 4..16)].into_iter().all(|(at, range)| range.contains(&at));
        let core = [(i, 12..20), (j, 6..14), (k, 6..14)].into_iter().all(|(at, range)| range.contains(&at));
        bytes.extend([if inside { 1 + u8::from(i >= 16) } else { 0 }, u8::from(core)]);
    }
    bytes
}

const SCENE: &str = r#"[scene]
until = 0.004

[law.soft]
type = "neo-hookean"
young-modulus = 3e3
poisson-ratio = 0.45

[law.stiff]
type = "neo-hookean"
young-modulus = 9e3
poisson-ratio = 0.45

[body.organs]
mesh = { image = "organs.seg.nrrd", labels = ["liver", "spleen", "tumour"], edge = 0.006, protect = ["tumour"] }
law = { liver = "soft", spleen = "soft", Tumour = "stiff" }
density = { liver = 1060, 2 = 1050, tumour = 1100 }

[constraint.held]
type = "fix"
body = "organs"
nodes = { intersection = [{ label = "liver" }, { half-space = { point = [-0.006, 0, 0], normal = [1, 0, 0] } }] }

[load.pull]
type = "force"
on = "organs"
nodes = { label-boundary = ["spleen", "tumour"] }
total = [0, 0, 1e-3]

[output.fields]
type = "vtu"
every = 0.002
data = ["displacement"]
"#;

fn workshop(changes: &[[&str; 2]]) -> Workshop {
    let text = changes.iter().fold(SCENE.to_owned(), |text, [from, to]| {
        assert!(text.contains(from), "`{from}` is not in the scene");
        text.replace(from, to)
    });
    let workshop = Workshop::new(&text);
    workshop.write("case/organs.seg.nrrd", segmentation());
    workshop
}

#[track_caller]
fn done(told: Told) -> Told {
    assert_eq!(told.code, 0, "{}", told.err);
    told
}

#[test]
fn a_scene_goes_by_the_names_of_a_segmentation_and_its_files_keep_them() {
    let workshop = workshop(&[]);
    let ran = workshop.run(&[]);
    ran.done();
    assert!(ran.words().contains("segments overlap in 512 voxels"), "{}", ran.err);
    let frame = &workshop.series("out/case/fields.pvd")[0].1.mesh;
    assert_eq!(Labels::of(frame).all_shown(), ["1 (liver)", "2 (spleen)", "3 (tumour)"]);
    // The same from the cache, where names are not kept, and by number.
    let again = workshop.run(&["--force"]);
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
        let told = workshop(&[[from, to]]).pliant(&["check", "case", "--no-cache"]);
        let words = told.words();
        assert_eq!(told.code, 2, "{to}: {}", told.err);
        assert!(words.contains(piece), "{to}: {words}");
        let lists = words.contains("1 (liver), 2 (spleen), 3 (tumour)") || to.contains("density");
        assert!(lists, "{to}: {words}");
    }
}

#[test]
fn a_mesh_of_an_image_keeps_the_names_and_protects_by_name() {
    let workshop = workshop(&[]);
    let mesh = |more: &[&str]| {
        let start = ["mesh", "case/organs.seg.nrrd", "--label", "1-3", "--edge", "6mm", "-o", "organs.vtu"];
        workshop.pliant(&[&start, more].concat())
    };
    done(mesh(&[]));
    let coarse = io::read(&workshop.path("organs.vtu")).unwrap().mesh;
    assert_eq!(Labels::of(&coarse).all_shown(), ["1 (liver)", "2 (spleen)", "3 (tumour)"]);
    done(mesh(&["--protect", "Tumour=2mm"]));
    let fine = io::read(&workshop.path("organs.vtu")).unwrap().mesh;
    assert!(fine.points.len() > 2 * coarse.points.len());
    let told = mesh(&["--protect", "tumor=2mm"]);
    assert!(told.code == 2 && told.words().contains("did you mean `tumour`?"), "{}", told.err);
    assert_eq!(mesh(&["--protect", "=1mm"]).code, 2);
}

#[cfg(feature = "viewer")]
mod with_pictures {
    use std::fs;

    use pliant_picture::{Picture, label_colour};

    use super::*;
    use crate::support::has_gpu;

    /// Pixels with the exact colour of a label: those of its swatch.
    fn swatches(workshop: &Workshop, file: &str) -> [usize; 4] {
        let picture = Picture::from_png(&fs::read(workshop.path(file)).unwrap()).unwrap();
        [0, 1, 2, 3]
            .map(|label| picture.rgba.chunks(4).filter(|pixel| pixel[..3] == label_colour(label)).count())
    }

    fn shown(workshop: &Workshop, file: &str) -> [bool; 4] {
        swatches(workshop, file).map(|pixels| pixels > 50)
    }

    #[test]
    fn labels_of_scenes_runs_and_meshes_are_drawn_and_hidden() {
        if !has_gpu() {
            return;
        }
        let view = "[view]\ncolour = \"label\"\nhide = [\"spleen\"]\n\n[scene]";
        let workshop = workshop(&[["[scene]", view]]);
        let render = |what: &str, more: &[&str]| {
            done(
                workshop
                    .pliant(&[&["render", what, "-o", "p", "--force", "--size", "480x320"], more].concat()),
            )
        };
        workshop.run(&["--picture"]).done();
        assert_eq!(shown(&workshop, "out/case/picture.png"), [false, true, false, true]);
        render("case", &[]);
        assert_eq!(shown(&workshop, "p/frame-00002.png"), [false, true, false, true]);
        render("case", &["--hide", "liver,3"]);
        assert_eq!(shown(&workshop, "p/frame-00002.png"), [false, false, true, false]);
        render("out/case", &["--colour", "label", "--hide", "1-2"]);
        assert_eq!(shown(&workshop, "p/frame-00002.png"), [false, false, false, true]);
        render("out/case", &["--colour", "displacement"]);
        assert_eq!(shown(&workshop, "p/frame-00002.png"), [false; 4]);
        // A mesh alone is drawn without a run.
        let mesh = ["mesh", "case/organs.seg.nrrd", "--label", "1-3", "--edge", "5mm", "-o", "organs.vtu"];
        done(workshop.pliant(&mesh));
        render("organs.vtu", &[]);
        assert_eq!(shown(&workshop, "p/frame-00000.png"), [false, true, true, true]);
        render("organs.vtu", &["--hide", "Liver"]);
        assert_eq!(shown(&workshop, "p/frame-00000.png"), [false, false, true, true]);
    }

    #[test]
    fn what_cannot_be_hidden_is_refused() {
        if !has_gpu() {
            return;
        }
        let workshop = workshop(&[]);
        workshop.run(&[]).done();
        for (what, hide, piece) in [
            ("case", "tumor", "did you mean `tumour`?"),
            ("case", "1-3", "all labels are hidden"),
            ("out/case", "tumor", "did you mean `tumour`?"),
            ("out/case", "7", "no cell has label 7: the mesh has 1 (liver)"),
            ("out/case", "1-3", "nothing is visible"),
        ] {
            let told = workshop.pliant(&["render", what, "--force", "--colour", "label", "--hide", hide]);
            assert!(told.code == 2 && told.words().contains(piece), "{what} {hide}: {}", told.err);
        }
    }
}
