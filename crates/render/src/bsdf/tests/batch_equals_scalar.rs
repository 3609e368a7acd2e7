//! Every lane of a batch has the same bits as the BSDF of a single point.

use glam::{DAffine3, Vec3};
use raycam_bvh::{Hit, WithSimd, dispatch_simd};
use raycam_scene::mesh::primitive;
use raycam_scene::{Glass, Material, MaterialModel, Metal, Object, Principled, World};

use crate::bsdf::batch::glossy::GlossyModel;
use crate::bsdf::batch::rough_dielectric::RoughDielectricModel;
use crate::bsdf::batch::specular::SpecularModel;
use crate::bsdf::batch::{BatchModel, BsdfBatch, BsdfEvals, LaneContext, LaneRandoms, LayeredBatchModel};
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::shading_point::ShadingPoint;
use crate::bsdf::specular::FORCE_TRANSMISSION;
use crate::bsdf::tests::diffuse_lanes::unit;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::control::Control;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::RayCone;
use crate::prepare::world::PreparedWorld;
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane, set_triangle};

/// A world with one ball per material.
fn world(models: &[MaterialModel]) -> PreparedWorld {
    let mut world = World::default();
    let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
    for model in models {
        let material = Material { model: model.clone(), color: [0.9, 0.8, 0.5], ..Material::default() };
        let material = world.add_material(material).unwrap();
        let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
    }
    PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
}

/// Random numbers from 0 to 1, one for each lane.
fn randoms(first: usize, step: usize) -> [f32; LANES] {
    std::array::from_fn(|lane| unit(first + step * lane).x.abs())
}

/// Hits of one ray per lane; lane i has the direction [`unit`] of `first + i`.
struct Hits {
    hits: [Hit; LANES],
    directions: [Vec3; LANES],
    interactions: SurfaceInteractions<LANES>,
}

impl Hits {
    fn new(world: &PreparedWorld, first: usize, object: impl Fn(usize) -> usize) -> Self {
        let hits = std::array::from_fn(|lane| Hit {
            t: 1.0,
            u: 0.2,
            v: 0.3,
            instance: object(first + lane) as u32,
            triangle: (first + lane) as u32 % 80,
        });
        let directions = std::array::from_fn(|lane| unit(first + lane));
        let mut interactions = SurfaceInteractions::default();
        let corners = interactions.clear();
        for (lane, hit) in hits.iter().enumerate() {
            set_triangle(corners, lane, world.geometry.corners(hit.instance, hit.triangle));
        }
        for (lane, hit) in hits.iter().enumerate() {
            interactions.set_lane(lane, &world.geometry, directions[lane], hit, &RayCone::default());
        }
        dispatch_simd(&mut interactions);
        Self { hits, directions, interactions }
    }
}

/// Evaluates a batch, compiled in the same way as in the integrator.
struct Evaluate<'a, M: BatchModel> {
    batch: &'a BsdfBatch<M>,
    context: LaneContext<'a>,
    wi: &'a Vec3xN<f32, LANES>,
    out: &'a mut BsdfEvals,
}

impl<M: BatchModel> WithSimd for Evaluate<'_, M> {
    #[inline(always)]
    fn run(self) {
        *self.out = self.batch.eval(self.context, self.wi);
    }
}

/// Numbers of samples and of lit directions that were compared.
#[derive(Default)]
struct Counts {
    reflected: usize,
    transmitted: usize,
    absorbed: usize,
    specular: usize,
    lit: [usize; 2],
}

