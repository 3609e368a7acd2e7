//! Keypoints of a static world. `tests/annotations/test_keypoints.py` compares keypoints of moving worlds with SciPy.

use crate::common::*;
use glam::{DVec2, DVec3};
use raycam_render::annotations::keypoints::{Keypoint, KeypointSource, keypoints};
use raycam_render::annotations::viewpoint::Viewpoint;
use raycam_render::{Control, RenderError};

fn seen(anchors: &[KeypointSource]) -> Result<Vec<Keypoint>, RenderError> {
    let world = still_life();
    let prepared = prepare(&world);
    let (eye, target) = (DVec3::new(0.0, -6.0, 1.0), DVec3::new(0.0, 0.0, 1.0));
    let view =
        Viewpoint { world: &prepared, animated_world: Some(&world), camera: &look_at(eye, target, 50.0, [81, 61]) };
    keypoints(view, anchors, 0.01, None, &Control::new())
}

#[test]
fn keypoints_report_their_image_and_occluder() {
    let ball = |point| KeypointSource::Mesh { object: 1, point };
    let anchors = [
        ball(DVec3::NEG_Y),
        ball(DVec3::Y),
        KeypointSource::World(DVec3::new(0.0, 3.0, 1.0)),
        KeypointSource::World(DVec3::new(0.0, -3.0, 1.0)),
        KeypointSource::World(DVec3::new(0.0, -9.0, 1.0)),
        KeypointSource::World(DVec3::new(100.0, 0.0, 1.0)),
    ];
    let found = seen(&anchors).unwrap();
    let middle = DVec2::new(40.0, 30.0);
    for (i, occluder) in [None, Some(1), Some(1), None].into_iter().enumerate() {
        assert!(found[i].pixel.distance(middle) < 1e-9, "{i}");
        assert!(found[i].inside, "{i}");
        assert_eq!(found[i].occluder, occluder, "{i}");
        assert_eq!(found[i].on_surface, i == 0, "{i}");
    }
    assert_eq!(found[0].point, DVec3::new(0.0, -1.0, 1.0));
    assert!(found[4].pixel.is_nan() && !found[4].inside, "behind the camera");
    assert!(found[5].pixel.is_finite() && !found[5].inside, "to the right");
}

#[test]
fn barycentric_keypoints_are_on_their_triangle() {
    let world = still_life();
    let mesh = &world.meshes[world.objects[2].mesh];
    let (triangle, weights) = (17, DVec3::new(0.5, 0.2, 0.3));
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.vertices[i as usize]);
    let point = a * weights.x + b * weights.y + c * weights.z;
    let object = 2;
    let anchors = [KeypointSource::Triangle { object, triangle, weights }, KeypointSource::Mesh { object, point }];
    let found = seen(&anchors).unwrap();
    assert!(found[0].point.distance(found[1].point) < 1e-12);
    assert!(found[0].pixel.distance(found[1].pixel) < 1e-9);
}

#[test]
fn invalid_keypoints_return_an_error() {
    let triangle =
        |object, triangle, sum: f64| KeypointSource::Triangle { object, triangle, weights: DVec3::splat(sum / 3.0) };
    assert!(seen(&[triangle(1, 3, 1.0)]).is_ok());
    for anchor in [
        triangle(3, 3, 1.0),
        triangle(1, 1 << 20, 1.0),
        triangle(1, 3, 2.0),
        KeypointSource::Mesh { object: 3, point: DVec3::ZERO },
    ] {
        let refused = seen(&[anchor]);
        assert!(matches!(refused, Err(RenderError::Settings(_))), "{anchor:?}: {refused:?}");
    }
}
