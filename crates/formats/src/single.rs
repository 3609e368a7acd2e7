//! Mesh files that hold one mesh without materials.

use raycam_scene::{Material, Mesh, Model, Part};

/// A model of this mesh alone.
pub(crate) fn model(mesh: Mesh, notices: Vec<String>) -> Model {
    Model {
        materials: vec![Material::plain(&mesh)],
        parts: vec![Part {
            name: String::new(),
            mesh,
            materials: vec![0],
        }],
        textures: Vec::new(),
        notices,
    }
}
