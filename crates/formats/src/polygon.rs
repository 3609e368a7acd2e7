//! Polygons to triangles, by cutting ears (Meisters 1975).

use glam::{DVec2, DVec3};

/// The work that was allowed is used up.
#[derive(Debug)]
pub(crate) struct OutOfSteps;

/// Cuts the polygon with these corners (at least 3) into exactly `corners.len() - 2` triangles of corner numbers, with
/// its own turning sense, appended to `triangles`.
///
/// The polygon is seen along its area vector (Newell), may be concave, and need not be quite flat. Corners in the middle
/// of a straight side are used too, so that neighbours that share them meet without gaps. One that crosses itself keeps
/// its signed area; one without area becomes triangles without area. `steps` is counted down by the work done.
pub(crate) fn triangulate(
    corners: &[DVec3],
    steps: &mut u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Result<(), OutOfSteps> {
    let count = corners.len() as u32;
    if count > 3
        && let Some(flat) = project(corners)
        && !strictly_convex(&flat)
    {
        return Ears::new(flat).cut(steps, triangles);
    }
    triangles.extend((2..count).map(|i| [0, i - 1, i]));
    Ok(())
}

/// The corners in their best plane, turning to the left; `None` where there is no such plane.
fn project(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = corners[0];
    let area: DVec3 = corners
        .windows(2)
        .map(|w| (w[0] - origin).cross(w[1] - origin))
        .sum();
    let normal = area.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    let (x, y) = if x.cross(y).dot(normal) > 0.0 {
        (x, y)
    } else {
        (y, x)
    };
    Some(
        corners
            .iter()
            .map(|&p| DVec2::new((p - origin).dot(x), (p - origin).dot(y)))
            .collect(),
    )
}

/// Twice the signed area of a triangle: positive where it turns to the left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

fn strictly_convex(flat: &[DVec2]) -> bool {
    let at = |i: usize| flat[i % flat.len()];
    (0..flat.len()).all(|i| turn(at(i), at(i + 1), at(i + 2)) > 0.0)
        // Turning to the left all the way, but more than once around, is a star.
        && (1..flat.len() - 1).all(|i| turn(flat[0], flat[i], flat[i + 1]) > 0.0)
}

/// What is left of a polygon: a ring of corners, and those of them that are not strictly convex.
struct Ears {
    flat: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Only these can lie in an ear.
    reflex: Vec<u32>,
    is_reflex: Vec<bool>,
}

impl Ears {
    fn new(flat: Vec<DVec2>) -> Self {
        let count = flat.len() as u32;
        let mut ears = Self {
            next: (1..count).chain([0]).collect(),
            previous: [count - 1].into_iter().chain(0..count - 1).collect(),
            reflex: Vec::new(),
            is_reflex: vec![false; flat.len()],
            flat,
        };
        (0..count).for_each(|corner| ears.classify(corner));
        ears
    }

    fn cut(mut self, steps: &mut u64, triangles: &mut Vec<[u32; 3]>) -> Result<(), OutOfSteps> {
        let mut left = self.flat.len();
        let (mut corner, mut tried) = (0, 0);
        while left > 3 {
            *steps = steps
                .checked_sub(1 + self.reflex.len() as u64)
                .ok_or(OutOfSteps)?;
            if !self.is_ear(corner) {
                corner = self.next[corner as usize];
                tried += 1;
                if tried < left {
                    continue;
                }
                // No ear: it crosses or touches itself. Take the corner that loses least.
                corner = self.least_bad(corner, left);
                *steps = steps.checked_sub(left as u64).ok_or(OutOfSteps)?;
            }
            let (before, after) = self.neighbours(corner);
            triangles.push([before, corner, after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.forget(corner);
            self.classify(before);
            self.classify(after);
            left -= 1;
            tried = 0;
            // Going on beyond the neighbour makes fewer slivers than a fan.
            corner = self.next[after as usize];
        }
        let (before, after) = self.neighbours(corner);
        triangles.push([before, corner, after]);
        Ok(())
    }

    fn neighbours(&self, corner: u32) -> (u32, u32) {
        (self.previous[corner as usize], self.next[corner as usize])
    }

    fn turn_at(&self, corner: u32) -> f64 {
        let (before, after) = self.neighbours(corner);
        turn(
            self.flat[before as usize],
            self.flat[corner as usize],
            self.flat[after as usize],
        )
    }

    fn is_ear(&self, corner: u32) -> bool {
        if self.is_reflex[corner as usize] {
            return false;
        }
        let (before, after) = self.neighbours(corner);
        let [a, b, c] = [before, corner, after].map(|i| self.flat[i as usize]);
        !self.reflex.iter().any(|&other| {
            let p = self.flat[other as usize];
            // A corner at the same place as one of these is a bridge to a hole, not an obstacle.
            p != a
                && p != b
                && p != c
                && turn(a, b, p) >= 0.0
                && turn(b, c, p) >= 0.0
                && turn(c, a, p) >= 0.0
        })
    }

    /// The first convex corner from `start` on, else the one that turns to the right the least.
    fn least_bad(&self, start: u32, left: usize) -> u32 {
        let ring =
            || std::iter::successors(Some(start), |&c| Some(self.next[c as usize])).take(left);
        ring()
            .find(|&c| !self.is_reflex[c as usize])
            .or_else(|| ring().max_by(|&a, &b| self.turn_at(a).total_cmp(&self.turn_at(b))))
            .unwrap_or(start)
    }

    fn classify(&mut self, corner: u32) {
        let is_reflex = self.turn_at(corner) <= 0.0;
        if is_reflex && !self.is_reflex[corner as usize] {
            self.reflex.push(corner);
            self.is_reflex[corner as usize] = true;
        } else if !is_reflex {
            self.forget(corner);
        }
    }

    fn forget(&mut self, corner: u32) {
        if std::mem::replace(&mut self.is_reflex[corner as usize], false) {
            self.reflex.retain(|&c| c != corner);
        }
    }
}
