//! Shared state of the paths of a batch, and the steps of a path that do not depend on a BSDF.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, Ray};
use raycam_scene::{Alpha, Material};

use crate::bsdf::BsdfSample;
use crate::integrator::camera_ray_batch::CameraRayBatch;
use crate::integrator::passes::{LightSource, Passes};
use crate::integrator::path_state::{LightSearch, PathState, WavefrontQueues};
use crate::interaction::LightSampleContext;
use crate::light::air_light::AirLight;
use crate::light::light_sampling::{LightSampling, MAX_SPLIT_SAMPLES};
use crate::light::lights::{LightView, Lights};
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{EnvironmentLookup, ONE_MINUS_SHADOW_EPSILON};
use crate::media::map::MediaMap;
use crate::media::nested_dielectrics::InteriorList;
use crate::path_guiding::{DirectionGuide, PathGuiding};
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::settings::Catchers;

/// Minimum number of segments before Russian roulette may end a path.
const MIN_ROULETTE_DEPTH: u32 = 6;
/// Throughput below which roulette may end a path; brighter paths continue unchanged. Without a threshold, every
/// survivor would be weighted up to a throughput of about one at the first roulette, and the added noise would outweigh
/// the saved time.
const ROULETTE_THRESHOLD: f32 = 1.0 / 8.0;
/// Number of bounces after which roulette ends some paths of any throughput, because light inside clear glass and between
/// white surfaces is never dimmed.
const MAX_CERTAIN_BOUNCES: u32 = 11;
/// Maximum probability of survival of such paths after a specular bounce: total reflection often traps them for ever.
const MAX_SPECULAR_SURVIVAL: f32 = 0.95;
/// Maximum probability of survival after other bounces. If roulette ended more paths at each bounce than leave a body, the
/// light that leaves the body would have an infinite variance.
const MAX_SCATTERED_SURVIVAL: f32 = 0.99;

/// Maximum number of surfaces of a path at which lights are sampled separately ([`LightSampling::Split`]), if there are
/// few finite lights without a mesh. Later surfaces contribute less; one light is sampled there.
const MAX_SPLIT_BOUNCES: u32 = 3;

/// Settings of the paths of one image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSettings<'a> {
    pub lights: &'a Lights,
    /// Maximum number of segments, including the camera ray.
    pub max_depth: u32,
    /// True if specular bounces do not count towards `max_depth`.
    pub free_specular_bounces: bool,
    /// Number of light samples per point.
    pub light_samples: usize,
    pub light_sampling: LightSampling,
    /// True if lights of several kinds are sampled separately at points that camera rays hit, and at the next two
    /// surfaces if there are few finite lights.
    pub split_lights: bool,
    /// Replaces constant environments by an ambient term. The value is the distance within which surfaces occlude the
    /// ambient light, if such a limit exists.
    pub ambient_term: Option<Option<f32>>,
    /// Hides the environment from camera rays.
    pub hide_environment: bool,
    /// Role of shadow catchers in the image.
    pub catchers: Catchers,
    /// The media that are computed in closed form, and the light that they scatter into rays.
    pub closed_form: Option<(MediaMap<'a>, &'a AirLight)>,
    /// The media that scatter paths, if they are not computed in closed form.
    pub media: Option<MediaMap<'a>>,
    /// True if camera rays meet a white Lambertian surface in place of any material.
    pub meets_white: bool,
    /// Recorder of the passes, if any pass is requested.
    pub passes: Option<Passes<'a>>,
}

/// Method by which light sampling selects a light.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LightChoice<'a> {
    /// No light can be sampled.
    None,
    /// All samples belong to one kind of light, so that no random number is used. `Some` for a single finite light.
    Single(Option<&'a PreparedLight>),
    /// A random number selects the light.
    Choose,
}

