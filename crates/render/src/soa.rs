//! Many of a kind at once, field by field, as registers hold them. Loops over lanes are run by
//! [`raycam_bvh::vectorized`]; each lane is computed as it would be alone.

use glam::DVec3;

/// How many: two registers of float64, one of float32.
pub(crate) const LANES: usize = 16;

/// Three coordinates of every lane.
pub(crate) type Three<T, const N: usize> = [[T; N]; 3];

/// Three points of every lane: a triangle's corners.
pub(crate) type Corners<const N: usize> = [Three<f64, N>; 3];

#[inline(always)]
pub(crate) fn set<T, const N: usize>(lanes: &mut Three<T, N>, lane: usize, [x, y, z]: [T; 3]) {
    lanes[0][lane] = x;
    lanes[1][lane] = y;
    lanes[2][lane] = z;
}

#[inline(always)]
pub(crate) fn get<T: Copy, const N: usize>(lanes: &Three<T, N>, lane: usize) -> [T; 3] {
    [lanes[0][lane], lanes[1][lane], lanes[2][lane]]
}

#[inline(always)]
pub(crate) fn vector<const N: usize>(lanes: &Three<f64, N>, lane: usize) -> DVec3 {
    DVec3::from(get(lanes, lane))
}

#[inline(always)]
pub(crate) fn set_corners<const N: usize>(
    lanes: &mut Corners<N>,
    lane: usize,
    corners: [DVec3; 3],
) {
    for (lanes, corner) in lanes.iter_mut().zip(corners) {
        set(lanes, lane, corner.to_array());
    }
}

#[inline(always)]
pub(crate) fn corners<const N: usize>([a, b, c]: &Corners<N>, lane: usize) -> [DVec3; 3] {
    [vector(a, lane), vector(b, lane), vector(c, lane)]
}
