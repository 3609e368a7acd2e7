//! Material and vertex attributes at a hit: colours, normals, opacity, emission, texture coordinates.

use glam::{DVec3, Vec2, Vec3};
use raycam_bvh::Hit;
use raycam_scene::{Alpha, MaterialModel, TextureSlot, Textured};

use crate::interaction::ray_cone::{Footprint, RayCone};
use crate::interaction::vector::normalize_facing;
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::texture::TexelWeight;

impl Geometry {
    /// Material of a hit triangle.
    #[inline]
    pub(crate) fn material(&self, hit: &Hit) -> &PreparedMaterial {
        &self.materials[self.material_index(hit.instance, hit.triangle)]
    }

    /// Index of a triangle's material.
    pub(crate) fn material_index(&self, instance: u32, triangle: u32) -> usize {
        let object = &self.instances[instance as usize];
        let slots = object.mesh.mesh.material_slots.as_ref();
        let slot = slots.map_or(0, |slots| usize::from(slots[triangle as usize]));
        object.materials[slot]
    }

    /// World-space normals of a triangle's vertices, of arbitrary length; `None` if the mesh has no normals.
    #[inline]
    pub(crate) fn vertex_normals(&self, instance: u32, triangle: u32) -> Option<[DVec3; 3]> {
        let object = &self.instances[instance as usize];
        let mesh = &*object.mesh.mesh;
        let normals = mesh.normals.as_ref()?;
        let of_vertex = |vertex: u32| {
            let [x, y, z] = normals[vertex as usize];
            object.normal_from_mesh * DVec3::new(f64::from(x), f64::from(y), f64::from(z))
        };
        // Each normal is computed in its own expression, because the compiler may not inline `map`.
        let [a, b, c] = mesh.triangles[triangle as usize];
        Some([of_vertex(a), of_vertex(b), of_vertex(c)])
    }

    /// Unit vertex normals on the side of `geometric`, which replaces missing normals.
    pub(crate) fn facing_vertex_normals(&self, instance: u32, triangle: u32, geometric: DVec3) -> Option<[DVec3; 3]> {
        let normals = self.vertex_normals(instance, triangle)?;
        Some(normals.map(|normal| normalize_facing(normal, geometric)))
    }

    /// Linear base colour at a hit: product of the material's, face's, vertices' and texture's colours.
    pub(crate) fn base_color(&self, hit: &Hit, footprint: &Footprint) -> Vec3 {
        self.base_color_with(self.material(hit), hit, footprint)
    }

    /// Same as [`Geometry::base_color`], with a known material.
    #[inline]
    pub(crate) fn base_color_with(
        &self,
        PreparedMaterial { material, .. }: &PreparedMaterial,
        hit: &Hit,
        footprint: &Footprint,
    ) -> Vec3 {
        let mesh = &*self.instances[hit.instance as usize].mesh.mesh;
        let triangle = hit.triangle as usize;
        let mut color = Vec3::from(material.color);
        if let Some(colors) = &mesh.face_colors {
            color *= Vec3::from(colors[triangle]);
        }
        if let Some(colors) = &mesh.vertex_colors {
            color *= interpolate(mesh.triangles[triangle].map(|i| colors[i as usize].into()), hit);
        }
        let weight = if material.alpha == Alpha::Opaque { TexelWeight::Uniform } else { TexelWeight::Alpha };
        if let Some(texel) = material.texture.and_then(|slot| self.weighted_texel(&slot, hit, footprint, weight)) {
            color *= Vec3::from_slice(&texel);
        }
        color
    }

