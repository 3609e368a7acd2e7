//! Mirrors and clear glass: light goes one of two ways.

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, Reflectance};

use crate::bsdf::{
    ScatterSample, Scattering, Value, conductor, dielectric, is_dispersive, principled,
};
use crate::interaction::Place;
use crate::lobes::fresnel::{Fresnel, refract};
use crate::lobes::ggx::Ggx;
use crate::lobes::shading_frame::Frame;
use crate::prepare::PreparedWorld;
use crate::prepare::material::PreparedMaterial;

/// One point of such a surface: [`crate::bsdf::Layered`] of a smooth interface alone, with the same samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Smooth {
    /// In coordinates along tangent, bitangent and normal.
    view: Vec3,
    reflected: Vec3,
    /// What is left of the light that goes on, and whether any ever does.
    refracted: Vec3,
    transmissive: bool,
    /// How often each is followed.
    shares: [f32; 2],
    /// The index of the other side relative to the viewer's; 1 for thin walls.
    eta: f32,
}

/// The number that chooses what passes, where any does.
pub(crate) const THROUGH: f32 = f32::INFINITY;

/// Where light goes on, if it does: what [`Smooth::sample`] says, without branches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    pub goes: bool,
    pub direction: Vec3,
    pub weight: Vec3,
    pub squeeze: f32,
}

impl Smooth {
    fn met(fresnel: &Fresnel, transmission: Vec3, eta: f32, frame: &Frame) -> Self {
        let view = frame.local(frame.view);
        Self::new(view, fresnel.reflected(view.z), transmission, eta, 1.0)
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
            view,
            reflected,
            refracted: (Vec3::ONE - reflected) * transmission,
            transmissive: transmission != Vec3::ZERO,
            shares: weights.map(|weight| (weight * scale * often).min(1.0)),
            eta,
        }
    }

    /// Whether by a number both ways are followed; [`THROUGH`] is the other then.
    #[inline(always)]
    pub(crate) fn forks(&self, choice: f32) -> bool {
        let [up, down] = self.shares;
        (choice < up) & (choice >= 1.0 - down)
    }

    /// By a number that chooses between both ways.
    #[inline(always)]
    pub(crate) fn way(&self, frame: &Frame, choice: f32) -> Way {
        let (v, [up, down]) = (self.view, self.shares);
        let back = (choice < up) | (down == 0.0);
        let through = refract(v, Vec3::Z, self.eta);
        let there = if back { up != 0.0 } else { through.is_some() };
        let l = if back {
            Vec3::new(-v.x, -v.y, v.z)
        } else {
            through.unwrap_or(Vec3::Z)
        };
        let squeezed = self.refracted / (down * self.eta * self.eta);
        let direction = frame.world(l);
        let above = frame.geometric.dot(direction);
        Way {
            goes: there & ((above > 0.0) == (l.z > 0.0)),
            direction,
            weight: if back { self.reflected / up } else { squeezed },
            squeeze: if above < 0.0 {
                self.eta * self.eta
            } else {
                1.0
            },
        }
    }
}

impl Way {
    #[inline(always)]
    pub fn sample(self) -> Option<ScatterSample> {
        self.goes.then_some(ScatterSample {
            direction: self.direction,
            weight: self.weight,
            pdf: 0.0,
            delta: true,
            squeeze: self.squeeze,
        })
    }
}

