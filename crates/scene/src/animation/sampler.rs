//! Keyframes and interpolation between them (glTF 2.0, section 3.11 and appendix C).

use glam::DQuat;
use serde::{Deserialize, Serialize};

use crate::error::{Result, SceneError};

/// Interpolation between keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SamplerInterpolation {
    /// The value of the previous keyframe.
    Step,
    /// Linear interpolation; rotations turn at constant speed along the shorter arc.
    Linear,
    /// Cubic Hermite spline; each keyframe has an incoming tangent, a value and an outgoing tangent.
    CubicSpline,
}

/// Keyframes of a property: times and values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimationSampler {
    times: Vec<f32>,
    values: Vec<f32>,
    width: usize,
    interpolation: SamplerInterpolation,
    rotation: bool,
}

impl AnimationSampler {
    /// Creates keyframes at `times` in seconds, each with `width` numbers, or three times as many for a spline.
    /// `rotation` marks quaternions.
    ///
    /// # Errors
    /// [`SceneError::World`] if there are no keyframes, if times are not finite, non-negative and increasing, or if the
    /// number of values is wrong.
    pub fn new(
        times: Vec<f32>,
        values: Vec<f32>,
        width: usize,
        interpolation: SamplerInterpolation,
        rotation: bool,
    ) -> Result<Self> {
        let fail = |message: String| Err(SceneError::world(message));
        if !times.first().is_some_and(|&first| first >= 0.0)
            || !times.iter().all(|time| time.is_finite())
            || !times.windows(2).all(|pair| pair[0] < pair[1])
        {
            return fail("invalid keyframe times; expected one or more times >= 0 in increasing order".into());
        }
        let parts = match interpolation {
            SamplerInterpolation::CubicSpline => 3,
            _ => 1,
        };
        if width == 0 || values.len() != parts * width * times.len() || rotation && width != 4 {
            return fail(format!(
                "{} values for {} keyframes; expected {} per keyframe",
                values.len(),
                times.len(),
                parts * width
            ));
        }
        Ok(Self { times, values, width, interpolation, rotation })
    }

    /// Time of the last keyframe.
    pub fn end_time(&self) -> f64 {
        self.times.last().map_or(0.0, |&time| f64::from(time))
    }

    /// Times of the keyframes, in seconds.
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// Values of all keyframes, one keyframe after the other, including tangents.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Interpolation between keyframes.
    pub fn interpolation(&self) -> SamplerInterpolation {
        self.interpolation
    }

    /// Number of components of a value.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Value at a time in seconds; before the first and after the last keyframe, the value of that keyframe.
    pub fn evaluate(&self, time: f64) -> Vec<f64> {
        let next = self.times.partition_point(|&t| f64::from(t) <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last || self.interpolation == SamplerInterpolation::Step {
            return self.value(next.saturating_sub(1).min(last), 1);
        }
        let first = next - 1;
        let [start, end] = [first, next].map(|key| f64::from(self.times[key]));
        let (span, t) = (end - start, (time - start) / (end - start));
        let [a, b] = [first, next].map(|key| self.value(key, 1));
        if self.interpolation == SamplerInterpolation::CubicSpline {
            let (out, into) = (self.value(first, 2), self.value(next, 0));
            let (t2, t3) = (t * t, t * t * t);
            let value = (0..self.width).map(|i| {
                (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                    + span * (t3 - 2.0 * t2 + t) * out[i]
                    + (3.0 * t2 - 2.0 * t3) * b[i]
                    + span * (t3 - t2) * into[i]
            });
            return value.collect();
        }
        if self.rotation {
            let turn = |v: &[f64]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]).normalize();
            return turn(&a).slerp(turn(&b), t).to_array().to_vec();
        }
        a.iter().zip(&b).map(|(a, b)| a + (b - a) * t).collect()
    }

    /// Part of a keyframe, selected by `part`: incoming tangent (0), value (1) or outgoing tangent (2).
    fn value(&self, key: usize, part: usize) -> Vec<f64> {
        let start = match self.interpolation {
            SamplerInterpolation::CubicSpline => (3 * key + part) * self.width,
            _ => key * self.width,
        };
        let values = &self.values[start..start + self.width];
        values.iter().map(|&v| f64::from(v)).collect()
    }
}
