//! Lights ready to shine: the closed set of [`raycam_scene::Light`] and the surfaces that shine, relative to the scene's
//! origin.
//!
//! A light without a mesh is seen where it has a size, but stands in nobody's way: rays pass through it and pick up its
//! radiance. What a ray picks up is the sum of
//!
//! * [`Lights::intersect_visible`]: lights without a mesh between its start and what it meets,
//! * [`Lights::emission`]: what the surface that it meets shines by itself,
//! * [`Lights::escaped_radiance`]: what lies behind everything, where it meets nothing.
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
use crate::light::emissive_triangles::EmissiveTriangles;
use crate::light::light_cull::BoundingSphere;
pub(crate) use crate::light::light_sampling::{
    LightSampleContexts, LightSampling, MAX_SPLIT_SAMPLES,
};
pub(crate) use crate::light::prepared_light::PreparedLight;
pub(crate) use crate::light::rectangle::SampleRectangle;
pub(crate) use crate::light::tree::importance::{ComputeNodeImportances, NodeImportances};
use crate::prepare::PreparedWorld;
use bounds::LightBounds;
use environment::EnvironmentLight;
pub(crate) use samples::{EnvironmentSample, LightLiSamples, LightRandom};
use tree::{LightTree, MAX_SPLIT_LIGHTS};

/// A point that is lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleContext {
    /// Scene-local.
    pub position: DVec3,
    /// Of unit length where light arrives on one side of a surface only, towards that side; else zero. It guides the
    /// choice alone: no light is lost for it.
    pub normal: Vec3,
}

/// A direction to a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLiSample {
    /// Of unit length.
    pub direction: Vec3,
    /// The scene-local point it comes from; `None` for infinitely far away.
    pub p_light: Option<DVec3>,
    /// What arrives if nothing stands in between: radiance; for a delta light irradiance on a surface that faces it.
    pub radiance: Vec3,
    /// The density of the direction by solid angle, times the probability that this light was chosen; for a delta light
    /// that probability alone. Greater than 0.
    pub pdf: f32,
    /// Whether its direction is the only one: nothing else finds this light.
    pub is_delta: bool,
}

/// Of one of those infinitely far away, by its number: its radiance out of a direction, and the density of sampling that.
pub(crate) type EnvironmentLookup = (usize, (Vec3, f32));

/// A shadow ray ends this share before its light, which may lie on a surface.
pub(crate) const ONE_MINUS_SHADOW_EPSILON: f32 = 1.0 - 1.0 / (1 << 16) as f32;

/// All lights of a world.
#[derive(Debug, Default)]
pub(crate) struct Lights {
    /// Lights without a mesh, in the order of the world.
    lights: Vec<PreparedLight>,
    /// The radiance of all even skies together, in the integrators that take it for an ambient term.
    pub ambient: Vec3,
    /// Which of `lights` are infinitely far, even skies last, and which are not.
    infinite: Vec<usize>,
    /// How many of `infinite` are no even skies.
    non_constant_infinite: usize,
    finite: Vec<usize>,
    /// Which of `finite` rays may cross, and a sphere around each.
    intersectable: Vec<(usize, BoundingSphere)>,
    /// Which of `finite` to choose.
    tree: LightTree,
    /// Surfaces that shine.
    emissive_triangles: EmissiveTriangles,
}

impl Lights {
    /// Lights without a mesh; surfaces that shine come with [`Lights::with_emissive_triangles`].
    pub fn new(lights: &[Light], up: Up, origin: DVec3) -> Self {
        let sources: Vec<PreparedLight> = lights
            .iter()
            .flat_map(|light| PreparedLight::new(light, up, origin))
            .collect();
        let (mut infinite, finite): (Vec<_>, Vec<_>) =
            (0..sources.len()).partition(|&i| sources[i].is_infinite());
        let is_even = |source: &PreparedLight| matches!(source, PreparedLight::GradientSky(sky) if sky.is_constant());
        infinite.sort_by_key(|&i| is_even(&sources[i]));
        let even = |source: &PreparedLight| match source {
            PreparedLight::GradientSky(sky) if sky.is_constant() => sky.horizon,
            _ => Vec3::ZERO,
        };
        let bounds: Vec<LightBounds> = finite.iter().map(|&i| sources[i].bounds()).collect();
        Self {
            ambient: sources.iter().map(even).sum(),
            tree: LightTree::new(&bounds),
            intersectable: finite
                .iter()
                .enumerate()
                .filter(|&(_, &i)| sources[i].is_hittable(false))
                .map(|(index, _)| (index, BoundingSphere::enclosing(&bounds[index])))
                .collect(),
            non_constant_infinite: infinite.iter().filter(|&&i| !is_even(&sources[i])).count(),
            lights: sources,
            infinite,
            finite,
            emissive_triangles: EmissiveTriangles::default(),
        }
    }

