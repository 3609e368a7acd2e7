//! Convex parts of meshes.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

use rapier3d_f64::math::Vector;
use rapier3d_f64::parry::transformation::try_convex_hull;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};

use crate::surface::Surface;

/// Fraction of its hull that a mesh must fill for the hull to represent it.
const CONVEX_SOLIDITY: f64 = 0.95;
/// Maximum concavity of a part, from 0 to 1 (parameter of VHACD).
const CONCAVITY: f64 = 0.01;
/// Number of voxels along the longest side of the mesh.
const RESOLUTION: u32 = 64;
/// Maximum number of meshes whose parts are kept for further calls.
const CACHE_SIZE: usize = 64;

/// Point sets in mesh coordinates; their convex hulls are the parts of a mesh.
pub(crate) type Parts = Vec<Vec<Vector>>;

/// Parts by the hash of mesh and limit, most recent last.
static CACHE: Mutex<Vec<(u64, Arc<Parts>)>> = Mutex::new(Vec::new());

/// Convex parts of a surface, at most `limit`; empty for a surface whose hull has no volume.
pub(crate) fn convex_parts(surface: &Surface, limit: u32) -> Arc<Parts> {
    let key = key_of(surface, limit);
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    let found = cache.iter().position(|(known, _)| *known == key).map(|i| cache.remove(i).1);
    let is_known = found.is_some();
    drop(cache);
    let parts = found.unwrap_or_else(|| Arc::new(decompose(surface, limit)));
    let mut cache = CACHE.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_known && cache.len() >= CACHE_SIZE {
        cache.remove(0);
    }
    cache.push((key, parts.clone()));
    parts
}

/// Fraction of its hull that a closed surface fills; 0 for an open surface.
pub(crate) fn solidity(surface: &Surface) -> f64 {
    match hull(surface.mesh().vertices()) {
        Some((_, volume)) if surface.is_closed => surface.volume().abs() / volume,
        _ => 0.0,
    }
}

/// Corners and volume of a convex hull; `None` if the hull is flat.
pub(crate) fn hull(points: &[Vector]) -> Option<(Vec<Vector>, f64)> {
    let (corners, triangles) = try_convex_hull(points).ok()?;
    let size = corners.iter().map(|corner| (*corner - corners[0]).length()).fold(0.0, f64::max);
    let volume: f64 = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|i| corners[i as usize] - corners[0]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    (volume > 1e-9 * size.powi(3)).then_some((corners, volume))
}

fn key_of(surface: &Surface, limit: u32) -> u64 {
    let mut hasher = DefaultHasher::new();
    limit.hash(&mut hasher);
    for vertex in surface.mesh().vertices() {
        vertex.to_array().map(f64::to_bits).hash(&mut hasher);
    }
    surface.mesh().indices().hash(&mut hasher);
    hasher.finish()
}

fn decompose(surface: &Surface, limit: u32) -> Parts {
    let (points, triangles) = (surface.mesh().vertices(), surface.mesh().indices());
    let Some((corners, volume)) = hull(points) else { return Vec::new() };
    if limit <= 1 || surface.is_closed && surface.volume().abs() > CONVEX_SOLIDITY * volume {
        return vec![corners];
    }
    let parameters =
        VHACDParameters { concavity: CONCAVITY, resolution: RESOLUTION, max_convex_hulls: limit, ..Default::default() };
    let decomposition = VHACD::decompose(&parameters, points, triangles, true);
    let clipped = decomposition.compute_primitive_intersections(points, triangles);
    let parts: Parts = clipped.iter().filter_map(|points| hull(points).map(|(corners, _)| corners)).collect();
    if parts.is_empty() { vec![corners] } else { parts }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raycam_scene::mesh::primitive;

    fn surface(mesh: &raycam_scene::Mesh) -> Surface {
        let points: Vec<Vector> = mesh.vertices.iter().map(|&v| crate::convert::vector(v)).collect();
        Surface::new(&points, mesh.triangles.iter().copied()).unwrap()
    }

    #[test]
    fn convex_meshes_are_one_part_with_their_own_corners() {
        let parts = convex_parts(&surface(&primitive::box_([1.0, 2.0, 3.0]).unwrap()), 32);
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].len(), 8);
    }

    #[test]
    fn parts_of_a_torus_leave_its_hole_open() {
        let torus = surface(&primitive::torus(1.0, 0.2, 32).unwrap());
        let parts = convex_parts(&torus, 32);
        assert!((4..=32).contains(&parts.len()), "{}", parts.len());
        for part in parts.iter() {
            let nearest = part.iter().map(|corner| corner.x.hypot(corner.y)).fold(f64::MAX, f64::min);
            assert!(nearest > 0.7, "{nearest}");
        }
        let same = decompose(&torus, 32);
        assert_eq!(*parts, same, "equal meshes have equal parts");
    }

    #[test]
    fn flat_meshes_have_no_parts() {
        assert!(convex_parts(&surface(&primitive::plane([1.0; 2]).unwrap()), 32).is_empty());
    }
}
