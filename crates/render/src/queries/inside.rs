//! Tests whether points are inside objects.

use std::ops::Range;

use glam::DVec3;
use raycam_bvh::ExactRay;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::one_instance::OneInstance;
use crate::prepare::world::PreparedWorld;
use crate::queries::tasks::{NS_PER_ALL_HITS_RAY, in_tasks};
use crate::queries::winding::{chosen_objects, half_line, residual_edges, winding_numbers};

/// Relative rounding error of a placed vertex. It is multiplied by the largest coordinates of the object's box and of
/// the object's position.
const BOX_ERROR: f64 = 32.0 * f64::EPSILON;

/// Rule that decides from an object's crossings whether a point is inside.
#[derive(Clone, Copy, PartialEq)]
enum Rule {
    /// For closed, oriented meshes: a point is inside if its signed crossings are not 0.
    Signed,
    /// For closed meshes with mixed windings: a point is inside if its number of crossings is odd.
    Parity,
    /// For open meshes: a point is inside if its absolute winding number is at least 1/2.
    Winding,
}

/// Selected object, with the data for testing points.
struct Body {
    instance: usize,
    rule: Rule,
    /// Box that contains all vertices of the object.
    bounds: [DVec3; 2],
    edges: Vec<([DVec3; 2], f64)>,
}

/// Selected objects, for testing whether points are inside.
pub(super) struct Bodies<'a> {
    geometry: &'a Geometry,
    bodies: Vec<Body>,
}

impl<'a> Bodies<'a> {
    pub fn new(geometry: &'a Geometry, objects: Option<&[bool]>) -> Result<Self, RenderError> {
        let body = |instance: usize| {
            let object = &geometry.instances[instance];
            let surface = object.mesh.surface();
            let rule = match (surface.is_closed, surface.is_oriented) {
                (true, true) => Rule::Signed,
                (true, false) => Rule::Parity,
                _ => Rule::Winding,
            };
            let [lower, upper] = object.bounds();
            let pad = BOX_ERROR * (lower.abs().max(upper.abs()) + object.world_from_mesh.translation.abs());
            let edges = if rule == Rule::Winding { residual_edges(geometry, instance) } else { vec![] };
            Body { instance, rule, bounds: [lower - pad, upper + pad], edges }
        };
        let bodies = chosen_objects(geometry, objects)?.into_iter().map(body).collect();
        Ok(Self { geometry, bodies })
    }

    /// Estimated time per point, in nanoseconds; infinite if any object requires winding numbers.
    fn work_of_point(&self) -> f64 {
        let sums = self.bodies.iter().any(|body| body.rule == Rule::Winding);
        if sums { f64::INFINITY } else { NS_PER_ALL_HITS_RAY * self.bodies.len() as f64 }
    }

    /// For each point, true if it is inside any of the objects.
    pub fn contain(&self, points: &[[f64; 3]]) -> Vec<bool> {
        let mut inside = vec![false; points.len()];
        for body in &self.bodies {
            let may_hold = |i: &usize| {
                let point = DVec3::from(points[*i]);
                let within = point.cmpge(body.bounds[0]).all() && point.cmple(body.bounds[1]).all();
                !inside[*i] && point.is_finite() && (within || body.rule == Rule::Winding)
            };
            let near: Vec<usize> = (0..points.len()).filter(may_hold).collect();
            if near.is_empty() {
                continue;
            }
            let candidates: Vec<[f64; 3]> = near.iter().map(|&i| points[i]).collect();
            for (i, is_inside) in near.into_iter().zip(self.body_contains(body, &candidates)) {
                inside[i] = is_inside;
            }
        }
        inside
    }

    fn body_contains(&self, body: &Body, points: &[[f64; 3]]) -> Vec<bool> {
        let geometry = self.geometry;
        if body.rule == Rule::Winding {
            let numbers = winding_numbers(geometry, body.instance, &body.edges, points);
            return numbers.into_iter().map(|number| number.abs() >= 0.5).collect();
        }
        let rays: Vec<ExactRay> =
            points.iter().map(|point| half_line(*point, way_out((*point).into(), body.bounds))).collect();
        let mut counts = vec![0; rays.len()];
        let filter = OneInstance(body.instance as u32);
        geometry.two_level().count_crossings(&rays, geometry, Some(&filter), body.rule == Rule::Signed, &mut counts);
        let is_inside = |count: i32| if body.rule == Rule::Signed { count != 0 } else { count % 2 != 0 };
        counts.into_iter().map(is_inside).collect()
    }
}

/// Axis direction in which a ray from the point leaves the box after the shortest distance. The direction affects only
/// the speed, not the result.
fn way_out(point: DVec3, [lower, upper]: [DVec3; 2]) -> DVec3 {
    let (down, up) = (point - lower, upper - point);
    let axis = down.min(up).min_position();
    let sign = if down[axis] < up[axis] { -1.0 } else { 1.0 };
    DVec3::AXES[axis] * sign
}

/// True for each point inside any of the selected objects. A point on a surface is treated as if it were shifted by an
/// infinitesimal vector, so a box contains points with `lower <= point < upper`.
///
/// The result is exact for closed meshes, for any orientation of their triangles. Open meshes contain the points whose
/// absolute winding number is at least 1/2.
///
/// # Errors
/// [`RenderError::Cancelled`], and errors of `crate::thread_pool::with_pool`.
pub fn inside(
    world: &PreparedWorld,
    points: &[[f64; 3]],
    objects: Option<&[bool]>,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    let bodies = Bodies::new(&world.geometry, objects)?;
    world.geometry.note_rays(points.len() as u64);
    let mut found = Vec::with_capacity(points.len());
    let work = |range: Range<usize>| bodies.contain(&points[range]);
    in_tasks((points.len(), bodies.work_of_point()), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}
