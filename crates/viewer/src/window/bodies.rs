//! The list of bodies, obstacles, tools and labels, with their visibility and look.

use std::collections::BTreeMap;

use eframe::egui;
use pliant_format::tables::{Choice, LookColour, LookTable};
use pliant_geometry::{CellLabel, Region, RegionNames};
use pliant_picture::{Coat, Regions, label_colour};

use super::App;
use crate::regions::{coat_of, regions_of};

/// Least opacity of the slider. Below it a region should be hidden instead, so that hands can't take it
/// either.
const LEAST: f64 = 0.05;
/// Height of the list on the screen.
const HEIGHT: f32 = 280.0;

/// Looks by name, as in a view.
type Looks = BTreeMap<String, LookTable>;

/// A line of the list.
struct Row {
    region: Region,
    /// Name as typed in a scene, and its text in the list.
    name: CellLabel,
    text: String,
}

/// Returns the rows of the list: bodies by name, then labels.
fn rows(names: &RegionNames) -> Vec<Row> {
    let labels = names.labels.iter().map(|(label, name)| Row {
        region: Region::Label(label),
        name: CellLabel::Number(label),
        text: format!("{label} {}", name.unwrap_or_default()).trim_end().to_owned(),
    });
    let body = |(&body, text): (&i32, &String)| Row {
        region: Region::Body(body),
        name: CellLabel::Name(text.clone()),
        text: text.clone(),
    };
    // A name that a label and a body share belongs to the label.
    let finds = |row: &Row| names.find(&row.name).is_ok_and(|found| found.contains(&row.region));
    names.bodies.iter().map(body).filter(finds).chain(labels).collect()
}

/// A tick, an opacity and a colour for each; whether others are hidden than before.
fn list(ui: &mut egui::Ui, names: &RegionNames, hide: &mut Vec<CellLabel>, looks: &mut Looks) -> bool {
    let rows = rows(names);
    let before: Vec<Region> = hide.iter().filter_map(|name| names.find(name).ok()).flatten().collect();
    let mut hidden = before.clone();
    egui::ScrollArea::vertical().id_salt("bodies").max_height(HEIGHT).show(ui, |ui| {
        for Row { region, name, text } in &rows {
            ui.horizontal(|ui| {
                if let Region::Label(label) = region {
                    let (place, _) = ui.allocate_exact_size(egui::vec2(14.0, 14.0), egui::Sense::hover());
                    let [r, g, b] = label_colour(*label);
                    ui.painter().rect_filled(place, 2.0, egui::Color32::from_rgb(r, g, b));
                }
                let mut shown = !hidden.contains(region);
                if ui.checkbox(&mut shown, text).on_hover_text("shows or hides it").changed() {
                    hidden.retain(|other| other != region);
                    hidden.extend((!shown).then_some(*region));
                }
            });
            let mut look = look_of(names, looks, *region).map(|(_, look)| look).unwrap_or_default();
            if ui.horizontal(|ui| edit_look(ui, text, &mut look)).inner {
                set_look(names, looks, *region, name, look);
            }
        }
    });
    if !hidden.is_empty() && ui.button("Show all").clicked() {
        hidden.clear();
    }
    // Something has to be left to be seen.
    let left = |is_label: bool| {
        let mut of_kind =
            rows.iter().filter(|row| matches!(row.region, Region::Label(_)) == is_label).peekable();
        of_kind.peek().is_none() || of_kind.any(|row| !hidden.contains(&row.region))
    };
    let changed = hidden != before && left(true) && left(false);
    if changed {
        *hide = rows.into_iter().filter(|row| hidden.contains(&row.region)).map(|row| row.name).collect();
    }
    changed
}

/// The look of a region with the name that gives it: the first one, as in pictures.
fn look_of(names: &RegionNames, looks: &Looks, region: Region) -> Option<(String, LookTable)> {
    let gives = |name: &String| regions_named(names, name).contains(&region);
    looks.iter().find(|(name, _)| gives(name)).map(|(name, look)| (name.clone(), *look))
}

fn regions_named(names: &RegionNames, name: &str) -> Vec<Region> {
    names.find(&CellLabel::Name(name.to_owned())).unwrap_or_default()
}

