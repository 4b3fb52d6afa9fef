//! All expression keys carried over to a person's proportions.
//!
//! # Entry point
//! [`KeyTransfer`]: from the generic head and the person's rest shape to the person's 52 keys.
//!
//! # How
//! What a key does to each triangle of the generic skin is done to the person's ([`crate::gradient`]). Over long ways
//! offsets keep to those that the derivative of the smooth warp between the heads ([`crate::warp`]) carries over: a lid
//! that has further to go goes further. What remains is put right where it shows: lids meet as the generic's do and stay
//! outside the person's eyeballs; the lips meet when `mouthClose` undoes `jawOpen`. Teeth and tongue move as rigidly as
//! they do on the generic head, eyeballs turn about their own centres, lashes go with their lids. A person equal to the
//! generic head gets its very keys; vertices that a key leaves alone are left alone.

use crate::contact::spread;
use crate::eyes::ball;
use crate::gradient::GradientTransfer;
use crate::warp::{Local, LocalWarp};
use crate::{GenericHead, HeadError, Key, Part, part};
use geometry::{Mat3, Similarity, Vec3, mesh};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Room that a lid keeps from the eyeball if the generic head's lid has it, metres.
const ROOM: f64 = 3e-4;
/// How reluctantly corrections spread to what a key hardly moves.
const RELUCTANCE: f64 = 1e-3;
/// Rounds of corrections: wanted ones that contradict each other settle in a few.
const ROUNDS: usize = 3;
/// Corrections not worth a round, metres.
const NOTHING: f64 = 1e-6;
/// Weight of hidden skin in the warp: fits guess it.
const HIDDEN: f64 = 0.05;

/// A ball.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Vec3,
    radius: f64,
}

impl Ball {
    fn new(positions: &[Vec3], eye: &Part) -> Self {
        let (centre, radius) = ball(positions, eye);
        Self { centre, radius }
    }

    /// Distance of a point from the surface, negative inside.
    fn clearance(&self, p: &Vec3) -> f64 {
        (p - self.centre).norm() - self.radius
    }
}

/// Carries keys from the generic head to a person.
pub struct KeyTransfer<'a> {
    generic: &'a GenericHead,
    basis: &'a [Vec3],
    /// The warp's derivative at each vertex.
    locals: Vec<Local>,
    /// Neighbours on the skin.
    rings: Vec<Vec<u32>>,
    gradients: GradientTransfer<'a>,
}

impl<'a> KeyTransfer<'a> {
    /// Prepares for a person whose rest shape is `basis_positions` (all vertices of the generic head's topology, metres).
    ///
    /// # Errors
    /// [`HeadError::Topology`] for another number of vertices, [`HeadError::Degenerate`] for positions that are no numbers.
    pub fn new(generic: &'a GenericHead, basis_positions: &'a [Vec3]) -> Result<Self, HeadError> {
        check(generic, basis_positions)?;
        let weights = control_weights(generic);
        let warp = LocalWarp::new(&generic.positions, basis_positions, &weights);
        let mut moved = vec![false; generic.positions.len()];
        generic.keys.iter().flat_map(|k| &k.offsets).for_each(|(v, _)| moved[*v as usize] = true);
        let still = Local { position: Vec3::zeros(), linear: Mat3::identity(), scale: 1.0 };
        let local = |(v, moved): (usize, &bool)| if *moved { warp.at(&generic.positions[v]) } else { still };
        let mut locals: Vec<Local> = moved.par_iter().enumerate().map(local).collect();
        for name in [part::TEETH_UPPER, part::TEETH_LOWER, part::TONGUE] {
            let range = vertices(generic, name)?;
            let fit = Similarity::fit(&generic.positions[range.clone()], &basis_positions[range.clone()], None, true)
                .ok_or_else(|| HeadError::Degenerate { place: name.to_owned() })?;
            let linear = fit.rigid.rotation.matrix() * fit.scale;
            locals[range].fill(Local { linear, scale: fit.scale, ..still });
        }
        let skin = &generic.quads[generic.skin().quads.clone()];
        let rings = mesh::neighbours(generic.positions.len(), &mesh::quad_edges(skin));
        let gradients = GradientTransfer::new(&generic.positions, basis_positions, skin, &generic.lip_contacts);
        Ok(Self { generic, basis: basis_positions, locals, rings, gradients })
    }

