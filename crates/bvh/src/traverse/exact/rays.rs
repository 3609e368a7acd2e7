//! Float64 rays in SoA, with their closest hits so far.

use crate::limits::MACHINE_EPSILON;
use crate::ray::{ExactHit, ExactRay, Ray};
use crate::scene::{ExactTriangles, Scene};
use crate::traverse::exact::clipped_ray::{ClippedRay, DONE, F64_ERROR, t_max_f32};
use crate::traverse::exact::ties::TieWindow;
use crate::traverse::exact::triangle::{HitSoFar, ShearedRay, max_f64};
use crate::traverse::packet::soa::PACKET_SIZE;

/// One value per ray.
type RayRow = [f64; PACKET_SIZE];

/// Up to 64 rays near the scene, by ray index; entries of all other rays are unspecified.
pub struct RaySoa64 {
    /// Origin and direction in world coordinates; the direction is scaled by a power of two so that its largest
    /// component is in 1..2.
    origin: [RayRow; 3],
    direction: [RayRow; 3],
    /// Power of two by which t along `direction` is divided to get t along the given direction.
    direction_scale: RayRow,
    /// The smallest valid t; 0 for all rays near the scene.
    t_min: RayRow,
    /// The t of the closest hit so far, along `direction`.
    t_hit: RayRow,
    /// The error bound of `t_hit`.
    t_error: RayRow,
    /// Bounds of the t of the closest hit so far, or of the end of the ray.
    pub t_range: [[f32; PACKET_SIZE]; 2],
    /// Bit i: the closest hit of ray i is pending: its triangle is known, but its intersection has not been computed,
    /// and `t_hit` is an upper bound on its t.
    pending: u64,
    /// Shear of x and y per unit of the major axis.
    shear: [RayRow; 2],
    /// The major axis: the axis of the direction's largest component.
    major_axis: [u8; PACKET_SIZE],
    /// Origin and direction in scaled scene coordinates, rounded to float32.
    origin_f32: [[f32; PACKET_SIZE]; 3],
    direction_f32: [[f32; PACKET_SIZE]; 3],
    /// The largest absolute coordinate of the scaled origin.
    max_abs_origin: RayRow,
    origin_class: [u8; PACKET_SIZE],
    /// True if any hit is sufficient: a ray that has a hit is done.
    pub any_hit: bool,
    /// Bit i: ray i may have hit two surfaces at equal distances.
    pub contested: u64,
    ties: TieWindow,
}

/// Class of a ray by its origin. Rows store the class as a number, so that code is vectorised.
#[repr(u8)]
#[derive(Clone, Copy, PartialEq)]
pub enum OriginClass {
    /// The ray is invalid, for example not finite, and therefore misses.
    Misses,
    /// The origin is near the scene.
    Near,
    /// The origin is far away: the ray is clipped first.
    Far,
}

impl RaySoa64 {
    pub const EMPTY: RaySoa64 = RaySoa64 {
        origin: [[0.0; PACKET_SIZE]; 3],
        direction: [[0.0; PACKET_SIZE]; 3],
        direction_scale: [0.0; PACKET_SIZE],
        t_min: [0.0; PACKET_SIZE],
        t_hit: [0.0; PACKET_SIZE],
        t_error: [0.0; PACKET_SIZE],
        t_range: [[0.0; PACKET_SIZE]; 2],
        pending: 0,
        shear: [[0.0; PACKET_SIZE]; 2],
        major_axis: [0; PACKET_SIZE],
        origin_f32: [[0.0; PACKET_SIZE]; 3],
        direction_f32: [[0.0; PACKET_SIZE]; 3],
        max_abs_origin: [0.0; PACKET_SIZE],
        origin_class: [OriginClass::Misses as u8; PACKET_SIZE],
        any_hit: false,
        contested: 0,
        ties: TieWindow::EMPTY,
    };

