//! Refines hits whose triangles were found in float32: t and the weights are computed for several hits at once, to one
//! unit in the last place.

use crate::exact::predicates::RayPredicates;
use crate::node::cross;
use crate::ray::{ExactHit, ExactRay, INVALID_ID};
use crate::scene::ExactTriangles;
use crate::simd::Isa;
use crate::traverse::exact::triangle::{ShearedRay, max_f64};

/// Number of hits that are refined at once.
const LANES: usize = 8;

/// A row with one number per hit.
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

    /// Computes t and the weights of the second and third corner.
    #[inline(always)]
    fn refine(&self) -> [Row; 3] {
        let (mut found, mut sure) = ([[0.0; LANES]; 3], [0u64; LANES]);
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &self.corners;
        let [t, u, v] = &mut found;
        // The loop's body has no inner loop and no branch, so that the compiler vectorises the loop.
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

/// Refines hits, including pending hits; `hits[i]` belongs to the ray `owner(i)`. Misses are not changed.
#[inline(always)]
pub fn refine_hits<I: Isa>(
    rays: &[ExactRay],
    owner: impl Fn(usize) -> usize,
    triangles: &dyn ExactTriangles,
    hits: &mut [ExactHit],
) {
    let mut batch = Intersections::default();
    // Corners are scattered in memory: their indices are prefetched two chunks ahead, and their coordinates one chunk
    // ahead.
    let prefetch = |hits: &[ExactHit], chunk: usize, prefetch: &dyn Fn(&ExactHit)| {
        let ahead = hits.chunks(LANES).nth(chunk).unwrap_or_default();
        ahead.iter().filter(|hit| hit.instance != INVALID_ID).for_each(prefetch);
    };
    let indices = |hit: &ExactHit| triangles.prefetch_indices(hit.instance, hit.triangle);
    let corners = |hit: &ExactHit| triangles.prefetch_corners(hit.instance, hit.triangle);
    prefetch(hits, 0, &indices);
    prefetch(hits, 1, &indices);
    prefetch(hits, 0, &corners);
    for chunk in 0..hits.len().div_ceil(LANES) {
        prefetch(hits, chunk + 2, &indices);
        prefetch(hits, chunk + 1, &corners);
        let end = hits.len().min((chunk + 1) * LANES);
        let hits = &mut hits[chunk * LANES..end];
        for (lane, hit) in hits.iter_mut().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
            let corners = triangles.corners(hit.instance, hit.triangle);
            let ray = &rays[owner(chunk * LANES + lane)];
            batch.set(lane, ray, corners);
            if is_pending(hit) {
                orient(ray, corners, hit);
            }
        }
        let [t, u, v] = batch.refine();
        for (lane, hit) in hits.iter_mut().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
            (hit.t, hit.u, hit.v) = (t[lane], u[lane], v[lane]);
        }
    }
}

/// Refines the hit of every ray.
#[inline(always)]
pub fn refine_each<I: Isa>(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) {
    refine_hits::<I>(rays, |i| i, triangles, hits);
}

/// True if only the triangle of a hit is known.
#[inline(always)]
fn is_pending(hit: &ExactHit) -> bool {
    hit.side == 0 && hit.triangle != INVALID_ID
}

/// A ray's direction, divided by a power of two so that its largest component is in 1..2; and this divisor.
#[inline(always)]
fn scaled_direction(ray: &ExactRay) -> ([f64; 3], f64) {
    let steepest = ray.direction.iter().fold(0.0, |most, d| max_f64(most, d.abs()));
    let power = f64::from_bits(steepest.to_bits() & (0x7ff << 52));
    let fraction = 1.0 / power;
    (ray.direction.map(|d| d * fraction), power)
}

/// Computes the intersections of pending hits in the same way as the search.
#[inline(always)]
pub fn intersect_each<I: Isa>(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) {
    for (ray, hit) in rays.iter().zip(hits) {
        if is_pending(hit) {
            let (direction, power) = scaled_direction(ray);
            let sheared = ShearedRay::new(ray.origin, direction);
            if let Some(found) = sheared.intersect(triangles.corners(hit.instance, hit.triangle)) {
                let found = found.to_hit(hit.instance, hit.triangle);
                *hit = ExactHit { t: found.t / power, ..found };
            }
        }
    }
}

/// Computes the normals and sides of pending hits.
#[inline(always)]
pub fn orient_each<I: Isa>(rays: &[ExactRay], triangles: &dyn ExactTriangles, hits: &mut [ExactHit]) {
    for (ray, hit) in rays.iter().zip(hits) {
        if is_pending(hit) {
            orient(ray, triangles.corners(hit.instance, hit.triangle), hit);
        }
    }
}

/// Sets the normal and the side of a pending hit. float64 determines the side, because the ray passes the triangle at a
/// distance from its edges that even float32 does not round to 0.
#[inline(always)]
fn orient(ray: &ExactRay, corners: [[f64; 3]; 3], hit: &mut ExactHit) {
    let normal = cross(corners);
    let ([x, y, z], _) = scaled_direction(ray);
    hit.normal = normal;
    hit.side = if x * normal[0] + y * normal[1] + z * normal[2] > 0.0 { 1 } else { -1 };
}
