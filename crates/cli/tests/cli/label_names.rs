//! Labels by name, and pictures of labels, through the real binary. A segmentation with names becomes a mesh
//! that keeps them. Values and selections of a scene use the names, and pictures show and hide labels.

use pliant_geometry::{Labels, io};
use pliant_testing::image_files::layered_segmentation;

use crate::support::{Said, Workshop, from_names};

fn workshop(changes: &[[&str; 2]]) -> Workshop {
    let workshop = Workshop::new(&from_names(changes));
    workshop.write("case/organs.seg.nrrd", layered_segmentation());
    workshop
}

#[track_caller]
fn done(output: Said) -> Said {
    assert_eq!(output.code, 0, "{}", output.err);
    output
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
    let output = mesh(&["--protect", "tumor=2mm"]);
    assert!(output.code == 2 && output.words().contains("did you mean `tumour`?"), "{}", output.err);
    assert_eq!(mesh(&["--protect", "=1mm"]).code, 2);
}

#[cfg(feature = "viewer")]
mod with_pictures {
    use std::fs;

    use pliant_picture::{Picture, label_colour};

    use super::*;
    use crate::support::has_gpu;

    /// Pixels with the exact colour of a label: the pixels of its swatch.
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
        // The tumour inside the spleen is not seen, so the legend does not have it.
        assert_eq!(shown(&workshop, "p/frame-00000.png"), [false, true, true, false]);
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
            let output = workshop.pliant(&["render", what, "--force", "--colour", "label", "--hide", hide]);
            assert!(output.code == 2 && output.words().contains(piece), "{what} {hide}: {}", output.err);
        }
    }
}
