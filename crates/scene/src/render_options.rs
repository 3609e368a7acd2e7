//! Options of a render, as a world carries them.

use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Serialize};

use crate::color::view_transform::ViewTransform;
use crate::error::{Result, SceneError};
use crate::written::written;

/// How to render; everything may be left out, and what the command line or the call says goes first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RenderOptions {
    /// "flat": the colour of the closest triangle, unlit. "direct": lit by the lights, with shadows. "path": all light,
    /// by any number of bounces. "ao": how much of the sky each point sees.
    pub integrator: Option<IntegratorName>,
    /// Samples per pixel, >= 1.
    pub samples: Option<u32>,
    /// Instead of samples: the standard error of a pixel's luminance at which it is done; `samples` is then the most
    /// that it gets, 16384 where not given.
    // World bundles keep the name of 0.1.
    #[serde(rename = "noise")]
    pub noise_threshold: Option<f32>,
    /// Instead of samples: seconds after which the picture is done; `samples` is then the most that a pixel gets.
    #[serde(rename = "time")]
    pub time_limit: Option<f64>,
    /// The most segments of a path, >= 1: 1 sees what shines, 2 what it lights, and so on; no limit where not given.
    pub max_depth: Option<u32>,
    /// The largest value of a sample, which hides bright specks and makes the picture darker; none where not given.
    pub clamp: Option<f32>,
    /// The pixel filter.
    pub filter: Option<FilterName>,
    /// The seed of all random numbers.
    pub seed: Option<u64>,
    /// Threads; all of the machine's where not given.
    pub threads: Option<usize>,
    /// Dims the sky in corners and under objects: true, or the distance in metres up to which surfaces count.
    pub ambient_occlusion: Option<AmbientOcclusion>,
    /// Stops of brightness of PNG pictures and videos: +1 doubles.
    pub exposure: Option<f64>,
    /// How PNG pictures and videos show what is brighter than 1: "standard" cuts it off, "agx" and "pbr_neutral"
    /// compress it.
    pub view: Option<ViewTransform>,
}

/// `true`, `false` or a distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(untagged)]
pub enum AmbientOcclusion {
    /// Surfaces at any distance count, or ambient occlusion is off.
    Switch(bool),
    /// Surfaces up to this distance in metres count.
    Distance(f64),
}

written! {
    AmbientOcclusion: "true, false or a distance in metres",

    fn visit_bool<E: Error>(self, v: bool) -> Result<AmbientOcclusion, E> {
        Ok(AmbientOcclusion::Switch(v))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<AmbientOcclusion, E> {
        self.visit_f64(v as f64)
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<AmbientOcclusion, E> {
        if v > 0.0 {
            Ok(AmbientOcclusion::Distance(v))
        } else {
            Err(E::custom(format_args!("{v}: expected a distance greater than 0")))
        }
    }
}

/// The closed set of integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum IntegratorName {
    /// The colour of the closest triangle, unlit.
    Flat,
    /// Direct light with shadows.
    Direct,
    /// All light, by any number of bounces.
    Path,
    /// Ambient occlusion by itself.
    Ao,
}

impl IntegratorName {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Direct => "direct",
            Self::Path => "path",
            Self::Ao => "ao",
        }
    }
}

/// The closed set of pixel filters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FilterName {
    /// The mean over the pixel's square.
    Box,
    /// Blackman-Harris, smooth, with a radius of 1.5 pixels.
    BlackmanHarris,
}

impl RenderOptions {
    /// Checks its values.
    ///
    /// # Errors
    /// [`SceneError::Schema`]: no samples, no threads, or an exposure that is not finite.
    pub fn validate(&self) -> Result<()> {
        if self.samples == Some(0) {
            return Err(SceneError::schema("samples", "0: expected a whole number >= 1"));
        }
        if self.threads == Some(0) {
            return Err(SceneError::schema("threads", "0: expected a whole number >= 1"));
        }
        if self.max_depth == Some(0) {
            return Err(SceneError::schema("max_depth", "0: expected a whole number of segments >= 1"));
        }
        for (key, value) in [("noise_threshold", self.noise_threshold.map(f64::from)), ("time_limit", self.time_limit)]
        {
            if let Some(value) = value
                && !(value.is_finite() && value > 0.0)
            {
                return Err(SceneError::schema(key, format!("{value}: expected a number greater than 0")));
            }
        }
        if let Some(clamp) = self.clamp
            && !(clamp.is_finite() && clamp > 0.0)
        {
            return Err(SceneError::schema("clamp", format!("{clamp}: expected a number greater than 0")));
        }
        match self.exposure {
            Some(exposure) if !exposure.is_finite() => {
                Err(SceneError::schema("exposure", format!("{exposure}: expected a finite number of stops")))
            }
            _ => Ok(()),
        }
    }
}
