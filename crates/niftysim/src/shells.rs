//! Membranes of NiftySim: triangles on the nodes of the solid that resist being stretched, but not being
//! bent.
//!
//! `NeoHookean` is the incompressible law S = μ (I − λ₃² C⁻¹), a neo-Hookean membrane with ν = 0.5 and E = 3
//! μ. `Linear` is linear in the displacements, with the axes at rest. For small displacements it equals the
//! membrane of St Venant and Kirchhoff with the same E and ν. Leaves out: shells that bend, and shells on
//! hexahedra; [`Remarks::missing`] names them.

use pliant_geometry::boundary;

use super::conditions::Remarks;
use super::error::{Fault, ImportProblem};
use super::geometry::{Geometry, Solid, check_listed, positive};
use super::xml::{
    XmlElement, attribute, child, children, count, fault, indices, line, needed, numbers, run_of_indices,
};

/// A membrane.
#[derive(Clone, Debug)]
pub(super) struct Membrane {
    /// The line of its set in the XML.
    pub line: u32,
    pub law: MembraneLaw,
    /// Density [kg/m³].
    pub density: f64,
    /// Thickness at rest [m].
    pub thickness: f64,
    /// Nodes of its triangles.
    pub faces: Vec<Vec<u32>>,
}

/// The law of a membrane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MembraneLaw {
    /// E [Pa], ν.
    Linear([f64; 2]),
    /// μ [Pa].
    NeoHookean(f64),
}

impl MembraneLaw {
    /// The table of the law without its header.
    pub fn lines(self) -> [String; 3] {
        let (name, young, poisson) = match self {
            Self::Linear([young, poisson]) => ("st-venant-kirchhoff", young, poisson),
            Self::NeoHookean(mu) => ("neo-hookean", 3.0 * mu, 0.5),
        };
        [
            format!("type = \"{name}\""),
            format!("young-modulus = {young:?}"),
            format!("poisson-ratio = {poisson:?}"),
        ]
    }
}

const ELEMENTS: &str = "<ShellElements Type=\"SURFACE\"/>, or Type=\"T3\" with triangles";
const SETS: &str = "<ShellElementSet Size=\"all\"> with a <Material>";
const MATERIAL: &str =
    "<Material Type=\"NeoHookean\">mu <Density>…</Density><Thickness>…</Thickness></Material>";

/// Reads the membranes of a model or submodel.
pub(super) fn read(
    of: XmlElement<'_>,
    geometry: &Geometry,
    remarks: &mut Remarks,
) -> Result<Vec<Membrane>, Fault> {
    let (elements, set) = (child(of, "ShellElements"), child(of, "ShellElementSet"));
    if elements.is_none() && set.is_none() {
        return Ok(Vec::new());
    }
    let elements = needed(of, "ShellElements", ELEMENTS)?;
    needed(of, "ShellElementSet", SETS)?;
    let kind = elements
        .attribute("type")
        .map_or_else(|| attribute(elements, "Type", "Type=\"SURFACE\""), Ok)?
        .trim();
    if geometry.solid == Solid::H8 || kind == "Q4" {
        remarks.missing.push(format!(
            "the shells of line {} (on quads; imported membranes must be triangles on tets)",
            line(elements)
        ));
        return Ok(Vec::new());
    }
    let triangles = triangles(elements, kind, geometry)?;
    let mut taken = vec![false; triangles.len()];
    let mut membranes = Vec::new();
    for set in children(of, "ShellElementSet") {
        let members = members(set, triangles.len())?;
        if kind == "SURFACE" && members.len() < triangles.len() {
            remarks.missing.push(format!(
                "the shells of line {} (a part of the surface, whose triangle numbers only NiftySim knows; list them with \
                 Type=\"T3\")",
                line(set)
            ));
            continue;
        }
        let Some(mut membrane) = without_faces(set, remarks)? else { continue };
        for &member in &members {
            if std::mem::replace(&mut taken[member as usize], true) {
                let what = format!("shell element {member} is in two sets");
                let problem = ImportProblem::Contradiction { what, remedy: "keep it in one set" };
                return Err(fault(set, problem));
            }
        }
        if child(set, "ClampedNodes").is_some() {
            remarks.notes.push(format!(
                "line {}: <ClampedNodes> is for shells that bend; membranes do not",
                membrane.line
            ));
        }
        membrane.faces = members.iter().map(|&member| triangles[member as usize].clone()).collect();
        membranes.push(membrane);
    }
    Ok(membranes)
}

