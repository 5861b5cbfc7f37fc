//! Regions as a view has them, for pictures.

use pliant_format::tables::{LookColour, LookTable, ViewTable};
use pliant_geometry::RegionNames;
use pliant_picture::{Coat, Material, Paint, Regions};

/// Returns the hidden regions of a view, and the regions with their own look.
pub fn regions_of(view: &ViewTable, names: &RegionNames) -> Regions {
    let coats = view.looks(names).into_iter().map(|(region, look)| (region, coat_of(look)));
    Regions { hidden: view.hidden(names), coats: coats.collect() }
}

/// Converts the look of a region in a scene to a coat of the picture.
pub fn coat_of(look: LookTable) -> Coat {
    Coat { opacity: look.opacity, paint: paint_of(look.colour) }
}

/// Converts the colour of a look to a paint of the picture.
fn paint_of(colour: LookColour) -> Paint {
    Paint::Plain(match colour {
        LookColour::View => return Paint::AsAll,
        LookColour::Label => return Paint::Labels,
        LookColour::Tissue => Material::Tissue,
        LookColour::Liver => Material::Liver,
        LookColour::Brain => Material::Brain,
        LookColour::Colon => Material::Colon,
        LookColour::Artery => Material::Artery,
        LookColour::Vein => Material::Vein,
        LookColour::Tumour => Material::Tumour,
        LookColour::Bone => Material::Bone,
        LookColour::Steel => Material::Steel,
    })
}

#[cfg(test)]
mod tests {
    use pliant_format::tables::Choice;

    use super::*;

    #[test]
    fn words_of_scenes_and_of_materials_are_the_same() {
        let words = LookColour::WORDS;
        let paints: Vec<Paint> =
            words.iter().map(|word| paint_of(LookColour::of_word(word).unwrap())).collect();
        assert_eq!(paints[..2], [Paint::AsAll, Paint::Labels]);
        assert_eq!(paints[2..], Material::ALL.map(Paint::Plain));
        assert_eq!(words[2..], Material::ALL.map(Material::name));
    }
}
