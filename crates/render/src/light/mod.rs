//! Lights ready to shine: the closed set of [`raycam_scene::Light`] and the surfaces that shine, relative to the scene's
//! origin.
//!
//! A light without a mesh is seen where it has a size, but stands in nobody's way: rays pass through it and pick up its
//! radiance. What a ray picks up is the sum of
//!
//! * [`Lights::crossed`]: lights without a mesh between its start and what it meets,
//! * [`Lights::emitted`]: what the surface that it meets shines by itself,
//! * [`Lights::sky`]: what lies behind everything, where it meets nothing.
//!
//! [`Lights::sample`] draws a direction to any of these, and each of these says what density `sample` has for its
//! direction: that is all that multiple importance sampling needs (E. Veach, "Robust Monte Carlo Methods for Light
//! Transport Simulation", 1997, chapter 9).

mod bounds;
pub(crate) mod default_lights;
mod disk;
pub(crate) mod emissive_triangles;
mod environment;
pub(crate) mod environment_image;
pub(crate) mod equirect;
pub(crate) mod gradient_sky;
mod ies;
pub(crate) mod light_cull;
pub(crate) mod light_sampling;
pub(crate) mod point;
pub(crate) mod preetham;
pub(crate) mod prepared_light;
pub(crate) mod rectangle;
mod samples;
mod spot;
mod sun;
#[cfg(test)]
mod tests;
mod tree;

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::{Light, Up};

pub(crate) use crate::light::default_lights::default_lights;
use crate::light::emissive_triangles::Emissive;
use crate::light::light_cull::Sphere;
pub(crate) use crate::light::light_sampling::{Askers, Choice, MOST_AT_ONCE};
pub(crate) use crate::light::prepared_light::Source;
pub(crate) use crate::light::rectangle::SampleArea;
pub(crate) use crate::light::tree::importance::{FindWeights, Weights};
use crate::prepare::PreparedWorld;
use bounds::Bounds;
use environment::Environment;
pub(crate) use samples::{Around, Drawn, LightSamples};
use tree::{MOST_AT_A_POINT, Tree};

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reference {
    /// Scene-local.
    pub position: DVec3,
    /// Of unit length where light arrives on one side of a surface only, towards that side; else zero. It guides the
    /// choice alone: no light is lost for it.
    pub normal: Vec3,
}

/// A direction to a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    /// Of unit length.
    pub direction: Vec3,
    /// The scene-local point it comes from; `None` for infinitely far away.
    pub end: Option<DVec3>,
    /// What arrives if nothing stands in between: radiance; for a delta light irradiance on a surface that faces it.
    pub radiance: Vec3,
    /// The density of the direction by solid angle, times the probability that this light was chosen; for a delta light
    /// that probability alone. Greater than 0.
    pub pdf: f32,
    /// Whether its direction is the only one: nothing else finds this light.
    pub delta: bool,
}

/// Of one of those infinitely far away, by its number: its radiance out of a direction, and the density of sampling that.
pub(crate) type Known = (usize, (Vec3, f32));

/// A shadow ray ends this share before its light, which may lie on a surface.
pub(crate) const BEFORE_LIGHT: f32 = 1.0 - 1.0 / (1 << 16) as f32;

/// All lights of a world.
#[derive(Debug, Default)]
pub(crate) struct Lights {
    /// Lights without a mesh, in the order of the world.
    sources: Vec<Source>,
    /// The radiance of all even skies together, in the integrators that take it for an ambient term.
    pub ambient: Vec3,
    /// Which of `sources` are infinitely far, even skies last, and which are not.
    infinite: Vec<usize>,
    /// How many of `infinite` are no even skies.
    uneven: usize,
    finite: Vec<usize>,
    /// Which of `finite` rays may cross, and a sphere around each.
    crossable: Vec<(usize, Sphere)>,
    /// Which of `finite` to choose.
    tree: Tree,
    /// Surfaces that shine.
    surfaces: Emissive,
}

impl Lights {
    /// Lights without a mesh; surfaces that shine come with [`Lights::with_surfaces`].
    pub fn new(lights: &[Light], up: Up, origin: DVec3) -> Self {
        let sources: Vec<Source> = lights
            .iter()
            .flat_map(|light| Source::new(light, up, origin))
            .collect();
        let (mut infinite, finite): (Vec<_>, Vec<_>) =
            (0..sources.len()).partition(|&i| sources[i].is_infinite());
        let is_even = |source: &Source| matches!(source, Source::Sky(sky) if sky.is_even());
        infinite.sort_by_key(|&i| is_even(&sources[i]));
        let even = |source: &Source| match source {
            Source::Sky(sky) if sky.is_even() => sky.horizon,
            _ => Vec3::ZERO,
        };
        let bounds: Vec<Bounds> = finite.iter().map(|&i| sources[i].bounds()).collect();
        Self {
            ambient: sources.iter().map(even).sum(),
            tree: Tree::new(&bounds),
            crossable: finite
                .iter()
                .enumerate()
                .filter(|&(_, &i)| sources[i].is_found(false))
                .map(|(index, _)| (index, Sphere::around(&bounds[index])))
                .collect(),
            uneven: infinite.iter().filter(|&&i| !is_even(&sources[i])).count(),
            sources,
            infinite,
            finite,
            surfaces: Emissive::default(),
        }
    }

