//! The finished head: in memory, and as the files of a result folder.

mod glb;
mod nodes;
mod overlay;
mod parts;
mod quality;
mod relief;
mod report;
mod tangents;

pub use overlay::{overlay, overlay_on_rig};
pub use parts::PartShape;
pub use quality::{Bounds, Measure, Quality, Verdict};
pub use relief::Relief;
pub use report::{DenseReport, FitReport, FrameReport, Report, ReportCamera, Scale, TextureReport};

use crate::files::{json_text, png, unwritable, write_together};
use crate::{FacewrightError, SurfaceTruth};
use geometry::{Vec3, mesh};
use glb::{GlbMaterial, GlbNode, GlbTarget, write_glb};
use head::{GenericHead, Key, Part, part};
use image::RgbaImage;
use std::path::Path;

/// A reconstructed head on the generic head's topology, but for the eyes of `--method paper`.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The person at rest: all vertices, head frame, metres.
    pub positions: Vec<Vec3>,
    /// The same vertices on the generic head.
    pub generic_positions: Vec<Vec3>,
    /// Quads of all parts.
    pub quads: Vec<[u32; 4]>,
    /// Texture coordinates per quad corner, v up.
    pub uvs: Vec<[[f32; 2]; 4]>,
    /// Parts of the head.
    pub parts: Vec<Part>,
    /// 52 ARKit keys and 15 visemes, carried over to this person.
    pub keys: Vec<Key>,
    /// Texture of the skin; alpha below 255 where no frame looked.
    pub texture: RgbaImage,
    /// Texture of the eyes.
    pub eyes: RgbaImage,
    /// How well the skin was measured, by vertex; `None` where it was not.
    pub truth: Option<SurfaceTruth>,
    /// What the skin has between its vertices; `None` where it was not measured.
    pub relief: Option<Relief>,
    /// What was done, and how well.
    pub report: Report,
}

/// Plain colours of the parts that no camera sees well: linear RGBA and roughness.
const TEETH: ([f32; 4], f32) = ([0.62, 0.55, 0.45, 1.0], 0.25);
const TONGUE: ([f32; 4], f32) = ([0.42, 0.14, 0.13, 1.0], 0.4);
const LASHES: ([f32; 4], f32) = ([0.02, 0.015, 0.012, 0.3], 0.8);

impl Reconstruction {
    /// The head as `head.glb`.
    pub fn glb(&self) -> Result<Vec<u8>, FacewrightError> {
        let (skin, eyes) = (png(&opaque(&self.texture))?, png(&self.eyes)?);
        let relief = self.relief.as_ref().map(Relief::normal_png).transpose()?;
        let plain = |name, (colour, roughness)| GlbMaterial { name, colour, roughness, png: None, normals: None };
        let painted = |name, roughness, png| GlbMaterial { png: Some(png), ..plain(name, ([1.0; 4], roughness)) };
        let materials = [
            GlbMaterial { normals: relief.as_deref(), ..painted("skin", 0.55, &skin[..]) },
            painted("eyes", 0.1, &eyes[..]),
            plain("teeth", TEETH),
            plain("tongue", TONGUE),
            plain("lashes", LASHES),
        ];
        let material = |name: &str| match name {
            part::SKIN => 0,
            part::EYE_LEFT | part::EYE_RIGHT => 1,
            part::TEETH_UPPER | part::TEETH_LOWER => 2,
            part::TONGUE => 3,
            _ => 4,
        };
        let meshes: Vec<PartMesh> = self.parts.iter().map(|part| PartMesh::new(self, part)).collect();
        let nodes: Vec<GlbNode> =
            self.parts.iter().zip(&meshes).map(|(p, m)| m.node(&p.name, material(&p.name))).collect();
        write_glb(&nodes, &materials).map_err(|e| unwritable(Path::new("head.glb"), &e))
    }

    /// Writes `head.glb`, `texture.png`, `eyes.png`, `report.json`, and `displacement.png` where the skin was measured densely.
    ///
    /// All files are made beside the folder first and moved into it last: on an error nothing in it has changed.
    pub fn write(&self, folder: &Path) -> Result<(), FacewrightError> {
        let mut files = vec![
            ("head.glb", self.glb()?),
            ("texture.png", png(&self.texture)?),
            ("eyes.png", png(&self.eyes)?),
            ("report.json", json_text(&self.report).into_bytes()),
        ];
        if let Some(relief) = &self.relief {
            files.push(("displacement.png", relief.displacement_png()?));
        }
        write_together(folder, &files)
    }
}

/// The texture without its mark of unseen places, which is no transparency.
fn opaque(picture: &RgbaImage) -> RgbaImage {
    let mut picture = picture.clone();
    picture.pixels_mut().for_each(|p| p.0[3] = 255);
    picture
}

/// Positions of every key of the generic head, as vertices of one part.
struct PartMesh<'a> {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<([u32; 3], [[f32; 2]; 3])>,
    targets: Vec<GlbTarget<'a>>,
}

impl<'a> PartMesh<'a> {
    fn new(head: &'a Reconstruction, part: &Part) -> Self {
        let first = part.vertices.start as u32;
        let quads = head.quads[part.quads.clone()].iter().map(|q| q.map(|i| i - first)).collect::<Vec<_>>();
        let positions = &head.positions[part.vertices.clone()];
        let normals = mesh::vertex_normals(positions, &mesh::triangulate(&quads));
        let corner = |q: &[u32; 4], uv: &[[f32; 2]; 4], k: [usize; 3]| (k.map(|k| q[k]), k.map(|k| uv[k]));
        let triangles = quads
            .iter()
            .zip(&head.uvs[part.quads.clone()])
            .flat_map(|(q, uv)| [corner(q, uv, [0, 1, 2]), corner(q, uv, [0, 2, 3])])
            .collect();
        Self {
            positions: positions.iter().map(single).collect(),
            normals: normals.iter().map(|n| single(&n.try_normalize(0.5).unwrap_or_else(Vec3::z))).collect(),
            triangles,
            targets: part_keys(head, part).collect(),
        }
    }

    fn node(&self, name: &'a str, material: usize) -> GlbNode<'_> {
        GlbNode {
            name,
            positions: &self.positions,
            normals: &self.normals,
            triangles: &self.triangles,
            targets: self.targets.clone(),
            material,
        }
    }
}

/// The keys of a part: the skin has every key, another part those that move it.
fn part_keys<'a>(head: &'a Reconstruction, part: &Part) -> impl Iterator<Item = GlbTarget<'a>> {
    let (range, is_skin) = (part.vertices.clone(), part.name == part::SKIN);
    head.keys.iter().filter_map(move |key| {
        let inside = key.offsets.iter().filter(|(i, _)| range.contains(&(*i as usize)));
        let offsets: Vec<_> = inside.map(|(i, d)| (i - range.start as u32, single(d))).collect();
        (is_skin || !offsets.is_empty()).then_some((key.name.as_str(), offsets))
    })
}

fn single(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

impl Reconstruction {
    /// An unfinished result on a generic head's topology, with everything but shape, keys, textures and report.
    pub(crate) fn on(head: &GenericHead, positions: Vec<Vec3>, keys: Vec<Key>, report: Report) -> Self {
        Self {
            positions,
            generic_positions: head.positions.clone(),
            quads: head.quads.clone(),
            uvs: head.uvs.clone(),
            parts: head.parts.clone(),
            keys,
            texture: RgbaImage::new(1, 1),
            eyes: RgbaImage::new(1, 1),
            truth: None,
            relief: None,
            report,
        }
    }
}
