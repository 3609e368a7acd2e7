//! The path integrator, and `direct`, a path integrator with one bounce behind specular surfaces.
//!
//! Every iteration of the loop is one bounce of all paths of a tile: escaped rays add the environment's light, hits are
//! shaded in chunks, and then one batch of shadow rays and one batch of closest-hit rays are traced.

use glam::{DVec3, Vec3};
use raycam_bvh::{Coherence, Hit};
use raycam_scene::world::RayVisibility;

use crate::control::Control;
use crate::error::RenderError;
use crate::integrator::batch::hits::{Chunk, HitBatch};
use crate::integrator::batch::sort::KindSort;
use crate::integrator::camera_ray_batch::{CameraRayBatch, is_miss};
use crate::integrator::closed_form_fog::RayBegins;
use crate::integrator::path_state::{LightSearch, PathState, WavefrontQueues};
use crate::integrator::path_tracer::{PathSettings, PathTracer};
use crate::interaction::LightSampleContext;
use crate::light::air_light::AirLight;
use crate::media::map::{Borders, MediaMap, MediumRay};
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::world::PreparedWorld;
use crate::settings::Catchers;
use crate::soa::LANES;

/// Buffers for the paths of a batch, reused for every batch.
#[derive(Default)]
pub(crate) struct PathScratch {
    pub(super) paths: Vec<PathState>,
    /// Indices of the paths that have a ray in this bounce and in the next, and the hits of these rays.
    pub(super) active: Vec<u32>,
    next_active: Vec<u32>,
    pub(super) hits: Vec<Hit>,
    /// For the escaped rays of a bounce: the environment's radiance, and the density with which light sampling selects
    /// this direction.
    escaped: Vec<(Vec3, f32)>,
    /// Distances at which the rays begin, in worlds with fog.
    ray_begins: RayBegins,
    /// Rays of a bounce through media, and the borders that they cross.
    media_rays: Vec<MediumRay>,
    borders: Borders,
    kind_sort: KindSort,
    hit_batch: HitBatch,
    pub(super) queues: WavefrontQueues,
    /// Values of the passes, ray by ray.
    pub passes: Vec<Vec3>,
}

/// Adds the radiance along every camera ray to `radiance`. Sets `is_background` where a ray escapes before it is
/// scattered.
pub(crate) fn radiance(
    world: &PreparedWorld,
    settings: &PathSettings,
    batch: &CameraRayBatch,
    control: &Control,
    scratch: &mut PathScratch,
    (radiance, is_background): (&mut [Vec3], &mut [bool]),
) -> Result<(), RenderError> {
    let mut tracer = PathTracer::new(world, settings, batch);
    scratch.generate_camera_paths(&tracer, batch);
    while !scratch.active.is_empty() {
        control.check()?;
        scratch.cross_media(&tracer, batch, radiance, is_background);
        scratch.handle_escaped_rays(&tracer, radiance, is_background);
        scratch.evaluate_materials(&tracer, radiance, is_background);
        scratch.trace_rays(&tracer, batch, radiance);
        tracer.bounce += 1;
    }
    Ok(())
}

impl PathScratch {
    /// Starts one path for every camera ray.
    pub(super) fn generate_camera_paths(&mut self, tracer: &PathTracer, batch: &CameraRayBatch) {
        self.queues.clear(tracer.max_light_samples(), tracer.settings.media.is_some());
        self.next_active.clear();
        self.paths.clear();
        // The media are found once per starting point, because the rays of a batch mostly start at one point.
        let mut known = (DVec3::NAN, InteriorList::default());
        let has_bodies = !tracer.geometry.bodies.is_empty();
        let mut interior_at = |origin: DVec3, direction: Vec3| {
            let start = origin - direction.as_dvec3() * batch.start_depth;
            if has_bodies && known.0 != start {
                known = (start, tracer.geometry.interior_at(start));
            }
            known.1
        };
        let rays = batch.origins.iter().zip(batch.directions).enumerate();
        let paths = rays.map(|(ray_index, (&position, &direction))| PathState {
            camera_ray: ray_index as u32,
            way: 0,
            throughput: Vec3::ONE,
            direction,
            prev_context: LightSampleContext { position, normal: Vec3::ZERO },
            passed_distance: 0.0,
            bsdf_pdf: 0.0,
            specular_bounce: true,
            is_camera_ray: true,
            split_count: 0,
            light_search: LightSearch::All,
            light_sampling: tracer.settings.light_sampling,
            depth: 1,
            interior_list: interior_at(position, direction),
            wavelength_channel: None,
            eta_scale: 1.0,
            ray_cone: batch.ray_cones[ray_index],
        });
        self.paths.extend(paths);
        self.hits.clear();
        self.hits.extend_from_slice(batch.hits);
        self.active.clear();
        self.active.extend(0..self.paths.len() as u32);
    }

