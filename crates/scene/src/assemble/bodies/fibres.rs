//! Fibre directions of cells: the same everywhere, from the mesh, or by a rule at the centre of the cell.
//! Tangential fibres use the nearest point of the surface. Walls take the gradient of a harmonic function on
//! the body's own elements. A cell without a direction is an error that names it.

use pliant_format::diagnostic::Diagnostic;
use pliant_format::registry::LawTable;
use pliant_format::suggestion;
use pliant_format::tables::{BodyModel, Fibre, FibreRule};
use pliant_geometry::words::counted;
use pliant_geometry::{CellBlock, CellId, CellKind, Selection, SurfaceLocator, Vector3};
use pliant_mechanics::harmonic::Laplacian;

use super::{Draft, nodes};
use crate::assemble::Context;
use crate::assemble::meshes::list_cells;

/// Directions shorter than this are zero.
const ZERO: f64 = 1e-12;
/// A direction by a rule is undefined where its length is below this fraction of its usual length.
const LOST: f64 = 1e-6;

/// The fault of a rule: the keys below it, the message and what to do.
struct RuleFault {
    at: Vec<&'static str>,
    message: String,
    help: String,
}

fn fault(at: &[&'static str], message: impl Into<String>, help: impl Into<String>) -> RuleFault {
    RuleFault { at: at.to_vec(), message: message.into(), help: help.into() }
}

/// Cells where a rule gives no direction, and the remedy.
struct Lost {
    cells: &'static str,
    help: &'static str,
}

/// A direction for each requested cell, `None` where it is undefined.
type Directions = (Vec<Option<[f64; 3]>>, Lost);

impl Context<'_> {
    /// The unit fibres of some cells of a body, cell by cell as many as the law has families.
    pub(super) fn fibres(
        &mut self,
        draft: &Draft<'_>,
        law_name: &str,
        law: &LawTable,
        block: &CellBlock,
        cells: &[u32],
    ) -> Option<Vec<[f64; 3]>> {
        let families = [
            ("fibre", &draft.table.fibre, &law.extras.fibre),
            ("second-fibre", &draft.table.second_fibre, &law.extras.second_fibre),
        ];
        let wanted = families.iter().take(law.law.families());
        // Both, so that the mistakes of both are reported.
        let found: Vec<_> = wanted
            .map(|&(key, of_body, of_law)| {
                let given = match (of_body, of_law) {
                    (Some(fibre), _) => Some((fibre, ["body", draft.name, key])),
                    (None, Some(fibre)) => Some((fibre, ["law", law_name, key])),
                    (None, None) => None,
                };
                self.family(key, given, draft, block, cells)
            })
            .collect();
        let found: Vec<Vec<[f64; 3]>> = found.into_iter().collect::<Option<_>>()?;
        Some((0..cells.len()).flat_map(|cell| found.iter().map(move |family| family[cell])).collect())
    }

    /// The direction of a body's fibres in the triangles of a shell.
    pub(super) fn shell_directions(
        &mut self,
        draft: &Draft<'_>,
        fibre: &Fibre,
        block: &CellBlock,
    ) -> Option<Vec<[f64; 3]>> {
        let path = ["body", draft.name, "fibre"];
        let cells: Vec<u32> = (0..block.len() as u32).collect();
        self.family("fibre", Some((fibre, path)), draft, block, &cells)
    }

    /// The unit direction of one family of fibres in some cells of a body, from what was given and where.
    fn family(
        &mut self,
        key: &str,
        given: Option<(&Fibre, [&str; 3])>,
        draft: &Draft<'_>,
        block: &CellBlock,
        cells: &[u32],
    ) -> Option<Vec<[f64; 3]>> {
        let name = draft.name;
        let Some((given, path)) = given else {
            let message = match key {
                "fibre" => format!("`{name}` has a law with fibres, but no fibre direction"),
                _ => format!("`{name}` has a law with two families of fibres, but no `{key}`"),
            };
            let help = format!(
                "add to the law or the body `{key} = [x, y, z]`, `{key} = {{ cell-data = \"name\" }}` or a rule: \
                 `along`, `toward`, `around`, `tangential`, `laplace`"
            );
            self.error(&["body", name, "law"], message, "this law needs a fibre", help);
            return None;
        };
        if draft.table.model != BodyModel::Solid && matches!(given, Fibre::PerCell(FibreRule::Laplace { .. }))
        {
            let message = "the rule `laplace` needs a solid";
            self.error(&path, message, "not for thin walls", "take another rule, or cell data of the mesh");
            return None;
        }
        let found = match given {
            Fibre::Uniform(direction) => along(direction, cells.len(), &[]),
            Fibre::PerCell(rule) => directions(rule, draft, block, cells),
        };
        let fault = match found {
            Ok((directions, lost)) => {
                let without = cells.iter().zip(&directions).filter(|(_, direction)| direction.is_none());
                let without: Vec<CellId> =
                    without.map(|(&index, _)| CellId { kind: block.kind, index }).collect();
                if without.is_empty() {
                    return Some(directions.into_iter().flatten().collect());
                }
                let message = format!(
                    "no fibre direction in cells of `{name}` {}: {}",
                    lost.cells,
                    list_cells(&without)
                );
                fault(&[], message, lost.help)
            }
            Err(fault) => fault,
        };
        let place = self.source().span(&[&path, fault.at.as_slice()].concat());
        let diagnostic =
            Diagnostic::error(fault.message).at(place, "no direction in some cells").help(fault.help);
        // The same rule may serve several laws and kinds of cells: say it once.
        if !self.out.contains(&diagnostic) {
            self.out.push(diagnostic);
        }
        None
    }
}

