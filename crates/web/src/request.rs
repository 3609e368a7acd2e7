//! Requests for pictures, as JSON: the arguments of `raycam.render` that a page has. What is left out has the value of the
//! world's `[render]`, or the default.

use raycam_render::{Channel, Filter, Integrator, Settings, TruthSurface};
use raycam_scene::render_options::{AmbientOcclusion, FilterName, IntegratorName, RenderOptions};
use raycam_scene::{Notice, NoticeCode};
use serde::Deserialize;

use crate::failure::failure;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Request {
    integrator: Option<IntegratorName>,
    samples: Option<u32>,
    max_depth: Option<u32>,
    clamp: Option<f32>,
    filter: Option<FilterName>,
    seed: Option<u64>,
    frame: u32,
    noise_threshold: Option<f32>,
    ambient_occlusion: Option<AmbientOcclusion>,
    /// Names; all channels where empty.
    channels: Vec<String>,
    region: Option<[u32; 4]>,
    /// True for the first opaque surface.
    solid: bool,
}

const DEFAULT_SAMPLES: u32 = 16;
/// Without a number of samples, where a noise threshold ends the picture.
const MOST_SAMPLES: u32 = 1 << 14;

/// The settings of a request for a world with these options, and notices.
pub fn settings(request: &str, world: &RenderOptions) -> Result<(Settings, Vec<Notice>), String> {
    let asked: Request = serde_json::from_str(request).map_err(|error| failure(format!("render: {error}")))?;
    let mut notices = vec![];
    if let Some(seconds) = world.time_limit {
        let message = format!("time_limit = {seconds} of the world is ignored: web pages render by number of samples");
        notices.push(Notice::new(NoticeCode::UnusedOption, message));
    }
    let noise = asked.noise_threshold.or(world.noise_threshold);
    let default_samples = if noise.is_some() { MOST_SAMPLES } else { DEFAULT_SAMPLES };
    let channel = |name: &String| Channel::from_name(name).ok_or_else(|| failure(format!("no channel {name:?}")));
    let channels = match asked.channels.is_empty() {
        true => Channel::all().collect(),
        false => asked.channels.iter().map(channel).collect::<Result<_, _>>()?,
    };
    let settings = Settings {
        integrator: match asked.integrator.or(world.integrator).unwrap_or(IntegratorName::Direct) {
            IntegratorName::Flat => Integrator::Flat,
            IntegratorName::Direct => Integrator::Direct,
            IntegratorName::Path => Integrator::Path,
            IntegratorName::Ao => Integrator::Ao,
        },
        samples: asked.samples.or(world.samples).unwrap_or(default_samples),
        noise,
        filter: match asked.filter.or(world.filter).unwrap_or(FilterName::Box) {
            FilterName::Box => Filter::Box,
            FilterName::BlackmanHarris => Filter::BlackmanHarris,
        },
        seed: asked.seed.or(world.seed).unwrap_or(0),
        frame: asked.frame,
        channels,
        surface: if asked.solid { TruthSurface::Solid } else { TruthSurface::First },
        max_depth: asked.max_depth.or(world.max_depth),
        clamp: asked.clamp.or(world.clamp),
        ambient_occlusion: match asked.ambient_occlusion.or(world.ambient_occlusion) {
            None | Some(AmbientOcclusion::Switch(false)) => None,
            Some(AmbientOcclusion::Switch(true)) => Some(f64::INFINITY),
            Some(AmbientOcclusion::Distance(distance)) => Some(distance),
        },
        region: asked.region,
        ..Settings::default()
    };
    Ok((settings, notices))
}
