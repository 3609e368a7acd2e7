//! Refinement of several hits at once to one unit in the last place.

use crate::exact::predicates::RayPredicates;
use crate::ray::{ExactHit, ExactRay, INVALID_ID};
use crate::scene::ExactTriangles;
use crate::simd::Isa;

/// Hits that are refined at once.
const LANES: usize = 8;

/// One number of each hit.
type Row = [f64; LANES];

/// Rays and corners of hits, in SoA.
#[derive(Default)]
struct Intersections {
    origin: [Row; 3],
    direction: [Row; 3],
    corners: [[Row; 3]; 3],
}

impl Intersections {
    fn set(&mut self, lane: usize, ray: &ExactRay, corners: [[f64; 3]; 3]) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
            for (row, corner) in self.corners.iter_mut().zip(corners) {
                row[axis][lane] = corner[axis];
            }
        }
    }

    fn get(&self, lane: usize) -> (RayPredicates, [[f64; 3]; 3]) {
        let ray =
            RayPredicates { origin: self.origin.map(|row| row[lane]), direction: self.direction.map(|row| row[lane]) };
        (ray, self.corners.map(|corner| corner.map(|row| row[lane])))
    }

    /// t and the weights of the second and third corner.
    #[inline(always)]
    fn refine(&self) -> [Row; 3] {
        let (mut found, mut sure) = ([[0.0; LANES]; 3], [0u64; LANES]);
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &self.corners;
        let [t, u, v] = &mut found;
        // The code has no loop and no branch, so that the compiler vectorises it.
        for i in 0..LANES {
            let ray = RayPredicates { origin: [ox[i], oy[i], oz[i]], direction: [dx[i], dy[i], dz[i]] };
            let corners = [[ax[i], ay[i], az[i]], [bx[i], by[i], bz[i]], [cx[i], cy[i], cz[i]]];
            let (values, is_sure) = ray.quick_intersection(corners);
            [t[i], u[i], v[i]] = values;
            sure[i] = u64::from(is_sure);
        }
        for lane in (0..LANES).filter(|lane| sure[*lane] == 0) {
            let (ray, corners) = self.get(lane);
            let values = ray.intersection(corners);
            for (row, value) in found.iter_mut().zip(values) {
                row[lane] = value;
            }
        }
        found
    }
}

/// Refines hits; `hits[i]` belongs to the ray `owner(i)`. Misses are not changed.
#[inline(always)]
pub fn refine_hits<I: Isa>(
    rays: &[ExactRay],
    owner: impl Fn(usize) -> usize,
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
) {
    let mut batch = Intersections::default();
    for (chunk, hits) in hits.chunks_mut(LANES).enumerate() {
        for (lane, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
            let corners = triangles.corners(hit.instance, hit.triangle);
            batch.set(lane, &rays[owner(chunk * LANES + lane)], corners);
        }
        let [t, u, v] = batch.refine();
        for (lane, hit) in hits.iter_mut().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
            (hit.t, hit.u, hit.v) = (t[lane], u[lane], v[lane]);
        }
    }
}

/// The hit of every ray, refined.
#[inline(always)]
pub fn refine_each<I: Isa>(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) {
    refine_hits::<I>(rays, |i| i, triangles, hits);
}
