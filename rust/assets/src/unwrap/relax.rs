//! Evens out a fold-free embedding without ever folding it.
//!
//! Minimises the symmetric Dirichlet energy `Σ w A (‖J‖² + ‖J⁻¹‖²)` of the maps from scaled surface triangles to the
//! plane by Newton's method with the energy's Hessian made positive by its closed-form eigensystem (Smith, De Goes,
//! Kim, Analytic Eigensystems for Isotropic Distortion Energies, 2019), steps limited to where no triangle folds (Smith,
//! Schaefer, Bijective Parameterization with Free Boundaries, 2015). Both diagonals of a quad count, so quads stay convex.

use geometry::Vec2;
use nalgebra::Matrix2;

type Mat2 = Matrix2<f64>;

/// A triangle with its wanted shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    corners: [usize; 3],
    /// Gradients of the corners' hat functions on the wanted triangle.
    gradients: [Vec2; 3],
    /// Area of the wanted triangle times its importance.
    weight: f64,
}

impl Element {
    /// From side lengths opposite to the corners' order `[01, 12, 20]`; slivers are opened to a tenth of their longest side.
    pub fn new(corners: [u32; 3], sides: [f64; 3], importance: f64) -> Self {
        let longest = sides.iter().fold(0.0_f64, |m, &s| m.max(s)).max(1e-12);
        let [base, _, left] = sides.map(|s| s.max(0.1 * longest));
        let x = (base * base + left * left - sides[1].max(0.1 * longest).powi(2)) / (2.0 * base);
        let y = (left * left - x * x).max(0.0).sqrt().max(0.1 * longest);
        let inverse = Mat2::new(1.0 / base, -x / (base * y), 0.0, 1.0 / y);
        let (g1, g2) = (inverse.row(0).transpose(), inverse.row(1).transpose());
        let gradients = [-(g1 + g2), g1, g2];
        Self { corners: corners.map(|c| c as usize), gradients, weight: 0.5 * base * y * importance }
    }

    fn jacobian(&self, uv: &[Vec2]) -> Mat2 {
        (0..3).fold(Mat2::zeros(), |j, k| j + uv[self.corners[k]] * self.gradients[k].transpose())
    }

    /// Infinite for folded triangles.
    fn energy(&self, uv: &[Vec2]) -> f64 {
        let j = self.jacobian(uv);
        let det = j.determinant();
        if det <= 0.0 {
            return f64::INFINITY;
        }
        self.weight * j.norm_squared() * (1.0 + 1.0 / (det * det))
    }

    /// Largest share of a step that keeps the triangle's area positive.
    fn limit(&self, uv: &[Vec2], step: &[Vec2]) -> f64 {
        let [a, b, c] = self.corners;
        let (p, q) = (uv[b] - uv[a], uv[c] - uv[a]);
        let (dp, dq) = (step[b] - step[a], step[c] - step[a]);
        let (square, linear, constant) = (dp.perp(&dq), p.perp(&dq) + dp.perp(&q), p.perp(&q));
        let discriminant = linear * linear - 4.0 * square * constant;
        if discriminant < 0.0 {
            return f64::INFINITY;
        }
        // The root that doesn't cancel, and its partner.
        let half = -0.5 * (linear + discriminant.sqrt().copysign(linear));
        let positive = |t: f64| if t > 0.0 { t } else { f64::INFINITY };
        positive(half / square).min(positive(constant / half))
    }
}

