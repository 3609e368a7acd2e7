//! The JSON of glTF's extensions, materials apart.

use serde::Deserialize;

use super::json::Attributes;

#[derive(Debug, Deserialize)]
pub(super) struct Lights {
    pub(super) lights: Vec<Light>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Light {
    #[serde(rename = "type")]
    pub(super) kind: String,
    #[serde(default = "white")]
    pub(super) color: [f64; 3],
    #[serde(default = "one")]
    pub(super) intensity: f64,
    pub(super) range: Option<f64>,
    pub(super) spot: Option<Spot>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Spot {
    #[serde(default)]
    pub(super) inner_cone_angle: f64,
    #[serde(default = "quarter")]
    pub(super) outer_cone_angle: f64,
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}

fn quarter() -> f64 {
    std::f64::consts::FRAC_PI_4
}

#[derive(Debug, Deserialize)]
pub(super) struct NodeLight {
    pub(super) light: usize,
}

#[derive(Debug, Deserialize)]
pub(super) struct GpuInstancing {
    pub(super) attributes: Instance,
}

/// Accessors by `TRANSLATION`, `ROTATION`, `SCALE` and names that begin with `_`.
pub(super) type Instance = Attributes;

#[derive(Debug, Deserialize)]
pub(super) struct Visibility {
    #[serde(default = "yes")]
    pub(super) visible: bool,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
pub(super) struct Variants {
    pub(super) variants: Vec<Variant>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Variant {
    pub(super) name: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct VariantMapping {
    pub(super) mappings: Vec<Mapping>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mapping {
    pub(super) variants: Vec<usize>,
    pub(super) material: usize,
}

#[derive(Debug, Deserialize)]
pub(super) struct TextureSource {
    pub(super) source: Option<usize>,
}

/// `KHR_texture_transform`.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct UvTransform {
    #[serde(default)]
    pub(super) offset: [f64; 2],
    #[serde(default)]
    pub(super) rotation: f64,
    #[serde(default = "ones")]
    pub(super) scale: [f64; 2],
    pub(super) tex_coord: Option<usize>,
}

fn ones() -> [f64; 2] {
    [1.0; 2]
}

/// `EXT_meshopt_compression` and `KHR_meshopt_compression`.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshoptView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: u64,
    pub(super) count: u64,
    pub(super) mode: String,
    #[serde(default = "none")]
    pub(super) filter: String,
}

fn none() -> String {
    "NONE".into()
}

#[derive(Debug, Deserialize)]
pub(super) struct Pointer {
    pub(super) pointer: String,
}
