//! Tangents of a textured mesh, which a normal map is relative to.

use geometry::{Vec2, Vec3};

/// Of each vertex, the unit direction in which u grows, and the sign with which `normal × tangent` is the one in which v grows (up), as
/// glTF has them. `uvs` have v up; vertices are split where they have a seam. Where a vertex's triangles have no area on the texture the
/// tangent is any that is at right angles to its unit normal.
pub fn tangents(
    positions: &[[f32; 3]],
    normals: &[[f32; 3]],
    uvs: &[[f32; 2]],
    triangles: &[[u32; 3]],
) -> Vec<[f32; 4]> {
    let place = |of: &[f32; 3]| Vec3::from_fn(|k, _| f64::from(of[k]));
    let mut sums = vec![(Vec3::zeros(), Vec3::zeros()); positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| place(&positions[v as usize]));
        let uv = triangle.map(|v| Vec2::from_fn(|k, _| f64::from(uvs[v as usize][k])));
        let (p, q) = (uv[1] - uv[0], uv[2] - uv[0]);
        let area = p.perp(&q);
        if area == 0.0 {
            continue;
        }
        let (ab, ac, weight) = (b - a, c - a, (b - a).cross(&(c - a)).norm());
        let along = |step: Vec3| (step / area).try_normalize(0.0).unwrap_or_else(Vec3::zeros) * weight;
        let (by_u, by_v) = (along(ab * q.y - ac * p.y), along(ac * p.x - ab * q.x));
        for &v in triangle {
            let sum = &mut sums[v as usize];
            *sum = (sum.0 + by_u, sum.1 + by_v);
        }
    }
    let tangent = |((by_u, by_v), normal): (&(Vec3, Vec3), &[f32; 3])| {
        let normal = place(normal);
        let along = (by_u - normal * normal.dot(by_u)).try_normalize(1e-12);
        let along = along.unwrap_or_else(|| normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize());
        let sign = if normal.cross(&along).dot(by_v) < 0.0 { -1.0 } else { 1.0 };
        [along.x as f32, along.y as f32, along.z as f32, sign]
    };
    sums.iter().zip(normals).map(tangent).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    fn of(uvs: [[f32; 2]; 4]) -> Vec<[f32; 4]> {
        tangents(&SQUARE, &[[0.0, 0.0, 1.0]; 4], &uvs, &HALVES)
    }

    #[test]
    fn they_run_along_u_on_textures_that_are_upright_turned_and_mirrored() {
        let near = |found: Vec<[f32; 4]>, wanted: [f32; 4]| {
            assert!(found.iter().flatten().zip(wanted.iter().cycle()).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        };
        near(of([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]), [1.0, 0.0, 0.0, 1.0]);
        near(of([[0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [0.0, 0.0]]), [0.0, -1.0, 0.0, 1.0]);
        near(of([[0.5, 0.0], [0.0, 0.0], [0.0, 0.5], [0.5, 0.5]]), [-1.0, 0.0, 0.0, -1.0]);
    }

    #[test]
    fn a_texture_of_no_area_still_gives_unit_tangents_on_the_skin() {
        for [x, y, z, sign] in of([[0.3, 0.3]; 4]) {
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-6 && z == 0.0 && sign.abs() == 1.0);
        }
    }
}
