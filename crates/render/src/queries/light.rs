//! Light at points of surfaces: the irradiance that they receive, and the radiance that leaves them.

use std::ops::Range;

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::control::Control;
use crate::error::RenderError;
use crate::guiding_switch::install_guiding;
use crate::integrator::camera_ray_batch::CameraRayBatch;
use crate::integrator::path::PathScratch;
use crate::integrator::requirements::effective_lights;
use crate::integrator::{irradiance, radiance};
use crate::interaction::ray_cone::RayCone;
use crate::memory::check_memory;
use crate::prepare::world::PreparedWorld;
use crate::queries::tasks::in_tasks;
use crate::sampling::sampler::Sampler;
use crate::settings::Settings;
use crate::thread_pool::with_pool;

/// Approximate rays per batch.
const BATCH_RAYS: usize = 4096;
/// Largest number of samples of a point in a batch.
const SAMPLES_PER_BATCH: u32 = 64;
/// Bytes for each point: its light, and the point itself.
const POINT_BYTES: u64 = 96;
/// Distance of the rays' starts from the points, relative to the largest coordinate.
const RELATIVE_LIFT: f64 = 1e-9;
/// Weights of linear red, green and blue in luminance (ITU-R BT.709).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Points of the world's triangles.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoints<'a> {
    /// The object of each point.
    pub instances: &'a [i32],
    /// The triangle of each point, in the object's mesh.
    pub triangles: &'a [i32],
    /// The weights of the triangle's corners.
    pub barycentrics: &'a [[f64; 3]],
    /// Unit normals in world coordinates, pointing to the side whose light is measured.
    pub normals: &'a [[f64; 3]],
    /// Pixels of an image, which select the random numbers.
    pub pixels: &'a [[i32; 2]],
}

impl SurfacePoints<'_> {
    fn check(&self, world: &PreparedWorld) -> Result<(), RenderError> {
        let n = self.instances.len();
        let others = [self.triangles.len(), self.barycentrics.len(), self.normals.len(), self.pixels.len()];
        if others != [n; 4] {
            return Err(RenderError::settings(format!(
                "{n} objects, but {others:?} triangles, barycentrics, normals and pixels; expected one value per point"
            )));
        }
        let instances = &world.geometry.instances;
        let is_known = |(&object, &triangle): (&i32, &i32)| {
            let object = usize::try_from(object).ok().and_then(|object| instances.get(object));
            object.is_some_and(|object| {
                usize::try_from(triangle).is_ok_and(|triangle| triangle < object.mesh.mesh.triangles.len())
            })
        };
        match self.instances.iter().zip(self.triangles).position(|at| !is_known(at)) {
            None => Ok(()),
            Some(at) => {
                let (object, triangle) = (self.instances[at], self.triangles[at]);
                Err(RenderError::settings(format!("point {at}: object {object} has no triangle {triangle}")))
            }
        }
    }
}

/// Light to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance of the surface's side, in watts per square metre.
    Irradiance,
    /// Radiance that leaves along the normal, in watts per square metre and steradian.
    Radiance,
}

/// Light at points.
#[derive(Clone, Debug, Default)]
pub struct PointLight {
    /// Linear red, green and blue.
    pub light: Vec<[f32; 3]>,
    /// Estimated standard errors of the luminance; infinite for one sample.
    pub error: Vec<f32>,
}

/// Light at points, path traced with the samples, depth, clamp and seed of `settings`.
///
/// Irradiance is the radiance of a white Lambertian surface at the point, times pi. The same arguments give the same
/// values for any number of threads.
///
/// # Errors
/// [`RenderError::Settings`] for invalid settings or points, [`RenderError::Cancelled`], and errors of [`with_pool`].
pub fn light_at(
    world: &PreparedWorld,
    points: &SurfacePoints,
    quantity: Quantity,
    settings: &Settings,
    control: &Control,
) -> Result<PointLight, RenderError> {
    settings.check([1, 1])?;
    points.check(world)?;
    let n = points.instances.len();
    check_memory(|| format!("light at {n} points"), n as u64 * POINT_BYTES)?;
    with_pool(settings.threads, || {
        let guiding = install_guiding(world);
        world.prepare_light();
        if let Some(guiding) = guiding {
            guiding.learn(&world.geometry, effective_lights(settings.integrator, world), settings);
        }
    })?;
    let tracer = PointTracer { world, points, quantity, settings, control };
    let (mut found, mut error) = (PointLight::default(), None);
    let work = |range| tracer.trace(range);
    in_tasks((n, f64::INFINITY), settings.threads, control, work, |part| match part {
        Ok(PointLight { light, error }) => {
            found.light.extend(light);
            found.error.extend(error);
        }
        Err(failure) => error = Some(failure),
    })?;
    error.map_or(Ok(found), Err)
}

/// Arguments of [`light_at`].
struct PointTracer<'a> {
    world: &'a PreparedWorld,
    points: &'a SurfacePoints<'a>,
    quantity: Quantity,
    settings: &'a Settings,
    control: &'a Control,
}

