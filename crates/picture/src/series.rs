//! Pictures of a series: the frames written by a run, with one view and one range of colours.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use pliant_geometry::io::{MeshFileError, read, read_torn_pvd};
use pliant_geometry::{Labels, Mesh, RegionNames, Vector3};

use crate::arrows::{self, PointForce, arrow_note, arrow_unit, contact_forces, largest_force};
use crate::camera::Camera;
use crate::colour::{Extremes, noise};
use crate::error::PictureError;
use crate::graphics::Graphics;
use crate::legend::{Legend, readable};
use crate::marks::{self, Mark, largest_load, marks_of};
use crate::maximum::{Maximum, largest_seen};
use crate::offscreen::{Frame, Offscreen};
use crate::outermost::Outermost;
use crate::picture::Picture;
use crate::regions::Regions;
use crate::section::Section;
use crate::sight::Sight;
use crate::style::Style;
use crate::subject::{Subject, critical_cell, deformed_points, nodal_values, visible};

/// A series of frames that can't be shown.
#[derive(Debug, thiserror::Error)]
pub enum SeriesError {
    /// The folder has no series.
    #[error("`{0}` has no series of frames (`*.pvd`)")]
    NoSeries(PathBuf),
    /// The folder has no series of that name.
    #[error("`{folder}` has no series `{name}`; it has {known}")]
    UnknownSeries {
        /// The folder.
        folder: PathBuf,
        /// The requested name.
        name: String,
        /// The existing names.
        known: String,
    },
    /// A list without a frame.
    #[error("`{0}` lists no frames")]
    NoFrames(PathBuf),
    /// A file that can't be read.
    #[error(transparent)]
    File(#[from] MeshFileError),
    /// The frames lack the field.
    #[error("the frames have no field `{field}` of single numbers; they have {known}")]
    NoField {
        /// The requested field.
        field: String,
        /// The existing fields.
        known: String,
    },
    /// Fibres were requested, but the frames have none.
    #[error("the cells of the frames have no fibres (the field `fibre`)")]
    NoFibres,
    /// The critical cell was requested, but the frames have no steps.
    #[error("the cells of the frames have no stable steps (the field `element-step`)")]
    NoSteps,
    /// Forces of contacts were requested, but the frames have none.
    #[error("the points of the frames have no forces of contacts (the field `contact-force`)")]
    NoContacts,
    /// Marks of constraints and loads were requested, but the frames have none.
    #[error("the points of the frames have no constraints and loads (the fields `constraint` and `load`)")]
    NoMarks,
    /// Colours of labels were requested, but the frames have none.
    #[error("the cells of the frames have no labels (the field `label`)")]
    NoLabels,
    /// Every cell is hidden.
    #[error("everything is hidden: nothing is visible")]
    AllHidden,
    /// A frame of another mesh than the first.
    #[error("the mesh of frame {0} differs from the first one")]
    OtherMesh(usize),
    /// A picture that can't be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

impl SeriesError {
    /// The remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NoSeries(_) => {
                "give a scene, or the folder of a run whose scene has an output of type `vtu`"
            }
            Self::UnknownSeries { .. } => "use one of its series",
            Self::NoFrames(_) => "run the scene again",
            Self::File(_) => "",
            Self::NoField { .. } => {
                "use one of these fields, a component such as `displacement:z` or `cauchy-stress:xx`, or \
                 `none`"
            }
            Self::NoFibres => {
                "show a body whose law has fibres; a finished run needs `fibre` in `data` of its output, `at = \"cells\"`"
            }
            Self::NoSteps => {
                "show bodies instead of carried surfaces; a finished run needs `element-step` in `data` of its output, `at = \"cells\"`"
            }
            Self::NoContacts => {
                "show bodies that touch something; a finished run needs `contact-force` in `data` of its output"
            }
            Self::NoMarks => {
                "a finished run needs `constraint` and `load` in `data` of an output of bodies, at the same \
                 times"
            }
            Self::NoLabels => {
                "show bodies whose mesh has cell data `label`, such as meshes from images with several labels"
            }
            Self::AllHidden => "hide less",
            Self::OtherMesh(_) => "run the scene again into an empty folder",
            Self::Picture(error) => error.remedy(),
        }
    }
}

/// The frames of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// Time [s] and file of each frame.
    pub frames: Vec<(f64, PathBuf)>,
}

