//! `path`, and `direct`, which is `path` of one bounce behind mirrors and glass: one loop over the rays of a tile.
//!
//! Every turn shades what the live rays met, asks for shadows in one batch and traces the rays that go on in another.
//! Light is found in two ways, by sampling lights and by sampling the surface; each way is weighed by the balance
//! heuristic (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.2).

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray};

use super::shadows::Shadows;
use super::walk::Walk;
use super::{Batch, Rules, is_miss};
use crate::control::Control;
use crate::error::RenderError;
use crate::light::{Lights, Reference};
use crate::prepare::PreparedWorld;
use crate::surface::Place;
use crate::texture::Cone;

/// A ray on its way from the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Index in the batch.
    pub ray: usize,
    /// What radiance along the ray is multiplied by to get the camera's.
    pub throughput: Vec3,
    pub direction: Vec3,
    /// Where it was scattered last; the camera at first.
    pub from: Reference,
    /// The density with which the surface there chose this direction.
    pub pdf: f32,
    /// Whether no light sampling could have found its direction: it comes from the camera, a mirror or smooth glass.
    pub straight: bool,
    /// Whether nothing has scattered it yet.
    pub from_camera: bool,
    /// Segments, this one included, as the rules count them.
    pub depth: u32,
    /// What is lost per metre where it goes.
    pub absorption: Vec3,
    /// The one colour that it carries, where dispersion has split it.
    pub channel: Option<usize>,
    /// What refraction has divided the throughput by, and will multiply it by on the way out.
    pub squeeze: f32,
    /// Surfaces met: which random numbers it has used.
    pub bounce: u32,
    /// How wide it is, until a surface scatters it.
    pub cone: Cone,
}

pub(super) fn radiance(
    world: &PreparedWorld,
    lights: &Lights,
    rules: &Rules,
    batch: &Batch,
    control: &Control,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) -> Result<(), RenderError> {
    let walk = Walk {
        world,
        lights,
        rules,
        samplers: batch.samplers,
        found: lights.is_found(rules.ambient.is_some()),
    };
    let mut wave = Wave {
        shadows: vec![Shadows::default(); rules.light_samples],
        ..Wave::default()
    };
    let mut paths: Vec<Path> = batch
        .origins
        .iter()
        .zip(batch.directions)
        .enumerate()
        .map(|(ray, (&position, &direction))| Path {
            ray,
            throughput: Vec3::ONE,
            direction,
            from: Reference {
                position,
                normal: Vec3::ZERO,
            },
            pdf: 0.0,
            straight: true,
            from_camera: true,
            depth: 1,
            absorption: Vec3::ZERO,
            channel: None,
            squeeze: 1.0,
            bounce: 0,
            cone: batch.cone,
        })
        .collect();
    let mut hits = batch.hits.to_vec();
    let mut places = Vec::with_capacity(hits.len());
    let mut first = true;
    while !paths.is_empty() {
        control.check()?;
        // Apart from what follows: triangles come from all over the memory, and many are fetched at once.
        places.clear();
        places.extend(paths.iter_mut().zip(&hits).map(|(path, hit)| {
            if is_miss(hit) {
                return Place::default();
            }
            path.cone = path.cone.after(hit.t);
            Place::new(world, path.direction, hit, path.cone.width)
        }));
        for ((path, hit), place) in paths.iter_mut().zip(&hits).zip(&places) {
            walk.step(path, hit, place, &mut wave, radiance);
        }
        for ray in wave.sky.drain(..) {
            sky[ray] = true;
        }
        let coherence = if first {
            Coherence::Unknown
        } else {
            Coherence::Incoherent
        };
        first = false;
        for shadows in &mut wave.shadows {
            shadows.settle(world, coherence, radiance);
        }
        wave.ambient.settle(world, Coherence::Incoherent, radiance);
        hits.clear();
        hits.resize(wave.rays.len(), Hit::MISS);
        world
            .scene
            .closest(&wave.rays, &mut hits, Coherence::Incoherent);
        wave.rays.clear();
        std::mem::swap(&mut paths, &mut wave.next);
        wave.next.clear();
    }
    Ok(())
}

/// What one turn of the loop asks for.
#[derive(Default)]
pub(super) struct Wave {
    /// One batch for each light sampled at a point: neighbours run alike where it is the same light.
    pub shadows: Vec<Shadows>,
    pub ambient: Shadows,
    /// The paths that go on, and their rays.
    pub next: Vec<Path>,
    pub rays: Vec<Ray>,
    /// The rays of the batch whose way from the camera ends in the sky.
    pub sky: Vec<usize>,
}
