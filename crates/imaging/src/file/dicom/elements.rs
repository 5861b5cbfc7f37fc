//! The elements of a DICOM file that are read, with the sequences that hold them. Encoding: DICOM PS3.5
//! sections 7.1, 7.5 and annex A. Leaves out: compressed pixels, elements and sequences that nobody asks for
//! (they are passed over).

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

use super::{DECOMPRESS, EXPORT, FILE_LIMIT};
use crate::error::{Fault, ImageProblem};
use crate::image::{Order, Scalar};

/// Sequences within sequences.
const DEEPEST: usize = 64;

/// Items of all sequences together. A frame has a few.
const MOST_ITEMS: usize = 1 << 20;

/// The length code for "until a delimiter".
const UNDEFINED: u32 = u32::MAX;

const ITEM: u32 = 0xFFFE_E000;
const ITEM_END: u32 = 0xFFFE_E00D;
const SEQUENCE_END: u32 = 0xFFFE_E0DD;
pub(super) const PIXELS: u32 = 0x7FE0_0010;

/// The tags that are read, by number.
const TAGS: [u32; 27] = [
    0x0002_0010, // TransferSyntaxUID
    0x0008_0016, // SOPClassUID
    0x0008_103E, // SeriesDescription
    0x0018_0050, // SliceThickness
    0x0018_0088, // SpacingBetweenSlices
    0x0020_000E, // SeriesInstanceUID
    0x0020_0032, // ImagePositionPatient
    0x0020_0037, // ImageOrientationPatient
    0x0028_0002, // SamplesPerPixel
    0x0028_0004, // PhotometricInterpretation
    0x0028_0008, // NumberOfFrames
    0x0028_0010, // Rows
    0x0028_0011, // Columns
    0x0028_0030, // PixelSpacing
    0x0028_0100, // BitsAllocated
    0x0028_0101, // BitsStored
    0x0028_0102, // HighBit
    0x0028_0103, // PixelRepresentation
    0x0028_1052, // RescaleIntercept
    0x0028_1053, // RescaleSlope
    0x0062_0001, // SegmentationType
    0x0062_0004, // SegmentNumber
    0x0062_0005, // SegmentLabel
    0x0062_000B, // ReferencedSegmentNumber
    0x0062_000E, // MaximumFractionalValue
    0x3006_0002, // StructureSetLabel
    PIXELS,
];

/// The sequences whose items are read, by number.
const SEQUENCES: [u32; 8] = [
    0x0020_9113, // PlanePositionSequence
    0x0020_9116, // PlaneOrientationSequence
    0x0028_9110, // PixelMeasuresSequence
    0x0028_9145, // PixelValueTransformationSequence
    0x0062_0002, // SegmentSequence
    0x0062_000A, // SegmentIdentificationSequence
    0x5200_9229, // SharedFunctionalGroupsSequence
    0x5200_9230, // PerFrameFunctionalGroupsSequence
];

/// A DICOM file, decompressed if it was deflated.
pub(super) struct DataSet<'a> {
    bytes: Cow<'a, [u8]>,
    /// Offset of the data set in the bytes.
    start: usize,
    explicit: bool,
    order: Order,
    compressed: Option<String>,
}

impl<'a> DataSet<'a> {
    /// Reads the header of a DICOM file; `None` if the bytes are of another format.
    pub fn of(bytes: &'a [u8]) -> Result<Option<Self>, Fault> {
        if bytes.get(128..132) != Some(b"DICM") {
            return Ok(None);
        }
        let mut meta = Walk { bytes, at: 132, explicit: true, order: Order::Little, items: 0 };
        let syntax = meta.set(Level::Meta, 0)?.text(0x0002_0010);
        let (explicit, order) = match syntax.as_deref() {
            Some("1.2.840.10008.1.2") => (false, Order::Little),
            Some("1.2.840.10008.1.2.2") => (true, Order::Big),
            _ => (true, Order::Little),
        };
        let (start, rest) = (meta.at, &bytes[meta.at..]);
        let mut set = Self { bytes: bytes.into(), start, explicit, order, compressed: None };
        match syntax {
            None => return Err(ImageProblem::MissingField { field: "TransferSyntaxUID" }.at_byte(132)),
            Some(syntax) if syntax == "1.2.840.10008.1.2.1.99" => {
                let mut unpacked = Vec::new();
                let result =
                    flate2::bufread::DeflateDecoder::new(rest).take(FILE_LIMIT).read_to_end(&mut unpacked);
                if let Err(error) = result {
                    let (found, message) = (unpacked.len() as u64, error.to_string());
                    return Err(ImageProblem::Packed { reading: "the slice", found, message }.at_byte(start));
                }
                (set.bytes, set.start) = (unpacked.into(), 0);
            }
            Some(syntax) => {
                let plain = ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"];
                set.compressed = Some(syntax).filter(|syntax| !plain.contains(&syntax.as_str()));
            }
        }
        Ok(Some(set))
    }

