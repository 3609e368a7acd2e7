//! A ray on its way, a step at a time.

use crate::blas::Bvh;
use crate::node::{NodeBlock, NodeRef, leaf, node};
use crate::ray::{Hit, INVALID_ID, Ray};
use crate::scene::Scene;
use crate::simd::Isa;
use crate::traverse::node_test::{intersect_children, setup_instance_ray};
use crate::traverse::single::closest_hit::{ClosestHit, NO_PRIM, any_hit};
use crate::traverse::stack::Stack;
use crate::traverse::trav_ray::{TravRay, scale_t};
use crate::traverse::triangle::single::edge_test;

/// A ray to be traced.
#[derive(Clone, Copy)]
pub struct RayTask {
    pub ray: Ray,
    /// What to answer it by.
    pub ray_id: usize,
    /// Where in the mesh of which instance to start, and to end with it; [`NodeRef::EMPTY`] for the root of everything.
    pub start_node: NodeRef,
    pub instance: u32,
}

/// Where it is, and what it met.
#[repr(C, align(64))]
pub struct RayState<'a> {
    /// In the coordinates of the tree that `blocks` belong to.
    ray: TravRay,
    blocks: &'a [NodeBlock],
    /// The node, leaf or instance that is next.
    pub node: NodeRef,
    /// Entries below belong to the tree over instances.
    stack_base: u32,
    best: ClosestHit,
    /// Of the leaf at hand: triangles edge_test whose edges the ray runs. They wait for the ray's next turn, when it is
    /// known for sure whether there are any, and no work is begun in vain.
    pub candidates: u32,
    /// The mesh that is being traced; `None` above the instances.
    pub mesh: Option<&'a Bvh>,
    instance: u32,
    /// The instance in whose coordinates `ray` is, or [`INVALID_ID`].
    current_instance: u32,
    /// Nothing but that instance is to be traced.
    single_instance: bool,
    /// `ray` runs in the given direction, and along every axis: another origin makes it that of another mesh in the place
    /// where it was made, or moved from there.
    direction_reusable: bool,
    /// t along the ray in the tree over instances is so many times that of the one given.
    tlas_t_scale: f64,
    pub ray_id: usize,
    pub hit: Hit,
    world_ray: Ray,
    stack: Stack,
}

// An odd number of lines: the same fields of all slots lie in different sets of the nearest cache.
const _: () = assert!(size_of::<RayState>() / 64 % 2 == 1);

impl<'a> RayState<'a> {
    #[inline(always)]
    pub fn idle() -> Self {
        Self {
            ray: TravRay::EMPTY,
            blocks: &[],
            node: NodeRef::EMPTY,
            stack_base: 0,
            best: ClosestHit::miss(0.0),
            candidates: 0,
            mesh: None,
            instance: 0,
            current_instance: INVALID_ID,
            single_instance: false,
            direction_reusable: false,
            tlas_t_scale: 1.0,
            ray_id: 0,
            hit: Hit::MISS,
            world_ray: Ray {
                origin: [0.0; 3],
                direction: [0.0; 3],
                t_max: 0.0,
            },
            stack: Stack::new(),
        }
    }

