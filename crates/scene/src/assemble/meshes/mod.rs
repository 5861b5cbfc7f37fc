//! The mesh of a body or a surface: read from a file or made from a shape, brought to metres, checked and
//! repaired.

mod files;
mod images;
mod sheets;
mod slivers;

use nalgebra::Rotation3;
use pliant_format::diagnostic::Diagnostic;
use pliant_format::tables::{BodyModel, BodyTable, Cells, Fix, MeshTable, Organ};
use pliant_geometry::io::MeshFile;
use pliant_geometry::words::counted;
use pliant_geometry::{
    CellBlock, CellId, CellKind, DataArray, Diagnosis, Mesh, Vector3, boundary, diagnose,
    faces_met_by_two_tets, reorder,
};
use pliant_meshing::{
    Block, DEFAULT_CELL_LIMIT, Ellipsoid, FieldMesh, ImplicitField, MeshingError, Phantom, Resolution,
    Stuffing, Tube, VolumeCell, Voxels, brain_label,
};

use super::Context;
pub use files::SizeDoubt;
use files::{MeshFault, words};
pub(super) use images::content_of;
pub(super) use sheets::is_sheet;

/// A mesh and where it comes from.
pub(crate) struct MeshOrigin {
    pub(crate) mesh: Mesh,
    pub(crate) origin: String,
}

/// Shapes of volume cells.
const SOLID_SHAPES: [&str; 4] = ["block", "ellipsoid", "tube", "organ"];

/// Carries the nodes' numbers in the file through the repairs.
const FILE_NUMBER: &str = "number of the node in the mesh file";

