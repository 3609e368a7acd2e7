//! Surfaces for which a file contains both vertex colours and face colours or an image. Mesh formats do not define how
//! to combine these colours, so only one source is used.

use raycam_scene::color::Rgb;
use raycam_scene::{Mesh, Notice, NoticeCode};

const WHITE: Rgb = [1.0; 3];

/// Keeps either the vertex colours or the face colours of a mesh that has both; returns a notice about the choice.
pub(crate) fn choose(mesh: &mut Mesh) -> Option<Notice> {
    let (vertices, faces) = (mesh.vertex_colors.as_deref()?, mesh.face_colors.as_deref()?);
    // Only the face colours are kept if the vertex colours are all equal and the face colours are not, because equal
    // colours contain less information.
    let one = |colors: &[Rgb]| colors.windows(2).all(|pair| pair[0] == pair[1]);
    if one(vertices) && !one(faces) {
        mesh.vertex_colors = None;
        return Some(Notice::new(
            NoticeCode::IgnoredColors,
            "the mesh has vertex and face colours; only the face colours are used",
        ));
    }
    mesh.face_colors = None;
    Some(Notice::new(
        NoticeCode::IgnoredColors,
        "the mesh has vertex and face colours; only the vertex colours are used",
    ))
}

/// Sets the colours of triangles with an image, and of their vertices, to white; vertices shared with other triangles
/// are duplicated. `textured` is indexed by material slot. Returns the number of triangles that had a colour.
pub(crate) fn hide_below_images(mesh: &mut Mesh, textured: &[bool]) -> usize {
    if mesh.vertex_colors.is_none() && mesh.face_colors.is_none() {
        return 0;
    }
    let slot_of = |triangle: usize| mesh.material_slots.as_ref().map_or(0, |slots| usize::from(slots[triangle]));
    let hidden: Vec<bool> = (0..mesh.triangles.len()).map(|triangle| textured[slot_of(triangle)]).collect();
    let count = hidden.iter().filter(|hidden| **hidden).count();
    if count == hidden.len() {
        (mesh.vertex_colors, mesh.face_colors) = (None, None);
        return count;
    }
    if let Some(colors) = &mut mesh.face_colors {
        colors.iter_mut().zip(&hidden).filter(|(_, hidden)| **hidden).for_each(|(color, _)| *color = WHITE);
    }
    let Some(mut colors) = mesh.vertex_colors.take() else { return count };
    let mut others = vec![false; mesh.vertices.len()];
    for (triangle, _) in mesh.triangles.iter().zip(&hidden).filter(|(_, hidden)| !**hidden) {
        triangle.iter().for_each(|&vertex| others[vertex as usize] = true);
    }
    let mut copies = vec![u32::MAX; mesh.vertices.len()];
    for (triangle, _) in mesh.triangles.iter_mut().zip(&hidden).filter(|(_, hidden)| **hidden) {
        for corner in triangle {
            let vertex = *corner as usize;
            if !others[vertex] {
                colors[vertex] = WHITE;
                continue;
            }
            if copies[vertex] == u32::MAX {
                copies[vertex] = mesh.vertices.len() as u32;
                mesh.vertices.push(mesh.vertices[vertex]);
                colors.push(WHITE);
                if let Some(uvs) = &mut mesh.uvs {
                    uvs.push(uvs[vertex]);
                }
                if let Some(normals) = &mut mesh.normals {
                    normals.push(normals[vertex]);
                }
            }
            *corner = copies[vertex];
        }
    }
    mesh.vertex_colors = Some(colors);
    count
}