/// Compares the samples and values of a model with the samples and values of single points in empty space.
fn compare<M: LayeredBatchModel>(world: &PreparedWorld, object: impl Fn(usize) -> usize) -> Counts {
    let mut counts = Counts::default();
    let mut batch = BsdfBatch::<M>::default();
    for first in (0..1920).step_by(LANES) {
        let Hits { hits, directions, interactions } = Hits::new(world, first, &object);
        batch.clear();
        for (lane, hit) in hits.iter().enumerate() {
            assert!(batch.load(lane, &MaterialHit::at_lane(&world.geometry, hit, &interactions, lane)));
        }
        let context = LaneContext { geometry: &world.geometry, interactions: &interactions };
        let (lobe, direction) = (randoms(first, 5), [randoms(first, 7), randoms(first, 11)]);
        let numbers = LaneRandoms { direction: &direction, lobe: &lobe };
        batch.sample_all(context, numbers);
        let mut wi = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            set_lane(&mut wi, lane, unit(first + 13 * lane).to_array());
        }
        let mut evals = BsdfEvals::default();
        dispatch_simd(Evaluate { batch: &batch, context, wi: &wi, out: &mut evals });
        for (lane, hit) in hits.iter().enumerate() {
            let interaction = interactions.lane(lane);
            let hit = MaterialHit::new(&world.geometry, hit, &interaction, directions[lane]);
            let ShadingPoint { frame, bsdf, .. } = ShadingPoint::new(&interaction, &hit);
            let random = [lobe[lane], direction[0][lane], direction[1][lane]];
            let scalar = bsdf.sample(&frame, random).map(|sample| {
                let origin = interaction.offset_ray_origin(sample.wi).as_vec3();
                (sample, origin)
            });
            assert_eq!(format!("{:?}", batch.samples.get(lane)), format!("{scalar:?}"));
            let wi = lane_vec3(&wi, lane);
            let BsdfEval { value, pdf } = bsdf.eval(&frame, wi);
            assert_eq!(lane_vec3(&evals.value, lane), value);
            assert_eq!(evals.pdf[lane], pdf);
            let is_below = |direction: Vec3| frame.geometric.dot(direction) < 0.0;
            match scalar {
                None => counts.absorbed += 1,
                Some((BsdfSample { is_specular, .. }, _)) if is_specular => counts.specular += 1,
                Some((sample, _)) if is_below(sample.wi) => counts.transmitted += 1,
                Some(_) => counts.reflected += 1,
            }
            counts.lit[usize::from(is_below(wi))] += usize::from(value != Vec3::ZERO);
        }
    }
    counts
}

fn metal(name: &str, roughness: f32) -> MaterialModel {
    let metal = Metal::named(name).unwrap();
    MaterialModel::Metal(Metal { roughness, ..metal })
}

