//! The bake: views of a surface into one texture.
//!
//! [`bake`] runs, for [`Method::Default`]: small atlases of all views → light, gains, agreement and best views
//! (`choice`, [`crate::shading`]) → each view at the size that the pictures' pixels are worth, its light taken out, into the
//! multi-band blend (`blend`) → filling and enlarging (`fill`). [`Method::Paper`] takes each triangle from one view (`paper`), then fills.
//!
//! The texture is square, top row first, texture coordinates with `v` up; colours are those of the pictures.

use crate::blend::Blend;
use crate::choice::compare;
use crate::error::{TextureError, Warning};
use crate::fill::fill;
use crate::paper;
use crate::plane::{Plane, Texel, reduce};
use crate::sample::Sight;
use crate::shading::{Light, Prior, Reference, Shading};
use geometry::mesh::{area_normal, vertex_normals};
use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use image::{GrayImage, RgbImage, RgbaImage};
use raster::{Fragment, NO_TRIANGLE, texels};
use rayon::prelude::*;

/// Largest size of the small atlases on which the views are compared.
const COMPARISON_SIZE: usize = 512;
/// Certainty is full from this part of a perfect view's (score)^(1 / angle power) on.
const CERTAIN: f32 = 0.1;
/// Texels per pixel, along an edge, beyond which a picture has nothing to tell: two for the finest wave that its pixels hold.
const TELLING_TEXELS: f64 = 2.0;
/// Below this share of seen texels a warning is given.
const LOW_COVERAGE: f64 = 0.25;

/// What is textured: triangles in the head frame, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Vertices, head frame, metres.
    pub positions: &'a [Vec3],
    /// Vertex indices.
    pub triangles: &'a [[u32; 3]],
    /// Texture coordinates of each triangle's corners, 0…1, `v` up.
    pub uvs: &'a [[Vec2; 3]],
    /// Per vertex 0…1 how much the pictures may say about it: 0 in cavities that they show wrongly.
    pub weight: Option<&'a [f64]>,
    /// Per vertex the vertex on the other side of the face, for what no view saw.
    pub mirror: Option<&'a [u32]>,
}

impl<'a> Surface<'a> {
    /// One that is drawn, not baked.
    pub fn drawn(positions: &'a [Vec3], triangles: &'a [[u32; 3]], uvs: &'a [[Vec2; 3]]) -> Self {
        Self { positions, triangles, uvs, weight: None, mirror: None }
    }
}

/// A mesh that may stand before the surface, such as eyeballs and teeth.
#[derive(Clone, Copy, Debug)]
pub struct Occluder<'a> {
    /// Vertices, head frame, metres.
    pub positions: &'a [Vec3],
    /// Vertex indices, any winding.
    pub triangles: &'a [[u32; 3]],
}

/// A picture of the head with its pose.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The picture as filmed, lens distortion included.
    pub image: &'a RgbImage,
    /// Its camera.
    pub camera: Camera,
    /// Its pose.
    pub cam_from_head: Transform,
    /// 0 where the picture shows no skin of this head (background, hair, a hand); size of the picture.
    pub mask: Option<&'a GrayImage>,
    /// How sharp the picture is compared with the other views', positive, any unit.
    pub sharpness: f64,
}

/// How the texture is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Each triangle from the view that it faces most (paper, section 2.7).
    Paper,
    /// Light taken out, views blended in octaves.
    #[default]
    Default,
}

/// How [`bake`] works.
#[derive(Clone, Copy, Debug)]
pub struct BakeOptions {
    /// Width and height of the texture, 16…16384 texels.
    pub size: u32,
    /// The method; all options below are for [`Method::Default`].
    pub method: Method,
    /// Fit the light and the gains of the views; without it the colours are taken as they are.
    pub shading: bool,
    /// Views count with the cosine of the viewing angle to this power.
    pub angle_power: f64,
    /// No view counts where it looks more slanted than this, radians.
    pub max_angle: f64,
    /// Nothing is taken closer to a silhouette than this, pixels …
    pub margin_px: f64,
    /// … plus this, metres on the surface …
    pub margin: f64,
    /// … and trust grows from there over this distance, metres on the surface.
    pub feather: f64,
    /// Information per observation that pulls the shading to zero; see [`crate::shading`].
    pub shading_prior: f64,
    /// The same for the gains of the views.
    pub gain_prior: f64,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            size: 2048,
            method: Method::Default,
            shading: true,
            angle_power: 4.0,
            max_angle: 80f64.to_radians(),
            margin_px: 1.5,
            margin: 0.002,
            feather: 0.008,
            shading_prior: 1e-3,
            gain_prior: 2e-3,
        }
    }
}

