//! State of paths, and the queues of rays that one bounce fills.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, Ray};

use crate::integrator::shadow_queue::ShadowRayQueue;
use crate::interaction::LightSampleContext;
use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::RayCone;
use crate::light::light_sampling::LightSampling;
use crate::light::samples::{LightLiSample, LightRandom};
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::material::PreparedMaterial;

/// The kind of light that a ray collects after it has passed objects that are hidden from some rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightSearch {
    /// The ray collects all light: from lamps, the sky and surfaces, and light that surfaces scatter.
    All,
    /// The ray collects only light that light samples also find, because it has passed an object that casts no shadow,
    /// and another path continues at this object.
    Sampled,
    /// The ray collects only light that light samples do not find, because it has passed a hidden object that casts a
    /// shadow.
    Scattered,
}

/// A path in progress.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    /// Index of the path's camera ray in the batch.
    pub camera_ray: u32,
    /// Index of the path's way in [`PassRecorder`](crate::integrator::passes::PassRecorder); 0 if no passes are
    /// recorded.
    pub way: u32,
    /// Factor from radiance along the current ray to radiance at the camera.
    pub throughput: Vec3,
    pub direction: Vec3,
    /// Point that scattered the path last; initially the camera.
    pub prev_context: LightSampleContext,
    /// Distance from the point that scattered the path last to the last thin wall that the path passed.
    pub passed_distance: f32,
    /// Density with which the BSDF at the point that scattered the path last sampled `direction`.
    pub bsdf_pdf: f32,
    /// True if light sampling could not have found `direction`: from the camera, or after a specular bounce.
    pub specular_bounce: bool,
    /// True until a surface or medium scatters the path, or a thin wall lets it pass.
    pub is_camera_ray: bool,
    /// Number of times that the path followed both branches of a dielectric.
    pub split_count: u8,
    /// Light that the ray of the path collects.
    pub light_search: LightSearch,
    /// Method of light sampling at the point that scattered the path last.
    pub light_sampling: LightSampling,
    /// Number of segments, including this one, that count towards the maximum depth; at most 65,535.
    pub depth: u16,
    /// Media that the path is in.
    pub interior_list: InteriorList,
    /// The only colour channel that the path transports after dispersion; `None` before.
    pub wavelength_channel: Option<ColorChannel>,
    /// Product of the squared relative indices of refraction by which refraction has divided the throughput.
    pub eta_scale: f32,
    /// Width and spread of the path; used until a rough surface scatters the path.
    pub ray_cone: RayCone,
}

/// Colour channel; its discriminant is the channel's index.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub(crate) enum ColorChannel {
    Red,
    Green,
    Blue,
}

impl ColorChannel {
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];

    pub fn index(self) -> usize {
        self as usize
    }
}

impl PathState {
    /// Index of the path's camera ray in the batch.
    #[inline(always)]
    pub fn ray_index(&self) -> usize {
        self.camera_ray as usize
    }

    /// Distance to a position from the point that scattered the path last.
    #[inline(always)]
    pub fn distance_to(&self, position: DVec3) -> f64 {
        (position - self.prev_context.position).length()
    }
}

// At most two cache lines, because the compiler copies larger structs by a function call.
const _: () = assert!(size_of::<PathState>() <= 128);

/// Queues of the rays that one bounce of all paths produces.
#[derive(Default)]
pub(crate) struct WavefrontQueues {
    /// One queue for each light sample of a point, because neighbouring rays to the same light are coherent.
    pub shadow_rays: Vec<ShadowRayQueue>,
    /// Shadow rays in directions that BSDFs sampled.
    pub bsdf_shadow_rays: ShadowRayQueue,
    /// Rays of paths that continue.
    pub next_rays: Vec<Ray>,
    /// New paths, which begin where a path follows both branches.
    pub split_paths: Vec<PathState>,
}

impl WavefrontQueues {
    /// Empties the queues and prepares them for this many light samples per point.
    pub fn clear(&mut self, light_samples: usize, tracks_media: bool) {
        self.shadow_rays.resize_with(light_samples, ShadowRayQueue::default);
        for queue in self.shadow_rays.iter_mut().chain([&mut self.bsdf_shadow_rays]) {
            queue.clear();
            queue.tracks_media = tracks_media;
        }
        self.next_rays.clear();
        self.split_paths.clear();
    }
}

/// One hit of a path, with its random numbers and samples.
pub(crate) struct HitView<'a> {
    pub hit: &'a Hit,
    pub material: &'a PreparedMaterial,
    pub interaction: SurfaceInteraction,
    /// Sampled direction, used if the BSDF is diffuse.
    pub diffuse_direction: Vec3,
    /// Random numbers used to sample any other BSDF.
    pub bsdf_random: [f32; 2],
    /// Random numbers of the first light sample.
    pub light_random: LightRandom,
    /// Sample of a rectangle that is the only light.
    pub single_light_sample: Option<LightLiSample>,
}
