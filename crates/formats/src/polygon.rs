//! Polygons to triangles, by cutting ears (Meisters 1975).

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

use crate::polygon_tree::{Tree, turn};

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

fn strictly_convex(flat: &[DVec2]) -> bool {
    let at = |i: usize| flat[i % flat.len()];
    (0..flat.len()).all(|i| turn(at(i), at(i + 1), at(i + 2)) > 0.0)
        // Turning to the left all the way, but more than once around, is a star.
        && (1..flat.len() - 1).all(|i| turn(flat[0], flat[i], flat[i + 1]) > 0.0)
}

/// In place of a neighbour: the corner has been cut off.
const CUT: u32 = u32::MAX;

/// What is left of a polygon: a ring of corners.
///
/// A corner is tried again only when its neighbours have changed or the one that lay in its ear does so no longer, so
/// that the work grows little faster than the number of corners.
struct Ears {
    flat: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Marked are the corners that are not strictly convex: only these can lie in an ear.
    reflex: Tree,
    /// Convex corners to try, each with its number in `tries`: an older one no longer counts.
    queue: VecDeque<(u32, u32)>,
    tries: Vec<u32>,
    /// By the corner that lies in their ears.
    blocked: Vec<Vec<u32>>,
}

impl Ears {
    fn new(flat: Vec<DVec2>) -> Self {
        let count = flat.len() as u32;
        let mut ears = Self {
            next: (1..count).chain([0]).collect(),
            previous: [count - 1].into_iter().chain(0..count - 1).collect(),
            reflex: Tree::new(&flat),
            queue: VecDeque::with_capacity(flat.len()),
            tries: vec![0; flat.len()],
            blocked: vec![Vec::new(); flat.len()],
            flat,
        };
        (0..count).for_each(|corner| ears.classify(corner));
        ears
    }

