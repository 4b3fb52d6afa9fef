//! The paper's texture: each triangle from the view whose normal looks most at the camera.
//!
//! Among the views that hold the whole triangle, `x = argmax_i n_i · (0, 0, −1)` with `n_i` the triangle's normal in the
//! camera's frame; the triangle takes its colours from picture `x` alone. Nothing is blended, and what hides the
//! triangle is not looked for (paper, section 2.7).

use crate::atlas::{Surface, View};
use crate::plane::{Plane, Texel};
use crate::sample::{Corner, bilinear, locate};
use geometry::mesh::area_normal;
use raster::{Fragment, NO_TRIANGLE, project};

/// Colours of the texels whose triangle some view faces, and each view's share of those triangles.
pub(crate) fn bake(surface: &Surface, views: &[View], map: &Plane<Fragment>) -> (Plane<Texel>, Vec<f64>) {
    let corners: Vec<Vec<Corner>> = views
        .iter()
        .map(|v| project(&v.camera, &v.cam_from_head, surface.positions).iter().map(|p| Corner::new(p, 1.0)).collect())
        .collect();
    let choice = choose(surface, views);
    let colours = Plane::from_rows(map.width, map.height, [0.0; 4], |y, row| {
        for (texel, fragment) in row.iter_mut().zip(map.row(y)).filter(|(_, f)| f.triangle != NO_TRIANGLE) {
            let Some(view) = choice[fragment.triangle as usize] else { continue };
            let triangle = surface.triangles[fragment.triangle as usize].map(|i| &corners[view][i as usize]);
            let ([u, v], _) = locate(&triangle, &fragment.weights());
            let [r, g, b] = bilinear(views[view].image, u, v);
            *texel = [r, g, b, 1.0];
        }
    });
    let seen = choice.iter().flatten().count().max(1) as f64;
    let shares = (0..views.len()).map(|v| choice.iter().filter(|&&c| c == Some(v)).count() as f64 / seen).collect();
    (colours, shares)
}

/// The view of each triangle; the earlier one of equals.
fn choose(surface: &Surface, views: &[View]) -> Vec<Option<usize>> {
    let mut best = vec![(0.0, None); surface.triangles.len()];
    for (number, view) in views.iter().enumerate() {
        let (width, height) = (f64::from(view.camera.width), f64::from(view.camera.height));
        let inside: Vec<bool> = project(&view.camera, &view.cam_from_head, surface.positions)
            .iter()
            .map(|p| {
                p.is_some_and(|p| (0.0..=width - 1.0).contains(&p.pixel.x) && (0.0..=height - 1.0).contains(&p.pixel.y))
            })
            .collect();
        for (triangle, best) in surface.triangles.iter().zip(&mut best) {
            let normal = view.cam_from_head.rotation * area_normal(surface.positions, triangle);
            let facing = -normal.z / normal.norm().max(1e-300);
            if facing > best.0 && triangle.iter().all(|&i| inside[i as usize]) {
                *best = (facing, Some(number));
            }
        }
    }
    best.into_iter().map(|(_, view)| view).collect()
}