    /// Opacity at a hit, 0..=1 (glTF 2.0, 3.9.4).
    pub(crate) fn opacity(&self, hit: &Hit) -> f32 {
        let material = &self.material(hit).material;
        if material.alpha == Alpha::Opaque {
            return 1.0;
        }
        let mesh = &*self.instances[hit.instance as usize].mesh.mesh;
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

    /// Perceptual roughness at a hit, 0..=1; 1 without a glossy lobe. For a Phong lobe: the roughness of the
    /// microfacets that correspond to its exponent (B. Walter et al., "Microfacet Models for Refraction through Rough
    /// Surfaces", 2007, section 5.2).
    pub(crate) fn roughness(&self, hit: &Hit) -> f32 {
        match &self.material(hit).material.model {
            MaterialModel::Phong { specular: [0.0, 0.0, 0.0], .. } | MaterialModel::Unlit | MaterialModel::Boundary => {
                1.0
            }
            MaterialModel::Phong { shininess, .. } => (2.0 / (shininess + 2.0)).powf(0.25),
            MaterialModel::Metal(metal) => metal.roughness,
            MaterialModel::Glass(glass) => glass.roughness,
            MaterialModel::Principled(principled) => self.textured(&principled.roughness, 1, hit),
        }
    }

    /// Metallic value at a hit: 1 for a metal, 0 for other materials, in between for mixtures.
    pub(crate) fn metallic(&self, hit: &Hit) -> f32 {
        match &self.material(hit).material.model {
            MaterialModel::Metal(_) => 1.0,
            MaterialModel::Principled(principled) => self.textured(&principled.metallic, 2, hit),
            MaterialModel::Phong { .. } | MaterialModel::Glass(_) | MaterialModel::Unlit | MaterialModel::Boundary => {
                0.0
            }
        }
    }

    /// Diffuse reflectance of the material's texture for lidars at a hit; `None` without such a texture or without
    /// texture coordinates.
    pub(crate) fn reflectance(&self, hit: &Hit) -> Option<f32> {
        let slot = self.material(hit).material.reflectance?;
        self.texel(&slot, hit).map(|texel| texel[0])
    }

    /// Product of a number and a channel of its texture; without texture coordinates, the channel counts as 1.
    fn textured(&self, value: &Textured<f32>, channel: usize, hit: &Hit) -> f32 {
        let texel = value.texture.and_then(|slot| self.texel(&slot, hit));
        value.value * texel.map_or(1.0, |texel| texel[channel])
    }

    /// Radiance in W/(m² sr) that the surface emits towards the origin of a ray with this direction; one-sided surfaces
    /// emit only from their front.
    pub(crate) fn emission(&self, hit: &Hit, direction: Vec3, footprint: &Footprint) -> Vec3 {
        let material = &self.material(hit).material;
        if material.emission.value == [0.0; 3] {
            return Vec3::ZERO;
        }
        if !material.double_sided {
            let [a, b, c] = self.corners(hit.instance, hit.triangle);
            let mirrored = self.instances[hit.instance as usize].flips_orientation;
            let away = (b - a).cross(c - a).dot(direction.as_dvec3()) > 0.0;
            if away != mirrored {
                return Vec3::ZERO;
            }
        }
        let texture = material.emission.texture;
        let texel = texture.and_then(|slot| self.filtered_texel(&slot, hit, footprint));
        Vec3::from(material.emission.value) * texel.map_or(Vec3::ONE, |t| Vec3::from_slice(&t))
    }

    /// Footprint of a ray cone at a hit; a point in a world without textures.
    pub(crate) fn footprint(&self, hit: &Hit, direction: Vec3, cone: &RayCone) -> Footprint {
        if self.textures.is_empty() || cone.width <= 0.0 {
            return Footprint::default();
        }
        Footprint::new(self.corners(hit.instance, hit.triangle), direction, cone)
    }

    /// Texture value at a hit, linear; `None` if the mesh lacks the texture coordinates.
    pub(crate) fn texel(&self, slot: &TextureSlot, hit: &Hit) -> Option<[f32; 4]> {
        let weights = [hit.u, hit.v].map(f64::from);
        let uv = self.uv(hit.instance, hit.triangle, slot.uv_set, weights)?;
        Some(self.textures[slot.texture].lookup(slot.coordinates(uv), TexelWeight::Uniform))
    }

    /// Mean linear texture value over a ray's footprint; `None` if the mesh lacks the texture coordinates.
    pub(crate) fn filtered_texel(&self, slot: &TextureSlot, hit: &Hit, footprint: &Footprint) -> Option<[f32; 4]> {
        self.weighted_texel(slot, hit, footprint, TexelWeight::Uniform)
    }

    /// Mean linear texture value over a ray's footprint, with the texels weighted by `weight`.
    fn weighted_texel(
        &self,
        slot: &TextureSlot,
        hit: &Hit,
        footprint: &Footprint,
        weight: TexelWeight,
    ) -> Option<[f32; 4]> {
        let texture = &self.textures[slot.texture];
        Some(match self.texture_footprint(slot, hit, footprint)? {
            (uv, None) => texture.lookup(uv, weight),
            (uv, Some(axes)) => texture.mean(uv, axes, weight),
        })
    }

    /// Mean gradient of a texture's red channel over a ray's footprint, with respect to the image coordinates.
    pub(crate) fn texel_gradient(&self, slot: &TextureSlot, hit: &Hit, footprint: &Footprint) -> Option<[f32; 2]> {
        let (uv, axes) = self.texture_footprint(slot, hit, footprint)?;
        Some(self.textures[slot.texture].mean_gradient(uv, axes.unwrap_or_default()))
    }

    /// Coordinates of a hit in a texture, and the axes of the ray's footprint at the hit; no axes if the footprint is a
    /// point.
    #[inline]
    fn texture_footprint(
        &self,
        slot: &TextureSlot,
        hit: &Hit,
        footprint: &Footprint,
    ) -> Option<([f32; 2], Option<[Vec2; 2]>)> {
        let corner = |weights| {
            let uv = self.uv(hit.instance, hit.triangle, slot.uv_set, weights)?;
            Some(Vec2::from(slot.coordinates(uv)))
        };
        let uv = corner([hit.u, hit.v].map(f64::from))?.to_array();
        if footprint.is_point() {
            return Some((uv, None));
        }
        let corners = [corner([0.0, 0.0])?, corner([1.0, 0.0])?, corner([0.0, 1.0])?];
        Some((uv, Some(footprint.in_texture(corners))))
    }

    /// Texture coordinates of a set, interpolated with the weights of a triangle's second and third vertex; `None` if
    /// the mesh does not have this set.
    pub(crate) fn uv(&self, instance: u32, triangle: u32, set: usize, weights: [f64; 2]) -> Option<[f32; 2]> {
        let corners = self.uv_corners(instance, triangle, set)?;
        Some(Self::interpolate_uv(&corners, weights))
    }

    /// Texture coordinates of a triangle's vertices; `None` if the mesh does not have this set.
    pub(crate) fn uv_corners(&self, instance: u32, triangle: u32, set: usize) -> Option<[[f64; 2]; 3]> {
        let mesh = &*self.instances[instance as usize].mesh.mesh;
        let uvs = mesh.uv_set(set)?;
        let corner = |vertex: u32| uvs[vertex as usize].map(f64::from);
        Some(mesh.triangles[triangle as usize].map(corner))
    }

    /// Texture coordinates, interpolated with the weights of the second and third vertex.
    #[inline]
    pub(crate) fn interpolate_uv([a, b, c]: &[[f64; 2]; 3], [u, v]: [f64; 2]) -> [f32; 2] {
        [0, 1].map(|axis| (a[axis] + (b[axis] - a[axis]) * u + (c[axis] - a[axis]) * v) as f32)
    }
}

/// Interpolates the values of three vertices at a hit.
fn interpolate([a, b, c]: [Vec3; 3], hit: &Hit) -> Vec3 {
    a + (b - a) * hit.u + (c - a) * hit.v
}
