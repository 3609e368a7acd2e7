//! Exact signs of a ray and a triangle, and their intersection in double-double arithmetic.
//!
//! A ray o + t d meets the plane of corners a, b, c relative to o: A, B, C. The sign of the edge function T(a, b) = d .
//! (A x B) is the side on which the ray passes the edge. The sign of V = A . (B x C) is the side of the plane on which
//! the ray starts, and t is V divided by the sum of the three edge functions. Signs are exact for the given float64
//! numbers. They are computed in float64. If its error bound is too large, they are computed in double-double
//! arithmetic, and if that is not sufficient either, with expansions (Shewchuk 1997).
//!
//! The signs are exact if all coordinates are 0 or have magnitudes between 1e-70 and 1e70; otherwise, float64 rounding
//! decides.

use crate::exact::expansion::{DoubleDouble, Expansion, two_diff};

type Point = [f64; 3];

/// The unit roundoff of float64.
const UNIT: f64 = f64::EPSILON / 2.0;

/// Error bound of an edge function in float64, doubled, as a fraction of the sum of its products' magnitudes.
const FLOAT_ERROR: f64 = 16.0 * UNIT;

/// Error bound of an edge function in double-double arithmetic, doubled, as a fraction of the sum of its
/// products' magnitudes.
const DOUBLE_ERROR: f64 = UNIT * UNIT * 256.0;

/// Minimum magnitude of a double-double value, as a fraction of the sum of its products' magnitudes, at which its
/// rounding to float64 is accurate.
const ROUNDABLE: f64 = DOUBLE_ERROR / UNIT;

/// Axes i, j, k of the products x_i (y_j z_k - y_k z_j) in a determinant.
const AXES: [[usize; 3]; 3] = [[0, 1, 2], [1, 2, 0], [2, 0, 1]];

/// The differences a - b of the components, each exact as a rounded difference and its rounding error.
fn differences(a: Point, b: Point) -> [(f64, f64); 3] {
    std::array::from_fn(|k| two_diff(a[k], b[k]))
}

fn double(parts: [(f64, f64); 3]) -> [DoubleDouble; 3] {
    parts.map(|(high, low)| DoubleDouble { high, low })
}

/// The triple product x . (y x z) in double-double arithmetic, and the sum of its products' magnitudes.
fn triple_product(x: [DoubleDouble; 3], y: [DoubleDouble; 3], z: [DoubleDouble; 3]) -> (DoubleDouble, f64) {
    let (mut sum, mut size) = (DoubleDouble::ZERO, 0.0);
    for [i, j, k] in AXES {
        let (first, second) = (y[j].mul(z[k]), y[k].mul(z[j]));
        sum = sum.add(x[i].mul(first.sub(second)));
        size += x[i].high.abs() * (first.high.abs() + second.high.abs());
    }
    (sum, size)
}

/// The exact triple product of three vectors whose components are sums of two floats.
fn exact_triple_product(x: [(f64, f64); 3], y: [(f64, f64); 3], z: [(f64, f64); 3]) -> Expansion {
    let mut sum = Expansion::ZERO;
    for [i, j, k] in AXES {
        for factor in [x[i].1, x[i].0] {
            if factor != 0.0 {
                sum.add_triple_product(factor, y[j], z[k]);
                sum.add_triple_product(-factor, y[k], z[j]);
            }
        }
    }
    sum
}

/// A triple product in double-double arithmetic or, if that is not accurate enough, its exact value rounded to a
/// double-double.
fn sure_triple_product(x: [(f64, f64); 3], y: [(f64, f64); 3], z: [(f64, f64); 3]) -> DoubleDouble {
    let (value, size) = triple_product(double(x), double(y), double(z));
    if value.high.abs() > ROUNDABLE * size {
        return value;
    }
    exact_triple_product(x, y, z).to_double_double()
}

