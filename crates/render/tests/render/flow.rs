//! Flow of moved and deformed meshes, and invalid arguments. Reprojection is tested in Python.

use std::sync::Arc;

use crate::common::*;
use glam::DVec3;
use raycam_render::annotations::flow::flow;
use raycam_render::annotations::viewpoint::Viewpoint;
use raycam_render::{Control, RenderError};

#[test]
fn flow_follows_the_corners_of_deformed_meshes() {
    let first = plane(2.0, 0.8);
    let mut second = first.clone();
    // The mesh is stretched and bent. The map is affine in each triangle, so it is known at each point.
    let bend = |v: DVec3| DVec3::new(1.5 * v.x + 0.2 * v.y, v.y, v.z + 0.3 * v.x.signum());
    let mesh = Arc::make_mut(&mut second.meshes[0]);
    mesh.vertices.iter_mut().for_each(|v| *v = bend(*v));
    let camera = look_at(DVec3::new(0.1, -0.2, 4.0), DVec3::ZERO, 40.0, [40, 30]);
    let (a, b) = (prepare(&first), prepare(&second));
    let view = |world| Viewpoint { world, animated_world: None, camera: &camera };
    let found = flow(view(&a), view(&b), Some(2), &Control::new()).unwrap();
    let mut followed = 0;
    for i in 0..40 * 30 {
        let pixel = camera.pixel_center_of(i as u32 % 40, i as u32 / 40);
        let (origin, direction) = camera.ray(pixel);
        let at = origin - direction * (origin.z / direction.z);
        if at.x.abs() > 1.0 || at.y.abs() > 1.0 {
            assert!(found.flow[i].iter().chain(&found.scene_flow[i]).all(|v| v.is_nan()));
            assert!(found.depth[i].is_nan() && !found.occluded[i] && !found.outside[i]);
            continue;
        }
        followed += 1;
        let to = DVec3::new(1.5 * at.x + 0.2 * at.y, at.y, 0.3 * at.x);
        let expected = camera.project(to).0 - pixel;
        let flow = found.flow[i].map(f64::from);
        assert!((flow[0] - expected.x).hypot(flow[1] - expected.y) < 1e-5);
        let moved = DVec3::from(found.scene_flow[i].map(f64::from));
        assert!((moved - (to - at)).length() < 1e-6);
    }
    assert!(followed > 300, "{followed}");
    let again = flow(view(&a), view(&b), Some(1), &Control::new()).unwrap();
    assert!(again.flow.iter().flatten().zip(found.flow.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn flow_refuses_worlds_with_different_triangles_and_can_be_cancelled() {
    let camera = look_at(DVec3::new(0.1, -0.2, 4.0), DVec3::ZERO, 40.0, [8, 8]);
    let (a, b) = (prepare(&plane(1.0, 1.0)), prepare(&still_life()));
    let view = |world| Viewpoint { world, animated_world: None, camera: &camera };
    let error = flow(view(&a), view(&b), None, &Control::new()).unwrap_err();
    assert!(error.to_string().contains("in the first: 1, in the second: 3"), "{error}");
    let control = Control::new();
    control.cancel();
    assert_eq!(flow(view(&a), view(&a), None, &control), Err(RenderError::Cancelled));
}
