//! A drawing as SVG, its unit a millimetre.

use super::{Anchor, Colour, Drawing, Mark, Outline, Stroke, Text};
use crate::DrawingError;
use image::GrayImage;
use svg::Document;
use svg::node::Node;
use svg::node::element::{Element, Group, Rectangle};

/// Families in the order of preference; the last is what a machine has.
const FONTS: &str = "Noto Sans, Helvetica, Arial, sans-serif";

/// The document.
pub fn encode(drawing: &Drawing) -> Result<String, DrawingError> {
    let (width, height) = (drawing.size.x, drawing.size.y);
    let page = Rectangle::new().set("width", width).set("height", height).set("fill", "white");
    let lines = Group::new().set("stroke-linejoin", "round").set("font-family", FONTS);
    let document = Document::new()
        .set("width", format!("{width}mm"))
        .set("height", format!("{height}mm"))
        .set("viewBox", (0, 0, width, height))
        .add(page)
        .add(drawing.marks.iter().try_fold(lines, |group, mark| Ok::<_, DrawingError>(group.add(node(mark)?)))?);
    Ok(document.to_string())
}

/// A length to a ten-thousandth of a millimetre.
fn mm(length: f64) -> f64 {
    (length * 1e4).round() / 1e4
}

fn node(mark: &Mark) -> Result<Element, DrawingError> {
    Ok(match mark {
        Mark::Shape { outline, fill, stroke } => {
            let mut node = shape(outline);
            paint(&mut node, "fill", *fill);
            if let Some(Stroke { colour, width }) = stroke {
                paint(&mut node, "stroke", Some(*colour));
                node.assign("stroke-width", mm(*width));
            }
            node
        }
        Mark::Text(text) => text_node(text),
        Mark::Picture { pixels, from, size } => {
            let mut node = element("image", &[("x", from.x), ("y", from.y), ("width", size.x), ("height", size.y)]);
            node.assign("preserveAspectRatio", "none");
            node.assign("href", data(pixels)?);
            node
        }
    })
}

/// A picture as an address that holds it.
fn data(pixels: &GrayImage) -> Result<String, DrawingError> {
    Ok(format!("data:image/png;base64,{}", base64(&super::png::picture(pixels)?)))
}

/// Bytes in base 64 (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |three: &[u8]| {
        let number = (0..3).fold(0, |number, k| number << 8 | usize::from(three.get(k).copied().unwrap_or(0)));
        let digit = move |k: usize| char::from(DIGITS[number >> (18 - 6 * k) & 63]);
        let count = three.len();
        (0..4).map(move |k| if k <= count { digit(k) } else { '=' })
    };
    bytes.chunks(3).flat_map(digits).collect()
}

fn element(name: &str, lengths: &[(&str, f64)]) -> Element {
    let mut node = Element::new(name);
    lengths.iter().for_each(|(name, length)| node.assign(*name, mm(*length)));
    node
}

fn paint(node: &mut Element, what: &str, colour: Option<Colour>) {
    node.assign(what, colour.map_or("none".to_owned(), hex));
    if let Some(Colour { opacity, .. }) = colour.filter(|c| c.opacity < 1.0) {
        node.assign(format!("{what}-opacity"), mm(opacity));
    }
}

fn hex(colour: Colour) -> String {
    let [r, g, b] = colour.rgb;
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn shape(outline: &Outline) -> Element {
    match outline {
        Outline::Rectangle { from, size } => {
            element("rect", &[("x", from.x), ("y", from.y), ("width", size.x), ("height", size.y)])
        }
        Outline::Circle { centre, radius } => element("circle", &[("cx", centre.x), ("cy", centre.y), ("r", *radius)]),
        Outline::Lines { points, closed } => {
            let mut node = Element::new(if *closed { "polygon" } else { "polyline" });
            let points: Vec<String> = points.iter().map(|p| format!("{},{}", mm(p.x), mm(p.y))).collect();
            node.assign("points", points.join(" "));
            node
        }
    }
}

fn text_node(text: &Text) -> Element {
    let mut node = element("text", &[("x", text.at.x), ("y", text.at.y), ("font-size", text.size)]);
    paint(&mut node, "fill", Some(text.colour));
    match text.anchor {
        Anchor::Start => {}
        Anchor::Middle => node.assign("text-anchor", "middle"),
        Anchor::End => node.assign("text-anchor", "end"),
    }
    if text.upwards {
        node.assign("transform", format!("rotate(-90 {} {})", mm(text.at.x), mm(text.at.y)));
    }
    if text.rim > 0.0 {
        paint(&mut node, "stroke", Some(Colour::WHITE));
        node.assign("stroke-width", mm(2.0 * text.rim));
        node.assign("paint-order", "stroke");
    }
    // A control character in a file's name would end the document.
    let content: String = text.content.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    node.append(svg::node::Text::new(content));
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec2;

    #[test]
    fn names_cannot_break_the_document() {
        let mut drawing = Drawing::new(Vec2::new(100.0, 50.0));
        drawing.text(Text::new("a<b>&\"c\u{1b}", Vec2::new(1.0, 2.0), 3.0));
        let document = encode(&drawing).unwrap();
        assert!(document.contains("a&lt;b&gt;&amp;\"c\u{fffd}"), "{document}");
    }

    #[test]
    fn base_64_is_that_of_the_standard() {
        let known =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (bytes, text) in known {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0x00, 0xfe]), "+/8A/g==");
    }

    #[test]
    fn a_picture_is_part_of_the_document() {
        let mut drawing = Drawing::new(Vec2::new(100.0, 50.0));
        drawing.picture(GrayImage::from_pixel(3, 2, image::Luma([90])), Vec2::new(1.0, 2.0), Vec2::new(30.0, 20.0));
        let document = encode(&drawing).unwrap();
        assert!(document.contains("<image") && document.contains("data:image/png;base64,iVBORw0KGgo"), "{document}");
    }
}