impl Context<'_> {
    /// The mesh of the table at `path` (`body.NAME.mesh`), in metres; diagnostics if it can't be had.
    pub(super) fn mesh(&mut self, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let given = [
            ("file", table.file.is_some()),
            ("given", table.given.is_some()),
            ("image", table.image.is_some()),
            ("masks", table.masks.is_some()),
            ("block", table.block.is_some()),
            ("ellipsoid", table.ellipsoid.is_some()),
            ("tube", table.tube.is_some()),
            ("organ", table.organ.is_some()),
            ("plate", table.plate.is_some()),
            ("cylinder", table.cylinder.is_some()),
            ("sphere", table.sphere.is_some()),
            ("hemisphere", table.hemisphere.is_some()),
            ("annulus", table.annulus.is_some()),
            ("twisted-strip", table.twisted_strip.is_some()),
            ("lens", table.lens.is_some()),
            ("lines", table.lines.is_some()),
        ];
        let sources: Vec<&str> = given.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
        let [source] = sources[..] else {
            let message = format!("a mesh comes from exactly one source, found {}", sources.len());
            let help = "give one of `file`, `image`, `masks`, `block`, `ellipsoid`, `tube`, `organ`, for shells `plate`, `cylinder`, \
                        `sphere`, `hemisphere`, `annulus`, `twisted-strip`, `lens`, or for bars `lines`";
            self.error(path, message, "this mesh", help);
            return None;
        };
        let from_file = matches!(source, "file" | "given") && table.cells.is_some();
        let of_scans = [
            ("label", table.label.is_some(), false),
            ("labels", table.labels.is_some(), false),
            ("vessels", table.vessels.is_some(), false),
            ("threshold", table.threshold.is_some(), false),
            ("add", table.add.is_some(), false),
            ("names", table.names.is_some(), false),
            ("clean", table.clean.is_some(), from_file),
            ("triangles", table.triangles.is_some(), from_file),
            ("shells", table.shells.is_some(), from_file),
            ("error", table.error.is_some(), from_file),
            ("inner-edge", table.inner_edge.is_some(), from_file),
            ("protect", table.protect.is_some(), from_file),
            ("distance", table.distance.is_some(), from_file),
        ];
        let misplaced =
            |&(_, given, fits): &(&str, bool, bool)| given && !fits && !matches!(source, "image" | "masks");
        if let Some((key, ..)) = of_scans.into_iter().find(misplaced) {
            let message = format!("`{key}` is for images, and this mesh comes from `{source}`");
            self.error(&[path, &[key]].concat(), message, "here", "leave it out");
            return None;
        }
        let mut made = match source {
            "file" | "given" if !from_file => self.with_own_cells(table, path)?,
            "file" | "given" | "image" | "masks" => self.scanned(table, path)?,
            _ if source == "lines" => self.lines(table, path)?,
            _ if SOLID_SHAPES.contains(&source) => self.shape(source, table, path)?,
            _ => self.sheet(source, table, path)?,
        };
        if table.turn != [0.0; 3] {
            made.mesh.transform(Rotation3::new(table.turn.into()).matrix());
        }
        let shift = Vector3::from(table.at);
        made.mesh.points.iter_mut().for_each(|point| *point += shift);
        Some(made)
    }

    /// A mesh with cells of its own, in metres.
    pub(super) fn with_own_cells(&mut self, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        if table.edge.is_some() {
            let message = "a mesh file has its own cells, so `edge` has no effect";
            let help = "leave it out, or add `as = \"tets\"` to make new cells in the surface of the file";
            self.error(&[path, &["edge"]].concat(), message, "here", help);
            return None;
        }
        match self.mesh_file(table) {
            Ok((name, MeshFile { mesh, format, notes, .. })) => {
                self.notes.extend(notes.iter().map(|note| format!("{name}: {note}")));
                Some(MeshOrigin { mesh, origin: format!("{name} ({format})") })
            }
            Err(MeshFault { key, message, help }) => {
                self.error(&[path, &[key]].concat(), message, "this file", help);
                None
            }
        }
    }

    fn shape(&mut self, source: &str, table: &MeshTable, path: &[&str]) -> Option<MeshOrigin> {
        let at = |key| [path, &[key]].concat();
        let counted = table.block.as_ref().is_some_and(|block| block.cells.is_some());
        let edge = match (table.edge, counted) {
            (Some(edge), false) => edge,
            (None, true) => 0.0,
            (Some(_), true) => {
                self.error(&at("edge"), "`edge` and `cells` are both given", "here", "leave one of them out");
                return None;
            }
            (None, false) => {
                let help = "add `edge`, the size of a cell in metres, for example `edge = 0.01`";
                self.error(&at(source), format!("`{source}` needs `edge`"), "this shape", help);
                return None;
            }
        };
        if table.fix.is_some() {
            self.error(&at("fix"), "`fix` repairs mesh files; shapes need none", "here", "leave it out");
            return None;
        }
        let cells = table.made_of();
        let structured = matches!(source, "block" | "tube");
        if matches!(cells, Cells::Surface | Cells::Shells) || structured && cells == Cells::ImmersedHexes {
            let message = format!("`{source}` cannot be made of {}", words(cells));
            let help = "take tets or hexes, which fit the faces of blocks and tubes; surfaces and shells come from images";
            self.error(
                &at("as"),
                message,
                "here",
                if structured { help } else { "take tets, hexes or immersed hexes" },
            );
            return None;
        }
        // The scale of an organ is applied to its field, so that `edge` stays in metres; other shapes are in
        // metres.
        if table.organ.is_none() && table.factor() != 1.0 {
            let help = "give the shape in metres, or use `scale` with `file` or `organ`";
            self.error(&at("scale"), format!("`scale` does not go with `{source}`"), "here", help);
            return None;
        }
        match make_shape(table, edge) {
            Ok(FieldMesh { mesh, dropped_components, dropped_cells, non_manifold_edges }) => {
                if dropped_components > 0 {
                    let note = format!(
                        "{source}: {dropped_cells} cells in {dropped_components} loose parts were dropped"
                    );
                    self.notes.push(note);
                }
                if non_manifold_edges > 0 {
                    self.notes.push(format!(
                        "{source}: the surface touches itself along {non_manifold_edges} edges, where a gap is thinner than `edge`"
                    ));
                }
                Some(MeshOrigin { mesh, origin: describe_shape(source, table) })
            }
            Err(error) => {
                self.error(&at(source), error.to_string(), "this shape", "");
                None
            }
        }
    }

    /// Applies the requested repairs of a body's mesh. Returns the number of each node in the file, empty if
    /// it is the same.
    pub(super) fn repair(&mut self, mesh: &mut Mesh, table: &MeshTable, path: &[&str]) -> Vec<u32> {
        let Some(fixes) = &table.fix else { return Vec::new() };
        let numbers = (0..mesh.points.len()).map(|node| node as f64).collect();
        mesh.point_data.insert(FILE_NUMBER.into(), DataArray::scalar(numbers));
        for fix in fixes.as_slice() {
            let what = match fix {
                Fix::Reorder => format!("{} reordered", counted(reorder(mesh), "inverted element")),
                Fix::DropUnused => format!("{} dropped", counted(mesh.drop_unused_points(), "unused node")),
                Fix::Merge => {
                    let pairs = diagnose(mesh).duplicate_nodes;
                    format!("{} merged", counted(mesh.merge_points(&pairs), "duplicate node"))
                }
            };
            self.notes.push(format!("`{}`: {what}", path[1]));
        }
        let numbers = mesh.point_data.remove(FILE_NUMBER).unwrap_or_default();
        numbers.values.iter().map(|&number| number as u32).collect()
    }

    /// Refuses a body's mesh that cannot be simulated.
    pub(super) fn check_mesh(&mut self, mesh: &Mesh, body: &BodyTable, path: &[&str]) -> bool {
        let table = &body.mesh;
        let fixes: &[Fix] = table.fix.as_ref().map_or(&[], |fixes| fixes.as_slice());
        let place: Vec<&str> = path.iter().copied().chain(table.own_cells()).collect();
        let dimension = match body.model {
            BodyModel::Solid => 3,
            BodyModel::Shell | BodyModel::Membrane => 2,
            BodyModel::Bar => 1,
        };
        if dimension == 1 && mesh.block(CellKind::Line).is_none_or(CellBlock::is_empty) {
            let help = "give `lines`, or a mesh file with line cells; for a thin wall set `model = \"shell\"` or `\"membrane\"`";
            self.error(
                &place,
                format!("`{}` is a bar, and its mesh has no lines", path[1]),
                "this mesh",
                help,
            );
            return false;
        }
        if dimension == 3 && mesh.volume_blocks().all(|block| block.is_empty()) {
            let help = "a solid body needs tets or hexes. To fill a closed surface of a file, add `edge = 0.008, as = \
                        \"tets\"` to `mesh`; for a thin wall set `model = \"shell\"` or `\"membrane\"`";
            self.error(&place, format!("`{}` has no volume elements", path[1]), "this mesh", help);
            return false;
        }
        let mut found = diagnose(mesh);
        if dimension != 3 && table.own_cells().is_none() {
            // The slit of an annulus.
            found.duplicate_nodes.clear();
        }
        let problems = problems(&found, fixes, dimension);
        for (message, help) in &problems {
            self.error(&place, format!("`{}` has {message}", path[1]), "this mesh", *help);
        }
        if problems.is_empty() {
            self.doubt_size(mesh, table, path);
            let met = faces_met_by_two_tets(mesh);
            if met > 0 {
                let message = format!("`{}` has {} that meet two tets", path[1], counted(met, "hex face"));
                let help = "stresses are wrong there, since such faces fail the patch test: make the body of one kind of cells";
                let place = self.source().span(&place);
                self.out.push(Diagnostic::warning(message).at(place, "this mesh").help(help));
            }
            if found.components > 1 {
                let of_scan = table.image.is_some();
                self.notes.push(format!(
                    "`{}` is made of {} separate parts{}",
                    path[1],
                    found.components,
                    if of_scan {
                        "; `clean = { keep-largest = true }` leaves out all but the largest"
                    } else {
                        ""
                    }
                ));
            }
        }
        problems.is_empty() && (dimension != 2 || self.check_slivers(mesh, path, &place))
    }

    /// Warns of a size that no organ has.
    fn doubt_size(&mut self, mesh: &Mesh, table: &MeshTable, path: &[&str]) {
        // Shapes are as large as the scene says, and a scale was thought about.
        let is_meant = table.own_cells().is_none() || table.scale.is_some();
        let doubt = SizeDoubt::of(mesh).filter(|doubt| !(is_meant && doubt.is_possible()));
        let Some(doubt) = doubt else { return };
        let message = format!("`{}` measures {doubt}", path[1]);
        let place = self.source().span(path);
        self.out.push(Diagnostic::warning(message).at(place, "this mesh").help(doubt.advice("scale = ")));
    }
}