    /// All keys of the generic head, in its order, for the person.
    ///
    /// # Errors
    /// [`HeadError::Degenerate`] when the person's eyes or mouth have no shape.
    pub fn keys(&self) -> Result<Vec<Key>, HeadError> {
        let carried: Result<Vec<Key>, HeadError> = self.generic.keys.par_iter().map(|key| self.carried(key)).collect();
        let mut keys = carried?;
        self.close_mouth(&mut keys)?;
        keys.par_iter_mut().zip(&self.generic.keys).for_each(|(own, key)| self.carry_lashes(own, key));
        Ok(keys)
    }

    /// One key, all but for the mouth's closing and the lashes.
    fn carried(&self, key: &Key) -> Result<Key, HeadError> {
        let mut own = Key { name: key.name.clone(), offsets: self.warped(key) };
        let region = self.region(key);
        let part = |offsets: &[(u32, Vec3)]| offsets[..region.len()].iter().map(|o| o.1).collect::<Vec<Vec3>>();
        let linear = |v: u32| self.locals[v as usize].linear;
        let skin = self.gradients.carry(&region, &part(&key.offsets), &part(&own.offsets), linear)?;
        own.offsets.iter_mut().zip(skin).for_each(|(offset, d)| offset.1 = d);
        for (side, name) in [part::EYE_LEFT, part::EYE_RIGHT].into_iter().enumerate() {
            let eye = self.generic.part(name).ok_or_else(|| HeadError::Degenerate { place: name.to_owned() })?;
            if key.name.starts_with("eye") && key.name.ends_with(["Left", "Right"][side]) {
                self.turn_eye(&mut own, key, eye);
                self.settle_lids(&mut own, key, eye, side)?;
            }
        }
        Ok(own)
    }

    /// Offsets taken through the warp's derivative.
    fn warped(&self, key: &Key) -> Vec<(u32, Vec3)> {
        key.offsets.iter().map(|&(v, d)| (v, self.locals[v as usize].linear * d)).collect()
    }

    /// Vertices of the skin that a key moves.
    fn region(&self, key: &Key) -> Vec<u32> {
        let skin = self.generic.skin().vertices.end;
        key.offsets.iter().map(|o| o.0).take_while(|&v| (v as usize) < skin).collect()
    }

    /// Turns the eyeball about its own centre as the generic's turns about its.
    fn turn_eye(&self, own: &mut Key, key: &Key, eye: &Part) {
        let (generic, person) = (Ball::new(&self.generic.positions, eye), Ball::new(self.basis, eye));
        let inside = |v: u32| eye.vertices.contains(&(v as usize));
        let from: Vec<Vec3> = key
            .offsets
            .iter()
            .filter(|o| inside(o.0))
            .map(|o| self.generic.positions[o.0 as usize] - generic.centre)
            .collect();
        let to: Vec<Vec3> = key.offsets.iter().filter(|o| inside(o.0)).zip(&from).map(|(o, p)| p + o.1).collect();
        let Some(turn) = Similarity::fit(&from, &to, None, false) else { return };
        let scale = person.radius / generic.radius.max(1e-12);
        let turned = |p: &Vec3| turn.rigid.rotation * p - p;
        for ((v, d), (_, given)) in own.offsets.iter_mut().zip(&key.offsets).filter(|(o, _)| inside(o.0)) {
            let there = self.generic.positions[*v as usize] - generic.centre;
            // What is no rotation in the generic key is kept, so that its own keys come back unchanged.
            let rest = given - turned(&there);
            *d = turned(&(self.basis[*v as usize] - person.centre)) + rest * scale;
        }
    }

