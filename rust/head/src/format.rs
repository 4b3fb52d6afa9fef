//! The generic head as bytes: a gzipped safetensors archive, so that any language can read it.
//!
//! Lengths are quantised (identity 1/100 mm of each component's own scale, keys 1/100 mm, positions f32): the class's own
//! accuracy is a hundred times coarser, and the file is four times smaller.

use crate::generic::{Anchor, GenericHead, IdentityClass, Key, Part};
use crate::{HeadError, part};
use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use geometry::Vec3;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::HashMap;
use std::io::{Read, Write};

/// Raised whenever the meaning of a tensor changes.
const VERSION: &str = "1";
/// Quantum of keys, metres.
const KEY_QUANTUM: f64 = 1e-5;

impl GenericHead {
    /// Packs the head. Equal heads give equal bytes.
    pub fn to_bytes(&self) -> Result<Vec<u8>, HeadError> {
        let mut tensors = Tensors::default();
        tensors.f32("positions", &[self.positions.len(), 3], self.positions.iter().flat_map(|p| [p.x, p.y, p.z]));
        tensors.u32("quads", &[self.quads.len(), 4], self.quads.iter().flatten().copied());
        tensors.f32("uvs", &[self.uvs.len(), 8], self.uvs.iter().flatten().flatten().map(|&x| f64::from(x)));
        let ends = self.parts.iter().flat_map(|p| [p.vertices.end as u32, p.quads.end as u32]);
        tensors.u32("part_ends", &[self.parts.len(), 2], ends);
        self.pack_identity(&mut tensors);
        self.pack_keys(&mut tensors);
        tensors.u32("mirror", &[self.mirror.len()], self.mirror.iter().copied());
        tensors.u32("cavity", &[self.cavity.len()], self.cavity.iter().map(|&c| u32::from(c)));
        let anchors = &self.anchors;
        tensors.u32("anchor_triangles", &[anchors.len(), 3], anchors.iter().flat_map(|a| a.triangle));
        let weights = anchors.iter().flat_map(|a| [a.weights[0], a.weights[1], a.weights[2], a.sigma]);
        tensors.f32("anchor_weights", &[anchors.len(), 4], weights);
        let pairs =
            [("lids_left", &self.lid_contacts[0]), ("lids_right", &self.lid_contacts[1]), ("lips", &self.lip_contacts)];
        for (name, list) in pairs {
            tensors.u32(name, &[list.len(), 2], list.iter().flatten().copied());
        }
        tensors.finish()
    }

