//! Gaps through which much light passes: balls to which samples of diffuse surfaces are guided, in the same way as to
//! caustic casters.
//!
//! Photon segments between diffuse surfaces show from which directions light arrives. [`find_gaps`] chooses
//! the balls that reduce the relative variance of a guided bounce most, averaged over the surfaces, and keeps
//! the balls that the second half of the photons confirms.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::sample_cones::{MAX_DENSITY_RATIO, MAX_GUIDED_WEIGHT};
use crate::lobes::cone_mixture::TargetCone;

// Lab note for all constants of this file that do not name another: "Photons find gaps", 11-27.

/// Maximum number of gaps; each takes time at every diffuse hit.
pub(crate) const MAX_GAPS: usize = 8;
/// Minimum fraction of the variance that the first ball removes: in the half of the photons to which it was fitted, and
/// in the other half.
const MIN_FIRST_GAIN: [f64; 2] = [0.03, 0.02];
/// Minimum fraction of the variance that each further ball removes: in the half of the photons to which it was fitted,
/// and in the other half.
const MIN_FURTHER_GAIN: [f64; 2] = [0.012, 0.01];
/// Minimum fraction of the variance that all balls together remove in the half of the photons that confirms balls. Lab
/// note: "without the minimum of 10 %", 11-27.
const MIN_WHOLE_GAIN: f64 = 0.1;
/// Factor on a ball's radius, because few photons do not cover the whole gap.
const MARGIN: f64 = 1.15;
/// Maximum number of balls that the other half of the photons rejects before the search ends. Not tuned.
const MAX_REFUSED: usize = 8;
/// Number of cells along the longest side of the world in which light is counted, a power of two. Not tuned.
const CELLS: usize = 16;
/// Minimum number of photons in a cell. Not tuned.
const MIN_PHOTONS: f64 = 16.0;
/// Number of cells along the longest side of the world; balls start in these cells.
const BALL_CELLS: usize = 24;
/// Number of cells in which the search for balls starts; the cells that the most light crosses are used.
const MAX_BALL_CELLS: usize = 40;
/// Number of photon segments with which balls are evaluated.
const JUDGES: u32 = 4096;
/// Maximum number of times that one segment counts among the [`JUDGES`] segments, because a few photons are not
/// sufficient evidence. Lab note: "none of which has a weight above 1 %", 11-27.
const MAX_SAME_JUDGES: u32 = JUDGES / 100;
/// Minimum number of photon segments in each half; with fewer, no gap is searched for.
const MIN_SEGMENTS: usize = 10_000;
/// Minimum fraction of a half's segments that connect two diffuse surfaces. Under an open sky the fraction is smaller,
/// and no gap is searched for.
const MIN_DIFFUSE_PART: f64 = 0.1;

/// Path of a photon between two surfaces, scene-local.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhotonSegment {
    pub start: Vec3,
    pub end: Vec3,
    /// Normal of the surface at the end, on the side of the start.
    pub normal: Vec3,
    /// True for a segment between two diffuse surfaces, where guiding helps.
    pub is_diffuse: bool,
}

/// A photon's segment, described from the segment's end.
struct Arrival {
    end: DVec3,
    normal: Vec3,
    /// Unit direction from the segment's end towards its start.
    direction: Vec3,
    length: f64,
    cosine: f32,
    weight: f64,
}

#[derive(Clone, Copy)]
struct Ball {
    center: DVec3,
    radius: f64,
}

/// Finds balls with one half of the photons and confirms the balls with the other half.
pub(crate) fn find_gaps(halves: [&[PhotonSegment]; 2], [lower, upper]: [DVec3; 2]) -> Vec<CausticCaster> {
    let size = (upper - lower).max_element();
    let is_enough = |half: &&[PhotonSegment]| {
        let diffuse = half.iter().filter(|segment| segment.is_diffuse).count();
        half.len() >= MIN_SEGMENTS && diffuse as f64 >= MIN_DIFFUSE_PART * half.len() as f64
    };
    if !halves.iter().all(is_enough) {
        return vec![];
    }
    let [found, confirming] = halves.map(|half| arrivals(half, lower, size));
    let mut pool = first_balls(&found, lower, size / BALL_CELLS as f64);
    let (mut own, mut others) = (Mixture::new(&found), Mixture::new(&confirming));
    let (mut gaps, mut refused) = (vec![], 0);
    while gaps.len() < MAX_GAPS && refused < MAX_REFUSED {
        let [least, confirmed] = if gaps.is_empty() { MIN_FIRST_GAIN } else { MIN_FURTHER_GAIN };
        let gains: Vec<_> = pool.par_iter().map(|ball| (own.gain(ball), *ball)).collect();
        let best = gains.iter().copied().reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((_, best)) = best.filter(|&(gain, _)| gain >= least) else {
            break;
        };
        // A ball that removes little variance in this step removes even less after more balls are added.
        pool = gains.into_iter().filter(|&(gain, _)| gain > 0.5 * MIN_FURTHER_GAIN[0]).map(|(_, ball)| ball).collect();
        if others.gain(&best) >= confirmed {
            own.add(&best);
            others.add(&best);
            let (center, radius) = (best.center, MARGIN * best.radius);
            gaps.push(CausticCaster { instance: u32::MAX, center, radius, is_rough: false, weight: 1.0 });
        } else {
            refused += 1;
            pool.retain(|ball| ball.center.distance(best.center) > 0.5 * best.radius);
        }
    }
    if others.variance > 1.0 - MIN_WHOLE_GAIN { vec![] } else { gaps }
}

