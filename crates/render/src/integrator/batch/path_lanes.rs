//! Paths that arrive at surfaces, many at a time, field by field.

use crate::integrator::path::Path;
use crate::light::Lights;
use crate::soa::{LANES, Three, set};

/// What surfaces of every kind ask of them.
#[derive(Debug)]
pub(crate) struct Arriving<const N: usize> {
    pub throughput: Three<f32, N>,
    /// Where they come from, and whether they may have crossed lights since.
    from: Three<f64, N>,
    pub near: [bool; N],
}

impl<const N: usize> Default for Arriving<N> {
    fn default() -> Self {
        Self {
            throughput: [[0.0; N]; 3],
            from: [[0.0; N]; 3],
            near: [false; N],
        }
    }
}

impl Arriving<LANES> {
    /// Sets a lane.
    #[inline]
    pub fn put(&mut self, lane: usize, path: &Path) {
        set(&mut self.throughput, lane, path.throughput.to_array());
        set(&mut self.from, lane, path.from.position.to_array());
    }

    /// Finds which may have crossed lights, in these directions.
    pub fn find_near(&mut self, lights: &Lights, directions: &Three<f32, LANES>) {
        lights.find_near(&self.from, directions, &mut self.near);
    }
}
