//! Selects nodes or boundary faces of a mesh, as a scene file does. Selections are boxes, planes, named sets,
//! labels, the interface of two labels, and unions, intersections and differences of selections. Leaves out:
//! cells inside; selections of the moving body (positions belong to the mesh at rest).

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cell::{diagonal, finite_bounds, is_finite};
use crate::labels::{CellLabel, Labels, UnknownLabel};
use crate::surface::{cell_label, face_key, label_boundary, label_nodes};
use crate::{CellBlock, Mesh, Surface, Vector3};

/// Slack of every comparison of positions, as part of the diagonal of the mesh's bounding box.
const SLACK: f64 = 1e-9;
/// Default tolerance of a plane, as part of the diagonal of the mesh's bounding box.
const PLANE_TOLERANCE: f64 = 1e-5;
/// Slack of the comparison of angles [°].
const ANGLE_SLACK: f64 = 1e-6;

/// Nodes or boundary faces of a body, chosen by position, by name or by label. Positions are taken in the
/// mesh before any motion [m].
///
/// Where faces are needed, a boundary face is selected if all its nodes are. `normal` looks at the face
/// itself, `label` and sets of volume cells at the cell behind it. Sets of triangles or quads name faces
/// directly. The boundary of a mesh of triangles and quads alone is the whole mesh.
#[derive(Deserialize, Serialize, JsonSchema, Clone, Debug, PartialEq)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Selection {
    /// Everything: `"all"`.
    All,
    /// Everything on the boundary: `"boundary"`.
    Boundary,
    /// Everything in an axis-aligned box [m]: `{ box = [[0, 0, 0], [0.1, 0.1, 0.02]] }`, the corner of the
    /// smallest coordinates first. Its sides belong to it, with a slack of 1e-9 of the diagonal of the mesh's
    /// bounding box.
    Box([[f64; 3]; 2]),
    /// Everything in a sphere: `{ sphere = { centre = [0, 0, 0], radius = 0.02 } }`. Its surface belongs to
    /// it, with the slack of `box`.
    Sphere {
        /// Its centre [m].
        centre: [f64; 3],
        /// Its radius [m], 0 or more.
        #[schemars(range(min = 0.0))]
        radius: f64,
    },
    /// Everything on one side of a plane: `{ half-space = { point = [0, 0, 0.05], normal = [0, 0, 1] } }`.
    /// The plane belongs to it, with the slack of `box`.
    HalfSpace {
        /// A point of the plane [m].
        point: [f64; 3],
        /// Points to the side that is selected; of any length but 0, without unit.
        normal: [f64; 3],
    },
    /// Everything on a plane: `{ plane = { point = [0, 0, 0], normal = [0, 0, 1] } }`.
    Plane {
        /// A point of the plane [m].
        point: [f64; 3],
        /// Perpendicular to the plane; of any length but 0, without unit.
        normal: [f64; 3],
        /// Greatest distance from the plane [m], 0 or more. Default: 1e-5 of the diagonal of the mesh's
        /// bounding box, which is 1e-6 m for an organ of 0.1 m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(min = 0.0))]
        tolerance: Option<f64>,
    },
    /// Boundary faces (and their nodes) that look in a direction:
    /// `{ normal = { direction = [0, 0, 1], within = 30 } }`.
    Normal {
        /// The direction; of any length but 0, without unit.
        direction: [f64; 3],
        /// Greatest angle between the direction and the outward normal of a face [°], from 0 to 180.
        #[schemars(range(min = 0.0, max = 180.0))]
        within: f64,
    },
    /// The nodes closest to a point: `{ nearest = { point = [0, 0, 0.05] } }`. Among nodes at the same
    /// distance, smaller indices come first.
    Nearest {
        /// The point [m].
        point: [f64; 3],
        /// Number of nodes, 1 or more (all, if the mesh has fewer). Default: 1.
        #[serde(default = "one")]
        #[schemars(range(min = 1))]
        count: u32,
    },
    /// A named set of the mesh file, of points or of cells: `{ set = "left-lobe" }`.
    Set(String),
    /// Everything of the cells with a label (cell data `label`), by number or name: `{ label = 2 }`,
    /// `{ label = "liver" }`.
    Label(CellLabel),
    /// Nodes shared by cells of two labels, the interface of two regions:
    /// `{ label-boundary = [1, "tumour"] }`.
    LabelBoundary([CellLabel; 2]),
    /// Nodes by index, counted from 0: `{ ids = [0, 5, 17] }`.
    Ids(Vec<u32>),
    /// Everything that any of the selections holds: `{ union = [{ set = "a" }, { set = "b" }] }`.
    Union(Vec<Selection>),
    /// Everything that each of the selections holds: `{ intersection = ["boundary", { label = 2 }] }`.
    Intersection(Vec<Selection>),
    /// Everything that the first selection holds and none of the others:
    /// `{ difference = ["boundary", { set = "cut" }] }`.
    Difference(Vec<Selection>),
}

