//! Reads base64 as VTK writes it: several padded pieces may follow each other, with white space anywhere.

/// Reads bytes from base64 text, piece by piece.
pub(super) struct Base64<'a> {
    text: std::slice::Iter<'a, u8>,
    /// Up to three decoded bytes that were not asked for yet.
    pending: [u8; 3],
    pending_len: usize,
}

impl<'a> Base64<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { text: text.iter(), pending: [0; 3], pending_len: 0 }
    }

    /// Goes on with the next padded piece: what is left of the last group is dropped.
    pub fn end_piece(&mut self) {
        self.pending_len = 0;
    }

    /// The next `count` bytes; `None` if the text ends before or holds other characters.
    pub fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        if count > self.text.len() {
            return None;
        }
        let mut bytes = Vec::with_capacity(count + 2);
        bytes.extend_from_slice(&self.pending[..self.pending_len]);
        self.pending_len = 0;
        while bytes.len() < count {
            let (group, len) = self.group()?;
            bytes.extend_from_slice(&group[..len]);
        }
        let extra = &bytes[count..];
        self.pending[..extra.len()].copy_from_slice(extra);
        self.pending_len = extra.len();
        bytes.truncate(count);
        Some(bytes)
    }

    /// Four characters as one to three bytes.
    fn group(&mut self) -> Option<([u8; 3], usize)> {
        let mut bits = 0_u32;
        let mut characters = 0;
        let mut padding = 0;
        while characters < 4 {
            let character = *self.text.next()?;
            let value = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => {
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
        (padding <= 2).then_some((bytes, 3 - padding))
    }
}

#[cfg(test)]
mod tests {
    use super::Base64;

    #[test]
    fn rfc_4648_test_vectors() {
        let vectors =
            [("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmFy", "foobar")];
        for (text, bytes) in vectors {
            assert_eq!(Base64::new(text.as_bytes()).take(bytes.len()).as_deref(), Some(bytes.as_bytes()));
            assert_eq!(Base64::new(text.as_bytes()).take(bytes.len() + 1), None);
        }
    }

    #[test]
    fn pieces_follow_each_other() {
        let mut text = Base64::new(b" Zm9v\nYg== Zm8=");
        assert_eq!(text.take(4).as_deref(), Some(b"foob".as_slice()));
        assert_eq!(text.take(2).as_deref(), Some(b"fo".as_slice()));
        assert_eq!(Base64::new(b"Zm9?").take(1), None);
    }
}
