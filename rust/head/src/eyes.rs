//! Eyeballs fitted to a person's sockets, and everything else that lies under the skin.
//!
//! # Entry points
//! - [`fit_eyes`]: centre, radius and gaze of both eyeballs.
//! - [`place_eyes`]: puts the eyeballs there and closes the sockets round them.
//! - [`carry_parts`]: lashes, teeth and tongue go with the skin.
//!
//! # How
//! An eyeball is as large as eyeballs are, or as the iris says: irises differ by a few per cent among people. It sits
//! where the warp of the face takes the generic one, as far forward as it can without poking through the lids. The
//! generic eyeballs are larger than that (their lids were modelled on them), so a gap would open in the corners of the
//! eye: the hidden skin of the socket, which begins at the lid's inner edge, is drawn onto the ball.

use crate::transfer::control_weights;
use crate::warp::LocalWarp;
use crate::{GenericHead, HeadError, Part, part};
use geometry::{Similarity, Vec3, mesh};
use nalgebra::Rotation3;

/// Skin nearer than this to the generic eyeball belongs to its lids or socket, metres.
const LID: f64 = 4e-3;
/// Hidden skin round an eyeball ends this far inside it at least, so that no gap shows, metres.
const TUCK: f64 = 5e-4;
/// Lids that reach deeper into the generic eyeball than this are not held outside, metres.
const SUNK: f64 = -5e-4;

/// Lashes follow the lid within this, metres: they must not part from it.
const LASH_REACH: f64 = 8e-3;

/// How to fit eyeballs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeOptions {
    /// Radius of an adult's eyeball, metres.
    pub radius: f64,
    /// Radius of an adult's iris, metres.
    pub iris_radius: f64,
    /// Room between eyeball and the lid that is nearest to it, metres.
    pub clearance: f64,
}

impl Default for EyeOptions {
    fn default() -> Self {
        // Horizontal visible iris diameter 11.7 mm. Eyeballs are 24 mm long; one millimetre more of radius makes up for
        // what the generic lids lack of curvature, and halves the gap in the corners of the eye.
        Self { radius: 0.013, iris_radius: 0.005_85, clearance: 1.5e-4 }
    }
}

/// A fitted eyeball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeFit {
    /// Its centre, head frame, metres.
    pub centre: Vec3,
    /// Its radius, metres.
    pub radius: f64,
    /// Unit direction in which it looks at rest.
    pub gaze: Vec3,
    /// Radius of its iris, metres.
    pub iris_radius: f64,
}

/// Fits both eyeballs, left one first, to a person's skin (`positions`: all vertices of the generic head's topology). `irises` are the
/// radii of the irises that were seen, metres: people's eyes are of one size, and what the irises say of both is averaged. At rest both
/// look straight ahead: where a person looks while filmed is the camera or a screen, and no rest.
///
/// # Errors
/// [`HeadError::Topology`] for another number of vertices, [`HeadError::Degenerate`] where there is no socket.
pub fn fit_eyes(
    generic: &GenericHead,
    positions: &[Vec3],
    irises: &[Option<f64>; 2],
    options: &EyeOptions,
) -> Result<[EyeFit; 2], HeadError> {
    same_topology(generic, positions)?;
    let weights = control_weights(generic);
    let warp = LocalWarp::new(&generic.positions, positions, &weights);
    let seen = || irises.iter().flatten();
    let measured = seen().map(|radius| radius / options.iris_radius).sum::<f64>() / seen().count().max(1) as f64;
    let fit = |side: usize| -> Result<EyeFit, HeadError> {
        let eye = eyeball(generic, side)?;
        let (centre, radius) = ball(&generic.positions, eye);
        let local = warp.at(&centre);
        let size = if measured > 0.0 { measured } else { local.scale }.clamp(0.8, 1.2);
        let forward = (local.linear * Vec3::z()).try_normalize(1e-9).unwrap_or_else(Vec3::z);
        let lids: Vec<Vec3> = lid_vertices(generic, &centre, radius).map(|v| positions[v]).collect();
        let own = options.radius * size;
        let centre = deepest(&lids, &local.position, &forward, own + options.clearance)
            .ok_or_else(|| HeadError::Degenerate { place: eye.name.clone() })?;
        Ok(EyeFit { centre, radius: own, gaze: Vec3::z(), iris_radius: options.iris_radius * size })
    };
    Ok([fit(0)?, fit(1)?])
}

