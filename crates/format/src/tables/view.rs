//! View of a scene, in pictures and in the window.

use std::collections::BTreeMap;

use pliant_geometry::{CellLabel, Region, RegionNames};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{FieldName, MOST_CURVED};

/// A choice among words, such as [`MapName`].
pub trait Choice: DeserializeOwned {
    /// Its words in the scene file.
    const WORDS: &[&str];

    /// Choice that a word stands for; `None` for an unknown word.
    fn of_word(word: &str) -> Option<Self> {
        serde_json::from_value(word.into()).ok()
    }
}

impl Choice for MapName {
    const WORDS: &[&str] = &["viridis", "cividis", "magma", "inferno", "plasma", "turbo", "blue-red"];
}

impl Choice for BackgroundName {
    const WORDS: &[&str] = &["light", "white", "dark"];
}

impl Choice for LookColour {
    const WORDS: &[&str] =
        &["view", "label", "tissue", "liver", "brain", "colon", "artery", "vein", "tumour", "bone", "steel"];
}

impl Choice for TextureName {
    const WORDS: &[&str] = &["none", "skin"];
}

/// View for pictures and films of the scene (`pliant render`, `pliant run --picture`) and for the window at
/// the start (`pliant view`). It does not change the run.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ViewTable {
    /// The body or the carried surface that is shown; if not given, all bodies together.
    #[serde(default)]
    pub on: Option<String>,
    /// Quantity that the colours show; `label`: the labels of the elements, each in a colour of its own;
    /// `none`: the colour of tissue. If not given, `von-mises`, and `displacement` on surfaces that shells
    /// carry.
    #[serde(default)]
    pub colour: Option<ColourBy>,
    /// Parts to hide, so that parts inside or behind are seen, as `[2, "tumour", "5-8", "grasper"]`. Labels
    /// of elements are given by number, name or range, and bodies, obstacles and tools by name. A name that a
    /// label and a body share means the label.
    #[serde(default)]
    pub hide: Vec<CellLabel>,
    /// Parts that look different from the rest, by names as in `hide`:
    /// `look.liver = { opacity = 0.3, colour = "liver" }`. The opacity goes from 0 to 1; the colour is `view`
    /// (as the rest), `label`, `tissue`, `liver`, `brain`, `colon`, `artery`, `vein`, `tumour`, `bone` or
    /// `steel`.
    #[serde(default)]
    pub look: BTreeMap<String, LookTable>,
    /// A component of a vector (`x`, `y`, `z`) or a tensor (`xx`, `xy`, …), instead of the size of a vector;
    /// a tensor needs one.
    #[serde(default)]
    pub component: Option<Component>,
    /// The map of colours; all but `turbo` look even to eyes that see no red or green.
    #[serde(default)]
    pub map: MapName,
    /// Values of the first and the last colour, in SI units; if not given, from the values of all frames
    /// without the outermost 0.5 %.
    #[serde(default)]
    pub range: Option<[f64; 2]>,
    /// True to draw the edges of the elements.
    #[serde(default)]
    pub edges: bool,
    /// True to draw only the edges of the elements on the surface.
    #[serde(default)]
    pub wireframe: bool,
    /// True to draw the shape at rest, as a ghost.
    #[serde(default)]
    pub ghost: bool,
    /// True to draw fibres on the surface and in a section, as short lines that follow the deformation.
    #[serde(default)]
    pub fibres: bool,
    /// True to draw the forces of contacts, through the bodies: a dot at each node in contact, and an arrow
    /// along the force on it. The note shows the force of the longest arrow.
    #[serde(default)]
    pub contacts: bool,
    /// True to mark constraints and loads, through the bodies. Squares mark held nodes, dots moved nodes, and
    /// bars nodes under plates. Arrows point along the forces of loads, and one along the weight of all. At
    /// most 300 of each kind are drawn.
    #[serde(default)]
    pub marks: bool,
    /// True to mark the element with the smallest `element-step`, through the body. Shells are then shown
    /// flat.
    #[serde(default)]
    pub critical: bool,
    /// True to mark the largest value that the colours show, by a ring at its place and the number. The ring
    /// is dashed if something hides the place.
    #[serde(default = "yes")]
    pub mark_maximum: bool,
    /// True to darken folds and contacts, where less light from all sides arrives.
    #[serde(default = "yes")]
    pub occlusion: bool,
    /// Texture of the surface. It is fixed in the body at rest, and moves with the body.
    #[serde(default)]
    pub texture: TextureName,
    /// A cutting plane: everything on the side of its normal is taken away, so that the inside is seen.
    #[serde(default)]
    pub clip: Option<ClipTable>,
    /// The instant of a single picture [s]; if not given, the end of the run.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub at: Option<f64>,
    /// Camera of the view.
    #[serde(default)]
    pub camera: CameraTable,
    /// Background of the picture.
    #[serde(default)]
    pub background: BackgroundName,
    /// Width and height of pictures [pixels].
    #[serde(default = "size")]
    #[schemars(inner(range(min = 16, max = 16384)))]
    pub size: [u32; 2],
    /// Parts that each edge of a shell is cut into, to show its curved surface; 1: flat triangles.
    #[serde(default = "four")]
    #[schemars(range(min = 1, max = MOST_CURVED))]
    pub curved: u32,
}

