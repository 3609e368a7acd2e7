//! Convex shapes with fast support queries, which visit only vertices near the extreme vertex.
//!
//! parry's `ConvexPolyhedron` visits every vertex and every face in each query; without this module, these queries take
//! most of the time for round meshes. It also represents a face of more than four corners, such as a cylinder's base, by
//! four neighbouring corners, so that a cylinder tilts on its base.

use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::details::support_map_aabb;
use rapier3d_f64::parry::bounding_volume::{Aabb, BoundingSphere};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::parry::query::{PointProjection, PointQuery, Ray, RayCast, RayIntersection};
use rapier3d_f64::parry::shape::{
    ConvexPolyhedron, FeatureId, PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, ShapeType, SharedShape,
    SupportMap, TypedShape,
};

/// Number of cells along an edge of the cube of directions; each cell has an entry in `Hull::start_vertices`.
const CELLS: usize = 8;

/// Convex hull of points.
#[derive(Clone)]
pub(crate) struct Hull {
    polyhedron: ConvexPolyhedron,
    /// Index in `neighbors` of each vertex's first neighbour; the last entry is the length of `neighbors`.
    first_neighbors: Vec<u32>,
    /// For each vertex, the vertices that are connected with it by an edge.
    neighbors: Vec<u32>,
    /// For each cell of the cube of directions, the vertex that is extreme in the direction of the cell's centre.
    start_vertices: Vec<u32>,
    /// Corners that represent each face in contacts.
    faces: Vec<FaceCorners>,
}

/// Up to four corners of a face in their order around it, as indices into the polyhedron's list of the face.
#[derive(Clone, Copy)]
struct FaceCorners {
    corners: [u32; 4],
    count: usize,
}

impl Hull {
    /// Returns the convex hull of points as a shape; `None` if the hull is flat.
    pub(crate) fn shape(points: &[Vector]) -> Option<SharedShape> {
        Some(SharedShape::new(Self::new(ConvexPolyhedron::from_convex_hull(points)?)))
    }

    fn new(polyhedron: ConvexPolyhedron) -> Self {
        let mut lists = vec![Vec::new(); polyhedron.points().len()];
        for [a, b] in polyhedron.edges().iter().map(|edge| edge.vertices) {
            lists[a as usize].push(b);
            lists[b as usize].push(a);
        }
        let mut first_neighbors = vec![0];
        for list in &lists {
            first_neighbors.push(first_neighbors[first_neighbors.len() - 1] + list.len() as u32);
        }
        let faces = (0..polyhedron.faces().len()).map(|face| FaceCorners::new(&polyhedron, face)).collect();
        let neighbors = lists.concat();
        let mut hull = Self { polyhedron, first_neighbors, neighbors, start_vertices: Vec::new(), faces };
        let start = hull.polyhedron.edges()[0].vertices[0];
        hull.start_vertices = cell_directions().map(|direction| hull.climb(start, direction)).collect();
        hull
    }

    /// Index of the extreme vertex in a direction.
    fn extreme_vertex(&self, direction: Vector) -> u32 {
        self.climb(self.start_vertices[cell_of(direction)], direction)
    }

    /// Moves from a vertex to neighbours that are farther in a direction, until no neighbour is farther. On a convex
    /// polyhedron, the last vertex is extreme.
    fn climb(&self, start: u32, direction: Vector) -> u32 {
        let height = |vertex: u32| self.polyhedron.points()[vertex as usize].dot(direction);
        let (mut best, mut best_height) = (start, height(start));
        loop {
            let here = best as usize;
            let range = self.first_neighbors[here] as usize..self.first_neighbors[here + 1] as usize;
            for &vertex in &self.neighbors[range] {
                let height = height(vertex);
                if height > best_height {
                    (best, best_height) = (vertex, height);
                }
            }
            if best as usize == here {
                return best;
            }
        }
    }

    /// Index of the face at the extreme vertex that faces a direction most.
    fn extreme_face(&self, direction: Vector) -> Option<usize> {
        let vertex = self.polyhedron.vertices()[self.extreme_vertex(direction) as usize];
        let first = vertex.first_adj_face_or_edge as usize;
        let faces = &self.polyhedron.faces_adj_to_vertex()[first..first + vertex.num_adj_faces_or_edge as usize];
        let slope = |face: usize| self.polyhedron.faces()[face].normal.dot(direction);
        let faces = faces.iter().map(|&face| face as usize);
        faces.reduce(|best, face| if slope(face) > slope(best) { face } else { best })
    }
}

