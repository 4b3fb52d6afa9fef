//! Lamps that are seen in the glasses of a head.

use geometry::{Camera, Transform, Vec2, Vec3};
use image::RgbImage;

/// Middles of the glasses from the tip of the nose in the head frame, metres; the other has the other sign of x.
const GLASS: Vec3 = Vec3::new(0.033, 0.041, -0.022);
/// Half axes of the lamp's image on the glass, metres.
const HALF: Vec2 = Vec2::new(0.009, 0.005);
/// How far it slides over the glass against the turn of the head, metres per radian.
const SLIDE: f64 = 0.02;
/// How much of what is below a lamp hides.
const OPACITY: f64 = 0.85;
/// Width of its soft edge, parts of its half axes.
const EDGE: f64 = 0.4;

/// A frame with two reflections over it.
pub fn over(frame: &RgbImage, camera: &Camera, cam_from_head: &Transform, nose_tip: &Vec3) -> RgbImage {
    let mut frame = frame.clone();
    // The way the face looks, as the camera sees it: sideways and up.
    let way = cam_from_head.rotation * Vec3::z();
    let slide = Vec3::new(way.x.asin(), way.y.asin(), 0.0) * SLIDE;
    for side in [-1.0, 1.0] {
        let glass = cam_from_head.apply(&(nose_tip + Vec3::new(side * GLASS.x, GLASS.y, GLASS.z)));
        let middle = glass - slide;
        let Some(at) = camera.project(&middle) else { continue };
        let half = HALF * (camera.fx / middle.z);
        let reach = half * (1.0 + EDGE);
        let pixels = |at: f64, reach: f64, size: u32| {
            (at - reach).ceil().max(0.0) as u32..((at + reach).floor() + 1.0).clamp(0.0, f64::from(size)) as u32
        };
        for y in pixels(at.y, reach.y, frame.height()) {
            for x in pixels(at.x, reach.x, frame.width()) {
                let away = (Vec2::new(f64::from(x), f64::from(y)) - at).component_div(&half).norm();
                let part = OPACITY * ((1.0 + EDGE - away) / EDGE).clamp(0.0, 1.0);
                let lit = |level: u8| (f64::from(level) + part * (255.0 - f64::from(level))).round() as u8;
                frame.get_pixel_mut(x, y).0.iter_mut().for_each(|level| *level = lit(*level));
            }
        }
    }
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use synthetic::head_from_turn;

    #[test]
    fn two_lamps_are_seen_that_stay_behind_the_turning_head() {
        let camera = Camera::centred(352, 288, 615.0);
        let nose = Vec3::new(0.0, -0.03, 0.1);
        // How far each lamp's middle lies to the right of its glass's.
        let slid = |yaw: f64| {
            let pose = head_from_turn(yaw, 0.0, 0.0, Vec3::zeros(), 0.75);
            let frame = over(&RgbImage::new(352, 288), &camera, &pose, &nose);
            [-1.0, 1.0].map(|side| {
                let glass = pose.apply(&(nose + Vec3::new(side * GLASS.x, GLASS.y, GLASS.z)));
                let at = camera.project(&glass).unwrap();
                let near = frame.enumerate_pixels().filter(|(x, ..)| (f64::from(*x) - at.x).abs() < 20.0);
                let (sum, weight) = near.fold((0.0, 0.0), |(sum, weight), (x, _, p)| {
                    let level = f64::from(p.0[0]);
                    (sum + level * (f64::from(x) - at.x), weight + level)
                });
                assert!(weight > 100.0 * 255.0, "{weight}");
                (sum / weight) * glass.z / camera.fx
            })
        };
        assert!(slid(0.0).iter().all(|s| s.abs() < 2e-4), "{:?}", slid(0.0));
        // The head's positive turn goes to the right of the picture, the lamps stay behind.
        assert!(slid(0.2).iter().all(|s| (s + 0.2 * SLIDE).abs() < 3e-4), "{:?}", slid(0.2));
    }
}
