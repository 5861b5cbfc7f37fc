//! Numbers of a Gmsh file, which are words of text or binary: the same calls read both.

use std::fmt::Arguments;

use crate::io::cursor::{Cursor, Order, Scalar};
use crate::io::error::{Fault, Place};

/// Storage of the numbers of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Binary {
        order: Order,
        /// The type of counts and of node and element numbers (`size_t` in Gmsh 4, `int` before).
        size: Scalar,
    },
}

/// The file's bytes and how its numbers are stored.
pub(super) struct Numbers<'a> {
    pub cursor: Cursor<'a>,
    pub encoding: Encoding,
}

impl<'a> Numbers<'a> {
    pub fn place(&self) -> Place {
        self.cursor.place()
    }

    pub(crate) fn is_binary(&self) -> bool {
        self.encoding != Encoding::Text
    }

    fn binary_integer(&mut self, scalar: Scalar, order: Order, what: Arguments<'_>) -> Result<i64, Fault> {
        let bytes = self.cursor.take(scalar.size(), what)?;
        Ok(scalar.decode_integers(bytes, order).first().copied().unwrap_or_default())
    }

    /// An `int`.
    pub fn int(&mut self, what: Arguments<'_>) -> Result<i64, Fault> {
        match self.encoding {
            Encoding::Text => self.cursor.integer(what),
            Encoding::Binary { order, .. } => self.binary_integer(Scalar::I32, order, what),
        }
    }

    /// A number of a node or an element.
    pub fn tag(&mut self, what: Arguments<'_>) -> Result<i64, Fault> {
        match self.encoding {
            Encoding::Text => self.cursor.integer(what),
            Encoding::Binary { order, size } => self.binary_integer(size, order, what),
        }
    }

    /// A count of things that take at least `text` bytes each as text and `binary` bytes each in binary.
    pub fn count(&mut self, text: usize, binary: usize, what: Arguments<'_>) -> Result<usize, Fault> {
        let count = self.tag(what)?;
        let each = if self.is_binary() { binary } else { text };
        let Ok(count) = usize::try_from(count) else {
            return Err(self.cursor.malformed(format!("the count {count} is negative (reading {what})")));
        };
        self.cursor.room(count, each, what)?;
        Ok(count)
    }

    /// A floating point number.
    pub fn real(&mut self, what: Arguments<'_>) -> Result<f64, Fault> {
        match self.encoding {
            Encoding::Text => self.cursor.real(what),
            Encoding::Binary { order, .. } => {
                let bytes = self.cursor.take(8, what)?;
                Ok(Scalar::F64.decode(bytes, order).first().copied().unwrap_or_default())
            }
        }
    }
}
