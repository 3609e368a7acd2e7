//! Conversions between float64 rays and hits and the types of kernels and frames.

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, Hit};

/// Converts a normal to float32, as stored in frames; -0 becomes 0.
pub(crate) fn to_f32_normal(normal: DVec3) -> [f32; 3] {
    (normal + 0.0).as_vec3().to_array()
}

/// Converts an exact hit to a float32 hit.
pub(crate) fn to_float_hit(&ExactHit { t, u, v, instance, triangle, .. }: &ExactHit) -> Hit {
    Hit { t: t as f32, u: u as f32, v: v as f32, instance, triangle }
}

/// Converts a camera ray to an exact ray.
pub(crate) fn exact_ray((origin, direction): (DVec3, DVec3)) -> ExactRay {
    ExactRay { origin: origin.to_array(), direction: direction.to_array(), t_min: 0.0, t_max: f64::INFINITY }
}

/// Id as stored in a frame: -1 for a miss.
#[inline]
pub(crate) fn signed_id(id: u32) -> i32 {
    i32::try_from(id).unwrap_or(-1)
}