    fn cut(mut self, steps: &mut u64, triangles: &mut Vec<[u32; 3]>) -> Result<(), OutOfSteps> {
        let mut corner = 0;
        for left in (4..=self.flat.len()).rev() {
            let ear = self.next_ear(steps)?;
            // No ear: it crosses or touches itself. Take the corner that loses least.
            let ear = match ear {
                Some(ear) => ear,
                None => self.least_bad(corner, left, steps)?,
            };
            let (before, after) = self.neighbours(ear);
            triangles.push([before, ear, after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.next[ear as usize] = CUT;
            self.set_reflex(ear, false);
            self.classify(before);
            self.classify(after);
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

    fn turn_at(&self, corner: u32) -> f64 {
        let [a, b, c] = self.corners(corner);
        turn(a, b, c)
    }

    /// The next corner whose triangle can be cut off.
    fn next_ear(&mut self, steps: &mut u64) -> Result<Option<u32>, OutOfSteps> {
        while let Some((corner, number)) = self.queue.pop_front() {
            spend(steps, 1)?;
            if number != self.tries[corner as usize] || self.next[corner as usize] == CUT {
                continue;
            }
            let (obstacle, looked_at) = self.reflex.inside(&self.flat, self.corners(corner));
            spend(steps, looked_at)?;
            match obstacle {
                None => return Ok(Some(corner)),
                Some(obstacle) => self.blocked[obstacle as usize].push(corner),
            }
        }
        Ok(None)
    }

    /// The first convex corner from `start` on, else the one that turns to the right the least.
    fn least_bad(&self, start: u32, left: usize, steps: &mut u64) -> Result<u32, OutOfSteps> {
        let mut best = (start, f64::NEG_INFINITY);
        let mut corner = start;
        for _ in 0..left {
            spend(steps, 1)?;
            if !self.reflex.is_marked(corner) {
                return Ok(corner);
            }
            let turn = self.turn_at(corner);
            if turn > best.1 {
                best = (corner, turn);
            }
            corner = self.next[corner as usize];
        }
        Ok(best.0)
    }

    /// Says of a corner with new neighbours what it is now.
    fn classify(&mut self, corner: u32) {
        let reflex = self.turn_at(corner) <= 0.0;
        self.set_reflex(corner, reflex);
        self.tries[corner as usize] += 1;
        if !reflex {
            self.queue.push_back((corner, self.tries[corner as usize]));
        }
    }

    fn set_reflex(&mut self, corner: u32, reflex: bool) {
        self.reflex.mark(corner, reflex);
        if !reflex {
            for waiting in std::mem::take(&mut self.blocked[corner as usize]) {
                self.tries[waiting as usize] += 1;
                self.queue
                    .push_back((waiting, self.tries[waiting as usize]));
            }
        }
    }
}

fn spend(steps: &mut u64, amount: u64) -> Result<(), OutOfSteps> {
    *steps = steps.checked_sub(amount).ok_or(OutOfSteps)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn cut(corners: &[DVec3]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        triangulate(corners, &mut u64::MAX.clone(), &mut triangles).unwrap();
        assert_eq!(triangles.len(), corners.len() - 2);
        triangles
    }

    /// Every triangle's area, with its sign as seen along `normal`.
    fn areas(corners: &[DVec3], normal: DVec3) -> Vec<f64> {
        let area = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
            (b - a).cross(c - a).dot(normal) / 2.0
        };
        cut(corners).into_iter().map(area).collect()
    }

    fn signed_area(corners: &[DVec3], normal: DVec3) -> f64 {
        let count = corners.len();
        (0..count)
            .map(|i| corners[i].cross(corners[(i + 1) % count]).dot(normal) / 2.0)
            .sum()
    }

    fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
    }

    /// No triangle turns back and none is missing: together they are the polygon.
    fn covers(corners: &[DVec3], normal: DVec3) {
        let areas = areas(corners, normal);
        let whole = signed_area(corners, normal);
        let sum: f64 = areas.iter().sum();
        assert!((sum - whole).abs() <= 1e-12 * whole, "{sum} of {whole}");
        assert!(
            areas.iter().all(|&area| area >= -1e-13 * whole),
            "{areas:?}"
        );
    }

    #[test]
    fn stars_of_any_shape_in_any_plane_are_covered_once() {
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for round in 0..400 {
            let count = 4 + round % 60;
            let turn = DQuat::from_euler(
                glam::EulerRot::XYZ,
                6.0 * random(),
                6.0 * random(),
                6.0 * random(),
            );
            let shift = DVec3::new(random(), random(), random()) * 100.0;
            let corners: Vec<DVec3> = (0..count)
                .map(|i| {
                    let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
                    let radius = 0.05 + random();
                    turn * DVec3::new(radius * cos, radius * sin, 0.0) + shift
                })
                .collect();
            let centred: Vec<DVec3> = corners.iter().map(|&c| c - shift).collect();
            let areas = areas(&corners, turn * DVec3::Z);
            let whole = signed_area(&centred, turn * DVec3::Z);
            assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9 * whole);
            assert!(areas.iter().all(|&area| area > -1e-9), "{areas:?}");
        }
    }

    #[test]
    fn corners_in_the_middle_of_sides_make_no_flat_triangles() {
        let square = flat(&[
            [0., 0.],
            [1., 0.],
            [2., 0.],
            [2., 2.],
            [1., 2.],
            [0., 2.],
            [0., 1.],
        ]);
        assert!(areas(&square, DVec3::Z).iter().all(|&area| area > 0.1));
        covers(&square, DVec3::Z);
        let triangle = flat(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.], [0., 3.]]);
        assert!(areas(&triangle, DVec3::Z).iter().all(|&area| area > 0.1));
    }

    #[test]
    fn an_arrow_is_cut_at_its_notch() {
        for start in 0..4 {
            let mut arrow = flat(&[[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]]);
            arrow.rotate_left(start);
            covers(&arrow, DVec3::Z);
            arrow.reverse();
            covers(&arrow, DVec3::NEG_Z);
        }
    }

    #[test]
    fn a_hole_with_a_bridge_stays_open() {
        let ring = flat(&[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
        ]);
        covers(&ring, DVec3::Z);
        assert!((areas(&ring, DVec3::Z).iter().sum::<f64>() - 12.0).abs() < 1e-12);
    }

    #[test]
    fn combs_and_spirals_are_covered() {
        let teeth = 200;
        let mut comb = vec![[0.0, 0.0], [2.0 * teeth as f64, 0.0]];
        comb.extend(
            (0..2 * teeth).map(|i| [(2 * teeth - i) as f64, if i % 2 == 0 { 10.0 } else { 1.0 }]),
        );
        covers(&flat(&comb), DVec3::Z);
        let arm = |i: usize, width: f64| {
            let angle = 0.1 * i as f64;
            [
                (1.0 + angle + width) * angle.cos(),
                (1.0 + angle + width) * angle.sin(),
            ]
        };
        let spiral: Vec<_> = (0..300)
            .map(|i| arm(i, 3.0))
            .chain((0..300).rev().map(|i| arm(i, 0.0)))
            .collect();
        covers(&flat(&spiral), DVec3::Z);
    }

    #[test]
    fn degenerate_polygons_keep_their_signed_area() {
        // Crossing itself, all on a line, all in one point, and not flat.
        let pentagram: Vec<_> = (0..5)
            .map(|i| (f64::from(i) * 2.0 * 72.0).to_radians().sin_cos().into())
            .collect();
        let bow = vec![[0., 0.], [2., 2.], [2., 0.], [0., 2.1], [-1., 1.]];
        for points in [
            pentagram,
            bow,
            vec![[0., 0.], [1., 0.], [2., 0.], [3., 0.]],
            vec![[1., 1.]; 6],
        ] {
            let corners = flat(&points);
            let sum: f64 = areas(&corners, DVec3::Z).iter().sum();
            assert!((sum - signed_area(&corners, DVec3::Z)).abs() < 1e-12);
        }
        let saddle: Vec<DVec3> = (0..4)
            .map(|i| {
                DVec3::new(
                    f64::from(i & 1 ^ i >> 1),
                    f64::from(i >> 1),
                    f64::from(i & 1),
                )
            })
            .collect();
        assert_eq!(cut(&saddle), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn work_is_limited() {
        let zigzag: Vec<_> = (0..1000)
            .map(|i| [f64::from(i), f64::from(i % 2)])
            .chain([[500.0, 900.0]])
            .collect();
        let (mut steps, mut triangles) = (1000, Vec::new());
        assert!(triangulate(&flat(&zigzag), &mut steps, &mut triangles).is_err());
        assert!(triangles.len() < 999);
    }

    #[test]
    fn large_contours_take_little_work() {
        let count = 40_000;
        let around = |i: usize, radius: f64| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            [radius * cos, radius * sin]
        };
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let star: Vec<_> = (0..count).map(|i| around(i, 0.3 + random())).collect();
        let gear: Vec<_> = (0..count)
            .map(|i| around(i, if i % 4 < 2 { 1.0 } else { 0.9 }))
            .collect();
        for points in [star, gear] {
            let corners = flat(&points);
            let (mut steps, mut triangles) = (1000 * count as u64, Vec::new());
            triangulate(&corners, &mut steps, &mut triangles).unwrap();
            covers(&corners, DVec3::Z);
        }
    }
}
