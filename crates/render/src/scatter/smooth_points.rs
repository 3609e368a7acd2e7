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
