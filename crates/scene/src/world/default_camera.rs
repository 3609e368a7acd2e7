//! Default camera of a world without cameras: it frames everything.

use glam::{BVec3, DVec2, DVec3};

use crate::camera::{Camera, PixelCenter, intrinsics_from_fov};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::up::Up;
use crate::world::World;

/// Direction from the middle of the world to the camera: components to the right, to the front and up. The direction is
/// at least 1.1 degrees off every plane whose normal has whole components up to 3, so that common slanted planes are
/// not viewed edge-on.
const AWAY: [f64; 3] = [1.0, 2.463, 1.085];

impl World {
    /// Returns the first camera, or a camera with a field of view of 45 degrees that frames everything from the front,
    /// right and above. `size` is the image size of this second camera.
    ///
    /// # Errors
    /// [`SceneError`] if there is neither a camera nor an object, or if the size is out of range.
    pub fn default_camera(&self, size: [u32; 2]) -> Result<Camera> {
        if let Some(first) = self.cameras.first() {
            return Ok(first.camera.clone());
        }
        let Some((low, high)) = self.bounds() else {
            return Err(SceneError::World(ErrorCode::NothingVisible.message(
                "the world has no objects, so there is nothing to frame; add an \
                    object or a camera",
            )));
        };
        let pixel_center = PixelCenter::default();
        let k = intrinsics_from_fov(45.0, size, pixel_center)?;
        let away = match self.up {
            Up::Z => DVec3::new(AWAY[0], -AWAY[1], AWAY[2]),
            Up::Y => DVec3::new(AWAY[0], AWAY[2], AWAY[1]),
        };
        let center = (low + high) / 2.0;
        let facing = Camera::look_at(away, DVec3::ZERO, self.up.axis(), k, size, pixel_center)?;
        // The camera is as close as possible, with every corner of the bounds within 90 % of the image.
        let reach = 0.9 * DVec2::new(f64::from(size[0]) / k.x_axis.x, f64::from(size[1]) / k.y_axis.y) / 2.0;
        let distance = (0..8)
            .map(|i| {
                let corner = DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
                let seen = facing.r() * (corner - center);
                (seen.truncate().abs() / reach).max_element() - seen.z
            })
            .fold(0.0, f64::max);
        let distance = if distance > 0.0 { distance } else { 1.0 };
        let eye = center - distance * facing.forward();
        Camera::new(k, facing.r(), eye, size, pixel_center)
    }
}
