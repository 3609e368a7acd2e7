//! A ray on its way, a step at a time.

use crate::blas::Bvh;
use crate::node::{NodeBlock, LEAF, NO_CHILD, leaf, node};
use crate::ray::{Hit, NOTHING, Ray};
use crate::scene::Scene;
use crate::simd::Isa;
use crate::traverse::node_test::{Best, NO_SLOT, any, enter_children, transform};
use crate::traverse::single::interleaved::Work;
use crate::traverse::stack::Stack;
use crate::traverse::trav_ray::{LocalRay, times};
use crate::traverse::triangle::single::within;

/// Where it is, and what it met.
#[repr(C, align(64))]
pub struct Slot<'a> {
    /// In the coordinates of the tree that `blocks` belong to.
    ray: LocalRay,
    blocks: &'a [NodeBlock],
    /// The node, leaf or instance that is next.
    pub at: u32,
    /// Entries below belong to the tree over instances.
    base: u32,
    best: Best,
    /// Of the leaf at hand: triangles within whose edges the ray runs. They wait for the ray's next turn, when it is
    /// known for sure whether there are any, and no work is begun in vain.
    pub near: u32,
    /// The mesh that is being traced; `None` above the instances.
    pub mesh: Option<&'a Bvh>,
    instance: u32,
    /// The instance in whose coordinates `ray` is, or [`NOTHING`].
    inside: u32,
    /// Nothing but that instance is to be traced.
    lone: bool,
    /// `ray` runs in the given direction, and along every axis: another origin makes it that of another mesh in the place
    /// where it was made, or moved from there.
    slanted: bool,
    /// t along the ray in the tree over instances is so many times that of the one given.
    outer_scale: f64,
    pub number: usize,
    pub hit: Hit,
    given: Ray,
    stack: Stack,
}

// An odd number of lines: the same fields of all slots lie in different sets of the nearest cache.
const _: () = assert!(size_of::<Slot>() / 64 % 2 == 1);

impl<'a> Slot<'a> {
    #[inline(always)]
    pub fn idle() -> Self {
        Self {
            ray: LocalRay::NONE,
            blocks: &[],
            at: NO_CHILD,
            base: 0,
            best: Best::nothing(0.0),
            near: 0,
            mesh: None,
            instance: 0,
            inside: NOTHING,
            lone: false,
            slanted: false,
            outer_scale: 1.0,
            number: 0,
            hit: Hit::MISS,
            given: Ray {
                origin: [0.0; 3],
                direction: [0.0; 3],
                t_max: 0.0,
            },
            stack: Stack::new(),
        }
    }

    /// Starts a ray; false if it meets nothing by definition.
    #[inline(always)]
    pub fn start(&mut self, scene: &'a Scene, work: Work) -> bool {
        let Work {
            ray: given,
            number,
            start,
            instance,
        } = work;
        self.hit = Hit::MISS;
        self.number = number;
        self.given = given;
        self.near = 0;
        self.stack.len = 0;
        self.stack.floor();
        self.base = 1;
        if scene.root == NO_CHILD || given.t_max.is_nan() || given.t_max < 0.0 {
            return false;
        }
        self.lone = scene.direct || start != NO_CHILD;
        self.slanted = false;
        self.inside = NOTHING;
        if self.lone {
            let entered = if scene.direct {
                self.enter::<true>(scene, 0, given.t_max)
            } else {
                self.enter::<false>(scene, instance, given.t_max)
            };
            self.at = if start == NO_CHILD { self.at } else { start };
            return entered;
        }
        self.at = scene.root;
        self.leave(scene, given.t_max)
    }

    /// Goes above the instances.
    #[inline(always)]
    fn leave(&mut self, scene: &'a Scene, t_max: f32) -> bool {
        if !scene.aim(&mut self.ray, &self.given) {
            return false;
        }
        self.best = Best::nothing(self.ray.inner_t(t_max));
        self.outer_scale = self.ray.t_scale;
        self.slanted = self.ray.is_slanted();
        self.blocks = scene.blocks();
        self.inside = NOTHING;
        self.mesh = None;
        true
    }

    /// What is left above the instances: most often another one or nothing, and for neither is the ray needed in the
    /// coordinates of their tree. True once there is nothing.
    #[inline(always)]
    fn go_on(&mut self, scene: &'a Scene) -> bool {
        self.at = self.stack.next();
        if self.at & LEAF == 0 {
            return !self.leave(scene, self.t_max());
        }
        self.at == NO_CHILD
    }

