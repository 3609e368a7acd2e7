//! Integrators: from camera rays and their hits to radiance.
//!
//! `flat` ([`unlit`]) and `ao` shade the first hit. `path` and `direct` share [`path`], a wavefront path tracer after
//! pbrt-v4 (M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th edition, chapter 15): all paths of a
//! tile advance one bounce at a time, so that rays are traced and BSDFs evaluated in batches.
//!
//! * [`path_state`]: the state of a path, and the queues of rays that a bounce fills.
//! * [`path_tracer`]: the state that all paths share, and the steps that do not depend on a BSDF: escaped
//!   rays, emission, the continuation of a path. Light is found by light sampling and by BSDF sampling,
//!   weighted by the balance heuristic of multiple importance sampling (E. Veach, "Robust Monte Carlo Methods
//!   for Light Transport Simulation", 1997, section 9.2.2). After some segments, Russian roulette ends paths
//!   at random if their throughput times `eta_scale` is below a threshold.
//! * [`direct_lighting`]: next-event estimation, one shadow ray for each light sample.
//! * [`shadow_queue`]: shadow rays with the light that each adds if nothing occludes the ray.
//! * [`batch`]: hits in chunks. Interactions, BSDF samples, direct lighting and shading are computed for many hits at
//!   once.
//! * [`closed_form_fog`]: the fog of `flat` and `direct`.
//! * [`volume`]: paths that a medium scatters.
//! * [`hidden_objects`]: objects that some rays do not find.
//! * [`passes`]: the parts of the radiance, divided by the light's way to the camera and by its source.
//! * [`record_passes`]: records the light of paths in the passes.
//! * [`requirements`]: the lights and rays that each integrator requires.
//! * [`shade`]: one hit of any material.
//! * [`bright_path`]: traces the paths of a batch again to find the surfaces and the light of the brightest path, for
//!   notices.
//!
//! Dependencies: `camera_ray_batch <- shadow_queue <- path_state <- path_tracer <- direct_lighting
//! <- shade <- batch <- path <- bright_path`, and `path_tracer <- closed_form_fog volume <- path`. The folder uses `bsdf`,
//! `light`, `lobes`, `path_guiding`, `interaction`, `sampling` and `prepare`.

mod ao;
pub(crate) mod batch;
pub(crate) mod bright_path;
pub(crate) mod camera_ray_batch;
mod closed_form_fog;
pub(crate) mod direct_lighting;
mod hidden_objects;
pub(crate) mod passes;
pub(crate) mod path;
pub(crate) mod path_state;
pub(crate) mod path_tracer;
mod record_passes;
pub(crate) mod requirements;
pub(crate) mod shade;
pub(crate) mod shadow_queue;
pub(crate) mod unlit;
mod volume;

use glam::Vec3;
use raycam_scene::{Notice, NoticeCode};

use crate::control::Control;
use crate::error::RenderError;
use crate::integrator::bright_path::BrightPath;
use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::passes::{Pass, PassRecorder, Passes};
use crate::integrator::path::PathScratch;
use crate::integrator::path_tracer::PathSettings;
use crate::integrator::requirements::{effective_lights, needs_light};
use crate::light::light_sampling::LightSampling;
use crate::light::lights::{LightView, Lights};
use crate::lobes::classify::is_solid_glass;
use crate::media::map::MediaMap;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::settings::{Integrator, Settings};

/// Maximum number of light samples that `direct` uses at a point.
const MAX_LIGHT_SAMPLES: usize = 64;

/// Computes the radiance along every camera ray, and sets its `passes` in the scratch buffers. `radiance`
/// must be 0 initially. Sets `is_background` for each ray that escapes before it is scattered.
pub(crate) fn radiance(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &CameraRayBatch,
    control: &Control,
    scratch: &mut PathScratch,
    passes: &[Pass],
    (radiance, is_background): (&mut [Vec3], &mut [bool]),
) -> Result<(), RenderError> {
    match settings.integrator {
        Integrator::Flat => unlit::radiance(world, batch, radiance, is_background),
        Integrator::Ao => {
            let distance = settings.ambient_occlusion.unwrap_or(f64::INFINITY) as f32;
            ao::radiance(world, distance, batch, radiance, is_background);
        }
        Integrator::Direct | Integrator::Path => {
            let settings = path_settings(settings, &world.geometry, effective_lights(settings.integrator, world));
            let out = (radiance, is_background);
            if passes.is_empty() {
                return path::radiance(world, &settings, batch, control, scratch, out);
            }
            let values = std::mem::take(&mut scratch.passes);
            let recorder = PassRecorder::new(passes, batch.hits.len(), values);
            let passes = Passes { recorder: &recorder, lights: settings.lights };
            let settings = PathSettings { passes: Some(passes), ..settings };
            let done = path::radiance(world, &settings, batch, control, scratch, out);
            scratch.passes = recorder.into_inner().into_values();
            return done;
        }
    }
    if settings.transparent_background {
        for (hit, (radiance, is_background)) in batch.hits.iter().zip(radiance.iter_mut().zip(is_background)) {
            *is_background |= !is_miss(hit) && world.geometry.is_left_out(settings.catchers, hit.instance);
            *radiance = if *is_background { Vec3::ZERO } else { *radiance };
        }
    }
    scratch.passes.clear();
    for &radiance in &*radiance {
        let own = |pass: &Pass| if *pass == Pass::Emission { radiance } else { Vec3::ZERO };
        scratch.passes.extend(passes.iter().map(own));
    }
    Ok(())
}

