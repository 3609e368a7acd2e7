//! Sun: parallel light, or a disk of uniform radiance at infinity.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::light::samples::LightLiSample;
use crate::sampling::direction_cone::DirectionCone;

#[derive(Debug)]
pub(crate) struct SunLight {
    cone: DirectionCone,
    /// Irradiance of a surface that faces the sun.
    irradiance: Vec3,
    /// Radiance of the disk; 0 without a disk.
    radiance: Vec3,
}

/// Squared sine of the half angle below which the disk is treated as a point, because float32 directions cannot resolve
/// it.
const MIN_SIN2: f64 = 1e-12;

impl SunLight {
    /// `direction` is the direction in which the light travels; `diameter` is an angle in degrees.
    pub fn new(direction: [f64; 3], irradiance: [f32; 3], diameter: f64) -> Self {
        let towards = (-DVec3::from(direction)).normalize_or_zero();
        let sin2 = (diameter.to_radians() / 2.0).sin().powi(2);
        let irradiance = Vec3::from(irradiance);
        // A surface that faces the sun receives the radiance times the integral of the cosine over the cone, pi sin^2.
        let sin2 = if sin2 < MIN_SIN2 { 0.0 } else { sin2 };
        let radiance = (sin2 > 0.0).then(|| (irradiance.as_dvec3() / (PI * sin2)).as_vec3());
        Self { cone: DirectionCone::new(towards, sin2), irradiance, radiance: radiance.unwrap_or_default() }
    }

    /// Direction to the sun, and the irradiance of a surface that faces it.
    pub fn direction_and_irradiance(&self) -> (Vec3, Vec3) {
        (self.cone.axis.as_vec3(), self.irradiance)
    }

    pub fn is_point(&self) -> bool {
        self.cone.one_minus_cos == 0.0
    }

    pub fn sample(&self, random: [f32; 2]) -> LightLiSample {
        let delta = self.is_point();
        LightLiSample {
            direction: if delta { self.cone.axis.as_vec3() } else { self.cone.sample(random).as_vec3() },
            p_light: None,
            radiance: if delta { self.irradiance } else { self.radiance },
            pdf: if delta { 1.0 } else { (1.0 / self.cone.solid_angle()) as f32 },
            is_delta: delta,
        }
    }

    pub fn pdf(&self, direction: Vec3) -> f32 {
        if !self.is_point() && self.cone.contains(direction.as_dvec3()) {
            (1.0 / self.cone.solid_angle()) as f32
        } else {
            0.0
        }
    }

    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        if !self.is_point() && self.cone.contains(direction.as_dvec3()) { self.radiance } else { Vec3::ZERO }
    }
}
