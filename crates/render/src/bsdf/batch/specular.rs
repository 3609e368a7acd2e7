//! Mirrors and clear glass, many points at a time, field by field.

use glam::Vec3;
use raycam_bvh::{Hit, Loops};
use raycam_scene::Reflectance;

use crate::bsdf::principled::{Lookup, Seen};
use crate::bsdf::specular::{Smooth, THROUGH, Way};
use crate::bsdf::{ScatterSample, dielectric, principled};
use crate::interaction::Places;
use crate::lobes::fresnel::{Fresnel, conductors, dielectric, pane, schlick_between};
use crate::prepare::PreparedWorld;
use crate::soa::{Three, get, set};

/// Points of smooth metals and clear glass. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct SmoothPoints<const N: usize> {
    /// Which lanes are such, and which of them are of metal.
    pub is: [bool; N],
    metal: [bool; N],
    any_metal: bool,
    any_glass: bool,
    /// Which of them reflect as Schlick's approximation says.
    schlick: [bool; N],
    any_schlick: bool,
    /// What a metal's reflection is multiplied by, and what passes the surface of glass.
    base: Three<f32, N>,
    /// Of metals.
    ior: Three<f32, N>,
    extinction: Three<f32, N>,
    /// What Schlick's approximation has at normal and at grazing incidence.
    ends: [Three<f32, N>; 2],
    /// Of glass: the index of the other side relative to the viewer's, or a pane's own.
    eta: [f32; N],
    thin: [bool; N],
    /// Whether a lane's path may go both ways, and whether it does.
    forks: [bool; N],
    forked: [bool; N],
    goes: Goes<N>,
    /// The other way, of lanes that are forked.
    through: Goes<N>,
}

/// How many times as often as its share of the light each way of a fork is followed.
const OFTEN: f32 = 3.0;

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
            schlick: [false; N],
            any_schlick: false,
            base: [[0.0; N]; 3],
            ior: [[1.0; N]; 3],
            extinction: [[0.0; N]; 3],
            ends: [[[0.0; N]; 3]; 2],
            eta: [1.0; N],
            thin: [false; N],
            forks: [false; N],
            forked: [false; N],
            goes: Goes::default(),
            through: Goes::default(),
        }
    }
}

impl<const N: usize> SmoothPoints<N> {
    /// Forgets all.
    #[inline]
    pub fn begin(&mut self) {
        self.is = [false; N];
        self.forks = [false; N];
        (self.any_metal, self.any_glass, self.any_schlick) = (false, false, false);
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any_metal | self.any_glass | self.any_schlick
    }

    /// Sets a lane, where the point there is such; its material is. `around` is the index of refraction of what is around
    /// its matter, and it may go both ways where it `forks`.
    #[inline]
    pub fn put(
        &mut self,
        (places, lane): (&Places<N>, usize),
        (world, hit): (&PreparedWorld, &Hit),
        channel: Option<usize>,
        around: f32,
        forks: bool,
    ) {
        let prepared = world.material(hit);
        let (footprint, front) = (places.footprint(lane), places.front(lane));
        let base = world.base_color_of(prepared, hit, footprint);
        (self.metal[lane], self.schlick[lane], self.thin[lane]) = (false, false, false);
        match &prepared.material.reflectance {
            Reflectance::Metal(metal) => {
                self.metal[lane] = true;
                self.any_metal = true;
                set(&mut self.ior, lane, metal.ior);
                set(&mut self.extinction, lane, metal.extinction);
            }
            Reflectance::Glass(glass) => {
                self.any_glass = true;
                self.eta[lane] = dielectric::eta(glass, front, channel, around);
                self.thin[lane] = glass.thin;
            }
            Reflectance::Principled(p) => {
                let seen = Seen {
                    channel,
                    around,
                    ..Seen::at(places, lane, base)
                };
                let layers = principled::layers(p, &Lookup::new(world, hit, footprint), &seen);
                // As it is where textures say nothing else.
                let Fresnel::Schlick { f0, f90, .. } = layers.fresnel else {
                    return;
                };
                if !(layers.is_bare() && layers.ggx.is_smooth()) {
                    return;
                }
                self.schlick[lane] = true;
                self.any_schlick = true;
                self.eta[lane] = layers.eta;
                set(&mut self.ends[0], lane, f0.to_array());
                set(&mut self.ends[1], lane, f90.to_array());
            }
            _ => return,
        }
        set(&mut self.base, lane, base.to_array());
        self.forks[lane] = forks && !self.metal[lane];
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
        self.goes.sample(lane)
    }

