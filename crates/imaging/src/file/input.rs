//! Bytes of a file, decompressed while reading. Memory grows with the bytes that arrive, never with the
//! header.

use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::{MultiGzDecoder, ZlibDecoder};
use pliant_geometry::io::open_regular;

use super::check_within;
use crate::error::{Fault, ImageProblem};
use crate::image::{Numbers, Order, Scalar};

/// Longest header of a text format; NRRD's of 3D Slicer list every segment.
const HEADER_LIMIT: u64 = 1 << 22;

/// Bytes of the pieces in which voxels are read, with progress reported after each.
const PIECE: u64 = 1 << 24;

/// Reader of the bytes of a file.
pub(super) struct Input<'a> {
    bytes: Box<dyn BufRead + 'a>,
    /// The file, where its neighbours may be read.
    path: Option<PathBuf>,
    /// The folder that neighbours have to be in, if there is one.
    within: Option<PathBuf>,
    /// Bytes read (after unpacking).
    at: usize,
    packed: bool,
    /// Bytes that header lines may still take.
    header_left: u64,
    /// Bytes that voxels may take.
    limit: u64,
    /// Receives the part of the voxels that is read.
    progress: &'a dyn Fn(f64),
}

impl<'a> Input<'a> {
    pub fn open(path: &Path, limit: u64, progress: &'a dyn Fn(f64)) -> io::Result<Self> {
        let mut file = BufReader::with_capacity(1 << 16, open_regular(path)?);
        let packed = file.fill_buf()?.starts_with(&[0x1f, 0x8b]);
        Ok(Self { limit, progress, ..Self::new(file, packed, Some(path.to_owned())) })
    }

    pub fn of_bytes(bytes: &'a [u8], limit: u64) -> Self {
        Self { limit, ..Self::new(bytes, bytes.starts_with(&[0x1f, 0x8b]), None) }
    }

