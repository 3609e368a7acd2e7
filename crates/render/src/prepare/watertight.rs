//! Watertight meshes: closed, consistently oriented surfaces that enclose a volume.

use glam::DVec3;
use raycam_scene::Mesh;
use rayon::prelude::*;

use crate::sampling::sampler::splitmix64;

/// Number of triangles per task.
const CHUNK: usize = 1 << 14;

/// True if every edge is used equally often in both directions and the enclosed volume is positive. Vertices at the
/// same position count as one vertex.
///
/// Edges are not sorted: signed hashes of their end points sum to zero for a closed mesh.
pub(crate) fn is_watertight(mesh: &Mesh) -> bool {
    let parts: Vec<(u64, f64)> = mesh
        .triangles
        .par_chunks(CHUNK)
        .map(|triangles| {
            let (mut open, mut volume) = (0u64, 0.0);
            for triangle in triangles {
                let corners = triangle.map(|vertex| mesh.vertices[vertex as usize]);
                let [a, b, c] = corners.map(vertex_key);
                for way in [edge_key(a, b), edge_key(b, c), edge_key(c, a)] {
                    open = open.wrapping_add(way);
                }
                let [a, b, c] = corners.map(|corner| corner - mesh.vertices[0]);
                volume += a.dot(b.cross(c));
            }
            (open, volume)
        })
        .collect();
    let open = parts.iter().fold(0u64, |sum, part| sum.wrapping_add(part.0));
    let volume: f64 = parts.iter().map(|part| part.1).sum();
    open == 0 && volume > 0.0
}

/// Hash of a position.
fn vertex_key(vertex: DVec3) -> u64 {
    // Positions with -0 and 0 must have the same hash.
    let [x, y, z] = (vertex + DVec3::ZERO).to_array().map(f64::to_bits);
    splitmix64(splitmix64(splitmix64(x) ^ y) ^ z)
}

/// Hash of a directed edge; the reversed edge has the negative of this hash.
fn edge_key(from: u64, to: u64) -> u64 {
    let between = splitmix64(splitmix64(from.min(to)) ^ from.max(to));
    match from.cmp(&to) {
        std::cmp::Ordering::Less => between,
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => between.wrapping_neg(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            vertices: vertices.iter().map(|&vertex| vertex.into()).collect(),
            triangles: triangles.to_vec(),
            ..Mesh::default()
        }
    }

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, -0.0], [0.0, 0.0, 1.0]];
    const SIDES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn closed_meshes_are_watertight() {
        assert!(is_watertight(&mesh(&CORNERS, &SIDES)));
        // The triangles have separate vertices, as at texture seams.
        let corners = SIDES.as_flattened().iter();
        let apart: Vec<_> = corners.map(|&i| CORNERS[i as usize]).collect();
        let own = [0, 3, 6, 9].map(|first| [first, first + 1, first + 2]);
        assert!(is_watertight(&mesh(&apart, &own)));
        // Degenerate triangles neither close nor open an edge.
        let flat = [&SIDES[..], &[[1, 1, 2], [2, 2, 2]]].concat();
        assert!(is_watertight(&mesh(&CORNERS, &flat)));
    }

    #[test]
    fn open_or_inverted_meshes_are_not_watertight() {
        for missing in 0..4 {
            let mut open = SIDES.to_vec();
            open.remove(missing);
            assert!(!is_watertight(&mesh(&CORNERS, &open)));
            let mut turned = SIDES;
            turned[missing].reverse();
            assert!(!is_watertight(&mesh(&CORNERS, &turned)));
        }
        let inside_out = SIDES.map(|[a, b, c]| [a, c, b]);
        assert!(!is_watertight(&mesh(&CORNERS, &inside_out)));
        assert!(!is_watertight(&mesh(&[], &[])));
    }
}
