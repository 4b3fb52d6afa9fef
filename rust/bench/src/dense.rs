//! Bench of `dense`: a piece of skin with a known relief, measured along its normals, beside windows swept through depth.

use crate::clock::{median, timed};
use crate::feature::{Feature, Figure};
use crate::results::Run;
use anyhow::Context;
use dense::{DenseOptions, Surface, View, measure};
use geometry::{Camera, Transform, Vec3};
use image::GrayImage;
use image::codecs::jpeg::JpegEncoder;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use synthetic::{Skin, SkinOptions};

/// Vertices along a side of the piece, and how far they are apart, metres.
const SIDE: u32 = 17;
const STEP: f64 = 0.004;
/// Pictures of a turning head, and how far it turns to both sides, degrees.
const FRAMES: u32 = 15;
const TURN: f64 = 30.0;

/// The bench.
pub struct Dense;

/// A film of the piece.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    camera: Camera,
    poses: Vec<Transform>,
    pictures: Vec<String>,
    /// A ball without relief: vertices, metres, and quads. Its normals point away from the middle.
    positions: Vec<[f64; 3]>,
    quads: Vec<[u32; 4]>,
    /// Vertices that are measured, 1, or not, 0.
    share: Vec<f64>,
}

/// How a case looks.
struct Kind {
    name: &'static str,
    skin: SkinOptions,
    quality: u8,
}

fn kinds() -> [Kind; 2] {
    let clean = SkinOptions::default();
    let poor = SkinOptions { noise: 3.0, blur: 1.0, ..clean.clone() };
    [Kind { name: "clean film", skin: clean, quality: 95 }, Kind { name: "blurred, JPEG 50", skin: poor, quality: 50 }]
}

impl Feature for Dense {
    type Inputs = Vec<Case>;
    /// How far the skin is out from each vertex of each case, metres.
    type Truth = Vec<Vec<f64>>;
    /// The same as found; none where it was not measured.
    type Answer = Vec<Option<f64>>;

    fn inputs(folder: &Path) -> anyhow::Result<(Self::Inputs, Self::Truth)> {
        let cases =
            kinds().iter().zip(0..).map(|(kind, k)| case(kind, k, folder)).collect::<anyhow::Result<Vec<_>>>()?;
        Ok(cases.into_iter().unzip())
    }

    fn measure(inputs: &Self::Inputs, folder: &Path) -> anyhow::Result<Vec<Run<Self::Answer>>> {
        inputs.iter().map(|case| run(case, folder)).collect()
    }

    fn figures(run: &Run<Self::Answer>, inputs: &Self::Inputs, truth: &Self::Truth) -> anyhow::Result<Vec<Figure>> {
        let k = inputs.iter().position(|case| case.name == run.case).context("a case of another run")?;
        let wanted = inputs[k].share.iter().filter(|share| **share > 0.5).count() as f64;
        let off = |(found, truth): (&Option<f64>, &f64)| found.map(|found| 1000.0 * (found - truth).abs());
        let mut errors: Vec<f64> = run.answer.iter().zip(&truth[k]).filter_map(off).collect();
        errors.sort_by(f64::total_cmp);
        let p90 = errors.get(errors.len() * 9 / 10).copied().unwrap_or(f64::NAN);
        Ok(vec![
            Figure::cost("ms", run.time("measure")),
            Figure::gain("measured, %", 100.0 * errors.len() as f64 / wanted),
            Figure::cost("error, median, mm", median(errors)),
            Figure::cost("error, p90, mm", p90),
        ])
    }
}

fn case(kind: &Kind, number: u64, folder: &Path) -> anyhow::Result<(Case, Vec<f64>)> {
    let skin = Skin::new(&kind.skin);
    let camera = Camera { k1: -0.15, k2: 0.05, ..Camera::centred(220, 220, 1000.0) };
    let part = |k: u32| 2.0 * f64::from(k) / f64::from(FRAMES - 1) - 1.0;
    let pose =
        |k: u32| Skin::pose((TURN * part(k)).to_radians(), (0.3 * TURN * (3.0 * part(k)).sin()).to_radians(), 0.6);
    let poses: Vec<Transform> = (0..FRAMES).map(pose).collect();
    let mut pictures = Vec::new();
    for (pose, k) in poses.iter().zip(0..) {
        let name = format!("{number}-{k:02}.jpg");
        let picture = skin.picture(&camera, pose, k);
        let file = std::fs::File::create(folder.join(&name))?;
        picture.write_with_encoder(JpegEncoder::new_with_quality(file, kind.quality))?;
        pictures.push(name);
    }
    let (positions, quads) = Skin::ball(SIDE, STEP);
    let truth = positions.iter().map(|p| skin.radius(&p.normalize()) - p.norm()).collect();
    let inside = |k: u32| (2..SIDE - 2).contains(&k);
    let share = (0..SIDE * SIDE).map(|i| if inside(i % SIDE) && inside(i / SIDE) { 1.0 } else { 0.0 }).collect();
    let positions = positions.iter().map(|p| [p.x, p.y, p.z]).collect();
    Ok((Case { name: kind.name.to_owned(), camera, poses, pictures, positions, quads, share }, truth))
}

fn run(case: &Case, folder: &Path) -> anyhow::Result<Run<Vec<Option<f64>>>> {
    let read = |name: &String| Ok(image::open(folder.join(name))?.to_luma8());
    let pictures = case.pictures.iter().map(read).collect::<anyhow::Result<Vec<GrayImage>>>()?;
    let positions: Vec<Vec3> = case.positions.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect();
    let view = |(image, pose): (_, &Transform)| View {
        image,
        camera: case.camera,
        cam_from_head: *pose,
        mask: None,
        moved: &[],
    };
    let views: Vec<View> = pictures.iter().zip(&case.poses).map(view).collect();
    let surface = Surface { positions: &positions, quads: &case.quads, share: &case.share };
    let (ms, found) = timed(|| measure(&surface, &views, &DenseOptions::default()));
    let found = found?;
    let offset = |v: usize| (case.share[v] > 0.5).then(|| found.positions[v].norm() - positions[v].norm());
    let answer = (0..positions.len()).map(offset).collect();
    let times_ms = BTreeMap::from([("measure".to_owned(), ms)]);
    Ok(Run {
        case: case.name.clone(),
        task: "surface along normals".to_owned(),
        setting: String::new(),
        times_ms,
        answer,
    })
}
