//! How surfaces scatter light: the closed set of [`raycam_scene::Reflectance`], evaluated at a point.
//!
//! All directions point away from the surface and are of unit length. `evaluate` and `sample` agree: a sample's weight
//! is its value divided by its density, and what one never returns the other gives no density.

mod frame;
mod lecture;
mod phong;

use glam::Vec3;

pub(crate) use frame::{Frame, cosine_direction};
pub(crate) use lecture::Lecture;
pub(crate) use phong::Lobe;

/// How one point scatters light, its textures looked up.
#[derive(Clone, Debug)]
pub(crate) enum Scatter<'a> {
    /// It does not: it absorbs, or shines by itself.
    Black,
    Lecture(Lecture<'a>),
}

/// A direction that light may come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScatterSample {
    pub direction: Vec3,
    /// Value (reflectance or transmittance times cosine) divided by density.
    pub weight: Vec3,
    /// By solid angle; of no meaning for delta samples.
    pub pdf: f32,
    /// Whether this direction is one of few: no light sampling finds it.
    pub delta: bool,
}

/// What share of an irradiance becomes radiance towards the viewer, and the density of sampling its direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Value {
    /// Reflectance or transmittance in 1/sr times the cosine.
    pub value: Vec3,
    /// By solid angle.
    pub pdf: f32,
}

impl Scatter<'_> {
    /// The value of light from a direction.
    pub fn evaluate(&self, frame: &Frame, light: Vec3) -> Value {
        // A triangle sends light back on the viewer's side, whatever the smooth surface says.
        if frame.geometric.dot(light) <= 0.0 {
            return Value::default();
        }
        match self {
            Self::Black => Value::default(),
            Self::Lecture(lecture) => lecture.evaluate(frame, light),
        }
    }

    /// A direction drawn about as often as it matters; `None` where the light is absorbed.
    pub fn sample(&self, frame: &Frame, random: [f32; 3]) -> Option<ScatterSample> {
        match self {
            Self::Black => None,
            Self::Lecture(lecture) => lecture.sample(frame, random),
        }
    }

    /// The radiance towards the viewer under a sky of radiance 1 that nothing hides.
    pub fn albedo(&self, frame: &Frame) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Lecture(lecture) => lecture.albedo(frame),
        }
    }

    /// Whether light that is sampled has a chance to be scattered to the viewer.
    pub fn is_lit(&self) -> bool {
        match self {
            Self::Black => false,
            Self::Lecture(_) => true,
        }
    }

    /// Whether light from behind the surface reaches the viewer.
    pub fn is_transmissive(&self) -> bool {
        match self {
            Self::Black | Self::Lecture(_) => false,
        }
    }
}