/// Returns the problems that keep a mesh of cells of a dimension from being simulated, with remedies. Cells
/// of other dimensions do not count.
fn problems(found: &Diagnosis, fixes: &[Fix], dimension: usize) -> Vec<(String, &'static str)> {
    let of_dimension = |cells: &[CellId]| -> Vec<CellId> {
        cells.iter().filter(|cell| cell.kind.dimension() == dimension).copied().collect()
    };
    let (lost, inverted, flat) = (
        of_dimension(&found.out_of_range_cells),
        of_dimension(&found.inverted_cells),
        of_dimension(&found.degenerate_cells),
    );
    let repeats: Vec<CellId> = found.duplicate_cells.iter().map(|&[_, repeat]| repeat).collect();
    let repeats = of_dimension(&repeats);
    let reorder = match fixes.contains(&Fix::Reorder) {
        false => "add `fix = \"reorder\"` to the mesh to swap their nodes",
        true => "swapping their nodes does not help: remesh there",
    };
    let crowded: Vec<String> = found.crowded_faces.iter().map(|face| join(&face.nodes, "–")).collect();
    let kinds = [
        ("nodes with coordinates that are not finite", list(&found.non_finite_nodes), "repair the mesh file"),
        ("elements that name nodes which do not exist", list_cells(&lost), "repair the mesh file"),
        ("inverted elements at rest", list_cells(&inverted), reorder),
        (
            [
                "bars without length at rest",
                "triangles without area at rest",
                "elements without volume at rest",
            ][dimension - 1],
            list_cells(&flat),
            "remesh there, or take them out of the mesh",
        ),
        (
            "nodes that no element uses",
            list(&found.unused_nodes),
            "add `fix = \"drop-unused\"` to the mesh to drop them",
        ),
        (
            "nodes at the same place",
            list_pairs(&found.duplicate_nodes),
            "add `fix = \"merge\"` to the mesh to join them",
        ),
        ("elements that repeat another", list_cells(&repeats), "remove them from the mesh file"),
        (
            "faces of more than two elements (by the numbers of their nodes)",
            shorten(crowded.into_iter()),
            "elements overlap there: remesh",
        ),
    ];
    let present = kinds.into_iter().filter(|(_, which, _)| !which.is_empty());
    present.map(|(what, which, help)| (format!("{what}: {which}"), help)).collect()
}

