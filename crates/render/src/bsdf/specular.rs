//! Mirrors and clear glass: light goes one of two ways.

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, MaterialModel};

use crate::bsdf::dielectric;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample, conductor, is_dispersive, principled};
use crate::interaction::SurfaceInteraction;
use crate::lobes::fresnel::{Fresnel, refract};
use crate::lobes::ggx::Ggx;
use crate::lobes::shading_frame::ShadingFrame;
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;

/// One point of such a surface: [`crate::bsdf::LayeredBsdf`] of a smooth interface alone, with the same samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularBsdf {
    /// In coordinates along tangent, bitangent and normal.
    wo: Vec3,
    reflected: Vec3,
    /// What is left of the light that goes on, and whether any ever does.
    refracted: Vec3,
    transmissive: bool,
    /// How often each is followed.
    probabilities: [f32; 2],
    /// The index of the other side relative to the viewer's; 1 for thin walls.
    eta: f32,
}

/// The number that chooses what passes, where any does.
pub(crate) const FORCE_TRANSMISSION: f32 = f32::INFINITY;

/// Where light goes on, if it does: what [`SpecularBsdf::sample`] says, without branches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecularSample {
    pub is_valid: bool,
    pub wi: Vec3,
    pub weight: Vec3,
    pub eta_scale: f32,
}

impl SpecularBsdf {
    fn from_fresnel(fresnel: &Fresnel, transmission: Vec3, eta: f32, frame: &ShadingFrame) -> Self {
        let view = frame.to_local(frame.wo);
        Self::new(view, fresnel.reflectance(view.z), transmission, eta, 1.0)
    }

    /// By the view in coordinates along tangent, bitangent and normal, and what is reflected of it. Each way is followed
    /// so many times as often as its share of the light, and at most always.
    #[inline(always)]
    pub fn new(view: Vec3, reflected: Vec3, transmission: Vec3, eta: f32, often: f32) -> Self {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let passed = mean(transmission);
        let below = if passed > 0.0 {
            1.0 - mean(reflected)
        } else {
            0.0
        };
        let weights = [mean(reflected), passed * below];
        let sum = weights[0] + weights[1];
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Self {
            wo: view,
            reflected,
            refracted: (Vec3::ONE - reflected) * transmission,
            transmissive: transmission != Vec3::ZERO,
            probabilities: weights.map(|weight| (weight * scale * often).min(1.0)),
            eta,
        }
    }

    /// Whether by a number both ways are followed; [`FORCE_TRANSMISSION`] is the other then.
    #[inline(always)]
    pub(crate) fn is_split(&self, choice: f32) -> bool {
        let [up, down] = self.probabilities;
        (choice < up) & (choice >= 1.0 - down)
    }

    /// By a number that chooses between both ways.
    #[inline(always)]
    pub(crate) fn sample_branch(&self, frame: &ShadingFrame, choice: f32) -> SpecularSample {
        let (v, [up, down]) = (self.wo, self.probabilities);
        let back = (choice < up) | (down == 0.0);
        let through = refract(v, Vec3::Z, self.eta);
        let there = if back { up != 0.0 } else { through.is_some() };
        let l = if back {
            Vec3::new(-v.x, -v.y, v.z)
        } else {
            through.unwrap_or(Vec3::Z)
        };
        let squeezed = self.refracted / (down * self.eta * self.eta);
        let direction = frame.to_world(l);
        let above = frame.geometric.dot(direction);
        SpecularSample {
            is_valid: there & ((above > 0.0) == (l.z > 0.0)),
            wi: direction,
            weight: if back { self.reflected / up } else { squeezed },
            eta_scale: if above < 0.0 {
                self.eta * self.eta
            } else {
                1.0
            },
        }
    }
}

impl SpecularSample {
    #[inline(always)]
    pub fn sample(self) -> Option<BsdfSample> {
        self.is_valid.then_some(BsdfSample {
            wi: self.wi,
            weight: self.weight,
            pdf: 0.0,
            is_specular: true,
            eta_scale: self.eta_scale,
        })
    }
}

