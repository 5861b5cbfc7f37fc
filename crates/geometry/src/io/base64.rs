//! Base64 in VTK's XML files, where padded pieces may follow each other, with white space anywhere. (Crates
//! decode one piece with a known end; here each piece contains its own length.)

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Values of characters; 255 for invalid ones.
const VALUES: [u8; 256] = {
    let mut values = [255; 256];
    let mut value = 0;
    while value < 64 {
        values[ALPHABET[value] as usize] = value as u8;
        value += 1;
    }
    values
};

/// Reads bytes from base64 text, piece by piece.
pub(super) struct Base64<'a> {
    text: std::slice::Iter<'a, u8>,
    /// Up to three decoded bytes that are not read yet.
    pending: [u8; 3],
    pending_len: usize,
}

impl<'a> Base64<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { text: text.iter(), pending: [0; 3], pending_len: 0 }
    }

    /// Continues with the next padded piece; drops the rest of the last group.
    pub(crate) fn end_piece(&mut self) {
        self.pending_len = 0;
    }

    /// The next `count` bytes; `None` if the text ends before or holds other characters.
    pub fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        if count > self.text.len() + self.pending_len {
            return None;
        }
        let mut bytes = Vec::with_capacity(count + 2);
        bytes.extend_from_slice(&self.pending[..self.pending_len]);
        self.pending_len = 0;
        while bytes.len() < count {
            // Groups of four plain characters, which is nearly all of any text.
            let wanted = (count - bytes.len()).div_ceil(3);
            let mut plain = 0;
            for group in self.text.as_slice().chunks_exact(4).take(wanted) {
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| VALUES[usize::from(group[i])]);
                if a | b | c | d >= 64 {
                    break;
                }
                let bits = u32::from(a) << 18 | u32::from(b) << 12 | u32::from(c) << 6 | u32::from(d);
                bytes.extend_from_slice(&bits.to_be_bytes()[1..]);
                plain += 1;
            }
            if plain > 0 {
                self.text.nth(4 * plain - 1);
            } else {
                let (group, len) = self.group()?;
                bytes.extend_from_slice(&group[..len]);
            }
        }
        let extra = &bytes[count..];
        self.pending[..extra.len()].copy_from_slice(extra);
        self.pending_len = extra.len();
        bytes.truncate(count);
        Some(bytes)
    }

    /// Returns the bytes up to the end of the text; `None` if it holds other characters.
    pub fn rest(&mut self) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        while !self.text.as_slice().trim_ascii().is_empty() {
            let (group, len) = self.group()?;
            bytes.extend_from_slice(&group[..len]);
        }
        Some(bytes)
    }

    /// Four characters as one to three bytes.
    fn group(&mut self) -> Option<([u8; 3], usize)> {
        let mut bits = 0_u32;
        let mut characters = 0;
        let mut padding = 0;
        while characters < 4 {
            let character = *self.text.next()?;
            let value = match VALUES[usize::from(character)] {
                value @ ..64 => value,
                _ if character == b'=' => {
                    padding += 1;
                    0
                }
                _ if character.is_ascii_whitespace() => continue,
                _ => return None,
            };
            if padding > 0 && character != b'=' {
                return None;
            }
            bits = (bits << 6) | u32::from(value);
            characters += 1;
        }
        let [_, bytes @ ..] = bits.to_be_bytes();
        (padding <= 2).then(|| (bytes, 3 - padding))
    }
}

/// Appends bytes as one padded piece (RFC 4648).
pub fn encode(bytes: &[u8], text: &mut Vec<u8>) {
    let group = |a: u8, b: u8, c: u8| {
        let bits = u32::from_be_bytes([0, a, b, c]);
        [18, 12, 6, 0].map(|shift| ALPHABET[(bits >> shift) as usize & 63])
    };
    let (groups, rest) = bytes.as_chunks();
    let before = text.len();
    text.reserve(bytes.len().div_ceil(3) * 4);
    text.resize(before + 4 * groups.len(), 0);
    for (four, &[a, b, c]) in text[before..].as_chunks_mut().0.iter_mut().zip(groups) {
        *four = group(a, b, c);
    }
    match rest {
        [a, b] => {
            let [first, second, third, _] = group(*a, *b, 0);
            text.extend_from_slice(&[first, second, third, b'=']);
        }
        [a] => {
            let [first, second, ..] = group(*a, 0, 0);
            text.extend_from_slice(&[first, second, b'=', b'=']);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::{Base64, encode};

    #[test]
    fn rfc_4648_test_vectors() {
        let vectors =
            [("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmFy", "foobar")];
        for (text, bytes) in vectors {
            assert_eq!(Base64::new(text.as_bytes()).take(bytes.len()).as_deref(), Some(bytes.as_bytes()));
            assert_eq!(Base64::new(text.as_bytes()).take(bytes.len() + 1), None);
            let mut encoded = Vec::new();
            encode(bytes.as_bytes(), &mut encoded);
            assert_eq!(encoded, text.as_bytes());
        }
    }

    /// Found by AFL++: a fourth `=` was counted off three bytes.
    #[test]
    fn groups_of_nothing_but_padding_hold_no_bytes() {
        for text in ["====", "A===", "Zg======"] {
            assert_eq!(Base64::new(text.as_bytes()).rest(), None, "{text}");
        }
    }

    #[test]
    fn pieces_follow_each_other() {
        let mut text = Base64::new(b" Zm9v\nYg== Zm8=");
        assert_eq!(text.take(4).as_deref(), Some(b"foob".as_slice()));
        assert_eq!(text.take(2).as_deref(), Some(b"fo".as_slice()));
        assert_eq!(Base64::new(b"Zm9?").take(1), None);
        // The last bytes of a piece whose characters were all used before.
        let mut text = Base64::new(b"Zm9v");
        assert_eq!(text.take(2).as_deref(), Some(b"fo".as_slice()));
        assert_eq!(text.take(1).as_deref(), Some(b"o".as_slice()));
        assert_eq!(text.take(1), None);
    }
}
