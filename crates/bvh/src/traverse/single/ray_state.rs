//! The state machine of a single ray in flight, advanced one step at a time.

use crate::blas::Bvh;
use crate::node::{NodeBlock, NodeRef, leaf, node};
use crate::ray::{Hit, INVALID_ID, Ray};
use crate::scene::Scene;
use crate::simd::Isa;
use crate::traverse::near_ties::widen;
use crate::traverse::node_test::{intersect_children, prefetch_block, setup_instance_ray};
use crate::traverse::single::closest_hit::{ClosestHit, MeshTies, NO_PRIM, any_hit};
use crate::traverse::single::interleaved::RayInFlight;
use crate::traverse::stack::Stack;
use crate::traverse::trav_ray::{TravRay, scale_t};
use crate::traverse::triangle::single::edge_test;

/// A ray to trace.
#[derive(Clone, Copy)]
pub struct RayTask {
    pub ray: Ray,
    /// The index under which the ray's hit is reported.
    pub ray_id: usize,
    /// The only subtree of the instance to traverse; [`NodeRef::EMPTY`] for the whole scene.
    pub start_node: NodeRef,
    pub instance: u32,
}

/// A ray in flight: its position in the trees and its hit. With `ANY_HIT`, the hit's instance only shows whether the
/// ray hit anything.
#[repr(C, align(64))]
pub struct RayState<'a, const ANY_HIT: bool> {
    /// The ray in the coordinates of the current tree.
    ray: TravRay,
    blocks: &'a [NodeBlock],
    /// The next node, leaf or instance.
    node: NodeRef,
    /// Stack entries below this index belong to the TLAS.
    stack_base: u32,
    best: ClosestHit,
    ties: MeshTies<'a>,
    /// Triangles of the current leaf that pass the edge test. These triangles are intersected in a separate step, which
    /// runs only if there are any.
    candidates: u32,
    /// The current BLAS; `None` in the TLAS.
    mesh: Option<&'a Bvh>,
    instance: u32,
    /// The instance in whose coordinates `ray` is, or [`INVALID_ID`].
    current_instance: u32,
    /// True if only one instance is traversed.
    single_instance: bool,
    /// True if `ray` has the given direction and is not parallel to an axis. For an instance that is only translated,
    /// it is then sufficient to translate the ray's origin.
    direction_reusable: bool,
    /// The scale of t along the ray in TLAS coordinates, relative to the given ray.
    tlas_t_scale: f64,
    pub ray_id: usize,
    pub hit: Hit,
    /// True if the ray may have hit coplanar surfaces of two instances.
    pub contested: bool,
    /// Width at t = 0 of the range in which [`crate::traverse::near_ties`] searches.
    tie_width: f32,
    pub world_ray: Ray,
    stack: Stack,
    _pad: [u64; 8],
}

// The size of a state is an odd number of cache lines, so that the same fields of all states are in different L1 sets.
// With 32-bit pointers, as in WebAssembly, the size differs; this is acceptable, because a browser page traces few rays
// at once.
#[cfg(target_pointer_width = "64")]
const _: () = assert!(size_of::<RayState<false>>() / 64 % 2 == 1);

impl<'a, const ANY_HIT: bool> RayState<'a, ANY_HIT> {
    /// A state without a ray.
    #[inline(always)]
    pub fn idle() -> Self {
        Self {
            ray: TravRay::EMPTY,
            blocks: &[],
            node: NodeRef::EMPTY,
            stack_base: 0,
            best: ClosestHit::miss(0.0),
            ties: MeshTies { ranges: None, width: 0.0, contested: false },
            candidates: 0,
            mesh: None,
            instance: 0,
            current_instance: INVALID_ID,
            single_instance: false,
            direction_reusable: false,
            tlas_t_scale: 1.0,
            ray_id: 0,
            hit: Hit::MISS,
            contested: false,
            tie_width: 0.0,
            world_ray: Ray { origin: [0.0; 3], direction: [0.0; 3], t_max: 0.0 },
            stack: Stack::new(),
            _pad: [0; 8],
        }
    }

