//! A reader that moves through the bytes of a file: words of text, lines, and blocks of binary numbers. Every
//! count is compared with the remaining bytes before anything is allocated.

use std::fmt::{self, Display};
use std::str::FromStr;

use super::error::{Fault, MeshFileProblem, Place};

/// Byte order of binary numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

/// Type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

macro_rules! decode {
    ($bytes:expr, $order:expr, $number:ty, $result:ty) => {{
        let chunks = $bytes.chunks_exact(size_of::<$number>());
        match $order {
            Order::Little => chunks
                .map(|c| <$number>::from_le_bytes(c.try_into().unwrap_or_default()) as $result)
                .collect(),
            Order::Big => chunks
                .map(|c| <$number>::from_be_bytes(c.try_into().unwrap_or_default()) as $result)
                .collect(),
        }
    }};
}

impl Scalar {
    pub const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub const fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Decodes `bytes` as floating point numbers.
    pub fn decode(self, bytes: &[u8], order: Order) -> Vec<f64> {
        match self {
            Self::I8 => decode!(bytes, order, i8, f64),
            Self::U8 => decode!(bytes, order, u8, f64),
            Self::I16 => decode!(bytes, order, i16, f64),
            Self::U16 => decode!(bytes, order, u16, f64),
            Self::I32 => decode!(bytes, order, i32, f64),
            Self::U32 => decode!(bytes, order, u32, f64),
            Self::I64 => decode!(bytes, order, i64, f64),
            Self::U64 => decode!(bytes, order, u64, f64),
            Self::F32 => decode!(bytes, order, f32, f64),
            Self::F64 => decode!(bytes, order, f64, f64),
        }
    }

    /// Decodes `bytes` as integers; floating point numbers are cut towards zero.
    pub(crate) fn decode_integers(self, bytes: &[u8], order: Order) -> Vec<i64> {
        match self {
            Self::I8 => decode!(bytes, order, i8, i64),
            Self::U8 => decode!(bytes, order, u8, i64),
            Self::I16 => decode!(bytes, order, i16, i64),
            Self::U16 => decode!(bytes, order, u16, i64),
            Self::I32 => decode!(bytes, order, i32, i64),
            Self::U32 => decode!(bytes, order, u32, i64),
            Self::I64 => decode!(bytes, order, i64, i64),
            Self::U64 => decode!(bytes, order, u64, i64),
            Self::F32 => decode!(bytes, order, f32, i64),
            Self::F64 => decode!(bytes, order, f64, i64),
        }
    }
}

/// A position in the bytes of a file.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    /// True after a binary block: positions are then given in bytes, not lines.
    binary: bool,
    /// Place in the file of the only line that the cursor moves in.
    only_line: Option<Place>,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1, binary: false, only_line: None }
    }

    /// A cursor for the words of a line, at `place` of the file.
    pub(crate) fn of_line(line: &'a [u8], place: Place) -> Self {
        Self { only_line: Some(place), ..Self::new(line) }
    }

    pub fn place(&self) -> Place {
        if let Some(place) = self.only_line {
            place
        } else if self.binary {
            Place::Byte(self.at)
        } else {
            Place::Line(self.line)
        }
    }

    pub fn malformed(&self, what: impl Into<String>) -> Fault {
        Fault::malformed(self.place(), what)
    }

    pub fn truncated(&self, reading: impl Display) -> Fault {
        match self.only_line {
            Some(place) => Fault::malformed(place, format!("the line ends while reading {reading}")),
            None => Fault::truncated(self.place(), reading),
        }
    }

    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Checks that `count` items of at least `each` bytes fit into the rest (the last one without its
    /// separator). Otherwise returns an error, so nothing is allocated for missing items.
    pub fn room(&self, count: usize, each: usize, reading: impl Display) -> Result<(), Fault> {
        match count.checked_mul(each) {
            Some(needed) if needed <= self.rest().len() + 1 => Ok(()),
            _ => Err(self.truncated(reading)),
        }
    }

    fn skip_space(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if !byte.is_ascii_whitespace() {
                break;
            }
            self.line += usize::from(byte == b'\n');
            self.at += 1;
        }
    }

    /// The next word, without moving.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().word()
    }

    /// The next word; `None` at the end.
    pub fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let rest = self.rest();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += end;
        (end > 0).then(|| &rest[..end])
    }

    /// The next word, which must be there.
    pub(crate) fn need_word(&mut self, reading: impl Display) -> Result<&'a [u8], Fault> {
        match self.word() {
            Some(word) => Ok(word),
            None => Err(self.truncated(reading)),
        }
    }

    /// The rest of this line, without its end; `None` at the end of the file.
    pub fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|&byte| byte == b'\n');
        self.at += end.map_or(rest.len(), |end| end + 1);
        self.line += usize::from(end.is_some());
        let line = &rest[..end.unwrap_or(rest.len())];
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// Returns to the position of `earlier`, a copy of this cursor.
    pub fn rewind(&mut self, earlier: Self) {
        *self = earlier;
    }

    /// A number of the next word.
    pub fn real(&mut self, reading: fmt::Arguments<'_>) -> Result<f64, Fault> {
        let word = self.need_word(reading)?;
        self.parse(word, "a number", reading)
    }

    /// An integer of the next word.
    pub fn integer(&mut self, reading: fmt::Arguments<'_>) -> Result<i64, Fault> {
        let word = self.need_word(reading)?;
        self.parse(word, "an integer", reading)
    }

    /// A count of items of at least `each` bytes.
    pub fn count(&mut self, each: usize, reading: fmt::Arguments<'_>) -> Result<usize, Fault> {
        let word = self.need_word(reading)?;
        let count = self.parse(word, "a count", reading)?;
        self.room(count, each, reading)?;
        Ok(count)
    }

    pub fn parse<T: FromStr>(
        &self,
        word: &[u8],
        expected: &'static str,
        reading: impl Display,
    ) -> Result<T, Fault> {
        std::str::from_utf8(word).ok().and_then(|text| text.parse().ok()).ok_or_else(|| Fault {
            place: self.place(),
            problem: MeshFileProblem::BadNumber { text: shown(word), expected, reading: reading.to_string() },
        })
    }

    /// The next `count` bytes of a binary block.
    pub fn take(&mut self, count: usize, reading: impl Display) -> Result<&'a [u8], Fault> {
        self.binary = true;
        let rest = self.rest();
        if count > rest.len() {
            return Err(self.truncated(reading));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    /// The next `count` numbers of a binary block, as bytes.
    pub(crate) fn take_numbers(
        &mut self,
        count: usize,
        scalar: Scalar,
        reading: impl Display,
    ) -> Result<&'a [u8], Fault> {
        match count.checked_mul(scalar.size()) {
            Some(bytes) => self.take(bytes, reading),
            None => Err(self.truncated(reading)),
        }
    }
}

/// A word of a file for a message: readable and short.
pub(super) fn shown(word: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(&word[..word.len().min(160)])
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    if word.len() > text.len() + 3 { format!("{text}…") } else { text }
}

/// A name found in a file.
pub(super) fn name(word: &[u8]) -> String {
    String::from_utf8_lossy(word).trim().to_owned()
}