    pub fn elements(&self) -> Result<Elements<'_>, Fault> {
        let Self { bytes, start, explicit, order, .. } = self;
        let mut walk = Walk { bytes, at: *start, explicit: *explicit, order: *order, items: 0 };
        let elements = walk.set(Level::Top, 0)?;
        Ok(Elements { compressed: self.compressed.clone(), ..elements })
    }
}

/// The elements of a file, or of an item of a sequence, that matter here.
pub(super) struct Elements<'a> {
    /// Value by tag (group × 2¹⁶ + element).
    values: BTreeMap<u32, &'a [u8]>,
    /// Items by the tag of their sequence.
    sequences: BTreeMap<u32, Vec<Elements<'a>>>,
    order: Order,
    /// Name of a transfer syntax that is not read.
    compressed: Option<String>,
}

impl<'a> Elements<'a> {
    pub fn get(&self, tag: u32) -> Option<&'a [u8]> {
        self.values.get(&tag).copied()
    }

    /// The items of a sequence; empty if it is missing.
    pub fn items(&self, sequence: u32) -> &[Self] {
        self.sequences.get(&sequence).map_or(&[], Vec::as_slice)
    }

    pub fn text(&self, tag: u32) -> Option<String> {
        let trimmed = |value| String::from_utf8_lossy(value).trim_matches(['\0', ' ']).to_owned();
        self.get(tag).map(trimmed).filter(|text| !text.is_empty())
    }

    pub fn short(&self, tag: u32, field: &'static str) -> Result<u16, ImageProblem> {
        let value = self.get(tag).ok_or(ImageProblem::MissingField { field })?;
        let bytes: [u8; 2] = value.get(..2).and_then(|bytes| bytes.try_into().ok()).ok_or_else(|| {
            ImageProblem::bad(field, format!("{} bytes long", value.len()), "2 bytes are needed")
        })?;
        Ok(if self.order == Order::Little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    /// `N` numbers of a decimal string.
    pub fn reals<const N: usize>(&self, tag: u32, field: &'static str) -> Result<[f64; N], ImageProblem> {
        let text = self.text(tag).ok_or(ImageProblem::MissingField { field })?;
        let numbers: Option<Vec<f64>> =
            text.split('\\').map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
            ImageProblem::bad(field, text, "it has the wrong number of values, or an invalid number")
        })
    }

    /// Frames of the file.
    pub fn frames(&self) -> Result<usize, ImageProblem> {
        let Some(text) = self.text(0x0028_0008) else { return Ok(1) };
        match text.parse() {
            Ok(frames @ 1..) => Ok(frames),
            _ => Err(ImageProblem::bad("NumberOfFrames", text, "a whole number above 0 is needed")),
        }
    }

    pub(crate) fn require_uncompressed(&self) -> Result<(), ImageProblem> {
        let Some(syntax) = &self.compressed else { return Ok(()) };
        let what = format!("a slice in transfer syntax {syntax} (compressed)");
        Err(ImageProblem::Unsupported { what, remedy: DECOMPRESS })
    }

    /// An error for pixels that are not one uncompressed grey or label value each.
    pub(crate) fn require_plain(&self) -> Result<(), ImageProblem> {
        self.require_uncompressed()?;
        let samples = self.short(0x0028_0002, "SamplesPerPixel")?;
        let meaning = self.text(0x0028_0004).unwrap_or_default();
        if samples != 1 || !(meaning.starts_with("MONOCHROME") || meaning == "PALETTE COLOR") {
            let what = format!("pixels of {samples} samples ({meaning})");
            return Err(ImageProblem::Unsupported { what, remedy: EXPORT });
        }
        Ok(())
    }

    pub fn scalar(&self) -> Result<Scalar, ImageProblem> {
        let allocated = self.short(0x0028_0100, "BitsAllocated")?;
        let stored = self.short(0x0028_0101, "BitsStored")?;
        let high = self.short(0x0028_0102, "HighBit")?;
        if stored == 0 || stored > allocated || high != stored - 1 {
            let value = format!("{stored} of {allocated} bits, the highest {high}");
            return Err(ImageProblem::bad(
                "BitsStored",
                value,
                "the lowest bits must be used; export the series again",
            ));
        }
        match (allocated, self.short(0x0028_0103, "PixelRepresentation")?) {
            (8, 0) => Ok(Scalar::U8),
            (8, 1) => Ok(Scalar::I8),
            (16, 0) => Ok(Scalar::U16),
            (16, 1) => Ok(Scalar::I16),
            (32, 0) => Ok(Scalar::U32),
            (32, 1) => Ok(Scalar::I32),
            (bits, sign) => Err(ImageProblem::Unsupported {
                what: format!("pixels of {bits} bits with PixelRepresentation {sign}"),
                remedy: EXPORT,
            }),
        }
    }

    /// Pixels as little-endian numbers, with unused high bits replaced by the sign or by 0.
    pub fn pixels(&self, bytes: &[u8], scalar: Scalar) -> Vec<u8> {
        let size = scalar.size();
        let mut pixels = bytes.to_vec();
        if self.order == Order::Big {
            pixels.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
        let stored = u32::from(self.short(0x0028_0101, "BitsStored").unwrap_or(8 * size as u16));
        let unused = 64 - stored.clamp(1, 64);
        if stored < 8 * size as u32 {
            for pixel in pixels.chunks_exact_mut(size) {
                let mut wide = [0; 8];
                wide[..size].copy_from_slice(pixel);
                let raw = u64::from_le_bytes(wide) << unused;
                let signed = matches!(scalar, Scalar::I8 | Scalar::I16 | Scalar::I32);
                let value = if signed { (raw as i64 >> unused) as u64 } else { raw >> unused };
                pixel.copy_from_slice(&value.to_le_bytes()[..size]);
            }
        }
        pixels
    }
}

