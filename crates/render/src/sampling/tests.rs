//! Properties of the random numbers: nets, blue noise, independence.

use crate::sampling::sampler::*;

#[test]
fn each_elementary_interval_contains_one_point() {
    // This is the defining property of a (0, 2)-sequence in base 2; scrambling, shuffling and mixing keep it.
    let pairs = [
        Dimension::Light(2, 1),
        Dimension::PixelFilter,
        Dimension::Bsdf(0),
        Dimension::Light(1, 0),
        Dimension::LobeAndLight(2),
        Dimension::Bsdf(11),
    ];
    for (pixel, pair) in (0..60).zip(pairs.into_iter().cycle()) {
        for columns in (0..=10).map(|bits| 1 << bits) {
            let mut cells = vec![0; 1024];
            for sample in 0..1024 {
                let [x, y] = Sampler::new(3, 1, [pixel, 7], sample).get_2d(pair);
                let rows = 1024 / columns;
                let column = (x * columns as f32) as usize;
                cells[(y * rows as f32) as usize * columns + column] += 1;
            }
            assert_eq!(cells, vec![1; 1024], "{pair:?}, {columns} columns");
        }
    }
}

/// Fraction of all boxes that contain exactly a 16th of the points. The boxes have the volume 1/16 and all shapes in
/// the four dimensions of two pairs.
fn even(samples: u32, pairs: [Dimension; 2]) -> f64 {
    let (mut even, mut all) = (0, 0);
    for pixel in 0..4 {
        let points: Vec<_> = (0..samples)
            .map(|sample| {
                let sampler = Sampler::new(5, 0, [pixel, 3], sample);
                let [[a, b], [c, d]] = pairs.map(|pair| sampler.get_2d(pair));
                [a, b, c, d]
            })
            .collect();
        for shape in 0..5u32.pow(4) {
            let bits = [0, 1, 2, 3].map(|k| shape / 5u32.pow(k) % 5);
            if bits.iter().sum::<u32>() != 4 {
                continue;
            }
            let mut cells = [0; 16];
            for point in &points {
                let at = |cell, (&x, bits): (&f32, u32)| cell << bits | (x * (1 << bits) as f32) as usize;
                cells[point.iter().zip(bits).fold(0, at)] += 1;
            }
            even += cells.iter().filter(|&&count| count == samples / 16).count();
            all += cells.len();
        }
    }
    f64::from(even as u32) / f64::from(all as u32)
}

#[test]
fn two_pairs_of_a_group_are_stratified_in_four_dimensions() {
    use Dimension::{Bsdf, Light, LobeAndLight, OpacityAndRoulette, PixelFilter};
    for pairs in [
        [PixelFilter, Bsdf(0)],
        [PixelFilter, Light(0, 0)],
        [PixelFilter, LobeAndLight(0)],
        [Bsdf(0), Light(1, 0)],
        [Bsdf(0), Bsdf(1)],
        [Bsdf(1), Bsdf(2)],
        [Bsdf(6), Light(7, 0)],
    ] {
        let [some, many] = [64, 256].map(|samples| even(samples, pairs));
        assert!(some > 0.9 && many == 1.0, "{pairs:?}: {some} {many}");
    }
    // All other pairs of dimensions are independent.
    for pairs in [[Bsdf(0), OpacityAndRoulette(1)], [Bsdf(3), Bsdf(4)]] {
        let many = even(256, pairs);
        assert!(many < 0.5, "{pairs:?}: {many}");
    }
}

#[test]
fn three_pairs_of_a_group_cover_most_combinations() {
    for pairs in [
        [Dimension::PixelFilter, Dimension::Bsdf(0), Dimension::Bsdf(1)],
        [Dimension::LobeAndLight(0), Dimension::LobeAndLight(1), Dimension::LobeAndLight(2)],
        [Dimension::Bsdf(4), Dimension::Light(5, 0), Dimension::LobeAndLight(6)],
    ] {
        let mut met = vec![false; 1 << 12];
        for sample in 0..1 << 14 {
            let sampler = Sampler::new(1, 0, [4, 5], sample);
            let cell = |cell, &pair: &Dimension| cell << 4 | (sampler.get_2d(pair)[0] * 16.0) as usize;
            met[pairs.iter().fold(0, cell)] = true;
        }
        // The first 1024 samples occupy 1024 of the 4096 cells, and the following samples mostly occupy other cells.
        let met = met.into_iter().filter(|&met| met).count();
        assert!(met > 3000, "{pairs:?}: {met}");
    }
}

#[test]
fn second_dimension_is_the_sobol_sequence() {
    let sobol_second = |index| sobol_dim2(index).reverse_bits();
    // The direction numbers m are 1, 3, 5, 15, ...; each is (2 m) xor m of the previous number.
    let mut m: u64 = 1;
    for bit in 0..32 {
        assert_eq!(u64::from(sobol_second(1 << bit)), m << (31 - bit));
        m ^= 2 * m;
    }
    assert_eq!(sobol_second(0b101), sobol_second(1) ^ sobol_second(0b100));
}

#[test]
fn batched_numbers_equal_single_numbers() {
    let samplers: Vec<_> = (0..50).map(|x| Sampler::new(4, 0, [x, 2], x / 3)).collect();
    let which = || (0..50).filter(|i| i % 7 != 3);
    let mut out = vec![[2.0; 2]];
    for pair in [Dimension::PixelFilter, Dimension::Bsdf(3), Dimension::Light(0, 63)] {
        Sampler::get_2d_many(&samplers, which(), [pair], [&mut out]);
        let alone: Vec<_> = which().map(|i| samplers[i].get_2d(pair)).collect();
        assert_eq!(out, alone);
    }
    assert!((0..1000).all(|i| reverse_bits(splitmix64(i) as u32) == (splitmix64(i) as u32).reverse_bits()));
}

