//! Exact rays through pixel centres, traced in float64.

use std::sync::Arc;

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, INVALID_ID};
use raycam_scene::Camera;

use crate::film::channel::Channel;
use crate::ground_truth::convert::exact_ray;
use crate::ground_truth::triangle_cache::TriangleCache;
use crate::interaction::vector::{face_forward, unit, unit_normal};
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::settings::{Catchers, Settings};

/// World-space normals of a surface on the viewer's side; 0 for the background.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Normals {
    /// Normal of the triangle.
    pub geometric: DVec3,
    /// Shading normal: interpolated from the vertex normals.
    pub shading: DVec3,
}

impl Normals {
    /// Normals of the background.
    const BACKGROUND: Self = Self { geometric: DVec3::ZERO, shading: DVec3::ZERO };

    /// `Some` if any channel requires normals; the value is true if a channel requires shading normals.
    pub fn normals_needed(channels: &[Channel]) -> Option<bool> {
        let any = |wanted: [Channel; 2]| channels.iter().any(|channel| wanted.contains(channel));
        let smooth = any([Channel::ShadingNormal, Channel::ShadingNormalCamera]);
        (smooth || any([Channel::Normal, Channel::NormalCamera])).then_some(smooth)
    }
}

/// Normals of a triangle that centre rays hit.
#[derive(Clone, Copy)]
struct CachedTriangle {
    /// Unit normal on the counter-clockwise side, and unit normal on the viewer's side.
    normal: DVec3,
    facing_normal: DVec3,
    /// Vertex normals on the viewer's side.
    corners: Option<[DVec3; 3]>,
}

impl CachedTriangle {
    const EMPTY: Self = Self { normal: DVec3::ZERO, facing_normal: DVec3::NAN, corners: None };

    fn new(world: &Geometry, hit: &ExactHit) -> Self {
        let corners = || world.corners(hit.instance, hit.triangle);
        Self { normal: unit(hit.normal.into()).unwrap_or_else(|| unit_normal(corners())), ..Self::EMPTY }
    }

    /// Normals at a hit; shading normals are computed only if `smooth` is true.
    fn normals(&mut self, world: &Geometry, ray: &ExactRay, hit: &ExactHit, smooth: bool) -> Normals {
        let ExactHit { instance, triangle, u, v, .. } = *hit;
        let geometric = face_forward(self.normal, ray.direction.into());
        if !smooth {
            return Normals { geometric, shading: geometric };
        }
        if geometric != self.facing_normal {
            self.facing_normal = geometric;
            self.corners = world.facing_vertex_normals(instance, triangle, geometric);
        }
        let shading =
            self.corners.map_or(geometric, |[a, b, c]| (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric));
        Normals { geometric, shading }
    }
}

/// Rays per batch: few enough that the triangles hit are still in the cache when normals are read. Smaller batches
/// would not amortise the traversal's setup.
const RAYS_PER_BATCH: usize = 512;

/// Rays through pixel centres and their hits.
#[derive(Default)]
pub(crate) struct CenterRays {
    pub rays: Vec<ExactRay>,
    /// First hit of each ray.
    pub hits: Vec<ExactHit>,
    /// Hits that the ground truth describes, if it skips some surfaces; otherwise empty.
    hits_behind: Vec<ExactHit>,
    normals: Vec<Normals>,
    /// Indices of the rays that hit coplanar surfaces of several objects.
    pub coplanar: Vec<usize>,
}

