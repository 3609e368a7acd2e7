//! Vertex colours of an OBJ file in addition to the colours of its materials. The format does not define a product of
//! several colours, so only one source is used: an image has priority over vertex colours, and vertex colours have
//! priority over `Kd` and `Ks`.

use std::path::Path;

use raycam_scene::color::Rgb;
use raycam_scene::{Material, MaterialModel, MeshFile, Notice, NoticeCode, counted};

use crate::geometry::colors;

const WHITE: Rgb = [1.0; 3];

/// Chooses the colours for every part of a model; notices report the ignored colours.
pub(crate) fn settle(model: &mut MeshFile, path: &Path) {
    let textured: Vec<bool> = model.materials.iter().map(|material| material.texture.is_some()).collect();
    let mut hidden = 0;
    // For each material: true if a part with colours uses it, and true if a part without colours uses it.
    let mut used = vec![[false; 2]; textured.len()];
    for part in &mut model.parts {
        // Vertices without a colour are white.
        if part.mesh.vertex_colors.as_ref().is_some_and(|colors| colors.iter().all(|color| *color == WHITE)) {
            part.mesh.vertex_colors = None;
        }
        let slots: Vec<bool> = part.materials.iter().map(|&material| textured[material]).collect();
        if part.mesh.vertex_colors.is_some() && slots.contains(&true) {
            hidden += colors::hide_below_images(&mut part.mesh, &slots);
        }
        for &material in &part.materials {
            used[material][usize::from(part.mesh.vertex_colors.is_none())] = true;
        }
    }
    let shown = path.display();
    if hidden > 0 {
        model.notices.push(Notice::new(
            NoticeCode::IgnoredColors,
            format!("{shown}: vertex colours are ignored on faces with an image ({})", counted(hidden, "face")),
        ));
    }
    let mut whitened = 0;
    for (index, [by_colored, by_others]) in used.into_iter().enumerate() {
        let material = &model.materials[index];
        if !by_colored || textured[index] || material.color == WHITE {
            continue;
        }
        whitened += 1;
        let white = in_white(material);
        if !by_others {
            model.materials[index] = white;
            continue;
        }
        let added = model.materials.len();
        model.materials.push(white);
        for part in model.parts.iter_mut().filter(|part| part.mesh.vertex_colors.is_some()) {
            part.materials.iter_mut().filter(|material| **material == index).for_each(|material| *material = added);
        }
    }
    if whitened > 0 {
        model.notices.push(Notice::new(
            NoticeCode::IgnoredColors,
            format!("{shown}: vertex colours replace Kd and Ks of {}", counted(whitened, "material")),
        ));
    }
}

/// Material without highlights whose base colour is the vertices' colour.
fn in_white(material: &Material) -> Material {
    let mut white = material.clone();
    if let MaterialModel::Phong { specular, .. } = &mut white.model {
        // Highlights are removed, so that the material reflects at most as much light as arrives, for any vertex
        // colours.
        *specular = [0.0; 3];
    }
    white.color = WHITE;
    white
}
