//! Instances: meshes placed in the scene, with bounds on their float32 rounding errors.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use raycam_bvh::Instance;
use raycam_scene::Object;
use raycam_scene::world::RayVisibility;

use crate::prepare::mesh::PreparedMesh;
use crate::prepare::stretch::StretchedBvh;

/// Maximum number of bounding boxes of a scene; if the scene has more objects, all objects share one box.
const MAX_BOXES: usize = 256;

/// Mesh placed in the scene.
#[derive(Clone, Debug)]
pub(crate) struct PreparedInstance {
    pub mesh: Arc<PreparedMesh>,
    /// BVH that is traced instead of the mesh's own BVH.
    pub stretched: Option<StretchedBvh>,
    pub world_from_mesh: DAffine3,
    /// Scale and shear of the object, without its rotation.
    scale_shear: DMat3,
    /// True if `world_from_mesh` is the identity.
    pub is_identity: bool,
    /// Transforms normals to the world: the inverse transpose of the linear part. The length is arbitrary.
    pub normal_from_mesh: DMat3,
    /// True if the transform mirrors: counter-clockwise triangles become clockwise.
    pub flips_orientation: bool,
    /// For each material slot: the index of the material.
    pub materials: Vec<usize>,
    /// Index of the category in the world's categories, or -1.
    pub category: i32,
    pub error_bounds: ErrorBounds,
    /// False for an instance that nothing hits.
    pub is_visible: bool,
    /// Kinds of rays that find the instance, if it is visible.
    pub ray_visibility: RayVisibility,
    /// True for the border of a medium, which only media cross.
    pub is_boundary: bool,
    /// True for a shadow catcher, of which only the shadows appear in a composite.
    pub is_catcher: bool,
}

/// Upper bound on the number of float32 roundings, each of the largest coordinate, between a surface and a ray that
/// leaves it: vertices, transform, origin and direction of the ray, shear of the triangle test.
const MAX_ROUNDINGS: f64 = 8.0;

/// Bounds on the float32 errors of points on an instance, in units of one rounding.
#[derive(Clone, Debug)]
pub(crate) struct ErrorBounds {
    /// Growth of a point's error when it is transformed to mesh coordinates and back: |M| |M^-1|.
    per_point: DMat3,
    /// Error of the instance's translation and of its vertices.
    per_mesh: DVec3,
}

impl ErrorBounds {
    /// Columns of `per_point`, followed by `per_mesh`.
    #[inline(always)]
    pub fn columns(&self) -> [DVec3; 4] {
        let Self { per_point: of_point, per_mesh: of_mesh } = self;
        [of_point.x_axis, of_point.y_axis, of_point.z_axis, *of_mesh]
    }

    /// Bound on the float32 displacement along `normal` of a point on the instance, of a ray that starts at this point,
    /// and of the triangles around the point. `point` is scene-local; the first two arguments are
    /// [`ErrorBounds::columns`].
    #[inline(always)]
    pub fn error_along([x, y, z]: [DVec3; 3], of_mesh: DVec3, point: DVec3, normal: DVec3) -> f64 {
        let per_axis = DMat3::from_cols(x, y, z) * point.abs() + of_mesh;
        MAX_ROUNDINGS * f64::from(f32::EPSILON) / 2.0 * per_axis.dot(normal.abs())
    }
}

impl PreparedInstance {
    pub fn new(
        object: &Object,
        mesh: Arc<PreparedMesh>,
        stretched: Option<StretchedBvh>,
        origin: DVec3,
        category: i32,
        is_boundary: bool,
    ) -> Self {
        let linear = object.world_from_mesh.matrix3;
        let stretch = stretched.as_ref().map_or(DMat3::IDENTITY, |own| own.stretch);
        // Linear part of the transform from the coordinates in which rays are traced to the world.
        let traced = linear * stretch.inverse();
        let of_point = traced.abs() * traced.inverse().abs();
        let place = (object.world_from_mesh.transform_point3(mesh.center) - origin).abs();
        let reach = (stretch.abs() * (mesh.upper - mesh.center).max(mesh.center - mesh.lower)).max_element();
        Self {
            error_bounds: ErrorBounds {
                per_point: of_point,
                per_mesh: of_point * place + traced.abs() * DVec3::splat(2.0 * reach),
            },
            is_identity: object.world_from_mesh == DAffine3::IDENTITY,
            world_from_mesh: object.world_from_mesh,
            scale_shear: object.scale_shear,
            normal_from_mesh: linear.inverse().transpose(),
            flips_orientation: linear.determinant() < 0.0,
            materials: object.materials.clone(),
            category,
            is_visible: object.visible && !is_boundary,
            ray_visibility: object.ray_visibility,
            is_boundary: object.visible && is_boundary,
            is_catcher: object.shadow_catcher,
            mesh,
            stretched,
        }
    }

