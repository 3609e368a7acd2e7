//! Interface of path guiding, and the slot that stores it in a prepared world.
//!
//! Path guiding only changes how directions and lights are sampled, never the expected image: directions come from a
//! [`ConeMixture`] with a known density, and lights are sampled at a known rate. Without guiding, images have more
//! noise if light arrives through glass, from mirrors or through gaps.

use std::fmt::Debug;
use std::sync::OnceLock;

use glam::DVec3;

use crate::interaction::batch::SurfaceInteractions;
use crate::light::lights::Lights;
use crate::lobes::cone_mixture::ConeMixture;
use crate::prepare::geometry::Geometry;
use crate::settings::Settings;
use crate::soa::{LANES, Vec3xN};

/// Minimum number of segments from a diffuse surface via another surface to a light; shorter paths are not guided.
pub(crate) const MIN_GUIDED_SEGMENTS: u32 = 2;

/// The path guiding data of one world.
pub(crate) trait PathGuiding: Debug + Send + Sync {
    /// Computes all data that depends only on the geometry, in the current thread pool.
    fn learn_geometry(&self, geometry: &Geometry);

    /// Learns all data that the samples of an image require before the first sample is traced; once per world.
    fn learn(&self, geometry: &Geometry, lights: &Lights, settings: &Settings);

    /// Index of a pixel's first sample that is guided by [`PathGuiding::learn_late`]; `None` if there is no such
    /// sample.
    fn first_late_sample(&self, settings: &Settings, size: [u32; 2]) -> Option<u32>;

    /// Learns the additional data that late samples require; once per world.
    fn learn_late(&self, geometry: &Geometry, lights: &Lights);

    /// Returns the guide of a batch of samples; `None` if there are no targets for these samples.
    fn guide<'a>(&'a self, geometry: &Geometry, lights: &Lights, is_late: bool)
    -> Option<Box<dyn DirectionGuide + 'a>>;

    /// True if [`PathGuiding::light_sampling_rate`] may be below 1.
    fn has_rare_light_sampling(&self) -> bool;

    /// Probability that lights are sampled at a scene-local position. Depends only on the world.
    fn light_sampling_rate(&self, geometry: &Geometry, lights: &Lights, position: DVec3) -> f32;
}

/// Guide of the directions of diffuse samples.
pub(crate) trait DirectionGuide: Debug {
    /// Sets the mixture of the active lanes, and samples a direction for each of these lanes.
    fn sample(&self, points: &GuidedPoints, mixture: &mut ConeMixture<LANES>, out: &mut Vec3xN<f32, LANES>);
}

/// Diffuse surface points whose samples are guided.
pub(crate) struct GuidedPoints<'a> {
    pub interactions: &'a SurfaceInteractions<LANES>,
    /// Lanes whose samples are guided.
    pub active: &'a [bool; LANES],
    pub random: &'a [[f32; LANES]; 2],
}

/// Path guiding of a prepared world, installed by the first image.
#[derive(Debug, Default)]
pub(crate) struct GuidingSlot {
    guiding: OnceLock<Option<Box<dyn PathGuiding>>>,
    /// True for the world at one time within an exposure, for which learning would take too long.
    is_within_exposure: bool,
}

impl GuidingSlot {
    pub fn within_exposure() -> Self {
        Self { is_within_exposure: true, ..Self::default() }
    }

    /// The installed path guiding; `None` before the first image and in builds without path guiding.
    pub fn get(&self) -> Option<&dyn PathGuiding> {
        self.guiding.get()?.as_deref()
    }

    /// The path guiding, created if necessary. `create` receives true for a world within an exposure.
    pub fn install(&self, create: impl FnOnce(bool) -> Option<Box<dyn PathGuiding>>) -> Option<&dyn PathGuiding> {
        self.guiding.get_or_init(|| create(self.is_within_exposure)).as_deref()
    }
}
