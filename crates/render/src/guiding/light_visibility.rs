//! Light visibility: the parts of space in which light sampling finds light.
//!
//! Shadow rays towards lamps inside glass or in another room are blocked by the objects in between. Space is divided
//! into cubes, and light sampling is rare in cubes from which no light was found. Whether a cube is hidden depends only
//! on the world: the first thread that visits a cube tests it, and every other thread would get the same result.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::{DVec3, UVec3};

/// Maximum number of cubes along the longest side of the world. Lab note: "In cubes (24 along the longest side)",
/// 11-26.
const MAX_CELLS_PER_SIDE: u32 = 24;
/// Fraction of the points in hidden cubes at which lights are sampled. The value is greater than zero, because tests of
/// a few points do not prove that a cube is dark. Lab note: as above.
pub(crate) const HIDDEN_RATE: f32 = 1.0 / 8.0;

const UNKNOWN: u8 = 0;
const LIT: u8 = 1;
const HIDDEN: u8 = 2;

/// Cubes into which space is divided, each marked as untested, lit or hidden from the lights.
#[derive(Debug)]
pub(crate) struct LightVisibility {
    /// Scene-local corner with the smallest coordinates.
    lower: DVec3,
    size: f64,
    cells_per_unit: f64,
    counts: UVec3,
    cells: Vec<AtomicU8>,
}

impl LightVisibility {
    /// Creates the untested cubes of a box; `None` for a box without a size.
    pub fn new([lower, upper]: [DVec3; 2]) -> Option<Self> {
        let extent = upper - lower;
        let size = extent.max_element() / f64::from(MAX_CELLS_PER_SIDE);
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let counts = (extent / size).ceil().as_uvec3().clamp(UVec3::ONE, UVec3::splat(MAX_CELLS_PER_SIDE));
        let cells = (0..counts.element_product()).map(|_| AtomicU8::new(UNKNOWN)).collect();
        Some(Self { lower, size, cells_per_unit: 1.0 / size, counts, cells })
    }

    /// Creates the same cubes, with all cubes hidden.
    #[cfg(test)]
    pub fn all_hidden(bounds: [DVec3; 2]) -> Option<Self> {
        let all = Self::new(bounds)?;
        all.cells.iter().for_each(|cell| cell.store(HIDDEN, Ordering::Relaxed));
        Some(all)
    }

    /// Fraction of the hits near a point at which lights are sampled. `sees_light` tests a cube that has not
    /// been tested yet: it receives the cube's lower and upper corner, and returns true if light is visible
    /// from the cube. Its result must depend only on the cube.
    #[inline]
    pub fn rate(&self, position: DVec3, sees_light: impl FnOnce([DVec3; 2]) -> bool) -> f32 {
        let last = (self.counts - UVec3::ONE).as_dvec3();
        // Points outside all cubes belong to the nearest cube.
        let cell = ((position - self.lower) * self.cells_per_unit).clamp(DVec3::ZERO, last).as_uvec3();
        let index = (cell.z * self.counts.y + cell.y) * self.counts.x + cell.x;
        let state = &self.cells[index as usize];
        let mut known = state.load(Ordering::Relaxed);
        if known == UNKNOWN {
            let lower = self.lower + cell.as_dvec3() * self.size;
            known = if sees_light([lower, lower + self.size]) { LIT } else { HIDDEN };
            state.store(known, Ordering::Relaxed);
        }
        if known == LIT { 1.0 } else { HIDDEN_RATE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cube_is_tested_once() {
        let visibility = LightVisibility::new([DVec3::splat(-1.0), DVec3::new(5.0, 1.0, 0.5)]).unwrap();
        assert_eq!(visibility.counts, UVec3::new(24, 8, 6));
        let mut asked = vec![];
        for _ in 0..2 {
            for x in [-0.9, 0.1, 4.99, 1e9] {
                let rate = visibility.rate(DVec3::new(x, 0.1, 0.2), |[lower, upper]| {
                    assert!((upper - lower).abs_diff_eq(DVec3::splat(0.25), 1e-12));
                    asked.push(lower.x);
                    lower.x < 2.0
                });
                assert_eq!(rate, if x < 2.0 { 1.0 } else { HIDDEN_RATE });
            }
        }
        assert_eq!(asked, [-1.0, 0.0, 4.75]);
    }

    #[test]
    fn boxes_without_size_have_no_cubes() {
        for corner in [DVec3::ZERO, DVec3::splat(f64::INFINITY), DVec3::splat(f64::NAN)] {
            assert!(LightVisibility::new([DVec3::ZERO, corner]).is_none());
        }
    }
}
