//! Which light to sample: how often each kind of them is chosen, and how often each light.

use glam::Vec3;
use raycam_bvh::Hit;

use crate::interaction::LightSampleContext;
use crate::light::lights::Lights;
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{
    EnvironmentLookup, LightLiSample, LightRandom, ONE_MINUS_SHADOW_EPSILON,
};
use crate::light::tree::MAX_SPLIT_LIGHTS;
use crate::light::tree::importance::{LightTreeContext, NodeImportances};
use crate::light::tree::node::{Child, LightTreeNode};
use crate::prepare::geometry::Geometry;

/// How often each light is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightSampling {
    /// By how much it may matter to the point that is lit.
    Importance,
    /// As often as any other: asked for [`Lights::count`] samples with evenly spread numbers, each once. Surfaces that
    /// shine count as one.
    Uniform,
    /// Each of those infinitely far away, some of the others, and surfaces that shine: by [`Lights::sample_each`].
    Split,
}

/// The most directions that [`Lights::sample_each`] tells of.
pub(crate) const MAX_SPLIT_SAMPLES: usize = 2 * MAX_SPLIT_LIGHTS + 1;

/// A point that is lit, and what is known of the trees over lights there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleContexts<'a> {
    pub from: &'a LightSampleContext,
    /// Of lights without a mesh, and of surfaces that shine; see [`Lights::single_node_trees`].
    pub importances: [Option<(&'a NodeImportances, usize)>; 2],
}

impl<'a> From<&'a LightSampleContext> for LightSampleContexts<'a> {
    fn from(from: &'a LightSampleContext) -> Self {
        Self {
            from,
            importances: [None; 2],
        }
    }
}

impl<'a> LightSampleContexts<'a> {
    pub(crate) fn finite(&self) -> LightTreeContext<'a> {
        LightTreeContext {
            from: self.from,
            importances: self.importances[0],
        }
    }

    pub(crate) fn emissive_triangles(&self) -> LightTreeContext<'a> {
        LightTreeContext {
            from: self.from,
            importances: self.importances[1],
        }
    }
}

/// Probabilities that add up to 1 over all lights, unless each kind is sampled.
pub(crate) struct KindProbabilities {
    /// How many of those infinitely far away are chosen at all.
    pub infinite_count: usize,
    /// Of each of them.
    pub infinite: f64,
    /// Of all others without a mesh together.
    pub finite: f64,
    /// Of all surfaces that shine together.
    pub emissive: f64,
}

impl Lights {
    /// Whether [`Lights::sample`] ever finds anything.
    pub fn has_light_samples(&self, choice: LightSampling) -> bool {
        choice == LightSampling::Uniform
            || self.non_constant_infinite > 0
            || !self.tree.is_empty()
            || self.has_emissive_triangles()
    }

    /// Whether [`Lights::sample`] needs the first of its numbers, which chooses among lights.
    pub fn needs_choice(&self, choice: LightSampling) -> bool {
        match choice {
            LightSampling::Uniform => self.count() > 1,
            LightSampling::Importance | LightSampling::Split => {
                self.has_emissive_triangles() || self.non_constant_infinite + self.tree.count() > 1
            }
        }
    }

    /// The light that [`Lights::sample`] always chooses, where there is one.
    pub fn single_light(&self, choice: LightSampling) -> Option<&PreparedLight> {
        let one = self.non_constant_infinite == 0
            && self.tree.count() == 1
            && !self.has_emissive_triangles();
        let [Child::Light(light)] = *self.tree.only_node()?.children() else {
            return None;
        };
        let only = &self.lights[self.finite[light as usize]];
        (one && choice == LightSampling::Importance).then_some(only)
    }

    /// Whether the only light is one that is infinitely far away and uneven: then there is nothing to choose.
    pub(crate) fn is_single_infinite(&self, choice: LightSampling) -> bool {
        let one =
            self.non_constant_infinite == 1 && self.infinite.len() == 1 && self.finite.is_empty();
        one && choice == LightSampling::Importance && !self.has_emissive_triangles()
    }

