//! A head that turns before a still camera and still lamps, rendered by ray casting of an implicit surface: no
//! triangles, no harmonics, nothing of what the bake assumes.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use geometry::{Camera, Progress, Transform, Vec2, Vec3};
use image::{GrayImage, Luma, Rgb, RgbImage};
use nalgebra::Rotation3;
use std::sync::LazyLock;
use texture::*;

const WALL: Rgb<u8> = Rgb([0, 255, 0]);
const PLATE: Rgb<u8> = Rgb([0, 0, 255]);
const NOISE: f64 = 1.5;
const YAWS: [f64; 7] = [-39.0, -26.0, -13.0, 0.0, 13.0, 26.0, 39.0];
const HELD_OUT: [f64; 3] = [-32.0, 6.0, 20.0];
/// A plate before the left cheek, in the head frame: x and y range, z.
const PLATE_AT: [f64; 5] = [0.03, 0.07, -0.05, -0.02, 0.125];

fn radius(d: &Vec3) -> f64 {
    let nose = 0.02 * (-(d.x * d.x + (d.y + 0.2).powi(2)) / 0.03).exp();
    let nose = if d.z > 0.0 { nose } else { 0.0 };
    0.085 + 0.015 * d.y * d.y + 0.004 * (5.0 * d.x).sin() * (4.0 * d.y).cos() + nose
}

/// Never greener than red.
fn albedo(d: &Vec3) -> [f64; 3] {
    let spots = 0.5 + 0.5 * (31.0 * d.x + 4.0 * d.y).sin() * (27.0 * d.y - 3.0 * d.z).cos();
    let beard = 1.0 / (1.0 + (12.0 * (d.y + 0.35)).exp());
    [0.75 - 0.25 * beard - 0.15 * spots, 0.52 - 0.15 * beard - 0.18 * spots, 0.40 - 0.08 * beard - 0.08 * spots]
}

/// Ambient light, two lamps and a highlight, in the camera frame.
fn light(n: &Vec3, eye: &Vec3) -> ([f64; 3], f64) {
    let lamps = [(Vec3::new(-0.7, -0.5, -0.6), [0.75, 0.72, 0.65]), (Vec3::new(0.9, -0.1, -0.3), [0.25, 0.28, 0.34])];
    let (mut diffuse, mut shine) = ([0.32, 0.33, 0.36], 0.0);
    for (direction, colour) in lamps {
        let direction = direction.normalize();
        (0..3).for_each(|k| diffuse[k] += colour[k] * n.dot(&direction).max(0.0));
        shine += 0.06 * n.dot(&(direction + eye).normalize()).max(0.0).powi(20);
    }
    (diffuse, shine)
}

fn camera() -> Camera {
    Camera { k1: -0.15, k2: 0.05, cx: 118.0, ..Camera::centred(240, 200, 440.0) }
}

fn pose(yaw_deg: f64) -> Transform {
    let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), yaw_deg.to_radians());
    let nod = Rotation3::from_axis_angle(&Vec3::x_axis(), 0.1 * (yaw_deg * 0.1).sin());
    Transform::new(
        Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0) * nod * turn,
        Vec3::new(0.004, -0.003, 0.7),
    )
}

fn gradient(p: &Vec3) -> Vec3 {
    let f = |p: Vec3| p.norm() - radius(&p.normalize());
    Vec3::from_fn(|k, _| {
        let mut h = Vec3::zeros();
        h[k] = 1e-5;
        f(p + h) - f(p - h)
    })
}

/// First point of a ray on the surface, head frame.
fn cast(origin: &Vec3, ray: &Vec3) -> Option<Vec3> {
    let mut t = origin.norm() - 0.14;
    for _ in 0..200 {
        let p = origin + ray * t;
        let f = p.norm() - radius(&p.normalize());
        if f < 1e-7 {
            return Some(p);
        }
        t += 0.5 * f;
        if p.dot(ray) > 0.0 && p.norm() > 0.15 {
            return None;
        }
    }
    None
}