    /// Reads a packed head and checks that its parts belong together.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, HeadError> {
        let mut raw = Vec::new();
        GzDecoder::new(bytes).read_to_end(&mut raw).map_err(|e| format_error(&e))?;
        let tensors = Archive::open(&raw)?;
        let positions = vectors(&tensors.f32("positions")?);
        let (identity, keys) = (unpack_identity(&tensors)?, unpack_keys(&tensors)?);
        let pairs = |name| Ok::<_, HeadError>(rows(&tensors.u32(name)?));
        let head = Self {
            quads: rows(&tensors.u32("quads")?),
            uvs: rows::<f32, 8>(&tensors.f32("uvs")?)
                .iter()
                .map(|c| [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]], [c[6], c[7]]])
                .collect(),
            parts: unpack_parts(&rows(&tensors.u32("part_ends")?))?,
            mirror: tensors.u32("mirror")?,
            cavity: tensors.u32("cavity")?.iter().map(|&c| c != 0).collect(),
            anchors: unpack_anchors(&tensors)?,
            lid_contacts: [pairs("lids_left")?, pairs("lids_right")?],
            lip_contacts: pairs("lips")?,
            positions,
            identity,
            keys,
        };
        head.check()?;
        Ok(head)
    }

    fn pack_identity(&self, tensors: &mut Tensors) {
        let (k, n) = (self.identity.components, self.positions.len());
        let mut scales = Vec::with_capacity(k);
        let mut values = Vec::with_capacity(self.identity.basis.len());
        for component in self.identity.basis.chunks_exact(3 * n) {
            let largest = component.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
            // One hundredth of a millimetre, or finer where a component is small.
            let scale = f64::from(largest / 2000.0).clamp(1e-7, 1e-5).max(f64::from(largest) / 32000.0);
            scales.push(scale);
            values.extend(component.iter().map(|&x| (f64::from(x) / scale).round() as i16));
        }
        tensors.f32("identity_scales", &[k], scales.into_iter());
        tensors.i16("identity", &[k, n, 3], values);
    }

    fn pack_keys(&self, tensors: &mut Tensors) {
        let names: Vec<&str> = self.keys.iter().map(|k| k.name.as_str()).collect();
        tensors.metadata.insert("keys".into(), names.join(" "));
        tensors.u32("key_lengths", &[self.keys.len()], self.keys.iter().map(|k| k.offsets.len() as u32));
        let entries = || self.keys.iter().flat_map(|k| &k.offsets);
        tensors.u32("key_vertices", &[entries().count()], entries().map(|(i, _)| *i));
        let quantised =
            entries().flat_map(|(_, d)| [d.x, d.y, d.z]).map(|x| (x / KEY_QUANTUM).round() as i16).collect();
        tensors.i16("key_offsets", &[entries().count(), 3], quantised);
    }

    fn check(&self) -> Result<(), HeadError> {
        let n = self.positions.len();
        let in_range = |i: &u32| (*i as usize) < n;
        let lists = [self.mirror.len(), self.cavity.len()];
        let consistent = lists.iter().all(|&len| len == n)
            && self.quads.len() == self.uvs.len()
            && self.identity.basis.len() == self.identity.components * n * 3
            && self.quads.iter().flatten().all(in_range)
            && self.mirror.iter().all(in_range)
            && self.anchors.iter().flat_map(|a| &a.triangle).all(in_range)
            && self.keys.iter().flat_map(|k| &k.offsets).all(|(i, _)| in_range(i))
            && self.lid_contacts.iter().chain([&self.lip_contacts]).flatten().flatten().all(in_range)
            && self.parts.last().is_some_and(|p| p.vertices.end == n && p.quads.end == self.quads.len());
        if consistent { Ok(()) } else { Err(format_error("its tables do not belong together")) }
    }
}

fn format_error(reason: impl ToString + Sized) -> HeadError {
    HeadError::Format { reason: reason.to_string() }
}

fn unpack_parts(ends: &[[u32; 2]]) -> Result<Vec<Part>, HeadError> {
    if ends.len() != part::ALL.len() {
        return Err(format_error("it has other parts"));
    }
    let mut start = [0, 0];
    let mut parts = Vec::with_capacity(ends.len());
    for (name, end) in part::ALL.iter().zip(ends.iter().map(|e| e.map(|x| x as usize))) {
        if end[0] < start[0] || end[1] < start[1] {
            return Err(format_error("its parts are out of order"));
        }
        parts.push(Part { name: (*name).to_owned(), vertices: start[0]..end[0], quads: start[1]..end[1] });
        start = end;
    }
    Ok(parts)
}

fn unpack_identity(tensors: &Archive) -> Result<IdentityClass, HeadError> {
    let (scales, values) = (tensors.f32("identity_scales")?, tensors.i16("identity")?);
    let length = values.len() / scales.len().max(1);
    let basis = values.chunks(length.max(1)).zip(&scales).flat_map(|(c, s)| c.iter().map(move |&x| f32::from(x) * s));
    Ok(IdentityClass { components: scales.len(), basis: basis.collect() })
}

fn unpack_keys(tensors: &Archive) -> Result<Vec<Key>, HeadError> {
    let names = tensors.metadata.get("keys").ok_or_else(|| format_error("no key names"))?;
    let (lengths, vertices) = (tensors.u32("key_lengths")?, tensors.u32("key_vertices")?);
    let offsets: Vec<Vec3> = rows::<i16, 3>(&tensors.i16("key_offsets")?)
        .iter()
        .map(|d| Vec3::from_fn(|k, _| f64::from(d[k]) * KEY_QUANTUM))
        .collect();
    let total: usize = lengths.iter().map(|&l| l as usize).sum();
    if names.split(' ').count() != lengths.len() || total != vertices.len() || total != offsets.len() {
        return Err(format_error("its keys are cut short"));
    }
    let mut entries = vertices.into_iter().zip(offsets);
    let take = |(name, &length): (&str, &u32)| Key {
        name: name.to_owned(),
        offsets: entries.by_ref().take(length as usize).collect(),
    };
    Ok(names.split(' ').zip(&lengths).map(take).collect())
}

