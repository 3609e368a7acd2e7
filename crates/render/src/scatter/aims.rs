//! Rays of matte surfaces aimed at what gathers light, many at a time.
//!
//! Light that a mirror or a lens throws on a matte surface is found by rays that happen to meet it, and few do. So a share of
//! a surface's rays goes evenly into the cones that the spheres around such objects fill, and the rest as ever; every
//! direction has the density that both have together (one-sample multiple importance sampling: E. Veach, "Robust Monte Carlo
//! Methods for Light Transport Simulation", 1997, section 9.2.4).

use std::f32::consts::TAU;

use glam::Vec3;
use raycam_bvh::Loops;

use super::frame::{above, cosine_density, turn};
use crate::lanes::{Three, get, set, vector};
use crate::mirrors::{MIRRORS, Mirror};
use crate::place::Places;

/// The largest share of a surface's rays that is aimed.
const MOST: f32 = 0.2;
/// How many times as densely as others rays are aimed, at most.
const DENSER: f32 = 16.0;
/// Smaller cones are not worth it: 1 - cos of the angle.
const SMALLEST: f32 = 1e-6;

/// Cones of every lane. Each lane is computed as it would be alone.
#[derive(Clone, Debug)]
pub(crate) struct Aims<const N: usize> {
    /// How many cones there are.
    count: usize,
    axis: [Three<f32, N>; MIRRORS],
    /// 1 - cos of the angle.
    height: [[f32; N]; MIRRORS],
    /// Of the rays.
    share: [[f32; N]; MIRRORS],
    /// What share is not aimed.
    rest: [f32; N],
}

impl<const N: usize> Default for Aims<N> {
    fn default() -> Self {
        Self {
            count: 0,
            axis: [[[0.0; N]; 3]; MIRRORS],
            height: [[1.0; N]; MIRRORS],
            share: [[0.0; N]; MIRRORS],
            rest: [1.0; N],
        }
    }
}

impl<const N: usize> Aims<N> {
    /// Aims at nothing.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Whether any ray may be aimed.
    pub fn any(&self) -> bool {
        self.count > 0
    }

    /// The density of a lane's direction, whose cosine to the normal is this.
    #[inline(always)]
    pub fn density(&self, lane: usize, direction: Vec3, cosine: f32) -> f32 {
        let mut density = cosine_density(cosine);
        if self.any() {
            density *= self.rest[lane];
            for k in 0..self.count {
                density += self.aimed(k, lane, direction);
            }
        }
        density
    }

    /// The same for all lanes.
    #[inline(always)]
    pub fn densities(&self, directions: &Three<f32, N>, cosines: &[f32; N]) -> [f32; N] {
        let mut densities = cosines.map(cosine_density);
        if self.any() {
            for (density, rest) in densities.iter_mut().zip(&self.rest) {
                *density *= rest;
            }
            for k in 0..self.count {
                for (lane, density) in densities.iter_mut().enumerate() {
                    *density += self.aimed(k, lane, get(directions, lane).into());
                }
            }
        }
        densities
    }

    #[inline(always)]
    fn aimed(&self, k: usize, lane: usize, direction: Vec3) -> f32 {
        // 1 - cos = |a - b|^2 / 2, without cancellation.
        let off = direction - Vec3::from(get(&self.axis[k], lane));
        let height = self.height[k][lane];
        let density = self.share[k][lane] / (TAU * height);
        if off.length_squared() <= 2.0 * height {
            density
        } else {
            0.0
        }
    }
}

/// The share that rays of a cosine's density have in this density; none where nothing goes.
#[inline(always)]
pub(crate) fn share(cosine: f32, density: f32) -> f32 {
    let share = cosine_density(cosine) / density;
    if density > 0.0 { share } else { 0.0 }
}

/// Finds the cones, and draws a direction for every lane by two numbers.
pub(crate) struct Aim<'a, const N: usize> {
    pub mirrors: &'a [Mirror],
    pub places: &'a Places<N>,
    /// Whose rays are aimed.
    pub active: &'a [bool; N],
    pub random: &'a [[f32; N]; 2],
    pub aims: &'a mut Aims<N>,
    pub out: &'a mut Three<f32, N>,
}

