//! From hits to radiance: the closed set of integrators, each a chain of stages over a batch of rays.

mod ao;
pub(crate) mod batch;
pub(crate) mod direct_lighting;
pub(crate) mod nested_dielectrics;
pub(crate) mod path;
pub(crate) mod photon_pass;
pub(crate) mod shade;
pub(crate) mod shadow_queue;
pub(crate) mod unlit;

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, INVALID_ID, Scene};

use crate::control::Control;
use crate::error::RenderError;
pub(crate) use crate::integrator::photon_pass::build_caustic_maps;
use crate::interaction::ray_cone::RayCone;
use crate::light::light_sampling::LightSampling;
use crate::light::lights::Lights;
use crate::prepare::world::PreparedWorld;
use crate::sampling::sampler::Sampler;
use crate::settings::{Integrator, Settings};
pub(crate) use path::PathScratch;

/// Rays of one tile and what they met, entry by entry.
pub(crate) struct CameraRayBatch<'a> {
    /// What rays that go on are traced against.
    pub scene: &'a Scene,
    /// Scene-local.
    pub origins: &'a [DVec3],
    /// How wide the rays are.
    pub ray_cone: RayCone,
    /// Unit length.
    pub directions: &'a [Vec3],
    pub hits: &'a [Hit],
    pub samplers: &'a [Sampler],
}

/// What one picture's paths do.
#[derive(Clone, Copy, Debug)]
struct PathSettings<'a> {
    /// What lights them.
    pub lights: &'a Lights,
    /// The most segments of a path, the camera's ray included.
    pub max_depth: u32,
    /// Whether mirrors and smooth glass cost no segment.
    pub free_specular_bounces: bool,
    /// How many lights are sampled at a point.
    pub light_samples: usize,
    /// How they are chosen.
    pub light_sampling: LightSampling,
    /// Whether surfaces that the camera sees sample more than one where there are several.
    pub split_lights: bool,
    /// Takes the even skies for an ambient term, dimmed by what is nearer than a distance where there is one.
    pub ambient_term: Option<Option<f32>>,
    /// Leaves the sky out where the camera sees it.
    pub hide_environment: bool,
}

/// The radiance that arrives along every ray of the batch, and whether what the camera sees there is the sky.
pub(crate) fn radiance(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &CameraRayBatch,
    control: &Control,
    room: &mut PathScratch,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) -> Result<(), RenderError> {
    let integrator = settings.integrator;
    let lights = integrator.effective_lights(world);
    let reach = settings.ambient_occlusion;
    match integrator {
        Integrator::Flat => unlit::radiance(world, batch, radiance, sky),
        Integrator::Ao => {
            let distance = reach.unwrap_or(f64::INFINITY) as f32;
            ao::radiance(world, distance, batch, radiance, sky);
        }
        Integrator::Direct => {
            let rules = PathSettings {
                lights,
                max_depth: 2,
                free_specular_bounces: true,
                light_samples: lights.count().clamp(1, MAX_LIGHT_SAMPLES),
                light_sampling: if lights.count() <= MAX_LIGHT_SAMPLES {
                    LightSampling::Uniform
                } else {
                    LightSampling::Importance
                },
                split_lights: false,
                ambient_term: match reach {
                    None => Some(None),
                    // Occluded at any distance, the sky is a light like others.
                    Some(distance) if distance.is_infinite() => None,
                    Some(distance) => Some(Some(distance as f32)),
                },
                hide_environment: settings.transparent,
            };
            path::radiance(world, &rules, batch, control, room, radiance, sky)?;
        }
        Integrator::Path => {
            let rules = PathSettings {
                lights,
                max_depth: settings.max_depth.unwrap_or(u32::MAX),
                free_specular_bounces: false,
                light_samples: 1,
                light_sampling: LightSampling::Importance,
                split_lights: true,
                ambient_term: None,
                hide_environment: settings.transparent,
            };
            path::radiance(world, &rules, batch, control, room, radiance, sky)?;
        }
    }
    if settings.transparent && matches!(integrator, Integrator::Flat | Integrator::Ao) {
        for (radiance, _) in radiance.iter_mut().zip(&*sky).filter(|(_, sky)| **sky) {
            *radiance = Vec3::ZERO;
        }
    }
    Ok(())
}

/// What [`radiance`] is of a camera's ray that meets nothing, where that is known without tracing it.
pub(crate) fn background(world: &PreparedWorld, settings: &Settings) -> Option<Vec3> {
    match settings.integrator {
        Integrator::Flat | Integrator::Ao if settings.transparent => Some(Vec3::ZERO),
        Integrator::Flat => Integrator::Flat
            .effective_lights(world)
            .constant_environment(),
        Integrator::Ao => Some(Vec3::ONE),
        // Rays may pick up lights without a mesh on their way.
        Integrator::Direct | Integrator::Path => None,
    }
}

/// The most lights that `direct` samples at a point.
const MAX_LIGHT_SAMPLES: usize = 64;

impl Integrator {
    /// The lights it works with: a world without any gets some where light is needed to see anything.
    pub(crate) fn effective_lights(self, world: &PreparedWorld) -> &Lights {
        match &world.lighting.default_lights {
            Some(lights) if self.needs_light() => lights,
            _ => &world.lighting.lights,
        }
    }

    /// Whether its rays go on from where they meet something.
    pub(crate) fn traces_secondary_rays(self) -> bool {
        self != Self::Flat
    }

    fn needs_light(self) -> bool {
        matches!(self, Self::Direct | Self::Path)
    }

    /// What the one who looks at the picture should know.
    pub(crate) fn notices(self, world: &PreparedWorld) -> Vec<String> {
        if self.needs_light() && world.lighting.default_lights.is_some() {
            let besides = match world.lighting.lights.has_emissive_triangles() {
                true => " but surfaces that shine, which a glTF file has to be seen",
                false => "",
            };
            vec![format!(
                "the world has no lights{besides}: it is lit by a white sky of radiance 0.4 and a sun of irradiance 2.4"
            )]
        } else {
            vec![]
        }
    }
}

fn is_miss(hit: &Hit) -> bool {
    hit.instance == INVALID_ID
}
