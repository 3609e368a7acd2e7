//! A hit whose material is evaluated, with the material's textures.

use std::cell::Cell;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{NormalMap, TextureSlot, Textured};

use crate::interaction::SurfaceInteraction;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::Footprint;
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::shading_frame::ShadingFrame;
use crate::prepare::geometry::Geometry;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

/// A hit, its material, and the properties of the path that arrives there.
pub(crate) struct MaterialHit<'a> {
    pub geometry: &'a Geometry,
    pub material: &'a PreparedMaterial,
    pub hit: &'a Hit,
    pub footprint: &'a Footprint,
    /// The shading frame without any normal map.
    pub unmapped_frame: ShadingFrame,
    pub is_front: bool,
    /// The only colour channel of the path; `None` if the path transports all channels.
    pub channel: Option<usize>,
    /// Index of refraction outside of the material's own interior.
    pub outside_ior: f32,
    /// Last texture that was read; several values are often channels of the same texture.
    cached: Cell<Option<(TextureSlot, [f32; 4])>>,
}

impl<'a> MaterialHit<'a> {
    /// Hit of a ray in `direction`, on a path that transports all colours in empty space.
    #[inline]
    pub fn new(geometry: &'a Geometry, hit: &'a Hit, interaction: &'a SurfaceInteraction, direction: Vec3) -> Self {
        Self {
            geometry,
            material: geometry.material(hit),
            hit,
            footprint: &interaction.footprint,
            unmapped_frame: interaction.shading_frame(direction),
            is_front: interaction.is_front,
            channel: None,
            outside_ior: 1.0,
            cached: Cell::new(None),
        }
    }

    /// Hit of a lane's ray, on a path that transports all colours in empty space.
    #[inline]
    pub fn at_lane(
        geometry: &'a Geometry,
        hit: &'a Hit,
        interactions: &'a SurfaceInteractions<LANES>,
        lane: usize,
    ) -> Self {
        Self {
            geometry,
            material: geometry.material(hit),
            hit,
            footprint: interactions.footprint(lane),
            unmapped_frame: interactions.shading_frame(lane),
            is_front: interactions.is_front(lane),
            channel: None,
            outside_ior: 1.0,
            cached: Cell::new(None),
        }
    }

    /// Returns this hit on a path with this colour channel and this index of refraction outside of the material.
    #[inline]
    pub fn seen_by(self, channel: Option<usize>, outside_ior: f32) -> Self {
        Self { channel, outside_ior, ..self }
    }

    /// Linear base colour at the hit.
    #[inline]
    pub fn base_color(&self) -> Vec3 {
        self.geometry.base_color_with(self.material, self.hit, self.footprint)
    }

    /// Normal from the material's normal map and height map, if the material has either of these maps.
    #[inline]
    pub fn mapped_normal(&self) -> Option<Vec3> {
        let material = &self.material.material;
        if material.bends_normals() { self.bent_normal(material.normal_map.as_ref()) } else { None }
    }

    /// Shading normal bent by a normal map and by the material's height map; `None` without either.
    pub fn bent_normal(&self, normal_map: Option<&NormalMap>) -> Option<Vec3> {
        let normal = self.unmapped_frame.normal;
        let mapped = normal_map
            .and_then(|map| self.geometry.mapped_normal(map, self.hit, self.footprint, normal, self.is_front));
        let Some(heights) = &self.material.material.height_map else { return mapped };
        let normals = [normal, mapped.unwrap_or(normal)];
        self.geometry.bumped_normal(heights, self.hit, self.footprint, normals, self.is_front).or(mapped)
    }

    /// Mapped normal for layers that mirror: it keeps the mirror direction above the surface.
    #[inline]
    pub fn mapped_mirror_normal(&self) -> Option<Vec3> {
        self.mapped_normal().map(|normal| self.unmapped_frame.keep_mirror_above(normal))
    }

    /// Albedo table of the rough interface, for the path's colour channel.
    pub fn dielectric_albedo(&self) -> Option<&'a DielectricAlbedo> {
        let tables = &self.material.dielectric_tables;
        tables.get(self.channel.unwrap_or(1)).or(tables.first())
    }

    /// Returns a texture's value, or ones if there is no texture or the mesh lacks its coordinates.
    pub fn texel(&self, slot: Option<TextureSlot>) -> [f32; 4] {
        let Some(slot) = slot else { return [1.0; 4] };
        if let Some((cached, texel)) = self.cached.get()
            && cached == slot
        {
            return texel;
        }
        let texel = self.geometry.filtered_texel(&slot, self.hit, self.footprint).unwrap_or([1.0; 4]);
        self.cached.set(Some((slot, texel)));
        texel
    }

    /// Returns a number, multiplied by a channel of its texture.
    pub fn value(&self, value: &Textured<f32>, channel: usize) -> f32 {
        match value.texture {
            None => value.value,
            slot => value.value * self.texel(slot)[channel],
        }
    }

    /// Returns a colour, multiplied by its texture.
    pub fn color(&self, value: &Textured<[f32; 3]>) -> Vec3 {
        let color = Vec3::from(value.value);
        match value.texture {
            None => color,
            slot => color * Vec3::from_slice(&self.texel(slot)),
        }
    }
}
