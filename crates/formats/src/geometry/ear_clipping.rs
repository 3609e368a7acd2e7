//! Triangulation of polygons by ear clipping (Meisters 1975).

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

use crate::geometry::reflex_kd_tree::{ReflexKdTree, signed_area2};

/// Error: the limit on steps is reached.
#[derive(Debug)]
pub(crate) struct WorkLimitExceeded;

/// Cuts the polygon with these corners (at least 3) into exactly `corners.len() - 2` triangles of corner indices with
/// the polygon's orientation, and appends them to `triangles`.
///
/// The polygon is viewed along its area vector (Newell); it may be concave, and need not be exactly planar. Corners in
/// the middle of a straight side are used too, so that adjacent polygons that share them have no gaps. A polygon that
/// intersects itself keeps its signed area; a polygon without area becomes triangles without area. `steps` is reduced
/// by the number of steps used.
pub(crate) fn triangulate(
    corners: &[DVec3],
    steps: &mut u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), WorkLimitExceeded> {
    let count = corners.len() as u32;
    if count > 3
        && let Some(flat) = project(corners)
        && !strictly_convex(&flat)
    {
        return EarClipper::new(flat).cut(steps, triangles);
    }
    triangles.extend((2..count).map(|i| [0, i - 1, i]));
    Ok(())
}

/// Corners projected to the best-fitting plane, counter-clockwise; `None` if there is no such plane.
fn project(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = corners[0];
    let area: DVec3 = corners.windows(2).map(|w| (w[0] - origin).cross(w[1] - origin)).sum();
    let normal = area.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    let (x, y) = if x.cross(y).dot(normal) > 0.0 { (x, y) } else { (y, x) };
    Some(corners.iter().map(|&p| DVec2::new((p - origin).dot(x), (p - origin).dot(y))).collect())
}

fn strictly_convex(flat: &[DVec2]) -> bool {
    let at = |i: usize| flat[i % flat.len()];
    (0..flat.len()).all(|i| signed_area2(at(i), at(i + 1), at(i + 2)) > 0.0)
        // This condition excludes stars: contours that always turn left but go around more than once.
        && (1..flat.len() - 1).all(|i| signed_area2(flat[0], flat[i], flat[i + 1]) > 0.0)
}

/// Marks a corner as clipped, in place of the index of its next corner.
const REMOVED: u32 = u32::MAX;

/// Remaining polygon: a ring of corners.
///
/// A corner is tested again only if its neighbours have changed or the obstacle in its ear has been removed. The work
/// therefore grows only slightly faster than the number of corners.
struct EarClipper {
    flat: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// All corners. Corners that are not strictly convex are marked, because only such corners can be inside an ear.
    reflex: ReflexKdTree,
    /// Convex corners to test, each with a version: an entry with an older version is stale.
    queue: VecDeque<(u32, u32)>,
    versions: Vec<u32>,
    /// Corners whose ear is blocked, grouped by the blocking obstacle.
    blocked: Vec<Vec<u32>>,
}

impl EarClipper {
    fn new(flat: Vec<DVec2>) -> Self {
        let count = flat.len() as u32;
        let mut ears = Self {
            next: (1..count).chain([0]).collect(),
            previous: [count - 1].into_iter().chain(0..count - 1).collect(),
            reflex: ReflexKdTree::new(&flat),
            queue: VecDeque::with_capacity(flat.len()),
            versions: vec![0; flat.len()],
            blocked: vec![Vec::new(); flat.len()],
            flat,
        };
        (0..count).for_each(|corner| ears.update_corner(corner));
        ears
    }

    fn cut(mut self, steps: &mut u64, triangles: &mut Vec<[u32; 3]>) -> Result<(), WorkLimitExceeded> {
        let mut corner = 0;
        for left in (4..=self.flat.len()).rev() {
            let ear = self.next_ear(steps)?;
            // If no ear exists because the polygon intersects or touches itself, a convex corner is cut off, or, if none
            // is left, the least reflex corner.
            let ear = match ear {
                Some(ear) => ear,
                None => self.least_reflex(corner, left, steps)?,
            };
            let (before, after) = self.neighbours(ear);
            triangles.push([before, ear, after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.next[ear as usize] = REMOVED;
            self.set_reflex(ear, false);
            self.update_corner(before);
            self.update_corner(after);
            corner = after;
        }
        let (before, after) = self.neighbours(corner);
        triangles.push([before, corner, after]);
        Ok(())
    }

    fn neighbours(&self, corner: u32) -> (u32, u32) {
        (self.previous[corner as usize], self.next[corner as usize])
    }

    fn corners(&self, corner: u32) -> [DVec2; 3] {
        let (before, after) = self.neighbours(corner);
        [before, corner, after].map(|i| self.flat[i as usize])
    }

    fn signed_area_at(&self, corner: u32) -> f64 {
        let [a, b, c] = self.corners(corner);
        signed_area2(a, b, c)
    }

    /// Next corner whose triangle can be cut off.
    fn next_ear(&mut self, steps: &mut u64) -> Result<Option<u32>, WorkLimitExceeded> {
        while let Some((corner, version)) = self.queue.pop_front() {
            charge(steps, 1)?;
            if version != self.versions[corner as usize] || self.next[corner as usize] == REMOVED {
                continue;
            }
            let (obstacle, looked_at) = self.reflex.find_inside(&self.flat, self.corners(corner));
            charge(steps, looked_at)?;
            match obstacle {
                None => return Ok(Some(corner)),
                Some(obstacle) => self.blocked[obstacle as usize].push(corner),
            }
        }
        Ok(None)
    }

    /// First convex corner from `start` on, or otherwise the corner with the largest signed area.
    fn least_reflex(&self, start: u32, left: usize, steps: &mut u64) -> Result<u32, WorkLimitExceeded> {
        let mut best = (start, f64::NEG_INFINITY);
        let mut corner = start;
        for _ in 0..left {
            charge(steps, 1)?;
            if !self.reflex.is_marked(corner) {
                return Ok(corner);
            }
            let area = self.signed_area_at(corner);
            if area > best.1 {
                best = (corner, area);
            }
            corner = self.next[corner as usize];
        }
        Ok(best.0)
    }

    /// Updates a corner whose neighbours have changed.
    fn update_corner(&mut self, corner: u32) {
        let reflex = self.signed_area_at(corner) <= 0.0;
        self.set_reflex(corner, reflex);
        self.versions[corner as usize] += 1;
        if !reflex {
            self.queue.push_back((corner, self.versions[corner as usize]));
        }
    }

    fn set_reflex(&mut self, corner: u32, reflex: bool) {
        self.reflex.mark(corner, reflex);
        if !reflex {
            for waiting in std::mem::take(&mut self.blocked[corner as usize]) {
                self.versions[waiting as usize] += 1;
                self.queue.push_back((waiting, self.versions[waiting as usize]));
            }
        }
    }
}

fn charge(steps: &mut u64, amount: u64) -> Result<(), WorkLimitExceeded> {
    *steps = steps.checked_sub(amount).ok_or(WorkLimitExceeded)?;
    Ok(())
}
