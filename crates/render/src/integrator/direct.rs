//! `direct`: light that comes straight from the lights, with shadows, and the sky as an ambient term.

use glam::Vec3;
use raycam_bvh::{Coherence, Ray};
use raycam_scene::Reflectance;

use super::{Batch, is_miss};
use crate::control::Control;
use crate::error::RenderError;
use crate::light::Reference;
use crate::prepare::PreparedWorld;
use crate::sampler::Pair;
use crate::settings::{Integrator, Settings};
use crate::surface::Surface;

/// A shadow ray ends this share before its light, which may lie on a surface.
const BEFORE_LIGHT: f32 = 1.0 - 1.0 / (1 << 16) as f32;

pub(super) fn radiance(
    world: &PreparedWorld,
    settings: &Settings,
    batch: &Batch,
    control: &Control,
    radiance: &mut [Vec3],
) -> Result<(), RenderError> {
    let lights = Integrator::Direct.lights(world);
    let sky = lights.ambient;
    let mut surfaces = vec![];
    for (i, hit) in batch.hits.iter().enumerate() {
        radiance[i] = if is_miss(hit) {
            lights.sky(batch.directions[i])
        } else if world.material(hit).material.reflectance == Reflectance::Unlit {
            world.base_color(hit)
        } else {
            surfaces.push(Surface::new(world, i, batch.directions[i], hit));
            Vec3::ZERO
        };
    }
    let mut shadows = Shadows::default();
    if sky != Vec3::ZERO {
        for surface in &surfaces {
            let ambient = sky * surface.ambient();
            match settings.ambient_occlusion {
                None => radiance[surface.ray] += ambient,
                Some(distance) => {
                    let random = batch.samplers[surface.ray].pair(Pair::Ambient);
                    let ray = leaving(surface, above(surface.geometric, random), distance as f32);
                    shadows.ask(ray, surface.ray, ambient);
                }
            }
        }
        shadows.settle(world, Coherence::Incoherent, radiance);
    }
    for (number, light) in lights.sources.iter().enumerate() {
        control.check()?;
        if light.is_ambient() {
            continue;
        }
        for surface in &surfaces {
            let from = Reference {
                position: surface.position,
                normal: surface.geometric,
            };
            let random = batch.samplers[surface.ray].pair(Pair::Light(number));
            let Some(sample) = light.sample(&from, random) else {
                continue;
            };
            let contribution = surface.reflected(sample.direction) * (sample.radiance / sample.pdf);
            if contribution == Vec3::ZERO {
                continue;
            }
            let ray = match sample.end {
                None => leaving(surface, sample.direction, f32::INFINITY),
                Some(end) => leaving(surface, (end - surface.start).as_vec3(), BEFORE_LIGHT),
            };
            shadows.ask(ray, surface.ray, contribution);
        }
        let coherence = if light.is_coherent() {
            Coherence::Coherent
        } else {
            Coherence::Unknown
        };
        shadows.settle(world, coherence, radiance);
    }
    Ok(())
}

/// A ray from a surface into the world.
fn leaving(surface: &Surface, direction: Vec3, t_max: f32) -> Ray {
    Ray {
        origin: surface.start.as_vec3().to_array(),
        direction: direction.to_array(),
        t_max,
    }
}

/// A direction above a surface with density cosine / pi (Malley's method).
fn above(normal: Vec3, [x, y]: [f32; 2]) -> Vec3 {
    let (right, up) = normal.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * y).sin_cos();
    let radius = x.sqrt();
    (right * cos + up * sin) * radius + normal * (1.0 - x).sqrt()
}

/// Light on its way to the rays of a batch, unless something stands in between.
#[derive(Default)]
struct Shadows {
    rays: Vec<Ray>,
    dark: Vec<bool>,
    /// Which ray of the batch it is for, and how much.
    light: Vec<(usize, Vec3)>,
}

impl Shadows {
    fn ask(&mut self, ray: Ray, index: usize, light: Vec3) {
        self.rays.push(ray);
        self.light.push((index, light));
    }

    /// Answers everything asked since the last time.
    fn settle(&mut self, world: &PreparedWorld, coherence: Coherence, radiance: &mut [Vec3]) {
        self.dark.clear();
        self.dark.resize(self.rays.len(), false);
        world.scene.occluded(&self.rays, &mut self.dark, coherence);
        for (&(index, light), dark) in self.light.iter().zip(&self.dark) {
            if !dark {
                radiance[index] += light;
            }
        }
        self.rays.clear();
        self.light.clear();
    }
}
