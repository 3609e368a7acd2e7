//! Topology of a mesh as a surface: whether it is closed and oriented, its boundary, and the triangles around each
//! point.

use crate::mesh::Mesh;
use crate::mesh::topology::{has_three_corners, weld_vertices};

/// Mesh as a surface. Vertices at the same position are one point; triangles with two corners at one point are omitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceTopology {
    /// True if every edge belongs to an even number of triangles.
    pub is_closed: bool,
    /// True if every edge is used equally often in both directions.
    pub is_oriented: bool,
    /// Edges with an odd number of triangles, as vertices of the mesh (the first vertex at each point).
    pub boundary_edges: Vec<[u32; 2]>,
    /// Edges that are used more often from their first vertex to their second than in reverse, with the difference.
    pub residual_edges: Vec<([u32; 2], u32)>,
    /// Signed volume, computed relative to the first vertex; positive if triangles are counter-clockwise as seen from
    /// outside.
    pub volume: f64,
    /// Number of connected components: sets of triangles that are connected by shared edges.
    pub components: usize,
}

/// Side of a triangle: its two points (the smaller index first), the direction in which the triangle traverses it, and
/// the triangle.
struct Side {
    ends: [u32; 2],
    direction: i32,
    triangle: u32,
}

impl SurfaceTopology {
    /// Computes the topology of a mesh by sorting its edges.
    pub fn new(mesh: &Mesh) -> Self {
        let (points, point_of) = weld_vertices(&mesh.vertices);
        let mut vertex_of = vec![u32::MAX; points.len()];
        for (vertex, &point) in point_of.iter().enumerate() {
            let first = &mut vertex_of[point as usize];
            *first = (*first).min(vertex as u32);
        }
        let triangles = mesh.triangles.iter().map(|corners| corners.map(|i| point_of[i as usize]));
        let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
        let mut volume = 0.0;
        let mut count = 0;
        for (triangle, corners) in triangles.enumerate().filter(|(_, corners)| has_three_corners(corners)) {
            let [a, b, c] = corners;
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let direction = if from < to { 1 } else { -1 };
                sides.push(Side { ends: [from.min(to), from.max(to)], direction, triangle: triangle as u32 });
            }
            let [a, b, c] = corners.map(|point| points[point as usize] - points[0]);
            volume += a.dot(b.cross(c)) / 6.0;
            count += 1;
        }
        sides.sort_unstable_by_key(|side| side.ends);
        let mut surface = Self { is_closed: true, is_oriented: true, volume, components: count, ..Self::default() };
        let mut parts = Parts((0..mesh.triangles.len() as u32).collect());
        for edge in sides.chunk_by(|a, b| a.ends == b.ends) {
            let sum: i32 = edge.iter().map(|side| side.direction).sum();
            let [from, to] = edge[0].ends.map(|point| vertex_of[point as usize]);
            if edge.len() % 2 == 1 {
                surface.boundary_edges.push([from, to]);
            }
            if sum != 0 {
                let ends = if sum > 0 { [from, to] } else { [to, from] };
                surface.residual_edges.push((ends, sum.unsigned_abs()));
            }
            for side in &edge[1..] {
                surface.components -= usize::from(parts.join(edge[0].triangle, side.triangle));
            }
        }
        surface.is_closed = surface.boundary_edges.is_empty();
        surface.is_oriented = surface.residual_edges.is_empty();
        surface
    }
}

/// Disjoint sets of triangles: each triangle has a parent, and roots are their own parents.
struct Parts(Vec<u32>);

impl Parts {
    fn root(&mut self, mut triangle: u32) -> u32 {
        while self.0[triangle as usize] != triangle {
            let grandparent = self.0[self.0[triangle as usize] as usize];
            self.0[triangle as usize] = grandparent;
            triangle = grandparent;
        }
        triangle
    }

    /// Joins the sets of two triangles; returns false if both triangles already belong to one set.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
        a != b
    }
}

/// Triangles around each point of a mesh.
#[derive(Clone, Debug, Default)]
pub struct PointTriangles {
    /// Index of each vertex's point.
    point_of: Vec<u32>,
    /// For each point, the offset of its first triangle in the list; the last entry is the list's length.
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl PointTriangles {
    /// Triangles around each point; triangles with two corners at one point are omitted.
    pub fn new(mesh: &Mesh) -> Self {
        let (points, point_of) = weld_vertices(&mesh.vertices);
        let corners = |triangle: &[u32; 3]| triangle.map(|i| point_of[i as usize]);
        let welded: Vec<[u32; 3]> = mesh.triangles.iter().map(corners).collect();
        let solid = || welded.iter().enumerate().filter(|(_, corners)| has_three_corners(corners));
        let mut starts = vec![0; points.len() + 1];
        for (_, corners) in solid() {
            corners.iter().for_each(|&point| starts[point as usize + 1] += 1);
        }
        for point in 0..points.len() {
            starts[point + 1] += starts[point];
        }
        let (mut next, mut triangles) = (starts.clone(), vec![0; starts[points.len()] as usize]);
        for (triangle, corners) in solid() {
            for &point in corners {
                triangles[next[point as usize] as usize] = triangle as u32;
                next[point as usize] += 1;
            }
        }
        Self { point_of, starts, triangles }
    }

    /// Triangles around the point of a vertex.
    pub fn around(&self, vertex: u32) -> &[u32] {
        let point = self.point_of[vertex as usize] as usize;
        &self.triangles[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    /// True if two vertices are the same point.
    pub fn is_same_point(&self, a: u32, b: u32) -> bool {
        self.point_of[a as usize] == self.point_of[b as usize]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::primitive;

    #[test]
    fn closed_boxes_have_no_boundary_and_open_boxes_have_one() {
        let mut mesh = primitive::box_([2.0, 3.0, 4.0]).unwrap();
        let surface = SurfaceTopology::new(&mesh);
        assert!(surface.is_closed && surface.is_oriented);
        assert!((surface.volume - 24.0).abs() < 1e-12);
        assert_eq!(surface.components, 1);
        mesh.triangles[0].reverse();
        let turned = SurfaceTopology::new(&mesh);
        assert!(turned.is_closed && !turned.is_oriented);
        assert_eq!(turned.residual_edges.iter().map(|(_, excess)| *excess).collect::<Vec<_>>(), [2, 2, 2]);
        mesh.triangles.remove(0);
        let open = SurfaceTopology::new(&mesh);
        assert!(!open.is_closed && !open.is_oriented);
        assert_eq!((open.boundary_edges.len(), open.residual_edges.len(), open.components), (3, 3, 1));
    }

    #[test]
    fn parts_connected_only_at_a_corner_are_separate_components() {
        let corners: [[f64; 3]; 5] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        let mesh = Mesh {
            vertices: corners.map(DVec3::from).to_vec(),
            triangles: vec![[0, 1, 2], [0, 3, 4], [0, 0, 1]],
            ..Mesh::default()
        };
        assert_eq!(SurfaceTopology::new(&mesh).components, 2);
        let around = PointTriangles::new(&mesh);
        assert_eq!((around.around(0), around.around(1)), (&[0, 1][..], &[0][..]));
    }
}
