//! Where the sheet is cut: the middle line, the loop behind the lips, and the four sides of each half island.
//!
//! The head is symmetric, so only its half with x ≥ 0 is flattened; the mirror map gives the other half. The middle line
//! is found by walking the vertices that are their own mirror image from the front of the neck to its back. Every quad
//! loop that leaves the middle line and comes back to it is known by its two indices there; those round the mouth are
//! nested, and the one whose ends lie closest together is where the lips touch.

use super::{Sheet, UnwrapError};
use geometry::mesh;
use std::collections::{BTreeMap, BTreeSet};

/// One half of an island, flattened onto a rectangle.
#[derive(Clone, Debug)]
pub(super) struct Half {
    /// Sheet vertex of each local vertex.
    pub vertices: Vec<u32>,
    /// Sheet quad of each local quad.
    pub faces: Vec<usize>,
    /// Local quads.
    pub quads: Vec<[u32; 4]>,
    /// Chains along the rectangle's sides, corners in both neighbours: left (down), bottom (right), right (up), top (left).
    pub sides: [Vec<u32>; 4],
    /// Local vertices of a slit, top end first and round to the bottom end; empty without one.
    pub slit: Vec<u32>,
}

/// Both islands: the face with cranium, ears and neck, and the mouth bag.
pub(super) struct Islands {
    /// Everything outside the loop behind the lips.
    pub face: Half,
    /// Everything behind it.
    pub mouth: Half,
    /// Sheet vertices where the lips touch, x ≥ 0, from the upper lip's middle to the lower lip's.
    pub lips: Vec<u32>,
}

/// Cuts the sheet behind the lips by `lip_rings` quad rings, and along the back from the top of the skull to the neck;
/// `corner_share` of that seam is the top of the map, the rest its side.
pub(super) fn cut(sheet: &Sheet, lip_rings: usize, corner_share: f64) -> Result<Islands, UnwrapError> {
    let topology = Topology::new(sheet);
    let middle = topology.middle_line(sheet)?;
    let MouthLoops { lips, slit, ends } = topology.mouth_loops(sheet, &middle, lip_rings)?;
    let crown = highest(sheet, &middle);
    let half: Vec<usize> = (0..sheet.quads.len()).filter(|&q| on_left(sheet, q)).collect();
    let barrier: BTreeSet<[u32; 2]> = slit.windows(2).map(|e| edge(e[0], e[1])).collect();
    let outside = topology.flood(&half, middle[0], &barrier);
    let inside: Vec<usize> = half.iter().copied().filter(|q| outside.binary_search(q).is_err()).collect();
    if inside.is_empty() || crown <= ends[1] {
        return Err(UnwrapError::Mouth);
    }
    let neck = topology.neck(sheet, &middle)?;
    let back = &middle[crown..];
    let corner = split(sheet, back, corner_share);
    let left =
        [&middle[ends[1]..=crown], &middle[..=ends[0]]].map(|part| part.iter().rev().copied().collect::<Vec<_>>());
    let reversed = |chain: &[u32]| chain.iter().rev().copied().collect::<Vec<u32>>();
    let face_sides = [left.concat(), neck, reversed(&back[corner..]), reversed(&back[..=corner])];
    let bag: Vec<u32> = reversed(&middle[ends[0]..=ends[1]]);
    let lower_first = reversed(&slit);
    // The corners of the mouth take the middle fifth of the loop.
    let (a, b) = (lower_first.len() * 2 / 5, lower_first.len() * 3 / 5);
    let mouth_sides = [bag, lower_first[..=a].to_vec(), lower_first[a..=b].to_vec(), lower_first[b..].to_vec()];
    let face = Half::new(sheet, outside, &face_sides, &slit);
    Ok(Islands { face, mouth: Half::new(sheet, inside, &mouth_sides, &[]), lips })
}

