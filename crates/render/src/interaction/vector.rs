//! Normals and directions in float64.

use glam::DVec3;

/// Unit vertex normal on the side of `geometric`, which replaces a zero normal.
#[inline(always)]
pub(crate) fn normalize_facing(normal: DVec3, geometric: DVec3) -> DVec3 {
    let normal = normal.normalize_or(geometric);
    if normal.dot(geometric) < 0.0 { -normal } else { normal }
}

/// Normal on the side that faces a ray of this direction.
#[inline]
pub(crate) fn face_forward(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal.dot(direction) > 0.0 { -normal } else { normal }
}

/// Unit normal on the side from which the triangle's vertices are counter-clockwise; 0 for a degenerate triangle.
#[inline]
pub(crate) fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (e1, e2) = (b - a, c - a);
    unit(e1.cross(e2)).unwrap_or_else(|| {
        // The edges are divided by their largest component, because squared lengths may overflow or underflow.
        let scale = e1.abs().max(e2.abs()).max_element().recip();
        (e1 * scale).cross(e2 * scale).normalize_or_zero()
    })
}

/// Unit vector, if the squared length neither overflows nor underflows float64.
#[inline]
pub(crate) fn unit(vector: DVec3) -> Option<DVec3> {
    let square = vector.length_squared();
    is_safe_square(square).then(|| vector / square.sqrt())
}

/// True for a squared length far from overflow and underflow.
#[inline(always)]
pub(crate) fn is_safe_square(square: f64) -> bool {
    (1e-200..1e200).contains(&square)
}
