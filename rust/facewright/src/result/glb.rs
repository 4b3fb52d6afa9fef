//! Binary glTF of a head: one node per part, morph targets by name, textures inside.
//!
//! Morph targets are sparse accessors: a key moves a tenth of the head, and the file stays as much smaller.
//! Vertices are split where the texture has a seam, so their number differs from the head's own.

use super::tangents::tangents;
use gltf_json as json;
use json::validation::{Checked, USize64};
use json::{Index, Root};
use serde_json::value::to_raw_value;
use std::collections::BTreeMap;

/// A morph target: its name, and moved vertices with their offsets.
pub type GlbTarget<'a> = (&'a str, Vec<(u32, [f32; 3])>);

/// One node with its mesh.
pub struct GlbNode<'a> {
    /// Name of node and mesh.
    pub name: &'a str,
    /// Vertices, metres.
    pub positions: &'a [[f32; 3]],
    /// Unit vertex normals.
    pub normals: &'a [[f32; 3]],
    /// Triangles and, per corner, texture coordinates with v up.
    pub triangles: &'a [([u32; 3], [[f32; 2]; 3])],
    /// Morph targets.
    pub targets: Vec<GlbTarget<'a>>,
    /// Index into the materials.
    pub material: usize,
}

/// A simple material.
pub struct GlbMaterial<'a> {
    /// Its name.
    pub name: &'a str,
    /// Linear RGBA, multiplied with the picture.
    pub colour: [f32; 4],
    /// 0 mirror … 1 chalk.
    pub roughness: f32,
    /// PNG file of its base colour.
    pub png: Option<&'a [u8]>,
    /// PNG file of its normals in tangent space.
    pub normals: Option<&'a [u8]>,
}

/// Writes nodes and materials as one GLB. Equal input gives equal bytes.
pub fn write_glb(nodes: &[GlbNode], materials: &[GlbMaterial]) -> Result<Vec<u8>, serde_json::Error> {
    let mut writer = Writer::default();
    writer.root.asset.generator = Some(format!("Facewright {}", env!("CARGO_PKG_VERSION")));
    for material in materials {
        writer.material(material);
    }
    for node in nodes {
        writer.node(node, materials.get(node.material).is_some_and(|material| material.normals.is_some()))?;
    }
    let roots = (0..nodes.len()).map(|i| Index::new(i as u32)).collect();
    let scene = writer.root.push(json::Scene { extensions: None, extras: None, name: None, nodes: roots });
    writer.root.scene = Some(scene);
    writer.finish()
}

#[derive(Default)]
struct Writer {
    root: Root,
    bin: Vec<u8>,
}

