//! Structure-of-arrays types: one field of all lanes is contiguous, as SIMD registers hold it.
//! [`raycam_bvh::dispatch_simd`] runs the loops over lanes; a lane's result does not depend on the other lanes.

use glam::{DVec3, Vec3};

/// Number of lanes of a batch: two registers of float64, one of float32 (AVX-512).
pub(crate) const LANES: usize = 16;

/// Three coordinates of every lane.
pub(crate) type Vec3xN<T, const N: usize> = [[T; N]; 3];

/// Three vertices of every lane.
pub(crate) type TriangleXN<const N: usize> = [Vec3xN<f64, N>; 3];

#[inline(always)]
pub(crate) fn set_lane<T, const N: usize>(lanes: &mut Vec3xN<T, N>, lane: usize, [x, y, z]: [T; 3]) {
    lanes[0][lane] = x;
    lanes[1][lane] = y;
    lanes[2][lane] = z;
}

#[inline(always)]
pub(crate) fn get_lane<T: Copy, const N: usize>(lanes: &Vec3xN<T, N>, lane: usize) -> [T; 3] {
    [lanes[0][lane], lanes[1][lane], lanes[2][lane]]
}

#[inline(always)]
pub(crate) fn lane_dvec3<const N: usize>(lanes: &Vec3xN<f64, N>, lane: usize) -> DVec3 {
    DVec3::from(get_lane(lanes, lane))
}

#[inline(always)]
pub(crate) fn set_triangle<const N: usize>(lanes: &mut TriangleXN<N>, lane: usize, corners: [DVec3; 3]) {
    for (lanes, corner) in lanes.iter_mut().zip(corners) {
        set_lane(lanes, lane, corner.to_array());
    }
}

#[inline(always)]
pub(crate) fn get_triangle<const N: usize>([a, b, c]: &TriangleXN<N>, lane: usize) -> [DVec3; 3] {
    [lane_dvec3(a, lane), lane_dvec3(b, lane), lane_dvec3(c, lane)]
}

/// The float32 vector of a lane.
#[inline(always)]
pub(crate) fn lane_vec3<const N: usize>(lanes: &Vec3xN<f32, N>, lane: usize) -> Vec3 {
    Vec3::from(get_lane(lanes, lane))
}
