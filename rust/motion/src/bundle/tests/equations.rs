//! The normal equations against differences of the cost.

use super::*;

/// Half of the cost's derivative along a change of the state.
fn slope(layout: &Layout, state: &State, step: f64, change: &dyn Fn(&mut State, f64)) -> f64 {
    let cost = |h: f64| {
        let mut moved = state.clone();
        change(&mut moved, h);
        layout.cost(&moved)
    };
    (cost(step) - cost(-step)) / (4.0 * step)
}

#[test]
fn gradients_are_the_costs_derivatives_for_every_lens_and_loss() {
    let bent = Camera { k3: -0.03, p1: 0.004, p2: -0.003, ..lens() };
    for (camera, loss) in [(bent, Loss::Squared), (lens(), Loss::Huber(2.0)), (bent, Loss::Cauchy(2.0))] {
        let scene = Scene::turning_head(&SceneOptions { frames: 5, points: 90, camera, ..SceneOptions::default() });
        let bundle = nudged(&scene, 0.3, 0.01, 0.002);
        let options = BundleOptions {
            loss,
            refine_focal: true,
            refine_distortion: true,
            focal_prior: Some(FocalPrior { focal_px: 600.0, log_sigma: 0.01 }),
            lens_prior: Some(LensPrior {
                principal_px: Vec2::new(170.0, 150.0),
                principal_sigma_px: 4.0,
                k1: -0.1,
                k1_sigma: 0.1,
            }),
            ..BundleOptions::default()
        };
        let layout = Layout::new(&bundle, &options).unwrap();
        let state = State { camera, poses: bundle.poses.clone(), points: bundle.points.clone() };
        let mut linearised = Linearised::new(&layout);
        layout.linearise(&state, &mut linearised);
        assert!((linearised.cost / layout.cost(&state) - 1.0).abs() < 1e-12);
        let near = |found: f64, numeric: f64, what: &str| {
            assert!((found - numeric).abs() < 1e-4 * (numeric.abs() + 100.0), "{loss:?} {what}: {found} {numeric}");
        };
        for k in 0..6 {
            let change = |s: &mut State, h: f64| s.poses[3] = s.poses[3].retract(&Vector6::ith(k, h));
            near(linearised.frames[3].gradient()[k], slope(&layout, &state, 1e-6, &change), "pose");
        }
        let point = layout.points[70];
        let block = &linearised.chunks[1].points[70 - linearised.chunks[0].points.len()];
        for k in 0..3 {
            let change = |s: &mut State, h: f64| s.points[point][k] += h;
            near(block.gradient()[k], slope(&layout, &state, 1e-6, &change), "point");
        }
        let log_focal =
            |s: &mut State, h: f64| (s.camera.fx, s.camera.fy) = (s.camera.fx * h.exp(), s.camera.fy * h.exp());
        near(linearised.camera.gradient[0], slope(&layout, &state, 1e-6, &log_focal), "focal length");
        near(linearised.camera.gradient[1], slope(&layout, &state, 1e-5, &|s, h| s.camera.k1 += h), "k1");
        near(linearised.camera.gradient[2], slope(&layout, &state, 1e-5, &|s, h| s.camera.k2 += h), "k2");
        near(linearised.camera.gradient[3], slope(&layout, &state, 1e-5, &|s, h| s.camera.cx += h), "cx");
        near(linearised.camera.gradient[4], slope(&layout, &state, 1e-5, &|s, h| s.camera.cy += h), "cy");
    }
}