/// The triangles of elements of a type, by their nodes.
fn triangles(of: XmlElement<'_>, kind: &str, geometry: &Geometry) -> Result<Vec<Vec<u32>>, Fault> {
    match kind {
        "SURFACE" => Ok(boundary(&geometry.mesh).faces.iter().map(|face| face.nodes().to_vec()).collect()),
        "T3" => {
            let nodes = indices(of, "node", geometry.node_count())?;
            check_listed(of, "NumEls", "node indices", nodes.len(), 3)?;
            Ok(nodes.chunks_exact(3).map(<[u32]>::to_vec).collect())
        }
        other => {
            let (what, known) = ("type of shell elements", "T3, SURFACE");
            Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
        }
    }
}

/// Reads the elements of a set, out of `element_count`.
fn members(set: XmlElement<'_>, element_count: usize) -> Result<Vec<u32>, Fault> {
    match attribute(set, "Size", "Size=\"all\" or a number")? {
        "all" => Ok((0..element_count as u32).collect()),
        word => {
            let size = count(set, word)?;
            let listed = indices(set, "shell element", element_count)?;
            run_of_indices(set, listed, size, "shell element", "shell elements", element_count)
        }
    }
}

/// The membrane of a set, still without triangles; `None` if it bends, which is left out.
fn without_faces(set: XmlElement<'_>, remarks: &mut Remarks) -> Result<Option<Membrane>, Fault> {
    let line = line(set);
    let material = needed(set, "Material", MATERIAL)?;
    let Some(law) = law(material)? else {
        let name = attribute(material, "Type", MATERIAL)?;
        remarks.missing.push(format!(
            "the shells of line {line} ({name} bends, which walls of `solver = \"explicit\"` do not; take Linear or \
             NeoHookean, or write a scene with `model = \"shell\"` and `solver = \"implicit\"`)"
        ));
        return Ok(None);
    };
    let density = positive(needed(material, "Density", "<Density>1000</Density>")?, "the density")?;
    let thickness = positive(needed(material, "Thickness", "<Thickness>1e-3</Thickness>")?, "the thickness")?;
    Ok(Some(Membrane { line, law, density, thickness, faces: Vec::new() }))
}

/// The law of a material; `None` if it bends.
fn law(of: XmlElement<'_>) -> Result<Option<MembraneLaw>, Fault> {
    let known = "Linear, NeoHookean, LinearShell, LinearThickShell";
    let name = attribute(of, "Type", "Type=\"Linear\" or \"NeoHookean\"")?;
    let values = numbers(of)?;
    let count = |wanted: &str| {
        let (what, found, wanted) = ("parameters", values.len(), format!("{wanted} ({name})"));
        fault(of, ImportProblem::Count { what, found, wanted })
    };
    let in_range = |what, value: f64, fits: bool, range| {
        if fits { Ok(()) } else { Err(fault(of, ImportProblem::OutOfRange { what, value, range })) }
    };
    match name {
        "Linear" => {
            let [young, poisson] = values[..] else { return Err(count("2: E nu")) };
            in_range("E", young, young > 0.0, "greater than 0")?;
            let range = "greater than -1 and less than 0.5";
            in_range("nu", poisson, poisson > -1.0 && poisson < 0.5, range)?;
            Ok(Some(MembraneLaw::Linear([young, poisson])))
        }
        "NeoHookean" => {
            let [mu] = values[..] else { return Err(count("1: mu")) };
            in_range("mu", mu, mu > 0.0, "greater than 0")?;
            Ok(Some(MembraneLaw::NeoHookean(mu)))
        }
        "LinearShell" | "LinearThickShell" => Ok(None),
        other => {
            let what = "type of shell material";
            Err(fault(of, ImportProblem::Unknown { what, found: other.into(), known }))
        }
    }
}
