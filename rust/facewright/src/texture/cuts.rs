//! What the textures need of the frames, cut out of them: a frame of a large film is mostly wall, and dozens of them are looked at together.

use super::mouth;
use super::skin_tone::SkinTone;
use crate::faces::{Clip, uncovered};
use crate::head::Measured;
use crate::{FacewrightError, Method};
use geometry::{Camera, Transform, Vec2};
use image::{GrayImage, Luma, RgbImage, imageops};
use raster::Window;
use rayon::prelude::*;
use vision::landmarks::{Face, Iris, PersonMask};

/// Pixels around what is cut out of a frame.
const EDGE: i32 = 8;
/// An eye is cut out so far around the middle of its iris, in radii of it: further than it is looked at.
const AROUND_IRIS: f64 = 3.0;

/// A part of a frame.
pub struct Cut {
    /// Its pixels.
    pub image: RgbImage,
    /// The frame's pixel that is its first.
    corner: [u32; 2],
    /// 255 where it may show the head's skin or hair, 0 on the wall, on cloth, on what covers the skin all the time, and on a
    /// mouth that is crossed or not at rest; `None` where that is not known.
    pub skin: Option<GrayImage>,
}

impl Cut {
    /// The pixels from `low` to `high` as far as the frame has them.
    fn of(picture: &RgbImage, low: Vec2, high: Vec2) -> Self {
        let within = |value: f64, size: u32| value.clamp(0.0, f64::from(size) - 1.0) as u32;
        let size = [picture.width(), picture.height()];
        let [corner, last] = [low, high].map(|at| [0, 1].map(|k| within(at[k], size[k])));
        let [width, height] = [0, 1].map(|k| last[k] - corner[k] + 1);
        let image = imageops::crop_imm(picture, corner[0], corner[1], width, height).to_image();
        Self { image, corner, skin: None }
    }

    /// With what it shows of a person, whose skin has this tone.
    fn showing(mut self, person: &PersonMask, face: &Face, tone: Option<&SkinTone>) -> Self {
        let corner = self.corner();
        let mut skin = GrayImage::from_pixel(self.image.width(), self.image.height(), Luma([255]));
        person.clear_outside(&mut skin, 0.0, |pixel| pixel + corner);
        if let Some(tone) = tone {
            tone.clear_below_face(&mut skin, &self.image, face, &corner);
        }
        self.skin = Some(skin);
        self
    }

    /// How red the lips of a face are.
    fn lips(&self, face: &Face) -> Option<mouth::Contrast> {
        mouth::contrast(&self.image, face, &self.corner())
    }

    /// Clears the mouth of a face.
    fn clear_mouth(&mut self, face: &Face) {
        let (width, height) = self.image.dimensions();
        let corner = self.corner();
        let skin = self.skin.get_or_insert_with(|| GrayImage::from_pixel(width, height, Luma([255])));
        mouth::clear_mouth(skin, face, &corner);
    }

    /// Without what a mask of it clears.
    fn only(mut self, mask: &GrayImage) -> Self {
        let skin = self.skin.get_or_insert_with(|| GrayImage::from_pixel(mask.width(), mask.height(), Luma([255])));
        skin.iter_mut().zip(mask.iter()).for_each(|(skin, mask)| *skin = (*skin).min(*mask));
        self
    }

    /// The frame's pixel that is its first.
    fn corner(&self) -> Vec2 {
        Vec2::new(f64::from(self.corner[0]), f64::from(self.corner[1]))
    }

    fn place(&self, pixel: &Vec2) -> Vec2 {
        pixel - self.corner()
    }

    /// The frame's lens for the part.
    pub fn camera(&self, camera: &Camera) -> Camera {
        let (width, height) = self.image.dimensions();
        let centre = self.place(&Vec2::new(camera.cx, camera.cy));
        Camera { width, height, cx: centre.x, cy: centre.y, ..*camera }
    }
}

/// What is cut out of one frame.
pub struct Cuts {
    /// The head, where the frame was picked for the skin.
    pub head: Option<Cut>,
    /// The eyes whose iris is seen, the subject's left one first, with the iris where the cut shows it.
    pub eyes: [Option<(Cut, Iris)>; 2],
}

