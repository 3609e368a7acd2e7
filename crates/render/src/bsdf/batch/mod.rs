//! BSDFs of [`LANES`] points at a time, field by field.
//!
//! A model consists of its lanes' parameters and three pure functions: view terms, sampling and evaluation. Their loops
//! over lanes call the same formulas of `lobes` and `bsdf` as the BSDF of one point, select values instead of
//! branching, and compile to vector code. Every lane has the same bits as [`crate::bsdf::layered::LayeredBsdf`]; a test
//! compares them.

pub(crate) mod clearcoat;
pub(crate) mod diffuse;
pub(crate) mod glossy;
pub(crate) mod rough_dielectric;
pub(crate) mod specular;

use glam::Vec3;
use raycam_bvh::{WithSimd, dispatch_simd};

use crate::bsdf::diffuse::Diffuse;
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::{BsdfEval, BsdfSample};
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::shading_frame::ShadingFrame;
use crate::prepare::geometry::Geometry;
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// Surface points of the lanes, and the geometry that contains them.
#[derive(Clone, Copy)]
pub(crate) struct LaneContext<'a> {
    pub geometry: &'a Geometry,
    pub interactions: &'a SurfaceInteractions<LANES>,
}

/// Random numbers of the lanes: two for a direction, and one that selects a lobe.
#[derive(Clone, Copy)]
pub(crate) struct LaneRandoms<'a> {
    pub direction: &'a [[f32; LANES]; 2],
    pub lobe: &'a [f32; LANES],
}

impl LaneRandoms<'_> {
    #[inline(always)]
    pub fn direction_of(&self, lane: usize) -> [f32; 2] {
        [self.direction[0][lane], self.direction[1][lane]]
    }
}

/// BSDF of many points: the parameters of all lanes.
pub(crate) trait BatchModel: Default {
    /// True if light sampling never contributes to points of this model.
    const IS_SPECULAR: bool = false;
    /// True if light may come from the far side of the surface.
    const IS_TRANSMISSIVE: bool = false;
    /// True if materials of this model may emit.
    const MAY_EMIT: bool = false;

    /// Terms that depend only on the viewing directions.
    type View: Default;

    /// Resets the flags that state whether any lane has a property.
    fn clear(&mut self) {}

    /// Computes the view terms of the active lanes from the lanes' shading normals.
    fn prepare_view(&self, lanes: &ActiveLanes, context: LaneContext, randoms: LaneRandoms) -> Self::View;

    /// Samples a direction for every lane.
    fn sample(&self, view: &Self::View, lanes: &ActiveLanes, context: LaneContext, randoms: LaneRandoms)
    -> BsdfSamples;

    /// Values and densities for the world directions `wi`, one per lane.
    fn eval(&self, view: &Self::View, lanes: &ActiveLanes, context: LaneContext, wi: &Vec3xN<f32, LANES>) -> BsdfEvals;

    /// True if light from the far side of a lane's surface reaches the viewer.
    fn is_transmissive(&self, _lane: usize) -> bool {
        Self::IS_TRANSMISSIVE
    }

    /// Diffuse BSDF of a single lane, for models whose direct lighting may be computed lane by lane;
    /// otherwise `None`.
    fn single(&self, _lane: usize) -> Option<Diffuse<'_>> {
        None
    }

    /// Refracted sample of a lane whose path follows both branches, and the origin of its ray.
    fn transmitted_sample(_view: &Self::View, _lane: usize) -> Option<(BsdfSample, Vec3)> {
        None
    }
}

/// Batch model whose lanes are set from layer stacks.
pub(crate) trait LayeredBatchModel: BatchModel {
    /// Sets a lane. Returns false if the model does not support these layers.
    fn set_layers(&mut self, lane: usize, hit: &MaterialHit, stack: &LayerStack) -> bool;
}

/// Active lanes of a model, and their shading normals.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ActiveLanes {
    pub is_active: [bool; LANES],
    any: bool,
    pub normals: Vec3xN<f32, LANES>,
}

