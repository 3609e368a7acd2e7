//! Mirrors and clear glass: light goes one of two ways.

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::Reflectance;

use super::frame::Frame;
use super::fresnel::{Fresnel, refract};
use super::ggx::Ggx;
use super::{ScatterSample, Scattering, Value, glass, metal};
use crate::place::Place;
use crate::prepare::{PreparedMaterial, PreparedWorld};

/// One point of such a surface: [`super::Layered`] of a smooth interface alone, with the same samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Smooth {
    /// In coordinates along tangent, bitangent and normal.
    view: Vec3,
    reflected: Vec3,
    /// What is left of the light that goes on, and whether any ever does.
    refracted: Vec3,
    transmissive: bool,
    /// How often each is sampled.
    shares: [f32; 2],
    /// The index of the other side relative to the viewer's; 1 for thin walls.
    eta: f32,
}

impl Smooth {
    pub(super) fn new(fresnel: &Fresnel, transmission: Vec3, eta: f32, frame: &Frame) -> Self {
        let mean = |color: Vec3| color.element_sum() / 3.0;
        let view = frame.local(frame.view);
        let reflected = fresnel.reflected(view.z);
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
            shares: weights.map(|weight| weight * scale),
            eta,
        }
    }
}

impl PreparedMaterial {
    /// A hit of a smooth metal or of clear glass without a normal map, and the directions there. The rest is as for
    /// [`super::Scatter::new`].
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
        let smooth = place.frame(direction);
        let frame = smooth.with_normal(smooth.normal, None);
        let smooth = match reflectance {
            Ok(metal) => Smooth::new(&metal::fresnel(metal, base), Vec3::ZERO, 1.0, &frame),
            Err(glass) => {
                let eta = glass::eta(glass, place.front, channel, around);
                let fresnel = glass::fresnel(glass, eta);
                Smooth::new(&fresnel, base, glass::beyond(glass, eta), &frame)
            }
        };
        Some((smooth, frame))
    }
}

fn is_smooth(roughness: f32) -> bool {
    Ggx::isotropic(roughness).is_smooth()
}

impl Scattering for Smooth {
    fn evaluate(&self, _: &Frame, _: Vec3) -> Value {
        Value::default()
    }

    #[inline]
    fn sample(&self, frame: &Frame, [choice, ..]: [f32; 3]) -> Option<ScatterSample> {
        let (v, [up, down]) = (self.view, self.shares);
        let (l, weight) = if choice < up || down == 0.0 {
            if up == 0.0 {
                return None;
            }
            (Vec3::new(-v.x, -v.y, v.z), self.reflected / up)
        } else {
            let squeezed = self.refracted / (down * self.eta * self.eta);
            (refract(v, Vec3::Z, self.eta)?, squeezed)
        };
        let direction = frame.world(l);
        let above = frame.geometric.dot(direction);
        if (above > 0.0) != (l.z > 0.0) {
            return None;
        }
        Some(ScatterSample {
            direction,
            weight,
            pdf: 0.0,
            delta: true,
            squeeze: if above < 0.0 {
                self.eta * self.eta
            } else {
                1.0
            },
        })
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

    #[test]
    fn mirrors_and_clear_glass_have_the_samples_of_their_layers() {
        let gold = Metal::named("gold").unwrap();
        let base = Vec3::new(0.9, 0.8, 0.5);
        let mut refracted = 0;
        for degrees in [0.0f32, 20.0, 50.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let frame = Frame::new(Vec3::Z, Vec3::Z, Vec3::new(0.6 * sin, -0.8 * sin, cos));
            let mut pairs = vec![(
                metal::metal(&gold, base, &frame),
                Smooth::new(&metal::fresnel(&gold, base), Vec3::ZERO, 1.0, &frame),
            )];
            for (thin, front) in [(true, true), (false, true), (false, false)] {
                let clear = Glass {
                    thin,
                    ..Glass::default()
                };
                let eta = glass::eta(&clear, front, None, 1.0);
                let fresnel = glass::fresnel(&clear, eta);
                pairs.push((
                    glass::glass(&clear, eta, base, None, &frame),
                    Smooth::new(&fresnel, base, glass::beyond(&clear, eta), &frame),
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
}
