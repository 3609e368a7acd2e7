//! Mirrors and clear dielectrics: light takes one of two directions.

use glam::Vec3;
use raycam_scene::MaterialModel;

use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::lobes::classify::is_smooth;
use crate::lobes::fresnel::{Fresnel, refract};
use crate::lobes::mean_color::mean;
use crate::lobes::shading_frame::ShadingFrame;

/// A smooth interface without other layers. Its samples are equal to the samples of
/// [`crate::bsdf::layered::LayeredBsdf`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularBsdf {
    wo: Vec3,
    /// Fractions of light that the interface reflects and refracts.
    reflected: Vec3,
    refracted: Vec3,
    is_transmissive: bool,
    /// Probabilities of following the reflection and the refraction; their sum exceeds 1 if a path may follow both.
    probabilities: [f32; 2],
    /// Index of refraction of the far side relative to the viewer's side; 1 for thin walls.
    eta: f32,
}

/// Passed instead of a random number to select refraction, if any light is refracted.
pub(crate) const FORCE_TRANSMISSION: f32 = f32::INFINITY;

/// Sample of one branch; `is_valid` is false if the branch scatters no light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularSample {
    pub is_valid: bool,
    pub wi: Vec3,
    pub weight: Vec3,
    pub eta_scale: f32,
}

impl SpecularBsdf {
    fn from_fresnel(fresnel: &Fresnel, transmission: Vec3, eta: f32, frame: &ShadingFrame) -> Self {
        let wo = frame.to_local(frame.wo);
        Self::new(wo, fresnel.reflectance(wo.z), transmission, eta, 1.0)
    }

    /// Creates the interface from the local direction towards the viewer and the reflectance there. Each branch is
    /// followed `oversampling` times as often as its fraction of the light; the probability is at most 1.
    #[inline(always)]
    pub fn new(wo: Vec3, reflected: Vec3, transmission: Vec3, eta: f32, oversampling: f32) -> Self {
        let passed = mean(transmission);
        let below = if passed > 0.0 { 1.0 - mean(reflected) } else { 0.0 };
        let weights = [mean(reflected), passed * below];
        let sum = weights[0] + weights[1];
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Self {
            wo,
            reflected,
            refracted: (Vec3::ONE - reflected) * transmission,
            is_transmissive: transmission != Vec3::ZERO,
            probabilities: weights.map(|weight| (weight * scale * oversampling).min(1.0)),
            eta,
        }
    }

    /// True if both branches are followed: the random number `choice` itself selects the reflection, and
    /// [`FORCE_TRANSMISSION`] the refraction.
    #[inline(always)]
    pub(crate) fn is_split(&self, choice: f32) -> bool {
        let [up, down] = self.probabilities;
        (choice < up) & (choice >= 1.0 - down)
    }

    /// Samples the branch that a random number selects.
    #[inline(always)]
    pub(crate) fn sample_branch(&self, frame: &ShadingFrame, choice: f32) -> SpecularSample {
        let (wo, [up, down]) = (self.wo, self.probabilities);
        let is_reflection = (choice < up) | (down == 0.0);
        let refracted = refract(wo, Vec3::Z, self.eta);
        let is_possible = if is_reflection { up != 0.0 } else { refracted.is_some() };
        let wi = if is_reflection { Vec3::new(-wo.x, -wo.y, wo.z) } else { refracted.unwrap_or(Vec3::Z) };
        let refracted_weight = self.refracted / (down * self.eta * self.eta);
        let wi_world = frame.to_world(wi);
        let side = frame.geometric.dot(wi_world);
        SpecularSample {
            is_valid: is_possible & ((side > 0.0) == (wi.z > 0.0)),
            wi: wi_world,
            weight: if is_reflection { self.reflected / up } else { refracted_weight },
            eta_scale: if side < 0.0 { self.eta * self.eta } else { 1.0 },
        }
    }
}

impl SpecularSample {
    #[inline(always)]
    pub fn sample(self) -> Option<BsdfSample> {
        self.is_valid.then_some(BsdfSample { eta_scale: self.eta_scale, ..BsdfSample::specular(self.wi, self.weight) })
    }
}

impl SpecularBsdf {
    /// BSDF of a smooth metal or of clear glass without a normal or height map, with its shading frame; `None` for
    /// other materials.
    #[inline]
    pub fn at_hit(hit: &MaterialHit) -> Option<(Self, ShadingFrame)> {
        let material = &hit.material.material;
        let roughness = match &material.model {
            MaterialModel::Metal(metal) => metal.roughness,
            MaterialModel::Glass(glass) => glass.roughness,
            MaterialModel::Phong { .. }
            | MaterialModel::Unlit
            | MaterialModel::Principled(_)
            | MaterialModel::Boundary => return None,
        };
        if material.bends_normals() || !is_smooth(roughness) {
            return None;
        }
        let stack = hit.layer_stack()?;
        let frame = hit.unmapped_frame.with_own_normal();
        let bsdf = Self::from_fresnel(&stack.fresnel, stack.transmission, stack.eta, &frame);
        Some((bsdf, frame))
    }
}

