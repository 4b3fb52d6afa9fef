//! The generic head: one mesh of several parts, everything that is known about it.

use geometry::{Vec2, Vec3, mesh};
use std::ops::Range;

/// Names of the parts, in the order in which a [`GenericHead`] holds them.
pub mod part {
    /// Skin with mouth bag, sockets and nostrils: closed but for the neck.
    pub const SKIN: &str = "skin";
    /// The subject's left eyeball.
    pub const EYE_LEFT: &str = "eye_left";
    /// The subject's right eyeball.
    pub const EYE_RIGHT: &str = "eye_right";
    /// Upper teeth.
    pub const TEETH_UPPER: &str = "teeth_upper";
    /// Lower teeth.
    pub const TEETH_LOWER: &str = "teeth_lower";
    /// Tongue.
    pub const TONGUE: &str = "tongue";
    /// Lashes of both eyes.
    pub const LASHES: &str = "lashes";
    /// All of them, in order.
    pub const ALL: [&str; 7] = [SKIN, EYE_LEFT, EYE_RIGHT, TEETH_UPPER, TEETH_LOWER, TONGUE, LASHES];
}

/// A run of vertices and quads that belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// One of [`part::ALL`].
    pub name: String,
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its quads; they use its own vertices only.
    pub quads: Range<usize>,
}

/// A linear class of heads: `positions = mean + Σ coefficient_j basis_j`, coefficients in standard deviations of the class.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentityClass {
    /// Number of components `k`, most important first.
    pub components: usize,
    /// `k × n × 3` metres per standard deviation, component by component, vertex by vertex.
    pub basis: Vec<f32>,
}

/// An expression key: what it adds to each vertex it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// ARKit name, `eyeBlinkLeft` … `tongueOut`.
    pub name: String,
    /// Moved vertices, ascending, with their offsets in metres.
    pub offsets: Vec<(u32, Vec3)>,
}

/// Where a landmark of the 468-point net sits on the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Vertices of the triangle it lies in.
    pub triangle: [u32; 3],
    /// Barycentric weights there.
    pub weights: [f64; 3],
    /// Standard deviation of the net's idea of this point along the skin, over people and views, metres.
    pub sigma: f64,
}

/// The generic head. Positions are the class's mean: an average adult.
#[derive(Clone, Debug, PartialEq)]
pub struct GenericHead {
    /// All vertices, part after part; head frame, metres.
    pub positions: Vec<Vec3>,
    /// Quads, counter-clockwise seen from outside, part after part.
    pub quads: Vec<[u32; 4]>,
    /// Texture coordinates of each quad's corners, u right, v up, 0…1. Skin has its own map; eyes share one;
    /// teeth, tongue and lashes lie in the skin map's mouth corner or have plain colours.
    pub uvs: Vec<[[f32; 2]; 4]>,
    /// Parts in the order of [`part::ALL`].
    pub parts: Vec<Part>,
    /// Identity class over all vertices.
    pub identity: IdentityClass,
    /// The 52 ARKit keys in their usual order.
    pub keys: Vec<Key>,
    /// The vertex on the other side of the head, for every vertex.
    pub mirror: Vec<u32>,
    /// Vertices of the skin that hardly any direction sees: mouth bag, sockets, insides of the nostrils.
    pub cavity: Vec<bool>,
    /// Anchors of the 468 landmarks.
    pub anchors: Vec<Anchor>,
    /// Pairs of upper and lower lid vertices that meet when `eyeBlink*` is 1: `[left, right]` eye.
    pub lid_contacts: [Vec<[u32; 2]>; 2],
    /// Pairs of upper and lower lip vertices that touch at rest.
    pub lip_contacts: Vec<[u32; 2]>,
}

impl GenericHead {
    /// The part of a name; `None` for a name that is not in [`part::ALL`].
    pub fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|p| p.name == name)
    }

    /// The skin: always there, checked when the head is read.
    pub fn skin(&self) -> &Part {
        &self.parts[0]
    }

    /// Triangles of a part, `2i` and `2i + 1` from its quad `i`.
    pub fn triangles(&self, part: &Part) -> Vec<[u32; 3]> {
        mesh::triangulate(&self.quads[part.quads.clone()])
    }

    /// Texture coordinates of the corners of a part's triangles, in their order, `v` up.
    pub fn triangle_uvs(&self, part: &Part) -> Vec<[Vec2; 3]> {
        let corner = |uv: &[[f32; 2]; 4], k: usize| Vec2::new(f64::from(uv[k][0]), f64::from(uv[k][1]));
        let quads = self.uvs[part.quads.clone()].iter();
        quads.flat_map(|uv| [[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|k| corner(uv, k)))).collect()
    }

    /// Triangles of the skin that can be seen from outside: without the cavities of mouth, nose and eyes.
    pub fn outer_skin(&self) -> Vec<[u32; 3]> {
        let outside = |t: &[u32; 3]| t.iter().all(|&i| !self.cavity[i as usize]);
        self.triangles(self.skin()).into_iter().filter(outside).collect()
    }

    /// The key of a name.
    pub fn key(&self, name: &str) -> Option<&Key> {
        self.keys.iter().find(|k| k.name == name)
    }

    /// Positions of a member of the class; missing coefficients are zero, surplus ones are ignored.
    pub fn with_identity(&self, coefficients: &[f64]) -> Vec<Vec3> {
        let mut positions = self.positions.clone();
        let n = positions.len();
        for (component, &c) in self.identity.basis.chunks_exact(3 * n).zip(coefficients) {
            if c != 0.0 {
                for (p, b) in positions.iter_mut().zip(component.chunks_exact(3)) {
                    *p += Vec3::new(f64::from(b[0]), f64::from(b[1]), f64::from(b[2])) * c;
                }
            }
        }
        positions
    }

    /// Landmark positions (468) on a mesh of this topology.
    pub fn landmarks(&self, positions: &[Vec3]) -> Vec<Vec3> {
        self.anchors.iter().map(|a| mesh::at_barycentric(positions, &a.triangle, &a.weights)).collect()
    }

    /// What an expression adds to the landmarks: one weight per key, in their order.
    pub fn landmark_offsets(&self, weights: &[f64]) -> Vec<Vec3> {
        self.landmarks(&self.with_expression(&vec![Vec3::zeros(); self.positions.len()], weights))
    }

    /// Positions with an expression added: one weight per key, in their order.
    pub fn with_expression(&self, positions: &[Vec3], weights: &[f64]) -> Vec<Vec3> {
        let mut moved = positions.to_vec();
        for (key, &weight) in self.keys.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            key.offsets.iter().for_each(|(vertex, offset)| moved[*vertex as usize] += offset * weight);
        }
        moved
    }
}
