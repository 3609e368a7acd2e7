//! Work that a frame requires, computed from its channels and settings.

use raycam_scene::Camera;

use crate::film::channel::Channel;
use crate::prepare::geometry::Geometry;
use crate::settings::{Settings, TruthSurface};

/// Stages of a tile that a frame requires.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RenderNeeds {
    /// Exact rays through the pixel centres.
    pub center_rays: bool,
    /// True if exact rays are required for more than the coverage.
    pub truth: bool,
    /// True if filtered samples are traced in addition to the centre rays.
    pub samples: bool,
    /// Shading of camera ray hits, for channels other than ground truth.
    pub shading: bool,
    /// The channel coverage: fraction of samples that hit the same instance as the centre ray.
    pub coverage: bool,
    /// Radiance of the samples.
    pub color: bool,
    /// True if the ground truth describes surfaces behind transparent surfaces.
    pub skip_transparent: bool,
    /// Random positions on the lens and times in the exposure.
    pub lens_or_time: bool,
    /// The channel error: standard error of the colour.
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
