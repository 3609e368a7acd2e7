//! `path`, and `direct`, which is `path` of one bounce behind mirrors and glass: one loop over the rays of a tile.
//!
//! Every turn shades what the live rays met, asks for shadows in one batch and traces the rays that go on in another.
//! Light is found in two ways, by sampling lights and by sampling the surface; each way is weighed by the balance
//! heuristic (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.2).

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray};
use raycam_scene::Reflectance;

use super::{Batch, Rules, is_miss};
use crate::control::Control;
use crate::error::RenderError;
use crate::integrator::batch::hits::Meetings;
use crate::integrator::nested_dielectrics::Media;
use crate::integrator::shade::Walk;
use crate::integrator::shadow_queue::Shadows;
use crate::light::{Choice, Lights, MOST_AT_ONCE, Reference};
use crate::prepare::PreparedWorld;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::texture::Cone;
use crate::soa::LANES;

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
    /// How often it has gone two ways.
    pub forks: u8,
    /// How lights were chosen where it was scattered last.
    pub choice: Choice,
    /// Segments, this one included, as the rules count them.
    pub depth: u32,
    /// What clear matter it goes through.
    pub media: Media,
    /// The one colour that it carries, where dispersion has split it.
    pub channel: Option<u8>,
    /// What refraction has divided the throughput by, and will multiply it by on the way out.
    pub squeeze: f32,
    /// How wide it is, until a surface scatters it.
    pub cone: Cone,
}

// Two lines of the cache; what is larger the compiler copies by a call.
const _: () = assert!(size_of::<Path>() <= 128);

pub(super) fn radiance(
    world: &PreparedWorld,
    rules: &Rules,
    batch: &Batch,
    control: &Control,
    room: &mut Room,
    radiance: &mut [Vec3],
    sky: &mut [bool],
) -> Result<(), RenderError> {
    let lights = rules.lights;
    let at_once = lights.most_at_once().filter(|_| rules.splits);
    let sampled = lights.is_sampled(rules.choice);
    // Where an ambient term is no part of it.
    let many = sampled && rules.ambient.is_none() && rules.light_samples <= MOST_AT_ONCE;
    let mut walk = Walk {
        world,
        lights,
        rules,
        samplers: batch.samplers,
        found: lights.is_found(rules.ambient.is_some()),
        sampled,
        chosen: rules.light_samples > 1 || lights.is_chosen(rules.choice),
        only: lights
            .only(rules.choice)
            .filter(|_| many && rules.light_samples == 1),
        many,
        splits: at_once.is_some(),
        blind: is_blind(world, lights),
        branches: branches(world),
        mirrors: match lights.is_thrown() {
            true => &world.mirrors,
            false => &[],
        },
        thrown: world.thrown.get().map_or(&[], Vec::as_slice),
        turn: 0,
    };
    let Room {
        paths,
        live,
        next,
        hits,
        behind,
        meetings,
        wave,
    } = room;
    wave.begin(at_once.unwrap_or(rules.light_samples));
    paths.clear();
    let rays = batch.origins.iter().zip(batch.directions).enumerate().map(
        |(ray, (&position, &direction))| Path {
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
            forks: 0,
            choice: rules.choice,
            depth: 1,
            media: Media::default(),
            channel: None,
            squeeze: 1.0,
            cone: batch.cone,
        },
    );
    paths.extend(rays);
    hits.clear();
    hits.extend_from_slice(batch.hits);
    live.clear();
    live.extend(0..paths.len() as u32);
    while !live.is_empty() {
        control.check()?;
        let environment = lights.environment();
        if let Some((_, environment)) = environment {
            let missed = live.iter().zip(&*hits).filter(|(_, hit)| is_miss(hit));
            let directions = missed.map(|(&at, _)| paths[at as usize].direction);
            environment.behind_many(directions, behind);
        }
        let mut missed = behind.iter();
        let mut met = 0;
        for i in 0..live.len() {
            let path = &paths[live[i] as usize];
            if is_miss(&hits[i]) {
                sky[path.ray] |= path.from_camera;
                let known = environment.and_then(|(number, _)| Some((number, *missed.next()?)));
                walk.miss(path, known, &mut radiance[path.ray]);
            } else {
                (live[met], hits[met]) = (live[i], hits[i]);
                met += 1;
            }
        }
        live.truncate(met);
        hits.truncate(met);
        meetings.find(&walk, paths, live, hits);
        next.clear();
        for (number, hits) in hits.chunks(LANES).enumerate() {
            let first = number * LANES;
            meetings.locate(&walk, number, paths, &live[first..][..hits.len()], hits);
            for (lane, hit) in hits.iter().enumerate() {
                let at = live[first + lane];
                let path = &mut paths[at as usize];
                let goes_on = if meetings.absent[lane] {
                    // The same ray, from the other side.
                    let place = meetings.places.place(lane);
                    wave.rays.push(place.leaving(path.direction, f32::INFINITY));
                    true
                } else if meetings.mattes.is[lane] {
                    walk.step_matte(path, meetings, (number, lane), hit, wave, radiance)
                } else if meetings.glossies.is[lane] {
                    walk.step_glossy(path, meetings, lane, hit, wave, radiance)
                } else if meetings.smooths.points.is[lane] {
                    walk.step_smooth(path, meetings, lane, wave, radiance)
                } else if meetings.frosteds.points.is[lane] {
                    walk.step_frosted(path, meetings, lane, hit, wave, radiance)
                } else {
                    let meeting = meetings.at(&walk, number, lane, hit);
                    walk.step(path, &meeting, wave, radiance)
                };
                if goes_on {
                    next.push(at);
                }
                for fork in wave.forks.drain(..) {
                    next.push(paths.len() as u32);
                    paths.push(fork);
                }
            }
        }
        std::mem::swap(live, next);
        let coherence = if walk.turn == 0 {
            Coherence::Unknown
        } else {
            Coherence::Incoherent
        };
        for shadows in &mut wave.shadows {
            shadows.settle(world, batch.scene, coherence, radiance);
        }
        wave.scattered
            .settle(world, batch.scene, Coherence::Incoherent, radiance);
        // All are written; what they were does not matter.
        hits.resize(wave.rays.len(), Hit::MISS);
        batch.scene.closest(&wave.rays, hits, Coherence::Incoherent);
        wave.rays.clear();
        walk.turn += 1;
    }
    Ok(())
}

