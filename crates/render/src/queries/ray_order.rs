//! Orders in which consecutive rays have similar directions.
//!
//! Exact hits are found for packets of 64 consecutive rays, which is fast if a packet is narrow. The rays of a lidar's
//! column or of an image's row form long packets; along a Morton curve of their directions, they form squares.

use raycam_bvh::ExactRay;

/// Rays per packet.
const PACKET_RAYS: usize = 64;
/// Minimum number of rays for which an order is computed.
const MIN_RAYS: usize = 4 * PACKET_RAYS;
/// Maximum distance between origins that are treated as equal, as a fraction of the scene's radius.
const MAX_ORIGIN_DISTANCE: f64 = 1.0 / 32.0;
/// Rays are sorted if the packets' mean width exceeds the width of square packets by more than this factor.
const MIN_WIDTH_RATIO: f32 = 2.0;
/// Bits per coordinate of a direction in the Morton code.
const BITS: u32 = 10;

/// Indices of the rays in an order in which packets are narrow; `None` if the given order is as good, or if the rays do
/// not start close together in a scene of this radius.
pub(super) fn narrow_order(rays: &[ExactRay], radius: f64) -> Option<Vec<usize>> {
    if rays.len() < MIN_RAYS || !have_common_origin(rays, MAX_ORIGIN_DISTANCE * radius) {
        return None;
    }
    let points: Vec<[f32; 2]> = rays.iter().map(|ray| octahedral(ray.direction)).collect();
    let bounds @ [lower, upper] = around(&points);
    let [width, height] = [upper[0] - lower[0], upper[1] - lower[1]];
    let packets = points.chunks(PACKET_RAYS);
    let count = packets.len() as f32;
    let widths: f32 = packets.map(around).map(|[l, u]| (u[0] - l[0]) + (u[1] - l[1])).sum();
    // Mean width of packets whose directions form squares or, if all directions are on a line, pieces of the
    // line.
    let square = (2.0 * (width * height / count).sqrt()).max((width + height) / count);
    let ratio = widths / count / square;
    if ratio.is_nan() || ratio <= MIN_WIDTH_RATIO {
        return None;
    }
    let mut keys: Vec<(u32, u32)> = (0..).zip(&points).map(|(at, &point)| (morton(point, bounds), at)).collect();
    keys.sort_unstable();
    Some(keys.into_iter().map(|(_, at)| at as usize).collect())
}

fn have_common_origin(rays: &[ExactRay], distance: f64) -> bool {
    let first = rays[0].origin;
    let is_near = |ray: &ExactRay| (0..3).all(|axis| (ray.origin[axis] - first[axis]).abs() <= distance);
    rays.iter().all(is_near)
}

/// Direction as a point of the square from -1 to 1: the direction's projection to an octahedron, unfolded.
fn octahedral([x, y, z]: [f64; 3]) -> [f32; 2] {
    let sum = x.abs() + y.abs() + z.abs();
    let (u, v) = (x / sum, y / sum);
    let (u, v) = if z < 0.0 { ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)) } else { (u, v) };
    [u as f32, v as f32]
}

/// Smallest box around points; NaN coordinates are ignored.
fn around(points: &[[f32; 2]]) -> [[f32; 2]; 2] {
    let nothing = [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]];
    points.iter().fold(nothing, |[l, u], p| [[l[0].min(p[0]), l[1].min(p[1])], [u[0].max(p[0]), u[1].max(p[1])]])
}

/// Morton code of a point within a box.
fn morton(point: [f32; 2], [lower, upper]: [[f32; 2]; 2]) -> u32 {
    let steps = ((1 << BITS) - 1) as f32;
    let cell = |axis: usize| spread(((point[axis] - lower[axis]) / (upper[axis] - lower[axis]) * steps) as u32);
    cell(0) | cell(1) << 1
}

/// Moves bit i to bit 2 i, for the lowest 16 bits.
fn spread(bits: u32) -> u32 {
    let mut bits = bits & 0xffff;
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays(columns: usize, rows: usize, step: f64) -> Vec<ExactRay> {
        let ray = |i: usize| {
            let (column, row) = ((i / rows) as f64, (i % rows) as f64);
            let direction = [1.0, step * column, step * (row - rows as f64 / 2.0)];
            ExactRay { origin: [0.0; 3], direction, t_min: 0.0, t_max: f64::INFINITY }
        };
        (0..columns * rows).map(ray).collect()
    }

    #[test]
    fn rays_in_columns_are_ordered_in_squares() {
        let rays = rays(32, 128, 1e-3);
        let order = narrow_order(&rays, 1.0).unwrap();
        let mut numbers = order.clone();
        numbers.sort_unstable();
        assert!(numbers.into_iter().eq(0..rays.len()));
        let sorted: Vec<_> = order.iter().map(|&at| rays[at]).collect();
        assert!(narrow_order(&sorted, 1.0).is_none());
        let wide = |rays: &[ExactRay]| -> f64 {
            let spread = |packet: &[ExactRay], axis: usize| {
                let values = packet.iter().map(|ray| ray.direction[axis]);
                values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
            };
            rays.chunks(PACKET_RAYS).map(|packet| spread(packet, 1) + spread(packet, 2)).sum()
        };
        assert!(wide(&sorted) < 0.5 * wide(&rays));
    }

    #[test]
    fn few_rays_and_rays_from_everywhere_keep_their_order() {
        assert!(narrow_order(&rays(1, 128, 1e-3), 1.0).is_none());
        let mut apart = rays(32, 128, 1e-3);
        apart[77].origin = [0.5, 0.0, 0.0];
        assert!(narrow_order(&apart, 1.0).is_none());
        apart[77].origin = [f64::NAN; 3];
        assert!(narrow_order(&apart, 1.0).is_none());
        let same = vec![rays(1, 1, 0.0)[0]; 4096];
        assert!(narrow_order(&same, 1.0).is_none());
    }

    #[test]
    fn spread_puts_a_zero_after_each_bit() {
        assert_eq!(spread(0b1011), 0b100_0101);
        assert_eq!(spread(0xffff), 0x5555_5555);
    }
}
