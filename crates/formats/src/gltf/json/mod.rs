//! JSON of glTF 2.0 as typed data. Unknown keys are ignored, as the specification requires (section 3.12 on extensions,
//! 3.13 on extras); required keys have required types.

/// The objects of glTF's JSON. Field names are converted to camel case unless another name is given; all fields are
/// optional.
macro_rules! json_objects {
    ($($(#[$about:meta])* struct $name:ident {
        $($(#[$note:meta])* $($key:literal)? $field:ident: $type:ty,)*
    })*) => {$(
        $(#[$about])*
        #[derive(Debug, Default, serde::Deserialize)]
        #[serde(rename_all = "camelCase", default)]
        pub(crate) struct $name {
            $($(#[$note])* $(#[serde(rename = $key)])? pub(crate) $field: $type,)*
        }
    )*};
}

pub(crate) mod extensions;
pub(crate) mod lenient;
pub(crate) mod material;
pub(crate) mod objects_only;
pub(crate) mod omissions;
pub(crate) mod texture_info;
use serde::Deserialize;

use crate::gltf::json::extensions::{
    Attributes, GpuInstancing, Lights, MeshoptView, NodeLight, Pointer, TextureSource, Variant, VariantMapping,
    Variants, Visibility,
};
use crate::gltf::json::lenient::Lenient;
use crate::gltf::json::material::Material;

json_objects! {
    /// A glTF document: the root object of the JSON.
    struct Root {
        asset: Option<Asset>,
        extensions_used: Vec<String>,
        extensions_required: Vec<String>,
        scene: Option<usize>,
        scenes: Vec<Scene>,
        nodes: Vec<Node>,
        meshes: Vec<Mesh>,
        cameras: Vec<Lenient<Camera>>,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        images: Vec<Image>,
        samplers: Vec<Sampler>,
        accessors: Vec<Accessor>,
        buffer_views: Vec<BufferView>,
        buffers: Vec<Buffer>,
        skins: Vec<Skin>,
        animations: Vec<Lenient<Animation>>,
        extensions: RootExtensions,
    }

    struct RootExtensions {
        "KHR_lights_punctual" lights: Option<Lenient<Lights>>,
        "KHR_materials_variants" variants: Option<Variants>,
    }
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

json_objects! {
    struct Scene {
        name: String,
        nodes: Vec<usize>,
    }

    struct Node {
        name: String,
        children: Vec<usize>,
        matrix: Option<[f64; 16]>,
        translation: Option<[f64; 3]>,
        rotation: Option<[f64; 4]>,
        scale: Option<[f64; 3]>,
        mesh: Option<usize>,
        camera: Option<Lenient<usize>>,
        skin: Option<usize>,
        weights: Option<Vec<f32>>,
        extensions: NodeExtensions,
    }
}

impl Node {
    /// Notice about an invalid transform that can still be read.
    pub(crate) fn transform_warning(&self) -> Option<&'static str> {
        let parts = self.translation.is_some() || self.rotation.is_some() || self.scale.is_some();
        // A rotation of length 0 is omitted later, with its own notice.
        let square: f64 = (self.rotation).map_or(1.0, |xyzw| xyzw.iter().map(|v| v * v).sum());
        if self.matrix.is_some() && parts {
            Some("both matrix and translation, rotation or scale; the matrix is used (NODE_MATRIX_TRS)")
        } else if square > 0.0 && (square.sqrt() - 1.0).abs() > 0.01 {
            Some("the rotation was normalised to length 1 (ROTATION_NON_UNIT)")
        } else {
            None
        }
    }
}

json_objects! {
    struct NodeExtensions {
        "KHR_lights_punctual" light: Option<Lenient<NodeLight>>,
        "EXT_mesh_gpu_instancing" instancing: Option<GpuInstancing>,
        "KHR_node_visibility" visibility: Option<Visibility>,
    }
}

impl NodeExtensions {
    /// Accessors with the transforms of the node's instances.
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

json_objects! {
    struct PrimitiveExtensions {
        "KHR_draco_mesh_compression" draco: Option<Draco>,
        "KHR_materials_variants" variants: Option<VariantMapping>,
    }
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
    /// glTF requires this value, although a ray tracer does not clip.
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

json_objects! {
    struct Texture {
        sampler: Option<usize>,
        source: Option<usize>,
        extensions: TextureExtensions,
    }

    struct TextureExtensions {
        "KHR_texture_basisu" basisu: Option<TextureSource>,
        "EXT_texture_webp" webp: Option<TextureSource>,
    }

    struct Image {
        name: String,
        uri: Option<String>,
        buffer_view: Option<usize>,
    }

    struct Sampler {
        mag_filter: Option<u32>,
        min_filter: Option<u32>,
        wrap_s: Option<u32>,
        wrap_t: Option<u32>,
    }
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

json_objects! {
    struct ViewExtensions {
        "EXT_meshopt_compression" ext_meshopt: Option<MeshoptView>,
        "KHR_meshopt_compression" khr_meshopt: Option<MeshoptView>,
    }
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
    pub(crate) channels: Vec<Lenient<Channel>>,
    pub(crate) samplers: Vec<Lenient<AnimationSampler>>,
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

json_objects! {
    struct TargetExtensions {
        "KHR_animation_pointer" pointer: Option<Pointer>,
    }
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