fn make_shape(table: &MeshTable, edge: f64) -> Result<FieldMesh, MeshingError> {
    let kind = if table.made_of() == Cells::Tets { VolumeCell::Tet } else { VolumeCell::Hex };
    let whole = |mesh| FieldMesh { mesh, dropped_components: 0, dropped_cells: 0, non_manifold_edges: 0 };
    if let Some(block) = &table.block {
        let resolution = match block.cells {
            Some(cells) => Resolution::Counts(cells.map(|n| n as usize)),
            None => Resolution::Edge(edge),
        };
        return Block::new(block.size).mesh(resolution, kind, DEFAULT_CELL_LIMIT).map(whole);
    }
    if let Some(tube) = &table.tube {
        let tube =
            Tube { inner_radius: tube.inner_radius, outer_radius: tube.outer_radius, length: tube.length };
        return tube.mesh(edge, kind, DEFAULT_CELL_LIMIT).map(whole);
    }
    let fill = |field: &dyn ImplicitField| match table.made_of() {
        Cells::Tets => Stuffing::new(edge).mesh(field),
        Cells::ImmersedHexes => Voxels::new(edge).immersed(field),
        _ => Voxels::new(edge).mesh(field),
    };
    if let Some(ellipsoid) = &table.ellipsoid {
        return fill(&Ellipsoid { centre: Vector3::zeros(), radii: Vector3::from(ellipsoid.radii) });
    }
    match table.organ {
        Some(Organ::Brain) => {
            let mut made = fill(&Phantom::new(pliant_meshing::Organ::Brain, table.factor())?)?;
            label_brain(&mut made.mesh, table.factor());
            Ok(made)
        }
        _ => fill(&Phantom::new(pliant_meshing::Organ::Liver, table.factor())?),
    }
}

/// Brain tissue 1, ventricles 2, tumour 3, by the centre of each cell.
fn label_brain(mesh: &mut Mesh, scale: f64) {
    let Mesh { points, blocks, .. } = mesh;
    for block in blocks {
        let label = |cell: &[u32]| {
            let sum: Vector3 = cell.iter().map(|&node| points[node as usize]).sum();
            // A cut boundary cell may have its centre just outside: it is tissue.
            f64::from(brain_label(&(sum / cell.len() as f64), scale).max(1))
        };
        let labels = block.cells().map(label).collect();
        block.data.insert("label".into(), DataArray::scalar(labels));
    }
    let names = [(1, "tissue"), (2, "ventricles"), (3, "tumour")];
    mesh.label_names = names.map(|(label, name)| (label, name.to_owned())).into();
}