/// Index of the cell of a point in a grid with this many cells per side.
fn cell_index(at: DVec3, cell: f64, count: usize) -> usize {
    let [x, y, z] = (at / cell).to_array().map(|i| (i.max(0.0) as usize).min(count - 1));
    (x * count + y) * count + z
}

/// Fluence of the photons that end in each slot; 0 if no photon ends there. A slot is a cell together with one of six
/// main directions of the normal.
fn fluences(ends: &[usize]) -> Vec<f64> {
    let mut counts = vec![0.0; 6 * CELLS.pow(3)];
    ends.iter().for_each(|&slot| counts[slot] += 1.0);
    let mut fluence = vec![0.0; counts.len()];
    let mut open: Vec<_> = (0..counts.len()).filter(|&slot| counts[slot] > 0.0).collect();
    // Cells with too few photons are merged until they have enough.
    for level in 0..=CELLS.ilog2() {
        let group = |slot: usize| {
            let [x, y, z] = [CELLS.pow(2), CELLS, 1].map(|step| (slot / 6 / step % CELLS) >> level);
            6 * ((x * CELLS + y) * CELLS + z) + slot % 6
        };
        let mut sums = vec![[0.0; 2]; counts.len()];
        for &slot in &open {
            let [count, slots] = &mut sums[group(slot)];
            (*count, *slots) = (*count + counts[slot], *slots + 1.0);
        }
        open.retain(|&slot| {
            let [count, slots] = sums[group(slot)];
            fluence[slot] = count / slots;
            count < MIN_PHOTONS
        });
    }
    fluence
}

/// Segments with which balls are evaluated, sampled in proportion to the variance that each segment adds without
/// guiding.
fn arrivals(segments: &[PhotonSegment], lower: DVec3, size: f64) -> Vec<Arrival> {
    let cell = |at: Vec3| cell_index(at.as_dvec3() - lower, size / CELLS as f64, CELLS);
    let slot = |segment: &PhotonSegment| {
        let axis = segment.normal.abs().max_position();
        6 * cell(segment.end) + 2 * axis + usize::from(segment.normal[axis] > 0.0)
    };
    let ends: Vec<_> = segments.iter().map(slot).collect();
    let fluence = fluences(&ends);
    let mut seen = vec![[0.0; 2]; CELLS.pow(3)];
    for &slot in &ends {
        let [sum, count] = &mut seen[slot / 6];
        (*sum, *count) = (*sum + fluence[slot], *count + 1.0);
    }
    let weight = |(segment, &end): (&PhotonSegment, &usize)| {
        let [sum, count] = seen[cell(segment.start)];
        if segment.is_diffuse && count > 0.0 { sum / count / fluence[end].powi(2) } else { 0.0 }
    };
    let weights: Vec<f64> = segments.iter().zip(&ends).map(weight).collect();
    let mut all = vec![];
    for (segment, times) in segments.iter().zip(systematic_counts(&weights, JUDGES)).filter(|&(_, times)| times > 0) {
        let offset = (segment.start - segment.end).as_dvec3();
        let direction = offset.normalize_or_zero().as_vec3();
        let cosine = direction.dot(segment.normal).max(1e-3);
        let (end, normal) = (segment.end.as_dvec3(), segment.normal);
        let weight = f64::from(times.min(MAX_SAME_JUDGES));
        all.push(Arrival { end, normal, direction, length: offset.length(), cosine, weight });
    }
    let total: f64 = all.iter().map(|arrival| arrival.weight).sum();
    all.iter_mut().for_each(|arrival| arrival.weight /= total);
    all
}

/// For each weight: the number of draws that systematic sampling assigns to it. The draws are evenly spaced in the sum
/// of all weights.
pub(crate) fn systematic_counts(weights: &[f64], draws: u32) -> Vec<u32> {
    let step = weights.iter().sum::<f64>() / f64::from(draws);
    let (mut passed, mut next) = (0.0, 0.5 * step);
    let count = |weight: &f64| {
        passed += weight;
        let mut count = 0;
        while next < passed {
            (count, next) = (count + 1, next + step);
        }
        count
    };
    weights.iter().map(count).collect()
}

/// Mixture of the cosine distribution and the balls chosen so far, evaluated for every segment.
struct Mixture<'a> {
    arrivals: &'a [Arrival],
    /// For each segment: the sum of the balls' weights before it is limited, and the sum of their densities divided by
    /// the density of the cosine distribution.
    terms: Vec<[f32; 2]>,
    /// Variance that remains with these balls, relative to the variance without any ball.
    variance: f64,
}

