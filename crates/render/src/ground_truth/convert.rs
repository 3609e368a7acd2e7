//! Conversions between float64 rays and hits and the types of kernels and frames.

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, Hit};

/// A normal as it is stored; 0 stays 0 whatever its sign.
pub(crate) fn to_f32_normal(normal: DVec3) -> [f32; 3] {
    (normal + 0.0).as_vec3().to_array()
}

/// An exact hit as the float32 kernel would tell it.
pub(crate) fn to_float_hit(
    &ExactHit {
        t,
        u,
        v,
        instance,
        triangle,
        ..
    }: &ExactHit,
) -> Hit {
    Hit {
        t: t as f32,
        u: u as f32,
        v: v as f32,
        instance,
        triangle,
    }
}

/// A camera's ray as the exact search takes it.
pub(crate) fn exact_ray((origin, direction): (DVec3, DVec3)) -> ExactRay {
    ExactRay {
        origin: origin.to_array(),
        direction: direction.to_array(),
        t_max: f64::INFINITY,
    }
}

/// An id as it is stored: -1 for nothing.
#[inline]
pub(crate) fn signed_id(id: u32) -> i32 {
    i32::try_from(id).unwrap_or(-1)
}
