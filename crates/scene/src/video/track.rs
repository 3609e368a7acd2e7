//! Values at given times, and interpolation between them.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::math::hermite::{Interpolate, hermite};

/// Curve between keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Interpolation")]
pub enum KeyframeInterpolation {
    /// Straight lines at constant speed.
    Linear,
    /// Catmull-Rom curves that start and end at rest: no corners, no jumps in speed.
    #[default]
    Smooth,
}

/// Keyframes of a value, in order of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track<T> {
    keys: Vec<Keyframe<T>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Keyframe<T> {
    time: f64,
    value: T,
    /// Interpolation up to the next key.
    interpolation: KeyframeInterpolation,
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { keys: Vec::new() }
    }
}

impl<T: Interpolate> Track<T> {
    /// Adds a key, which must be later than all previous keys.
    pub fn push(&mut self, time: f64, value: T, interpolation: KeyframeInterpolation) {
        self.keys.push(Keyframe { time, value, interpolation });
    }

    /// True if there are no keys.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Value at a time; before the first key and after the last, the value of that key. `None` without keys.
    pub fn evaluate(&self, time: f64) -> Option<T> {
        let next = self.keys.partition_point(|key| key.time <= time);
        let Some(i) = next.checked_sub(1) else { return self.keys.first().map(|key| key.value) };
        let from = &self.keys[i];
        let Some(to) = self.keys.get(next) else { return Some(from.value) };
        let span = to.time - from.time;
        let s = (time - from.time) / span;
        Some(match from.interpolation {
            KeyframeInterpolation::Linear => from.value.offset_by(from.value.delta_to(to.value) * s),
            KeyframeInterpolation::Smooth => {
                let velocities = [i, next].map(|key| self.velocity(key) * span);
                hermite(from.value, to.value, velocities, s)
            }
        })
    }

    /// Catmull-Rom: the velocity at a key is the velocity of the parabola through the key and its neighbours. At both
    /// ends, the velocity is 0.
    fn velocity(&self, i: usize) -> DVec3 {
        if i == 0 || i + 1 == self.keys.len() {
            return DVec3::ZERO;
        }
        let [before, here, after] = [&self.keys[i - 1], &self.keys[i], &self.keys[i + 1]];
        let (arriving, leaving) = (here.time - before.time, after.time - here.time);
        let arrival = before.value.delta_to(here.value) / arriving;
        let departure = here.value.delta_to(after.value) / leaving;
        (arrival * leaving + departure * arriving) / (arriving + leaving)
    }
}

impl Track<DVec3> {
    /// Returns an upper bound of the speed along each axis between two times.
    ///
    /// The derivative of a Hermite curve is at most 1.5 times the difference of its end values plus the velocities at
    /// both ends.
    pub fn max_speed(&self, [start, end]: [f64; 2]) -> DVec3 {
        let mut most = DVec3::ZERO;
        let first = self.keys.partition_point(|key| key.time <= start).saturating_sub(1);
        for (i, pair) in self.keys.windows(2).enumerate().skip(first) {
            let [from, to] = pair else { break };
            if from.time > end {
                break;
            }
            let rise = ((to.value - from.value) / (to.time - from.time)).abs();
            most = most.max(match from.interpolation {
                KeyframeInterpolation::Linear => rise,
                KeyframeInterpolation::Smooth => 1.5 * rise + self.velocity(i).abs() + self.velocity(i + 1).abs(),
            });
        }
        most
    }
}
