//! Prepared meshes: BVHs that are built once, and refitted while only the vertices move.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use glam::{DMat3, DVec3};
use raycam_bvh::Bvh;
use raycam_scene::mesh::surface::{PointTriangles, SurfaceTopology};
use raycam_scene::{Mesh, World};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::memory::check_memory;
use crate::prepare::family::{BuiltPart, SharedParts};
use crate::prepare::watertight::is_watertight;
use crate::thread_pool::in_pool;

/// A mesh and its BVH; the BVH's float32 vertices are relative to `center`.
#[derive(Debug)]
pub(crate) struct PreparedMesh {
    pub mesh: Arc<Mesh>,
    pub bvh: Arc<Bvh>,
    pub lower: DVec3,
    pub upper: DVec3,
    pub center: DVec3,
    /// BVHs of the mesh after a linear map, kept while an instance uses them.
    stretched: Mutex<Vec<(DMat3, Weak<Bvh>)>>,
    /// Result of [`is_watertight`], computed on demand.
    is_closed: OnceLock<bool>,
    /// Topology of the mesh's surface, computed on demand.
    surface: OnceLock<SurfaceTopology>,
    /// Triangles around each point, computed on demand.
    point_triangles: OnceLock<PointTriangles>,
    /// SAH cost of the BVH when it was built.
    built_cost: f64,
}

/// Memory per triangle while a BVH is built, in bytes, including a margin.
const BUILD_BYTES: u64 = 200;
/// Maximum SAH cost of a refitted BVH relative to its cost when it was built; above this ratio, the BVH is rebuilt.
const MAX_REFIT_COST_RATIO: f64 = 1.5;

/// Prepared meshes of a world by index, and the indices of the meshes that are not prepared yet.
#[derive(Debug)]
pub(crate) struct MeshList {
    known: Vec<Option<Arc<PreparedMesh>>>,
    missing: Vec<usize>,
}

impl MeshList {
    /// Lists the meshes of a world's objects: the meshes that `parts` contains, and the indices of the missing meshes.
    pub fn new(world: &World, parts: &SharedParts<PreparedMesh>) -> Self {
        let mut known: Vec<Option<Arc<PreparedMesh>>> = vec![None; world.meshes.len()];
        let mut missing = vec![];
        for object in &world.objects {
            let index = object.mesh;
            if known[index].is_none() {
                known[index] = parts.built_of(&world.meshes[index]);
                if known[index].is_none() {
                    missing.push(index);
                }
            }
        }
        missing.sort_unstable();
        missing.dedup();
        Self { known, missing }
    }

    /// True if no mesh needs to be built.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }
}

/// Prepares every mesh that an object shows, by its index in the world; builds the meshes missing in `list`.
/// `previous` contains the meshes of the previous world's instances, in order; these meshes, or other meshes
/// of `parts`, are refitted if only vertices moved.
pub(crate) fn prepare_meshes(
    world: &World,
    list: MeshList,
    previous: &[&Arc<PreparedMesh>],
    parts: &SharedParts<PreparedMesh>,
    control: &Control,
) -> Result<Vec<Option<Arc<PreparedMesh>>>, RenderError> {
    let MeshList { known: mut meshes, missing } = list;
    control.start(missing.len());
    if missing.is_empty() {
        return Ok(meshes);
    }
    // The previous mesh of the object with the same index is refitted if only its vertices moved.
    let mut before = HashMap::new();
    for (object, &previous) in world.objects.iter().zip(previous) {
        before.entry(object.mesh).or_insert(&**previous);
    }
    let built: Vec<_> = missing
        .into_par_iter()
        .map(|index| {
            control.check()?;
            let mesh = &world.meshes[index];
            let moved = before.get(&index).and_then(|before| before.refit(mesh));
            let moved = moved
                .or_else(|| parts.find_part(|known| known.has_size_of(mesh)).and_then(|before| before.refit(mesh)));
            let mesh = match moved {
                Some(moved) => moved,
                None => PreparedMesh::build(index, mesh.clone())?,
            };
            control.advance();
            Ok((index, Arc::new(mesh)))
        })
        .collect::<Result<_, RenderError>>()?;
    for (index, mesh) in built {
        meshes[index] = Some(mesh);
    }
    Ok(meshes)
}

impl PreparedMesh {
    fn build(index: usize, mesh: Arc<Mesh>) -> Result<Self, RenderError> {
        mesh.validate().map_err(|error| RenderError::world(format!("mesh {index}: {error}")))?;
        let (lower, upper) = mesh.bounds().unwrap_or_default();
        let center = rounded_center(lower, upper);
        let bvh = build_bvh(index, &mesh, center, DMat3::IDENTITY)?;
        Ok(Self::new(mesh, bvh.sah_cost(), bvh, [lower, upper, center]))
    }

    fn new(mesh: Arc<Mesh>, built_cost: f64, bvh: Bvh, [lower, upper, center]: [DVec3; 3]) -> Self {
        Self {
            mesh,
            built_cost,
            bvh: Arc::new(bvh),
            lower,
            upper,
            center,
            stretched: Mutex::default(),
            is_closed: OnceLock::new(),
            surface: OnceLock::new(),
            point_triangles: OnceLock::new(),
        }
    }

