//! The head as one linear model: identity class and static expression keys side by side, vertex by vertex.

use crate::GenericHead;
use faer::Mat;
use geometry::Vec3;

/// Keys that turn the eyes or move what no landmark sees are not fitted.
const NOT_FITTED: [&str; 2] = ["eyeLook", "tongue"];
/// A key that moves no landmark by this much cannot be seen, metres.
const VISIBLE_OFFSET: f64 = 2e-4;

/// A point that moves linearly with the coefficients: `mean + basis · coefficients`.
#[derive(Clone, Debug)]
pub(crate) struct LinearPoint {
    /// Where it is with all coefficients zero, metres.
    pub mean: Vec3,
    /// `3 × K` metres per coefficient, as three rows of `K`.
    pub basis: [Vec<f64>; 3],
}

impl LinearPoint {
    /// Its place for `K` coefficients.
    pub fn at(&self, coefficients: &[f64]) -> Vec3 {
        self.mean + Vec3::from_fn(|axis, _| dot(&self.basis[axis], coefficients))
    }

    /// The gradient of `direction · point` by the coefficients.
    pub fn gradient(&self, direction: &Vec3) -> Vec<f64> {
        let [x, y, z] = &self.basis;
        (0..x.len()).map(|k| direction.x * x[k] + direction.y * y[k] + direction.z * z[k]).collect()
    }
}

/// Sum of products.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// All vertices as functions of `K = identity + keys` coefficients.
pub(crate) struct ShapeModel {
    mean: Vec<Vec3>,
    /// `n × 3 × K`: the coefficients of one coordinate lie together.
    basis: Vec<f32>,
    /// Number of identity components, the first coefficients.
    pub identity: usize,
    /// Which of the head's keys the remaining coefficients are.
    pub keys: Vec<usize>,
}

impl ShapeModel {
    /// Gathers the class and the keys that move landmarks.
    pub fn new(head: &GenericHead) -> Self {
        let (n, identity) = (head.positions.len(), head.identity.components);
        let keys = fitted_keys(head);
        let size = identity + keys.len();
        let mut basis = vec![0.0_f32; n * 3 * size];
        for (k, component) in head.identity.basis.chunks_exact((3 * n).max(1)).enumerate() {
            for (row, &value) in component.iter().enumerate() {
                basis[row * size + k] = value;
            }
        }
        for (k, &key) in keys.iter().enumerate() {
            for (vertex, offset) in &head.keys[key].offsets {
                for axis in 0..3 {
                    basis[(3 * *vertex as usize + axis) * size + identity + k] = offset[axis] as f32;
                }
            }
        }
        Self { mean: head.positions.clone(), basis, identity, keys }
    }

    /// Number of coefficients `K`.
    pub fn size(&self) -> usize {
        self.identity + self.keys.len()
    }

    /// The point at barycentric weights of a triangle.
    pub fn point(&self, triangle: &[u32; 3], weights: &[f64; 3]) -> LinearPoint {
        let size = self.size();
        let mut point = LinearPoint { mean: Vec3::zeros(), basis: [vec![0.0; size], vec![0.0; size], vec![0.0; size]] };
        for (&vertex, &weight) in triangle.iter().zip(weights) {
            point.mean += self.mean[vertex as usize] * weight;
            for (axis, sums) in point.basis.iter_mut().enumerate() {
                for (sum, &b) in sums.iter_mut().zip(self.row(vertex as usize, axis)) {
                    *sum += weight * f64::from(b);
                }
            }
        }
        point
    }

    /// All vertices for `K` coefficients.
    pub fn positions(&self, coefficients: &[f64]) -> Vec<Vec3> {
        let along = |row: &[f32]| row.iter().zip(coefficients).map(|(&b, c)| f64::from(b) * c).sum::<f64>();
        let place = |(i, p): (usize, &Vec3)| p + Vec3::from_fn(|axis, _| along(self.row(i, axis)));
        self.mean.iter().enumerate().map(place).collect()
    }

    /// The head's coefficients of all keys from those that are fitted.
    pub fn all_keys(&self, fitted: &[f64], key_count: usize) -> Vec<f64> {
        let mut all = vec![0.0; key_count];
        for (&key, &value) in self.keys.iter().zip(fitted) {
            all[key] = value;
        }
        all
    }

    fn row(&self, vertex: usize, axis: usize) -> &[f32] {
        let size = self.size();
        &self.basis[(3 * vertex + axis) * size..][..size]
    }
}

fn fitted_keys(head: &GenericHead) -> Vec<usize> {
    let mut anchored = vec![0.0_f64; head.positions.len()];
    for anchor in &head.anchors {
        for (&vertex, &weight) in anchor.triangle.iter().zip(&anchor.weights) {
            anchored[vertex as usize] = anchored[vertex as usize].max(weight);
        }
    }
    let seen = |k: &crate::Key| k.offsets.iter().any(|(i, d)| anchored[*i as usize] * d.norm() > VISIBLE_OFFSET);
    let fitted = |k: &crate::Key| seen(k) && !NOT_FITTED.iter().any(|prefix| k.name.starts_with(prefix));
    head.keys.iter().enumerate().filter(|(_, k)| fitted(k)).map(|(i, _)| i).collect()
}

/// One landmark of the model.
pub(crate) struct ModelLandmark {
    /// Its index among the net's 468.
    pub index: usize,
    /// Where it is.
    pub point: LinearPoint,
    /// Skin normal on the mean head.
    pub normal: Vec3,
    /// Two unit directions along the skin, the columns of the slip.
    pub tangents: [Vec3; 2],
    /// Standard deviation of its slip along the skin, metres.
    pub sigma: f64,
}

/// The landmarks that are points of the skin.
pub(crate) struct LandmarkModel {
    /// In order of their index.
    pub points: Vec<ModelLandmark>,
    /// `3L × K`: the bases of all landmarks, row after row.
    pub basis: Mat<f64>,
}

impl LandmarkModel {
    /// All landmarks but the outline of the face.
    pub fn new(head: &GenericHead, shape: &ShapeModel, normals: &[Vec3]) -> Self {
        let on_skin = |i: &usize| !geometry::face_mesh::FACE_OVAL.contains(i) && head.anchors[*i].sigma.is_finite();
        let landmark = |index: usize| {
            let anchor = &head.anchors[index];
            let normal = (0..3).map(|k| normals[anchor.triangle[k] as usize] * anchor.weights[k]).sum::<Vec3>();
            let normal = normal.try_normalize(1e-12).unwrap_or_else(Vec3::z);
            let tangents = tangents(&normal);
            ModelLandmark {
                index,
                point: shape.point(&anchor.triangle, &anchor.weights),
                normal,
                tangents,
                sigma: anchor.sigma,
            }
        };
        let points: Vec<ModelLandmark> = (0..head.anchors.len()).filter(on_skin).map(landmark).collect();
        let basis = Mat::from_fn(3 * points.len(), shape.size(), |row, k| points[row / 3].point.basis[row % 3][k]);
        Self { points, basis }
    }
}

/// Two unit vectors that complete a unit normal.
pub(crate) fn tangents(normal: &Vec3) -> [Vec3; 2] {
    let helper = if normal.x.abs() < 0.8 { Vec3::x() } else { Vec3::y() };
    let first = (helper - normal * normal.dot(&helper)).normalize();
    [first, normal.cross(&first)]
}
