//! Shading frames, and sampling of the cosine-weighted hemisphere.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

/// Orthonormal directions at a surface point, in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingFrame {
    /// Normal of the triangle, on the viewer's side.
    pub geometric: Vec3,
    /// Shading normal.
    pub normal: Vec3,
    pub tangent: Vec3,
    pub bitangent: Vec3,
    /// Direction towards the viewer.
    pub wo: Vec3,
}

impl ShadingFrame {
    /// A frame with an arbitrary tangent.
    #[inline]
    pub fn new(geometric: Vec3, normal: Vec3, wo: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { geometric, normal, tangent, bitangent, wo }
    }

    /// A world direction in local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// The frame with its own normal bent towards the viewer, and an arbitrary tangent.
    #[inline(always)]
    pub fn with_own_normal(&self) -> Self {
        self.with_axis(self.bend_towards_viewer(self.normal))
    }

    /// The frame about another normal, with an arbitrary tangent.
    #[inline(always)]
    pub fn with_axis(&self, normal: Vec3) -> Self {
        self.with_axes(normal, normal.any_orthonormal_vector())
    }

    /// The frame about another normal, bent towards the viewer, with its tangent as near to `tangent` as possible.
    pub fn with_shading_normal(&self, normal: Vec3, tangent: Option<Vec3>) -> Self {
        let normal = self.bend_towards_viewer(normal);
        let along = tangent
            .map(|tangent| (tangent - normal * normal.dot(tangent)).normalize_or_zero())
            .filter(|&tangent| tangent != Vec3::ZERO)
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        self.with_axes(normal, along)
    }

    /// A normal, bent just enough to face the viewer.
    #[inline(always)]
    pub fn bend_towards_viewer(&self, normal: Vec3) -> Vec3 {
        /// Smallest cosine between the normal and `wo`.
        const MIN_VIEW_COSINE: f32 = 1e-3;
        let cosine = normal.dot(self.wo);
        if cosine < MIN_VIEW_COSINE {
            (normal + self.wo * (MIN_VIEW_COSINE * 1.1 - cosine)).normalize()
        } else {
            normal
        }
    }

    #[inline(always)]
    fn with_axes(&self, normal: Vec3, tangent: Vec3) -> Self {
        Self { normal, tangent, bitangent: normal.cross(tangent), ..*self }
    }

    /// A local direction in world coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

/// A direction given about the z axis, turned so that z is `axis`.
#[inline(always)]
pub(crate) fn to_world_around(axis: Vec3, v: Vec3) -> Vec3 {
    let (right, up) = axis.any_orthonormal_pair();
    right * v.x + up * v.y + axis * v.z
}

/// Sine and cosine of an angle in turns, 0..=1, accurate to a rounding or two and the same on every machine
/// (polynomials of S. Moshier, "Cephes", single precision).
#[inline(always)]
pub(crate) fn sincos_turns(turns: f32) -> (f32, f32) {
    let quarter = (4.0 * turns + 0.5) as u32;
    let x = (4.0 * turns - quarter as f32) * FRAC_PI_2;
    let x2 = x * x;
    let sin = ((-1.951_529_6e-4 * x2 + 8.332_161e-3) * x2 - 1.666_665_5e-1) * x2 * x + x;
    let cos = ((2.443_315_7e-5 * x2 - 1.388_731_6e-3) * x2 + 4.166_664_6e-2) * x2 * x2 - 0.5 * x2 + 1.0;
    // Selected: a branch would be mispredicted half of the time.
    let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let signed = |x: f32, quarter: u32| f32::from_bits(x.to_bits() ^ (quarter & 2) << 30);
    (signed(sin, quarter), signed(cos, quarter + 1))
}

/// The angle of (x, y) in turns, 0..=1: the inverse of [`sincos_turns`], from the same source. 0 where both are 0.
#[inline(always)]
pub(crate) fn atan2_turns(y: f32, x: f32) -> f32 {
    let (across, along) = (y.abs(), x.abs());
    let (less, more) = (across.min(along), across.max(along));
    // Up to an eighth of a turn; above tan(pi / 8) from there.
    let ratio = if more > 0.0 { less / more } else { 0.0 };
    let far = ratio > 0.414_213_57;
    let t = if far { (ratio - 1.0) / (ratio + 1.0) } else { ratio };
    let t2 = t * t;
    let series = ((8.053_744_5e-2 * t2 - 1.387_768_6e-1) * t2 + 1.997_771_1e-1) * t2 - 3.333_295e-1;
    let turns = (series * t2 * t + t) * (0.5 / PI) + if far { 0.125 } else { 0.0 };
    let turns = if across > along { 0.25 - turns } else { turns };
    let turns = if x < 0.0 { 0.5 - turns } else { turns };
    if y < 0.0 { 1.0 - turns } else { turns }
}

/// A local direction above the surface with density cosine / pi (Malley's method).
#[inline(always)]
pub(crate) fn sample_cosine_hemisphere([x, y]: [f32; 2]) -> Vec3 {
    let (sin, cos) = sincos_turns(y);
    let radius = x.sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - x).sqrt())
}

/// The density of [`sample_cosine_hemisphere`].
#[inline(always)]
pub(crate) fn cosine_hemisphere_pdf(cosine: f32) -> f32 {
    cosine.max(0.0) / PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn atan2_turns_inverts_sincos_turns() {
        const STEPS: u32 = 1 << 16;
        for step in 0..STEPS {
            let turns = step as f32 / STEPS as f32;
            let (sin, cos) = sincos_turns(turns);
            for length in [1.0, 1e-30, 3e20] {
                let off = (atan2_turns(length * sin, length * cos) - turns).abs();
                assert!(off.min(1.0 - off) < 1.5e-7, "{turns}: {off}");
            }
        }
        for (y, x, turns) in [(0.0, 0.0, 0.0), (2.0, 0.0, 0.25), (0.0, -3.0, 0.5), (-1.0, 0.0, 0.75)] {
            assert_eq!(atan2_turns(y, x), turns);
        }
    }
}
