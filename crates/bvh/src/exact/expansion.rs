//! Error-free float64 arithmetic: sums and products with their rounding errors, and expansions, exact sums of floats
//! that do not overlap (Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric
//! predicates").
//!
//! Exact as long as no product over- or underflows.

/// The rounded sum and its rounding error (Knuth's TwoSum).
#[inline(always)]
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// The rounded difference and its rounding error.
#[inline(always)]
pub fn two_diff(a: f64, b: f64) -> (f64, f64) {
    two_sum(a, -b)
}

/// The rounded product and its rounding error.
#[inline(always)]
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

/// The largest number of components of an [`Expansion`].
const CAPACITY: usize = 256;

/// An exact sum: nonzero components that do not overlap, ordered by increasing magnitude.
pub struct Expansion {
    components: [f64; CAPACITY],
    len: usize,
}

impl Expansion {
    pub const ZERO: Expansion = Expansion { components: [0.0; CAPACITY], len: 0 };

    /// Adds a float (Shewchuk's GrowExpansion, without zeros).
    pub fn add(&mut self, value: f64) {
        let (mut carry, mut kept) = (value, 0);
        for i in 0..self.len {
            let (sum, error) = two_sum(carry, self.components[i]);
            carry = sum;
            if error != 0.0 {
                self.components[kept] = error;
                kept += 1;
            }
        }
        if carry != 0.0 {
            self.components[kept] = carry;
            kept += 1;
        }
        self.len = kept;
    }

    /// Adds `factor * (high + low)`.
    pub fn add_product(&mut self, factor: f64, (high, low): (f64, f64)) {
        for part in [low, high] {
            if part != 0.0 {
                let (product, error) = two_product(factor, part);
                self.add(error);
                self.add(product);
            }
        }
    }

    /// Adds `factor` times the product of `a` and `b`, each the sum of two floats.
    pub fn add_triple_product(&mut self, factor: f64, a: (f64, f64), b: (f64, f64)) {
        for x in [a.1, a.0] {
            for y in [b.1, b.0] {
                if x != 0.0 && y != 0.0 {
                    self.add_product(factor, two_product(x, y));
                }
            }
        }
    }

    /// A float that differs from the sum by at most one unit in the last place, and has the sum's sign.
    pub fn estimate(&self) -> f64 {
        self.components[..self.len].iter().sum()
    }

    /// The sum rounded to two floats.
    pub fn to_double_double(mut self) -> DoubleDouble {
        let high = self.estimate();
        self.add(-high);
        DoubleDouble { high, low: self.estimate() }
    }

    /// -1, 0 or 1: the sign of the sum.
    pub fn sign(&self) -> i32 {
        match self.len {
            0 => 0,
            len if self.components[len - 1] > 0.0 => 1,
            _ => -1,
        }
    }
}

/// An unevaluated sum of two floats, of 106 bits (double-double).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleDouble {
    pub high: f64,
    pub low: f64,
}

impl DoubleDouble {
    pub const ZERO: DoubleDouble = DoubleDouble { high: 0.0, low: 0.0 };

    #[inline(always)]
    fn normalized(high: f64, low: f64) -> DoubleDouble {
        let sum = high + low;
        DoubleDouble { high: sum, low: low - (sum - high) }
    }

    /// The sum, with an error below 2^-104 of the summands' magnitudes.
    #[inline(always)]
    pub fn add(self, other: DoubleDouble) -> DoubleDouble {
        let (high, error) = two_sum(self.high, other.high);
        let (low, second) = two_sum(self.low, other.low);
        let first = DoubleDouble::normalized(high, error + low);
        DoubleDouble::normalized(first.high, first.low + second)
    }

    #[inline(always)]
    pub fn neg(self) -> DoubleDouble {
        DoubleDouble { high: -self.high, low: -self.low }
    }

    #[inline(always)]
    pub fn sub(self, other: DoubleDouble) -> DoubleDouble {
        self.add(other.neg())
    }

    /// The product, with a relative error below 2^-102.
    #[inline(always)]
    pub fn mul(self, other: DoubleDouble) -> DoubleDouble {
        let (high, error) = two_product(self.high, other.high);
        DoubleDouble::normalized(high, error + (self.high * other.low + self.low * other.high))
    }

    #[inline(always)]
    pub fn scale(self, factor: f64) -> DoubleDouble {
        let (high, error) = two_product(self.high, factor);
        DoubleDouble::normalized(high, error + self.low * factor)
    }

    /// The float nearest to the quotient, with a relative error below 2^-52.
    #[inline(always)]
    pub fn quotient(self, other: DoubleDouble) -> f64 {
        let first = self.high / other.high;
        let rest = self.sub(other.scale(first));
        first + (rest.high + rest.low) / other.high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_free_sums_and_products_are_exact() {
        let (sum, error) = two_sum(1e16, 1.0 + f64::EPSILON);
        // The float64 sum is rounded to a multiple of 2; `error` is exactly the rounding error.
        assert_eq!((sum - 1e16) + error, 1.0 + f64::EPSILON);
        let (product, error) = two_product(1.0 + f64::EPSILON, 1.0 + f64::EPSILON);
        assert_eq!((product, error), (1.0 + 2.0 * f64::EPSILON, f64::EPSILON * f64::EPSILON));
    }

    #[test]
    fn expansion_signs_are_exact_after_cancellation() {
        let mut sum = Expansion::ZERO;
        for value in [1e200, 1.0, -1e200, 1e-200, -1.0] {
            sum.add(value);
        }
        assert_eq!((sum.sign(), sum.estimate()), (1, 1e-200));
        sum.add(-1e-200);
        assert_eq!((sum.sign(), sum.len), (0, 0));
    }

    #[test]
    fn quotients_are_rounded_once() {
        let third = DoubleDouble { high: 1.0, low: 0.0 }.quotient(DoubleDouble { high: 3.0, low: 0.0 });
        assert_eq!(third, 1.0 / 3.0);
        let near = DoubleDouble { high: 1.0, low: f64::EPSILON / 4.0 };
        assert_eq!(near.quotient(DoubleDouble { high: 1.0, low: 0.0 }), 1.0);
    }
}