impl CenterRays {
    /// Traces the centre rays of pixels. If `passing` is true, the ground truth describes the surfaces behind
    /// transparent surfaces.
    pub fn trace(
        &mut self,
        world: &Geometry,
        camera: &Camera,
        pixels: &[[u32; 2]],
        settings: &Settings,
        passing: bool,
    ) {
        self.rays.clear();
        let centers = pixels.iter().map(|&[x, y]| camera.pixel_center_of(x, y));
        camera.rays(centers, |ray| self.rays.push(exact_ray(ray)));
        self.hits.resize(pixels.len(), ExactHit::MISS);
        self.hits_behind.clear();
        self.normals.clear();
        self.coplanar.clear();
        let smooth = Normals::normals_needed(&settings.channels);
        let mut facets = TriangleCache::new(CachedTriangle::EMPTY);
        let batches = self.rays.chunks(RAYS_PER_BATCH).zip(self.hits.chunks_mut(RAYS_PER_BATCH));
        for (batch, (rays, hits)) in batches.enumerate() {
            let ties = world.closest_visible(rays, hits);
            let coplanar = ties.iter().filter(|tie| tie.is_coplanar);
            self.coplanar.extend(coplanar.map(|tie| batch * RAYS_PER_BATCH + tie.ray as usize));
            let mut truth = &*hits;
            if passing || settings.catchers != Catchers::Show {
                let first = self.hits_behind.len();
                self.hits_behind.extend_from_slice(hits);
                let behind = &mut self.hits_behind[first..];
                if passing {
                    world.skip_transparent(rays, behind, &ties);
                }
                let seen = behind.iter_mut().filter(|hit| hit.instance != INVALID_ID);
                for hit in seen.filter(|hit| world.is_left_out(settings.catchers, hit.instance)) {
                    *hit = ExactHit::MISS;
                }
                truth = behind;
            }
            if let Some(smooth) = smooth {
                let truth = rays.iter().zip(truth);
                self.normals.extend(truth.map(|(ray, hit)| {
                    if hit.instance == INVALID_ID {
                        return Normals::BACKGROUND;
                    }
                    let facet = facets.get_or_insert(hit, || CachedTriangle::new(world, hit));
                    facet.normals(world, ray, hit, smooth)
                }));
            }
        }
        self.rebase_depth(camera.ray_start_depth());
    }

    /// Same as [`CenterRays::trace`], with a world for each pixel; the pixels of a row share a world.
    pub fn trace_per_world(
        &mut self,
        worlds: &[Arc<PreparedWorld>],
        camera: &Camera,
        pixels: &[[u32; 2]],
        settings: &Settings,
        passing: bool,
    ) {
        let mut of_row = CenterRays::default();
        self.rays.clear();
        self.hits.clear();
        self.hits_behind.clear();
        self.normals.clear();
        self.coplanar.clear();
        let mut from = 0;
        while let Some(world) = worlds.get(from) {
            let same = worlds[from..].iter().take_while(|other| Arc::ptr_eq(other, world));
            let to = from + same.count();
            of_row.trace(&world.geometry, camera, &pixels[from..to], settings, passing);
            self.rays.append(&mut of_row.rays);
            self.hits.append(&mut of_row.hits);
            self.hits_behind.append(&mut of_row.hits_behind);
            self.normals.append(&mut of_row.normals);
            self.coplanar.extend(of_row.coplanar.drain(..).map(|i| from + i));
            from = to;
        }
    }

    /// Moves the rays' origins from depth `start` to the plane of depth 0, from which depth and distance are measured.
    fn rebase_depth(&mut self, start: f64) {
        if start == 0.0 {
            return;
        }
        for ray in &mut self.rays {
            let back = start * DVec3::from(ray.direction);
            ray.origin = (DVec3::from(ray.origin) - back).to_array();
        }
        for hit in self.hits.iter_mut().chain(&mut self.hits_behind) {
            hit.t += start;
        }
    }

    /// Creates the centre ray of a single pixel that shows the background.
    pub fn background() -> Self {
        Self {
            rays: vec![exact_ray((DVec3::ZERO, DVec3::Z))],
            hits: vec![ExactHit::MISS],
            hits_behind: vec![],
            normals: vec![],
            coplanar: vec![],
        }
    }

    /// Hits that the ground truth describes, one per pixel.
    pub fn ground_truth_hits(&self) -> &[ExactHit] {
        match self.hits_behind.is_empty() {
            true => &self.hits,
            false => &self.hits_behind,
        }
    }

    /// Normals at the hit that the ground truth describes for pixel `i`; 0 if normals are not requested.
    #[inline]
    pub fn normals(&self, i: usize) -> &Normals {
        self.normals.get(i).unwrap_or(&Normals::BACKGROUND)
    }
}
