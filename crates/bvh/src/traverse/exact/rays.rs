//! Float64 rays in SoA, with their closest hits so far.

use crate::node::cross;
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::Scene;
use crate::traverse::exact::single::{ClippedRay, F64_ERROR, t_max_f32};
use crate::traverse::packet::soa::PACKET_SIZE;

/// One value per ray.
type RayRow = [f64; PACKET_SIZE];

/// Up to 64 rays near the scene, by ray index; entries of other rays are meaningless.
pub struct RaySoa64 {
    /// Origin in the world and direction as given, the latter scaled to a largest component in 1..2.
    origin: [RayRow; 3],
    direction: [RayRow; 3],
    /// The given t is the t along `direction` divided by this power of two.
    direction_scale: RayRow,
    /// The t of the closest hit so far, along `direction`.
    t_hit: RayRow,
    /// Shear of x and y per unit of the main axis.
    shear: [RayRow; 2],
    /// The main axis, of the largest component of the direction.
    major_axis: [u8; PACKET_SIZE],
    /// Origin and direction in scaled scene coordinates, rounded to float32.
    origin_f32: [[f32; PACKET_SIZE]; 3],
    direction_f32: [[f32; PACKET_SIZE]; 3],
    /// The largest absolute coordinate of the scaled origin.
    max_abs_origin: RayRow,
    origin_class: [u8; PACKET_SIZE],
    /// The main axis that all rays share, if they do.
    shared_major_axis: Option<usize>,
}

/// The class of a ray by its origin. Rows hold the discriminants, for vectorised code.
#[repr(u8)]
#[derive(Clone, Copy, PartialEq)]
pub enum OriginClass {
    /// The ray misses by definition.
    Misses,
    /// The origin is near the scene.
    Near,
    /// The origin is far away: the ray is clipped first.
    Far,
}

/// The axis after each axis.
const NEXT_AXES: [usize; 3] = [1, 2, 0];

impl RaySoa64 {
    pub const EMPTY: RaySoa64 = RaySoa64 {
        origin: [[0.0; PACKET_SIZE]; 3],
        direction: [[0.0; PACKET_SIZE]; 3],
        direction_scale: [0.0; PACKET_SIZE],
        t_hit: [0.0; PACKET_SIZE],
        shear: [[0.0; PACKET_SIZE]; 2],
        major_axis: [0; PACKET_SIZE],
        origin_f32: [[0.0; PACKET_SIZE]; 3],
        direction_f32: [[0.0; PACKET_SIZE]; 3],
        max_abs_origin: [0.0; PACKET_SIZE],
        origin_class: [OriginClass::Misses as u8; PACKET_SIZE],
        shared_major_axis: None,
    };

