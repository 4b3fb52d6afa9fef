//! The eyes' own picture: iris, pupil and white as the frames show them.
//!
//! An iris is a few pixels wide and half hidden by lids, so it is not projected texel by texel. Its colour is measured as a
//! function of radius and angle over all frames (robustly, visible pixels only), and painted with the pupil, the dark
//! limbus and the white that it is known to have.
//!
//! # Conventions
//! An eye's picture is azimuthal about its gaze: the distance from the picture's middle is the angle from the gaze axis.
//! Angles turn from the subject's left over up, as in the head frame.

use geometry::{Vec2, smooth_step};
use image::{RgbImage, Rgba, RgbaImage};

/// Rings and sectors of the measured profile.
const RINGS: usize = 6;
const SECTORS: usize = 12;
/// Angle from the gaze axis at which the iris ends, radians: a 5.85 mm iris on a 12 mm eyeball.
pub const LIMBUS_ANGLE: f64 = 0.509;
/// Radius of a pupil in indoor light, of the iris's.
const PUPIL: f64 = 0.36;

/// One eye in one frame.
#[derive(Clone, Debug)]
pub struct EyeView<'a> {
    /// The frame.
    pub image: &'a RgbImage,
    /// Centre of the iris, pixels.
    pub centre: Vec2,
    /// Radius of the iris, pixels.
    pub radius: f64,
    /// Polygon between the lids, pixels.
    pub opening: &'a [Vec2],
}

/// What was measured of an eye.
#[derive(Clone, Debug, PartialEq)]
pub struct EyeColours {
    /// Mean colour per ring from the pupil's edge to the limbus, and per sector; sRGB 0…255.
    pub iris: [[[f64; 3]; SECTORS]; RINGS],
    /// Colour of the white beside the iris.
    pub white: [f64; 3],
    /// Pixels that were used.
    pub samples: usize,
}

impl EyeColours {
    /// An eye of which only two colours are known, sRGB 0…255.
    pub fn plain(iris: [f64; 3], white: [f64; 3]) -> Self {
        Self { iris: [[iris; SECTORS]; RINGS], white, samples: 0 }
    }

    /// Out of the shade of brow and lids, which a renderer makes anew: the white of an eye reflects at least as much as
    /// the `skin` (sRGB 0…255) around it. The iris gets half of that (in stops): a few pixels wide, it has light of the white
    /// in it already.
    #[must_use]
    pub fn unshaded(&self, skin: [f64; 3]) -> Self {
        let gain = (luminance(skin) / luminance(self.white).max(1e-4)).clamp(1.0, MOST_SHADE);
        let brighter = |colour: [f64; 3], gain: f64| colour.map(|c| from_linear(gain * to_linear(c)));
        let iris = self.iris.map(|ring| ring.map(|c| brighter(c, gain.sqrt())));
        let white = brighter(self.white, gain);
        let grey = from_linear(luminance(white));
        Self { iris, white: white.map(|c| c + LID_TINT * (grey - c)), samples: self.samples }
    }
}

/// Light that the deepest sockets keep off an eye, as a factor.
const MOST_SHADE: f64 = 4.0;

/// What part of its tint the white of a small eye has from the lids, whose colour the lens mixes in.
const LID_TINT: f64 = 0.5;

