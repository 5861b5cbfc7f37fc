//! A list from which another scene is opened: the files of a folder, and the scenes that were opened last.

use std::fs;
use std::path::{Path, PathBuf};

use eframe::egui;
use pliant_scene::cache_folder;

use super::App;

/// Scenes that are remembered.
const REMEMBERED: usize = 10;
/// Width and height of the list on the screen.
const SIZE: [f32; 2] = [420.0, 380.0];

/// Something that can be opened.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Entry {
    /// A folder that holds other things.
    Folder(PathBuf),
    /// A scene (its folder or its file), or a mesh.
    Scene(PathBuf),
}

/// The list.
#[derive(Debug, Default)]
pub(super) struct Browser {
    pub shown: bool,
    folder: PathBuf,
    pub entries: Vec<Entry>,
    pub recent: Vec<PathBuf>,
}

impl Browser {
    /// Shows the folder around a scene, or hides the list.
    pub fn turn(&mut self, scene: &Path) {
        self.shown = !self.shown;
        let file = scene.canonicalize().unwrap_or_else(|_| scene.to_owned());
        let listed = if file.ends_with("scene.toml") { file.parent() } else { Some(&*file) };
        self.enter(listed.and_then(Path::parent).unwrap_or(&file).to_owned());
        self.recent = recent();
    }

    fn enter(&mut self, folder: PathBuf) {
        self.entries = entries(&folder);
        self.folder = folder;
    }

    /// Draws the list, and returns the chosen file.
    fn ui(&mut self, ui: &mut egui::Ui) -> Option<PathBuf> {
        let (mut chosen, mut next) = (None, None);
        if !self.recent.is_empty() {
            ui.label("Opened before");
            for path in &self.recent {
                if ui.link(path.display().to_string()).clicked() {
                    chosen = Some(path.clone());
                }
            }
            ui.separator();
        }
        ui.horizontal(|ui| {
            let above = self.folder.parent();
            let up = ui.add_enabled(above.is_some(), egui::Button::new("Up"));
            if up.on_hover_text("to the parent folder").clicked() {
                next = above.map(Path::to_owned);
            }
            ui.label(self.folder.display().to_string());
        });
        for entry in &self.entries {
            let (Entry::Folder(path) | Entry::Scene(path)) = entry;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            match entry {
                Entry::Folder(path) if ui.selectable_label(false, format!("{name}/")).clicked() => {
                    next = Some(path.clone())
                }
                Entry::Scene(path) if ui.selectable_label(false, &*name).clicked() => {
                    chosen = Some(path.clone())
                }
                _ => {}
            }
        }
        if let Some(folder) = next {
            self.enter(folder);
        }
        chosen
    }
}

/// Returns the files of a folder that can be opened: folders, then scenes and meshes, each by name. A folder
/// that cannot be read has no entries.
fn entries(folder: &Path) -> Vec<Entry> {
    let read = fs::read_dir(folder).into_iter().flatten().flatten();
    let entry = |path: PathBuf| {
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        let scene = path.extension().is_some_and(|end| end == "toml" || end == "xml")
            || pliant_format::is_mesh(&path);
        match path.is_dir() {
            _ if hidden => None,
            true if path.join("scene.toml").is_file() => Some(Entry::Scene(path)),
            true => Some(Entry::Folder(path)),
            false => scene.then_some(Entry::Scene(path)),
        }
    };
    let mut entries: Vec<Entry> = read.filter_map(|found| entry(found.path())).collect();
    entries.sort_unstable();
    entries
}

/// The file that remembers scenes, a path a line; `None` where nothing is kept.
fn memory() -> Option<PathBuf> {
    Some(cache_folder()?.join("recent-scenes"))
}

/// The scenes that were opened last and still are there, the last one first.
fn recent() -> Vec<PathBuf> {
    let text = memory().and_then(|file| fs::read_to_string(file).ok()).unwrap_or_default();
    text.lines().map(PathBuf::from).filter(|path| path.exists()).take(REMEMBERED).collect()
}

/// Remembers a scene. Where it cannot be written, it is forgotten.
pub(super) fn remember(scene: &Path) {
    let (Some(file), Ok(scene)) = (memory(), scene.canonicalize()) else { return };
    let mut scenes = recent();
    scenes.retain(|path| *path != scene);
    scenes.insert(0, scene);
    let lines: String = scenes.iter().take(REMEMBERED).map(|path| format!("{}\n", path.display())).collect();
    let _ = file.parent().map(fs::create_dir_all);
    let _ = fs::write(file, lines);
}

impl App {
    /// Draws the list while it is shown, and opens the chosen file.
    pub(super) fn browse(&mut self, context: &egui::Context) {
        if !self.browser.shown {
            return;
        }
        let mut open = true;
        let window = egui::Window::new("Open").open(&mut open).default_size(SIZE).collapsible(false);
        let shown =
            window.show(context, |ui| egui::ScrollArea::vertical().show(ui, |ui| self.browser.ui(ui)).inner);
        let chosen = shown.and_then(|shown| shown.inner.flatten());
        self.browser.shown = open && chosen.is_none();
        if let Some(path) = chosen {
            let scene = path.join("scene.toml");
            self.begin_reading(if scene.is_file() { scene } else { path }, context);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lists_folders_then_scenes_and_meshes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for made in ["organs", "liver", ".git"] {
            fs::create_dir(at(made)).unwrap();
        }
        for file in ["liver/scene.toml", "ball.toml", "skin.stl", "notes.md", "organs/a.csv"] {
            fs::write(at(file), "").unwrap();
        }
        let scenes = ["ball.toml", "liver", "skin.stl"].map(|name| Entry::Scene(at(name)));
        assert_eq!(entries(folder.path()), [&[Entry::Folder(at("organs"))], &scenes[..]].concat());
        let mut browser = Browser::default();
        browser.turn(&at("liver/scene.toml"));
        assert!(browser.shown && browser.entries.len() == 4);
        browser.turn(&at("ball.toml"));
        assert!(!browser.shown && browser.entries.len() == 4);
        assert!(entries(&at("nowhere")).is_empty());
    }
}