    /// Makes lids meet as the generic's do, and keeps them outside the eyeball.
    fn settle_lids(&self, own: &mut Key, key: &Key, eye: &Part, side: usize) -> Result<(), HeadError> {
        let (generic, person) = (Ball::new(&self.generic.positions, eye), Ball::new(self.basis, eye));
        let blink = key.name.starts_with("eyeBlink");
        for _ in 0..ROUNDS {
            let mut wanted = self.out_of_ball(own, key, &generic, &person);
            if blink {
                let pushed: BTreeMap<u32, Vec3> = wanted.iter().copied().collect();
                let pairs = self.generic.lid_contacts[side].iter().copied();
                let base = |v: u32| pushed.get(&v).copied().unwrap_or_else(Vec3::zeros);
                let meeting = self.meeting(pairs, &[key], &[own], own);
                wanted.extend(meeting.into_iter().map(|(v, d)| (v, d + base(v))));
            }
            if wanted.iter().all(|(_, d)| d.norm() < NOTHING) {
                break;
            }
            self.correct(own, &wanted)?;
        }
        Ok(())
    }

    /// Corrections that take lids out of the eyeball, as far as the generic's are.
    fn out_of_ball(&self, own: &Key, key: &Key, generic: &Ball, person: &Ball) -> Vec<(u32, Vec3)> {
        let skin = &self.generic.skin().vertices;
        let correction = |((v, d), (_, given)): (&(u32, Vec3), &(u32, Vec3))| {
            let i = *v as usize;
            if !skin.contains(&i) || self.generic.cavity[i] {
                return None;
            }
            let room = generic.clearance(&(self.generic.positions[i] + given)) * self.locals[i].scale;
            let end = self.basis[i] + d;
            let lack = room.min(ROOM) - person.clearance(&end);
            let out = (end - person.centre).try_normalize(1e-9)?;
            (lack > 1e-9).then(|| (*v, out * lack))
        };
        own.offsets.iter().zip(&key.offsets).filter_map(correction).collect()
    }

    /// Corrections of `own` that bring pairs as close under all `keys` as the generic's come, shared as `own` moves them.
    fn meeting(
        &self,
        pairs: impl Iterator<Item = [u32; 2]>,
        generic_keys: &[&Key],
        keys: &[&Key],
        own: &Key,
    ) -> Vec<(u32, Vec3)> {
        let mut sums: BTreeMap<u32, (Vec3, f64)> = BTreeMap::new();
        for [a, b] in pairs {
            let gap = |positions: &[Vec3], keys: &[&Key]| {
                let moved = |v: u32| keys.iter().fold(positions[v as usize], |p, key| p + offset(key, v));
                moved(a) - moved(b)
            };
            let linear = (self.locals[a as usize].linear + self.locals[b as usize].linear) / 2.0;
            let lack = linear * gap(&self.generic.positions, generic_keys) - gap(self.basis, keys);
            let (da, db) = (offset(own, a).norm(), offset(own, b).norm());
            let share = if da + db > 0.0 { da / (da + db) } else { 0.5 };
            for (v, d) in [(a, lack * share), (b, lack * (share - 1.0))] {
                let sum = sums.entry(v).or_insert((Vec3::zeros(), 0.0));
                *sum = (sum.0 + d, sum.1 + 1.0);
            }
        }
        sums.into_iter().map(|(v, (sum, count))| (v, sum / count)).collect()
    }

    /// Spreads corrections over the skin that the key moves, and adds them.
    fn correct(&self, own: &mut Key, wanted: &[(u32, Vec3)]) -> Result<(), HeadError> {
        let region = self.region(own);
        let largest = own.offsets.iter().map(|o| o.1.norm()).fold(1e-12, f64::max);
        let reluctance: Vec<f64> =
            own.offsets[..region.len()].iter().map(|(_, d)| RELUCTANCE / (d.norm() / largest + 0.02).powi(2)).collect();
        let field = spread(&self.rings, &region, &reluctance, wanted)?;
        own.offsets.iter_mut().zip(&field).for_each(|((_, d), c)| *d += c);
        Ok(())
    }