fn one() -> u32 {
    1
}

/// The error of a selection.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SelectionError {
    /// No set has the name.
    #[error("no set is named `{name}`{}", sets_instead(.nearest, .known))]
    UnknownSet {
        /// The requested name.
        name: String,
        /// The most similar name, if one is similar.
        nearest: Option<String>,
        /// Names of the sets, sorted.
        known: Vec<String>,
    },
    /// A set of the mesh names something beyond its end.
    #[error(
        "set `{name}` of the mesh is broken: it contains {of} {index}, but there are {count}, counted from 0"
    )]
    BrokenSet {
        /// Name of the set.
        name: String,
        /// `node`, `tet`, `triangle`, …
        of: &'static str,
        /// The index that does not exist.
        index: u32,
        /// Number of existing items.
        count: usize,
    },
    /// A node index is beyond the last node.
    #[error("there is no node {id}: the mesh has {count} nodes, counted from 0")]
    NoSuchNode {
        /// The requested index.
        id: u32,
        /// Number of nodes.
        count: usize,
    },
    /// No cell has the label.
    #[error(transparent)]
    UnknownLabel(#[from] UnknownLabel),
    /// A direction without length.
    #[error("{what} is zero: it must point somewhere, for example [0, 0, 1]")]
    ZeroDirection {
        /// The direction: `normal of the plane`, …
        what: &'static str,
    },
    /// The smallest corner of a box is beyond the largest.
    #[error("box is empty along {axis}: it begins at {min} m and ends at {max} m; swap the two")]
    ReversedBox {
        /// `x`, `y` or `z`.
        axis: char,
        /// Start of the box [m].
        min: f64,
        /// End of the box [m].
        max: f64,
    },
    /// A number is infinite or not a number.
    #[error("{what} must be finite, not {value}")]
    NotFinite {
        /// The quantity: `centre of the sphere`, …
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A number is outside of its range.
    #[error("{what} must be {range}, not {value}")]
    OutOfRange {
        /// The quantity: `radius of the sphere`, …
        what: &'static str,
        /// The number.
        value: f64,
        /// The valid range.
        range: &'static str,
    },
    /// Too few operands.
    #[error("{operation} needs {least} or more selections, but has {count}")]
    TooFewParts {
        /// `union`, `intersection` or `difference`.
        operation: &'static str,
        /// Number of selections needed.
        least: usize,
        /// Number of selections given.
        count: usize,
    },
    /// Nothing is selected.
    #[error("{selection} selects no {wanted}: {hint}")]
    Empty {
        /// The selection, in words.
        selection: String,
        /// `nodes` or `boundary faces`.
        wanted: &'static str,
        /// The likely reason, and the position of the mesh.
        hint: String,
    },
}

fn sets_instead(nearest: &Option<String>, known: &[String]) -> String {
    let listing = format!("the mesh has `{}`", known.join("`, `"));
    match nearest {
        _ if known.is_empty() => ": the mesh has no sets".to_owned(),
        Some(name) => format!("; did you mean `{name}`? ({listing})"),
        None => format!(": {listing}"),
    }
}

type Indices = Result<Vec<u32>, SelectionError>;

impl Selection {
    /// The selected nodes of `mesh`, increasing, each once, at least one. `surface` is the boundary of
    /// `mesh`.
    pub fn nodes(&self, mesh: &Mesh, surface: &Surface) -> Indices {
        let view = View { mesh, surface };
        let nodes = self.evaluate(&|leaf| view.nodes(leaf))?;
        if nodes.is_empty() { Err(view.empty(self, Wanted::Nodes)) } else { Ok(nodes) }
    }

    /// The selected faces of `surface`, the boundary of `mesh`, as indices into `surface.faces`,
    /// increasing, each once, at least one.
    pub fn faces(&self, mesh: &Mesh, surface: &Surface) -> Indices {
        let view = View { mesh, surface };
        let faces = self.evaluate(&|leaf| view.faces(leaf))?;
        if faces.is_empty() { Err(view.empty(self, Wanted::Faces)) } else { Ok(faces) }
    }

    /// Checks all numbers that can be checked without a mesh: finite, in range, directions not zero.
    /// [`nodes`](Self::nodes) and [`faces`](Self::faces) do so first.
    pub fn check(&self) -> Result<(), SelectionError> {
        match self {
            Self::Box([low, high]) => {
                finite("corner of the box", low)?;
                finite("corner of the box", high)?;
                let reversed = (0..3).find(|&axis| low[axis] > high[axis]);
                reversed.map_or(Ok(()), |axis| {
                    let (min, max) = (low[axis], high[axis]);
                    Err(SelectionError::ReversedBox { axis: ['x', 'y', 'z'][axis], min, max })
                })
            }
            Self::Sphere { centre, radius } => {
                finite("centre of the sphere", centre)?;
                in_range("radius of the sphere", *radius, f64::INFINITY, "0 or more")
            }
            Self::HalfSpace { point, normal } => {
                finite("point of the half-space", point)?;
                unit("normal of the half-space", normal).map(|_| ())
            }
            Self::Plane { point, normal, tolerance } => {
                finite("point of the plane", point)?;
                unit("normal of the plane", normal)?;
                in_range("tolerance of the plane", tolerance.unwrap_or(0.0), f64::INFINITY, "0 or more")
            }
            Self::Normal { direction, within } => {
                unit("direction of the normal", direction)?;
                in_range("angle `within`", *within, 180.0, "from 0 to 180 degrees")
            }
            Self::Nearest { point, count } => {
                finite("point to be near to", point)?;
                if *count == 0 {
                    let (what, range) = ("count of nearest nodes", "1 or more");
                    return Err(SelectionError::OutOfRange { what, value: 0.0, range });
                }
                Ok(())
            }
            Self::Union(parts) => check_parts("union", 1, parts),
            Self::Intersection(parts) => check_parts("intersection", 1, parts),
            Self::Difference(parts) => check_parts("difference", 2, parts),
            Self::All | Self::Boundary | Self::Set(_) | Self::Label(_) => Ok(()),
            Self::LabelBoundary(_) | Self::Ids(_) => Ok(()),
        }
    }

    /// The operands of a union, intersection or difference.
    fn parts(&self) -> Option<&[Self]> {
        match self {
            Self::Union(parts) | Self::Intersection(parts) | Self::Difference(parts) => Some(parts),
            _ => None,
        }
    }

    /// Combines the results of `leaf` for the other selections in unions, intersections and differences.
    fn evaluate(&self, leaf: &dyn Fn(&Self) -> Indices) -> Indices {
        self.check()?;
        let Some(parts) = self.parts() else { return leaf(self) };
        let mut results = parts.iter().map(|part| part.evaluate(leaf)).collect::<Result<Vec<_>, _>>()?;
        let mut first = results.remove(0);
        for other in results {
            match self {
                Self::Union(_) => first.extend(other),
                Self::Intersection(_) => first.retain(|index| other.binary_search(index).is_ok()),
                _ => first.retain(|index| other.binary_search(index).is_err()),
            }
        }
        Ok(sorted(first))
    }

    /// Distance of a point [m] from a region of space, 0 inside; `None` for selections of another sort.
    fn gap(&self, p: &Vector3) -> Option<f64> {
        // `check` has made sure that normals are not zero.
        let height = |point: &[f64; 3], normal: &[f64; 3]| {
            (p - Vector3::from(*point)).dot(&Vector3::from(*normal).normalize())
        };
        match self {
            Self::Box([low, high]) => {
                Some((p.sup(&Vector3::from(*low)).inf(&Vector3::from(*high)) - p).norm())
            }
            Self::Sphere { centre, radius } => Some(((p - Vector3::from(*centre)).norm() - radius).max(0.0)),
            Self::HalfSpace { point, normal } => Some((-height(point, normal)).max(0.0)),
            Self::Plane { point, normal, .. } => Some(height(point, normal).abs()),
            _ => None,
        }
    }
}

/// The mesh to select from.
struct View<'m> {
    mesh: &'m Mesh,
    surface: &'m Surface,
}