/// A model, its lanes, and the values computed for these lanes.
#[derive(Default)]
pub(crate) struct BsdfBatch<M: BatchModel> {
    pub lanes: ActiveLanes,
    pub model: M,
    pub view: M::View,
    pub samples: BsdfSamples,
}

impl<M: BatchModel> BsdfBatch<M> {
    /// Deactivates all lanes.
    #[inline]
    pub fn clear(&mut self) {
        self.lanes.is_active = [false; LANES];
        self.lanes.any = false;
        self.model.clear();
    }

    #[inline]
    pub fn any_active(&self) -> bool {
        self.lanes.any
    }

    #[inline]
    pub fn is_active(&self, lane: usize) -> bool {
        self.lanes.is_active[lane]
    }

    #[inline]
    pub fn activate(&mut self, lane: usize, normal: Vec3) {
        self.lanes.is_active[lane] = true;
        self.lanes.any = true;
        set_lane(&mut self.lanes.normals, lane, normal.to_array());
    }

    /// Computes the view terms and the samples of all lanes, if any lane is active.
    pub fn sample_all(&mut self, context: LaneContext, randoms: LaneRandoms) {
        if self.any_active() {
            dispatch_simd(SampleBatch { batch: self, context, randoms });
        }
    }

    /// Values and densities for the world directions `wi`, one per lane.
    #[inline(always)]
    pub fn eval(&self, context: LaneContext, wi: &Vec3xN<f32, LANES>) -> BsdfEvals {
        self.model.eval(&self.view, &self.lanes, context, wi)
    }
}

impl<M: LayeredBatchModel> BsdfBatch<M> {
    /// Activates a lane if the model supports the material at a hit. Returns true if the model supports the material.
    #[inline]
    pub fn load(&mut self, lane: usize, hit: &MaterialHit) -> bool {
        let Some(stack) = hit.layer_stack() else {
            return false;
        };
        let is_covered = self.model.set_layers(lane, hit, &stack);
        if is_covered {
            let normal = hit.mapped_mirror_normal().unwrap_or(hit.unmapped_frame.normal);
            self.activate(lane, normal);
        }
        is_covered
    }
}

struct SampleBatch<'a, M: BatchModel> {
    batch: &'a mut BsdfBatch<M>,
    context: LaneContext<'a>,
    randoms: LaneRandoms<'a>,
}

impl<M: BatchModel> WithSimd for SampleBatch<'_, M> {
    #[inline(always)]
    fn run(self) {
        let Self { batch, context, randoms } = self;
        batch.view = batch.model.prepare_view(&batch.lanes, context, randoms);
        batch.samples = batch.model.sample(&batch.view, &batch.lanes, context, randoms);
    }
}

/// A [`BsdfSample`] and the origin of its ray for every lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfSamples {
    pub is_valid: [bool; LANES],
    pub wi: Vec3xN<f32, LANES>,
    pub weight: Vec3xN<f32, LANES>,
    pub pdf: [f32; LANES],
    pub is_specular: [bool; LANES],
    pub eta_scale: [f32; LANES],
    pub origin: Vec3xN<f32, LANES>,
}

impl Default for BsdfSamples {
    fn default() -> Self {
        Self {
            is_valid: [false; LANES],
            wi: [[0.0; LANES]; 3],
            weight: [[0.0; LANES]; 3],
            pdf: [0.0; LANES],
            is_specular: [false; LANES],
            eta_scale: [1.0; LANES],
            origin: [[0.0; LANES]; 3],
        }
    }
}

impl BsdfSamples {
    /// Sets the world direction of a lane, and the origin of its ray.
    #[inline(always)]
    pub fn set_direction(&mut self, context: LaneContext, lane: usize, wi: Vec3) {
        let origin = context.interactions.offset_ray_origin(lane, wi).as_vec3();
        set_lane(&mut self.wi, lane, wi.to_array());
        set_lane(&mut self.origin, lane, origin.to_array());
    }

