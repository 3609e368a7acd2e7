//! Light selection: probabilities sum to 1 and match the draws, and no light is missed.

use glam::{DVec3, Vec3};
use raycam_scene::Light;

use super::*;
use crate::light::bounds::LightBounds;
use crate::light::light_sampling::LightSampling;
use crate::light::tree::{LightTree, MAX_SPLIT_LIGHTS, RecentNodes};
use crate::prepare::world::PreparedWorld;

/// Point, spot and rectangle lights at random positions; one light has no power.
fn many() -> Vec<Light> {
    let at = |i: u32| {
        let [x, y] = random(3 * i);
        let [z, _] = random(3 * i + 1);
        [x, y, z].map(|v| 8.0 * f64::from(v) - 4.0)
    };
    (0..40)
        .map(|i| {
            let [x, y, z] = at(i);
            let power = if i == 7 { 0.0 } else { 1.0 + i as f32 };
            match i % 3 {
                0 => Light::Point {
                    position: [x, y, z + 5.0],
                    power: Some([power; 3]),
                    intensity: None,
                    radius: 0.1 * f64::from(i % 2),
                },
                1 => Light::Spot {
                    position: [x, y, z + 5.0],
                    direction: [0.2 * x, 0.2 * y, -1.0],
                    power: None,
                    intensity: Some([power; 3]),
                    inner: 20.0,
                    outer: 60.0,
                    radius: 0.0,
                },
                _ => area([x, y, z + 5.0], [0.5, 0.0, 0.1], [0.0, -0.5, 0.0]),
            }
        })
        .collect()
}

fn points() -> Vec<LightSampleContext> {
    (0..24)
        .map(|i| {
            let [x, y] = random(1000 + i);
            let [a, b] = random(2000 + i);
            let normal = Vec3::new(a - 0.5, b - 0.5, 0.7).normalize();
            LightSampleContext {
                position: DVec3::new(f64::from(x), f64::from(y), 0.1) * 10.0 - 5.0,
                normal: if i % 3 == 0 { Vec3::ZERO } else { normal },
            }
        })
        .collect()
}

fn tree_of(lights: &[Light]) -> (LightTree, usize) {
    let bounds: Vec<LightBounds> = lights.iter().map(|light| source(light.clone()).bounds()).collect();
    (LightTree::new(&bounds), bounds.len())
}

/// A curved panel of small lights of different powers, five metres above. At most points, parts of this tree count as
/// groups of similar lights.
fn panel() -> Vec<LightBounds> {
    (0..400)
        .map(|i| {
            let [x, y] = [i % 20, i / 20].map(|n| f64::from(n) * 0.02);
            let corners = [[0.0, 0.0], [0.02, 0.0], [0.0, 0.02]].map(|[u, v]| DVec3::new(x + u, y + v, 5.0 + x * x));
            let down = DVec3::new(2.0 * x, 0.0, -1.0).normalize();
            let power = if i == 7 { 0.0 } else { 1.0 + f64::from(i % 5) };
            LightBounds::planar(&corners, down, Vec3::splat(power as f32), false)
        })
        .collect()
}

#[test]
fn light_probabilities_sum_to_one_and_match_the_draws() {
    let bounds = |light: &Light| source(light.clone()).bounds();
    let lights: Vec<LightBounds> = many().iter().map(bounds).collect();
    points().iter().for_each(|from| check_probabilities(&lights, from));
    let near = LightSampleContext { position: DVec3::new(0.2, 0.2, 4.9), normal: Vec3::Z };
    points().iter().chain([&near]).for_each(|from| check_probabilities(&panel(), from));
}

fn check_probabilities(lights: &[LightBounds], from: &LightSampleContext) {
    const DRAWS: u32 = 1 << 16;
    let (tree, count) = (LightTree::new(lights), lights.len());
    let stated: Vec<f64> = (0..count).map(|i| tree.pmf(&from.into(), i)).collect();
    // The sum is below 1 because a few draws end at a node without a selectable child.
    let sum: f64 = stated.iter().sum();
    assert!(sum > 0.8 && sum < 1.0 + 1e-5, "{sum}");
    assert_eq!(stated[7], 0.0, "a light of power 0 must never be chosen");
    // The numbers are evenly spaced. The count of a light is off by at most one draw at each end of the intervals that
    // select it.
    let (mut found, mut lost) = (vec![0.0; count], 0.0);
    for n in 0..DRAWS {
        let number = (f64::from(n) + 0.5) / f64::from(DRAWS);
        let Some((light, probability)) = tree.sample(&from.into(), number, None) else {
            lost += 1.0;
            continue;
        };
        assert!((probability / stated[light] - 1.0).abs() < 1e-5);
        found[light] += 1.0;
    }
    for (found, stated) in found.iter().zip(&stated) {
        let off: f64 = found - stated * f64::from(DRAWS);
        assert!(off.abs() <= 2.0, "{found} of {stated}");
    }
    let off: f64 = lost / f64::from(DRAWS) - (1.0 - sum);
    assert!(off.abs() < 1e-3, "{lost} draws chose no light, but the probabilities sum to {sum}");
}

