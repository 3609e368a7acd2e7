//! The scene: placed meshes, and the queries over them.

pub(crate) mod flattened;
pub(crate) mod rebraid;

use std::sync::Arc;

use crate::blas::{Bvh, scale_of};
use crate::build::{self, BuildItem, Leaves, TREELET};
use crate::error::BuildError;
use crate::node::{NodeBlock, LEAF, NO_CHILD};
use crate::platform::dispatch::{InstructionSet, Machine};
use crate::platform::huge_page_vec::Pages;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, Ray};
use crate::scene::flattened::{Members, Together};
use crate::scene::rebraid::{Part, Placement, box_of, parts};
use crate::traverse;
use crate::traverse::stream::backoff::Backoff;
use crate::traverse::trav_ray::{EPS, Extent};

/// A placed mesh: `world_from_mesh` maps mesh-local to scene-local coordinates, rows of a 3 x 4 matrix.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The mesh.
    pub bvh: Arc<Bvh>,
    /// Any invertible affine transform: rotation, scale, shear, mirror, translation.
    pub world_from_mesh: [[f32; 4]; 3],
}

/// Where [`Scene::closest_exact`] finds a triangle's corners in float64 world coordinates.
///
/// The mesh and transform given to [`Scene::build`] must be these rounded to float32: the search is padded for that
/// rounding and no more.
pub trait ExactTriangles {
    /// The three corners of a triangle of an instance.
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3];
}

/// A mesh in its place, as rays see it.
#[derive(Debug)]
pub(crate) struct Placed {
    pub bvh: Arc<Bvh>,
    /// From scaled scene coordinates to those of the mesh's tree.
    pub mesh_from_scene: [[f32; 4]; 3],
    /// Where it does no more than that, by how much it moves points.
    pub shift: Option<[f32; 3]>,
    /// How much longer it makes a vector at most.
    pub stretch: f32,
}

impl Placed {
    /// The placement has no pad yet. `bounds` is the mesh's box in the scene, `None` for an empty mesh.
    fn new(
        instance: Instance,
        bounds: Option<([f64; 3], [f64; 3])>,
        unit: f64,
    ) -> (Self, Option<Placement>) {
        let scale = f64::from(instance.bvh.scale());
        let forward = instance.world_from_mesh.map(|row| row.map(f64::from));
        let along = scale / unit;
        let usable = inverse(&forward)
            .map(|m| m.map(|r| [r[0] * along, r[1] * along, r[2] * along, r[3] * scale]))
            .map(|m| m.map(|row| row.map(|x| x as f32)))
            .filter(|m| m.iter().flatten().all(|x| x.is_finite()));
        // Row sums bound how far the largest coordinate grows.
        let stretch = usable.map_or(0.0, |m| norm(&m.map(|row| row.map(f64::from))));
        let placement = usable.and(bounds).map(|(lower, upper)| {
            let shrink = norm(&forward) * unit / scale;
            let mesh_reach = f64::from(instance.bvh.reach()) * shrink;
            let corners = lower.iter().chain(&upper);
            let farthest = corners.fold(0.0, |r: f64, x| r.max((x * unit).abs()));
            let back = unit / scale;
            Placement {
                bvh: instance.bvh.clone(),
                scene_from_mesh: forward
                    .map(|r| [r[0] * back, r[1] * back, r[2] * back, r[3] * unit]),
                reach: (mesh_reach + farthest) as f32,
                condition: (stretch * shrink) as f32,
                pad: 0.0,
            }
        });
        let mesh_from_scene = usable.unwrap_or([[0.0; 4]; 3]);
        let shift = mesh_from_scene.map(|row| row[3]);
        let placed = Self {
            bvh: instance.bvh,
            shift: (unit == 1.0 && mesh_from_scene == moved_by(shift)).then_some(shift),
            mesh_from_scene,
            stretch: stretch as f32,
        };
        (placed, placement)
    }
}

/// Placed meshes, ready to be traced. Scene-local coordinates are world coordinates less `origin`.
pub struct Scene {
    pub(crate) placed: Vec<Placed>,
    origin: [f64; 3],
    /// Scene coordinates are multiplied by this power of two before anything else; 1 for all but extreme scenes.
    pub(crate) unit: f64,
    /// What rays go into, one after the other.
    pub(crate) parts: Vec<Part>,
    /// Nodes over the parts.
    blocks: Pages<NodeBlock>,
    pub(crate) root: u32,
    /// Box of everything, scaled.
    pub(crate) extent: Extent,
    /// Largest coordinate at hand, scaled; with the condition of the worst transform it bounds rounding.
    pub(crate) reach: f32,
    pub(crate) condition: f32,
    /// The scene is one mesh, placed where it was made: rays need neither transform nor the nodes above.
    pub(crate) direct: bool,
    /// Whose the triangles of that mesh are, where it is several in one.
    pub(crate) members: Option<Members>,
    /// Of rays that run apart: packets of them, and asking them at the gate.
    pub(crate) packets: Backoff,
    pub(crate) gate: Backoff,
    /// Of packets of shadow rays that do not.
    pub(crate) shadows: Backoff,
    machine: Machine,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Scene of {} instances for {}",
            self.placed.len(),
            self.machine.isa().name()
        )
    }
}

