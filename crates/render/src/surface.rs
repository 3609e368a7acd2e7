//! From a hit to what is there: colour, normals, and where rays may start.

use glam::{DVec3, Vec2, Vec3};
use raycam_bvh::{Hit, Ray};
use raycam_scene::{Alpha, TextureSlot};

use crate::light::Reference;
use crate::prepare::{PreparedMaterial, PreparedWorld};
use crate::scatter::{Frame, Scatter, Scattering};
use crate::texture::Footprint;

impl PreparedWorld {
    /// The material of a hit triangle.
    #[inline]
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
    pub(crate) fn base_color(&self, hit: &Hit, footprint: &Footprint) -> Vec3 {
        self.base_color_of(self.material(hit), hit, footprint)
    }

    /// The same where the hit's material is known.
    #[inline]
    pub(crate) fn base_color_of(
        &self,
        PreparedMaterial { material, .. }: &PreparedMaterial,
        hit: &Hit,
        footprint: &Footprint,
    ) -> Vec3 {
        let mesh = &*self.objects[hit.instance as usize].mesh.mesh;
        let triangle = hit.triangle as usize;
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
        if let Some(texel) = material
            .texture
            .and_then(|slot| self.texel_within(&slot, hit, footprint))
        {
            color *= Vec3::from_slice(&texel);
        }
        color
    }

    /// How much of a hit surface is there, 0..=1 (glTF 2.0, 3.9.4).
    pub(crate) fn opacity(&self, hit: &Hit) -> f32 {
        let material = &self.material(hit).material;
        if material.alpha == Alpha::Opaque {
            return 1.0;
        }
        let mesh = &*self.objects[hit.instance as usize].mesh.mesh;
        let mut opacity = material.opacity;
        if let Some([.., alpha]) = material.texture.and_then(|slot| self.texel(&slot, hit)) {
            opacity *= alpha;
        }
        if let Some(opacities) = &mesh.vertex_opacities {
            let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|i| opacities[i as usize]);
            opacity *= a + (b - a) * hit.u + (c - a) * hit.v;
        }
        match material.alpha {
            Alpha::Mask { cutoff } => f32::from(opacity >= cutoff),
            Alpha::Opaque | Alpha::Blend => opacity,
        }
    }

    /// What the surface shines against a direction, in W/(m² sr): one-sided surfaces from their front alone.
    pub(crate) fn emission(&self, hit: &Hit, direction: Vec3) -> Vec3 {
        let material = &self.material(hit).material;
        if material.emission.value == [0.0; 3] {
            return Vec3::ZERO;
        }
        if !material.double_sided {
            let [a, b, c] = self.corners(hit.instance, hit.triangle);
            let mirrored = self.objects[hit.instance as usize].mirrored;
            let away = (b - a).cross(c - a).dot(direction.as_dvec3()) > 0.0;
            if away != mirrored {
                return Vec3::ZERO;
            }
        }
        let texture = material.emission.texture;
        let texel = texture.and_then(|slot| self.texel(&slot, hit));
        Vec3::from(material.emission.value) * texel.map_or(Vec3::ONE, |t| Vec3::from_slice(&t))
    }

    /// The value of a texture at a hit, linear; `None` where the mesh lacks its coordinates.
    pub(crate) fn texel(&self, slot: &TextureSlot, hit: &Hit) -> Option<[f32; 4]> {
        let weights = [hit.u, hit.v].map(f64::from);
        let uv = self.uv(hit.instance, hit.triangle, slot.uv_set, weights)?;
        Some(self.textures[slot.texture].lookup(slot.coordinates(uv)))
    }

    /// The mean of a texture over the part of the triangle that a ray covers.
    pub(crate) fn texel_within(
        &self,
        slot: &TextureSlot,
        hit: &Hit,
        footprint: &Footprint,
    ) -> Option<[f32; 4]> {
        if footprint.is_point() {
            return self.texel(slot, hit);
        }
        let corner = |weights| {
            let uv = self.uv(hit.instance, hit.triangle, slot.uv_set, weights)?;
            Some(Vec2::from(slot.coordinates(uv)))
        };
        let corners = [
            corner([0.0, 0.0])?,
            corner([1.0, 0.0])?,
            corner([0.0, 1.0])?,
        ];
        let uv = corner([hit.u, hit.v].map(f64::from))?;
        let axes = footprint.in_image(corners);
        Some(self.textures[slot.texture].mean(uv.to_array(), axes))
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

/// A normal on the side that a ray in this direction sees.
#[inline]
pub(crate) fn facing(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}

/// The normal of a triangle, unit length, on the side from which its corners run counter-clockwise; 0 for one without
/// area.
#[inline]
pub(crate) fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (e1, e2) = (b - a, c - a);
    unit(e1.cross(e2)).unwrap_or_else(|| {
        // Scaled by its largest edge: corners may be far apart or close together.
        let scale = e1.abs().max(e2.abs()).max_element().recip();
        (e1 * scale).cross(e2 * scale).normalize_or_zero()
    })
}

/// The direction of a vector whose length is far from the ends of float64.
#[inline]
pub(crate) fn unit(vector: DVec3) -> Option<DVec3> {
    let square = vector.length_squared();
    (1e-200..1e200)
        .contains(&square)
        .then(|| vector / square.sqrt())
}

