//! The sky: the same radiance from everywhere.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::LightSample;

#[derive(Debug)]
pub(crate) struct Sky {
    pub radiance: Vec3,
}

impl Sky {
    /// A direction by its cosine to the normal (Malley's method); from the whole sphere where there is none.
    pub fn sample(&self, normal: Vec3, [x, y]: [f32; 2]) -> LightSample {
        let (sin, cos) = (TAU * y).sin_cos();
        let (axis, height, radius) = if normal == Vec3::ZERO {
            let height = 1.0 - 2.0 * x;
            (Vec3::Z, height, 2.0 * (x * (1.0 - x)).sqrt())
        } else {
            (normal, (1.0 - x).sqrt(), x.sqrt())
        };
        let (right, up) = axis.any_orthonormal_pair();
        let direction = (right * cos + up * sin) * radius + axis * height;
        LightSample {
            direction,
            end: None,
            radiance: self.radiance,
            pdf: self.pdf(normal, direction),
            delta: false,
        }
    }

    pub fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        if normal == Vec3::ZERO {
            1.0 / (4.0 * PI)
        } else {
            normal.dot(direction).max(0.0) / PI
        }
    }
}
