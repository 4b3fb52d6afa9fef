//! The meshes of a head.glb, as they are drawn.
//!
//! The reader of glTF takes the numbers in a file for true, and panics where they are not; they are checked here first.

use crate::FacewrightError;
use geometry::{Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Semantic};
use head::part;
use image::{Rgba, RgbaImage};
use std::path::Path;
use texture::{Layer, Surface};

/// Parts that are drawn; lashes are finer than a frame's pixels.
const DRAWN: [&str; 6] =
    [part::SKIN, part::EYE_LEFT, part::EYE_RIGHT, part::TEETH_UPPER, part::TEETH_LOWER, part::TONGUE];

/// One node of a head.glb.
pub(super) struct Node {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[Vec2; 3]>,
    texture: RgbaImage,
}

impl Node {
    /// What is drawn of it.
    pub(super) fn layer(&self) -> Layer<'_> {
        let surface = Surface::drawn(&self.positions, &self.triangles, &self.uvs);
        Layer { surface, texture: &self.texture }
    }
}

/// Reads those that are drawn.
///
/// # Errors
/// [`FacewrightError::NoResult`].
pub(super) fn read_nodes(path: &Path) -> Result<Vec<Node>, FacewrightError> {
    let no_result = |reason: String| FacewrightError::NoResult {
        path: path.parent().unwrap_or(Path::new(".")).to_owned(),
        reason: format!("head.glb: {reason}"),
    };
    let bytes = std::fs::read(path).map_err(|e| no_result(e.to_string()))?;
    nodes(&bytes).map_err(no_result)
}

fn nodes(bytes: &[u8]) -> Result<Vec<Node>, String> {
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| e.to_string())?;
    let root = document.into_json();
    check_references(&root)?;
    let document = gltf::Document::from_json(root).map_err(|e| e.to_string())?;
    let blob = blob.ok_or("it is empty")?;
    let wanted = document.nodes().filter_map(|node| Some((node.name()?.to_owned(), node)));
    let drawn = wanted.filter(|(name, _)| DRAWN.contains(&name.as_str()));
    drawn
        .map(|(name, node)| read_node(&node, &blob).ok_or_else(|| format!("it has no mesh {name} that can be read")))
        .collect()
}

/// Refuses what names something that is not there, where the reader takes for granted that it is.
fn check_references(root: &gltf_json::Root) -> Result<(), String> {
    let is_there = |index: &gltf_json::Index<gltf_json::Accessor>| index.value() < root.accessors.len();
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    if !primitives.all(|primitive| primitive.attributes.values().all(is_there)) {
        return Err("the values of a mesh are not in it".to_owned());
    }
    let is_inside = |image: &gltf_json::Image| image.buffer_view.is_some() && image.mime_type.is_some();
    if !root.images.iter().all(is_inside) {
        return Err("a picture is not in it".to_owned());
    }
    Ok(())
}

/// A node, if all that it names is there.
fn read_node(node: &gltf::Node, blob: &[u8]) -> Option<Node> {
    let mesh = node.mesh()?;
    let primitive = mesh.primitives().next()?;
    let has = |semantic: &Semantic, dimensions| {
        primitive.get(semantic).is_some_and(|values| is_whole(&values, blob, dimensions))
    };
    let is_read = has(&Semantic::Positions, Dimensions::Vec3)
        && has(&Semantic::TexCoords(0), Dimensions::Vec2)
        && is_whole(&primitive.indices()?, blob, Dimensions::Scalar);
    if !is_read {
        return None;
    }
    let reader = primitive.reader(|_| Some(blob));
    let vector = |p: [f32; 3]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    let positions: Vec<Vec3> = reader.read_positions()?.map(vector).collect();
    let uvs: Vec<[f32; 2]> = reader.read_tex_coords(0)?.into_f32().collect();
    let indices: Vec<u32> = reader.read_indices()?.into_u32().collect();
    let vertices = positions.len().min(uvs.len());
    let is_fine = indices.iter().all(|i| (*i as usize) < vertices)
        && positions.iter().all(|p| p.iter().all(|x| x.is_finite()))
        && uvs.iter().flatten().all(|x| x.is_finite());
    if !is_fine {
        return None;
    }
    let triangles: Vec<[u32; 3]> = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    let corner = |i: u32| Vec2::new(f64::from(uvs[i as usize][0]), 1.0 - f64::from(uvs[i as usize][1]));
    let uvs = triangles.iter().map(|t| t.map(corner)).collect();
    Some(Node { positions, triangles, uvs, texture: base_colour(&primitive.material(), blob)? })
}

