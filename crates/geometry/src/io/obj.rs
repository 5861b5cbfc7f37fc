//! Wavefront OBJ: reads points, faces (`f`), lines (`l`) and points (`p`), and writes surfaces. Groups (`g`),
//! objects (`o`) and materials (`usemtl`) become cell sets. Leaves out normals, texture coordinates,
//! materials themselves and free-form surfaces.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::cells::{Cells, finite, index_limit};
use super::cursor::{Cursor, name, shown};
use super::error::{Fault, MeshFileProblem, Place};
use super::surface_out::SurfaceOut;
use super::{Format, MeshFile};
use crate::{CellKind, Vector3};

/// More groups on one `g` line than any file has; keeps hostile files from multiplying.
const MOST_GROUPS: usize = 64;

#[derive(Default)]
struct ObjReader {
    points: Vec<Vector3>,
    cells: Cells,
    /// Sets that the next faces belong to: of `g`, `o` and `usemtl`.
    groups: Vec<usize>,
    object: Option<usize>,
    material: Option<usize>,
    numbers: BTreeMap<String, usize>,
    sets: Vec<Vec<usize>>,
    ignored: BTreeMap<String, usize>,
    corners: Vec<u32>,
}

/// Reads an OBJ file.
pub(super) fn read(bytes: &[u8]) -> Result<MeshFile, Fault> {
    let mut reader = ObjReader::default();
    let mut cursor = Cursor::new(bytes);
    let mut joined = Vec::new();
    loop {
        let place = cursor.place();
        let Some(mut line) = cursor.line() else { break };
        // A backslash at the end continues in the next line.
        if line.ends_with(b"\\") {
            joined.clear();
            while let [start @ .., b'\\'] = line {
                joined.extend_from_slice(start);
                joined.push(b' ');
                line = cursor.line().unwrap_or_default();
            }
            joined.extend_from_slice(line);
            line = &joined;
        }
        reader.read_line(line, place)?;
    }
    reader.finish()
}

impl ObjReader {
    fn read_line(&mut self, line: &[u8], place: Place) -> Result<(), Fault> {
        let line = line.split(|&byte| byte == b'#').next().unwrap_or_default();
        let mut words = Cursor::of_line(line, place);
        let Some(key) = words.word() else { return Ok(()) };
        match key {
            b"v" => self.read_point(words),
            b"f" => self.read_cell(words, 3),
            b"l" => self.read_cell(words, 2),
            b"p" => self.read_cell(words, 1),
            b"g" => self.read_groups(words),
            b"o" => {
                self.object = self.set(words.rest());
                Ok(())
            }
            b"usemtl" => {
                self.material = self.set(words.rest());
                Ok(())
            }
            // Normals, texture coordinates, smoothing and materials change no geometry.
            b"vn" | b"vt" | b"s" | b"mtllib" => Ok(()),
            other => {
                if self.ignored.len() < 16 {
                    *self.ignored.entry(shown(other)).or_default() += 1;
                }
                Ok(())
            }
        }
    }

    fn read_point(&mut self, mut words: Cursor<'_>) -> Result<(), Fault> {
        let number = self.points.len() + 1;
        let what = format_args!("point {number}");
        let (x, y, z) = (words.real(what)?, words.real(what)?, words.real(what)?);
        index_limit(number, words.place())?;
        self.points.push(finite(x, y, z, number as u64, words.place())?);
        Ok(())
    }

    /// A cell of at least `least` corners, each an index or index/texture/normal.
    fn read_cell(&mut self, mut words: Cursor<'_>, least: usize) -> Result<(), Fault> {
        let count = self.points.len();
        let number = self.cells.len() + 1;
        self.corners.clear();
        while let Some(word) = words.word() {
            let index = word.split(|&byte| byte == b'/').next().unwrap_or_default();
            let index: i64 = words.parse(index, "the number of a point", format_args!("cell {number}"))?;
            // From 1, or from the last point so far backwards.
            let from_zero = if index < 0 { index.checked_add(count as i64) } else { index.checked_sub(1) };
            let found = from_zero.and_then(|at| u32::try_from(at).ok()).filter(|&at| (at as usize) < count);
            let Some(found) = found else {
                let problem = MeshFileProblem::UndefinedNode { node: index, cell: format!("cell {number}") };
                return Err(Fault { place: words.place(), problem });
            };
            self.corners.push(found);
        }
        if self.corners.len() < least {
            let what =
                format!("cell {number} has {} corners, at least {least} are needed", self.corners.len());
            return Err(words.malformed(what));
        }
        let source = self.cells.len();
        self.cells.open();
        match least {
            3 => self.cells.push_polygon(&self.corners),
            2 => self.corners.windows(2).for_each(|pair| self.cells.push(CellKind::Line, pair)),
            _ => self.corners.iter().for_each(|&point| self.cells.push(CellKind::Vertex, &[point])),
        }
        let sets = self.groups.iter().chain(&self.object).chain(&self.material);
        for &set in sets {
            self.sets[set].push(source);
        }
        Ok(())
    }

    fn read_groups(&mut self, mut words: Cursor<'_>) -> Result<(), Fault> {
        self.groups.clear();
        while let Some(word) = words.word() {
            let set = self.set(word);
            self.groups.extend(set);
            if self.groups.len() > MOST_GROUPS {
                return Err(words.malformed(format!("more than {MOST_GROUPS} groups at once")));
            }
        }
        Ok(())
    }

    /// The number of a set, added if its name is new; `None` for an empty name.
    fn set(&mut self, word: &[u8]) -> Option<usize> {
        let name = name(word);
        if name.is_empty() {
            return None;
        }
        let next = self.sets.len();
        let number = *self.numbers.entry(name).or_insert(next);
        if number == next {
            self.sets.push(Vec::new());
        }
        Some(number)
    }

    fn finish(mut self) -> Result<MeshFile, Fault> {
        let mut notes: Vec<String> =
            self.ignored.iter().map(|(key, count)| format!("{count} lines `{key}` were ignored")).collect();
        for (name, number) in &self.numbers {
            let members = std::mem::take(&mut self.sets[*number]);
            if !members.is_empty() {
                self.cells.add_set(name, members);
            }
        }
        let mesh = self.cells.into_mesh(self.points, BTreeMap::new(), &mut notes)?;
        Ok(MeshFile { mesh, format: Format::Obj.name().to_owned(), notes, time: None })
    }
}

/// Writes the surface cells of a mesh. Cell sets become groups; white space in their names becomes `_`.
pub(super) fn write(out: &mut dyn Write, surface: &SurfaceOut<'_>) -> io::Result<()> {
    for x in &surface.points {
        writeln!(out, "v {:?} {:?} {:?}", x.x, x.y, x.z)?;
    }
    let mut groups: Vec<&str> = Vec::new();
    for face in &surface.faces {
        if face.sets != groups {
            groups.clone_from(&face.sets);
            write!(out, "g")?;
            for group in &groups {
                let word: String =
                    group.chars().map(|c| if c.is_whitespace() || c == '#' { '_' } else { c }).collect();
                write!(out, " {word}")?;
            }
            writeln!(out)?;
        }
        write!(out, "f")?;
        for &node in &face.nodes {
            write!(out, " {}", node as usize + 1)?;
        }
        writeln!(out)?;
    }
    Ok(())
}
