//! From hits to radiance: the closed set of integrators, each a chain of stages over a batch of rays.

mod direct;
mod flat;

use glam::Vec3;
use raycam_bvh::{Hit, NOTHING};

use crate::control::Control;
use crate::error::RenderError;
use crate::light::Lights;
use crate::prepare::PreparedWorld;
use crate::sampler::Sampler;
use crate::settings::{Integrator, Settings};

/// Rays of one tile and what they met, entry by entry.
pub(crate) struct Batch<'a> {
    /// Unit length.
    pub directions: &'a [Vec3],
    pub hits: &'a [Hit],
    pub samplers: &'a [Sampler],
}

/// The radiance that arrives along every ray of the batch.
pub(crate) fn radiance(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &Batch,
    control: &Control,
    radiance: &mut [Vec3],
) -> Result<(), RenderError> {
    match settings.integrator {
        Integrator::Flat => flat::radiance(world, batch, radiance),
        Integrator::Direct => direct::radiance(world, settings, batch, control, radiance)?,
    }
    Ok(())
}

impl Integrator {
    /// The lights it works with: a world without any gets some where light is needed to see anything.
    pub(crate) fn lights(self, world: &PreparedWorld) -> &Lights {
        match (self, &world.default_lights) {
            (Integrator::Direct, Some(lights)) => lights,
            _ => &world.lights,
        }
    }

    /// What the one who looks at the picture should know.
    pub(crate) fn notices(self, world: &PreparedWorld) -> Vec<String> {
        if self == Integrator::Direct && world.default_lights.is_some() {
            vec!["the world has no lights: it is lit by a white sky of radiance 0.4 and a sun of irradiance 2.4".into()]
        } else {
            vec![]
        }
    }
}

fn is_miss(hit: &Hit) -> bool {
    hit.instance == NOTHING
}
