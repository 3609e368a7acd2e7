//! Spot light: a point or a sphere whose light is restricted to a cone (glTF `KHR_lights_punctual`).

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::light::bounds::LightBounds;
use crate::light::point::PointLight;
use crate::light::samples::LightLiSample;

#[derive(Debug)]
pub(crate) struct SpotLight {
    /// Scene-local position of the light.
    position: DVec3,
    radius: f64,
    axis: DVec3,
    /// Radiant intensity on the axis in W/sr, for each colour.
    intensity: Vec3,
    cos_inner: f64,
    cos_outer: f64,
}

impl SpotLight {
    /// Creates a spot light with the intensity 1; `inner` and `outer` are half angles in degrees.
    pub fn new(position: DVec3, direction: DVec3, inner: f64, outer: f64, radius: f64) -> Self {
        Self {
            position,
            radius,
            axis: direction.normalize_or_zero(),
            intensity: Vec3::ONE,
            cos_inner: inner.to_radians().cos(),
            cos_outer: outer.to_radians().cos(),
        }
    }

    pub fn with_intensity(self, intensity: Vec3) -> Self {
        Self { intensity, ..self }
    }

    /// Sets the intensity from the power. The integral of the falloff is 2π times the sum of 1 - cos inner (full
    /// intensity) and (cos inner - cos outer) / 3 (penumbra, in which the falloff is a square).
    pub fn with_power(self, power: Vec3) -> Self {
        let full = 1.0 - self.cos_inner + (self.cos_inner - self.cos_outer) / 3.0;
        self.with_intensity((power.as_dvec3() / (TAU * full)).as_vec3())
    }

    pub fn bounds(&self) -> LightBounds {
        let spread = self.cos_outer.acos() - self.cos_inner.acos();
        LightBounds {
            cos_theta_o: self.cos_inner as f32,
            cos_theta_e: spread.cos() as f32,
            axis: self.axis.as_vec3(),
            ..LightBounds::isotropic(self.position - self.radius, self.position + self.radius, self.intensity)
        }
    }

    pub fn is_point(&self) -> bool {
        self.radius == 0.0
    }

    /// The spot light without its cone: a sphere that shines equally in every direction.
    fn sphere(&self) -> PointLight {
        PointLight::new(self.position, self.intensity, self.radius)
    }

    /// Falloff at a point, by the direction from the light's centre.
    fn falloff_at(&self, point: DVec3) -> f32 {
        self.falloff((point - self.position).normalize_or_zero().dot(self.axis)) as f32
    }

    /// Distance at which a ray hits the sphere, the radiance there, and the density of [`SpotLight::sample`].
    pub fn intersect(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let (distance, radiance, density) = self.sphere().intersect(point, direction)?;
        let falloff = self.falloff_at(point);
        (falloff > 0.0).then_some((distance, radiance * falloff, density))
    }

    pub fn sample(&self, point: DVec3, random: [f32; 2]) -> Option<LightLiSample> {
        if !self.is_point() {
            let falloff = self.falloff_at(point);
            let mut sample = self.sphere().sample(point, random).filter(|_| falloff > 0.0)?;
            sample.radiance *= falloff;
            return Some(sample);
        }
        let offset = self.position - point;
        let distance = offset.length();
        if distance == 0.0 {
            return None;
        }
        let direction = offset / distance;
        let falloff = self.falloff(-direction.dot(self.axis));
        let radiance = self.intensity.as_dvec3() * (falloff / (distance * distance));
        (falloff > 0.0).then(|| LightLiSample::from_delta(direction, Some(self.position), radiance))
    }

    fn falloff(&self, cos: f64) -> f64 {
        if cos >= self.cos_inner {
            return 1.0;
        }
        let share = (cos - self.cos_outer) / (self.cos_inner - self.cos_outer);
        share.max(0.0).powi(2)
    }
}
