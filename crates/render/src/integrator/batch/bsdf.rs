//! Surfaces that light is sampled for, of every kind that is computed many at a time.

use crate::bsdf::{FrostedPoints, GlossyPoints, Values};
use crate::integrator::batch::diffuse::Mattes;
use crate::integrator::batch::path_lanes::Arriving;
use crate::interaction::Places;
use crate::prepare::PreparedWorld;
use crate::soa::{Three, set};

/// Surfaces of lanes, and the paths that arrive there.
#[derive(Clone, Copy)]
pub(crate) struct Surfaces<'a, const N: usize> {
    pub arriving: &'a Arriving<N>,
    pub mattes: &'a Mattes<N>,
    pub glossies: &'a GlossyPoints<N>,
    pub frosted: &'a FrostedPoints<N>,
    pub world: &'a PreparedWorld,
}

impl<const N: usize> Surfaces<'_, N> {
    /// Whether a lane has one.
    pub fn has(&self, lane: usize) -> bool {
        self.mattes.is[lane] || self.glossies.is[lane] || self.frosted.is[lane]
    }

    /// [`Reference::normal`] of the lanes.
    pub fn normals(&self, places: &Places<N>) -> Three<f32, N> {
        let mut normals = *places.geometrics();
        for lane in (0..N).filter(|&lane| self.frosted.is[lane]) {
            set(&mut normals, lane, [0.0; 3]);
        }
        normals
    }

    /// The values of light from these directions, where there are any of them.
    #[inline(always)]
    pub fn evaluate(&self, places: &Places<N>, directions: &Three<f32, N>) -> Values<N> {
        let Self {
            mattes,
            glossies,
            frosted,
            ..
        } = self;
        let mut values = if glossies.any() {
            glossies.evaluate(places, directions)
        } else {
            mattes.evaluate(places, directions)
        };
        if glossies.any() && mattes.any() {
            values.take(&mattes.is, &mattes.evaluate(places, directions));
        }
        if frosted.any() {
            let refracted = frosted.evaluate(self.world, places, directions);
            values.take(&frosted.is, &refracted);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_bvh::{Hit, vectorized};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Material, Object, Principled, Reflectance, World};

    use super::*;
    use crate::bsdf::{FindFrosted, FindLobes};
    use crate::control::Control;
    use crate::integrator::batch::diffuse::tests::some;
    use crate::soa::{LANES, get};

    #[test]
    fn each_lane_has_the_values_of_its_kind() {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let glass = Glass {
            roughness: 0.5,
            ..Glass::default()
        };
        for reflectance in [
            Reflectance::Principled(Principled::default().into()),
            Reflectance::Glass(glass),
        ] {
            let material = Material {
                reflectance,
                ..Material::default()
            };
            let material = world.add_material(material).unwrap();
            let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
            world.add_object(object).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let (places, mut mattes, directions) = some(0);
        let (mut glossies, mut frosted) = (GlossyPoints::default(), FrostedPoints::default());
        for lane in 0..LANES {
            let hit = |instance| Hit {
                instance,
                triangle: lane as u32,
                ..Hit::MISS
            };
            mattes.is[lane] = lane % 3 == 0;
            match lane % 3 {
                0 => {}
                1 => glossies.put((&places, lane), &world, world.material(&hit(0)), &hit(0)),
                _ => frosted.put((&places, lane), &world, &hit(1), None, 1.0),
            }
        }
        let (random, choice) = (&[[0.4; LANES]; 2], &[0.3; LANES]);
        vectorized(FindLobes {
            places: &places,
            random,
            choice,
            points: &mut glossies,
        });
        vectorized(FindFrosted {
            world: &world,
            places: &places,
            random,
            choice,
            points: &mut frosted,
        });
        let surfaces = Surfaces {
            arriving: &Arriving::default(),
            mattes: &mattes,
            glossies: &glossies,
            frosted: &frosted,
            world: &world,
        };
        let values = surfaces.evaluate(&places, &directions);
        let kinds = [
            mattes.evaluate(&places, &directions),
            glossies.evaluate(&places, &directions),
            frosted.evaluate(&world, &places, &directions),
        ];
        let normals = surfaces.normals(&places);
        for lane in 0..LANES {
            let own = &kinds[lane % 3];
            assert!(surfaces.has(lane));
            assert_eq!(get(&values.value, lane), get(&own.value, lane));
            assert_eq!(values.pdf[lane], own.pdf[lane]);
            assert_eq!(get(&normals, lane) == [0.0; 3], lane % 3 == 2);
        }
    }
}
