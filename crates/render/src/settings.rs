//! What is asked of a picture.

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::sampling::filter::Filter;

/// How the colour of a ray is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// The base colour of the nearest triangle, whatever the light: the lecture's picture.
    #[default]
    Flat,
    /// Light that comes straight from the lights, with shadows, also in mirrors and through smooth glass.
    Direct,
    /// All light, by any number of bounces: unbiased.
    Path,
    /// How much of the sky each point sees.
    Ao,
}

/// Which surface on a pixel's centre ray the ground truth tells of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TruthSurface {
    /// The first triangle, whatever it is made of.
    #[default]
    First,
    /// The first that one does not see through: less than half opaque surfaces, backs of one-sided ones and what
    /// refracts are passed, along the straight ray.
    Solid,
}

/// What is asked of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How the colour of a ray is found.
    pub integrator: Integrator,
    /// Samples per pixel, at least 1. One sample goes through the exact pixel centre, whatever the filter.
    pub samples: u32,
    /// Stops each pixel when the estimated standard error of its luminance is no more than this; `samples` is then the most
    /// that a pixel gets.
    pub noise: Option<f32>,
    /// Stops the picture after about as many seconds, all pixels at the same number of samples, `samples` at most. What
    /// comes out depends on the machine; the notices say how many samples give the same.
    pub time: Option<f64>,
    /// How samples are spread over the pixel.
    pub filter: Filter,
    /// Chooses the random numbers, together with `frame`.
    pub seed: u64,
    /// The frame of a video: another frame has other noise.
    pub frame: u32,
    /// What the frame holds, each channel once.
    pub channels: Vec<Channel>,
    /// What the ground truth tells of.
    pub surface: TruthSurface,
    /// Leaves the sky out where the camera sees it, for pictures to be laid over others: see [`Channel::Alpha`].
    pub transparent: bool,
    /// The most segments of a path in `path`: 1 sees what shines, 2 what it lights, and so on; `None` for no limit.
    pub max_depth: Option<u32>,
    /// The largest value of a sample, which makes pictures darker than they are; `None` for none.
    pub clamp: Option<f32>,
    /// How far, in metres, surfaces darken the sky of others (infinity: any distance); `None` for an unoccluded sky.
    pub ambient_occlusion: Option<f64>,
    /// x, y, width and height of the part to render; `None` for all of it.
    pub region: Option<[u32; 4]>,
    /// How many threads work; `None` for all there are.
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
            max_depth: None,
            clamp: None,
            ambient_occlusion: None,
            region: None,
            threads: None,
        }
    }
}

/// The most samples per pixel.
pub const MAX_SAMPLES: u32 = 1 << 24;

impl Settings {
    /// The region to render of an image of this size, if a picture can be made from these settings.
    pub(crate) fn check(&self, [width, height]: [u32; 2]) -> Result<[u32; 4], RenderError> {
        let fail = |message: String| Err(RenderError::Settings(message));
        if !(1..=MAX_SAMPLES).contains(&self.samples) {
            return fail(format!(
                "samples is {}; expected 1 to {MAX_SAMPLES}",
                self.samples
            ));
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
            return fail(format!(
                "ambient_occlusion is {distance}; expected a distance above 0, or infinity"
            ));
        }
        if let Some(noise) = self.noise
            && !(noise.is_finite() && noise > 0.0)
        {
            return fail(format!("noise is {noise}; expected a radiance above 0"));
        }
        if let Some(time) = self.time
            && !(time.is_finite() && time > 0.0)
        {
            return fail(format!("time is {time}; expected seconds above 0"));
        }
        if self.noise.is_some() && self.time.is_some() {
            return fail("both noise and time are given; expected one of them".into());
        }
        if self.max_depth == Some(0) {
            return fail("max_depth is 0; expected at least 1 segment of a path".into());
        }
        if let Some(clamp) = self.clamp
            && !(clamp.is_finite() && clamp > 0.0)
        {
            return fail(format!("clamp is {clamp}; expected a radiance above 0"));
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