    /// Moves the paths through fog and other media. A path that a medium scatters continues or ends before its hit.
    pub(super) fn cross_media(
        &mut self,
        tracer: &PathTracer,
        batch: &CameraRayBatch,
        radiance: &mut [Vec3],
        is_background: &mut [bool],
    ) {
        if let Some(media) = &tracer.settings.media {
            self.scatter_in_media(tracer, media, batch, radiance, is_background);
        } else if let Some((media, air_light)) = &tracer.settings.closed_form {
            self.apply_closed_form(tracer, (media, air_light), batch, radiance);
        }
    }

    /// Moves the paths through scattering media.
    #[inline(never)]
    fn scatter_in_media(
        &mut self,
        tracer: &PathTracer,
        media: &MediaMap,
        batch: &CameraRayBatch,
        radiance: &mut [Vec3],
        is_background: &mut [bool],
    ) {
        let Self { paths, active, next_active, hits, ray_begins, media_rays, borders, queues, .. } = self;
        if tracer.bounce == 0 {
            ray_begins.clear();
        }
        media_rays.clear();
        media_rays.extend(active.iter().zip(&*hits).map(|(&index, hit)| {
            let path = &paths[index as usize];
            let begin = ray_begins.advance(tracer.geometry, index as usize, path, hit, batch.start_depth);
            tracer.ray_through_media(path, hit, begin)
        }));
        borders.find(media, media_rays.iter());
        let mut count = 0;
        for i in 0..active.len() {
            let (index, hit) = (active[i], hits[i]);
            let path = &mut paths[index as usize];
            let (ray_index, was_camera_ray) = (path.ray_index(), path.is_camera_ray);
            let mut continues = false;
            let out = (&mut radiance[ray_index], &mut continues);
            let ray = (&media_rays[i], borders.of_ray(i));
            if tracer.cross_media(media, path, &hit, ray, queues, out) {
                (active[count], hits[count]) = (index, hit);
                count += 1;
                continue;
            }
            is_background[ray_index] |= was_camera_ray && is_miss(&hit);
            if continues {
                next_active.push(index);
            }
        }
        active.truncate(count);
        hits.truncate(count);
    }

    /// Dims the paths by the media of their rays, in closed form.
    #[inline(never)]
    fn apply_closed_form(
        &mut self,
        tracer: &PathTracer,
        media: (&MediaMap, &AirLight),
        batch: &CameraRayBatch,
        radiance: &mut [Vec3],
    ) {
        if tracer.bounce == 0 {
            self.ray_begins.clear();
        }
        for (&index, hit) in self.active.iter().zip(&self.hits) {
            let path = &mut self.paths[index as usize];
            let begin = self.ray_begins.advance(tracer.geometry, index as usize, path, hit, batch.start_depth);
            tracer.apply_closed_form(media, path, hit, begin, &mut radiance[path.ray_index()]);
        }
    }

