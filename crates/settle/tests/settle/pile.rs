//! Objects that are dropped into a bin.

use glam::DAffine3;
use raycam_scene::World;
use raycam_scene::mesh::primitive;
use raycam_settle::{Place, Request, Target, settle};

use crate::common::{add, moved, request};

/// Creates a bin of five boxes with `count` objects above it; returns the world, the indices of the objects, and the
/// indices of the boxes.
fn bin(count: usize) -> (World, Vec<usize>, Vec<usize>) {
    let mut world = World::default();
    let mut wall = |name: &str, size: [f64; 3], x: f64, y: f64, z: f64| {
        add(&mut world, name, primitive::box_(size).unwrap(), moved(x, y, z))
    };
    let sides = vec![
        wall("bottom", [0.4, 0.3, 0.01], 0.0, 0.0, 0.005),
        wall("left", [0.01, 0.3, 0.15], -0.195, 0.0, 0.085),
        wall("right", [0.01, 0.3, 0.15], 0.195, 0.0, 0.085),
        wall("front", [0.38, 0.01, 0.15], 0.0, -0.145, 0.085),
        wall("back", [0.38, 0.01, 0.15], 0.0, 0.145, 0.085),
    ];
    let things = (0..count)
        .map(|i| {
            let mesh = match i % 4 {
                0 => primitive::box_([0.06, 0.04, 0.03]),
                1 => primitive::cylinder(0.02, 0.07, 32),
                2 => primitive::sphere(0.025, 3),
                _ => primitive::torus(0.03, 0.008, 24),
            };
            add(&mut world, &format!("thing-{i}"), mesh.unwrap(), DAffine3::IDENTITY)
        })
        .collect();
    (world, sides, things)
}

fn into_bin(things: &[usize], sides: &[usize], seed: u64) -> Request {
    let target = Some(Target { objects: sides.to_vec(), place: Place::Into });
    Request { target, seed, ..request(things) }
}

#[test]
fn piles_in_a_bin_rest_without_penetration() {
    let (world, sides, things) = bin(20);
    let settled = settle(&world, &into_bin(&things, &sides, 7), &|| false).unwrap();
    assert!(settled.report.penetration <= 2e-4, "{:?}", settled.report);
    assert!(settled.report.motion <= 1e-4, "{:?}", settled.report);
    for transform in &settled.transforms {
        let center = transform.translation;
        assert!(center.x.abs() < 0.19 && center.y.abs() < 0.14 && center.z > 0.01, "{center}");
        let linear = transform.matrix3;
        assert!((linear.transpose() * linear).abs_diff_eq(glam::DMat3::IDENTITY, 1e-12));
    }
}

#[test]
fn equal_requests_give_equal_bytes() {
    let (world, sides, things) = bin(6);
    let poses = |seed| settle(&world, &into_bin(&things, &sides, seed), &|| false).unwrap().transforms;
    let first = poses(3);
    let again = std::thread::spawn({
        let (world, request) = (world.clone(), into_bin(&things, &sides, 3));
        move || settle(&world, &request, &|| false).unwrap().transforms
    });
    assert_eq!(first, again.join().unwrap());
    assert_ne!(first, poses(4));
}

/// Hashes of settled piles, recorded on x86-64: number of objects, seed, hash.
const RECORDED: [(usize, u64, u64); 4] = [
    (10, 0, 0x8652_c71b_6a99_0f69),
    (10, 1, 0x434f_d8f8_78b0_3260),
    (10, 2, 0x581c_b685_7b2b_33a8),
    (20, 0, 0x5e64_dd7b_003b_0f29),
];

/// FNV-1a hash of the bits of all numbers of the transforms.
fn hash(transforms: &[DAffine3]) -> u64 {
    let numbers = transforms.iter().flat_map(|transform| transform.to_cols_array());
    let bytes = numbers.flat_map(|number| number.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[test]
fn piles_have_the_recorded_bytes_on_every_processor() {
    let found = RECORDED.map(|(count, seed, _)| {
        let (world, sides, things) = bin(count);
        let settled = settle(&world, &into_bin(&things, &sides, seed), &|| false).unwrap();
        (count, seed, hash(&settled.transforms))
    });
    assert_eq!(found, RECORDED, "{found:#x?}");
}

#[test]
fn object_order_does_not_affect_objects_that_do_not_touch() {
    // The target is one large floor, because two distant tables would be two targets. On it, the three small objects do
    // not touch each other.
    let mut world = World::default();
    let floor = add(&mut world, "floor", primitive::box_([20.0, 20.0, 0.1]).unwrap(), moved(0.0, 0.0, -0.05));
    let things: Vec<usize> = (0..3)
        .map(|i| {
            add(&mut world, &format!("box-{i}"), primitive::box_([0.1, 0.07, 0.05]).unwrap(), moved(0.0, 0.0, 0.0))
        })
        .collect();
    let request = |order: &[usize]| Request {
        target: Some(Target { objects: vec![floor], place: Place::On }),
        seed: 5,
        ..request(order)
    };
    let forward = settle(&world, &request(&things), &|| false).unwrap().transforms;
    let backward = settle(&world, &request(&[things[2], things[1], things[0]]), &|| false).unwrap().transforms;
    for (a, b) in forward.iter().zip(backward.iter().rev()) {
        assert!(a.abs_diff_eq(*b, 1e-9), "{a:?} {b:?}");
    }
}

/// Tests many seeds; 1,000 if `RAYCAM_PROOF` is set.
#[test]
fn objects_settle_for_many_seeds() {
    let count = if std::env::var_os("RAYCAM_PROOF").is_some() { 1000 } else { 3 };
    let (world, sides, things) = bin(10);
    let fails = |seed: &u64| {
        let settled = settle(&world, &into_bin(&things, &sides, *seed), &|| false);
        !settled.is_ok_and(|settled| settled.report.penetration <= 2e-4)
    };
    let failed: Vec<u64> = (0..count).filter(fails).collect();
    assert!(failed.is_empty(), "seeds {failed:?}");
}

#[test]
fn bodies_that_miss_the_bin_are_drawn_again_and_other_bodies_stay() {
    let (world, sides, things) = bin(20);
    let attempts: Vec<usize> = (4..8)
        .map(|seed| settle(&world, &into_bin(&things, &sides, seed), &|| false).unwrap().report.attempts)
        .collect();
    // Only bodies that miss the target fall again, so few attempts are necessary; one of these piles needs two.
    assert!((5..=12).contains(&attempts.iter().sum::<usize>()), "{attempts:?}");
}
