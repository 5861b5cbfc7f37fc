//! Status codes, and the report of an error.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use pliant_format::ReadError;
use pliant_format::diagnostic::SceneErrors;
use pliant_format::source::Source;
use pliant_sim::Failure;

/// Result of a call.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PliantStatus {
    /// The call succeeded.
    Ok = 0,
    /// A pointer is null that must not be.
    Null = 1,
    /// A text is not UTF-8.
    NotText = 2,
    /// A number is not finite, or out of its range.
    NotANumber = 3,
    /// A buffer is too short; the message says for how many items.
    ShortBuffer = 4,
    /// A handle was never given out by this context, or is of another kind.
    BadHandle = 5,
    /// A handle was closed: by `..._close`, or by a panic.
    Closed = 6,
    /// Another thread has a call on this handle under way. Nothing happened.
    Busy = 7,
    /// There is nothing of this name.
    Unknown = 8,
    /// The scene has mistakes; line, column and key locate the first one.
    Scene = 9,
    /// A file can't be read.
    File = 10,
    /// The simulation failed; kind, body, node, element and time locate the failure.
    Failed = 11,
    /// The solver or the device can't do this.
    Unsupported = 12,
    /// Another thread asked to stop; the steps taken so far stay.
    Stopped = 13,
    /// The program was built for another version of this interface.
    Version = 14,
    /// A cell names a node that does not exist, or has an unknown type.
    BadCells = 15,
    /// A snapshot is damaged, or of another model.
    BadSnapshot = 16,
    /// A defect of Pliant. The handle is closed.
    Internal = 17,
}

/// An error and its place. The caller owns it; it holds no memory of the library. Texts are UTF-8, end with a
/// zero and are cut where they are longer.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PliantError {
    /// The code that the call returned.
    pub status: PliantStatus,
    /// Mistakes of the scene in all; 0 of other errors.
    pub mistakes: u32,
    /// Line and column in the scene, from 1, the column in characters; 0 if there is no such place.
    pub line: u32,
    /// See `line`.
    pub column: u32,
    /// The node of `body`, from 0; -1 if it is about none.
    pub node: i64,
    /// The element of `body`, from 0; -1 if it is about none.
    pub element: i64,
    /// Time [s] of the simulation; NaN if it is about none.
    pub time: f64,
    /// Kind of a `PLIANT_STATUS_FAILED`: `not-finite`, `inverted`, `unbalanced`, `unstable`, `singular`,
    /// `not-converged`, `blocked`, `intersecting`, `hourglass`, `device`, `output` or `input`.
    pub kind: [c_char; 32],
    /// The body that it is about.
    pub body: [c_char; 64],
    /// The key of the scene, such as `law.tissue.young-modulus`.
    pub key: [c_char; 256],
    /// The scene file, as it was given.
    pub file: [c_char; 512],
    /// The mistake, and a remedy.
    pub message: [c_char; 2048],
}

/// An error on its way to the border.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fault {
    pub(crate) status: PliantStatus,
    pub(crate) message: String,
    place: Option<Box<Place>>,
}

/// Place of an error.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Place {
    mistakes: u32,
    line_and_column: [u32; 2],
    key: String,
    file: String,
    kind: &'static str,
    body: String,
    node: Option<u32>,
    element: Option<u32>,
    time: Option<f64>,
}

