//! State of an import: the world under construction, and the meshes and textures of the document that are read already.

use std::collections::HashMap;
use std::sync::Arc;

use raycam_scene::animation::DeformableMesh;
use raycam_scene::{Image, NoticeCode, World};

use crate::error::{FormatError, Result};
use crate::gltf::document::Document;
use crate::io::{AssetRoot, Diagnostics};

/// A world under construction.
pub(crate) struct Builder<'a, 'b> {
    pub(crate) document: &'a Document<'a>,
    pub(crate) assets: &'b mut AssetRoot,
    pub(crate) diagnostics: Diagnostics,
    pub(crate) world: World,
    pub(crate) textures: ImportedTextures,
    pub(crate) meshes: ImportedMeshes,
}

impl Builder<'_, '_> {
    /// The result for an element that the world can do without: a fault in the file becomes a notice, and the element is
    /// omitted.
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

/// A mesh of the world and the materials of its slots.
#[derive(Clone)]
pub(crate) struct ImportedMesh {
    pub(crate) mesh: usize,
    pub(crate) materials: Vec<usize>,
    /// The primitive of the document of each material slot's first use, for variants.
    pub(crate) primitives: Vec<usize>,
    /// Morph targets and skin, where the mesh has any.
    pub(crate) shape: Option<Arc<DeformableMesh>>,
}

/// Textures and images that have been read, by index in the document and by whether they are colours.
#[derive(Default)]
pub(crate) struct ImportedTextures {
    pub(crate) textures: HashMap<(usize, bool), usize>,
    /// `None` for images that are left out.
    pub(crate) images: HashMap<(usize, bool), Option<Arc<Image>>>,
}