    /// Loads rays. A ray is near if its origin is within `reach` of the scene's origin, in scaled scene coordinates.
    #[inline(always)]
    pub fn load(&mut self, scene: &Scene, rays: &[ExactRay], reach: f64) {
        (self.contested, self.pending, self.ties) = (0, 0, TieWindow::new(scene));
        for (i, ray) in rays.iter().enumerate() {
            for axis in 0..3 {
                self.origin[axis][i & (PACKET_SIZE - 1)] = ray.origin[axis];
                self.direction[axis][i & (PACKET_SIZE - 1)] = ray.direction[axis];
            }
            self.t_hit[i & (PACKET_SIZE - 1)] = ray.t_max;
            self.t_error[i & (PACKET_SIZE - 1)] = 0.0;
            self.t_min[i & (PACKET_SIZE - 1)] = ray.t_min;
        }
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &mut self.direction);
        let [sx, sy] = &mut self.shear;
        let ([wx, wy, wz], scale) = (scene.origin(), scene.scale);
        let ([px, py, pz], [ax, ay, az]) = (&mut self.origin_f32, &mut self.direction_f32);
        // The loop has no branches, so that the compiler vectorises it.
        for i in 0..PACKET_SIZE {
            let size = [dx[i].abs(), dy[i].abs(), dz[i].abs()];
            let steepest = max_f64(max_f64(size[0], size[1]), size[2]);
            let finite = (size[0] <= f64::MAX)
                & (size[1] <= f64::MAX)
                & (size[2] <= f64::MAX)
                & (ox[i].abs() <= f64::MAX)
                & (oy[i].abs() <= f64::MAX)
                & (oz[i].abs() <= f64::MAX);
            // This check excludes subnormal directions, whose scaling would not be exact, and a t_max of NaN.
            let sane = finite & (steepest >= f64::MIN_POSITIVE) & (self.t_hit[i] >= self.t_min[i]);
            let power = f64::from_bits(steepest.to_bits() & (0x7ff << 52));
            let d = [dx[i] / power, dy[i] / power, dz[i] / power];
            (dx[i], dy[i], dz[i]) = (d[0], d[1], d[2]);
            self.direction_scale[i] = power;
            self.t_hit[i] *= power;
            self.t_range[0][i] = self.t_hit[i] as f32 * (1.0 - 4.0 * MACHINE_EPSILON) - f32::MIN_POSITIVE;
            self.t_range[1][i] = self.t_hit[i] as f32 * (1.0 + 4.0 * MACHINE_EPSILON) + f32::MIN_POSITIVE;
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
            let near = (farthest <= reach) & (self.t_min[i] == 0.0);
            self.origin_class[i] = (sane as u8) * (2 - near as u8);
            (px[i], py[i], pz[i]) = (start[0] as f32, start[1] as f32, start[2] as f32);
            (ax[i], ay[i], az[i]) = ((d[0] * scale) as f32, (d[1] * scale) as f32, (d[2] * scale) as f32);
        }
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

    /// Ray `i` in scaled scene coordinates, and the largest absolute coordinate of its origin.
    #[inline(always)]
    pub fn local_ray_f32(&self, i: usize) -> (Ray, f64) {
        let i = i & (PACKET_SIZE - 1);
        let origin = [self.origin_f32[0][i], self.origin_f32[1][i], self.origin_f32[2][i]];
        let ray = Ray {
            origin,
            direction: [self.direction_f32[0][i], self.direction_f32[1][i], self.direction_f32[2][i]],
            t_max: self.t_max_f32(i).next_up(),
        };
        (ray, self.max_abs_origin[i])
    }

    /// The t up to which boxes must be visited.
    #[inline(always)]
    pub fn t_max_f32(&self, i: usize) -> f32 {
        t_max_f32(self.t_hit[i & (PACKET_SIZE - 1)], 0.0, &self.ties)
    }

    /// The origin of ray `i` in scaled scene coordinates, and its direction.
    #[inline(always)]
    pub fn local_ray_f64(&self, scene: &Scene, i: usize) -> ([f64; 3], [f64; 3]) {
        let (i, world) = (i & (PACKET_SIZE - 1), scene.origin());
        let at = |axis: usize| (self.origin[axis][i] - world[axis]) * scene.scale;
        ([at(0), at(1), at(2)], [self.direction[0][i], self.direction[1][i], self.direction[2][i]])
    }

    /// Converts ray `i`, with its closest hit so far, to a single ray.
    pub fn to_single(&self, scene: &Scene, i: usize, hit: &ExactHit) -> ClippedRay {
        let i = i & (PACKET_SIZE - 1);
        let (start, _) = self.local_ray_f64(scene, i);
        ClippedRay {
            ray: self.sheared_ray(i),
            direction_scale: self.direction_scale[i],
            local_origin: start,
            t_offset: 0.0,
            origin_error: origin_error(scene, self.max_abs_origin[i]),
            t_min: 0.0,
            t_error: self.t_error[i],
            any_hit: self.any_hit,
            ties: self.ties,
            contested: false,
            best: ExactHit { t: self.t_hit[i], ..*hit },
        }
    }

    /// Copies the closest hit of a single ray to ray `i`.
    pub fn commit(&mut self, i: usize, ray: &ClippedRay, hit: &mut ExactHit) {
        self.set_t(i, ray.best.t, ray.t_error);
        self.contested |= u64::from(ray.contested) << (i & (PACKET_SIZE - 1));
        *hit = ray.best;
    }