    /// Gives each lash what the skin's offsets have beyond the warp's, at the lid vertex that is near and moves likewise.
    fn carry_lashes(&self, own: &mut Key, key: &Key) {
        let Some(lashes) = self.generic.part(part::LASHES) else { return };
        let skin = self.region(key).len();
        let warped = self.warped(key);
        let lids: Vec<usize> = (0..skin).filter(|&i| !self.generic.cavity[key.offsets[i].0 as usize]).collect();
        for i in (skin..key.offsets.len()).filter(|&i| lashes.vertices.contains(&(key.offsets[i].0 as usize))) {
            let place = self.generic.positions[key.offsets[i].0 as usize];
            let unlike = |lid: usize| {
                let (v, d) = &key.offsets[lid];
                let way = self.generic.positions[*v as usize] - place;
                way.norm_squared() + 4.0 * (d - key.offsets[i].1).norm_squared()
            };
            let nearest = lids.iter().min_by(|a, b| unlike(**a).total_cmp(&unlike(**b)));
            let more = nearest.map_or_else(Vec3::zeros, |&lid| own.offsets[lid].1 - warped[lid].1);
            own.offsets[i].1 = warped[i].1 + more;
        }
    }

    /// Makes the lips meet when `mouthClose` is added to `jawOpen`.
    fn close_mouth(&self, keys: &mut [Key]) -> Result<(), HeadError> {
        let find = |name: &str| self.generic.keys.iter().position(|k| k.name == name);
        let (Some(open), Some(close)) = (find("jawOpen"), find("mouthClose")) else { return Ok(()) };
        let generic = [&self.generic.keys[open], &self.generic.keys[close]];
        for _ in 0..ROUNDS {
            let pairs = self.generic.lip_contacts.iter().copied();
            let wanted = self.meeting(pairs, &generic, &[&keys[open], &keys[close]], &keys[close]);
            if wanted.iter().all(|(_, d)| d.norm() < NOTHING) {
                break;
            }
            self.correct(&mut keys[close], &wanted)?;
        }
        Ok(())
    }
}

fn check(generic: &GenericHead, positions: &[Vec3]) -> Result<(), HeadError> {
    let (found, wanted) = (positions.len(), generic.positions.len());
    if found != wanted {
        return Err(HeadError::Topology { found, wanted });
    }
    let bad =
        generic.parts.iter().find(|p| positions[p.vertices.clone()].iter().any(|v| v.iter().any(|x| !x.is_finite())));
    bad.map_or(Ok(()), |p| Err(HeadError::Degenerate { place: p.name.clone() }))
}

/// Area of the skin round each vertex, less where it is hidden; zero for the other parts.
pub(crate) fn control_weights(generic: &GenericHead) -> Vec<f64> {
    let mut weights = vec![0.0; generic.positions.len()];
    for t in generic.triangles(generic.skin()) {
        let area = mesh::area_normal(&generic.positions, &t).norm();
        for v in t.map(|v| v as usize) {
            weights[v] += area * if generic.cavity[v] { HIDDEN } else { 1.0 };
        }
    }
    weights
}

fn vertices(generic: &GenericHead, name: &str) -> Result<std::ops::Range<usize>, HeadError> {
    let part = generic.part(name).ok_or_else(|| HeadError::Degenerate { place: name.to_owned() })?;
    Ok(part.vertices.clone())
}