/// What became of one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewReport {
    /// Whether it shows the head.
    pub used: bool,
    /// Brightness per channel compared with the other views, as a factor.
    pub gain: [f64; 3],
    /// Share of the seen surface that takes its detail from this view.
    pub share: f64,
}

/// A texture and how it came about.
#[derive(Clone, Debug)]
pub struct Baked {
    /// sRGB; alpha 255 where a view saw the surface, less where it was filled (see [`crate::fill`]).
    pub texture: RgbaImage,
    /// Share of the islands' texels that a view saw.
    pub coverage: f64,
    /// The light of the pictures relative to the texture's, to light the head as in a frame.
    pub shading: Option<Shading>,
    /// One per view, in order.
    pub views: Vec<ViewReport>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Times of the steps, in parts: the atlas unwrapped, views compared, blended, gaps filled.
const PARTS: [f64; 4] = [5.0, 40.0, 40.0, 15.0];

/// Makes the texture of a surface from views of it; `occluders` hide it but are not textured.
///
/// Views that do not show the head are left out with a warning; it is an error when none does.
pub fn bake(
    surface: &Surface,
    occluders: &[Occluder],
    views: &[View],
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Baked, TextureError> {
    validate(surface, occluders, views, options)?;
    let [unwrapping, comparing, blending, filling] = progress.split(&PARTS);
    unwrapping.stage("texture: unwrap")?;
    let size = match options.method {
        Method::Paper => options.size as usize,
        Method::Default => telling_size(surface, options.size as usize, finest_density(views)),
    };
    let map = texel_map(surface.uvs, size)?;
    let blended = match options.method {
        Method::Paper => {
            let (colours, shares) = paper::bake(surface, views, &map);
            let report = |&share: &f64| ViewReport { used: share > 0.0, gain: [1.0; 3], share };
            let reports: Vec<_> = shares.iter().map(report).collect();
            if reports.iter().all(|r| !r.used) {
                return Err(TextureError::HeadNotSeen { views: views.len() });
            }
            Blended { colours, shading: None, reports, warnings: Vec::new() }
        }
        Method::Default => blend_views(surface, occluders, views, options, &map, [&comparing, &blending])?,
    };
    filling.stage("texture: fill")?;
    let islands = map.data.iter().filter(|f| f.triangle != NO_TRIANGLE).count();
    let coverage = blended.colours.data.iter().filter(|t| t[3] >= 0.5).count() as f64 / islands as f64;
    let mut warnings = blended.warnings;
    if coverage < LOW_COVERAGE {
        warnings.push(Warning::LowCoverage { percent: 100.0 * coverage });
    }
    let filled = fill(blended.colours, surface, &map);
    drop(map);
    let texture = filled.picture(surface.uvs, options.size as usize);
    Ok(Baked { texture, coverage, shading: blended.shading, views: blended.reports, warnings })
}

/// Colours with certainty 0…1, before filling.
struct Blended {
    colours: Plane<Texel>,
    shading: Option<Shading>,
    reports: Vec<ViewReport>,
    warnings: Vec<Warning>,
}

fn blend_views(
    surface: &Surface,
    occluders: &[Occluder],
    views: &[View],
    options: &BakeOptions,
    map: &Plane<Fragment>,
    [comparing, blending]: [&Progress; 2],
) -> Result<Blended, TextureError> {
    comparing.stage("texture: compare views")?;
    let normals = vertex_normals(surface.positions, surface.triangles);
    let finest = finest_density(views);
    let views = with_relative_sharpness(views, finest);
    let sights: Vec<Option<Sight>> =
        views.par_iter().map(|view| Sight::new(surface, &normals, occluders, view, options)).collect();
    comparing.step(1, 2)?;
    let size = map.width.min(COMPARISON_SIZE);
    let small_map = texel_map(surface.uvs, size)?;
    let small = |s: &Option<Sight>| s.as_ref().map(|s| reduce(&s.sample(&small_map)));
    let small: Vec<Option<Plane<Texel>>> = sights.iter().map(small).collect();
    let shows = |plane: &Option<Plane<Texel>>| plane.as_ref().is_some_and(|p| p.data.iter().any(|t| t[3] > 0.0));
    let used: Vec<usize> = (0..views.len()).filter(|&v| shows(&small[v])).collect();
    if used.is_empty() {
        return Err(TextureError::HeadNotSeen { views: views.len() });
    }
    let small: Vec<Plane<Texel>> = small.into_iter().filter(|p| shows(p)).flatten().collect();
    let mut sights: Vec<Sight> =
        sights.into_iter().enumerate().filter(|(v, _)| used.contains(v)).filter_map(|(_, s)| s).collect();
    let poses: Vec<Transform> = sights.iter().map(|s| *s.pose()).collect();
    let cell_normals = cell_normals(surface, &normals, size.div_ceil(2));
    let prior = options.shading.then_some(Prior { shading: options.shading_prior, gain: options.gain_prior });
    let found = compare(&small, &poses, &cell_normals, prior.as_ref());

    let light = found.light.clone().unwrap_or_else(|| Light::none(used.len()));
    let shading = light.shading(Reference::Frontal);
    let (levels, fine) = octaves(surface, map.width, finest);
    let mut blend = Blend::new(map.width, levels, fine);
    let mut atlas = Plane::new(map.width, map.height, [0.0; 4]);
    blending.stage("texture: blend")?;
    for (i, sight) in sights.iter_mut().enumerate() {
        blending.step(i, used.len())?;
        sight.correct(&normals, &shading, &light.gains[i]);
        sight.sample_into(&mut atlas, map, Some(&found.consistency[i]));
        blend.add(&atlas, &found.selection[i]);
    }
    drop(atlas);
    let mut colours = blend.finish();
    let root = 1.0 / options.angle_power.max(0.1) as f32;
    colours.data.par_iter_mut().for_each(|t| t[3] = (t[3].powf(root) / CERTAIN).min(1.0));

    let mut reports = vec![ViewReport { used: false, gain: [1.0; 3], share: 0.0 }; views.len()];
    for (i, &view) in used.iter().enumerate() {
        reports[view] = ViewReport { used: true, gain: light.gains[i].map(f64::exp), share: found.shares[i] };
    }
    let unused = (0..views.len()).filter(|v| !used.contains(v));
    let mut warnings: Vec<_> = unused.map(|view| Warning::ViewWithoutHead { view }).collect();
    if options.shading && used.len() > 1 && found.light.is_none() {
        warnings.push(Warning::NoShading);
    }
    Ok(Blended { colours, shading: found.light.is_some().then_some(shading), reports, warnings })
}

/// The triangle of every texel.
fn texel_map(uvs: &[[Vec2; 3]], size: usize) -> Result<Plane<Fragment>, TextureError> {
    let map = Plane { width: size, height: size, data: texels(uvs, size) };
    let covered = map.data.iter().any(|f| f.triangle != NO_TRIANGLE);
    if covered { Ok(map) } else { Err(TextureError::NoTexels) }
}

/// The finest resolution of any view, pixels per metre at the head's distance.
fn finest_density(views: &[View]) -> f64 {
    let density = |v: &View| (v.camera.fx * v.camera.fy).sqrt() / v.cam_from_head.translation.z.abs().max(1e-3);
    views.iter().map(density).fold(f64::MIN_POSITIVE, f64::max)
}

/// The views with scores of at most about one.
fn with_relative_sharpness<'a>(views: &[View<'a>], finest: f64) -> Vec<View<'a>> {
    let sharpest = views.iter().map(|v| v.sharpness).fold(f64::MIN_POSITIVE, f64::max);
    let relative = |v: &View<'a>| View { sharpness: v.sharpness / sharpest / (finest * finest), ..*v };
    views.iter().map(relative).collect()
}

