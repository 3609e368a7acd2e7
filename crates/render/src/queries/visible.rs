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
    /// The first point of each pair.
    pub from: &'a [[f64; 3]],
    /// The second point of each pair.
    pub to: &'a [[f64; 3]],
    /// Triangles within this distance of either point do not count.
    pub margin: f64,
    /// The surfaces that can hide a point.
    pub selection: Selection<'a>,
}

/// True for each pair of points without a closed triangle between them; false if a coordinate is not finite.
/// The result is symmetric.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or the margin is negative, [`RenderError::Cancelled`], and
/// errors of `crate::thread_pool::with_pool`.
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
    // The comparison is false for NaN, so that a margin of NaN is an error.
    let is_valid = pairs.margin >= 0.0;
    if !is_valid {
        return Err(RenderError::settings(format!("margin is {}; expected a number of at least 0", pairs.margin)));
    }
    pairs.selection.check(world.geometry.instances.len(), n)?;
    let geometry = &world.geometry;
    let mut found = Vec::with_capacity(n);
    let work = |range: Range<usize>| {
        let ends: Vec<_> = range.clone().map(|i| [pairs.from[i], pairs.to[i]]).collect();
        let margins = vec![pairs.margin; ends.len()];
        clear_pairs(geometry, &ends, &margins, &pairs.selection, range.start)
    };
    in_tasks((n, NS_PER_RAY), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}

/// True for each pair of points without a selected triangle between them. Triangles within a pair's margin of either
/// point do not count; `first` is the selection's index of the first pair.
pub(super) fn clear_pairs(
    geometry: &Geometry,
    ends: &[[[f64; 3]; 2]],
    margins: &[f64],
    chosen: &Selection,
    first: usize,
) -> Vec<bool> {
    let rays: Vec<ExactRay> = ends.iter().map(|ends| segment(*ends)).collect();
    let selection = chosen.filter(geometry, &rays, (first, None));
    let filter = SightFilter { geometry, ends, margins, selection, selects: !chosen.is_everything() };
    let mut occluded = vec![false; rays.len()];
    geometry.exact_scene().occluded_exact(&rays, geometry, Some(&filter), &mut occluded);
    let is_finite = |ends: &[[f64; 3]; 2]| ends.as_flattened().iter().all(|x| x.is_finite());
    ends.iter().zip(occluded).map(|(ends, occluded)| !occluded && is_finite(ends)).collect()
}

/// The ray between two points. It starts at the point with the smaller coordinates, so that the result is symmetric.
fn segment([a, b]: [[f64; 3]; 2]) -> ExactRay {
    let (a, b) = if b < a { (b, a) } else { (a, b) };
    ExactRay { origin: a, direction: std::array::from_fn(|k| b[k] - a[k]), t_min: 0.0, t_max: 1.0 }
}

/// Filter that accepts selected triangles that are farther than the margin from both end points.
struct SightFilter<'a> {
    geometry: &'a Geometry,
    ends: &'a [[[f64; 3]; 2]],
    margins: &'a [f64],
    selection: SelectionFilter<'a>,
    selects: bool,
}

impl HitFilter for SightFilter<'_> {
    fn accepts_instance(&self, ray: usize, instance: u32) -> bool {
        !self.selects || self.selection.accepts_instance(ray, instance)
    }

    fn accepts(&self, ray: usize, hit: &ExactHit) -> bool {
        let corners = ExactTriangles::corners(self.geometry, hit.instance, hit.triangle);
        let is_away = |end: &[f64; 3]| squared_distance_to_triangle(*end, corners).sqrt() > self.margins[ray];
        self.ends[ray].iter().all(is_away) && (!self.selects || self.selection.accepts(ray, hit))
    }
}
