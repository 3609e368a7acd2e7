//! Media inside meshes that are not closed.

use glam::DVec3;

use crate::counted::counted;
use crate::mesh::Mesh;
use crate::mesh::topology::{Edges, weld_vertices};
use crate::notice::{Notice, NoticeCode};
use crate::world::World;

impl World {
    /// Adds a notice about a medium inside an object whose mesh is not closed.
    pub(crate) fn note_open_medium(&mut self, id: usize) {
        let object = &self.objects[id];
        if object.materials.iter().all(|&material| self.materials[material].medium.is_none()) {
            return;
        }
        if let Some((count, [a, b])) = boundary_edges(&self.meshes[object.mesh]) {
            let [a, b] = [a, b].map(|end| object.world_from_mesh.transform_point3(end).to_array());
            let message = format!(
                "the mesh has {} (the first from {a:?} to {b:?}), so its medium has no defined inside; close the mesh",
                counted(count, "boundary edge")
            );
            self.notices.push(Notice::about(NoticeCode::OpenMedium, format!("object {:?}", object.name), message));
        }
    }
}

/// The number of edges that do not join two triangles, and the ends of the first; `None` for a closed mesh.
fn boundary_edges(mesh: &Mesh) -> Option<(usize, [DVec3; 2])> {
    let (points, point_of) = weld_vertices(&mesh.vertices);
    let welded: Vec<_> = mesh.triangles.iter().map(|corners| corners.map(|corner| point_of[corner as usize])).collect();
    let edges = Edges::new(&welded);
    let is_open = |&&(count, ends): &&(&u32, &[u32; 2])| count % 2 == 1 && ends[0] != ends[1];
    let all: Vec<_> = edges.triangle_count.iter().zip(&edges.ends).collect();
    let open: Vec<_> = all.iter().filter(is_open).collect();
    let (_, ends) = open.first()?;
    Some((open.len(), ends.map(|end| points[end as usize])))
}