    /// Sets the densities and weights of samples that are not specular from the evaluations `evals`.
    #[inline(always)]
    pub fn set_evals(&mut self, evals: &BsdfEvals) {
        for lane in 0..LANES {
            let (pdf, is_specular) = (evals.pdf[lane], self.is_specular[lane]);
            let weight = lane_vec3(&evals.value, lane) / pdf;
            let own = lane_vec3(&self.weight, lane);
            let weight = if is_specular { own } else { weight };
            self.is_valid[lane] &= is_specular | (pdf > 0.0);
            self.pdf[lane] = if is_specular { 0.0 } else { pdf };
            set_lane(&mut self.weight, lane, weight.to_array());
        }
    }

    /// Returns a lane's sample and the origin of its ray.
    #[inline]
    pub fn get(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        self.is_valid[lane].then(|| {
            let sample = BsdfSample {
                wi: lane_vec3(&self.wi, lane),
                weight: lane_vec3(&self.weight, lane),
                pdf: self.pdf[lane],
                is_specular: self.is_specular[lane],
                eta_scale: self.eta_scale[lane],
            };
            (sample, lane_vec3(&self.origin, lane))
        })
    }
}

/// A [`BsdfEval`] for every lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BsdfEvals {
    pub value: Vec3xN<f32, LANES>,
    pub pdf: [f32; LANES],
}

impl BsdfEvals {
    /// Sets the value and the density of a lane if `is_lit` is true; otherwise sets both to zero.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, is_lit: bool, BsdfEval { value, pdf }: BsdfEval) {
        let value = if is_lit { value } else { Vec3::ZERO };
        self.pdf[lane] = if is_lit { pdf } else { 0.0 };
        set_lane(&mut self.value, lane, value.to_array());
    }

    /// Copies the lanes whose `mask` is true from `others`.
    #[inline(always)]
    pub fn select_lanes(&mut self, mask: &[bool; LANES], others: &Self) {
        for (lane, &is_selected) in mask.iter().enumerate() {
            let from = if is_selected { others } else { &*self };
            let (value, pdf) = (lane_vec3(&from.value, lane), from.pdf[lane]);
            set_lane(&mut self.value, lane, value.to_array());
            self.pdf[lane] = pdf;
        }
    }
}

/// Two colours for every lane: the reflectance at normal incidence and at grazing incidence.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct F0F90Lanes([Vec3xN<f32, LANES>; 2]);

impl F0F90Lanes {
    #[inline(always)]
    pub fn set(&mut self, lane: usize, (f0, f90): (Vec3, Vec3)) {
        set_lane(&mut self.0[0], lane, f0.to_array());
        set_lane(&mut self.0[1], lane, f90.to_array());
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> (Vec3, Vec3) {
        (lane_vec3(&self.0[0], lane), lane_vec3(&self.0[1], lane))
    }
}

/// Shading normals, bent towards the viewer, and the local directions towards the viewer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LocalView {
    normals: Vec3xN<f32, LANES>,
    wo: Vec3xN<f32, LANES>,
}

impl LocalView {
    #[inline(always)]
    pub fn new(lanes: &ActiveLanes, context: LaneContext) -> Self {
        let mut view = Self::default();
        for lane in 0..LANES {
            let frame = context.interactions.shading_frame(lane);
            let normal = frame.bend_towards_viewer(lane_vec3(&lanes.normals, lane));
            let wo = frame.with_axis(normal).to_local(frame.wo);
            set_lane(&mut view.normals, lane, normal.to_array());
            set_lane(&mut view.wo, lane, wo.to_array());
        }
        view
    }

    #[inline(always)]
    pub fn frame(&self, context: LaneContext, lane: usize) -> ShadingFrame {
        let frame = context.interactions.shading_frame(lane);
        frame.with_axis(lane_vec3(&self.normals, lane))
    }

    #[inline(always)]
    pub fn wo(&self, lane: usize) -> Vec3 {
        lane_vec3(&self.wo, lane)
    }

    /// Cosines between the normals and the directions towards the viewer.
    #[inline(always)]
    pub fn cosines(&self) -> &[f32; LANES] {
        &self.wo[2]
    }
}