/// The most instances of a scene.
const INSTANCE_LIMIT: usize = (1 << 31) - 2;

/// What moves points by a vector.
pub(crate) const fn moved_by([x, y, z]: [f32; 3]) -> [[f32; 4]; 3] {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}

impl Scene {
    /// Places meshes. An instance whose transform is singular is kept and never hit.
    pub fn build(instances: Vec<Instance>, origin: [f64; 3]) -> Result<Self, BuildError> {
        if instances.len() > INSTANCE_LIMIT {
            return Err(BuildError::TooLarge {
                what: "instances",
                given: instances.len(),
                limit: INSTANCE_LIMIT,
            });
        }
        let finite = |i: &Instance| i.world_from_mesh.iter().flatten().all(|x| x.is_finite());
        if let Some(at) = instances.iter().position(|i| !finite(i)) {
            return Err(BuildError::NotFinite {
                what: format!("instance {at}"),
            });
        }
        if !origin.iter().all(|x| x.is_finite()) {
            return Err(BuildError::NotFinite {
                what: "the scene's origin".into(),
            });
        }
        let direct = instances.len() == 1 && instances[0].world_from_mesh == moved_by([0.0; 3]);
        let boxes: Vec<_> = instances.iter().map(world_box).collect();
        let reach64 = boxes
            .iter()
            .flatten()
            .flat_map(|(l, u)| l.iter().chain(u))
            .fold(0.0, |r: f64, x| r.max(x.abs()));
        let unit = f64::from(if direct {
            instances[0].bvh.scale()
        } else {
            scale_of64(reach64)
        });
        let mut scene = Self {
            placed: Vec::with_capacity(instances.len()),
            parts: vec![],
            origin,
            unit,
            blocks: Pages::with_capacity(0),
            root: NO_CHILD,
            extent: Extent {
                lower: [0.0; 3],
                upper: [0.0; 3],
            },
            reach: 0.0,
            condition: 1.0,
            direct,
            members: None,
            packets: Backoff::default(),
            gate: Backoff::default(),
            shadows: Backoff::default(),
            machine: Machine::best(),
        };
        let mut placements: Vec<Option<Placement>> = Vec::with_capacity(instances.len());
        for (instance, bounds) in instances.into_iter().zip(boxes) {
            let (placed, placement) = Placed::new(instance, bounds, unit);
            if let Some(placement) = &placement {
                scene.condition = scene.condition.max(placement.condition);
                scene.reach = scene.reach.max(placement.reach);
            }
            scene.placed.push(placed);
            placements.push(placement);
        }
        for (placed, placement) in scene.placed.iter().zip(&mut placements) {
            if let (None, Some(placement)) = (placed.shift, placement) {
                placement.pad = f64::from(rounding_of(placement.condition) * 2.0 * scene.reach);
            }
        }
        if direct {
            scene.reach = scene.placed[0].bvh.reach();
        }
        scene.parts = parts(&placements);
        let items: Vec<_> = (0..)
            .zip(&scene.parts)
            .map(|(id, part)| part.item(id))
            .collect();
        let tree = build::build(scene.machine, items.as_slice(), &Singly);
        (scene.blocks, scene.root) = (tree.blocks, tree.root);
        scene.extent = Extent {
            lower: tree.lower,
            upper: tree.upper,
        };
        Ok(scene)
    }

    /// The world coordinates of the scene-local origin.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Whether it is one tree, in which rays need no transform.
    pub fn is_one_tree(&self) -> bool {
        self.direct
    }

    /// The instruction set that queries run with.
    pub fn instruction_set(&self) -> InstructionSet {
        self.machine.isa()
    }

    /// Makes queries run with a certain instruction set; false, and nothing changes, where the machine lacks it.
    /// The answers are the same.
    pub fn set_instruction_set(&mut self, isa: InstructionSet) -> bool {
        let machine = Machine::with(isa);
        self.machine = machine.unwrap_or(self.machine);
        machine.is_some()
    }

