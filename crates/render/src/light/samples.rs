//! Samples of lights, for one point and for many.

use glam::{DVec3, Vec3};

use crate::soa::{Vec3xN, get_lane, set_lane};

/// A direction to a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLiSample {
    /// Of unit length.
    pub direction: Vec3,
    /// The scene-local point it comes from; `None` for infinitely far away.
    pub p_light: Option<DVec3>,
    /// What arrives if nothing stands in between: radiance; for a delta light irradiance on a surface that faces it.
    pub radiance: Vec3,
    /// The density of the direction by solid angle, times the probability that this light was chosen; for a delta light
    /// that probability alone. Greater than 0.
    pub pdf: f32,
    /// Whether its direction is the only one: nothing else finds this light.
    pub is_delta: bool,
}

/// Of one of those infinitely far away, by its number: its radiance out of a direction, and the density of sampling that.
pub(crate) type EnvironmentLookup = (usize, (Vec3, f32));

/// A shadow ray ends this share before its light, which may lie on a surface.
pub(crate) const ONE_MINUS_SHADOW_EPSILON: f32 = 1.0 - 1.0 / (1 << 16) as f32;

/// Where on a light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightRandom {
    pub random: [f32; 2],
    /// What they draw of one of the lights that are infinitely far away, by its number, where that is known.
    pub environment: Option<(usize, EnvironmentSample)>,
}

impl From<[f32; 2]> for LightRandom {
    fn from(random: [f32; 2]) -> Self {
        Self {
            random,
            environment: None,
        }
    }
}

/// A direction to a light that is infinitely far away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnvironmentSample {
    /// Of unit length.
    pub direction: Vec3,
    pub radiance: Vec3,
    /// By solid angle.
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
    /// The only direction to a light: `irradiance` on a surface that faces it.
    pub(super) fn from_delta(direction: DVec3, end: Option<DVec3>, irradiance: DVec3) -> Self {
        Self {
            direction: direction.as_vec3(),
            p_light: end,
            radiance: irradiance.as_vec3(),
            pdf: 1.0,
            is_delta: true,
        }
    }

    /// One of many, unless its density is beyond float32.
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

    /// The same where its light has been chosen with a probability.
    pub(super) fn with_selection_pdf(mut self, probability: f64) -> Option<Self> {
        self.pdf *= probability as f32;
        (self.pdf > 0.0 && self.pdf.is_finite()).then_some(self)
    }
}

/// Field by field what a [`LightLiSample`] has.
#[derive(Debug)]
pub(crate) struct LightLiSamples<const N: usize> {
    pub direction: Vec3xN<f32, N>,
    /// Infinite where the light is infinitely far away.
    pub p_light: Vec3xN<f64, N>,
    pub radiance: Vec3xN<f32, N>,
    /// 0 where there is no sample.
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
    /// The sample of a lane.
    #[inline(always)]
    pub fn get_lane(&self, lane: usize) -> Option<LightLiSample> {
        (self.pdf[lane] > 0.0).then(|| LightLiSample {
            direction: get_lane(&self.direction, lane).into(),
            p_light: Some(DVec3::from(get_lane(&self.p_light, lane)))
                .filter(|end| end.x < f64::INFINITY),
            radiance: get_lane(&self.radiance, lane).into(),
            pdf: self.pdf[lane],
            is_delta: self.is_delta[lane],
        })
    }

    /// Leaves no sample.
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

    /// The same radiance for all.
    #[inline(always)]
    pub fn set_radiance(&mut self, radiance: Vec3) {
        self.radiance = radiance.to_array().map(|value| [value; N]);
        self.is_delta = [false; N];
    }
}