impl FaceCorners {
    /// Selects a corner, the corner farthest from it, and the farthest corners on both sides of the line between them.
    fn new(polyhedron: &ConvexPolyhedron, face: usize) -> Self {
        let face = polyhedron.faces()[face];
        let (first, count) = (face.first_vertex_or_edge, face.num_vertices_or_edges);
        if count <= 4 {
            return Self { corners: [first, first + 1, first + 2, first + 3], count: count as usize };
        }
        let point = |corner: u32| polyhedron.points()[polyhedron.vertices_adj_to_face()[corner as usize] as usize];
        let farthest = |measure: &dyn Fn(Vector) -> f64| {
            let candidates = (first..first + count).map(|corner| (corner, measure(point(corner))));
            candidates.reduce(|best, other| if other.1 > best.1 { other } else { best }).map_or(first, |best| best.0)
        };
        let origin = point(first);
        let opposite = farthest(&|corner| (corner - origin).length_squared());
        let side = face.normal.cross(point(opposite) - origin);
        let left = farthest(&|corner| (corner - origin).dot(side));
        let right = farthest(&|corner| (origin - corner).dot(side));
        let mut selected = vec![first, opposite, left, right];
        selected.sort_unstable();
        selected.dedup();
        let mut corners = [first; 4];
        corners[..selected.len()].copy_from_slice(&selected);
        Self { corners, count: selected.len() }
    }
}

/// Index of the cell of a direction.
fn cell_of(direction: Vector) -> usize {
    let [x, y, z] = direction.to_array();
    let (axis, main, u, v) = if x.abs() >= y.abs() && x.abs() >= z.abs() {
        (0, x, y, z)
    } else if y.abs() >= z.abs() {
        (1, y, z, x)
    } else {
        (2, z, x, y)
    };
    // A direction of zero gives NaN, which is converted to 0.
    let cell = |value: f64| ((0.5 * (value / main.abs() + 1.0) * CELLS as f64) as usize).min(CELLS - 1);
    ((2 * axis + usize::from(main > 0.0)) * CELLS + cell(u)) * CELLS + cell(v)
}

/// The direction of each cell's centre.
fn cell_directions() -> impl Iterator<Item = Vector> {
    let middle = |cell: usize| (2 * cell + 1) as f64 / CELLS as f64 - 1.0;
    (0..6 * CELLS * CELLS).map(move |index| {
        let (face, u, v) = (index / (CELLS * CELLS), middle(index / CELLS % CELLS), middle(index % CELLS));
        let main = if face % 2 == 1 { 1.0 } else { -1.0 };
        match face / 2 {
            0 => Vector::new(main, u, v),
            1 => Vector::new(v, main, u),
            _ => Vector::new(u, v, main),
        }
    })
}

impl SupportMap for Hull {
    fn local_support_point(&self, direction: Vector) -> Vector {
        self.polyhedron.points()[self.extreme_vertex(direction) as usize]
    }
}

impl PolygonalFeatureMap for Hull {
    fn local_support_feature(&self, direction: Vector, feature: &mut PolygonalFeature) {
        let Some(face) = self.extreme_face(direction) else {
            return self.polyhedron.local_support_feature(direction, feature);
        };
        let FaceCorners { corners, count } = self.faces[face];
        for (i, corner) in corners[..count].iter().map(|&corner| corner as usize).enumerate() {
            let vertex = self.polyhedron.vertices_adj_to_face()[corner];
            feature.vertices[i] = self.polyhedron.points()[vertex as usize];
            feature.vids[i] = PackedFeatureId::vertex(vertex);
            feature.eids[i] = PackedFeatureId::edge(self.polyhedron.edges_adj_to_face()[corner]);
        }
        feature.fid = PackedFeatureId::face(face as u32);
        feature.num_vertices = count;
    }

    fn is_convex_polyhedron(&self) -> bool {
        true
    }
}

impl RayCast for Hull {
    fn cast_local_ray_and_get_normal(&self, ray: &Ray, limit: f64, solid: bool) -> Option<RayIntersection> {
        self.polyhedron.cast_local_ray_and_get_normal(ray, limit, solid)
    }
}

