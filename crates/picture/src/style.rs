//! Styles of bodies.

use crate::colour::ColourMap;
use crate::plane::Plane;

/// The background of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// Pale grey, lighter towards the bottom.
    #[default]
    Light,
    /// Plain white, for print.
    White,
    /// Dark grey.
    Dark,
}

impl Background {
    /// Colours (sRGB) at top and bottom.
    pub(crate) const fn colours(self) -> [[u8; 3]; 2] {
        match self {
            Self::Light => [[219, 226, 233], [250, 251, 252]],
            Self::White => [[255, 255, 255], [255, 255, 255]],
            Self::Dark => [[52, 57, 66], [24, 26, 31]],
        }
    }

    /// Colour (sRGB) of the text on it.
    pub const fn ink(self) -> [u8; 3] {
        match self {
            Self::Light | Self::White => [32, 36, 42],
            Self::Dark => [232, 235, 240],
        }
    }

    /// Colour (sRGB) of the shape at rest.
    pub(crate) const fn ghost(self) -> [u8; 3] {
        match self {
            Self::Light | Self::White => [70, 84, 104],
            Self::Dark => [190, 204, 224],
        }
    }
}

/// The texture of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Texture {
    /// Smooth and dull.
    #[default]
    None,
    /// Moist tissue, finely uneven: fixed to the body at rest, at any resolution. Under colours of values it
    /// is weaker.
    Skin,
}

/// Colour (sRGB) without a value: soft tissue.
pub(crate) const PLAIN: [u8; 3] = [214, 148, 132];

/// Colour (sRGB) of points without a value where others have one: no map has this grey.
pub const MISSING: [u8; 3] = [158, 162, 168];

/// Meaning of a plain colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Material {
    /// Soft tissue of any kind.
    #[default]
    Tissue,
    /// Dark red.
    Liver,
    /// Pale.
    Brain,
    /// Rose.
    Colon,
    /// Red.
    Artery,
    /// Blue, as in atlases.
    Vein,
    /// Yellow, as in plans of operations.
    Tumour,
    /// Ivory.
    Bone,
    /// Grey metal: of obstacles and tools.
    Steel,
}

impl Material {
    /// Every material.
    pub const ALL: [Self; 9] = [
        Self::Tissue,
        Self::Liver,
        Self::Brain,
        Self::Colon,
        Self::Artery,
        Self::Vein,
        Self::Tumour,
        Self::Bone,
        Self::Steel,
    ];

    /// Its word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tissue => "tissue",
            Self::Liver => "liver",
            Self::Brain => "brain",
            Self::Colon => "colon",
            Self::Artery => "artery",
            Self::Vein => "vein",
            Self::Tumour => "tumour",
            Self::Bone => "bone",
            Self::Steel => "steel",
        }
    }

    /// Its colour (sRGB).
    pub const fn colour(self) -> [u8; 3] {
        match self {
            Self::Tissue => PLAIN,
            Self::Liver => [150, 62, 52],
            Self::Brain => [222, 196, 182],
            Self::Colon => [222, 150, 142],
            Self::Artery => [196, 44, 40],
            Self::Vein => [62, 88, 170],
            Self::Tumour => [226, 190, 84],
            Self::Bone => [228, 218, 192],
            Self::Steel => [162, 168, 175],
        }
    }
}

/// Gloss of a material, and the variation of its colour if it has a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Finish {
    /// Light of the highlight of a white lamp.
    pub shine: f32,
    /// Blinn's exponent: the larger, the smaller the highlight.
    pub sharpness: f32,
    /// Variation of the colour with the blood below, from 0 to 1.
    pub perfusion: f32,
}

/// Finish of surfaces that show values and labels, and of tissue without a texture.
pub(crate) const DULL: Finish = Finish { shine: 0.10, sharpness: 40.0, perfusion: 0.0 };

impl Material {
    /// Its gloss: wet serous surfaces (liver, colon) shine more than the brain, bone is dull, steel sharp.
    pub(crate) const fn finish(self) -> Finish {
        let [shine, sharpness, perfusion] = match self {
            Self::Tissue => return DULL,
            Self::Liver => [0.26, 70.0, 1.0],
            Self::Brain => [0.16, 45.0, 0.7],
            Self::Colon => [0.30, 80.0, 0.9],
            Self::Artery | Self::Vein => [0.24, 60.0, 0.5],
            Self::Tumour => [0.18, 50.0, 0.6],
            Self::Bone => [0.05, 14.0, 0.25],
            Self::Steel => [0.45, 110.0, 0.0],
        };
        Finish { shine, sharpness, perfusion }
    }
}

/// Style of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Colours of values.
    pub map: ColourMap,
    /// The values of the first and the last colour; without, a body has the colour of tissue.
    pub range: Option<[f64; 2]>,
    /// True if colours show labels instead of values. Cells without a label have the colour of tissue.
    pub labels: bool,
    /// True if the edges of the cells are drawn.
    pub edges: bool,
    /// True if only the edges of the surface cells are drawn.
    pub wireframe: bool,
    /// True if the shape at rest is drawn, as a ghost.
    pub ghost: bool,
    /// True if fibres are drawn, on the surface and in a section.
    pub fibres: bool,
    /// True if the forces of contacts are drawn, as arrows through the bodies.
    pub contacts: bool,
    /// True if the cell with the smallest stable step is marked.
    pub critical: bool,
    /// True if the largest value is marked with a ring and its number.
    pub maximum: bool,
    /// True if folds and contacts are darker, where less light arrives.
    pub occlusion: bool,
    /// The texture of the surface.
    pub texture: Texture,
    /// Shows only the part behind a plane, and its section.
    pub clip: Option<Plane>,
    /// The background.
    pub background: Background,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            map: ColourMap::default(),
            range: None,
            labels: false,
            edges: false,
            wireframe: false,
            ghost: false,
            fibres: false,
            contacts: false,
            critical: false,
            maximum: false,
            occlusion: true,
            texture: Texture::default(),
            clip: None,
            background: Background::default(),
        }
    }
}

impl Style {
    /// True if surfaces take light from each other: edges alone do not.
    pub(crate) fn is_occluded(&self) -> bool {
        self.occlusion && !self.wireframe
    }

    /// True if colours show labels or values.
    pub(crate) fn tells(&self) -> bool {
        self.labels || self.range.is_some()
    }
}
