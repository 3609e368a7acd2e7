//! Samples of lights, for one point and for many.

use glam::{DVec3, Vec3};

use super::LightSample;
use crate::soa::{Three, get, set};

/// Where on a light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Drawn {
    pub random: [f32; 2],
    /// What they draw of one of the lights that are infinitely far away, by its number, where that is known.
    pub around: Option<(usize, Around)>,
}

impl From<[f32; 2]> for Drawn {
    fn from(random: [f32; 2]) -> Self {
        Self {
            random,
            around: None,
        }
    }
}

/// A direction to a light that is infinitely far away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// Of unit length.
    pub direction: Vec3,
    pub radiance: Vec3,
    /// By solid angle.
    pub pdf: f32,
}

impl Around {
    pub fn sample(&self) -> LightSample {
        LightSample {
            direction: self.direction,
            end: None,
            radiance: self.radiance,
            pdf: self.pdf,
            delta: false,
        }
    }
}

impl LightSample {
    /// The only direction to a light: `irradiance` on a surface that faces it.
    pub(super) fn delta(direction: DVec3, end: Option<DVec3>, irradiance: DVec3) -> Self {
        Self {
            direction: direction.as_vec3(),
            end,
            radiance: irradiance.as_vec3(),
            pdf: 1.0,
            delta: true,
        }
    }

    /// One of many, unless its density is beyond float32.
    pub(super) fn toward(
        direction: DVec3,
        end: DVec3,
        radiance: Vec3,
        density: f64,
    ) -> Option<Self> {
        let pdf = density as f32;
        (pdf > 0.0 && pdf.is_finite()).then(|| Self {
            direction: direction.as_vec3(),
            end: Some(end),
            radiance,
            pdf,
            delta: false,
        })
    }

    /// The same where its light has been chosen with a probability.
    pub(super) fn chosen(mut self, probability: f64) -> Option<Self> {
        self.pdf *= probability as f32;
        (self.pdf > 0.0 && self.pdf.is_finite()).then_some(self)
    }
}

/// Field by field what a [`LightSample`] has.
#[derive(Debug)]
pub(crate) struct LightSamples<const N: usize> {
    pub direction: Three<f32, N>,
    /// Infinite where the light is infinitely far away.
    pub end: Three<f64, N>,
    pub radiance: Three<f32, N>,
    /// 0 where there is no sample.
    pub pdf: [f32; N],
    pub delta: [bool; N],
}

impl<const N: usize> Default for LightSamples<N> {
    fn default() -> Self {
        Self {
            direction: [[0.0; N]; 3],
            end: [[0.0; N]; 3],
            radiance: [[0.0; N]; 3],
            pdf: [0.0; N],
            delta: [false; N],
        }
    }
}

impl<const N: usize> LightSamples<N> {
    /// The sample of a lane.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Option<LightSample> {
        (self.pdf[lane] > 0.0).then(|| LightSample {
            direction: get(&self.direction, lane).into(),
            end: Some(DVec3::from(get(&self.end, lane))).filter(|end| end.x < f64::INFINITY),
            radiance: get(&self.radiance, lane).into(),
            pdf: self.pdf[lane],
            delta: self.delta[lane],
        })
    }

    /// Leaves no sample.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.pdf = [0.0; N];
    }

    /// Sets a lane.
    pub fn put(&mut self, lane: usize, sample: Option<LightSample>) {
        self.pdf[lane] = sample.map_or(0.0, |sample| sample.pdf);
        if let Some(sample) = sample {
            set(&mut self.direction, lane, sample.direction.to_array());
            let end = sample.end.unwrap_or(DVec3::INFINITY);
            set(&mut self.end, lane, end.to_array());
            set(&mut self.radiance, lane, sample.radiance.to_array());
            self.delta[lane] = sample.delta;
        }
    }

    /// The same radiance for all.
    #[inline(always)]
    pub fn shine(&mut self, radiance: Vec3) {
        self.radiance = radiance.to_array().map(|value| [value; N]);
        self.delta = [false; N];
    }
}
