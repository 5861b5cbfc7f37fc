//! Pictures and films through the real binary: pictures of scenes and of finished runs, rejections, and the
//! message of a build without pictures. Without an adapter, tests that need one are skipped with a notice;
//! with `PLIANT_REQUIRE_GPU=1` they fail.

#[cfg(not(feature = "viewer"))]
use crate::support::{BLOCK, Workshop};

#[cfg(not(feature = "viewer"))]
#[test]
fn a_build_without_pictures_tells_how_to_make_one_with_them() {
    let workshop = Workshop::new(BLOCK);
    for arguments in [&["render", "case"][..], &["view", "case"], &["run", "case", "--picture"]] {
        let output = workshop.pliant(arguments);
        assert_eq!(output.code, 2, "{}", output.err);
        assert!(output.err.contains("cargo build --release --features viewer"), "{}", output.err);
        assert!(!workshop.path("out").join("case/history.csv").exists(), "nothing is run");
    }
}

#[cfg(feature = "viewer")]
mod with_pictures {
    use std::collections::BTreeSet;
    use std::fs;

    use pliant_picture::Picture;

    use crate::support::{BLOCK, Said, Workshop, changed, has_gpu};

    /// The sizes of a PNG file, and the number of its frames if it is animated.
    fn png(workshop: &Workshop, name: &str) -> ([u32; 2], Option<u32>) {
        let bytes = fs::read(workshop.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(bytes.starts_with(b"\x89PNG"), "{name}");
        let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        let animated = bytes.windows(4).position(|window| window == b"acTL").map(|at| number(at + 4));
        ([number(16), number(20)], animated)
    }

    fn names(workshop: &Workshop, folder: &str) -> BTreeSet<String> {
        let entries = fs::read_dir(workshop.path(folder)).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[track_caller]
    fn done(output: &Said) -> &Said {
        assert_eq!(output.code, 0, "{}", output.err);
        output
    }

    fn short(more: &str) -> Workshop {
        Workshop::new(&format!("{BLOCK}\n[view]\nsize = [96, 64]\n{more}"))
    }

    #[test]
    fn a_run_leaves_a_picture_in_its_folder_and_summary() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        let output = workshop.run(&["--picture", "--step", "1e-3"]);
        assert_eq!(png(&workshop, "out/case/picture.png"), ([96, 64], None));
        assert!(workshop.read("out/case/summary.md").contains("![the last instant](picture.png)"));
        let files = &output.done()["files"];
        assert!(files.as_array().unwrap().iter().any(|file| file.as_str().unwrap().ends_with("picture.png")));
        // Without the option the picture of the last run is removed.
        workshop.run(&["--force", "--step", "1e-3"]).done();
        assert!(!workshop.path("out/case/picture.png").exists());
        assert!(!workshop.read("out/case/summary.md").contains("picture.png"));
    }

    #[test]
    fn a_finished_run_becomes_pictures_and_a_film() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        workshop.run(&["--step", "1e-3"]).done();
        let small = ["--size", "80x60"];
        done(&workshop.pliant(&[&["render", "out/case"], &small[..]].concat()));
        assert_eq!(names(&workshop, "pictures"), BTreeSet::from(["frame-00005.png".into()]));
        assert_eq!(png(&workshop, "pictures/frame-00005.png").0, [80, 60]);

        let film = ["render", "out/case", "-o", "all", "--film", "film.png", "--colour", "displacement:z"];
        done(&workshop.pliant(&[&film, &small[..]].concat()));
        assert_eq!(names(&workshop, "all").len(), 6);
        assert_eq!(png(&workshop, "film.png"), ([80, 60], Some(6)));

        done(
            &workshop
                .pliant(&[&["render", "out/case", "-o", "some", "--frames", "1..3"], &small[..]].concat()),
        );
        let two = BTreeSet::from(["frame-00001.png".into(), "frame-00002.png".into()]);
        assert_eq!(names(&workshop, "some"), two);
        // The same pictures again, with nothing asked twice.
        done(
            &workshop
                .pliant(&[&["render", "out/case", "-o", "some", "--frames", "1..3"], &small[..]].concat()),
        );
    }

