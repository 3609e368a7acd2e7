//! Mesh files that hold one mesh without materials.

use raycam_scene::{Material, Mesh, Model, Part, Reflectance};

/// The material of a mesh without one: white where the mesh has colours of its own, else light grey.
pub(crate) fn plain_material(colored: bool) -> Material {
    Material {
        name: String::new(),
        color: [if colored { 1.0 } else { 0.8 }; 3],
        texture: None,
        reflectance: Reflectance::Lecture { diffuse: 1.0, specular: [0.0; 3], shininess: 32.0 },
    }
}

/// A model of this mesh alone.
pub(crate) fn model(mesh: Mesh, notices: Vec<String>) -> Model {
    let colored = mesh.vertex_colors.is_some() || mesh.face_colors.is_some();
    Model {
        parts: vec![Part { name: String::new(), mesh, materials: vec![0] }],
        materials: vec![plain_material(colored)],
        textures: Vec::new(),
        notices,
    }
}
