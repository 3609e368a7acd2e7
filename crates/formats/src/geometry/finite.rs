//! Vertices that are not finite, and omission of the faces that use such vertices.

use glam::DVec3;
use raycam_scene::{Mesh, counted};

/// Numbers of vertices that are not finite, and of triangles that use such vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct NonFinite {
    pub(crate) vertices: usize,
    /// Number of triangles that were removed because one of their vertices is not finite.
    pub(crate) triangles: usize,
}

impl NonFinite {
    /// Text of a notice about vertices that are not finite; `None` if all vertices are finite.
    pub(crate) fn message(self) -> Option<String> {
        let Self { vertices, triangles } = self;
        match (vertices, triangles) {
            (0, _) => None,
            (_, 0) => Some(format!("{} with coordinates that are not finite", counted(vertices, "unused vertex"))),
            _ => Some(format!("{} omitted: vertex coordinates are not finite", counted(triangles, "face"))),
        }
    }
}

/// Removes the triangles with a corner that is not finite. Vertices are kept, so that other arrays keep their length;
/// vertices that are not finite move to the first finite vertex.
pub(crate) fn drop_non_finite(mesh: &mut Mesh) -> NonFinite {
    let vertices = mesh.vertices.iter().filter(|vertex| !vertex.is_finite()).count();
    if vertices == 0 {
        return NonFinite::default();
    }
    let all = mesh.vertices.len();
    let finite = |triangle: &[u32; 3]| {
        // Indices beyond the vertices are reported elsewhere.
        triangle.iter().all(|&i| i as usize >= all || mesh.vertices[i as usize].is_finite())
    };
    let kept: Vec<bool> = mesh.triangles.iter().map(finite).collect();
    retain(&mut mesh.triangles, &kept);
    if let Some(colors) = &mut mesh.face_colors {
        retain(colors, &kept);
    }
    if let Some(slots) = &mut mesh.material_slots {
        retain(slots, &kept);
    }
    let place = mesh.vertices.iter().copied().find(|vertex| vertex.is_finite()).unwrap_or(DVec3::ZERO);
    for vertex in mesh.vertices.iter_mut().filter(|vertex| !vertex.is_finite()) {
        *vertex = place;
    }
    NonFinite { vertices, triangles: kept.iter().filter(|kept| !**kept).count() }
}

/// Keeps only items whose flag is set.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut flags = kept.iter();
    items.retain(|_| flags.next().is_some_and(|kept| *kept));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn face_attributes_of_removed_triangles_are_removed() {
        let mut mesh = Mesh {
            vertices: vec![DVec3::NAN, DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(f64::INFINITY)],
            triangles: vec![[1, 2, 3], [0, 1, 2], [3, 2, 1], [2, 3, 4]],
            face_colors: Some(vec![[0.1; 3], [0.2; 3], [0.3; 3], [0.4; 3]]),
            material_slots: Some(vec![0, 1, 2, 3]),
            ..Mesh::default()
        };
        assert_eq!(drop_non_finite(&mut mesh), NonFinite { vertices: 2, triangles: 2 });
        assert_eq!(mesh.triangles, [[1, 2, 3], [3, 2, 1]]);
        assert_eq!(mesh.face_colors, Some(vec![[0.1; 3], [0.3; 3]]));
        assert_eq!(mesh.material_slots, Some(vec![0, 2]));
        assert_eq!(mesh.vertices, [DVec3::X, DVec3::X, DVec3::Y, DVec3::Z, DVec3::X]);
        assert_eq!(drop_non_finite(&mut mesh).message(), None);
    }
}
