//! Light sampling: selection of a light, samples towards it, and the densities that multiple importance sampling
//! requires.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::interaction::LightSampleContext;
use crate::light::lights::Lights;
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{EnvironmentLookup, LightLiSample, LightRandom, ONE_MINUS_SHADOW_EPSILON};
use crate::light::tree::importance::{LightTreeContext, NodeImportances};
use crate::light::tree::node::{Child, LightTreeNode};
use crate::light::tree::{MAX_SPLIT_LIGHTS, RecentNodes};
use crate::prepare::geometry::Geometry;

/// Strategy of light selection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightSampling {
    /// One light, by its importance at the point.
    Importance,
    /// One light, uniformly: [`Lights::count`] stratified samples select each light once. Emissive triangles count as
    /// one light.
    Uniform,
    /// Samples of every infinite light, several finite lights and an emissive triangle; see [`Lights::sample_split`].
    Split,
}

/// Light to which a light sample belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampledLight {
    /// Index among the infinite lights. The radiance of overlapping infinite lights is included.
    Infinite(usize),
    /// Index among the finite lights.
    Finite(usize),
    /// The sample is on an emissive triangle.
    Surfaces,
}

/// Maximum number of samples that [`Lights::sample_split`] returns.
pub(crate) const MAX_SPLIT_SAMPLES: usize = 2 * MAX_SPLIT_LIGHTS + 1;

/// Point for which lights are sampled, with known importances of light tree nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSampleContexts<'a> {
    pub from: &'a LightSampleContext,
    /// Node importances and lane for finite lights and for emissive triangles; see [`Lights::single_node_trees`].
    pub importances: [Option<(&'a NodeImportances, usize)>; 2],
}

impl<'a> From<&'a LightSampleContext> for LightSampleContexts<'a> {
    fn from(from: &'a LightSampleContext) -> Self {
        Self { from, importances: [None; 2] }
    }
}

impl<'a> LightSampleContexts<'a> {
    pub(crate) fn finite(&self) -> LightTreeContext<'a> {
        LightTreeContext { from: self.from, importances: self.importances[0] }
    }

    pub(crate) fn emissive_triangles(&self) -> LightTreeContext<'a> {
        LightTreeContext { from: self.from, importances: self.importances[1] }
    }
}

/// Selection probabilities by kind of light. Their sum is 1, unless every kind is sampled.
pub(crate) struct KindProbabilities {
    /// Number of infinite lights that can be selected.
    pub infinite_count: usize,
    /// Probability of each infinite light.
    pub infinite: f64,
    /// Probability that a finite light without a mesh is selected.
    pub finite: f64,
    /// Probability that an emissive triangle is selected.
    pub emissive: f64,
}

impl Lights {
    /// True if [`Lights::sample`] can return a sample.
    pub fn has_light_samples(&self, choice: LightSampling) -> bool {
        choice == LightSampling::Uniform
            || self.non_constant_infinite > 0
            || !self.tree.is_empty()
            || self.has_emissive_triangles()
    }

    /// True if [`Lights::sample`] uses the random number that selects a light.
    pub fn needs_choice(&self, choice: LightSampling) -> bool {
        match choice {
            LightSampling::Uniform => self.count() > 1 || self.has_emissive_triangles(),
            LightSampling::Importance | LightSampling::Split => {
                self.has_emissive_triangles() || self.non_constant_infinite + self.tree.count() > 1
            }
        }
    }

    /// The only light that [`Lights::sample`] can select; `None` if there are several lights.
    pub fn single_light(&self, choice: LightSampling) -> Option<&PreparedLight> {
        let one = self.non_constant_infinite == 0 && self.tree.count() == 1 && !self.has_emissive_triangles();
        let [Child::Light(light)] = *self.tree.only_node()?.children() else {
            return None;
        };
        let only = &self.lights[self.finite[light as usize]];
        (one && choice == LightSampling::Importance).then_some(only)
    }

    /// True if the world has exactly one light, which is infinite and not constant.
    pub(crate) fn is_single_infinite(&self, choice: LightSampling) -> bool {
        let one = self.non_constant_infinite == 1 && self.infinite.len() == 1 && self.finite.is_empty();
        one && choice == LightSampling::Importance && !self.has_emissive_triangles()
    }

