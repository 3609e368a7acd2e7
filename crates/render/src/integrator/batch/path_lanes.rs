//! Paths that arrive at surfaces, many at a time, field by field.

use crate::integrator::path::PathState;
use crate::light::lights::Lights;
use crate::soa::{LANES, Vec3xN, set_lane};

/// What surfaces of every kind ask of them.
#[derive(Debug)]
pub(crate) struct PathLanes<const N: usize> {
    pub throughput: Vec3xN<f32, N>,
    /// Where they come from, and whether they may have crossed lights since.
    prev_point: Vec3xN<f64, N>,
    pub may_cross_light: [bool; N],
}

impl<const N: usize> Default for PathLanes<N> {
    fn default() -> Self {
        Self {
            throughput: [[0.0; N]; 3],
            prev_point: [[0.0; N]; 3],
            may_cross_light: [false; N],
        }
    }
}

impl PathLanes<LANES> {
    /// Sets a lane.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, path: &PathState) {
        set_lane(&mut self.throughput, lane, path.throughput.to_array());
        set_lane(
            &mut self.prev_point,
            lane,
            path.prev_context.position.to_array(),
        );
    }

    /// Finds which may have crossed lights, in these directions.
    pub fn test_light_bounds(&mut self, lights: &Lights, directions: &Vec3xN<f32, LANES>) {
        lights.may_intersect_any(&self.prev_point, directions, &mut self.may_cross_light);
    }
}
