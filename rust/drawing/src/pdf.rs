//! A drawing as a PDF page, its unit a millimetre, text as outlines.

use super::{Colour, Drawing, Mark, Outline, Segment, Stroke, font};
use flate2::{Compression, write::ZlibEncoder};
use geometry::Vec2;
use image::GrayImage;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};
use std::collections::BTreeSet;
use std::io::Write;

/// Points of a PDF per millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// The document.
pub fn encode(drawing: &Drawing) -> Vec<u8> {
    let [catalog, pages, page, content] = [1, 2, 3, 4].map(Ref::new);
    let (width, height) = ((drawing.size.x * POINTS) as f32, (drawing.size.y * POINTS) as f32);
    let (operators, opacities) = operators(drawing);
    let pictures: Vec<(Ref, &GrayImage)> = pictures(drawing).zip(5..).map(|(p, id)| (Ref::new(id), p)).collect();
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let mut leaf = pdf.page(page);
    leaf.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = leaf.resources();
    let mut states = resources.ext_g_states();
    for percent in opacities {
        let mut state = states.insert(Name(name(percent).as_bytes())).start::<pdf_writer::writers::ExtGraphicsState>();
        state.non_stroking_alpha(f32::from(percent) / 100.0).stroking_alpha(f32::from(percent) / 100.0);
    }
    states.finish();
    let mut objects = resources.x_objects();
    for (k, (id, _)) in pictures.iter().enumerate() {
        objects.pair(Name(picture_name(k).as_bytes()), *id);
    }
    objects.finish();
    resources.finish();
    leaf.finish();
    let packed = deflate(&operators);
    pdf.stream(content, &packed).filter(Filter::FlateDecode);
    for (id, pixels) in pictures {
        let packed = deflate(pixels.as_raw());
        let mut object = pdf.image_xobject(id, &packed);
        object.width(pixels.width() as i32).height(pixels.height() as i32);
        object.filter(Filter::FlateDecode);
        object.bits_per_component(8).interpolate(true).color_space().device_gray();
    }
    pdf.finish()
}

fn pictures(drawing: &Drawing) -> impl Iterator<Item = &GrayImage> {
    drawing.marks.iter().filter_map(|mark| match mark {
        Mark::Picture { pixels, .. } => Some(pixels),
        _ => None,
    })
}

fn picture_name(number: usize) -> String {
    format!("picture{number}")
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

fn name(percent: u8) -> String {
    format!("opacity{percent}")
}

/// The page's operators, and the opacities they use, percent.
fn operators(drawing: &Drawing) -> (Vec<u8>, BTreeSet<u8>) {
    let mut writer = Operators { content: Content::new(), opacity: 100, used: BTreeSet::from([100]), pictures: 0 };
    let scale = POINTS as f32;
    writer.content.transform([scale, 0.0, 0.0, -scale, 0.0, (drawing.size.y * POINTS) as f32]);
    writer.content.set_line_join(LineJoinStyle::RoundJoin);
    for mark in &drawing.marks {
        match mark {
            Mark::Shape { outline, fill, stroke } => {
                if let Some(fill) = fill {
                    writer.fill(*fill);
                    writer.outline(outline);
                    writer.content.fill_nonzero();
                }
                if let Some(stroke) = stroke {
                    writer.stroke(stroke);
                    writer.outline(outline);
                    writer.content.stroke();
                }
            }
            Mark::Text(text) => {
                let glyphs = font::outlines(text);
                if text.rim > 0.0 {
                    writer.stroke(&Stroke { colour: Colour::WHITE, width: 2.0 * text.rim });
                    writer.path(&glyphs);
                    writer.content.stroke();
                }
                writer.fill(text.colour);
                writer.path(&glyphs);
                writer.content.fill_nonzero();
            }
            Mark::Picture { from, size, .. } => writer.picture(from, size),
        }
    }
    (writer.content.finish().into_vec(), writer.used)
}

struct Operators {
    content: Content,
    /// Opacity now set, percent.
    opacity: u8,
    used: BTreeSet<u8>,
    /// Pictures placed so far.
    pictures: usize,
}

impl Operators {
    fn fill(&mut self, colour: Colour) {
        self.opacity(colour);
        let [r, g, b] = unit(colour);
        self.content.set_fill_rgb(r, g, b);
    }

    fn stroke(&mut self, stroke: &Stroke) {
        self.opacity(stroke.colour);
        let [r, g, b] = unit(stroke.colour);
        self.content.set_stroke_rgb(r, g, b).set_line_width(stroke.width as f32);
    }

    fn opacity(&mut self, colour: Colour) {
        let percent = (colour.opacity.clamp(0.0, 1.0) * 100.0).round() as u8;
        if percent != self.opacity {
            self.content.set_parameters(Name(name(percent).as_bytes()));
            self.opacity = percent;
            self.used.insert(percent);
        }
    }

    /// Places the next picture, whose first row is at the top of a unit square that has y up.
    fn picture(&mut self, from: &Vec2, size: &Vec2) {
        self.opacity(Colour::BLACK);
        let [x, y, width, height] = [from.x, from.y + size.y, size.x, size.y].map(|v| v as f32);
        self.content.save_state().transform([width, 0.0, 0.0, -height, x, y]);
        self.content.x_object(Name(picture_name(self.pictures).as_bytes())).restore_state();
        self.pictures += 1;
    }

    fn outline(&mut self, outline: &Outline) {
        if let Outline::Rectangle { from, size } = outline {
            self.content.rect(from.x as f32, from.y as f32, size.x as f32, size.y as f32);
        } else {
            self.path(&outline.segments());
        }
    }

    fn path(&mut self, segments: &[Segment]) {
        for segment in segments {
            match segment {
                Segment::Move(p) => self.content.move_to(p.x as f32, p.y as f32),
                Segment::Line(p) => self.content.line_to(p.x as f32, p.y as f32),
                Segment::Cubic(a, b, p) => {
                    let [a, b, p] = [a, b, p].map(|v| (v.x as f32, v.y as f32));
                    self.content.cubic_to(a.0, a.1, b.0, b.1, p.0, p.1)
                }
                Segment::Close => self.content.close_path(),
            };
        }
    }
}

fn unit(colour: Colour) -> [f32; 3] {
    colour.rgb.map(|c| f32::from(c) / 255.0)
}