/// Properties of the lights and materials that are determined once for all paths of a batch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathModes<'a> {
    pub light_choice: LightChoice<'a>,
    /// True if BSDF samples may hit sampled lights, so that multiple importance sampling must weight both kinds of
    /// samples.
    pub mis_with_bsdf: bool,
    /// True if direct lighting is evaluated for a batch of points at once.
    pub batch_direct_lighting: bool,
    /// True if lights of several kinds are sampled separately at points that camera rays hit.
    pub split_lights: bool,
    /// Number of first bounces at which all paths sample lights separately.
    split_bounces: u32,
    /// True if the last segment of a path needs only an occlusion test, because its hit neither emits nor absorbs
    /// light.
    pub last_segment_is_occlusion_only: bool,
    /// True if any batched BSDF selects between lobes.
    pub needs_lobe_choice: bool,
    /// True if some objects are hidden from some kinds of rays.
    pub has_hidden_objects: bool,
    /// True if there are materials of several kinds, so that hits are sorted by kind.
    pub has_many_kinds: bool,
}

impl<'a> PathModes<'a> {
    fn new(geometry: &Geometry, settings: &PathSettings<'a>) -> Self {
        let lights = settings.lights;
        let sampling = settings.light_sampling;
        let has_light_samples = lights.has_light_samples(sampling);
        // Disabled if passes are recorded: a batch computes the same values, but does not separate them by
        // light and lobe.
        let batch_direct_lighting = has_light_samples
            && settings.ambient_term.is_none()
            && settings.light_samples <= MAX_SPLIT_SAMPLES
            && settings.passes.is_none();
        let is_single = settings.ambient_term.is_none() && settings.light_samples == 1;
        let light_choice = if !has_light_samples {
            LightChoice::None
        } else if settings.light_samples > 1 || lights.needs_choice(sampling) {
            LightChoice::Choose
        } else {
            LightChoice::Single(lights.single_light(sampling).filter(|_| is_single))
        };
        let needs_lobe_choice = |prepared: &PreparedMaterial| prepared.kind.needs_lobe_choice(&prepared.material);
        let kind = |prepared: &PreparedMaterial| std::mem::discriminant(&prepared.kind);
        let mut kinds = geometry.materials.iter().map(kind);
        let first_kind = kinds.next();
        let split_lights = settings.split_lights && lights.max_split_samples().is_some();
        let split_bounces = match (split_lights, lights.has_few_finite()) {
            (false, _) => 0,
            (true, false) => 1,
            (true, true) => MAX_SPLIT_BOUNCES,
        };
        Self {
            light_choice,
            mis_with_bsdf: lights.is_hittable(settings.ambient_term.is_some()),
            batch_direct_lighting,
            split_lights,
            split_bounces,
            last_segment_is_occlusion_only: last_segment_is_occlusion_only(geometry, lights),
            needs_lobe_choice: geometry.materials.iter().any(needs_lobe_choice),
            has_hidden_objects: geometry.has_hidden_objects,
            has_many_kinds: kinds.any(|kind| Some(kind) != first_kind),
        }
    }

    pub fn has_light_samples(&self) -> bool {
        !matches!(self.light_choice, LightChoice::None)
    }

    /// True if a random number selects the light.
    pub fn needs_light_choice(&self) -> bool {
        matches!(self.light_choice, LightChoice::Choose)
    }

    /// The only light, if the world has exactly one light and this light is finite.
    pub fn single_light(&self) -> Option<&'a PreparedLight> {
        if let LightChoice::Single(light) = self.light_choice { light } else { None }
    }
}

fn last_segment_is_occlusion_only(geometry: &Geometry, lights: &Lights) -> bool {
    let has_interior = |prepared: &PreparedMaterial| prepared.absorption.is_some();
    let may_absorb = lights.has_finite() && geometry.materials.iter().any(has_interior);
    // With an environment, the occlusion test comes first, because the environment is looked up only for unoccluded
    // rays.
    let has_environment = lights.environment().is_some();
    !(geometry.has_transparency || lights.has_emissive_triangles() || may_absorb || has_environment)
}

