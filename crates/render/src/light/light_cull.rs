//! Bounding spheres of lights, for a fast test that excludes most rays.

use glam::{DVec3, Vec3};
use raycam_bvh::WithSimd;

use crate::light::bounds::LightBounds;
use crate::soa::{Vec3xN, get_lane, lane_dvec3};

/// Sphere around a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundingSphere {
    center: DVec3,
    radius2: f32,
}

impl BoundingSphere {
    pub fn enclosing(bounds: &LightBounds) -> Self {
        let [lower, upper] = [bounds.lower, bounds.upper].map(|corner| corner.as_dvec3());
        let center = (lower + upper) / 2.0;
        // The radius includes the rounding errors of the corners, which are float32.
        let rounding = f64::from(f32::EPSILON) * (lower.abs() + upper.abs()).length();
        let radius = (upper - lower).length() / 2.0 + rounding;
        Self { center, radius2: (radius * radius * 1.01) as f32 }
    }

    /// False only if the ray misses the sphere.
    #[inline(always)]
    pub fn may_intersect(&self, from: DVec3, direction: Vec3) -> bool {
        let to_center = (self.center - from).as_vec3();
        let (along, distance2) = (to_center.dot(direction), to_center.length_squared());
        let limit = self.radius2 + 1e-5 * distance2;
        // Branch-free, for loops over many rays.
        (distance2 <= limit) | (along > 0.0) & (distance2 - along * along <= limit)
    }
}

/// Loop that tests many rays against all spheres.
pub(crate) struct TestSpheres<'a, const N: usize> {
    pub spheres: &'a [(usize, BoundingSphere)],
    pub from: &'a Vec3xN<f64, N>,
    pub directions: &'a Vec3xN<f32, N>,
    pub out: &'a mut [bool; N],
}

impl<const N: usize> WithSimd for TestSpheres<'_, N> {
    #[inline(always)]
    fn run(self) {
        let mut near = [false; N];
        for (_, sphere) in self.spheres {
            for (lane, near) in near.iter_mut().enumerate() {
                let from = lane_dvec3(self.from, lane);
                *near |= sphere.may_intersect(from, get_lane(self.directions, lane).into());
            }
        }
        *self.out = near;
    }
}
