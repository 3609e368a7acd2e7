//! Mirrors and clear glass, many points at a time, field by field.

use glam::Vec3;
use raycam_bvh::{Hit, WithSimd};
use raycam_scene::MaterialModel;

use crate::bsdf::dielectric;
use crate::bsdf::principled::{TextureLookup, ViewContext};
use crate::bsdf::specular::{FORCE_TRANSMISSION, SpecularBsdf, SpecularSample};
use crate::bsdf::{BsdfSample, principled};
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::fresnel::{Fresnel, conductors, dielectric, schlick_two_sided, thin_dielectric};
use crate::prepare::geometry::Geometry;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Points of smooth metals and clear glass. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct SpecularBsdfBatch<const N: usize> {
    /// Which lanes are such, and which of them are of metal.
    pub is_active: [bool; N],
    is_conductor: [bool; N],
    any_conductor: bool,
    any_dielectric: bool,
    /// Which of them reflect as Schlick's approximation says.
    uses_schlick: [bool; N],
    any_schlick: bool,
    /// What a metal's reflection is multiplied by, and what passes the surface of glass.
    base: Vec3xN<f32, N>,
    /// Of metals.
    ior: Vec3xN<f32, N>,
    extinction: Vec3xN<f32, N>,
    /// What Schlick's approximation has at normal and at grazing incidence.
    f0_f90: [Vec3xN<f32, N>; 2],
    /// Of glass: the index of the other side relative to the viewer's, or a pane's own.
    eta: [f32; N],
    is_thin: [bool; N],
    /// Whether a lane's path may go both ways, and whether it does.
    may_split: [bool; N],
    is_split: [bool; N],
    samples: Goes<N>,
    /// The other way, of lanes that are forked.
    transmitted: Goes<N>,
}

/// How many times as often as its share of the light each way of a fork is followed.
const SPLIT_OVERSAMPLING: f32 = 3.0;

/// Where light goes on, and where its rays start.
#[derive(Clone, Copy, Debug)]
struct Goes<const N: usize> {
    goes: [bool; N],
    direction: Vec3xN<f32, N>,
    weight: Vec3xN<f32, N>,
    squeeze: [f32; N],
    start: Vec3xN<f32, N>,
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

impl<const N: usize> Default for SpecularBsdfBatch<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            is_conductor: [false; N],
            any_conductor: false,
            any_dielectric: false,
            uses_schlick: [false; N],
            any_schlick: false,
            base: [[0.0; N]; 3],
            ior: [[1.0; N]; 3],
            extinction: [[0.0; N]; 3],
            f0_f90: [[[0.0; N]; 3]; 2],
            eta: [1.0; N],
            is_thin: [false; N],
            may_split: [false; N],
            is_split: [false; N],
            samples: Goes::default(),
            transmitted: Goes::default(),
        }
    }
}

impl<const N: usize> SpecularBsdfBatch<N> {
    /// Forgets all.
    #[inline]
    pub fn clear(&mut self) {
        self.is_active = [false; N];
        self.may_split = [false; N];
        (self.any_conductor, self.any_dielectric, self.any_schlick) = (false, false, false);
    }

    /// Whether there is any.
    #[inline]
    pub fn any_active(&self) -> bool {
        self.any_conductor | self.any_dielectric | self.any_schlick
    }

    /// Sets a lane, where the point there is such; its material is. `outside_ior` is the index of refraction of what is around
    /// its matter, and it may go both ways where it `is_split`.
    #[inline]
    pub fn set_lane(
        &mut self,
        (places, lane): (&SurfaceInteractions<N>, usize),
        (world, hit): (&Geometry, &Hit),
        channel: Option<usize>,
        around: f32,
        forks: bool,
    ) {
        let prepared = world.material(hit);
        let (footprint, front) = (places.footprint(lane), places.is_front(lane));
        let base = world.base_color_with(prepared, hit, footprint);
        (
            self.is_conductor[lane],
            self.uses_schlick[lane],
            self.is_thin[lane],
        ) = (false, false, false);
        match &prepared.material.model {
            MaterialModel::Metal(metal) => {
                self.is_conductor[lane] = true;
                self.any_conductor = true;
                set_lane(&mut self.ior, lane, metal.ior);
                set_lane(&mut self.extinction, lane, metal.extinction);
            }
            MaterialModel::Glass(glass) => {
                self.any_dielectric = true;
                self.eta[lane] = dielectric::eta(glass, front, channel, around);
                self.is_thin[lane] = glass.thin;
            }
            MaterialModel::Principled(p) => {
                let seen = ViewContext {
                    channel,
                    outside_ior: around,
                    ..ViewContext::for_lane(places, lane, base)
                };
                let layers =
                    principled::layer_stack(p, &TextureLookup::new(world, hit, footprint), &seen);
                // As it is where textures say nothing else.
                let Fresnel::Schlick { f0, f90, .. } = layers.fresnel else {
                    return;
                };
                if !(layers.is_interface_only() && layers.ggx.effectively_smooth()) {
                    return;
                }
                self.uses_schlick[lane] = true;
                self.any_schlick = true;
                self.eta[lane] = layers.eta;
                set_lane(&mut self.f0_f90[0], lane, f0.to_array());
                set_lane(&mut self.f0_f90[1], lane, f90.to_array());
            }
            _ => return,
        }
        set_lane(&mut self.base, lane, base.to_array());
        self.may_split[lane] = forks && !self.is_conductor[lane];
        self.is_active[lane] = true;
    }

