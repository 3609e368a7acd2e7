//! Objects that fall from their poses in the world.

use glam::DVec3;
use raycam_scene::World;
use raycam_scene::mesh::primitive;
use raycam_settle::{Physics, SettleError, overlaps, settle};

use crate::common::{add, bowl, moved, request};

#[test]
fn stacked_boxes_stay_upright() {
    let mut world = World::default();
    add(&mut world, "table", primitive::box_([1.0, 1.0, 0.02]).unwrap(), moved(0.0, 0.0, -0.01));
    let boxes: Vec<usize> = (0..5)
        .map(|i| {
            let place = moved(0.0, 0.0, 0.026 + 0.051 * f64::from(i));
            add(&mut world, &format!("box-{i}"), primitive::box_([0.1, 0.1, 0.05]).unwrap(), place)
        })
        .collect();
    let settled = settle(&world, &request(&boxes), &|| false).unwrap();
    for (i, transform) in settled.transforms.iter().enumerate() {
        let expected = DVec3::new(0.0, 0.0, 0.025 + 0.05 * i as f64);
        let off = transform.translation - expected;
        assert!(off.truncate().length() < 1e-3, "box {i} slid by {off}");
        // Each contact leaves a gap of at most twice the skin thickness.
        assert!((-1e-4..1e-3).contains(&off.z), "box {i} rests {off} away from its expected position");
        assert!(transform.matrix3.z_axis.z > 0.9999, "box {i} tilts");
    }
    assert!(settled.report.penetration <= 2e-4);
}

#[test]
fn balls_in_a_bowl_rest_at_the_lowest_point() {
    let mut world = World::default();
    add(&mut world, "bowl", bowl(0.2, 0.1, 48), moved(0.0, 0.0, 0.0));
    let ball = add(&mut world, "ball", primitive::sphere(0.02, 3).unwrap(), moved(0.12, 0.03, 0.12));
    let settled = settle(&world, &request(&[ball]), &|| false).unwrap();
    let center = settled.transforms[0].translation;
    assert!(center.truncate().length() < 8e-3, "the ball lies at {center}");
    assert!((0.0195..0.0215).contains(&center.z), "the ball lies at {center}");
}

#[test]
fn fine_ball_in_a_bowl_comes_to_rest_before_the_time_limit() {
    // The finer the ball, the longer it rolls to and fro. Without drag, this ball still moves after 5 s.
    let mut world = World::default();
    add(&mut world, "bowl", bowl(0.2, 0.1, 24), moved(0.0, 0.0, 0.0));
    let ball = add(&mut world, "ball", primitive::sphere(0.02, 5).unwrap(), moved(0.12, 0.03, 0.12));
    let settled = settle(&world, &request(&[ball]), &|| false).unwrap();
    let center = settled.transforms[0].translation;
    assert!(center.truncate().length() < 8e-3, "the ball lies at {center}");
}

#[test]
fn ring_dropped_over_a_peg_comes_to_rest_around_it() {
    // If the ring were represented by its hull, it would stay on top of the peg.
    let mut world = World::default();
    add(&mut world, "floor", primitive::plane([2.0; 2]).unwrap(), moved(0.0, 0.0, 0.0));
    add(&mut world, "peg", primitive::cylinder(0.01, 0.1, 32).unwrap(), moved(0.0, 0.0, 0.05));
    let ring = add(&mut world, "ring", primitive::torus(0.05, 0.01, 32).unwrap(), moved(0.0, 0.0, 0.15));
    let settled = settle(&world, &request(&[ring]), &|| false).unwrap();
    let low = settled.transforms[0].translation.z;
    assert!((0.0099..0.0105).contains(&low), "the ring lies at a height of {low}");
}

#[test]
fn flat_objects_that_should_fall_are_refused() {
    let mut world = World::default();
    let sheet = add(&mut world, "sheet", primitive::plane([1.0; 2]).unwrap(), moved(0.0, 0.0, 1.0));
    let refused = settle(&world, &request(&[sheet]), &|| false).unwrap_err();
    assert_eq!(refused, SettleError::NoVolume { name: "sheet".into() });
}

#[test]
fn objects_without_ground_are_refused() {
    let mut world = World::default();
    let ball = add(&mut world, "ball", primitive::sphere(0.02, 2).unwrap(), moved(0.0, 0.0, 1.0));
    let refused = settle(&world, &request(&[ball]), &|| false).unwrap_err();
    assert!(matches!(refused, SettleError::NotSettled { attempts: 1, .. }), "{refused}");
    let text = refused.to_string();
    assert!(text.contains("increase seconds") && !text.contains("another seed"), "{text}");
}

#[test]
fn numbers_out_of_range_are_refused() {
    let world = World::default();
    let mut negative = request(&[]);
    negative.seconds = -1.0;
    let mut bouncy = request(&[]);
    bouncy.physics = vec![(0, Physics { restitution: 1.5, ..Physics::default() })];
    for wrong in [negative, bouncy] {
        assert!(matches!(settle(&world, &wrong, &|| false), Err(SettleError::OutOfRange(_))));
    }
}

#[test]
fn settling_ends_when_it_is_cancelled() {
    let mut world = World::default();
    let ball = add(&mut world, "ball", primitive::sphere(0.02, 2).unwrap(), moved(0.0, 0.0, 1.0));
    assert_eq!(settle(&world, &request(&[ball]), &|| true).unwrap_err(), SettleError::Cancelled);
}

#[test]
fn overlaps_list_pairs_of_different_groups() {
    let mut world = World::default();
    let cube = || primitive::box_([1.0; 3]).unwrap();
    add(&mut world, "a", cube(), moved(0.0, 0.0, 0.0));
    add(&mut world, "b", cube(), moved(0.9, 0.1, 0.2));
    add(&mut world, "c", cube(), moved(2.5, 0.0, 0.0));
    let found = overlaps(&world, &[0, 1, 2], 2e-4);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].objects, [0, 1]);
    assert!((found[0].depth - 0.1).abs() < 1e-9);
    assert!(overlaps(&world, &[0, 0, 2], 2e-4).is_empty());
}
