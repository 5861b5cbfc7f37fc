//! A field of a simulation that is open.

use pliant_run::FieldReader;

/// A field that is read again and again.
pub(crate) struct OpenField {
    pub(crate) on: String,
    pub(crate) name: String,
    pub(crate) at: u32,
    pub(crate) reader: FieldReader,
}
