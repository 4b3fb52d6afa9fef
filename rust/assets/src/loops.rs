//! Closed edge loops of quad meshes.
//!
//! # Entry points
//! [`Loops::new`], [`Loops::through`].
//!
//! At a vertex of four edges a loop goes on along the edge that shares no face with the one it came by.

use std::collections::BTreeMap;

/// An undirected edge, lower vertex first.
pub type Edge = [u32; 2];

/// Edges, faces and vertices of a quad mesh, ready for walking.
pub struct Loops {
    faces_of_edge: BTreeMap<Edge, Vec<usize>>,
    edges_of_vertex: BTreeMap<u32, Vec<Edge>>,
}

/// The four edges of a quad.
pub fn edges(quad: &[u32; 4]) -> [Edge; 4] {
    [0, 1, 2, 3].map(|k| edge(quad[k], quad[(k + 1) % 4]))
}

/// The edge between two vertices.
pub fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

impl Loops {
    /// Indexes a mesh.
    pub fn new<'a>(quads: impl Iterator<Item = &'a [u32; 4]>) -> Self {
        let mut faces_of_edge: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
        for (i, quad) in quads.enumerate() {
            for edge in edges(quad) {
                faces_of_edge.entry(edge).or_default().push(i);
            }
        }
        let mut edges_of_vertex: BTreeMap<u32, Vec<Edge>> = BTreeMap::new();
        for edge in faces_of_edge.keys() {
            edge.iter().for_each(|&v| edges_of_vertex.entry(v).or_default().push(*edge));
        }
        Self { faces_of_edge, edges_of_vertex }
    }

    /// Faces that share an edge, as numbered in the list given.
    pub fn faces(&self, edge: &Edge) -> &[usize] {
        self.faces_of_edge.get(edge).map_or(&[], Vec::as_slice)
    }

    /// The closed loop of a given length through a vertex: its vertices in order; `None` when there is none.
    pub fn through(&self, vertex: u32, length: usize) -> Option<Vec<u32>> {
        let starts = self.edges_of_vertex.get(&vertex)?;
        starts.iter().filter_map(|start| self.walk(*start, vertex)).find(|found| found.len() == length)
    }

    fn walk(&self, start: Edge, vertex: u32) -> Option<Vec<u32>> {
        let (mut edge, mut walked) = (start, vec![vertex]);
        loop {
            let last = walked[walked.len() - 1];
            let next = if edge[0] == last { edge[1] } else { edge[0] };
            if next == vertex {
                return Some(walked);
            }
            let around = self.edges_of_vertex.get(&next).filter(|e| e.len() == 4)?;
            let apart = |e: &&Edge| !self.faces(e).iter().any(|f| self.faces(&edge).contains(f));
            edge = *around.iter().find(apart)?;
            walked.push(next);
            if walked.len() > self.edges_of_vertex.len() {
                return None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube of 3 × 5 quads; ring `r` begins at vertex `5 r`.
    fn tube() -> Vec<[u32; 4]> {
        (0..15).map(|i| (i / 5 * 5, i % 5, (i + 1) % 5)).map(|(r, k, n)| [r + k, r + n, r + 5 + n, r + 5 + k]).collect()
    }

    #[test]
    fn a_ring_of_a_tube_is_a_loop() {
        let quads = tube();
        assert_eq!(Loops::new(quads.iter()).through(7, 5).map(|v| v.len()), Some(5));
        assert!(Loops::new(quads.iter()).through(7, 6).is_none());
        assert!(Loops::new(quads.iter()).through(99, 5).is_none());
    }

    #[test]
    fn inner_edges_have_two_faces_and_rims_one() {
        let quads = tube();
        let loops = Loops::new(quads.iter());
        assert_eq!((loops.faces(&edge(6, 5)).len(), loops.faces(&edge(0, 1)).len()), (2, 1));
    }
}
