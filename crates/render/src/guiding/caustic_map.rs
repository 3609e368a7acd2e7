//! Caustic maps: for a receiving point, the region of a caster from which the point's photons came.
//!
//! Photons guide paths (H. W. Jensen, "Importance Driven Path Tracing using the Photon Map", Rendering
//! Techniques 1995). The space around a caster is divided into cells by direction and distance. A cell stores
//! up to two spheres to which samples of diffuse surfaces are guided: the photon neighbourhoods that are
//! brightest relative to their size. Photons are neighbours if their exit points on the caster, or points
//! further along their paths, are close to each other.

use glam::{DVec3, Vec3};

use crate::guiding::caustic_casters::CausticCaster;
use crate::soa::{Vec3xN, lane_vec3, set_lane};

/// Number of cells per side of the square that represents directions (octahedral map). Lab note: "32 x 32 directions, 8
/// distances", 11-23.
const CELLS_PER_SIDE: usize = 32;
/// Number of distance layers from infinity to the bounding sphere, uniform in the reciprocal of the distance. Lab note:
/// as above.
const DISTANCE_LAYERS: usize = 8;
const CELL_COUNT: usize = CELLS_PER_SIDE * CELLS_PER_SIDE * DISTANCE_LAYERS;
/// Maximum side length, in cells, of the blocks into which cells with few photons are merged. Not tuned.
const COARSEST_SIDE: usize = 8;
/// Minimum number of photons per target. Not tuned: with fewer photons, the standard deviation is unknown.
const MIN_PHOTONS: usize = 5;
/// Maximum number of photons per block that are compared with each other. Not tuned: limits the learning time.
const MAX_PHOTONS: usize = 64;
/// Distances from the landing point along a photon's path, in radii of the caster, at which photons are compared in
/// addition to their exit points. Behind a thin wall, directions are similar but exit points differ. Lab note: "points
/// at 2, 6 and 20 radii", 11-27.
const WAY_DISTANCES: [f64; 3] = [2.0, 6.0, 20.0];
/// Radii of the compared neighbourhoods, relative to their distance from the landing points, and the divisors of their
/// light. The divisor is the radius to the power of 0.4, so that small neighbourhoods win unless they have few photons.
/// Lab note: "light divided by the radius to the power of 0.4", 11-27.
const NEIGHBORHOODS: [(f64, f64); 5] =
    [(0.03, 0.24595), (0.06, 0.324534), (0.12, 0.428225), (0.25, 0.574349), (0.5, 0.757858)];
/// Radius of a target in standard deviations; 1.4 would cover a uniform disk. Lab note: "2.1 standard deviations wide",
/// 11-27.
const RADIUS_SIGMAS: f64 = 2.1;
/// Minimum radius of a target, in radii of the caster, or relative to the target's distance from the receiver if this
/// distance exceeds the caster's radius. Not tuned.
const MIN_RADIUS: f64 = 0.02;
/// Minimum fraction of a block's light that its second target must have, and minimum fraction of a caster's light in
/// cells with a second target. Lab note: "a second target only if a tenth of the caster's photons need such a target",
/// 11-27.
const MIN_SECOND_FRACTION: f64 = 0.1;
/// Distance from exit to receiver, in radii of the caster, below which the receiver touches the caster. Lab note:
/// "Receivers that touch the caster", 11-26.
const MIN_EXIT_DISTANCE: f64 = 0.1;

/// Sphere from which a cell's photons came, relative to the caster's centre and in units of the caster's radius.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GuideTarget {
    pub center: [f32; 3],
    /// Radius; 0 if the cell has no photons.
    pub radius: f32,
}

/// Guide targets of N points, one per point.
pub(crate) struct GuideTargets<const N: usize> {
    pub center: Vec3xN<f32, N>,
    pub radius: [f32; N],
}

/// One guide target per cell.
type CellTargets = Box<[GuideTarget; CELL_COUNT]>;