fn describe_shape(source: &str, table: &MeshTable) -> String {
    let cells = words(table.made_of());
    let name = match table.organ {
        Some(Organ::Liver) => "built-in liver",
        Some(Organ::Brain) => "built-in brain",
        None => source,
    };
    match table.edge {
        Some(edge) => format!("{name}, {cells} of {edge} m"),
        None => format!("{name}, {cells}"),
    }
}

/// The surface cells of a mesh, or the boundary of its volume cells, as a mesh of triangles and quads.
pub(super) fn surface_of(mesh: Mesh) -> Mesh {
    if mesh.volume_blocks().any(|block| !block.is_empty()) {
        return boundary(&mesh).to_mesh(&mesh.points).0;
    }
    let mut surface = mesh;
    surface
        .blocks
        .retain(|block| matches!(block.kind, CellKind::Triangle | CellKind::Quad) && !block.is_empty());
    surface
}

/// Items shown of a list.
const SHOWN: usize = 10;

/// The first items of a list, numbered from 0; empty for none.
fn shorten(items: impl ExactSizeIterator<Item = String>) -> String {
    let count = items.len();
    let shown = items.take(SHOWN).collect::<Vec<_>>().join(", ");
    match count {
        0 => shown,
        _ if count > SHOWN => format!("{shown}, … ({count} in all; counted from 0)"),
        _ => format!("{shown} (counted from 0)"),
    }
}

fn list(nodes: &[u32]) -> String {
    shorten(nodes.iter().map(u32::to_string))
}

fn list_pairs(pairs: &[[u32; 2]]) -> String {
    shorten(pairs.iter().map(|pair| join(pair, " and ")))
}

/// Cells by kind and number, for a message.
pub(super) fn list_cells(cells: &[CellId]) -> String {
    shorten(cells.iter().map(|cell| format!("{} {}", cell.kind.name(), cell.index)))
}