impl Half {
    fn new(sheet: &Sheet, faces: Vec<usize>, sides: &[Vec<u32>; 4], slit: &[u32]) -> Self {
        let mut vertices: Vec<u32> = faces.iter().flat_map(|&q| sheet.quads[q]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        // Every listed vertex is one of its own: the search cannot miss.
        let local = |v: u32| vertices.binary_search(&v).unwrap_or(0) as u32;
        let chain = |side: &Vec<u32>| side.iter().map(|&v| local(v)).collect();
        let quads = faces.iter().map(|&q| sheet.quads[q].map(local)).collect();
        let (sides, slit) = ([0, 1, 2, 3].map(|k| chain(&sides[k])), slit.iter().map(|&v| local(v)).collect());
        Self { faces, quads, sides, slit, vertices }
    }

    /// Edges of the quads and across the slit.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges = mesh::quad_edges(&self.quads);
        edges.extend(self.slit_pairs().iter().map(|p| edge(p[0], p[1])));
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Quads that close the slit, counter-clockwise; the map keeps them open.
    pub fn slit_quads(&self) -> Vec<[u32; 4]> {
        self.slit_pairs().windows(2).map(|p| [p[0][1], p[1][1], p[1][0], p[0][0]]).collect()
    }

    /// Vertices across from each other on the slit, `[upper, lower]`, from the middle outwards.
    pub fn slit_pairs(&self) -> Vec<[u32; 2]> {
        let n = self.slit.len();
        (0..n / 2).map(|i| [self.slit[i], self.slit[n - 1 - i]]).collect()
    }
}

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn on_left(sheet: &Sheet, quad: usize) -> bool {
    sheet.quads[quad].iter().map(|&v| sheet.positions[v as usize].x).sum::<f64>() > 0.0
}

fn highest(sheet: &Sheet, middle: &[u32]) -> usize {
    let height = |i: &usize| sheet.positions[middle[*i] as usize].y;
    (0..middle.len()).max_by(|a, b| height(a).total_cmp(&height(b))).unwrap_or(0)
}

/// Index at a share of a chain's length, never at its ends.
fn split(sheet: &Sheet, chain: &[u32], share: f64) -> usize {
    let at = |v: u32| sheet.positions[v as usize];
    let mut lengths = vec![0.0];
    for pair in chain.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + (at(pair[1]) - at(pair[0])).norm());
    }
    let goal = share * lengths[lengths.len() - 1];
    lengths.iter().take_while(|&&l| l < goal).count().clamp(1, chain.len().saturating_sub(2).max(1))
}

/// Half loops around the mouth, from the middle line's upper end to its lower one.
struct MouthLoops {
    /// Where the lips touch.
    lips: Vec<u32>,
    /// Where to cut.
    slit: Vec<u32>,
    /// Indices of the cut's ends on the middle line.
    ends: [usize; 2],
}

/// Who touches whom on the sheet.
struct Topology {
    quads_at: BTreeMap<[u32; 2], Vec<usize>>,
    edges: Vec<Vec<u32>>,
}

impl Topology {
    fn new(sheet: &Sheet) -> Self {
        let mut quads_at: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (i, q) in sheet.quads.iter().enumerate() {
            for k in 0..4 {
                quads_at.entry(edge(q[k], q[(k + 1) % 4])).or_default().push(i);
            }
        }
        let list: Vec<[u32; 2]> = quads_at.keys().copied().collect();
        Self { edges: mesh::neighbours(sheet.positions.len(), &list), quads_at }
    }

    /// The vertices that are their own mirror image, from the front of the neck over face and skull to its back.
    fn middle_line(&self, sheet: &Sheet) -> Result<Vec<u32>, UnwrapError> {
        let own = |v: u32| sheet.mirror[v as usize] == v;
        let along = |v: u32| self.edges[v as usize].iter().copied().filter(move |&w| own(w));
        let all: Vec<u32> = (0..sheet.positions.len() as u32).filter(|&v| own(v)).collect();
        let forward = |v: &u32| sheet.positions[*v as usize].z;
        let ends = all.iter().copied().filter(|&v| along(v).count() == 1);
        let start = ends.max_by(|a, b| forward(a).total_cmp(&forward(b))).ok_or(UnwrapError::MiddleLine)?;
        let mut line = vec![start];
        while let Some(next) = along(line[line.len() - 1]).find(|v| !line.ends_with(&[*v]) && !line.contains(v)) {
            line.push(next);
        }
        let simple = all.iter().all(|&v| along(v).count() <= 2) && line.len() == all.len() && line.len() > 4;
        if simple { Ok(line) } else { Err(UnwrapError::MiddleLine) }
    }

