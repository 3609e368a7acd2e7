//! `path`, and `direct`, which is `path` of one bounce behind mirrors and glass: one loop over the rays of a tile.
//!
//! Every turn shades what the live rays met, asks for shadows in one batch and traces the rays that go on in another.
//! Light is found in two ways, by sampling lights and by sampling the surface; each way is weighed by the balance
//! heuristic (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2.2).

use glam::Vec3;
use raycam_bvh::{Coherence, Hit, Ray};
use raycam_scene::{Alpha, Material, Reflectance};

use super::shadows::Shadows;
use super::{Batch, Rules, is_miss};
use crate::control::Control;
use crate::error::RenderError;
use crate::light::{BEFORE_LIGHT, Lights, Reference};
use crate::prepare::PreparedWorld;
use crate::sampler::{Pair, Sampler};
use crate::scatter::{cosine_direction, inside, is_dispersive};
use crate::surface::Surface;
use crate::texture::{Cone, Footprint};

/// Segments before a path may end by roulette.
const SAFE_DEPTH: u32 = 4;

/// A ray on its way from the camera.
#[derive(Clone, Copy, Debug)]
struct Path {
    /// Index in the batch.
    ray: usize,
    /// What radiance along the ray is multiplied by to get the camera's.
    throughput: Vec3,
    direction: Vec3,
    /// Where it was scattered last; the camera at first.
    from: Reference,
    /// The density with which the surface there chose this direction.
    pdf: f32,
    /// Whether no light sampling could have found its direction: it comes from the camera, a mirror or smooth glass.
    straight: bool,
    /// Whether nothing has scattered it yet.
    from_camera: bool,
    /// Segments, this one included, as the rules count them.
    depth: u32,
    /// What is lost per metre where it goes.
    absorption: Vec3,
    /// The one colour that it carries, where dispersion has split it.
    channel: Option<usize>,
    /// What refraction has divided the throughput by, and will multiply it by on the way out.
    squeeze: f32,
    /// Surfaces met: which random numbers it has used.
    bounce: u32,
    /// How wide it is, until a surface scatters it.
    cone: Cone,
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
    let mut first = true;
    while !paths.is_empty() {
        control.check()?;
        for (path, hit) in paths.iter().zip(&hits) {
            walk.step(path, hit, &mut wave, radiance);
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
struct Wave {
    /// One batch for each light sampled at a point: neighbours run alike where it is the same light.
    shadows: Vec<Shadows>,
    ambient: Shadows,
    /// The paths that go on, and their rays.
    next: Vec<Path>,
    rays: Vec<Ray>,
    /// The rays of the batch whose way from the camera ends in the sky.
    sky: Vec<usize>,
}

/// What all paths share.
struct Walk<'a> {
    world: &'a PreparedWorld,
    lights: &'a Lights,
    rules: &'a Rules,
    samplers: &'a [Sampler],
    /// Whether a ray may find light that `Lights::sample` finds too.
    found: bool,
}

impl Walk<'_> {
    /// What one path does at what it met.
    fn step(&self, path: &Path, hit: &Hit, wave: &mut Wave, radiance: &mut [Vec3]) {
        let out = &mut radiance[path.ray];
        if is_miss(hit) {
            self.pick_up(path, f64::INFINITY, out);
            if path.from_camera {
                wave.sky.push(path.ray);
            }
            if !(path.from_camera && self.rules.transparent) {
                self.see_sky(path, out);
            }
            return;
        }
        let path = &mut { *path };
        let material = &self.world.material(hit).material;
        if path.channel.is_none() && is_dispersive(material) {
            let [choice, _] = self.samplers[path.ray].pair(Pair::Spectrum);
            let channel = ((choice * 3.0) as usize).min(2);
            path.channel = Some(channel);
            path.throughput *= 3.0 * Vec3::AXES[channel];
        }
        path.cone = path.cone.after(hit.t);
        let (channel, width) = (path.channel, path.cone.width);
        let surface = Surface::new(self.world, path.direction, hit, channel, width);
        if self.passes(path, &surface, hit) {
            // The same ray, from the other side.
            wave.rays
                .push(surface.leaving(path.direction, f32::INFINITY));
            wave.next.push(Path {
                bounce: path.bounce + 1,
                ..*path
            });
            return;
        }
        let distance = (surface.position - path.from.position).length();
        let absorption = match inside(material) {
            // The ray has run inside, wherever it came from.
            Some(absorption) if !surface.front => absorption,
            _ => path.absorption,
        };
        if absorption != Vec3::ZERO {
            path.throughput *= (-absorption * distance as f32).exp();
        }
        self.pick_up(path, distance, out);
        self.see_surface(path, hit, distance, out);
        if self.free(path) || path.depth < self.rules.max_depth {
            self.sample_lights(path, &surface, wave, out);
            self.scatter(path, material, &surface, wave);
        }
    }

    /// Whether a path that may not grow may still go on through mirrors.
    fn free(&self, path: &Path) -> bool {
        self.rules.free_mirrors && path.straight
    }

    /// Whether a surface is not there for this ray: by its opacity, or because the camera sees the back of a one-sided
    /// one (glTF 2.0, 3.9.4 and 3.9.6).
    fn passes(&self, path: &Path, surface: &Surface, hit: &Hit) -> bool {
        let material = &self.world.material(hit).material;
        if path.depth == 1 && path.straight && !surface.front && !material.double_sided {
            return !surface.scatter.is_transmissive();
        }
        if material.alpha == Alpha::Opaque {
            return false;
        }
        let [chance, _] = self.samplers[path.ray].pair(Pair::Fate(path.bounce));
        chance >= self.world.opacity(hit)
    }

    /// The weight of light that the surface's own sampling found, where light sampling has this density.
    fn weight(&self, path: &Path, pdf: f32) -> f32 {
        if path.straight || pdf == 0.0 {
            1.0
        } else {
            1.0 / (1.0 + self.rules.light_samples as f32 * pdf / path.pdf)
        }
    }

    /// Lights without a mesh that the ray crosses.
    fn pick_up(&self, path: &Path, distance: f64, out: &mut Vec3) {
        self.lights.crossed(
            &path.from,
            self.rules.choice,
            path.direction,
            distance,
            |radiance, pdf| {
                *out += path.throughput * radiance * self.weight(path, pdf);
            },
        );
    }

    fn see_sky(&self, path: &Path, out: &mut Vec3) {
        let sky = self.sky(path.straight, self.lights.sky(path.direction));
        if sky != Vec3::ZERO {
            let pdf = self
                .lights
                .sky_pdf(&path.from, self.rules.choice, path.direction);
            *out += path.throughput * sky * self.weight(path, pdf);
        }
    }

    /// The part of the sky's radiance that is not in the ambient term.
    fn sky(&self, straight: bool, radiance: Vec3) -> Vec3 {
        if straight || self.rules.ambient.is_none() {
            radiance
        } else {
            (radiance - self.lights.ambient).max(Vec3::ZERO)
        }
    }

    /// What the surface at a hit shines by itself.
    fn see_surface(&self, path: &Path, hit: &Hit, distance: f64, out: &mut Vec3) {
        let (world, direction) = (self.world, path.direction);
        if path.straight && world.material(hit).material.reflectance == Reflectance::Unlit {
            *out += path.throughput * world.base_color(hit, &Footprint::default());
        }
        let emitted = self.lights.emitted(world, hit, direction);
        if emitted != Vec3::ZERO {
            let pdf = self.lights.emitted_pdf(
                &path.from,
                self.rules.choice,
                world,
                hit,
                direction,
                distance,
            );
            *out += path.throughput * emitted * self.weight(path, pdf);
        }
    }

    /// Asks for the light of one or more lights at a surface.
    fn sample_lights(&self, path: &Path, surface: &Surface, wave: &mut Wave, out: &mut Vec3) {
        if !surface.scatter.is_lit() {
            return;
        }
        let sampler = &self.samplers[path.ray];
        if let Some(within) = self.rules.ambient
            && self.lights.ambient != Vec3::ZERO
        {
            let ambient =
                path.throughput * self.lights.ambient * surface.scatter.albedo(&surface.frame);
            match within {
                None => *out += ambient,
                Some(distance) => {
                    let direction = surface
                        .frame
                        .above(cosine_direction(sampler.pair(Pair::Ambient)));
                    let ray = surface.leaving(direction, distance);
                    wave.ambient.ask(ray, path.ray, ambient);
                }
            }
        }
        let from = surface.reference();
        let count = self.rules.light_samples;
        let [_, choice] = sampler.pair(Pair::Which(path.bounce));
        for (index, shadows) in wave.shadows.iter_mut().enumerate() {
            let [x, y] = sampler.pair(Pair::Light(path.bounce, index));
            let which = [(choice + index as f32) / count as f32, x, y];
            let Some(sample) = self
                .lights
                .sample(self.world, &from, self.rules.choice, which)
            else {
                continue;
            };
            let radiance = match sample.end {
                None if !sample.delta => self.sky(false, sample.radiance),
                _ => sample.radiance,
            };
            let scattered = surface.scatter.evaluate(&surface.frame, sample.direction);
            let pdf = sample.pdf * count as f32;
            let mut light = path.throughput * scattered.value * (radiance / pdf);
            if !sample.delta && self.found {
                light /= 1.0 + scattered.pdf / pdf;
            }
            if light == Vec3::ZERO {
                continue;
            }
            let ray = match sample.end {
                None => surface.leaving(sample.direction, f32::INFINITY),
                Some(end) => {
                    let way = end - surface.start(sample.direction);
                    Ray {
                        direction: way.as_vec3().to_array(),
                        ..surface.leaving(sample.direction, BEFORE_LIGHT)
                    }
                }
            };
            shadows.ask(ray, path.ray, light);
        }
    }

    /// Sends the path on, where it has a future.
    fn scatter(&self, path: &Path, material: &Material, surface: &Surface, wave: &mut Wave) {
        let sampler = &self.samplers[path.ray];
        let [choice, _] = sampler.pair(Pair::Which(path.bounce));
        let [x, y] = sampler.pair(Pair::Scatter(path.bounce));
        let Some(sample) = surface.scatter.sample(&surface.frame, [choice, x, y]) else {
            return;
        };
        let free = self.free(path) && sample.delta;
        let depth = path.depth + u32::from(!free);
        // The last segment only looks for lights.
        let last = depth >= self.rules.max_depth && !sample.delta;
        if depth > self.rules.max_depth || (last && !self.found) {
            return;
        }
        let mut throughput = path.throughput * sample.weight;
        let squeeze = path.squeeze * sample.squeeze;
        if path.bounce + 2 > SAFE_DEPTH {
            let survival = (throughput.max_element() * squeeze).min(0.95);
            let [_, chance] = sampler.pair(Pair::Fate(path.bounce));
            if chance >= survival {
                return;
            }
            throughput /= survival;
        }
        if throughput == Vec3::ZERO {
            return;
        }
        let passed = surface.frame.geometric.dot(sample.direction) < 0.0;
        let absorption = match inside(material) {
            Some(absorption) if passed && surface.front => absorption,
            Some(_) if passed => Vec3::ZERO,
            _ => path.absorption,
        };
        wave.rays
            .push(surface.leaving(sample.direction, f32::INFINITY));
        wave.next.push(Path {
            ray: path.ray,
            throughput,
            direction: sample.direction,
            from: surface.reference(),
            pdf: sample.pdf,
            straight: sample.delta,
            from_camera: false,
            depth,
            absorption,
            channel: path.channel,
            squeeze,
            bounce: path.bounce + 1,
            cone: path.cone.scattered(sample.delta),
        });
    }
}
