//! The light bulb: a point, or a sphere of even radiance, that itself is not seen and casts no shadow.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::Arriving;

#[derive(Debug)]
pub(crate) struct Bulb {
    /// Scene-local.
    pub center: DVec3,
    /// In W/sr.
    pub intensity: Vec3,
    pub radius: f64,
}

impl Bulb {
    /// The inverse square law; for a sphere, a direction drawn evenly from the cone it fills (P. Shirley, C. Wang and
    /// K. Zimmerman, "Monte Carlo techniques for direct lighting calculations", 1996). A sphere is dark inside.
    pub fn arriving(&self, point: DVec3, random: impl FnOnce() -> [f32; 2]) -> Option<Arriving> {
        let offset = self.center - point;
        let distance = offset.length();
        if distance <= self.radius || distance == 0.0 {
            return None;
        }
        let axis = offset / distance;
        if self.radius == 0.0 {
            return Some(Arriving {
                direction: axis.as_vec3(),
                from: Some(self.center),
                irradiance: (self.intensity.as_dvec3() / (distance * distance)).as_vec3(),
            });
        }
        // The cone's half angle; 1 - cos without cancellation, however far the bulb is.
        let sin2_max = (self.radius / distance).powi(2);
        let height = sin2_max / (1.0 + (1.0 - sin2_max).sqrt());
        let [x, y] = random().map(f64::from);
        let cap = x * height;
        let (cos, sin) = (1.0 - cap, (cap * (2.0 - cap)).sqrt());
        let (right, up) = axis.any_orthonormal_pair();
        let direction = axis * cos + (right * (TAU * y).cos() + up * (TAU * y).sin()) * sin;
        let near = distance * cos
            - (self.radius.powi(2) - (distance * sin).powi(2))
                .max(0.0)
                .sqrt();
        // Radiance is intensity / (pi r^2), the cone's solid angle 2 pi (1 - cos): their product stays finite.
        let irradiance = self.intensity.as_dvec3() * (TAU * height / (PI * self.radius.powi(2)));
        Some(Arriving {
            direction: direction.as_vec3(),
            from: Some(point + direction * near),
            irradiance: irradiance.as_vec3(),
        })
    }
}
