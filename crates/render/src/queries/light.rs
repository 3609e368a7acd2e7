//! Light at points of surfaces (the irradiance that they receive, and the radiance that leaves them), and along rays.

use std::ops::Range;

use glam::{DVec3, Vec3};
use raycam_bvh::{ExactHit, ExactRay, Hit};

use crate::control::Control;
use crate::error::RenderError;
use crate::ground_truth::convert::to_float_hit;
use crate::guiding_switch::install_guiding;
use crate::integrator::camera_ray_batch::CameraRayBatch;
use crate::integrator::path::PathScratch;
use crate::integrator::requirements::effective_lights;
use crate::integrator::{irradiance, radiance};
use crate::interaction::ray_cone::RayCone;
use crate::memory::check_memory;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::tasks::in_tasks;
use crate::sampling::sampler::Sampler;
use crate::settings::Settings;
use crate::thread_pool::with_pool;

/// Approximate number of rays per batch.
const BATCH_RAYS: usize = 4096;
/// Maximum number of samples of a point in a batch.
const SAMPLES_PER_BATCH: u32 = 64;
/// Memory in bytes per point, for the point and its light.
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
    /// For each point: the image pixel whose random numbers are used.
    pub pixels: &'a [[i32; 2]],
}

impl SurfacePoints<'_> {
    fn check(&self, world: &PreparedWorld) -> Result<(), RenderError> {
        let n = self.instances.len();
        let others = [self.triangles.len(), self.barycentrics.len(), self.normals.len(), self.pixels.len()];
        if others != [n; 4] {
            return Err(RenderError::settings(format!(
                "triangles, barycentrics, normals and pixels have {others:?} entries; expected {n}, one per point"
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

/// Rays along which light arrives at their origins.
#[derive(Clone, Copy, Debug)]
pub struct LightRays<'a> {
    /// Origins of the rays, in world coordinates.
    pub origins: &'a [[f64; 3]],
    /// Unit directions of the rays, opposite to the direction of the light.
    pub directions: &'a [[f64; 3]],
    /// For each ray: the image pixel whose random numbers are used.
    pub pixels: &'a [[i32; 2]],
}

impl LightRays<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let n = self.origins.len();
        if [self.directions.len(), self.pixels.len()] != [n; 2] {
            return Err(RenderError::settings(format!(
                "{n} origins, {} directions and {} pixels; expected one of each per ray",
                self.directions.len(),
                self.pixels.len()
            )));
        }
        let is_finite = |[a, b]: [&[f64; 3]; 2]| a.iter().chain(b).all(|x| x.is_finite());
        match self.origins.iter().zip(self.directions).position(|(a, b)| !is_finite([a, b])) {
            None => Ok(()),
            Some(at) => Err(RenderError::settings(format!("ray {at} has an origin or direction that is not finite"))),
        }
    }
}

/// Kind of light that is computed at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance of the surface's measured side, in watts per square metre.
    Irradiance,
    /// Radiance that leaves along the normal, in watts per square metre and steradian.
    Radiance,
}

/// Light at points or along rays.
#[derive(Clone, Debug, Default)]
pub struct PointLight {
    /// Linear red, green and blue of the light, one colour per point.
    pub light: Vec<[f32; 3]>,
    /// Estimated standard errors of the luminance, one per point; infinite for one sample.
    pub error: Vec<f32>,
}

/// Light at points, path traced with the samples, depth, clamp and seed of `settings`.
///
/// Irradiance is the radiance of a white Lambertian surface at the point, times pi. The same arguments give the same
/// values for any number of threads.
///
/// # Errors
/// [`RenderError::Settings`] for invalid settings or points, [`RenderError::Cancelled`], and errors of `with_pool`.
pub fn light_at(
    world: &PreparedWorld,
    points: &SurfacePoints,
    quantity: Quantity,
    settings: &Settings,
    control: &Control,
) -> Result<PointLight, RenderError> {
    points.check(world)?;
    trace_light(world, Source::Points(points, quantity), settings, control)
}

/// Radiance along rays, in watts per square metre and steradian, path traced with the samples, depth, clamp and seed of
/// `settings`. For rays that hit nothing, this is the radiance of the sky. The same arguments give the same values for
/// any number of threads.
///
/// # Errors
/// [`RenderError::Settings`] for invalid settings or rays, [`RenderError::Cancelled`], and errors of `with_pool`.
pub fn radiance_along(
    world: &PreparedWorld,
    rays: &LightRays,
    settings: &Settings,
    control: &Control,
) -> Result<PointLight, RenderError> {
    rays.check()?;
    trace_light(world, Source::Rays(rays), settings, control)
}

fn trace_light(
    world: &PreparedWorld,
    source: Source,
    settings: &Settings,
    control: &Control,
) -> Result<PointLight, RenderError> {
    settings.check([1, 1])?;
    let n = source.len();
    check_memory(|| format!("computing the light at {n} points"), n as u64 * POINT_BYTES)?;
    with_pool(settings.threads, || {
        let guiding = install_guiding(world);
        world.prepare_light();
        if let Some(guiding) = guiding {
            guiding.learn(&world.geometry, effective_lights(settings.integrator, world), settings);
        }
    })?;
    let tracer = LightTracer { world, source, settings, control };
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

/// Points or rays for which light is computed.
#[derive(Clone, Copy)]
enum Source<'a> {
    Points(&'a SurfacePoints<'a>, Quantity),
    Rays(&'a LightRays<'a>),
}

impl Source<'_> {
    fn len(&self) -> usize {
        match self {
            Source::Points(points, _) => points.instances.len(),
            Source::Rays(rays) => rays.origins.len(),
        }
    }

    fn pixels(&self) -> &[[i32; 2]] {
        match self {
            Source::Points(points, _) => points.pixels,
            Source::Rays(rays) => rays.pixels,
        }
    }

    fn is_irradiance(&self) -> bool {
        matches!(self, Source::Points(_, Quantity::Irradiance))
    }
}

