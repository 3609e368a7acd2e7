//! Disk light: a disk of uniform radiance.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::light::bounds::LightBounds;
use crate::light::samples::LightLiSample;

#[derive(Debug)]
pub(crate) struct DiskLight {
    /// Scene-local centre of the disk.
    center: DVec3,
    /// Unit normal on the side that emits.
    normal: DVec3,
    radius: f64,
    radiance: Vec3,
    two_sided: bool,
}

impl DiskLight {
    pub fn new(center: DVec3, direction: DVec3, radius: f64, radiance: Vec3, two_sided: bool) -> Self {
        Self { center, normal: direction.normalize_or_zero(), radius, radiance, two_sided }
    }

    pub fn bounds(&self) -> LightBounds {
        // Half extent of the disk along each axis.
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO);
        let reach = DVec3::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * self.radius;
        let corners = [self.center - reach, self.center + reach];
        let intensity = self.radiance.as_dvec3() * (PI * self.radius * self.radius);
        LightBounds::planar(&corners, self.normal, intensity.as_vec3(), self.two_sided)
    }

    /// Samples a point on the disk uniformly by area.
    pub fn sample(&self, point: DVec3, [x, y]: [f32; 2]) -> Option<LightLiSample> {
        if !self.faces(point) {
            return None;
        }
        let (right, up) = self.normal.any_orthonormal_pair();
        let radius = self.radius * f64::from(x).sqrt();
        let (sin, cos) = (TAU * f64::from(y)).sin_cos();
        let end = self.center + (right * cos + up * sin) * radius;
        let offset = end - point;
        let direction = offset.normalize_or_zero();
        let density = self.pdf(offset.length_squared(), direction);
        LightLiSample::new(direction, end, self.radiance, density)
    }

    fn pdf(&self, distance2: f64, direction: DVec3) -> f64 {
        distance2 / (PI * self.radius * self.radius * self.normal.dot(direction).abs())
    }

    /// Distance at which a ray hits the disk, the radiance there, and the density of [`DiskLight::sample`]; `None` for
    /// a miss.
    pub fn intersect(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let direction = direction.as_dvec3();
        let distance = (self.center - point).dot(self.normal) / direction.dot(self.normal);
        let met = distance.is_finite()
            && distance > 0.0
            && self.faces(point)
            && (point + direction * distance - self.center).length() <= self.radius;
        met.then(|| {
            let density = self.pdf(distance * distance, direction);
            (distance, self.radiance, density)
        })
    }

    fn faces(&self, point: DVec3) -> bool {
        let height = (point - self.center).dot(self.normal);
        height > 0.0 || self.two_sided && height < 0.0
    }
}
