//! Meshes and the scene that places them.

use std::sync::Arc;

use crate::ray::{Coherence, ExactHit, ExactRay, Hit, Ray};

/// How much time a build may take for faster rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// For geometry that changes every frame.
    Fast,
    /// Binned surface-area heuristic.
    #[default]
    Default,
    /// For geometry that is traced very often.
    High,
}

/// How a mesh is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// Time against speed.
    pub quality: Quality,
}

/// Why a mesh or a scene could not be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BuildError {
    /// A triangle names a vertex that is not there.
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The index it gives.
        index: u32,
        /// The vertices there are.
        vertices: usize,
    },
    /// A vertex or a transform is NaN or infinite.
    NotFinite {
        /// `vertex 12` or `instance 3`.
        what: String,
    },
    /// More triangles or instances than 32-bit indices hold.
    TooLarge {
        /// `triangles` or `instances`.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many there may be.
        limit: usize,
    },
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::IndexOutOfRange { triangle, index, vertices } => {
                write!(f, "triangle {triangle} names vertex {index}, but there are {vertices} vertices")
            }
            Self::NotFinite { what } => write!(f, "{what} is NaN or infinite"),
            Self::TooLarge { what, given, limit } => write!(f, "{given} {what} given, at most {limit} fit"),
        }
    }
}

impl std::error::Error for BuildError {}

/// One mesh, ready to be traced: mesh-local float32 coordinates.
#[derive(Debug)]
pub struct Bvh {
    corners: Vec<[[f32; 3]; 3]>,
}

impl Bvh {
    /// Builds over indexed triangles. Zero-area triangles are kept and never hit.
    ///
    /// Runs in parallel on the rayon pool it is called in; the result does not depend on that pool.
    pub fn build(
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        _options: &BuildOptions,
    ) -> Result<Self, BuildError> {
        let corners = triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
        Ok(Self { corners })
    }

    /// How many triangles the mesh has.
    pub fn triangle_count(&self) -> usize {
        self.corners.len()
    }
}

/// A placed mesh: `world_from_mesh` maps mesh-local to scene-local coordinates, rows of a 3 x 4 matrix.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The mesh.
    pub bvh: Arc<Bvh>,
    /// Any invertible affine transform: rotation, scale, shear, mirror, translation.
    pub world_from_mesh: [[f32; 4]; 3],
}

/// Where [`Scene::closest_exact`] finds a triangle's corners in float64 world coordinates.
pub trait ExactTriangles {
    /// The three corners of a triangle of an instance.
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3];
}

/// Placed meshes, ready to be traced. Scene-local coordinates are world coordinates less `origin`.
#[derive(Debug)]
pub struct Scene {
    instances: Vec<Instance>,
    origin: [f64; 3],
}

impl Scene {
    /// Places meshes. An instance whose transform is singular is kept and never hit.
    pub fn build(instances: Vec<Instance>, origin: [f64; 3]) -> Result<Self, BuildError> {
        Ok(Self { instances, origin })
    }

    /// The world coordinates of the scene-local origin.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// The nearest hit of every ray, on the calling thread. `hits` is as long as `rays`.
    pub fn closest(&self, _rays: &[Ray], _hits: &mut [Hit], _coherence: Coherence) {
        unimplemented!("placeholder until the kernel lands")
    }

    /// Whether anything lies on each ray, on the calling thread. `dark` is as long as `rays`.
    pub fn occluded(&self, _rays: &[Ray], _dark: &mut [bool], _coherence: Coherence) {
        unimplemented!("placeholder until the kernel lands")
    }

    /// The nearest hit of every ray by float64 arithmetic on the float64 corners: ties and edges are decided as exact
    /// geometry decides them, up to float64 rounding.
    pub fn closest_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        hits: &mut [ExactHit],
    ) {
        // Brute force: the placeholder of the traversal that lands with the kernel.
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = ExactHit::MISS;
            for (i, instance) in self.instances.iter().enumerate() {
                for t in 0..instance.bvh.corners.len() {
                    let found = intersect(ray, triangles.corners(i as u32, t as u32));
                    if let Some((t_hit, u, v)) = found
                        && t_hit < hit.t
                        && t_hit <= ray.t_max
                    {
                        *hit = ExactHit { t: t_hit, u, v, instance: i as u32, triangle: t as u32 };
                    }
                }
            }
        }
    }
}

fn intersect(ray: &ExactRay, [a, b, c]: [[f64; 3]; 3]) -> Option<(f64, f64, f64)> {
    let sub = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (e1, e2, s) = (sub(b, a), sub(c, a), sub(ray.origin, a));
    let p = cross(ray.direction, e2);
    let det = dot(e1, p);
    let q = cross(s, e1);
    let (u, v, t) = (dot(s, p) / det, dot(ray.direction, q) / det, dot(e2, q) / det);
    (det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some((t, u, v))
}