fn join(nodes: &[u32], with: &str) -> String {
    nodes.iter().map(u32::to_string).collect::<Vec<_>>().join(with)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CUBE, read};

    fn tet(index: u32) -> CellId {
        CellId { kind: CellKind::Tet, index }
    }

    #[test]
    fn long_lists_are_cut_and_counted() {
        assert_eq!(list(&[]), "");
        assert_eq!(list(&[3]), "3 (counted from 0)");
        let many: Vec<u32> = (0..12).collect();
        assert_eq!(list(&many), "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, … (12 in all; counted from 0)");
        assert_eq!(list_pairs(&[[1, 2]]), "1 and 2 (counted from 0)");
        assert_eq!(list_cells(&[tet(4)]), "tet 4 (counted from 0)");
    }

    #[test]
    fn faults_of_surface_cells_keep_no_solid_from_running() {
        let triangle = CellId { kind: CellKind::Triangle, index: 0 };
        let found = Diagnosis {
            degenerate_cells: vec![triangle],
            duplicate_cells: vec![[triangle, triangle]],
            ..Diagnosis::default()
        };
        assert!(problems(&found, &[], 3).is_empty());
    }

    #[test]
    fn reordering_is_offered_once() {
        let found = Diagnosis { inverted_cells: vec![tet(1)], ..Diagnosis::default() };
        assert!(problems(&found, &[], 3)[0].1.contains("fix = \"reorder\""));
        assert!(problems(&found, &[Fix::Reorder], 3)[0].1.contains("remesh"));
    }

    #[test]
    fn a_program_gives_meshes_from_its_memory() {
        let block = Block::new([0.1, 0.1, 0.1]);
        let mesh = block.mesh(Resolution::Edge(0.05), VolumeCell::Tet, DEFAULT_CELL_LIMIT).unwrap();
        let mesh = std::sync::Arc::new(mesh);
        let with = |table: &str, given: &str| {
            let text = CUBE
                .replace("{ block = { size = [0.2, 0.1, 0.1], cells = [2, 2, 2] }, as = \"hexes\" }", table)
                .replace(
                    "{ set = \"z-min\" }",
                    "{ half-space = { point = [0, 0, 0.01], normal = [0, 0, -1] } }",
                );
            assert!(text.contains(table) && text.contains("half-space"));
            let source = pliant_format::source::Source::parse("cube.toml", text).unwrap();
            let meshes = [(given.to_owned(), std::sync::Arc::clone(&mesh))].into();
            let source = source.giving(pliant_format::source::Given { meshes, ..Default::default() });
            pliant_format::Scene::from_source(source, ".".into()).and_then(|scene| crate::build(&scene))
        };
        let built = with("{ given = 'mine' }", "mine").unwrap_or_else(|error| panic!("{}", error.plain()));
        assert_eq!(built.bodies[0].mesh.points, mesh.points);
        assert_eq!(built.bodies[0].origin, "mine (given by the program)");
        let finer = with("{ given = 'mine', as = 'tets', edge = 0.02 }", "mine")
            .unwrap_or_else(|error| panic!("{}", error.plain()));
        assert!(finer.model.node_count() > 2 * built.model.node_count());
        for (table, says) in [
            ("{ given = 'other' }", "no mesh `other` is given"),
            ("{ given = 'mine', edge = 0.1 }", "has its own cells"),
            ("{ given = 'mine', file = 'a.msh' }", "exactly one source, found 2"),
        ] {
            let errors = with(table, "mine").unwrap_err().plain().to_string();
            assert!(errors.contains(says), "{errors}");
        }
    }

    #[test]
    fn what_does_not_go_with_a_shape_or_a_file_is_refused() {
        for (mesh, says) in [
            ("{ organ = 'liver' }", "`organ` needs `edge`"),
            (
                "{ block = { size = [1, 1, 1], cells = [1, 1, 1] }, edge = 1 }",
                "`edge` and `cells` are both given",
            ),
            ("{ block = { size = [1, 1, 1] }, edge = 1, fix = 'merge' }", "`fix` repairs mesh files"),
            ("{ block = { size = [1, 1, 1] }, edge = 1, scale = 2 }", "`scale` does not go with `block`"),
            ("{ file = 'a.msh', edge = 1 }", "a mesh file has its own cells"),
            ("{ edge = 1 }", "exactly one source, found 0"),
            ("{ organ = 'liver', edge = 1, label = 1 }", "`label` is for images"),
            ("{ file = 'a.msh', clean = { fill-holes = true } }", "`clean` is for images"),
            ("{ image = 'a.nii', label = 1 }", "tets of an image or a surface need `edge`"),
            ("{ image = 'a.nii', edge = 1, label = 1, fix = 'merge' }", "`fix` repairs the cells of a mesh"),
            ("{ image = 'a.nii', edge = 1, label = 1, scale = 2 }", "`scale` does not go with `image`"),
            ("{ image = 'a.nii', edge = 1, label = 1, labels = [2] }", "exactly one of `label`"),
            ("{ image = 'a.nii', edge = 1, label = 1 }", "cannot open"),
            ("{ image = 'a.nii', edge = 1, label = 1, shells = 9 }", "`shells` does not go with tets"),
            ("{ image = 'a.nii', edge = 1, label = 1, as = 'shells' }", "`edge` does not go with shells"),
            ("{ image = 'a.nii', label = 1, as = 'shells' }", "exactly one of `shells`, `error`"),
            ("{ image = 'a.nii', edge = 1, label = 1, add = 'b.nii' }", "`add` goes with `threshold`"),
            ("{ masks = ['a.nii'], edge = 1, threshold = 1, add = 'b.nii' }", "`add` goes with `image`"),
            ("{ masks = [], edge = 1 }", "`masks` names no image"),
            ("{ organ = 'liver', edge = 1, names = 'a.txt' }", "`names` is for images"),
            ("{ organ = 'liver', edge = 1, vessels = [1] }", "`vessels` is for images"),
            ("{ organ = 'liver', edge = 1, error = 0.1 }", "`error` is for images"),
            ("{ organ = 'liver', edge = 1, as = 'shells' }", "`organ` cannot be made of shells"),
            (
                "{ block = { size = [1, 1, 1] }, edge = 1, as = 'immersed-hexes' }",
                "cannot be made of immersed hexes",
            ),
        ] {
            let mesh_line = CUBE.lines().find(|line| line.starts_with("mesh")).unwrap();
            let scene = read(&CUBE.replace(mesh_line, &format!("mesh = {mesh}")));
            let message = crate::build(&scene).unwrap_err().plain().to_string();
            assert!(message.contains(says), "{message}");
        }
    }
}