    /// Adds the light that escaped rays find, and removes the paths of these rays.
    pub(super) fn handle_escaped_rays(
        &mut self,
        tracer: &PathTracer,
        radiance: &mut [Vec3],
        is_background: &mut [bool],
    ) {
        let Self { paths, active, hits, escaped, .. } = self;
        let environment = tracer.lights.environment();
        if let Some((_, environment)) = environment {
            let misses = active.iter().zip(&*hits).filter(|(_, hit)| is_miss(hit));
            let directions = misses.map(|(&path, _)| paths[path as usize].direction);
            environment.lookup_many(directions, escaped);
        }
        let mut escaped = escaped.iter();
        let mut count = 0;
        for i in 0..active.len() {
            let path = &paths[active[i] as usize];
            if is_miss(&hits[i]) {
                is_background[path.ray_index()] |= path.is_camera_ray;
                let lookup = environment.and_then(|(index, _)| Some((index, *escaped.next()?)));
                tracer.handle_escaped_ray(path, lookup, &mut radiance[path.ray_index()]);
            } else {
                (active[count], hits[count]) = (active[i], hits[i]);
                count += 1;
            }
        }
        active.truncate(count);
        hits.truncate(count);
    }

    /// Shades all hits: queues shadow rays and the rays of continuing paths.
    pub(super) fn evaluate_materials(
        &mut self,
        tracer: &PathTracer,
        radiance: &mut [Vec3],
        is_background: &mut [bool],
    ) {
        let Self { paths, active, next_active, hits, kind_sort, hit_batch, queues, .. } = self;
        if tracer.modes.has_many_kinds {
            kind_sort.sort(tracer.geometry, active, hits);
        }
        hit_batch.begin_bounce(tracer, paths, active, hits);
        let leaves_out = tracer.settings.catchers != Catchers::Show;
        for (index, (hits, indices)) in hits.chunks(LANES).zip(active.chunks(LANES)).enumerate() {
            let chunk = Chunk { index, hits, paths: indices };
            hit_batch.evaluate_chunk(tracer, chunk, paths);
            for (lane, &index) in indices.iter().enumerate() {
                let path = &mut paths[index as usize];
                if leaves_out && hit_batch.is_solid(tracer, path, (&hits[lane], lane)) {
                    let position = hit_batch.interactions.position(lane);
                    if tracer.ends_before(path, &hits[lane], position, &mut radiance[path.ray_index()]) {
                        is_background[path.ray_index()] = true;
                        continue;
                    }
                }
                let at = (&*hit_batch, chunk, lane);
                let (is_shaded, behind) = match tracer.modes.has_hidden_objects {
                    true => tracer.meet_hidden(path, at, radiance),
                    false => (true, None),
                };
                if is_shaded && tracer.shade_lane(path, at, queues, radiance) {
                    next_active.push(index);
                }
                if let Some((path, ray)) = behind {
                    queues.next_rays.push(ray);
                    queues.split_paths.push(path);
                }
                for path in queues.split_paths.drain(..) {
                    next_active.push(paths.len() as u32);
                    paths.push(path);
                }
            }
        }
        std::mem::swap(active, next_active);
        next_active.clear();
    }

    /// Traces shadow rays, then the rays of the next bounce.
    pub(super) fn trace_rays(&mut self, tracer: &PathTracer, batch: &CameraRayBatch, radiance: &mut [Vec3]) {
        let (queues, passes) = (&mut self.queues, tracer.settings.passes);
        let media = tracer.settings.media.as_ref();
        let coherence = if tracer.bounce == 0 { Coherence::Unknown } else { Coherence::Incoherent };
        for shadow_rays in &mut queues.shadow_rays {
            shadow_rays.trace(tracer.geometry, batch.scene, coherence, media, passes, radiance);
        }
        queues.bsdf_shadow_rays.trace(tracer.geometry, batch.scene, Coherence::Incoherent, media, passes, radiance);
        // Every entry is overwritten, so the initial values do not matter.
        self.hits.resize(queues.next_rays.len(), Hit::MISS);
        let finds = |rays: &RayVisibility| rays.reflection;
        tracer.geometry.closest(batch.scene, &queues.next_rays, &mut self.hits, Coherence::Incoherent, finds);
        queues.next_rays.clear();
    }
}
