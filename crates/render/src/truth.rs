//! Ground truth: the channels of the exact ray through the pixel's centre, in float64.

use glam::DVec3;
use raycam_bvh::{ExactHit, NOTHING};

use crate::prepare::PreparedWorld;
use crate::surface::facing_normal;

/// A pixel-centre ray and what it met.
pub(crate) struct Truth<'a> {
    pub world: &'a PreparedWorld,
    /// The camera's principal axis, unit length.
    pub forward: DVec3,
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    pub hit: ExactHit,
}

impl Truth<'_> {
    fn missed(&self) -> bool {
        self.hit.instance == NOTHING
    }

    pub fn depth(&self) -> f32 {
        if self.missed() {
            f32::INFINITY
        } else {
            (self.hit.t * self.direction.dot(self.forward)) as f32
        }
    }

    pub fn distance(&self) -> f32 {
        if self.missed() {
            f32::INFINITY
        } else {
            self.hit.t as f32
        }
    }

    pub fn position(&self) -> [f64; 3] {
        let point = if self.missed() {
            DVec3::NAN
        } else {
            self.origin + self.hit.t * self.direction
        };
        point.to_array()
    }

    pub fn normal(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        let corners = self.world.corners(self.hit.instance, self.hit.triangle);
        facing_normal(corners, self.direction).as_vec3().to_array()
    }

    pub fn barycentric(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        let ExactHit { u, v, .. } = self.hit;
        [1.0 - u - v, u, v].map(|weight| weight as f32)
    }

    pub fn instance(&self) -> i32 {
        id(self.hit.instance)
    }

    pub fn triangle(&self) -> i32 {
        id(self.hit.triangle)
    }
}

/// An id as it is stored: -1 for nothing.
pub(crate) fn id(id: u32) -> i32 {
    i32::try_from(id).unwrap_or(-1)
}