fn colour(pixel: Vec2, pose: &Transform, plate: bool) -> [f64; 3] {
    let bytes = |c: Rgb<u8>| c.0.map(f64::from);
    let head_from_cam = pose.inverse();
    let (origin, ray) = (head_from_cam.translation, head_from_cam.rotation * camera().ray(&pixel));
    let on_plate = origin + ray * ((PLATE_AT[4] - origin.z) / ray.z);
    let in_range = |v: f64, k: usize| (PLATE_AT[k]..PLATE_AT[k + 1]).contains(&v);
    if plate && in_range(on_plate.x, 0) && in_range(on_plate.y, 2) {
        return bytes(PLATE);
    }
    let Some(p) = cast(&origin, &ray) else { return bytes(WALL) };
    let n = pose.rotation * gradient(&p).normalize();
    let (diffuse, shine) = light(&n, &(-pose.apply(&p).normalize()));
    let a = albedo(&p.normalize());
    [0, 1, 2].map(|k| 255.0 * (a[k] * diffuse[k] + shine).powf(0.6).min(1.0))
}

/// Box-filtered over 2×2 rays, with noise.
fn photograph(yaw_deg: f64, plate: bool, noise: f64) -> RgbImage {
    let pose = pose(yaw_deg);
    RgbImage::from_fn(camera().width, camera().height, |x, y| {
        let rays = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];
        let colours = rays.map(|r| colour(Vec2::new(f64::from(x) + r[0], f64::from(y) + r[1]), &pose, plate));
        Rgb([0, 1, 2].map(|k| {
            let mean = colours.iter().map(|c| c[k]).sum::<f64>() / 4.0;
            let seed = f64::from(x) * 12.9898 + f64::from(y) * 78.233 + yaw_deg + k as f64;
            // Uniform of the wanted standard deviation.
            let jitter = ((seed.sin() * 43758.5453).rem_euclid(1.0) - 0.5) * 12f64.sqrt();
            (mean + noise * jitter).round().clamp(0.0, 255.0) as u8
        }))
    })
}

struct Head {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[Vec2; 3]>,
    mirror: Vec<u32>,
}

impl Head {
    /// Meridians and parallels on the surface, unrolled.
    fn new() -> Self {
        let (m, n) = (128u32, 80u32);
        let direction = |i: u32, j: u32| {
            let (a, b) = (2.0 * f64::from(i) / f64::from(m) - 1.0, f64::from(j) / f64::from(n) - 0.5);
            let (a, b) = (a * std::f64::consts::PI, b * std::f64::consts::PI * 0.98);
            Vec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos())
        };
        let mut head = Self { positions: vec![], triangles: vec![], uvs: vec![], mirror: vec![] };
        for j in 0..=n {
            for i in 0..m {
                let d = direction(i, j);
                head.positions.push(d * radius(&d));
                head.mirror.push(j * m + (m - i) % m);
            }
        }
        for j in 0..n {
            for i in 0..m {
                let quad = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                for corners in [[0, 1, 2], [0, 2, 3]] {
                    head.triangles.push(corners.map(|k: usize| quad[k][1] * m + quad[k][0] % m));
                    let uv = |k: usize| {
                        Vec2::new(f64::from(quad[k][0]) / f64::from(m), f64::from(quad[k][1]) / f64::from(n))
                    };
                    head.uvs.push(corners.map(uv));
                }
            }
        }
        head
    }

    fn surface(&self) -> Surface<'_> {
        Surface { positions: &self.positions, triangles: &self.triangles, uvs: &self.uvs, weight: None, mirror: None }
    }
}

static HEAD: LazyLock<Head> = LazyLock::new(Head::new);
static PHOTOGRAPHS: LazyLock<Vec<RgbImage>> =
    LazyLock::new(|| YAWS.iter().map(|&yaw| photograph(yaw, false, NOISE)).collect());

fn view(image: &RgbImage, yaw_deg: f64) -> View<'_> {
    View { image, camera: camera(), cam_from_head: pose(yaw_deg), mask: None, sharpness: 1.0 }
}

fn views() -> Vec<View<'static>> {
    PHOTOGRAPHS.iter().zip(YAWS).map(|(image, yaw)| view(image, yaw)).collect()
}

fn options(method: Method) -> BakeOptions {
    BakeOptions { size: 512, method, ..BakeOptions::default() }
}

fn baked(options: &BakeOptions) -> Baked {
    bake(&HEAD.surface(), &[], &views(), options, &Progress::new()).unwrap()
}

