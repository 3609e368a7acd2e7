//! JSON of glTF's extensions, except materials.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::gltf::json::lenient::Lenient;

/// Indices of accessors by name, sorted by name.
pub(crate) type Attributes = BTreeMap<String, usize>;

#[derive(Debug, Deserialize)]
pub(crate) struct Lights {
    pub(crate) lights: Vec<Lenient<Light>>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Light {
    #[serde(rename = "type")]
    pub(crate) kind: String,
    #[serde(default = "white")]
    pub(crate) color: [f64; 3],
    #[serde(default = "one")]
    pub(crate) intensity: f64,
    pub(crate) range: Option<f64>,
    pub(crate) spot: Option<Spot>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Spot {
    #[serde(default)]
    pub(crate) inner_cone_angle: f64,
    #[serde(default = "quarter")]
    pub(crate) outer_cone_angle: f64,
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
pub(crate) struct NodeLight {
    pub(crate) light: usize,
}

#[derive(Debug, Deserialize)]
pub(crate) struct GpuInstancing {
    /// Accessors of `TRANSLATION`, `ROTATION` and `SCALE`, and of application-specific names that begin with `_`.
    pub(crate) attributes: Attributes,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Visibility {
    #[serde(default = "yes")]
    pub(crate) visible: bool,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
pub(crate) struct Variants {
    pub(crate) variants: Vec<Variant>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Variant {
    pub(crate) name: String,
}

#[derive(Debug, Deserialize)]
pub(crate) struct VariantMapping {
    pub(crate) mappings: Vec<Mapping>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Mapping {
    pub(crate) variants: Vec<usize>,
    pub(crate) material: usize,
}

#[derive(Debug, Deserialize)]
pub(crate) struct TextureSource {
    pub(crate) source: Option<usize>,
}

/// `EXT_meshopt_compression` and `KHR_meshopt_compression`.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MeshoptView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    pub(crate) byte_stride: u64,
    pub(crate) count: u64,
    pub(crate) mode: String,
    #[serde(default = "none")]
    pub(crate) filter: String,
}

fn none() -> String {
    "NONE".into()
}

#[derive(Debug, Deserialize)]
pub(crate) struct Pointer {
    pub(crate) pointer: String,
}
