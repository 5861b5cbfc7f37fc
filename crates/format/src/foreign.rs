//! Files of other programs that are neither a mesh nor a scene here: their kinds, and advice.

use std::path::Path;

/// Files by their ending: kind and advice.
const BY_ENDING: [(&str, &str, &str); 9] = [
    ("inp", "an input deck of Abaqus or CalculiX", "convert it with `meshio convert model.inp model.vtu`"),
    ("bdf", "an input deck of Nastran", "convert it with `meshio convert model.bdf model.vtu`"),
    ("med", "a mesh of Salome", "convert it with `meshio convert model.med model.vtu`"),
    ("k", "an input deck of LS-DYNA", "export its mesh as VTK from the program that made it"),
    ("feb", "a model of FEBio", "export its mesh as VTK from FEBio Studio"),
    ("scn", "a scene of SOFA", "give the mesh file that its loader names in `filename`"),
    ("step", "a CAD model without cells", "mesh it with Gmsh: `gmsh -3 model.step -o model.msh`"),
    ("stp", "a CAD model without cells", "mesh it with Gmsh: `gmsh -3 model.stp -o model.msh`"),
    ("iges", "a CAD model without cells", "mesh it with Gmsh: `gmsh -3 model.iges -o model.msh`"),
];

/// Scenes in XML by a word that they contain.
const BY_WORD: [(&str, &str, &str); 3] = [
    ("<Model", "a model of NiftySim", "convert it with `pliant import MODEL.xml -o scene.toml`"),
    (
        "<febio_spec",
        "a model of FEBio",
        "export its mesh as VTK from FEBio Studio, and write a scene with `pliant new`",
    ),
    (
        "<Node",
        "a scene of SOFA",
        "write a scene with `pliant new`, and name there the mesh files of the SOFA loaders",
    ),
];

/// Returns the kind of a file and advice, if its ending names the format of another program.
///
/// ```
/// let [what, help] = pliant_format::foreign_file("model.INP".as_ref()).unwrap();
/// assert!(what.contains("Abaqus") && help.contains("meshio"));
/// assert_eq!(pliant_format::foreign_file("model.vtu".as_ref()), None);
/// ```
pub fn foreign_file(path: &Path) -> Option<[&'static str; 2]> {
    let ending = path.extension()?.to_str()?;
    let entry = BY_ENDING.iter().find(|(known, ..)| ending.eq_ignore_ascii_case(known));
    entry.map(|&(_, what, help)| [what, help])
}

/// Returns the kind of a text and advice, if the text is XML and not TOML.
pub(crate) fn foreign_text(text: &str) -> Option<[&'static str; 2]> {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('<').then(|| {
        let entry = BY_WORD.iter().find(|(word, ..)| text.contains(word));
        entry.map_or(
            ["XML", "a scene is written in TOML: `pliant new NAME` writes one"],
            |&(_, what, help)| [what, help],
        )
    })
}
