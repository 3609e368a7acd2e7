//! The state machine of a float64 ray in flight: float32 boxes find the candidates, float64 corners decide.

use crate::blas::Bvh;
use crate::limits::MACHINE_EPSILON;
use crate::node::{NodeBlock, NodeRef, leaf, node};
use crate::ray::INVALID_ID;
use crate::scene::rebraid::SubtreeRef;
use crate::scene::{ExactTriangles, Scene};
use crate::simd::Isa;
use crate::traverse::exact::clipped_ray::{ClippedRay, coordinate_error, max_abs, to_mesh_space};
use crate::traverse::exact::leaf::{LeafCandidates, classify_triangles, t_range};
use crate::traverse::node_test::{intersect_children, prefetch_block};
use crate::traverse::single::interleaved::RayInFlight;
use crate::traverse::stack::Stack;
use crate::traverse::trav_ray::{TravRay, scale_t};

/// A search along one ray: it visits the triangles that the ray may hit.
pub trait RaySearch {
    fn clipped_ray(&self) -> &ClippedRay;

    /// True if the search visits triangles of an instance.
    fn accepts_instance(&self, instance: u32) -> bool;

    /// True if float32 may decide about triangles; each triangle is then passed to [`RaySearch::decide`] first.
    fn uses_float32(&self) -> bool;

    fn decide(&self, estimate: &TriangleEstimate) -> Decision;

    /// Receives a triangle for which [`RaySearch::decide`] returned [`Decision::Accepted`].
    fn accept(&mut self, triangle: (u32, u32), estimate: &TriangleEstimate);

    /// Tests a triangle that the ray may hit, in float64.
    fn visit(&mut self, triangle: (u32, u32), corners: [[f64; 3]; 3], triangles: &dyn ExactTriangles);
}

/// Float32 results for a ray and a triangle.
pub struct TriangleEstimate {
    /// Bounds of t along the ray of the search, counted from its clipped origin.
    pub t: [f32; 2],
    /// True if the ray's line certainly passes through the triangle.
    pub is_sure: bool,
    /// True if the ray leaves through the back of the triangle, as seen in the mesh; valid if `is_sure`.
    pub leaves: bool,
}

/// Decision about a triangle by its [`TriangleEstimate`].
#[derive(Clone, Copy, PartialEq)]
pub enum Decision {
    Rejected,
    Accepted,
    /// Float64 must decide.
    Unknown,
}

/// A float64 ray in flight: its position in the trees, and its search.
#[repr(C, align(64))]
pub struct ExactRayState<'a, S> {
    /// The ray in the coordinates of the current tree.
    ray: TravRay,
    blocks: &'a [NodeBlock],
    node: NodeRef,
    /// Stack entries below this index belong to the TLAS.
    stack_base: u32,
    /// The t up to which boxes are visited, along `ray`.
    t_max: f32,
    /// The error bound of coordinates in the mesh.
    off: f32,
    /// Triangles of the current leaf that the ray may hit.
    candidates: LeafCandidates,
    /// The first of these triangles, loaded by [`RayInFlight::load_triangle`].
    triangle: u32,
    corners: [[f64; 3]; 3],
    /// The current BLAS; `None` in the TLAS.
    mesh: Option<&'a Bvh>,
    instance: u32,
    /// The instance in whose coordinates `ray` is, or [`INVALID_ID`].
    current_instance: u32,
    /// True if the ray traverses only one tree.
    single_tree: bool,
    /// The scale of t along the ray in TLAS coordinates.
    tlas_t_scale: f64,
    triangles: &'a dyn ExactTriangles,
    /// The index under which the ray's hits are reported.
    pub ray_id: usize,
    /// The search along the ray; `None` without a ray.
    pub search: Option<S>,
    stack: Stack,
}

impl<'a, S: RaySearch> ExactRayState<'a, S> {
    /// A state without a ray.
    #[inline(always)]
    pub fn idle(triangles: &'a dyn ExactTriangles) -> Self {
        Self {
            ray: TravRay::EMPTY,
            blocks: &[],
            node: NodeRef::EMPTY,
            stack_base: 0,
            t_max: 0.0,
            off: 0.0,
            candidates: LeafCandidates::NONE,
            triangle: 0,
            corners: [[0.0; 3]; 3],
            mesh: None,
            instance: 0,
            current_instance: INVALID_ID,
            single_tree: false,
            tlas_t_scale: 1.0,
            triangles,
            ray_id: 0,
            search: None,
            stack: Stack::new(),
        }
    }

