//! Mixture of cosine-weighted and cone sampling for diffuse surfaces.
//!
//! A fraction of the samples is distributed uniformly in cones; the other samples have the cosine-weighted
//! density. Every direction has the density of the whole mixture (one-sample multiple importance sampling: E.
//! Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.4), so any choice of
//! cones is unbiased. Path guiding chooses the cones.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::lobes::shading_frame::{cosine_hemisphere_pdf, sincos_turns, to_world_around};
use crate::soa::{Vec3xN, get_lane, lane_vec3, set_lane};

/// Maximum number of cones per lane. Path guiding asserts that the cones of all its targets fit.
pub(crate) const MAX_CONES: usize = 108;
/// 1 - cosine of the half angle of the smallest cone that is sampled.
const MIN_CONE: f32 = 1e-6;

/// Cone of the directions to a sphere.
pub(crate) struct TargetCone {
    pub axis: Vec3,
    pub one_minus_cos: f32,
    /// Upper bound of the cone's fraction of the cosine-weighted hemisphere above a surface; 0 for a cone
    /// that is not sampled.
    pub max_fraction: f32,
}

impl TargetCone {
    #[inline(always)]
    pub fn new(direction: Vec3, radius: f32, normal: Vec3) -> Self {
        let distance2 = direction.length_squared();
        let sin2 = radius * radius / distance2;
        let one_minus_cos = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let axis = direction / distance2.sqrt();
        let up = normal.dot(axis) + sin2.sqrt();
        let is_sampled = (sin2 < 0.999) & (one_minus_cos > MIN_CONE) & (up > 0.0);
        let fraction = 2.0 * one_minus_cos * up.clamp(0.0, 1.0);
        Self {
            axis,
            one_minus_cos: if is_sampled { one_minus_cos } else { 1.0 },
            max_fraction: if is_sampled { fraction } else { 0.0 },
        }
    }
}

/// The cones of every lane, and the fractions of samples that are distributed in them.
#[derive(Clone, Debug)]
pub(crate) struct ConeMixture<const N: usize> {
    pub(crate) count: usize,
    pub(crate) axis: [Vec3xN<f32, N>; MAX_CONES],
    /// For each cone: 1 - cosine of the half angle.
    pub(crate) one_minus_cos: [[f32; N]; MAX_CONES],
    /// For each cone: the fraction of the samples in this cone.
    pub(crate) weight: [[f32; N]; MAX_CONES],
    /// Fraction of the samples with the cosine-weighted density.
    pub(crate) cosine_weight: [f32; N],
}

impl<const N: usize> Default for ConeMixture<N> {
    fn default() -> Self {
        Self {
            count: 0,
            axis: [[[0.0; N]; 3]; MAX_CONES],
            one_minus_cos: [[1.0; N]; MAX_CONES],
            weight: [[0.0; N]; MAX_CONES],
            cosine_weight: [1.0; N],
        }
    }
}

impl<const N: usize> ConeMixture<N> {
    /// Removes all cones.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// True if samples may be guided.
    pub fn has_cones(&self) -> bool {
        self.count > 0
    }

    /// Density of a direction in a lane; `cosine` is the cosine between the direction and the normal.
    #[inline(always)]
    pub fn pdf(&self, lane: usize, direction: Vec3, cosine: f32) -> f32 {
        let mut density = cosine_hemisphere_pdf(cosine);
        if self.has_cones() {
            density *= self.cosine_weight[lane];
            for k in 0..self.count {
                density += self.cone_pdf(k, lane, direction);
            }
        }
        density
    }

    /// [`ConeMixture::pdf`] of every lane.
    #[inline(always)]
    pub fn pdfs(&self, directions: &Vec3xN<f32, N>, cosines: &[f32; N]) -> [f32; N] {
        let mut densities = cosines.map(cosine_hemisphere_pdf);
        if self.has_cones() {
            for (density, rest) in densities.iter_mut().zip(&self.cosine_weight) {
                *density *= rest;
            }
            for k in 0..self.count {
                for (lane, density) in densities.iter_mut().enumerate() {
                    *density += self.cone_pdf(k, lane, get_lane(directions, lane).into());
                }
            }
        }
        densities
    }