#[test]
fn several_draws_at_a_point_equal_single_draws() {
    let deep: Vec<LightBounds> = (0..100_000)
        .map(|i| {
            let ([x, y], [z, power]) = (random(2 * i), random(2 * i + 1));
            let at = DVec3::new(x.into(), y.into(), z.into()) * 10.0;
            LightBounds::isotropic(at, at, Vec3::splat(power))
        })
        .collect();
    let mut found = 0;
    for tree in [LightTree::new(&deep), LightTree::new(&panel())] {
        for from in points() {
            let mut recent = RecentNodes::default();
            for n in 0..64 {
                // The numbers increase, then they have any order.
                let number = if n < 32 { f64::from(n) / 32.0 } else { f64::from(random(n)[0]) };
                let again = tree.sample(&(&from).into(), number, Some(&mut recent));
                assert_eq!(again, tree.sample(&(&from).into(), number, None));
                found += usize::from(again.is_some());
            }
        }
    }
    assert!(found > 300, "{found}");
}

#[test]
fn light_choice_is_unbiased() {
    const SAMPLES: u32 = 1 << 17;
    let many = many();
    let lights = lights(&many);
    let nothing = PreparedWorld::new(&raycam_scene::World::default(), None, None, &crate::Control::new()).unwrap();
    let from = LightSampleContext { position: DVec3::new(0.3, -0.2, 0.0), normal: Vec3::Z };
    // The sum of the lights alone must equal the light of all lights, for both kinds of selection.
    let alone: f64 = many.iter().map(|light| irradiance(&source(light.clone()), &from, 1 << 10)).sum();
    for choice in [LightSampling::Importance, LightSampling::Uniform] {
        let one = |n: u32| {
            let [which, _] = random(n + 7_000_000);
            let [x, y] = Sampler::new(9, 0, [1, 2], n).get_2d(Dimension::Light(0, 0));
            let sample = lights.sample(&(&from).into(), &nothing.geometry, choice, which, &[x, y].into())?;
            let cosine = f64::from(sample.direction.dot(from.normal).max(0.0));
            Some(f64::from(sample.radiance.y) / f64::from(sample.pdf) * cosine)
        };
        let found = (0..SAMPLES).filter_map(one).sum::<f64>() / f64::from(SAMPLES);
        close(found, alone, 1e-2);
    }
    // Split sampling must find the same light.
    let mut found = 0.0;
    for n in 0..SAMPLES / 8 {
        let [which, _] = random(n + 7_000_000);
        let sampler = Sampler::new(9, 0, [1, 2], n);
        let random = |index| Some(sampler.get_2d(Dimension::Light(0, index)).into());
        lights.sample_split(&(&from).into(), &nothing.geometry, which, random, |_, sample, _| {
            let cosine = f64::from(sample.direction.dot(from.normal).max(0.0));
            found += f64::from(sample.radiance.y) / f64::from(sample.pdf) * cosine;
        });
    }
    close(found / f64::from(SAMPLES / 8), alone, 1e-2);
}

#[test]
fn light_samples_match_their_expected_counts() {
    const DRAWS: u32 = 1 << 14;
    for (many, most) in [(many(), MAX_SPLIT_LIGHTS), (many()[..3].to_vec(), 3)] {
        let (tree, count) = tree_of(&many);
        for from in points() {
            let expected: Vec<f64> = (0..count).map(|i| tree.expected_count(&(&from).into(), i)).collect();
            let mut found = vec![0.0; count];
            for n in 0..DRAWS {
                let number = (f64::from(n) + 0.5) / f64::from(DRAWS);
                tree.sample_split(&(&from).into(), number, |index, light, stated| {
                    assert!(index < most);
                    assert!((stated / expected[light] - 1.0).abs() < 1e-5);
                    found[light] += 1.0 / f64::from(DRAWS);
                });
            }
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() < 2e-3, "{found} of {expected}");
            }
        }
    }
}

#[test]
fn light_tree_depth_is_bounded_by_the_number_of_lights() {
    let at = |i: u32| DVec3::X * f64::from(i).exp2();
    // First all lights are at one position, then the distances of the lights halve from one to the next.
    let heap: Vec<LightBounds> = (0..1000).map(|_| LightBounds::isotropic(at(0), at(0), Vec3::ONE)).collect();
    let row: Vec<LightBounds> =
        (0..1000).map(|i| LightBounds::isotropic(at(i % 120), at(i % 120), Vec3::ONE)).collect();
    let from = LightSampleContext { position: DVec3::ZERO, normal: Vec3::ZERO };
    for lights in [heap, row] {
        let tree = LightTree::new(&lights);
        assert_eq!(tree.count(), lights.len());
        let sum: f64 = (0..lights.len()).map(|i| tree.pmf(&(&from).into(), i)).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}

#[test]
fn large_light_trees_do_not_depend_on_thread_count() {
    // This number of lights is split by several threads, mostly from subsamples of the lights.
    let lights: Vec<LightBounds> = (0..9000)
        .map(|i| {
            let ([x, y], [z, size]) = (random(2 * i), random(2 * i + 1));
            let at = DVec3::new(x.into(), y.into(), z.into()) * 10.0;
            LightBounds::isotropic(at, at + 0.01 * f64::from(size), Vec3::splat(size))
        })
        .collect();
    let built = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| LightTree::new(&lights))
    };
    let tree = built(1);
    assert_eq!(format!("{tree:?}"), format!("{:?}", built(3)));
    for from in points() {
        let stated = |i| tree.pmf(&(&from).into(), i);
        let sum: f64 = (0..lights.len()).map(stated).sum();
        assert!((sum - 1.0).abs() < 1e-4 || from.normal != Vec3::ZERO, "{sum}");
        let (light, probability) = tree.sample(&(&from).into(), 0.3, None).unwrap();
        assert!((probability / stated(light) - 1.0).abs() < 1e-5);
    }
}