/// A batch of paths, all at the same bounce.
pub(crate) struct PathTracer<'a> {
    pub geometry: &'a Geometry,
    pub lights: &'a Lights,
    pub settings: &'a PathSettings<'a>,
    pub samplers: &'a [Sampler],
    pub modes: PathModes<'a>,
    /// Guide of diffuse samples; `None` if diffuse samples are not guided.
    pub guide: Option<Box<dyn DirectionGuide + 'a>>,
    /// Path guiding, if it reduces light sampling at some places.
    rare_light_sampling: Option<&'a dyn PathGuiding>,
    /// Index of the bounce: the number of surfaces that the paths have met. It selects the samplers' dimensions.
    pub bounce: u32,
}

impl<'a> PathTracer<'a> {
    pub fn new(world: &'a PreparedWorld, settings: &'a PathSettings<'a>, batch: &CameraRayBatch<'a>) -> Self {
        let lights = settings.lights;
        let guiding = world.guiding.get();
        let mut modes = PathModes::new(&world.geometry, settings);
        // The rate of light sampling is learned at surfaces, and is not valid in media.
        let is_clear = settings.media.is_none();
        let may_be_rare =
            is_clear && modes.needs_light_choice() && settings.light_sampling == LightSampling::Importance;
        let rare_light_sampling = guiding.filter(|guiding| may_be_rare && guiding.has_rare_light_sampling());
        if rare_light_sampling.is_some() {
            // The rate of light sampling applies only where one light is selected.
            modes.split_bounces = modes.split_bounces.min(1);
        }
        Self {
            geometry: &world.geometry,
            lights,
            settings,
            samplers: batch.samplers,
            modes,
            guide: guiding.and_then(|guiding| guiding.guide(&world.geometry, lights, batch.is_late)),
            rare_light_sampling,
            bounce: 0,
        }
    }

    /// Maximum number of light samples at a point.
    pub fn max_light_samples(&self) -> usize {
        let split = self.lights.max_split_samples().filter(|_| self.modes.split_lights);
        split.unwrap_or(self.settings.light_samples)
    }
}