    /// Coordinates of a point of the mesh in the object's box, in the object's axes: the box's diagonal has length 1,
    /// and its centre is (0.5, 0.5, 0.5).
    ///
    /// H. Wang et al., "Normalized Object Coordinate Space for Category-Level 6D Object Pose and Size Estimation", CVPR
    /// 2019.
    pub fn normalized_coordinates(&self, point: DVec3) -> DVec3 {
        let axes = DAffine3::from_mat3(self.scale_shear);
        let [lower, upper] = transformed_bounds(&self.mesh, &axes);
        let diagonal = (upper - lower).length();
        let scale = if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 };
        DVec3::splat(0.5) + (axes.transform_point3(point) - (lower + upper) / 2.0) * scale
    }

    /// World-space bounding box: lower and upper corner.
    pub fn bounds(&self) -> [DVec3; 2] {
        transformed_bounds(&self.mesh, &self.world_from_mesh)
    }

    /// Bound, per axis, on float32 errors of the instance and of rays that start up to `reach` from the scene's
    /// origin.
    pub fn error_extent(&self, reach: f64) -> DVec3 {
        let rounding = self.error_bounds.per_point * DVec3::splat(reach) + self.error_bounds.per_mesh;
        MAX_ROUNDINGS * f64::from(f32::EPSILON) / 2.0 * rounding
    }

    /// Instance of the mesh's BVH, or of its stretched BVH, in scene-local coordinates. An invisible instance is
    /// flattened to a point, which rays cannot hit.
    pub fn bvh_instance(&self, origin: DVec3) -> Instance {
        self.instance_if(self.is_visible, origin)
    }

    /// Same as [`PreparedInstance::bvh_instance`], for a scene that contains only the borders of media: all
    /// other instances are flattened to a point.
    pub fn boundary_instance(&self, origin: DVec3) -> Instance {
        self.instance_if(self.is_boundary, origin)
    }

    fn instance_if(&self, is_there: bool, origin: DVec3) -> Instance {
        if !is_there {
            return Instance { bvh: self.mesh.bvh.clone(), world_from_mesh: [[0.0; 4]; 3] };
        }
        let linear = self.world_from_mesh.matrix3;
        let (bvh, linear) = match &self.stretched {
            Some(StretchedBvh { bvh, stretch }) => (bvh, linear * stretch.inverse()),
            None => (&self.mesh.bvh, linear),
        };
        let place = self.world_from_mesh.transform_point3(self.mesh.center) - origin;
        let row = |i: usize| {
            let row = linear.row(i);
            [row.x, row.y, row.z, place[i]].map(|value| value as f32)
        };
        Instance { bvh: bvh.clone(), world_from_mesh: [row(0), row(1), row(2)] }
    }
}

/// Bounding box of a placed mesh, from the eight corners of its own box.
pub(crate) fn transformed_bounds(mesh: &PreparedMesh, world_from_mesh: &DAffine3) -> [DVec3; 2] {
    let corner = |i: u32| {
        let pick = |axis: usize| {
            if i >> axis & 1 == 1 { mesh.upper[axis] } else { mesh.lower[axis] }
        };
        world_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    (0..8).map(corner).fold(nothing, |[l, u], c| [l.min(c), u.max(c)])
}

/// World-space boxes that contain all instances, padded by the float32 errors of rays that start within `reach` of the
/// scene's origin.
pub(crate) fn object_bounds(objects: &[PreparedInstance], origin: DVec3, reach: f64) -> Vec<[DVec3; 2]> {
    let each = (MAX_BOXES / objects.len().max(1)).max(1);
    let boxes = objects.iter().filter(|object| object.is_visible).flat_map(|object| {
        let blur = object.error_extent(reach);
        let place = object.world_from_mesh;
        object.mesh.bvh.bounding_boxes(each).into_iter().map(move |corners| {
            let [lower, upper] = corners.map(|corner| DVec3::from(corner.map(f64::from)));
            let middle = place.transform_point3(object.mesh.center + (lower + upper) / 2.0);
            let half = place.matrix3.abs() * ((upper - lower) / 2.0);
            let pad = blur + 16.0 * f64::EPSILON * (middle.abs() + half + origin.abs());
            [middle - half - pad, middle + half + pad]
        })
    });
    if objects.len() <= MAX_BOXES {
        return boxes.collect();
    }
    let around = |[a, b]: [DVec3; 2], [l, u]: [DVec3; 2]| [a.min(l), b.max(u)];
    boxes.reduce(around).into_iter().collect()
}
