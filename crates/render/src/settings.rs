//! Render settings and their validation.

use raycam_scene::SceneError;
use raycam_scene::render_options::{AmbientOcclusion, RenderOptions};
pub use raycam_scene::render_options::{Filter, Integrator};

use crate::error::RenderError;
use crate::film::channel::Channel;

/// Surface on a pixel's centre ray that the ground truth describes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TruthSurface {
    /// The first triangle hit, of any material.
    #[default]
    First,
    /// The first surface that is not transparent. The straight ray skips surfaces of opacity below one half, back faces
    /// of one-sided surfaces, and refractive surfaces.
    Solid,
}

impl TruthSurface {
    /// Returns the variant with this name: "first" or "solid".
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "first" => Some(Self::First),
            "solid" => Some(Self::Solid),
            _ => None,
        }
    }
}

/// Role of shadow catchers in a frame ([`raycam_scene::Object::shadow_catcher`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Catchers {
    /// Shadow catchers are rendered like all other surfaces.
    #[default]
    Show,
    /// Shadow catchers show the background and hide everything behind them.
    Hide,
    /// Only shadow catchers are surfaces; all other objects show the background and hide everything behind them.
    Only,
}

impl Catchers {
    /// Returns the variant with this name: "show", "hide" or "only".
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "show" => Some(Self::Show),
            "hide" => Some(Self::Hide),
            "only" => Some(Self::Only),
            _ => None,
        }
    }
}

/// Settings of one rendered frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Algorithm that computes the colour of a camera ray.
    pub integrator: Integrator,
    /// Samples per pixel, at least 1. A single sample is the exact centre ray, with any filter.
    pub samples: u32,
    /// Target standard error of a pixel's luminance: the pixel stops when the estimate is at or below this value.
    /// `samples` is then the maximum.
    pub noise_threshold: Option<f32>,
    /// Time limit in seconds. Every pixel gets the same number of samples, at most `samples`. The result depends on
    /// the machine; a notice states the number of samples that reproduces it.
    pub time_limit: Option<f64>,
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
    pub transparent_background: bool,
    /// Role of shadow catchers; any role except `Show` requires `transparent_background`.
    pub catchers: Catchers,
    /// Maximum number of path segments in `path`: 1 shows emitters, 2 adds direct lighting, and so on. `None`: no
    /// limit.
    pub max_depth: Option<u32>,
    /// Upper limit of a sample's radiance, which darkens the image. `None`: no limit.
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
            noise_threshold: None,
            time_limit: None,
            filter: Filter::Box,
            seed: 0,
            frame: 0,
            channels: vec![Channel::Color],
            surface: TruthSurface::First,
            transparent_background: false,
            catchers: Catchers::Show,
            max_depth: None,
            clamp: None,
            ambient_occlusion: None,
            region: None,
            threads: None,
        }
    }
}

impl Settings {
    /// Creates settings from validated options with their defaults; the other settings are those of
    /// [`Settings::default`].
    ///
    /// # Errors
    /// [`RenderError::Settings`]: the errors of [`RenderOptions::validate`].
    pub fn resolve(options: &RenderOptions) -> Result<Self, RenderError> {
        let options = options.complete().map_err(|error: SceneError| RenderError::settings(error))?;
        let rest = Self::default();
        Ok(Self {
            integrator: options.integrator.unwrap_or(rest.integrator),
            samples: options.samples.unwrap_or(rest.samples),
            noise_threshold: options.noise_threshold.map(|radiance| radiance as f32),
            time_limit: options.time_limit,
            max_depth: options.max_depth,
            clamp: options.clamp.map(|radiance| radiance as f32),
            filter: options.filter.unwrap_or(rest.filter),
            seed: options.seed.unwrap_or(rest.seed),
            threads: options.threads,
            ambient_occlusion: options.ambient_occlusion.and_then(AmbientOcclusion::max_distance),
            ..rest
        })
    }

    /// Validates the settings that [`RenderOptions`] does not contain. Returns the region to render of an image of this
    /// size.
    pub(crate) fn check(&self, [width, height]: [u32; 2]) -> Result<[u32; 4], RenderError> {
        let fail = |message: String| Err(RenderError::settings(message));
        if self.channels.is_empty() {
            return fail("channels is empty; expected at least one channel".into());
        }
        for (i, channel) in self.channels.iter().enumerate() {
            if self.channels[..i].contains(channel) {
                return fail(format!(
                    "channels contains {:?} twice; expected each channel at most once",
                    channel.name()
                ));
            }
        }
        if self.time_limit.is_some() && cfg!(target_family = "wasm") {
            return fail("time_limit is not supported by WebAssembly, which has no clock; use samples".into());
        }
        if self.catchers != Catchers::Show && !self.transparent_background {
            return fail("shadow catchers can only be hidden if transparent_background is true".into());
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