fn unpack_anchors(tensors: &Archive) -> Result<Vec<Anchor>, HeadError> {
    let triangles: Vec<[u32; 3]> = rows(&tensors.u32("anchor_triangles")?);
    let weights: Vec<[f32; 4]> = rows(&tensors.f32("anchor_weights")?);
    let anchor = |(triangle, w): (&[u32; 3], &[f32; 4])| Anchor {
        triangle: *triangle,
        weights: [f64::from(w[0]), f64::from(w[1]), f64::from(w[2])],
        sigma: f64::from(w[3]),
    };
    Ok(triangles.iter().zip(&weights).map(anchor).collect())
}

fn vectors(values: &[f32]) -> Vec<Vec3> {
    values.chunks_exact(3).map(|v| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))).collect()
}

fn rows<T: Copy + Default, const N: usize>(values: &[T]) -> Vec<[T; N]> {
    let row = |chunk: &[T]| {
        let mut row = [T::default(); N];
        row.copy_from_slice(chunk);
        row
    };
    values.chunks_exact(N).map(row).collect()
}

/// Tensors on their way out, in the order in which they were added.
#[derive(Default)]
struct Tensors {
    list: Vec<(String, Dtype, Vec<usize>, Vec<u8>)>,
    metadata: HashMap<String, String>,
}

impl Tensors {
    fn f32(&mut self, name: &str, shape: &[usize], values: impl Iterator<Item = f64>) {
        self.push(name, Dtype::F32, shape, values.flat_map(|x| (x as f32).to_le_bytes()).collect());
    }

    fn u32(&mut self, name: &str, shape: &[usize], values: impl Iterator<Item = u32>) {
        self.push(name, Dtype::U32, shape, values.flat_map(u32::to_le_bytes).collect());
    }

    fn i16(&mut self, name: &str, shape: &[usize], values: Vec<i16>) {
        self.push(name, Dtype::I16, shape, values.into_iter().flat_map(i16::to_le_bytes).collect());
    }

    fn push(&mut self, name: &str, dtype: Dtype, shape: &[usize], bytes: Vec<u8>) {
        self.list.push((name.to_owned(), dtype, shape.to_vec(), bytes));
    }

    fn finish(self) -> Result<Vec<u8>, HeadError> {
        let mut views = Vec::with_capacity(self.list.len());
        for (name, dtype, shape, bytes) in &self.list {
            let view = TensorView::new(*dtype, shape.clone(), bytes).map_err(|e| format_error(&e))?;
            views.push((name.as_str(), view));
        }
        // One string of metadata, so that no hash order reaches the bytes.
        let keys = self.metadata.get("keys").cloned().unwrap_or_default();
        let metadata = HashMap::from([("head".to_owned(), format!("{VERSION} {keys}"))]);
        let raw = safetensors::serialize(views, Some(metadata)).map_err(|e| format_error(&e))?;
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        encoder.write_all(&raw).map_err(|e| format_error(&e))?;
        encoder.finish().map_err(|e| format_error(&e))
    }
}

/// Tensors on their way in.
struct Archive<'a> {
    tensors: SafeTensors<'a>,
    metadata: HashMap<String, String>,
}

impl<'a> Archive<'a> {
    fn open(raw: &'a [u8]) -> Result<Self, HeadError> {
        let (_, header) = SafeTensors::read_metadata(raw).map_err(|e| format_error(&e))?;
        let text = header.metadata().as_ref().and_then(|m| m.get("head")).cloned().unwrap_or_default();
        let (version, keys) = text.split_once(' ').unwrap_or((&text, ""));
        if version != VERSION {
            return Err(format_error("it has another version"));
        }
        let metadata = HashMap::from([("keys".to_owned(), keys.to_owned())]);
        Ok(Self { tensors: SafeTensors::deserialize(raw).map_err(|e| format_error(&e))?, metadata })
    }

