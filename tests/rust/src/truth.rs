//! What is true of the film of `blend_fixtures/synthetic_person.blend`.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use crate::clip;
use geometry::{Camera, Transform, Vec2, Vec3};
use serde_json::Value;

/// Skin that faces the camera by less than this cosine is at the head's rim: whether it is seen is not asked there.
const RIM: f64 = 0.2;

/// The filmed head, its camera and its poses.
pub struct Truth {
    /// The camera.
    pub camera: Camera,
    /// `cam_from_head` of each frame.
    pub poses: Vec<Transform>,
    /// Turn of each frame, degrees.
    pub yaw_deg: Vec<f64>,
    /// Tip of the nose, head frame, metres.
    pub nose_tip: Vec3,
    /// Of the head, metres.
    pub vertices: Vec<Vec3>,
    /// Of the head.
    pub triangles: Vec<[u32; 3]>,
}

impl Truth {
    /// Reads `truth.json` and `head.ply`.
    pub fn read() -> Self {
        let value: Value = serde_json::from_str(&std::fs::read_to_string(clip().join("truth.json")).unwrap()).unwrap();
        let frames = value["frames"].as_array().unwrap();
        let nose_tip: [f64; 3] = serde_json::from_value(value["nose_tip"].clone()).unwrap();
        let (vertices, triangles) = read_ply(&std::fs::read(clip().join("head.ply")).unwrap());
        Self {
            camera: serde_json::from_value(value["camera"].clone()).unwrap(),
            poses: frames.iter().map(|f| serde_json::from_value(f["cam_from_head"].clone()).unwrap()).collect(),
            yaw_deg: frames.iter().map(|f| f["yaw_deg"].as_f64().unwrap()).collect(),
            nose_tip: nose_tip.into(),
            vertices,
            triangles,
        }
    }

    /// Nearest point of the head on a pixel's ray, and its normal.
    fn cast(&self, frame: usize, pixel: &Vec2) -> Option<(Vec3, Vec3)> {
        let head_from_cam = self.poses[frame].inverse();
        let (origin, ray) = (head_from_cam.translation, head_from_cam.rotation * self.camera.ray(pixel));
        let hit = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.vertices[i as usize]);
            let (ab, ac) = (b - a, c - a);
            let across = ray.cross(&ac);
            let determinant = ab.dot(&across);
            let from_a = origin - a;
            let u = from_a.dot(&across) / determinant;
            let turned = from_a.cross(&ab);
            let v = ray.dot(&turned) / determinant;
            let along = ac.dot(&turned) / determinant;
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along > 0.0).then(|| (along, ab.cross(&ac).normalize()))
        };
        let nearest = self.triangles.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(along, normal)| (origin + ray * along, normal))
    }

    /// Where frame `b` shows what a pixel of frame `a` shows; `None` off the head and where it is turned away.
    pub fn carried(&self, a: usize, b: usize, pixel: &Vec2) -> Option<Vec2> {
        let (point, normal) = self.cast(a, pixel)?;
        let in_b = self.poses[b].apply(&point);
        let facing = -(self.poses[b].rotation * normal).dot(&in_b.normalize());
        self.camera.project(&in_b).filter(|_| facing > RIM)
    }
}

/// Vertices and triangles of a binary PLY of three float32, and of one uchar and three int32.
fn read_ply(bytes: &[u8]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..body]).unwrap();
    let count =
        |name: &str| header.lines().find_map(|l| l.strip_prefix(name)).unwrap().trim().parse::<usize>().unwrap();
    let (vertices, faces) = (count("element vertex "), count("element face "));
    let (points, triangles) = bytes[body..].split_at(12 * vertices);
    let number = |b: &[u8], k: usize| f64::from(f32::from_le_bytes(b[4 * k..4 * k + 4].try_into().unwrap()));
    let index = |b: &[u8], k: usize| u32::from_le_bytes(b[1 + 4 * k..5 + 4 * k].try_into().unwrap());
    (
        points.chunks_exact(12).map(|b| Vec3::new(number(b, 0), number(b, 1), number(b, 2))).collect(),
        triangles.chunks_exact(13).take(faces).map(|b| [index(b, 0), index(b, 1), index(b, 2)]).collect(),
    )
}
