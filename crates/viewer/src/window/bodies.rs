//! The list of what is shown: bodies, obstacles, tools and labels, with what of them is seen and how.

use std::collections::BTreeMap;

use eframe::egui;
use pliant_geometry::{CellLabel, Region, RegionNames};
use pliant_picture::{Coat, Regions, label_colour};
use pliant_scene::format::{Choice, LookColour, LookTable};

use super::App;
use crate::regions::{coat_of, regions_of};

/// The least opacity of the slider: what is to be gone is hidden, so that it cannot be taken hold of either.
const LEAST: f64 = 0.05;
/// Height of the list on the screen.
const HEIGHT: f32 = 280.0;

/// Looks by name, as in a view.
type Looks = BTreeMap<String, LookTable>;

/// A line of the list.
struct Row {
    region: Region,
    /// As it is typed in a scene, and as it is read.
    name: CellLabel,
    text: String,
}

/// What is shown: bodies by name, then labels.
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
    // A name that a label has, too, is that of the label.
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
                if ui.checkbox(&mut shown, text).on_hover_text("shows it, or leaves it out").changed() {
                    hidden.retain(|other| other != region);
                    hidden.extend((!shown).then_some(*region));
                }
            });
            let name = name.to_string();
            let mut look = looks.get(&name).copied().unwrap_or_default();
            let edited = ui.horizontal(|ui| edit_look(ui, text, &mut look)).inner;
            if edited && look == LookTable::default() {
                looks.remove(&name);
            } else if edited {
                looks.insert(name, look);
            }
        }
    });
    if !hidden.is_empty() && ui.button("Show all").clicked() {
        hidden.clear();
    }
    // Something has to be left to be seen.
    let left = |is_label: bool| {
        let mut own = rows.iter().filter(|row| matches!(row.region, Region::Label(_)) == is_label).peekable();
        own.peek().is_none() || own.any(|row| !hidden.contains(&row.region))
    };
    let changed = hidden != before && left(true) && left(false);
    if changed {
        *hide = rows.into_iter().filter(|row| hidden.contains(&row.region)).map(|row| row.name).collect();
    }
    changed
}

/// Opacity and colour; whether they were changed.
fn edit_look(ui: &mut egui::Ui, name: &str, look: &mut LookTable) -> bool {
    let before = *look;
    ui.add_space(18.0);
    ui.spacing_mut().slider_width = 60.0;
    ui.add(egui::Slider::new(&mut look.opacity, LEAST..=1.0).max_decimals(2))
        .on_hover_text("opacity: below 1 one sees what lies inside and behind");
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

/// The list of a finished run, whose frames keep all cells: what is hidden is invisible.
#[derive(Default)]
pub(super) struct Listed {
    pub names: RegionNames,
    hide: Vec<CellLabel>,
    looks: Looks,
}

impl Listed {
    /// Draws it; how a picture shows what it says.
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