#[test]
fn pixels_dimensions_frames_and_seeds_are_independent() {
    let base = (5, 2, [10, 20], 3, Dimension::PixelFilter);
    let of = |(seed, frame, pixel, sample, pair)| Sampler::new(seed, frame, pixel, sample).get_2d(pair);
    let others = [
        (6, 2, [10, 20], 3, Dimension::PixelFilter),
        (5, 3, [10, 20], 3, Dimension::PixelFilter),
        (5, 2, [11, 20], 3, Dimension::PixelFilter),
        (5, 2, [10, 21], 3, Dimension::PixelFilter),
        (5, 2, [10, 20], 4, Dimension::PixelFilter),
        (5, 2, [10, 20], 3, Dimension::AmbientOcclusion),
        (5, 2, [10, 20], 3, Dimension::Light(0, 0)),
    ];
    for other in others {
        assert_ne!(of(base), of(other), "{other:?}");
    }
    let n = 20_000;
    let product = |i: u32| {
        let at = |frame| Sampler::new(0, frame, [3, 0], 0).get_2d(Dimension::PixelFilter)[0] - 0.5;
        f64::from(at(i) * at(i + 1))
    };
    let covariance = (0..n).map(product).sum::<f64>() / f64::from(n);
    assert!(covariance.abs() < 4.0 / 12.0 / f64::from(n).sqrt(), "{covariance}");
}

#[test]
fn samples_of_a_square_of_pixels_form_a_digital_net() {
    for (side, corner, bits) in [(2, [0, 0], 10), (2, [70, 202], 10), (4, [8, 60], 8), (8, [72, 24], 8)] {
        for samples in (0..=bits).map(|k| 1 << k) {
            let pixels = (0..side * side).map(|i| [corner[0] + i % side, corner[1] + i / side]);
            let points: Vec<_> = pixels
                .flat_map(|pixel| (0..samples).map(move |sample| (pixel, sample)))
                .map(|(pixel, sample)| Sampler::new(8, 0, pixel, sample).get_2d(Dimension::Bsdf(1)))
                .collect();
            for columns in (0..=points.len().ilog2()).map(|bits| 1 << bits) {
                let mut cells = vec![0; points.len()];
                let rows = points.len() / columns;
                for [x, y] in &points {
                    let column = (x * columns as f32) as usize;
                    cells[(y * rows as f32) as usize * columns + column] += 1;
                }
                let even = cells.iter().all(|&count| count == 1);
                assert!(even, "{samples} samples, {columns} columns of {side} by {side}");
            }
        }
    }
}

/// Squared error of the mean over a square of pixels, relative to independent pixels.
fn together(side: u32, samples: u32, mean: f64, f: impl Fn(&Sampler) -> f64) -> f64 {
    const SIZE: u32 = 64;
    let off = |seed, [x, y]: [u32; 2]| {
        let value = |sample| f(&Sampler::new(seed, 0, [x, y], sample));
        (0..samples).map(value).sum::<f64>() / f64::from(samples) - mean
    };
    let (mut alone, mut together) = (0.0, 0.0);
    for seed in 0..16 {
        for block in 0..(SIZE / side).pow(2) {
            let corner = [block % (SIZE / side), block / (SIZE / side)].map(|n| n * side);
            let pixels = (0..side * side).map(|i| [corner[0] + i % side, corner[1] + i / side]);
            let all: Vec<_> = pixels.map(|pixel| off(seed, pixel)).collect();
            alone += all.iter().map(|off| off * off).sum::<f64>();
            together += all.iter().sum::<f64>().powi(2);
        }
    }
    together / alone
}

#[test]
fn errors_of_neighbouring_pixels_cancel() {
    let [product, disk] =
        [|[x, y]: [f32; 2]| f64::from(x * y), |[x, y]: [f32; 2]| f64::from(u8::from(x * x + y * y < 1.0))];
    // The integrand is a product of three factors exp(-3 |x - y|); its mean is the cube of the mean of one factor.
    let mean = (2.0 / 3.0 - 2.0 / 9.0 * (1.0 - (-3f64).exp())).powi(3);
    for samples in [1, 4, 7, 16] {
        let ratio = |side, mean, f: fn([f32; 2]) -> f64| {
            together(side, samples, mean, |sampler| f(sampler.get_2d(Dimension::PixelFilter)))
        };
        // Sample counts that are not a power of two are less well stratified.
        let most = if samples == 7 { 0.9 } else { 0.1 };
        let smooth = ratio(4, 0.25, product);
        assert!(smooth < most, "{samples}: {smooth}");
        let edge = ratio(4, std::f64::consts::FRAC_PI_4, disk);
        assert!(edge < most.max(0.4), "{samples}: {edge}");
        // For functions that depend on many dimensions at once, the samples are not stratified; blue noise
        // must not make the error much larger.
        let much = together(2, samples, mean, |sampler| {
            let [a, b] = sampler.get_2d(Dimension::PixelFilter);
            let [c, d] = sampler.get_2d(Dimension::Bsdf(0));
            let [e, f] = sampler.get_2d(Dimension::Light(0, 0));
            f64::from((-3.0 * ((a - d).abs() + (c - e).abs() + (f - b).abs())).exp())
        });
        assert!(much < 1.3, "{samples}: {much}");
    }
}
