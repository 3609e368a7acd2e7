//! Brightest path of a sample: the surfaces that it met, and the ray that contributed the most light.

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit};

use crate::control::Control;
use crate::error::RenderError;
use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::path::PathScratch;
use crate::integrator::path_state::PathState;
use crate::integrator::path_tracer::{PathSettings, PathTracer};
use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::prepare::world::PreparedWorld;

/// A path, and the ray that contributed the most light to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrightPath {
    /// Largest colour component of the sample's radiance.
    pub radiance: f32,
    /// Instances that the path met, starting at the camera; the light of the ray arrives at the last instance.
    pub instances: Vec<u32>,
    /// Start of the ray, scene-local.
    pub origin: DVec3,
    /// Unit direction of the ray, towards the light.
    pub direction: Vec3,
    /// Distance to the light; infinite for suns and skies.
    pub distance: f64,
    /// Largest colour component of the radiance that arrived along this ray.
    light: f32,
}

impl BrightPath {
    /// Records light that arrived along a ray, if it is brighter than all earlier light.
    fn note(&mut self, light: f32, instances: &[u32], (origin, direction, distance): (DVec3, Vec3, f64)) {
        if light > self.light {
            let instances = instances.to_vec();
            *self = Self { radiance: self.radiance, instances, origin, direction, distance, light };
        }
    }
}

/// A path in progress, and the instances that the path has met.
#[derive(Clone, Debug, Default)]
struct PathRecord {
    instances: Vec<u32>,
    position: DVec3,
}

/// The paths of one batch, each with its brightest ray.
struct Recorder<'a, 'b> {
    tracer: PathTracer<'a>,
    batch: &'a CameraRayBatch<'b>,
    /// Brightest ray so far, for each camera ray.
    bright: Vec<BrightPath>,
    /// For each path: the surfaces met so far.
    records: Vec<PathRecord>,
}

/// Traces the paths of a batch in the same way as [`path::radiance`](crate::integrator::path::radiance). Returns the
/// radiance along every camera ray with its brightest path.
pub(crate) fn bright_paths(
    world: &PreparedWorld,
    settings: &PathSettings,
    batch: &CameraRayBatch,
    control: &Control,
    scratch: &mut PathScratch,
) -> Result<Vec<BrightPath>, RenderError> {
    let count = batch.hits.len();
    let tracer = PathTracer::new(world, settings, batch);
    scratch.generate_camera_paths(&tracer, batch);
    let records = vec![PathRecord::default(); count];
    let mut recorder = Recorder { tracer, batch, bright: vec![BrightPath::default(); count], records };
    let (mut radiance, mut is_background) = (vec![Vec3::ZERO; count], vec![false; count]);
    while !scratch.active.is_empty() {
        control.check()?;
        scratch.cross_media(&recorder.tracer, batch, &mut radiance, &mut is_background);
        recorder.note_ends(scratch);
        scratch.handle_escaped_rays(&recorder.tracer, &mut radiance, &mut is_background);
        let lit: Vec<u32> = scratch.active.clone();
        scratch.evaluate_materials(&recorder.tracer, &mut radiance, &mut is_background);
        recorder.note_shadow_rays(scratch, &lit);
        recorder.follow_splits(scratch, &lit);
        scratch.trace_rays(&recorder.tracer, batch, &mut radiance);
        recorder.tracer.bounce += 1;
    }
    for (bright, radiance) in recorder.bright.iter_mut().zip(radiance) {
        bright.radiance = radiance.max_element();
    }
    Ok(recorder.bright)
}

impl Recorder<'_, '_> {
    /// Records the light at the ends of a bounce's rays: emission, lights that are crossed, and the sky.
    fn note_ends(&mut self, scratch: &PathScratch) {
        for (&index, hit) in scratch.active.iter().zip(&scratch.hits) {
            let path = &scratch.paths[index as usize];
            let record = &mut self.records[index as usize];
            let distance = if is_miss(hit) { f64::INFINITY } else { f64::from(hit.t) };
            let start = path.prev_context.position;
            let (lights, _) = self.tracer.lights_of(path);
            lights.intersect_visible(
                &path.prev_context,
                path.light_sampling,
                path.direction,
                distance,
                |_, at, radiance, pdf| {
                    let light = path.throughput * radiance * self.tracer.mis_weight(path, pdf);
                    let ray = (start, path.direction, at);
                    self.bright[path.ray_index()].note(light.max_element(), &record.instances, ray);
                },
            );
            let light = self.tracer.light_at_end(path, hit, distance);
            let ray = (start, path.direction, distance);
            self.bright[path.ray_index()].note(light.max_element(), &record.instances, ray);
            if !is_miss(hit) {
                record.instances.push(hit.instance);
                record.position = start + path.direction.as_dvec3() * distance;
            }
        }
    }

    /// Records the light that the shadow rays of a bounce find. `lit` are the indices of the paths that queued them.
    fn note_shadow_rays(&mut self, scratch: &PathScratch, lit: &[u32]) {
        let queues = scratch.queues.shadow_rays.iter().chain([&scratch.queues.bsdf_shadow_rays]);
        for (ray, index, light) in queues.flat_map(ShadowRayQueue::entries) {
            if light.max_element() <= self.bright[index].light {
                continue;
            }
            let mut seen = [Vec3::ZERO];
            let mut one = ShadowRayQueue::default();
            one.push(ray, 0, light);
            one.trace(self.tracer.geometry, self.batch.scene, Coherence::Incoherent, None, None, &mut seen);
            let origin = Vec3::from(ray.origin).as_dvec3();
            let direction = Vec3::from(ray.direction);
            let distance = f64::from(ray.t_max * direction.length());
            let Some(path) = self.path_at(scratch, lit, index, origin) else {
                continue;
            };
            let ray = (origin, direction.normalize_or_zero(), distance);
            self.bright[index].note(seen[0].max_element(), &self.records[path].instances, ray);
        }
    }

    /// Copies the list of instances to paths that began when a path followed both branches of a dielectric.
    fn follow_splits(&mut self, scratch: &PathScratch, lit: &[u32]) {
        for index in self.records.len()..scratch.paths.len() {
            let path = &scratch.paths[index];
            let from = self.path_at(scratch, lit, path.ray_index(), path.prev_context.position);
            let record = from.map(|path| self.records[path].clone());
            self.records.push(record.unwrap_or_default());
        }
    }

    /// Among the paths `lit` of a camera ray, the index of the path whose surface is nearest to a point.
    fn path_at(&self, scratch: &PathScratch, lit: &[u32], ray_index: usize, point: DVec3) -> Option<usize> {
        let own = lit.iter().map(|&index| index as usize).filter(|&path| scratch.paths[path].ray_index() == ray_index);
        let far = |path: usize| self.records[path].position.distance_squared(point);
        own.min_by(|&a, &b| far(a).total_cmp(&far(b)))
    }
}

impl PathTracer<'_> {
    /// Light that a path finds at the end of its ray: emission of the surface, or the sky.
    fn light_at_end(&self, path: &PathState, hit: &Hit, distance: f64) -> Vec3 {
        let mut light = Vec3::ZERO;
        if !is_miss(hit) {
            let material = &self.geometry.material(hit).material;
            self.add_emission(path, material, hit, distance, &mut light);
        } else if !(path.is_camera_ray && self.settings.hide_environment) {
            light += self.environment_light(path, None);
        }
        light
    }
}
