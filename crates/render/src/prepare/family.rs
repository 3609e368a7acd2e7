//! Parts of prepared worlds that a world and all that comes of it share: each is built once while its input lives.
//!
//! A part is kept as long as anyone else has what it was built of: a world at a time, a copy or a changed world finds what
//! the others have built, also when the one that built it is gone.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use raycam_scene::{Mesh, Texture};

use crate::prepare::mesh::PreparedMesh;
use crate::prepare::texture::PreparedTexture;

/// Prepared meshes and textures, by the address of what they were prepared of.
#[derive(Debug, Default)]
pub(crate) struct SharedParts {
    /// Locked for look-ups alone: nothing is built or freed meanwhile, and a fork finds it free.
    parts: Mutex<Parts>,
}

#[derive(Debug, Default)]
struct Parts {
    meshes: HashMap<usize, Arc<PreparedMesh>>,
    textures: HashMap<usize, Arc<PreparedTexture>>,
}

impl SharedParts {
    fn lock(&self) -> MutexGuard<'_, Parts> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The prepared mesh of a mesh, if anyone has built it.
    pub fn mesh(&self, mesh: &Arc<Mesh>) -> Option<Arc<PreparedMesh>> {
        self.lock().meshes.get(&address(mesh)).cloned()
    }

    /// A prepared mesh of as many vertices and triangles: perhaps the same mesh in another form.
    pub fn mesh_of_size(&self, mesh: &Mesh) -> Option<Arc<PreparedMesh>> {
        let size = |mesh: &Mesh| (mesh.vertices.len(), mesh.triangles.len());
        self.lock().meshes.values().find(|known| size(&known.mesh) == size(mesh)).cloned()
    }

    /// The prepared texture of a texture, if there is one.
    pub fn texture(&self, texture: &Arc<Texture>) -> Option<Arc<PreparedTexture>> {
        self.lock().textures.get(&address(texture)).cloned()
    }

    /// Keeps the parts of a world, and frees those whose inputs nobody has any more.
    pub fn keep<'a>(&self, meshes: impl Iterator<Item = &'a Arc<PreparedMesh>>, textures: &[Arc<PreparedTexture>]) {
        let mut parts = self.lock();
        parts.meshes.extend(meshes.map(|mesh| (address(&mesh.mesh), mesh.clone())));
        parts.textures.extend(textures.iter().map(|texture| (address(texture.source()), texture.clone())));
        let unused = |count: usize, inputs: usize| count == 1 && inputs == 1;
        let no_mesh =
            |_: &usize, known: &mut Arc<PreparedMesh>| unused(Arc::strong_count(known), Arc::strong_count(&known.mesh));
        let no_texture = |_: &usize, known: &mut Arc<PreparedTexture>| {
            unused(Arc::strong_count(known), Arc::strong_count(known.source()))
        };
        let freed: (Vec<_>, Vec<_>) =
            (parts.meshes.extract_if(no_mesh).collect(), parts.textures.extract_if(no_texture).collect());
        drop(parts);
        drop(freed);
    }
}

fn address<T>(part: &Arc<T>) -> usize {
    Arc::as_ptr(part).addr()
}