/// Relative luminance of an sRGB colour 0…255 (Rec. 709).
fn luminance(colour: [f64; 3]) -> f64 {
    let [r, g, b] = colour.map(to_linear);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Linear light 0…1 of an sRGB value 0…255 (IEC 61966-2-1).
fn to_linear(value: f64) -> f64 {
    let v = value / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The inverse of [`to_linear`], no brighter than white.
fn from_linear(light: f64) -> f64 {
    let v = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    255.0 * v.min(1.0)
}

/// Measures an eye over frames; `None` when no frame shows enough of it.
pub fn measure(views: &[EyeView]) -> Option<EyeColours> {
    let mut iris: Vec<Vec<[f64; 3]>> = vec![Vec::new(); RINGS * SECTORS];
    let mut white = Vec::new();
    for view in views {
        collect(view, &mut iris, &mut white);
    }
    let samples = iris.iter().map(Vec::len).sum::<usize>();
    if samples < 20 || white.is_empty() {
        return None;
    }
    let all: Vec<[f64; 3]> = iris.iter().flatten().copied().collect();
    let overall = middle(&all, 0.4);
    let ring = |r: usize| middle(&iris[r * SECTORS..][..SECTORS].concat(), 0.4).or(overall);
    let mut colours = EyeColours { iris: [[[0.0; 3]; SECTORS]; RINGS], white: middle(&white, 0.6)?, samples };
    for r in 0..RINGS {
        let ring_colour = ring(r)?;
        for s in 0..SECTORS {
            // Highlights are far brighter than their ring; a sector seen little leans on its ring.
            let bright = |c: &[f64; 3]| c.iter().sum::<f64>();
            let dull = |c: &&[f64; 3]| bright(c) < 1.5 * bright(&ring_colour);
            let seen: Vec<[f64; 3]> = iris[r * SECTORS + s].iter().filter(dull).copied().collect();
            let trust = seen.len() as f64 / (seen.len() as f64 + 12.0);
            let own = middle(&seen, 0.4).unwrap_or(ring_colour);
            colours.iris[r][s] = std::array::from_fn(|c| trust * own[c] + (1.0 - trust) * ring_colour[c]);
        }
    }
    Some(colours)
}

/// Paints one eye, `size`×`size` pixels. `equator` is the distance of the eyeball's equator from the picture's middle, in
/// halves of its size.
pub fn paint(colours: &EyeColours, size: u32, equator: f64) -> RgbaImage {
    let half = f64::from(size) / 2.0;
    RgbaImage::from_fn(size, size, |x, y| {
        let (dx, dy) = ((f64::from(x) + 0.5) / half - 1.0, 1.0 - (f64::from(y) + 0.5) / half);
        let radius = dx.hypot(dy) / equator * std::f64::consts::FRAC_PI_2 / LIMBUS_ANGLE;
        let colour = colour_at(colours, radius, dy.atan2(dx));
        Rgba([to_byte(colour[0]), to_byte(colour[1]), to_byte(colour[2]), 255])
    })
}

/// Adds a frame's pixels to the lists of rings and sectors, and to the white.
fn collect(view: &EyeView, iris: &mut [Vec<[f64; 3]>], white: &mut Vec<[f64; 3]>) {
    let reach = 2.2 * view.radius;
    let clamp = |value: f64, size: u32| value.clamp(0.0, f64::from(size) - 1.0) as u32;
    let (width, height) = view.image.dimensions();
    for y in clamp(view.centre.y - reach, height)..=clamp(view.centre.y + reach, height) {
        for x in clamp(view.centre.x - reach, width)..=clamp(view.centre.x + reach, width) {
            let pixel = Vec2::new(f64::from(x), f64::from(y));
            // Lids and lashes shade what lies next to them.
            if distance_inside(&pixel, view.opening) < 0.18 * view.radius {
                continue;
            }
            let offset = (pixel - view.centre) / view.radius;
            let colour = view.image.get_pixel(x, y).0.map(f64::from);
            let r = (offset.norm() - PUPIL) / (1.0 - PUPIL);
            if (0.05..0.92).contains(&r) {
                let turn = (-offset.y).atan2(offset.x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
                let ring = ((r * RINGS as f64) as usize).min(RINGS - 1);
                iris[ring * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)].push(colour);
            } else if (1.25..2.0).contains(&offset.norm()) {
                white.push(colour);
            }
        }
    }
}

/// Distance of a point from the edge of a polygon, positive inside.
fn distance_inside(point: &Vec2, polygon: &[Vec2]) -> f64 {
    let (mut inside, mut nearest) = (false, f64::MAX);
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if (a.y > point.y) != (b.y > point.y) && point.x < (b.x - a.x) * (point.y - a.y) / (b.y - a.y) + a.x {
            inside = !inside;
        }
        let edge = b - a;
        let along = ((point - a).dot(&edge) / edge.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        nearest = nearest.min((point - a - edge * along).norm());
    }
    if inside { nearest } else { -nearest }
}

/// The mean of the middle half around a quantile of brightness: highlights and lashes fall out at the ends.
fn middle(colours: &[[f64; 3]], quantile: f64) -> Option<[f64; 3]> {
    if colours.is_empty() {
        return None;
    }
    let mut sorted = colours.to_vec();
    sorted.sort_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum::<f64>()));
    let n = sorted.len() as f64;
    let (from, to) = (((quantile - 0.25) * n).max(0.0) as usize, ((quantile + 0.25) * n).ceil() as usize);
    let kept = &sorted[from.min(sorted.len() - 1)..to.clamp(from + 1, sorted.len().max(from + 1)).min(sorted.len())];
    Some(std::array::from_fn(|c| kept.iter().map(|k| k[c]).sum::<f64>() / kept.len().max(1) as f64))
}

/// The painted colour at a distance from the gaze axis, in iris radii, and an angle.
fn colour_at(colours: &EyeColours, radius: f64, angle: f64) -> [f64; 3] {
    let iris = iris_colour(colours, ((radius - PUPIL) / (1.0 - PUPIL)).clamp(0.0, 1.0), angle);
    let limbus = 1.0 - 0.45 * (-((radius - 0.97) / 0.09).powi(2)).exp();
    // Fibres: streaks along the radius, strongest half way.
    let fibre = (angle * 61.0).sin() * 0.5 + (angle * 37.0 + 1.0).sin() * 0.5;
    let streak = 1.0 + 0.10 * fibre * (std::f64::consts::PI * (radius - PUPIL) / (1.0 - PUPIL)).sin().max(0.0);
    let outside = smooth_step(0.96, 1.06, radius);
    let pupil = 1.0 - smooth_step(PUPIL - 0.05, PUPIL + 0.03, radius);
    let vessel = smooth_step(1.3, 3.0, radius);
    std::array::from_fn(|c| {
        // The white reddens towards the corners.
        let white = colours.white[c] * [1.0, 1.0 - 0.12 * vessel, 1.0 - 0.14 * vessel][c];
        let coloured = iris[c] * limbus * streak;
        let ball = coloured * (1.0 - outside) + white * outside;
        ball * (1.0 - pupil) + 6.0 * pupil
    })
}

