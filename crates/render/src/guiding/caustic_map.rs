//! Where the light that mirrors and lenses throw has left them, by where it falls.
//!
//! Light is followed to where it falls, as photons are that guide paths (H. W. Jensen, "Importance Driven Path Tracing using the
//! Photon Map", Rendering Techniques 1995). Of those that fall into a cell of the space around such an object only the mean
//! and the spread of the places are kept where they left it: a ball, at which rays of matte surfaces are aimed.

use glam::{DVec3, Vec3};

use crate::guiding::caustic_casters::CausticCaster;

/// Cells on a side of the square that the directions from an object are unfolded to.
const CELLS_PER_SIDE: usize = 32;
/// Cells from far away to the sphere around the object, even in the reciprocal of the distance.
const DISTANCE_LAYERS: usize = 8;
const CELL_COUNT: usize = CELLS_PER_SIDE * CELLS_PER_SIDE * DISTANCE_LAYERS;
/// Cells on a side of what is looked at together where little falls, up to this many.
const COARSEST_SIDE: usize = 8;
/// Fewer photons say nothing.
const MIN_PHOTONS: u32 = 6;
/// The radius of the ball: so many standard deviations (1.4 hold all of an even disk), and a little where few tell of it.
const RADIUS_SIGMAS: f64 = 1.75;
const MIN_RADIUS: f64 = 0.02;

/// Where light has left an object that falls into a cell, in units of the sphere around the object and from its middle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GuideTarget {
    pub center: [f32; 3],
    /// 0 where nothing falls.
    pub radius: f32,
}

/// That of all cells around an object.
#[derive(Clone, Debug)]
pub(crate) struct CausticMap(Box<[GuideTarget; CELL_COUNT]>);

/// A photon that has left an object and falls on something, both scene-local.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhotonDeposit {
    pub exit_point: DVec3,
    pub landing_point: DVec3,
    /// In units of any kind; greater than 0.
    pub power: f64,
}

/// What has fallen into a cell.
#[derive(Clone, Copy, Debug, Default)]
struct CellStats {
    count: u32,
    power: f64,
    /// Of the places where they left, and of their squares, both times power.
    left: DVec3,
    square: f64,
}

impl CausticMap {
    /// By the photons that this object has thrown.
    pub fn new(mirror: &CausticCaster, fallen: impl Iterator<Item = PhotonDeposit>) -> Self {
        let from_middle = |place: DVec3| (place - mirror.center) / mirror.radius;
        let mut sums = vec![CellStats::default(); CELL_COUNT];
        for PhotonDeposit {
            exit_point: left,
            landing_point: at,
            power,
        } in fallen
        {
            let left = from_middle(left);
            sums[cell_index(from_middle(at).as_vec3())].add(&CellStats {
                count: 1,
                power,
                left: left * power,
                square: left.length_squared() * power,
            });
        }
        let mut exits = Box::new([GuideTarget::default(); CELL_COUNT]);
        let mut size = 1;
        while size <= COARSEST_SIDE {
            let part = |cell: usize| {
                let [x, y, layer] = [
                    cell % CELLS_PER_SIDE,
                    cell / CELLS_PER_SIDE % CELLS_PER_SIDE,
                    cell / (CELLS_PER_SIDE * CELLS_PER_SIDE),
                ];
                ((layer / size) * CELLS_PER_SIDE + y / size) * CELLS_PER_SIDE + x / size
            };
            let mut parts = vec![CellStats::default(); CELL_COUNT];
            for (cell, sum) in sums.iter().enumerate() {
                parts[part(cell)].add(sum);
            }
            let unknown = exits.iter_mut().enumerate();
            for (cell, exit) in unknown.filter(|(_, exit)| exit.radius == 0.0) {
                *exit = parts[part(cell)].target();
            }
            size *= 2;
        }
        Self(exits)
    }

    /// What falls on a place: `way` leads there from the object's middle, in units of the sphere around it.
    #[inline(always)]
    pub fn lookup(&self, way: Vec3) -> GuideTarget {
        // A power of two of them, so that no index needs a check.
        self.0[cell_index(way) % CELL_COUNT]
    }
}

impl CellStats {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.power += other.power;
        self.left += other.left;
        self.square += other.square;
    }

    fn target(&self) -> GuideTarget {
        if self.count < MIN_PHOTONS {
            return GuideTarget::default();
        }
        let mean = self.left / self.power;
        let variance = (self.square / self.power - mean.length_squared()).max(0.0);
        GuideTarget {
            center: mean.as_vec3().to_array(),
            radius: (RADIUS_SIGMAS * variance.sqrt() + MIN_RADIUS) as f32,
        }
    }
}

