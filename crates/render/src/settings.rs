//! What is asked of a picture.

use crate::channel::Channel;

/// How the colour of a ray is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// The base colour of the nearest triangle, whatever the light: the lecture's picture.
    #[default]
    Flat,
    /// Light that comes straight from the lights, with shadows.
    Direct,
}

/// How the samples of a pixel are spread and weighed: by importance, so that every sample counts the same and pixels
/// share nothing (Ernst, Stamminger and Greiner, "Filter Importance Sampling", 2006).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The mean over the pixel's square.
    #[default]
    Box,
    /// The four-term window of Blackman and Harris, three pixels wide: smoother edges, no ringing.
    BlackmanHarris,
}

/// What is asked of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How the colour of a ray is found.
    pub integrator: Integrator,
    /// Samples per pixel, at least 1. One sample goes through the exact pixel centre, whatever the filter.
    pub samples: u32,
    /// How samples are spread over the pixel.
    pub filter: Filter,
    /// Chooses the random numbers, together with `frame`.
    pub seed: u64,
    /// The frame of a video: another frame has other noise.
    pub frame: u32,
    /// What the frame holds, each channel once.
    pub channels: Vec<Channel>,
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
            filter: Filter::Box,
            seed: 0,
            frame: 0,
            channels: vec![Channel::Color],
            ambient_occlusion: None,
            region: None,
            threads: None,
        }
    }
}
