//! Regions in an image of labels: size, place, and pieces joined through faces of voxels. Runs of equal
//! labels along i are joined with the runs of neighbouring rows (He, Chao, Suzuki 2008).

use std::collections::BTreeMap;
use std::fmt;

use pliant_geometry::Grid;
use serde::Serialize;

use crate::border::Border;
use crate::error::LabelError;
use crate::image::{Image, LabelImage};

/// The voxels of one label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RegionReport {
    /// The label.
    pub label: i32,
    /// Number of voxels.
    pub voxels: u64,
    /// Their volume [m³].
    pub volume: f64,
    /// Smallest corner of the box round them in world coordinates [m].
    pub low: [f64; 3],
    /// Largest corner [m].
    pub high: [f64; 3],
    /// Pieces joined through faces of voxels.
    pub components: u64,
    /// Voxels of the largest piece.
    pub largest_component: u64,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Voxels at the border of the image, where the organ may be cut off.
    pub border: Border,
}

impl fmt::Display for RegionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = [self.low, self.high].map(|x| x.map(|x| x * 1e3));
        write!(
            f,
            "label {}{}: {} voxels, {:.2} ml, x {:.1} to {:.1}, y {:.1} to {:.1}, z {:.1} to {:.1} mm",
            self.label,
            self.name.as_ref().map_or_else(String::new, |name| format!(" ({name})")),
            self.voxels,
            self.volume * 1e6,
            low[0],
            high[0],
            low[1],
            high[1],
            low[2],
            high[2]
        )?;
        match self.components {
            1 => write!(f, ", in one piece")?,
            n => write!(f, ", in {n} pieces, the largest of {} voxels", self.largest_component)?,
        }
        if self.border.is_touched() {
            write!(f, "; at the border of the image: {}", self.border)
        } else {
            Ok(())
        }
    }
}

impl RegionReport {
    /// Every label but 0, increasing.
    pub(crate) fn of_labels(grid: &Grid, label: impl Fn(usize) -> i32) -> Vec<Self> {
        let components = Components::new(grid.dims, label, 0);
        let [nx, ny, nz] = grid.dims;
        let mut found: BTreeMap<i32, Self> = BTreeMap::new();
        for run in &components.runs {
            let report = found.entry(run.label).or_insert_with(|| Self {
                label: run.label,
                voxels: 0,
                volume: 0.0,
                low: [f64::INFINITY; 3],
                high: [f64::NEG_INFINITY; 3],
                components: 0,
                largest_component: 0,
                name: None,
                border: Border::new(grid),
            });
            let length = u64::from(run.to - run.from);
            report.voxels += length;
            let (j, k) = (run.row as usize % ny, run.row as usize / ny);
            let at_sides = [
                [u64::from(run.from == 0), u64::from(run.to as usize == nx)],
                [(j, 0), (j, ny - 1)].map(|(j, side)| if j == side { length } else { 0 }),
                [(k, 0), (k, nz - 1)].map(|(k, side)| if k == side { length } else { 0 }),
            ];
            report.border.add(at_sides);
            // Run by run: the box in an oblique grid is smaller than that round its box of voxels.
            let [low, high] = grid.world_box([run.from as usize, j, k], [run.to as usize - 1, j, k]);
            for axis in 0..3 {
                report.low[axis] = report.low[axis].min(low[axis]);
                report.high[axis] = report.high[axis].max(high[axis]);
            }
        }
        for (run, size) in components.runs.iter().zip(components.sizes()).filter(|(_, size)| *size > 0) {
            if let Some(report) = found.get_mut(&run.label) {
                report.components += 1;
                report.largest_component = report.largest_component.max(size);
            }
        }
        let with_volume =
            |report: Self| Self { volume: report.voxels as f64 * grid.voxel_volume(), ..report };
        found.into_values().map(with_volume).collect()
    }
}

/// Voxels of one label that follow each other along i.
#[derive(Clone, Copy, Debug)]
struct Run {
    label: i32,
    /// First voxel and the one after the last, along i.
    from: u32,
    to: u32,
    /// Number of the row: j + ny k.
    row: u32,
}

/// Runs joined to components.
pub(crate) struct Components {
    runs: Vec<Run>,
    /// The first run of the component of each run.
    root: Vec<u32>,
}

