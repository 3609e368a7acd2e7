//! Ground truth: the channels of the exact ray through the pixel's centre, in float64.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use raycam_bvh::{ExactHit, ExactRay, Hit, NOTHING};
use raycam_scene::Camera;

use crate::channel::Channel;
use crate::prepare::PreparedWorld;
use crate::settings::Settings;
use crate::surface::{facing, unit, unit_normal};
use crate::texture::Footprint;

/// A pixel-centre ray and what it met.
pub(crate) struct Truth<'a> {
    pub world: &'a PreparedWorld,
    pub camera_from_world: &'a DMat3,
    /// Its direction has unit length.
    pub ray: &'a ExactRay,
    pub hit: &'a ExactHit,
    /// Where normals are asked for.
    pub normals: &'a Normals,
}

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
    const NONE: Self = Self {
        geometric: DVec3::ZERO,
        shading: DVec3::ZERO,
    };

    /// Whether any of the channels needs normals, and then whether it needs smooth ones.
    pub fn asked(channels: &[Channel]) -> Option<bool> {
        let any = |wanted: [Channel; 2]| channels.iter().any(|channel| wanted.contains(channel));
        let smooth = any([Channel::ShadingNormal, Channel::ShadingNormalCamera]);
        (smooth || any([Channel::Normal, Channel::NormalCamera])).then_some(smooth)
    }

    /// Those of a hit, the smooth one where asked for.
    fn new(world: &PreparedWorld, ray: &ExactRay, hit: &ExactHit, smooth: bool) -> Self {
        let ExactHit {
            instance,
            triangle,
            u,
            v,
            normal,
            ..
        } = *hit;
        if instance == NOTHING {
            return Self::NONE;
        }
        let geometric =
            unit(normal.into()).unwrap_or_else(|| unit_normal(world.corners(instance, triangle)));
        let geometric = facing(geometric, ray.direction.into());
        let corners = smooth
            .then(|| world.corner_normals(instance, triangle, geometric))
            .flatten();
        let shading = corners.map_or(geometric, |[a, b, c]| {
            (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric)
        });
        Normals { geometric, shading }
    }
}

/// Rays that are answered at a time: what is told of their triangles is told while these are in the cache.
const PACKET: usize = 64;

/// The rays through the pixels' centres, and what they met.
#[derive(Default)]
pub(crate) struct Exact {
    pub rays: Vec<ExactRay>,
    /// What they met first.
    pub hits: Vec<ExactHit>,
    /// What lies behind that, where the ground truth tells of it; else empty.
    behind: Vec<ExactHit>,
    normals: Vec<Normals>,
}

impl Exact {
    /// Traces the rays of pixels; with `passing` the ground truth is of what lies behind what one sees through.
    pub fn find(
        &mut self,
        world: &PreparedWorld,
        camera: &Camera,
        pixels: &[[u32; 2]],
        settings: &Settings,
        passing: bool,
    ) {
        self.rays.clear();
        self.rays.extend(
            pixels
                .iter()
                .map(|&[x, y]| exact_ray(camera.ray(camera.pixel_center_of(x, y)))),
        );
        self.hits.clear();
        self.hits.resize(pixels.len(), ExactHit::MISS);
        self.behind.clear();
        self.normals.clear();
        let smooth = Normals::asked(&settings.channels);
        let packets = self.rays.chunks(PACKET).zip(self.hits.chunks_mut(PACKET));
        for (rays, hits) in packets {
            world.scene.closest_exact(rays, world, hits);
            let mut told = &*hits;
            if passing {
                let first = self.behind.len();
                self.behind.extend_from_slice(hits);
                world.pass_through(rays, &mut self.behind[first..]);
                told = &self.behind[first..];
            }
            if let Some(smooth) = smooth {
                let told = rays.iter().zip(told);
                self.normals
                    .extend(told.map(|(ray, hit)| Normals::new(world, ray, hit, smooth)));
            }
        }
        self.count_from(camera.start());
    }

    /// [`Exact::find`], where each pixel sees a world of its own: those of a line the same one.
    pub fn find_each(
        &mut self,
        worlds: &[Arc<PreparedWorld>],
        camera: &Camera,
        pixels: &[[u32; 2]],
        settings: &Settings,
        passing: bool,
    ) {
        let mut of_line = Exact::default();
        self.rays.clear();
        self.hits.clear();
        self.behind.clear();
        self.normals.clear();
        let mut from = 0;
        while let Some(world) = worlds.get(from) {
            let same = worlds[from..]
                .iter()
                .take_while(|other| Arc::ptr_eq(other, world));
            let to = from + same.count();
            of_line.find(world, camera, &pixels[from..to], settings, passing);
            self.rays.append(&mut of_line.rays);
            self.hits.append(&mut of_line.hits);
            self.behind.append(&mut of_line.behind);
            self.normals.append(&mut of_line.normals);
            from = to;
        }
    }

