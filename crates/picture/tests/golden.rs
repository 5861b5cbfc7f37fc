//! Pictures equal the stored ones, drawn by Mesa's software Vulkan. `PLIANT_RENEW_GOLDEN=1` stores new ones.

mod support;

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use pliant_geometry::{CellKind, DataArray, Mesh, Region, Vector3};
use pliant_picture::{
    Background, Camera, Coat, ColourMap, Difference, Graphics, Legend, Look, Material, Paint, Picture, Plane,
    Projection, Regions, Style, Texture,
};
use support::graphics;

/// Hexes of a grid whose corners from [0, 1]³ are put anywhere.
fn hexes(mesh: &mut Mesh, [nx, ny, nz]: [u32; 3], place: impl Fn(Vector3) -> Vector3) {
    let first = mesh.points.len() as u32;
    let at = |i: u32, j: u32, k: u32| first + (k * (ny + 1) + j) * (nx + 1) + i;
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                let part = |i: u32, n: u32| f64::from(i) / f64::from(n);
                mesh.points.push(place(Vector3::new(part(i, nx), part(j, ny), part(k, nz))));
            }
        }
    }
    let nodes = &mut mesh.block_mut(CellKind::Hex).nodes;
    for k in 0..nz {
        for (i, j) in (0..nx * ny).map(|c| (c % nx, c / nx)) {
            for k in [k, k + 1] {
                nodes.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
            }
        }
    }
}

/// A cube made round.
fn ball(p: Vector3) -> Vector3 {
    let [x, y, z] = p.map(|x| 2.0 * x - 1.0).into();
    let round = |a: f64, b: f64, c: f64| a * (1.0 - b * b / 2.0 - c * c / 2.0 + b * b * c * c / 3.0).sqrt();
    Vector3::new(round(x, y, z), round(y, z, x), round(z, x, y)) * 0.035
}

/// Makes a straight beam, displaced to a bow, and a ball near it, displaced a little upwards.
fn organs(with_ball: bool) -> Mesh {
    let mut mesh = Mesh::default();
    hexes(&mut mesh, [24, 6, 4], |p| Vector3::new(0.2 * p.x - 0.1, 0.05 * p.y - 0.025, 0.02 * p.z));
    let beam = mesh.points.len();
    if with_ball {
        hexes(&mut mesh, [8, 8, 8], |p| ball(p) + Vector3::new(0.02, 0.08, 0.03));
    }
    let bent = |point: &Vector3| {
        let (radius, angle) = (0.09 - point.z, point.x / 0.09);
        Vector3::new(radius * angle.sin(), point.y, 0.09 - radius * angle.cos()) - point
    };
    let moved = mesh.points.iter().enumerate().flat_map(|(index, point)| {
        let by = if index < beam { bent(point) } else { Vector3::new(0.0, 0.0, 0.012) };
        [by.x, by.y, by.z]
    });
    let moved = DataArray { components: 3, values: moved.collect() };
    let value = |point: &Vector3| 2e3 * (1.0 + (PI * point.x / 0.1).cos() * (point.z / 0.02)) + 1e4 * point.y;
    let values = DataArray::scalar(mesh.points.iter().map(value).collect());
    mesh.point_data.insert("displacement".into(), moved);
    mesh.point_data.insert("von-mises".into(), values);
    mesh
}

fn look() -> Look {
    Look {
        field: Some("von-mises".into()),
        style: Style { range: Some([0.0, 5e3]), ..Style::default() },
        size: [480, 320],
        legend: Legend {
            quantity: "von Mises stress".into(),
            unit: "Pa".into(),
            title: "A beam and a ball".into(),
            ..Legend::default()
        },
        ..Look::default()
    }
}

fn section() -> Look {
    let plane = Plane::through(&Vector3::new(0.0, 0.06, 0.0), &Vector3::new(0.25, 1.0, 0.0));
    let style = Style { edges: true, clip: plane, map: ColourMap::Cividis, ..look().style };
    Look { style, camera: Camera { azimuth: 60.0, ..Camera::default() }, ..look() }
}

