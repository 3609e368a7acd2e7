//! Cube maps as latitude-longitude images.
//!
//! Source: the layout of OpenEXR's environment maps, `ImfEnvmap.h`: six square faces on top of each other, +X -X +Y -Y
//! +Z -Z. The centres of a face's outermost texels lie on the cube's edges. The top row of the latitude-longitude image
//! is +Y, its middle +Z.

use std::f32::consts::PI;

/// Latitude-longitude image of a cube map whose faces have `side` x `side` texels: 4 side x 2 side texels, filtered
/// bilinearly within each face.
pub(super) fn latitude_longitude(faces: &[[f32; 4]], side: usize) -> ([usize; 2], Vec<[f32; 4]>) {
    let size = [4 * side, 2 * side];
    let direction = |x: usize, y: usize| {
        let longitude = PI * (1.0 - 2.0 * (x as f32 + 0.5) / size[0] as f32);
        let latitude = PI * (0.5 - (y as f32 + 0.5) / size[1] as f32);
        [longitude.sin() * latitude.cos(), latitude.sin(), longitude.cos() * latitude.cos()]
    };
    let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    (size, texels.map(|(x, y)| texel(faces, side, direction(x, y))).collect())
}

/// Value of the cube map in a direction.
fn texel(faces: &[[f32; 4]], side: usize, [x, y, z]: [f32; 3]) -> [f32; 4] {
    let [ax, ay, az] = [x.abs(), y.abs(), z.abs()];
    // Column and row, each in -1..=1, from left to right and from top to bottom.
    let (face, column, row) = if ax >= ay && ax >= az {
        (if x > 0.0 { 0 } else { 1 }, if x > 0.0 { z / ax } else { -z / ax }, -y / ax)
    } else if ay >= az {
        (if y > 0.0 { 2 } else { 3 }, x / ay, if y > 0.0 { -z / ay } else { z / ay })
    } else {
        (if z > 0.0 { 4 } else { 5 }, if z > 0.0 { -x / az } else { x / az }, -y / az)
    };
    let last = side - 1;
    let place = |at: f32| {
        let at = (at + 1.0) / 2.0 * last as f32;
        let first = (at as usize).min(last);
        (first, (first + 1).min(last), at - first as f32)
    };
    let ((left, right, u), (top, bottom, v)) = (place(column), place(row));
    let at = |column: usize, row: usize| faces[(face * side + row) * side + column];
    let mix = |a: [f32; 4], b: [f32; 4], t: f32| [0, 1, 2, 3].map(|i| a[i] + t * (b[i] - a[i]));
    mix(mix(at(left, top), at(right, top), u), mix(at(left, bottom), at(right, bottom), u), v)
}