/// Whether a material is a smooth metal or clear glass and no more, where its textures do not say otherwise: of one index of
/// refraction for all colours, without normals or light of its own.
pub(crate) fn is_specular_material(material: &Material) -> bool {
    let clear = match &material.model {
        MaterialModel::Metal(metal) => is_smooth(metal.roughness),
        MaterialModel::Glass(glass) => is_smooth(glass.roughness),
        MaterialModel::Principled(p) => principled::is_specular(p),
        _ => return false,
    };
    clear
        && !is_dispersive(material)
        && material.normal_map.is_none()
        && material.emission.value == [0.0; 3]
}

impl PreparedMaterial {
    /// A hit of a smooth metal or of clear glass without a normal map, and the directions there. The rest is as for
    /// [`crate::bsdf::Scatter::new`].
    #[inline]
    pub fn specular_bsdf(
        &self,
        world: &Geometry,
        hit: &Hit,
        place: &SurfaceInteraction,
        direction: Vec3,
        channel: Option<usize>,
        around: f32,
    ) -> Option<(SpecularBsdf, ShadingFrame)> {
        let reflectance = match &self.material.model {
            _ if self.material.normal_map.is_some() => return None,
            MaterialModel::Metal(metal) if is_smooth(metal.roughness) => Ok(metal),
            MaterialModel::Glass(glass) if is_smooth(glass.roughness) => Err(glass),
            _ => return None,
        };
        let base = world.base_color_with(self, hit, &place.footprint);
        let frame = place.shading_frame(direction).with_own_normal();
        let smooth = match reflectance {
            Ok(metal) => SpecularBsdf::from_fresnel(
                &conductor::fresnel(metal, base),
                Vec3::ZERO,
                1.0,
                &frame,
            ),
            Err(glass) => {
                let eta = dielectric::eta(glass, place.is_front, channel, around);
                let fresnel = dielectric::fresnel(glass, eta);
                SpecularBsdf::from_fresnel(
                    &fresnel,
                    base,
                    dielectric::relative_ior(glass, eta),
                    &frame,
                )
            }
        };
        Some((smooth, frame))
    }
}

/// Whether a lobe of this perceptual roughness is a mirror.
pub(crate) fn is_smooth(roughness: f32) -> bool {
    Ggx::isotropic(roughness).effectively_smooth()
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
        self.transmissive
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

    #[test]
    fn mirrors_and_clear_glass_have_the_samples_of_their_layers() {
        let gold = Metal::named("gold").unwrap();
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut refracted = 0;
        for degrees in [0.0f32, 20.0, 50.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = ShadingFrame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let mut pairs = vec![(
                LayeredBsdf::new(conductor::layer_stack(&gold, base), &frame),
                SpecularBsdf::from_fresnel(
                    &conductor::fresnel(&gold, base),
                    Vec3::ZERO,
                    1.0,
                    &frame,
                ),
            )];
            for (thin, front) in [(true, true), (false, true), (false, false)] {
                let clear = Glass {
                    thin,
                    ..Glass::default()
                };
                let eta = dielectric::eta(&clear, front, None, 1.0);
                let fresnel = dielectric::fresnel(&clear, eta);
                pairs.push((
                    LayeredBsdf::new(dielectric::layer_stack(&clear, eta, base, None), &frame),
                    SpecularBsdf::from_fresnel(
                        &fresnel,
                        base,
                        dielectric::relative_ior(&clear, eta),
                        &frame,
                    ),
                ));
            }
            for (layered, smooth) in pairs {
                assert!(!layered.is_non_specular());
                assert_eq!(layered.is_transmissive(), smooth.is_transmissive());
                assert!(
                    (layered.albedo() - smooth.albedo(&frame))
                        .abs()
                        .max_element()
                        < 1e-6
                );
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
    fn ways_that_are_followed_more_often_bring_as_much() {
        const CHOICES: u32 = 4000;
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut both = 0;
        for (degrees, thin, front) in [
            (0.0f32, false, true),
            (70.0, false, true),
            (86.0, true, true),
            (40.0, false, false),
            (60.0, false, false),
        ] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = ShadingFrame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let clear = Glass {
                thin,
                ..Glass::default()
            };
            let eta = dielectric::eta(&clear, front, None, 1.0);
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
