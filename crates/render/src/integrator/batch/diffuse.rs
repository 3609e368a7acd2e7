//! What paths do at matte surfaces, many at a time: what [`Walk::step`] does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::{Hit, Loops};

use crate::bsdf::{Aims, Matte, ScatterSample, Values, share};
use crate::integrator::batch::hits::Meetings;
use crate::integrator::nested_dielectrics::Skin;
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::interaction::Places;
use crate::interaction::attributes::Surface;
use crate::light::Reference;
use crate::soa::{Three, get, set};

/// Paths at matte surfaces in empty space. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct Mattes<const N: usize> {
    /// Which lanes are such.
    pub is: [bool; N],
    pub albedo: Three<f32, N>,
    pub aims: Aims<N>,
    leaving: Leaving<N>,
}

/// Where paths go on: whether that is away from the triangle, its density, and where the ray starts.
#[derive(Clone, Copy, Debug)]
struct Leaving<const N: usize> {
    away: [bool; N],
    pdf: [f32; N],
    /// What the albedo is multiplied by for the weight.
    ratio: [f32; N],
    start: Three<f32, N>,
}

impl<const N: usize> Default for Leaving<N> {
    fn default() -> Self {
        Self {
            away: [false; N],
            pdf: [0.0; N],
            ratio: [1.0; N],
            start: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for Mattes<N> {
    fn default() -> Self {
        Self {
            is: [false; N],
            albedo: [[0.0; N]; 3],
            aims: Aims::default(),
            leaving: Leaving::default(),
        }
    }
}

impl<const N: usize> Mattes<N> {
    /// Sets a lane.
    #[inline]
    pub fn put(&mut self, lane: usize, albedo: Vec3) {
        self.is[lane] = true;
        set(&mut self.albedo, lane, albedo.to_array());
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.is != [false; N]
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn evaluate(&self, places: &Places<N>, directions: &Three<f32, N>) -> Values<N> {
        let (mut values, mut cosines) = (Values::default(), [0.0; N]);
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            *cosine = places.normal(lane).dot(get(directions, lane).into());
        }
        let densities = self.aims.densities(directions, &cosines);
        for lane in 0..N {
            let (direction, cosine) = (Vec3::from(get(directions, lane)), cosines[lane]);
            let dark = (places.geometric(lane).dot(direction) <= 0.0) | (cosine <= 0.0);
            let value = Vec3::from(get(&self.albedo, lane)) * FRAC_1_PI * cosine;
            let value = if dark { Vec3::ZERO } else { value };
            values.pdf[lane] = if dark { 0.0 } else { densities[lane] };
            set(&mut values.value, lane, value.to_array());
        }
        values
    }

    /// The direction in which a path goes on, which is this one, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize, direction: Vec3) -> Option<(ScatterSample, Vec3)> {
        let Leaving {
            away,
            pdf,
            ratio,
            start,
        } = &self.leaving;
        away[lane].then(|| {
            let sample = ScatterSample {
                direction,
                weight: Vec3::from(get(&self.albedo, lane)) * ratio[lane],
                pdf: pdf[lane],
                delta: false,
                squeeze: 1.0,
            };
            (sample, get(start, lane).into())
        })
    }
}

/// Finds where paths go on.
pub(crate) struct Scatter<'a, const N: usize> {
    pub places: &'a Places<N>,
    pub directions: &'a Three<f32, N>,
    pub mattes: &'a mut Mattes<N>,
}

impl<const N: usize> Loops for Scatter<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            places,
            directions,
            mattes,
        } = self;
        let mut leaving = Leaving::default();
        let mut cosines = [0.0; N];
        for (lane, cosine) in cosines.iter_mut().enumerate() {
            let direction = Vec3::from(get(directions, lane));
            let start = places.start(lane, direction).as_vec3();
            *cosine = places.normal(lane).dot(direction);
            leaving.away[lane] = places.geometric(lane).dot(direction) > 0.0;
            set(&mut leaving.start, lane, start.to_array());
        }
        leaving.pdf = mattes.aims.densities(directions, &cosines);
        if mattes.aims.any() {
            for (lane, ratio) in leaving.ratio.iter_mut().enumerate() {
                *ratio = share(cosines[lane], leaving.pdf[lane]);
            }
        }
        mattes.leaving = leaving;
    }
}