impl Series {
    /// The names of all series in the folder of a run, in alphabetical order.
    ///
    /// # Errors
    /// If the folder cannot be read or has none.
    pub fn names(folder: &Path) -> Result<Vec<String>, SeriesError> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .map_err(|source| MeshFileError::Open { path: folder.to_owned(), source })?
            .filter_map(|entry| Some(entry.ok()?.file_name().to_str()?.strip_suffix(".pvd")?.to_owned()))
            .collect();
        names.sort_unstable();
        if names.is_empty() { Err(SeriesError::NoSeries(folder.to_owned())) } else { Ok(names) }
    }

    /// The series of a name in the folder of a run; without a name the first in alphabetical order.
    ///
    /// # Errors
    /// If none exists.
    pub fn find(folder: &Path, name: Option<&str>) -> Result<Self, SeriesError> {
        let names = Self::names(folder)?;
        let name = match name {
            None => names[0].clone(),
            Some(name) if names.iter().any(|known| known == name) => name.to_owned(),
            Some(name) => {
                let known = quoted(&names);
                return Err(SeriesError::UnknownSeries {
                    folder: folder.to_owned(),
                    name: name.to_owned(),
                    known,
                });
            }
        };
        let list = folder.join(format!("{name}.pvd"));
        // A run that was stopped as it wrote there left whole frames, too.
        let frames = read_torn_pvd(&list)?;
        if frames.is_empty() {
            return Err(SeriesError::NoFrames(list));
        }
        Ok(Self { name, frames })
    }

    /// The first series in the folder of a run that has constraints or loads.
    ///
    /// # Errors
    /// If none has, or the folder cannot be read.
    pub fn of_marks(folder: &Path) -> Result<Self, SeriesError> {
        for name in Self::names(folder)? {
            let series = Self::find(folder, Some(&name))?;
            let mesh = series.mesh(0)?;
            if marks_of(&mesh, &mesh.points).is_some() {
                return Ok(series);
            }
        }
        Err(SeriesError::NoMarks)
    }

    /// The mesh of the frame at a time [s].
    fn mesh_at(&self, time: f64) -> Result<Mesh, SeriesError> {
        let at = self.frames.iter().position(|(moment, _)| (moment - time).abs() <= 1e-9 * time.abs());
        self.mesh(at.ok_or(SeriesError::NoMarks)?)
    }

    /// Labels and bodies of its first frame.
    ///
    /// # Errors
    /// If it can't be read.
    pub fn regions(&self) -> Result<RegionNames, SeriesError> {
        Ok(RegionNames::of(&self.mesh(0)?))
    }

    fn mesh(&self, index: usize) -> Result<Mesh, SeriesError> {
        Ok(read(&self.frames[index].1)?.mesh)
    }

    /// The first of some fields that the frames have as single numbers at each point.
    ///
    /// # Errors
    /// If the first frame can't be read.
    pub fn first_field<'f>(&self, fields: &[&'f str]) -> Result<Option<&'f str>, SeriesError> {
        let mesh = self.mesh(0)?;
        Ok(fields.iter().copied().find(|field| nodal_values(&mesh, field).is_some()))
    }
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The view of meshes with fields.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// The field that colours show (see [`nodal_values`]); `None` for the colour of tissue.
    pub field: Option<String>,
    /// Hidden regions, and regions with their own look.
    pub regions: Regions,
    /// The style of bodies. Without a range, the values decide.
    pub style: Style,
    /// The camera; its target and height fit the body, except for the two below.
    pub camera: Camera,
    /// The target [m], unless fitted.
    pub target: Option<Vector3>,
    /// Magnification compared with a camera that fits the body; 0 counts as 1.
    pub zoom: f64,
    /// The series whose constraints and loads are marked; `None` for no marks.
    pub marks: Option<Series>,
    /// Width and height of pictures [pixels].
    pub size: [u32; 2],
    /// Their text; labels come from the mesh.
    pub legend: Legend,
}

/// Size of a gap [m] below which it is round-off: the finest tissue that is meshed has elements a thousand
/// times as large.
const LEAST_GAP: f64 = 1e-8;

/// Data that the frames share.
#[derive(Default)]
struct Common {
    extremes: Extremes,
    /// Points of the surface, in all frames.
    points: Outermost,
    /// The largest force of a contact and of a load [N].
    largest: [f64; 2],
    /// True if a part of a body has no value.
    missing: bool,
    /// Visible labels.
    labels: BTreeSet<i32>,
}