fn directions(
    rule: &FibreRule,
    draft: &Draft<'_>,
    block: &CellBlock,
    cells: &[u32],
) -> Result<Directions, RuleFault> {
    let centre = |&cell: &u32| {
        let nodes = block.cell(cell as usize);
        nodes.iter().map(|&node| draft.mesh.points[node as usize]).sum::<Vector3>() / nodes.len() as f64
    };
    let size = draft.mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
    match rule {
        FibreRule::CellData(field) => cell_data(field, draft, block, cells),
        FibreRule::Along(axis) => along(axis, cells.len(), &["along"]),
        FibreRule::Toward(point) => {
            let to = |cell| unit(Vector3::from(*point) - centre(cell), LOST * size);
            let lost = Lost {
                cells: "whose centre is the point of `toward`",
                help: "move the point off the centres of cells, for example out of the body",
            };
            Ok((cells.iter().map(to).collect(), lost))
        }
        FibreRule::Around { point, axis, angle } => {
            let axis = axis_of(axis, "the axis", &["around", "axis"])?;
            let axis = Vector3::from(axis);
            let (along, around) = angle.to_radians().sin_cos();
            let direction = |cell| {
                let ring = unit(axis.cross(&(centre(cell) - Vector3::from(*point))), LOST * size)?;
                unit(Vector3::from(ring) * around + axis * along, ZERO)
            };
            let lost = Lost {
                cells: "whose centre lies on the axis of `around`",
                help: "move the axis off the centres of cells, or give these cells a law of their own",
            };
            Ok((cells.iter().map(direction).collect(), lost))
        }
        FibreRule::Tangential { surface, closest_to } => {
            let wanted = axis_of(closest_to, "`closest-to`", &["tangential", "closest-to"])?;
            let faces = surface
                .faces(draft.mesh, draft.boundary)
                .map_err(|error| fault(&["tangential", "surface"], error.to_string(), ""))?;
            let locator = SurfaceLocator::new(draft.boundary, &faces, &draft.mesh.points);
            let along_surface = |cell| {
                let normal = locator.closest(&centre(cell))?.normal;
                if normal == Vector3::zeros() {
                    None
                } else {
                    unit(wanted - normal * normal.dot(&wanted), LOST)
                }
            };
            let lost = Lost {
                cells: "where `closest-to` is perpendicular to the surface",
                help: "choose another direction, or a surface that is not perpendicular to it",
            };
            Ok((cells.iter().map(along_surface).collect(), lost))
        }
        FibreRule::Laplace { from, to } => laplace([from, to], draft, block, cells),
    }
}