/// Whether all values of a kind are in the file, one after the other.
fn is_whole(values: &Accessor, blob: &[u8], dimensions: Dimensions) -> bool {
    let is_kind = values.dimensions() == dimensions
        && match dimensions {
            Dimensions::Scalar => matches!(values.data_type(), DataType::U8 | DataType::U16 | DataType::U32),
            _ => values.data_type() == DataType::F32,
        };
    let Some(view) = values.view().filter(|_| is_kind && values.sparse().is_none()) else { return false };
    let (size, stride) = (values.size(), view.stride().unwrap_or(values.size()));
    let end = values
        .count()
        .checked_sub(1)
        .and_then(|last| last.checked_mul(stride)?.checked_add(values.offset())?.checked_add(size));
    let inside = view.offset().checked_add(view.length()).is_some_and(|end| end <= blob.len());
    inside && stride >= size && end.is_some_and(|end| end <= view.length())
}

/// The picture of a material, or one texel of its plain colour.
fn base_colour(material: &gltf::Material, blob: &[u8]) -> Option<RgbaImage> {
    let surface = material.pbr_metallic_roughness();
    let Some(info) = surface.base_color_texture() else {
        let encode = |linear: f32| (255.0 * linear.powf(1.0 / 2.2)).round() as u8;
        let [r, g, b, _] = surface.base_color_factor();
        return Some(RgbaImage::from_pixel(2, 2, Rgba([encode(r), encode(g), encode(b), 255])));
    };
    let gltf::image::Source::View { view, .. } = info.texture().source().source() else { return None };
    let bytes = blob.get(view.offset()..view.offset().checked_add(view.length())?)?;
    Some(image::load_from_memory(bytes).ok()?.into_rgba8())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One triangle, with a change of its JSON.
    fn said(from: &str, to: &str) -> Option<String> {
        let json = r#"{"asset":{"version":"2.0"},"nodes":[{"name":"skin","mesh":0}],"meshes":[{"primitives":[{"attributes":
            {"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],"materials":[{}],"accessors":[
            {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
            {"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"},
            {"bufferView":2,"componentType":5125,"count":3,"type":"SCALAR"}],
            "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":24},
            {"buffer":0,"byteOffset":60,"byteLength":12}],"buffers":[{"byteLength":72}],"images":[]}"#;
        assert!(json.contains(from));
        let mut json = json.replace(from, to).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let values = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0];
        let blob = [values.map(f32::to_le_bytes).concat(), [0_u32, 1, 2].map(u32::to_le_bytes).concat()].concat();
        let length = |bytes: &[u8]| (bytes.len() as u32).to_le_bytes();
        let chunks = [&length(&json)[..], b"JSON", &json, &length(&blob), b"BIN\0", &blob].concat();
        let total = (12 + chunks.len() as u32).to_le_bytes();
        nodes(&[b"glTF", &2_u32.to_le_bytes()[..], &total, &chunks].concat()).err()
    }

    #[test]
    fn a_head_that_names_what_it_does_not_hold_is_refused_in_words() {
        assert_eq!(said("\"skin\"", "\"skin\""), None);
        let unreadable = "it has no mesh skin that can be read";
        for (from, to, words) in [
            ("\"POSITION\":0", "\"POSITION\":9", "the values of a mesh are not in it"),
            ("\"images\":[]", "\"images\":[{}]", "a picture is not in it"),
            // Vertices 0 to 2 are named, and there are two.
            ("\"count\":3,\"type\":\"VEC2\"", "\"count\":2,\"type\":\"VEC2\"", unreadable),
            ("\"count\":3,\"type\":\"VEC3\"", "\"count\":9223372036854775807,\"type\":\"VEC3\"", unreadable),
            ("\"byteOffset\":60", "\"byteOffset\":62", unreadable),
            ("\"mesh\":0", "\"extras\":0", unreadable),
        ] {
            let said = said(from, to).unwrap();
            assert!(said.contains(words), "{to}: {said}");
        }
    }
}