/// The head-frame normal of each cell of a small atlas; zero outside the islands.
fn cell_normals(surface: &Surface, normals: &[Vec3], size: usize) -> Plane<Vec3> {
    let normal = |f: &Fragment| {
        let corners = surface.triangles.get(f.triangle as usize)?;
        let sum = (0..3).map(|k| normals[corners[k] as usize] * f64::from(f.weights()[k])).sum::<Vec3>();
        sum.try_normalize(1e-6)
    };
    let data = texels(surface.uvs, size).iter().map(|f| normal(f).unwrap_or_else(Vec3::zeros)).collect();
    Plane { width: size, height: size, data }
}

/// Texels per metre of the surface, along an edge, in an atlas of a size.
fn texels_per_metre(surface: &Surface, size: usize) -> f64 {
    let area: f64 = surface.triangles.iter().map(|t| area_normal(surface.positions, t).norm() / 2.0).sum();
    let unwrapped: f64 = surface.uvs.iter().map(|[a, b, c]| (b - a).perp(&(c - a)).abs() / 2.0).sum();
    size as f64 * (unwrapped / area.max(1e-12)).sqrt()
}

/// The size at which views are blended: the atlas's, halved while its texels are still finer than what the pictures tell.
fn telling_size(surface: &Surface, size: usize, pixels_per_metre: f64) -> usize {
    let is_enough =
        |s: usize| s >= COMPARISON_SIZE && texels_per_metre(surface, s) >= TELLING_TEXELS * pixels_per_metre;
    let half = |s: &usize| (s.is_multiple_of(2)).then_some(s / 2).filter(|&s| is_enough(s));
    std::iter::successors(Some(size), half).last().unwrap_or(size)
}

