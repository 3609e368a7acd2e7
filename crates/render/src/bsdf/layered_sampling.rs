//! How layers are sampled: by which lobe, and where that sends light.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::BsdfSample;
use crate::bsdf::layered::LayeredBsdf;
use crate::lobes::clearcoat::COAT_FRESNEL;
use crate::lobes::fresnel::{reflect, refract};
use crate::lobes::shading_frame::{ShadingFrame, sample_cosine_hemisphere};

/// How many lobes are sampled; the last is the coat's.
pub(crate) const LOBE_COUNT: usize = 5;
/// The interface: also what rough ones refract.
pub(crate) const SPECULAR: usize = 0;
pub(crate) const DIFFUSE_REFLECTION: usize = 1;
pub(crate) const DIFFUSE_TRANSMISSION: usize = 2;
/// Of smooth ones.
pub(crate) const REFRACTION: usize = 3;

impl LayeredBsdf<'_> {
    /// How often each lobe is sampled.
    pub(crate) fn compute_lobe_probabilities(&self) -> [f32; LOBE_COUNT] {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let layers = &self.stack;
        let own = self.interface_albedo(&layers.fresnel, self.wo);
        let sheen = layers
            .sheen
            .map_or(Vec3::ZERO, |sheen| sheen.albedo_color(self.wo.z));
        let passed = mean(layers.transmission);
        let mut single = mean(own.single_scatter);
        let mut below = match passed > 0.0 {
            true => 1.0 - mean(layers.base_fresnel.reflectance(self.wo.z)),
            false => 0.0,
        };
        if let Some(kept) = self
            .multiscatter
            .and_then(|between| between.single_scatter_albedo(self.wo))
        {
            [single, below] = kept;
        }
        let [up, down] = self
            .multiscatter
            .map_or([0.0; 2], |between| between.lobe_probabilities());
        let mut weights = [
            single,
            mean(own.multi_scatter + layers.diffuse * self.base_transmittance + sheen)
                + passed * up,
            mean(layers.diffuse_transmission) * self.base_transmittance + passed * down,
            passed * below,
            0.0,
        ];
        if self.has_microfacet_transmission() {
            // Each microfacet chooses for itself.
            weights[SPECULAR] += weights[REFRACTION];
            weights[REFRACTION] = 0.0;
        }
        let sum: f32 = weights.iter().sum();
        if sum <= 0.0 {
            return [0.0, 0.0, 0.0, 0.0, f32::from(self.coat_albedo > 0.0)];
        }
        let scale = (1.0 - self.coat_albedo) / sum;
        let mut shares = weights.map(|weight| weight * scale);
        shares[LOBE_COUNT - 1] = self.coat_albedo;
        shares
    }

    /// Whether microfacets reflect a part and refract a part: [`SPECULAR`] is both then.
    pub(crate) fn has_microfacet_transmission(&self) -> bool {
        self.stack.transmission != Vec3::ZERO && !self.stack.ggx.effectively_smooth()
    }

    /// How often one microfacet of those that divide light is asked to reflect, by the cosine between its normal and the
    /// view: near the critical angle some reflect all, and others next to nothing.
    pub(crate) fn reflect_probability(&self, cosine: f32) -> f32 {
        if !self.has_microfacet_transmission() {
            return 1.0;
        }
        let layers = &self.stack;
        let reflected = layers.fresnel.reflectance(cosine).element_sum();
        let rest = (Vec3::ONE - layers.base_fresnel.reflectance(cosine)) * layers.transmission;
        let both = reflected + rest.element_sum();
        if both > 0.0 { reflected / both } else { 1.0 }
    }

    pub fn sample(&self, frame: &ShadingFrame, [choice, x, y]: [f32; 3]) -> Option<BsdfSample> {
        let mut left = choice;
        let mut lobe = 0;
        while lobe + 1 < LOBE_COUNT && left >= self.lobe_probabilities[lobe] {
            left -= self.lobe_probabilities[lobe];
            lobe += 1;
        }
        while self.lobe_probabilities[lobe] == 0.0 {
            // Rounding, or the end of a list of nothing.
            lobe = lobe.checked_sub(1)?;
        }
        let (v, ggx) = (self.wo, &self.stack.ggx);
        let direction = match lobe {
            SPECULAR if ggx.effectively_smooth() => {
                let weight = self.stack.fresnel.reflectance(v.z) / self.lobe_probabilities[lobe];
                return self.specular_sample(frame, Vec3::new(-v.x, -v.y, v.z), weight);
            }
            SPECULAR => {
                let h = ggx.sample_wm(v, [x, y]);
                if left < self.reflect_probability(v.dot(h)) * self.lobe_probabilities[lobe] {
                    frame.to_world(reflect(v, h)?)
                } else if self.stack.eta == 1.0 {
                    // Thin walls: the reflection, seen from behind.
                    let l = reflect(v, h)?;
                    frame.to_world(Vec3::new(l.x, l.y, -l.z))
                } else {
                    frame.to_world(refract(v, h, self.stack.eta)?)
                }
            }
            DIFFUSE_REFLECTION => frame.to_world(sample_cosine_hemisphere([x, y])),
            DIFFUSE_TRANSMISSION => frame.to_world(-sample_cosine_hemisphere([x, y])),
            REFRACTION => {
                let rest = Vec3::ONE - self.stack.base_fresnel.reflectance(v.z);
                let eta = self.stack.eta;
                let weight =
                    rest * self.stack.transmission / (self.lobe_probabilities[lobe] * eta * eta);
                return self.specular_sample(frame, refract(v, Vec3::Z, eta)?, weight);
            }
            _ => {
                let coat = self.stack.coat.as_ref()?;
                let v = coat.frame.to_local(frame.wo);
                if coat.ggx.effectively_smooth() {
                    let direction = coat.frame.to_world(Vec3::new(-v.x, -v.y, v.z));
                    let weight = COAT_FRESNEL.reflectance(v.z)
                        * (coat.weight / self.lobe_probabilities[lobe]);
                    return (frame.geometric.dot(direction) > 0.0).then_some(BsdfSample {
                        wi: direction,
                        weight,
                        pdf: 0.0,
                        is_specular: true,
                        eta_scale: 1.0,
                    });
                }
                coat.frame
                    .to_world(reflect(v, coat.ggx.sample_wm(v, [x, y]))?)
            }
        };
        let BsdfEval { value, pdf } = self.eval(frame, direction);
        (pdf > 0.0).then(|| BsdfSample {
            wi: direction,
            weight: value / pdf,
            pdf,
            is_specular: false,
            eta_scale: self.eta_scale(frame, direction),
        })
    }

    /// A sample of a smooth interface.
    fn specular_sample(&self, frame: &ShadingFrame, l: Vec3, weight: Vec3) -> Option<BsdfSample> {
        let direction = frame.to_world(l);
        if (frame.geometric.dot(direction) > 0.0) != (l.z > 0.0) {
            return None;
        }
        let (coat, sheen) = self.cover_transmittance(frame, direction);
        Some(BsdfSample {
            wi: direction,
            weight: weight * (coat * sheen),
            pdf: 0.0,
            is_specular: true,
            eta_scale: self.eta_scale(frame, direction),
        })
    }

    /// By how much radiance is squeezed together where it goes on.
    fn eta_scale(&self, frame: &ShadingFrame, direction: Vec3) -> f32 {
        if frame.geometric.dot(direction) < 0.0 {
            self.stack.eta * self.stack.eta
        } else {
            1.0
        }
    }
}