    /// Depth and distance count from the plane where rays from infinity have the depth 0, not from their start.
    fn count_from(&mut self, start: f64) {
        if start == 0.0 {
            return;
        }
        for ray in &mut self.rays {
            let back = start * DVec3::from(ray.direction);
            ray.origin = (DVec3::from(ray.origin) - back).to_array();
        }
        for hit in self.hits.iter_mut().chain(&mut self.behind) {
            hit.t += start;
        }
    }

    /// One ray that met nothing.
    pub fn nothing() -> Self {
        Self {
            rays: vec![exact_ray((DVec3::ZERO, DVec3::Z))],
            hits: vec![ExactHit::MISS],
            behind: vec![],
            normals: vec![],
        }
    }

    /// What there is to tell of a ray.
    #[inline]
    pub fn truth<'a>(
        &'a self,
        world: &'a PreparedWorld,
        camera_from_world: &'a DMat3,
        i: usize,
    ) -> Truth<'a> {
        Truth {
            world,
            camera_from_world,
            ray: &self.rays[i],
            hit: self.behind.get(i).unwrap_or(&self.hits[i]),
            normals: self.normals.get(i).unwrap_or(&Normals::NONE),
        }
    }
}

impl Truth<'_> {
    fn missed(&self) -> bool {
        self.hit.instance == NOTHING
    }

    /// The hit as the float32 kernel would tell it.
    fn rounded(&self) -> Hit {
        rounded(self.hit)
    }

    pub fn albedo(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        self.world
            .base_color(&self.rounded(), &Footprint::default())
            .to_array()
    }

    pub fn depth(&self) -> f32 {
        if self.missed() {
            return f32::INFINITY;
        }
        let direction = DVec3::from(self.ray.direction);
        (self.hit.t * direction.dot(self.camera_from_world.row(2))) as f32
    }

    pub fn distance(&self) -> f32 {
        if self.missed() {
            f32::INFINITY
        } else {
            self.hit.t as f32
        }
    }

    pub fn position(&self) -> [f64; 3] {
        let point = if self.missed() {
            DVec3::NAN
        } else {
            DVec3::from(self.ray.origin) + self.hit.t * DVec3::from(self.ray.direction)
        };
        point.to_array()
    }

    /// A normal in the camera's axes.
    pub fn in_camera(&self, normal: impl Fn(&Normals) -> DVec3) -> [f32; 3] {
        stored(*self.camera_from_world * normal(self.normals))
    }

    pub fn barycentric(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        let ExactHit { u, v, .. } = *self.hit;
        [1.0 - u - v, u, v].map(|weight| weight as f32)
    }

    pub fn uv(&self) -> [f32; 2] {
        if self.missed() {
            return [f32::NAN; 2];
        }
        let ExactHit { u, v, .. } = *self.hit;
        self.world
            .uv(self.hit.instance, self.hit.triangle, 0, [u, v])
            .unwrap_or([f32::NAN; 2])
    }

    pub fn category(&self) -> i32 {
        if self.missed() {
            return -1;
        }
        self.world.objects[self.hit.instance as usize].category
    }

    pub fn material(&self) -> i32 {
        if self.missed() {
            return -1;
        }
        let index = self
            .world
            .material_index(self.hit.instance, self.hit.triangle);
        i32::try_from(index).unwrap_or(-1)
    }
}

/// A normal as it is stored; 0 stays 0 whatever its sign.
pub(crate) fn stored(normal: DVec3) -> [f32; 3] {
    (normal + 0.0).as_vec3().to_array()
}

/// An exact hit as the float32 kernel would tell it.
pub(crate) fn rounded(
    &ExactHit {
        t,
        u,
        v,
        instance,
        triangle,
        ..
    }: &ExactHit,
) -> Hit {
    Hit {
        t: t as f32,
        u: u as f32,
        v: v as f32,
        instance,
        triangle,
    }
}

/// An id as it is stored: -1 for nothing.
pub(crate) fn id(id: u32) -> i32 {
    i32::try_from(id).unwrap_or(-1)
}

/// A camera's ray as the exact search takes it.
pub(crate) fn exact_ray((origin, direction): (DVec3, DVec3)) -> ExactRay {
    ExactRay {
        origin: origin.to_array(),
        direction: direction.to_array(),
        t_max: f64::INFINITY,
    }
}