    /// Number of indices of [`Lights::sample_split`]; `None` if the world has fewer than two lights or too
    /// many infinite lights.
    pub fn max_split_samples(&self) -> Option<usize> {
        let several = self.non_constant_infinite + self.tree.count() + usize::from(self.has_emissive_triangles()) > 1;
        (several && self.non_constant_infinite <= MAX_SPLIT_LIGHTS)
            .then_some(self.non_constant_infinite + MAX_SPLIT_LIGHTS + 1)
    }

    /// True if [`Lights::sample_split`] samples every finite light without a mesh, instead of selecting some of them.
    pub fn has_few_finite(&self) -> bool {
        self.tree.count() <= MAX_SPLIT_LIGHTS
    }

    /// Light without a mesh to which all samples with this index of [`Lights::sample_split`] belong; `None` if the light
    /// depends on the point.
    pub fn light_of_index(&self, index: usize) -> Option<&PreparedLight> {
        match index.checked_sub(self.non_constant_infinite) {
            None => Some(&self.lights[self.infinite[index]]),
            Some(index) => Some(&self.lights[self.finite[self.tree.light_of_index(index)?]]),
        }
    }

    /// Roots of light trees that consist of one node with several children, for finite lights and for emissive
    /// triangles. The importances of such a node can be computed for a batch of points.
    pub fn single_node_trees(&self, choice: LightSampling) -> [Option<&LightTreeNode>; 2] {
        let uses_tree = match choice {
            LightSampling::Importance => true,
            LightSampling::Uniform => false,
            LightSampling::Split => !self.has_few_finite(),
        };
        let finite = self.tree.only_node().filter(|_| uses_tree);
        [finite, self.emissive_triangles.tree().only_node()].map(|node| node.filter(|node| node.children().len() > 1))
    }

    /// True if [`Lights::sample_split`] may return a sample with this index.
    pub fn may_use_index(&self, index: usize) -> bool {
        let surfaces = self.non_constant_infinite + MAX_SPLIT_LIGHTS;
        index < self.non_constant_infinite + self.tree.count().min(MAX_SPLIT_LIGHTS)
            || (index == surfaces && self.has_emissive_triangles())
    }

    /// Selects a finite light by a number in 0..1; returns the light's index and probability.
    pub(crate) fn choose_finite(
        &self,
        from: &LightTreeContext,
        choice: LightSampling,
        number: f64,
        recent: Option<&mut RecentNodes>,
    ) -> Option<(usize, f64)> {
        if choice == LightSampling::Uniform {
            let count = self.finite.len();
            let index = (number * count as f64) as usize;
            return Some((index.min(count - 1), 1.0 / count as f64));
        }
        self.tree.sample(from, number, recent)
    }

    /// Probability of selecting a finite light among the finite lights, or its expected count if several lights are
    /// selected.
    pub(crate) fn finite_pmf(&self, from: &LightSampleContext, choice: LightSampling, light: usize) -> f64 {
        match choice {
            LightSampling::Importance => self.tree.pmf(&from.into(), light),
            LightSampling::Uniform => 1.0 / self.finite.len() as f64,
            LightSampling::Split => self.tree.expected_count(&from.into(), light),
        }
    }

    /// Selection probabilities of each kind of light at a point.
    pub(crate) fn kind_probabilities(&self, from: &LightSampleContext, choice: LightSampling) -> KindProbabilities {
        let (near, has_emissive) = (!self.tree.is_empty(), self.has_emissive_triangles());
        match choice {
            LightSampling::Uniform => {
                let one = 1.0 / self.count().max(1) as f64;
                KindProbabilities {
                    infinite_count: self.infinite.len(),
                    infinite: one,
                    finite: one * self.finite.len() as f64,
                    emissive: if has_emissive { one } else { 0.0 },
                }
            }
            LightSampling::Split => KindProbabilities {
                infinite_count: self.non_constant_infinite,
                infinite: 1.0,
                finite: 1.0,
                emissive: 1.0,
            },
            LightSampling::Importance => {
                // BSDF samples find constant skies as efficiently as light samples.
                let infinite_count = self.non_constant_infinite;
                if infinite_count == 0 && !(near && has_emissive) {
                    return KindProbabilities {
                        infinite_count,
                        infinite: 0.0,
                        finite: f64::from(u8::from(near)),
                        emissive: f64::from(u8::from(has_emissive)),
                    };
                }
                // The amount of light from infinite lights is unknown, so each infinite light is selected as often as
                // all finite lights together.
                let near = [self.tree.importance(from), self.emissive_triangles.importance(from)];
                let total = near[0] + near[1];
                let groups = infinite_count + usize::from(total > 0.0);
                let one = 1.0 / groups.max(1) as f64;
                let [finite, surfaces] = near.map(|part| if total > 0.0 { one * part / total } else { 0.0 });
                KindProbabilities { infinite_count, infinite: one, finite, emissive: surfaces }
            }
        }
    }

