//! From values to colours: perceptual maps, most of them safe for the colour-blind, and the range that they
//! span. From labels to colours: one for each, the same in every picture.

/// A map of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark violet over green to yellow; even to all eyes.
    #[default]
    Viridis,
    /// Blue over grey to yellow; the same to those who see no red or green.
    Cividis,
    /// Black over red to pale yellow.
    Magma,
    /// Black over red to yellow.
    Inferno,
    /// Blue over red to yellow.
    Plasma,
    /// The rainbow, made even; not for the colour-blind.
    Turbo,
    /// Blue over white to red, for values around zero.
    BlueRed,
}

impl ColourMap {
    /// Every map.
    pub const ALL: [Self; 7] =
        [Self::Viridis, Self::Cividis, Self::Magma, Self::Inferno, Self::Plasma, Self::Turbo, Self::BlueRed];

    /// Its word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Cividis => "cividis",
            Self::Magma => "magma",
            Self::Inferno => "inferno",
            Self::Plasma => "plasma",
            Self::Turbo => "turbo",
            Self::BlueRed => "blue-red",
        }
    }

    /// True if the middle of the map has a distinct colour, which stands for zero.
    pub(crate) const fn is_diverging(self) -> bool {
        matches!(self, Self::BlueRed)
    }

    /// Returns the part of the map for a value that all points share. It is the middle of a diverging map,
    /// and the beginning of the others.
    pub const fn part_of_one_value(self) -> f64 {
        if self.is_diverging() { 0.5 } else { 0.0 }
    }

    /// The colour (sRGB) of a part of the range from 0 to 1.
    pub fn at(self, part: f64) -> [u8; 3] {
        let (gradient, part) = match self {
            Self::Viridis => (colorous::VIRIDIS, part),
            Self::Cividis => (colorous::CIVIDIS, part),
            Self::Magma => (colorous::MAGMA, part),
            Self::Inferno => (colorous::INFERNO, part),
            Self::Plasma => (colorous::PLASMA, part),
            Self::Turbo => (colorous::TURBO, part),
            Self::BlueRed => (colorous::RED_BLUE, 1.0 - part),
        };
        gradient.eval_continuous(part).as_array()
    }

    /// 256 colours in linear light, for the shader.
    pub(crate) fn table(self) -> Vec<[f32; 4]> {
        let colour = |index: u32| {
            let [r, g, b] = self.at(f64::from(index) / 255.0).map(linear);
            [r, g, b, 1.0]
        };
        (0..256).map(colour).collect()
    }
}

/// Colours of the labels from 0: grey, then the colours of Okabe and Ito (2008), which colour-blind people
/// can distinguish.
const FIRST: [[u8; 3]; 8] = [
    [153, 153, 153],
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
];
/// Turn of the hue from one label to the next, the golden section: any number of labels spread evenly.
const TURN: f64 = 0.618_033_988_749_894_9;
/// Cycle of lightness and chroma (OKLab). Hues repeat nearly after a Fibonacci number of labels; the first
/// one divisible by nine is 144, so similar hues differ in lightness before.
const TONES: [[f64; 2]; 9] = [
    [0.69, 0.11],
    [0.55, 0.16],
    [0.75, 0.16],
    [0.81, 0.10],
    [0.36, 0.11],
    [0.62, 0.08],
    [0.42, 0.11],
    [0.88, 0.10],
    [0.49, 0.11],
];

/// The colour (sRGB) of a label, the same in every picture. The first two dozen are easy to distinguish;
/// among hundreds some look alike.
pub fn label_colour(label: i32) -> [u8; 3] {
    if let Some(&colour) = usize::try_from(label).ok().and_then(|label| FIRST.get(label)) {
        return colour;
    }
    // Labels below zero are the highest of all as unsigned numbers.
    let number = label as u32;
    let [lightness, chroma] = TONES[number as usize % TONES.len()];
    let hue = std::f64::consts::TAU * (f64::from(number) * TURN).fract();
    of_oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// The nearest colour (sRGB) of one in OKLab (Ottosson 2020).
fn of_oklab(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let long = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let medium = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let short = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701_0 * short,
    ]
    .map(|light| {
        let coded = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
        (255.0 * coded.clamp(0.0, 1.0)).round() as u8
    })
}

