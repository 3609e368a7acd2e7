//! The light of lights at a surface: what is asked for by shadow rays (next event estimation).

use glam::{DVec3, Vec3};
use raycam_bvh::Ray;

use crate::bsdf::{Scattering, above, cosine_direction};
use crate::integrator::batch::hits::Meeting;
use crate::integrator::nested_dielectrics::Skin;
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::integrator::shadow_queue::Shadows;
use crate::interaction::attributes::Surface;
use crate::light::{Askers, BEFORE_LIGHT, Choice, Drawn, LightSample, MOST_AT_ONCE};
use crate::sampling::sampler::Pair;

impl Walk<'_> {
    /// How lights are chosen where a path is scattered.
    pub(crate) fn choice(&self, path: &Path) -> Choice {
        if self.splits && path.from_camera {
            Choice::Several
        } else {
            self.rules.choice
        }
    }

    /// The same for all paths that nothing has let through before.
    pub(crate) fn choice_of_turn(&self) -> Choice {
        if self.splits && self.turn == 0 {
            Choice::Several
        } else {
            self.rules.choice
        }
    }

    /// The numbers of the lights that may be sampled at surfaces of this turn.
    pub(crate) fn asked(&self) -> impl Iterator<Item = usize> {
        let (split, count) = match self.choice_of_turn() {
            Choice::Several => (true, MOST_AT_ONCE),
            _ => (false, self.rules.light_samples),
        };
        (0..count).filter(move |&i| !split || self.lights.tells(i))
    }

    /// Asks for the light of one or more lights at a surface.
    #[inline]
    pub(crate) fn sample_lights<S: Scattering>(
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
            _ => sampler.pair(Pair::Light(self.turn, index)).into(),
        };
        if let Some(sample) = &meeting.on_area {
            self.ask(path, surface, skin, sample, &mut wave.shadows[0]);
            return;
        }
        let tell = |index: usize, sample: LightSample| {
            self.ask(path, surface, skin, &sample, &mut wave.shadows[index]);
        };
        self.draw_samples(self.choice(path), &(&from).into(), choice, random, tell);
    }

    /// Tells of the samples of lights at a point with their numbers, each with the density of all of its kind together.
    /// `by` knows what lights may matter to the point, `which` chooses among them, and `random` gives where on each.
    #[inline(always)]
    pub(crate) fn draw_samples(
        &self,
        choice: Choice,
        by: &Askers,
        which: f32,
        random: impl Fn(usize) -> Drawn,
        mut tell: impl FnMut(usize, LightSample),
    ) {
        let (lights, world) = (self.lights, self.world);
        if let Some(light) = self.only {
            if let Some(sample) = light.sample(by.from, random(0).random) {
                tell(0, sample);
            }
            return;
        }
        if choice == Choice::Several {
            lights.sample_each(by, world, which, random, tell);
            return;
        }
        let count = self.rules.light_samples;
        for index in 0..count {
            let which = (which + index as f32) / count as f32;
            if let Some(mut sample) = lights.sample(by, world, choice, which, &random(index)) {
                sample.pdf *= count as f32;
                tell(index, sample);
            }
        }
    }

    /// Asks for the light of a sample.
    #[inline]
    fn ask<S: Scattering>(
        &self,
        path: &Path,
        surface: &Surface<S>,
        skin: Skin,
        sample: &LightSample,
        shadows: &mut Shadows,
    ) {
        let pdf = sample.pdf;
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
        let media = skin.beyond(surface.frame.geometric, sample.direction);
        let start = surface.place.start(sample.direction);
        let end = sample.end.unwrap_or(DVec3::INFINITY);
        light *= self.arrives(path.ray, media, start, end);
        if light == Vec3::ZERO {
            return;
        }
        let ray = match sample.end {
            None => surface.place.leaving(sample.direction, f32::INFINITY),
            Some(end) => Ray {
                direction: (end - start).as_vec3().to_array(),
                ..surface.place.leaving(sample.direction, BEFORE_LIGHT)
            },
        };
        shadows.ask(ray, path.ray, light);
    }
}