    /// Starts a ray; returns false if the ray is invalid and therefore misses (see [`TravRay::setup`]).
    #[inline(always)]
    pub fn begin(&mut self, scene: &'a Scene, task: RayTask) -> bool {
        let RayTask { ray: world_ray, ray_id, start_node, instance } = task;
        self.hit = Hit::MISS;
        self.contested = false;
        self.tie_width = scene.outer_near_tie_width(&world_ray);
        self.ray_id = ray_id;
        self.world_ray = world_ray;
        self.candidates = 0;
        self.stack.len = 0;
        self.stack.push_sentinel();
        self.stack_base = 1;
        if scene.root == NodeRef::EMPTY || world_ray.t_max.is_nan() || world_ray.t_max < 0.0 {
            return false;
        }
        self.single_instance = scene.is_single_mesh || start_node != NodeRef::EMPTY;
        self.direction_reusable = false;
        self.current_instance = INVALID_ID;
        if self.single_instance {
            let entered = if scene.is_single_mesh {
                self.enter_blas::<true>(scene, 0, world_ray.t_max)
            } else {
                self.enter_blas::<false>(scene, instance, world_ray.t_max)
            };
            self.node = if start_node == NodeRef::EMPTY { self.node } else { start_node };
            return entered;
        }
        self.node = scene.root;
        self.enter_tlas(scene, world_ray.t_max)
    }

    /// Returns to the TLAS; returns false if the ray is invalid in scene coordinates.
    #[inline(always)]
    fn enter_tlas(&mut self, scene: &'a Scene, t_max: f32) -> bool {
        if !scene.setup_ray(&mut self.ray, &self.world_ray) {
            return false;
        }
        self.best = ClosestHit::miss(self.ray.to_local_t(t_max));
        self.tlas_t_scale = self.ray.t_scale;
        self.direction_reusable = self.ray.has_no_parallel_axis();
        self.blocks = scene.blocks();
        self.current_instance = INVALID_ID;
        self.mesh = None;
        true
    }

    /// Pops the next TLAS entry. Usually, the next entry is another instance, or the stack is empty. In both cases, the
    /// ray in TLAS coordinates is not needed. Returns true if the ray is done.
    #[inline(always)]
    fn pop_tlas(&mut self, scene: &'a Scene) -> bool {
        self.node = self.stack.pop_unchecked();
        if !self.node.is_leaf() {
            return !self.enter_tlas(scene, self.t_max());
        }
        self.node == NodeRef::EMPTY
    }

    /// Enters an instance; returns false if the transformed ray is invalid and therefore misses.
    #[inline(always)]
    fn enter_blas<const SINGLE_LEVEL: bool>(&mut self, scene: &'a Scene, instance: u32, t_max: f32) -> bool {
        let record = &scene.instances[instance as usize];
        let mesh = &*record.bvh;
        // The next subtree may belong to the same instance.
        if SINGLE_LEVEL || self.current_instance != instance {
            let runs = if SINGLE_LEVEL {
                scene.setup_ray(&mut self.ray, &self.world_ray)
            } else if let (Some([x, y, z]), true) = (record.translation_only, self.direction_reusable) {
                let [a, b, c] = self.world_ray.origin;
                self.ray.translate([a + x, b + y, c + z], mesh.bounds())
            } else {
                self.direction_reusable = false;
                setup_instance_ray(&mut self.ray, scene, record, &self.world_ray)
            };
            if !runs {
                return false;
            }
            self.current_instance = instance;
        }
        self.best = ClosestHit::miss(self.ray.to_local_t(t_max));
        let ranges = scene.mesh_ranges.as_ref();
        self.ties = MeshTies { ranges, width: scene.near_tie_width_in(record), contested: false };
        self.blocks = mesh.blocks();
        self.mesh = Some(mesh);
        self.instance = instance;
        self.node = mesh.root();
        true
    }

