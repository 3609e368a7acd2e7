//! Displacement of an object's mesh by the heights of its materials.

use std::sync::Arc;

use glam::DMat3;

use crate::displacement::{Displacement, HeightField};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::material::height_map::HeightUnit;
use crate::mesh::Mesh;
use crate::schema::spec::displace::DisplaceSpec;
use crate::schema::spec::object::ObjectSpec;
use crate::texture::Texture;

/// Mesh of an object with its materials and the textures that they add to the world.
pub(super) struct ObjectParts<'a> {
    pub mesh: &'a mut Arc<Mesh>,
    pub materials: &'a mut [Material],
    /// Textures that the world already contains.
    pub known_textures: &'a [Arc<Texture>],
    /// Textures to be added to the world; their indices follow the indices of `known_textures`.
    pub new_textures: &'a mut Vec<Texture>,
}

impl ObjectSpec {
    /// Displaces a mesh if the description has the key `displace`. The materials then lose their height maps, because
    /// the surface itself has the relief, and textures that only the height maps used are removed.
    ///
    /// # Errors
    /// [`SceneError::Schema`] for invalid settings, for materials without heights, and the errors of
    /// [`Displacement::apply`].
    pub(super) fn displace_parts(&self, parts: ObjectParts<'_>, world_from_mesh: DMat3) -> Result<()> {
        let Some(settings) = self.displace.map(DisplaceSpec::settings).transpose()? else { return Ok(()) };
        let ObjectParts { mesh, materials, known_textures, new_textures } = parts;
        if materials.iter().all(|material| material.height_map.is_none()) {
            let message = "requires textures.height, which this object does not have";
            return Err(SceneError::schema(ErrorCode::MissingValue, "displace", message));
        }
        if materials.iter().any(|material| material.height_map.is_some_and(|map| map.unit == HeightUnit::Texel)) {
            let message = "requires height_scale, because the heights of the file's material have no unit";
            return Err(SceneError::schema(ErrorCode::MissingValue, "displace", message));
        }
        let texture = |index: usize| match known_textures.get(index) {
            Some(known) => &**known,
            None => &new_textures[index - known_textures.len()],
        };
        let levels = |texture: &Texture| {
            let images = if settings.max_edge > 0.0 { texture.image.mip_map() } else { vec![] };
            images.into_iter().map(|image| Texture { image, sampler: texture.sampler }).collect()
        };
        let heights = |material: &Material| {
            material.height_map.map(|map| HeightField {
                texture: texture(map.texture.texture),
                levels: levels(texture(map.texture.texture)),
                slot: map.texture,
                scale: map.scale.into(),
                zero: settings.zero,
            })
        };
        let displacement = Displacement {
            heights: materials.iter().map(heights).collect(),
            world_from_mesh,
            max_edge: settings.max_edge,
            max_triangles: settings.max_triangles,
        };
        *mesh = Arc::new(displacement.apply(mesh).map_err(|error| error.in_context("displace"))?);
        let maps: Vec<_> = materials.iter_mut().filter_map(|material| material.height_map.take()).collect();
        let is_used = |index: usize| materials.iter().flat_map(Material::texture_slots).any(|s| s.texture == index);
        while let Some(last) = (known_textures.len() + new_textures.len()).checked_sub(1)
            && !new_textures.is_empty()
            && maps.iter().any(|map| map.texture.texture == last)
            && !is_used(last)
        {
            new_textures.pop();
        }
        Ok(())
    }
}