    /// The same of what passes the surface, where another path is to follow it.
    #[inline]
    pub fn fork(&self, lane: usize) -> Option<(ScatterSample, Vec3)> {
        self.forked[lane].then(|| self.through.sample(lane))?
    }
}

impl<const N: usize> SmoothPoints<N> {
    /// What the lanes reflect, by the cosines of their views.
    #[inline(always)]
    fn reflected(&self, cosines: &[f32; N]) -> Three<f32, N> {
        let mut reflected = [[0.0; N]; 3];
        let mut take = |lane: usize, is: bool, color: Vec3| {
            for (out, color) in reflected.iter_mut().zip(color.to_array()) {
                out[lane] = if is { color } else { out[lane] };
            }
        };
        if self.any_glass {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let once = dielectric(cosine, self.eta[lane]);
                let all = if self.thin[lane] { pane(once) } else { once };
                take(lane, true, Vec3::splat(all));
            }
        }
        if self.any_schlick {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let [f0, f90] = self.ends.each_ref().map(|end| get(end, lane).into());
                let color = schlick_between(f0, f90, cosine, self.eta[lane]);
                take(lane, self.schlick[lane], color);
            }
        }
        if self.any_metal {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let (ior, extinction) = (get(&self.ior, lane), get(&self.extinction, lane));
                let tint = Vec3::from(get(&self.base, lane));
                let color = tint * conductors(cosine, ior.into(), extinction.into());
                take(lane, self.metal[lane], color);
            }
        }
        reflected
    }
}

impl<const N: usize> Goes<N> {
    #[inline(always)]
    fn put(&mut self, lane: usize, way: &Way, start: Vec3) {
        self.goes[lane] = way.goes;
        self.squeeze[lane] = way.squeeze;
        set(&mut self.direction, lane, way.direction.to_array());
        set(&mut self.weight, lane, way.weight.to_array());
        set(&mut self.start, lane, start.to_array());
    }

    #[inline]
    fn sample(&self, lane: usize) -> Option<(ScatterSample, Vec3)> {
        let way = Way {
            goes: self.goes[lane],
            direction: get(&self.direction, lane).into(),
            weight: get(&self.weight, lane).into(),
            squeeze: self.squeeze[lane],
        };
        way.sample()
            .map(|sample| (sample, get(&self.start, lane).into()))
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
        let reflected = points.reflected(&views[2]);
        // What passes the surface is found where any path follows it besides.
        let any_forks = points.forks != [false; N];
        for through in [false, true] {
            if through && !any_forks {
                break;
            }
            let mut goes = Goes::default();
            for (lane, &choice) in choice.iter().enumerate() {
                let frame = places.frame(lane).about(get(&normals, lane).into());
                let beyond = if points.metal[lane] | points.thin[lane] {
                    1.0
                } else {
                    points.eta[lane]
                };
                let (view, reflected) = (get(&views, lane).into(), get(&reflected, lane).into());
                let (forks, transmission) = (points.forks[lane], points.transmission(lane));
                let often = if forks { OFTEN } else { 1.0 };
                let smooth = Smooth::new(view, reflected, transmission, beyond, often);
                points.forked[lane] = forks & smooth.forks(choice);
                let way = smooth.way(&frame, if through { THROUGH } else { choice });
                goes.put(lane, &way, places.start(lane, way.direction).as_vec3());
            }
            if through {
                points.through = goes;
            } else {
                points.goes = goes;
            }
        }
    }
}