/// Moves the free coordinates of `uv` until the energy stands still; returns its weighted mean, 4 for an isometry and
/// infinite if there were folds from the start.
pub(super) fn relax(elements: &[Element], free: &[[bool; 2]], edges: &[[u32; 2]], uv: &mut Vec<Vec2>) -> f64 {
    let energy = |uv: &[Vec2]| elements.iter().map(|e| e.energy(uv)).sum::<f64>();
    let weight: f64 = elements.iter().map(|e| e.weight).sum();
    let mut system = System::new(uv.len(), edges);
    let mut current = energy(uv);
    if current.is_infinite() {
        return current;
    }
    for _ in 0..300 {
        system.assemble(elements, uv, free);
        let step = system.solve();
        let slope: f64 = -step.iter().zip(&system.gradient).map(|(s, g)| s.dot(g)).sum::<f64>();
        let limit = elements.iter().map(|e| e.limit(uv, &step)).fold(f64::INFINITY, f64::min);
        let mut length = (0.9 * limit).min(1.0);
        let moved = loop {
            let trial: Vec<Vec2> = uv.iter().zip(&step).map(|(p, s)| p + s * length).collect();
            let value = energy(&trial);
            if value <= current - 1e-4 * length * slope {
                *uv = trial;
                break current - value;
            }
            length *= 0.5;
            if length < 1e-12 {
                break 0.0;
            }
        };
        current -= moved;
        if moved <= 1e-7 * current {
            break;
        }
    }
    current / weight
}

/// The Newton system in 2×2 blocks: a diagonal, and one block for each edge direction.
struct System {
    rows: Vec<usize>,
    columns: Vec<usize>,
    blocks: Vec<Mat2>,
    diagonal: Vec<Mat2>,
    gradient: Vec<Vec2>,
}

impl System {
    fn new(n: usize, edges: &[[u32; 2]]) -> Self {
        let rings = geometry::mesh::neighbours(n, edges);
        let mut rows = vec![0];
        let mut columns = Vec::new();
        for mut ring in rings {
            ring.sort_unstable();
            columns.extend(ring.iter().map(|&j| j as usize));
            rows.push(columns.len());
        }
        let blocks = vec![Mat2::zeros(); columns.len()];
        Self { rows, columns, blocks, diagonal: vec![Mat2::zeros(); n], gradient: vec![Vec2::zeros(); n] }
    }

    fn assemble(&mut self, elements: &[Element], uv: &[Vec2], free: &[[bool; 2]]) {
        self.blocks.fill(Mat2::zeros());
        self.diagonal.fill(Mat2::zeros());
        self.gradient.fill(Vec2::zeros());
        for element in elements {
            self.add(element, uv);
        }
        self.fix(free);
    }

    fn add(&mut self, element: &Element, uv: &[Vec2]) {
        let j = element.jacobian(uv);
        let det = j.determinant();
        let inverse_square = 1.0 / (det * det);
        let cofactor = Mat2::new(j[(1, 1)], -j[(1, 0)], -j[(0, 1)], j[(0, 0)]);
        let first = j * (2.0 * (1.0 + inverse_square)) - cofactor * (2.0 * j.norm_squared() * inverse_square / det);
        let modes = modes(&j);
        for k in 0..3 {
            let (a, g) = (element.corners[k], element.gradients[k]);
            self.gradient[a] += first * g * element.weight;
            for l in 0..3 {
                let (b, h) = (element.corners[l], element.gradients[l]);
                let block = modes.iter().fold(Mat2::zeros(), |sum, (value, mode)| {
                    sum + (mode * g) * (mode * h).transpose() * (value * element.weight)
                });
                if k == l {
                    self.diagonal[a] += block;
                } else if let Ok(slot) = self.columns[self.rows[a]..self.rows[a + 1]].binary_search(&b) {
                    self.blocks[self.rows[a] + slot] += block;
                }
            }
        }
    }

    /// Takes the fixed coordinates out: unit rows and columns, no force.
    fn fix(&mut self, free: &[[bool; 2]]) {
        let mask = |v: usize| Vec2::new(f64::from(u8::from(free[v][0])), f64::from(u8::from(free[v][1])));
        for (a, axes) in free.iter().enumerate() {
            let keep = mask(a);
            self.gradient[a].component_mul_assign(&keep);
            for (k, free) in axes.iter().enumerate() {
                if !free {
                    self.diagonal[a].fill_row(k, 0.0);
                    self.diagonal[a].fill_column(k, 0.0);
                    self.diagonal[a][(k, k)] = 1.0;
                }
            }
            for slot in self.rows[a]..self.rows[a + 1] {
                let outer = keep * mask(self.columns[slot]).transpose();
                self.blocks[slot].component_mul_assign(&outer);
            }
        }
    }

