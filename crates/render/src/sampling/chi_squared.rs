//! Pearson's chi-squared test of sample distributions (test support).

use std::f64::consts::TAU;

/// Chi-squared statistic and degrees of freedom of observed counts against expected counts. Cells with small expected
/// counts are merged. The last cell may collect samples outside of all other cells, so that the sum of the counts is
/// not fixed.
pub(crate) fn statistic(pairs: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let (mut chi2, mut freedom, mut rest) = (0.0, 0.0, (0.0, 0.0));
    for (seen, expected) in pairs {
        if expected < 10.0 {
            rest = (rest.0 + seen, rest.1 + expected);
        } else {
            chi2 += (seen - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if rest.1 >= 5.0 {
        chi2 += (rest.0 - rest.1).powi(2) / rest.1;
        freedom += 1.0;
    } else if rest.0 > rest.1 + 10.0 {
        // Many samples are in cells for which almost no samples are expected.
        chi2 = f64::INFINITY;
    }
    (chi2, freedom)
}

/// Chi-squared limit that a correct distribution exceeds by chance once in 100 runs of `tests` tests: Šidák correction,
/// Wilson-Hilferty approximation.
pub(crate) fn limit(freedom: f64, tests: usize) -> f64 {
    let p = 1.0 - 0.99f64.powf(1.0 / tests as f64);
    // The quantile of the normal distribution is found by bisection of its tail.
    let tail =
        |z: f64| (0..20_000).map(|i| (-(z + f64::from(i) * 1e-3).powi(2) / 2.0).exp() * 1e-3).sum::<f64>() / TAU.sqrt();
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if tail(middle) > p { low = middle } else { high = middle }
    }
    let k = 2.0 / (9.0 * freedom);
    freedom * (1.0 - k + low * k.sqrt()).powi(3)
}

#[test]
fn chi_squared_limits_match_published_tables() {
    // The 99 % quantile of the chi-squared distribution with 100 degrees of freedom is 135.807.
    assert!((limit(100.0, 1) - 135.807).abs() < 0.1);
}
