//! Light samples for one point, and for a batch of points.

use glam::{DVec3, Vec3};

use crate::soa::{Vec3xN, get_lane, set_lane};

/// Sampled direction towards a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLiSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Scene-local point on the light; `None` for an infinite light.
    pub p_light: Option<DVec3>,
    /// Unoccluded radiance; for a delta light, irradiance of a surface that faces it.
    pub radiance: Vec3,
    /// Density by solid angle times the probability of selecting the light; for a delta light, only the probability.
    /// Greater than 0.
    pub pdf: f32,
    /// True for a delta light, which BSDF samples cannot hit.
    pub is_delta: bool,
}

/// Infinite light by index, with its radiance from a direction and the density of sampling that direction.
pub(crate) type EnvironmentLookup = (usize, (Vec3, f32));

/// Length of a shadow ray relative to the distance of its light: slightly shorter, because the light may lie on a
/// surface.
pub(crate) const ONE_MINUS_SHADOW_EPSILON: f32 = 1.0 - 1.0 / (1 << 16) as f32;

/// Random numbers of a light sample.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightRandom {
    pub random: [f32; 2],
    /// Precomputed sample of one of the infinite lights, with its index.
    pub environment: Option<(usize, EnvironmentSample)>,
}

impl From<[f32; 2]> for LightRandom {
    fn from(random: [f32; 2]) -> Self {
        Self { random, environment: None }
    }
}

/// Sampled direction towards an infinite light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnvironmentSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    pub radiance: Vec3,
    /// Density by solid angle.
    pub pdf: f32,
}

impl EnvironmentSample {
    pub fn sample(&self) -> LightLiSample {
        LightLiSample {
            direction: self.direction,
            p_light: None,
            radiance: self.radiance,
            pdf: self.pdf,
            is_delta: false,
        }
    }
}

impl LightLiSample {
    /// Sample of a delta light: `irradiance` on a surface that faces the light.
    pub(super) fn from_delta(direction: DVec3, end: Option<DVec3>, irradiance: DVec3) -> Self {
        Self { direction: direction.as_vec3(), p_light: end, radiance: irradiance.as_vec3(), pdf: 1.0, is_delta: true }
    }

    /// Sample of a light with an extent; `None` if the density is 0 or too large for float32.
    pub(super) fn new(direction: DVec3, end: DVec3, radiance: Vec3, density: f64) -> Option<Self> {
        let pdf = density as f32;
        (pdf > 0.0 && pdf.is_finite()).then(|| Self {
            direction: direction.as_vec3(),
            p_light: Some(end),
            radiance,
            pdf,
            is_delta: false,
        })
    }

    /// Multiplies the density by the probability of selecting the light; `None` if the result is 0 or too
    /// large for float32.
    pub(super) fn with_selection_pdf(mut self, probability: f64) -> Option<Self> {
        self.pdf *= probability as f32;
        (self.pdf > 0.0 && self.pdf.is_finite()).then_some(self)
    }
}

/// [`LightLiSample`]s of a batch, structure of arrays.
#[derive(Debug)]
pub(crate) struct LightLiSamples<const N: usize> {
    pub direction: Vec3xN<f32, N>,
    /// Scene-local points on the lights; infinite for infinite lights.
    pub p_light: Vec3xN<f64, N>,
    pub radiance: Vec3xN<f32, N>,
    /// Density of each sample; 0 if the lane has no sample.
    pub pdf: [f32; N],
    pub is_delta: [bool; N],
}

impl<const N: usize> Default for LightLiSamples<N> {
    fn default() -> Self {
        Self {
            direction: [[0.0; N]; 3],
            p_light: [[0.0; N]; 3],
            radiance: [[0.0; N]; 3],
            pdf: [0.0; N],
            is_delta: [false; N],
        }
    }
}

impl<const N: usize> LightLiSamples<N> {
    /// Returns the sample of a lane, if it has one.
    #[inline(always)]
    pub fn get_lane(&self, lane: usize) -> Option<LightLiSample> {
        (self.pdf[lane] > 0.0).then(|| LightLiSample {
            direction: get_lane(&self.direction, lane).into(),
            p_light: Some(DVec3::from(get_lane(&self.p_light, lane))).filter(|end| end.x < f64::INFINITY),
            radiance: get_lane(&self.radiance, lane).into(),
            pdf: self.pdf[lane],
            is_delta: self.is_delta[lane],
        })
    }

    /// Removes all samples.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.pdf = [0.0; N];
    }

    /// Sets a lane.
    pub fn set_lane(&mut self, lane: usize, sample: Option<LightLiSample>) {
        self.pdf[lane] = sample.map_or(0.0, |sample| sample.pdf);
        if let Some(sample) = sample {
            set_lane(&mut self.direction, lane, sample.direction.to_array());
            let end = sample.p_light.unwrap_or(DVec3::INFINITY);
            set_lane(&mut self.p_light, lane, end.to_array());
            set_lane(&mut self.radiance, lane, sample.radiance.to_array());
            self.is_delta[lane] = sample.is_delta;
        }
    }

    /// Sets the same sample for all lanes.
    pub fn set_all(&mut self, sample: &LightLiSample) {
        for lane in 0..N {
            self.set_lane(lane, Some(*sample));
        }
    }

    /// Sets the same radiance for all lanes.
    #[inline(always)]
    pub fn set_radiance(&mut self, radiance: Vec3) {
        self.radiance = radiance.to_array().map(|value| [value; N]);
        self.is_delta = [false; N];
    }
}
