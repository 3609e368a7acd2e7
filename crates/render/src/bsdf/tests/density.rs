//! These tests check that samples are distributed according to the reported density, and that the density integrates to
//! one.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::bsdf::BsdfEval;
use crate::bsdf::tests::*;
use crate::sampling::chi_squared::{limit, statistic};

/// Grid over the directions on one side of the surface, in polar coordinates (distance and azimuth) around a centre;
/// cells are finer near the centre.
struct Chart {
    center: DVec3,
    right: DVec3,
    up: DVec3,
    side: f64,
}

impl Chart {
    fn new(center: DVec3, side: f64) -> Self {
        let (right, up) = center.any_orthonormal_pair();
        Self { center, right, up, side }
    }

    /// Returns the direction at a point of the unit square, and the solid angle per area at this point; `None` if the
    /// direction is on the other side.
    fn at(&self, place: DVec2) -> Option<(DVec3, f64)> {
        let height = 2.0 * place.x.powi(4);
        let (sin, cos) = (TAU * place.y).sin_cos();
        let radius = (height * (2.0 - height)).max(0.0).sqrt();
        let direction = (self.right * cos + self.up * sin) * radius + self.center * (1.0 - height);
        let solid = TAU * 8.0 * place.x.powi(3);
        (direction.z * self.side > 0.0).then_some((direction, solid))
    }

    /// Integrates `density` over a cell by the midpoint rule.
    fn integrate(&self, [x, y]: [usize; 2], density: impl Fn(DVec3) -> f64) -> f64 {
        let sum = |points: usize| {
            let (mut sum, mut inside) = (0.0, 0);
            for i in 0..points * points {
                let [i, j] = [i % points, i / points].map(|i| (i as f64 + 0.5) / points as f64);
                let place = DVec2::new((x as f64 + i) / OUT as f64, (y as f64 + j) / AROUND as f64);
                if let Some((direction, solid)) = self.at(place) {
                    sum += density(direction) * solid;
                    inside += 1;
                }
            }
            (sum / (OUT * AROUND * points * points) as f64, inside)
        };
        let (integral, inside) = sum(FINE);
        // The density jumps at the horizon, so the midpoint rule is inexact in cells that the horizon cuts.
        if inside == 0 || inside == FINE * FINE { integral } else { sum(FINEST).0 }
    }

    fn of(&self, d: DVec3) -> DVec2 {
        // Computing 1 - cos from the distance keeps precision near the centre.
        let height = (d - self.center).length_squared() / 2.0;
        let turn = d.dot(self.up).atan2(d.dot(self.right)) / TAU;
        DVec2::new((height / 2.0).clamp(0.0, 1.0).powf(0.25), turn.rem_euclid(1.0))
    }
}

/// Cells on each side of the surface: `OUT` from a chart's centre outwards, times `AROUND` around the centre. A cell
/// has `FINE` x `FINE` quadrature points, and a cell that the horizon cuts has `FINEST` x `FINEST`.
const OUT: usize = 24;
const AROUND: usize = 16;
const FINE: usize = 14;
const FINEST: usize = 112;
const SAMPLES: usize = 1 << 20;