/// The nesting of elements.
#[derive(Clone, Copy, PartialEq)]
enum Level {
    /// The group 2 before the data set.
    Meta,
    Top,
    /// An item that ends with its bytes.
    Item,
    /// An item that ends with a delimiter.
    Open,
}

/// A walk over the elements of a data set.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    explicit: bool,
    order: Order,
    /// Items met.
    items: usize,
}

impl<'a> Walk<'a> {
    /// The elements of a level, on the top up to the pixels.
    fn set(&mut self, level: Level, depth: usize) -> Result<Elements<'a>, Fault> {
        let order = self.order;
        let mut found =
            Elements { values: BTreeMap::new(), sequences: BTreeMap::new(), order, compressed: None };
        while self.at < self.bytes.len() {
            let start = self.at;
            let tag = self.tag()?;
            if level == Level::Meta && tag >> 16 != 2 {
                self.at = start;
                break;
            }
            if tag >> 16 == 0xFFFE {
                self.long()?;
                if level == Level::Open && tag == ITEM_END {
                    break;
                }
                let expected = "the file is damaged; copy it again";
                return Err(ImageProblem::bad("a delimiter", "outside any sequence", expected).at_byte(start));
            }
            let (kind, length) = self.kind_and_length()?;
            let wanted = SEQUENCES.contains(&tag);
            if tag == PIXELS && level == Level::Top {
                // Compressed pixels come in pieces; they are rejected later by the transfer syntax.
                let rest = &self.bytes[self.at..];
                let count = if length == UNDEFINED { rest.len() } else { (length as usize).min(rest.len()) };
                found.values.insert(tag, &rest[..count]);
                self.at += count;
                break;
            } else if length == UNDEFINED || wanted {
                let items = self.sequence(kind, length, depth + 1, start)?;
                if wanted {
                    found.sequences.insert(tag, items);
                }
            } else {
                let value = self.take(length as usize)?;
                if TAGS.contains(&tag) && kind != Some(*b"SQ") {
                    found.values.insert(tag, value);
                }
            }
        }
        Ok(found)
    }

    /// The items of a sequence; in a truncated file, those before its end.
    fn sequence(
        &mut self,
        kind: Option<[u8; 2]>,
        length: u32,
        depth: usize,
        start: usize,
    ) -> Result<Vec<Elements<'a>>, Fault> {
        if depth > DEEPEST {
            let expected = "no more than 64 levels are read; the file is damaged: copy it again";
            return Err(ImageProblem::bad("sequences", "nested too deep", expected).at_byte(start));
        }
        // Elements of unknown kind are written without kinds (PS3.5, 6.2.2).
        if length != UNDEFINED {
            let bytes = self.take(length as usize)?;
            let explicit = self.explicit && kind != Some(*b"UN");
            let mut inner = Walk { bytes, at: 0, explicit, ..*self };
            let items = inner.items(depth)?;
            self.items = inner.items;
            return Ok(items);
        }
        let explicit = self.explicit;
        self.explicit &= kind != Some(*b"UN");
        let items = self.items(depth);
        self.explicit = explicit;
        items
    }

    fn items(&mut self, depth: usize) -> Result<Vec<Elements<'a>>, Fault> {
        let mut items = Vec::new();
        while self.at < self.bytes.len() {
            let start = self.at;
            let (tag, length) = (self.tag()?, self.long()?);
            match tag {
                SEQUENCE_END => break,
                ITEM if self.items == MOST_ITEMS => {
                    let expected = "the file is damaged; copy it again";
                    return Err(
                        ImageProblem::bad("sequences", "of more than 2²⁰ items", expected).at_byte(start)
                    );
                }
                ITEM => {
                    self.items += 1;
                    items.push(if length == UNDEFINED {
                        self.set(Level::Open, depth)?
                    } else {
                        let bytes = self.take(length as usize)?;
                        let mut inner = Walk { bytes, at: 0, ..*self };
                        let item = inner.set(Level::Item, depth)?;
                        self.items = inner.items;
                        item
                    });
                }
                _ => {
                    let expected = "the file is damaged; copy it again";
                    return Err(ImageProblem::bad("a sequence", "something other than items", expected)
                        .at_byte(start));
                }
            }
        }
        Ok(items)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.at..];
        if count > rest.len() {
            let (expected, found) = (count as u64, rest.len() as u64);
            return Err(ImageProblem::Truncated { reading: "an element", expected, found }.at_byte(self.at));
        }
        self.at += count;
        Ok(&rest[..count])
    }

    fn word(&mut self) -> Result<u16, Fault> {
        let bytes = self.take(2)?;
        let bytes = [bytes[0], bytes[1]];
        Ok(if self.order == Order::Little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn long(&mut self) -> Result<u32, Fault> {
        let [first, second] = [self.word()?, self.word()?].map(u32::from);
        Ok(if self.order == Order::Little { second << 16 | first } else { first << 16 | second })
    }

    fn tag(&mut self) -> Result<u32, Fault> {
        Ok(u32::from(self.word()?) << 16 | u32::from(self.word()?))
    }

    /// The kind of an element, if the file states it, and the length of its value.
    fn kind_and_length(&mut self) -> Result<(Option<[u8; 2]>, u32), Fault> {
        if !self.explicit {
            return Ok((None, self.long()?));
        }
        let kind = self.take(2)?;
        let kind = [kind[0], kind[1]];
        match &kind {
            b"OB" | b"OW" | b"OF" | b"OD" | b"OL" | b"OV" | b"SQ" | b"UN" | b"UC" | b"UR" | b"UT" | b"SV"
            | b"UV" => {
                self.take(2)?;
                Ok((Some(kind), self.long()?))
            }
            _ => Ok((Some(kind), u32::from(self.word()?))),
        }
    }
}
