//! The disk light: a disk of even radiance.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::LightSample;
use super::bounds::Bounds;

#[derive(Debug)]
pub(crate) struct Disk {
    /// Scene-local.
    center: DVec3,
    /// Where it shines to.
    normal: DVec3,
    radius: f64,
    radiance: Vec3,
    two_sided: bool,
}

impl Disk {
    pub fn new(
        center: DVec3,
        direction: DVec3,
        radius: f64,
        radiance: Vec3,
        two_sided: bool,
    ) -> Self {
        Self {
            center,
            normal: direction.normalize_or_zero(),
            radius,
            radiance,
            two_sided,
        }
    }

    pub fn bounds(&self) -> Bounds {
        // How far a disk reaches along an axis.
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO);
        let reach = DVec3::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * self.radius;
        let corners = [self.center - reach, self.center + reach];
        let intensity = self.radiance.as_dvec3() * (PI * self.radius * self.radius);
        Bounds::flat(&corners, self.normal, intensity.as_vec3(), self.two_sided)
    }

    /// A point drawn evenly from the area.
    pub fn sample(&self, point: DVec3, [x, y]: [f32; 2]) -> Option<LightSample> {
        if !self.shines_to(point) {
            return None;
        }
        let (right, up) = self.normal.any_orthonormal_pair();
        let radius = self.radius * f64::from(x).sqrt();
        let (sin, cos) = (TAU * f64::from(y)).sin_cos();
        let end = self.center + (right * cos + up * sin) * radius;
        let offset = end - point;
        let direction = offset.normalize_or_zero();
        let density = self.density(offset.length_squared(), direction);
        LightSample::toward(direction, end, self.radiance, density)
    }

    fn density(&self, distance2: f64, direction: DVec3) -> f64 {
        distance2 / (PI * self.radius * self.radius * self.normal.dot(direction).abs())
    }

    pub fn crossed(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let direction = direction.as_dvec3();
        let distance = (self.center - point).dot(self.normal) / direction.dot(self.normal);
        let met = distance.is_finite()
            && distance > 0.0
            && self.shines_to(point)
            && (point + direction * distance - self.center).length() <= self.radius;
        met.then(|| {
            let density = self.density(distance * distance, direction);
            (distance, self.radiance, density)
        })
    }

    fn shines_to(&self, point: DVec3) -> bool {
        let height = (point - self.center).dot(self.normal);
        height > 0.0 || self.two_sided && height < 0.0
    }
}