/// Cuts of the chosen frames with their poses; the head of those that are picked among them.
pub fn cuts(
    clip: &Clip,
    measured: &Measured,
    chosen: &[(usize, Transform)],
    picked: &[usize],
    method: Method,
) -> Result<Vec<Cuts>, FacewrightError> {
    let cuts = |(i, (frame, pose)): (usize, &(usize, Transform))| {
        let picture = clip.frames.picture(*frame)?;
        let head = if picked.contains(&i) {
            let cut = head(&picture, measured, pose);
            Some(match method {
                // The paper's texture takes what the frames show.
                Method::Paper => cut,
                Method::Default => showing(cut, clip, *frame, &picture)?,
            })
        } else {
            None
        };
        let irises = clip.faces.face(*frame).map(|face| &face.irises);
        let eyes = [0, 1].map(|side| irises.map(|irises| &irises[side]).and_then(|iris| eye(&picture, iris)));
        Ok(Cuts { head, eyes })
    };
    let mut cuts = chosen.par_iter().enumerate().map(cuts).collect::<Result<Vec<Cuts>, FacewrightError>>()?;
    if method == Method::Default {
        clear_mouths(clip, chosen, &mut cuts);
    }
    Ok(cuts)
}

/// Clears the mouths that would not colour the lips as they rest.
fn clear_mouths(clip: &Clip, chosen: &[(usize, Transform)], cuts: &mut [Cuts]) {
    let mut heads: Vec<(&mut Cut, usize, &Face)> = Vec::new();
    for (cuts, (frame, _)) in cuts.iter_mut().zip(chosen) {
        heads.extend(cuts.head.as_mut().zip(clip.faces.face(*frame)).map(|(head, face)| (head, *frame, face)));
    }
    let picked: Vec<_> = heads.iter().map(|(head, frame, face)| (*frame, head.lips(face))).collect();
    for i in mouth::unusable(clip, &picked) {
        let (head, _, face) = &mut heads[i];
        head.clear_mouth(face);
    }
}

/// The head, with what may colour it.
fn showing(cut: Cut, clip: &Clip, frame: usize, picture: &RgbImage) -> Result<Cut, FacewrightError> {
    let Some((face, person)) = clip.faces.face(frame).zip(clip.person(frame)?) else { return Ok(cut) };
    let cut = cut.showing(&person, face, SkinTone::of(picture, face).as_ref());
    let place = (cut.corner, cut.image.dimensions());
    let bare = clip.faces.appearance().and_then(|usual| uncovered(picture, face, &usual, place));
    Ok(bare.iter().fold(cut, Cut::only))
}

/// The head, or the whole frame where it is not in it.
fn head(picture: &RgbImage, measured: &Measured, pose: &Transform) -> Cut {
    let vertices = raster::project(&measured.camera, pose, &measured.positions);
    let whole = Window { x: 0, y: 0, width: picture.width() as usize, height: picture.height() as usize };
    let window = Window::around(&vertices, &measured.camera, EDGE).unwrap_or(whole);
    let low = Vec2::new(f64::from(window.x), f64::from(window.y));
    Cut::of(picture, low, low + Vec2::new(window.width as f64 - 1.0, window.height as f64 - 1.0))
}

fn eye(picture: &RgbImage, iris: &Iris) -> Option<(Cut, Iris)> {
    let reach = Vec2::repeat(AROUND_IRIS * iris.radius);
    let is_inside = iris.visible && reach.x.is_finite() && iris.centre.iter().all(|c| c.is_finite());
    let cut = is_inside.then(|| Cut::of(picture, iris.centre - reach, iris.centre + reach))?;
    let eye_contour = iris.eye_contour.iter().map(|point| cut.place(point)).collect();
    let iris = Iris { centre: cut.place(&iris.centre), eye_contour, ..iris.clone() };
    Some((cut, iris))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;
    use image::Rgb;

    #[test]
    fn a_cut_shows_the_same_pixels_through_its_own_lens() {
        let picture = RgbImage::from_fn(60, 40, |x, y| Rgb([x as u8, y as u8, 0]));
        let camera = Camera { k1: -0.1, ..Camera::centred(60, 40, 50.0) };
        let cut = Cut::of(&picture, Vec2::new(12.0, -7.0), Vec2::new(31.0, 22.0));
        assert_eq!(cut.image.dimensions(), (20, 23));
        let (point, own) = (Vec3::new(-0.08, -0.06, 0.5), cut.camera(&camera));
        let (there, here) = (camera.project(&point).unwrap(), own.project(&point).unwrap());
        assert!((here + Vec2::new(12.0, 0.0) - there).norm() < 1e-12);
        let pixel = |image: &RgbImage, at: &Vec2| *image.get_pixel(at.x.round() as u32, at.y.round() as u32);
        assert_eq!(pixel(&cut.image, &here), pixel(&picture, &there));
    }
}