/// Look of a body, an obstacle, a tool or the elements of a label.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LookTable {
    /// Opacity from 0, invisible, to 1, opaque: a body of 0.3 shows its inside.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub opacity: f64,
    /// Source of its colour.
    #[serde(default)]
    pub colour: LookColour,
}

impl Default for LookTable {
    fn default() -> Self {
        Self { opacity: one(), colour: LookColour::default() }
    }
}

/// Source of the colour of a body, an obstacle, a tool or the elements of a label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LookColour {
    /// Same as the rest: `colour` of the view; steel for obstacles and tools.
    #[default]
    View,
    /// The colour of each label.
    Label,
    /// The colour of soft tissue.
    Tissue,
    /// Dark red.
    Liver,
    /// Pale.
    Brain,
    /// Rose.
    Colon,
    /// Red.
    Artery,
    /// Blue.
    Vein,
    /// Yellow.
    Tumour,
    /// Ivory.
    Bone,
    /// Grey.
    Steel,
}

fn size() -> [u32; 2] {
    [1280, 800]
}

fn four() -> u32 {
    4
}

/// Quantity that colours show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ColourBy {
    /// Nothing.
    Nothing(Nothing),
    /// The labels of elements.
    Labels(Labels),
    /// A field.
    Field(FieldName),
}

/// The word `label`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Labels {
    /// Cell data `label`.
    Label,
}

/// The word `none`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Nothing {
    /// No field.
    None,
}

/// A component of a vector or a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Component {
    X,
    Y,
    Z,
    Xx,
    Yy,
    Zz,
    Xy,
    Yz,
    Xz,
}

impl Component {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Xx => "xx",
            Self::Yy => "yy",
            Self::Zz => "zz",
            Self::Xy => "xy",
            Self::Yz => "yz",
            Self::Xz => "xz",
        }
    }

    /// Number of components of the values that have it: 3 for vectors, 9 for tensors.
    pub fn of(self) -> usize {
        if self.word().len() == 1 { 3 } else { 9 }
    }
}

/// A map of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MapName {
    /// Dark violet over green to yellow.
    #[default]
    Viridis,
    /// Blue over grey to yellow.
    Cividis,
    /// Black over red to pale yellow.
    Magma,
    /// Black over red to yellow.
    Inferno,
    /// Blue over red to yellow.
    Plasma,
    /// The rainbow, made even.
    Turbo,
    /// Blue over white to red, for values around zero.
    BlueRed,
}