/// Number of octaves of the blend, and how many of them are finer than some eight pixels of the pictures.
fn octaves(surface: &Surface, size: usize, pixels_per_metre: f64) -> (usize, usize) {
    let texels_per_pixel = texels_per_metre(surface, size) / pixels_per_metre;
    let fine = (texels_per_pixel.log2() + 2.0).round().clamp(1.0, 12.0) as usize;
    let deepest = (size as f64).log2() as usize;
    ((fine + 3).min(deepest), fine.min(deepest))
}

fn validate(
    surface: &Surface,
    occluders: &[Occluder],
    views: &[View],
    options: &BakeOptions,
) -> Result<(), TextureError> {
    validate_options(options)?;
    validate_surface(surface)?;
    for occluder in occluders {
        check_indices("triangle", occluder.triangles.as_flattened(), occluder.positions.len())?;
        check_finite("vertex", occluder.positions.iter().flat_map(|p| p.iter()))?;
    }
    if views.is_empty() {
        return Err(TextureError::NoViews);
    }
    for (number, view) in views.iter().enumerate() {
        view.camera.validate()?;
        let expected = (view.camera.width, view.camera.height);
        let sizes = [("picture", Some(view.image.dimensions())), ("mask", view.mask.map(GrayImage::dimensions))];
        for (what, found) in sizes.iter().filter_map(|(what, size)| size.map(|s| (*what, s))) {
            if found != expected {
                return Err(TextureError::SizeMismatch { what, view: number, found, expected });
            }
        }
        check_option("the sharpness of a frame", view.sharpness, view.sharpness > 0.0, "a positive number")?;
        check_finite("pose", view.cam_from_head.rows().as_flattened().iter())?;
    }
    Ok(())
}

fn validate_options(o: &BakeOptions) -> Result<(), TextureError> {
    check_option("the texture's size", f64::from(o.size), (16..=16384).contains(&o.size), "16 to 16384")?;
    check_option("the angle power", o.angle_power, (0.0..=32.0).contains(&o.angle_power), "0 to 32")?;
    let angles = 0.0..=std::f64::consts::FRAC_PI_2;
    check_option("the largest viewing angle", o.max_angle, angles.contains(&o.max_angle), "0 to π/2")?;
    for (name, value) in [
        ("the margin in pixels", o.margin_px),
        ("the margin", o.margin),
        ("the feather", o.feather),
        ("the prior of the shading", o.shading_prior),
        ("the prior of the gains", o.gain_prior),
    ] {
        check_option(name, value, value >= 0.0, "zero or more")?;
    }
    Ok(())
}

/// Checks that lengths, indices and numbers of a surface fit each other.
pub(crate) fn validate_surface(surface: &Surface) -> Result<(), TextureError> {
    let (vertices, triangles) = (surface.positions.len(), surface.triangles.len());
    if triangles == 0 {
        return Err(TextureError::NoTexels);
    }
    for (what, found, expected) in [
        ("triples of texture coordinates", surface.uvs.len(), triangles),
        ("vertex weights", surface.weight.map_or(vertices, <[f64]>::len), vertices),
        ("mirror indices", surface.mirror.map_or(vertices, <[u32]>::len), vertices),
    ] {
        if found != expected {
            return Err(TextureError::LengthMismatch { what, found, expected });
        }
    }
    check_indices("triangle", surface.triangles.as_flattened(), vertices)?;
    check_indices("mirror index", surface.mirror.unwrap_or(&[]), vertices)?;
    check_finite("vertex", surface.positions.iter().flat_map(|p| p.iter()))?;
    check_finite("texture coordinate", surface.uvs.as_flattened().iter().flat_map(|uv| uv.iter()))?;
    check_finite("vertex weight", surface.weight.unwrap_or(&[]).iter())
}

fn check_indices(what: &'static str, indices: &[u32], vertices: usize) -> Result<(), TextureError> {
    match indices.iter().find(|&&i| i as usize >= vertices) {
        Some(&index) => Err(TextureError::IndexOutOfRange { what, index, vertices }),
        None => Ok(()),
    }
}

fn check_finite<'a>(what: &'static str, mut values: impl Iterator<Item = &'a f64>) -> Result<(), TextureError> {
    if values.all(|v| v.is_finite()) { Ok(()) } else { Err(TextureError::NotFinite { what }) }
}

fn check_option(name: &'static str, value: f64, fits: bool, range: &'static str) -> Result<(), TextureError> {
    if fits && value.is_finite() { Ok(()) } else { Err(TextureError::Option { name, value, range }) }
}