#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Nodes,
    Faces,
}

impl Wanted {
    fn name(self) -> &'static str {
        match self {
            Self::Nodes => "nodes",
            Self::Faces => "boundary faces",
        }
    }
}

impl View<'_> {
    /// Nodes of a selection other than union, intersection and difference.
    fn nodes(&self, leaf: &Selection) -> Indices {
        match leaf {
            Selection::All => Ok((0..self.mesh.points.len() as u32).collect()),
            Selection::Boundary => Ok(self.surface.nodes()),
            Selection::Normal { .. } => {
                let faces = self.faces(leaf)?;
                let faces = faces.iter().map(|&face| &self.surface.faces[face as usize]);
                Ok(sorted(faces.flat_map(|face| face.nodes()).copied().collect()))
            }
            Selection::Nearest { point, count } => Ok(self.nearest(point, *count)),
            Selection::Set(name) => {
                let set = self.set(name)?;
                let cells = set.cells.iter();
                let nodes =
                    cells.flat_map(|(block, cells)| cells.iter().flat_map(|&c| block.cell(c as usize)));
                let nodes: Vec<u32> = nodes.chain(set.points).copied().collect();
                self.check_nodes(&nodes).map(|()| sorted(nodes))
            }
            Selection::Label(label) => Ok(label_nodes(self.mesh, Labels::of(self.mesh).find(label)?)),
            Selection::LabelBoundary([a, b]) => {
                let labels = Labels::of(self.mesh);
                Ok(label_boundary(self.mesh, [labels.find(a)?, labels.find(b)?]))
            }
            Selection::Ids(ids) => self.check_nodes(ids).map(|()| sorted(ids.clone())),
            _ => Ok(self.region(leaf)),
        }
    }

    /// Boundary faces of a selection other than union, intersection and difference.
    fn faces(&self, leaf: &Selection) -> Indices {
        match leaf {
            Selection::All | Selection::Boundary => Ok(self.faces_where(|_| true)),
            Selection::Normal { direction, within } => {
                let direction = unit("direction of the normal", direction)?;
                Ok(self.faces_where(|face| {
                    self.angle(face, &direction).is_some_and(|angle| angle <= within + ANGLE_SLACK)
                }))
            }
            Selection::Label(label) => {
                let label = Labels::of(self.mesh).find(label)?;
                Ok(self.faces_where(|face| {
                    let parent = self.surface.faces[face].parent;
                    let block = self.mesh.block(parent.kind);
                    block.and_then(|block| cell_label(block, parent.index)) == Some(label)
                }))
            }
            Selection::Set(name) => self.faces_of_set(name),
            _ => Ok(self.faces_among(&self.nodes(leaf)?)),
        }
    }

    fn faces_where(&self, wanted: impl Fn(usize) -> bool) -> Vec<u32> {
        (0..self.surface.faces.len()).filter(|&face| wanted(face)).map(|face| face as u32).collect()
    }

    /// Faces whose nodes are all among `nodes`.
    fn faces_among(&self, nodes: &[u32]) -> Vec<u32> {
        let mut chosen = vec![false; self.mesh.points.len()];
        nodes.iter().for_each(|&node| chosen[node as usize] = true);
        self.faces_where(|face| self.surface.faces[face].nodes().iter().all(|&node| chosen[node as usize]))
    }

    /// Faces of the cells in a set, faces that are cells in it, and faces whose nodes are all in it.
    fn faces_of_set(&self, name: &str) -> Indices {
        let set = self.set(name)?;
        let mut nodes = set.points.to_vec();
        let mut parents = Vec::new();
        let mut keys = Vec::new();
        for (block, cells) in &set.cells {
            let cells_nodes = cells.iter().map(|&cell| block.cell(cell as usize));
            match block.kind.dimension() {
                0 | 1 => nodes.extend(cells_nodes.flatten()),
                2 => keys.extend(cells_nodes.map(face_key)),
                _ => parents.extend(cells.iter().map(|&cell| (block.kind, cell))),
            }
        }
        self.check_nodes(&nodes)?;
        parents.sort_unstable();
        keys.sort_unstable();
        let mut faces = self.faces_where(|face| {
            let face = &self.surface.faces[face];
            parents.binary_search(&(face.parent.kind, face.parent.index)).is_ok()
                || keys.binary_search(&face_key(face.nodes())).is_ok()
        });
        faces.extend(self.faces_among(&nodes));
        Ok(sorted(faces))
    }

    /// Nodes in a region of space.
    fn region(&self, leaf: &Selection) -> Vec<u32> {
        let diagonal = diagonal(&self.mesh.points);
        let tolerance = match leaf {
            Selection::Plane { tolerance, .. } => tolerance.unwrap_or(PLANE_TOLERANCE * diagonal),
            _ => 0.0,
        };
        let reach = tolerance + SLACK * diagonal;
        let points = (0u32..).zip(&self.mesh.points);
        points.filter(|(_, p)| leaf.gap(p).is_some_and(|gap| gap <= reach)).map(|(node, _)| node).collect()
    }

    fn nearest(&self, point: &[f64; 3], count: u32) -> Vec<u32> {
        let point = Vector3::from(*point);
        let finite = (0u32..).zip(&self.mesh.points).filter(|(_, p)| is_finite(p));
        let mut nodes: Vec<(f64, u32)> = finite.map(|(node, p)| ((p - point).norm(), node)).collect();
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if (count as usize) < nodes.len() {
            nodes.select_nth_unstable_by(count as usize, order);
            nodes.truncate(count as usize);
        }
        sorted(nodes.into_iter().map(|(_, node)| node).collect())
    }

    /// Angle between the normal of a face and a unit vector [°]; `None` for a face without area.
    fn angle(&self, face: usize, direction: &Vector3) -> Option<f64> {
        let normal = self.surface.faces[face].normal(&self.mesh.points);
        let (sine, cosine) = (normal.cross(direction).norm(), normal.dot(direction));
        (normal != Vector3::zeros()).then(|| sine.atan2(cosine).to_degrees())
    }

    /// The point set and the cell sets of a name; cells that it names exist.
    fn set(&self, name: &str) -> Result<NamedSet<'_>, SelectionError> {
        let points = self.mesh.point_sets.get(name);
        let blocks = self.mesh.blocks.iter();
        let cells: Vec<_> =
            blocks.filter_map(|block| Some((block, block.sets.get(name)?.as_slice()))).collect();
        if points.is_none() && cells.is_empty() {
            return Err(self.unknown_set(name));
        }
        for (block, set) in &cells {
            check_indices(name, block.kind.name(), set, block.len())?;
        }
        let points = points.map_or(&[][..], Vec::as_slice);
        check_indices(name, "node", points, self.mesh.points.len())?;
        Ok(NamedSet { points, cells })
    }

    fn unknown_set(&self, name: &str) -> SelectionError {
        let known = self.mesh.set_names();
        let similar = known.iter().map(|other| (strsim::jaro_winkler(name, other), *other));
        let nearest = similar.filter(|(likeness, _)| *likeness > 0.7).max_by(|a, b| a.0.total_cmp(&b.0));
        SelectionError::UnknownSet {
            name: name.to_owned(),
            nearest: nearest.map(|(_, name)| name.to_owned()),
            known: known.into_iter().map(str::to_owned).collect(),
        }
    }

    fn check_nodes(&self, nodes: &[u32]) -> Result<(), SelectionError> {
        let count = self.mesh.points.len();
        let beyond = nodes.iter().find(|&&node| node as usize >= count);
        beyond.map_or(Ok(()), |&id| Err(SelectionError::NoSuchNode { id, count }))
    }

    /// The error for a selection that selects nothing.
    fn empty(&self, selection: &Selection, wanted: Wanted) -> SelectionError {
        let mut hint = self.reason(selection, wanted);
        if let Some((low, high)) = finite_bounds(&self.mesh.points) {
            let (low, high) = (position(&low), position(&high));
            hint += &format!("; the mesh lies between {low} and {high} m");
        }
        SelectionError::Empty { selection: selection.to_string(), wanted: wanted.name(), hint }
    }

    /// Reason that a selection selects nothing.
    fn reason(&self, selection: &Selection, wanted: Wanted) -> String {
        if self.mesh.points.is_empty() {
            return "the mesh has no points".to_owned();
        }
        if wanted == Wanted::Faces && self.surface.faces.is_empty() {
            return "the mesh has no boundary faces".to_owned();
        }
        if let Some(parts) = selection.parts() {
            let counts = parts.iter().map(|part| {
                let count = match wanted {
                    Wanted::Nodes => part.evaluate(&|leaf| self.nodes(leaf)),
                    Wanted::Faces => part.evaluate(&|leaf| self.faces(leaf)),
                };
                format!("{part} selects {}", count.map_or(0, |found| found.len()))
            });
            return counts.collect::<Vec<_>>().join(", ");
        }
        let nodes = self.nodes(selection).map_or(0, |nodes| nodes.len());
        if wanted == Wanted::Faces && nodes > 0 {
            return format!("it has {nodes} nodes, but no boundary face lies completely within them");
        }
        match selection {
            Selection::Boundary => "the mesh has no boundary faces".to_owned(),
            Selection::Normal { direction, .. } => self.closest_normal(direction),
            Selection::Set(_) => "the set is empty".to_owned(),
            Selection::Ids(_) => "the list is empty".to_owned(),
            Selection::LabelBoundary([a, b]) => format!("cells of labels {a} and {b} share no node"),
            _ => self.closest_node(selection),
        }
    }

    fn closest_node(&self, region: &Selection) -> String {
        let gaps = self.mesh.points.iter().enumerate();
        let gaps = gaps.filter_map(|(node, p)| Some((region.gap(p).filter(|gap| gap.is_finite())?, node)));
        let Some((gap, node)) = gaps.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return "no point of the mesh is finite".to_owned();
        };
        let at = position(&self.mesh.points[node]);
        format!("the closest, node {node} at {at}, is {} m away", number(gap))
    }

    fn closest_normal(&self, direction: &[f64; 3]) -> String {
        let Some(direction) = Vector3::from(*direction).try_normalize(0.0) else { return String::new() };
        let angles = (0..self.surface.faces.len()).filter_map(|face| self.angle(face, &direction));
        match angles.min_by(f64::total_cmp) {
            Some(angle) => format!("the closest normal of a boundary face is {}° away", number(angle)),
            None => "the mesh has no boundary faces".to_owned(),
        }
    }
}