    /// Loads rays. A ray is near if its origin is within `reach` of the scene's origin, in scaled scene coordinates.
    #[inline(always)]
    pub fn load(&mut self, scene: &Scene, rays: &[ExactRay], reach: f64) {
        for (i, ray) in rays.iter().enumerate() {
            for axis in 0..3 {
                self.origin[axis][i & (PACKET_SIZE - 1)] = ray.origin[axis];
                self.direction[axis][i & (PACKET_SIZE - 1)] = ray.direction[axis];
            }
            self.t_hit[i & (PACKET_SIZE - 1)] = ray.t_max;
        }
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &mut self.direction);
        let [sx, sy] = &mut self.shear;
        let ([wx, wy, wz], scale) = (scene.origin(), scene.scale);
        let ([px, py, pz], [ax, ay, az]) = (&mut self.origin_f32, &mut self.direction_f32);
        // Branch-free, so that it is vectorised.
        for i in 0..PACKET_SIZE {
            let size = [dx[i].abs(), dy[i].abs(), dz[i].abs()];
            let steepest = max_f64(max_f64(size[0], size[1]), size[2]);
            let finite = (size[0] <= f64::MAX)
                & (size[1] <= f64::MAX)
                & (size[2] <= f64::MAX)
                & (ox[i].abs() <= f64::MAX)
                & (oy[i].abs() <= f64::MAX)
                & (oz[i].abs() <= f64::MAX);
            // Excludes subnormal directions, whose scaling would not be exact, and a NaN t_max.
            let sane = finite & (steepest >= f64::MIN_POSITIVE) & (self.t_hit[i] >= 0.0);
            let power = f64::from_bits(steepest.to_bits() & (0x7ff << 52));
            let d = [dx[i] / power, dy[i] / power, dz[i] / power];
            (dx[i], dy[i], dz[i]) = (d[0], d[1], d[2]);
            self.direction_scale[i] = power;
            self.t_hit[i] *= power;
            let size = [d[0].abs(), d[1].abs(), d[2].abs()];
            let first = (size[0] >= size[1]) & (size[0] >= size[2]);
            let second = size[1] >= size[2];
            let pick = |a, b, c| {
                if first {
                    a
                } else if second {
                    b
                } else {
                    c
                }
            };
            let main = pick(d[0], d[1], d[2]);
            let after = pick(d[1], d[2], d[0]);
            let last = pick(d[2], d[0], d[1]);
            (sx[i], sy[i]) = (after / main, last / main);
            self.major_axis[i] = if first {
                0
            } else if second {
                1
            } else {
                2
            };
            let start = [(ox[i] - wx) * scale, (oy[i] - wy) * scale, (oz[i] - wz) * scale];
            let farthest = max_f64(max_f64(start[0].abs(), start[1].abs()), start[2].abs());
            self.max_abs_origin[i] = farthest;
            self.origin_class[i] = (sane as u8) * (2 - (farthest <= reach) as u8);
            (px[i], py[i], pz[i]) = (start[0] as f32, start[1] as f32, start[2] as f32);
            (ax[i], ay[i], az[i]) = ((d[0] * scale) as f32, (d[1] * scale) as f32, (d[2] * scale) as f32);
        }
        let first = self.major_axis[0];
        let same = self.major_axis[..rays.len()].iter().all(|main| *main == first);
        self.shared_major_axis = same.then_some(usize::from(first));
    }

    /// The class of ray `i`.
    #[inline(always)]
    pub fn origin_class(&self, i: usize) -> OriginClass {
        match self.origin_class[i & (PACKET_SIZE - 1)] {
            0 => OriginClass::Misses,
            1 => OriginClass::Near,
            _ => OriginClass::Far,
        }
    }

    /// The ray in scaled scene coordinates, its largest coordinate, and the error bound of its origin.
    #[inline(always)]
    pub fn local_ray_f32(&self, scene: &Scene, i: usize) -> (Ray, f32, f64) {
        let i = i & (PACKET_SIZE - 1);
        let origin = [self.origin_f32[0][i], self.origin_f32[1][i], self.origin_f32[2][i]];
        let ray = Ray {
            origin,
            direction: [self.direction_f32[0][i], self.direction_f32[1][i], self.direction_f32[2][i]],
            t_max: self.t_max_f32(i).next_up(),
        };
        let farthest = self.max_abs_origin[i];
        (ray, farthest as f32, origin_error(scene, farthest))
    }

    /// The t up to which boxes must be visited.
    #[inline(always)]
    pub fn t_max_f32(&self, i: usize) -> f32 {
        t_max_f32(self.t_hit[i & (PACKET_SIZE - 1)], 0.0)
    }

    /// Origin in scaled scene coordinates, and direction.
    #[inline(always)]
    pub fn local_ray_f64(&self, scene: &Scene, i: usize) -> ([f64; 3], [f64; 3]) {
        let (i, world) = (i & (PACKET_SIZE - 1), scene.origin());
        (
            std::array::from_fn(|a| (self.origin[a][i] - world[a]) * scene.scale),
            std::array::from_fn(|a| self.direction[a][i]),
        )
    }

    /// A single ray with its closest hit so far.
    pub fn to_single(&self, scene: &Scene, i: usize, hit: &ExactHit) -> ClippedRay {
        let i = i & (PACKET_SIZE - 1);
        let (start, direction) = self.local_ray_f64(scene, i);
        ClippedRay {
            origin: std::array::from_fn(|a| self.origin[a][i]),
            direction,
            direction_scale: self.direction_scale[i],
            local_origin: start,
            t_offset: 0.0,
            origin_error: origin_error(scene, self.max_abs_origin[i]),
            best: ExactHit { t: self.t_hit[i], ..*hit },
        }
    }

    /// Takes over the hit of a single ray.
    pub fn commit(&mut self, i: usize, ray: &ClippedRay, hit: &mut ExactHit) {
        self.t_hit[i & (PACKET_SIZE - 1)] = ray.best.t;
        *hit = ray.best;
    }

    /// Writes the t of the hit, if any, in lengths of the given direction.
    #[inline(always)]
    pub fn to_hit(&self, i: usize, hit: &mut ExactHit) {
        let i = i & (PACKET_SIZE - 1);
        if hit.triangle != crate::INVALID_ID {
            hit.t = self.t_hit[i] / self.direction_scale[i];
        }
    }

    /// Intersects one ray with a triangle.
    #[inline(always)]
    pub fn intersect_one(&mut self, i: usize, corners: [[f64; 3]; 3], triangle: (u32, u32), hits: &mut [ExactHit]) {
        let i = i & (PACKET_SIZE - 1);
        let normal = cross(corners);
        let [u, v, w] = self.edge_functions(i, usize::from(self.major_axis[i]) % 3, &corners);
        if same_sign(u, v, w) && normal != [0.0; 3] {
            self.accept_hit(i, [u, v, w], &corners, normal, triangle, hits);
        }
    }

    /// Intersects many rays with a triangle; hits are those of [`RaySoa64::intersect_one`]. True if any hit is closer.
    #[inline(always)]
    pub fn intersect_many(
        &mut self,
        rays: u64,
        corners: [[f64; 3]; 3],
        triangle: (u32, u32),
        hits: &mut [ExactHit],
    ) -> bool {
        let normal = cross(corners);
        // Rounding may give collinear corners a determinant.
        if normal == [0.0; 3] {
            return false;
        }
        let mut inside = match self.shared_major_axis {
            Some(0) => self.edge_test::<0>(&corners),
            Some(1) => self.edge_test::<1>(&corners),
            Some(2) => self.edge_test::<2>(&corners),
            _ => u64::MAX,
        } & rays;
        let mut closer = false;
        while inside != 0 {
            let i = inside.trailing_zeros() as usize;
            inside &= inside - 1;
            let [u, v, w] = self.edge_functions(i, usize::from(self.major_axis[i]) % 3, &corners);
            if same_sign(u, v, w) {
                closer |= self.accept_hit(i, [u, v, w], &corners, normal, triangle, hits);
            }
        }
        closer
    }

    /// Bit i: ray i, whose main axis is `Z`, passes the edge test.
    #[inline(always)]
    fn edge_test<const Z: usize>(&self, corners: &[[f64; 3]; 3]) -> u64 {
        let (x, y) = (NEXT_AXES[Z], NEXT_AXES[NEXT_AXES[Z]]);
        let (ox, oy, oz) = (&self.origin[x], &self.origin[y], &self.origin[Z]);
        let [sx, sy] = &self.shear;
        let [a, b, c] = *corners;
        let mut inside = [0u8; PACKET_SIZE];
        for i in 0..PACKET_SIZE {
            let (za, zb, zc) = (a[Z] - oz[i], b[Z] - oz[i], c[Z] - oz[i]);
            let (ax, ay) = (a[x] - ox[i] - sx[i] * za, a[y] - oy[i] - sy[i] * za);
            let (bx, by) = (b[x] - ox[i] - sx[i] * zb, b[y] - oy[i] - sy[i] * zb);
            let (cx, cy) = (c[x] - ox[i] - sx[i] * zc, c[y] - oy[i] - sy[i] * zc);
            let u = cx * by - cy * bx;
            let v = ax * cy - ay * cx;
            let w = bx * ay - by * ax;
            inside[i] = same_sign(u, v, w) as u8;
        }
        bits(&inside)
    }

    /// The edge functions of [`crate::traverse::packet::triangle`] in float64, sheared so that ray `i` is the main axis
    /// `z`.
    #[inline(always)]
    fn edge_functions(&self, i: usize, z: usize, corners: &[[f64; 3]; 3]) -> [f64; 3] {
        let (x, y) = (NEXT_AXES[z], NEXT_AXES[NEXT_AXES[z]]);
        let i = i & (PACKET_SIZE - 1);
        let (sx, sy) = (self.shear[0][i], self.shear[1][i]);
        let (ox, oy, oz) = (self.origin[x][i], self.origin[y][i], self.origin[z][i]);
        let [a, b, c] = corners.map(|p| {
            let along = p[z] - oz;
            [p[x] - ox - sx * along, p[y] - oy - sy * along]
        });
        [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]]
    }

    /// Accepts a triangle that ray `i` passes through, if it is closer than the closest hit so far.
    #[inline(always)]
    fn accept_hit(
        &mut self,
        i: usize,
        [u, v, w]: [f64; 3],
        corners: &[[f64; 3]; 3],
        normal: [f64; 3],
        (instance, triangle): (u32, u32),
        hits: &mut [ExactHit],
    ) -> bool {
        let i = i & (PACKET_SIZE - 1);
        let z = usize::from(self.major_axis[i]) % 3;
        let det = u + v + w;
        if det == 0.0 {
            return false;
        }
        let (wa, wb, wc) = (u / det, v / det, w / det);
        let [a, b, c] = corners.map(|p| (p[z] - self.origin[z][i]) / self.direction[z][i]);
        let t = wa * a + wb * b + wc * c;
        let (best, hit) = (self.t_hit[i], &mut hits[i]);
        let first = hit.triangle == crate::INVALID_ID || (instance, triangle) < (hit.instance, hit.triangle);
        if !(t >= 0.0 && (t < best || t == best && first)) {
            return false;
        }
        self.t_hit[i] = t;
        *hit = ExactHit { t, u: wb, v: wc, instance, triangle, normal };
        true
    }
}

