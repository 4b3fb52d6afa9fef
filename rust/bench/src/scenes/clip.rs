//! The project's own clip: a rendered head that turns, and the board filmed by the same camera; and films like it.

use super::seen::Body;
use crate::files::{read_grey, read_json};
use anyhow::Context;
use geometry::{Camera, Transform, Vec3};
use image::{GrayImage, RgbImage};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The clip's `truth.json`.
#[derive(Deserialize)]
pub struct Clip {
    /// The camera of frames and boards.
    pub camera: Camera,
    /// Frames of the head.
    pub frames: Vec<Frame>,
    /// Pictures of the board.
    pub boards: Vec<BoardPicture>,
    /// The board.
    pub board: Board,
    /// Tip of the nose, head frame.
    pub nose_tip: [f64; 3],
    mesh: PathBuf,
    #[serde(skip)]
    folder: PathBuf,
}

/// A frame of the head.
#[derive(Deserialize)]
pub struct Frame {
    /// Its name.
    pub name: String,
    /// The true pose.
    pub cam_from_head: Transform,
    /// Turn of the head, degrees; the nose to image right is positive.
    pub yaw_deg: f64,
    file: PathBuf,
}

/// A picture of the board.
#[derive(Deserialize)]
pub struct BoardPicture {
    /// The true pose.
    pub cam_from_board: Transform,
    file: PathBuf,
}

/// The board.
#[derive(Deserialize)]
pub struct Board {
    /// Inner corners: columns, rows.
    pub inner_corners: (u32, u32),
    /// Side of a square, metres.
    pub square_m: f64,
}

impl Clip {
    /// The project's own.
    pub fn open() -> anyhow::Result<Self> {
        Self::open_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/clip"))
    }

    /// Reads the truth of a film in a folder that is laid out like the project's own.
    pub fn open_in(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self { folder: folder.to_owned(), ..read_json(&folder.join("truth.json"))? })
    }

    /// The picture of a frame.
    pub fn frame(&self, index: usize) -> anyhow::Result<GrayImage> {
        read_grey(&self.folder.join(&self.frames[index].file))
    }

    /// The picture of a frame, in colour.
    pub fn picture(&self, index: usize) -> anyhow::Result<RgbImage> {
        let path = self.folder.join(&self.frames[index].file);
        let picture = image::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(picture.to_rgb8())
    }

    /// A picture of the board.
    pub fn board(&self, index: usize) -> anyhow::Result<GrayImage> {
        read_grey(&self.folder.join(&self.boards[index].file))
    }

    /// The head that was filmed, in the head frame.
    pub fn head(&self) -> anyhow::Result<Body> {
        let path = self.folder.join(&self.mesh);
        let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        read_ply(&bytes).with_context(|| format!("{} is not the PLY it should be", path.display()))
    }
}

/// A binary PLY of vertices of three float32 and triangles of one uchar and three int32.
fn read_ply(bytes: &[u8]) -> Option<Body> {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end)? + end.len();
    let header = std::str::from_utf8(&bytes[..body]).ok()?;
    let count = |name: &str| header.lines().find_map(|l| l.strip_prefix(name))?.trim().parse::<usize>().ok();
    let word = |b: &[u8], k: usize| -> Option<[u8; 4]> { b.get(4 * k..4 * k + 4)?.try_into().ok() };
    let number = |b: &[u8], k: usize| word(b, k).map(|w| f64::from(f32::from_le_bytes(w)));
    let vertex = |b: &[u8]| Some(Vec3::new(number(b, 0)?, number(b, 1)?, number(b, 2)?));
    let index = |b: &[u8], k: usize| word(&b[1..], k).map(u32::from_le_bytes);
    let triangle = |b: &[u8]| Some([index(b, 0)?, index(b, 1)?, index(b, 2)?]);
    let (vertices, faces) = (count("element vertex ")?, count("element face ")?);
    let (vertex_bytes, face_bytes) = bytes[body..].split_at_checked(12 * vertices)?;
    let positions = vertex_bytes.chunks_exact(12).map(vertex).collect::<Option<_>>()?;
    let triangles = face_bytes.chunks_exact(13).take(faces).map(triangle).collect::<Option<_>>()?;
    Some(Body { positions, triangles })
}