    /// The surfaces of a world that shine by themselves.
    pub fn with_emissive_triangles(self, world: &PreparedWorld) -> Self {
        Self {
            emissive_triangles: EmissiveTriangles::new(world),
            ..self
        }
    }

    /// Whether any surface shines by itself.
    pub fn has_emissive_triangles(&self) -> bool {
        !self.emissive_triangles.is_empty()
    }

    /// Whether any has a place in the world and no mesh.
    pub fn has_finite(&self) -> bool {
        !self.finite.is_empty()
    }

    /// How many there are to choose from; all surfaces that shine count as one.
    pub fn count(&self) -> usize {
        self.lights.len() + usize::from(self.has_emissive_triangles())
    }

    /// One light chosen for this point, and a direction to it. Lights infinitely far away count as one where their
    /// directions meet: their radiance and densities are sums. `by` knows what may matter to the point.
    pub fn sample(
        &self,
        by: &LightSampleContexts,
        world: &PreparedWorld,
        choice: LightSampling,
        which: f32,
        drawn: &LightRandom,
    ) -> Option<LightLiSample> {
        if let Some((_, around)) = drawn.environment
            && self.is_single_infinite(choice)
        {
            return (around.pdf > 0.0).then(|| around.sample());
        }
        let from = by.from;
        let odds = self.kind_probabilities(from, choice);
        let mut which = f64::from(which);
        let infinite = odds.infinite * odds.infinite_count as f64;
        if which < infinite {
            let index = ((which / odds.infinite) as usize).min(odds.infinite_count - 1);
            return self.sample_infinite(from, choice, index, drawn);
        }
        which -= infinite;
        if which < odds.finite {
            let (light, probability) =
                self.choose_finite(&by.finite(), choice, which / odds.finite)?;
            self.sample_finite(from, light, odds.finite * probability, drawn.random)
        } else if odds.emissive > 0.0 {
            let which = ((which - odds.finite) / odds.emissive).clamp(0.0, 1.0);
            self.sample_emissive_triangles(world, by, odds.emissive, which, drawn.random)
        } else {
            None
        }
    }

    /// Directions to all kinds of light, as [`LightSampling::Split`] says: tells of each with its number, for which `random` gives
    /// where on the light. `which` chooses within branches, `by` knows what may matter to the point.
    pub fn sample_split(
        &self,
        by: &LightSampleContexts,
        world: &PreparedWorld,
        which: f32,
        random: impl Fn(usize) -> LightRandom,
        mut tell: impl FnMut(usize, LightLiSample),
    ) {
        let (from, which) = (by.from, f64::from(which));
        let mut found = |index, sample: Option<LightLiSample>| {
            if let Some(sample) = sample {
                tell(index, sample);
            }
        };
        for index in 0..self.non_constant_infinite {
            let sample = self.sample_infinite(from, LightSampling::Split, index, &random(index));
            found(index, sample);
        }
        self.tree
            .sample_split(&by.finite(), which, |index, light, expected| {
                let index = self.non_constant_infinite + index;
                let sample = self.sample_finite(from, light, expected, random(index).random);
                found(index, sample);
            });
        if self.has_emissive_triangles() {
            let index = self.non_constant_infinite + MAX_SPLIT_LIGHTS;
            let sample =
                self.sample_emissive_triangles(world, by, 1.0, which, random(index).random);
            found(index, sample);
        }
    }

    /// A direction to one of those infinitely far away.
    fn sample_infinite(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        index: usize,
        drawn: &LightRandom,
    ) -> Option<LightLiSample> {
        let mut sample = match drawn.environment {
            Some((number, around)) if number == index => around.sample(),
            _ => self.lights[self.infinite[index]].sample(from, drawn.random)?,
        };
        if sample.is_delta {
            sample.pdf = self.kind_probabilities(from, choice).infinite as f32;
        } else {
            let own = (index, (sample.radiance, sample.pdf));
            (sample.radiance, sample.pdf) =
                self.radiance_and_pdf(from, choice, sample.direction, Some(own));
        }
        (sample.pdf > 0.0).then_some(sample)
    }

    /// A direction to one of `finite`, that is chosen with this probability or of which so many are expected.
    fn sample_finite(
        &self,
        from: &LightSampleContext,
        light: usize,
        probability: f64,
        random: [f32; 2],
    ) -> Option<LightLiSample> {
        let sample = self.lights[self.finite[light]].sample(from, random)?;
        sample.with_selection_pdf(probability)
    }

