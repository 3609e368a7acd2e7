//! Subdivision of coarse meshes: Loop's scheme with sharp boundaries, and midpoint.
//!
//! Each level replaces each triangle by four: triangle `i` becomes `4 i` to `4 i + 3`, first its three corners in order
//! and then its middle. They inherit its colour and material slot. Vertices with equal coordinates are one point of the
//! surface and move together, so that texture seams and hard corners do not tear. Texture coordinates, vertex colours
//! and opacities are interpolated linearly along the edges.

use glam::DVec3;

use crate::error::{Result, SceneError};
use crate::mesh::Mesh;
use crate::mesh::edge_refinement::append_midpoints;
use crate::mesh::topology::{Edges, has_three_corners, weld_vertices};

/// Maximum number of triangles after subdivision.
pub const MAX_SUBDIVIDED_TRIANGLES: usize = 1 << 25;

/// Applies `levels` steps of Loop's scheme (C. Loop, Smooth Subdivision Surfaces Based on Triangles, 1987). Edges that
/// belong to one triangle, or to more than two, are sharp: points on them follow a spline curve along the edge (Hoppe
/// et al. 1994), and do not move if more than two such edges meet. The result has shading normals.
///
/// # Errors
/// [`SceneError::World`] if the mesh is invalid or would have more than [`MAX_SUBDIVIDED_TRIANGLES`] triangles.
pub fn loop_subdivide(mesh: &Mesh, levels: u32) -> Result<Mesh> {
    let mut refined = SubdividedMesh::new(mesh, levels)?;
    for _ in 0..levels {
        refined.split(loop_points);
    }
    if levels > 0 {
        refined.mesh.normals = Some(refined.smooth_normals());
    }
    Ok(refined.mesh)
}

/// Splits each triangle into four at its edges' midpoints, `levels` times; the surface is unchanged.
///
/// # Errors
/// [`SceneError::World`] if the mesh is invalid or would have more than [`MAX_SUBDIVIDED_TRIANGLES`] triangles.
pub fn midpoint(mesh: &Mesh, levels: u32) -> Result<Mesh> {
    let mut refined = SubdividedMesh::new(mesh, levels)?;
    for _ in 0..levels {
        refined.split(|points, _, edges| {
            let middle = |&[a, b]: &[u32; 2]| points[a as usize].midpoint(points[b as usize]);
            points.iter().copied().chain(edges.ends.iter().map(middle)).collect()
        });
    }
    Ok(refined.mesh)
}

/// A mesh, and the distinct points of its surface.
struct SubdividedMesh {
    mesh: Mesh,
    points: Vec<DVec3>,
    /// Index of each vertex's point.
    point_of_vertex: Vec<u32>,
}

/// Function that receives points, and the triangles and edges between them. It returns the moved points, followed by
/// one new point per edge.
type SubdivisionRule = fn(&[DVec3], &[[u32; 3]], &Edges) -> Vec<DVec3>;

impl SubdividedMesh {
    fn new(mesh: &Mesh, levels: u32) -> Result<Self> {
        mesh.validate()?;
        let count = mesh.triangles.len();
        let refined = 4_usize.checked_pow(levels).and_then(|factor| factor.checked_mul(count));
        if refined.is_none_or(|refined| refined > MAX_SUBDIVIDED_TRIANGLES && levels > 0) {
            return Err(SceneError::mesh(format!(
                "{levels} subdivision levels turn {count} triangles into more than {MAX_SUBDIVIDED_TRIANGLES}; each \
                 level multiplies the number of triangles by four, so use fewer levels"
            )));
        }
        let (points, point_of) = weld_vertices(&mesh.vertices);
        Ok(Self { mesh: mesh.clone(), points, point_of_vertex: point_of })
    }

