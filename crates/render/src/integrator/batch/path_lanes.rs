//! Paths that arrive at the surfaces of a chunk, field by field.

use glam::Vec3;

use crate::integrator::path_state::PathState;
use crate::light::lights::Lights;
use crate::soa::{LANES, Vec3xN, set_lane};

/// The path of every lane.
#[derive(Debug, Default)]
pub(crate) struct PathLanes {
    pub throughput: Vec3xN<f32, LANES>,
    prev_point: Vec3xN<f64, LANES>,
    /// True if the last segment may have crossed a light without a mesh.
    pub may_cross_light: [bool; LANES],
}

impl PathLanes {
    #[inline]
    pub fn set(&mut self, lane: usize, path: &PathState) {
        let prev_point = path.prev_context.position;
        self.set_throughput(lane, path.throughput);
        set_lane(&mut self.prev_point, lane, prev_point.to_array());
    }

    #[inline]
    pub fn set_throughput(&mut self, lane: usize, throughput: Vec3) {
        set_lane(&mut self.throughput, lane, throughput.to_array());
    }

    /// Tests the last segments, which have these directions, against the bounds of lights without a mesh.
    pub fn test_light_bounds(&mut self, lights: &Lights, directions: &Vec3xN<f32, LANES>) {
        lights.may_intersect_any(&self.prev_point, directions, &mut self.may_cross_light);
    }
}
