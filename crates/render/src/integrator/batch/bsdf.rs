//! BSDFs of a chunk's lanes: one batch for each kind of BSDF that is evaluated in batches.

use crate::bsdf::batch::diffuse::DiffuseModel;
use crate::bsdf::batch::glossy::GlossyModel;
use crate::bsdf::batch::rough_dielectric::RoughDielectricModel;
use crate::bsdf::batch::specular::SpecularModel;
use crate::bsdf::batch::{BsdfBatch, BsdfEvals, LaneContext, LaneRandoms};
use crate::soa::{LANES, Vec3xN, set_lane};

/// One batch for each kind of BSDF; a lane is active in at most one batch.
#[derive(Default)]
pub(crate) struct BatchBsdf {
    pub diffuse: BsdfBatch<DiffuseModel>,
    pub specular: BsdfBatch<SpecularModel>,
    pub glossy: BsdfBatch<GlossyModel>,
    pub rough_dielectric: BsdfBatch<RoughDielectricModel>,
}

impl BatchBsdf {
    /// Deactivates all lanes.
    pub fn clear(&mut self) {
        self.diffuse.clear();
        self.specular.clear();
        self.glossy.clear();
        self.rough_dielectric.clear();
    }

    /// Samples the BSDFs of all lanes.
    pub fn sample_all(&mut self, context: LaneContext, randoms: LaneRandoms) {
        self.specular.sample_all(context, randoms);
        self.glossy.sample_all(context, randoms);
        self.rough_dielectric.sample_all(context, randoms);
        self.diffuse.sample_all(context, randoms);
    }

    /// True if some lane has a BSDF for which light sampling contributes.
    pub fn any_non_specular(&self) -> bool {
        self.diffuse.any_active() || self.glossy.any_active() || self.rough_dielectric.any_active()
    }

    /// True if light sampling contributes at a lane.
    pub fn is_non_specular(&self, lane: usize) -> bool {
        self.diffuse.is_active(lane) || self.glossy.is_active(lane) || self.rough_dielectric.is_active(lane)
    }

    /// The normal of `crate::light::LightSampleContext` for every lane.
    pub fn light_sample_normals(&self, context: LaneContext) -> Vec3xN<f32, LANES> {
        let mut normals = *context.interactions.side_normals();
        for lane in (0..LANES).filter(|&lane| self.rough_dielectric.is_active(lane)) {
            set_lane(&mut normals, lane, [0.0; 3]);
        }
        normals
    }

    /// Values and densities for the world directions `wi`, one per lane.
    #[inline(always)]
    pub fn eval(&self, context: LaneContext, wi: &Vec3xN<f32, LANES>) -> BsdfEvals {
        let Self { diffuse, glossy, rough_dielectric, .. } = self;
        let mut evals = if glossy.any_active() { glossy.eval(context, wi) } else { diffuse.eval(context, wi) };
        if glossy.any_active() && diffuse.any_active() {
            evals.select_lanes(&diffuse.lanes.is_active, &diffuse.eval(context, wi));
        }
        if rough_dielectric.any_active() {
            let others = rough_dielectric.eval(context, wi);
            evals.select_lanes(&rough_dielectric.lanes.is_active, &others);
        }
        evals
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_bvh::Hit;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Material, MaterialModel, Object, Principled, World};

    use super::*;
    use crate::bsdf::material_hit::MaterialHit;
    use crate::bsdf::tests::diffuse_lanes::diffuse_lanes;
    use crate::control::Control;
    use crate::prepare::world::PreparedWorld;
    use crate::soa::get_lane;

    #[test]
    fn each_lane_has_the_values_of_its_bsdf_kind() {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let glass = Glass { roughness: 0.5, ..Glass::default() };
        for model in [MaterialModel::Principled(Principled::default().into()), MaterialModel::Glass(glass)] {
            let material = Material { model, ..Material::default() };
            let material = world.add_material(material).unwrap();
            let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
            world.add_object(object).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let (interactions, diffuse) = diffuse_lanes(0);
        let mut bsdf = BatchBsdf { diffuse, ..BatchBsdf::default() };
        for lane in 0..LANES {
            let hit = |instance| Hit { instance, triangle: lane as u32, ..Hit::MISS };
            bsdf.diffuse.lanes.is_active[lane] = lane % 3 == 0;
            let at_lane = |hit| MaterialHit::at_lane(&world.geometry, hit, &interactions, lane);
            match lane % 3 {
                0 => {}
                1 => assert!(bsdf.glossy.load(lane, &at_lane(&hit(0)))),
                _ => assert!(bsdf.rough_dielectric.load(lane, &at_lane(&hit(1)))),
            }
        }
        let context = LaneContext { geometry: &world.geometry, interactions: &interactions };
        let randoms = LaneRandoms { direction: &[[0.4; LANES]; 2], lobe: &[0.3; LANES] };
        bsdf.glossy.sample_all(context, randoms);
        bsdf.rough_dielectric.sample_all(context, randoms);
        let directions = bsdf.diffuse.model.directions;
        let evals = bsdf.eval(context, &directions);
        let kinds = [
            bsdf.diffuse.eval(context, &directions),
            bsdf.glossy.eval(context, &directions),
            bsdf.rough_dielectric.eval(context, &directions),
        ];
        let normals = bsdf.light_sample_normals(context);
        for lane in 0..LANES {
            let own = &kinds[lane % 3];
            assert!(bsdf.is_non_specular(lane));
            assert_eq!(get_lane(&evals.value, lane), get_lane(&own.value, lane));
            assert_eq!(evals.pdf[lane], own.pdf[lane]);
            assert_eq!(get_lane(&normals, lane) == [0.0; 3], lane % 3 == 2);
        }
    }
}