/// An instant that is drawn.
struct Shown {
    frame: Frame,
    /// The smallest stable step of a cell [s] if that cell is marked.
    step: Option<f64>,
    /// Forces of contacts, if they are drawn, and the least gap [m] with them.
    forces: Vec<PointForce>,
    gap: Option<f64>,
    /// Constraints and loads, if they are marked.
    marks: Vec<Mark>,
}

/// Settings that all pictures share.
struct Settled {
    camera: Camera,
    style: Style,
    /// Length of arrows over their force [m/N], and the largest force [N], of contacts and of loads.
    arrows: [[f64; 2]; 2],
    /// Text of every picture.
    legend: Legend,
}

impl Common {
    fn add(&mut self, subject: &Subject, shown: &Shown, style: &Style, regions: &Regions) {
        let frame = &shown.frame;
        let mut section = Section::default();
        if let Some(plane) = &style.clip {
            section.cut(subject, &frame.points, &frame.values, plane);
        }
        let is_seen = |point: &u32| {
            style.clip.is_none_or(|plane| plane.distance(&frame.points[*point as usize]) <= 0.0)
        };
        let largest = [largest_force(&shown.forces), largest_load(&shown.marks)];
        self.largest = [0, 1].map(|kind| self.largest[kind].max(largest[kind]));
        let mut showing = subject.showing_points(regions);
        showing.retain(is_seen);
        self.missing |= subject.lacks_value(&showing, &frame.values);
        self.extremes.add(showing.iter().filter_map(|&point| frame.values.get(point as usize)).copied());
        if !frame.values.is_empty() {
            self.extremes.add(section.values(subject, regions));
        }
        if style.labels {
            self.labels.extend(subject.labels_seen(regions, |point| is_seen(&point), section.kinds()));
        }
        let surface = subject.surface_points();
        self.points.add(surface.iter().map(|&point| frame.points[point as usize]));
        if style.ghost {
            self.points.add(surface.iter().map(|&point| subject.points[point as usize]));
        }
    }
}

impl Look {
    /// Prepares the drawing of a mesh with fields, with the marks of another mesh.
    fn frame(&self, mesh: &Mesh, marks: Option<&Mesh>) -> Result<Shown, SeriesError> {
        let missing =
            |field: &str| SeriesError::NoField { field: field.to_owned(), known: quoted(&fields(mesh)) };
        let values = match &self.field {
            None => Vec::new(),
            Some(field) => nodal_values(mesh, field).ok_or_else(|| missing(field))?,
        };
        let critical = (self.style.critical)
            .then(|| critical_cell(&visible(mesh, &self.regions.hidden)).ok_or(SeriesError::NoSteps))
            .transpose()?;
        let points = deformed_points(mesh);
        let (critical, step) = critical.unzip();
        let forces = match self.style.contacts {
            true => contact_forces(mesh, &points).ok_or(SeriesError::NoContacts)?,
            false => Vec::new(),
        };
        let gaps = mesh.point_data.get("gap").filter(|_| self.style.contacts);
        let gap =
            gaps.and_then(|gaps| gaps.values.iter().copied().filter(|gap| gap.is_finite()).reduce(f64::min));
        let marks = marks.map(|mesh| marks_of(mesh, &deformed_points(mesh)).ok_or(SeriesError::NoMarks));
        let marks = marks.transpose()?.unwrap_or_default();
        Ok(Shown { frame: Frame { points, values, critical }, step, forces, gap, marks })
    }

    /// Returns this look with the labels of a mesh in its legend.
    fn with_labels_of(&self, mesh: &Mesh) -> Result<Self, SeriesError> {
        let mut look = self.clone();
        if self.style.labels {
            let labels = Labels::of(&visible(mesh, &self.regions.hidden));
            if labels.is_empty() {
                return Err(if self.regions.hidden.is_empty() {
                    SeriesError::NoLabels
                } else {
                    SeriesError::AllHidden
                });
            }
            look.legend.labels =
                labels.iter().map(|(label, name)| (label, name.unwrap_or_default().to_owned())).collect();
        }
        Ok(look)
    }

