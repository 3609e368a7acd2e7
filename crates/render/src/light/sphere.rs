//! Spheres around lights: most rays miss most lights, and this says so at little cost.

use glam::{DVec3, Vec3};

use super::bounds::Bounds;

/// A sphere around a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    center: DVec3,
    radius2: f32,
}

impl Sphere {
    pub fn around(bounds: &Bounds) -> Self {
        let [lower, upper] = [bounds.lower, bounds.upper].map(|corner| corner.as_dvec3());
        let center = (lower + upper) / 2.0;
        // The corners have been rounded to float32.
        let rounding = f64::from(f32::EPSILON) * (lower.abs() + upper.abs()).length();
        let radius = (upper - lower).length() / 2.0 + rounding;
        Self {
            center,
            radius2: (radius * radius * 1.01) as f32,
        }
    }

    /// Whether a ray may meet it; false only if it does not.
    #[inline]
    pub fn is_near(&self, from: DVec3, direction: Vec3) -> bool {
        let way = (self.center - from).as_vec3();
        let (along, distance2) = (way.dot(direction), way.length_squared());
        let room = self.radius2 + 1e-5 * distance2;
        distance2 <= room || along > 0.0 && distance2 - along * along <= room
    }
}
