//! The lights of a world that has none.

use raycam_scene::{Light, Up};

/// What a world without lights gets where light is needed to see anything: a sky, and a sun that stands high to the
/// left of the default camera, because a sky alone shows no shape. A white floor then has a radiance of about 1.
pub(crate) fn default_lights(up: Up) -> [Light; 2] {
    let direction = match up {
        Up::Z => [1.0, 2.0, -3.0],
        Up::Y => [1.0, -3.0, -2.0],
    };
    [
        Light::uniform_sky([0.4; 3]),
        Light::Sun {
            direction,
            irradiance: [2.4; 3],
            angular_diameter: 0.0,
        },
    ]
}