/// Adds the radiance along every camera ray, with a white Lambertian surface in place of each object that the ray hits.
pub(crate) fn irradiance(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &CameraRayBatch,
    control: &Control,
    scratch: &mut PathScratch,
    out: (&mut [Vec3], &mut [bool]),
) -> Result<(), RenderError> {
    let settings = path_settings(settings, &world.geometry, effective_lights(settings.integrator, world));
    path::radiance(world, &PathSettings { meets_white: true, ..settings }, batch, control, scratch, out)
}

/// Brightest path of every camera ray; empty for integrators that show no light.
pub(crate) fn bright_paths(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &CameraRayBatch,
    control: &Control,
    scratch: &mut PathScratch,
) -> Result<Vec<BrightPath>, RenderError> {
    if let Integrator::Flat | Integrator::Ao = settings.integrator {
        return Ok(vec![]);
    }
    let settings = path_settings(settings, &world.geometry, effective_lights(settings.integrator, world));
    bright_path::bright_paths(world, &settings, batch, control, scratch)
}

/// Settings of paths. Paths of `direct` have one bounce behind specular surfaces. Every light is sampled, and constant
/// environments are an ambient term.
fn path_settings<'a>(settings: &Settings, geometry: &'a Geometry, lights: &'a Lights) -> PathSettings<'a> {
    let paths = PathSettings {
        lights,
        max_depth: settings.max_depth.unwrap_or(u32::MAX),
        free_specular_bounces: false,
        light_samples: 1,
        light_sampling: LightSampling::Importance,
        split_lights: true,
        ambient_term: None,
        hide_environment: settings.transparent_background,
        catchers: settings.catchers,
        closed_form: None,
        media: None,
        meets_white: false,
        passes: None,
    };
    if settings.integrator != Integrator::Direct {
        let media = MediaMap::new(geometry);
        let media = if lights.has_infinite() { media.map(MediaMap::below_the_sky) } else { media };
        return PathSettings { media, ..paths };
    }
    let are_few = lights.count() <= MAX_LIGHT_SAMPLES;
    PathSettings {
        max_depth: 2,
        free_specular_bounces: true,
        light_samples: lights.count().clamp(1, MAX_LIGHT_SAMPLES),
        light_sampling: if are_few { LightSampling::Uniform } else { LightSampling::Importance },
        split_lights: false,
        ambient_term: match settings.ambient_occlusion {
            None => Some(None),
            // If surfaces at any distance occlude the environment, the environment is sampled like other lights,
            // without an ambient term.
            Some(distance) if distance.is_infinite() => None,
            Some(distance) => Some(Some(distance as f32)),
        },
        closed_form: MediaMap::new(geometry).map(|media| (media, lights.air_light())),
        ..paths
    }
}

/// Radiance along a camera ray that hits nothing, if it is the same for all rays.
pub(crate) fn background(world: &PreparedWorld, settings: &Settings) -> Option<Vec3> {
    match settings.integrator {
        Integrator::Flat | Integrator::Ao if settings.transparent_background => Some(Vec3::ZERO),
        // In worlds with media, the radiance may depend on the ray.
        Integrator::Flat if world.geometry.has_media() => None,
        Integrator::Flat => effective_lights(Integrator::Flat, world).view(LightView::Camera).constant_environment(),
        Integrator::Ao => Some(Vec3::ONE),
        // A ray may cross lights that have no mesh.
        Integrator::Direct | Integrator::Path => None,
    }
}

/// True if any visible object consists of solid glass.
fn has_solid_glass(world: &PreparedWorld) -> bool {
    let solid: Vec<bool> = world.geometry.materials.iter().map(|known| is_solid_glass(&known.material)).collect();
    solid.contains(&true)
        && world.geometry.instances.iter().any(|seen| seen.is_visible && seen.materials.iter().any(|&at| solid[at]))
}

/// Notices about an image of a world.
pub(crate) fn notices(integrator: Integrator, world: &PreparedWorld) -> Vec<Notice> {
    let mut notices = Vec::new();
    if !needs_light(integrator) {
        return notices;
    }
    let lighting = world.lighting();
    if lighting.default_lights.is_some() {
        let besides = match lighting.lights.has_emissive_triangles() {
            true => " except emissive surfaces",
            false => "",
        };
        let message = format!(
            "the world has no lights{besides}; it is lit by a white sky of radiance 0.4 and a sun of irradiance 2.4"
        );
        notices.push(Notice::new(NoticeCode::DefaultLights, message));
    }
    if integrator == Integrator::Path && lighting.lights.has_sizeless() && has_solid_glass(world) {
        let message = "lamps and suns without a size do not shine through solid glass, so surfaces behind it are \
                       too dark; set radius (lamps) or angular_diameter (suns; Earth's sun: 0.53) to light them";
        notices.push(Notice::new(NoticeCode::GlassBlocksLight, message));
    }
    notices
}