    /// The drawn parts of a mesh.
    fn subject(&self, mesh: &Mesh) -> Result<Subject, SeriesError> {
        let subject = Subject::new(&visible(mesh, &self.regions.hidden));
        if subject.triangle_count() == 0 && !self.regions.hidden.is_empty() {
            return Err(SeriesError::AllHidden);
        }
        if self.style.fibres && !subject.has_fibres() {
            return Err(SeriesError::NoFibres);
        }
        Ok(subject)
    }

    /// Returns the shared data before the first frame.
    fn common(&self, subject: &Subject) -> Common {
        Common { extremes: Extremes::above(noise(&self.legend.unit, subject.extent())), ..Common::default() }
    }

    /// Camera, style, text and the length of arrows for all frames.
    fn settle(&self, common: Common) -> Settled {
        let mut style = self.style;
        let mut legend = Legend { missing: common.missing, ..self.legend.clone() };
        legend.labels.retain(|(label, _)| common.labels.contains(label));
        legend.ends = common.extremes.ends();
        style.range = self
            .field
            .as_ref()
            .and_then(|_| self.style.range.or_else(|| common.extremes.range(self.style.map)));
        let [width, height] = self.size.map(f64::from);
        // The colour scale is beside the body, not on it.
        let taken = legend.width(&style, self.size);
        let mut camera = self.camera;
        camera.fit(common.points.points(), width * (1.0 - taken) / height);
        if let Some(target) = self.target {
            camera.target = target;
        }
        if self.zoom > 0.0 {
            camera.zoom(1.0 / self.zoom);
        }
        camera.pan(-0.5 * taken * width / height, 0.0);
        let arrows = common.largest.map(|largest| [arrow_unit(common.points.points(), largest), largest]);
        Settled { camera, style, arrows, legend }
    }

    fn finished(
        &self,
        mut picture: Picture,
        subject: &Subject,
        settled: &Settled,
        shown: &Shown,
        time: f64,
    ) -> Picture {
        let Settled { camera, style, arrows: [contacts, loads], legend } = settled;
        let Frame { points, values, .. } = &shown.frame;
        let mut section = Section::default();
        let is_marked =
            style.maximum && !values.is_empty() && style.range.is_some_and(|[low, high]| low < high);
        if let Some(plane) = style.clip.filter(|_| is_marked || style.labels) {
            section.cut(subject, points, values, &plane);
        }
        let sight = Sight::new(subject, points, &self.regions, style.clip, &section, camera);
        let mut legend = legend.clone();
        if style.labels {
            let labels = legend.labels.iter().map(|(label, _)| *label);
            legend.hidden = sight.hidden_labels(&self.regions, labels);
        }
        let largest = largest_seen(subject, &self.regions, points, values, style.clip, &section);
        // Round-off in this frame has no maximum, even if the other frames have one.
        let least = noise(&legend.unit, subject.extent());
        if let Some((place, value)) = largest.filter(|(_, value)| is_marked && value.abs() >= least) {
            let [low, high] = style.range.unwrap_or_default();
            let (unit, factor) = readable(&legend.unit, low.abs().max(high.abs()));
            let beside = picture.width as f32 * (1.0 - legend.width(style, self.size) as f32);
            let maximum = Maximum { place, value, unit: &unit, factor, is_seen: sight.sees(&place) };
            maximum.draw(&mut picture, camera, style, beside);
        }
        marks::draw(&mut picture, camera, &shown.marks, loads[0]);
        arrows::draw(&mut picture, camera, &shown.forces, contacts[0]);
        let mut note =
            if self.legend.note.is_empty() { format!("t = {time:.3} s") } else { self.legend.note.clone() };
        for ([_, largest], of) in [(contacts, ""), (loads, " of loads")] {
            if *largest > 0.0 {
                note.push_str(&format!(", {}{of}", arrow_note(*largest)));
            }
        }
        if let Some(gap) = shown.gap {
            note.push_str(&format!(", {}", gap_note(gap)));
        }
        if let Some(step) = shown.step {
            let (unit, factor) = readable("s", step);
            note.push_str(&format!(", smallest element step {:.3} {unit} (marked)", step * factor));
        }
        if self.legend.unconverged > 0 {
            note.push_str(&format!(", steps that did not converge: {}", self.legend.unconverged));
        }
        Legend { note, ..legend }.write(&mut picture, style);
        picture
    }

