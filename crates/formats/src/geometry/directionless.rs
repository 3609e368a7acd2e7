//! Normals without a direction: zeros, or values that are not finite.

use glam::DVec3;
use raycam_scene::Mesh;

/// Replaces zero normals of vertices by the area-weighted mean normal of their triangles; returns the number of these
/// vertices that triangles use.
pub(crate) fn fill_normals(mesh: &mut Mesh) -> usize {
    let Some(normals) = mesh.normals.as_mut().filter(|normals| normals.contains(&[0.0; 3])) else { return 0 };
    let mut sums = vec![None; normals.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.vertices[vertex as usize]);
        let area = (b - a).cross(c - a);
        for &vertex in triangle.iter().filter(|&&vertex| normals[vertex as usize] == [0.0; 3]) {
            let sum: &mut Option<DVec3> = &mut sums[vertex as usize];
            *sum = Some(sum.unwrap_or_default() + if area.is_finite() { area } else { DVec3::ZERO });
        }
    }
    let used = sums.iter().flatten().count();
    for (normal, sum) in normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == [0.0; 3]) {
        *normal = sum.and_then(DVec3::try_normalize).unwrap_or(DVec3::Z).as_vec3().to_array();
    }
    used
}