    /// The most directions that [`Lights::sample_each`] tells of, if there is more than one kind of light to tell apart and
    /// not too much of what is infinitely far away.
    pub fn max_split_samples(&self) -> Option<usize> {
        let several = self.non_constant_infinite
            + self.tree.count()
            + usize::from(self.has_emissive_triangles())
            > 1;
        (several && self.non_constant_infinite <= MAX_SPLIT_LIGHTS)
            .then_some(self.non_constant_infinite + MAX_SPLIT_LIGHTS + 1)
    }

    /// What [`LightSampleContexts::importances`] takes for many points at a time: of lights without a mesh and of surfaces that shine, the node
    /// that is all of the tree over them, where there is something to choose in it.
    pub fn single_node_trees(&self, choice: LightSampling) -> [Option<&LightTreeNode>; 2] {
        let finite = self
            .tree
            .only_node()
            .filter(|_| choice != LightSampling::Uniform);
        [finite, self.emissive_triangles.tree().only_node()]
            .map(|node| node.filter(|node| node.children().len() > 1))
    }

    /// Whether [`Lights::sample_each`] may tell of a direction with this number.
    pub fn may_use_index(&self, index: usize) -> bool {
        let surfaces = self.non_constant_infinite + MAX_SPLIT_LIGHTS;
        index < self.non_constant_infinite + self.tree.count().min(MAX_SPLIT_LIGHTS)
            || (index == surfaces && self.has_emissive_triangles())
    }

    /// One of the lights without a mesh that are not infinitely far away, by a number in 0..1, and its probability.
    pub(crate) fn choose_finite(
        &self,
        from: &LightTreeContext,
        choice: LightSampling,
        number: f64,
    ) -> Option<(usize, f64)> {
        if choice == LightSampling::Uniform {
            let count = self.finite.len();
            let index = (number * count as f64) as usize;
            return Some((index.min(count - 1), 1.0 / count as f64));
        }
        self.tree.sample(from, number)
    }

    /// The probability with which such a light is chosen among them, or how many of it are expected.
    pub(crate) fn finite_pmf(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        light: usize,
    ) -> f64 {
        match choice {
            LightSampling::Importance => self.tree.pmf(&from.into(), light),
            LightSampling::Uniform => 1.0 / self.finite.len() as f64,
            LightSampling::Split => self.tree.expected_count(&from.into(), light),
        }
    }

    /// With which probability each kind of light is chosen.
    pub(crate) fn kind_probabilities(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
    ) -> KindProbabilities {
        let (near, shining) = (!self.tree.is_empty(), self.has_emissive_triangles());
        match choice {
            LightSampling::Uniform => {
                let one = 1.0 / self.count().max(1) as f64;
                KindProbabilities {
                    infinite_count: self.infinite.len(),
                    infinite: one,
                    finite: one * self.finite.len() as f64,
                    emissive: if shining { one } else { 0.0 },
                }
            }
            LightSampling::Split => KindProbabilities {
                infinite_count: self.non_constant_infinite,
                infinite: 1.0,
                finite: 1.0,
                emissive: 1.0,
            },
            LightSampling::Importance => {
                // Scattered rays find even skies as well as any sample would.
                let sought = self.non_constant_infinite;
                if sought == 0 && !(near && shining) {
                    return KindProbabilities {
                        infinite_count: sought,
                        infinite: 0.0,
                        finite: f64::from(u8::from(near)),
                        emissive: f64::from(u8::from(shining)),
                    };
                }
                // Nothing says how much of what is infinitely far away arrives: each is as likely as all that is near.
                let near = [
                    self.tree.importance(from),
                    self.emissive_triangles.importance(from),
                ];
                let total = near[0] + near[1];
                let groups = sought + usize::from(total > 0.0);
                let one = 1.0 / groups.max(1) as f64;
                let [finite, surfaces] =
                    near.map(|part| if total > 0.0 { one * part / total } else { 0.0 });
                KindProbabilities {
                    infinite_count: sought,
                    infinite: one,
                    finite,
                    emissive: surfaces,
                }
            }
        }
    }

    /// One light chosen for this point, and a direction to it. Lights infinitely far away count as one where their
    /// directions meet: their radiance and densities are sums. `by` knows what may matter to the point.
    pub fn sample(
        &self,
        by: &LightSampleContexts,
        world: &Geometry,
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
        world: &Geometry,
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
        world: &Geometry,
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

    /// The density with which [`Lights::sample`] finds this hit, `distance` away from `from`.
    pub fn emission_pdf(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        world: &Geometry,
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
