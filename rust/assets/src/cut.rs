//! Cuts the head off the base mesh along one clean edge loop of the neck, and gathers its parts.
//!
//! # Entry point
//! [`Cut::new`].
//!
//! A cut by bone weights leaves a jagged rim; walking the edge loop through one known vertex leaves 42 even edges.

use crate::anny::{Base, Face, Target};
use crate::loops::{Edge, Loops, edge, edges};
use anyhow::Context;
use geometry::Vec3;
use head::{Part, part};
use std::collections::{BTreeMap, BTreeSet};

/// A vertex of the loop at the base of the neck.
const NECK_VERTEX: u32 = 1460;
/// Edges of that loop.
pub const NECK_EDGES: usize = 42;
/// Groups of the base mesh that make each part.
const SOURCES: [(&str, &[&str]); 7] = [
    (part::SKIN, &["body"]),
    (part::EYE_LEFT, &["helper-l-eye"]),
    (part::EYE_RIGHT, &["helper-r-eye"]),
    (part::TEETH_UPPER, &["helper-upper-teeth"]),
    (part::TEETH_LOWER, &["helper-lower-teeth"]),
    (part::TONGUE, &["helper-tongue"]),
    (part::LASHES, &["helper-l-eyelashes-1", "helper-l-eyelashes-2", "helper-r-eyelashes-1", "helper-r-eyelashes-2"]),
];

/// The head as a selection of the base mesh.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Base vertex of each head vertex; ascending within a part.
    pub base_vertices: Vec<u32>,
    /// Quads over head vertices, part after part.
    pub quads: Vec<[u32; 4]>,
    /// The package's own texture coordinates of each quad's corners.
    pub uvs: Vec<[[f32; 2]; 4]>,
    /// Parts in the order of [`part::ALL`].
    pub parts: Vec<Part>,
    head_of_base: BTreeMap<u32, u32>,
}

impl Cut {
    /// Cuts the head off.
    ///
    /// # Errors
    /// When the mesh has no such neck loop or lacks a group.
    pub fn new(base: &Base) -> anyhow::Result<Self> {
        let mut cut = Self {
            base_vertices: Vec::new(),
            quads: Vec::new(),
            uvs: Vec::new(),
            parts: Vec::new(),
            head_of_base: BTreeMap::new(),
        };
        for (name, groups) in SOURCES {
            let mut faces = Vec::new();
            for group in groups {
                faces.extend_from_slice(base.groups.get(*group).with_context(|| format!("no group {group}"))?);
            }
            if name == part::SKIN {
                faces = above_neck(&faces, &base.positions)?;
            }
            cut.append(name, &faces, base);
        }
        Ok(cut)
    }

    fn append(&mut self, name: &str, faces: &[Face], base: &Base) {
        let (first_vertex, first_quad) = (self.base_vertices.len(), self.quads.len());
        let used: BTreeSet<u32> = faces.iter().flat_map(|f| f.vertices).collect();
        for vertex in used {
            self.head_of_base.insert(vertex, self.base_vertices.len() as u32);
            self.base_vertices.push(vertex);
        }
        self.quads.extend(faces.iter().map(|f| f.vertices.map(|v| self.head_of_base[&v])));
        self.uvs.extend(faces.iter().map(|f| f.texture.map(|t| base.texture[t as usize])));
        self.parts.push(Part {
            name: name.to_owned(),
            vertices: first_vertex..self.base_vertices.len(),
            quads: first_quad..self.quads.len(),
        });
    }

    /// The head vertex of a base vertex; `None` for one that is cut off.
    pub fn vertex(&self, base_vertex: u32) -> Option<u32> {
        self.head_of_base.get(&base_vertex).copied()
    }

    /// The head's vertices of a base position list.
    pub fn positions(&self, base: &[Vec3]) -> Vec<Vec3> {
        self.base_vertices.iter().map(|&v| base[v as usize]).collect()
    }

    /// A target restricted to the head, over head vertices, ascending.
    pub fn restrict(&self, target: &Target) -> Target {
        let inside = target.iter().filter_map(|&(v, d)| Some((*self.head_of_base.get(&v)?, d)));
        let mut restricted: Target = inside.collect();
        restricted.sort_unstable_by_key(|&(v, _)| v);
        restricted
    }
}

/// The body's faces above the neck loop: those reached from the top of the skull without crossing it.
fn above_neck(faces: &[Face], positions: &[Vec3]) -> anyhow::Result<Vec<Face>> {
    let loops = Loops::new(faces.iter().map(|f| &f.vertices));
    let neck = loops.through(NECK_VERTEX, NECK_EDGES).context("no loop of 42 edges runs round the neck")?;
    let rim: BTreeSet<Edge> = (0..NECK_EDGES).map(|k| edge(neck[k], neck[(k + 1) % NECK_EDGES])).collect();
    let height = |face: &Face| face.vertices.iter().map(|&v| positions[v as usize].y).fold(f64::MIN, f64::max);
    let top = (0..faces.len()).max_by(|&a, &b| height(&faces[a]).total_cmp(&height(&faces[b])));
    let mut open = vec![top.context("the body has no faces")?];
    let mut kept = BTreeSet::from([open[0]]);
    while let Some(face) = open.pop() {
        for edge in edges(&faces[face].vertices).iter().filter(|edge| !rim.contains(*edge)) {
            open.extend(loops.faces(edge).iter().filter(|&&next| kept.insert(next)));
        }
    }
    Ok(kept.iter().map(|&i| faces[i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube of `rings` rings of 42 quads, standing upright; ring `r` begins at vertex `42 r`.
    fn tube(rings: u32) -> (Vec<Face>, Vec<Vec3>) {
        let position = |i: u32| {
            let angle = f64::from(i % 42) * std::f64::consts::TAU / 42.0;
            Vec3::new(angle.cos(), f64::from(i / 42), angle.sin())
        };
        let face = |i: u32| {
            let (r, k, next) = (i / 42, i % 42, (i + 1) % 42);
            let vertices = [42 * r + k, 42 * r + next, 42 * (r + 1) + next, 42 * (r + 1) + k];
            Face { vertices, texture: [0; 4] }
        };
        ((0..42 * (rings - 1)).map(face).collect(), (0..42 * rings).map(position).collect())
    }

    #[test]
    fn a_tube_is_cut_along_the_ring_of_the_neck_vertex() {
        let (faces, positions) = tube(60);
        let kept = above_neck(&faces, &positions).unwrap();
        let ring = NECK_VERTEX / 42;
        assert_eq!(kept.len() as u32, 42 * (59 - ring));
        assert!(kept.iter().flat_map(|f| f.vertices).all(|v| v / 42 >= ring));
    }

    #[test]
    fn a_body_without_that_loop_is_refused() {
        let (faces, positions) = tube(20);
        assert!(above_neck(&faces, &positions).is_err());
    }
}
