//! Readable files: regular ones of limited size. Reading a pipe could wait forever, reading a device such as
//! `/dev/zero` would not end.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file, or a link to one. Rejects pipes, devices, sockets and folders without opening them.
///
/// # Errors
/// An error of the operating system, or that this is not a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_file() {
        return File::open(path);
    }
    let what = if kind.is_dir() {
        "it is a folder"
    } else {
        "it is not a regular file but a pipe, a socket or a device; write its data to a file first"
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, what))
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// The errors of [`open_regular`], or that the file is larger.
pub fn read_limited(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let announced = file.metadata()?.len();
    let mut bytes = Vec::new();
    // A file can grow while it is read.
    if announced <= limit && file.take(limit.saturating_add(1)).read_to_end(&mut bytes)? as u64 <= limit {
        return Ok(bytes);
    }
    let length = announced.max(bytes.len() as u64);
    let what = if length >= 1 << 20 {
        format!("it has {} MB, more than the limit of {} MB", length >> 20, limit >> 20)
    } else {
        format!("it has {length} bytes, more than the limit of {limit}")
    };
    Err(io::Error::new(io::ErrorKind::FileTooLarge, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_up_to_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("seven");
        fs::write(&path, "seven77").unwrap();
        assert_eq!(read_limited(&path, 7).unwrap(), b"seven77");
        assert!(
            read_limited(&path, 6).unwrap_err().to_string().contains("7 bytes, more than the limit of 6")
        );
        fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        let message = read_limited(&path, 1 << 30).unwrap_err().to_string();
        assert_eq!(message, "it has 1048576 MB, more than the limit of 1024 MB");
        assert!(read_limited(folder.path(), 6).unwrap_err().to_string().contains("folder"));
        assert_eq!(read_limited(&folder.path().join("none"), 6).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[test]
    #[cfg(unix)]
    fn devices_are_refused() {
        assert!(open_regular(Path::new("/dev/zero")).unwrap_err().to_string().contains("not a regular file"));
    }
}