impl PointQuery for Hull {
    fn project_local_point(&self, point: Vector, solid: bool) -> PointProjection {
        self.polyhedron.project_local_point(point, solid)
    }

    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.polyhedron.project_local_point_and_get_feature(point)
    }
}

impl Shape for Hull {
    fn compute_local_aabb(&self) -> Aabb {
        self.polyhedron.compute_local_aabb()
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.polyhedron.compute_local_bounding_sphere()
    }

    fn compute_aabb(&self, pose: &Pose) -> Aabb {
        support_map_aabb(pose, self)
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }

    fn scale_dyn(&self, scale: Vector, _: u32) -> Option<Box<dyn Shape>> {
        Some(Box::new(Self::new(self.polyhedron.clone().scaled(scale)?)))
    }

    fn mass_properties(&self, density: f64) -> MassProperties {
        self.polyhedron.mass_properties(density)
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::ConvexPolyhedron
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::ConvexPolyhedron(&self.polyhedron)
    }

    fn ccd_thickness(&self) -> f64 {
        self.polyhedron.ccd_thickness()
    }

    fn ccd_angular_thickness(&self) -> f64 {
        self.polyhedron.ccd_angular_thickness()
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn as_support_map(&self) -> Option<&dyn SupportMap> {
        Some(self)
    }

    fn as_polygonal_feature_map(&self) -> Option<(&dyn PolygonalFeatureMap, f64)> {
        Some((self, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raycam_scene::mesh::primitive;

    fn hull(mesh: &raycam_scene::Mesh) -> Hull {
        let points: Vec<Vector> = mesh.vertices.iter().map(|&v| crate::convert::vector(v)).collect();
        Hull::new(ConvexPolyhedron::from_convex_hull(&points).unwrap())
    }

    fn directions() -> impl Iterator<Item = Vector> {
        // Points of a spiral around the sphere (Fibonacci lattice), and the axes, at which cells meet.
        let spiral = (0..2000).map(|i| {
            let (height, angle) = (1.0 - (f64::from(i) + 0.5) / 1000.0, 2.4 * f64::from(i));
            let radius = (1.0 - height * height).sqrt();
            Vector::new(radius * angle.cos(), radius * angle.sin(), height)
        });
        spiral.chain([Vector::X, -Vector::X, Vector::Y, -Vector::Y, Vector::Z, -Vector::Z, Vector::ONE])
    }

    #[test]
    fn support_points_are_the_farthest_vertices() {
        for mesh in [primitive::sphere(0.02, 4), primitive::cylinder(0.02, 0.07, 32), primitive::box_([1.0, 2.0, 0.01])]
        {
            let hull = hull(&mesh.unwrap());
            for direction in directions() {
                let found = hull.local_support_point(direction).dot(direction);
                let heights = hull.polyhedron.points().iter().map(|point| point.dot(direction));
                assert_eq!(found, heights.fold(f64::MIN, f64::max), "{direction}");
            }
        }
    }

    #[test]
    fn zero_directions_have_a_support_point() {
        let hull = hull(&primitive::sphere(1.0, 2).unwrap());
        assert!(hull.local_support_point(Vector::ZERO).is_finite());
    }

    #[test]
    fn base_of_a_cylinder_is_represented_by_four_corners_a_quarter_turn_apart() {
        let hull = hull(&primitive::cylinder(0.5, 2.0, 32).unwrap());
        let mut feature = PolygonalFeature::default();
        hull.local_support_feature(-Vector::Z, &mut feature);
        assert_eq!(feature.num_vertices, 4);
        for i in 0..4 {
            let (here, next) = (feature.vertices[i], feature.vertices[(i + 1) % 4]);
            assert!((here.z + 1.0).abs() < 1e-12, "{here}");
            assert!(here.truncate().dot(next.truncate()).abs() < 1e-12, "{here} {next}");
        }
    }

    #[test]
    fn bounds_enclose_the_turned_vertices() {
        let hull = hull(&primitive::cylinder(0.02, 0.07, 32).unwrap());
        let turned = rapier3d_f64::math::Rotation::from_xyzw(0.1, 0.5, 0.7, 0.5).normalize();
        let pose = Pose::from_parts(Vector::new(1.0, 2.0, 3.0), turned);
        let (bounds, expected) = (hull.compute_aabb(&pose), hull.polyhedron.compute_aabb(&pose));
        assert!((bounds.mins - expected.mins).length() < 1e-15 && (bounds.maxs - expected.maxs).length() < 1e-15);
    }
}
