//! Requests for images, as JSON: the arguments of `raycam.render` that a page supports. Options that are not given have
//! the value of the world's `[render]`, or the default.

use raycam_render::{Channel, Settings, TruthSurface};
use raycam_scene::render_options::{RENDER_OPTIONS, RenderOptions};
use raycam_scene::{Notice, NoticeCode};
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::failure::failure;

/// Arguments of one call in addition to the options of [`RenderOptions`].
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct CallArguments {
    frame: u32,
    /// Channel names; empty for all channels.
    channels: Vec<String>,
    region: Option<[u32; 4]>,
    /// "first" (default) or "solid".
    surface: Option<String>,
}

/// Returns the render settings of a request, and notices; `world` contains the options of the world's `[render]`.
pub fn settings(request: &str, world: &RenderOptions) -> Result<(Settings, Vec<Notice>), String> {
    let invalid = |error: serde_json::Error| failure(format!("render: {error}"));
    let arguments: Map<String, Value> = serde_json::from_str(request).map_err(invalid)?;
    let is_option = |name: &String| RENDER_OPTIONS.iter().any(|option| option.name == name);
    let (options, call): (Map<_, _>, Map<_, _>) = arguments.into_iter().partition(|(name, _)| is_option(name));
    let options: RenderOptions = serde_json::from_value(options.into()).map_err(invalid)?;
    let call: CallArguments = serde_json::from_value(call.into()).map_err(invalid)?;
    let mut notices = vec![];
    let mut world = world.clone();
    if let Some(seconds) = world.time_limit.take() {
        let message = format!(
            "the world's time_limit of {seconds} s is ignored, because pages render a fixed number \
            of samples"
        );
        notices.push(Notice::new(NoticeCode::UnusedOption, message));
    }
    let channel = |name: &String| Channel::from_name(name).ok_or_else(|| failure(format!("unknown channel {name:?}")));
    let channels = match call.channels.is_empty() {
        true => Channel::all().filter(|channel| !channel.is_pass()).collect(),
        false => call.channels.iter().map(channel).collect::<Result<_, _>>()?,
    };
    let surface = call.surface.as_deref().unwrap_or("first");
    let settings = Settings {
        frame: call.frame,
        channels,
        surface: TruthSurface::from_name(surface).ok_or_else(|| failure(format!("unknown surface {surface:?}")))?,
        region: call.region,
        threads: None,
        ..Settings::resolve(&options.or(&world)).map_err(failure)?
    };
    Ok((settings, notices))
}