/// Everything of one name.
struct NamedSet<'m> {
    points: &'m [u32],
    cells: Vec<(&'m CellBlock, &'m [u32])>,
}

fn check_indices(name: &str, of: &'static str, indices: &[u32], count: usize) -> Result<(), SelectionError> {
    let beyond = indices.iter().find(|&&index| index as usize >= count);
    beyond.map_or(Ok(()), |&index| Err(SelectionError::BrokenSet { name: name.to_owned(), of, index, count }))
}

fn check_parts(operation: &'static str, least: usize, parts: &[Selection]) -> Result<(), SelectionError> {
    let count = parts.len();
    if count < least {
        return Err(SelectionError::TooFewParts { operation, least, count });
    }
    parts.iter().try_for_each(Selection::check)
}

fn finite(what: &'static str, values: &[f64]) -> Result<(), SelectionError> {
    let odd = values.iter().find(|value| !value.is_finite());
    odd.map_or(Ok(()), |&value| Err(SelectionError::NotFinite { what, value }))
}

fn in_range(what: &'static str, value: f64, max: f64, range: &'static str) -> Result<(), SelectionError> {
    finite(what, &[value])?;
    if (0.0..=max).contains(&value) { Ok(()) } else { Err(SelectionError::OutOfRange { what, value, range }) }
}