/// In which cell the end of a way is: directions are unfolded to an octahedron and that to a square (Q. Meyer et al., "On
/// Floating-Point Normal Vectors", 2010).
#[inline(always)]
fn cell_index(way: Vec3) -> usize {
    let sum = way.x.abs() + way.y.abs() + way.z.abs();
    let (x, y) = (way.x / sum, way.y / sum);
    let folded = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    let (x, y) = if way.z < 0.0 { folded } else { (x, y) };
    let along = |x: f32, cells: usize| (x * cells as f32).clamp(0.0, cells as f32 - 1.0) as u32;
    let [x, y] = [x, y].map(|x| along(0.5 * x + 0.5, CELLS_PER_SIDE));
    let layer = along(1.0 / way.length(), DISTANCE_LAYERS);
    ((layer * CELLS_PER_SIDE as u32 + y) * CELLS_PER_SIDE as u32 + x) as usize
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const MIRROR: CausticCaster = CausticCaster {
        instance: 0,
        center: DVec3::new(1.0, 2.0, 3.0),
        radius: 0.5,
    };

    /// What a mirror throws into its whole surroundings from a small ball within its sphere, both in units of that.
    pub fn from_ball(mirror: &CausticCaster, center: DVec3, radius: f64) -> CausticMap {
        let golden = 0.618_033_988_75;
        let fallen = (0..100_000).map(|i| {
            let number = |k: i32| (0.5 + f64::from(i) * f64::powi(golden, k)).fract();
            let direction = |k: i32| {
                let z = 2.0 * number(k) - 1.0;
                let (sin, cos) = (std::f64::consts::TAU * number(k + 1)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                DVec3::new(across * cos, across * sin, z)
            };
            let left = center + direction(1) * radius;
            PhotonDeposit {
                exit_point: mirror.center + mirror.radius * left,
                landing_point: mirror.center + mirror.radius * direction(3) / number(5).max(0.01),
                power: 1.0,
            }
        });
        CausticMap::new(mirror, fallen)
    }

    fn fallen(left: DVec3, at: DVec3, power: f64) -> PhotonDeposit {
        let placed = |place: DVec3| MIRROR.center + MIRROR.radius * place;
        PhotonDeposit {
            exit_point: placed(left),
            landing_point: placed(at),
            power,
        }
    }

    #[test]
    fn light_comes_from_where_it_left() {
        let at = DVec3::new(1.5, -0.4, -2.0);
        let left = |i: usize| {
            let (sin, cos) = (f64::from(i as u32) * 0.1).sin_cos();
            DVec3::new(0.6 + 0.1 * cos, 0.1 * sin, -0.5)
        };
        // What is strong counts more.
        let weak = (0..50).map(|i| fallen(-left(i), at, 1e-9));
        let strong = (0..63).map(|i| fallen(left(i), at, 1.0));
        let thrown = CausticMap::new(&MIRROR, weak.chain(strong));
        let exit = thrown.lookup(at.as_vec3());
        let center = Vec3::from(exit.center);
        assert!(
            center.distance(Vec3::new(0.6, 0.0, -0.5)) < 2e-3,
            "{exit:?}"
        );
        assert!((exit.radius - 0.195).abs() < 2e-3, "{exit:?}");
    }

    #[test]
    fn where_little_falls_more_is_looked_at() {
        let [here, beside, behind] = [
            DVec3::new(0.05, 0.05, 3.0),
            DVec3::new(0.4, 0.4, 3.0),
            DVec3::new(0.05, 0.05, -3.0),
        ];
        assert_ne!(cell_index(here.as_vec3()), cell_index(beside.as_vec3()));
        let left = DVec3::new(0.2, 0.3, 0.4);
        let few = |count| CausticMap::new(&MIRROR, (0..count).map(|_| fallen(left, here, 1.0)));
        let radius = |count, at: DVec3| few(count).lookup(at.as_vec3()).radius;
        assert_eq!(radius(MIN_PHOTONS as usize - 1, here), 0.0);
        assert!(radius(MIN_PHOTONS as usize, here) > 0.0);
        assert!(radius(MIN_PHOTONS as usize, beside) > 0.0);
        assert_eq!(radius(1000, behind), 0.0);
    }

    #[test]
    fn every_place_is_in_a_cell() {
        for x in [0.0, -0.0, 1.0, -1.0, 1e-30, 1e30, f32::INFINITY, f32::NAN] {
            for y in [0.0, 2.0, -1e-30, -1e30] {
                for z in [0.0, -3.0, 1e-38] {
                    assert!(cell_index(Vec3::new(x, y, z)) < CELL_COUNT);
                }
            }
        }
        let ways = [
            (1, 1, 1),
            (-1, 1, 1),
            (1, -1, 1),
            (1, 1, -1),
            (2, 1, 1),
            (6, 6, 6),
        ];
        let mut cells = ways.map(|(x, y, z)| cell_index(Vec3::new(x as f32, y as f32, z as f32)));
        cells.sort_unstable();
        assert!(cells.windows(2).all(|two| two[0] < two[1]), "{cells:?}");
    }
}