/// Rays that end at the points, as if they had just hit the surfaces there.
#[derive(Default)]
struct ArrivedRays {
    origins: Vec<DVec3>,
    directions: Vec<Vec3>,
    hits: Vec<Hit>,
    samplers: Vec<Sampler>,
    cones: Vec<RayCone>,
}

impl PointTracer<'_> {
    fn trace(&self, range: Range<usize>) -> Result<PointLight, RenderError> {
        let (mut rays, mut paths) = (ArrivedRays::default(), PathScratch::default());
        let mut found = PointLight::default();
        let step = SAMPLES_PER_BATCH.min(self.settings.samples);
        let points: Vec<usize> = range.collect();
        for some in points.chunks((BATCH_RAYS / step as usize).max(1)) {
            let mut sums = vec![(Vec3::ZERO, 0.0f64, 0.0f64); some.len()];
            for first in (0..self.settings.samples).step_by(step as usize) {
                self.control.check()?;
                let samples = first..self.settings.samples.min(first + step);
                let count = samples.len();
                self.arrive(some, samples, &mut rays);
                let light = self.shade(&rays, &mut paths)?;
                for (sum, light) in sums.iter_mut().zip(light.chunks(count)) {
                    for light in light.iter().map(|&light| self.clamped(light)) {
                        let luminance = f64::from(light.dot(LUMINANCE));
                        *sum = (sum.0 + light, sum.1 + luminance, sum.2 + luminance * luminance);
                    }
                }
            }
            self.write(&sums, &mut found);
        }
        Ok(found)
    }

    /// Sets the rays for the samples of several points.
    fn arrive(&self, some: &[usize], samples: Range<u32>, rays: &mut ArrivedRays) {
        let Self { world, points, settings, .. } = self;
        let ArrivedRays { origins, directions, hits, samplers, cones } = rays;
        origins.clear();
        directions.clear();
        hits.clear();
        samplers.clear();
        for &at in some {
            let (instance, triangle) = (points.instances[at] as u32, points.triangles[at] as u32);
            let corners = world.geometry.corners(instance, triangle);
            let [a, b, c] = points.barycentrics[at];
            let position = corners[0] * a + corners[1] * b + corners[2] * c;
            let sampler = Sampler::for_pixel(settings.seed, settings.frame, points.pixels[at].map(|x| x as u32));
            let normal = DVec3::from(points.normals[at]);
            // On the outer side of a closed body.
            let lift = RELATIVE_LIFT * position.abs().max_element().max(f64::MIN_POSITIVE);
            for sample in samples.clone() {
                origins.push(position - world.geometry.origin + normal * lift);
                directions.push(-normal.as_vec3());
                hits.push(Hit { t: lift as f32, u: b as f32, v: c as f32, instance, triangle });
                samplers.push(sampler.with_sample(sample));
            }
        }
        cones.clear();
        cones.resize(hits.len(), RayCone::default());
    }

    fn shade(&self, rays: &ArrivedRays, paths: &mut PathScratch) -> Result<Vec<Vec3>, RenderError> {
        let batch = CameraRayBatch {
            scene: self.world.geometry.two_level(),
            origins: &rays.origins,
            ray_cones: &rays.cones,
            directions: &rays.directions,
            hits: &rays.hits,
            samplers: &rays.samplers,
            start_depth: 0.0,
            is_late: false,
        };
        let mut light = vec![Vec3::ZERO; rays.hits.len()];
        let mut missed = vec![false; rays.hits.len()];
        let out = (&mut light[..], &mut missed[..]);
        match self.quantity {
            Quantity::Irradiance => irradiance(self.world, self.settings, &batch, self.control, paths, out)?,
            Quantity::Radiance => radiance(self.world, self.settings, &batch, self.control, paths, &[], out)?,
        }
        Ok(light)
    }

    /// The light of a sample, at most `clamp`; 0 for values that float32 does not represent.
    fn clamped(&self, light: Vec3) -> Vec3 {
        if !(light.is_finite() && light.min_element() >= 0.0) {
            return Vec3::ZERO;
        }
        let (brightest, limit) = (light.max_element(), self.settings.clamp.unwrap_or(f32::INFINITY));
        if brightest > limit { light * (limit / brightest) } else { light }
    }

    /// Appends means and standard errors of sums over samples: of light, of luminance and of its square.
    fn write(&self, sums: &[(Vec3, f64, f64)], found: &mut PointLight) {
        let n = f64::from(self.settings.samples);
        let factor = if self.quantity == Quantity::Irradiance { std::f32::consts::PI } else { 1.0 };
        for &(light, luminance, square) in sums {
            found.light.push((light * (factor / n as f32)).to_array());
            let variance = (square - luminance * luminance / n).max(0.0) / (n - 1.0);
            let error = if n < 2.0 { f64::INFINITY } else { (variance / n).sqrt() };
            found.error.push(error as f32 * factor);
        }
    }
}
