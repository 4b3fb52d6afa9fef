//! Outlines and widths of text in Noto Sans, without kerning.

use super::{Anchor, Segment, Text};
use geometry::Vec2;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Reads the font; `None` would mean that the font in the program is broken.
fn face() -> Option<Face<'static>> {
    Face::parse(notosans::REGULAR_TTF, 0).ok()
}

/// The glyph of a character; the first of a font says that it has none.
fn glyph(face: &Face, character: char) -> GlyphId {
    face.glyph_index(character).unwrap_or(GlyphId(0))
}

fn advance(face: &Face, character: char) -> f64 {
    face.glyph_hor_advance(glyph(face, character)).map_or(0.0, f64::from) / f64::from(face.units_per_em())
}

/// Width of a line of text in a size, mm.
pub fn text_width(content: &str, size: f64) -> f64 {
    face().map_or(0.0, |face| content.chars().map(|c| advance(&face, c)).sum::<f64>() * size)
}

/// A text as lines of at most `width` mm, broken between words, and within a word that is longer.
pub fn wrap(content: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in content.split_whitespace() {
        let last = lines.len() - 1;
        let joined = if lines[last].is_empty() { word.to_owned() } else { format!("{} {word}", lines[last]) };
        if text_width(&joined, size) <= width {
            lines[last] = joined;
            continue;
        }
        if !lines[last].is_empty() {
            lines.push(String::new());
        }
        for character in word.chars() {
            let last = lines.len() - 1;
            if !lines[last].is_empty() && text_width(&format!("{}{character}", lines[last]), size) > width {
                lines.push(String::new());
            }
            let last = lines.len() - 1;
            lines[last].push(character);
        }
    }
    lines
}

/// The outlines of a text's glyphs on its page, mm.
pub fn outlines(text: &Text) -> Vec<Segment> {
    let Some(face) = face() else { return Vec::new() };
    let width = text_width(&text.content, text.size);
    let begin = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -width / 2.0,
        Anchor::End => -width,
    };
    let scale = text.size / f64::from(face.units_per_em());
    let mut pen = Pen { text, scale, x: begin, at: Vec2::zeros(), segments: Vec::new() };
    for character in text.content.chars() {
        // A space has no outline.
        let _ = face.outline_glyph(glyph(&face, character), &mut pen);
        pen.x += advance(&face, character) * text.size;
    }
    pen.segments
}

/// Puts a glyph's outline where it belongs on the page.
struct Pen<'a> {
    text: &'a Text,
    /// Millimetres per unit of the font.
    scale: f64,
    /// Where the glyph begins on the base line, mm.
    x: f64,
    /// Where the last segment ended, mm.
    at: Vec2,
    segments: Vec<Segment>,
}

impl Pen<'_> {
    fn place(&self, x: f32, y: f32) -> Vec2 {
        let (along, up) = (self.x + f64::from(x) * self.scale, f64::from(y) * self.scale);
        self.text.at + if self.text.upwards { Vec2::new(-up, -along) } else { Vec2::new(along, -up) }
    }
}

impl OutlineBuilder for Pen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.at = self.place(x, y);
        self.segments.push(Segment::Move(self.at));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.at = self.place(x, y);
        self.segments.push(Segment::Line(self.at));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (handle, end) = (self.place(x1, y1), self.place(x, y));
        let third = |p: Vec2| p + (handle - p) * (2.0 / 3.0);
        self.segments.push(Segment::Cubic(third(self.at), third(end), end));
        self.at = end;
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let end = self.place(x, y);
        self.segments.push(Segment::Cubic(self.place(x1, y1), self.place(x2, y2), end));
        self.at = end;
    }

    fn close(&mut self) {
        self.segments.push(Segment::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(text: &Text) -> (Vec2, Vec2) {
        let points = outlines(text).into_iter().filter_map(|s| match s {
            Segment::Move(p) | Segment::Line(p) | Segment::Cubic(_, _, p) => Some(p),
            Segment::Close => None,
        });
        let far = Vec2::from_element(f64::INFINITY);
        points.fold((far, -far), |(low, high), p| (low.inf(&p), high.sup(&p)))
    }

    #[test]
    fn capitals_stand_on_the_base_line_and_end_where_the_width_says() {
        let text = Text::new("HEH", Vec2::new(10.0, 20.0), 5.0);
        let (low, high) = extent(&text);
        assert!((high.y - 20.0).abs() < 1e-9 && (low.y - (20.0 - 0.714 * 5.0)).abs() < 0.01, "{low} {high}");
        assert!(low.x > 10.0 && high.x < 10.0 + text_width("HEH", 5.0));
        let (low, high) = extent(&text.clone().anchored(Anchor::Middle));
        assert!(((low.x + high.x) / 2.0 - 10.0).abs() < 0.05);
        let (low, high) = extent(&Text { upwards: true, ..text });
        assert!((high.x - 10.0).abs() < 1e-9 && high.y < 20.0 && low.y > 20.0 - text_width("HEH", 5.0));
    }

    #[test]
    fn lines_are_no_wider_than_asked() {
        let text = "the board was tilted by no more than 7°: tilt_it_by_30_degrees_and_more_to_all_sides";
        let lines = wrap(text, 3.0, 30.0);
        assert!(lines.len() > 3 && lines.iter().all(|l| text_width(l, 3.0) <= 30.0), "{lines:?}");
        assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
    }

    #[test]
    fn a_character_without_a_glyph_has_a_width() {
        assert!(text_width("\u{10ffff}", 1.0) > 0.0 && text_width("", 1.0) == 0.0);
    }
}
