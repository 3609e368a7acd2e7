//! What a mesh file holds, before it is placed in a world.

use crate::error::SceneError;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::texture::{Texture, Wrap};

/// A named piece of a mesh file (an OBJ `o`), in the file's coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Empty when it has none.
    pub name: String,
    /// Its triangles.
    pub mesh: Mesh,
    /// Indices into [`Model::materials`], one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
}

/// The contents of a mesh file. As an object of a world file its parts become one object; loaded as a world of its own,
/// each part becomes an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// In file order.
    pub parts: Vec<Part>,
    /// `texture` is an index into [`Model::textures`].
    pub materials: Vec<Material>,
    /// The images that the materials use.
    pub textures: Vec<Texture>,
    /// What reading it had to say.
    pub notices: Vec<String>,
}

/// Where the files that a description names come from: a folder, and nothing outside it.
pub trait Files {
    /// What can go wrong with a file.
    type Error: From<SceneError>;

    /// The mesh file of this name.
    ///
    /// # Errors
    /// Where it is missing, unreadable, too large or malformed.
    fn mesh(&mut self, file: &str) -> Result<Model, Self::Error>;

    /// The image file of this name.
    ///
    /// # Errors
    /// Where it is missing, unreadable, too large or malformed.
    fn texture(&mut self, file: &str, wrap: [Wrap; 2]) -> Result<Texture, Self::Error>;
}

/// For descriptions that may name no files.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    type Error = SceneError;

    fn mesh(&mut self, file: &str) -> Result<Model, SceneError> {
        Err(SceneError::World(format!(
            "mesh {file:?}: files cannot be read here"
        )))
    }

    fn texture(&mut self, file: &str, _wrap: [Wrap; 2]) -> Result<Texture, SceneError> {
        Err(SceneError::World(format!(
            "texture {file:?}: files cannot be read here"
        )))
    }
}

impl Model {
    /// All parts as one mesh, with the materials of its slots as indices into [`Model::materials`].
    ///
    /// # Errors
    /// [`SceneError::World`] where there is no triangle, or there are more than 2^32 vertices or 2^16 materials.
    pub fn merged(&self) -> Result<(Mesh, Vec<usize>), SceneError> {
        Err(SceneError::World("merging is not built yet".into()))
    }
}