/// Texture of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TextureName {
    /// Smooth and dull.
    #[default]
    None,
    /// Moist tissue, finely uneven.
    Skin,
}

/// Background of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundName {
    /// Pale grey, lighter towards the bottom.
    #[default]
    Light,
    /// Plain white, for print.
    White,
    /// Dark grey.
    Dark,
}

/// A plane.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ClipTable {
    /// A point on it [m].
    pub point: [f64; 3],
    /// Its normal, of any length but 0.
    pub normal: [f64; 3],
}

/// A camera that orbits its target.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CameraTable {
    /// Angle around the axis that points up [°]; with `up = "z"` 0 looks from the side of x, 90 from the side
    /// of y.
    #[serde(default = "azimuth")]
    pub azimuth: f64,
    /// Angle above the horizon [°].
    #[serde(default = "elevation")]
    #[schemars(range(min = -90.0, max = 90.0))]
    pub elevation: f64,
    /// Magnification; at 1 everything fits the picture.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub zoom: f64,
    /// Point in the middle of the picture [m]; if not given, the point that fits the picture best.
    #[serde(default)]
    pub target: Option<[f64; 3]>,
    /// The axis that points up; if not given, against gravity, and `z` without gravity.
    #[serde(default)]
    pub up: Option<UpName>,
    /// True if parallel lines stay parallel.
    #[serde(default)]
    pub orthographic: bool,
}

fn azimuth() -> f64 {
    -55.0
}

fn elevation() -> f64 {
    22.0
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

impl Default for CameraTable {
    fn default() -> Self {
        Self {
            azimuth: azimuth(),
            elevation: elevation(),
            zoom: one(),
            target: None,
            up: None,
            orthographic: false,
        }
    }
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[allow(missing_docs)]
pub enum UpName {
    #[serde(rename = "x")]
    X,
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "z")]
    Z,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "-z")]
    MinusZ,
}

impl UpName {
    /// Its direction.
    pub fn direction(self) -> [f64; 3] {
        match self {
            Self::X => [1.0, 0.0, 0.0],
            Self::Y => [0.0, 1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
            Self::MinusX => [-1.0, 0.0, 0.0],
            Self::MinusY => [0.0, -1.0, 0.0],
            Self::MinusZ => [0.0, 0.0, -1.0],
        }
    }
}

impl ViewTable {
    /// True if the colours show labels.
    pub fn shows_labels(&self) -> bool {
        matches!(self.colour, Some(ColourBy::Labels(_)))
    }

    /// The existing regions that it hides. Other names are left out: a scene with them is refused when it is
    /// built.
    pub fn hidden(&self, names: &RegionNames) -> Vec<Region> {
        self.hide.iter().filter_map(|name| names.find(name).ok()).flatten().collect()
    }

    /// The existing regions with a look of their own.
    pub fn looks(&self, names: &RegionNames) -> Vec<(Region, LookTable)> {
        let regions = |name: &String| names.find(&CellLabel::Name(name.clone())).unwrap_or_default();
        let of = |(name, look): (&String, &LookTable)| {
            regions(name).into_iter().map(|region| (region, *look)).collect::<Vec<_>>()
        };
        self.look.iter().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that the words are the schema's.
    fn same<T: Choice + JsonSchema>() {
        let schema = schemars::schema_for!(T);
        let known = schema.get("oneOf").and_then(|choices| choices.as_array()).unwrap();
        let words: Vec<&str> = known.iter().map(|choice| choice["const"].as_str().unwrap()).collect();
        assert_eq!(words, T::WORDS);
        assert!(T::WORDS.iter().all(|word| T::of_word(word).is_some()) && T::of_word("jet").is_none());
    }

    #[test]
    fn choices_have_the_words_of_the_schema() {
        same::<MapName>();
        same::<BackgroundName>();
        same::<TextureName>();
        same::<LookColour>();
    }
}
