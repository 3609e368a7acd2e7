//! Objects of a world in the form that the simulation and the checks require.

use glam::DAffine3;
use rapier3d_f64::math::{Pose, Vector};
use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::prelude::SharedShape;
use raycam_scene::World;

use crate::convert::vector;
use crate::error::{Result, SettleError};
use crate::hull::Hull;
use crate::parts::{convex_parts, hull, solidity};
use crate::request::Physics;
use crate::surface::{Placed, Surface};

/// Size in metres above which tolerances are constant.
const FULL_TOLERANCE_SIZE: f64 = 0.1;
/// Fraction of its convex hull that a static object must fill to be represented by the hull.
const EXACTLY_CONVEX: f64 = 1.0 - 1e-9;

/// Object that falls. Initially, the axes of its body are the world's axes, and its origin is at the centre of the
/// mesh's bounds.
pub(crate) struct Body {
    pub(crate) object: usize,
    pub(crate) name: String,
    pub(crate) physics: Physics,
    /// The convex parts in the body's coordinates.
    pub(crate) parts: Vec<SharedShape>,
    /// The real mesh in the body's coordinates.
    pub(crate) surface: Surface,
    /// Position of the body in the world.
    pub(crate) origin: Pose,
    /// Maximum distance of a vertex from the origin.
    pub(crate) radius: f64,
    /// Longest side of the mesh's bounds.
    pub(crate) size: f64,
}

/// Object that does not move, in world coordinates.
pub(crate) struct Obstacle {
    pub(crate) object: usize,
    pub(crate) name: String,
    pub(crate) physics: Physics,
    pub(crate) surface: Surface,
    pub(crate) bounds: Aabb,
}

impl Body {
    /// Creates the body of an object.
    ///
    /// # Errors
    /// [`SettleError::NoVolume`] for a flat mesh.
    pub(crate) fn new(world: &World, object: usize, physics: Physics) -> Result<Self> {
        let name = world.objects[object].name.clone();
        let flat = || SettleError::NoVolume { name: name.clone() };
        let mesh = &world.meshes[world.objects[object].mesh];
        let own: Vec<Vector> = mesh.vertices.iter().map(|&vertex| vector(vertex)).collect();
        let own = Surface::new(&own, mesh.triangles.iter().copied()).ok_or_else(flat)?;
        let place = world.objects[object].world_from_mesh;
        let placed = surface_of(world, object, place).ok_or_else(flat)?;
        let center = placed.mesh().local_aabb().center();
        let shifted = |point: Vector| {
            let point = glam::DVec3::from_array(point.to_array());
            vector(place.transform_point3(point)) - center
        };
        let body_from_mesh = DAffine3::from_translation(-glam::DVec3::from_array(center.to_array())) * place;
        let surface = surface_of(world, object, body_from_mesh).ok_or_else(flat)?;
        let shape = |part: &Vec<Vector>| {
            let points: Vec<Vector> = part.iter().map(|&point| shifted(point)).collect();
            hull(&points).and_then(|(corners, _)| Hull::shape(&corners))
        };
        let parts: Vec<SharedShape> = convex_parts(&own, physics.parts).iter().filter_map(shape).collect();
        if parts.is_empty() {
            return Err(flat());
        }
        let radius = surface.mesh().vertices().iter().map(|vertex| vertex.length()).fold(0.0, f64::max);
        let size = surface.mesh().local_aabb().extents().max_element();
        Ok(Self { object, name, physics, parts, surface, origin: Pose::from_translation(center), radius, size })
    }

    /// Factor by which tolerated lengths are multiplied: 1 for objects of 0.1 m and more, and proportionally less for
    /// smaller objects.
    pub(crate) fn tolerance(&self) -> f64 {
        (self.size / FULL_TOLERANCE_SIZE).min(1.0)
    }
}

impl Obstacle {
    /// Creates the obstacle for a visible object; `None` if the object has no triangles with area.
    pub(crate) fn new(world: &World, object: usize, physics: Physics) -> Option<Self> {
        let surface = surface_of(world, object, world.objects[object].world_from_mesh)?;
        let bounds = surface.mesh().local_aabb();
        Some(Self { object, name: world.objects[object].name.clone(), physics, surface, bounds })
    }

    /// The obstacle's surface at its position in the world.
    pub(crate) fn placed(&self) -> Placed<'_> {
        Placed { surface: &self.surface, pose: Pose::identity(), bounds: self.bounds }
    }

    /// Shape for the simulation: the hull of a convex object, otherwise its triangles, solid from both sides.
    pub(crate) fn shape(&self) -> SharedShape {
        use rapier3d_f64::parry::shape::{TriMesh, TriMeshFlags};
        let mesh = self.surface.mesh();
        if solidity(&self.surface) > EXACTLY_CONVEX
            && let Some(shape) = Hull::shape(mesh.vertices())
        {
            return shape;
        }
        let flags = TriMeshFlags::FIX_INTERNAL_EDGES_TWO_SIDED;
        let fixed = TriMesh::with_flags(mesh.vertices().to_vec(), mesh.indices().to_vec(), flags);
        SharedShape::new(fixed.unwrap_or_else(|_| mesh.clone()))
    }
}

/// Returns the surface of an object placed by a transform; `None` without triangles with area.
fn surface_of(world: &World, object: usize, place: DAffine3) -> Option<Surface> {
    let mesh = &world.meshes[world.objects[object].mesh];
    let points: Vec<Vector> = mesh.vertices.iter().map(|&v| vector(place.transform_point3(v))).collect();
    let mirrored = place.matrix3.determinant() < 0.0;
    let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    Surface::new(&points, mesh.triangles.iter().map(turned))
}