/// Transmittance of a wall that light passes straight through: see [`crate::lobes::classify::is_straight`]. The result
/// is zero if the hit has other layers or is rough.
pub(crate) fn straight_transmittance(hit: &MaterialHit) -> Vec3 {
    let stack = hit.layer_stack().filter(|stack| stack.is_interface_only() && stack.ggx.effectively_smooth());
    stack.map_or(Vec3::ZERO, |stack| {
        let frame = hit.unmapped_frame.with_own_normal();
        SpecularBsdf::from_fresnel(&stack.fresnel, stack.transmission, 1.0, &frame).refracted
    })
}

impl BsdfModel for SpecularBsdf {
    fn eval(&self, _: &ShadingFrame, _: Vec3) -> BsdfEval {
        BsdfEval::default()
    }

    #[inline]
    fn sample(&self, frame: &ShadingFrame, [choice, ..]: [f32; 3]) -> Option<BsdfSample> {
        self.sample_branch(frame, choice).sample()
    }

    fn albedo(&self, _: &ShadingFrame) -> Vec3 {
        (self.reflected + self.refracted).min(Vec3::ONE)
    }

    fn is_non_specular(&self) -> bool {
        false
    }

    fn is_transmissive(&self) -> bool {
        self.is_transmissive
    }

    fn needs_lobe_sample(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Glass, Metal};

    use super::*;
    use crate::bsdf::layered::LayeredBsdf;
    use crate::bsdf::{conductor, dielectric};

    #[test]
    fn smooth_interfaces_and_layers_return_equal_samples() {
        let gold = Metal::named("gold").unwrap();
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut refracted = 0;
        for degrees in [0.0f32, 20.0, 50.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = ShadingFrame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let mut pairs = vec![(
                LayeredBsdf::new(conductor::layer_stack(&gold, base), &frame),
                SpecularBsdf::from_fresnel(&conductor::fresnel(&gold, base), Vec3::ZERO, 1.0, &frame),
            )];
            for (thin, front) in [(true, true), (false, true), (false, false)] {
                let clear = Glass { thin, ..Glass::default() };
                let eta = dielectric::eta_of_side(&clear, front, None, 1.0);
                let fresnel = dielectric::fresnel(&clear, eta);
                pairs.push((
                    LayeredBsdf::new(dielectric::layer_stack(&clear, eta, base, None), &frame),
                    SpecularBsdf::from_fresnel(&fresnel, base, dielectric::relative_ior(&clear, eta), &frame),
                ));
            }
            for (layered, smooth) in pairs {
                assert!(!layered.is_non_specular());
                assert_eq!(layered.is_transmissive(), smooth.is_transmissive());
                assert!((layered.albedo() - smooth.albedo(&frame)).abs().max_element() < 1e-6);
                for choice in [0.0, 0.02, 0.3, 0.7, 0.999_999_9] {
                    let one = layered.sample(&frame, [choice, 0.0, 0.0]);
                    let other = smooth.sample(&frame, [choice, 0.0, 0.0]);
                    assert_eq!(format!("{one:?}"), format!("{other:?}"), "{degrees}");
                    refracted += usize::from(one.is_some_and(|one| one.wi.z < 0.0));
                }
            }
        }
        assert!(refracted > 20, "{refracted}");
    }

    #[test]
    fn oversampled_branches_conserve_energy() {
        const CHOICES: u32 = 4000;
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut both = 0;
        for (degrees, thin, front) in
            [(0.0f32, false, true), (70.0, false, true), (86.0, true, true), (40.0, false, false), (60.0, false, false)]
        {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = ShadingFrame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let clear = Glass { thin, ..Glass::default() };
            let eta = dielectric::eta_of_side(&clear, front, None, 1.0);
            let reflected = dielectric::fresnel(&clear, eta).reflectance(cos);
            let beyond = dielectric::relative_ior(&clear, eta);
            let [mut up, mut down] = [Vec3::ZERO; 2];
            let smooth = SpecularBsdf::new(frame.to_local(frame.wo), reflected, base, beyond, 3.0);
            for i in 0..CHOICES {
                let choice = (i as f32 + 0.5) / CHOICES as f32;
                let mut follow = |way: SpecularSample| {
                    let side = if way.wi.z > 0.0 { &mut up } else { &mut down };
                    *side += way.weight / CHOICES as f32;
                };
                follow(smooth.sample_branch(&frame, choice));
                if smooth.is_split(choice) {
                    both += 1;
                    follow(smooth.sample_branch(&frame, FORCE_TRANSMISSION));
                }
            }
            let passed = (Vec3::ONE - reflected) * base / (beyond * beyond);
            for (met, expected) in [(up, reflected), (down, passed)] {
                let off = (met - expected).abs().max_element();
                assert!(off < 1e-3, "{degrees} {met} {expected}");
            }
        }
        assert!(both > CHOICES, "{both}");
    }
}