fn ghost() -> Look {
    let style = Style { ghost: true, range: None, background: Background::Dark, ..Style::default() };
    let camera = Camera { projection: Projection::Orthographic, elevation: 35.0, ..Camera::default() };
    Look { field: None, style, camera, ..look() }
}

/// The organs with fibres around the x axis, and stable steps of their cells; an inner cell has the smallest.
fn fibrous() -> Mesh {
    let mut mesh = organs(true);
    let block = &mut mesh.blocks[0];
    let (mut fibres, mut steps) = (Vec::new(), Vec::new());
    for (number, nodes) in block.cells().enumerate() {
        let middle = nodes.iter().map(|&node| mesh.points[node as usize]).sum::<Vector3>() / 8.0;
        let around = Vector3::new(0.5, 0.0, 0.0)
            + Vector3::x().cross(&(middle - Vector3::new(0.0, 0.08, 0.03))) * 30.0;
        fibres.extend(around.normalize().iter().copied());
        steps.push(if number == 24 * 6 + 24 * 3 + 6 { 1e-4 } else { 2e-4 });
    }
    block.data.insert("fibre".into(), DataArray { components: 3, values: fibres });
    block.data.insert("element-step".into(), DataArray::scalar(steps));
    mesh
}

/// Fibres on the surface and in the section, and the marked cell seen through the body.
fn fibres() -> Look {
    let style = Style { fibres: true, critical: true, range: None, edges: false, ..section().style };
    Look {
        field: None,
        style,
        camera: Camera { azimuth: 70.0, elevation: 30.0, ..Camera::default() },
        ..look()
    }
}

fn skin() -> Look {
    Look { field: None, style: Style { texture: Texture::Skin, range: None, ..look().style }, ..look() }
}

fn skin_under_colours() -> Look {
    Look { style: Style { texture: Texture::Skin, ..look().style }, ..look() }
}

fn wireframe() -> Look {
    Look { style: Style { wireframe: true, ..look().style }, ..look() }
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.png"))
}

fn stored(name: &str) -> Picture {
    Picture::from_png_with_coverage(&std::fs::read(file(name)).unwrap()).unwrap()
}

fn difference(graphics: &Graphics, look: &Look, mesh: &Mesh, name: &str) -> Difference {
    let drawn = look.picture(graphics, mesh, None, 0.25).unwrap();
    if std::env::var_os("PLIANT_RENEW_GOLDEN").is_some() {
        std::fs::write(file(name), drawn.png_with_coverage().unwrap()).unwrap();
    }
    drawn.difference(&stored(name)).unwrap()
}

#[test]
fn pictures_are_as_stored() {
    let Some(graphics) = graphics() else { return };
    let looks = [
        ("bodies", look()),
        ("section", section()),
        ("ghost", ghost()),
        ("fibres", fibres()),
        ("skin", skin()),
        ("skin-under-colours", skin_under_colours()),
        ("wireframe", wireframe()),
    ];
    for (name, look) in looks {
        let difference = difference(&graphics, &look, &fibrous(), name);
        assert!(difference.is_same(), "{name}: {difference:?}");
    }
}

#[test]
fn a_missing_organ_and_wrong_colours_are_seen() {
    let Some(graphics) = graphics() else { return };
    let bodies = stored("bodies");
    let seen = |look: &Look, mesh: &Mesh| {
        let difference = look.picture(&graphics, mesh, None, 0.25).unwrap().difference(&bodies).unwrap();
        assert!(!difference.is_same(), "{difference:?}");
        difference
    };
    // The camera of all organs, so only the missing one differs.
    assert!(seen(&look(), &organs(false)).overlap < 0.98, "a missing organ");
    let style = |style: Style| Look { style, ..look() };
    let usual = look().style;
    assert!(seen(&style(Style { map: ColourMap::Inferno, ..usual }), &organs(true)).on_bodies > 6.0);
    assert!(seen(&style(Style { range: Some([0.0, 8e3]), ..usual }), &organs(true)).on_bodies > 6.0);
    assert!(seen(&Look { field: None, ..look() }, &organs(true)).on_bodies > 6.0, "no colours");
    let turned = Camera { azimuth: -45.0, ..Camera::default() };
    seen(&Look { camera: turned, ..look() }, &organs(true));
}