/// Targets of all cells around a caster. A cell has a first target and, in some maps, a second one.
#[derive(Clone, Debug)]
pub(crate) struct CausticMap {
    first: CellTargets,
    /// `None` if few cells require second targets, because every target takes time at every diffuse hit.
    second: Option<CellTargets>,
}

/// Path of a photon from its exit point on a caster to a receiver, scene-local.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhotonDeposit {
    pub exit_point: DVec3,
    pub landing_point: DVec3,
    /// Photon weight, greater than 0, in any unit.
    pub power: f64,
}

/// A photon in coordinates relative to the caster's centre, in units of the caster's radius.
struct MapPhoton {
    cell: usize,
    landing: DVec3,
    /// The photon's exit point, followed by the points on its path at [`WAY_DISTANCES`] from the landing point.
    ways: [DVec3; WAY_DISTANCES.len() + 1],
    power: f64,
}

impl MapPhoton {
    fn new(caster: &CausticCaster, deposit: &PhotonDeposit) -> Self {
        let relative = |point: DVec3| (point - caster.center) / caster.radius;
        let (exit, landing) = (relative(deposit.exit_point), relative(deposit.landing_point));
        let direction = (exit - landing).normalize_or_zero();
        let [near, middle, far] = WAY_DISTANCES.map(|distance| landing + distance * direction);
        let ways = [visible_exit(exit, landing), near, middle, far];
        Self { cell: cell_index(landing.as_vec3()) as usize, landing, ways, power: deposit.power }
    }
}

impl CausticMap {
    /// Creates the map of a caster's photons.
    pub fn new(caster: &CausticCaster, deposits: impl Iterator<Item = PhotonDeposit>) -> Self {
        let photons: Vec<_> = deposits.map(|deposit| MapPhoton::new(caster, &deposit)).collect();
        // The arrays are allocated directly on the heap, because worker threads have small stacks.
        let none = || vec![GuideTarget::default(); CELL_COUNT].try_into().expect("one for each cell");
        let (mut first, mut second): (CellTargets, CellTargets) = (none(), none());
        let mut size = 1;
        while size <= COARSEST_SIDE {
            let block = |cell: usize| {
                let [x, y, layer] = [
                    cell % CELLS_PER_SIDE,
                    cell / CELLS_PER_SIDE % CELLS_PER_SIDE,
                    cell / (CELLS_PER_SIDE * CELLS_PER_SIDE),
                ];
                ((layer / size) * CELLS_PER_SIDE + y / size) * CELLS_PER_SIDE + x / size
            };
            let mut blocks: Vec<Vec<&MapPhoton>> = vec![vec![]; CELL_COUNT];
            photons.iter().for_each(|photon| blocks[block(photon.cell)].push(photon));
            let targets: Vec<_> = blocks.iter().map(|block| block_targets(block)).collect();
            for (cell, (first, second)) in first.iter_mut().zip(&mut *second).enumerate() {
                if first.radius == 0.0 {
                    [*first, *second] = targets[block(cell)];
                }
            }
            size *= 2;
        }
        let all: f64 = photons.iter().map(|photon| photon.power).sum();
        let twice = photons.iter().filter(|photon| second[photon.cell].radius > 0.0).map(|photon| photon.power);
        let second = (twice.sum::<f64>() > MIN_SECOND_FRACTION * all).then_some(second);
        Self { first, second }
    }

    /// Targets of points, given relative to the caster's centre and in units of its radius. Also returns the second
    /// targets, if the map has any.
    #[inline(always)]
    pub fn lookup_lanes<const N: usize>(&self, points: &Vec3xN<f32, N>) -> (GuideTargets<N>, Option<GuideTargets<N>>) {
        let mut cells = [0; N];
        for (lane, cell) in cells.iter_mut().enumerate() {
            *cell = cell_index(lane_vec3(points, lane));
        }
        (gather(&self.first, &cells), self.second.as_ref().map(|second| gather(second, &cells)))
    }

