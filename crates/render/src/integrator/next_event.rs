//! The light of lights at a surface: what is asked for by shadow rays (next event estimation).

use glam::Vec3;
use raycam_bvh::Ray;

use super::media::Skin;
use super::meetings::Meeting;
use super::path::{Path, Wave};
use super::shadows::Shadows;
use super::walk::Walk;
use crate::light::{BEFORE_LIGHT, Choice, LightSample, MOST_AT_ONCE, Source};
use crate::sampler::Pair;
use crate::scatter::{Scattering, above, cosine_direction};
use crate::surface::Surface;

impl Walk<'_> {
    /// How lights are chosen where a path is scattered.
    pub(super) fn choice(&self, path: &Path) -> Choice {
        if self.splits && path.from_camera {
            Choice::Split
        } else {
            self.rules.choice
        }
    }

    /// The same for all paths that nothing has let through before.
    pub(super) fn choice_of_turn(&self) -> Choice {
        if self.splits && self.turn == 0 {
            Choice::Split
        } else {
            self.rules.choice
        }
    }

    /// The numbers of the lights that may be sampled at surfaces of this turn.
    pub(super) fn asked(&self) -> impl Iterator<Item = usize> {
        let (split, count) = match self.choice_of_turn() {
            Choice::Split => (true, MOST_AT_ONCE),
            _ => (false, self.rules.light_samples),
        };
        (0..count).filter(move |&i| !split || self.lights.tells(i))
    }

    /// Asks for the light of one or more lights at a surface.
    #[inline]
    pub(super) fn sample_lights<S: Scattering>(
        &self,
        path: &Path,
        surface: &Surface<S>,
        skin: Skin,
        meeting: &Meeting,
        wave: &mut Wave,
        out: &mut Vec3,
    ) {
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
                    let direction = above(
                        surface.place.geometric,
                        cosine_direction(sampler.pair(Pair::Ambient)),
                    );
                    let ray = surface.place.leaving(direction, distance);
                    wave.scattered.ask(ray, path.ray, ambient);
                }
            }
        }
        if !self.sampled {
            return;
        }
        let from = surface.reference();
        let [_, choice] = if self.chosen {
            sampler.pair(Pair::Which(self.turn))
        } else {
            [0.0; 2]
        };
        let random = |index| match index {
            0 => meeting.light,
            _ => sampler.pair(Pair::Light(self.turn, index)),
        };
        let (lights, world) = (self.lights, self.world);
        match self.choice(path) {
            Choice::Split => {
                lights.sample_each(&from, world, &from, choice, random, |index, sample| {
                    let shadows = &mut wave.shadows[index];
                    self.ask(path, surface, skin, &sample, sample.pdf, shadows);
                })
            }
            few => {
                let count = self.rules.light_samples;
                for (index, shadows) in wave.shadows.iter_mut().take(count).enumerate() {
                    let [x, y] = random(index);
                    let sample = match self.only {
                        Some(Source::Area(_)) => meeting.on_area,
                        Some(light) => light.sample(&from, [x, y]),
                        None => {
                            let which = [(choice + index as f32) / count as f32, x, y];
                            lights.sample(world, &from, few, which)
                        }
                    };
                    if let Some(sample) = sample {
                        self.ask(
                            path,
                            surface,
                            skin,
                            &sample,
                            sample.pdf * count as f32,
                            shadows,
                        );
                    }
                }
            }
        }
    }

    /// Asks for the light of a sample, which all samples together find with this density.
    #[inline]
    fn ask<S: Scattering>(
        &self,
        path: &Path,
        surface: &Surface<S>,
        skin: Skin,
        sample: &LightSample,
        pdf: f32,
        shadows: &mut Shadows,
    ) {
        let radiance = match sample.end {
            None if !sample.delta => self.sky(false, sample.radiance),
            _ => sample.radiance,
        };
        let scattered = surface.scatter.evaluate(&surface.frame, sample.direction);
        let mut light = path.throughput * scattered.value * (radiance / pdf);
        if !sample.delta && self.found {
            light /= 1.0 + scattered.pdf / pdf;
        }
        if light == Vec3::ZERO {
            return;
        }
        let ray = match sample.end {
            None => surface.place.leaving(sample.direction, f32::INFINITY),
            Some(end) => {
                let way = end - surface.place.start(sample.direction);
                let media = skin.beyond(surface.frame.geometric, sample.direction);
                if !media.is_empty() {
                    light *= (-media.absorption(self.world) * way.length() as f32).exp();
                }
                Ray {
                    direction: way.as_vec3().to_array(),
                    ..surface.place.leaving(sample.direction, BEFORE_LIGHT)
                }
            }
        };
        shadows.ask(ray, path.ray, light);
    }
}