    /// Starts a ray; false if it meets nothing by definition.
    #[inline(always)]
    pub fn begin(&mut self, scene: &'a Scene, task: RayTask) -> bool {
        let RayTask {
            ray: world_ray,
            ray_id,
            start_node,
            instance,
        } = task;
        self.hit = Hit::MISS;
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
            self.node = if start_node == NodeRef::EMPTY {
                self.node
            } else {
                start_node
            };
            return entered;
        }
        self.node = scene.root;
        self.enter_tlas(scene, world_ray.t_max)
    }

    /// Goes above the instances.
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

    /// What is left above the instances: most often another one or nothing, and for neither is the ray needed in the
    /// coordinates of their tree. True once there is nothing.
    #[inline(always)]
    fn pop_tlas(&mut self, scene: &'a Scene) -> bool {
        self.node = self.stack.pop_unchecked();
        if !self.node.is_leaf() {
            return !self.enter_tlas(scene, self.t_max());
        }
        self.node == NodeRef::EMPTY
    }

    /// Goes into an instance.
    #[inline(always)]
    fn enter_blas<const SINGLE_LEVEL: bool>(
        &mut self,
        scene: &'a Scene,
        instance: u32,
        t_max: f32,
    ) -> bool {
        let placed = &scene.instances[instance as usize];
        let mesh = &*placed.bvh;
        // Another part of the mesh it was in last may be next.
        if SINGLE_LEVEL || self.current_instance != instance {
            let runs = if SINGLE_LEVEL {
                scene.setup_ray(&mut self.ray, &self.world_ray)
            } else if let (Some([x, y, z]), true) =
                (placed.translation_only, self.direction_reusable)
            {
                let [a, b, c] = self.world_ray.origin;
                self.ray.translate([a + x, b + y, c + z], mesh.bounds())
            } else {
                self.direction_reusable = false;
                setup_instance_ray(&mut self.ray, scene, placed, &self.world_ray)
            };
            if !runs {
                return false;
            }
            self.current_instance = instance;
        }
        self.best = ClosestHit::miss(self.ray.to_local_t(t_max));
        self.blocks = mesh.blocks();
        self.mesh = Some(mesh);
        self.instance = instance;
        self.node = mesh.root();
        true
    }

    /// Takes over what the instance had.
    #[inline(always)]
    fn commit_hit(&mut self) {
        if let (Some(mesh), true) = (self.mesh, self.best.prim_index != NO_PRIM) {
            let ClosestHit {
                t,
                u,
                v,
                prim_index,
            } = self.best;
            self.hit.keep_closer(Hit {
                t: self.ray.to_outer_t(t),
                u,
                v,
                instance: self.instance,
                triangle: mesh.prim_id(prim_index),
            });
        }
    }

    /// The t up to which the scene is of interest.
    #[inline(always)]
    fn t_max(&self) -> f32 {
        if self.hit.t < self.world_ray.t_max {
            self.hit.t
        } else {
            self.world_ray.t_max
        }
    }

    /// One node.
    #[inline(always)]
    pub fn step_node<I: Isa, const ANY_HIT: bool>(&mut self) {
        let node = node(self.blocks, self.node);
        let (mask, enter) = intersect_children::<I>(node, &self.ray, self.best.t);
        self.node = if ANY_HIT {
            self.stack
                .push_children_or_pop::<I, false>(node, enter, mask)
        } else {
            self.stack
                .push_children_or_pop::<I, true>(node, enter, mask)
        };
        self.prefetch::<I>();
    }

    /// One leaf: which of its triangles may be met, or on to what is next. (Whether any may is anybody's guess too.)
    #[inline(always)]
    pub fn step_leaf<I: Isa>(&mut self) {
        self.candidates = edge_test::<I>(leaf(self.blocks, self.node), &self.ray);
        self.node = self.stack.pop_if(self.candidates == 0, self.node);
        self.prefetch::<I>();
    }

    /// The triangles of the leaf that may be met.
    #[inline(always)]
    pub fn step_triangles<I: Isa>(&mut self) {
        let leaf = leaf(self.blocks, self.node);
        if let Some(mesh) = self.mesh
            && self.best.update(mesh, leaf, self.candidates, &self.ray)
        {
            self.stack.cull(self.stack_base as usize, self.best.t);
            mesh.prefetch_prim_id::<I>(leaf.first_prim);
        }
        self.node = self.stack.pop_unchecked();
        self.prefetch::<I>();
    }

    /// One leaf, where any hit will do. (They come too early for [`RayState::step_leaf`] to pay.)
    #[inline(always)]
    pub fn step_leaf_any_hit<I: Isa>(&mut self) {
        let leaf = leaf(self.blocks, self.node);
        let candidates = edge_test::<I>(leaf, &self.ray);
        if any_hit(leaf, candidates, &self.ray, self.best.t) {
            self.hit.instance = self.instance;
            self.node = NodeRef::EMPTY;
            return;
        }
        self.node = self.stack.pop_unchecked();
        self.prefetch::<I>();
    }

    /// Into an instance or out of it; true once the ray is done.
    #[inline(always)]
    pub fn step_instance<const ANY_HIT: bool>(&mut self, scene: &'a Scene) -> bool {
        if ANY_HIT && self.hit.instance != INVALID_ID {
            return true;
        }
        if self.node != NodeRef::EMPTY {
            return self.enter_instance(scene);
        }
        if !self.single_instance {
            return self.leave_instance(scene);
        }
        self.commit_hit();
        true
    }

    /// Enters the part at hand, or goes on where the ray cannot; true once there is nothing left.
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

    /// The mesh is done: goes on above it. True once there is nothing left.
    #[inline(never)]
    fn leave_instance(&mut self, scene: &'a Scene) -> bool {
        self.commit_hit();
        if self.mesh.is_none() {
            return true;
        }
        self.mesh = None;
        self.stack_base = 1;
        // Only then do entries say where they are entered: those of any hits do not.
        if self.best.prim_index != NO_PRIM {
            self.stack.cull(1, scale_t(self.t_max(), self.tlas_t_scale));
        }
        self.pop_tlas(scene)
    }

    #[inline(always)]
    fn prefetch<I: Isa>(&self) {
        let at = self
            .blocks
            .as_ptr()
            .wrapping_add(self.node.index())
            .cast::<u8>();
        for line in 0..4 {
            I::prefetch(at.wrapping_add(64 * line));
        }
    }
}
