//! Lines of letters in the shapes of a TrueType or OpenType font.

use super::{Flattening, OutlineError, Polygon};
use harfrust::font::glyph::outline::{DrawMemory, DrawOptions, PathSink};
use harfrust::{Buffer, Font, GlyphId, ShapeOptions, ShaperFont};
use kurbo::{CubicBez, Point, QuadBez, Vec2};

/// Distance of a chord from the curve of a letter, in em.
const TOLERANCE: f64 = 1.0 / 500.0;

/// The polygons of a line of text, whose base line begins at the origin; 1 is the em of the font. Letters are placed by
/// the font's advances and its kerning, and joined as it says.
///
/// # Errors
/// The font cannot be read or lacks a character, the letters enclose nothing, or they have more points than the limit.
pub(crate) fn glyphs(text: &str, font: &[u8], limit: usize) -> Result<Vec<Polygon>, OutlineError> {
    if text.trim().is_empty() {
        return Err(OutlineError::new("the text has no letters"));
    }
    if text.chars().any(char::is_control) {
        let message = "the text has a line end or a tab, but it stands on one line";
        return Err(OutlineError::with_fix(message, "call 'glyphs' for each line and translate the lines"));
    }
    if text.len() > limit {
        return Err(OutlineError::TooManyPoints);
    }
    let damaged = || OutlineError::new("the font is damaged");
    let font = Font::new(font.to_vec(), 0).ok_or_else(|| {
        OutlineError::with_fix("the file is not a font", "name a TrueType or OpenType font (.ttf or .otf)")
    })?;
    let em = f64::from(font.units_per_em());
    if em == 0.0 {
        return Err(damaged());
    }
    let mut buffer = Buffer::new();
    buffer.push_str(text);
    buffer.guess_segment_properties();
    harfrust::shape(&ShaperFont::new(&font), &mut buffer, ShapeOptions::new()).map_err(|_| damaged())?;
    if !buffer.allocation_successful() {
        return Err(damaged());
    }
    let shapes = font.outline_glyphs();
    let mut pen = Pen { out: Flattening::new(TOLERANCE, limit), origin: Vec2::ZERO, em, at: Point::ZERO };
    let mut origin = Vec2::ZERO;
    for (info, position) in buffer.glyph_infos().iter().zip(buffer.glyph_positions()) {
        let character = || text.get(info.cluster as usize..).and_then(|rest| rest.chars().next()).unwrap_or(' ');
        if info.glyph_id == 0 {
            let c = character();
            let message = format!("the font has no letter for '{c}' (U+{:04X})", u32::from(c));
            return Err(OutlineError::with_fix(message, "name a font that has it, or leave the character out"));
        }
        pen.origin = origin + Vec2::new(f64::from(position.x_offset), f64::from(position.y_offset));
        if let Some(shape) = shapes.get(GlyphId::new(info.glyph_id)) {
            let drawn = shape.draw(&DrawOptions::new(), DrawMemory::default(), &mut pen);
            drawn.map_err(|_| OutlineError::new(format!("the font is damaged at the letter '{}'", character())))?;
        }
        if pen.out.too_many {
            return Err(OutlineError::TooManyPoints);
        }
        origin += Vec2::new(f64::from(position.x_advance), f64::from(position.y_advance));
    }
    pen.out.resolved()
}

/// Takes a letter's curves, in units of the font.
struct Pen {
    out: Flattening,
    /// The place of the letter, in those units.
    origin: Vec2,
    em: f64,
    at: Point,
}

impl Pen {
    fn place(&self, x: f32, y: f32) -> Point {
        let point = Vec2::new(f64::from(x), f64::from(y)) + self.origin;
        (point / self.em).to_point()
    }
}

impl PathSink for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.at = self.place(x, y);
        self.out.move_to(self.at);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.at = self.place(x, y);
        self.out.line_to(self.at);
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        let (middle, to) = (self.place(cx0, cy0), self.place(x, y));
        self.out.quadratic_to(QuadBez::new(self.at, middle, to));
        self.at = to;
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (first, second, to) = (self.place(cx0, cy0), self.place(cx1, cy1), self.place(x, y));
        self.out.cubic_to(CubicBez::new(self.at, first, second, to));
        self.at = to;
    }

    fn close(&mut self) {}
}
