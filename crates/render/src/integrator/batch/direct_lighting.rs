//! What lights bring to matte and glossy surfaces, many at a time: what [`Walk::sample_lights`] asks for one by one.

use glam::{DVec3, Vec3};
use raycam_bvh::{Loops, Ray, vectorized};

use crate::integrator::batch::bsdf::Surfaces;
use crate::integrator::shade::Walk;
use crate::integrator::shadow_queue::Shadows;
use crate::interaction::Places;
use crate::light::{
    Around, Askers, BEFORE_LIGHT, Choice, Drawn, FindWeights, LightSamples, MOST_AT_ONCE,
    Reference, Source, Weights,
};
use crate::soa::{LANES, Three, get, set, vector};

/// What the surfaces of a turn ask lights for: the random numbers of all of them, and of some at a time what takes more
/// room.
#[derive(Default)]
pub(crate) struct Asked {
    /// Where on each of the lights that are sampled at a point.
    pub draws: Draws,
    /// Which light.
    pub which: Vec<[f32; 2]>,
    pub samples: [LightSamples<LANES>; MOST_AT_ONCE],
    lit: [Lit<LANES>; MOST_AT_ONCE],
    /// Of lights without a mesh, and of surfaces that shine.
    weights: [Weights; 2],
    /// How many of `lit` there are, the last of which has something.
    count: usize,
}

/// Random numbers of all surfaces of a turn, light by light.
#[derive(Default)]
pub(crate) struct Draws {
    pub numbers: [Vec<[f32; 2]>; MOST_AT_ONCE],
    /// What they draw of the image or the sky all around, where it may be asked for, and its number.
    around: [Vec<Around>; MOST_AT_ONCE],
    environment: usize,
}

impl Draws {
    /// Draws from the image or the sky all around: for all surfaces, whatever they are, so that none waits for what it reads.
    pub fn look_around(&mut self, walk: &Walk) {
        self.around.iter_mut().for_each(Vec::clear);
        let Some((number, environment)) = walk.lights.environment() else {
            return;
        };
        self.environment = number;
        let splits = walk.choice_of_turn() == Choice::Several;
        for i in walk.asked().filter(|&i| walk.many || i == 0) {
            if !splits || i == number {
                environment.sample_many(&self.numbers[i], &mut self.around[i]);
            }
        }
    }

    /// Where a surface of the turn asks light `i`.
    pub fn of(&self, i: usize, surface: usize) -> Drawn {
        let around = self.around[i].get(surface);
        Drawn {
            random: self.numbers[i][surface],
            around: around.map(|&around| (self.environment, around)),
        }
    }
}

impl Asked {
    /// Finds what arrives at the surfaces of chunk `number`. Samples of a lone area light are there already.
    pub fn find(
        &mut self,
        walk: &Walk,
        number: usize,
        places: &Places<LANES>,
        surfaces: Surfaces<LANES>,
    ) {
        if !matches!(walk.only, Some(Source::Area(_))) {
            walk.asked().for_each(|i| self.samples[i].clear());
            let choice = walk.choice_of_turn();
            let small = walk.lights.small_trees(choice);
            let normals = surfaces.normals(places);
            for (node, out) in small.iter().zip(&mut self.weights) {
                if let Some(node) = node {
                    vectorized(FindWeights {
                        node,
                        points: places.positions(),
                        normals: &normals,
                        out,
                    });
                }
            }
            let known = [0, 1].map(|i: usize| small[i].map(|_| &self.weights[i]));
            for lane in (0..LANES).filter(|&lane| surfaces.has(lane)) {
                let from = Reference {
                    position: places.position(lane),
                    normal: get(&normals, lane).into(),
                };
                let index = number * LANES + lane;
                let which = if walk.chosen {
                    self.which[index][1]
                } else {
                    0.0
                };
                let random = |i: usize| self.draws.of(i, index);
                let put = |i: usize, sample| self.samples[i].put(lane, Some(sample));
                let by = Askers {
                    from: &from,
                    known: known.map(|known| Some((known?, lane))),
                };
                walk.draw_samples(choice, &by, which, random, put);
            }
        }
        self.count = 0;
        for i in walk.asked() {
            // Numbers between these have nothing.
            for lit in &mut self.lit[self.count..i] {
                lit.any = [false; LANES];
            }
            vectorized(Light {
                places,
                samples: &self.samples[i],
                found: walk.found,
                surfaces,
                lit: &mut self.lit[i],
            });
            self.count = i + 1;
        }
    }

    /// Asks whether light arrives at a lane, which is of a path with this ray.
    #[inline(always)]
    pub fn ask(&self, lane: usize, ray: usize, shadows: &mut [Shadows]) {
        for (lit, shadows) in self.lit[..self.count].iter().zip(shadows) {
            if lit.any[lane] {
                shadows.ask(lit.shadow(lane), ray, get(&lit.light, lane).into());
            }
        }
    }

    /// The same where only a part of the light from a direction and an end arrives, or none.
    #[inline]
    pub fn ask_through(
        &self,
        lane: usize,
        ray: usize,
        shadows: &mut [Shadows],
        through: impl Fn(Vec3, DVec3) -> Vec3,
    ) {
        for (i, (lit, shadows)) in self.lit[..self.count].iter().zip(shadows).enumerate() {
            if lit.any[lane] {
                let samples = &self.samples[i];
                let end: DVec3 = vector(&samples.end, lane);
                let part = through(get(&samples.direction, lane).into(), end);
                if part != Vec3::ZERO {
                    let light = part * Vec3::from(get(&lit.light, lane));
                    shadows.ask(lit.shadow(lane), ray, light);
                }
            }
        }
    }
}