/// Puts the eyeballs where they were fitted and tucks the hidden skin of the sockets under their surfaces.
///
/// # Errors
/// [`HeadError::Topology`] for another number of vertices.
pub fn place_eyes(generic: &GenericHead, positions: &mut [Vec3], eyes: &[EyeFit; 2]) -> Result<(), HeadError> {
    same_topology(generic, positions)?;
    for (side, fit) in eyes.iter().enumerate() {
        let eye = eyeball(generic, side)?;
        let (centre, radius) = ball(&generic.positions, eye);
        let turn = Rotation3::rotation_between(&Vec3::z(), &fit.gaze).unwrap_or_else(Rotation3::identity);
        for v in eye.vertices.clone() {
            positions[v] = fit.centre + turn * (generic.positions[v] - centre) * (fit.radius / radius);
        }
        for v in generic.skin().vertices.clone() {
            let depth = (generic.positions[v] - centre).norm() - radius;
            let hidden = depth.abs() < LID && (generic.cavity[v] || depth < SUNK);
            if let (true, Some(out)) = (hidden, (positions[v] - fit.centre).try_normalize(1e-9)) {
                positions[v] = fit.centre + out * (fit.radius + depth.min(-TUCK));
            }
        }
    }
    Ok(())
}

/// Moves lashes, teeth and tongue along with the skin: lashes by the warp of the face, teeth and tongue together by the
/// similarity nearest to it, so that the bite stays a bite; then back until they are behind the lips as the generic's are.
///
/// # Errors
/// [`HeadError::Topology`] for another number of vertices, [`HeadError::Degenerate`] for a mouth in one place.
pub fn carry_parts(generic: &GenericHead, positions: &mut [Vec3]) -> Result<(), HeadError> {
    same_topology(generic, positions)?;
    let weights = control_weights(generic);
    let skin = positions.to_vec();
    let warp = LocalWarp::new(&generic.positions, &skin, &weights);
    let of = |name: &str| generic.part(name).into_iter().flat_map(|p| p.vertices.clone());
    let lids = LocalWarp::with_reach(&generic.positions, &skin, &weights, LASH_REACH);
    for v in of(part::LASHES) {
        positions[v] = lids.at(&generic.positions[v]).position;
    }
    let mouth: Vec<usize> = [part::TEETH_UPPER, part::TEETH_LOWER, part::TONGUE].iter().flat_map(|n| of(n)).collect();
    let from: Vec<Vec3> = mouth.iter().map(|&v| generic.positions[v]).collect();
    let to: Vec<Vec3> = from.iter().map(|p| warp.at(p).position).collect();
    let fit =
        Similarity::fit(&from, &to, None, true).ok_or_else(|| HeadError::Degenerate { place: "mouth".to_owned() })?;
    let back = Vec3::new(0.0, 0.0, protrusion(generic, &skin, &mouth, &fit));
    for (v, p) in mouth.into_iter().zip(&from) {
        positions[v] = fit.apply(p) - back;
    }
    Ok(())
}

/// How far teeth stand out of the lips, against how they are on the generic head: at most half the room is given up.
fn protrusion(generic: &GenericHead, skin: &[Vec3], mouth: &[usize], fit: &Similarity) -> f64 {
    // The bag of the mouth is guessed: what was seen are the lips.
    let lips = generic.skin().vertices.clone().filter(|&v| !generic.cavity[v]);
    let lack = |&v: &usize| {
        let place = generic.positions[v];
        let gap = |w: &usize| (generic.positions[*w] - place).norm_squared();
        let nearest = lips.clone().min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
        let way = generic.positions[nearest] - place;
        let length = way.norm();
        // Only what faces the lips counts: the rest is far inside.
        (way.z > 0.5 * length && length < 6e-3)
            .then(|| 0.5 * length * fit.scale - (skin[nearest] - fit.apply(&place)).dot(&way) / length)
    };
    mouth.iter().filter_map(lack).fold(0.0_f64, f64::max).min(5e-3)
}

