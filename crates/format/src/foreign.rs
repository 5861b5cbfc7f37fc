//! Files of other programs that are neither a mesh nor a scene here: their kinds, and advice.

use std::path::Path;

/// Files by their ending: kind and advice.
const BY_ENDING: [(&str, &str, &str); 9] = [
    ("inp", "an input deck of Abaqus or CalculiX", "`meshio convert model.inp model.vtu` makes a mesh of it"),
    ("bdf", "an input deck of Nastran", "`meshio convert model.bdf model.vtu` makes a mesh of it"),
    ("med", "a mesh of Salome", "`meshio convert model.med model.vtu` makes a mesh of it"),
    ("k", "an input deck of LS-DYNA", "export its mesh as VTK from the program that made it"),
    ("feb", "a model of FEBio", "export its mesh as VTK from FEBio Studio"),
    ("scn", "a scene of SOFA", "its mesh is the file that its loader names in `filename`: give that one"),
    ("step", "a CAD model without cells", "Gmsh makes a mesh of it: `gmsh -3 model.step -o model.msh`"),
    ("stp", "a CAD model without cells", "Gmsh makes a mesh of it: `gmsh -3 model.stp -o model.msh`"),
    ("iges", "a CAD model without cells", "Gmsh makes a mesh of it: `gmsh -3 model.iges -o model.msh`"),
];

/// Scenes in XML by a word that they contain.
const BY_WORD: [(&str, &str, &str); 3] = [
    ("<Model", "a model of NiftySim", "`pliant import MODEL.xml -o scene.toml` makes a scene of it"),
    (
        "<febio_spec",
        "a model of FEBio",
        "export its mesh as VTK from FEBio Studio, and write a scene with `pliant new`",
    ),
    (
        "<Node",
        "a scene of SOFA",
        "write a scene with `pliant new`, and name the mesh files of its loaders there",
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
    let own = BY_ENDING.iter().find(|(known, ..)| ending.eq_ignore_ascii_case(known));
    own.map(|&(_, what, help)| [what, help])
}

/// Returns the kind of a text and advice, if the text is XML and not TOML.
pub(crate) fn foreign_text(text: &str) -> Option<[&'static str; 2]> {
    text.trim_start_matches('\u{feff}').trim_start().starts_with('<').then(|| {
        let own = BY_WORD.iter().find(|(word, ..)| text.contains(word));
        own.map_or(["XML", "a scene is written in TOML: `pliant new NAME` writes one"], |&(_, what, help)| {
            [what, help]
        })
    })
}
