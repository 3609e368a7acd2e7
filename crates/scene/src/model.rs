//! Contents of a mesh file, and the loader of a description's files.

use std::sync::Arc;

use crate::error::{Result, SceneError};
use crate::light::{IesProfile, Light};
use crate::material::Material;
use crate::mesh::Mesh;
use crate::notice::Notice;
use crate::texture::{ColorUse, Image, Texture, Wrap};
use crate::up::Up;

/// Named part of a mesh file (an OBJ `o`), in the file's coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshPart {
    /// Name; empty if absent.
    pub name: String,
    /// Triangles.
    pub mesh: Mesh,
    /// Indices into [`MeshFile::materials`], one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
}

/// Contents of a mesh file. In an object of a world file, its parts become one object; loaded as a separate world, each
/// part becomes an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshFile {
    /// Parts in file order.
    pub parts: Vec<MeshPart>,
    /// Materials; `texture` is an index into [`MeshFile::textures`].
    pub materials: Vec<Material>,
    /// Images that the materials use.
    pub textures: Vec<Texture>,
    /// Notices of the reader.
    pub notices: Vec<Notice>,
    /// The up axis, if the format specifies it.
    pub up: Option<Up>,
}

/// The contents of a mesh file as one mesh, with coordinates in the world's axes.
#[derive(Clone, Debug)]
pub struct SingleMesh {
    /// All parts, joined into one mesh.
    pub mesh: Arc<Mesh>,
    /// The materials of the mesh's slots; `texture` is an index into [`SingleMesh::textures`].
    pub materials: Vec<Material>,
    /// The images that the materials use.
    pub textures: Vec<Texture>,
    /// Notices of the reader.
    pub notices: Vec<Notice>,
    /// The up axis of the file, if the format specifies it.
    pub up: Option<Up>,
}

/// Loader of the files that a description names; it reads only files inside one folder.
pub trait AssetLoader {
    /// Error type of the loader.
    type Error: From<SceneError>;

    /// Reads the mesh file with this name.
    ///
    /// # Errors
    /// A file that is missing, unreadable, too large or malformed.
    fn mesh(&mut self, file: &str) -> Result<MeshFile, Self::Error>;

    /// Returns the contents of the mesh file with this name, if the loader shares files between worlds and another
    /// world has read it with the same `up` axis (`None`: the file's own axis).
    fn shared_mesh(&mut self, _file: &str, _up: Option<Up>) -> Option<SingleMesh> {
        None
    }

    /// Receives a mesh file that was just read by [`AssetLoader::mesh`], for [`AssetLoader::shared_mesh`].
    fn share_mesh(&mut self, _file: &str, _up: Option<Up>, _mesh: &SingleMesh) {}

    /// Reads the image file with this name. Integers in colour images are in sRGB; all other values are linear.
    ///
    /// # Errors
    /// A file that is missing, unreadable, too large or malformed.
    fn texture(&mut self, file: &str, wrap: [Wrap; 2], color_use: ColorUse) -> Result<Texture, Self::Error>;

    /// Reads the image file with this name as an environment: it repeats around the horizon and ends at the poles.
    ///
    /// # Errors
    /// A file that is missing, unreadable, too large or malformed.
    fn environment(&mut self, file: &str) -> Result<Arc<Image>, Self::Error> {
        Ok(self.texture(file, [Wrap::Repeat, Wrap::Clamp], ColorUse::Color)?.image)
    }

    /// Reads the IES file with this name.
    ///
    /// # Errors
    /// A file that is missing, unreadable, too large or malformed.
    fn profile(&mut self, file: &str) -> Result<IesProfile, Self::Error>;

    /// Returns an image of a material in the form in which the world stores it; the world may limit the memory of its
    /// images.
    ///
    /// # Errors
    /// An image that does not fit into memory and cannot be stored elsewhere.
    fn store_texture(&mut self, image: Arc<Image>) -> Result<Arc<Image>, Self::Error> {
        Ok(image)
    }

    /// Returns the full path of the background image with this name; the caller reads the image.
    ///
    /// # Errors
    /// A file that is missing or unreadable.
    fn picture(&mut self, file: &str) -> Result<String, Self::Error> {
        Ok(file.into())
    }

    /// Returns the contents of the file with this name.
    ///
    /// # Errors
    /// A file that is missing, unreadable or too large.
    fn bytes(&mut self, file: &str) -> Result<Vec<u8>, Self::Error> {
        Err(SceneError::world(format!(
            "file {file:?}: cannot be loaded, because this asset loader does not read files"
        ))
        .into())
    }

