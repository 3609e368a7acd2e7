//! Visibility between pairs of points.

use std::ops::Range;

use raycam_bvh::{ExactHit, ExactRay, ExactTriangles, HitFilter, squared_distance_to_triangle};

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::selection::{Selection, SelectionFilter};
use crate::queries::tasks::{NS_PER_RAY, in_tasks};

/// Pairs of points, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct PointPairs<'a> {
    /// First points.
    pub from: &'a [[f64; 3]],
    /// The second points, one per first point.
    pub to: &'a [[f64; 3]],
    /// Triangles within this distance of either point do not count.
    pub margin: f64,
    /// The surfaces that can hide a point.
    pub selection: Selection<'a>,
}

/// True for each pair of points without a closed triangle between them. The result is symmetric.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or the margin is negative, [`RenderError::Cancelled`], and
/// errors of [`crate::thread_pool::with_pool`].
pub fn visible(
    world: &PreparedWorld,
    pairs: &PointPairs,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    let (n, other) = (pairs.from.len(), pairs.to.len());
    if n != other {
        return Err(RenderError::settings(format!(
            "{n} first points and {other} second points; expected equal numbers"
        )));
    }
    // False for a margin of NaN.
    let is_valid = pairs.margin >= 0.0;
    if !is_valid {
        return Err(RenderError::settings(format!("margin is {}; expected a number of at least 0", pairs.margin)));
    }
    pairs.selection.check(world.geometry.instances.len(), n)?;
    let geometry = &world.geometry;
    let mut found = Vec::with_capacity(n);
    let work = |range: Range<usize>| {
        let ends: Vec<_> = range.clone().map(|i| [pairs.from[i], pairs.to[i]]).collect();
        let rays: Vec<ExactRay> = ends.iter().map(|ends| segment(*ends)).collect();
        let selection = pairs.selection.filter(geometry, &rays, (range.start, None));
        let selects = !pairs.selection.is_everything();
        let filter = SightFilter { geometry, ends: &ends, margin: pairs.margin, selection, selects };
        let mut occluded = vec![false; rays.len()];
        geometry.exact_scene().occluded_exact(&rays, geometry, Some(&filter), &mut occluded);
        let is_finite = |ends: &[[f64; 3]; 2]| ends.as_flattened().iter().all(|x| x.is_finite());
        ends.iter().zip(occluded).map(|(ends, occluded)| !occluded && is_finite(ends)).collect::<Vec<bool>>()
    };
    in_tasks((n, NS_PER_RAY), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}

/// The ray between two points. It starts at the point with the smaller coordinates, so that the result is symmetric.
fn segment([a, b]: [[f64; 3]; 2]) -> ExactRay {
    let (a, b) = if b < a { (b, a) } else { (a, b) };
    ExactRay { origin: a, direction: std::array::from_fn(|k| b[k] - a[k]), t_min: 0.0, t_max: 1.0 }
}

/// Ignores triangles that contain an end point.
struct SightFilter<'a> {
    geometry: &'a Geometry,
    ends: &'a [[[f64; 3]; 2]],
    margin: f64,
    selection: SelectionFilter<'a>,
    selects: bool,
}

impl HitFilter for SightFilter<'_> {
    fn accepts_instance(&self, ray: usize, instance: u32) -> bool {
        !self.selects || self.selection.accepts_instance(ray, instance)
    }

    fn accepts(&self, ray: usize, hit: &ExactHit) -> bool {
        let corners = ExactTriangles::corners(self.geometry, hit.instance, hit.triangle);
        let is_away = |end: &[f64; 3]| squared_distance_to_triangle(*end, corners).sqrt() > self.margin;
        self.ends[ray].iter().all(is_away) && (!self.selects || self.selection.accepts(ray, hit))
    }
}
