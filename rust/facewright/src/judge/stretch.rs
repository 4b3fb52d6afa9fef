//! How far the skin is stretched against the generic head, region by region, and where its ears are.

use crate::head::regions::Region;
use geometry::{Similarity, Vec3};
use head::GenericHead;

/// Of a region's area, so much is stretched less than its measure says.
const SHARE: f64 = 0.99;

/// The person's skin laid onto the generic head's.
pub struct Stretch<'a> {
    head: &'a GenericHead,
    regions: &'a [Option<Region>],
    triangles: Vec<[u32; 3]>,
    /// The person's vertices where the generic head's are, metres.
    laid: Vec<Vec3>,
}

impl<'a> Stretch<'a> {
    /// Lays a person's head onto the generic one, by face and skull; `None` where it has no size.
    pub fn new(head: &'a GenericHead, regions: &'a [Option<Region>], positions: &[Vec3]) -> Option<Self> {
        let holds = |region: &Region| !matches!(region, Region::Ears | Region::Neck);
        let fixed: Vec<usize> = (0..regions.len()).filter(|&v| regions[v].as_ref().is_some_and(holds)).collect();
        let at = |places: &[Vec3]| fixed.iter().map(|&v| places[v]).collect::<Vec<_>>();
        let onto = Similarity::fit(&at(positions), &at(&head.positions), None, true)?;
        let laid = positions[..regions.len()].iter().map(|p| onto.apply(p)).collect();
        Some(Self { head, regions, triangles: head.outer_skin(), laid })
    }

    fn of_region(&self, wanted: impl Fn(Region) -> bool) -> impl Iterator<Item = [usize; 3]> {
        let all = self.triangles.iter().map(|t| t.map(|i| i as usize));
        all.filter(move |t| t.iter().all(|&v| self.regions[v].is_some_and(&wanted)))
    }

    /// How many times longer or shorter than the generic head's edges those of a region are, but for a hundredth of its area.
    pub fn of(&self, wanted: impl Fn(Region) -> bool) -> f64 {
        let one = |t: [usize; 3]| (self.fold(&t), cross(&self.head.positions, &t).norm());
        let mut all: Vec<(f64, f64)> = self.of_region(wanted).map(one).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (total, mut sum): (f64, f64) = (all.iter().map(|(_, area)| area).sum(), 0.0);
        let at = all.iter().find(|(_, area)| {
            sum += area;
            sum >= SHARE * total
        });
        at.map_or(1.0, |(fold, _)| *fold)
    }

    /// The most stretched or squeezed edge of a triangle.
    fn fold(&self, t: &[usize; 3]) -> f64 {
        let length = |places: &[Vec3], k: usize| (places[t[k]] - places[t[(k + 1) % 3]]).norm();
        let ratio = |k: usize| length(&self.laid, k) / length(&self.head.positions, k).max(1e-9);
        (0..3).map(ratio).map(|r| r.max(1.0 / r.max(1e-9))).fold(1.0, f64::max)
    }

    /// Area of the generic head's triangles that are turned over on the person's, lids and lips aside, square metres.
    pub fn flipped(&self) -> f64 {
        let turned = |t: &[usize; 3]| cross(&self.head.positions, t).dot(&cross(&self.laid, t)) < 0.0;
        let flipped = self.of_region(|region| region != Region::Features).filter(turned);
        flipped.map(|t| cross(&self.head.positions, &t).norm() / 2.0).sum::<f64>().abs()
    }

    /// How far an ear is from where the generic head has it: the worse of both, metres.
    pub fn ears(&self) -> f64 {
        let shift = |v: usize| self.laid[v] - self.head.positions[v];
        let side = |sign: f64| {
            let own = |v: &usize| self.regions[*v] == Some(Region::Ears) && sign * self.head.positions[*v].x > 0.0;
            let ear: Vec<usize> = (0..self.regions.len()).filter(own).collect();
            ear.iter().map(|&v| shift(v)).sum::<Vec3>().norm() / ear.len().max(1) as f64
        };
        side(1.0).max(side(-1.0))
    }
}

fn cross(places: &[Vec3], t: &[usize; 3]) -> Vec3 {
    (places[t[1]] - places[t[0]]).cross(&(places[t[2]] - places[t[0]]))
}
