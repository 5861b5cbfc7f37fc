//! Text in pictures, in the typeface of the window.

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};

use crate::picture::Picture;

/// The alignment of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// A typeface in a size.
pub(crate) struct Pen {
    font: FontRef<'static>,
    scale: PxScale,
}

impl Pen {
    /// Makes letters of a height in pixels, from the lowest descender to the highest ascender.
    pub fn new(size: f32) -> Option<Self> {
        let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
        Some(Self { font, scale: PxScale::from(size) })
    }

    /// Glyphs of a text with their distance from its start.
    fn glyphs(&self, text: &str) -> (Vec<(GlyphId, f32)>, f32) {
        let font = self.font.as_scaled(self.scale);
        let mut at = 0.0;
        let mut before: Option<GlyphId> = None;
        let glyphs = text
            .chars()
            .map(|character| {
                let glyph = self.font.glyph_id(character);
                at += before.map_or(0.0, |before| font.kern(before, glyph));
                before = Some(glyph);
                let place = (glyph, at);
                at += font.h_advance(glyph);
                place
            })
            .collect();
        (glyphs, at)
    }

    /// Width of a text [pixels].
    pub fn width(&self, text: &str) -> f32 {
        self.glyphs(text).1
    }

    /// Writes a text whose middle line is at a height.
    pub fn write(&self, picture: &mut Picture, text: &str, [x, y]: [f32; 2], align: Align, ink: [u8; 3]) {
        let (glyphs, width) = self.glyphs(text);
        let start = match align {
            Align::Left => x,
            Align::Right => x - width,
        };
        // The middle of capitals, without ascenders and descenders.
        let base = (y + 0.26 * self.scale.y).round();
        for (id, offset) in glyphs {
            let place = ab_glyph::point(start + offset, base);
            let Some(outline) = self.font.outline_glyph(id.with_scale_and_position(self.scale, place)) else {
                continue;
            };
            let bounds = outline.px_bounds();
            outline.draw(|dx, dy, cover| {
                // Light strokes look thin on a screen.
                let cover = cover.min(1.0).powf(0.75);
                picture.mix(
                    bounds.min.x as i64 + i64::from(dx),
                    bounds.min.y as i64 + i64::from(dy),
                    ink,
                    cover,
                );
            });
        }
    }
}