impl Components {
    /// Joins all voxels whose label is not `background`.
    pub(crate) fn new(dims: [usize; 3], label: impl Fn(usize) -> i32, background: i32) -> Self {
        let [nx, ny, nz] = dims;
        let mut runs: Vec<Run> = Vec::new();
        let mut row_start = Vec::with_capacity(ny * nz + 1);
        for row in 0..ny * nz {
            row_start.push(runs.len());
            let mut open: Option<Run> = None;
            for i in 0..nx {
                let here = label(row * nx + i);
                match &mut open {
                    Some(run) if run.label == here => run.to += 1,
                    _ => {
                        runs.extend(open.take().filter(|run| run.label != background));
                        open = Some(Run { label: here, from: i as u32, to: i as u32 + 1, row: row as u32 });
                    }
                }
            }
            runs.extend(open.filter(|run| run.label != background));
        }
        row_start.push(runs.len());
        let mut joined = Self { root: (0..runs.len() as u32).collect(), runs };
        for row in 0..ny * nz {
            let neighbours = [(row % ny > 0).then(|| row - 1), row.checked_sub(ny)];
            for other in neighbours.into_iter().flatten() {
                joined.join_rows(row_start[row]..row_start[row + 1], row_start[other]..row_start[other + 1]);
            }
        }
        for run in 0..joined.root.len() as u32 {
            joined.root[run as usize] = joined.find(run);
        }
        joined
    }

    fn join_rows(&mut self, row: std::ops::Range<usize>, other: std::ops::Range<usize>) {
        let (mut a, mut b) = (row.start, other.start);
        while a < row.end && b < other.end {
            let (x, y) = (self.runs[a], self.runs[b]);
            if x.label == y.label && x.from < y.to && y.from < x.to {
                let [p, q] = [self.find(a as u32), self.find(b as u32)];
                self.root[p.max(q) as usize] = p.min(q);
            }
            if x.to < y.to {
                a += 1;
            } else {
                b += 1;
            }
        }
    }

    fn find(&mut self, mut run: u32) -> u32 {
        while self.root[run as usize] != run {
            self.root[run as usize] = self.root[self.root[run as usize] as usize];
            run = self.root[run as usize];
        }
        run
    }

    /// Voxels of each component, by its first run (0 for runs that are not first).
    pub(crate) fn sizes(&self) -> Vec<u64> {
        let mut sizes = vec![0; self.runs.len()];
        for (run, &root) in self.runs.iter().zip(&self.root) {
            sizes[root as usize] += u64::from(run.to - run.from);
        }
        sizes
    }

    /// Returns the first run of the largest component (the first among equals) and the number of components;
    /// `None` without components.
    pub(crate) fn largest(&self) -> Option<(u32, usize)> {
        let sizes = self.sizes();
        let count = sizes.iter().filter(|&&size| size > 0).count();
        let largest = (0..sizes.len()).rev().max_by_key(|&run| sizes[run])?;
        Some((largest as u32, count))
    }

    /// The voxels of each run with the first run of its component.
    pub(crate) fn voxels(&self, nx: usize) -> impl Iterator<Item = (std::ops::Range<usize>, u32)> {
        self.runs.iter().zip(&self.root).map(move |(run, &root)| {
            let start = run.row as usize * nx;
            (start + run.from as usize..start + run.to as usize, root)
        })
    }
}

impl Image {
    /// Every label but 0, increasing, with its size, place and pieces. `progress` hears fractions from 0
    /// to 1.
    pub fn regions(&self, progress: &dyn Fn(f64)) -> Result<Vec<RegionReport>, LabelError> {
        self.survey()?;
        progress(0.3);
        let mut regions = RegionReport::of_labels(&self.grid, |at| self.label(at));
        for region in &mut regions {
            region.name = self.names.get(region.label).map(str::to_owned);
        }
        progress(1.0);
        Ok(regions)
    }
}

impl LabelImage {
    /// Every label but 0, increasing, with its size, place and pieces.
    pub fn regions(&self) -> Vec<RegionReport> {
        RegionReport::of_labels(&self.grid, |at| self.labels[at])
    }

    /// The labels of the image without 0, increasing.
    pub fn present(&self) -> Vec<i32> {
        let mut labels: Vec<i32> = self.labels.chunk_by(|a, b| a == b).map(|run| run[0]).collect();
        labels.sort_unstable();
        labels.dedup();
        labels.retain(|&label| label != 0);
        labels
    }
}