    /// The guiding targets for one point.
    #[cfg(test)]
    pub fn lookup(&self, point: Vec3) -> [GuideTarget; 2] {
        let (first, second) = self.lookup_lanes(&point.to_array().map(|x| [x]));
        [Some(first), second].map(|targets| {
            targets.map_or_else(GuideTarget::default, |targets| GuideTarget {
                center: targets.center.map(|[x]| x),
                radius: targets.radius[0],
            })
        })
    }
}

#[inline(always)]
fn gather<const N: usize>(all: &CellTargets, cells: &[u32; N]) -> GuideTargets<N> {
    let mut targets = GuideTargets { center: [[0.0; N]; 3], radius: [0.0; N] };
    for (lane, &cell) in cells.iter().enumerate() {
        // The table size is a power of two, so that a mask replaces the bounds check.
        let GuideTarget { center, radius } = all[cell as usize % CELL_COUNT];
        set_lane(&mut targets.center, lane, center);
        targets.radius[lane] = radius;
    }
    targets
}

/// Point from which a photon arrives at a receiver: where the photon left the caster or, if the receiver
/// touches the caster (a floor under water, for example), a point one caster radius away.
fn visible_exit(exit: DVec3, landing: DVec3) -> DVec3 {
    let way = exit - landing;
    let distance = way.length();
    if distance < MIN_EXIT_DISTANCE && distance > 0.0 { landing + way / distance } else { exit }
}

/// Targets of a block's photons: the two neighbourhoods of photons that are brightest relative to their size.
fn block_targets(block: &[&MapPhoton]) -> [GuideTarget; 2] {
    let step = block.len().div_ceil(MAX_PHOTONS).max(1);
    let mut left: Vec<_> = block.iter().copied().step_by(step).collect();
    let power: f64 = left.iter().map(|photon| photon.power).sum();
    let landing = left.iter().map(|photon| photon.landing * photon.power).sum::<DVec3>() / power;
    let mut targets = [GuideTarget::default(); 2];
    for (number, target) in targets.iter_mut().enumerate() {
        let Some((way, center, radius)) = brightest_neighborhood(&left, landing) else {
            break;
        };
        let is_near = |photon: &&MapPhoton| photon.ways[way].distance_squared(center) <= radius * radius;
        let (near, others): (Vec<_>, Vec<_>) = left.into_iter().partition(is_near);
        left = others;
        let (mut sum, mut moment, mut square) = (0.0, DVec3::ZERO, 0.0);
        for photon in near {
            let offset = photon.ways[way] - center;
            sum += photon.power;
            moment += photon.power * offset;
            square += photon.power * offset.length_squared();
        }
        if number > 0 && sum < MIN_SECOND_FRACTION * power {
            break;
        }
        let mean = moment / sum;
        let sigma = (square / sum - mean.length_squared()).max(0.0).sqrt();
        let radius = RADIUS_SIGMAS * sigma + MIN_RADIUS * center.distance(landing).max(1.0);
        *target = GuideTarget { center: (center + mean).as_vec3().to_array(), radius: radius as f32 };
    }
    targets
}

/// Distance index, centre and radius of the photon neighbourhood that is brightest relative to its size; `None` if
/// there are too few photons.
fn brightest_neighborhood(photons: &[&MapPhoton], landing: DVec3) -> Option<(usize, DVec3, f64)> {
    let mut best = (0.0, None);
    for way in 0..=WAY_DISTANCES.len() {
        for photon in photons {
            let center = photon.ways[way];
            let reach2 = center.distance_squared(landing);
            let mut sums = [(0.0, 0); NEIGHBORHOODS.len()];
            for other in photons {
                let off2 = other.ways[way].distance_squared(center);
                for ((power, count), (radius, _)) in sums.iter_mut().zip(NEIGHBORHOODS) {
                    if off2 <= radius * radius * reach2 {
                        (*power, *count) = (*power + other.power, *count + 1);
                    }
                }
            }
            for ((power, count), (radius, size)) in sums.into_iter().zip(NEIGHBORHOODS) {
                let worth = power / size;
                if count >= MIN_PHOTONS && worth > best.0 {
                    best = (worth, Some((way, center, radius * reach2.sqrt())));
                }
            }
        }
    }
    best.1
}