    fn new(bytes: impl BufRead + 'a, packed: bool, path: Option<PathBuf>) -> Self {
        let bytes: Box<dyn BufRead + 'a> = if packed {
            Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(bytes)))
        } else {
            Box::new(bytes)
        };
        Self {
            bytes,
            path,
            within: None,
            at: 0,
            packed,
            header_left: HEADER_LIMIT,
            limit: u64::MAX,
            progress: &|_| {},
        }
    }

    /// Restricts the reading of other files to this folder.
    pub(crate) fn stay_within(&mut self, folder: Option<PathBuf>) {
        self.within = folder;
    }

    /// The remaining bytes, as a separate input.
    pub fn rest(&mut self) -> Input<'_> {
        let (path, within, progress) = (self.path.clone(), self.within.clone(), self.progress);
        Input { bytes: Box::new(&mut self.bytes), path, within, progress, ..*self }
    }

    /// Unpacks the rest with gzip.
    pub(crate) fn unpack_gzip(self) -> Self {
        Self { bytes: Box::new(BufReader::new(MultiGzDecoder::new(self.bytes))), packed: true, ..self }
    }

    /// Unpacks the rest with zlib.
    pub(crate) fn unpack_zlib(self) -> Self {
        Self { bytes: Box::new(BufReader::new(ZlibDecoder::new(self.bytes))), packed: true, ..self }
    }

    /// Opens the file of this name in the same folder, from its start, compressed or not. It starts with
    /// voxels, which may look like anything.
    pub fn beside(&self, field: &'static str, name: &str) -> Result<Input<'a>, Fault> {
        let Some(path) = &self.path else {
            return Err(ImageProblem::Unsupported {
                what: format!("data in another file (`{name}`)"),
                remedy: "read the header from its own file",
            }
            .into());
        };
        let path = path.with_file_name("").join(name);
        match check_within(&path, self.within.as_deref()).and_then(|()| open_regular(&path)) {
            Ok(file) => {
                let file = BufReader::with_capacity(1 << 16, file);
                let (within, limit, progress) = (self.within.clone(), self.limit, self.progress);
                Ok(Input { within, limit, progress, ..Input::new(file, false, Some(path)) })
            }
            Err(error) => {
                let expected = "that file must be readable and in the folder of the header";
                Err(ImageProblem::bad(field, name, expected).with_cause(&error).into())
            }
        }
    }

    /// The name of this file with another extension: `scan.hdr.gz` and `img` give `scan.img` and
    /// `scan.img.gz`.
    pub(crate) fn sibling_names(&self, ending: &str) -> Vec<String> {
        let name = self.path.as_deref().and_then(|path| path.file_name()?.to_str());
        let stem =
            name.map(|name| name.strip_suffix(".gz").unwrap_or(name)).and_then(|name| name.rsplit_once('.'));
        stem.map_or(Vec::new(), |(stem, _)| vec![format!("{stem}.{ending}"), format!("{stem}.{ending}.gz")])
    }

    /// Up to `count` of the coming bytes, without moving.
    pub fn peek(&mut self, count: usize) -> Result<Vec<u8>, Fault> {
        let before = self.at;
        let head = self.up_to(count as u64, "the first bytes")?;
        self.at = before;
        let rest = std::mem::replace(&mut self.bytes, Box::new(io::empty()));
        self.bytes = Box::new(Cursor::new(head.clone()).chain(rest));
        Ok(head)
    }

    /// Up to `count` bytes.
    pub(crate) fn up_to(&mut self, count: u64, reading: &'static str) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::new();
        let result = (&mut self.bytes).take(count).read_to_end(&mut bytes);
        self.at += bytes.len();
        match result {
            Ok(_) => Ok(bytes),
            Err(error) => Err(self.broken(reading, &error)),
        }
    }

    /// Exactly `count` bytes.
    pub fn exact(&mut self, count: u64, reading: &'static str) -> Result<Vec<u8>, Fault> {
        let start = self.at;
        let bytes = self.up_to(count, reading)?;
        let found = bytes.len() as u64;
        if found < count {
            return Err(ImageProblem::Truncated { reading, expected: count, found }.at_byte(start));
        }
        Ok(bytes)
    }

    /// Passes over `count` bytes.
    pub fn skip(&mut self, count: u64, reading: &'static str) -> Result<(), Fault> {
        match io::copy(&mut (&mut self.bytes).take(count), &mut io::sink()) {
            Ok(found) => {
                self.at += found as usize;
                let problem = ImageProblem::Truncated { reading, expected: count, found };
                if found < count { Err(problem.at_byte(self.at)) } else { Ok(()) }
            }
            Err(error) => Err(self.broken(reading, &error)),
        }
    }

    /// The next line without its end; `None` at the end of the file.
    pub fn line(&mut self) -> Result<Option<String>, Fault> {
        let mut line = Vec::new();
        let result = (&mut self.bytes).take(self.header_left).read_until(b'\n', &mut line);
        self.at += line.len();
        self.header_left -= (line.len() as u64).min(self.header_left);
        if let Err(error) = result {
            return Err(self.broken("the header", &error));
        }
        if self.header_left == 0 {
            return Err(ImageProblem::Unsupported {
                what: "a header of more than 4 MiB".to_owned(),
                remedy: "check that this is an image",
            }
            .into());
        }
        if line.is_empty() {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&line);
        Ok(Some(text.trim_end_matches(['\n', '\r']).to_owned()))
    }

    /// The numbers of `count` voxels.
    pub fn numbers(&mut self, count: usize, scalar: Scalar, order: Order) -> Result<Numbers, Fault> {
        let (needed, start) = (self.within_limit(count, scalar)?, self.at);
        let mut bytes = Vec::new();
        while (bytes.len() as u64) < needed {
            let piece = self.up_to(PIECE.min(needed - bytes.len() as u64), "the voxels")?;
            if piece.is_empty() {
                let (reading, found) = ("the voxels", bytes.len() as u64);
                return Err(ImageProblem::Truncated { reading, expected: needed, found }.at_byte(start));
            }
            bytes.extend_from_slice(&piece);
            (self.progress)(bytes.len() as f64 / needed as f64);
        }
        Ok(Numbers { scalar, order, bytes })
    }

    /// Bytes of `count` numbers, if the limit allows them.
    pub(crate) fn within_limit(&self, count: usize, scalar: Scalar) -> Result<u64, ImageProblem> {
        let (bytes, limit) = (count as u64 * scalar.size() as u64, self.limit);
        if bytes > limit { Err(ImageProblem::TooManyBytes { bytes, limit }) } else { Ok(bytes) }
    }

    fn broken(&self, reading: &'static str, error: &io::Error) -> Fault {
        let message = if self.packed { error.to_string() } else { format!("reading failed: {error}") };
        ImageProblem::Packed { reading, found: self.at as u64, message }.at_byte(self.at)
    }
}

impl ImageProblem {
    /// Adds the error of the operating system to the value of a bad field.
    fn with_cause(mut self, cause: &io::Error) -> Self {
        if let Self::BadField { value, .. } = &mut self {
            *value += &format!(" ({cause})");
        }
        self
    }
}