fn offset(key: &Key, vertex: u32) -> Vec3 {
    key.offsets.binary_search_by_key(&vertex, |o| o.0).map_or_else(|_| Vec3::zeros(), |i| key.offsets[i].1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::IdentityClass;
    use crate::testing::{asset, with_eyes};

    /// Seven parts of nine vertices, two keys.
    fn toy_head() -> GenericHead {
        let place = |v: usize| {
            let centre = [Vec3::zeros(), Vec3::new(0.03, 0.0, -0.01), Vec3::new(-0.03, 0.0, -0.01)];
            let (part, i) = (v / 9, v % 9);
            let bulge = if i == 4 { 0.004 } else { 0.0 };
            centre[if part < 3 { part } else { 0 }]
                + Vec3::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0, 0.0) * 0.01
                + Vec3::z() * bulge
        };
        let corners = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];
        let key = |name: &str, shift: f64| Key {
            name: name.into(),
            offsets: (0..63)
                .filter(|v| v % 9 > 3)
                .map(|v| (v, Vec3::new(0.0, -shift, shift * f64::from(v % 5))))
                .collect(),
        };
        GenericHead {
            positions: (0..63).map(place).collect(),
            quads: (0..7).flat_map(|p| corners.map(|q| q.map(|v| v + 9 * p))).collect(),
            uvs: vec![[[0.0; 2]; 4]; 28],
            parts: (0..7)
                .map(|i| Part { name: part::ALL[i].into(), vertices: 9 * i..9 * i + 9, quads: 4 * i..4 * i + 4 })
                .collect(),
            identity: IdentityClass { components: 0, basis: Vec::new() },
            keys: vec![key("eyeBlinkLeft", 0.004), key("jawOpen", 0.01), key("mouthClose", -0.01)],
            mirror: (0..63).collect(),
            cavity: vec![false; 63],
            anchors: Vec::new(),
            lid_contacts: [vec![[4, 7]], vec![]],
            lip_contacts: vec![[5, 8]],
        }
    }

    fn posed(positions: &[Vec3], keys: &[&Key]) -> Vec<Vec3> {
        let mut posed = positions.to_vec();
        keys.iter().flat_map(|k| &k.offsets).for_each(|(v, d)| posed[*v as usize] += d);
        posed
    }

    fn named<'a>(keys: &'a [Key], name: &str) -> &'a Key {
        keys.iter().find(|k| k.name == name).unwrap()
    }

    /// How far the gap between two vertices is from the generic head's gap, taken to the person.
    fn lack(transfer: &KeyTransfer, [a, b]: &[u32; 2], given: &[Vec3], here: &[Vec3]) -> f64 {
        let gap = |p: &[Vec3]| p[*a as usize] - p[*b as usize];
        (transfer.locals[*a as usize].linear * gap(given) - gap(here)).norm()
    }

    fn largest_difference(a: &[Key], b: &[Key]) -> f64 {
        let differences = a.iter().zip(b).flat_map(|(a, b)| {
            assert_eq!((a.name.as_str(), a.offsets.len()), (b.name.as_str(), b.offsets.len()));
            a.offsets.iter().zip(&b.offsets).map(|(x, y)| {
                assert_eq!(x.0, y.0);
                (x.1 - y.1).norm()
            })
        });
        differences.fold(0.0, f64::max)
    }

    #[test]
    fn a_person_equal_to_the_generic_head_gets_its_very_keys() {
        for generic in asset().into_iter().chain([toy_head()]) {
            let keys = KeyTransfer::new(&generic, &generic.positions).unwrap().keys().unwrap();
            assert!(largest_difference(&keys, &generic.keys) < 1e-9);
        }
    }

    #[test]
    fn a_larger_head_moves_by_as_much_more() {
        let Some(generic) = asset() else { return };
        let larger: Vec<Vec3> = generic.positions.iter().map(|p| p * 1.1).collect();
        let keys = KeyTransfer::new(&generic, &larger).unwrap().keys().unwrap();
        let scaled: Vec<Key> = generic
            .keys
            .iter()
            .map(|k| Key { name: k.name.clone(), offsets: k.offsets.iter().map(|(v, d)| (*v, d * 1.1)).collect() })
            .collect();
        // The room kept from the eyeball is a length, and doesn't grow.
        assert!(largest_difference(&keys, &scaled) < 1e-4, "{}", largest_difference(&keys, &scaled));
    }

    #[test]
    fn lids_of_other_people_close_outside_their_eyeballs() {
        let Some(generic) = asset() else { return };
        for seed in 0..3 {
            let person = with_eyes(&generic, seed, 1.0 + 0.1 * seed as f64, 6e-4 * seed as f64);
            let transfer = KeyTransfer::new(&generic, &person).unwrap();
            let keys = transfer.keys().unwrap();
            for (side, name) in [(0, "eyeBlinkLeft"), (1, "eyeBlinkRight")] {
                let (key, own) = (named(&generic.keys, name), named(&keys, name));
                let (given, closed) = (posed(&generic.positions, &[key]), posed(&person, &[own]));
                for pair in &generic.lid_contacts[side] {
                    let lack = lack(&transfer, pair, &given, &closed);
                    assert!(lack < 2e-4, "seed {seed} {name}: {pair:?} {lack}");
                }
                let eye = generic.part([part::EYE_LEFT, part::EYE_RIGHT][side]).unwrap();
                let (there, here) = (Ball::new(&generic.positions, eye), Ball::new(&person, eye));
                for (v, _) in own.offsets.iter().filter(|o| generic.skin().vertices.contains(&(o.0 as usize))) {
                    let v = *v as usize;
                    if !generic.cavity[v] && there.clearance(&given[v]) > 0.0 {
                        assert!(
                            here.clearance(&closed[v]) > -1e-4,
                            "seed {seed} {name} {v} {}",
                            here.clearance(&closed[v])
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn lips_of_other_people_meet_when_the_jaw_is_down() {
        let Some(generic) = asset() else { return };
        for seed in 0..3 {
            let person = with_eyes(&generic, seed, 1.2, 6e-4 * seed as f64);
            let transfer = KeyTransfer::new(&generic, &person).unwrap();
            let keys = transfer.keys().unwrap();
            let both = |keys: &'_ [Key], p: &[Vec3]| posed(p, &[named(keys, "jawOpen"), named(keys, "mouthClose")]);
            let (given, closed) = (both(&generic.keys, &generic.positions), both(&keys, &person));
            for pair in &generic.lip_contacts {
                let lack = lack(&transfer, pair, &given, &closed);
                assert!(lack < 2e-4, "seed {seed}: {pair:?} {lack}");
            }
        }
    }

    #[test]
    fn nothing_is_torn() {
        let Some(generic) = asset() else { return };
        let edges = mesh::quad_edges(&generic.quads[generic.skin().quads.clone()]);
        let mut worst: f64 = 0.0;
        for seed in 0..2 {
            let person = with_eyes(&generic, seed, 1.5, 6e-4 * seed as f64);
            let keys = KeyTransfer::new(&generic, &person).unwrap().keys().unwrap();
            let scale = |a: usize, b: usize| {
                ((person[a] - person[b]).norm() / (generic.positions[a] - generic.positions[b]).norm()).max(1.0)
            };
            for (key, own) in generic.keys.iter().zip(&keys) {
                let (given, here) = (posed(&generic.positions, &[key]), posed(&person, &[own]));
                for &[a, b] in &edges {
                    let (a, b) = (a as usize, b as usize);
                    if generic.cavity[a] || generic.cavity[b] {
                        continue;
                    }
                    let length = |p: &[Vec3]| (p[a] - p[b]).norm();
                    // On the person an edge may change by as much more as it is longer, and half as much again.
                    let usual = (length(&given) - length(&generic.positions)).abs() * scale(a, b);
                    worst = worst.max((length(&here) - length(&person)).abs() - 1.5 * usual);
                }
            }
        }
        assert!(worst < 3.5e-3, "an edge changes by {worst} m too much");
    }

    #[test]
    fn teeth_stay_rigid_and_eyes_turn_about_their_centres() {
        let Some(generic) = asset() else { return };
        let person = with_eyes(&generic, 3, 1.2, 6e-4);
        let keys = KeyTransfer::new(&generic, &person).unwrap().keys().unwrap();
        let teeth = generic.part(part::TEETH_LOWER).unwrap().vertices.clone();
        let opened = posed(&person, &[named(&keys, "jawOpen")]);
        for (a, b) in teeth.clone().zip(teeth.skip(1)) {
            let (rest, moved) = ((person[a] - person[b]).norm(), (opened[a] - opened[b]).norm());
            assert!((rest - moved).abs() < 0.03 * rest + 1e-5, "{rest} {moved}");
        }
        let eye = generic.part(part::EYE_LEFT).unwrap();
        let (before, after) =
            (Ball::new(&person, eye), Ball::new(&posed(&person, &[named(&keys, "eyeLookOutLeft")]), eye));
        assert!((before.centre - after.centre).norm() < 2e-5 && (before.radius - after.radius).abs() < 2e-5);
    }

    #[test]
    fn another_topology_and_rubbish_are_refused() {
        let generic = toy_head();
        assert!(matches!(KeyTransfer::new(&generic, &generic.positions[1..]), Err(HeadError::Topology { .. })));
        let mut broken = generic.positions.clone();
        broken[3].x = f64::NAN;
        assert!(matches!(KeyTransfer::new(&generic, &broken), Err(HeadError::Degenerate { .. })));
    }
}