fn sign(value: f64) -> i32 {
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

/// Sign of the triple product x . (y x z), if float64 determines it.
#[inline]
fn float_sign(x: Point, y: Point, z: Point) -> Option<i32> {
    let (mut value, mut size) = (0.0, 0.0);
    for [i, j, k] in AXES {
        let (first, second) = (y[j] * z[k], y[k] * z[j]);
        value += x[i] * (first - second);
        size += x[i].abs() * (first.abs() + second.abs());
    }
    (value.abs() > FLOAT_ERROR * size).then(|| sign(value))
}

/// The sign of a triple product that float64 does not determine.
fn exact_sign(x: [(f64, f64); 3], y: [(f64, f64); 3], z: [(f64, f64); 3]) -> i32 {
    let (value, size) = triple_product(double(x), double(y), double(z));
    if value.high.abs() > DOUBLE_ERROR * size {
        return sign(value.high);
    }
    exact_triple_product(x, y, z).sign()
}

/// The sign of the first component of (b - a) x (c - a) that is not 0.
#[cold]
#[inline(never)]
fn normal_sign([a, b, c]: [Point; 3]) -> i32 {
    let (e, f) = (differences(b, a), differences(c, a));
    let signs = AXES.map(|[_, j, k]| {
        let mut sum = Expansion::ZERO;
        sum.add_triple_product(1.0, e[j], f[k]);
        sum.add_triple_product(-1.0, e[k], f[j]);
        sum.sign()
    });
    signs.into_iter().find(|sign| *sign != 0).unwrap_or(0)
}

/// A ray, in the coordinate frame of the corners with which it is compared.
#[derive(Clone, Copy)]
pub struct RayPredicates {
    pub origin: Point,
    pub direction: Point,
}

impl RayPredicates {
    fn exact_direction(&self) -> [(f64, f64); 3] {
        self.direction.map(|component| (component, 0.0))
    }

    fn relative(&self, point: Point) -> Point {
        std::array::from_fn(|k| point[k] - self.origin[k])
    }

    /// The sign of the edge function of an edge from a to b: -1, 0 or 1.
    #[inline]
    pub fn edge_sign(&self, a: Point, b: Point) -> i32 {
        float_sign(self.direction, self.relative(a), self.relative(b)).unwrap_or_else(|| {
            exact_sign(self.exact_direction(), differences(a, self.origin), differences(b, self.origin))
        })
    }

    /// Sign of V, A . (B x C): equal to the sign of the edge functions if the ray starts in front of the plane, and 0
    /// if the ray starts on the plane.
    #[inline]
    pub fn start_sign(&self, corners: [Point; 3]) -> i32 {
        let [x, y, z] = corners.map(|corner| self.relative(corner));
        float_sign(x, y, z).unwrap_or_else(|| {
            let [x, y, z] = corners.map(|corner| differences(corner, self.origin));
            exact_sign(x, y, z)
        })
    }

    /// Sign of an edge function after shifting the origin by the infinitesimal vector (e, e², e³) (simulation of
    /// simplicity, Edelsbrunner and Mücke 1990): 0 only for an edge parallel to the ray.
    #[inline]
    pub fn moved_edge_sign(&self, a: Point, b: Point) -> i32 {
        match self.edge_sign(a, b) {
            0 => self.parallel_sign(a, b),
            sign => sign,
        }
    }

    /// The sign of the first component of d x (b - a) that is not 0.
    #[cold]
    #[inline(never)]
    fn parallel_sign(&self, a: Point, b: Point) -> i32 {
        let edge = differences(b, a);
        let signs = AXES.map(|[_, j, k]| {
            let mut sum = Expansion::ZERO;
            sum.add_product(self.direction[j], edge[k]);
            sum.add_product(-self.direction[k], edge[j]);
            sum.sign()
        });
        signs.into_iter().find(|sign| *sign != 0).unwrap_or(0)
    }

    /// The side of a crossing of the moved line: 1 along the normal of the triangle, -1 against it, 0 without a
    /// crossing.
    pub fn crossing_side(&self, [a, b, c]: [Point; 3]) -> i32 {
        let sign = self.moved_edge_sign(a, b);
        if sign != 0 && self.moved_edge_sign(b, c) == sign && self.moved_edge_sign(c, a) == sign { sign } else { 0 }
    }

    /// Same as [`RayPredicates::start_sign`], after shifting the origin as in [`RayPredicates::moved_edge_sign`]; 0
    /// only for a triangle without area.
    pub fn moved_start_sign(&self, corners: [Point; 3]) -> i32 {
        match self.start_sign(corners) {
            0 => -normal_sign(corners),
            sign => sign,
        }
    }

    /// t and the weights of the second and third corner at the point where the line meets the plane, each accurate to
    /// one unit in the last place. The plane must not be parallel to the ray.
    pub fn intersection(&self, corners: [Point; 3]) -> [f64; 3] {
        let (found, is_sure) = self.quick_intersection(corners);
        if is_sure { found } else { self.slow_intersection(corners) }
    }

    /// [`RayPredicates::intersection`] in double-double arithmetic, and true if its precision is sufficient.
    /// Branch-free, so that a loop over rays is vectorised.
    #[inline(always)]
    pub fn quick_intersection(&self, [a, b, c]: [Point; 3]) -> ([f64; 3], bool) {
        let relative = |p: Point| {
            let part = |k: usize| {
                let (high, low) = two_diff(p[k], self.origin[k]);
                DoubleDouble { high, low }
            };
            [part(0), part(1), part(2)]
        };
        let [x, y, z] = [relative(a), relative(b), relative(c)];
        let (ab, bc, ca) = (Cross::new(x, y), Cross::new(y, z), Cross::new(z, x));
        let (edge_ab, sure_ab) = ab.along(self.direction);
        let (edge_bc, sure_bc) = bc.along(self.direction);
        let (edge_ca, sure_ca) = ca.along(self.direction);
        let (volume, sure_volume) = bc.dot(x);
        let normal_side = edge_ab.add(edge_bc).add(edge_ca);
        let weights = [edge_ca.quotient(normal_side), edge_ab.quotient(normal_side)];
        let found = [volume.quotient(normal_side), weights[0], weights[1]];
        (found, sure_ab & sure_bc & sure_ca & sure_volume)
    }

    #[cold]
    #[inline(never)]
    fn slow_intersection(&self, [a, b, c]: [Point; 3]) -> [f64; 3] {
        let direction = self.exact_direction();
        let [x, y, z] = [a, b, c].map(|p| differences(p, self.origin));
        let (edge_ab, edge_ca) = (sure_triple_product(direction, x, y), sure_triple_product(direction, z, x));
        let normal_side = edge_ab.add(sure_triple_product(direction, y, z)).add(edge_ca);
        let t = sure_triple_product(x, y, z).quotient(normal_side);
        [t, edge_ca.quotient(normal_side), edge_ab.quotient(normal_side)]
    }
}

/// A cross product in double-double arithmetic, with the sums of the magnitudes of the products in its
/// components.
struct Cross {
    components: [DoubleDouble; 3],
    sizes: [f64; 3],
}

impl Cross {
    #[inline(always)]
    fn new(y: [DoubleDouble; 3], z: [DoubleDouble; 3]) -> Cross {
        let component = |j: usize, k: usize| {
            let (first, second) = (y[j].mul(z[k]), y[k].mul(z[j]));
            (first.sub(second), first.high.abs() + second.high.abs())
        };
        let ((a, size_a), (b, size_b), (c, size_c)) = (component(1, 2), component(2, 0), component(0, 1));
        Cross { components: [a, b, c], sizes: [size_a, size_b, size_c] }
    }

    /// The dot product with a vector, and true if the float64 result equals the correctly rounded exact value.
    #[inline(always)]
    fn along(&self, [x, y, z]: Point) -> (DoubleDouble, bool) {
        let ([a, b, c], [size_a, size_b, size_c]) = (self.components, self.sizes);
        let value = a.scale(x).add(b.scale(y)).add(c.scale(z));
        let size = x.abs() * size_a + y.abs() * size_b + z.abs() * size_c;
        (value, value.high.abs() >= ROUNDABLE * size)
    }

    #[inline(always)]
    fn dot(&self, [x, y, z]: [DoubleDouble; 3]) -> (DoubleDouble, bool) {
        let ([a, b, c], [size_a, size_b, size_c]) = (self.components, self.sizes);
        let value = a.mul(x).add(b.mul(y)).add(c.mul(z));
        let size = x.high.abs() * size_a + y.high.abs() * size_b + z.high.abs() * size_c;
        (value, value.high.abs() >= ROUNDABLE * size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A generator of 64 random bits (xorshift64*).
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> u64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
        }

        /// An integer from -`size` to `size`.
        fn integer(&mut self, size: i64) -> i64 {
            (self.next() >> 16) as i64 % (2 * size + 1) - size
        }
    }

    fn det(x: [i128; 3], y: [i128; 3], z: [i128; 3]) -> i128 {
        (0..3).map(|i| x[i] * (y[(i + 1) % 3] * z[(i + 2) % 3] - y[(i + 2) % 3] * z[(i + 1) % 3])).sum()
    }

    /// Signs compared with integer arithmetic: small coordinates, which are often on one line or plane, and coordinates
    /// of 40 bits, whose products float64 rounds.
    #[test]
    fn predicate_signs_match_integer_arithmetic() {
        let mut random = Random(7);
        let mut zeros = 0;
        for round in 0..20_000 {
            let size = [2, 100, 1 << 39][round % 3];
            let mut point = || -> [i64; 3] { std::array::from_fn(|_| random.integer(size)) };
            let [o, d, a, b, mut c] = [point(), point(), point(), point(), point()];
            if round % 2 == 0 {
                // The corners and the origin are in one plane.
                c = std::array::from_fn(|k| a[k] + b[k] - o[k]);
            }
            let relative = |p: [i64; 3]| -> [i128; 3] { std::array::from_fn(|k| i128::from(p[k]) - i128::from(o[k])) };
            let float = |p: [i64; 3]| p.map(|x| x as f64);
            let ray = RayPredicates { origin: float(o), direction: float(d) };
            let expected = det(d.map(i128::from), relative(a), relative(b)).signum() as i32;
            assert_eq!(ray.edge_sign(float(a), float(b)), expected);
            assert_eq!(ray.edge_sign(float(b), float(a)), -expected);
            let expected = det(relative(a), relative(b), relative(c)).signum() as i32;
            assert_eq!(ray.start_sign([a, b, c].map(float)), expected);
            zeros += usize::from(expected == 0);
        }
        assert!(zeros > 5_000, "{zeros}");
    }

    /// The signs must not change if all numbers are multiplied by powers of two, or by factors that float64 rounds.
    #[test]
    fn predicate_signs_do_not_depend_on_the_scale() {
        let ray = RayPredicates { origin: [0.1, 0.2, 0.3], direction: [1.0, 1.0, 1.0] };
        let (a, b) = ([1.1, 1.2, 1.3], [2.1, 2.2, 2.3 + 4.0 * f64::EPSILON]);
        let plain = ray.edge_sign(a, b);
        assert_ne!(plain, 0);
        for power in [-200, -60, 60, 200] {
            let scale = 2f64.powi(power);
            let by = |p: Point| p.map(|x| x * scale);
            let scaled = RayPredicates { origin: by(ray.origin), direction: ray.direction };
            assert_eq!(scaled.edge_sign(by(a), by(b)), plain, "2^{power}");
        }
    }

    /// A grazing ray, with t computed from integers.
    #[test]
    fn intersections_are_rounded_once() {
        let big = (1i64 << 30) as f64;
        let ray = RayPredicates { origin: [0.0; 3], direction: [big, 1.0, 0.0] };
        // The plane is y = 1 - x / 2^60, and the ray meets it at a slope of 2^-30.
        let (low, high) = (1.0 - 1.0 / (1i64 << 30) as f64, 1.0 + 1.0 / (1i64 << 30) as f64);
        let corners = [[-big, high, -big], [3.0 * big, 1.0 - 3.0 / (1i64 << 30) as f64, 0.0], [-big, high, big]];
        let [t, u, v] = ray.intersection(corners);
        // The exact t solves t + t 2^30 / 2^60 = 1.
        let expected = 1.0 / (1.0 + 1.0 / (1i64 << 30) as f64);
        assert!((t - expected).abs() <= f64::EPSILON / 2.0, "{t} {expected} {low}");
        assert!((u - (1.0 + t) / 4.0).abs() < 1e-15 && v > 0.0);
    }
}
