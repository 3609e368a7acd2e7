//! Default lights of a world without lights.

use raycam_scene::{Light, Up};

/// Lights of a world without lights: a uniform sky, and a sun at the upper left, seen from the default camera, because
/// a sky alone does not show shape. The radiance of a white floor is then about 1.
pub(crate) fn default_lights(up: Up) -> [Light; 2] {
    let direction = match up {
        Up::Z => [1.0, 2.0, -3.0],
        Up::Y => [1.0, -3.0, -2.0],
    };
    [Light::uniform_sky([0.4; 3]), Light::Sun { direction, irradiance: [2.4; 3], angular_diameter: 0.0 }]
}