impl Fault {
    pub(crate) fn new(status: PliantStatus, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), place: None }
    }

    /// Makes a fault of mistakes of a scene; the key comes from its source, if that was read.
    pub(crate) fn scene(errors: &SceneErrors, source: Option<&Source>) -> Self {
        let mistakes = || errors.diagnostics().iter().filter(|one| one.is_error());
        let Some(first) = mistakes().next() else {
            return Self::new(PliantStatus::Scene, errors.plain().to_string());
        };
        let (line, column) = errors.line_and_column(first).unwrap_or_default();
        let span = first.span.as_ref().filter(|_| first.option.is_none());
        let key = source.zip(span).and_then(|(source, span)| source.key_at(span.start));
        let mut message = first.message.clone();
        for more in
            [Some(&first.label), first.help.as_ref()].into_iter().flatten().filter(|more| !more.is_empty())
        {
            message.push_str("; ");
            message.push_str(more);
        }
        let place = Place {
            mistakes: mistakes().count() as u32,
            line_and_column: [line as u32, column as u32],
            key: key.unwrap_or_default(),
            file: errors.name().to_owned(),
            ..Place::default()
        };
        Self { status: PliantStatus::Scene, message, place: Some(Box::new(place)) }
    }

    pub(crate) fn read(error: &ReadError) -> Self {
        match error {
            ReadError::Scene(errors) => Self::scene(errors, None),
            ReadError::File { path, .. } => {
                let place = Place { file: path.display().to_string(), ..Place::default() };
                Self { place: Some(Box::new(place)), ..Self::new(PliantStatus::File, error.to_string()) }
            }
        }
    }

    fn write(&self, to: &mut MaybeUninit<PliantError>) {
        let other = Place::default();
        let place = self.place.as_deref().unwrap_or(&other);
        to.write(PliantError {
            status: self.status,
            mistakes: place.mistakes,
            line: place.line_and_column[0],
            column: place.line_and_column[1],
            node: place.node.map_or(-1, i64::from),
            element: place.element.map_or(-1, i64::from),
            time: place.time.unwrap_or(f64::NAN),
            kind: text(place.kind),
            body: text(&place.body),
            key: text(&place.key),
            file: text(&place.file),
            message: text(&self.message),
        });
    }
}

impl From<Failure> for Fault {
    fn from(failure: Failure) -> Self {
        let Failure { kind, body, element, node, time, message, .. } = failure;
        let body = body.map(String::from).unwrap_or_default();
        let place = Place { kind: kind.word(), body, node, element, time, ..Place::default() };
        Self { status: PliantStatus::Failed, message, place: Some(Box::new(place)) }
    }
}

/// A text with a zero at its end, cut between two characters where it is too long.
fn text<const N: usize>(text: &str) -> [c_char; N] {
    let mut out = [0; N];
    let whole = text.len().min(N - 1);
    let end = (0..=whole).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
    out.iter_mut().zip(&text.as_bytes()[..end]).for_each(|(to, &byte)| *to = byte as c_char);
    out
}

/// The code of a result; its error goes where the caller wants it.
pub(crate) fn reported(
    result: Result<(), Fault>,
    error: Option<&mut MaybeUninit<PliantError>>,
) -> PliantStatus {
    let fault = match result {
        Ok(()) => Fault::new(PliantStatus::Ok, ""),
        Err(fault) => fault,
    };
    if let Some(to) = error {
        match fault.status {
            // No texts are written where all is well.
            PliantStatus::Ok => clear(to),
            _ => fault.write(to),
        }
    }
    fault.status
}

/// Reports that all is well: `status`, and empty texts of kind, key and message. Other fields are not
/// written.
fn clear(to: &mut MaybeUninit<PliantError>) {
    let to = to.as_mut_ptr();
    // SAFETY: `to` points to a whole `PliantError` of the caller, and only places within it are written.
    unsafe {
        (&raw mut (*to).status).write(PliantStatus::Ok);
        for first in [&raw mut (*to).kind[0], &raw mut (*to).key[0], &raw mut (*to).message[0]] {
            first.write(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_cut_between_characters() {
        let bytes = |text: [c_char; 4]| text.map(|byte| byte as u8);
        assert_eq!(bytes(text("ab")), *b"ab\0\0");
        assert_eq!(bytes(text("abü")), *b"ab\0\0");
        assert_eq!(bytes(text("aü")), [b'a', 0xc3, 0xbc, 0]);
    }
}