    /// Goes into an instance.
    #[inline(always)]
    fn enter<const DIRECT: bool>(&mut self, scene: &'a Scene, instance: u32, t_max: f32) -> bool {
        let placed = &scene.placed[instance as usize];
        let mesh = &*placed.bvh;
        // Another part of the mesh it was in last may be next.
        if DIRECT || self.inside != instance {
            let runs = if DIRECT {
                scene.aim(&mut self.ray, &self.given)
            } else if let (Some([x, y, z]), true) = (placed.shift, self.slanted) {
                let [a, b, c] = self.given.origin;
                self.ray.shift([a + x, b + y, c + z], mesh.extent())
            } else {
                self.slanted = false;
                transform(&mut self.ray, scene, placed, &self.given)
            };
            if !runs {
                return false;
            }
            self.inside = instance;
        }
        self.best = Best::nothing(self.ray.inner_t(t_max));
        self.blocks = mesh.blocks();
        self.mesh = Some(mesh);
        self.instance = instance;
        self.at = mesh.root();
        true
    }

    /// Takes over what the instance had.
    #[inline(always)]
    fn conclude(&mut self) {
        if let (Some(mesh), true) = (self.mesh, self.best.slot != NO_SLOT) {
            let Best { t, u, v, slot } = self.best;
            self.hit.take(Hit {
                t: self.ray.outer_t(t),
                u,
                v,
                instance: self.instance,
                triangle: mesh.id(slot),
            });
        }
    }

    /// The t up to which the scene is of interest.
    #[inline(always)]
    fn t_max(&self) -> f32 {
        if self.hit.t < self.given.t_max {
            self.hit.t
        } else {
            self.given.t_max
        }
    }

    /// One node.
    #[inline(always)]
    pub fn step_node<I: Isa, const ANY: bool>(&mut self) {
        let node = node(self.blocks, self.at);
        let (mask, enter) = enter_children::<I>(node, &self.ray, self.best.t);
        self.at = if ANY {
            self.stack.exchange::<I, false>(node, enter, mask)
        } else {
            self.stack.exchange::<I, true>(node, enter, mask)
        };
        self.prefetch::<I>();
    }

    /// One leaf: which of its triangles may be met, or on to what is next. (Whether any may is anybody's guess too.)
    #[inline(always)]
    pub fn step_leaf<I: Isa>(&mut self) {
        self.near = within::<I>(leaf(self.blocks, self.at), &self.ray);
        self.at = self.stack.next_if(self.near == 0, self.at);
        self.prefetch::<I>();
    }

    /// The triangles of the leaf that may be met.
    #[inline(always)]
    pub fn step_near<I: Isa>(&mut self) {
        let leaf = leaf(self.blocks, self.at);
        if let Some(mesh) = self.mesh
            && self.best.take(mesh, leaf, self.near, &self.ray)
        {
            self.stack.cut(self.base as usize, self.best.t);
            mesh.prefetch_id::<I>(leaf.first);
        }
        self.at = self.stack.next();
        self.prefetch::<I>();
    }

    /// One leaf, where any hit will do. (They come too early for [`Slot::step_leaf`] to pay.)
    #[inline(always)]
    pub fn step_any<I: Isa>(&mut self) {
        let leaf = leaf(self.blocks, self.at);
        let near = within::<I>(leaf, &self.ray);
        if any(leaf, near, &self.ray, self.best.t) {
            self.hit.instance = self.instance;
            self.at = NO_CHILD;
            return;
        }
        self.at = self.stack.next();
        self.prefetch::<I>();
    }

    /// Into an instance or out of it; true once the ray is done.
    #[inline(always)]
    pub fn step_instance<const ANY: bool>(&mut self, scene: &'a Scene) -> bool {
        if ANY && self.hit.instance != NOTHING {
            return true;
        }
        if self.at != NO_CHILD {
            return self.enter_instance(scene);
        }
        if !self.lone {
            return self.leave_instance(scene);
        }
        self.conclude();
        true
    }

    /// Enters the part at hand, or goes on where the ray cannot; true once there is nothing left.
    #[inline(never)]
    fn enter_instance(&mut self, scene: &'a Scene) -> bool {
        let t_max = self.t_max();
        let part = &scene.parts[(self.at & !LEAF) as usize];
        if self.enter::<false>(scene, part.instance, t_max) {
            self.at = part.start;
            self.stack.floor();
            self.base = self.stack.len as u32;
            return false;
        }
        self.go_on(scene)
    }

    /// The mesh is done: goes on above it. True once there is nothing left.
    #[inline(never)]
    fn leave_instance(&mut self, scene: &'a Scene) -> bool {
        self.conclude();
        if self.mesh.is_none() {
            return true;
        }
        self.mesh = None;
        self.base = 1;
        // Only then do entries say where they are entered: those of any hits do not.
        if self.best.slot != NO_SLOT {
            self.stack.cut(1, times(self.t_max(), self.outer_scale));
        }
        self.go_on(scene)
    }

    #[inline(always)]
    fn prefetch<I: Isa>(&self) {
        let at = self
            .blocks
            .as_ptr()
            .wrapping_add((self.at & !LEAF) as usize)
            .cast::<u8>();
        for line in 0..4 {
            I::prefetch(at.wrapping_add(64 * line));
        }
    }
}