#[test]
fn what_is_not_drawn_is_seen() {
    let Some(graphics) = graphics() else { return };
    for (name, look, without) in [
        ("fibres", fibres(), Style { fibres: false, ..fibres().style }),
        ("skin", skin(), Style { texture: Texture::None, ..skin().style }),
        ("wireframe", wireframe(), Style { wireframe: false, ..wireframe().style }),
    ] {
        let drawn = Look { style: without, ..look }.picture(&graphics, &fibrous(), None, 0.25).unwrap();
        let difference = drawn.difference(&stored(name)).unwrap();
        assert!(!difference.is_same(), "{name}: {difference:?}");
    }
}

#[test]
fn the_marked_cell_is_seen_through_the_body_where_it_is_and_nowhere_else() {
    let Some(graphics) = graphics() else { return };
    let look =
        Look { style: Style { critical: true, range: None, ..Style::default() }, field: None, ..look() };
    let plain = Look { style: Style { critical: false, ..look.style }, ..look.clone() };
    let [with, without] =
        [&look, &plain].map(|look| look.picture(&graphics, &fibrous(), None, 0.25).unwrap());
    // The note at the bottom shows its step.
    let above = (4 * with.width * (with.height - 40)) as usize;
    let changed: Vec<usize> = (0..above / 4)
        .filter(|&pixel| with.rgba[4 * pixel..][..3] != without.rgba[4 * pixel..][..3])
        .collect();
    let marked = changed.iter().filter(|&&p| with.rgba[4 * p] > 180 && with.rgba[4 * p + 1] < 100).count();
    assert!(marked > 20 && changed.len() < 1000, "{marked} of {}", changed.len());
    assert!(with.rgba[above..] != without.rgba[above..], "its step is told");
    let none = look.picture(&graphics, &organs(true), None, 0.25).unwrap_err().to_string();
    assert!(none.contains("element-step"), "{none}");
}

#[test]
fn texture_stays_on_the_body_when_it_moves() {
    let Some(graphics) = graphics() else { return };
    let mut far = fibrous();
    let away = Vector3::new(0.3, -0.2, 0.1);
    let moved = far.point_data.get_mut("displacement").unwrap();
    moved.values.chunks_mut(3).for_each(|u| (0..3).for_each(|c| u[c] += away[c]));
    let difference =
        skin().picture(&graphics, &far, None, 0.25).unwrap().difference(&stored("skin")).unwrap();
    assert!(difference.is_same(), "{difference:?}");
}

#[test]
fn a_section_shows_what_is_inside_and_nothing_beyond_the_plane() {
    let Some(graphics) = graphics() else { return };
    let mesh = organs(true);
    let whole = Look { style: Style { clip: None, ..section().style }, ..section() };
    let [cut, whole] = [&section(), &whole].map(|look| look.picture(&graphics, &mesh, None, 0.25).unwrap());
    let covered = |picture: &Picture| picture.rgba.chunks(4).filter(|pixel| pixel[3] > 127).count();
    assert!(covered(&cut) < covered(&whole));
    assert!(covered(&cut) * 3 > covered(&whole), "the section is closed by what it cuts");
}

#[test]
fn the_same_picture_has_the_same_pixels_and_any_size_is_drawn() {
    let Some(graphics) = graphics() else { return };
    let mesh = organs(true);
    let draw = |size| Look { size, ..look() }.picture(&graphics, &mesh, None, 0.25).unwrap();
    assert_eq!(draw([200, 130]), draw([200, 130]));
    for size in [[1, 1], [63, 500], [1000, 17]] {
        assert_eq!(draw(size).rgba.len(), 4 * (size[0] * size[1]) as usize);
    }
    let most = graphics.device.limits().max_texture_dimension_2d;
    let refused =
        Look { size: [most + 1, 10], ..look() }.picture(&graphics, &mesh, None, 0.0).unwrap_err().to_string();
    assert!(refused.contains("cannot draw"), "{refused}");
}

