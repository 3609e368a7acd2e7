//! What paths do at matte surfaces, many at a time: what [`PathTracer::step`] does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::{Hit, WithSimd};

use crate::bsdf::ShadingPoint;
use crate::bsdf::diffuse::Diffuse;
use crate::bsdf::{BsdfEvals, BsdfSample};
use crate::guiding::cones::{GuidingCones, mixture_weight};
use crate::integrator::batch::hits::HitBatch;
use crate::integrator::nested_dielectrics::InterfaceTransition;
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Paths at matte surfaces in empty space. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct DiffuseBatch<const N: usize> {
    /// Which lanes are such.
    pub is_active: [bool; N],
    pub albedo: Vec3xN<f32, N>,
    pub guiding: GuidingCones<N>,
    leaving: Leaving<N>,
}

/// Where paths go on: whether that is away from the triangle, its density, and where the ray starts.
#[derive(Clone, Copy, Debug)]
struct Leaving<const N: usize> {
    away: [bool; N],
    pdf: [f32; N],
    /// What the albedo is multiplied by for the weight.
    ratio: [f32; N],
    start: Vec3xN<f32, N>,
}

impl<const N: usize> Default for Leaving<N> {
    fn default() -> Self {
        Self {
            away: [false; N],
            pdf: [0.0; N],
            ratio: [1.0; N],
            start: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for DiffuseBatch<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            albedo: [[0.0; N]; 3],
            guiding: GuidingCones::default(),
            leaving: Leaving::default(),
        }
    }
}

impl<const N: usize> DiffuseBatch<N> {
    /// Sets a lane.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, albedo: Vec3) {
        self.is_active[lane] = true;
        set_lane(&mut self.albedo, lane, albedo.to_array());
    }

    /// Whether there is any.
    #[inline]
    pub fn any_active(&self) -> bool {
        self.is_active != [false; N]
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn eval(
        &self,
        places: &SurfaceInteractions<N>,
        directions: &Vec3xN<f32, N>,
    ) -> BsdfEvals<N> {
        let (mut values, mut cosines) = (BsdfEvals::default(), [0.0; N]);
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            *cosine = places
                .shading_normal(lane)
                .dot(get_lane(directions, lane).into());
        }
        let densities = self.guiding.pdfs(directions, &cosines);
        for lane in 0..N {
            let (direction, cosine) = (Vec3::from(get_lane(directions, lane)), cosines[lane]);
            let dark = (places.geometric_normal(lane).dot(direction) <= 0.0) | (cosine <= 0.0);
            let value = Vec3::from(get_lane(&self.albedo, lane)) * FRAC_1_PI * cosine;
            let value = if dark { Vec3::ZERO } else { value };
            values.pdf[lane] = if dark { 0.0 } else { densities[lane] };
            set_lane(&mut values.value, lane, value.to_array());
        }
        values
    }

    /// The direction in which a path goes on, which is this one, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize, direction: Vec3) -> Option<(BsdfSample, Vec3)> {
        let Leaving {
            away,
            pdf,
            ratio,
            start,
        } = &self.leaving;
        away[lane].then(|| {
            let sample = BsdfSample {
                wi: direction,
                weight: Vec3::from(get_lane(&self.albedo, lane)) * ratio[lane],
                pdf: pdf[lane],
                is_specular: false,
                eta_scale: 1.0,
            };
            (sample, get_lane(start, lane).into())
        })
    }
}

/// Finds where paths go on.
pub(crate) struct Scatter<'a, const N: usize> {
    pub places: &'a SurfaceInteractions<N>,
    pub directions: &'a Vec3xN<f32, N>,
    pub mattes: &'a mut DiffuseBatch<N>,
}

impl<const N: usize> WithSimd for Scatter<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            directions,
            mattes,
        } = self;
        let mut leaving = Leaving::default();
        let mut cosines = [0.0; N];
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            let direction = Vec3::from(get_lane(directions, lane));
            let start = places.offset_ray_origin(lane, direction).as_vec3();
            *cosine = places.shading_normal(lane).dot(direction);
            leaving.away[lane] = places.geometric_normal(lane).dot(direction) > 0.0;
            set_lane(&mut leaving.start, lane, start.to_array());
        }
        leaving.pdf = mattes.guiding.pdfs(directions, &cosines);
        if mattes.guiding.has_cones() {
            for (lane, ratio) in leaving.ratio.iter_mut().enumerate() {
                *ratio = mixture_weight(cosines[lane], leaving.pdf[lane]);
            }
        }
        mattes.leaving = leaving;
    }
}