/// A direction as a unit vector.
fn unit(what: &'static str, direction: &[f64; 3]) -> Result<Vector3, SelectionError> {
    finite(what, direction)?;
    Vector3::from(*direction).try_normalize(0.0).ok_or(SelectionError::ZeroDirection { what })
}

/// Increasing, each once.
fn sorted(mut indices: Vec<u32>) -> Vec<u32> {
    indices.sort_unstable();
    indices.dedup();
    indices
}

/// Six digits at most, for a message.
fn number(x: f64) -> String {
    let short = format!("{x:.5e}").parse::<f64>().unwrap_or(x);
    if short == 0.0 || (1e-4..1e6).contains(&short.abs()) { short.to_string() } else { format!("{short:e}") }
}

fn position(p: &Vector3) -> String {
    format!("[{}, {}, {}]", number(p.x), number(p.y), number(p.z))
}

impl fmt::Display for Selection {
    /// In words, for messages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joined = |parts: &[Self]| parts.iter().map(Self::to_string).collect::<Vec<_>>().join("; ");
        match self {
            Self::All => write!(f, "`all`"),
            Self::Boundary => write!(f, "`boundary`"),
            Self::Box([low, high]) => write!(f, "box from {low:?} to {high:?}"),
            Self::Sphere { centre, radius } => write!(f, "sphere around {centre:?} of radius {radius}"),
            Self::HalfSpace { point, normal } => write!(f, "half-space at {point:?} towards {normal:?}"),
            Self::Plane { point, normal, .. } => write!(f, "plane at {point:?} with normal {normal:?}"),
            Self::Normal { direction, within } => write!(f, "normal within {within}° of {direction:?}"),
            Self::Nearest { point, count } => write!(f, "nearest {count} to {point:?}"),
            Self::Set(name) => write!(f, "set `{name}`"),
            Self::Label(label) => write!(f, "label {label}"),
            Self::LabelBoundary([a, b]) => write!(f, "boundary of labels {a} and {b}"),
            Self::Ids(ids) => write!(f, "list of {} ids", ids.len()),
            Self::Union(parts) => write!(f, "union of ({})", joined(parts)),
            Self::Intersection(parts) => write!(f, "intersection of ({})", joined(parts)),
            Self::Difference(parts) => write!(f, "difference of ({})", joined(parts)),
        }
    }
}

#[cfg(test)]
mod tests;
