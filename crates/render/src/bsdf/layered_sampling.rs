//! How layers are sampled: by which lobe, and where that sends light.

use glam::Vec3;

use crate::bsdf::ScatterSample;
use crate::bsdf::Value;
use crate::bsdf::layered::Layered;
use crate::lobes::clearcoat::COAT;
use crate::lobes::fresnel::{reflect, refract};
use crate::lobes::shading_frame::{Frame, cosine_direction};

/// How many lobes are sampled; the last is the coat's.
pub(crate) const LOBES: usize = 5;
/// The interface: also what rough ones refract.
pub(crate) const SPECULAR: usize = 0;
pub(crate) const UP: usize = 1;
pub(crate) const DOWN: usize = 2;
/// Of smooth ones.
pub(crate) const REFRACTION: usize = 3;

impl Layered<'_> {
    /// How often each lobe is sampled.
    pub(crate) fn shares(&self) -> [f32; LOBES] {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let layers = &self.layers;
        let own = self.albedo_of(&layers.fresnel, self.view);
        let sheen = layers
            .sheen
            .map_or(Vec3::ZERO, |sheen| sheen.reflected(self.view.z));
        let passed = mean(layers.transmission);
        let mut single = mean(own.single);
        let mut below = match passed > 0.0 {
            true => 1.0 - mean(layers.over.reflected(self.view.z)),
            false => 0.0,
        };
        if let Some(kept) = self.between.and_then(|between| between.kept(self.view)) {
            [single, below] = kept;
        }
        let [up, down] = self.between.map_or([0.0; 2], |between| between.shares());
        let mut weights = [
            single,
            mean(own.multiple + layers.diffuse * self.left + sheen) + passed * up,
            mean(layers.through) * self.left + passed * down,
            passed * below,
            0.0,
        ];
        if self.divides() {
            // Each microfacet chooses for itself.
            weights[SPECULAR] += weights[REFRACTION];
            weights[REFRACTION] = 0.0;
        }
        let sum: f32 = weights.iter().sum();
        if sum <= 0.0 {
            return [0.0, 0.0, 0.0, 0.0, f32::from(self.coated > 0.0)];
        }
        let scale = (1.0 - self.coated) / sum;
        let mut shares = weights.map(|weight| weight * scale);
        shares[LOBES - 1] = self.coated;
        shares
    }

    /// Whether microfacets reflect a part and refract a part: [`SPECULAR`] is both then.
    pub(crate) fn divides(&self) -> bool {
        self.layers.transmission != Vec3::ZERO && !self.layers.ggx.is_smooth()
    }

    /// How often one microfacet of those that divide light is asked to reflect, by the cosine between its normal and the
    /// view: near the critical angle some reflect all, and others next to nothing.
    pub(crate) fn mirrors(&self, cosine: f32) -> f32 {
        if !self.divides() {
            return 1.0;
        }
        let layers = &self.layers;
        let reflected = layers.fresnel.reflected(cosine).element_sum();
        let rest = (Vec3::ONE - layers.over.reflected(cosine)) * layers.transmission;
        let both = reflected + rest.element_sum();
        if both > 0.0 { reflected / both } else { 1.0 }
    }

    pub fn sample(&self, frame: &Frame, [choice, x, y]: [f32; 3]) -> Option<ScatterSample> {
        let mut left = choice;
        let mut lobe = 0;
        while lobe + 1 < LOBES && left >= self.shares[lobe] {
            left -= self.shares[lobe];
            lobe += 1;
        }
        while self.shares[lobe] == 0.0 {
            // Rounding, or the end of a list of nothing.
            lobe = lobe.checked_sub(1)?;
        }
        let (v, ggx) = (self.view, &self.layers.ggx);
        let direction = match lobe {
            SPECULAR if ggx.is_smooth() => {
                let weight = self.layers.fresnel.reflected(v.z) / self.shares[lobe];
                return self.delta(frame, Vec3::new(-v.x, -v.y, v.z), weight);
            }
            SPECULAR => {
                let h = ggx.sample(v, [x, y]);
                if left < self.mirrors(v.dot(h)) * self.shares[lobe] {
                    frame.world(reflect(v, h)?)
                } else if self.layers.eta == 1.0 {
                    // Thin walls: the reflection, seen from behind.
                    let l = reflect(v, h)?;
                    frame.world(Vec3::new(l.x, l.y, -l.z))
                } else {
                    frame.world(refract(v, h, self.layers.eta)?)
                }
            }
            UP => frame.world(cosine_direction([x, y])),
            DOWN => frame.world(-cosine_direction([x, y])),
            REFRACTION => {
                let rest = Vec3::ONE - self.layers.over.reflected(v.z);
                let eta = self.layers.eta;
                let weight = rest * self.layers.transmission / (self.shares[lobe] * eta * eta);
                return self.delta(frame, refract(v, Vec3::Z, eta)?, weight);
            }
            _ => {
                let coat = self.layers.coat.as_ref()?;
                let v = coat.frame.local(frame.view);
                if coat.ggx.is_smooth() {
                    let direction = coat.frame.world(Vec3::new(-v.x, -v.y, v.z));
                    let weight = COAT.reflected(v.z) * (coat.weight / self.shares[lobe]);
                    return (frame.geometric.dot(direction) > 0.0).then_some(ScatterSample {
                        direction,
                        weight,
                        pdf: 0.0,
                        delta: true,
                        squeeze: 1.0,
                    });
                }
                coat.frame.world(reflect(v, coat.ggx.sample(v, [x, y]))?)
            }
        };
        let Value { value, pdf } = self.evaluate(frame, direction);
        (pdf > 0.0).then(|| ScatterSample {
            direction,
            weight: value / pdf,
            pdf,
            delta: false,
            squeeze: self.squeeze(frame, direction),
        })
    }

    /// A sample of a smooth interface.
    fn delta(&self, frame: &Frame, l: Vec3, weight: Vec3) -> Option<ScatterSample> {
        let direction = frame.world(l);
        if (frame.geometric.dot(direction) > 0.0) != (l.z > 0.0) {
            return None;
        }
        let (coat, sheen) = self.covered(frame, direction);
        Some(ScatterSample {
            direction,
            weight: weight * (coat * sheen),
            pdf: 0.0,
            delta: true,
            squeeze: self.squeeze(frame, direction),
        })
    }

    /// By how much radiance is squeezed together where it goes on.
    fn squeeze(&self, frame: &Frame, direction: Vec3) -> f32 {
        if frame.geometric.dot(direction) < 0.0 {
            self.layers.eta * self.layers.eta
        } else {
            1.0
        }
    }
}
