//! State of an import: the world under construction, and the meshes and textures of the document that have been read.

use std::collections::HashMap;
use std::sync::Arc;

use raycam_scene::animation::DeformableMesh;
use raycam_scene::{Image, NoticeCode, World};

use crate::error::{FormatError, Result};
use crate::gltf::document::Document;
use crate::io::{AssetRoot, Diagnostics};

/// World under construction.
pub(crate) struct Builder<'a, 'b> {
    pub(crate) document: &'a Document<'a>,
    pub(crate) assets: &'b mut AssetRoot,
    pub(crate) diagnostics: Diagnostics,
    pub(crate) world: World,
    pub(crate) textures: ImportedTextures,
    pub(crate) meshes: ImportedMeshes,
}

impl Builder<'_, '_> {
    /// Converts the result of reading an optional element: an invalid element becomes `None`, with a notice.
    pub(crate) fn or_omitted<T>(&mut self, place: &str, what: &str, result: Result<T>) -> Result<Option<T>> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(FormatError::Syntax { message, .. }) => {
                self.diagnostics.note(NoticeCode::IgnoredElement, place, format!("{what} is omitted: {message}"));
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// Meshes that have been read, by index in the document.
#[derive(Default)]
pub(crate) struct ImportedMeshes {
    pub(crate) known: HashMap<usize, Option<ImportedMesh>>,
}

/// Mesh of the world and the materials of its slots.
#[derive(Clone)]
pub(crate) struct ImportedMesh {
    pub(crate) mesh: usize,
    pub(crate) materials: Vec<usize>,
    /// For each material slot, the index of the primitive that uses the slot first; variants are looked up there.
    pub(crate) primitives: Vec<usize>,
    /// Morph targets and skin, if the mesh has any.
    pub(crate) shape: Option<Arc<DeformableMesh>>,
}

/// Textures and images that have been read. A key consists of the index in the document and a flag: true for colours.
#[derive(Default)]
pub(crate) struct ImportedTextures {
    pub(crate) textures: HashMap<(usize, bool), usize>,
    /// `None` for omitted images.
    pub(crate) images: HashMap<(usize, bool), Option<Arc<Image>>>,
}