/// What may come from a light: whether anything, how much, and the shadow ray.
#[derive(Clone, Copy, Debug)]
struct Lit<const N: usize> {
    any: [bool; N],
    light: Three<f32, N>,
    start: Three<f32, N>,
    way: Three<f32, N>,
    t_max: [f32; N],
}

impl<const N: usize> Default for Lit<N> {
    fn default() -> Self {
        Self {
            any: [false; N],
            light: [[0.0; N]; 3],
            start: [[0.0; N]; 3],
            way: [[0.0; N]; 3],
            t_max: [0.0; N],
        }
    }
}

impl<const N: usize> Lit<N> {
    #[inline(always)]
    fn shadow(&self, lane: usize) -> Ray {
        Ray {
            origin: get(&self.start, lane),
            direction: get(&self.way, lane),
            t_max: self.t_max[lane],
        }
    }
}

/// Finds what one light brings to the paths.
struct Light<'a, const N: usize> {
    places: &'a Places<N>,
    samples: &'a LightSamples<N>,
    /// Whether scattered rays may find it too.
    found: bool,
    surfaces: Surfaces<'a, N>,
    lit: &'a mut Lit<N>,
}

impl<const N: usize> Loops for Light<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            samples,
            found,
            surfaces,
            lit: out,
        } = self;
        let mut lit = Lit::default();
        let values = surfaces.evaluate(places, &samples.direction);
        for lane in 0..N {
            let direction = Vec3::from(get(&samples.direction, lane));
            let radiance = Vec3::from(get(&samples.radiance, lane));
            let throughput = Vec3::from(get(&surfaces.arriving.throughput, lane));
            let (value, density) = (get(&values.value, lane), values.pdf[lane]);
            let pdf = samples.pdf[lane];
            let light = throughput * Vec3::from(value) * (radiance / pdf);
            let both = found & !samples.delta[lane];
            let light = light / if both { 1.0 + density / pdf } else { 1.0 };
            let start = places.start(lane, direction);
            let end: DVec3 = vector(&samples.end, lane);
            let way = (end - start).as_vec3();
            let infinite = end.x == f64::INFINITY;
            let way = if infinite { direction } else { way };
            lit.t_max[lane] = if infinite {
                f32::INFINITY
            } else {
                BEFORE_LIGHT
            };
            let Vec3 { x, y, z } = light;
            lit.any[lane] = (pdf > 0.0) & ((x != 0.0) | (y != 0.0) | (z != 0.0));
            set(&mut lit.light, lane, light.to_array());
            set(&mut lit.start, lane, start.as_vec3().to_array());
            set(&mut lit.way, lane, way.to_array());
        }
        *out = lit;
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::World;

    use super::*;
    use crate::bsdf::{FrostedPoints, GlossyPoints, Scattering};
    use crate::control::Control;
    use crate::integrator::batch::diffuse::tests::{alone, some, unit};
    use crate::integrator::batch::path_lanes::Arriving;
    use crate::light::LightSample;
    use crate::prepare::PreparedWorld;

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let mut lit = 0;
        let (glossies, frosted) = (GlossyPoints::default(), FrostedPoints::default());
        let world = PreparedWorld::new(&World::default(), None, None, &Control::new()).unwrap();
        for first in (0..320).step_by(LANES) {
            let (places, mattes, directions) = some(first);
            let mut arriving = Arriving::default();
            let mut samples = LightSamples::default();
            for lane in 0..LANES {
                let i = first + lane;
                set(&mut arriving.throughput, lane, unit(7 * i).abs().to_array());
                let sample = LightSample {
                    direction: unit(5 * i),
                    end: (i % 7 != 0).then_some(unit(5 * i).as_dvec3() * 3.0),
                    radiance: Vec3::new(3.0, 2.0, 1.0),
                    pdf: 0.1 + i as f32,
                    delta: i % 3 == 0,
                };
                samples.put(lane, (i % 5 != 0).then_some(sample));
            }
            let mut lanes = Lit::default();
            vectorized(Light {
                places: &places,
                samples: &samples,
                found: true,
                surfaces: Surfaces {
                    arriving: &arriving,
                    mattes: &mattes,
                    glossies: &glossies,
                    frosted: &frosted,
                    world: &world,
                },
                lit: &mut lanes,
            });
            for lane in 0..LANES {
                let place = places.place(lane);
                let matte = alone(&mattes, &directions, lane);
                let frame = place.frame(unit(first + lane));
                let alone = samples.at(lane).and_then(|sample| {
                    let scattered = matte.evaluate(&frame, sample.direction);
                    let throughput = Vec3::from(get(&arriving.throughput, lane));
                    let mut light = throughput * scattered.value * (sample.radiance / sample.pdf);
                    if !sample.delta {
                        light /= 1.0 + scattered.pdf / sample.pdf;
                    }
                    let ray = match sample.end {
                        None => place.leaving(sample.direction, f32::INFINITY),
                        Some(end) => Ray {
                            direction: (end - place.start(sample.direction)).as_vec3().to_array(),
                            ..place.leaving(sample.direction, BEFORE_LIGHT)
                        },
                    };
                    (light != Vec3::ZERO).then_some((ray, light))
                });
                let known = lanes.any[lane].then(|| {
                    let ray = Ray {
                        origin: get(&lanes.start, lane),
                        direction: get(&lanes.way, lane),
                        t_max: lanes.t_max[lane],
                    };
                    (ray, Vec3::from(get(&lanes.light, lane)))
                });
                assert_eq!(format!("{known:?}"), format!("{alone:?}"));
                lit += usize::from(alone.is_some());
            }
        }
        assert!(lit > 60, "{lit}");
    }
}
