//! The list of the files of a series (`.pvd`).

use std::path::{Path, PathBuf};
use std::{fs, io};

use roxmltree::Node;

use super::{MeshFileError, MeshFileProblem, PVD_TAIL, Place, parse_xml};

/// Reads the list of the files of a series: time [s] and file of each frame. Files are relative to the folder
/// of the list.
///
/// # Errors
/// If it cannot be read, or where it is malformed.
pub fn read_pvd(path: &Path) -> Result<Vec<(f64, PathBuf)>, MeshFileError> {
    parse(path, &fs::read_to_string(path).map_err(unreadable(path))?)
}

/// Reads the list of a series whose writer may have been stopped. If its end is torn, only the frames of
/// whole entries are returned.
///
/// # Errors
/// The errors of [`read_pvd`], if more than its end is torn.
pub fn read_torn_pvd(path: &Path) -> Result<Vec<(f64, PathBuf)>, MeshFileError> {
    let bytes = fs::read(path).map_err(unreadable(path))?;
    // A name may be torn within a character.
    let text = String::from_utf8_lossy(&bytes);
    parse(path, &text).or_else(|error| {
        let end = text.rfind("/>").ok_or(error)? + 2;
        parse(path, &format!("{}\n{PVD_TAIL}", &text[..end]))
    })
}

fn unreadable(path: &Path) -> impl Fn(io::Error) -> MeshFileError {
    |source| MeshFileError::Open { path: path.to_owned(), source }
}

fn parse(path: &Path, text: &str) -> Result<Vec<(f64, PathBuf)>, MeshFileError> {
    let malformed = |place: Place, what: &str| MeshFileError::Content {
        path: path.to_owned(),
        place,
        problem: MeshFileProblem::Malformed { what: what.into() },
    };
    let document =
        parse_xml(text).map_err(|error| malformed(Place::Line(error.line), &format!("not XML ({error})")))?;
    let frames = document.descendants().filter(|node| node.has_tag_name("DataSet"));
    let folder = path.parent().unwrap_or(Path::new(""));
    let frame = |frame: Node<'_, '_>| {
        let time = frame.attribute("timestep")?.trim().parse().ok().filter(|time: &f64| time.is_finite())?;
        Some((time, folder.join(frame.attribute("file")?)))
    };
    let line = |node: Node<'_, '_>| Place::Line(document.text_pos_at(node.range().start).row as usize);
    frames
        .map(|node| frame(node).ok_or_else(|| malformed(line(node), "a frame without a time or a file")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_names_times_and_files_and_a_broken_one_its_line() {
        let path = Path::new("out/a.pvd");
        let list = "<VTKFile>\n<Collection>\n<DataSet timestep=\"0.1\" file=\"a/1 &amp; 2.vtu\"/>\n</Collection></VTKFile>";
        assert_eq!(parse(path, list).unwrap(), [(0.1, PathBuf::from("out/a/1 & 2.vtu"))]);
        for broken in [list.replace("0.1", "x"), list.replace("0.1", "inf"), list.replace("file", "name")] {
            let message = parse(path, &broken).unwrap_err().to_string();
            assert!(message.contains("line 3: a frame without a time or a file"), "{message}");
        }
        assert!(parse(path, "no XML").is_err() && read_pvd(Path::new("none.pvd")).is_err());
    }
}