#[test]
fn forces_of_contacts_are_drawn_where_they_act_and_told_in_the_note() {
    let Some(graphics) = graphics() else { return };
    let mut mesh = organs(false);
    // At the middle of the upper side of the beam, 4 N upwards; elsewhere nothing, or no value.
    let node = (0..mesh.points.len())
        .min_by(|&a, &b| {
            let far = |node: usize| (mesh.points[node] - Vector3::new(0.0, 0.0, 0.02)).norm();
            far(a).total_cmp(&far(b))
        })
        .unwrap();
    let mut values = vec![0.0; 3 * mesh.points.len()];
    values[3 * node + 2] = 4.0;
    values[..3].fill(f64::NAN);
    let style = Style { contacts: true, range: None, ..Style::default() };
    let camera = Camera { projection: Projection::Orthographic, elevation: 0.0, ..Camera::default() };
    let look = Look { field: None, style, camera, ..look() };
    let none = look.picture(&graphics, &mesh, None, 0.25).unwrap_err();
    assert!(none.to_string().contains("`contact-force`") && !none.remedy().is_empty(), "{none}");
    mesh.point_data.insert("contact-force".into(), DataArray { components: 3, values });
    let plain = Look { style: Style { contacts: false, ..style }, ..look.clone() };
    let [with, without] = [&look, &plain].map(|look| look.picture(&graphics, &mesh, None, 0.25).unwrap());
    let above = with.width * (with.height - 40);
    let changed: Vec<[u32; 2]> = (0..above)
        .filter(|&pixel| {
            let at = 4 * pixel as usize;
            with.rgba[at..][..3] != without.rgba[at..][..3]
        })
        .map(|pixel| [pixel % with.width, pixel / with.width])
        .collect();
    let span = |c: usize| {
        let places = || changed.iter().map(|at| at[c]);
        places().max().unwrap_or(0) - places().min().unwrap_or(0)
    };
    // One upright arrow, of the one force.
    println!("{} pixels, {} wide and {} high", changed.len(), span(0), span(1));
    assert!(changed.len() > 100 && span(0) < 12 && (20..120).contains(&span(1)), "{changed:?}");
    let note = |picture: &Picture| picture.rgba[4 * above as usize..].to_vec();
    assert!(note(&with) != note(&without), "what it stands for is in the note");
    let gaps = (0..mesh.points.len()).map(|node| if node == 3 { 2e-5 } else { f64::NAN });
    mesh.point_data.insert("gap".into(), DataArray::scalar(gaps.collect()));
    let near = look.picture(&graphics, &mesh, None, 0.25).unwrap();
    assert!(note(&near) != note(&with), "the least gap is in the note");
    let legend = Legend { unconverged: 2, ..look.legend.clone() };
    let cut = Look { legend, ..look }.picture(&graphics, &mesh, None, 0.25).unwrap();
    assert!(note(&cut) != note(&near), "steps that did not converge are in the note");
}

/// Dark red reflects 3 % of blue light. Brighter pixels on a liver are its highlight, which bone lacks.
#[test]
fn organs_shine_each_in_its_way() {
    let Some(graphics) = graphics() else { return };
    let brightest_blue = |material: Material| {
        let coat = Coat { paint: Paint::Plain(material), ..Coat::default() };
        let regions = Regions { coats: vec![(Region::Body(0), coat)], ..Regions::default() };
        let style = Style { range: None, ..Style::default() };
        let look = Look { field: None, style, regions, ..look() };
        let picture = look.picture(&graphics, &organs(true), None, 0.25).unwrap();
        let covered = picture.rgba.chunks(4).filter(|pixel| pixel[3] == 255);
        let light = |byte: u8| ((f64::from(byte) / 255.0 + 0.055) / 1.055).powf(2.4);
        // Light above the reflection of a white lamp on this colour.
        let reflection = light(material.colour()[2]);
        covered.map(|pixel| light(pixel[2])).fold(0.0, f64::max) - reflection
    };
    let [liver, bone] = [Material::Liver, Material::Bone].map(brightest_blue);
    assert!(liver > 0.15 && bone < 0.12, "{liver} {bone}");
}