/// The centre on the line from `start` along `forward` that is farthest forward with all lids outside a ball of `reach`.
fn deepest(lids: &[Vec3], start: &Vec3, forward: &Vec3, reach: f64) -> Option<Vec3> {
    // A lid vertex touches the ball when its centre is at `along − √(reach² − across²)`; lids farther off never do.
    let touch = |p: &Vec3| {
        let along = (p - start).dot(forward);
        let across = (p - start - forward * along).norm_squared();
        (across < reach * reach).then(|| along - (reach * reach - across).sqrt())
    };
    let limit = lids.iter().filter_map(touch).fold(f64::INFINITY, f64::min);
    limit.is_finite().then(|| start + forward * limit)
}

/// Visible skin that lies on the front of the generic eyeball.
fn lid_vertices<'a>(generic: &'a GenericHead, centre: &'a Vec3, radius: f64) -> impl Iterator<Item = usize> + 'a {
    generic.skin().vertices.clone().filter(move |&v| {
        let p = generic.positions[v] - centre;
        let clearance = p.norm() - radius;
        !generic.cavity[v] && p.z > 0.0 && clearance > SUNK && clearance < LID
    })
}

fn eyeball(generic: &GenericHead, side: usize) -> Result<&Part, HeadError> {
    let name = [part::EYE_LEFT, part::EYE_RIGHT][side];
    generic
        .part(name)
        .filter(|p| !p.vertices.is_empty())
        .ok_or_else(|| HeadError::Degenerate { place: name.to_owned() })
}

/// Centre and outer radius of an eyeball.
pub(crate) fn ball(positions: &[Vec3], eye: &Part) -> (Vec3, f64) {
    let vertices = &positions[eye.vertices.clone()];
    let centre = vertices.iter().sum::<Vec3>() / vertices.len().max(1) as f64;
    (centre, vertices.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max))
}

fn same_topology(generic: &GenericHead, positions: &[Vec3]) -> Result<(), HeadError> {
    let (found, wanted) = (positions.len(), generic.positions.len());
    if found == wanted { Ok(()) } else { Err(HeadError::Topology { found, wanted }) }
}

/// Where the visible lid ends and the socket begins, seen from the front of an eyeball: `count` places round the opening,
/// each as an edge of the skin and a share along it, counter-clockwise from the subject's left.
pub fn opening(generic: &GenericHead, side: usize, count: usize) -> Result<Vec<([u32; 2], f64)>, HeadError> {
    let eye = eyeball(generic, side)?;
    let (centre, radius) = ball(&generic.positions, eye);
    let rim: Vec<[u32; 2]> = rim_edges(generic)
        .into_iter()
        .filter(|e| {
            e.iter().all(|&v| {
                let p = generic.positions[v as usize] - centre;
                p.z > 0.0 && p.norm() < 1.5 * radius
            })
        })
        .collect();
    let middle =
        rim.iter().flatten().map(|&v| generic.positions[v as usize]).sum::<Vec3>() / (2 * rim.len()).max(1) as f64;
    let crossing = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / count as f64;
        let hits = rim.iter().filter_map(|e| {
            let [a, b] = e.map(|v| generic.positions[v as usize] - middle);
            let (direction, along) = (Vec3::new(angle.cos(), angle.sin(), 0.0), b - a);
            let det = direction.x * along.y - direction.y * along.x;
            let share = (a.x * direction.y - a.y * direction.x) / det;
            let distance = (a + along * share).dot(&direction);
            (det.abs() > 1e-15 && (0.0..=1.0).contains(&share) && distance > 0.0).then_some((distance, *e, share))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, e, share)| (e, share))
    };
    let places: Option<Vec<_>> = (0..count).map(crossing).collect();
    places.ok_or_else(|| HeadError::Degenerate { place: eye.name.clone() })
}