    /// BVH of the mesh around its centre, after a linear map; `index` is used for errors. The BVH is refitted outside
    /// the lock, so that threads do not wait. Refitting does not slow rays down if all boxes are squeezed equally.
    pub fn stretched_bvh(&self, index: usize, stretch: DMat3) -> Result<Arc<Bvh>, RenderError> {
        let known = || self.stretched.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known().iter().find(|(own, _)| *own == stretch).and_then(|(_, bvh)| bvh.upgrade());
        if let Some(found) = found {
            return Ok(found);
        }
        let stretched = || {
            check_build_memory(index, &self.mesh)?;
            let mut bvh = Bvh::clone(&self.bvh);
            let vertices = local_vertices(&self.mesh, self.center, stretch);
            let is_refitted = bvh.refit(&vertices, &self.mesh.triangles).is_ok();
            if is_refitted { Ok(bvh) } else { build_bvh(index, &self.mesh, self.center, stretch) }
        };
        let bvh = Arc::new(in_pool(stretched)??);
        let mut known = known();
        known.retain(|(own, bvh)| *own != stretch && bvh.strong_count() > 0);
        known.push((stretch, Arc::downgrade(&bvh)));
        Ok(bvh)
    }

    /// Result of [`is_watertight`]. Computed before the cell is locked, so that threads do not wait for it.
    pub fn is_watertight(&self) -> bool {
        let known = self.is_closed.get().copied();
        let body = known.unwrap_or_else(|| is_watertight(&self.mesh));
        *self.is_closed.get_or_init(|| body)
    }

    /// True if `mesh` has the same number of vertices and triangles, so that it may be a deformed version of this mesh.
    fn has_size_of(&self, mesh: &Mesh) -> bool {
        (self.mesh.vertices.len(), self.mesh.triangles.len()) == (mesh.vertices.len(), mesh.triangles.len())
    }

    /// Topology of the mesh. Computed before the cell is locked, so that threads do not wait for it.
    pub fn surface(&self) -> &SurfaceTopology {
        let known = self.surface.get().is_some();
        let found = if known { SurfaceTopology::default() } else { SurfaceTopology::new(&self.mesh) };
        self.surface.get_or_init(|| found)
    }

    /// Triangles around each point of the mesh, computed like [`PreparedMesh::surface`].
    pub fn point_triangles(&self) -> &PointTriangles {
        let known = self.point_triangles.get().is_some();
        let found = if known { PointTriangles::default() } else { PointTriangles::new(&self.mesh) };
        self.point_triangles.get_or_init(|| found)
    }

    /// The same mesh with moved vertices and a refitted BVH; `None` if a rebuild is required.
    fn refit(&self, mesh: &Arc<Mesh>) -> Option<Self> {
        let before = &*self.mesh;
        let same = before.vertices.len() == mesh.vertices.len()
            && before.triangles == mesh.triangles
            && mesh.validate().is_ok();
        let (lower, upper) = mesh.bounds().filter(|_| same)?;
        let center = rounded_center(lower, upper);
        let mut bvh = Bvh::clone(&self.bvh);
        bvh.refit(&local_vertices(mesh, center, DMat3::IDENTITY), &mesh.triangles).ok()?;
        (bvh.sah_cost() <= MAX_REFIT_COST_RATIO * self.built_cost)
            .then(|| Self::new(mesh.clone(), self.built_cost, bvh, [lower, upper, center]))
    }
}

impl BuiltPart for PreparedMesh {
    type Input = Mesh;

    fn input(&self) -> &Arc<Mesh> {
        &self.mesh
    }
}

/// Centre of a box, rounded to an eighth of the power of two above its radius. The centre therefore stays constant
/// while the contents of the box move little, and float32 coordinates lose only an eighth of a bit.
pub(crate) fn rounded_center(lower: DVec3, upper: DVec3) -> DVec3 {
    let half = (upper - lower) / 2.0;
    let center = lower + half;
    let step = half.length().log2().ceil().exp2() / 8.0;
    let rounded = (center / step).round() * step;
    // The exact centre is used for a mesh without extent, whose step is 0, and for positions so distant that the step
    // is not finite.
    if step > 0.0 && rounded.is_finite() { rounded } else { center }
}

/// BVH of a mesh around `center`, after a linear map.
fn build_bvh(index: usize, mesh: &Mesh, center: DVec3, stretch: DMat3) -> Result<Bvh, RenderError> {
    check_build_memory(index, mesh)?;
    let vertices = local_vertices(mesh, center, stretch);
    Bvh::build(&vertices, &mesh.triangles).map_err(|source| RenderError::Build { mesh: index, source })
}

/// Checks that there is enough memory for the BVH of a mesh.
fn check_build_memory(index: usize, mesh: &Mesh) -> Result<(), RenderError> {
    let bytes = BUILD_BYTES * mesh.triangles.len() as u64 + 12 * mesh.vertices.len() as u64;
    check_memory(|| format!("the tree of mesh {index} ({} triangles)", mesh.triangles.len()), bytes)
}

/// Float32 vertices relative to `center`, after a linear map.
fn local_vertices(mesh: &Mesh, center: DVec3, stretch: DMat3) -> Vec<[f32; 3]> {
    let vertices = mesh.vertices.par_iter().with_min_len(1 << 14);
    vertices.map(|&vertex| (stretch * (vertex - center)).as_vec3().to_array()).collect()
}