/// Whether a material is a smooth metal or clear glass and no more, where its textures do not say otherwise: of one index of
/// refraction for all colours, without normals or light of its own.
pub(crate) fn is_clear(material: &Material) -> bool {
    let clear = match &material.reflectance {
        Reflectance::Metal(metal) => is_smooth(metal.roughness),
        Reflectance::Glass(glass) => is_smooth(glass.roughness),
        Reflectance::Principled(p) => principled::is_clear(p),
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
    pub fn smooth(
        &self,
        world: &PreparedWorld,
        hit: &Hit,
        place: &Place,
        direction: Vec3,
        channel: Option<usize>,
        around: f32,
    ) -> Option<(Smooth, Frame)> {
        let reflectance = match &self.material.reflectance {
            _ if self.material.normal_map.is_some() => return None,
            Reflectance::Metal(metal) if is_smooth(metal.roughness) => Ok(metal),
            Reflectance::Glass(glass) if is_smooth(glass.roughness) => Err(glass),
            _ => return None,
        };
        let base = world.base_color_of(self, hit, &place.footprint);
        let frame = place.frame(direction).upright();
        let smooth = match reflectance {
            Ok(metal) => Smooth::met(&conductor::fresnel(metal, base), Vec3::ZERO, 1.0, &frame),
            Err(glass) => {
                let eta = dielectric::eta(glass, place.front, channel, around);
                let fresnel = dielectric::fresnel(glass, eta);
                Smooth::met(&fresnel, base, dielectric::beyond(glass, eta), &frame)
            }
        };
        Some((smooth, frame))
    }
}

/// Whether a lobe of this perceptual roughness is a mirror.
pub(crate) fn is_smooth(roughness: f32) -> bool {
    Ggx::isotropic(roughness).is_smooth()
}

impl Scattering for Smooth {
    fn evaluate(&self, _: &Frame, _: Vec3) -> Value {
        Value::default()
    }

    #[inline]
    fn sample(&self, frame: &Frame, [choice, ..]: [f32; 3]) -> Option<ScatterSample> {
        self.way(frame, choice).sample()
    }

    fn albedo(&self, _: &Frame) -> Vec3 {
        (self.reflected + self.refracted).min(Vec3::ONE)
    }

    fn is_lit(&self) -> bool {
        false
    }

    fn is_transmissive(&self) -> bool {
        self.transmissive
    }

    fn chooses(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Glass, Metal};

    use super::*;
    use crate::bsdf::Layered;

    #[test]
    fn mirrors_and_clear_glass_have_the_samples_of_their_layers() {
        let gold = Metal::named("gold").unwrap();
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut refracted = 0;
        for degrees in [0.0f32, 20.0, 50.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = Frame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let mut pairs = vec![(
                Layered::new(conductor::layers(&gold, base), &frame),
                Smooth::met(&conductor::fresnel(&gold, base), Vec3::ZERO, 1.0, &frame),
            )];
            for (thin, front) in [(true, true), (false, true), (false, false)] {
                let clear = Glass {
                    thin,
                    ..Glass::default()
                };
                let eta = dielectric::eta(&clear, front, None, 1.0);
                let fresnel = dielectric::fresnel(&clear, eta);
                pairs.push((
                    Layered::new(dielectric::layers(&clear, eta, base, None), &frame),
                    Smooth::met(&fresnel, base, dielectric::beyond(&clear, eta), &frame),
                ));
            }
            for (layered, smooth) in pairs {
                assert!(!layered.is_lit());
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
                    refracted += usize::from(one.is_some_and(|one| one.direction.z < 0.0));
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
            let frame = Frame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let clear = Glass {
                thin,
                ..Glass::default()
            };
            let eta = dielectric::eta(&clear, front, None, 1.0);
            let reflected = dielectric::fresnel(&clear, eta).reflected(cos);
            let beyond = dielectric::beyond(&clear, eta);
            let [mut up, mut down] = [Vec3::ZERO; 2];
            let smooth = Smooth::new(frame.local(frame.view), reflected, base, beyond, 3.0);
            for i in 0..CHOICES {
                let choice = (i as f32 + 0.5) / CHOICES as f32;
                let mut follow = |way: Way| {
                    let side = if way.direction.z > 0.0 {
                        &mut up
                    } else {
                        &mut down
                    };
                    *side += way.weight / CHOICES as f32;
                };
                follow(smooth.way(&frame, choice));
                if smooth.forks(choice) {
                    both += 1;
                    follow(smooth.way(&frame, THROUGH));
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