    /// Samples one light. Overlapping infinite lights count as one light: their radiances and densities are summed.
    /// `by` contains the point and known importances.
    #[inline]
    pub fn sample(
        &self,
        by: &LightSampleContexts,
        world: &Geometry,
        choice: LightSampling,
        which: f32,
        drawn: &LightRandom,
    ) -> Option<LightLiSample> {
        self.sample_with_light(by, world, choice, which, drawn, None).map(|(sample, _)| sample)
    }

    /// Same as [`Lights::sample`], but also returns the light. For several samples at the same point, `recent` contains
    /// the recent nodes of the light trees over finite lights and over emissive triangles.
    #[inline]
    pub fn sample_with_light(
        &self,
        by: &LightSampleContexts,
        world: &Geometry,
        choice: LightSampling,
        which: f32,
        drawn: &LightRandom,
        recent: Option<&mut [RecentNodes; 2]>,
    ) -> Option<(LightLiSample, SampledLight)> {
        if let Some((index, around)) = drawn.environment
            && self.is_single_infinite(choice)
        {
            return (around.pdf > 0.0).then(|| (around.sample(), SampledLight::Infinite(index)));
        }
        let from = by.from;
        let kinds = self.kind_probabilities(from, choice);
        let [recent_finite, recent_emissive] = recent.map_or([None, None], |nodes| nodes.each_mut().map(Some));
        let mut which = f64::from(which);
        let infinite = kinds.infinite * kinds.infinite_count as f64;
        if which < infinite {
            let index = ((which / kinds.infinite) as usize).min(kinds.infinite_count - 1);
            return Some((self.sample_infinite(from, choice, index, drawn)?, SampledLight::Infinite(index)));
        }
        which -= infinite;
        if which < kinds.finite {
            let (light, probability) = self.choose_finite(&by.finite(), choice, which / kinds.finite, recent_finite)?;
            let sample = self.sample_finite(from, light, kinds.finite * probability, drawn.random)?;
            Some((sample, SampledLight::Finite(light)))
        } else if kinds.emissive > 0.0 {
            let which = ((which - kinds.finite) / kinds.emissive).clamp(0.0, 1.0);
            let by = by.emissive_triangles();
            let sample = self.emissive_triangles.sample(world, &by, which, drawn.random, recent_emissive)?;
            let sample = sample.with_selection_pdf(kinds.emissive)?;
            Some((sample, SampledLight::Surfaces))
        } else {
            None
        }
    }

    /// Selects a finite light without a mesh for a ray near to a point; returns the light's index and probability.
    pub fn choose_finite_at(&self, chooser: &LightSampleContext, number: f32) -> Option<(usize, f64)> {
        self.tree.sample(&chooser.into(), f64::from(number), None)
    }

    /// Probability with which [`Lights::choose_finite_at`] selects a light.
    pub fn finite_probability_at(&self, chooser: &LightSampleContext, light: usize) -> f64 {
        self.tree.pmf(&chooser.into(), light)
    }

    /// Probability with which [`Lights::sample`] selects a finite light without a mesh.
    pub fn finite_probability(&self, from: &LightSampleContext, choice: LightSampling, light: usize) -> f64 {
        self.kind_probabilities(from, choice).finite * self.finite_pmf(from, choice, light)
    }

    /// Returns the scene-local centre of a finite light without a mesh.
    pub fn center_of_finite(&self, light: usize) -> DVec3 {
        let bounds = self.lights[self.finite[light]].bounds();
        (bounds.lower.as_dvec3() + bounds.upper.as_dvec3()) / 2.0
    }

