//! Gradient sky: radiance by elevation, or equal in every direction.

use std::f32::consts::PI;

use glam::Vec3;

use crate::light::samples::LightLiSample;
use crate::lobes::shading_frame::{sincos_turns, to_world_around};

#[derive(Debug)]
pub(crate) struct GradientSky {
    pub up: Vec3,
    pub zenith: Vec3,
    pub horizon: Vec3,
    pub ground: Vec3,
}

impl GradientSky {
    pub fn is_constant(&self) -> bool {
        self.zenith == self.horizon && self.horizon == self.ground
    }

    /// Radiance from a direction: linear in the sine of the elevation above the horizon, constant below.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let sine = self.up.dot(direction);
        if self.is_constant() {
            self.horizon
        } else if sine < 0.0 {
            self.ground
        } else {
            self.horizon + (self.zenith - self.horizon) * sine.min(1.0)
        }
    }

    /// Samples a cosine-weighted direction (Malley's method), or a uniform direction on the sphere if `normal` is zero.
    pub fn sample(&self, normal: Vec3, [x, y]: [f32; 2]) -> LightLiSample {
        let (sin, cos) = sincos_turns(y);
        let (axis, height, radius) = if normal == Vec3::ZERO {
            (Vec3::Z, 1.0 - 2.0 * x, 2.0 * (x * (1.0 - x)).sqrt())
        } else {
            (normal, (1.0 - x).sqrt(), x.sqrt())
        };
        let direction = to_world_around(axis, Vec3::new(radius * cos, radius * sin, height));
        LightLiSample {
            direction,
            p_light: None,
            radiance: self.radiance(direction),
            pdf: self.pdf(normal, direction),
            is_delta: false,
        }
    }

    pub fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        if normal == Vec3::ZERO { 1.0 / (4.0 * PI) } else { normal.dot(direction).max(0.0) / PI }
    }
}