/// Mean PSNR of held-out views, inside the drawn mask without its border.
fn psnr(baked: &Baked) -> f64 {
    let painter = Painter::new(&[Layer { surface: HEAD.surface(), texture: &baked.texture }]).unwrap();
    let shading = DrawOptions { shading: baked.shading.as_ref(), ..DrawOptions::default() };
    let one = |yaw: f64| {
        let (drawn, truth) = (painter.draw(&camera(), &pose(yaw), &shading).unwrap(), photograph(yaw, false, 0.0));
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y, pixel) in drawn.enumerate_pixels().filter(|(x, y, _)| *x > 2 && *y > 2 && *x < 237 && *y < 197) {
            let whole = (0..5).all(|j| (0..5).all(|i| drawn.get_pixel(x + i - 2, y + j - 2)[3] == 255));
            if whole {
                sum += (0..3).map(|k| (f64::from(pixel[k]) - f64::from(truth.get_pixel(x, y)[k])).powi(2)).sum::<f64>();
                count += 3.0;
            }
        }
        assert!(count > 10_000.0);
        10.0 * (255.0f64.powi(2) * count / sum).log10()
    };
    HELD_OUT.iter().map(|&yaw| one(yaw)).sum::<f64>() / HELD_OUT.len() as f64
}

/// Texels that are greener or bluer than skin can be.
fn foreign_texels(baked: &Baked) -> usize {
    baked
        .texture
        .pixels()
        .filter(|p| p[3] > 0 && (p[1] > p[0].saturating_add(12) || p[2] > p[0].saturating_add(12)))
        .count()
}

#[test]
fn held_out_views_are_redrawn_and_better_than_by_the_papers_method() {
    let ours = psnr(&baked(&options(Method::Default)));
    let unshaded = psnr(&baked(&BakeOptions { shading: false, ..options(Method::Default) }));
    let paper = psnr(&baked(&options(Method::Paper)));
    println!("PSNR {ours:.1} dB, without shading {unshaded:.1} dB, paper {paper:.1} dB");
    // Noise alone allows 44.6 dB; the light is no polynomial and the pixels are resampled twice.
    assert!(ours > 32.0 && ours > unshaded + 3.0 && ours > paper + 4.0);
}

#[test]
fn no_texel_has_the_colour_of_the_wall() {
    let baked = baked(&options(Method::Default));
    assert_eq!(foreign_texels(&baked), 0);
    assert!(baked.coverage > 0.35 && baked.warnings.is_empty(), "{} {:?}", baked.coverage, baked.warnings);
    let shares: f64 = baked.views.iter().map(|v| v.share).sum();
    assert!((shares - 1.0).abs() < 1e-9);
}

fn with_plate() -> Vec<RgbImage> {
    YAWS.iter().map(|&yaw| photograph(yaw, true, NOISE)).collect()
}

#[test]
fn an_occluder_leaves_no_trace() {
    let pictures = with_plate();
    let views: Vec<_> = pictures.iter().zip(YAWS).map(|(image, yaw)| view(image, yaw)).collect();
    let [x0, x1, y0, y1, z] = PLATE_AT;
    let positions = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|p| Vec3::new(p[0], p[1], z));
    let plate = Occluder { positions: &positions, triangles: &[[0, 1, 2], [0, 2, 3]] };
    let options = options(Method::Default);
    let hidden = bake(&HEAD.surface(), &[plate], &views, &options, &Progress::new()).unwrap();
    assert_eq!(foreign_texels(&hidden), 0);
    let shown = bake(&HEAD.surface(), &[], &views, &options, &Progress::new()).unwrap();
    assert!(foreign_texels(&shown) > 100, "the plate must be visible to a bake that does not know it");
}

#[test]
fn a_hand_in_one_view_is_outvoted_or_masked() {
    let mut picture = PHOTOGRAPHS[3].clone();
    let hand = |x: u32, y: u32| (100..140).contains(&x) && (90..120).contains(&y);
    picture.enumerate_pixels_mut().filter(|(x, y, _)| hand(*x, *y)).for_each(|(_, _, p)| *p = PLATE);
    let mask = GrayImage::from_fn(240, 200, |x, y| Luma([if hand(x, y) { 0 } else { 255 }]));
    for mask in [None, Some(&mask)] {
        let mut views = views();
        views[3] = View { image: &picture, mask, ..views[3] };
        let baked = bake(&HEAD.surface(), &[], &views, &options(Method::Default), &Progress::new()).unwrap();
        let foreign = foreign_texels(&baked);
        assert!(foreign <= if mask.is_some() { 0 } else { 300 }, "{foreign} of {} texels", 512 * 512);
    }
}