    fn mouth_loops(&self, sheet: &Sheet, middle: &[u32], rings: usize) -> Result<MouthLoops, UnwrapError> {
        let index: BTreeMap<u32, usize> = middle.iter().enumerate().map(|(i, &v)| (v, i)).collect();
        let at = |i: usize| sheet.positions[middle[i] as usize];
        let mut loops: Vec<(usize, usize, Vec<u32>)> = Vec::new();
        for (i, &v) in middle.iter().enumerate() {
            let sideways = self.edges[v as usize].iter().find(|&&w| sheet.positions[w as usize].x > 1e-9);
            if let Some(path) = sideways.and_then(|&w| self.straight(v, w, &index)) {
                let j = index[&path[path.len() - 1]];
                // Written from the upper end down, once.
                if j > i + 1 {
                    loops.push((i, j, path.into_iter().rev().collect()));
                }
            }
        }
        let gap = |l: &&(usize, usize, Vec<u32>)| (at(l.1) - at(l.0)).norm();
        let touch = loops.iter().min_by(|a, b| gap(a).total_cmp(&gap(b))).ok_or(UnwrapError::Mouth)?;
        let (i, j) = (touch.0 + rings, touch.1.saturating_sub(rings));
        let slit = loops.iter().find(|l| l.0 == i && l.1 == j).ok_or(UnwrapError::Mouth)?;
        if slit.2.len() < 8 || slit.2.len() % 2 == 1 {
            // Odd loops would leave a triangle in the mouth's corner.
            return Err(UnwrapError::Mouth);
        }
        Ok(MouthLoops { lips: touch.2.clone(), slit: slit.2.clone(), ends: [i, j] })
    }

    /// Straight on through quad corners of valence four, until the middle line is met again.
    fn straight(&self, from: u32, to: u32, middle: &BTreeMap<u32, usize>) -> Option<Vec<u32>> {
        let mut path = vec![from, to];
        loop {
            let [before, here] = [path[path.len() - 2], path[path.len() - 1]];
            if middle.contains_key(&here) {
                return Some(path);
            }
            let ring = &self.edges[here as usize];
            let behind = &self.quads_at[&edge(before, here)];
            let beside = |w: u32| self.quads_at[&edge(here, w)].iter().any(|q| behind.contains(q));
            let mut ahead = ring.iter().copied().filter(|&w| w != before && !beside(w));
            let (next, other) = (ahead.next()?, ahead.next());
            if ring.len() != 4 || other.is_some() || path.len() > 1000 {
                return None;
            }
            path.push(next);
        }
    }

    /// Those of `quads` that are reached from a vertex without crossing the barrier, ascending.
    fn flood(&self, quads: &[usize], start: u32, barrier: &BTreeSet<[u32; 2]>) -> Vec<usize> {
        let allowed: BTreeSet<usize> = quads.iter().copied().collect();
        let corners: BTreeMap<usize, Vec<[u32; 2]>> = self.edges_of(&allowed);
        let mut reached: BTreeSet<usize> =
            corners.iter().filter(|(_, edges)| edges.iter().flatten().any(|&v| v == start)).map(|(&q, _)| q).collect();
        let mut queue: Vec<usize> = reached.iter().copied().collect();
        while let Some(q) = queue.pop() {
            for e in corners[&q].iter().filter(|e| !barrier.contains(*e)) {
                for &next in self.quads_at[e].iter().filter(|n| allowed.contains(n)) {
                    if reached.insert(next) {
                        queue.push(next);
                    }
                }
            }
        }
        reached.into_iter().collect()
    }

    fn edges_of(&self, quads: &BTreeSet<usize>) -> BTreeMap<usize, Vec<[u32; 2]>> {
        let mut edges: BTreeMap<usize, Vec<[u32; 2]>> = BTreeMap::new();
        for (e, at) in &self.quads_at {
            for q in at.iter().filter(|q| quads.contains(q)) {
                edges.entry(*q).or_default().push(*e);
            }
        }
        edges
    }

    /// The border with x ≥ 0 from the front end of the middle line to its back end.
    fn neck(&self, sheet: &Sheet, middle: &[u32]) -> Result<Vec<u32>, UnwrapError> {
        let border = |a: u32, b: u32| self.quads_at[&edge(a, b)].len() == 1;
        let mut chain = vec![middle[0]];
        let goal = middle[middle.len() - 1];
        while chain[chain.len() - 1] != goal {
            let here = chain[chain.len() - 1];
            let fits = |w: &&u32| border(here, **w) && !chain.contains(w) && sheet.positions[**w as usize].x > -1e-9;
            chain.push(*self.edges[here as usize].iter().find(fits).ok_or(UnwrapError::Neck)?);
        }
        Ok(chain)
    }
}
