//! Samples are as dense as they say, and the whole density is one.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::*;
use crate::scatter::Value;

/// The directions on one side of the surface, by how far they are from a centre and which way: finer the nearer.
struct Chart {
    center: DVec3,
    right: DVec3,
    up: DVec3,
    side: f64,
}

impl Chart {
    fn new(center: DVec3, side: f64) -> Self {
        let (right, up) = center.any_orthonormal_pair();
        Self {
            center,
            right,
            up,
            side,
        }
    }

    /// A direction at a place in the unit square, with its solid angle per area; `None` on the other side.
    fn at(&self, place: DVec2) -> Option<(DVec3, f64)> {
        let height = 2.0 * place.x.powi(4);
        let (sin, cos) = (TAU * place.y).sin_cos();
        let radius = (height * (2.0 - height)).max(0.0).sqrt();
        let direction = (self.right * cos + self.up * sin) * radius + self.center * (1.0 - height);
        let solid = TAU * 8.0 * place.x.powi(3);
        (direction.z * self.side > 0.0).then_some((direction, solid))
    }

    fn of(&self, d: DVec3) -> DVec2 {
        // 1 - cos from the distance: near the centre it keeps its digits.
        let height = (d - self.center).length_squared() / 2.0;
        let turn = d.dot(self.up).atan2(d.dot(self.right)) / TAU;
        DVec2::new(
            (height / 2.0).clamp(0.0, 1.0).powf(0.25),
            turn.rem_euclid(1.0),
        )
    }
}

/// Critical value of chi-squared at one-sided probability `p` (Wilson and Hilferty), `z` being the normal's.
fn critical(freedom: f64, z: f64) -> f64 {
    let t = 2.0 / (9.0 * freedom);
    freedom * (1.0 - t + z * t.sqrt()).powi(3)
}

/// Cells outwards and around, on both sides; points of a quadrature in each.
const OUT: usize = 24;
const AROUND: usize = 16;
const FINE: usize = 14;
const SAMPLES: usize = 1 << 18;
/// 0.01 over all tests of this file, some 130 (Sidak): 1 - 0.99^(1/130) = 7.7e-5.
const Z: f64 = 3.78;

/// What is wrong with it.
fn check(
    name: &str,
    scatter: &Scatter,
    frame: &Frame,
    refracted: Vec3,
    random: &mut Random,
) -> Option<String> {
    let v = frame.view.as_dvec3();
    let charts = [
        Chart::new(DVec3::new(-v.x, -v.y, v.z), 1.0),
        Chart::new(refracted.as_dvec3().normalize(), -1.0),
    ];
    let mut expected = vec![0.0f64; 2 * OUT * AROUND];
    for (side, chart) in charts.iter().enumerate() {
        for x in 0..OUT * FINE {
            for y in 0..AROUND * FINE {
                let place = DVec2::new(
                    (x as f64 + 0.5) / (OUT * FINE) as f64,
                    (y as f64 + 0.5) / (AROUND * FINE) as f64,
                );
                let Some((direction, solid)) = chart.at(place) else {
                    continue;
                };
                let pdf = f64::from(scatter.evaluate(frame, direction.as_vec3()).pdf);
                expected[(side * OUT + x / FINE) * AROUND + y / FINE] +=
                    pdf * solid / (OUT * FINE * AROUND * FINE) as f64;
            }
        }
    }
    // The whole is one: what is not found is what evenly spread numbers reject.
    let total: f64 = expected.iter().sum();
    let mut kept = 0.0;
    for i in 0..SAMPLES {
        let sample = scatter.sample(frame, spread(i as u32));
        kept += f64::from(u8::from(sample.is_some_and(|sample| !sample.delta)));
    }
    let kept = kept / SAMPLES as f64;
    if (total - kept).abs() > 1e-3 {
        return Some(format!("{name}: {total}, expected {kept}"));
    }
    let mut seen = vec![0.0f64; 2 * OUT * AROUND];
    for _ in 0..SAMPLES {
        let numbers = [random.next(), random.next(), random.next()];
        let Some(sample) = scatter.sample(frame, numbers).filter(|s| !s.delta) else {
            continue;
        };
        let d = sample.direction.as_dvec3();
        let Value { value, pdf } = scatter.evaluate(frame, sample.direction);
        let off = (value / pdf - sample.weight).abs().max_element();
        assert!(
            off <= 1e-5 * sample.weight.max_element() && (pdf / sample.pdf - 1.0).abs() <= 1e-5,
            "{name}: {value} / {pdf} is not {} with {}",
            sample.weight,
            sample.pdf
        );
        let side = usize::from(d.z < 0.0);
        let place = charts[side].of(d);
        let x = ((place.x * OUT as f64) as usize).min(OUT - 1);
        let y = ((place.y * AROUND as f64) as usize).min(AROUND - 1);
        seen[(side * OUT + x) * AROUND + y] += 1.0;
    }
    // Cells that hardly anything falls into count as one.
    let (mut chi, mut freedom, mut rest) = (0.0, 0.0, (0.0, 0.0));
    for (seen, expected) in seen.iter().zip(&expected) {
        let expected = expected * SAMPLES as f64;
        if expected < 10.0 {
            rest = (rest.0 + seen, rest.1 + expected);
        } else {
            chi += (seen - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if rest.1 > 10.0 {
        chi += (rest.0 - rest.1).powi(2) / rest.1;
        freedom += 1.0;
    }
    let limit = critical(freedom, Z);
    (chi >= limit).then(|| format!("{name}: chi squared {chi} > {limit} of {freedom} cells"))
}

#[test]
fn samples_are_as_dense_as_their_density_says() {
    let (lossless, lossy) = all();
    let cases: Vec<_> = lossless.iter().chain(&lossy).collect();
    // Both cores, each with its own numbers.
    let wrong = std::thread::scope(|scope| {
        let halves = [0, 1].map(|half| {
            let cases: Vec<(String, f32)> = cases
                .iter()
                .flat_map(|(name, _)| [20.0f32, 70.0].map(|degrees| (name.clone(), degrees)))
                .collect();
            scope.spawn(move || {
                let (lossless, lossy) = all();
                let made: Vec<_> = lossless.iter().chain(&lossy).collect();
                let mut wrong = vec![];
                for (i, (name, degrees)) in cases.iter().enumerate() {
                    // Mirrors have no density; the furnace knows lobes that are thin strips.
                    if i % 2 != half
                        || name == "brushed 0.1"
                        || name.ends_with(" 0")
                        || name.contains(" 0 ")
                    {
                        continue;
                    }
                    let frame = frame(*degrees, 0.3);
                    let (_, make) = made[i / 2];
                    let refracted = match name.starts_with("glass") && name.contains("false") {
                        true => {
                            let eta = if name.ends_with("true") {
                                1.5
                            } else {
                                1.0 / 1.5
                            };
                            crate::scatter::fresnel::refract(frame.view, Vec3::Z, eta)
                                .unwrap_or(-frame.view)
                        }
                        false => -frame.view,
                    };
                    let name = format!("{name} at {degrees}");
                    let mut random = Random(11 + i as u64 * 1000);
                    wrong.extend(check(&name, &make(&frame), &frame, refracted, &mut random));
                }
                wrong
            })
        });
        halves.map(|half| half.join().unwrap()).concat()
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