impl<const N: usize> Loops for Aim<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self {
            mirrors,
            places,
            active,
            random: [first, second],
            aims,
            out,
        } = self;
        aims.count = mirrors.len().min(MIRRORS);
        let mut all = [0.0; N];
        for (k, mirror) in mirrors.iter().take(MIRRORS).enumerate() {
            let radius2 = (mirror.radius * mirror.radius) as f32;
            for lane in 0..N {
                let way = (mirror.center - vector(places.positions(), lane)).as_vec3();
                let distance2 = way.length_squared();
                let sin2 = radius2 / distance2;
                let height = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
                let axis = way / distance2.sqrt();
                // What it fills of the half sphere at most, as seen by a matte surface.
                let up = places.normal(lane).dot(axis) + sin2.sqrt();
                let share = DENSER * 2.0 * height * up.clamp(0.0, 1.0);
                let apt = active[lane] & (sin2 < 0.999) & (height > SMALLEST) & (up > 0.0);
                let share = if apt { share.min(1.0) } else { 0.0 };
                set(&mut aims.axis[k], lane, axis.to_array());
                aims.height[k][lane] = if apt { height } else { 1.0 };
                aims.share[k][lane] = share;
                all[lane] += share;
            }
        }
        for (all, rest) in all.iter_mut().zip(&mut aims.rest) {
            let scale = if *all > MOST { MOST / *all } else { 1.0 };
            *rest = 1.0 - *all * scale;
            *all = scale;
        }
        // Where the first number lies says which cone it is; what is left of it is as good as new.
        let mut from = [0.0; N];
        let mut height = [1.0; N];
        let mut number = [0.0; N];
        let mut aimed = [false; N];
        let mut axis = *places.normals();
        for k in 0..aims.count {
            for lane in 0..N {
                let share = aims.share[k][lane] * all[lane];
                aims.share[k][lane] = share;
                let at = first[lane] - from[lane];
                let here = (at >= 0.0) & (at < share);
                for (axis, other) in axis.iter_mut().zip(&aims.axis[k]) {
                    axis[lane] = if here { other[lane] } else { axis[lane] };
                }
                height[lane] = if here {
                    aims.height[k][lane]
                } else {
                    height[lane]
                };
                number[lane] = if here { at / share } else { number[lane] };
                aimed[lane] |= here;
                from[lane] += share;
            }
        }
        for lane in 0..N {
            let rest = (first[lane] - from[lane]) / aims.rest[lane];
            let x = if aimed[lane] { number[lane] } else { rest };
            let x = x.clamp(0.0, 1.0);
            let cap = x * height[lane];
            let sin2 = if aimed[lane] { cap * (2.0 - cap) } else { x };
            let cos = if aimed[lane] {
                1.0 - cap
            } else {
                (1.0 - x).sqrt()
            };
            let (turn_sin, turn_cos) = turn(second[lane]);
            let radius = sin2.sqrt();
            let local = Vec3::new(radius * turn_cos, radius * turn_sin, cos);
            let direction = above(get(&axis, lane).into(), local);
            set(out, lane, direction.to_array());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DAffine3, DVec3};
    use raycam_bvh::{Hit, vectorized};
    use raycam_scene::{Material, Object, World, primitive};

    use super::*;
    use crate::chi_squared::{limit, statistic};
    use crate::control::Control;
    use crate::lanes::{LANES, set_corners};
    use crate::prepare::PreparedWorld;

    fn floor() -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([2.0, 2.0]).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let object = Object::new("", floor, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    /// Rays that come down on places of the floor, the first of which is `first`.
    fn places<const N: usize>(world: &PreparedWorld, first: usize) -> Places<N> {
        let mut places = Places::<N>::default();
        let corners = places.begin();
        for lane in 0..N {
            set_corners(corners, lane, world.corners(0, 0));
        }
        for lane in 0..N {
            let hit = Hit {
                t: 1.0,
                u: 0.05 * (first + lane) as f32,
                v: 0.1,
                instance: 0,
                triangle: 0,
            };
            places.put(lane, world, -Vec3::Z, &hit, 0.0);
        }
        places.run();
        places
    }

    /// One before the floor, one that it cuts, one that holds all places, one too far away to matter.
    fn some() -> Vec<Mirror> {
        [
            (DVec3::new(1.5, 0.0, 1.0), 0.4),
            (DVec3::new(-1.0, 2.0, 0.1), 0.6),
            (DVec3::new(0.0, 0.0, 2.0), 5.0),
            (DVec3::new(0.0, 0.0, 9e3), 1.0),
        ]
        .map(|(center, radius)| Mirror { center, radius })
        .into()
    }

    fn aimed<const N: usize>(
        places: &Places<N>,
        active: [bool; N],
        random: [[f32; N]; 2],
    ) -> (Aims<N>, Three<f32, N>) {
        let (mut aims, mut out) = (Aims::default(), [[0.0; N]; 3]);
        vectorized(Aim {
            mirrors: &some(),
            places,
            active: &active,
            random: &random,
            aims: &mut aims,
            out: &mut out,
        });
        (aims, out)
    }

    fn random(at: usize) -> f32 {
        let mut x = at as u32;
        for factor in [0x7feb_352d, 0x846c_a68b] {
            x = (x ^ (x >> 16)).wrapping_mul(factor);
        }
        (x >> 8) as f32 / (1 << 24) as f32
    }

    #[test]
    fn directions_are_as_dense_as_they_say() {
        const HIGH: usize = 40;
        const AROUND: usize = 40;
        const FINE: usize = 12;
        const SAMPLES: usize = 1 << 16;
        let world = floor();
        let mut places = Places::<LANES>::default();
        let corners = places.begin();
        (0..LANES).for_each(|lane| set_corners(corners, lane, world.corners(0, 0)));
        let hit = Hit {
            t: 1.0,
            u: 0.2,
            v: 0.1,
            instance: 0,
            triangle: 0,
        };
        (0..LANES).for_each(|lane| places.put(lane, &world, -Vec3::Z, &hit, 0.0));
        places.run();
        let mut seen = vec![0.0f64; HIGH * AROUND];
        let cell = |d: DVec3| {
            let turn = (d.y.atan2(d.x) / TAU).rem_euclid(1.0);
            let row = ((d.z + 1.0) / 2.0 * HIGH as f64) as usize;
            row.min(HIGH - 1) * AROUND + ((turn * AROUND as f64) as usize).min(AROUND - 1)
        };
        for at in 0..SAMPLES {
            let number =
                |which| std::array::from_fn(|lane| random(2 * (at * LANES + lane) + which));
            let (_, out) = aimed(&places, [true; LANES], [number(0), number(1)]);
            for lane in 0..LANES {
                let direction = Vec3::from(get(&out, lane));
                assert!((direction.length() - 1.0).abs() < 1e-5);
                seen[cell(direction.as_dvec3())] += 1.0;
            }
        }
        let (aims, _) = aimed(&places, [true; LANES], [[0.5; LANES]; 2]);
        let mut expected = vec![0.0f64; HIGH * AROUND];
        for row in 0..HIGH * FINE {
            for column in 0..AROUND * FINE {
                let z = (row as f64 + 0.5) / (HIGH * FINE) as f64 * 2.0 - 1.0;
                let (sin, cos) = ((column as f64 + 0.5) / (AROUND * FINE) as f64 * TAU).sin_cos();
                let radius = (1.0 - z * z).sqrt();
                let direction = DVec3::new(radius * cos, radius * sin, z);
                let density = aims.density(5, direction.as_vec3(), z as f32);
                let solid = 2.0 * TAU / (HIGH * AROUND * FINE * FINE) as f64;
                expected[row / FINE * AROUND + column / FINE] += f64::from(density) * solid;
            }
        }
        let all: f64 = expected.iter().sum();
        assert!((all - 1.0).abs() < 1e-3, "{all}");
        let count = (SAMPLES * LANES) as f64;
        let (chi2, freedom) = statistic(seen.into_iter().zip(expected.iter().map(|e| e * count)));
        assert!(
            freedom > 500.0 && chi2 < limit(freedom, 1),
            "{chi2} of {freedom}"
        );
        // A fifth is aimed, and none at what holds all places.
        assert!((aims.rest[5] - (1.0 - MOST)).abs() < 1e-6);
        assert_eq!((aims.share[2][5], aims.share[3][5]), (0.0, 0.0));
    }

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let world = floor();
        let whole = places::<LANES>(&world, 0);
        let active = std::array::from_fn(|lane| lane % 5 != 4);
        let number = |which| std::array::from_fn(|lane| random(2 * lane + which));
        let numbers: [[f32; LANES]; 2] = [number(0), number(1)];
        let (aims, out) = aimed(&whole, active, numbers);
        let cosines = std::array::from_fn(|lane| out[2][lane]);
        let densities = aims.densities(&out, &cosines);
        for lane in 0..LANES {
            let own = numbers.map(|numbers| [numbers[lane]]);
            let (alone, direction) = aimed(&places::<1>(&world, lane), [active[lane]], own);
            assert_eq!(get(&direction, 0), get(&out, lane));
            let density = alone.density(0, get(&direction, 0).into(), cosines[lane]);
            assert_eq!(density, densities[lane]);
            assert_eq!(alone.rest[0] < 1.0, active[lane]);
        }
    }
}
