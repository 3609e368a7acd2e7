//! Rays of a lidar's beams: an elliptical Gaussian, sampled by a fixed set of rays.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::error::RenderError;
use crate::thread_pool::with_pool;

/// Horizontal part of a unit direction below which the beam counts as vertical; its horizontal axis is then
/// y.
const MIN_HORIZONTAL: f64 = 1e-9;

/// Beams of a lidar. The horizontal axis of a beam is perpendicular to z.
#[derive(Clone, Copy, Debug)]
pub struct Beams<'a> {
    /// Origins of the axes, in sensor axes.
    pub origins: &'a [[f64; 3]],
    /// Unit directions of the axes, in sensor axes.
    pub directions: &'a [[f64; 3]],
    /// Rotation of the set of rays about each axis, as a fraction of a full turn.
    pub turns: &'a [f64],
    /// Rotation world_from_sensor of each beam, or a single rotation.
    pub rotations: &'a [[[f64; 3]; 3]],
    /// Points of the cross section, in units of the 1/e² radius; a single point always stands for the axis.
    pub samples: &'a [[f64; 2]],
    /// Horizontal and vertical width at the origin, in metres.
    pub width: [f64; 2],
    /// Tangents of half the horizontal and vertical divergence.
    pub half_tangents: [f64; 2],
}

/// Start relative to the sensor's position, in metres, and unit direction of a ray, in world axes.
pub type BeamRay = ([f64; 3], [f64; 3]);

/// Points or directions, one per ray.
pub type RayVectors = Vec<[f64; 3]>;

/// Starts and directions of the rays of all beams, `samples.len()` per beam.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length, and errors of `with_pool`.
pub fn beam_rays(beams: &Beams, threads: Option<usize>) -> Result<(RayVectors, RayVectors), RenderError> {
    let (n, k) = (beams.origins.len(), beams.samples.len());
    if [beams.directions.len(), beams.turns.len()] != [n; 2] || ![1, n].contains(&beams.rotations.len()) || k == 0 {
        return Err(RenderError::settings(format!(
            "beams: expected {n} directions, {n} turns, 1 or {n} rotations, and at least 1 sample; got {}, {}, {} and {k}",
            beams.directions.len(),
            beams.turns.len(),
            beams.rotations.len()
        )));
    }
    let (mut starts, mut ways) = (vec![[0.0; 3]; n * k], vec![[0.0; 3]; n * k]);
    with_pool(threads, || {
        let rows = starts.par_chunks_exact_mut(k).zip(ways.par_chunks_exact_mut(k)).with_min_len(1024);
        rows.enumerate().for_each(|(i, (starts, ways))| {
            let rotation = &beams.rotations[if beams.rotations.len() == 1 { 0 } else { i }];
            let write = |at: usize, (start, way): BeamRay| {
                starts[at] = rotated(rotation, start);
                ways[at] = rotated(rotation, way);
            };
            beams.rays(i, write);
        });
    })?;
    Ok((starts, ways))
}

impl Beams<'_> {
    /// Calls `write` for each ray of a beam, with the index of its sample and the ray in sensor axes.
    fn rays(&self, beam: usize, mut write: impl FnMut(usize, BeamRay)) {
        let (origin, [x, y, z]) = (self.origins[beam], self.directions[beam]);
        if self.samples.len() == 1 {
            return write(0, (origin, [x, y, z]));
        }
        let flat = (x * x + y * y).sqrt();
        let side = if flat < MIN_HORIZONTAL { [0.0, 1.0, 0.0] } else { [-y / flat, x / flat, 0.0] };
        let above = [y * side[2] - z * side[1], z * side[0] - x * side[2], x * side[1] - y * side[0]];
        let angle = TAU * self.turns[beam];
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        for (at, [a, b]) in self.samples.iter().enumerate() {
            let (u, v) = (cos * a - sin * b, sin * a + cos * b);
            let [right, up] = [u * self.width[0] / 2.0, v * self.width[1] / 2.0];
            let start = [0, 1, 2].map(|i| origin[i] + right * side[i] + up * above[i]);
            let [right, up] = [u * self.half_tangents[0], v * self.half_tangents[1]];
            let way = [0, 1, 2].map(|i| self.directions[beam][i] + right * side[i] + up * above[i]);
            let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
            write(at, (start, way.map(|value| value / length)));
        }
    }
}

fn rotated(rotation: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    rotation.map(|[a, b, c]| x * a + y * b + z * c)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn rays_of(direction: [f64; 3], turn: f64, rotation: [[f64; 3]; 3]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let beams = Beams {
            origins: &[[1.0, 2.0, 3.0]],
            directions: &[direction],
            turns: &[turn],
            rotations: &[rotation],
            samples: &[[0.0, 0.0], [1.0, 0.0]],
            width: [0.2, 0.4],
            half_tangents: [0.01, 0.02],
        };
        beam_rays(&beams, Some(1)).unwrap()
    }

    #[test]
    fn beam_rays_start_and_diverge_along_the_beam_axes() {
        let (starts, ways) = rays_of([1.0, 0.0, 0.0], 0.0, IDENTITY);
        assert_eq!(starts, [[1.0, 2.0, 3.0], [1.0, 2.1, 3.0]]);
        assert_eq!(ways[0], [1.0, 0.0, 0.0]);
        assert!((ways[1][1] / ways[1][0] - 0.01).abs() < 1e-15);
        // A quarter turn of the set moves the second ray from the horizontal to the vertical axis.
        let (starts, ways) = rays_of([1.0, 0.0, 0.0], 0.25, IDENTITY);
        assert!((starts[1][2] - 3.2).abs() < 1e-15 && (ways[1][2] / ways[1][0] - 0.02).abs() < 1e-15);
    }

    #[test]
    fn rotations_turn_starts_and_directions() {
        let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let (starts, ways) = rays_of([0.0, 0.0, 1.0], 0.0, quarter);
        assert_eq!(starts, [[-2.0, 1.0, 3.0], [-2.1, 1.0, 3.0]]);
        assert_eq!(ways[0], [0.0, 0.0, 1.0]);
        assert!(ways[1][0] < 0.0);
    }
}
