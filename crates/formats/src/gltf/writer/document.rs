//! State of an export: the document's lists, and the meshes and textures that have been written.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use raycam_scene::{Image, Mesh, Notice, NoticeCode, TextureSampler, World};
use serde_json::{Map, Value, json};

use crate::gltf::writer::binary::BinaryChunk;

/// Document under construction.
pub(crate) struct Writer<'a> {
    pub(crate) world: &'a World,
    pub(crate) binary: BinaryChunk,
    /// Lists of the document, such as `meshes`, by key.
    pub(crate) lists: BTreeMap<&'static str, Vec<Value>>,
    pub(crate) lights: Vec<Value>,
    pub(crate) extensions: BTreeSet<&'static str>,
    pub(crate) meshes: WrittenMeshes,
    pub(crate) textures: WrittenTextures,
    /// For each light, its definition in the node tree and its index in the document; then the same for each camera.
    pub(crate) light_definition: Vec<(usize, usize)>,
    pub(crate) camera_definition: Vec<(usize, usize)>,
    pub(crate) notices: Vec<Notice>,
}

/// Meshes that have been written.
#[derive(Default)]
pub(crate) struct WrittenMeshes {
    /// Primitives without materials. A key consists of the mesh and a flag: true for a deformed mesh.
    pub(crate) primitives: HashMap<(*const Mesh, bool), Vec<(usize, Value)>>,
    /// Index of each mesh in the document, by the mesh's JSON.
    pub(crate) meshes: HashMap<String, usize>,
}

/// Images, textures and samplers that have been written.
#[derive(Default)]
pub(crate) struct WrittenTextures {
    /// A key consists of the image and a flag: true for colours.
    pub(crate) images: HashMap<(*const Image, bool), usize>,
    pub(crate) textures: HashMap<(usize, TextureSampler), usize>,
    pub(crate) samplers: HashMap<TextureSampler, usize>,
    /// Images that were composed here; they are kept so that no other image reuses their address.
    pub(crate) generated: Vec<Arc<Image>>,
}

impl Writer<'_> {
    /// Adds an item to one of the document's lists and returns its index.
    pub(crate) fn push(&mut self, list: &'static str, item: impl Into<Value>) -> usize {
        let items = self.lists.entry(list).or_default();
        items.push(item.into());
        items.len() - 1
    }

    /// Adds a notice, unless the same notice already exists.
    pub(crate) fn note(&mut self, code: NoticeCode, message: impl Into<String>) {
        let notice = Notice::new(code, message);
        if !self.notices.contains(&notice) {
            self.notices.push(notice);
        }
    }

    /// Adds the object of an extension, and declares the extension.
    pub(crate) fn extend(&mut self, item: &mut Map<String, Value>, name: &'static str, extension: Value) {
        self.extensions.insert(name);
        let all = item.entry("extensions").or_insert_with(|| json!({}));
        if let Some(all) = all.as_object_mut() {
            all.insert(name.into(), extension);
        }
    }
}
