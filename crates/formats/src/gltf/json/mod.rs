//! The JSON of glTF 2.0 as typed data. Unknown keys are passed over, as the specification demands (section 3.12 on
//! extensions, 3.13 on extras); what is required is typed as required.

pub(crate) mod extensions;
pub(crate) mod material;
pub(crate) mod texture_info;
use serde::Deserialize;

use crate::gltf::json::extensions::{
    Attributes, GpuInstancing, Lights, MeshoptView, NodeLight, Pointer, TextureSource, Variant, VariantMapping,
    Variants, Visibility,
};
use crate::gltf::json::material::Material;

/// A document.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Root {
    pub(crate) asset: Option<Asset>,
    pub(crate) extensions_used: Vec<String>,
    pub(crate) extensions_required: Vec<String>,
    pub(crate) scene: Option<usize>,
    pub(crate) scenes: Vec<Scene>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    pub(crate) images: Vec<Image>,
    pub(crate) samplers: Vec<Sampler>,
    pub(crate) accessors: Vec<Accessor>,
    pub(crate) buffer_views: Vec<BufferView>,
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) skins: Vec<Skin>,
    pub(crate) animations: Vec<Animation>,
    pub(crate) extensions: RootExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(crate) lights: Option<Lights>,
    #[serde(rename = "KHR_materials_variants")]
    pub(crate) variants: Option<Variants>,
}

impl RootExtensions {
    pub(crate) fn variants(&self) -> &[Variant] {
        self.variants.as_ref().map_or(&[], |list| &list.variants)
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Asset {
    pub(crate) version: String,
    pub(crate) min_version: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Scene {
    pub(crate) name: String,
    pub(crate) nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) children: Vec<usize>,
    pub(crate) matrix: Option<[f64; 16]>,
    pub(crate) translation: Option<[f64; 3]>,
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
    pub(crate) mesh: Option<usize>,
    pub(crate) camera: Option<usize>,
    pub(crate) skin: Option<usize>,
    pub(crate) weights: Option<Vec<f32>>,
    pub(crate) extensions: NodeExtensions,
}

impl Node {
    /// The notice about a faulty transform that can be read all the same.
    pub(crate) fn transform_warning(&self) -> Option<&'static str> {
        let parts = self.translation.is_some() || self.rotation.is_some() || self.scale.is_some();
        let square: f64 = (self.rotation).map_or(1.0, |xyzw| xyzw.iter().map(|v| v * v).sum());
        if self.matrix.is_some() && parts {
            Some("a matrix, and translation, rotation or scale: the matrix counts (NODE_MATRIX_TRS)")
        } else if (square.sqrt() - 1.0).abs() > 0.01 {
            Some("the length of its rotation is not 1: it is made 1 (ROTATION_NON_UNIT)")
        } else {
            None
        }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(crate) light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(crate) instancing: Option<GpuInstancing>,
    #[serde(rename = "KHR_node_visibility")]
    pub(crate) visibility: Option<Visibility>,
}

impl NodeExtensions {
    /// Accessors of the transforms of the instances of the node.
    pub(crate) fn instances(&self) -> Option<&Attributes> {
        self.instancing.as_ref().map(|ext| &ext.attributes)
    }
}

#[derive(Debug, Deserialize)]
pub(crate) struct Mesh {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) primitives: Vec<Primitive>,
    pub(crate) weights: Option<Vec<f32>>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Primitive {
    pub(crate) attributes: Attributes,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    #[serde(default = "triangles")]
    pub(crate) mode: u32,
    #[serde(default)]
    pub(crate) targets: Vec<Attributes>,
    #[serde(default)]
    pub(crate) extensions: PrimitiveExtensions,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(crate) draco: Option<Draco>,
    #[serde(rename = "KHR_materials_variants")]
    pub(crate) variants: Option<VariantMapping>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Draco {
    pub(crate) buffer_view: usize,
    pub(crate) attributes: Attributes,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Camera {
    #[serde(default)]
    pub(crate) name: String,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) perspective: Option<Perspective>,
    pub(crate) orthographic: Option<Orthographic>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Perspective {
    pub(crate) aspect_ratio: Option<f64>,
    pub(crate) yfov: f64,
    /// Required, though a ray tracer does not cut anything off.
    #[serde(rename = "znear")]
    pub(crate) _near: f64,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Orthographic {
    pub(crate) xmag: f64,
    pub(crate) ymag: f64,
    #[serde(rename = "znear")]
    pub(crate) _near: f64,
    #[serde(rename = "zfar")]
    pub(crate) _far: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Texture {
    pub(crate) sampler: Option<usize>,
    pub(crate) source: Option<usize>,
    pub(crate) extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct TextureExtensions {
    #[serde(rename = "KHR_texture_basisu")]
    pub(crate) basisu: Option<TextureSource>,
    #[serde(rename = "EXT_texture_webp")]
    pub(crate) webp: Option<TextureSource>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Image {
    pub(crate) name: String,
    pub(crate) uri: Option<String>,
    pub(crate) buffer_view: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Sampler {
    pub(crate) mag_filter: Option<u32>,
    pub(crate) min_filter: Option<u32>,
    pub(crate) wrap_s: Option<u32>,
    pub(crate) wrap_t: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<usize>,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
    #[serde(default)]
    pub(crate) normalized: bool,
    pub(crate) count: u64,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) min: Option<Vec<f64>>,
    pub(crate) max: Option<Vec<f64>>,
    pub(crate) sparse: Option<Sparse>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Sparse {
    pub(crate) count: u64,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    pub(crate) byte_stride: Option<u64>,
    #[serde(default)]
    pub(crate) extensions: ViewExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub(crate) ext_meshopt: Option<MeshoptView>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub(crate) khr_meshopt: Option<MeshoptView>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Skin {
    pub(crate) inverse_bind_matrices: Option<usize>,
    pub(crate) joints: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Animation {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) channels: Vec<Channel>,
    pub(crate) samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Channel {
    pub(crate) sampler: usize,
    pub(crate) target: ChannelTarget,
}

#[derive(Debug, Deserialize)]
pub(crate) struct ChannelTarget {
    pub(crate) node: Option<usize>,
    pub(crate) path: String,
    #[serde(default)]
    pub(crate) extensions: TargetExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub(crate) pointer: Option<Pointer>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct AnimationSampler {
    pub(crate) input: usize,
    pub(crate) output: usize,
    #[serde(default = "linear")]
    pub(crate) interpolation: String,
}

fn linear() -> String {
    "LINEAR".into()
}