    /// Samples a finite light without a mesh, for any probability of its selection.
    pub fn sample_finite_light(
        &self,
        from: &LightSampleContext,
        light: usize,
        random: [f32; 2],
    ) -> Option<LightLiSample> {
        self.sample_finite(from, light, 1.0, random)
    }

    /// Samples every kind of light ([`LightSampling::Split`]) and reports each sample with its index and its light.
    /// `random` returns the random numbers of an index, or `None` if no sample with this index is required; `which`
    /// selects lights within a kind.
    pub fn sample_split(
        &self,
        by: &LightSampleContexts,
        world: &Geometry,
        which: f32,
        random: impl Fn(usize) -> Option<LightRandom>,
        mut report: impl FnMut(usize, LightLiSample, SampledLight),
    ) {
        let (from, which) = (by.from, f64::from(which));
        let mut found = |index, sample: Option<LightLiSample>, light| {
            if let Some(sample) = sample {
                report(index, sample, light);
            }
        };
        for index in 0..self.non_constant_infinite {
            let sample = |random| self.sample_infinite(from, LightSampling::Split, index, &random);
            found(index, random(index).and_then(sample), SampledLight::Infinite(index));
        }
        self.tree.sample_split(&by.finite(), which, |index, light, expected| {
            let index = self.non_constant_infinite + index;
            let sample = |LightRandom { random, .. }| self.sample_finite(from, light, expected, random);
            found(index, random(index).and_then(sample), SampledLight::Finite(light));
        });
        let index = self.non_constant_infinite + MAX_SPLIT_LIGHTS;
        if self.has_emissive_triangles()
            && let Some(LightRandom { random, .. }) = random(index)
        {
            let by = by.emissive_triangles();
            let sample = self.emissive_triangles.sample(world, &by, which, random, None);
            found(index, sample, SampledLight::Surfaces);
        }
    }

    /// Samples an infinite light.
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
            (sample.radiance, sample.pdf) = self.radiance_and_pdf(from, choice, sample.direction, Some(own));
        }
        (sample.pdf > 0.0).then_some(sample)
    }

    /// Samples a finite light that was selected with this probability or expected count.
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

    /// Radiance of the infinite lights from a direction, and the density with which [`Lights::sample`]
    /// samples this direction.
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
        let kinds = self.kind_probabilities(from, choice);
        let (mut radiance, mut pdf) = (Vec3::ZERO, 0.0);
        for (number, &i) in self.infinite.iter().enumerate() {
            let (part, density) = match known {
                Some((known, own)) if known == number => own,
                _ => self.lights[i].radiance_and_pdf(from.normal, direction),
            };
            radiance += part;
            if number < kinds.infinite_count {
                pdf += kinds.infinite as f32 * density;
            }
        }
        (radiance, pdf)
    }

    /// Density with which [`Lights::sample`] samples the direction to this hit, at this distance.
    pub fn emission_pdf(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        world: &Geometry,
        hit: &Hit,
        direction: Vec3,
        distance: f64,
    ) -> f32 {
        let density = self.emissive_triangles.pdf(world, from, hit, direction, distance);
        (self.kind_probabilities(from, choice).emissive * density) as f32
    }

    /// Reports every light without a mesh that a ray crosses within `distance`: its index among the finite
    /// lights, the distance to it, its radiance, and the density with which [`Lights::sample`] samples the
    /// ray's direction for it.
    #[inline]
    pub fn intersect_visible(
        &self,
        from: &LightSampleContext,
        choice: LightSampling,
        direction: Vec3,
        distance: f64,
        mut report: impl FnMut(usize, f64, Vec3, f32),
    ) {
        for &(index, sphere) in &self.intersectable {
            if sphere.may_intersect(from.position, direction)
                && let Some((at, radiance, density)) =
                    self.lights[self.finite[index]].intersect(from.position, direction)
                && at * f64::from(ONE_MINUS_SHADOW_EPSILON) <= distance
            {
                let kinds = self.kind_probabilities(from, choice).finite;
                let probability = self.finite_pmf(from, choice, index);
                report(index, at, radiance, (kinds * probability * density) as f32);
            }
        }
    }
}