/// Compares a material's samples with its density by a chi-squared test; returns a description of the deviation, if
/// any.
fn check(
    name: &str,
    scatter: &Bsdf,
    frame: &ShadingFrame,
    refracted: Vec3,
    tests: usize,
    random: &mut Random,
) -> Option<String> {
    let v = frame.wo.as_dvec3();
    let charts = [Chart::new(DVec3::new(-v.x, -v.y, v.z), 1.0), Chart::new(refracted.as_dvec3().normalize(), -1.0)];
    let mut expected = vec![0.0f64; 2 * OUT * AROUND];
    for (side, chart) in charts.iter().enumerate() {
        for cell in 0..OUT * AROUND {
            let density = |direction: DVec3| f64::from(scatter.eval(frame, direction.as_vec3()).pdf);
            expected[side * OUT * AROUND + cell] = chart.integrate([cell / AROUND, cell % AROUND], density);
        }
    }
    // The density integrates to 1. If samples may be absorbed, the missing part must equal the fraction of random
    // numbers for which no sample is returned.
    let total: f64 = expected.iter().sum();
    let mut kept = 0.0;
    const SPREAD: usize = 1 << 19;
    for i in 0..SPREAD {
        let sample = scatter.sample(frame, spread(i as u32));
        kept += f64::from(u8::from(sample.is_some_and(|sample| !sample.is_specular)));
    }
    let kept = kept / SPREAD as f64;
    if (total - kept).abs() > 1e-3 {
        return Some(format!("{name}: {total}, expected {kept}"));
    }
    let mut seen = vec![0.0f64; 2 * OUT * AROUND];
    for i in 0..SAMPLES {
        let numbers = [random.next(), random.next(), random.next()];
        let Some(sample) = scatter.sample(frame, numbers).filter(|s| !s.is_specular) else {
            continue;
        };
        let d = sample.wi.as_dvec3();
        if i % 16 == 0 {
            let BsdfEval { value, pdf } = scatter.eval(frame, sample.wi);
            let off = (value / pdf - sample.weight).abs().max_element();
            assert!(
                off <= 1e-5 * sample.weight.max_element() && (pdf / sample.pdf - 1.0).abs() <= 1e-5,
                "{name}: {value} / {pdf} is not {} with {}",
                sample.weight,
                sample.pdf
            );
        }
        let side = usize::from(d.z < 0.0);
        let place = charts[side].of(d);
        let x = ((place.x * OUT as f64) as usize).min(OUT - 1);
        let y = ((place.y * AROUND as f64) as usize).min(AROUND - 1);
        seen[(side * OUT + x) * AROUND + y] += 1.0;
    }
    let expected = expected.iter().map(|share| share * SAMPLES as f64);
    let (chi2, freedom) = statistic(seen.iter().copied().zip(expected));
    let limit = limit(freedom, tests);
    (chi2 >= limit).then(|| format!("{name}: chi squared {chi2} > {limit} of {freedom} cells"))
}

/// Direction of smooth refraction, which is the centre of a refracting lobe; without refraction, the opposite direction
/// of `wo`.
fn refracted(name: &str, frame: &ShadingFrame) -> Vec3 {
    let eta = match name.split(' ').collect::<Vec<_>>()[..] {
        ["glass", _, "false", "true"] | ["solid", _, "true"] => 1.5,
        ["glass", _, "false", "false"] | ["solid" | "mixed", _, "false"] => 1.0 / 1.5,
        _ => 1.0,
    };
    crate::lobes::fresnel::refract(frame.wo, Vec3::Z, eta).unwrap_or(-frame.wo)
}

#[test]
fn bsdf_samples_follow_their_density() {
    let cases = || {
        let (lossless, lossy) = all();
        let all: Vec<_> = lossless.into_iter().chain(lossy).collect();
        // Mirrors are excluded because they have no density, and lobes that are thin strips because the furnace test
        // covers them.
        let dense = |name: &str| name != "brushed 0.1" && !format!("{name} ").contains(" 0 ");
        let dense: Vec<_> = all.into_iter().filter(|(name, _)| dense(name)).collect();
        dense
    };
    let tests = 2 * cases().len();
    // Two threads each test one viewing angle, with their own random numbers.
    let wrong = std::thread::scope(|scope| {
        let halves = [20.0f32, 70.0].map(|degrees| {
            scope.spawn(move || {
                let frame = frame(degrees, 0.3);
                let mut wrong = vec![];
                for (i, (name, make)) in cases().iter().enumerate() {
                    let refracted = refracted(name, &frame);
                    let name = format!("{name} at {degrees}");
                    let mut random = Random(11 + i as u64 * 1000 + degrees as u64);
                    let scatter = make(&frame);
                    wrong.extend(check(&name, &scatter, &frame, refracted, tests, &mut random));
                }
                wrong
            })
        });
        halves.map(|half| half.join().unwrap()).concat()
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
