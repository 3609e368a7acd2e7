//! From a hit to what is there: colour, normals, and where rays may start.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;
use raycam_scene::Reflectance;

use crate::prepare::{PreparedMaterial, PreparedWorld};

impl PreparedWorld {
    /// The material of a hit triangle.
    pub(crate) fn material(&self, hit: &Hit) -> &PreparedMaterial {
        &self.materials[self.material_index(hit.instance, hit.triangle)]
    }

    /// Which of the world's materials a triangle has.
    pub(crate) fn material_index(&self, instance: u32, triangle: u32) -> usize {
        let object = &self.objects[instance as usize];
        let slots = object.mesh.mesh.material_slots.as_ref();
        let slot = slots.map_or(0, |slots| usize::from(slots[triangle as usize]));
        object.materials[slot]
    }

    /// The normals of a triangle's corners in the world, unit length, on the side of `geometric`, which stands in where a
    /// corner has none; `None` where the mesh has none.
    pub(crate) fn corner_normals(
        &self,
        instance: u32,
        triangle: u32,
        geometric: DVec3,
    ) -> Option<[DVec3; 3]> {
        let object = &self.objects[instance as usize];
        let mesh = &*object.mesh.mesh;
        let normals = mesh.normals.as_ref()?;
        Some(mesh.triangles[triangle as usize].map(|vertex| {
            let normal = DVec3::from(normals[vertex as usize].map(f64::from));
            let normal = (object.normal_from_mesh * normal).normalize_or(geometric);
            if normal.dot(geometric) < 0.0 {
                -normal
            } else {
                normal
            }
        }))
    }

    /// The linear base colour at a hit: the product of its material's, its triangle's, its corners' and its texture's.
    pub(crate) fn base_color(&self, hit: &Hit) -> Vec3 {
        let mesh = &*self.objects[hit.instance as usize].mesh.mesh;
        let triangle = hit.triangle as usize;
        let material = &self.material(hit).material;
        let mut color = Vec3::from(material.color);
        if let Some(colors) = &mesh.face_colors {
            color *= Vec3::from(colors[triangle]);
        }
        if let Some(colors) = &mesh.vertex_colors {
            color *= interpolate(
                mesh.triangles[triangle].map(|i| colors[i as usize].into()),
                hit,
            );
        }
        if let Some(slot) = &material.texture
            && let Some(uv) = self.uv(
                hit.instance,
                hit.triangle,
                slot.uv_set,
                [hit.u, hit.v].map(f64::from),
            )
        {
            let texel = self.textures[slot.texture].lookup(slot.coordinates(uv));
            color *= Vec3::from_slice(&texel);
        }
        color
    }

    /// Texture coordinates of a set at the weights of a triangle's second and third corner; `None` where the mesh has
    /// none.
    pub(crate) fn uv(
        &self,
        instance: u32,
        triangle: u32,
        set: usize,
        [u, v]: [f64; 2],
    ) -> Option<[f32; 2]> {
        let mesh = &*self.objects[instance as usize].mesh.mesh;
        let uvs = mesh.uv_set(set)?;
        let corners = mesh.triangles[triangle as usize].map(|vertex| uvs[vertex as usize]);
        Some([0, 1].map(|axis| {
            let [a, b, c] = corners.map(|corner| f64::from(corner[axis]));
            (a + (b - a) * u + (c - a) * v) as f32
        }))
    }
}

/// A value of the three corners at a hit.
fn interpolate([a, b, c]: [Vec3; 3], hit: &Hit) -> Vec3 {
    a + (b - a) * hit.u + (c - a) * hit.v
}

/// The normal of a triangle in the world, unit length, against `direction`; 0 for one without area.
pub(crate) fn facing_normal([a, b, c]: [DVec3; 3], direction: DVec3) -> DVec3 {
    // Scaled by its largest edge: corners may be far apart or close together.
    let (e1, e2) = (b - a, c - a);
    let scale = e1.abs().max(e2.abs()).max_element();
    let normal = (e1 / scale).cross(e2 / scale).normalize_or_zero();
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}

/// A lit point of a surface, on the side that is seen. All vectors are in the world and of unit length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface<'a> {
    /// Index of its ray in the batch.
    pub ray: usize,
    /// Scene-local.
    pub position: DVec3,
    /// Where rays that leave the surface start: beyond all float32 rounding, scene-local.
    pub start: DVec3,
    /// Of the triangle.
    pub geometric: Vec3,
    /// Of the smooth surface that the triangle stands for.
    pub normal: Vec3,
    /// Towards the viewer.
    pub view: Vec3,
    pub base: Vec3,
    pub material: &'a PreparedMaterial,
}

impl<'a> Surface<'a> {
    pub fn new(world: &'a PreparedWorld, ray: usize, direction: Vec3, hit: &Hit) -> Self {
        let corners = world
            .corners(hit.instance, hit.triangle)
            .map(|corner| corner - world.origin);
        let [a, b, c] = corners;
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let position = a + (b - a) * u + (c - a) * v;
        let geometric = facing_normal(corners, direction.as_dvec3());
        let mut surface = Self {
            ray,
            position,
            start: position + geometric * world.rounding(hit.instance, position, geometric),
            geometric: geometric.as_vec3(),
            normal: geometric.as_vec3(),
            view: -direction,
            base: world.base_color(hit),
            material: world.material(hit),
        };
        surface.smooth(world, hit, corners, geometric);
        surface
    }

    /// Takes the normal from the corners' normals, where there are any, and lifts the start of rays to the smooth
    /// surface, so that a coarse mesh does not shade itself (J. Hanika, "Hacking the Shadow Terminator", Ray Tracing
    /// Gems II, 2021, chapter 4).
    fn smooth(&mut self, world: &PreparedWorld, hit: &Hit, corners: [DVec3; 3], geometric: DVec3) {
        let Some(normals) = world.corner_normals(hit.instance, hit.triangle, geometric) else {
            return;
        };
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let weights = [1.0 - u - v, u, v];
        let (mut normal, mut lift) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..3 {
            normal += normals[k] * weights[k];
            let below = (corners[k] - self.position).dot(normals[k]).max(0.0);
            lift += normals[k] * (weights[k] * below);
        }
        self.normal = normal.normalize_or(geometric).as_vec3();
        self.start += lift;
    }

    /// Reflectance times cosine towards a light: what share of an irradiance becomes radiance towards the viewer.
    pub fn reflected(&self, light: Vec3) -> Vec3 {
        let cosine = self.normal.dot(light);
        // Light from below the triangle would shine through it, whatever the smooth surface says.
        if cosine <= 0.0 || self.geometric.dot(light) <= 0.0 {
            return Vec3::ZERO;
        }
        let Reflectance::Lecture {
            diffuse, specular, ..
        } = &self.material.material.reflectance
        else {
            return Vec3::ZERO;
        };
        let mut reflected = self.base * (*diffuse * std::f32::consts::FRAC_1_PI);
        if let Some(lobe) = &self.material.lobe {
            reflected += Vec3::from(*specular) * lobe.evaluate(self.normal, self.view, light);
        }
        reflected * cosine
    }

    /// The radiance towards the viewer under a sky of radiance 1 that nothing hides.
    pub fn ambient(&self) -> Vec3 {
        let Reflectance::Lecture {
            diffuse, specular, ..
        } = &self.material.material.reflectance
        else {
            return Vec3::ZERO;
        };
        let mut reflected = self.base * *diffuse;
        if let Some(lobe) = &self.material.lobe {
            reflected += Vec3::from(*specular) * lobe.albedo(self.normal.dot(self.view));
        }
        reflected
    }
}