    /// The surfaces of a world that shine by themselves.
    pub fn with_surfaces(self, world: &PreparedWorld) -> Self {
        Self {
            surfaces: Emissive::new(world),
            ..self
        }
    }

    /// Whether any surface shines by itself.
    pub fn has_surfaces(&self) -> bool {
        !self.surfaces.is_empty()
    }

    /// Whether any has a place in the world and no mesh.
    pub fn has_finite(&self) -> bool {
        !self.finite.is_empty()
    }

    /// How many there are to choose from; all surfaces that shine count as one.
    pub fn count(&self) -> usize {
        self.sources.len() + usize::from(self.has_surfaces())
    }

    /// One light chosen for this point, and a direction to it. Lights infinitely far away count as one where their
    /// directions meet: their radiance and densities are sums. `by` knows what may matter to the point.
    pub fn sample(
        &self,
        by: &Askers,
        world: &PreparedWorld,
        choice: Choice,
        which: f32,
        drawn: &Drawn,
    ) -> Option<LightSample> {
        if let Some((_, around)) = drawn.around
            && self.is_alone(choice)
        {
            return (around.pdf > 0.0).then(|| around.sample());
        }
        let from = by.from;
        let odds = self.odds(from, choice);
        let mut which = f64::from(which);
        let infinite = odds.infinite * odds.sought as f64;
        if which < infinite {
            let index = ((which / odds.infinite) as usize).min(odds.sought - 1);
            return self.sample_infinite(from, choice, index, drawn);
        }
        which -= infinite;
        if which < odds.finite {
            let (light, probability) = self.choose(&by.finite(), choice, which / odds.finite)?;
            self.sample_finite(from, light, odds.finite * probability, drawn.random)
        } else if odds.surfaces > 0.0 {
            let which = ((which - odds.finite) / odds.surfaces).clamp(0.0, 1.0);
            self.sample_surfaces(world, by, odds.surfaces, which, drawn.random)
        } else {
            None
        }
    }

    /// Directions to all kinds of light, as [`Choice::Several`] says: tells of each with its number, for which `random` gives
    /// where on the light. `which` chooses within branches, `by` knows what may matter to the point.
    pub fn sample_each(
        &self,
        by: &Askers,
        world: &PreparedWorld,
        which: f32,
        random: impl Fn(usize) -> Drawn,
        mut tell: impl FnMut(usize, LightSample),
    ) {
        let (from, which) = (by.from, f64::from(which));
        let mut found = |index, sample: Option<LightSample>| {
            if let Some(sample) = sample {
                tell(index, sample);
            }
        };
        for index in 0..self.uneven {
            let sample = self.sample_infinite(from, Choice::Several, index, &random(index));
            found(index, sample);
        }
        self.tree
            .choose_many(&by.finite(), which, |index, light, expected| {
                let index = self.uneven + index;
                let sample = self.sample_finite(from, light, expected, random(index).random);
                found(index, sample);
            });
        if self.has_surfaces() {
            let index = self.uneven + MOST_AT_A_POINT;
            let sample = self.sample_surfaces(world, by, 1.0, which, random(index).random);
            found(index, sample);
        }
    }

    /// A direction to one of those infinitely far away.
    fn sample_infinite(
        &self,
        from: &Reference,
        choice: Choice,
        index: usize,
        drawn: &Drawn,
    ) -> Option<LightSample> {
        let mut sample = match drawn.around {
            Some((number, around)) if number == index => around.sample(),
            _ => self.sources[self.infinite[index]].sample(from, drawn.random)?,
        };
        if sample.delta {
            sample.pdf = self.odds(from, choice).infinite as f32;
        } else {
            let own = (index, (sample.radiance, sample.pdf));
            (sample.radiance, sample.pdf) = self.behind(from, choice, sample.direction, Some(own));
        }
        (sample.pdf > 0.0).then_some(sample)
    }

    /// A direction to one of `finite`, that is chosen with this probability or of which so many are expected.
    fn sample_finite(
        &self,
        from: &Reference,
        light: usize,
        probability: f64,
        random: [f32; 2],
    ) -> Option<LightSample> {
        let sample = self.sources[self.finite[light]].sample(from, random)?;
        sample.chosen(probability)
    }