    /// One level of subdivision.
    fn split(&mut self, rule: SubdivisionRule) {
        let surface = self.point_triangles();
        let point_edges = Edges::new(&surface);
        let points = rule(&self.points, &surface, &point_edges);

        let mesh = &mut self.mesh;
        let edges = Edges::new(&mesh.triangles);
        let old = mesh.vertices.len() as u32;
        let mut edge_points = vec![0; edges.ends.len()];
        for (own, shared) in edges.of_triangle.iter().zip(&point_edges.of_triangle) {
            for side in 0..3 {
                // The middle of an edge from a point to itself is that point.
                let [a, b] = point_edges.ends[shared[side] as usize];
                let middle = if a == b { a } else { self.points.len() as u32 + shared[side] };
                edge_points[own[side] as usize] = middle;
            }
        }
        self.point_of_vertex.extend(edge_points);
        self.points = points;
        append_midpoints(mesh, &edges.ends);
        // Tangents are dropped; they are later derived from the texture coordinates again.
        mesh.tangents = None;
        mesh.vertices = self.point_of_vertex.iter().map(|&point| self.points[point as usize]).collect();
        let four = |[a, b, c]: [u32; 3], sides: &[u32; 3]| {
            let [ab, bc, ca] = sides.map(|edge| old + edge);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        mesh.triangles =
            mesh.triangles.iter().zip(&edges.of_triangle).flat_map(|(&corners, sides)| four(corners, sides)).collect();
        repeat_per_triangle(&mut mesh.face_colors);
        repeat_per_triangle(&mut mesh.material_slots);
    }

    /// Triangles as indices of points instead of vertices.
    fn point_triangles(&self) -> Vec<[u32; 3]> {
        self.mesh.triangles.iter().map(|triangle| triangle.map(|v| self.point_of_vertex[v as usize])).collect()
    }

    /// For each vertex, the area-weighted mean normal of the triangles around its point.
    fn smooth_normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![DVec3::ZERO; self.points.len()];
        for triangle in self.point_triangles() {
            let [a, b, c] = triangle.map(|point| self.points[point as usize]);
            for point in triangle {
                sums[point as usize] += (b - a).cross(c - a);
            }
        }
        let unit = |&point: &u32| sums[point as usize].normalize_or_zero().as_vec3().to_array();
        self.point_of_vertex.iter().map(unit).collect()
    }
}

/// Applies Loop's rule.
fn loop_points(points: &[DVec3], surface: &[[u32; 3]], edges: &Edges) -> Vec<DVec3> {
    let at = |point: u32| points[point as usize];
    // Sums of neighbours: for each point over all neighbours and over the neighbours along sharp edges, and for each
    // edge over the two opposite corners.
    let mut around = vec![(0_u32, DVec3::ZERO); points.len()];
    let mut along = around.clone();
    for (&[a, b], &count) in edges.ends.iter().zip(&edges.triangle_count).filter(|(_, count)| **count > 0) {
        for (here, there) in [(a, b), (b, a)] {
            let add = |sums: &mut [(u32, DVec3)]| {
                sums[here as usize].0 += 1;
                sums[here as usize].1 += at(there);
            };
            add(&mut around);
            if count != 2 {
                add(&mut along);
            }
        }
    }
    let mut opposite = vec![DVec3::ZERO; edges.ends.len()];
    for (triangle, sides) in surface.iter().zip(&edges.of_triangle).filter(|(triangle, _)| has_three_corners(triangle))
    {
        for side in 0..3 {
            opposite[sides[side] as usize] += at(triangle[(side + 2) % 3]);
        }
    }
    let rings = around.iter().zip(&along);
    let mut moved: Vec<DVec3> = points
        .iter()
        .zip(rings)
        .map(|(&point, (&(n, ring), &(sharp, ends)))| match sharp {
            0 | 1 if n > 0 => {
                let beta = loop_weight(n);
                point * (1.0 - f64::from(n) * beta) + ring * beta
            }
            2 => point * 0.75 + ends * 0.125,
            _ => point,
        })
        .collect();
    for (&[a, b], (&count, &corners)) in edges.ends.iter().zip(edges.triangle_count.iter().zip(&opposite)) {
        moved.push(match count {
            2 => (at(a) + at(b)) * 0.375 + corners * 0.125,
            _ => at(a).midpoint(at(b)),
        });
    }
    moved
}

/// Weight of each of n neighbours of an interior point (Loop 1987).
fn loop_weight(n: u32) -> f64 {
    let n = f64::from(n);
    let c = 0.375 + 0.25 * (std::f64::consts::TAU / n).cos();
    (0.625 - c * c) / n
}

/// Repeats the value of each triangle for the four triangles that replace it.
fn repeat_per_triangle<T: Copy>(values: &mut Option<Vec<T>>) {
    if let Some(values) = values {
        *values = values.iter().flat_map(|&value| [value; 4]).collect();
    }
}
