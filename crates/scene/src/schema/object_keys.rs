//! Groups of an object's keys.

use std::sync::LazyLock;

/// Keys that identify the object or apply to it as a whole.
pub(super) const WHOLE_OBJECT: [&str; 5] = ["name", "category", "visible", "shadow_catcher", "lidar"];
/// Keys that each define the shape.
pub(super) const SHAPES: [&str; 9] =
    ["box", "plane", "sphere", "cylinder", "cone", "torus", "mesh", "vertices", "instance_of"];
/// Keys that belong to the mesh, not to its placement or material.
pub(super) const GEOMETRY: [&str; 7] =
    ["triangles", "refine", "displace", "face_colors", "vertex_colors", "uvs", "normals"];
/// Keys that define the placement.
pub(super) const PLACEMENT: [&str; 6] = ["location", "roll", "pitch", "yaw", "scale", "matrix"];
/// Keys that are valid for several material types.
pub(super) const COMMON_KEYS: [&str; 12] = [
    "type",
    "color",
    "texture",
    "textures",
    "wrap",
    "height_scale",
    "specular",
    "emission",
    "opacity",
    "alpha",
    "roughness",
    "slots",
];
/// Keys of the lecture's material.
pub(super) const PHONG_KEYS: [&str; 2] = ["diffuse", "shininess"];
/// Keys of metals.
pub(super) const METAL_KEYS: [&str; 1] = ["metal"];
/// Keys of glass.
pub(super) const GLASS_KEYS: [&str; 6] =
    ["ior", "thin", "dispersion", "attenuation_color", "attenuation_distance", "priority"];
/// Keys of media.
pub(super) const MEDIUM_KEYS: [&str; 1] = ["medium"];
/// Keys of the principled material.
pub(super) const PRINCIPLED_KEYS: [&str; 14] = [
    "metallic",
    "specular_color",
    "transmission",
    "clearcoat",
    "clearcoat_roughness",
    "sheen_color",
    "sheen_roughness",
    "iridescence",
    "iridescence_ior",
    "iridescence_thickness",
    "anisotropy",
    "anisotropy_rotation",
    "diffuse_transmission",
    "diffuse_transmission_color",
];

/// Groups of all material keys.
pub(super) const MATERIAL_KEYS: [&[&str]; 6] =
    [&COMMON_KEYS, &PHONG_KEYS, &METAL_KEYS, &GLASS_KEYS, &MEDIUM_KEYS, &PRINCIPLED_KEYS];

/// Keys that a table of `slots` accepts.
pub(super) static SLOT_KEYS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| MATERIAL_KEYS.into_iter().flatten().copied().filter(|key| *key != "slots").collect());

/// True for a key of an object.
pub(super) fn is_object_key(key: &str) -> bool {
    let others: [&[&str]; 5] = [&WHOLE_OBJECT, &SHAPES, &GEOMETRY, &PLACEMENT, &["upright"]];
    others.into_iter().chain(MATERIAL_KEYS).any(|group| group.contains(&key))
}