/// Arguments and state of [`trace_light`].
struct LightTracer<'a> {
    world: &'a PreparedWorld,
    source: Source<'a>,
    settings: &'a Settings,
    control: &'a Control,
}

/// A ray and its hit.
struct Arrival {
    /// Scene-local origin of the ray.
    origin: DVec3,
    direction: Vec3,
    hit: Hit,
}

/// Rays and their hits, one for each sample. Rays to points of surfaces start close to these points.
#[derive(Default)]
struct ArrivedRays {
    origins: Vec<DVec3>,
    directions: Vec<Vec3>,
    hits: Vec<Hit>,
    samplers: Vec<Sampler>,
    cones: Vec<RayCone>,
}

impl LightTracer<'_> {
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
        let ArrivedRays { origins, directions, hits, samplers, cones } = rays;
        origins.clear();
        directions.clear();
        hits.clear();
        samplers.clear();
        let (settings, pixels) = (self.settings, self.source.pixels());
        for (&at, Arrival { origin, direction, hit }) in some.iter().zip(self.arrivals(some)) {
            let sampler = Sampler::for_pixel(settings.seed, settings.frame, pixels[at].map(|x| x as u32));
            for sample in samples.clone() {
                origins.push(origin);
                directions.push(direction);
                hits.push(hit);
                samplers.push(sampler.with_sample(sample));
            }
        }
        cones.clear();
        cones.resize(hits.len(), RayCone::default());
    }

    /// Rays that arrive at some points, as if they had just hit the surfaces there; or the given rays with their exact
    /// hits.
    fn arrivals(&self, some: &[usize]) -> Vec<Arrival> {
        let geometry = &self.world.geometry;
        match self.source {
            Source::Points(points, _) => some.iter().map(|&at| arrival_at(geometry, points, at)).collect(),
            Source::Rays(rays) => {
                let exact = |&at: &usize| ExactRay {
                    origin: rays.origins[at],
                    direction: rays.directions[at],
                    t_min: 0.0,
                    t_max: f64::INFINITY,
                };
                let queries: Vec<ExactRay> = some.iter().map(exact).collect();
                let mut hits = vec![ExactHit::MISS; some.len()];
                geometry.closest_exact(&queries, &mut hits);
                let arrival = |(ray, hit): (&ExactRay, &ExactHit)| Arrival {
                    origin: DVec3::from(ray.origin) - geometry.origin,
                    direction: DVec3::from(ray.direction).as_vec3(),
                    hit: to_float_hit(hit),
                };
                queries.iter().zip(&hits).map(arrival).collect()
            }
        }
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
        if self.source.is_irradiance() {
            irradiance(self.world, self.settings, &batch, self.control, paths, out)?;
        } else {
            radiance(self.world, self.settings, &batch, self.control, paths, &[], out)?;
        }
        Ok(light)
    }

    /// The light of a sample, at most `clamp`; 0 if a component is negative or not finite.
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
        let factor = if self.source.is_irradiance() { std::f32::consts::PI } else { 1.0 };
        for &(light, luminance, square) in sums {
            found.light.push((light * (factor / n as f32)).to_array());
            let variance = (square - luminance * luminance / n).max(0.0) / (n - 1.0);
            let error = if n < 2.0 { f64::INFINITY } else { (variance / n).sqrt() };
            found.error.push(error as f32 * factor);
        }
    }
}

/// Ray that arrives at a point against its normal, from the side whose light is measured.
fn arrival_at(geometry: &Geometry, points: &SurfacePoints, at: usize) -> Arrival {
    let (instance, triangle) = (points.instances[at] as u32, points.triangles[at] as u32);
    let corners = geometry.corners(instance, triangle);
    let [a, b, c] = points.barycentrics[at];
    let position = corners[0] * a + corners[1] * b + corners[2] * c;
    let normal = DVec3::from(points.normals[at]);
    let lift = RELATIVE_LIFT * position.abs().max_element().max(f64::MIN_POSITIVE);
    Arrival {
        origin: position - geometry.origin + normal * lift,
        direction: -normal.as_vec3(),
        hit: Hit { t: lift as f32, u: b as f32, v: c as f32, instance, triangle },
    }
}