/// Edges between a wholly visible quad and one that is not.
pub(crate) fn rim_edges(generic: &GenericHead) -> Vec<[u32; 2]> {
    let quads = &generic.quads[generic.skin().quads.clone()];
    let (hidden, seen): (Vec<_>, Vec<_>) =
        quads.iter().copied().partition(|q| q.iter().any(|&v| generic.cavity[v as usize]));
    let hidden = mesh::quad_edges(&hidden);
    mesh::quad_edges(&seen).into_iter().filter(|e| hidden.binary_search(e).is_ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{asset, person};

    #[test]
    fn eyeballs_touch_the_lids_from_inside_on_other_people() {
        let Some(generic) = asset() else { return };
        let options = EyeOptions::default();
        for seed in 0..4 {
            let head = person(&generic, seed, 1.2, 6e-4);
            let eyes = fit_eyes(&generic, &head, &[None; 2], &options).unwrap();
            for (side, eye) in eyes.iter().enumerate() {
                let (centre, radius) = ball(&generic.positions, eyeball(&generic, side).unwrap());
                let clearance = |v: usize| (head[v] - eye.centre).norm() - eye.radius;
                let least = lid_vertices(&generic, &centre, radius).map(clearance).fold(f64::INFINITY, f64::min);
                assert!((least - options.clearance).abs() < 1e-6, "{least}");
                assert!((0.8..=1.2).contains(&(eye.radius / options.radius)));
            }
            assert!(((eyes[0].centre - eyes[1].centre).norm() - 0.063).abs() < 0.008);
        }
    }

    #[test]
    fn an_iris_gives_the_size_of_both_eyes() {
        let Some(generic) = asset() else { return };
        let plain = fit_eyes(&generic, &generic.positions, &[None; 2], &EyeOptions::default()).unwrap();
        let seen = [Some(0.0062), None];
        let eyes = fit_eyes(&generic, &generic.positions, &seen, &EyeOptions::default()).unwrap();
        assert!((eyes[0].iris_radius - 0.0062).abs() < 1e-12 && eyes[0].radius > plain[0].radius);
        assert_eq!(eyes[1].radius, eyes[0].radius);
    }

    #[test]
    fn eyes_at_rest_look_straight_ahead() {
        let Some(generic) = asset() else { return };
        for seed in 0..4 {
            let head = person(&generic, seed, 1.2, 6e-4);
            let eyes = fit_eyes(&generic, &head, &[None; 2], &EyeOptions::default()).unwrap();
            assert!(eyes.iter().all(|eye| eye.gaze == Vec3::z()));
        }
    }

    #[test]
    fn placed_eyes_have_their_size_and_their_sockets_are_hidden() {
        let Some(generic) = asset() else { return };
        let mut head = person(&generic, 5, 1.0, 0.0);
        let eyes = fit_eyes(&generic, &head, &[None; 2], &EyeOptions::default()).unwrap();
        place_eyes(&generic, &mut head, &eyes).unwrap();
        let eye = eyeball(&generic, 1).unwrap();
        let (centre, radius) = ball(&head, eye);
        assert!((centre - eyes[1].centre).norm() < 1e-6 && (radius - eyes[1].radius).abs() < 1e-6);
        let (there, wide) = ball(&generic.positions, eye);
        let sockets = generic
            .skin()
            .vertices
            .clone()
            .filter(|&v| generic.cavity[v] && ((generic.positions[v] - there).norm() - wide).abs() < LID);
        assert!(sockets.into_iter().all(|v| (head[v] - centre).norm() < radius));
    }

    #[test]
    fn the_generic_heads_parts_stay_where_they_are() {
        let Some(generic) = asset() else { return };
        let mut head = generic.positions.clone();
        carry_parts(&generic, &mut head).unwrap();
        let moved = head.iter().zip(&generic.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(moved < 1e-9, "{moved}");
    }

    #[test]
    fn teeth_stay_behind_the_lips_of_other_people() {
        let Some(generic) = asset() else { return };
        for seed in 0..4 {
            let head = person(&generic, seed, 1.2, 6e-4);
            let mouth: Vec<usize> = [part::TEETH_UPPER, part::TEETH_LOWER]
                .iter()
                .flat_map(|n| generic.part(n).unwrap().vertices.clone())
                .collect();
            let front = |p: &[Vec3], vs: &mut dyn Iterator<Item = usize>| vs.map(|v| p[v].z).fold(f64::MIN, f64::max);
            let lips = || generic.lip_contacts.iter().flatten().map(|&v| v as usize);
            let room = |p: &[Vec3]| front(p, &mut lips()) - front(p, &mut mouth.iter().copied());
            assert!(room(&head) > 0.0, "seed {seed}: {} of {}", room(&head), room(&generic.positions));
        }
    }

    #[test]
    fn another_topology_is_refused() {
        let Some(generic) = asset() else { return };
        let mut short = generic.positions[1..].to_vec();
        assert!(carry_parts(&generic, &mut short).is_err());
        assert!(fit_eyes(&generic, &short, &[None; 2], &EyeOptions::default()).is_err());
    }
}
