//! Diffuse lanes on a ball, some with path guiding, have the same samples as single points.

use glam::{DAffine3, DVec3, Vec3};
use raycam_bvh::{Hit, dispatch_simd};
use raycam_scene::mesh::primitive;
use raycam_scene::{Material, Object, World};

use crate::bsdf::BsdfModel;
use crate::bsdf::batch::diffuse::DiffuseModel;
use crate::bsdf::batch::{BsdfBatch, LaneContext, LaneRandoms};
use crate::control::Control;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::RayCone;
use crate::prepare::world::PreparedWorld;
use crate::soa::{LANES, set_lane, set_triangle};

/// A unit vector for every index.
pub(crate) fn unit(i: usize) -> Vec3 {
    let angle = i as f32;
    Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()).normalize()
}

fn ball() -> PreparedWorld {
    let mut world = World::default();
    let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
    let material = world.add_material(Material::default()).unwrap();
    let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
    world.add_object(object).unwrap();
    PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
}

/// Hits of a ball by one ray per lane (lane i has the direction [`unit`] of `first + i`), and the diffuse batch of
/// these hits, in which every second lane is guided.
pub(crate) fn diffuse_lanes(first: usize) -> (SurfaceInteractions<LANES>, BsdfBatch<DiffuseModel>) {
    let world = ball();
    let mut interactions = SurfaceInteractions::<LANES>::default();
    let mut batch = BsdfBatch::<DiffuseModel>::default();
    let corners = interactions.clear();
    for lane in 0..LANES {
        set_triangle(corners, lane, world.geometry.corners(0, (first + lane) as u32));
    }
    for lane in 0..LANES {
        let i = first + lane;
        let hit = Hit { t: 1.0, u: 0.2, v: 0.3, instance: 0, triangle: i as u32 };
        interactions.set_lane(lane, &world.geometry, unit(i), &hit, &RayCone::default());
        batch.activate(lane, Vec3::ZERO);
        let model = &mut batch.model;
        set_lane(&mut model.directions, lane, unit(2 * i + 1).to_array());
        set_lane(&mut model.albedo, lane, unit(i).abs().to_array());
    }
    dispatch_simd(&mut interactions);
    if first.is_multiple_of(2 * LANES) {
        let (cones, normals) = (&mut batch.model.guiding, interactions.shading_normals());
        cones.count = 2;
        for (k, center) in [DVec3::X, DVec3::Y].into_iter().enumerate() {
            let mut directions = [[0.0; LANES]; 3];
            for lane in 0..LANES {
                let direction = (2.0 * center - interactions.position(lane)).as_vec3();
                set_lane(&mut directions, lane, direction.to_array());
            }
            cones.set_cones(k, (&directions, &[0.7; LANES]), normals, 16.0, 1.0);
        }
        cones.cosine_weight = [1.0; LANES];
        cones.limit_weights(0..2, &[0.2; LANES]);
        let random: [f32; LANES] = std::array::from_fn(|lane| unit(lane + first).x.abs());
        cones.sample(normals, &[random; 2], &mut batch.model.directions);
    }
    (interactions, batch)
}

#[test]
fn guided_and_unguided_lanes_equal_scalar_evaluation() {
    let world = ball();
    let mut valid = 0;
    for first in (0..320).step_by(LANES) {
        let (interactions, mut batch) = diffuse_lanes(first);
        let context = LaneContext { geometry: &world.geometry, interactions: &interactions };
        let randoms = LaneRandoms { direction: &[[0.0; LANES]; 2], lobe: &[0.0; LANES] };
        batch.sample_all(context, randoms);
        for lane in 0..LANES {
            let interaction = interactions.lane(lane);
            let frame = interaction.shading_frame(unit(first + lane));
            let scalar = batch.model.lane(lane).sample(&frame, [0.0; 3]);
            let scalar = scalar.map(|sample| {
                let origin = interaction.offset_ray_origin(sample.wi).as_vec3();
                (sample, origin)
            });
            let batched = batch.samples.get(lane);
            assert_eq!(format!("{batched:?}"), format!("{scalar:?}"));
            valid += usize::from(scalar.is_some());
        }
    }
    assert!(valid > 60, "{valid}");
}
