//! Colours of labels. Each cell has exactly the colour of its label, hidden cells show the inside, and the
//! legend has a swatch for each visible label.

mod support;

use pliant_geometry::{CellKind, DataArray, Mesh, Region, Vector3};
use pliant_picture::{
    Camera, Coat, Look, Picture, Plane, Regions, Section, Sight, Style, Subject, label_colour,
};
use support::graphics;

/// A cube of 6³ hexes: label 1 in one half and 2 in the other, around a core of 2³ with label 3.
fn cube() -> Mesh {
    let n = 6_u32;
    let at = |i: u32, j: u32, k: u32| (k * (n + 1) + j) * (n + 1) + i;
    let mut mesh = Mesh::default();
    for k in 0..=n {
        for (j, i) in (0..(n + 1) * (n + 1)).map(|p| (p / (n + 1), p % (n + 1))) {
            mesh.points.push(Vector3::new(i.into(), j.into(), k.into()) * 0.01);
        }
    }
    let (mut nodes, mut labels) = (Vec::new(), Vec::new());
    for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
        for k in [k, k + 1] {
            nodes.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
        }
        let core = [i, j, k].iter().all(|place| (2..4).contains(place));
        labels.push(if core { 3.0 } else { f64::from(1 + i / 3) });
    }
    let block = mesh.block_mut(CellKind::Hex);
    block.nodes = nodes;
    block.data.insert("label".into(), DataArray::scalar(labels));
    mesh.label_names = [(1, "left".to_owned()), (2, "right".to_owned())].into();
    mesh
}

fn look() -> Look {
    Look { style: Style { labels: true, ..Style::default() }, size: [480, 320], ..Look::default() }
}