    /// What passes a lane's surface.
    #[inline(always)]
    pub fn transmission(&self, lane: usize) -> Vec3 {
        if self.is_conductor[lane] {
            Vec3::ZERO
        } else {
            get_lane(&self.base, lane).into()
        }
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        self.samples.sample(lane)
    }

    /// The same of what passes the surface, where another path is to follow it.
    #[inline]
    pub fn transmitted_sample(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        self.is_split[lane].then(|| self.transmitted.sample(lane))?
    }
}

impl<const N: usize> SpecularBsdfBatch<N> {
    /// What the lanes reflect, by the cosines of their views.
    #[inline(always)]
    fn reflectance(&self, cosines: &[f32; N]) -> Vec3xN<f32, N> {
        let mut reflected = [[0.0; N]; 3];
        let mut take = |lane: usize, is: bool, color: Vec3| {
            for (out, color) in reflected.iter_mut().zip(color.to_array()) {
                out[lane] = if is { color } else { out[lane] };
            }
        };
        if self.any_dielectric {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let once = dielectric(cosine, self.eta[lane]);
                let all = if self.is_thin[lane] {
                    thin_dielectric(once)
                } else {
                    once
                };
                take(lane, true, Vec3::splat(all));
            }
        }
        if self.any_schlick {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let [f0, f90] = self.f0_f90.each_ref().map(|end| get_lane(end, lane).into());
                let color = schlick_two_sided(f0, f90, cosine, self.eta[lane]);
                take(lane, self.uses_schlick[lane], color);
            }
        }
        if self.any_conductor {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let (ior, extinction) =
                    (get_lane(&self.ior, lane), get_lane(&self.extinction, lane));
                let tint = Vec3::from(get_lane(&self.base, lane));
                let color = tint * conductors(cosine, ior.into(), extinction.into());
                take(lane, self.is_conductor[lane], color);
            }
        }
        reflected
    }
}

impl<const N: usize> Goes<N> {
    #[inline(always)]
    fn put(&mut self, lane: usize, way: &SpecularSample, start: Vec3) {
        self.goes[lane] = way.is_valid;
        self.squeeze[lane] = way.eta_scale;
        set_lane(&mut self.direction, lane, way.wi.to_array());
        set_lane(&mut self.weight, lane, way.weight.to_array());
        set_lane(&mut self.start, lane, start.to_array());
    }

    #[inline]
    fn sample(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        let way = SpecularSample {
            is_valid: self.goes[lane],
            wi: get_lane(&self.direction, lane).into(),
            weight: get_lane(&self.weight, lane).into(),
            eta_scale: self.squeeze[lane],
        };
        way.sample()
            .map(|sample| (sample, get_lane(&self.start, lane).into()))
    }
}

/// Finds where light goes on.
pub(crate) struct SampleSpecular<'a, const N: usize> {
    pub places: &'a SurfaceInteractions<N>,
    /// Which way, where there are two.
    pub choice: &'a [f32; N],
    pub batch: &'a mut SpecularBsdfBatch<N>,
}

impl<const N: usize> WithSimd for SampleSpecular<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            choice,
            batch: points,
        } = self;
        let (mut normals, mut views) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for lane in 0..N {
            let frame = places.shading_frame(lane).with_own_normal();
            set_lane(&mut normals, lane, frame.normal.to_array());
            set_lane(&mut views, lane, frame.to_local(frame.wo).to_array());
        }
        let reflected = points.reflectance(&views[2]);
        // What passes the surface is found where any path follows it besides.
        let any_forks = points.may_split != [false; N];
        for through in [false, true] {
            if through && !any_forks {
                break;
            }
            let mut goes = Goes::default();
            for (lane, &choice) in choice.iter().enumerate() {
                let frame = places
                    .shading_frame(lane)
                    .with_axis(get_lane(&normals, lane).into());
                let beyond = if points.is_conductor[lane] | points.is_thin[lane] {
                    1.0
                } else {
                    points.eta[lane]
                };
                let (view, reflected) = (
                    get_lane(&views, lane).into(),
                    get_lane(&reflected, lane).into(),
                );
                let (forks, transmission) = (points.may_split[lane], points.transmission(lane));
                let often = if forks { SPLIT_OVERSAMPLING } else { 1.0 };
                let smooth = SpecularBsdf::new(view, reflected, transmission, beyond, often);
                points.is_split[lane] = forks & smooth.is_split(choice);
                let way =
                    smooth.sample_branch(&frame, if through { FORCE_TRANSMISSION } else { choice });
                goes.put(lane, &way, places.offset_ray_origin(lane, way.wi).as_vec3());
            }
            if through {
                points.transmitted = goes;
            } else {
                points.samples = goes;
            }
        }
    }
}