    /// The window of t in which hits may tie.
    #[inline(always)]
    pub fn ties(&self) -> &TieWindow {
        &self.ties
    }

    /// Sets the t of the closest hit so far.
    #[inline(always)]
    fn set_t(&mut self, i: usize, t: f64, error: f64) {
        let i = i & (PACKET_SIZE - 1);
        (self.t_hit[i], self.t_error[i]) = (t, error);
        self.t_range[0][i] = ((t - error) as f32).next_down();
        self.t_range[1][i] = ((t + error) as f32).next_up();
    }

    /// Stores a hit of which only the triangle and bounds of t are known. If `any_hit` is true, the ray is done.
    #[inline(always)]
    pub fn set_pending(&mut self, i: usize, t: [f32; 2], triangle: (u32, u32), hit: &mut ExactHit) {
        let i = i & (PACKET_SIZE - 1);
        self.t_hit[i] = f64::from(t[1]);
        (self.t_range[0][i], self.t_range[1][i]) = (t[0], t[1]);
        self.pending |= 1 << i;
        let (instance, triangle) = triangle;
        *hit = ExactHit { instance, triangle, ..ExactHit::MISS };
    }

    /// Computes the intersection of the closest hit so far, if this has not been done.
    #[inline(always)]
    pub fn resolve(&mut self, i: usize, hit: &mut ExactHit, triangles: &dyn ExactTriangles) {
        let bit = 1 << (i & (PACKET_SIZE - 1));
        if self.pending & bit != 0 && !self.any_hit {
            self.pending &= !bit;
            let ExactHit { instance, triangle, .. } = *hit;
            if let Some(found) = self.sheared_ray(i).intersect(triangles.corners(instance, triangle)) {
                self.set_t(i, found.t, found.t_error);
                *hit = found.to_hit(instance, triangle);
            }
        }
    }

    /// Writes the t of the hit, in units of the given direction's length; t is infinite for a miss or a pending hit.
    #[inline(always)]
    pub fn to_hit(&self, i: usize, hit: &mut ExactHit) {
        let i = i & (PACKET_SIZE - 1);
        *hit = match hit.triangle {
            crate::INVALID_ID => ExactHit::MISS,
            _ if self.pending >> i & 1 != 0 => *hit,
            _ => ExactHit { t: self.t_hit[i] / self.direction_scale[i], ..*hit },
        };
    }

    /// Intersects one ray with a triangle; keeps the hit if it is closer.
    #[inline(always)]
    pub fn intersect_one(
        &mut self,
        i: usize,
        corners: [[f64; 3]; 3],
        triangle: (u32, u32),
        hits: &mut [ExactHit],
        triangles: &dyn ExactTriangles,
    ) -> bool {
        let ray = self.sheared_ray(i);
        let i = i & (PACKET_SIZE - 1);
        let Some(found) = ray.intersect(corners) else { return false };
        self.resolve(i, &mut hits[i], triangles);
        let so_far = HitSoFar::new(0.0, self.t_hit[i], self.t_error[i], &hits[i]);
        self.contested |= u64::from(self.ties.may_tie((found.t, triangle), (so_far.t, &hits[i]))) << i;
        if !ray.precedes(&found, corners, triangle, &so_far, triangles) {
            return false;
        }
        let (t, error) = if self.any_hit { (DONE, 0.0) } else { (found.t, found.t_error) };
        self.set_t(i, t, error);
        let (instance, triangle) = triangle;
        hits[i] = found.to_hit(instance, triangle);
        true
    }

    #[inline(always)]
    fn sheared_ray(&self, i: usize) -> ShearedRay {
        let i = i & (PACKET_SIZE - 1);
        ShearedRay {
            origin: [self.origin[0][i], self.origin[1][i], self.origin[2][i]],
            direction: [self.direction[0][i], self.direction[1][i], self.direction[2][i]],
            major_axis: usize::from(self.major_axis[i]),
            shear: [self.shear[0][i], self.shear[1][i]],
        }
    }
}

/// The error bound of ray origins whose largest absolute coordinate is at most `farthest`, in scaled scene coordinates.
#[inline(always)]
pub fn origin_error(scene: &Scene, farthest: f64) -> f64 {
    let world = scene.origin().map(|x| (x * scene.scale).abs());
    let offset = farthest.max(world[0]).max(world[1]).max(world[2]);
    F64_ERROR * (offset + f64::from(scene.max_abs_coord))
}