    /// A direction to a surface that shines, where these are chosen with this probability.
    fn sample_surfaces(
        &self,
        world: &PreparedWorld,
        by: &Askers,
        probability: f64,
        which: f64,
        random: [f32; 2],
    ) -> Option<LightSample> {
        let sample = self.surfaces.sample(world, &by.surfaces(), which, random)?;
        sample.chosen(probability)
    }

    /// Whether rays that are scattered may find light that [`Lights::sample`] finds too; even skies do not count where
    /// they are an ambient term.
    pub fn is_found(&self, ambient: bool) -> bool {
        let found = |source: &Source| source.is_found(ambient);
        self.has_surfaces() || self.sources.iter().any(found)
    }

    /// Whether any has a size without being all around: what mirrors and lenses throw on other things.
    pub fn is_thrown(&self) -> bool {
        self.has_surfaces() || self.sources.iter().any(Source::is_thrown)
    }

    /// The radiance from infinitely far away, out of a direction of unit length: what a ray that meets nothing sees.
    /// `known` is what [`Source::behind`] says of one of those infinitely far away.
    pub fn sky(&self, direction: Vec3, known: Option<Known>) -> Vec3 {
        if self.uneven == 0 {
            return self.ambient;
        }
        let parts = self.infinite.iter().enumerate().map(|(number, &i)| {
            let (radiance, _) = match known {
                Some((known, own)) if known == number => own,
                _ => self.sources[i].behind(Vec3::ZERO, direction),
            };
            radiance
        });
        parts.sum()
    }

    /// What [`Lights::sky`] is where it is the same in all directions.
    pub fn even_sky(&self) -> Option<Vec3> {
        (self.uneven == 0).then(|| self.sky(Vec3::Z, None))
    }

    /// The same, and the density with which [`Lights::sample`] finds this direction for its sake.
    pub fn behind(
        &self,
        from: &Reference,
        choice: Choice,
        direction: Vec3,
        known: Option<Known>,
    ) -> (Vec3, f32) {
        if self.uneven == 0 && choice != Choice::Even {
            return (self.ambient, 0.0);
        }
        if let Some((_, own)) = known
            && self.is_alone(choice)
        {
            return own;
        }
        let odds = self.odds(from, choice);
        let (mut radiance, mut pdf) = (Vec3::ZERO, 0.0);
        for (number, &i) in self.infinite.iter().enumerate() {
            let (part, density) = match known {
                Some((known, own)) if known == number => own,
                _ => self.sources[i].behind(from.normal, direction),
            };
            radiance += part;
            if number < odds.sought {
                pdf += odds.infinite as f32 * density;
            }
        }
        (radiance, pdf)
    }

    /// The first image or clear sky all around, and its number among those infinitely far away.
    pub fn environment(&self) -> Option<(usize, &Environment)> {
        let mut uneven = self.infinite[..self.uneven].iter().enumerate();
        uneven.find_map(|(number, &i)| match &self.sources[i] {
            Source::Environment(environment) => Some((number, &**environment)),
            _ => None,
        })
    }

    /// What the surface at a hit shines by itself against `direction`, in W/(m² sr).
    pub fn emitted(&self, world: &PreparedWorld, hit: &Hit, direction: Vec3) -> Vec3 {
        world.emission(hit, direction)
    }

    /// The density with which [`Lights::sample`] finds this hit, `distance` away from `from`.
    pub fn emitted_pdf(
        &self,
        from: &Reference,
        choice: Choice,
        world: &PreparedWorld,
        hit: &Hit,
        direction: Vec3,
        distance: f64,
    ) -> f32 {
        let density = self.surfaces.density(world, from, hit, direction, distance);
        (self.odds(from, choice).surfaces * density) as f32
    }

    /// Tells of every light without a mesh that a ray from `from` picks up on its way of at most `distance`: where, its
    /// radiance, and the density with which [`Lights::sample`] finds it there.
    #[inline]
    pub fn crossed(
        &self,
        from: &Reference,
        choice: Choice,
        direction: Vec3,
        distance: f64,
        mut tell: impl FnMut(f64, Vec3, f32),
    ) {
        for &(index, sphere) in &self.crossable {
            if sphere.is_near(from.position, direction)
                && let Some((at, radiance, density)) =
                    self.sources[self.finite[index]].crossed(from.position, direction)
                && at * f64::from(BEFORE_LIGHT) <= distance
            {
                let odds = self.odds(from, choice).finite;
                let probability = self.probability(from, choice, index);
                tell(at, radiance, (odds * probability * density) as f32);
            }
        }
    }
}
