//! Another mesh in the place of a part.

use super::Reconstruction;
use geometry::Vec3;

/// A part's mesh, its vertices counted from its own first.
pub struct PartShape {
    /// The person's vertices at rest, head frame, metres.
    pub positions: Vec<Vec3>,
    /// The generic head's.
    pub generic_positions: Vec<Vec3>,
    /// Its quads.
    pub quads: Vec<[u32; 4]>,
    /// Texture coordinates per quad corner, v up.
    pub uvs: Vec<[[f32; 2]; 4]>,
    /// What each key of the head adds: vertices, ascending, with their offsets.
    pub keys: Vec<Vec<(u32, Vec3)>>,
}

impl Reconstruction {
    /// Gives the part of a name another mesh. What the keys did to the one before is gone; the parts behind it are as they were,
    /// with their vertices and quads counted anew. A name that no part has changes nothing.
    pub(crate) fn replace_part(&mut self, name: &str, shape: PartShape) {
        let Some(index) = self.parts.iter().position(|p| p.name == name) else { return };
        let (vertices, quads) = (self.parts[index].vertices.clone(), self.parts[index].quads.clone());
        let (vertex_end, quad_end) = (vertices.start + shape.positions.len(), quads.start + shape.quads.len());
        let first = vertices.start as u32;
        let behind = |i: u32| (i as usize >= vertices.end).then(|| i - vertices.end as u32 + vertex_end as u32);
        for (key, own) in self.keys.iter_mut().zip(shape.keys) {
            let (before, rest): (Vec<_>, Vec<_>) = key.offsets.iter().copied().partition(|(i, _)| *i < first);
            let rest = rest.into_iter().filter_map(|(i, d)| Some((behind(i)?, d)));
            key.offsets = before.into_iter().chain(own.into_iter().map(|(i, d)| (first + i, d))).chain(rest).collect();
        }
        self.quads.iter_mut().flatten().for_each(|i| *i = behind(*i).unwrap_or(*i));
        self.quads.splice(quads.clone(), shape.quads.iter().map(|quad| quad.map(|i| first + i)));
        self.uvs.splice(quads.clone(), shape.uvs);
        self.positions.splice(vertices.clone(), shape.positions);
        self.generic_positions.splice(vertices.clone(), shape.generic_positions);
        for part in &mut self.parts[index + 1..] {
            part.vertices =
                part.vertices.start - vertices.end + vertex_end..part.vertices.end - vertices.end + vertex_end;
            part.quads = part.quads.start - quads.end + quad_end..part.quads.end - quads.end + quad_end;
        }
        (self.parts[index].vertices, self.parts[index].quads) = (vertices.start..vertex_end, quads.start..quad_end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Report;
    use head::{Key, Part, part};
    use image::RgbaImage;

    /// Three squares; one key moves a corner of each.
    fn three() -> Reconstruction {
        let names = [part::SKIN, part::EYE_LEFT, part::TONGUE].into_iter().enumerate();
        let place = |i: u32| Vec3::new(f64::from(i), 0.0, 0.0);
        Reconstruction {
            positions: (0..12).map(place).collect(),
            generic_positions: (0..12).map(place).collect(),
            quads: [0, 4, 8].map(|i| [i, i + 1, i + 2, i + 3]).to_vec(),
            uvs: [0.0, 0.1, 0.2].map(|u| [[u, 0.0]; 4]).to_vec(),
            parts: names
                .map(|(i, name)| Part { name: name.to_owned(), vertices: 4 * i..4 * i + 4, quads: i..i + 1 })
                .collect(),
            keys: vec![Key { name: "jawOpen".to_owned(), offsets: [1, 5, 9].map(|i| (i, place(i))).to_vec() }],
            texture: RgbaImage::new(1, 1),
            eyes: RgbaImage::new(1, 1),
            truth: None,
            relief: None,
            report: Report::empty(),
        }
    }

    fn six() -> PartShape {
        PartShape {
            positions: vec![Vec3::y(); 6],
            generic_positions: vec![Vec3::z(); 6],
            quads: vec![[0, 1, 2, 3], [2, 3, 4, 5]],
            uvs: vec![[[0.5, 0.5]; 4]; 2],
            keys: vec![vec![(4, Vec3::z())]],
        }
    }

    #[test]
    fn every_part_keeps_its_vertices_and_quads_when_one_before_it_grows() {
        let mut head = three();
        head.replace_part(part::EYE_LEFT, six());
        let spans: Vec<_> = head.parts.iter().map(|p| (p.vertices.clone(), p.quads.clone())).collect();
        assert_eq!(spans, [(0..4, 0..1), (4..10, 1..3), (10..14, 3..4)]);
        for part in &head.parts {
            assert!(head.quads[part.quads.clone()].iter().flatten().all(|&i| part.vertices.contains(&(i as usize))));
        }
        assert_eq!((head.quads[2], head.uvs[2][0], head.uvs[3][0]), ([6, 7, 8, 9], [0.5, 0.5], [0.2, 0.0]));
        assert_eq!((head.positions[9], head.generic_positions[9], head.positions[10].x), (Vec3::y(), Vec3::z(), 8.0));
    }

    #[test]
    fn keys_lose_what_they_did_to_the_part_and_nothing_else() {
        let mut head = three();
        head.replace_part(part::EYE_LEFT, six());
        let moved = |i: f64| Vec3::new(i, 0.0, 0.0);
        assert_eq!(head.keys[0].offsets, [(1, moved(1.0)), (8, Vec3::z()), (11, moved(9.0))]);
    }
}