    fn apply(&self, x: &[Vec2]) -> Vec<Vec2> {
        let row = |a: usize| {
            let slots = self.rows[a]..self.rows[a + 1];
            slots.fold(self.diagonal[a] * x[a], |sum, s| sum + self.blocks[s] * x[self.columns[s]])
        };
        (0..x.len()).map(row).collect()
    }

    /// The descent direction, by conjugate gradients with the diagonal blocks as preconditioner.
    fn solve(&self) -> Vec<Vec2> {
        let inverse: Vec<Mat2> = self.diagonal.iter().map(|d| d.try_inverse().unwrap_or_else(Mat2::identity)).collect();
        let dot = |a: &[Vec2], b: &[Vec2]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let precondition = |r: &[Vec2]| r.iter().zip(&inverse).map(|(r, m)| m * r).collect::<Vec<Vec2>>();
        let mut x = vec![Vec2::zeros(); self.gradient.len()];
        let mut residual: Vec<Vec2> = self.gradient.iter().map(|g| -g).collect();
        let mut direction = precondition(&residual);
        let mut energy = dot(&residual, &direction);
        let goal = energy * 1e-6;
        for _ in 0..600 {
            let image = self.apply(&direction);
            let curvature = dot(&direction, &image);
            if energy <= goal || curvature <= 0.0 {
                break;
            }
            let step = energy / curvature;
            for i in 0..x.len() {
                x[i] += direction[i] * step;
                residual[i] -= image[i] * step;
            }
            let preconditioned = precondition(&residual);
            let next = dot(&residual, &preconditioned);
            for (d, p) in direction.iter_mut().zip(&preconditioned) {
                *d = p + *d * (next / energy);
            }
            energy = next;
        }
        x
    }
}

/// Eigenvalues, negative ones cut off, and eigenmatrices of the energy's second derivative by the Jacobian.
fn modes(j: &Mat2) -> [(f64, Mat2); 4] {
    // Signed singular values from the similar and the anti-similar part: u, v are rotations.
    let (e, f) = ((j[(0, 0)] + j[(1, 1)]) / 2.0, (j[(0, 0)] - j[(1, 1)]) / 2.0);
    let (g, h) = ((j[(1, 0)] + j[(0, 1)]) / 2.0, (j[(1, 0)] - j[(0, 1)]) / 2.0);
    let (q, r) = (e.hypot(h), f.hypot(g));
    let s1 = q + r;
    // Not q − r, which cancels where a triangle is a sliver.
    let s2 = j.determinant() / s1;
    let (a1, a2) = (g.atan2(f), h.atan2(e));
    let rotation = |t: f64| Mat2::new(t.cos(), -t.sin(), t.sin(), t.cos());
    let (u, vt) = (rotation((a2 + a1) / 2.0), rotation((a2 - a1) / 2.0));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let slope = |s: f64| 2.0 * s - 2.0 / (s * s * s);
    let stretch = |s: f64| 2.0 + 6.0 / (s * s * s * s);
    let product = s1 * s2;
    let twist = (slope(s1) + slope(s2)) / (s1 + s2);
    let flip = 2.0 + 2.0 * (s1 * s1 + product + s2 * s2) / (product * product * product);
    [
        (stretch(s1), u * Mat2::new(1.0, 0.0, 0.0, 0.0) * vt),
        (stretch(s2), u * Mat2::new(0.0, 0.0, 0.0, 1.0) * vt),
        (twist.max(0.0), u * Mat2::new(0.0, -half, half, 0.0) * vt),
        (flip, u * Mat2::new(0.0, half, half, 0.0) * vt),
    ]
}