#[test]
fn one_view_is_enough_and_its_far_side_is_filled_from_the_mirror() {
    let views = [views()[1]];
    let surface = Surface { mirror: Some(&HEAD.mirror), ..HEAD.surface() };
    let baked = bake(&surface, &[], &views, &options(Method::Default), &Progress::new()).unwrap();
    assert!(baked.shading.is_none() && baked.views[0].gain == [1.0; 3]);
    assert!(baked.texture.pixels().any(|p| p[3] == fill::ALPHA_MIRRORED));
    assert_eq!(foreign_texels(&baked), 0);
}

#[test]
fn views_without_the_head_are_named_and_alone_refused() {
    let elsewhere = View { cam_from_head: Transform::new(pose(0.0).rotation, Vec3::new(3.0, 0.0, 0.7)), ..views()[0] };
    let behind = View { cam_from_head: Transform::new(pose(0.0).rotation, Vec3::new(0.0, 0.0, -0.7)), ..views()[0] };
    let some = [elsewhere, views()[2], views()[3], behind];
    let progress = Progress::new();
    let baked = bake(&HEAD.surface(), &[], &some, &options(Method::Default), &progress).unwrap();
    assert!(baked.warnings.contains(&Warning::ViewWithoutHead { view: 0 }));
    assert!(baked.warnings.contains(&Warning::ViewWithoutHead { view: 3 }));
    for method in [Method::Default, Method::Paper] {
        let error = bake(&HEAD.surface(), &[], &[elsewhere, behind], &options(method), &progress).unwrap_err();
        assert_eq!(error, TextureError::HeadNotSeen { views: 2 });
        assert_eq!(bake(&HEAD.surface(), &[], &[], &options(method), &progress).unwrap_err(), TextureError::NoViews);
    }
}

#[test]
fn bad_input_is_refused_with_a_sentence() {
    let progress = Progress::new();
    let run = |surface: &Surface, views: &[View], options: &BakeOptions| {
        bake(surface, &[], views, options, &progress).unwrap_err().to_string()
    };
    let (surface, options) = (HEAD.surface(), options(Method::Default));
    assert!(run(&Surface { uvs: &HEAD.uvs[1..], ..surface }, &views(), &options).contains("unwrap"));
    assert!(run(&Surface { positions: &HEAD.positions[1..], ..surface }, &views(), &options).contains("names vertex"));
    assert!(run(&Surface { triangles: &[], uvs: &[], ..surface }, &views(), &options).contains("no faces"));
    let small = RgbImage::new(8, 8);
    assert!(run(&surface, &[View { image: &small, ..views()[0] }], &options).contains("one size"));
    assert!(run(&surface, &views(), &BakeOptions { size: 3, ..options }).contains("16 to 16384"));
    assert!(run(&surface, &[View { sharpness: f64::NAN, ..views()[0] }], &options).contains("sharpness"));
    progress.cancel();
    assert_eq!(run(&surface, &views(), &options), "cancelled");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| baked(&BakeOptions { size: 256, ..options(Method::Default) }))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.texture, three.texture);
    assert_eq!(one.shading, three.shading);
}

#[test]
fn a_drawing_is_transparent_outside_the_head_and_soft_at_its_border() {
    let baked = baked(&options(Method::Default));
    let layer = Layer { surface: HEAD.surface(), texture: &baked.texture };
    let drawn = draw(&[layer], &camera(), &pose(10.0), &DrawOptions::default()).unwrap();
    assert_eq!(drawn.get_pixel(3, 3)[3], 0);
    assert_eq!(drawn.get_pixel(118, 100)[3], 255);
    assert!(drawn.pixels().any(|p| p[3] == 128));
    let away = Transform::new(pose(0.0).rotation, Vec3::new(5.0, 0.0, 0.7));
    assert!(draw(&[layer], &camera(), &away, &DrawOptions::default()).unwrap().pixels().all(|p| p[3] == 0));
    assert!(draw(&[layer], &camera(), &away, &DrawOptions { supersampling: 0, ..DrawOptions::default() }).is_err());
}
