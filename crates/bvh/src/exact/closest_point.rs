//! The point of a triangle that is closest to a given point: computed in float64, or in double-double arithmetic for
//! needles (regions as in C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5).

use crate::exact::expansion::{DoubleDouble, two_diff};

type Vector3 = [f64; 3];

/// Squared sine of the angle at the first corner, above which float64 with one correction step is precise enough to
/// find the foot of the perpendicular.
const MIN_SQUARED_SINE: f64 = 1e-6;

/// The point of a triangle that is closest to another point.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePoint {
    pub squared_distance: f64,
    pub position: Vector3,
    /// Weights of the corners; each weight is at least 0, and their sum is 1.
    pub weights: [f64; 3],
}

fn sub(a: Vector3, b: Vector3) -> Vector3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vector3, b: Vector3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The point a + v e + w f.
fn plus(a: Vector3, v: f64, e: Vector3, w: f64, f: Vector3) -> Vector3 {
    std::array::from_fn(|k| a[k] + (v * e[k] + w * f[k]))
}

/// Point of a triangle closest to `point`. A triangle without area is a segment or a point. If the closest point is on
/// an edge, both triangles that share the edge return the same bits.
#[inline]
pub fn closest_point(point: Vector3, corners: [Vector3; 3]) -> TrianglePoint {
    let [a, b, c] = corners;
    let relative = corners.map(|corner| sub(corner, point));
    let (e, f) = (sub(b, a), sub(c, a));
    let (ee, ef, ff) = (dot(e, e), dot(e, f), dot(f, f));
    let (ae, af) = (dot(relative[0], e), dot(relative[0], f));
    let det = ee * ff - ef * ef;
    let weights = if det > MIN_SQUARED_SINE * (ee * ff) {
        let (v, w) = (ef * af - ff * ae, ef * ae - ee * af);
        (v >= 0.0 && w >= 0.0 && v + w <= det).then(|| {
            let (v, w) = (v / det, w / det);
            // One step of Newton's method; the remaining error is a rounding error relative to the triangle's size.
            let rest = plus(relative[0], v, e, w, f);
            let (ae, af) = (dot(rest, e), dot(rest, f));
            [v + (ef * af - ff * ae) / det, w + (ef * ae - ee * af) / det]
        })
    } else {
        foot_in_double_double(point, corners)
    };
    let Some([v, w]) = weights else { return closest_of_edges(corners, relative) };
    let (v, w) = (v.max(0.0), w.max(0.0));
    let excess = (v + w).max(1.0);
    let (v, w) = (v / excess, w / excess);
    let foot = plus(relative[0], v, e, w, f);
    TrianglePoint {
        squared_distance: dot(foot, foot),
        position: plus(a, v, e, w, f),
        weights: [(1.0 - v - w).max(0.0), v, w],
    }
}

/// Weights of the second and third corner at the foot of the perpendicular, if the foot is inside the triangle.
#[cold]
#[inline(never)]
fn foot_in_double_double(point: Vector3, [a, b, c]: [Vector3; 3]) -> Option<[f64; 2]> {
    let exact = |p: Vector3, q: Vector3| -> [DoubleDouble; 3] {
        std::array::from_fn(|k| {
            let (high, low) = two_diff(p[k], q[k]);
            DoubleDouble { high, low }
        })
    };
    let dot = |x: &[DoubleDouble; 3], y: &[DoubleDouble; 3]| x[0].mul(y[0]).add(x[1].mul(y[1])).add(x[2].mul(y[2]));
    let (r, e, f) = (exact(a, point), exact(b, a), exact(c, a));
    let (ee, ef, ff, re, rf) = (dot(&e, &e), dot(&e, &f), dot(&f, &f), dot(&r, &e), dot(&r, &f));
    let det = ee.mul(ff).sub(ef.mul(ef));
    let v = ef.mul(rf).sub(ff.mul(re));
    let w = ef.mul(re).sub(ee.mul(rf));
    let inside = v.high >= 0.0 && w.high >= 0.0 && v.add(w).sub(det).high <= 0.0;
    // Below this value, double-double arithmetic cannot distinguish a needle from a segment.
    let solid = det.high > 1e-24 * (ee.high * ff.high);
    (inside && solid).then(|| [v.quotient(det), w.quotient(det)])
}