    /// Sets cone `k` of every lane. The cone's weight is `weight` times the smaller of 1 and `density_ratio`
    /// times [`TargetCone::max_fraction`]. Returns the `max_fraction` of every lane. The arrays are local
    /// until they are full, because loops that write into `self` while reading the interactions are not
    /// vectorised.
    #[inline(always)]
    pub fn set_cones(
        &mut self,
        k: usize,
        (directions, radii): (&Vec3xN<f32, N>, &[f32; N]),
        normals: &Vec3xN<f32, N>,
        density_ratio: f32,
        weight: f32,
    ) -> [f32; N] {
        let mut axis = [[0.0; N]; 3];
        let [mut one_minus_cos, mut weights, mut max_fractions] = [[0.0; N]; 3];
        for lane in 0..N {
            let cone = TargetCone::new(lane_vec3(directions, lane), radii[lane], lane_vec3(normals, lane));
            set_lane(&mut axis, lane, cone.axis.to_array());
            one_minus_cos[lane] = cone.one_minus_cos;
            weights[lane] = weight * (density_ratio * cone.max_fraction).min(1.0);
            max_fractions[lane] = cone.max_fraction;
        }
        self.axis[k] = axis;
        self.one_minus_cos[k] = one_minus_cos;
        self.weight[k] = weights;
        max_fractions
    }

    /// Scales the weights of some cones down so that their sum does not exceed this value, and reduces the weight of
    /// the cosine distribution by the resulting sum.
    #[inline(always)]
    pub fn limit_weights(&mut self, cones: std::ops::Range<usize>, max: &[f32; N]) {
        let mut all = [0.0; N];
        for weights in &self.weight[cones.clone()] {
            for (all, weight) in all.iter_mut().zip(weights) {
                *all += weight;
            }
        }
        let mut scale = [1.0; N];
        for lane in 0..N {
            let (all, max) = (all[lane], max[lane]);
            scale[lane] = if all > max { max / all } else { 1.0 };
            self.cosine_weight[lane] -= all * scale[lane];
        }
        for weights in &mut self.weight[cones] {
            for (weight, scale) in weights.iter_mut().zip(&scale) {
                *weight *= scale;
            }
        }
    }

    /// Samples a direction for every lane. The first random number selects the cone, and is rescaled so that it is
    /// uniform again.
    #[inline(always)]
    pub fn sample(&self, normals: &Vec3xN<f32, N>, [first, second]: &[[f32; N]; 2], out: &mut Vec3xN<f32, N>) {
        let mut begin = [0.0; N];
        let mut one_minus_cos = [1.0; N];
        let mut remainder = [0.0; N];
        let mut is_guided = [false; N];
        let mut axis = *normals;
        for k in 0..self.count {
            for lane in 0..N {
                let weight = self.weight[k][lane];
                let offset = first[lane] - begin[lane];
                let is_chosen = (offset >= 0.0) & (offset < weight);
                for (axis, cone) in axis.iter_mut().zip(&self.axis[k]) {
                    axis[lane] = if is_chosen { cone[lane] } else { axis[lane] };
                }
                one_minus_cos[lane] = if is_chosen { self.one_minus_cos[k][lane] } else { one_minus_cos[lane] };
                remainder[lane] = if is_chosen { offset / weight } else { remainder[lane] };
                is_guided[lane] |= is_chosen;
                begin[lane] += weight;
            }
        }
        for lane in 0..N {
            let is_guided = is_guided[lane];
            let rest = (first[lane] - begin[lane]) / self.cosine_weight[lane];
            let x = if is_guided { remainder[lane] } else { rest };
            let x = x.clamp(0.0, 1.0);
            let cap = x * one_minus_cos[lane];
            let sin2 = if is_guided { cap * (2.0 - cap) } else { x };
            let cosine = if is_guided { 1.0 - cap } else { (1.0 - x).sqrt() };
            let (sin, cos) = sincos_turns(second[lane]);
            let radius = sin2.sqrt();
            let local = Vec3::new(radius * cos, radius * sin, cosine);
            let direction = to_world_around(get_lane(&axis, lane).into(), local);
            set_lane(out, lane, direction.to_array());
        }
    }

    #[inline(always)]
    fn cone_pdf(&self, k: usize, lane: usize, direction: Vec3) -> f32 {
        // 1 - cosine = |a - b|^2 / 2, without cancellation.
        let off = direction - Vec3::from(get_lane(&self.axis[k], lane));
        let height = self.one_minus_cos[k][lane];
        let density = self.weight[k][lane] / (TAU * height);
        if off.length_squared() <= 2.0 * height { density } else { 0.0 }
    }
}

/// Ratio of the cosine-weighted density to the mixture's density; 0 if the mixture's density is 0.
#[inline(always)]
pub(crate) fn mixture_weight(cosine: f32, density: f32) -> f32 {
    let share = cosine_hemisphere_pdf(cosine) / density;
    if density > 0.0 { share } else { 0.0 }
}
