//! Sampling of layers: a lobe is chosen in proportion to its albedo, then a direction of that lobe.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::BsdfSample;
use crate::bsdf::exact_interface::sample_interface;
use crate::bsdf::layered::{
    COAT, DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION, LOBE_COUNT, LayeredBsdf, REFRACTION, SPECULAR, reflect_probability,
};
use crate::lobes::fresnel::{reflect, refract};
use crate::lobes::mean_color::mean;
use crate::lobes::shading_frame::{ShadingFrame, sample_cosine_hemisphere};

impl LayeredBsdf<'_> {
    /// Approximate albedo of each lobe below the coat, to which its sampling probability is proportional.
    pub(crate) fn lobe_weights(&self) -> [f32; LOBE_COUNT] {
        let stack = &self.stack;
        let own = self.interface_albedo(&stack.fresnel, self.wo);
        let sheen = stack.sheen.map_or(Vec3::ZERO, |sheen| sheen.albedo_color(self.wo.z));
        let passed = mean(stack.transmission);
        let mut single = mean(own.single_scatter);
        let mut below = match passed > 0.0 {
            true => 1.0 - mean(stack.base_fresnel.reflectance(self.wo.z)),
            false => 0.0,
        };
        if let Some(albedo) = self.multiscatter.and_then(|multiscatter| multiscatter.single_scatter_albedo(self.wo)) {
            [single, below] = albedo;
        }
        let [up, down] = self.multiscatter.map_or([0.0; 2], |multiscatter| multiscatter.lobe_probabilities());
        let diffuse = own.multi_scatter + stack.diffuse * self.base_transmittance + sheen;
        let mut weights = [
            single,
            mean(diffuse) + passed * up,
            mean(stack.diffuse_transmission) * self.base_transmittance + passed * down,
            passed * below,
            0.0,
        ];
        if self.has_microfacet_transmission() {
            // Each microfacet either reflects or refracts, so both are sampled as a single lobe.
            weights[SPECULAR] += weights[REFRACTION];
            weights[REFRACTION] = 0.0;
        }
        if let Some(albedo) = self.exact_interface_albedo {
            weights[SPECULAR] = albedo;
        }
        weights
    }

    /// Fractions of the base in the reflected and the transmitted diffuse lobe.
    pub(crate) fn base_fractions(&self, weights: &[f32; LOBE_COUNT]) -> [f32; 2] {
        let of = |color: Vec3, lobe: usize| match mean(color) * self.base_transmittance {
            base if base > 0.0 => (base / weights[lobe]).min(1.0),
            _ => 0.0,
        };
        [of(self.stack.diffuse, DIFFUSE_REFLECTION), of(self.stack.diffuse_transmission, DIFFUSE_TRANSMISSION)]
    }

    /// Probability of sampling each lobe.
    pub(crate) fn sampling_probabilities(&self, weights: [f32; LOBE_COUNT]) -> [f32; LOBE_COUNT] {
        let sum: f32 = weights.iter().sum();
        if sum <= 0.0 {
            return [0.0, 0.0, 0.0, 0.0, f32::from(self.coat_albedo > 0.0)];
        }
        let scale = (1.0 - self.coat_albedo) / sum;
        let mut probabilities = weights.map(|weight| weight * scale);
        probabilities[COAT] = self.coat_albedo;
        probabilities
    }

    /// True if microfacets reflect a part of the light and refract another; [`SPECULAR`] then covers both.
    fn has_microfacet_transmission(&self) -> bool {
        self.stack.transmission != Vec3::ZERO && !self.stack.ggx.effectively_smooth()
    }

    /// Probability that a microfacet reflects, by the cosine between its normal and `wo`. Near the critical angle, some
    /// microfacets reflect all light and others almost none.
    pub(crate) fn reflect_probability(&self, cosine: f32) -> f32 {
        if !self.has_microfacet_transmission() {
            return 1.0;
        }
        let stack = &self.stack;
        let refracted = (Vec3::ONE - stack.base_fresnel.reflectance(cosine)) * stack.transmission;
        reflect_probability(stack.fresnel.reflectance(cosine), refracted)
    }

    pub fn sample(&self, frame: &ShadingFrame, [choice, x, y]: [f32; 3]) -> Option<BsdfSample> {
        let mut rest = choice;
        let mut lobe = 0;
        while lobe + 1 < LOBE_COUNT && rest >= self.lobe_probabilities[lobe] {
            rest -= self.lobe_probabilities[lobe];
            lobe += 1;
        }
        while self.lobe_probabilities[lobe] == 0.0 {
            // The last lobe with a positive probability is used if rounding errors lead past it; `None` if
            // there is no such lobe.
            lobe = lobe.checked_sub(1)?;
        }
        let probability = self.lobe_probabilities[lobe];
        let wo = self.wo;
        let wi = match lobe {
            SPECULAR if self.stack.ggx.effectively_smooth() => {
                let weight = self.stack.fresnel.reflectance(wo.z) / probability;
                return self.specular_sample(frame, Vec3::new(-wo.x, -wo.y, wo.z), weight);
            }
            SPECULAR if self.exact_interface_albedo.is_some() => {
                frame.to_world(sample_interface(&self.stack, wo, [rest / probability, x, y])?)
            }
            SPECULAR => frame.to_world(self.sample_microfacet(rest, [x, y])?),
            DIFFUSE_REFLECTION => frame.to_world(self.sample_diffuse(rest / probability, 0, [x, y])),
            DIFFUSE_TRANSMISSION => frame.to_world(-self.sample_diffuse(rest / probability, 1, [x, y])),
            REFRACTION => {
                let refracted = Vec3::ONE - self.stack.base_fresnel.reflectance(wo.z);
                let eta = self.stack.eta;
                let weight = refracted * self.stack.transmission / (probability * eta * eta);
                return self.specular_sample(frame, refract(wo, Vec3::Z, eta)?, weight);
            }
            _ => {
                let coat = self.stack.coat.as_ref()?;
                let sample = coat.sample(coat.wo(), [x, y], probability);
                if !sample.is_valid {
                    return None;
                }
                if sample.is_specular {
                    return Some(BsdfSample::specular(sample.wi, Vec3::splat(sample.weight)));
                }
                sample.wi
            }
        };
        let BsdfEval { value, pdf } = self.eval(frame, wi);
        (pdf > 0.0).then(|| BsdfSample {
            wi,
            weight: value / pdf,
            pdf,
            is_specular: false,
            eta_scale: self.eta_scale(frame, wi),
        })
    }

    /// Samples a local direction above the surface for the reflected (0) or transmitted (1) diffuse lobe; `choice`
    /// selects the base or the other parts of the lobe.
    fn sample_diffuse(&self, choice: f32, side: usize, random: [f32; 2]) -> Vec3 {
        let base = self.base_directions.filter(|_| choice < self.base_fractions[side]);
        base.map_or_else(|| sample_cosine_hemisphere(random), |base| base.sample(random))
    }

    /// Samples a microfacet, and returns the local direction into which it scatters light. The microfacet
    /// reflects if `choice` is below the probability of reflection within this lobe; otherwise it refracts.
    fn sample_microfacet(&self, choice: f32, random: [f32; 2]) -> Option<Vec3> {
        let wo = self.wo;
        let wm = self.stack.ggx.sample_wm(wo, random);
        let reflect_probability = self.reflect_probability(wo.dot(wm));
        if choice < reflect_probability * self.lobe_probabilities[SPECULAR] {
            reflect(wo, wm)
        } else if self.stack.eta == 1.0 {
            // Thin walls: transmission is the reflection, mirrored to the other side.
            reflect(wo, wm).map(|wi| Vec3::new(wi.x, wi.y, -wi.z))
        } else {
            refract(wo, wm, self.stack.eta)
        }
    }

    /// Sample of a smooth interface that scatters light into a local direction.
    fn specular_sample(&self, frame: &ShadingFrame, wi: Vec3, weight: Vec3) -> Option<BsdfSample> {
        let wi_world = frame.to_world(wi);
        if (frame.geometric.dot(wi_world) > 0.0) != (wi.z > 0.0) {
            return None;
        }
        let (coat, sheen) = self.cover_transmittance(frame, wi_world);
        Some(BsdfSample {
            eta_scale: self.eta_scale(frame, wi_world),
            ..BsdfSample::specular(wi_world, weight * (coat * sheen))
        })
    }

    /// [`BsdfSample::eta_scale`] of a sampled world direction.
    fn eta_scale(&self, frame: &ShadingFrame, wi_world: Vec3) -> f32 {
        if frame.geometric.dot(wi_world) < 0.0 { self.stack.eta * self.stack.eta } else { 1.0 }
    }
}
