//! Keyframes and what lies between them (glTF 2.0, section 3.11 and appendix C).

use glam::DQuat;
use serde::{Deserialize, Serialize};

use crate::error::{Result, SceneError};

/// The interpolation between keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SamplerInterpolation {
    /// The one before.
    Step,
    /// A straight line; rotations turn evenly the short way.
    Linear,
    /// A cubic Hermite spline; each keyframe has a tangent in, a value and a tangent out.
    CubicSpline,
}

/// Values at times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimationSampler {
    times: Vec<f32>,
    values: Vec<f32>,
    width: usize,
    interpolation: SamplerInterpolation,
    rotation: bool,
}

impl AnimationSampler {
    /// Keyframes at `times` in seconds, each of `width` numbers, three times as many with a spline. `rotation` says
    /// that they are quaternions.
    ///
    /// # Errors
    /// [`SceneError::World`] where there are no keyframes, times are not finite, >= 0 and rising, or there is another
    /// number of values.
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
            return fail("times of keyframes: expected one or more, >= 0 and rising".into());
        }
        let parts = match interpolation {
            SamplerInterpolation::CubicSpline => 3,
            _ => 1,
        };
        if width == 0 || values.len() != parts * width * times.len() || rotation && width != 4 {
            return fail(format!(
                "{} values for {} keyframes: expected {} for each",
                values.len(),
                times.len(),
                parts * width
            ));
        }
        Ok(Self { times, values, width, interpolation, rotation })
    }

    /// The time of the last keyframe.
    pub fn end_time(&self) -> f64 {
        self.times.last().map_or(0.0, |&time| f64::from(time))
    }

    /// When its keyframes are, in seconds.
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// The numbers of all keyframes one after the other, tangents included.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The interpolation between keyframes.
    pub fn interpolation(&self) -> SamplerInterpolation {
        self.interpolation
    }

    /// How many numbers a value has.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The value at a time in seconds; that of the first or last keyframe outside of them.
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

    /// A keyframe's tangent in (0), value (1) or tangent out (2).
    fn value(&self, key: usize, part: usize) -> Vec<f64> {
        let start = match self.interpolation {
            SamplerInterpolation::CubicSpline => (3 * key + part) * self.width,
            _ => key * self.width,
        };
        let values = &self.values[start..start + self.width];
        values.iter().map(|&v| f64::from(v)).collect()
    }
}
