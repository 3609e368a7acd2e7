//! Mirrors and clear glass, many points at a time, field by field.

use glam::Vec3;
use raycam_bvh::Loops;
use raycam_scene::Reflectance;

use super::fresnel::{conductors, dielectric, pane};
use super::smooth::{Smooth, Way};
use super::{ScatterSample, glass};
use crate::lanes::{Three, get, set};
use crate::place::Places;

/// Points of smooth metals and clear glass. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct SmoothPoints<const N: usize> {
    /// Which lanes are such, and which of them are of metal.
    pub is: [bool; N],
    metal: [bool; N],
    any_metal: bool,
    any_glass: bool,
    /// What a metal's reflection is multiplied by, and what passes the surface of glass.
    base: Three<f32, N>,
    /// Of metals.
    ior: Three<f32, N>,
    extinction: Three<f32, N>,
    /// Of glass: the index of the other side relative to the viewer's, or a pane's own.
    eta: [f32; N],
    thin: [bool; N],
    goes: Goes<N>,
}

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
struct Goes<const N: usize> {
    goes: [bool; N],
    direction: Three<f32, N>,
    weight: Three<f32, N>,
    squeeze: [f32; N],
    start: Three<f32, N>,
}

impl<const N: usize> Default for Goes<N> {
    fn default() -> Self {
        Self {
            goes: [false; N],
            direction: [[0.0; N]; 3],
            weight: [[0.0; N]; 3],
            squeeze: [1.0; N],
            start: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for SmoothPoints<N> {
    fn default() -> Self {
        Self {
            is: [false; N],
            metal: [false; N],
            any_metal: false,
            any_glass: false,
            base: [[0.0; N]; 3],
            ior: [[1.0; N]; 3],
            extinction: [[0.0; N]; 3],
            eta: [1.0; N],
            thin: [false; N],
            goes: Goes::default(),
        }
    }
}

impl<const N: usize> SmoothPoints<N> {
    /// Forgets all.
    #[inline]
    pub fn begin(&mut self) {
        self.is = [false; N];
        (self.any_metal, self.any_glass) = (false, false);
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any_metal | self.any_glass
    }

    /// Sets a lane: what it is made of, where the ray is on its front or not, in which colour if it has but one, and what is
    /// around it.
    #[inline]
    pub fn put(
        &mut self,
        lane: usize,
        reflectance: &Reflectance,
        base: Vec3,
        (front, channel, around): (bool, Option<usize>, f32),
    ) {
        set(&mut self.base, lane, base.to_array());
        self.metal[lane] = false;
        match reflectance {
            Reflectance::Metal(metal) => {
                self.metal[lane] = true;
                self.any_metal = true;
                set(&mut self.ior, lane, metal.ior);
                set(&mut self.extinction, lane, metal.extinction);
            }
            Reflectance::Glass(glass) => {
                self.any_glass = true;
                self.eta[lane] = glass::eta(glass, front, channel, around);
                self.thin[lane] = glass.thin;
            }
            _ => return,
        }
        self.is[lane] = true;
    }

    /// What passes a lane's surface.
    #[inline(always)]
    pub fn transmission(&self, lane: usize) -> Vec3 {
        if self.metal[lane] {
            Vec3::ZERO
        } else {
            get(&self.base, lane).into()
        }
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(ScatterSample, Vec3)> {
        let goes = &self.goes;
        let way = Way {
            goes: goes.goes[lane],
            direction: get(&goes.direction, lane).into(),
            weight: get(&goes.weight, lane).into(),
            squeeze: goes.squeeze[lane],
        };
        way.sample()
            .map(|sample| (sample, get(&goes.start, lane).into()))
    }
}

/// Finds where light goes on.
pub(crate) struct FindWays<'a, const N: usize> {
    pub places: &'a Places<N>,
    /// Which way, where there are two.
    pub choice: &'a [f32; N],
    pub points: &'a mut SmoothPoints<N>,
}

impl<const N: usize> Loops for FindWays<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            choice,
            points,
        } = self;
        let (mut normals, mut views) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for lane in 0..N {
            let frame = places.frame(lane).upright();
            set(&mut normals, lane, frame.normal.to_array());
            set(&mut views, lane, frame.local(frame.view).to_array());
        }
        let mut reflected = [[0.0; N]; 3];
        if points.any_glass {
            for (lane, &cosine) in views[2].iter().enumerate() {
                let once = dielectric(cosine, points.eta[lane]);
                let all = if points.thin[lane] { pane(once) } else { once };
                set(&mut reflected, lane, [all; 3]);
            }
        }
        if points.any_metal {
            for (lane, &cosine) in views[2].iter().enumerate() {
                let (ior, extinction) = (get(&points.ior, lane), get(&points.extinction, lane));
                let tint = Vec3::from(get(&points.base, lane));
                let color = tint * conductors(cosine, ior.into(), extinction.into());
                let color = color.to_array();
                for axis in 0..3 {
                    let out = &mut reflected[axis][lane];
                    *out = if points.metal[lane] {
                        color[axis]
                    } else {
                        *out
                    };
                }
            }
        }
        let mut goes = Goes::default();
        for (lane, &choice) in choice.iter().enumerate() {
            let frame = places.frame(lane).about(get(&normals, lane).into());
            let beyond = if points.metal[lane] | points.thin[lane] {
                1.0
            } else {
                points.eta[lane]
            };
            let (view, reflected) = (get(&views, lane), get(&reflected, lane));
            let smooth = Smooth::new(
                view.into(),
                reflected.into(),
                points.transmission(lane),
                beyond,
            );
            let way = smooth.way(&frame, choice);
            let start = places.start(lane, way.direction).as_vec3();
            goes.goes[lane] = way.goes;
            goes.squeeze[lane] = way.squeeze;
            set(&mut goes.direction, lane, way.direction.to_array());
            set(&mut goes.weight, lane, way.weight.to_array());
            set(&mut goes.start, lane, start.to_array());
        }
        points.goes = goes;
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_bvh::{Hit, vectorized};
    use raycam_scene::{Glass, Material, Metal, Object, World, primitive};

    use super::*;
    use crate::control::Control;
    use crate::lanes::{LANES, set_corners};
    use crate::prepare::PreparedWorld;
    use crate::scatter::Scattering;

    /// A smooth ball of each of these.
    fn world(reflectances: impl IntoIterator<Item = Reflectance>) -> PreparedWorld {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        for reflectance in reflectances {
            let material = Material {
                reflectance,
                color: [0.9, 0.8, 0.5],
                ..Material::default()
            };
            let material = world.add_material(material).unwrap();
            let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
            world.add_object(object).unwrap();
        }
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let glass = |thin| {
            Reflectance::Glass(Glass {
                thin,
                ..Glass::default()
            })
        };
        let metal = |name| Reflectance::Metal(Metal::named(name).unwrap());
        let all = [glass(false), glass(true), metal("gold"), metal("silver")];
        let world = world(all);
        let unit = |i: usize| {
            let angle = i as f32;
            Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()).normalize()
        };
        // Glass alone, metal alone, and both.
        let object = |i: usize| match i / LANES % 3 {
            0 => i % 2,
            1 => 2 + i % 2,
            _ => i * 7 / 3 % 4,
        };
        let (mut on, mut through, mut lost) = (0, 0, 0);
        let mut points = SmoothPoints::<LANES>::default();
        for first in (0..480).step_by(LANES) {
            let mut places = Places::<LANES>::default();
            let hits: Vec<_> = (first..first + LANES)
                .map(|i| Hit {
                    t: 1.0,
                    u: 0.2,
                    v: 0.3,
                    instance: object(i) as u32,
                    triangle: i as u32 % 80,
                })
                .collect();
            let corners = places.begin();
            for (lane, hit) in hits.iter().enumerate() {
                set_corners(corners, lane, world.corners(hit.instance, hit.triangle));
            }
            for (lane, hit) in hits.iter().enumerate() {
                places.put(lane, &world, unit(first + lane), hit, 0.0);
            }
            vectorized(&mut places);
            let channel = [None, Some(0)][first % 3 % 2];
            let around = |lane| [1.0, 1.33][lane % 2];
            let choice = std::array::from_fn(|lane| unit(first + 5 * lane).x.abs());
            points.begin();
            for (lane, hit) in hits.iter().enumerate() {
                let (material, front) = (world.material(hit), places.front(lane));
                let base = world.base_color_of(material, hit, places.footprint(lane));
                let side = (front, channel, around(lane));
                points.put(lane, &material.material.reflectance, base, side);
            }
            vectorized(FindWays {
                places: &places,
                choice: &choice,
                points: &mut points,
            });
            for (lane, hit) in hits.iter().enumerate() {
                let (place, direction) = (places.place(lane), unit(first + lane));
                let alone = world.material(hit).smooth(
                    &world,
                    hit,
                    &place,
                    direction,
                    channel,
                    around(lane),
                );
                let (smooth, frame) = alone.unwrap();
                assert_eq!(
                    points.transmission(lane) != Vec3::ZERO,
                    smooth.is_transmissive()
                );
                let alone = smooth.sample(&frame, [choice[lane], 0.0, 0.0]);
                let alone = alone.map(|sample| (sample, place.start(sample.direction).as_vec3()));
                assert_eq!(format!("{:?}", points.sample(lane)), format!("{alone:?}"));
                match alone {
                    None => lost += 1,
                    Some((sample, _)) if frame.geometric.dot(sample.direction) < 0.0 => {
                        through += 1;
                    }
                    Some(_) => on += 1,
                }
            }
        }
        assert!(on > 60 && through > 60 && lost > 3, "{on} {through} {lost}");
    }
}