impl Walk<'_> {
    /// [`Walk::step`] at a lane of [`Mattes`].
    #[inline]
    pub(crate) fn step_matte(
        &self,
        path: &mut Path,
        meetings: &Meetings,
        (number, lane): (usize, usize),
        hit: &Hit,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meetings {
            places,
            mattes,
            arriving,
            ..
        } = meetings;
        let out = &mut radiance[path.ray];
        let from = Reference {
            position: places.position(lane),
            normal: places.geometric(lane),
        };
        if arriving.near[lane] {
            let distance = (from.position - path.from.position).length();
            self.pick_up(path, distance, out);
        }
        if !self.free(path) && path.depth >= self.rules.max_depth {
            return false;
        }
        let direction = get(&meetings.matte, lane).into();
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.choice(path) != self.choice_of_turn();
        if self.many && !late {
            meetings.asked.ask(lane, path.ray, &mut wave.shadows);
        } else if self.sampled || self.rules.ambient.is_some() {
            let meeting = meetings.at(self, number, lane, hit);
            let surface = Surface {
                place: &meeting.place,
                frame: meeting.place.frame(path.direction),
                scatter: Matte {
                    albedo: get(&mattes.albedo, lane).into(),
                    direction,
                    aims: mattes.aims.any().then_some((&mattes.aims, lane)),
                },
            };
            let skin = Skin::none(path.media);
            self.sample_lights(path, &surface, skin, &meeting, wave, out);
        }
        match mattes.sample(lane, direction) {
            Some((sample, start)) => self.send(path, &sample, start, from, path.media, wave),
            None => false,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use glam::{DAffine3, DVec3};
    use raycam_bvh::vectorized;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, Object, World};

    use super::*;
    use crate::bsdf::{Aim, Scattering};
    use crate::control::Control;
    use crate::guiding::caustic_casters::Mirror;
    use crate::prepare::PreparedWorld;
    use crate::soa::{LANES, set_corners};

    pub fn unit(i: usize) -> Vec3 {
        let angle = i as f32;
        Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()).normalize()
    }

    /// Surfaces of a ball, the first of which is `first`, and directions; every second time they aim.
    pub fn some(first: usize) -> (Places<LANES>, Mattes<LANES>, Three<f32, LANES>) {
        let mut world = World::default();
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let (mut places, mut mattes) = (Places::<LANES>::default(), Mattes::default());
        let mut directions = [[0.0; LANES]; 3];
        let corners = places.begin();
        for lane in 0..LANES {
            set_corners(corners, lane, world.corners(0, (first + lane) as u32));
        }
        for lane in 0..LANES {
            let i = first + lane;
            let hit = Hit {
                t: 1.0,
                u: 0.2,
                v: 0.3,
                instance: 0,
                triangle: i as u32,
            };
            places.put(lane, &world, unit(i), &hit, 0.0);
            mattes.is[lane] = true;
            set(&mut directions, lane, unit(2 * i + 1).to_array());
            set(&mut mattes.albedo, lane, unit(i).abs().to_array());
        }
        vectorized(&mut places);
        if first.is_multiple_of(2 * LANES) {
            let mirrors = [DVec3::X, DVec3::Y].map(|center| Mirror {
                object: 0,
                center: 2.0 * center,
                radius: 0.7,
            });
            let random: Vec<f32> = (0..LANES).map(|i| unit(i + first).x.abs()).collect();
            vectorized(Aim {
                mirrors: &mirrors,
                thrown: &[],
                places: &places,
                active: &[true; LANES],
                random: &[0, 1].map(|_| std::array::from_fn(|lane| random[lane])),
                aims: &mut mattes.aims,
                out: &mut directions,
            });
        }
        (places, mattes, directions)
    }

    /// The surface of a lane by itself.
    pub fn alone<'a>(
        mattes: &'a Mattes<LANES>,
        directions: &Three<f32, LANES>,
        lane: usize,
    ) -> Matte<'a> {
        Matte {
            albedo: get(&mattes.albedo, lane).into(),
            direction: get(directions, lane).into(),
            aims: mattes.aims.any().then_some((&mattes.aims, lane)),
        }
    }

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let mut away = 0;
        for first in (0..320).step_by(LANES) {
            let (places, mut mattes, directions) = some(first);
            vectorized(Scatter {
                places: &places,
                directions: &directions,
                mattes: &mut mattes,
            });
            for lane in 0..LANES {
                let place = places.place(lane);
                let matte = alone(&mattes, &directions, lane);
                let frame = place.frame(unit(first + lane));
                let alone = matte
                    .sample(&frame, [0.0; 3])
                    .map(|sample| (sample, place.start(sample.direction).as_vec3()));
                let lanes = mattes.sample(lane, get(&directions, lane).into());
                assert_eq!(format!("{lanes:?}"), format!("{alone:?}"));
                away += usize::from(alone.is_some());
            }
        }
        assert!(away > 60, "{away}");
    }
}