#[test]
fn specular_lanes_equal_scalar_evaluation() {
    let glass = |thin| MaterialModel::Glass(Glass { thin, ..Glass::default() });
    let principled = |thickness| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (0.0, 0.0);
        (p.transmission.value, p.thickness.value) = (1.0, thickness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    let world =
        world(&[glass(false), glass(true), metal("gold", 0.0), metal("silver", 0.0), principled(0.0), principled(1.0)]);
    // Groups of lanes with only glass, only metal, only glTF's glass, and all of these materials.
    let object = |i: usize| match i / LANES % 4 {
        kind @ 0..3 => 2 * kind + i % 2,
        _ => i * 7 / 3 % 6,
    };
    let (mut reflected, mut transmitted, mut absorbed, mut split) = (0, 0, 0, 0);
    let mut batch = BsdfBatch::<SpecularModel>::default();
    for first in (0..480).step_by(LANES) {
        let Hits { hits, directions, interactions } = Hits::new(&world, first, object);
        let channel = [None, Some(0)][first % 3 % 2];
        let outside_ior = |lane| [1.0, 1.33][lane % 2];
        let lobe = randoms(first, 5);
        let may_split = |lane: usize| (first / LANES + lane).is_multiple_of(3);
        batch.clear();
        for (lane, hit) in hits.iter().enumerate() {
            let hit = MaterialHit::at_lane(&world.geometry, hit, &interactions, lane);
            assert!(batch.load(lane, &hit.seen_by(channel, outside_ior(lane))));
            if may_split(lane) {
                batch.model.allow_split(lane);
            }
        }
        let context = LaneContext { geometry: &world.geometry, interactions: &interactions };
        let numbers = LaneRandoms { direction: &[[0.0; LANES]; 2], lobe: &lobe };
        batch.sample_all(context, numbers);
        for (lane, hit) in hits.iter().enumerate() {
            let interaction = interactions.lane(lane);
            let hit = MaterialHit::new(&world.geometry, hit, &interaction, directions[lane])
                .seen_by(channel, outside_ior(lane));
            let ShadingPoint { bsdf, frame, .. } = ShadingPoint::new(&interaction, &hit);
            let is_transmissive = bsdf.is_transmissive();
            assert_eq!(batch.model.is_transmissive(lane), is_transmissive);
            let sample = |choice| {
                let sample = bsdf.sample(&frame, [choice, 0.0, 0.0]);
                sample.map(|sample| {
                    let origin = interaction.offset_ray_origin(sample.wi).as_vec3();
                    (sample, origin)
                })
            };
            let scalar = sample(lobe[lane]);
            let batched = batch.samples.get(lane);
            let other = SpecularModel::transmitted_sample(&batch.view, lane);
            if may_split(lane) && is_transmissive {
                // Only directions and origins are compared; the weights of split paths are compared in another test.
                let ray = |(sample, origin): (BsdfSample, Vec3)| (sample.wi, origin);
                if let Some(other) = other {
                    assert_eq!(ray(other), ray(sample(FORCE_TRANSMISSION).unwrap()));
                    assert_eq!(batched.map(ray), sample(0.0).map(ray));
                    split += 1;
                }
                continue;
            }
            assert!(other.is_none());
            assert_eq!(format!("{batched:?}"), format!("{scalar:?}"));
            match scalar {
                None => absorbed += 1,
                Some((sample, _)) if frame.geometric.dot(sample.wi) < 0.0 => transmitted += 1,
                Some(_) => reflected += 1,
            }
        }
    }
    assert!(reflected > 40 && transmitted > 40 && absorbed > 3, "{reflected} {transmitted} {absorbed}");
    assert!(split > 20, "{split}");
}

#[test]
fn glossy_lanes_equal_scalar_evaluation() {
    let principled = |metallic, roughness| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (metallic, roughness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    let layered = |coat: [f32; 2], sheen: [f32; 3]| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (0.2, 0.5);
        (p.clearcoat.value, p.clearcoat_roughness.value) = coat.into();
        (p.sheen_color.value, p.sheen_roughness.value) = (sheen, 0.6);
        MaterialModel::Principled(p.into())
    };
    let world = world(&[
        principled(0.0, 0.4),
        principled(0.3, 1.0),
        principled(1.0, 0.1),
        metal("gold", 0.4),
        metal("silver", 0.05),
        layered([0.7, 0.4], [0.0; 3]),
        layered([1.0, 0.0], [0.0; 3]),
        layered([0.5, 0.2], [0.3, 0.6, 0.2]),
        layered([0.0, 0.0], [0.9; 3]),
    ]);
    // Groups of lanes with only principled materials, only metals, only clear coats, and all of these materials.
    let counts = compare::<GlossyModel>(&world, |i| match i / LANES % 4 {
        0 => i % 3,
        1 => 3 + i % 2,
        2 => 5 + i % 2,
        _ => i * 7 / 3 % 9,
    });
    let Counts { reflected, absorbed, specular, lit: [lit, _], .. } = counts;
    assert!(reflected > 1200 && absorbed > 10 && lit > 600, "{reflected} {absorbed} {lit}");
    assert!(specular > 10, "{specular}");
}

#[test]
fn rough_dielectric_lanes_equal_scalar_evaluation() {
    let glass = |roughness, ior| MaterialModel::Glass(Glass { roughness, ior, ..Glass::default() });
    let principled = |roughness, metallic| {
        let mut p = Principled::default();
        (p.transmission.value, p.thickness.value) = (1.0, 1.0);
        (p.metallic.value, p.roughness.value) = (metallic, roughness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    // The second material loses almost no energy between its microfacets.
    let world =
        world(&[glass(0.4, 1.5), glass(0.04, 1.3), glass(1.0, 1.1), principled(0.3, 0.0), principled(0.9, 0.4)]);
    let counts = compare::<RoughDielectricModel>(&world, |i| match i / LANES % 3 {
        0 => i % 3,
        1 => 3 + i % 2,
        _ => i * 7 / 3 % 5,
    });
    let Counts { reflected, transmitted, absorbed, lit, .. } = counts;
    assert!(reflected > 400 && transmitted > 400 && absorbed > 10, "{reflected} {transmitted} {absorbed}");
    assert!(lit[0] > 300 && lit[1] > 300, "{lit:?}");
}

#[test]
fn rough_dielectrics_with_other_layers_are_not_batched() {
    let with = |change: fn(&mut Principled)| {
        let mut p = Principled::default();
        (p.transmission.value, p.thickness.value) = (1.0, 1.0);
        (p.metallic.value, p.roughness.value) = (0.0, 0.5);
        change(&mut p);
        MaterialModel::Principled(p.into())
    };
    let world = world(&[
        with(|_| {}),
        with(|p| p.transmission.value = 0.5),
        with(|p| p.roughness.value = 0.0),
        with(|p| p.clearcoat.value = 1.0),
        with(|p| p.anisotropy.value = 0.5),
        MaterialModel::Glass(Glass { thin: true, roughness: 0.5, ..Glass::default() }),
    ]);
    let Hits { hits, interactions, .. } = Hits::new(&world, 0, |i| i % 6);
    let mut batch = BsdfBatch::<RoughDielectricModel>::default();
    for (lane, hit) in hits.iter().enumerate() {
        let material_hit = MaterialHit::at_lane(&world.geometry, hit, &interactions, lane);
        let is_batched = batch.load(lane, &material_hit);
        assert_eq!(is_batched, hit.instance == 0, "{}", hit.instance);
    }
}