    fn bytes(&self, name: &str, dtype: Dtype) -> Result<&[u8], HeadError> {
        let tensor = self.tensors.tensor(name).map_err(|e| format_error(&e))?;
        if tensor.dtype() != dtype {
            return Err(format_error(format!("{name} has another type")));
        }
        // The view borrows the archive, the data the raw bytes: take the longer life through the name's offsets.
        let data = tensor.data();
        Ok(data)
    }

    fn f32(&self, name: &str) -> Result<Vec<f32>, HeadError> {
        Ok(rows::<u8, 4>(self.bytes(name, Dtype::F32)?).into_iter().map(f32::from_le_bytes).collect())
    }

    fn u32(&self, name: &str) -> Result<Vec<u32>, HeadError> {
        Ok(rows::<u8, 4>(self.bytes(name, Dtype::U32)?).into_iter().map(u32::from_le_bytes).collect())
    }

    fn i16(&self, name: &str) -> Result<Vec<i16>, HeadError> {
        Ok(rows::<u8, 2>(self.bytes(name, Dtype::I16)?).into_iter().map(i16::from_le_bytes).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiny() -> GenericHead {
        let positions: Vec<Vec3> = (0..28).map(|i| Vec3::new(f64::from(i) / 64.0, 0.25, -0.5)).collect();
        let parts = part::ALL.iter().enumerate();
        GenericHead {
            quads: (0..7).map(|i| [0, 1, 2, 3].map(|k| 4 * i + k)).collect(),
            uvs: vec![[[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]; 7],
            parts: parts
                .map(|(i, n)| Part { name: (*n).to_owned(), vertices: 4 * i..4 * i + 4, quads: i..i + 1 })
                .collect(),
            identity: IdentityClass { components: 2, basis: (0..168).map(|i| (i as f32 - 80.0) * 1e-5).collect() },
            keys: vec![Key { name: "jawOpen".into(), offsets: vec![(2, Vec3::new(0.0, -0.012, 0.001))] }],
            mirror: (0..28).rev().collect(),
            cavity: (0..28).map(|i| i % 3 == 0).collect(),
            anchors: vec![Anchor { triangle: [0, 1, 2], weights: [0.25, 0.25, 0.5], sigma: 0.5 }],
            lid_contacts: [vec![[0, 1]], vec![]],
            lip_contacts: vec![[2, 3]],
            positions,
        }
    }

    #[test]
    fn survives_a_round_trip() {
        let head = tiny();
        let bytes = head.to_bytes().unwrap();
        let back = GenericHead::from_bytes(&bytes).unwrap();
        assert_eq!(bytes, head.to_bytes().unwrap(), "equal heads give equal bytes");
        assert_eq!((&back.positions, &back.quads, &back.parts), (&head.positions, &head.quads, &head.parts));
        assert_eq!(
            (&back.anchors, &back.lid_contacts, &back.mirror),
            (&head.anchors, &head.lid_contacts, &head.mirror)
        );
        let worst =
            back.identity.basis.iter().zip(&head.identity.basis).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 6e-6, "{worst}");
        assert!((back.keys[0].offsets[0].1 - head.keys[0].offsets[0].1).norm() < 1e-9);
    }

    #[test]
    fn rubbish_and_torn_tables_are_refused() {
        assert!(GenericHead::from_bytes(b"no head at all").is_err());
        let mut torn = tiny();
        torn.mirror.pop();
        let error = GenericHead::from_bytes(&torn.to_bytes().unwrap()).unwrap_err();
        assert!(error.to_string().contains("install Facewright again"));
    }

    #[test]
    fn identity_coefficients_add_their_components() {
        let head = tiny();
        let moved = head.with_identity(&[0.0, 2.0]);
        let expected = f64::from(head.identity.basis[84]) * 2.0;
        assert!((moved[0].x - head.positions[0].x - expected).abs() < 1e-12);
    }
}