impl PathTracer<'_> {
    /// [`PathTracer::step`] at a lane of [`DiffuseBatch`].
    #[inline]
    pub(crate) fn shade_diffuse(
        &self,
        path: &mut PathState,
        meetings: &HitBatch,
        (number, lane): (usize, usize),
        hit: &Hit,
        wave: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitBatch {
            places,
            diffuse: mattes,
            path_lanes: arriving,
            ..
        } = meetings;
        let out = &mut radiance[path.ray_index];
        let from = LightSampleContext {
            position: places.position(lane),
            normal: places.geometric_normal(lane),
        };
        if arriving.may_cross_light[lane] {
            let distance = (from.position - path.prev_context.position).length();
            self.add_intersected_lights(path, distance, out);
        }
        if !self.is_free_bounce(path) && path.depth >= self.settings.max_depth {
            return false;
        }
        let direction = get_lane(&meetings.diffuse_directions, lane).into();
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.light_sampling(path) != self.light_sampling_of_bounce();
        if self.batch_direct_lighting && !late {
            meetings
                .direct_lighting
                .push_shadow_rays(lane, path.ray_index, &mut wave.shadow_rays);
        } else if self.has_light_samples || self.settings.ambient_term.is_some() {
            let meeting = meetings.view(self, number, lane, hit);
            let surface = ShadingPoint {
                interaction: &meeting.place,
                frame: meeting.place.shading_frame(path.direction),
                bsdf: Diffuse {
                    albedo: get_lane(&mattes.albedo, lane).into(),
                    sampled_direction: direction,
                    guiding: mattes
                        .guiding
                        .has_cones()
                        .then_some((&mattes.guiding, lane)),
                },
            };
            let skin = InterfaceTransition::no_interface(path.interior_list);
            self.sample_lights(path, &surface, skin, &meeting, wave, out);
        }
        match mattes.sample(lane, direction) {
            Some((sample, start)) => {
                self.continue_path(path, &sample, start, from, path.interior_list, wave)
            }
            None => false,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use glam::{DAffine3, DVec3};
    use raycam_bvh::dispatch_simd;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, Object, World};

    use super::*;
    use crate::bsdf::BsdfModel;
    use crate::control::Control;
    use crate::guiding::caustic_casters::CausticCaster;
    use crate::guiding::sample_cones::SampleGuided;
    use crate::prepare::world::PreparedWorld;
    use crate::soa::{LANES, set_triangle};

    pub fn unit(i: usize) -> Vec3 {
        let angle = i as f32;
        Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()).normalize()
    }

    /// Surfaces of a ball, the first of which is `first`, and directions; every second time they aim.
    pub fn some(
        first: usize,
    ) -> (
        SurfaceInteractions<LANES>,
        DiffuseBatch<LANES>,
        Vec3xN<f32, LANES>,
    ) {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let (mut places, mut mattes) = (
            SurfaceInteractions::<LANES>::default(),
            DiffuseBatch::default(),
        );
        let mut directions = [[0.0; LANES]; 3];
        let corners = places.clear();
        for lane in 0..LANES {
            set_triangle(
                corners,
                lane,
                world.geometry.corners(0, (first + lane) as u32),
            );
        }
        for lane in 0..LANES {
            let i = first + lane;
            let hit = Hit {
                t: 1.0,
                u: 0.2,
                v: 0.3,
                instance: 0,
                triangle: i as u32,
            };
            places.set_lane(lane, &world.geometry, unit(i), &hit, 0.0);
            mattes.is_active[lane] = true;
            set_lane(&mut directions, lane, unit(2 * i + 1).to_array());
            set_lane(&mut mattes.albedo, lane, unit(i).abs().to_array());
        }
        dispatch_simd(&mut places);
        if first.is_multiple_of(2 * LANES) {
            let mirrors = [DVec3::X, DVec3::Y].map(|center| CausticCaster {
                instance: 0,
                center: 2.0 * center,
                radius: 0.7,
            });
            let random: Vec<f32> = (0..LANES).map(|i| unit(i + first).x.abs()).collect();
            dispatch_simd(SampleGuided {
                casters: &mirrors,
                maps: &[],
                places: &places,
                active: &[true; LANES],
                random: &[0, 1].map(|_| std::array::from_fn(|lane| random[lane])),
                cones: &mut mattes.guiding,
                out: &mut directions,
            });
        }
        (places, mattes, directions)
    }

    /// The surface of a lane by itself.
    pub fn alone<'a>(
        mattes: &'a DiffuseBatch<LANES>,
        directions: &Vec3xN<f32, LANES>,
        lane: usize,
    ) -> Diffuse<'a> {
        Diffuse {
            albedo: get_lane(&mattes.albedo, lane).into(),
            sampled_direction: get_lane(directions, lane).into(),
            guiding: mattes
                .guiding
                .has_cones()
                .then_some((&mattes.guiding, lane)),
        }
    }

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let mut away = 0;
        for first in (0..320).step_by(LANES) {
            let (places, mut mattes, directions) = some(first);
            dispatch_simd(Scatter {
                places: &places,
                directions: &directions,
                mattes: &mut mattes,
            });
            for lane in 0..LANES {
                let place = places.lane(lane);
                let matte = alone(&mattes, &directions, lane);
                let frame = place.shading_frame(unit(first + lane));
                let alone = matte
                    .sample(&frame, [0.0; 3])
                    .map(|sample| (sample, place.offset_ray_origin(sample.wi).as_vec3()));
                let lanes = mattes.sample(lane, get_lane(&directions, lane).into());
                assert_eq!(format!("{lanes:?}"), format!("{alone:?}"));
                away += usize::from(alone.is_some());
            }
        }
        assert!(away > 60, "{away}");
    }
}