/// Cell of a point: octahedral directions (Q. Meyer et al., "On Floating-Point Normal Vectors", 2010) and distance
/// layers.
#[inline(always)]
fn cell_index(point: Vec3) -> u32 {
    let sum = point.x.abs() + point.y.abs() + point.z.abs();
    let (x, y) = (point.x / sum, point.y / sum);
    let folded = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    let (x, y) = if point.z < 0.0 { folded } else { (x, y) };
    let along = |x: f32, cells: usize| (x * cells as f32).clamp(0.0, cells as f32 - 1.0) as u32;
    let [x, y] = [x, y].map(|x| along(0.5 * x + 0.5, CELLS_PER_SIDE));
    let layer = along(1.0 / point.length(), DISTANCE_LAYERS);
    (layer * CELLS_PER_SIDE as u32 + y) * CELLS_PER_SIDE as u32 + x
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const CASTER: CausticCaster =
        CausticCaster { instance: 0, center: DVec3::new(1.0, 2.0, 3.0), radius: 0.5, is_rough: false, weight: 1.0 };

    /// Map of photons that leave small balls within the caster in all directions, in units of the caster's radius.
    pub fn from_balls(caster: &CausticCaster, balls: &[(DVec3, f64)]) -> CausticMap {
        let golden = 0.618_033_988_75;
        let deposits = (0..100_000).map(|i| {
            let number = |k: i32| (0.5 + f64::from(i) * f64::powi(golden, k)).fract();
            let direction = |k: i32| {
                let z = 2.0 * number(k) - 1.0;
                let (sin, cos) = (std::f64::consts::TAU * number(k + 1)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                DVec3::new(across * cos, across * sin, z)
            };
            let (center, radius) = balls[i as usize % balls.len()];
            let left = center + direction(1) * radius;
            PhotonDeposit {
                exit_point: caster.center + caster.radius * left,
                landing_point: caster.center + caster.radius * direction(3) / number(5).max(0.01),
                power: 1.0,
            }
        });
        CausticMap::new(caster, deposits)
    }

    fn deposits(left: DVec3, at: DVec3, power: f64) -> PhotonDeposit {
        let placed = |place: DVec3| CASTER.center + CASTER.radius * place;
        PhotonDeposit { exit_point: placed(left), landing_point: placed(at), power }
    }

    #[test]
    fn targets_surround_the_exit_points() {
        let at = DVec3::new(1.5, -0.4, -2.0);
        let left = |i: usize| {
            let (sin, cos) = (f64::from(i as u32) * 0.1).sin_cos();
            DVec3::new(0.6 + 0.1 * cos, 0.1 * sin, -0.5)
        };
        // Photons of high power count more than many photons of low power.
        let weak = (0..50).map(|i| deposits(-left(i), at, 1e-9));
        let strong = (0..63).map(|i| deposits(left(i), at, 1.0));
        let map = CausticMap::new(&CASTER, weak.chain(strong));
        let [exit, _] = map.lookup(at.as_vec3());
        let direction = |point: Vec3| (point - at.as_vec3()).normalize();
        let seen = Vec3::from(exit.center);
        assert!(direction(seen).distance(direction(Vec3::new(0.6, 0.0, -0.5))) < 5e-3, "{exit:?}");
        let radius = exit.radius / seen.distance(at.as_vec3());
        assert!((0.1..0.15).contains(&radius), "{exit:?}");
    }

    #[test]
    fn bimodal_exit_points_have_two_targets() {
        let at = DVec3::new(1.5, -0.4, -2.0);
        let left = |i: usize| DVec3::new(0.0, 0.5, 0.01 * (i % 5) as f64);
        let mirrored = |i: usize| left(i) * DVec3::new(1.0, -1.0, 1.0);
        let both = (0..60).map(|i| deposits(if i % 3 == 0 { mirrored(i) } else { left(i) }, at, 1.0));
        let [first, second] = CausticMap::new(&CASTER, both).lookup(at.as_vec3());
        for (target, y) in [(first, 0.5), (second, -0.5)] {
            assert!(Vec3::from(target.center).distance(Vec3::new(0.0, y, 0.02)) < 1e-2, "{target:?}");
            assert!(target.radius < 0.1, "{target:?}");
        }
        // A caster whose photons rarely have two exit regions has no second targets.
        let elsewhere = (0..960).map(|i| deposits(left(i), -at, 1.0));
        let rare = elsewhere.chain((0..60).map(|i| deposits(if i % 2 == 0 { mirrored(i) } else { left(i) }, at, 1.0)));
        let map = CausticMap::new(&CASTER, rare);
        assert!(map.second.is_none());
        let [first, _] = map.lookup(at.as_vec3());
        assert!(first.radius > 0.0 && first.radius < 0.1, "{first:?}");
    }

    #[test]
    fn parallel_light_has_a_target_beyond_its_exit_points() {
        let direction = DVec3::new(0.36, 0.48, 0.8);
        let at = |i: usize| DVec3::new(0.1 + 0.001 * (i % 8) as f64, 0.0, -1.2 + 0.01 * (i / 8) as f64);
        let photons = (0..64).map(|i| deposits(at(i) + direction * (0.2 + 0.1 * (i % 3) as f64), at(i), 1.0));
        let [target, _] = CausticMap::new(&CASTER, photons).lookup(at(20).as_vec3());
        let seen = Vec3::from(target.center) - at(20).as_vec3();
        // The target must be farther away than the exit points, which are at distances of 0.2 to 0.4.
        assert!(seen.length() > 1.9 && seen.normalize().distance(direction.as_vec3()) < 1e-2, "{target:?}");
        assert!(target.radius < 0.045 * seen.length(), "{target:?}");
    }

    #[test]
    fn receivers_touching_the_caster_use_a_point_one_radius_away() {
        let at = DVec3::new(0.9, 0.0, -0.3);
        let above = at + 0.001 * DVec3::new(0.0, 0.6, 0.8);
        assert!(visible_exit(above, at).distance(at + DVec3::new(0.0, 0.6, 0.8)) < 1e-9);
        let far = at + DVec3::Z;
        assert_eq!(visible_exit(far, at), far);
        assert_eq!(visible_exit(at, at), at);
    }

    #[test]
    fn cells_with_few_photons_use_the_photons_of_their_block() {
        let [here, beside, behind] =
            [DVec3::new(0.05, 0.05, 3.0), DVec3::new(0.4, 0.4, 3.0), DVec3::new(0.05, 0.05, -3.0)];
        assert_ne!(cell_index(here.as_vec3()), cell_index(beside.as_vec3()));
        let left = DVec3::new(0.2, 0.3, 0.4);
        let few = |count| CausticMap::new(&CASTER, (0..count).map(|_| deposits(left, here, 1.0)));
        let radius = |count, at: DVec3| few(count).lookup(at.as_vec3())[0].radius;
        assert_eq!(radius(MIN_PHOTONS - 1, here), 0.0);
        assert!(radius(MIN_PHOTONS, here) > 0.0);
        assert!(radius(MIN_PHOTONS, beside) > 0.0);
        assert_eq!(radius(1000, behind), 0.0);
    }

    #[test]
    fn every_point_belongs_to_a_cell() {
        for x in [0.0, -0.0, 1.0, -1.0, 1e-30, 1e30, f32::INFINITY, f32::NAN] {
            for y in [0.0, 2.0, -1e-30, -1e30] {
                for z in [0.0, -3.0, 1e-38] {
                    assert!((cell_index(Vec3::new(x, y, z)) as usize) < CELL_COUNT);
                }
            }
        }
        let ways = [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (2, 1, 1), (6, 6, 6)];
        let mut cells = ways.map(|(x, y, z)| cell_index(Vec3::new(x as f32, y as f32, z as f32)));
        cells.sort_unstable();
        assert!(cells.windows(2).all(|two| two[0] < two[1]), "{cells:?}");
    }
}