impl Writer {
    /// Appends bytes at the next multiple of four and describes them.
    fn view(&mut self, bytes: &[u8], target: Option<json::buffer::Target>) -> Index<json::buffer::View> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.root.push(json::buffer::View {
            buffer: Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: None,
            name: None,
            target: target.map(Checked::Valid),
            extensions: None,
            extras: None,
        })
    }

    fn material(&mut self, material: &GlbMaterial) {
        let texture = |index| json::texture::Info { index, tex_coord: 0, extensions: None, extras: None };
        let base_color_texture = material.png.map(|png| texture(self.texture(material.name.to_owned(), png)));
        let normal_texture = material.normals.map(|png| json::material::NormalTexture {
            index: self.texture(format!("{} normals", material.name), png),
            scale: 1.0,
            tex_coord: 0,
            extensions: None,
            extras: None,
        });
        let transparent = material.colour[3] < 1.0;
        self.root.push(json::Material {
            name: Some(material.name.into()),
            alpha_mode: Checked::Valid(if transparent {
                json::material::AlphaMode::Blend
            } else {
                json::material::AlphaMode::Opaque
            }),
            double_sided: transparent,
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                base_color_factor: json::material::PbrBaseColorFactor(material.colour),
                base_color_texture,
                metallic_factor: json::material::StrengthFactor(0.0),
                roughness_factor: json::material::StrengthFactor(material.roughness),
                ..Default::default()
            },
            normal_texture,
            ..Default::default()
        });
    }

    /// A picture that is a texture.
    fn texture(&mut self, name: String, png: &[u8]) -> Index<json::Texture> {
        let buffer_view = Some(self.view(png, None));
        let source = self.root.push(json::Image {
            buffer_view,
            mime_type: Some(json::image::MimeType("image/png".into())),
            name: Some(name.clone()),
            uri: None,
            extensions: None,
            extras: None,
        });
        self.root.push(json::Texture { name: Some(name), sampler: None, source, extensions: None, extras: None })
    }

    /// A node; with tangents where its material has normals of its own.
    fn node(&mut self, node: &GlbNode, with_tangents: bool) -> Result<(), serde_json::Error> {
        let split = Split::new(node.triangles);
        let gather = |values: &[[f32; 3]]| split.source.iter().map(|&i| values[i as usize]).collect::<Vec<_>>();
        let (places, directions) = (gather(node.positions), gather(node.normals));
        let (positions, normals) = (self.vectors(&places, true), self.vectors(&directions, false));
        let uvs: Vec<u8> = split.uvs.iter().flat_map(|uv| [uv[0], 1.0 - uv[1]]).flat_map(f32::to_le_bytes).collect();
        let uvs = self.accessor(&uvs, split.uvs.len(), json::accessor::Type::Vec2);
        let indices: Vec<u8> = split.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&indices, Some(json::buffer::Target::ElementArrayBuffer));
        let indices = self.root.push(json::Accessor {
            component_type: Checked::Valid(json::accessor::GenericComponentType(json::accessor::ComponentType::U32)),
            ..accessor(Some(view), split.indices.len(), json::accessor::Type::Scalar)
        });
        let targets = node.targets.iter().map(|(_, offsets)| self.target(&split, offsets)).collect();
        let names: Vec<&str> = node.targets.iter().map(|(name, _)| *name).collect();
        let mut attributes = BTreeMap::from([
            (Checked::Valid(json::mesh::Semantic::Positions), positions),
            (Checked::Valid(json::mesh::Semantic::Normals), normals),
            (Checked::Valid(json::mesh::Semantic::TexCoords(0)), uvs),
        ]);
        if with_tangents {
            let (triangles, _) = split.indices.as_chunks::<3>();
            let tangents = tangents(&places, &directions, &split.uvs, triangles);
            let bytes: Vec<u8> = tangents.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
            let tangents = self.accessor(&bytes, tangents.len(), json::accessor::Type::Vec4);
            attributes.insert(Checked::Valid(json::mesh::Semantic::Tangents), tangents);
        }
        let primitive = json::mesh::Primitive {
            attributes,
            indices: Some(indices),
            material: Some(Index::new(node.material as u32)),
            mode: Checked::Valid(json::mesh::Mode::Triangles),
            targets: (!names.is_empty()).then_some(targets),
            extensions: None,
            extras: None,
        };
        let extras = serde_json::json!({ "targetNames": names });
        let mesh = self.root.push(json::Mesh {
            name: Some(node.name.into()),
            primitives: vec![primitive],
            weights: (!names.is_empty()).then(|| vec![0.0; names.len()]),
            extras: if names.is_empty() { None } else { Some(to_raw_value(&extras)?) },
            extensions: None,
        });
        self.root.push(json::Node { mesh: Some(mesh), name: Some(node.name.into()), ..Default::default() });
        Ok(())
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, kind: json::accessor::Type) -> Index<json::Accessor> {
        let view = self.view(bytes, Some(json::buffer::Target::ArrayBuffer));
        self.root.push(accessor(Some(view), count, kind))
    }

    fn vectors(&mut self, values: &[[f32; 3]], with_bounds: bool) -> Index<json::Accessor> {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let index = self.accessor(&bytes, values.len(), json::accessor::Type::Vec3);
        if with_bounds {
            let accessor = &mut self.root.accessors[index.value()];
            (accessor.min, accessor.max) = bounds(values.iter().copied());
        }
        index
    }

    /// A morph target over the split vertices: zeros, and the moved vertices as sparse values.
    fn target(&mut self, split: &Split, offsets: &[(u32, [f32; 3])]) -> json::mesh::MorphTarget {
        let moved: BTreeMap<u32, [f32; 3]> = offsets.iter().copied().filter(|(_, d)| *d != [0.0; 3]).collect();
        let mut entries: Vec<(u32, [f32; 3])> =
            (0..).zip(&split.source).filter_map(|(new, old)| moved.get(old).map(|offset| (new, *offset))).collect();
        if entries.is_empty() {
            // Readers want some data even where nothing moves.
            entries.push((0, [0.0; 3]));
        }
        let mut target = accessor(None, split.source.len(), json::accessor::Type::Vec3);
        // The zeros count too, unless every vertex moves.
        let zeros = (entries.len() < split.source.len()).then_some([0.0; 3]);
        (target.min, target.max) = bounds(entries.iter().map(|(_, d)| *d).chain(zeros));
        let indices: Vec<u8> = entries.iter().flat_map(|(i, _)| i.to_le_bytes()).collect();
        let values: Vec<u8> = entries.iter().flat_map(|(_, d)| *d).flat_map(f32::to_le_bytes).collect();
        target.sparse = Some(json::accessor::sparse::Sparse {
            count: USize64::from(entries.len()),
            indices: json::accessor::sparse::Indices {
                buffer_view: self.view(&indices, None),
                byte_offset: USize64(0),
                component_type: Checked::Valid(json::accessor::IndexComponentType(json::accessor::ComponentType::U32)),
                extensions: None,
                extras: None,
            },
            values: json::accessor::sparse::Values {
                buffer_view: self.view(&values, None),
                byte_offset: USize64(0),
                extensions: None,
                extras: None,
            },
            extensions: None,
            extras: None,
        });
        json::mesh::MorphTarget { positions: Some(self.root.push(target)), normals: None, tangents: None }
    }

    fn finish(mut self) -> Result<Vec<u8>, serde_json::Error> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.root.push(json::Buffer {
            byte_length: USize64::from(self.bin.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut text = serde_json::to_vec(&self.root)?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.bin.len();
        let mut glb = Vec::with_capacity(total);
        glb.extend(b"glTF");
        for word in [2, total as u32, text.len() as u32] {
            glb.extend(word.to_le_bytes());
        }
        glb.extend(b"JSON");
        glb.extend(&text);
        glb.extend((self.bin.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(&self.bin);
        Ok(glb)
    }
}

fn accessor(view: Option<Index<json::buffer::View>>, count: usize, kind: json::accessor::Type) -> json::Accessor {
    json::Accessor {
        buffer_view: view,
        byte_offset: view.map(|_| USize64(0)),
        count: USize64::from(count),
        component_type: Checked::Valid(json::accessor::GenericComponentType(json::accessor::ComponentType::F32)),
        type_: Checked::Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

fn bounds(values: impl Iterator<Item = [f32; 3]>) -> (Option<json::Value>, Option<json::Value>) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for value in values {
        for k in 0..3 {
            low[k] = low[k].min(value[k]);
            high[k] = high[k].max(value[k]);
        }
    }
    (Some(json::Value::from(low.to_vec())), Some(json::Value::from(high.to_vec())))
}

/// Vertices split so that each has one texture coordinate.
struct Split {
    source: Vec<u32>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

impl Split {
    fn new(triangles: &[([u32; 3], [[f32; 2]; 3])]) -> Self {
        let mut known: BTreeMap<(u32, [u32; 2]), u32> = BTreeMap::new();
        let mut split = Self { source: Vec::new(), uvs: Vec::new(), indices: Vec::with_capacity(3 * triangles.len()) };
        for (corners, uvs) in triangles {
            for (&vertex, uv) in corners.iter().zip(uvs) {
                let next = split.source.len() as u32;
                let index = *known.entry((vertex, uv.map(f32::to_bits))).or_insert(next);
                if index == next {
                    split.source.push(vertex);
                    split.uvs.push(*uv);
                }
                split.indices.push(index);
            }
        }
        split
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(targets: Vec<GlbTarget>) -> Vec<u8> {
        square_with(targets, None)
    }

    fn square_with(targets: Vec<GlbTarget>, normals: Option<&[u8]>) -> Vec<u8> {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let triangles =
            [([0, 1, 2], [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]), ([0, 2, 3], [[0.6, 0.0], [0.5, 0.5], [0.6, 0.5]])];
        let node = GlbNode {
            name: "skin",
            positions: &positions,
            normals: &[[0.0, 0.0, 1.0]; 4],
            triangles: &triangles,
            targets,
            material: 0,
        };
        let material = GlbMaterial { name: "skin", colour: [1.0; 4], roughness: 0.5, png: None, normals };
        write_glb(&[node], &[material]).unwrap()
    }

    fn open_jaw() -> Vec<u8> {
        square(vec![("jawOpen", vec![(0, [0.0, -0.25, 0.0])]), ("viseme_sil", vec![])])
    }

    #[test]
    fn an_independent_reader_finds_names_seams_and_targets() {
        let bytes = open_jaw();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let node = file.nodes().next().unwrap();
        let mesh = node.mesh().unwrap();
        assert_eq!(node.name(), Some("skin"));
        assert!(mesh.extras().as_ref().unwrap().get().contains(r#"["jawOpen","viseme_sil"]"#));
        let primitive = mesh.primitives().next().unwrap();
        let blob = file.blob.as_deref().unwrap();
        let reader = primitive.reader(|_| Some(blob));
        assert_eq!(reader.read_positions().unwrap().count(), 5, "vertex 0 is split at the seam");
        let moved: Vec<_> = reader.read_morph_targets().next().unwrap().0.unwrap().collect();
        assert_eq!(moved.iter().filter(|d| d[1] == -0.25).count(), 2, "both copies of vertex 0 move");
    }

    #[test]
    fn bounds_of_a_target_hold_zero_only_where_a_vertex_rests() {
        let down = [0.0, -0.25, 0.0];
        let highest = |moved: std::ops::Range<u32>| {
            let bytes = square(vec![("jawOpen", moved.map(|i| (i, down)).collect())]);
            let file = gltf::Gltf::from_slice(&bytes).unwrap();
            let max = file.accessors().find(|a| a.sparse().is_some()).unwrap().max().unwrap();
            max[1].as_f64().unwrap()
        };
        assert_eq!(highest(0..3), 0.0);
        assert_eq!(highest(0..4), -0.25);
    }

    #[test]
    fn tangents_come_with_a_normal_map_and_only_then() {
        let tangents = |normals: Option<&[u8]>| {
            let bytes = square_with(Vec::new(), normals);
            let file = gltf::Gltf::from_slice(&bytes).unwrap();
            let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
            let blob = file.blob.as_deref().unwrap();
            let found = primitive.reader(|_| Some(blob)).read_tangents().map(|found| found.collect::<Vec<_>>());
            (found, primitive.material().normal_texture().is_some())
        };
        let (found, is_mapped) = tangents(Some(b"a picture"));
        assert_eq!((found.unwrap().len(), is_mapped), (5, true));
        assert_eq!(tangents(None), (None, false));
    }

    #[test]
    fn equal_input_gives_equal_bytes() {
        assert_eq!(open_jaw(), open_jaw());
    }
}