/// Whether the last segments of paths find no more than lights behind everything, or between surfaces in empty space.
fn is_blind(world: &PreparedWorld, lights: &Lights) -> bool {
    let clear = |prepared: &PreparedMaterial| prepared.inside.is_some();
    let dims = lights.has_finite() && world.materials.iter().any(clear);
    // Of an image or a clear sky, only what is seen is worth finding.
    let reads = lights.environment().is_some();
    !(world.see_through || lights.has_surfaces() || dims || reads)
}

/// Whether surfaces that are met many at a time choose between two ways: clear glass, and glossy ones.
fn branches(world: &PreparedWorld) -> bool {
    let choose = |prepared: &PreparedMaterial| {
        let metal = matches!(prepared.material.reflectance, Reflectance::Metal(_));
        prepared.glossy || prepared.frosted || (prepared.clear && !metal)
    };
    world.materials.iter().any(choose)
}

/// What the paths of a batch take, kept from batch to batch.
#[derive(Default)]
pub(crate) struct Room {
    paths: Vec<Path>,
    /// Which of them go on, which will then, and what these meet.
    live: Vec<u32>,
    next: Vec<u32>,
    hits: Vec<Hit>,
    /// What the image or the sky all around has behind those that meet nothing.
    behind: Vec<(Vec3, f32)>,
    meetings: Meetings,
    wave: Wave,
}

/// What one turn of the loop asks for.
#[derive(Default)]
pub(super) struct Wave {
    /// One batch for each light sampled at a point: neighbours run alike where it is the same light.
    pub shadows: Vec<Shadows>,
    /// In directions that surfaces chose.
    pub scattered: Shadows,
    /// Of the paths that go on.
    pub rays: Vec<Ray>,
    /// Those that have begun where one went two ways.
    pub forks: Vec<Path>,
}

impl Wave {
    /// Asks for nothing yet, and for the light of so many lights at a point.
    fn begin(&mut self, lights: usize) {
        self.shadows.resize_with(lights, Shadows::default);
        self.shadows.iter_mut().for_each(Shadows::clear);
        self.scattered.clear();
        self.rays.clear();
        self.forks.clear();
    }
}