/// Where a ray meets a triangle, on the side that is seen.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Place {
    /// Scene-local.
    pub position: DVec3,
    /// The triangle's normal, on the viewer's side.
    pub geometric: Vec3,
    /// Of the smooth surface that the triangle stands for.
    normal: Vec3,
    /// Whether the viewer is where the triangle's corners run counter-clockwise.
    pub front: bool,
    /// How far rays that leave it start from it, on the viewer's side and on the other: beyond all float32 rounding.
    above: Vec3,
    below: Vec3,
    /// What the ray covers of the triangle, where there are textures.
    pub footprint: Footprint,
}

impl Place {
    /// Where a ray in this direction meets its hit; `width` is how wide its cone is there.
    #[inline]
    pub fn new(world: &PreparedWorld, direction: Vec3, hit: &Hit, width: f32) -> Self {
        let corners = world.corners(hit.instance, hit.triangle);
        Self::in_triangle(world, corners, direction, hit, width)
    }

    /// The same in a triangle whose corners in the world are known.
    #[inline]
    pub fn in_triangle(
        world: &PreparedWorld,
        corners: [DVec3; 3],
        direction: Vec3,
        hit: &Hit,
        width: f32,
    ) -> Self {
        let corners = corners.map(|corner| corner - world.origin);
        let [a, b, c] = corners;
        let (e1, e2) = (b - a, c - a);
        let position = a + e1 * f64::from(hit.u) + e2 * f64::from(hit.v);
        let outwards = unit_normal(corners);
        let outside = outwards.dot(direction.as_dvec3()) <= 0.0;
        let geometric = if outside { outwards } else { -outwards };
        let beyond = geometric * world.rounding(hit.instance, position, geometric);
        let (normal, lift) = smooth(world, hit, corners, position, geometric);
        Self {
            position,
            geometric: geometric.as_vec3(),
            normal,
            front: outside != world.objects[hit.instance as usize].mirrored,
            above: (beyond + lift).as_vec3(),
            below: -beyond.as_vec3(),
            footprint: if world.textures.is_empty() {
                Footprint::default()
            } else {
                Footprint::new(corners, direction, width)
            },
        }
    }

    /// The directions of the smooth surface, seen along a ray in this direction.
    #[inline]
    pub fn frame(&self, direction: Vec3) -> Frame {
        Frame::new(self.geometric, self.normal, -direction)
    }

    /// Where rays in this direction start, scene-local.
    #[inline]
    pub fn start(&self, direction: Vec3) -> DVec3 {
        let below = self.geometric.dot(direction) < 0.0;
        self.position + if below { self.below } else { self.above }.as_dvec3()
    }

    /// A ray from here into the world.
    #[inline]
    pub fn leaving(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray {
            origin: self.start(direction).as_vec3().to_array(),
            direction: direction.to_array(),
            t_max,
        }
    }
}

/// What happens to light at a place.
#[derive(Clone, Debug)]
pub(crate) struct Surface<'a, S> {
    pub place: &'a Place,
    /// The normals and the viewer.
    pub frame: Frame,
    pub scatter: S,
}

impl<'a> Surface<'a, Scatter<'a>> {
    /// What a ray in this direction sees at its hit, which is this place; `channel` is the colour that it carries, where it
    /// has lost the others by dispersion.
    pub fn new(
        world: &'a PreparedWorld,
        place: &'a Place,
        direction: Vec3,
        hit: &Hit,
        channel: Option<usize>,
        around: f32,
    ) -> Self {
        let smooth = place.frame(direction);
        let (scatter, frame) = Scatter::new(
            world,
            hit,
            smooth,
            place.front,
            channel,
            around,
            &place.footprint,
        );
        Self {
            place,
            frame,
            scatter,
        }
    }
}

impl<S: Scattering> Surface<'_, S> {
    /// This point, as lights are sampled for it.
    #[inline]
    pub fn reference(&self) -> Reference {
        Reference {
            position: self.place.position,
            normal: if self.scatter.is_transmissive() {
                Vec3::ZERO
            } else {
                self.frame.geometric
            },
        }
    }
}

/// The normal of the smooth surface that the corners' normals describe, on the side of `geometric`, and how far above
/// the triangle it lies: rays start there, so that a coarse mesh does not shade itself (J. Hanika, "Hacking the Shadow
/// Terminator", Ray Tracing Gems II, 2021, chapter 4).
fn smooth(
    world: &PreparedWorld,
    hit: &Hit,
    corners: [DVec3; 3],
    position: DVec3,
    geometric: DVec3,
) -> (Vec3, DVec3) {
    let Some(normals) = world.corner_normals(hit.instance, hit.triangle, geometric) else {
        return (geometric.as_vec3(), DVec3::ZERO);
    };
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let weights = [1.0 - u - v, u, v];
    let (mut normal, mut lift) = (DVec3::ZERO, DVec3::ZERO);
    for k in 0..3 {
        normal += normals[k] * weights[k];
        let below = (corners[k] - position).dot(normals[k]).max(0.0);
        lift += normals[k] * (weights[k] * below);
    }
    (normal.normalize_or(geometric).as_vec3(), lift)
}