/// The closest point on the three edges.
fn closest_of_edges(corners: [Vector3; 3], relative: [Vector3; 3]) -> TrianglePoint {
    let edge = |i: usize, j: usize| {
        // The computation starts at the edge's lexicographically smaller end, so that both triangles of the edge return
        // the same bits.
        let (i, j) = if corners[j] < corners[i] { (j, i) } else { (i, j) };
        let along = sub(corners[j], corners[i]);
        let t = -dot(relative[i], along) / dot(along, along);
        let mut weights = [0.0; 3];
        let (foot, position) = if t >= 1.0 {
            weights[j] = 1.0;
            (relative[j], corners[j])
        } else if t > 0.0 {
            (weights[i], weights[j]) = (1.0 - t, t);
            (plus(relative[i], t, along, 0.0, along), plus(corners[i], t, along, 0.0, along))
        } else {
            // This case includes edges of length zero, whose t is NaN.
            weights[i] = 1.0;
            (relative[i], corners[i])
        };
        TrianglePoint { squared_distance: dot(foot, foot), position, weights }
    };
    let nearer = |x: TrianglePoint, y: TrianglePoint| if y.squared_distance < x.squared_distance { y } else { x };
    nearer(nearer(edge(0, 1), edge(1, 2)), edge(2, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vector3; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    #[test]
    fn closest_points_are_found_in_every_region() {
        let cases = [
            ([1.0, 1.0, 2.0], [1.0, 1.0, 0.0]),
            ([-1.0, -2.0, 0.5], [0.0, 0.0, 0.0]),
            ([6.0, -1.0, 0.0], [4.0, 0.0, 0.0]),
            ([-1.0, 5.0, 0.0], [0.0, 3.0, 0.0]),
            ([2.0, -7.0, 1.0], [2.0, 0.0, 0.0]),
            ([-3.0, 1.5, 1.0], [0.0, 1.5, 0.0]),
            ([2.0 + 3.0, 1.5 + 4.0, 0.0], [2.0, 1.5, 0.0]),
        ];
        for (point, expected) in cases {
            for turn in 0..3 {
                let corners: [Vector3; 3] = std::array::from_fn(|k| CORNERS[(k + turn) % 3]);
                let found = closest_point(point, corners);
                let off = sub(found.position, expected);
                assert!(dot(off, off) < 1e-30, "{point:?}: {found:?}");
                let between = sub(point, expected);
                assert!((found.squared_distance - dot(between, between)).abs() < 1e-14);
                let weighted: Vector3 = std::array::from_fn(|k| (0..3).map(|i| found.weights[i] * corners[i][k]).sum());
                let off = sub(weighted, expected);
                assert!(dot(off, off) < 1e-30);
            }
        }
    }

    #[test]
    fn needles_count_as_triangles_and_flat_triangles_as_segments() {
        let needle = |height: f64| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, height, 0.0]];
        for height in [1e-2, 1e-5, 1e-8, 1e-10] {
            let found = closest_point([0.5, height / 2.0, 1e-3], needle(height));
            assert!((found.squared_distance.sqrt() - 1e-3).abs() < 1e-18, "{height}: {found:?}");
        }
        let flat = [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
        let found = closest_point([3.0, 0.0, 0.0], flat);
        assert_eq!(found.position, [1.0, 1.0, 1.0]);
        let found = closest_point([3.0, 4.0, 0.0], [[0.0; 3]; 3]);
        assert_eq!(found.squared_distance, 25.0);
    }
}
