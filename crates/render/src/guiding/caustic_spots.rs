//! Caustic spots: small regions where casters focus light, and which then illuminate their surroundings like
//! lamps. Samples of other surfaces are guided to these spots, because shadow rays do not find them.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::guiding::caustic_casters::CausticCaster;

/// Maximum number of spots: each takes time at every diffuse hit. Lab note for all constants of this file: "Caustic
/// spots", 11-27.
pub(crate) const MAX_SPOTS: usize = 4;
/// Maximum radius in which photons form a spot, relative to the longest side of the world.
const MAX_RADIUS: f64 = 1.0 / 40.0;
/// Radius of a spot in standard deviations.
const RADIUS_SIGMAS: f64 = 1.5;
/// Margin added to the radius of a spot, relative to the longest side of the world.
const MARGIN: f64 = 1e-3;
/// Minimum noise that a spot causes without guiding, at a distance of half the world's size: the square of the spot's
/// fraction of all light, divided by the fraction of directions that the spot covers.
const MIN_NOISE: f64 = 0.05;
/// Minimum number of photons in a spot.
const MIN_PHOTONS: usize = 32;

/// Spots among landing points, with their fractions of all light, brightest first. `size` is the longest side of the
/// world.
pub(crate) fn find_spots(mut landed: Vec<(DVec3, f64)>, size: f64) -> Vec<CausticCaster> {
    let reach = MAX_RADIUS * size;
    let mut spots = vec![];
    while spots.len() < MAX_SPOTS {
        let Some(cell) = brightest_cell(&landed, reach) else {
            break;
        };
        let (center, radius, fraction) = gather(&landed, cell, reach);
        let radius = RADIUS_SIGMAS * radius + MARGIN * size;
        let (near, others): (Vec<_>, Vec<_>) = landed.into_iter().partition(|(at, _)| at.distance(center) <= reach);
        let noise = (fraction * 0.5 * size / radius).powi(2);
        let is_spot = near.len() >= MIN_PHOTONS && noise > MIN_NOISE;
        if !is_spot {
            break;
        }
        landed = others;
        spots.push(CausticCaster { instance: u32::MAX, center, radius, is_rough: false, weight: 1.0 });
    }
    spots
}

/// Mean of the points in the cell that receives the most light, weighted by their light; `size` is the side length of a
/// cell.
fn brightest_cell(landed: &[(DVec3, f64)], size: f64) -> Option<DVec3> {
    let mut cells = BTreeMap::<[i64; 3], (f64, DVec3)>::new();
    for &(at, light) in landed {
        let (sum, moment) = cells.entry((at / size).floor().as_i64vec3().to_array()).or_default();
        (*sum, *moment) = (*sum + light, *moment + light * at);
    }
    let brightest = cells.into_values().max_by(|(a, _), (b, _)| a.total_cmp(b));
    brightest.map(|(sum, moment)| moment / sum)
}

/// Mean, standard deviation and light of the points within `reach` of a centre, which is moved to their mean.
fn gather(landed: &[(DVec3, f64)], mut center: DVec3, reach: f64) -> (DVec3, f64, f64) {
    let (mut sigma, mut fraction) = (0.0, 0.0);
    for _ in 0..4 {
        let (mut sum, mut moment, mut square) = (0.0, DVec3::ZERO, 0.0);
        for &(at, light) in landed.iter().filter(|(at, _)| at.distance(center) < reach) {
            let offset = at - center;
            (sum, moment, square) = (sum + light, moment + light * offset, square + light * offset.length_squared());
        }
        let mean = moment / sum;
        (sigma, fraction) = ((square / sum - mean.length_squared()).max(0.0).sqrt(), sum);
        center += mean;
    }
    (center, sigma, fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 points, distributed evenly over a square of a floor, which together have the fraction `light` of all light.
    fn square(middle: [f64; 2], side: f64, light: f64) -> impl Iterator<Item = (DVec3, f64)> {
        let at = move |i: i32| (f64::from(i) + 0.5) / 20.0 - 0.5;
        let [x, y] = middle;
        (0..400).map(move |i| (DVec3::new(x + side * at(i % 20), y + side * at(i / 20), 0.0), light / 400.0))
    }

    #[test]
    fn caustic_spots_are_small_and_bright() {
        let all =
            square([0.0, 0.0], 2.0, 0.3).chain(square([0.3, 0.2], 0.04, 0.02)).chain(square([-0.5, 0.1], 0.04, 0.03));
        let spots = find_spots(all.collect(), 2.0);
        assert_eq!(spots.len(), 2);
        for (spot, x) in spots.iter().zip([-0.5, 0.3]) {
            assert!((spot.center.x - x).abs() < 2e-3 && spot.center.z == 0.0, "{spot:?}");
            // A square's standard deviation is its side divided by the square root of six.
            assert!((spot.radius - 1.5 * 0.04 / 6.0f64.sqrt() - 2e-3).abs() < 5e-3, "{spot:?}");
        }
        for dim in [square([0.0, 0.0], 2.0, 1.0), square([0.3, 0.2], 0.04, 1e-3)] {
            assert!(find_spots(dim.collect(), 2.0).is_empty());
        }
        assert!(find_spots(vec![], 2.0).is_empty());
    }
}