/// Bilinear in radius, around the circle in angle.
fn iris_colour(colours: &EyeColours, r: f64, angle: f64) -> [f64; 3] {
    let ring = (r * RINGS as f64 - 0.5).clamp(0.0, RINGS as f64 - 1.0);
    let sector = (angle.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * SECTORS as f64 - 0.5)
        .rem_euclid(SECTORS as f64);
    let (r0, s0) = (ring as usize, sector as usize % SECTORS);
    let (r1, s1) = ((r0 + 1).min(RINGS - 1), (s0 + 1) % SECTORS);
    let (fr, fs) = (ring - r0 as f64, sector.fract());
    let at = |r: usize, s: usize, c: usize| colours.iris[r][s][c];
    std::array::from_fn(|c| {
        (at(r0, s0, c) * (1.0 - fs) + at(r0, s1, c) * fs) * (1.0 - fr)
            + (at(r1, s0, c) * (1.0 - fs) + at(r1, s1, c) * fs) * fr
    })
}

fn to_byte(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A blue iris of radius 12 in a white, with a highlight, below an upper lid.
    fn eye() -> (RgbImage, Vec<Vec2>) {
        let centre = Vec2::new(40.0, 30.0);
        let image = RgbImage::from_fn(80, 60, |x, y| {
            let d = (Vec2::new(f64::from(x), f64::from(y)) - centre).norm() / 12.0;
            let lit = (x as i32 - 44).pow(2) + (y as i32 - 26).pow(2) < 5;
            image::Rgb(match d {
                _ if y < 22 => [200, 150, 130],
                _ if lit => [255, 255, 255],
                d if d < PUPIL => [10, 10, 10],
                d if d < 1.0 => [60, 90, 150],
                _ => [210, 200, 195],
            })
        });
        let opening = [(10.0, 30.0), (25.0, 22.0), (55.0, 22.0), (70.0, 30.0), (55.0, 42.0), (25.0, 42.0)];
        (image, opening.iter().map(|&(x, y)| Vec2::new(x, y)).collect())
    }

    fn view<'a>((image, opening): &'a (RgbImage, Vec<Vec2>)) -> EyeView<'a> {
        EyeView { image, centre: Vec2::new(40.0, 30.0), radius: 12.0, opening }
    }

    #[test]
    fn measures_iris_and_white_in_spite_of_highlight_and_lid() {
        let eye = eye();
        let colours = measure(&[view(&eye)]).unwrap();
        for ring in colours.iris.iter().flatten() {
            assert!((ring[2] - 150.0).abs() < 6.0 && (ring[0] - 60.0).abs() < 6.0, "{ring:?}");
        }
        assert!((colours.white[0] - 210.0).abs() < 4.0);
    }

    #[test]
    fn paints_a_dark_pupil_a_blue_iris_and_a_white() {
        let eye = eye();
        let picture = paint(&measure(&[view(&eye)]).unwrap(), 256, 1.0);
        let at = |angle: f64| picture.get_pixel(128 + (angle / std::f64::consts::FRAC_PI_2 * 128.0) as u32, 128).0;
        assert!(at(0.02)[0] < 20);
        let iris = at(0.65 * LIMBUS_ANGLE);
        assert!(iris[2] > iris[0] + 50, "{iris:?}");
        assert!(at(1.3 * LIMBUS_ANGLE)[0] > 190);
    }

    #[test]
    fn a_shaded_eye_becomes_as_bright_as_the_skin_and_a_bright_one_stays() {
        let shaded = EyeColours::plain([40.0, 50.0, 60.0], [100.0, 95.0, 90.0]);
        let skin = [180.0, 150.0, 130.0];
        let eye = shaded.unshaded(skin);
        assert!((luminance(eye.white) / luminance(skin) - 1.0).abs() < 0.01);
        let gain = |of: fn(&EyeColours) -> [f64; 3]| luminance(of(&eye)) / luminance(of(&shaded));
        assert!((gain(|e| e.iris[0][0]).powi(2) / gain(|e| e.white) - 1.0).abs() < 0.01);
        let tint = |e: &EyeColours| e.white[0] - e.white[2];
        assert!(tint(&eye) < tint(&shaded) && tint(&eye) > 0.0);
        let bright = EyeColours::plain([40.0, 50.0, 60.0], [220.0, 215.0, 210.0]);
        assert!((bright.unshaded(skin).white[1] - 215.0).abs() < 1.0);
    }

    #[test]
    fn a_closed_eye_gives_nothing() {
        let (image, _) = eye();
        let closed = vec![Vec2::new(20.0, 30.0), Vec2::new(60.0, 30.0)];
        assert!(measure(&[view(&(image, closed))]).is_none());
    }
}
