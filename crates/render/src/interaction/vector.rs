//! Normals and directions in float64.

use glam::DVec3;

/// The normal of a corner, of unit length, on the side of the triangle's.
#[inline(always)]
pub(crate) fn normalize_facing(normal: DVec3, geometric: DVec3) -> DVec3 {
    let normal = normal.normalize_or(geometric);
    if normal.dot(geometric) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// A normal on the side that a ray in this direction sees.
#[inline]
pub(crate) fn face_forward(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}

/// The normal of a triangle, unit length, on the side from which its corners run counter-clockwise; 0 for one without
/// area.
#[inline]
pub(crate) fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (e1, e2) = (b - a, c - a);
    unit(e1.cross(e2)).unwrap_or_else(|| {
        // Scaled by its largest edge: corners may be far apart or close together.
        let scale = e1.abs().max(e2.abs()).max_element().recip();
        (e1 * scale).cross(e2 * scale).normalize_or_zero()
    })
}

/// The direction of a vector whose length is far from the ends of float64.
#[inline]
pub(crate) fn unit(vector: DVec3) -> Option<DVec3> {
    let square = vector.length_squared();
    is_safe_square(square).then(|| vector / square.sqrt())
}

/// Whether the square of a length is far from the ends of float64.
#[inline(always)]
pub(crate) fn is_safe_square(square: f64) -> bool {
    (1e-200..1e200).contains(&square)
}