    /// Merges the hit in the current instance into the hit of the ray.
    #[inline(always)]
    fn commit_hit(&mut self, scene: &Scene) {
        if let (Some(mesh), true) = (self.mesh, self.best.prim_index != NO_PRIM) {
            let ClosestHit { t, u, v, prim_index, .. } = self.best;
            let triangle = mesh.prim_id(prim_index);
            let hit = Hit { t: self.ray.to_outer_t(t), u, v, instance: self.instance, triangle };
            self.contested |= self.ties.contested | scene.keep_closer(&mut self.hit, hit, self.tie_width);
        }
    }

    /// The t up to which the ray is searched: the t of the closest hit so far, widened for ties, or the ray's t_max.
    #[inline(always)]
    fn t_max(&self) -> f32 {
        let limit = widen(self.hit.t, self.tie_width);
        if limit < self.world_ray.t_max { limit } else { self.world_ray.t_max }
    }

    /// Enters the instance of the current subtree, or pops the next entry if the transformed ray is invalid and
    /// therefore misses the instance. Returns true if the ray is done.
    #[inline(never)]
    fn enter_instance(&mut self, scene: &'a Scene) -> bool {
        let t_max = self.t_max();
        let subtree = &scene.subtree_refs[self.node.index()];
        if self.enter_blas::<false>(scene, subtree.instance, t_max) {
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
        self.commit_hit(scene);
        if self.mesh.is_none() {
            return true;
        }
        self.mesh = None;
        self.stack_base = 1;
        // Only closest-hit traversal stores distances on the stack.
        if self.best.prim_index != NO_PRIM {
            self.stack.cull(1, scale_t(self.t_max(), self.tlas_t_scale));
        }
        self.pop_tlas(scene)
    }
}

impl<'a, const ANY_HIT: bool> RayInFlight<'a> for RayState<'a, ANY_HIT> {
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
        let (mask, enter) = intersect_children::<I>(node, &self.ray, self.best.limit);
        self.node = if ANY_HIT {
            self.stack.push_children_or_pop::<I, false>(node, enter, mask)
        } else {
            self.stack.push_children_or_pop::<I, true>(node, enter, mask)
        };
        prefetch_block::<I>(self.blocks, self.node);
    }

    /// Tests the edges of the triangles, branch-free because candidates are unpredictable; without a candidate, pops
    /// the next node. In any-hit queries, triangles are intersected in the same step, because most rays end too early
    /// for two steps to be faster.
    #[inline(always)]
    fn step_leaf<I: Isa>(&mut self) -> bool {
        let leaf = leaf(self.blocks, self.node);
        let candidates = edge_test::<I>(leaf, &self.ray);
        if ANY_HIT {
            if any_hit(leaf, candidates, &self.ray, self.best.t) {
                self.hit.instance = self.instance;
                self.node = NodeRef::EMPTY;
                return false;
            }
            self.node = self.stack.pop_unchecked();
        } else {
            self.candidates = candidates;
            self.node = self.stack.pop_if(candidates == 0, self.node);
        }
        prefetch_block::<I>(self.blocks, self.node);
        !ANY_HIT && candidates != 0
    }

    #[inline(always)]
    fn step_triangles<I: Isa>(&mut self) {
        let leaf = leaf(self.blocks, self.node);
        if let Some(mesh) = self.mesh
            && self.best.update(mesh, leaf, self.candidates, &self.ray, &mut self.ties)
        {
            self.stack.cull(self.stack_base as usize, self.best.limit);
            mesh.prefetch_prim_id::<I>(leaf.first_prim);
        }
        self.node = self.stack.pop_unchecked();
        prefetch_block::<I>(self.blocks, self.node);
    }

    #[inline(always)]
    fn step_instance(&mut self, scene: &'a Scene) -> bool {
        if ANY_HIT && self.hit.instance != INVALID_ID {
            return true;
        }
        if self.node != NodeRef::EMPTY {
            return self.enter_instance(scene);
        }
        if !self.single_instance {
            return self.leave_instance(scene);
        }
        self.commit_hit(scene);
        true
    }
}
