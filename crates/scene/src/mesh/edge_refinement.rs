//! Refinement of a mesh at selected edges, without cracks: neighbours split a shared edge at the same point.
//!
//! Vertices with equal coordinates are one point of the surface, and an edge is selected for a pair of points. The new
//! triangles are in the order of the triangles that they replace.

use glam::{DVec3, Vec3};

use crate::mesh::Mesh;
use crate::mesh::topology::{Edges, weld_vertices};

/// Mesh that is being refined.
pub(crate) struct EdgeRefinement {
    pub mesh: Mesh,
    /// Index of each vertex's point.
    pub point_of_vertex: Vec<u32>,
    /// Number of points.
    pub point_count: u32,
}

/// The edges that one step splits.
pub(crate) struct SelectedEdges {
    /// Edges between points.
    edges: Edges,
    /// For each edge, the index of its new point; `None` if the edge is not split.
    new_points: Vec<Option<u32>>,
    point_count: u32,
    /// Number of triangles after the split.
    pub triangle_count: usize,
}

impl SelectedEdges {
    /// True if no edge is split.
    pub fn is_empty(&self) -> bool {
        self.new_points.iter().all(Option::is_none)
    }
}

impl EdgeRefinement {
    /// Starts the refinement of a valid mesh. Tangents are removed, because they would not follow a moved surface.
    pub fn new(mesh: &Mesh) -> Self {
        let (points, point_of_vertex) = weld_vertices(&mesh.vertices);
        let mesh = Mesh { tangents: None, ..mesh.clone() };
        Self { mesh, point_of_vertex, point_count: points.len() as u32 }
    }

    /// Triangles as indices of points instead of vertices.
    pub fn point_triangles(&self) -> Vec<[u32; 3]> {
        self.mesh.triangles.iter().map(|triangle| triangle.map(|v| self.point_of_vertex[v as usize])).collect()
    }

    /// Selects each edge for which `is_long` is true in one of its triangles; the arguments are the triangle and its
    /// side: 0 from corner 0 to 1, 1 from 1 to 2, 2 from 2 to 0.
    pub fn select(&self, is_long: impl Fn(usize, usize) -> bool) -> SelectedEdges {
        let edges = Edges::new(&self.point_triangles());
        let mut selected = vec![false; edges.ends.len()];
        for (triangle, sides) in edges.of_triangle.iter().enumerate() {
            for (side, &edge) in sides.iter().enumerate() {
                let [a, b] = edges.ends[edge as usize];
                selected[edge as usize] |= a != b && is_long(triangle, side);
            }
        }
        let sides = edges.of_triangle.as_flattened().iter();
        let triangle_count = edges.of_triangle.len() + sides.filter(|&&edge| selected[edge as usize]).count();
        let mut point_count = self.point_count;
        let number = |is_selected: bool| {
            is_selected.then(|| {
                point_count += 1;
                point_count - 1
            })
        };
        let new_points = selected.into_iter().map(number).collect();
        SelectedEdges { edges, new_points, point_count, triangle_count }
    }

    /// Splits the selected edges at their midpoints. A triangle with n selected edges is replaced by n + 1 triangles.
    pub fn split(&mut self, selected: &SelectedEdges) {
        let SelectedEdges { edges: shared, new_points, point_count, .. } = selected;
        let own = Edges::new(&self.mesh.triangles);
        // For each edge between vertices, the index of its new vertex; and for each new vertex, the ends of its edge.
        let mut new_vertices: Vec<Option<u32>> = vec![None; own.ends.len()];
        let mut ends = Vec::new();
        let old = self.mesh.vertices.len() as u32;
        for (sides, shared_sides) in own.of_triangle.iter().zip(&shared.of_triangle) {
            for (&edge, &shared_edge) in sides.iter().zip(shared_sides) {
                let (vertex, point) = (&mut new_vertices[edge as usize], new_points[shared_edge as usize]);
                if let (None, Some(point)) = (&vertex, point) {
                    *vertex = Some(old + ends.len() as u32);
                    ends.push(own.ends[edge as usize]);
                    self.point_of_vertex.push(point);
                }
            }
        }
        append_midpoints(&mut self.mesh, &ends);
        self.point_count = *point_count;

        let mesh = &mut self.mesh;
        let (mut triangles, mut parents) = (Vec::with_capacity(selected.triangle_count), Vec::new());
        for (parent, (&corners, sides)) in mesh.triangles.iter().zip(&own.of_triangle).enumerate() {
            let before = triangles.len();
            split_triangle(corners, sides.map(|edge| new_vertices[edge as usize]), &mesh.vertices, &mut triangles);
            parents.resize(parents.len() + triangles.len() - before, parent as u32);
        }
        mesh.triangles = triangles;
        if let Some(colors) = &mut mesh.face_colors {
            *colors = parents.iter().map(|&parent| colors[parent as usize]).collect();
        }
        if let Some(slots) = &mut mesh.material_slots {
            *slots = parents.iter().map(|&parent| slots[parent as usize]).collect();
        }
    }
}

/// Appends the midpoint of each pair of vertices, with interpolated attributes.
pub(crate) fn append_midpoints(mesh: &mut Mesh, ends: &[[u32; 2]]) {
    fn append<T: Copy>(values: &mut Vec<T>, ends: &[[u32; 2]], between: impl Fn(T, T) -> T) {
        let added: Vec<T> = ends.iter().map(|&[a, b]| between(values[a as usize], values[b as usize])).collect();
        values.extend(added);
    }
    fn mean<const N: usize>(a: [f32; N], b: [f32; N]) -> [f32; N] {
        std::array::from_fn(|i| f32::midpoint(a[i], b[i]))
    }
    append(&mut mesh.vertices, ends, DVec3::midpoint);
    mesh.uvs.iter_mut().chain(&mut mesh.more_uvs).for_each(|uvs| append(uvs, ends, mean));
    mesh.vertex_colors.iter_mut().for_each(|colors| append(colors, ends, mean));
    mesh.vertex_opacities.iter_mut().for_each(|opacities| append(opacities, ends, f32::midpoint));
    let unit_mean = |a: [f32; 3], b: [f32; 3]| {
        (Vec3::from_array(a) + Vec3::from_array(b)).normalize_or(Vec3::from_array(a)).to_array()
    };
    mesh.normals.iter_mut().for_each(|normals| append(normals, ends, unit_mean));
}

/// Appends the triangles that replace a triangle whose sides have these new vertices.
fn split_triangle(corners: [u32; 3], sides: [Option<u32>; 3], vertices: &[DVec3], triangles: &mut Vec<[u32; 3]>) {
    let turned = |by: usize| ([0, 1, 2].map(|i| corners[(i + by) % 3]), [0, 1, 2].map(|i| sides[(i + by) % 3]));
    for by in 0..3 {
        match turned(by) {
            ([a, b, c], [Some(ab), None, None]) => return triangles.extend([[a, ab, c], [ab, b, c]]),
            ([a, b, c], [Some(ab), Some(bc), None]) => {
                let length = |from: u32, to: u32| vertices[from as usize].distance_squared(vertices[to as usize]);
                let quad = match length(a, bc) <= length(ab, c) {
                    true => [[a, ab, bc], [a, bc, c]],
                    false => [[a, ab, c], [ab, bc, c]],
                };
                triangles.push([ab, b, bc]);
                return triangles.extend(quad);
            }
            _ => {}
        }
    }
    match (corners, sides) {
        ([a, b, c], [Some(ab), Some(bc), Some(ca)]) => {
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        _ => triangles.push(corners),
    }
}