    /// Returns the error with the key that refers to the file, such as `object[2].mesh`, added at the beginning.
    fn in_context(error: Self::Error, key: &str) -> Self::Error;
}

/// Loader for descriptions that must not name files.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAssets;

impl AssetLoader for NoAssets {
    type Error = SceneError;

    fn mesh(&mut self, file: &str) -> Result<MeshFile> {
        Err(SceneError::world(format!("mesh {file:?}: files are not supported in this world description")))
    }

    fn texture(&mut self, file: &str, _wrap: [Wrap; 2], _color_use: ColorUse) -> Result<Texture> {
        Err(SceneError::world(format!("texture {file:?}: files are not supported in this world description")))
    }

    fn profile(&mut self, file: &str) -> Result<IesProfile> {
        Err(SceneError::world(format!("profile {file:?}: files are not supported in this world description")))
    }

    fn in_context(error: SceneError, key: &str) -> SceneError {
        error.in_context(key)
    }
}

impl MeshFile {
    /// Contents of a file with one mesh and no materials.
    pub fn from_mesh(mesh: Mesh, notices: Vec<Notice>) -> Self {
        Self {
            materials: vec![Material::for_mesh(&mesh)],
            parts: vec![MeshPart { name: String::new(), mesh, materials: vec![0] }],
            textures: Vec::new(),
            notices,
            up: None,
        }
    }

    /// Joins all parts into one mesh, with the materials of its slots as indices into [`MeshFile::materials`].
    ///
    /// A part that lacks an array which another part has gets neutral values: white colours, texture coordinates (0,
    /// 0), and no normals.
    ///
    /// # Errors
    /// [`SceneError::World`] if no part has triangles, if a part is invalid or lacks a material, or if there are too
    /// many vertices or materials.
    pub fn as_single_mesh(&self) -> Result<(Mesh, Vec<usize>)> {
        let parts = || self.parts.iter().filter(|part| !part.mesh.triangles.is_empty());
        let vertices: usize = parts().map(|part| part.mesh.vertices.len()).sum();
        let slots: usize = parts().map(|part| part.materials.len()).sum();
        if vertices > u32::MAX as usize || slots > usize::from(u16::MAX) {
            return Err(SceneError::world(format!(
                "too many vertices or materials for one mesh: {vertices} vertices (limit {}), {slots} materials (limit {})",
                u32::MAX,
                u16::MAX
            )));
        }
        for MeshPart { name, mesh, materials } in parts() {
            mesh.validate()?;
            let lacking = materials.iter().any(|&material| material >= self.materials.len());
            if lacking || materials.len() < mesh.slot_count() {
                return Err(SceneError::world(format!("part {name:?} uses a material that is missing")));
            }
        }
        let mut merged = Mesh::default();
        let mut materials: Vec<usize> = Vec::new();
        for part in parts() {
            let mesh = &part.mesh;
            let slot_of: Vec<u16> = part
                .materials
                .iter()
                .map(|material| {
                    let slot = materials.iter().position(|m| m == material).unwrap_or_else(|| {
                        materials.push(*material);
                        materials.len() - 1
                    });
                    slot as u16
                })
                .collect();
            let slots = match &mesh.material_slots {
                Some(slots) => slots.iter().map(|&slot| slot_of[usize::from(slot)]).collect(),
                None => vec![slot_of[0]; mesh.triangles.len()],
            };
            merged.append(mesh, slots);
        }
        merged.material_slots = merged.material_slots.filter(|_| materials.len() > 1);
        merged.validate()?;
        Ok((merged, materials))
    }
}

impl Light {
    /// Reads the file to which the light refers, unless it has already been read.
    ///
    /// # Errors
    /// Errors of `files`.
    pub fn read<F: AssetLoader>(&mut self, files: &mut F) -> Result<(), F::Error> {
        match self {
            Light::Environment { image, .. } => image.load(|file| files.environment(file)),
            Light::Projector { image, .. } => {
                let read = |file: &str| Ok(files.texture(file, [Wrap::Clamp; 2], ColorUse::Color)?.image);
                image.load(read)
            }
            Light::Ies { profile, .. } => profile.load(|file| Ok(Arc::new(files.profile(file)?))),
            _ => Ok(()),
        }
    }
}
