//! `[render]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::color::view_transform::ViewTransform;
use crate::error::{Result, SceneError};
use crate::notice::{Notice, NoticeCode};
use crate::render_options::{AmbientOcclusion, FilterName, IntegratorName, RenderOptions};

/// How to render; everything may be left out, and what the command line or the call says goes first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RenderSpec {
    /// "flat": the colour of the closest triangle, unlit. "direct": lit by the lights, with shadows. "path": all light,
    /// by any number of bounces. "ao": how much of the sky each point sees.
    pub integrator: Option<IntegratorName>,
    /// Samples per pixel, >= 1.
    pub samples: Option<u32>,
    /// Instead of samples: the standard error of a pixel's luminance at which it is done; `samples` is then the most that it
    /// gets, 16384 where not given.
    pub noise_threshold: Option<f32>,
    /// Instead of samples: seconds after which the picture is done; `samples` is then the most that a pixel gets.
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
    /// The name of `noise_threshold` until 0.2.
    #[schemars(skip)]
    #[serde(rename = "noise", skip_serializing)]
    pub old_noise: Option<f32>,
    /// The name of `time_limit` until 0.2.
    #[schemars(skip)]
    #[serde(rename = "time", skip_serializing)]
    pub old_time: Option<f64>,
}

impl RenderSpec {
    /// The options that it describes, and a notice for each old name.
    ///
    /// # Errors
    /// The errors of [`RenderOptions::validate`], and an option under both its names.
    pub fn build(self) -> Result<(RenderOptions, Vec<Notice>)> {
        let mut notices = Vec::new();
        let noise = [self.noise_threshold, self.old_noise];
        let time = [self.time_limit, self.old_time];
        let options = RenderOptions {
            integrator: self.integrator,
            samples: self.samples,
            noise_threshold: renamed("noise_threshold", "noise", noise, &mut notices)?,
            time_limit: renamed("time_limit", "time", time, &mut notices)?,
            max_depth: self.max_depth,
            clamp: self.clamp,
            filter: self.filter,
            seed: self.seed,
            threads: self.threads,
            ambient_occlusion: self.ambient_occlusion,
            exposure: self.exposure,
            view: self.view,
        };
        options.validate()?;
        Ok((options, notices))
    }
}

/// The value of an option under its name or its old one.
fn renamed<T>(
    name: &str,
    old_name: &str,
    [value, old_value]: [Option<T>; 2],
    notices: &mut Vec<Notice>,
) -> Result<Option<T>> {
    if old_value.is_none() {
        return Ok(value);
    }
    if value.is_some() {
        let message = format!("{name:?} is given too, its name today: give one of them");
        return Err(SceneError::schema(old_name, message));
    }
    notices.push(Notice::new(
        NoticeCode::Renamed,
        format!("render.{old_name} is called {name} now; the old name is understood until 0.2"),
    ));
    Ok(old_value)
}