    /// One picture of a mesh with fields at a time [s], with the constraints and loads of another mesh.
    ///
    /// # Errors
    /// If the field is missing, or drawing fails.
    pub fn picture(
        &self,
        graphics: &Graphics,
        mesh: &Mesh,
        marks: Option<&Mesh>,
        time: f64,
    ) -> Result<Picture, SeriesError> {
        let look = self.with_labels_of(mesh)?;
        let subject = look.subject(mesh)?;
        let shown = look.frame(mesh, marks)?;
        let mut common = look.common(&subject);
        common.add(&subject, &shown, &look.style, &look.regions);
        let settled = look.settle(common);
        let mut offscreen = Offscreen::new(graphics, &subject, look.size)?;
        let picture = offscreen.draw(&shown.frame, &settled.camera, &settled.style, &look.regions)?;
        Ok(look.finished(picture, &subject, &settled, &shown, time))
    }

    /// Pictures of chosen frames of a series: `take` receives each with its index.
    ///
    /// # Errors
    /// If a frame can't be read or drawn, or `take` fails.
    pub fn pictures(
        &self,
        graphics: &Graphics,
        series: &Series,
        frames: &[usize],
        mut take: impl FnMut(usize, Picture) -> Result<(), PictureError>,
    ) -> Result<(), SeriesError> {
        let Some(&first) = frames.first() else { return Ok(()) };
        let mesh = series.mesh(first)?;
        let look = self.with_labels_of(&mesh)?;
        let subject = look.subject(&mesh)?;
        let blocks =
            |mesh: &Mesh| mesh.blocks.iter().map(|block| (block.kind, block.len())).collect::<Vec<_>>();
        let shape = (mesh.points.len(), blocks(&mesh));
        let read = |index: usize| {
            let mesh = series.mesh(index)?;
            if (mesh.points.len(), blocks(&mesh)) != shape {
                return Err(SeriesError::OtherMesh(index));
            }
            let marks = look.marks.as_ref().map(|marks| marks.mesh_at(series.frames[index].0)).transpose()?;
            look.frame(&mesh, marks.as_ref())
        };
        let mut common = look.common(&subject);
        for &index in frames {
            common.add(&subject, &read(index)?, &look.style, &look.regions);
        }
        let settled = look.settle(common);
        let mut offscreen = Offscreen::new(graphics, &subject, look.size)?;
        for (count, &index) in frames.iter().enumerate() {
            let shown = read(index)?;
            let picture = offscreen.draw(&shown.frame, &settled.camera, &settled.style, &look.regions)?;
            take(count, look.finished(picture, &subject, &settled, &shown, series.frames[index].0))?;
        }
        Ok(())
    }
}

/// Formats the least gap [m]; round-off counts as 0.
fn gap_note(gap: f64) -> String {
    let (unit, factor) = readable("m", gap.abs().max(LEAST_GAP));
    match gap.abs() < LEAST_GAP {
        true => "least gap 0".into(),
        false => format!("least gap {:.3} {unit}", gap * factor).replace('-', "−"),
    }
}

/// Names of the fields of points and cells.
fn fields(mesh: &Mesh) -> Vec<String> {
    let cells = mesh.blocks.iter().flat_map(|block| block.data.keys());
    let mut names: Vec<String> = mesh.point_data.keys().chain(cells).cloned().collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use pliant_geometry::io::pvd_text;

    use super::*;

    #[test]
    fn gaps_of_round_off_are_none() {
        assert_eq!(
            [-1e-9, 0.0, 2e-5, -3e-4].map(gap_note),
            ["least gap 0", "least gap 0", "least gap 20.000 µm", "least gap −300.000 µm"]
        );
    }

    #[test]
    fn a_list_whose_writer_was_stopped_shows_its_whole_frames() {
        let folder = tempfile::tempdir().unwrap();
        let files = [0.0, 0.1, 0.2].map(|time| (time, format!("fields/{time}.vtu")));
        let list = pvd_text(files.into_iter()).unwrap();
        let frames = |text: &str| {
            std::fs::write(folder.path().join("fields.pvd"), text).unwrap();
            Series::find(folder.path(), None).map(|series| series.frames.len()).ok()
        };
        let last = list.find("0.2.vtu").unwrap();
        assert_eq!([frames(&list), frames(&list[..last]), frames("<VTKFile")], [Some(3), Some(2), None]);
    }
}
