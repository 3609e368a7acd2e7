//! Vertex data required by materials.

use raycam_scene::{Mesh, NoticeCode};

use crate::gltf::document::Document;
use crate::gltf::json::Primitive;
use crate::gltf::json::material::Material;
use crate::gltf::json::texture_info::TextureInfo;
use crate::io::Diagnostics;

/// Vertex data required by the materials of a primitive, including its variants.
pub(crate) struct MaterialRequirements {
    /// Indices of the required sets of texture coordinates.
    sets: Vec<usize>,
    /// Set of texture coordinates that the tangents follow, if a material requires tangents.
    pub(crate) tangent_uvs: Option<usize>,
}

impl MaterialRequirements {
    /// The requirements of a primitive's materials; materials that do not exist have none.
    pub(crate) fn of_primitive(document: &Document<'_>, primitive: &Primitive) -> Self {
        let mappings = primitive.extensions.variants.iter();
        let mappings = mappings.flat_map(|variants| &variants.mappings);
        let materials = primitive.material.into_iter();
        let (mut sets, mut tangent_uvs) = (Vec::new(), None);
        let indices = materials.chain(mappings.map(|mapping| mapping.material));
        for material in indices.filter_map(|index| document.root.materials.get(index)) {
            sets.extend(material.textures().map(TextureInfo::uv_set));
            tangent_uvs = tangent_uvs.or(material.tangent_uvs());
        }
        sets.sort_unstable();
        sets.dedup();
        Self { sets, tangent_uvs }
    }

    /// Adds a notice for each set of texture coordinates that the mesh lacks.
    pub(crate) fn check_uvs(&self, place: &str, mesh: &Mesh, diagnostics: &mut Diagnostics) {
        for set in self.sets.iter().filter(|&&set| mesh.uv_set(set).is_none()) {
            let message =
                format!("the material uses TEXCOORD_{set}, which the mesh lacks (MESH_PRIMITIVE_TOO_FEW_TEXCOORDS)");
            diagnostics.note(NoticeCode::MissingValue, place, message);
        }
    }
}

impl Material {
    fn textures(&self) -> impl Iterator<Item = &TextureInfo> {
        let pbr = &self.pbr_metallic_roughness;
        let unlit = self.extensions.unlit.is_some();
        let own = [
            pbr.base_color_texture.as_ref(),
            pbr.metallic_roughness_texture.as_ref().filter(|_| !unlit),
            self.normal_texture.as_ref().filter(|_| !unlit),
            self.occlusion_texture.as_ref().filter(|_| !unlit),
            self.emissive_texture.as_ref().filter(|_| !unlit),
        ];
        own.into_iter().flatten()
    }

    /// Set of texture coordinates of the first texture that requires tangents.
    fn tangent_uvs(&self) -> Option<usize> {
        let extensions = &self.extensions;
        if extensions.unlit.is_some() {
            return None;
        }
        let clearcoat = extensions.clearcoat.as_ref();
        let clearcoat = clearcoat.and_then(|coat| coat.clearcoat_normal_texture.as_ref());
        let anisotropy = extensions.anisotropy.as_ref();
        let texture = anisotropy.and_then(|ani| ani.anisotropy_texture.as_ref());
        let first = [self.normal_texture.as_ref(), clearcoat, texture].into_iter().flatten().next();
        first.map(TextureInfo::uv_set).or(anisotropy.map(|_| 0))
    }
}