/// The light of a byte of sRGB.
fn light(byte: u8) -> f64 {
    let s = f64::from(byte) / 255.0;
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Pixels of the body with the lit colour of each label from 1 to 3, and other pixels. Light changes the
/// brightness of a colour and adds a little white; without its white, the rest has the direction of the
/// label's colour.
fn counts(picture: &Picture) -> [usize; 4] {
    let pure = |rgb: &[u8]| {
        let rgb = Vector3::from_iterator(rgb[..3].iter().map(|&byte| light(byte)));
        let white = rgb.min() * 0.9;
        rgb.map(|x| x - white).normalize()
    };
    let pure_colours: Vec<Vector3> = (1..=3).map(|label| pure(&label_colour(label))).collect();
    let mut counts = [0; 4];
    for pixel in picture.rgba.chunks(4).filter(|pixel| pixel[3] > 250) {
        let colour = pure(pixel);
        let nearest = (0..3)
            .max_by(|&a, &b| pure_colours[a].dot(&colour).total_cmp(&pure_colours[b].dot(&colour)))
            .unwrap();
        counts[if pure_colours[nearest].dot(&colour) > 0.96 { nearest } else { 3 }] += 1;
    }
    counts
}

fn without(labels: &[i32]) -> Regions {
    Regions { hidden: labels.iter().copied().map(Region::Label).collect(), ..Regions::default() }
}

fn swatches(picture: &Picture) -> Vec<i32> {
    let exact = |label: &i32| {
        let colour = label_colour(*label);
        picture.rgba.chunks(4).filter(|pixel| pixel[..3] == colour).count() > 50
    };
    (1..=3).filter(exact).collect()
}

#[test]
fn cells_have_the_colours_of_their_labels_and_none_between() {
    let Some(graphics) = graphics() else { return };
    let picture = look().picture(&graphics, &cube(), None, 0.0).unwrap();
    let [left, right, core, other] = counts(&picture);
    assert!(left > 3000 && right > 3000 && core == 0, "{left} {right} {core}");
    // Where a pixel lies on the border, samples of both are in it.
    assert!(other * 50 < left + right, "{other} of {}", left + right);
    assert_eq!(swatches(&picture), [1, 2], "the core is not seen");
}

#[test]
fn hidden_labels_show_what_lies_inside_and_leave_the_legend() {
    let Some(graphics) = graphics() else { return };
    let hiding = |labels: Vec<i32>| {
        Look { regions: without(&labels), ..look() }.picture(&graphics, &cube(), None, 0.0)
    };
    let picture = hiding(vec![1, 2]).unwrap();
    let [left, right, core, _] = counts(&picture);
    assert!((left, right) == (0, 0) && core > 3000, "{left} {right} {core}");
    assert_eq!(swatches(&picture), [3]);
    let half = hiding(vec![2]).unwrap();
    let [left, right, core, _] = counts(&half);
    assert!(right == 0 && left > 3000 && core > 200, "{left} {right} {core}");
    let message = hiding(vec![1, 2, 3]).unwrap_err().to_string();
    assert!(message.contains("nothing is visible"), "{message}");
}

#[test]
fn one_sees_through_half_of_the_body_to_what_lies_inside_and_through_nothing_of_the_rest() {
    let Some(graphics) = graphics() else { return };
    let seen = |opacity: [f64; 2]| {
        let coat = |(label, opacity)| (Region::Label(label), Coat { opacity, ..Coat::default() });
        let regions = Regions { coats: (1..).zip(opacity).map(coat).collect(), ..Regions::default() };
        Look { regions, ..look() }.picture(&graphics, &cube(), None, 0.0).unwrap()
    };
    let whole = look().picture(&graphics, &cube(), None, 0.0).unwrap();
    assert_eq!(whole.rgba, seen([1.0, 1.0]).rgba);
    // Invisible cells look like hidden ones, but the camera still fits them.
    let [left, right, core, _] = counts(&seen([0.0, 0.0]));
    assert!((left, right) == (0, 0) && core > 1000, "{left} {right} {core}");
    let half = seen([0.3, 0.3]);
    let at = |picture: &Picture, x: u32, y: u32| {
        let from = 4 * (y * picture.width + x) as usize;
        Vector3::from_iterator(picture.rgba[from..from + 3].iter().map(|&byte| light(byte)))
    };
    let green = |picture: &Picture| {
        let places = (0..48).flat_map(|x| (0..32).map(move |y| (10 * x, 10 * y)));
        places
            .filter(|&(x, y)| {
                let c = at(picture, x, y);
                c.y > 1.15 * c.x && c.y > 1.05 * c.z
            })
            .count()
    };
    assert!(green(&half) > green(&whole) + 10, "{} {}", green(&half), green(&whole));
}

#[test]
fn a_section_has_the_colours_of_the_cells_it_cuts() {
    let Some(graphics) = graphics() else { return };
    let clip = Plane::through(&Vector3::new(0.0, 0.031, 0.0), &-Vector3::y());
    let look = Look { style: Style { clip, ..look().style }, ..look() };
    let picture = look.picture(&graphics, &cube(), None, 0.0).unwrap();
    let [left, right, core, other] = counts(&picture);
    assert!(left > 2000 && right > 2000 && core > 400, "{left} {right} {core}");
    assert!(other * 50 < left + right, "{other}");
    assert_eq!(swatches(&picture), [1, 2, 3]);
}

/// The colours of a section match the legend byte by byte, whatever light falls on it.
#[test]
fn colours_of_a_section_are_those_of_the_legend_from_every_side() {
    let Some(graphics) = graphics() else { return };
    for (azimuth, normal) in
        [(0.0, Vector3::x()), (80.0, Vector3::x()), (-80.0, Vector3::x()), (-55.0, -Vector3::z())]
    {
        let clip = Plane::through(&Vector3::new(0.025, 0.0, 0.031), &normal);
        let elevation = if normal.z < 0.0 { -40.0 } else { 5.0 };
        let camera = Camera { azimuth, elevation, ..Camera::default() };
        let look = Look { style: Style { clip, ..look().style }, camera, ..look() };
        let picture = look.picture(&graphics, &cube(), None, 0.0).unwrap();
        let exact = |label| {
            let colour = label_colour(label);
            picture.rgba.chunks(4).filter(|pixel| pixel[..3] == colour && pixel[3] == 255).count()
        };
        // Swatches are not covered by a body.
        assert!(exact(1) > 2000 && exact(3) > 200, "{azimuth}: {} {}", exact(1), exact(3));
    }
}

#[test]
fn the_legend_tells_which_labels_nothing_is_seen_of_from_here() {
    let mut mesh = cube();
    // The corner of the smallest x, the greatest y and the smallest z.
    mesh.blocks[0].data.get_mut("label").unwrap().values[30] = 4.0;
    let subject = Subject::new(&mesh);
    let hidden = |azimuth: f64, regions: &Regions| -> Vec<i32> {
        let mut camera = Camera { azimuth, ..Camera::default() };
        camera.fit(&mesh.points, 1.0);
        let sight = Sight::new(&subject, &mesh.points, regions, None, &Section::default(), &camera);
        sight.hidden_labels(regions, [1, 2, 4].into_iter()).into_iter().collect()
    };
    let default_regions = Regions::default();
    assert_eq!(hidden(-45.0, &default_regions), [4]);
    assert_eq!(hidden(135.0, &default_regions), [0; 0]);
    assert_eq!(hidden(45.0, &default_regions), [0; 0], "the side of y");
    let glass = Coat { opacity: 0.5, ..Coat::default() };
    let through =
        Regions { coats: [1, 2].map(|label| (Region::Label(label), glass)).to_vec(), ..default_regions };
    assert_eq!(hidden(-45.0, &through), [0; 0]);
}

#[test]
fn a_mesh_without_labels_is_refused() {
    let Some(graphics) = graphics() else { return };
    let mut mesh = cube();
    mesh.blocks[0].data.clear();
    let message = look().picture(&graphics, &mesh, None, 0.0).unwrap_err();
    assert!(message.to_string().contains("have no labels") && !message.remedy().is_empty(), "{message}");
}
