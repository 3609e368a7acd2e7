//! Ground truth: the channels of the exact ray through the pixel's centre, in float64.

use std::sync::Arc;

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, Hit, INVALID_ID};
use raycam_scene::Camera;

use crate::film::channel::Channel;
use crate::ground_truth::convert::exact_ray;
use crate::ground_truth::triangle_cache::TriangleCache;
use crate::interaction::vector::{face_forward, unit, unit_normal};
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::settings::Settings;

/// The normals of a surface in the world, on the side that is seen; 0 for the background.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Normals {
    /// Of the triangle.
    pub geometric: DVec3,
    /// Of the smooth surface that it stands for.
    pub shading: DVec3,
}

impl Normals {
    /// Those of the background.
    const BACKGROUND: Self = Self {
        geometric: DVec3::ZERO,
        shading: DVec3::ZERO,
    };

    /// Whether any of the channels needs normals, and then whether it needs smooth ones.
    pub fn normals_needed(channels: &[Channel]) -> Option<bool> {
        let any = |wanted: [Channel; 2]| channels.iter().any(|channel| wanted.contains(channel));
        let smooth = any([Channel::ShadingNormal, Channel::ShadingNormalCamera]);
        (smooth || any([Channel::Normal, Channel::NormalCamera])).then_some(smooth)
    }
}

/// A triangle, as it was seen last.
#[derive(Clone, Copy)]
struct CachedTriangle {
    /// Its normal on the side from which its corners run counter-clockwise, and on the side that was seen.
    normal: DVec3,
    facing_normal: DVec3,
    /// The smooth ones of its corners there.
    corners: Option<[DVec3; 3]>,
}

impl CachedTriangle {
    const EMPTY: Self = Self {
        normal: DVec3::ZERO,
        facing_normal: DVec3::NAN,
        corners: None,
    };

    fn new(world: &Geometry, hit: &ExactHit) -> Self {
        let corners = || world.corners(hit.instance, hit.triangle);
        Self {
            normal: unit(hit.normal.into()).unwrap_or_else(|| unit_normal(corners())),
            ..Self::EMPTY
        }
    }

    /// The normals of a hit, the smooth one where asked for.
    fn normals(
        &mut self,
        world: &Geometry,
        ray: &ExactRay,
        hit: &ExactHit,
        smooth: bool,
    ) -> Normals {
        let ExactHit {
            instance,
            triangle,
            u,
            v,
            ..
        } = *hit;
        let geometric = face_forward(self.normal, ray.direction.into());
        if !smooth {
            return Normals {
                geometric,
                shading: geometric,
            };
        }
        if geometric != self.facing_normal {
            self.facing_normal = geometric;
            self.corners = world.facing_vertex_normals(instance, triangle, geometric);
        }
        let shading = self.corners.map_or(geometric, |[a, b, c]| {
            (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric)
        });
        Normals { geometric, shading }
    }
}

/// Rays that are answered at a time: what is told of their triangles is told while these are in the cache. Much fewer would
/// pay for the room that each search needs.
const RAYS_PER_BATCH: usize = 512;

/// The rays through the pixels' centres, and what they met.
#[derive(Default)]
pub(crate) struct CenterRays {
    pub rays: Vec<ExactRay>,
    /// What they met first.
    pub hits: Vec<ExactHit>,
    /// What lies behind that, where the ground truth tells of it; else empty.
    hits_behind: Vec<ExactHit>,
    normals: Vec<Normals>,
}

impl CenterRays {
    /// Traces the rays of pixels; with `passing` the ground truth is of what lies behind what one sees through.
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
        let smooth = Normals::normals_needed(&settings.channels);
        let mut facets = TriangleCache::new(CachedTriangle::EMPTY);
        let batches = self
            .rays
            .chunks(RAYS_PER_BATCH)
            .zip(self.hits.chunks_mut(RAYS_PER_BATCH));
        for (rays, hits) in batches {
            world.closest_exact(rays, hits);
            let mut told = &*hits;
            if passing {
                let first = self.hits_behind.len();
                self.hits_behind.extend_from_slice(hits);
                world.skip_transparent(rays, &mut self.hits_behind[first..]);
                told = &self.hits_behind[first..];
            }
            if let Some(smooth) = smooth {
                let told = rays.iter().zip(told);
                self.normals.extend(told.map(|(ray, hit)| {
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

    /// [`CenterRays::trace`], where each pixel sees a world of its own: those of a line the same one.
    pub fn trace_per_world(
        &mut self,
        worlds: &[Arc<PreparedWorld>],
        camera: &Camera,
        pixels: &[[u32; 2]],
        settings: &Settings,
        passing: bool,
    ) {
        let mut of_line = CenterRays::default();
        self.rays.clear();
        self.hits.clear();
        self.hits_behind.clear();
        self.normals.clear();
        let mut from = 0;
        while let Some(world) = worlds.get(from) {
            let same = worlds[from..]
                .iter()
                .take_while(|other| Arc::ptr_eq(other, world));
            let to = from + same.count();
            of_line.trace(
                &world.geometry,
                camera,
                &pixels[from..to],
                settings,
                passing,
            );
            self.rays.append(&mut of_line.rays);
            self.hits.append(&mut of_line.hits);
            self.hits_behind.append(&mut of_line.hits_behind);
            self.normals.append(&mut of_line.normals);
            from = to;
        }
    }

    /// Depth and distance count from the plane where rays from infinity have the depth 0, not from their start.
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

    /// One ray that met nothing.
    pub fn background() -> Self {
        Self {
            rays: vec![exact_ray((DVec3::ZERO, DVec3::Z))],
            hits: vec![ExactHit::MISS],
            hits_behind: vec![],
            normals: vec![],
        }
    }

    /// What is told of: what the rays met first, or what lies behind that.
    pub fn ground_truth_hits(&self) -> &[ExactHit] {
        match self.hits_behind.is_empty() {
            true => &self.hits,
            false => &self.hits_behind,
        }
    }

    /// The normals of that, where asked for.
    #[inline]
    pub fn normals(&self, i: usize) -> &Normals {
        self.normals.get(i).unwrap_or(&Normals::BACKGROUND)
    }
}
