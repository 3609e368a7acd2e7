//! Render settings and their validation.

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::sampling::filter::Filter;

/// Algorithm that computes the colour of a camera ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Base colour of the nearest triangle, unlit (glTF `KHR_materials_unlit`).
    #[default]
    Flat,
    /// Direct lighting with shadows, also seen in mirrors and through smooth glass.
    Direct,
    /// Unbiased path tracing.
    Path,
    /// Ambient occlusion: the visible fraction of the sky.
    Ao,
}

/// Surface on a pixel's centre ray that the ground truth describes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TruthSurface {
    /// The first triangle hit, whatever its material.
    #[default]
    First,
    /// The first surface that cannot be seen through. The straight ray skips surfaces of opacity below one half, back
    /// faces of one-sided surfaces, and refractive surfaces.
    Solid,
}

/// Part that shadow catchers take in a frame ([`raycam_scene::Object::shadow_catcher`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Catchers {
    /// Surfaces like all others.
    #[default]
    Show,
    /// Background, behind which nothing is seen.
    Hide,
    /// Surfaces; all others are background, behind which nothing is seen.
    Only,
}

/// Settings of one rendered frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Algorithm that computes the colour of a camera ray.
    pub integrator: Integrator,
    /// Samples per pixel, at least 1. A single sample is the exact centre ray, whatever the filter.
    pub samples: u32,
    /// Target standard error of a pixel's luminance: the pixel stops when the estimate is at or below this value.
    /// `samples` is then the maximum.
    pub noise: Option<f32>,
    /// Time limit in seconds. Every pixel gets the same number of samples, at most `samples`. The result depends on
    /// the machine; a notice states the number of samples that reproduces it.
    pub time: Option<f64>,
    /// Pixel filter.
    pub filter: Filter,
    /// Seed of the random numbers, together with `frame`.
    pub seed: u64,
    /// Frame number of a video: each frame has independent noise.
    pub frame: u32,
    /// Channels of the frame, each once.
    pub channels: Vec<Channel>,
    /// Surface that the ground truth describes.
    pub surface: TruthSurface,
    /// Hides the environment from camera rays, so that the frame can be composited: see [`Channel::Alpha`].
    pub transparent: bool,
    /// Part that shadow catchers take, where `transparent`.
    pub catchers: Catchers,
    /// Largest number of path segments in `path`: 1 shows emitters, 2 adds direct lighting, and so on. `None`: no
    /// limit.
    pub max_depth: Option<u32>,
    /// Largest value of a sample; it darkens the image. `None`: no limit.
    pub clamp: Option<f32>,
    /// Distance in metres within which surfaces occlude the ambient light (infinity: any distance). `None`: no
    /// occlusion.
    pub ambient_occlusion: Option<f64>,
    /// x, y, width and height of the rendered part. `None`: the whole image.
    pub region: Option<[u32; 4]>,
    /// Number of threads. `None`: all that the process may use.
    pub threads: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Flat,
            samples: 1,
            noise: None,
            time: None,
            filter: Filter::Box,
            seed: 0,
            frame: 0,
            channels: vec![Channel::Color],
            surface: TruthSurface::First,
            transparent: false,
            catchers: Catchers::Show,
            max_depth: None,
            clamp: None,
            ambient_occlusion: None,
            region: None,
            threads: None,
        }
    }
}

/// Largest number of samples per pixel.
pub const MAX_SAMPLES: u32 = 1 << 24;

impl Settings {
    /// Validates the settings; returns the region to render of an image of this size.
    pub(crate) fn check(&self, [width, height]: [u32; 2]) -> Result<[u32; 4], RenderError> {
        let fail = |message: String| Err(RenderError::settings(message));
        if !(1..=MAX_SAMPLES).contains(&self.samples) {
            return fail(format!("samples is {}; expected 1 to {MAX_SAMPLES}", self.samples));
        }
        if self.channels.is_empty() {
            return fail("no channels are asked for; expected at least one".into());
        }
        for (i, channel) in self.channels.iter().enumerate() {
            if self.channels[..i].contains(channel) {
                return fail(format!("channel {:?} is asked for twice", channel.name()));
            }
        }
        if let Some(distance) = self.ambient_occlusion
            && (distance.is_nan() || distance <= 0.0)
        {
            return fail(format!("ambient_occlusion is {distance}; expected a distance above 0, or infinity"));
        }
        if let Some(noise) = self.noise
            && !(noise.is_finite() && noise > 0.0)
        {
            return fail(format!("noise_threshold is {noise}; expected a radiance above 0"));
        }
        if let Some(time) = self.time
            && !(time.is_finite() && time > 0.0)
        {
            return fail(format!("time_limit is {time}; expected seconds above 0"));
        }
        if self.time.is_some() && cfg!(target_family = "wasm") {
            return fail("time_limit needs a clock, which WebAssembly has not; expected a number of samples".into());
        }
        if self.noise.is_some() && self.time.is_some() {
            return fail("both noise_threshold and time_limit are given; expected one of them".into());
        }
        if self.max_depth == Some(0) {
            return fail("max_depth is 0; expected at least 1 segment of a path".into());
        }
        if let Some(clamp) = self.clamp
            && !(clamp.is_finite() && clamp > 0.0)
        {
            return fail(format!("clamp is {clamp}; expected a radiance above 0"));
        }
        if self.catchers != Catchers::Show && !self.transparent {
            return fail("shadow catchers are left out of pictures with a transparent background alone".into());
        }
        let whole = [0, 0, width, height];
        let region = self.region.unwrap_or(whole);
        let [x, y, w, h] = region.map(u64::from);
        if w == 0 || h == 0 || x + w > u64::from(width) || y + h > u64::from(height) {
            return fail(format!(
                "region [{x}, {y}, {w}, {h}] (x, y, width, height) is not inside the image of {width} x {height} pixels"
            ));
        }
        Ok(region)
    }
}