/// Gives a region a look, by the name that has given it one so far. A name of several labels is replaced by
/// the numbers of the others.
fn set_look(names: &RegionNames, looks: &mut Looks, region: Region, label: &CellLabel, look: LookTable) {
    let mut key = label.to_string();
    while let Some((name, shared)) = look_of(names, looks, region) {
        looks.remove(&name);
        let regions = regions_named(names, &name);
        if regions.len() == 1 {
            key = name;
        }
        for other in regions.into_iter().filter(|other| *other != region) {
            if let Region::Label(label) = other {
                looks.entry(label.to_string()).or_insert(shared);
            }
        }
    }
    if look != LookTable::default() {
        looks.insert(key, look);
    }
}

/// Opacity and colour; whether they were changed.
fn edit_look(ui: &mut egui::Ui, name: &str, look: &mut LookTable) -> bool {
    let before = *look;
    ui.add_space(18.0);
    ui.spacing_mut().slider_width = 60.0;
    ui.add(egui::Slider::new(&mut look.opacity, LEAST..=1.0).max_decimals(2))
        .on_hover_text("opacity: below 1, the inside and the background show through");
    let word = |colour: LookColour| LookColour::WORDS[colour as usize];
    egui::ComboBox::from_id_salt(("look", name)).selected_text(word(look.colour)).width(70.0).show_ui(
        ui,
        |ui| {
            for other in LookColour::WORDS.iter().filter_map(|word| LookColour::of_word(word)) {
                ui.selectable_value(&mut look.colour, other, word(other));
            }
        },
    );
    *look != before
}

impl App {
    /// Regions of the view, as the picture takes them.
    pub(super) fn look_at_regions(&mut self) {
        self.port.regions = regions_of(&self.view, &self.names);
    }

    /// The list; whether others are hidden than before.
    pub(super) fn bodies(&mut self, ui: &mut egui::Ui) -> bool {
        let changed = list(ui, &self.names, &mut self.view.hide, &mut self.view.look);
        self.look_at_regions();
        changed
    }
}

/// The list of a finished run. Its frames keep all cells: hidden regions are invisible.
#[derive(Default)]
pub(super) struct Listed {
    pub names: RegionNames,
    hide: Vec<CellLabel>,
    looks: Looks,
}

impl Listed {
    /// Draws the list, and returns the hidden regions and their looks for a picture.
    pub fn edit(&mut self, ui: &mut egui::Ui) -> Regions {
        list(ui, &self.names, &mut self.hide, &mut self.looks);
        let invisible = Coat { opacity: 0.0, ..Coat::default() };
        let hidden = self.hide.iter().map(|name| (name.clone(), invisible));
        let looks = self.looks.iter().map(|(name, look)| (CellLabel::Name(name.clone()), coat_of(*look)));
        let found = |(name, coat): (CellLabel, Coat)| {
            let regions = self.names.find(&name).unwrap_or_default();
            regions.into_iter().map(move |region| (region, coat))
        };
        Regions { hidden: Vec::new(), coats: hidden.chain(looks).flat_map(found).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_given_by_name_or_range_is_that_of_the_row_and_is_changed_there() {
        let named = [(1, None), (2, Some("tumour".to_owned())), (3, None), (4, None)];
        let names =
            RegionNames { labels: named.into_iter().collect(), bodies: [(1, "liver".to_owned())].into() };
        let look = |opacity| LookTable { opacity, ..LookTable::default() };
        let mut looks: Looks = [("tumour", 0.5), ("3-4", 0.3), ("liver", 0.2)]
            .map(|(name, o)| (name.to_owned(), look(o)))
            .into();
        let opacity = |looks: &Looks, region| look_of(&names, looks, region).map(|(_, look)| look.opacity);
        assert_eq!(opacity(&looks, Region::Label(2)), Some(0.5));
        assert_eq!(opacity(&looks, Region::Label(3)), Some(0.3));
        assert_eq!(opacity(&looks, Region::Label(1)), None);
        set_look(&names, &mut looks, Region::Label(2), &CellLabel::Number(2), look(0.6));
        set_look(&names, &mut looks, Region::Label(3), &CellLabel::Number(3), look(0.7));
        set_look(&names, &mut looks, Region::Body(1), &CellLabel::Name("liver".into()), look(1.0));
        let expected = [("3", 0.7), ("4", 0.3), ("tumour", 0.6)];
        assert_eq!(looks, expected.map(|(name, o)| (name.to_owned(), look(o))).into());
    }
}
