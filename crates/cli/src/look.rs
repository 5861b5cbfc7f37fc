//! The look of a picture or window that the `[view]` of a scene requests.

use pliant_format::Scene;
use pliant_format::tables::{BackgroundName, FieldName, MapName, TextureName, UpName};
use pliant_geometry::Vector3;
use pliant_picture::{Axis, Background, Camera, ColourMap, Legend, Look, Plane, Projection, Style, Texture};

/// The view that a scene requests.
pub fn look_of(scene: &Scene) -> Look {
    let view = &scene.view;
    let camera = &view.camera;
    let mut look = Look {
        style: Style {
            map: map_of(view.map),
            range: view.range,
            labels: view.shows_labels(),
            edges: view.edges,
            wireframe: view.wireframe,
            ghost: view.ghost,
            fibres: view.fibres,
            contacts: view.contacts,
            critical: view.critical,
            maximum: view.mark_maximum,
            occlusion: view.occlusion,
            texture: texture_of(view.texture),
            clip: view.clip.and_then(|clip| Plane::through(&clip.point.into(), &clip.normal.into())),
            background: background_of(view.background),
        },
        camera: Camera {
            azimuth: camera.azimuth,
            elevation: camera.elevation,
            projection: if camera.orthographic { Projection::Orthographic } else { Projection::Perspective },
            up: Axis::nearest(&up(scene)),
            ..Camera::default()
        },
        target: camera.target.map(Vector3::from),
        zoom: camera.zoom,
        size: view.size,
        ..Look::default()
    };
    if let Some(field) = scene.shown_field() {
        colour_by(&mut look, field, view.component.map(|component| component.word()));
    }
    look.legend.title = scene.scene.title.clone();
    look
}

pub(crate) fn map_of(name: MapName) -> ColourMap {
    match name {
        MapName::Viridis => ColourMap::Viridis,
        MapName::Cividis => ColourMap::Cividis,
        MapName::Magma => ColourMap::Magma,
        MapName::Inferno => ColourMap::Inferno,
        MapName::Plasma => ColourMap::Plasma,
        MapName::Turbo => ColourMap::Turbo,
        MapName::BlueRed => ColourMap::BlueRed,
    }
}

pub(crate) fn background_of(name: BackgroundName) -> Background {
    match name {
        BackgroundName::Light => Background::Light,
        BackgroundName::White => Background::White,
        BackgroundName::Dark => Background::Dark,
    }
}

pub(crate) fn texture_of(name: TextureName) -> Texture {
    match name {
        TextureName::None => Texture::None,
        TextureName::Skin => Texture::Skin,
    }
}

/// The up direction: from the scene, or against gravity.
fn up(scene: &Scene) -> Vector3 {
    let gravity = || scene.scene.gravity.map(|gravity| -Vector3::from(gravity));
    scene.view.camera.up.map(UpName::direction).map(Vector3::from).or_else(gravity).unwrap_or_default()
}

fn colour_by(look: &mut Look, field: FieldName, component: Option<&str>) {
    let part = component.map(|part| format!(":{part}")).unwrap_or_default();
    look.field = Some(format!("{}{part}", field.name()));
    let part = component.map(|part| format!(" {part}")).unwrap_or_default();
    look.legend.quantity = format!("{}{part}", field.title());
    look.legend.unit = field.unit().into();
}

/// Colours by a field of any name, as in files, or by labels.
pub(crate) fn colour_by_name(look: &mut Look, name: &str) {
    look.style.labels = name == "label";
    let (field_name, part) =
        name.split_once(':').map_or((name, None), |(field_name, part)| (field_name, Some(part)));
    if name == "none" || look.style.labels {
        look.field = None;
        look.style.range = None;
    } else if let Some(field) = FieldName::of_name(field_name) {
        colour_by(look, field, part);
    } else {
        look.field = Some(name.into());
        look.legend = Legend { quantity: name.into(), unit: String::new(), ..look.legend.clone() };
    }
}

#[cfg(test)]
mod tests {
    use pliant_format::tables::Choice;

    use super::*;

    #[test]
    fn words_of_scenes_and_of_pictures_are_the_same() {
        let maps = MapName::WORDS;
        let seen: Vec<ColourMap> = maps.iter().map(|word| map_of(MapName::of_word(word).unwrap())).collect();
        assert_eq!(seen, ColourMap::ALL);
        assert_eq!(seen.iter().map(|map| map.name()).collect::<Vec<_>>(), maps);
        let backgrounds = BackgroundName::WORDS;
        let seen: Vec<Background> =
            backgrounds.iter().map(|word| background_of(BackgroundName::of_word(word).unwrap())).collect();
        assert_eq!(seen, [Background::Light, Background::White, Background::Dark]);
        let textures = TextureName::WORDS.iter().map(|word| texture_of(TextureName::of_word(word).unwrap()));
        assert_eq!(textures.collect::<Vec<_>>(), [Texture::None, Texture::Skin]);
    }
}
