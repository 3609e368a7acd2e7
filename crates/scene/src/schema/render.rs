//! `[render]`.

use schemars::JsonSchema;
use serde::Deserialize;

/// How to render; everything may be left out, and what the command line or the call says goes first.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RenderSpec {
    /// "flat": the colour of the closest triangle, unlit. "direct": lit by the lights, with shadows.
    pub integrator: Option<IntegratorName>,
    /// Samples per pixel, >= 1.
    pub samples: Option<u32>,
    /// The pixel filter.
    pub filter: Option<FilterName>,
    /// The seed of all random numbers.
    pub seed: Option<u64>,
    /// Threads; all of the machine's where not given.
    pub threads: Option<usize>,
    /// Dims the sky in corners: true, or the distance up to which surfaces count.
    pub ambient_occlusion: Option<bool>,
    /// Stops of brightness of PNG pictures and videos: +1 doubles.
    pub exposure: Option<f64>,
}

/// The closed set of integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum IntegratorName {
    /// The colour of the closest triangle, unlit.
    Flat,
    /// Direct light with shadows.
    Direct,
}

/// The closed set of pixel filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FilterName {
    /// The mean over the pixel's square.
    Box,
    /// Blackman-Harris, smooth, with a radius of 1.5 pixels.
    BlackmanHarris,
}
