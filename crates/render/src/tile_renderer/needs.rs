//! Work that a frame requires, computed from its channels and settings.

use raycam_scene::Camera;

use crate::film::channel::Channel;
use crate::prepare::geometry::Geometry;
use crate::settings::{Settings, TruthSurface};

/// Stages of a tile that a frame requires.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RenderNeeds {
    /// True if exact rays through the pixel centres are traced.
    pub center_rays: bool,
    /// True if exact rays are required for channels other than the coverage.
    pub truth: bool,
    /// True if filtered samples are traced in addition to the centre rays.
    pub samples: bool,
    /// True if the hits of camera rays are shaded, for channels other than ground truth.
    pub shading: bool,
    /// True for the channel coverage: the fraction of samples that hit the same instance as the centre ray.
    pub coverage: bool,
    /// True if the radiance of the samples is required.
    pub color: bool,
    /// True if the ground truth describes surfaces behind transparent surfaces.
    pub skip_transparent: bool,
    /// True if the samples have random positions on the lens or random times in the exposure.
    pub lens_or_time: bool,
    /// True if the standard error of the colour is required.
    pub error: bool,
}

impl RenderNeeds {
    pub fn new(settings: &Settings, camera: &Camera, geometry: &Geometry) -> Self {
        let has = |channel| settings.channels.contains(&channel);
        let has_pass = settings.channels.iter().any(|channel| channel.is_pass());
        let color = has(Channel::Color) || has(Channel::Alpha) || has(Channel::Error) || has_pass;
        let coverage = has(Channel::Coverage);
        let single = settings.samples == 1;
        let mut channels = settings.channels.iter();
        let truth = channels.any(|&channel| channel.is_ground_truth() && channel != Channel::Coverage);
        Self {
            center_rays: single || truth || coverage,
            truth,
            samples: !single && (color || coverage),
            shading: color || coverage,
            coverage,
            color,
            skip_transparent: settings.surface == TruthSurface::Solid && geometry.has_skippable(),
            lens_or_time: camera.aperture().is_some() || camera.motion().is_some(),
            error: has(Channel::Error) || settings.noise_threshold.is_some(),
        }
    }
}
