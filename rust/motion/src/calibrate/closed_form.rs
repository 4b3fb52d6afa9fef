//! A first camera from homographies, in closed form (Zhang 1999, section 3.1 and 3.3).
//!
//! Columns of `A⁻¹ H` are a rotation's: each picture gives two linear equations for the image of the absolute conic
//! `B = A⁻ᵀ A⁻¹`. Distortion follows by linear least squares from the residuals of the undistorted camera.

use super::{BoardView, Model};
use geometry::{Camera, Mat3, Transform, Vec2, Vec3};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Camera and boards to refine from: the closed form, and a camera of usual focal length where it has no answer.
pub(super) fn start(
    views: &[BoardView],
    homographies: &[Mat3],
    (width, height): (u32, u32),
    model: &Model,
) -> (Camera, Vec<Transform>) {
    let usual = || Camera::centred(width, height, 1.2 * f64::from(width.max(height)));
    let mut camera = camera(homographies, width, height).unwrap_or_else(usual);
    if model.square_pixels {
        camera.fx = (camera.fx * camera.fy).sqrt();
        camera.fy = camera.fx;
    }
    let poses: Vec<Transform> = homographies.iter().map(|h| pose(&camera, h)).collect();
    let seen = |camera: &Camera| {
        let in_camera = |(view, pose): (&BoardView, &Transform)| {
            view.points.iter().all(|p| camera.project(&pose.apply(&p.push(0.0))).is_some())
        };
        views.iter().zip(&poses).all(in_camera)
    };
    let pairs = views.iter().zip(&poses).flat_map(|(view, pose)| {
        view.points.iter().zip(&view.pixels).map(|(point, pixel)| (pose.apply(&point.push(0.0)), *pixel))
    });
    let distorted = distortion(&camera, model.distortion_terms, pairs).filter(seen);
    (distorted.unwrap_or(camera), poses)
}

/// The camera without distortion and without skew whose conic fits all homographies best; where that is no camera, the
/// one with its principal point in the centre; `None` where neither is one.
fn camera(homographies: &[Mat3], width: u32, height: u32) -> Option<Camera> {
    let middle = Camera::centred(width, height, f64::from(width.max(height)));
    // Pixels are brought near 1 so that the linear system is well conditioned.
    let unit = Mat3::new(
        1.0 / middle.fx,
        0.0,
        -middle.cx / middle.fx, //
        0.0,
        1.0 / middle.fx,
        -middle.cy / middle.fx, //
        0.0,
        0.0,
        1.0,
    );
    let scaled: Vec<Mat3> = homographies.iter().map(|h| unit * h).collect();
    let [fx, fy, cx, cy] = free_centre(&scaled).or_else(|| fixed_centre(&scaled))?;
    let pixels = |x: f64| x * middle.fx;
    Some(Camera { fx: pixels(fx), fy: pixels(fy), cx: pixels(cx) + middle.cx, cy: pixels(cy) + middle.cy, ..middle })
}

/// `hᵢᵀ B hⱼ` as a row for the unknowns `B₁₁ B₂₂ B₁₃ B₂₃ B₃₃` (no skew: `B₁₂ = 0`).
fn conic_row(h: &Mat3, i: usize, j: usize) -> SVector<f64, 5> {
    let (a, b) = (h.column(i), h.column(j));
    SVector::from([a[0] * b[0], a[1] * b[1], a[2] * b[0] + a[0] * b[2], a[2] * b[1] + a[1] * b[2], a[2] * b[2]])
}

/// Each homography's two equations: orthogonal columns, and columns of one length.
fn conic_rows(h: &Mat3) -> [SVector<f64, 5>; 2] {
    let h = h / h.fixed_view::<3, 2>(0, 0).norm();
    [conic_row(&h, 0, 1), conic_row(&h, 0, 0) - conic_row(&h, 1, 1)]
}

/// `[fx, fy, cx, cy]`; refused where the conic is no camera's or its centre is outside the picture.
fn free_centre(homographies: &[Mat3]) -> Option<[f64; 4]> {
    let mut normal = SMatrix::<f64, 5, 5>::zeros();
    for row in homographies.iter().flat_map(conic_rows) {
        normal += row * row.transpose();
    }
    let eigen = normal.symmetric_eigen();
    let smallest = (0..5).min_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]))?;
    let b = eigen.eigenvectors.column(smallest);
    let (cx, cy) = (-b[2] / b[0], -b[3] / b[1]);
    let scale = b[4] + b[2] * cx + b[3] * cy;
    let (fx, fy) = ((scale / b[0]).sqrt(), (scale / b[1]).sqrt());
    let plausible = fx.is_finite() && fy.is_finite() && (0.5..2.0).contains(&(fx / fy)) && cx.abs().max(cy.abs()) < 0.5;
    plausible.then_some([fx, fy, cx, cy])
}

/// As [`free_centre`] with the principal point in the centre: linear in `1/fx², 1/fy²`.
fn fixed_centre(homographies: &[Mat3]) -> Option<[f64; 4]> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for row in homographies.iter().flat_map(conic_rows) {
        let a = Vector2::new(row[0], row[1]);
        normal += a * a.transpose();
        right -= a * row[4];
    }
    let inverse = normal.cholesky()?.solve(&right);
    let focal = inverse.map(|v| (1.0 / v).sqrt());
    focal.iter().all(|f| f.is_finite()).then(|| [focal.x, focal.y, 0.0, 0.0])
}

/// The board's pose of a homography from board metres to pixels of an undistorted camera.
fn pose(camera: &Camera, homography: &Mat3) -> Transform {
    let column = |k: usize| {
        let h = homography.column(k);
        Vec3::new((h[0] - camera.cx * h[2]) / camera.fx, (h[1] - camera.cy * h[2]) / camera.fy, h[2])
    };
    let (a, b, t) = (column(0), column(1), column(2));
    // The board is before the camera.
    let scale = 2.0 / (a.norm() + b.norm()) * if t.z < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = (a * scale, b * scale);
    Transform::from_matrix(&Mat3::from_columns(&[a, b, a.cross(&b)]), t * scale)
}

/// The camera with `k1`, and with two and more terms `k2`, by linear least squares from where it puts the points without
/// distortion (Zhang 1999, equation 13).
fn distortion(camera: &Camera, terms: usize, observations: impl Iterator<Item = (Vec3, Vec2)>) -> Option<Camera> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (point, pixel) in observations.filter(|(p, _)| p.z > 0.0) {
        let normalised = point.xy() / point.z;
        let (ideal, r2) = (camera.distort(&normalised), normalised.norm_squared());
        let from_centre = ideal - Vec2::new(camera.cx, camera.cy);
        for (c, residual) in [(from_centre.x, pixel.x - ideal.x), (from_centre.y, pixel.y - ideal.y)] {
            let row = Vector2::new(c * r2, c * r2 * r2);
            normal += row * row.transpose();
            right += row * residual;
        }
    }
    match terms {
        0 => None,
        1 => Some(Camera { k1: right.x / normal.m11, ..*camera }),
        _ => normal.cholesky().map(|factor| factor.solve(&right)).map(|k| Camera { k1: k.x, k2: k.y, ..*camera }),
    }
}
