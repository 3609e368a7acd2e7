//! Supported extensions of glTF, and the check of the extensions that a file uses and requires.

use std::path::Path;

use raycam_scene::NoticeCode;

use crate::error::{FormatError, Result};
use crate::gltf::json::Root;
use crate::io::Diagnostics;

/// All supported extensions.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Extensions that do not affect the image.
const IGNORABLE: &[&str] = &["KHR_xmp", "KHR_xmp_json_ld"];

/// Rejects a file that requires unsupported extensions, and adds a notice for unsupported extensions that the file only
/// uses.
pub(crate) fn check(root: &Root, path: &Path, diagnostics: &mut Diagnostics) -> Result<()> {
    let known = |name: &String| SUPPORTED.contains(&&name[..]) || IGNORABLE.contains(&&name[..]);
    let unknown: Vec<&str> =
        root.extensions_required.iter().filter(|name| !known(name)).map(|name| &name[..]).collect();
    if !unknown.is_empty() {
        let message = format!(
            "extensionsRequired: {} is not supported (UNSUPPORTED_EXTENSION); supported: {}",
            unknown.join(", "),
            SUPPORTED.join(", ")
        );
        return Err(FormatError::unsupported(path, message));
    }
    for name in root.extensions_used.iter().filter(|name| !known(name)) {
        let message = format!(
            "extension {name} is not supported; it is ignored, because it is not required \
            (UNSUPPORTED_EXTENSION)"
        );
        diagnostics.note(NoticeCode::IgnoredFeature, "extensionsUsed", message);
    }
    Ok(())
}