    /// Starts a ray through one subtree or the whole scene; returns false if the ray is invalid and therefore
    /// misses (see [`TravRay::setup`]).
    #[inline(always)]
    pub fn begin(&mut self, scene: &'a Scene, ray_id: usize, search: S, subtree: Option<&SubtreeRef>) -> bool {
        self.ray_id = ray_id;
        self.search = Some(search);
        self.stack.len = 0;
        self.stack.push_sentinel();
        self.stack_base = 1;
        self.current_instance = INVALID_ID;
        self.single_tree = scene.is_single_mesh || subtree.is_some();
        if self.single_tree {
            let runs = self.enter_blas(scene, subtree.map_or(0, |subtree| subtree.instance));
            self.node = subtree.map_or(self.node, |subtree| subtree.node);
            return runs;
        }
        self.node = scene.root;
        self.enter_tlas(scene)
    }

    /// The t up to which boxes must be visited, along the ray of the search.
    #[inline(always)]
    fn outer_t_max(&self) -> f32 {
        self.search.as_ref().map_or(0.0, |search| search.clipped_ray().t_max_f32())
    }

    /// Returns to the TLAS; returns false if the ray is invalid in scene coordinates.
    #[inline(always)]
    fn enter_tlas(&mut self, scene: &'a Scene) -> bool {
        let Some(search) = &self.search else { return false };
        let ray = search.clipped_ray();
        let ([x, y, z], [dx, dy, dz], scale) = (ray.local_origin, ray.ray.direction, scene.scale);
        let start = [x as f32, y as f32, z as f32];
        let direction = [(dx * scale) as f32, (dy * scale) as f32, (dz * scale) as f32];
        let slack = 2.0 * scene.box_padding(max_abs(start)) + ray.origin_error as f32 * 2.0;
        if !self.ray.setup(start, direction, &scene.bounds, slack) {
            return false;
        }
        self.tlas_t_scale = self.ray.t_scale;
        self.t_max = self.ray.to_local_t(self.outer_t_max()).next_up();
        self.blocks = scene.blocks();
        self.current_instance = INVALID_ID;
        self.mesh = None;
        true
    }

    /// Enters an instance; returns false if the filter rejects the instance, or if the transformed ray is invalid and
    /// therefore misses.
    #[inline(always)]
    fn enter_blas(&mut self, scene: &'a Scene, instance: u32) -> bool {
        let Some(search) = self.search.as_ref().filter(|search| search.accepts_instance(instance)) else {
            return false;
        };
        let record = &scene.instances[instance as usize];
        let mesh = &*record.bvh;
        // The next subtree may belong to the same instance.
        if self.current_instance != instance {
            let ray = search.clipped_ray();
            let (origin, direction) = to_mesh_space(scene, record, (ray.local_origin, ray.ray.direction));
            let [x, y, z] = ray.local_origin;
            let distance = max_abs([x as f32, y as f32, z as f32]);
            let off = coordinate_error(scene, record, distance, ray.origin_error);
            if !self.ray.setup(origin, direction, mesh.bounds(), off) {
                self.current_instance = INVALID_ID;
                return false;
            }
            self.off = off + 8.0 * MACHINE_EPSILON * (max_abs(origin).max(mesh.max_abs_coord()) + mesh.max_abs_coord());
            self.current_instance = instance;
        }
        self.t_max = self.ray.to_local_t(self.outer_t_max()).next_up();
        self.blocks = mesh.blocks();
        self.mesh = Some(mesh);
        self.instance = instance;
        self.node = mesh.root();
        true
    }

    /// Pops the next TLAS entry. Usually, the next entry is another instance, or the stack is empty. In both cases, the
    /// ray in TLAS coordinates is not needed. Returns true if the ray is done.
    #[inline(always)]
    fn pop_tlas(&mut self, scene: &'a Scene) -> bool {
        self.node = self.stack.pop_unchecked();
        if !self.node.is_leaf() {
            return !self.enter_tlas(scene);
        }
        self.node == NodeRef::EMPTY
    }

    /// Enters the instance of the current subtree, or pops the next entry if the instance is skipped. Returns true if
    /// the ray is done.
    #[inline(never)]
    fn enter_instance(&mut self, scene: &'a Scene) -> bool {
        let subtree = &scene.subtree_refs[self.node.index()];
        if self.enter_blas(scene, subtree.instance) {
            self.node = subtree.node;
            self.stack.push_sentinel();
            self.stack_base = self.stack.len as u32;
            return false;
        }
        self.pop_tlas(scene)
    }

