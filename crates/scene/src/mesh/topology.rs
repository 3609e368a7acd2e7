//! Vertices that share a point, and the edges between points.

use glam::DVec3;

/// Edges of triangles.
pub struct Edges {
    /// The two ends of each edge, the smaller index first.
    pub ends: Vec<[u32; 2]>,
    /// For each triangle, its edges from corner 0 to 1, 1 to 2 and 2 to 0.
    pub of_triangle: Vec<[u32; 3]>,
    /// For each edge, the number of its triangles; triangles with a repeated corner are not counted.
    pub triangle_count: Vec<u32>,
}

impl Edges {
    /// Finds the edges of these triangles, sorted by their ends.
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * triangles.len());
        for (i, &[a, b, c]) in triangles.iter().enumerate() {
            for (side, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
                sides.push(([from.min(to), from.max(to)], i as u32, side as u8));
            }
        }
        sides.sort_unstable();
        let mut edges = Self {
            ends: Vec::with_capacity(sides.len() / 2),
            of_triangle: vec![[0; 3]; triangles.len()],
            triangle_count: Vec::with_capacity(sides.len() / 2),
        };
        for (ends, triangle, side) in sides {
            if edges.ends.last() != Some(&ends) {
                edges.ends.push(ends);
                edges.triangle_count.push(0);
            }
            let edge = edges.ends.len() - 1;
            edges.of_triangle[triangle as usize][usize::from(side)] = edge as u32;
            edges.triangle_count[edge] += u32::from(has_three_corners(&triangles[triangle as usize]));
        }
        edges
    }
}

/// True if a triangle's corners are three different points. Other triangles have no neighbours.
pub fn has_three_corners(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Returns the distinct positions of vertices, and for each vertex the index of its position.
pub fn weld_vertices(vertices: &[DVec3]) -> (Vec<DVec3>, Vec<u32>) {
    // Adding 0 converts -0 to +0, which is the same position.
    let bits = |vertex: DVec3| (vertex + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (bits(vertices[i as usize]), i));
    let mut points = Vec::new();
    let mut point_of = vec![0; vertices.len()];
    let mut last = None;
    for i in order {
        let vertex = vertices[i as usize];
        if last != Some(bits(vertex)) {
            last = Some(bits(vertex));
            points.push(vertex + 0.0);
        }
        point_of[i as usize] = points.len() as u32 - 1;
    }
    (points, point_of)
}
