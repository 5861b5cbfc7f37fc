//! A picture as pixels, and how far two of them differ.

use std::io::Cursor;

use crate::error::PictureError;

/// A picture: rows from top to bottom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
    /// Red, green and blue (sRGB) of each pixel, and how much of it a body covers.
    pub rgba: Vec<u8>,
}

/// Difference between two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean absolute difference of all channels of all pixels, of 255.
    pub everywhere: f64,
    /// Mean absolute difference over the pixels that a body covers in either picture, of 255.
    pub on_bodies: f64,
    /// Pixels that bodies cover in both pictures over those they cover in either.
    pub overlap: f64,
}

impl Difference {
    /// True if both pictures show the same: the differences are below 2 everywhere and 6 on bodies, and the
    /// silhouettes overlap to 98 %.
    pub fn is_same(&self) -> bool {
        self.everywhere < 2.0 && self.on_bodies < 6.0 && self.overlap >= 0.98
    }
}

impl Picture {
    /// Encodes the picture as a PNG file, without the coverage.
    ///
    /// # Errors
    /// If the pixels don't fit the size.
    pub fn png(&self) -> Result<Vec<u8>, PictureError> {
        self.encode(png::ColorType::Rgb, &self.rgb())
    }

    /// Encodes the picture as a PNG file whose opacity is the coverage, for comparisons.
    ///
    /// # Errors
    /// If the pixels don't fit the size.
    pub fn png_with_coverage(&self) -> Result<Vec<u8>, PictureError> {
        self.encode(png::ColorType::Rgba, &self.rgba)
    }

    /// Red, green and blue of each pixel.
    pub fn rgb(&self) -> Vec<u8> {
        self.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    }

    fn encode(&self, colour: png::ColorType, bytes: &[u8]) -> Result<Vec<u8>, PictureError> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width, self.height);
        encoder.set_color(colour);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(coding)?;
        writer.write_image_data(bytes).map_err(coding)?;
        writer.finish().map_err(coding)?;
        Ok(file)
    }

    /// Reads the output of [`Self::png`]; all pixels count as covered.
    ///
    /// # Errors
    /// If the file is invalid.
    pub fn from_png(file: &[u8]) -> Result<Self, PictureError> {
        let (rgb, [width, height]) = decoded(file, png::ColorType::Rgb)?;
        let rgba = rgb.chunks_exact(3).flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255]).collect();
        Ok(Self { width, height, rgba })
    }

    /// Reads the output of [`Self::png_with_coverage`].
    ///
    /// # Errors
    /// If the file is invalid.
    pub fn from_png_with_coverage(file: &[u8]) -> Result<Self, PictureError> {
        let (rgba, [width, height]) = decoded(file, png::ColorType::Rgba)?;
        Ok(Self { width, height, rgba })
    }

    /// Compares the picture with another of the same size; `None` for another size.
    pub fn difference(&self, other: &Self) -> Option<Difference> {
        if [self.width, self.height] != [other.width, other.height] {
            return None;
        }
        let (mut everywhere, mut on_bodies) = ((0, 0_u64), (0, 0_u64));
        let (mut both, mut either) = (0_u64, 0_u64);
        for (a, b) in self.rgba.chunks_exact(4).zip(other.rgba.chunks_exact(4)) {
            let apart: u64 = (0..3).map(|c| u64::from(a[c].abs_diff(b[c]))).sum();
            everywhere = (everywhere.0 + apart, everywhere.1 + 3);
            let covered = [a[3] > 127, b[3] > 127];
            if covered.contains(&true) {
                on_bodies = (on_bodies.0 + apart, on_bodies.1 + 3);
                either += 1;
                both += u64::from(covered == [true, true]);
            }
        }
        let mean = |(sum, count): (u64, u64)| if count == 0 { 0.0 } else { sum as f64 / count as f64 };
        let overlap = if either == 0 { 1.0 } else { both as f64 / either as f64 };
        Some(Difference { everywhere: mean(everywhere), on_bodies: mean(on_bodies), overlap })
    }

    /// Mixes a colour (sRGB) into a pixel; pixels outside are ignored.
    pub(crate) fn mix(&mut self, x: i64, y: i64, colour: [u8; 3], cover: f32) {
        if !(0..i64::from(self.width)).contains(&x) || !(0..i64::from(self.height)).contains(&y) {
            return;
        }
        let at = 4 * (y as usize * self.width as usize + x as usize);
        for (byte, new) in self.rgba[at..at + 3].iter_mut().zip(colour) {
            *byte = (f32::from(*byte) * (1.0 - cover) + f32::from(new) * cover).round() as u8;
        }
    }
}

pub(crate) fn coding(error: impl ToString) -> PictureError {
    PictureError::Coding(error.to_string())
}

/// The bytes of the pixels of a PNG file, and its size; an error if they are of another kind.
fn decoded(file: &[u8], wanted: png::ColorType) -> Result<(Vec<u8>, [u32; 2]), PictureError> {
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().map_err(coding)?;
    let (kind, size) = (reader.output_color_type(), [reader.info().width, reader.info().height]);
    if kind != (wanted, png::BitDepth::Eight) {
        return Err(PictureError::Coding(format!("its pixels are {:?} of {:?} bits", kind.0, kind.1)));
    }
    let length = reader.output_buffer_size().ok_or_else(|| PictureError::Coding("it is too large".into()))?;
    let mut bytes = vec![0; length];
    reader.next_frame(&mut bytes).map_err(coding)?;
    Ok((bytes, size))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(radius: i64, colour: [u8; 3]) -> Picture {
        let mut picture = Picture { width: 100, height: 100, rgba: vec![255; 40_000] };
        for (pixel, index) in picture.rgba.chunks_exact_mut(4).zip(0_i64..) {
            let (x, y) = (index % 100 - 50, index / 100 - 50);
            pixel[3] = 0;
            if x * x + y * y < radius * radius {
                pixel.copy_from_slice(&[colour[0], colour[1], colour[2], 255]);
            }
        }
        picture
    }

    #[test]
    fn a_picture_is_the_same_as_itself_and_comes_back_from_its_file() {
        let picture = disc(30, [200, 30, 30]);
        let again = Picture::from_png_with_coverage(&picture.png_with_coverage().unwrap()).unwrap();
        assert_eq!(picture, again);
        let difference = picture.difference(&again).unwrap();
        assert_eq!(difference, Difference { everywhere: 0.0, on_bodies: 0.0, overlap: 1.0 });
        assert!(difference.is_same());
    }

    #[test]
    fn other_sizes_colours_and_silhouettes_are_told_apart() {
        let picture = disc(30, [200, 30, 30]);
        assert!(!picture.difference(&disc(28, [200, 30, 30])).unwrap().is_same(), "a smaller disc");
        assert!(!picture.difference(&disc(30, [180, 30, 30])).unwrap().is_same(), "another red");
        assert!(picture.difference(&disc(30, [197, 30, 30])).unwrap().is_same(), "nearly the same red");
        let none = Picture { width: 10, height: 10, rgba: vec![0; 400] };
        assert!(picture.difference(&none).is_none());
        let opaque = picture.png().unwrap();
        assert!(Picture::from_png_with_coverage(&opaque).is_err(), "no coverage");
        let again = Picture::from_png(&opaque).unwrap();
        assert_eq!(again.rgb(), picture.rgb());
        assert!(again.rgba.chunks(4).all(|pixel| pixel[3] == 255));
        assert!(Picture::from_png_with_coverage(b"no picture").is_err());
    }
}
