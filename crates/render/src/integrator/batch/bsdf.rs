//! Surfaces that light is sampled for, of every kind that is computed many at a time.

use crate::bsdf::BsdfEvals;
use crate::bsdf::batch::glossy::GlossyBsdfBatch;
use crate::bsdf::batch::rough_dielectric::RoughDielectricBsdfBatch;
use crate::integrator::batch::diffuse::DiffuseBatch;
use crate::integrator::batch::path_lanes::PathLanes;
use crate::interaction::batch::SurfaceInteractions;
use crate::prepare::world::PreparedWorld;
use crate::soa::{Vec3xN, set_lane};

/// Surfaces of lanes, and the paths that arrive there.
#[derive(Clone, Copy)]
pub(crate) struct BatchBsdf<'a, const N: usize> {
    pub path_lanes: &'a PathLanes<N>,
    pub diffuse: &'a DiffuseBatch<N>,
    pub glossy: &'a GlossyBsdfBatch<N>,
    pub rough_dielectric: &'a RoughDielectricBsdfBatch<N>,
    pub world: &'a PreparedWorld,
}

impl<const N: usize> BatchBsdf<'_, N> {
    /// Whether a lane has one.
    pub fn is_active(&self, lane: usize) -> bool {
        self.diffuse.is_active[lane]
            || self.glossy.is_active[lane]
            || self.rough_dielectric.is_active[lane]
    }

    /// [`LightSampleContext::normal`] of the lanes.
    pub fn normals(&self, places: &SurfaceInteractions<N>) -> Vec3xN<f32, N> {
        let mut normals = *places.geometric_normals();
        for lane in (0..N).filter(|&lane| self.rough_dielectric.is_active[lane]) {
            set_lane(&mut normals, lane, [0.0; 3]);
        }
        normals
    }

    /// The values of light from these directions, where there are any of them.
    #[inline(always)]
    pub fn eval(
        &self,
        places: &SurfaceInteractions<N>,
        directions: &Vec3xN<f32, N>,
    ) -> BsdfEvals<N> {
        let Self {
            diffuse: mattes,
            glossy: glossies,
            rough_dielectric: frosted,
            ..
        } = self;
        let mut values = if glossies.any() {
            glossies.eval(places, directions)
        } else {
            mattes.eval(places, directions)
        };
        if glossies.any() && mattes.any_active() {
            values.select_lanes(&mattes.is_active, &mattes.eval(places, directions));
        }
        if frosted.any() {
            let refracted = frosted.eval(&self.world.geometry, places, directions);
            values.select_lanes(&frosted.is_active, &refracted);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_bvh::{Hit, dispatch_simd};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Material, MaterialModel, Object, Principled, World};

    use super::*;
    use crate::bsdf::batch::glossy_sample::SampleGlossy;
    use crate::bsdf::batch::rough_dielectric_sample::SampleRoughDielectric;
    use crate::control::Control;
    use crate::integrator::batch::diffuse::tests::some;
    use crate::soa::{LANES, get_lane};

    #[test]
    fn each_lane_has_the_values_of_its_kind() {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let glass = Glass {
            roughness: 0.5,
            ..Glass::default()
        };
        for reflectance in [
            MaterialModel::Principled(Principled::default().into()),
            MaterialModel::Glass(glass),
        ] {
            let material = Material {
                model: reflectance,
                ..Material::default()
            };
            let material = world.add_material(material).unwrap();
            let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
            world.add_object(object).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let (places, mut mattes, directions) = some(0);
        let (mut glossies, mut frosted) = (
            GlossyBsdfBatch::default(),
            RoughDielectricBsdfBatch::default(),
        );
        for lane in 0..LANES {
            let hit = |instance| Hit {
                instance,
                triangle: lane as u32,
                ..Hit::MISS
            };
            mattes.is_active[lane] = lane % 3 == 0;
            match lane % 3 {
                0 => {}
                1 => glossies.set_lane(
                    (&places, lane),
                    &world.geometry,
                    world.geometry.material(&hit(0)),
                    &hit(0),
                ),
                _ => frosted.set_lane((&places, lane), &world.geometry, &hit(1), None, 1.0),
            }
        }
        let (random, choice) = (&[[0.4; LANES]; 2], &[0.3; LANES]);
        dispatch_simd(SampleGlossy {
            places: &places,
            random,
            choice,
            batch: &mut glossies,
        });
        dispatch_simd(SampleRoughDielectric {
            world: &world.geometry,
            places: &places,
            random,
            choice,
            batch: &mut frosted,
        });
        let surfaces = BatchBsdf {
            path_lanes: &PathLanes::default(),
            diffuse: &mattes,
            glossy: &glossies,
            rough_dielectric: &frosted,
            world: &world,
        };
        let values = surfaces.eval(&places, &directions);
        let kinds = [
            mattes.eval(&places, &directions),
            glossies.eval(&places, &directions),
            frosted.eval(&world.geometry, &places, &directions),
        ];
        let normals = surfaces.normals(&places);
        for lane in 0..LANES {
            let own = &kinds[lane % 3];
            assert!(surfaces.is_active(lane));
            assert_eq!(get_lane(&values.value, lane), get_lane(&own.value, lane));
            assert_eq!(values.pdf[lane], own.pdf[lane]);
            assert_eq!(get_lane(&normals, lane) == [0.0; 3], lane % 3 == 2);
        }
    }
}
