//! Regions of a picture (labels, bodies, obstacles and tools): hidden ones, transparent ones, and their
//! colours.

use pliant_geometry::Region;

use crate::colour::{label_colour, linear};
use crate::style::{DULL, Finish, Material, PLAIN};

/// Colour of a region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Paint {
    /// Colour by the rule for all bodies: values, labels or tissue; for obstacles and tools steel.
    #[default]
    AsAll,
    /// The colour of each label.
    Labels,
    /// One colour.
    Plain(Material),
}

/// Look of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// From 0, which hides it, to 1, through which nothing is seen.
    pub opacity: f64,
    /// Colour of the region.
    pub paint: Paint,
}

impl Default for Coat {
    fn default() -> Self {
        Self { opacity: 1.0, paint: Paint::AsAll }
    }
}

/// Hidden regions, and regions with their own look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// Regions whose cells are left out.
    pub hidden: Vec<Region>,
    /// Regions with a coat. The coat of a label has priority over the coat of a body.
    pub coats: Vec<(Region, Coat)>,
}

/// Properties by which cells look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Kind {
    pub label: Option<i32>,
    pub body: i32,
    /// True for an obstacle or a tool.
    pub thing: bool,
}

impl Regions {
    /// The coat of cells.
    pub(crate) fn coat(&self, kind: Kind) -> Coat {
        let of = |is_label: bool| {
            let mut coats =
                self.coats.iter().filter(|(region, _)| matches!(region, Region::Label(_)) == is_label);
            coats.find(|(region, _)| region.has(kind.label, kind.body)).map(|(_, coat)| *coat)
        };
        of(true).or_else(|| of(false)).unwrap_or_default()
    }
}

/// Codes for the shader in place of a colour: colour of the value, and colour of tissue.
const OF_VALUE: f32 = -1.0;
const OF_TISSUE: f32 = -2.0;

/// Returns the shader's data of cells: light of their colour and opacity, and their finish. With `labels`,
/// colours show labels.
pub(crate) fn light(kind: Kind, coat: Coat, labels: bool) -> [[f32; 4]; 2] {
    let Finish { shine, sharpness, perfusion } = match coat.paint {
        Paint::Plain(material) => material.finish(),
        Paint::AsAll if kind.thing => Material::Steel.finish(),
        Paint::AsAll | Paint::Labels => DULL,
    };
    [colour(kind, coat, labels), [shine, sharpness, perfusion, 0.0]]
}

/// Light of the colour of cells, and their opacity.
fn colour(kind: Kind, coat: Coat, labels: bool) -> [f32; 4] {
    let opacity = coat.opacity.clamp(0.0, 1.0) as f32;
    let of = |bytes: [u8; 3]| {
        let [r, g, b] = bytes.map(linear);
        [r, g, b, opacity]
    };
    let none = |which: f32| [which, 0.0, 0.0, opacity];
    match coat.paint {
        Paint::Plain(material) if material.colour() == PLAIN => none(OF_TISSUE),
        Paint::Plain(material) => of(material.colour()),
        Paint::AsAll if kind.thing => of(Material::Steel.colour()),
        Paint::AsAll if !labels => none(OF_VALUE),
        Paint::AsAll | Paint::Labels => kind.label.map_or(none(OF_TISSUE), |label| of(label_colour(label))),
    }
}