/// The light of a byte of sRGB (IEC 61966-2-1).
pub(crate) fn linear(byte: u8) -> f32 {
    let s = f32::from(byte) / 255.0;
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Collects values to find the range that colours span: single corners with extreme values do not take the
/// whole map.
#[derive(Clone, Debug, Default)]
pub struct Extremes {
    values: Vec<f32>,
    /// The size below which a value is round-off.
    noise: f64,
}

/// Part of the values that the range leaves out at each end.
const LEFT_OUT: f64 = 0.005;
/// Relative difference up to which values count as equal: some digits of single precision.
pub(crate) const EQUAL: f64 = 1e-6;

/// Returns the size below which values of a unit are round-off, on bodies of an extent [m]. For displacements
/// it is a millionth of the extent. For stresses [Pa] it is the stress that strains the softest tissue (100
/// Pa) by 10⁻⁵. For other units, whose scale is unknown, it is zero.
pub fn noise(unit: &str, extent: f64) -> f64 {
    match unit {
        "m" => 1e-6 * extent,
        "Pa" => 1e-3,
        _ => 0.0,
    }
}

impl Extremes {
    /// Without values yet; if all are smaller than a size, they count as zero.
    pub fn above(noise: f64) -> Self {
        Self { noise, ..Self::default() }
    }

    /// Returns the least and the greatest value, including the values outside of the range.
    pub fn ends(&self) -> Option<[f64; 2]> {
        let ends = self.values.iter().map(|&value| [value; 2]).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        ends.map(|ends| ends.map(f64::from))
    }

    /// Adds values of a frame; non-finite ones are ignored.
    pub fn add(&mut self, values: impl IntoIterator<Item = f64>) {
        self.values.extend(values.into_iter().filter(|value| value.is_finite()).map(|value| value as f32));
    }

    /// Returns the range without the outermost values; `None` without values. The range begins at zero if no
    /// value is negative. If many values have either sign, or the map diverges, it lies around zero. Equal
    /// values have a range of length zero.
    pub fn range(mut self, map: ColourMap) -> Option<[f64; 2]> {
        if self.values.is_empty() {
            return None;
        }
        self.values.sort_unstable_by(f32::total_cmp);
        let last = self.values.len() - 1;
        let at = |part: f64| f64::from(self.values[(part * last as f64).round() as usize]);
        let (least, most) = (f64::from(self.values[0]), f64::from(self.values[last]));
        if least.abs().max(most.abs()) < self.noise {
            return Some([0.0; 2]);
        }
        if most - least <= EQUAL * most.abs().max(least.abs()) {
            return Some([most; 2]);
        }
        let (low, high) = (at(LEFT_OUT), at(1.0 - LEFT_OUT));
        // Values that hardly differ keep their whole range.
        let (low, high) = if high > low { (low, high) } else { (least, most) };
        let both = low < 0.0 && high > 0.0 && low.abs().min(high) > 0.2 * low.abs().max(high);
        Some(if map.is_diverging() || both {
            let reach = high.max(-low);
            [-reach, reach]
        } else if least >= 0.0 && low < 0.5 * high {
            [0.0, high]
        } else {
            [low, high]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightness of a colour (CIE L*).
    fn lightness(colour: [u8; 3]) -> f32 {
        let [r, g, b] = colour.map(linear);
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn sequential_maps_grow_lighter_all_the_way() {
        for map in
            [ColourMap::Viridis, ColourMap::Cividis, ColourMap::Magma, ColourMap::Inferno, ColourMap::Plasma]
        {
            let steps: Vec<f32> = (0..=20).map(|i| lightness(map.at(f64::from(i) / 20.0))).collect();
            assert!(steps.is_sorted(), "{map:?}: {steps:?}");
        }
        assert_eq!(ColourMap::Viridis.at(0.0), [0x44, 0x01, 0x54]);
        assert!(ColourMap::BlueRed.at(0.0)[2] > 90 && ColourMap::BlueRed.at(1.0)[0] > 90);
    }

    #[test]
    fn labels_have_colours_that_are_told_apart() {
        assert_eq!(label_colour(5), [0, 114, 178], "Okabe and Ito's blue");
        let colours: Vec<[u8; 3]> = (0..118).chain([1001, 1002, -1]).map(label_colour).collect();
        let apart = |[a, b]: [&[u8; 3]; 2]| -> u32 {
            (0..3).map(|c| u32::from(a[c].abs_diff(b[c])).pow(2)).sum::<u32>().isqrt()
        };
        for (at, colour) in colours.iter().enumerate() {
            for other in &colours[..at] {
                let least = if at < 24 { 30 } else { 10 };
                assert!(apart([colour, other]) >= least, "{at}: {colour:?} and {other:?}");
            }
        }
        // Neighbours, as organs of one atlas, are far from each other.
        assert!(colours[..40].windows(2).all(|pair| apart([&pair[0], &pair[1]]) > 60), "{colours:?}");
        assert_eq!(of_oklab(1.0, 0.0, 0.0), [255; 3]);
    }

    fn range(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
        let mut extremes = Extremes::default();
        extremes.add(values);
        extremes.range(ColourMap::Viridis)
    }

    #[test]
    fn ranges_start_at_zero_or_lie_around_it_and_forget_single_corners() {
        let many = (0..=1000).map(f64::from);
        assert_eq!(range(many.clone()), Some([0.0, 995.0]));
        assert_eq!(range(many.clone().chain([1e9])), Some([0.0, 996.0]));
        assert_eq!(range(many.clone().map(|x| x - 400.0)), Some([-595.0, 595.0]));
        assert_eq!(range(many.map(|x| x + 2000.0)), Some([2005.0, 2995.0]));
        assert_eq!(range([f64::NAN]), None);
        assert_eq!(range([0.0, 0.0]), Some([0.0, 0.0]), "no range is made up");
        assert_eq!(range([4.0, f64::NAN]), Some([4.0, 4.0]));
        assert_eq!(range([2.0, 2.000_000_1]), Some([2.000_000_1_f32.into(); 2]), "round-off is no range");
        let at_rest = |noise: f64| {
            let mut extremes = Extremes::above(noise);
            extremes.add([0.0, 3e-9, -2e-9]);
            (extremes.ends(), extremes.range(ColourMap::Viridis))
        };
        assert_eq!(at_rest(noise("m", 0.1)).1, Some([0.0; 2]), "a body of 10 cm at rest");
        assert_eq!(at_rest(noise("m", 1e-6)).0, Some([-2e-9_f32, 3e-9].map(f64::from)));
        assert!(at_rest(noise("m", 1e-6)).1.is_some_and(|[low, high]| low < high));
        let mut extremes = Extremes::default();
        extremes.add((0..=1000).map(|x| f64::from(x) - 100.0));
        assert_eq!(extremes.range(ColourMap::BlueRed), Some([-895.0, 895.0]), "white is zero");
    }
}