    /// A direction to a surface that shines, where these are chosen with this probability.
    fn sample_emissive_triangles(
        &self,
        world: &PreparedWorld,
        by: &LightSampleContexts,
        probability: f64,
        which: f64,
        random: [f32; 2],
    ) -> Option<LightLiSample> {
        let sample =
            self.emissive_triangles
                .sample(world, &by.emissive_triangles(), which, random)?;
        sample.with_selection_pdf(probability)
    }

    /// Whether rays that are scattered may find light that [`Lights::sample`] finds too; even skies do not count where
    /// they are an ambient term.
    pub fn is_hittable(&self, ambient: bool) -> bool {
        let found = |source: &PreparedLight| source.is_hittable(ambient);
        self.has_emissive_triangles() || self.lights.iter().any(found)
    }

    /// Whether any has a size without being all around: what mirrors and lenses throw on other things.
    pub fn can_cast_caustics(&self) -> bool {
        self.has_emissive_triangles() || self.lights.iter().any(PreparedLight::can_cast_caustics)
    }

    /// The radiance from infinitely far away, out of a direction of unit length: what a ray that meets nothing sees.
    /// `known` is what [`PreparedLight::radiance_and_pdf`] says of one of those infinitely far away.
    pub fn escaped_radiance(&self, direction: Vec3, known: Option<EnvironmentLookup>) -> Vec3 {
        if self.non_constant_infinite == 0 {
            return self.ambient;
        }
        let parts = self.infinite.iter().enumerate().map(|(number, &i)| {
            let (radiance, _) = match known {
                Some((known, own)) if known == number => own,
                _ => self.lights[i].radiance_and_pdf(Vec3::ZERO, direction),
            };
            radiance
        });
        parts.sum()
    }

    /// What [`Lights::escaped_radiance`] is where it is the same in all directions.
    pub fn constant_environment(&self) -> Option<Vec3> {
        (self.non_constant_infinite == 0).then(|| self.escaped_radiance(Vec3::Z, None))
    }

    /// The same, and the density with which [`Lights::sample`] finds this direction for its sake.
    pub fn radiance_and_pdf(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        direction: Vec3,
        known: Option<EnvironmentLookup>,
    ) -> (Vec3, f32) {
        if self.non_constant_infinite == 0 && choice != LightSampling::Uniform {
            return (self.ambient, 0.0);
        }
        if let Some((_, own)) = known
            && self.is_single_infinite(choice)
        {
            return own;
        }
        let odds = self.kind_probabilities(from, choice);
        let (mut radiance, mut pdf) = (Vec3::ZERO, 0.0);
        for (number, &i) in self.infinite.iter().enumerate() {
            let (part, density) = match known {
                Some((known, own)) if known == number => own,
                _ => self.lights[i].radiance_and_pdf(from.normal, direction),
            };
            radiance += part;
            if number < odds.infinite_count {
                pdf += odds.infinite as f32 * density;
            }
        }
        (radiance, pdf)
    }

    /// The first image or clear sky all around, and its number among those infinitely far away.
    pub fn environment(&self) -> Option<(usize, &EnvironmentLight)> {
        let mut uneven = self.infinite[..self.non_constant_infinite]
            .iter()
            .enumerate();
        uneven.find_map(|(number, &i)| match &self.lights[i] {
            PreparedLight::Environment(environment) => Some((number, &**environment)),
            _ => None,
        })
    }

    /// What the surface at a hit shines by itself against `direction`, in W/(m² sr).
    pub fn emission(&self, world: &PreparedWorld, hit: &Hit, direction: Vec3) -> Vec3 {
        world.emission(hit, direction)
    }

    /// The density with which [`Lights::sample`] finds this hit, `distance` away from `from`.
    pub fn emission_pdf(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        world: &PreparedWorld,
        hit: &Hit,
        direction: Vec3,
        distance: f64,
    ) -> f32 {
        let density = self
            .emissive_triangles
            .pdf(world, from, hit, direction, distance);
        (self.kind_probabilities(from, choice).emissive * density) as f32
    }

    /// Tells of every light without a mesh that a ray from `from` picks up on its way of at most `distance`: where, its
    /// radiance, and the density with which [`Lights::sample`] finds it there.
    #[inline]
    pub fn intersect_visible(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        direction: Vec3,
        distance: f64,
        mut tell: impl FnMut(f64, Vec3, f32),
    ) {
        for &(index, sphere) in &self.intersectable {
            if sphere.may_intersect(from.position, direction)
                && let Some((at, radiance, density)) =
                    self.lights[self.finite[index]].intersect(from.position, direction)
                && at * f64::from(ONE_MINUS_SHADOW_EPSILON) <= distance
            {
                let odds = self.kind_probabilities(from, choice).finite;
                let probability = self.finite_pmf(from, choice, index);
                tell(at, radiance, (odds * probability * density) as f32);
            }
        }
    }
}