    #[test]
    fn a_film_is_made_by_ffmpeg_or_else_an_animated_png() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        let arguments = ["render", "case", "--film", "film.mp4", "--step", "1e-3", "--size", "81x61"];
        let output = workshop.pliant(&arguments);
        done(&output);
        if pliant_picture::ffmpeg() {
            let bytes = fs::read(workshop.path("film.mp4")).unwrap();
            assert_eq!(&bytes[4..8], b"ftyp");
        }
        let mut without = workshop.command(&[&arguments[..], &["--force"]].concat());
        let output: Said = without.env("PATH", "").output().unwrap().into();
        assert!(done(&output).err.contains("ffmpeg was not found"), "{}", output.err);
        assert_eq!(png(&workshop, "film.png"), ([81, 61], Some(6)));
    }

    #[test]
    fn a_scene_is_seen_as_its_table_and_then_the_options_say() {
        if !has_gpu() {
            return;
        }
        let workshop = short("colour = 'displacement'\nedges = true\ncamera = { azimuth = 20, up = 'y' }\n");
        let take = |folder: &str, more: &[&str]| -> Vec<u8> {
            let arguments = [&["render", "case", "--step", "1e-3", "-o", folder], more].concat();
            done(&workshop.pliant(&arguments));
            fs::read(workshop.path(folder).join("frame-00005.png")).unwrap()
        };
        let plain = take("plain", &[]);
        let different: [&[&str]; 10] = [
            &["--no-maximum"],
            &["--colour", "pressure"],
            &["--colour", "none"],
            &["--colour", "cauchy-stress:zz"],
            &["--map", "magma"],
            &["--range", "-1e-3,1e-2"],
            &["--camera", "-70,-10"],
            &["--clip", "0.05,0.05,0.05,1,0.2,0"],
            &["--ghost", "--background", "white", "--zoom", "0.7"],
            &["--orthographic", "--up", "-z"],
        ];
        for (number, more) in different.iter().enumerate() {
            assert_ne!(take(&format!("other-{number}"), more), plain, "{more:?}");
        }
        assert_eq!(take("again", &["--camera", "20,22"]), plain);
        let surface = take("surface", &["--set", "view.on=skin", "--colour", "von-mises"]);
        assert_ne!(surface, plain);
        // A surface has no inside: a section shows the inside of the body that carries it.
        let cut = ["--clip", "0.05,0.05,0.05,1,0.2,0"];
        let section = |on: &str| take(on, &[&["--set", &format!("view.on={on}")][..], &cut].concat());
        assert_eq!(section("skin"), section("block"));
        assert!(Picture::from_png_with_coverage(&plain).is_err(), "pictures are opaque");
    }

    #[test]
    fn every_colour_and_mark_changes_what_is_seen_of_fibrous_tissue() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        let take = |more: &[&str]| -> Vec<u8> {
            let arguments = [&["render", "case", "--step", "1e-3", "-o", "pictures"], more].concat();
            done(&workshop.pliant(&arguments));
            fs::read(workshop.path("pictures/frame-00005.png")).unwrap()
        };
        let mut seen = BTreeSet::new();
        for colour in [
            "none",
            "von-mises",
            "displacement",
            "fibre-stretch",
            "pressure",
            "energy-density",
            "element-step",
        ] {
            assert!(seen.insert(take(&["--colour", colour])), "{colour}");
        }
        let marks: [&[&str]; 4] = [&["--fibres"], &["--critical"], &["--texture", "skin"], &["--wireframe"]];
        for more in marks {
            assert!(seen.insert(take(more)), "{more:?}");
        }
        // The same words in the scene.
        let table = short("fibres = true\ncritical = true\ntexture = 'skin'\nwireframe = true\n");
        done(&table.pliant(&["render", "case", "--step", "1e-3", "-o", "pictures"]));
        let by_table = fs::read(table.path("pictures/frame-00005.png")).unwrap();
        assert_eq!(take(&["--fibres", "--critical", "--texture", "skin", "--wireframe"]), by_table);
    }

    #[test]
    fn a_folder_of_scenes_becomes_a_gallery() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        for (name, title) in [("one", "A block"), ("two", "Another one")] {
            let titled = BLOCK.replace("[scene]\n", &format!("[scene]\ntitle = '{title}'\n"));
            workshop.write(
                &format!("scenes/{name}/scene.toml"),
                format!("{titled}\n[view]\nsize = [320, 200]\n"),
            );
        }
        workshop.write("scenes/README.md", "no scene");
        let arguments = ["render", "scenes", "-o", "gallery", "--until", "0.004"];
        done(&workshop.pliant(&arguments));
        let expected = ["README.md", "one.png", "two.png"].map(String::from);
        assert_eq!(names(&workshop, "gallery"), BTreeSet::from(expected));
        assert_eq!(png(&workshop, "gallery/two.png").0, [640, 400]);
        let page = workshop.read("gallery/README.md");
        for piece in
            ["## A block\n\n![A block](one.png)", "pliant render scenes/two --until 0.004", "## Another one"]
        {
            assert!(page.contains(piece), "{piece}: {page}");
        }
        done(&workshop.pliant(&arguments));
        let output = workshop.pliant(&[&arguments[..], &["--film", "film.png"]].concat());
        assert_eq!(output.code, 2);
        assert!(output.err.contains("the last picture of each scene"), "{}", output.err);
    }

    /// A bar is held at one end, moved at the other one, and pressed from above. Its files show this, and so
    /// do pictures of the scene, of a surface that it carries, of the run and of its files.
    #[test]
    fn constraints_and_loads_are_written_and_marked() {
        if !has_gpu() {
            return;
        }
        let bar = include_str!("../../../viewer/tests/support/bar.toml");
        let more = "[output.marks]\ntype = 'vtu'\nevery = 0.05\ndata = ['displacement', 'constraint', 'load', 'weight']\n\
                    [surface.skin]\non = 'bar'\nmesh = { block = { size = [0.2, 0.1, 0.1], cells = [3, 2, 2] } }\n\
                    [view]\nsize = [600, 400]\ncolour = 'none'\nmarks = true\n";
        let workshop = Workshop::new(&format!("{bar}{more}"));
        workshop.run(&["--until", "0.1", "--picture"]).done();
        let last = workshop.path("out/case/marks/000002.vtu");
        let mesh = pliant_geometry::io::read(&last).unwrap().mesh;
        let held = &mesh.point_data["constraint"].values;
        assert_eq!([1.0, 2.0].map(|kind| held.iter().filter(|value| **value == kind).count()), [9, 9]);
        let pressed: f64 = mesh.point_data["load"].values.chunks(3).map(|force| force[2]).sum();
        // The pressure times the area of the upper side, which the pull stretches by a tenth and thins.
        assert!(pressed < -0.9 && pressed > -1.2, "{pressed} N");
        let weight: f64 = mesh.point_data["weight"].values.chunks(3).map(|force| force[2]).sum();
        assert!((weight + 0.02).abs() < 1e-9, "{weight} N of 2 kg under 0.01 m/s²");

        let has = |name: &str| {
            let picture = Picture::from_png(&fs::read(workshop.path(name)).unwrap()).unwrap();
            [[40, 44, 52], [206, 112, 20], [24, 128, 80]]
                .map(|colour: [u8; 3]| picture.rgb().chunks(3).filter(|pixel| *pixel == colour).count() > 5)
        };
        assert_eq!(has("out/case/picture.png"), [true; 3]);
        let render = |what: &str, out: &str, more: &[&str]| {
            done(&workshop.pliant(&[&["render", what, "-o", out], more].concat()));
            fs::read_dir(workshop.path(out)).unwrap().next().unwrap().unwrap().path()
        };
        for (what, out, more) in [
            ("case", "scene", &["--until", "0.1"][..]),
            ("case", "skin", &["--until", "0.1", "--set", "view.on=skin"]),
            ("out/case", "files", &["--marks", "--size", "600x400", "--colour", "none"]),
        ] {
            let picture = render(what, out, more);
            assert_eq!(has(picture.to_str().unwrap()), [true; 3], "{out}");
        }
        let without = render("case", "without", &["--until", "0.1", "--set", "view.marks=false"]);
        assert_eq!(has(without.to_str().unwrap()), [false; 3]);
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_a_remedy() {
        if !has_gpu() {
            return;
        }
        let workshop = short("");
        workshop.run(&["--step", "1e-3"]).done();
        workshop.write("full/letter.txt", "mine");
        workshop.write("empty/letter.txt", "mine");
        let cases: [(&[&str], &str); 16] = [
            (&["render", "nowhere"], "nowhere"),
            (&["render", "out/case", "--fibres"], "needs `fibre` in `data`"),
            (&["render", "out/case", "--critical"], "needs `element-step` in `data`"),
            (&["render", "out/case", "--contacts"], "needs `contact-force` in `data`"),
            (&["render", "case", "--contacts"], "no body touches anything, so there is no `contact-force`"),
            (&["render", "out/case", "--marks"], "needs `constraint` and `load` in `data`"),
            (&["render", "case", "--texture", "wood"], "possible values: none, skin"),
            (&["render", "empty"], "has no series of frames"),
            (&["render", "out/case", "--series", "skin"], "it has `fields`"),
            (&["render", "out/case", "--colour", "pressure"], "`displacement`, `von-mises`"),
            (&["render", "out/case", "--frames", "9"], "has 6 frames, from 0 to 5"),
            (&["render", "out/case", "--until", "2"], "give the scene"),
            (&["render", "out/case", "--film", "film.avi"], "end it in .mp4"),
            (&["render", "out/case", "-o", "full"], "it is not empty"),
            (&["render", "case", "--colour", "presure"], "did you mean \"pressure\"?"),
            (&["render", "case", "--colour", "bending-moment:xx"], "have no `bending-moment`"),
        ];
        for (arguments, piece) in cases {
            let output = workshop.pliant(arguments);
            assert_eq!(output.code, 2, "{arguments:?}: {}", output.err);
            assert!(output.words().contains(piece), "{arguments:?}: {}", output.err);
        }
        for typed in [
            ["--range", "2,1"],
            ["--range", "1"],
            ["--size", "5x5"],
            ["--camera", "0,100"],
            ["--clip", "0,0,0,0,0,0"],
            ["--zoom", "-1"],
            ["--frames", "3..2"],
        ] {
            assert_eq!(workshop.pliant(&[&["render", "out/case"], &typed[..]].concat()).code, 2, "{typed:?}");
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn without_anything_that_draws_the_packages_are_named() {
        let workshop = short("");
        for arguments in [&["render", "case"][..], &["run", "case", "--picture"]] {
            // On Linux nothing answers to Direct3D.
            let output: Said =
                workshop.command(arguments).env("WGPU_BACKEND", "dx12").output().unwrap().into();
            assert_eq!(output.code, 2, "{}", output.err);
            assert!(output.err.contains("mesa-vulkan-drivers libvulkan1"), "{}", output.err);
        }
        let scene = changed(BLOCK, "until = 0.02", "until = 0.002");
        assert_eq!(Workshop::new(&scene).pliant(&["run", "case"]).code, 0, "everything else works");
    }
}