/// Returns one direction for some cells.
fn along(direction: &[f64; 3], count: usize, at: &[&'static str]) -> Result<Directions, RuleFault> {
    let unit = axis_of(direction, "the fibre direction", at)?.into();
    Ok((vec![Some(unit); count], Lost { cells: "", help: "" }))
}

fn axis_of(direction: &[f64; 3], what: &str, at: &[&'static str]) -> Result<Vector3, RuleFault> {
    let help = "give a direction, for example [0, 1, 0]; its length does not matter";
    unit(Vector3::from(*direction), ZERO)
        .map(Vector3::from)
        .ok_or_else(|| fault(at, format!("{what} is zero"), help))
}

fn cell_data(
    field: &str,
    draft: &Draft<'_>,
    block: &CellBlock,
    cells: &[u32],
) -> Result<Directions, RuleFault> {
    let Some(data) = block.data.get(field) else {
        let known: Vec<&str> = block.data.keys().map(String::as_str).collect();
        let help = suggestion(field, &known, "the mesh", "cell data");
        return Err(fault(&[], format!("the mesh of `{}` has no cell data `{field}`", draft.name), help));
    };
    if data.components != 3 {
        let has = counted(data.components, "component");
        let message = format!("cell data `{field}` has {has}, but a direction has 3");
        return Err(fault(&[], message, "name an array of vectors"));
    }
    let of = |&cell: &u32| unit(Vector3::from_column_slice(data.item(cell as usize)), ZERO);
    let lost = Lost {
        cells: "whose data is zero or not finite",
        help: "give every cell a direction in the mesh file",
    };
    Ok((cells.iter().map(of).collect(), lost))
}

/// Along ∇φ with ∇²φ = 0 in the body, φ = 0 on the first selection and 1 on the second.
fn laplace(
    selections: [&Selection; 2],
    draft: &Draft<'_>,
    block: &CellBlock,
    cells: &[u32],
) -> Result<Directions, RuleFault> {
    let keys = [["laplace", "from"], ["laplace", "to"]];
    let nodes_of = |side: usize| {
        let chosen = selections[side].nodes(draft.mesh, draft.boundary);
        chosen.map_err(|error| fault(&keys[side], error.to_string(), ""))
    };
    let (from, to) = (nodes_of(0)?, nodes_of(1)?);
    if let Some(node) = to.iter().find(|node| from.binary_search(node).is_ok()) {
        let message = format!("node {node} (counted from 0) is in `from` and in `to`");
        return Err(fault(&["laplace"], message, "choose `from` and `to` without common nodes"));
    }
    let given: Vec<(u32, f64)> =
        from.iter().map(|&node| (node, 0.0)).chain(to.iter().map(|&node| (node, 1.0))).collect();
    let points: Vec<[f64; 3]> = draft.mesh.points.iter().map(|&p| p.into()).collect();
    let tets = draft
        .mesh
        .block(CellKind::Tet)
        .map_or(Vec::new(), |b| (0..b.len()).map(|c| nodes(b, c as u32, |node| node)).collect());
    let hexes = draft
        .mesh
        .block(CellKind::Hex)
        .map_or(Vec::new(), |b| (0..b.len()).map(|c| nodes(b, c as u32, |node| node)).collect());
    let phi = Laplacian::new(&points, &tets, &hexes)
        .solve(&given)
        .map_err(|error| fault(&["laplace"], error.to_string(), "check the mesh for very flat cells"))?;
    let gradients: Vec<Vector3> = cells
        .iter()
        .map(|&cell| Laplacian::mean_gradient(&points, block.cell(cell as usize), &phi).into())
        .collect();
    let steepest = gradients.iter().map(Vector3::norm).fold(0.0, f64::max);
    let lost = Lost {
        cells: "where the solution of Laplace's equation is constant",
        help: "no cell may have all its nodes in `from` or in `to`, or lie apart from both: select faces of the surface only, on \
               both sides of every part of the body",
    };
    let of = |gradient: &Vector3| unit(*gradient, (LOST * steepest).max(f64::MIN_POSITIVE));
    Ok((gradients.iter().map(of).collect(), lost))
}

/// The direction of a vector, if it is finite and longer than a least length.
fn unit(vector: Vector3, least: f64) -> Option<[f64; 3]> {
    let norm = vector.norm();
    (norm.is_finite() && norm > least).then(|| (vector / norm).into())
}

#[cfg(test)]
mod tests {
    use pliant_geometry::Vector3;

    use super::unit;
    use crate::assemble::{Built, build};
    use crate::testing::read;

    fn scene(mesh: &str, fibre: &str) -> pliant_format::Scene {
        read(&format!(
            "[scene]\nuntil = 1\n[law.muscle]\ntype = 'transversely-isotropic'\nyoung-modulus = 1e4\n\
             poisson-ratio = 0.3\nfibre-modulus = 5e3\n[body.organ]\nmesh = {{ {mesh} }}\nlaw = 'muscle'\n\
             density = 1000\nfibre = {fibre}\n"
        ))
    }

    /// The centre and the fibre of each cell.
    fn fibres(mesh: &str, fibre: &str) -> Vec<(Vector3, Vector3)> {
        let Built { model, .. } = build(&scene(mesh, fibre)).unwrap_or_else(|e| panic!("{}", e.plain()));
        let solid = &model.solids[0];
        let centre = |cell: usize| {
            let nodes = solid.cells.nodes(cell);
            nodes.iter().map(|&n| Vector3::from(model.rest[n as usize])).sum::<Vector3>() / nodes.len() as f64
        };
        let fibres = solid.fibre.iter().map(|&f| Vector3::from(f));
        let pairs: Vec<_> = fibres.enumerate().map(|(cell, fibre)| (centre(cell), fibre)).collect();
        assert!(pairs.len() > 40 && pairs.iter().all(|(_, fibre)| (fibre.norm() - 1.0).abs() < 1e-12));
        pairs
    }

    fn refused(mesh: &str, fibre: &str) -> String {
        build(&scene(mesh, fibre)).expect_err("a mistake").plain().to_string()
    }

    const BLOCK: &str = "block = { size = [0.04, 0.04, 0.04] }, edge = 0.01";
    const SPHERE: &str = "ellipsoid = { radii = [0.05, 0.05, 0.05] }, edge = 0.012";
    const TUBE: &str = "tube = { inner-radius = 0.02, outer-radius = 0.04, length = 0.03 }, edge = 0.005";

    #[test]
    fn a_direction_has_length_one_or_is_none() {
        assert_eq!(unit(Vector3::new(0.0, -3.0, 4.0), 1e-12), Some([0.0, -0.6, 0.8]));
        for none in [[0.0; 3], [1e-13, 0.0, 0.0], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(Vector3::from(none), 1e-12), None);
        }
    }

    #[test]
    fn along_an_axis_is_the_axis() {
        for (_, fibre) in fibres(BLOCK, "{ along = [0, 0, -2] }") {
            assert_eq!(fibre, -Vector3::z());
        }
    }

    #[test]
    fn toward_the_middle_of_a_sphere_is_against_the_radius() {
        // The middle of the lattice is a node, so that no cell has its centre there.
        for (centre, fibre) in fibres(SPHERE, "{ toward = [0, 0, 0] }") {
            assert!((fibre + centre.normalize()).norm() < 1e-12);
        }
    }

    #[test]
    fn around_the_axis_of_a_tube_is_perpendicular_to_radius_and_axis() {
        for (centre, fibre) in fibres(TUBE, "{ around = { point = [0, 0, 1], axis = [0, 0, 1] } }") {
            let radial = Vector3::new(centre.x, centre.y, 0.0).normalize();
            assert!((fibre - Vector3::z().cross(&radial)).norm() < 1e-12);
        }
    }

    #[test]
    fn two_families_climb_a_vessel_to_the_right_and_to_the_left() {
        let helix =
            |angle: f64| format!("{{ around = {{ point = [0, 0, 0], axis = [0, 0, 1], angle = {angle} }} }}");
        let text = format!(
            "[scene]\nuntil = 1\n[law.wall]\ntype = 'holzapfel-gasser-ogden'\nfamilies = 2\nyoung-modulus = 1e4\n\
             poisson-ratio = 0.45\nfibre-modulus = 5e3\nfibre-exponent = 1\nfibre = {}\n[body.vessel]\n\
             mesh = {{ {TUBE} }}\nlaw = 'wall'\ndensity = 1000\n",
            helix(30.0)
        );
        let missing = build(&read(&text)).expect_err("a mistake").plain().to_string();
        assert!(missing.contains("two families of fibres, but no `second-fibre`"), "{missing}");
        let Built { model, .. } = build(&read(&format!("{text}second-fibre = {}\n", helix(-30.0))))
            .unwrap_or_else(|error| panic!("{}", error.plain()));
        let solid = &model.solids[0];
        assert_eq!(solid.fibre.len(), 2 * solid.cells.len());
        for cell in 0..solid.cells.len() {
            let [a, b] = solid.fibres(cell) else { panic!("two families") };
            // The axis halves the angle between them: their sum is a ring, their difference the axis.
            assert!((a[2] - 0.5).abs() < 1e-12 && (b[2] + 0.5).abs() < 1e-12);
            assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn tangential_on_a_sphere_is_orthogonal_to_the_radius() {
        let wanted = Vector3::new(0.3, 0.0, 1.0);
        for edge in [0.012, 0.006] {
            // The nearest point lies on a facet that the cell looks at: its radius differs by at most half
            // the angle that the facet subtends. Near the middle of the sphere no facet is nearest.
            let aside = 0.5 * edge / 0.05;
            let mesh = SPHERE.replace("0.012", &edge.to_string());
            let pairs = fibres(&mesh, "{ tangential = { closest-to = [0.3, 0, 1] } }");
            for (centre, fibre) in pairs.into_iter().filter(|(centre, _)| centre.norm() > 0.03) {
                let radius = centre.normalize();
                let exact = wanted - radius * radius.dot(&wanted);
                // The direction turns the faster, the nearer `closest-to` is to the normal.
                let slant = exact.norm() / wanted.norm();
                if slant > 2.0 * aside {
                    assert!(fibre.dot(&radius).abs() < aside, "{} at {centre}", fibre.dot(&radius));
                    let off = (fibre - exact.normalize()).norm();
                    assert!(off < aside / (slant - aside), "{off} at {centre}");
                }
            }
        }
    }

    #[test]
    fn tangential_to_one_face_of_a_block_lies_in_it_everywhere() {
        let rule = "{ tangential = { surface = { set = 'z-max' }, closest-to = [1, 0, 5] } }";
        for (_, fibre) in fibres(BLOCK, rule) {
            assert!((fibre - Vector3::x()).norm() < 1e-12);
        }
    }

    #[test]
    fn laplace_between_two_faces_of_a_block_is_the_line_between_them() {
        let rule = "{ laplace = { from = { set = 'x-max' }, to = { set = 'x-min' } } }";
        for cells in ["tets", "hexes"] {
            for (_, fibre) in fibres(&format!("{BLOCK}, as = '{cells}'"), rule) {
                // Linear functions are exact; the solver leaves 1e-10.
                assert!((fibre + Vector3::x()).norm() < 1e-8, "{fibre}");
            }
        }
    }

    /// φ = ln(r/a)/ln(b/a): radial, |∇φ| = 1/(r ln(b/a)).
    #[test]
    fn laplace_through_the_wall_of_a_tube_is_radial() {
        let rule = "{ laplace = { from = { set = 'inner' }, to = { set = 'outer' } } }";
        for (cells, limit) in [("tets", 0.2), ("hexes", 0.01)] {
            let pairs = fibres(&format!("{TUBE}, as = '{cells}'"), rule);
            let off = |(centre, fibre): &(Vector3, Vector3)| {
                (fibre - Vector3::new(centre.x, centre.y, 0.0).normalize()).norm()
            };
            let mean = pairs.iter().map(off).sum::<f64>() / pairs.len() as f64;
            let worst = pairs.iter().map(off).fold(0.0, f64::max);
            // Hexes are symmetric about the radius through their centre; tets are not: first order in the
            // cell size.
            assert!(worst < limit && mean < limit / 2.0, "{cells}: {worst:.3}, mean {mean:.3}");
        }
    }

    #[test]
    fn lost_directions_are_told_with_their_cells() {
        let hexes = format!("{BLOCK}, as = 'hexes'");
        let says = refused(&hexes, "{ toward = [0.005, 0.005, 0.005] }");
        assert!(
            says.contains("point of `toward`: hex 0 (counted from 0) (help: move the point off"),
            "{says}"
        );
        let says = refused(&hexes, "{ around = { point = [0.005, 0.005, 0], axis = [0, 0, 1] } }");
        assert!(says.contains("axis of `around`: hex 0, hex 16, hex 32, hex 48"), "{says}");
        let rule = "{ tangential = { surface = { set = 'z-max' }, closest-to = [0, 0, 1] } }";
        let says = refused(&hexes, rule);
        assert!(says.contains("perpendicular to the surface: hex 0, hex 1,"), "{says}");
        let below = "{ box = [[0, 0, 0], [0.04, 0.04, 0.01]] }";
        let says =
            refused(&hexes, &format!("{{ laplace = {{ from = {below}, to = {{ set = 'z-max' }} }} }}"));
        assert!(
            says.contains("equation is constant: hex 0, hex 1,") && says.contains("… (16 in all"),
            "{says}"
        );
    }

    #[test]
    fn rules_without_a_direction_or_a_surface_are_refused() {
        for (rule, says) in [
            ("{ along = [0, 0, 0] }", "the fibre direction is zero"),
            ("{ around = { point = [0, 0, 0], axis = [0, 0, 0] } }", "the axis is zero"),
            ("{ tangential = { closest-to = [0, 0, 0] } }", "`closest-to` is zero"),
            (
                "{ tangential = { surface = { set = 'top' }, closest-to = [0, 0, 1] } }",
                "no set is named `top`",
            ),
            ("{ laplace = { from = { set = 'x-min' }, to = { set = 'xmax' } } }", "did you mean `x-max`"),
            (
                "{ laplace = { from = { set = 'x-min' }, to = { set = 'y-min' } } }",
                "is in `from` and in `to`",
            ),
        ] {
            let message = refused(BLOCK, rule);
            assert!(message.contains(says), "{message}");
        }
    }
}
