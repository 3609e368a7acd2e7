//! Shading frames, and sampling of the cosine-weighted hemisphere.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

/// Orthonormal frame at a surface point, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingFrame {
    /// Unit normal that separates reflection from transmission, on the viewer's side: usually the triangle's
    /// normal.
    pub geometric: Vec3,
    /// Shading normal.
    pub normal: Vec3,
    pub tangent: Vec3,
    pub bitangent: Vec3,
    /// Direction towards the viewer.
    pub wo: Vec3,
}

impl ShadingFrame {
    /// Creates a frame with an arbitrary tangent.
    #[inline]
    pub fn new(geometric: Vec3, normal: Vec3, wo: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { geometric, normal, tangent, bitangent, wo }
    }

    /// Converts a world direction to local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// The frame with its normal bent towards the viewer, and an arbitrary tangent.
    #[inline(always)]
    pub fn with_own_normal(&self) -> Self {
        self.with_axis(self.bend_towards_viewer(self.normal))
    }

    /// A frame about another normal, with an arbitrary tangent.
    #[inline(always)]
    pub fn with_axis(&self, normal: Vec3) -> Self {
        self.with_axes(normal, normal.any_orthonormal_vector())
    }

    /// A frame about another normal, bent towards the viewer, whose tangent is as close to `tangent` as possible.
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

    /// Mapped normal, tilted towards the geometric normal just enough for the mirror direction of `wo` to be above the
    /// surface. Otherwise, light that the normal map reflects into the surface would be lost.
    ///
    /// In the plane of both normals, with angles from the geometric normal, the mirror direction of `wo` at angle phi
    /// about a normal at angle a has the angle 2 a - phi. Let psi be the angle at which the mirror direction has the
    /// lowest allowed height. The largest a is then (phi + psi) / 2: the bisector of both directions.
    #[inline]
    pub fn keep_mirror_above(&self, normal: Vec3) -> Vec3 {
        /// Smallest cosine between the mirror direction and the geometric normal: an absolute value, and a fraction of
        /// the cosine of `wo`.
        const MIN_COSINE: f32 = 0.01;
        const MAX_FRACTION: f32 = 0.9;
        let (along, up) = (normal.dot(self.geometric), self.wo.dot(self.geometric));
        let min_height = MIN_COSINE.min(MAX_FRACTION * up).max(0.0);
        if along > 0.0 && 2.0 * normal.dot(self.wo) * along - up >= min_height {
            return normal;
        }
        let Some(tilt) = (normal - self.geometric * along).try_normalize() else {
            return self.geometric;
        };
        let across = self.wo.dot(tilt);
        let length = across.hypot(up);
        let mirrored = (length * length - min_height * min_height).max(0.0).sqrt();
        // The sum of two vectors of equal length points along their bisector.
        let bisector = tilt * (across + mirrored) + self.geometric * (up + min_height);
        bisector.try_normalize().unwrap_or(self.geometric)
    }

    #[inline(always)]
    fn with_axes(&self, normal: Vec3, tangent: Vec3) -> Self {
        Self { normal, tangent, bitangent: normal.cross(tangent), ..*self }
    }

    /// Converts a local direction to world coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

/// Rotates a direction given about the z axis so that z becomes `axis`.
#[inline(always)]
pub(crate) fn to_world_around(axis: Vec3, v: Vec3) -> Vec3 {
    let (right, up) = axis.any_orthonormal_pair();
    right * v.x + up * v.y + axis * v.z
}

/// Sine and cosine of an angle in turns, 0..=1, accurate to one or two roundings and equal on every machine
/// (polynomials of S. Moshier, "Cephes", single precision).
#[inline(always)]
pub(crate) fn sincos_turns(turns: f32) -> (f32, f32) {
    let quarter = (4.0 * turns + 0.5) as u32;
    let x = (4.0 * turns - quarter as f32) * FRAC_PI_2;
    let x2 = x * x;
    let sin = ((-1.951_529_6e-4 * x2 + 8.332_161e-3) * x2 - 1.666_665_5e-1) * x2 * x + x;
    let cos = ((2.443_315_7e-5 * x2 - 1.388_731_6e-3) * x2 + 4.166_664_6e-2) * x2 * x2 - 0.5 * x2 + 1.0;
    // Sine and cosine are selected without a branch, which would be mispredicted half of the time.
    let (sin, cos) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let signed = |x: f32, quarter: u32| f32::from_bits(x.to_bits() ^ (quarter & 2) << 30);
    (signed(sin, quarter), signed(cos, quarter + 1))
}

/// Angle of (x, y) in turns, 0..=1: the inverse of [`sincos_turns`], from the same source. 0 if both coordinates are 0.
#[inline(always)]
pub(crate) fn atan2_turns(y: f32, x: f32) -> f32 {
    let (across, along) = (y.abs(), x.abs());
    let (less, more) = (across.min(along), across.max(along));
    // The ratio is the tangent of at most an eighth of a turn. Above tan(pi / 8), the angle is computed relative to an
    // eighth of a turn.
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

/// Samples a local direction above the surface with the density cosine / pi (Malley's method).
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
    fn mirror_directions_of_mapped_normals_stay_above_the_surface() {
        let direction = |elevation: f32, azimuth: f32| {
            let ((sin, cos), (s, c)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
            Vec3::new(cos * c, cos * s, sin)
        };
        let mirror = |normal: Vec3, wo: Vec3| (2.0 * normal.dot(wo) * normal - wo).z;
        for wo in [1.0, 3.0, 10.0, 30.0, 60.0, 90.0].map(|elevation| direction(elevation, 0.0)) {
            let frame = ShadingFrame::new(Vec3::Z, Vec3::Z, wo);
            let min_height = 0.01f32.min(0.9 * wo.z);
            for normal in
                (0..18).flat_map(|i| [-20.0, 5.0, 30.0, 50.0, 80.0, 89.9].map(|up| direction(up, 20.0 * i as f32)))
            {
                let found = frame.keep_mirror_above(normal);
                assert!((found.length() - 1.0).abs() < 1e-5);
                assert!(mirror(found, wo) > min_height - 1e-5, "{wo} {normal} {found}");
                if normal.z > 0.0 && mirror(normal, wo) >= min_height {
                    assert_eq!(found, normal);
                    continue;
                }
                // The reference is a search for the steepest allowed tilt in the plane of both normals.
                let tilt = (normal * Vec3::new(1.0, 1.0, 0.0)).normalize();
                let of = |angle: f32| tilt * angle.sin() + Vec3::Z * angle.cos();
                let allowed = (0..9000).map(|i| (i as f32 / 100.0).to_radians());
                let steepest = allowed.take_while(|&angle| mirror(of(angle), wo) >= min_height - 1e-6).last();
                let expected = of(steepest.unwrap());
                assert!((found - expected).length() < 1e-3, "{wo} {normal}: {found}, expected {expected}");
            }
        }
    }

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