    /// The nearest hit of every ray, on the calling thread. `hits` is as long as `rays`.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        traverse::closest(self.machine, self, rays, hits, coherence);
        if let Some(members) = &self.members {
            members.name(
                hits.iter_mut()
                    .map(|hit| (&mut hit.instance, &mut hit.triangle)),
            );
        }
    }

    /// Whether anything lies on each ray, on the calling thread. `dark` is as long as `rays`.
    pub fn occluded(&self, rays: &[Ray], dark: &mut [bool], coherence: Coherence) {
        assert_eq!(rays.len(), dark.len(), "as many answers as rays");
        traverse::occluded(self.machine, self, rays, dark, coherence);
    }

    /// The nearest hit of every ray by float64 arithmetic on the float64 corners: ties and edges are decided as exact
    /// geometry decides them, up to float64 rounding. On the calling thread; `hits` is as long as `rays`.
    pub fn closest_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        hits: &mut [ExactHit],
    ) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        match &self.members {
            None => traverse::closest_exact(self.machine, self, rays, triangles, hits),
            Some(members) => {
                let all = Together(members, triangles);
                traverse::closest_exact(self.machine, self, rays, &all, hits);
                members.name(
                    hits.iter_mut()
                        .map(|hit| (&mut hit.instance, &mut hit.triangle)),
                );
            }
        }
    }

    /// The nodes above the parts.
    pub(crate) fn blocks(&self) -> &[NodeBlock] {
        &self.blocks
    }

    /// By how much boxes of instances must be padded for a ray that starts within `distance` of the scene's origin:
    /// a transformed ray is off by no more.
    #[inline(always)]
    pub(crate) fn slack(&self, distance: f32) -> f32 {
        self.rounding(false) * (distance + self.reach)
    }

    /// Whether a ray of float32 that starts here needs boxes to be padded for little.
    #[inline(always)]
    pub(crate) fn is_within(&self, [x, y, z]: [f32; 3]) -> bool {
        x.abs().max(y.abs()).max(z.abs()) <= self.reach
    }

    /// The slack as a part of the largest coordinate at hand. For a ray of float32 that starts within the scene's reach,
    /// boxes of instances that are more than moved have their pads already, and for others one sum is rounded.
    #[inline(always)]
    pub(crate) fn rounding(&self, within: bool) -> f32 {
        if within {
            2.0 * EPS
        } else {
            rounding_of(self.condition)
        }
    }
}

/// What a transform with a condition may do to a ray, as a part of the largest coordinate at hand.
fn rounding_of(condition: f32) -> f32 {
    (64.0 * condition + 24.0) * EPS
}

/// Leaves of the tree over parts: their number.
struct Singly;

impl Leaves for Singly {
    const IN_BLOCKS: bool = false;
    const USUAL: usize = 1;
    type Notes = ();

    fn enter(&self, items: &mut [BuildItem], _notes: &mut ()) -> usize {
        items.len()
    }

    fn fit(&self, items: &[BuildItem], _notes: &mut ()) -> bool {
        items.len() == 1
    }

    fn binary_leaf(&self) -> usize {
        1
    }

    fn bins(&self, items: usize) -> usize {
        if items > TREELET { 64 } else { 16 }
    }

    fn emit(
        &self,
        items: &[BuildItem],
        _notes: &mut (),
        _ids: &mut Vec<u32>,
        _blocks: &mut Vec<NodeBlock>,
    ) -> u32 {
        LEAF | items[0].id
    }
}

fn scale_of64(reach: f64) -> f32 {
    scale_of((reach as f32).min(f32::MAX))
}

/// The largest sum of the absolute values of a row of the linear part.
fn norm(m: &[[f64; 4]; 3]) -> f64 {
    m.iter()
        .map(|r| r[0].abs() + r[1].abs() + r[2].abs())
        .fold(0.0, f64::max)
}

/// The box of an instance in the scene; `None` for an empty mesh.
fn world_box(instance: &Instance) -> Option<([f64; 3], [f64; 3])> {
    if instance.bvh.triangle_count() == 0 {
        return None;
    }
    let scale = f64::from(instance.bvh.scale());
    let m = instance.world_from_mesh.map(|row| row.map(f64::from));
    let m = m.map(|r| [r[0] / scale, r[1] / scale, r[2] / scale, r[3]]);
    Some(box_of(&m, instance.bvh.extent()))
}

/// The inverse of an affine map; `None` where it is singular.
fn inverse(m: &[[f64; 4]; 3]) -> Option<[[f64; 4]; 3]> {
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum::<f64>();
    if det == 0.0 {
        return None;
    }
    let mut inverse = [[0.0; 4]; 3];
    for (r, row) in inverse.iter_mut().enumerate() {
        for c in 0..3 {
            row[c] = cofactor(c, r) / det;
        }
        row[3] = -(0..3).map(|c| row[c] * m[c][3]).sum::<f64>();
    }
    Some(inverse)
}
