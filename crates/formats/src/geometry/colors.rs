//! Two sources of colour for one surface. Mesh formats define no product of them, so one is used.

use raycam_scene::color::Rgb;
use raycam_scene::{Mesh, Notice, NoticeCode};

const WHITE: Rgb = [1.0; 3];

/// Keeps the colours of the vertices or those of the faces, where a mesh has both; returns what is used.
pub(crate) fn choose(mesh: &mut Mesh) -> Option<Notice> {
    let (vertices, faces) = (mesh.vertex_colors.as_deref()?, mesh.face_colors.as_deref()?);
    // Colours that are all the same say less.
    let one = |colors: &[Rgb]| colors.windows(2).all(|pair| pair[0] == pair[1]);
    if one(vertices) && !one(faces) {
        mesh.vertex_colors = None;
        return Some(Notice::new(NoticeCode::IgnoredColors, "vertex and face colours: those of the faces are used"));
    }
    mesh.face_colors = None;
    Some(Notice::new(NoticeCode::IgnoredColors, "vertex and face colours: those of the vertices are used"))
}

/// Makes triangles with an image white, and their vertices, each its own where others use it too. `textured` is by material
/// slot. Returns how many triangles had a colour.
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