impl PathTracer<'_> {
    /// True if a path at its maximum depth may continue through specular surfaces.
    pub fn is_free_bounce(&self, path: &PathState) -> bool {
        self.settings.free_specular_bounces && path.specular_bounce
    }

    /// True if a path has the maximum number of segments, so that it ends at its current hit.
    pub fn is_at_max_depth(&self, path: &PathState) -> bool {
        !self.is_free_bounce(path) && u32::from(path.depth) >= self.settings.max_depth
    }

    /// True if a camera ray hits the back of a one-sided surface (glTF 2.0, 3.9.6).
    pub fn is_culled_back_face(&self, path: &PathState, material: &Material, front: bool) -> bool {
        path.depth == 1 && path.specular_bounce && !front && !material.double_sided
    }

    /// True if the background replaces the instance hit by a camera ray; in that case, adds the lights in front of the
    /// instance.
    #[inline]
    pub fn ends_before(&self, path: &PathState, hit: &Hit, position: DVec3, out: &mut Vec3) -> bool {
        let is_left_out = path.is_camera_ray && self.geometry.is_left_out(self.settings.catchers, hit.instance);
        if is_left_out {
            self.add_intersected_lights(path, path.distance_to(position), out);
        }
        is_left_out
    }

    /// True if a surface's opacity lets a ray pass, at random for alpha blending (glTF 2.0, 3.9.4).
    #[inline]
    pub fn fails_alpha_test(&self, path: &PathState, material: &Material, hit: &Hit) -> bool {
        if material.alpha == Alpha::Opaque {
            return false;
        }
        let dimension = Dimension::OpacityAndRoulette(self.bounce);
        let [random, _] = self.samplers[path.ray_index()].get_2d(dimension);
        random >= self.geometry.opacity(hit)
    }

    /// Fraction of the hits near a position at which lights are sampled.
    #[inline]
    pub fn light_sampling_rate(&self, sampling: LightSampling, position: DVec3) -> f32 {
        match self.rare_light_sampling {
            Some(guiding) if sampling == LightSampling::Importance => {
                guiding.light_sampling_rate(self.geometry, self.lights, position)
            }
            _ => 1.0,
        }
    }

    /// Balance-heuristic weight of light that BSDF sampling found in a direction for which light sampling has the
    /// density `pdf`.
    pub fn mis_weight(&self, path: &PathState, pdf: f32) -> f32 {
        if path.specular_bounce || pdf == 0.0 {
            1.0
        } else {
            let pdf = pdf * self.light_sampling_rate(path.light_sampling, path.prev_context.position);
            let is_split = path.light_sampling == LightSampling::Split;
            let count = if is_split { 1.0 } else { self.settings.light_samples as f32 };
            1.0 / (1.0 + count * pdf / path.bsdf_pdf)
        }
    }

    /// Adds the light that an escaped ray finds. `lookup` is the radiance of an environment that has already been
    /// looked up.
    #[inline]
    pub fn handle_escaped_ray(&self, path: &PathState, lookup: Option<EnvironmentLookup>, out: &mut Vec3) {
        self.add_intersected_lights(path, f64::INFINITY, out);
        if !(path.is_camera_ray && self.settings.hide_environment || self.skips_light(path)) {
            let light = self.environment_light(path, lookup);
            *out += light;
            if self.settings.passes.is_some() {
                self.record(path, self.environment_source(path), light);
            }
        }
    }

    /// Adds lights without a mesh that the ray of a path crosses before `distance`, except lights in front of a thin
    /// wall that the path has passed.
    #[inline]
    pub fn add_intersected_lights(&self, path: &PathState, distance: f64, out: &mut Vec3) {
        if path.is_camera_ray && self.settings.catchers == Catchers::Only {
            return;
        }
        if self.settings.media.is_some() || self.skips_light(path) {
            // In worlds with media, these lights are added together with the media in front of them.
            return;
        }
        let (lights, view) = self.lights_of(path);
        lights.intersect_visible(
            &path.prev_context,
            path.light_sampling,
            path.direction,
            distance,
            |index, at, radiance, pdf| {
                if at >= f64::from(path.passed_distance) {
                    let light = path.throughput * radiance * self.mis_weight(path, pdf);
                    *out += light;
                    self.record(path, LightSource::Finite { index, view }, light);
                }
            },
        );
    }

    /// Lights that the ray of a path can find, and the kind of the ray.
    #[inline]
    pub fn lights_of(&self, path: &PathState) -> (&Lights, LightView) {
        let view = match (path.specular_bounce, path.is_camera_ray) {
            (false, _) => LightView::Scattered,
            (true, true) => LightView::Camera,
            (true, false) => LightView::Reflection,
        };
        (self.lights.view(view), view)
    }

    /// Light of the environment along the ray of a path, weighted for multiple importance sampling.
    #[inline]
    pub fn environment_light(&self, path: &PathState, lookup: Option<EnvironmentLookup>) -> Vec3 {
        let direction = path.direction;
        let (radiance, pdf) = if path.specular_bounce {
            let (lights, _) = self.lights_of(path);
            (lights.escaped_radiance(direction, lookup.filter(|_| !self.lights.has_views())), 0.0)
        } else {
            self.lights.radiance_and_pdf(&path.prev_context, path.light_sampling, direction, lookup)
        };
        let radiance = self.environment_without_ambient(path.specular_bounce, radiance);
        path.throughput * radiance * self.mis_weight(path, pdf)
    }

    /// Source of the light that the environment sends along the ray of a path.
    pub fn environment_source(&self, path: &PathState) -> LightSource {
        let has_ambient = path.specular_bounce || self.settings.ambient_term.is_none();
        LightSource::Infinite { direction: path.direction, has_ambient, view: self.lights_of(path).1 }
    }

    /// Radiance of the environment; for scattered light, without the part that the ambient term already contains.
    pub fn environment_without_ambient(&self, specular_bounce: bool, radiance: Vec3) -> Vec3 {
        if specular_bounce || self.settings.ambient_term.is_none() {
            radiance
        } else {
            (radiance - self.lights.ambient).max(Vec3::ZERO)
        }
    }

    /// Adds the emission of the surface at a hit.
    pub fn add_emission(&self, path: &PathState, material: &Material, hit: &Hit, distance: f64, out: &mut Vec3) {
        let (geometry, direction) = (self.geometry, path.direction);
        if path.specular_bounce && material.model.is_unlit() {
            let footprint = geometry.footprint(hit, direction, &path.ray_cone);
            let light = path.throughput * geometry.base_color(hit, &footprint);
            *out += light;
            self.record(path, LightSource::Surfaces, light);
        }
        if material.emission.value == [0.0; 3] || self.skips_light(path) {
            return;
        }
        let footprint = geometry.footprint(hit, direction, &path.ray_cone);
        let emitted = geometry.emission(hit, direction, &footprint);
        if emitted != Vec3::ZERO {
            let pdf =
                self.lights.emission_pdf(&path.prev_context, path.light_sampling, geometry, hit, direction, distance);
            let light = path.throughput * emitted * self.mis_weight(path, pdf);
            *out += light;
            self.record(path, LightSource::Surfaces, light);
        }
    }

    /// Dims a path by the medium that it crossed; `distance` is measured from the point that scattered the path last.
    #[inline]
    pub fn apply_absorption(&self, path: &mut PathState, distance: f64) {
        let absorption = path.interior_list.absorption(self.geometry);
        if absorption != Vec3::ZERO {
            path.throughput *= (-absorption * (distance as f32 - path.passed_distance)).exp();
        }
    }

    /// Method of light sampling at the next hit of a path.
    pub fn light_sampling(&self, path: &PathState) -> LightSampling {
        let is_split = self.modes.split_lights && path.is_camera_ray || self.bounce < self.modes.split_bounces;
        if is_split { LightSampling::Split } else { self.settings.light_sampling }
    }

    /// Method of light sampling at this bounce, for all paths that have not passed a surface unscattered.
    pub fn light_sampling_of_bounce(&self) -> LightSampling {
        if self.bounce < self.modes.split_bounces { LightSampling::Split } else { self.settings.light_sampling }
    }

    /// True if a path samples lights in the same way as the other paths of this bounce; false for a camera ray that
    /// passed surfaces and is at a later bounce than those at which all paths sample lights separately.
    pub fn samples_lights_in_step(&self, path: &PathState) -> bool {
        self.light_sampling(path) == self.light_sampling_of_bounce()
    }

    /// Continues a path straight through a thin wall at `position`, from `origin` on its far side. Shadow rays pass
    /// such walls too, so the next light is weighted according to light sampling at the point that scattered the path
    /// last, and the segment does not count.
    pub fn pass_straight(
        &self,
        path: &mut PathState,
        sample: &BsdfSample,
        (position, origin): (DVec3, Vec3),
        queues: &mut WavefrontQueues,
    ) -> bool {
        path.throughput *= sample.weight;
        path.is_camera_ray = false;
        path.passed_distance = path.distance_to(position) as f32;
        let ray = Ray { origin: origin.to_array(), direction: path.direction.to_array(), t_max: f32::INFINITY };
        let continues = path.throughput != Vec3::ZERO;
        if continues {
            queues.next_rays.push(ray);
        }
        continues
    }

    /// Continues a path with a BSDF sample from `origin`. Returns false if the path ends.
    #[inline(always)]
    pub fn continue_path(
        &self,
        path: &mut PathState,
        sample: &BsdfSample,
        origin: Vec3,
        context: LightSampleContext,
        interior_list: InteriorList,
        queues: &mut WavefrontQueues,
    ) -> bool {
        let is_free = self.is_free_bounce(path) && sample.is_specular;
        let depth = u32::from(path.depth) + u32::from(!is_free);
        // After this segment the path ends, so the segment only searches for lights.
        let is_last = depth >= self.settings.max_depth && !sample.is_specular;
        if depth > self.settings.max_depth || (is_last && !self.modes.mis_with_bsdf) {
            return false;
        }
        let mut throughput = path.throughput * sample.weight;
        let eta_scale = path.eta_scale * sample.eta_scale;
        if self.bounce.saturating_add(2) > MIN_ROULETTE_DEPTH {
            let max_survival = match (self.bounce > MAX_CERTAIN_BOUNCES, sample.is_specular) {
                (false, _) => 1.0,
                (true, true) => MAX_SPECULAR_SURVIVAL,
                (true, false) => MAX_SCATTERED_SURVIVAL,
            };
            let survival = (throughput.max_element() * eta_scale / ROULETTE_THRESHOLD).min(max_survival);
            // Paths above the threshold, which are most paths, skip drawing the random number, which is expensive.
            if survival < 1.0 {
                let dimension = Dimension::OpacityAndRoulette(self.bounce);
                let [_, random] = self.samplers[path.ray_index()].get_2d(dimension);
                if random >= survival {
                    return false;
                }
                throughput /= survival;
            }
        }
        if throughput == Vec3::ZERO {
            return false;
        }
        path.throughput = throughput;
        path.direction = sample.wi;
        path.prev_context = context;
        path.passed_distance = 0.0;
        path.bsdf_pdf = sample.pdf;
        path.specular_bounce = sample.is_specular;
        path.light_sampling = self.light_sampling(path);
        path.light_search = LightSearch::All;
        path.is_camera_ray = false;
        path.depth = u16::try_from(depth).unwrap_or(u16::MAX);
        path.interior_list = interior_list;
        path.eta_scale = eta_scale;
        path.ray_cone = path.ray_cone.after_scatter(sample.is_specular);
        let ray = Ray { origin: origin.to_array(), direction: sample.wi.to_array(), t_max: f32::INFINITY };
        if is_last
            && self.modes.last_segment_is_occlusion_only
            && self.settings.media.is_none()
            && path.interior_list.is_empty()
        {
            self.queue_last_segment(path, ray, queues);
            return false;
        }
        queues.next_rays.push(ray);
        true
    }

    /// Queues shadow rays for the light that [`PathTracer::handle_escaped_ray`] would add, because an occlusion test is
    /// faster than a closest hit.
    #[inline(never)]
    fn queue_last_segment(&self, path: &PathState, ray: Ray, queues: &mut WavefrontQueues) {
        let queue = &mut queues.bsdf_shadow_rays;
        let (lights, view) = self.lights_of(path);
        lights.intersect_visible(
            &path.prev_context,
            path.light_sampling,
            path.direction,
            f64::INFINITY,
            |index, distance, radiance, pdf| {
                let t_max = distance as f32 * ONE_MINUS_SHADOW_EPSILON;
                let light = path.throughput * radiance * self.mis_weight(path, pdf);
                let tag = self.tag_of_last_segment(path, LightSource::Finite { index, view });
                queue.push_tagged(Ray { t_max, ..ray }, path.ray_index(), light, tag);
            },
        );
        let environment = self.environment_light(path, None);
        if environment != Vec3::ZERO {
            let tag = self.tag_of_last_segment(path, self.environment_source(path));
            queue.push_tagged(ray, path.ray_index(), environment, tag);
        }
    }
}