/// True if edge functions do not differ in sign.
#[inline(always)]
fn same_sign(u: f64, v: f64, w: f64) -> bool {
    ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
}

/// The error bound of a ray's origin, in scaled scene coordinates.
#[inline(always)]
fn origin_error(scene: &Scene, farthest: f64) -> f64 {
    let world = scene.origin().map(|x| (x * scene.scale).abs());
    let offset = farthest.max(world[0]).max(world[1]).max(world[2]);
    F64_ERROR * (offset + f64::from(scene.max_abs_coord))
}

#[inline(always)]
fn max_f64(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Bit i: byte i is 1; the others are 0.
#[inline(always)]
fn bits(bytes: &[u8; PACKET_SIZE]) -> u64 {
    let mut all = 0;
    for (k, eight) in bytes.as_chunks::<8>().0.iter().enumerate() {
        // Bit 8 j times bit 56 - 7 j is bit 56 + j, and no two products coincide.
        let some = u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        all |= some << (8 * k);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_become_bits() {
        for mask in [0, 1, 0x80, u64::MAX, 0x0123_4567_89ab_cdef, 1 << 63, 0xa5a5_5a5a_0f0f_f00f] {
            let bytes = std::array::from_fn(|i| (mask >> i & 1) as u8);
            assert_eq!(bits(&bytes), mask);
        }
    }
}