    /// Leaves an instance. Returns true if the ray is done.
    #[inline(never)]
    fn leave_instance(&mut self, scene: &'a Scene) -> bool {
        if self.mesh.is_none() {
            return true;
        }
        self.mesh = None;
        self.stack_base = 1;
        self.stack.cull(1, scale_t(self.outer_t_max(), self.tlas_t_scale).next_up());
        self.pop_tlas(scene)
    }
}

impl<'a, S: RaySearch> RayInFlight<'a> for ExactRayState<'a, S> {
    #[inline(always)]
    fn node(&self) -> NodeRef {
        self.node
    }

    #[inline(always)]
    fn is_in_tlas(&self) -> bool {
        self.mesh.is_none()
    }

    #[inline(always)]
    fn step_node<I: Isa>(&mut self) {
        let node = node(self.blocks, self.node);
        let (mask, enter) = intersect_children::<I>(node, &self.ray, self.t_max);
        self.node = self.stack.push_children_or_pop::<I, true>(node, enter, mask);
        prefetch_block::<I>(self.blocks, self.node);
    }

    #[inline(always)]
    fn step_leaf<I: Isa>(&mut self) -> bool {
        let leaf = leaf(self.blocks, self.node);
        self.candidates = classify_triangles::<I>(leaf, &self.ray, self.off);
        if let Some(mesh) = self.mesh {
            mesh.prefetch_prim_id::<I>(leaf.first_prim);
        }
        let has_none = self.candidates.near == 0;
        self.node = self.stack.pop_if(has_none, self.node);
        prefetch_block::<I>(self.blocks, self.node);
        !has_none
    }

    /// Loads the first candidate that float32 does not decide.
    #[inline(always)]
    fn load_triangle<I: Isa>(&mut self) {
        let (Some(search), Some(mesh)) = (&mut self.search, self.mesh) else { return };
        let leaf = leaf(self.blocks, self.node);
        let LeafCandidates { near, sure, positive } = self.candidates;
        if search.uses_float32() {
            let is_forward = self.ray.reciprocal[self.ray.axes[2] as usize & 3] > 0.0;
            let mut left = near;
            while left != 0 {
                let k = left.trailing_zeros();
                left &= left - 1;
                let is_sure = sure >> k & 1 != 0;
                let t = t_range(leaf, k as usize, &self.ray, self.off, is_sure).map(|t| self.ray.to_outer_t(t));
                let leaves = (positive >> k & 1 != 0) != is_forward;
                let estimate = TriangleEstimate { t, is_sure, leaves };
                let decision = search.decide(&estimate);
                if decision == Decision::Accepted {
                    search.accept((self.instance, mesh.prim_id(leaf.first_prim + k)), &estimate);
                }
                self.candidates.near &= !(u32::from(decision != Decision::Unknown) << k);
            }
        }
        if self.candidates.near != 0 {
            self.triangle = mesh.prim_id(leaf.first_prim + self.candidates.near.trailing_zeros());
            self.corners = self.triangles.corners(self.instance, self.triangle);
        }
    }

    #[inline(always)]
    fn step_triangles<I: Isa>(&mut self) {
        let (Some(search), Some(mesh)) = (&mut self.search, self.mesh) else { return };
        let leaf = leaf(self.blocks, self.node);
        let mut left = self.candidates.near;
        if left != 0 && !search.clipped_ray().is_done() {
            search.visit((self.instance, self.triangle), self.corners, self.triangles);
            left &= left - 1;
            while left != 0 {
                let triangle = mesh.prim_id(leaf.first_prim + left.trailing_zeros());
                left &= left - 1;
                let corners = self.triangles.corners(self.instance, triangle);
                search.visit((self.instance, triangle), corners, self.triangles);
            }
        }
        if search.clipped_ray().is_done() {
            self.node = NodeRef::EMPTY;
            return;
        }
        let t_max = self.ray.to_local_t(search.clipped_ray().t_max_f32()).next_up();
        if t_max < self.t_max {
            self.t_max = t_max;
            self.stack.cull(self.stack_base as usize, t_max);
        }
        self.node = self.stack.pop_unchecked();
        prefetch_block::<I>(self.blocks, self.node);
    }

    #[inline(always)]
    fn step_instance(&mut self, scene: &'a Scene) -> bool {
        if self.search.as_ref().is_none_or(|search| search.clipped_ray().is_done()) {
            return true;
        }
        if self.node != NodeRef::EMPTY {
            return self.enter_instance(scene);
        }
        self.single_tree || self.leave_instance(scene)
    }
}