impl<'a> Mixture<'a> {
    fn new(arrivals: &'a [Arrival]) -> Self {
        let variance = arrivals.iter().map(|arrival| arrival.weight).sum();
        Self { arrivals, terms: vec![[0.0; 2]; arrivals.len()], variance }
    }

    /// Fraction of the initial variance that a further ball removes.
    fn gain(&self, ball: &Ball) -> f64 {
        let each = self.arrivals.iter().zip(&self.terms).map(|(arrival, [weight, density])| {
            let [more, denser] = arrival.terms(ball);
            let (weight, density) = (weight + more, density + denser);
            let scale = (MAX_GUIDED_WEIGHT / weight).min(1.0);
            arrival.weight / f64::from(1.0 - weight * scale + density * scale)
        });
        self.variance - each.sum::<f64>()
    }

    fn add(&mut self, ball: &Ball) {
        self.variance -= self.gain(ball);
        for (arrival, [weight, density]) in self.arrivals.iter().zip(&mut self.terms) {
            let [more, denser] = arrival.terms(ball);
            (*weight, *density) = (*weight + more, *density + denser);
        }
    }
}

impl Arrival {
    /// The ball's weight at the end of the segment, and its density towards the start, divided by the density of the
    /// cosine distribution.
    fn terms(&self, ball: &Ball) -> [f32; 2] {
        let cone = TargetCone::new((ball.center - self.end).as_vec3(), ball.radius as f32, self.normal);
        let weight = (MAX_DENSITY_RATIO * cone.max_fraction).min(1.0);
        let is_inside = (self.direction - cone.axis).length_squared() <= 2.0 * cone.one_minus_cos;
        [weight, if is_inside { weight / (2.0 * cone.one_minus_cos * self.cosine) } else { 0.0 }]
    }
}

/// Balls with which the search starts, at the cells that the most light crosses; some are centred where the segments
/// through these cells meet.
fn first_balls(arrivals: &[Arrival], lower: DVec3, cell: f64) -> Vec<Ball> {
    const PARTS: i32 = 4;
    let mut crossed = vec![0.0; BALL_CELLS.pow(3)];
    for arrival in arrivals {
        for part in 0..PARTS {
            let along = arrival.length * (f64::from(part) + 0.5) / f64::from(PARTS);
            let at = arrival.end + arrival.direction.as_dvec3() * along - lower;
            crossed[cell_index(at, cell, BALL_CELLS)] += arrival.weight * arrival.length;
        }
    }
    let mut order: Vec<_> = (0..crossed.len()).collect();
    order.sort_by(|&a, &b| crossed[b].total_cmp(&crossed[a]));
    let balls = order[..MAX_BALL_CELLS].par_iter().flat_map_iter(|&index| {
        let [x, y, z] = [index / BALL_CELLS.pow(2), index / BALL_CELLS % BALL_CELLS, index % BALL_CELLS];
        let middle = lower + (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * cell;
        let mut balls = vec![Ball { center: middle, radius: cell }, Ball { center: middle, radius: 0.6 * cell }];
        for radius in [0.5 * cell, cell] {
            if let Some((center, radii)) = meeting_point(arrivals, middle, radius) {
                let radii = radii.into_iter().map(|r| (1.05 * r).clamp(0.1 * cell, 1.5 * cell));
                balls.extend(radii.chain([0.5 * cell, cell]).map(|radius| Ball { center, radius }));
            }
        }
        balls
    });
    balls.collect()
}

/// Point closest to the segments through a ball, with the radii that contain half, most and almost all of these
/// segments.
fn meeting_point(arrivals: &[Arrival], mut center: DVec3, radius: f64) -> Option<(DVec3, [f64; 3])> {
    let mut distances = vec![];
    for _ in 0..3 {
        distances.clear();
        let (mut across, mut sum, mut total) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for arrival in arrivals {
            let direction = arrival.direction.as_dvec3();
            let along = (center - arrival.end).dot(direction);
            let distance = (center - arrival.end - along * direction).length();
            if distance < radius && along > 0.0 && along < arrival.length {
                let outer = DMat3::from_cols(direction * direction.x, direction * direction.y, direction * direction.z);
                let plane = (DMat3::IDENTITY - outer) * arrival.weight;
                (across, sum, total) = (across + plane, sum + plane * arrival.end, total + arrival.weight);
                distances.push(distance);
            }
        }
        if distances.len() < 8 {
            return None;
        }
        // A small weight of the ball's centre keeps the solution stable if the segments are nearly parallel.
        let hold = 0.01 * total;
        let moved = (across + DMat3::IDENTITY * hold).inverse() * (sum + hold * center) - center;
        center += moved.clamp_length_max(radius);
    }
    distances.sort_by(f64::total_cmp);
    Some((center, [0.5, 0.7, 0.9].map(|part| distances[(part * distances.len() as f64) as usize])))
}
