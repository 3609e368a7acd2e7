//! Values at times, and between them.

use glam::{DQuat, DVec3};

use crate::schema::KeyframeInterpolation;

/// Keys in order of time.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Track<T> {
    keys: Vec<Keyframe<T>>,
}

#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Keyframe<T> {
    time: f64,
    value: T,
    /// Up to the next key.
    interpolation: KeyframeInterpolation,
}

/// A value that moves by steps: locations by vectors, rotations by rotation vectors in their own axes.
pub trait Interpolate: Copy {
    /// The step from here to there; of rotations, the shorter way round.
    fn delta_to(self, there: Self) -> DVec3;
    /// Where a step leads.
    fn offset_by(self, step: DVec3) -> Self;
}

impl Interpolate for DVec3 {
    fn delta_to(self, there: Self) -> DVec3 {
        there - self
    }

    fn offset_by(self, step: DVec3) -> Self {
        self + step
    }
}

impl Interpolate for DQuat {
    fn delta_to(self, there: Self) -> DVec3 {
        let turn = self.conjugate() * there;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let sine = turn.xyz().length();
        if sine == 0.0 {
            DVec3::ZERO
        } else {
            turn.xyz() * (2.0 * sine.atan2(turn.w) / sine)
        }
    }

    fn offset_by(self, step: DVec3) -> Self {
        (self * DQuat::from_scaled_axis(step)).normalize()
    }
}

impl<T> Default for Track<T> {
    fn default() -> Self {
        Self { keys: Vec::new() }
    }
}

impl<T: Interpolate> Track<T> {
    /// Adds a key, later than all before.
    pub fn push(&mut self, time: f64, value: T, interpolation: KeyframeInterpolation) {
        self.keys.push(Keyframe {
            time,
            value,
            interpolation,
        });
    }

    /// Whether there are no keys.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// The value at a time; before the first key and after the last, theirs. `None` without keys.
    pub fn evaluate(&self, time: f64) -> Option<T> {
        let next = self.keys.partition_point(|key| key.time <= time);
        let Some(i) = next.checked_sub(1) else {
            return self.keys.first().map(|key| key.value);
        };
        let from = &self.keys[i];
        let Some(to) = self.keys.get(next) else {
            return Some(from.value);
        };
        let span = to.time - from.time;
        let s = (time - from.time) / span;
        Some(match from.interpolation {
            KeyframeInterpolation::Linear => {
                from.value.offset_by(from.value.delta_to(to.value) * s)
            }
            KeyframeInterpolation::Smooth => {
                // A cubic Bézier curve in cumulative form, which is the same for vectors and for rotations (Kim, Kim and
                // Shin, "A general construction scheme for unit quaternion curves", SIGGRAPH 1995).
                let (first, last) = (
                    self.velocity(i) * span / 3.0,
                    self.velocity(next) * span / 3.0,
                );
                let middle = from
                    .value
                    .offset_by(first)
                    .delta_to(to.value.offset_by(-last));
                from.value
                    .offset_by(first * (1.0 - (1.0 - s).powi(3)))
                    .offset_by(middle * (s * s * (3.0 - 2.0 * s)))
                    .offset_by(last * s.powi(3))
            }
        })
    }

    /// Catmull-Rom: the velocity at a key is that of the parabola through it and its neighbours. At both ends it is 0.
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
