//! Projection of points to pixels, and of pixels to rays.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use crate::camera::lens::Lens;
use crate::camera::shutter::{Pose, ShutterMotion};
use crate::camera::{Camera, Center};

/// Number of steps in the search for the line (row or column) that shows a point, if the secant method does not find
/// the line.
const LINE_STEPS: u32 = 64;

/// Ray of a pixel through a point of the lens at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Origin of the ray in the world.
    pub origin: DVec3,
    /// Direction with unit length; NaN, which hits nothing, if no point projects to the pixel.
    pub direction: DVec3,
}

/// Static pinhole camera, all of whose samples are rays from its centre: see [`Camera::pinhole`].
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    k: DMat3,
    world_from_camera: DMat3,
    /// Centre in the world.
    pub center: DVec3,
}

impl Pinhole {
    /// Unit direction of a pixel's ray in the world, with the same bits as from [`Camera::generate_ray`].
    #[inline(always)]
    pub fn direction(&self, pixel: DVec2) -> DVec3 {
        (self.world_from_camera * image_plane_point(self.k, pixel).extend(1.0)).normalize()
    }
}

/// Point of the image plane at focal length 1 for a pixel.
#[inline(always)]
fn image_plane_point(k: DMat3, pixel: DVec2) -> DVec2 {
    let y = (pixel.y - k.z_axis.y) / k.y_axis.y;
    let x = (pixel.x - k.z_axis.x - k.y_axis.x * y) / k.x_axis.x;
    DVec2::new(x, y)
}

impl Camera {
    /// True if the rays through the middle of the aperture equal the rays of a static pinhole.
    fn is_static_pinhole(&self) -> bool {
        self.center == Center::Point && self.lens == Lens::Pinhole && self.motion.is_none()
    }

    /// Returns the camera as a [`Pinhole`]; `None` if the camera has a lens, an aperture or motion.
    pub fn pinhole(&self) -> Option<Pinhole> {
        (self.is_static_pinhole() && self.aperture.is_none()).then(|| Pinhole {
            k: self.k,
            world_from_camera: self.r.transpose(),
            center: self.c,
        })
    }

    /// Returns the origin of all rays through the middle of the aperture; `None` if it depends on the pixel.
    pub fn static_center(&self) -> Option<DVec3> {
        (self.center == Center::Point && self.motion.is_none()).then_some(self.c)
    }

    /// Returns the pixel coordinates of a world point, and true if the camera images the point there.
    ///
    /// A pinhole images points in front of it (depth > 0). For a point behind it, the pixel is where the line through
    /// the point and the centre meets the image; at depth 0 the pixel is not finite. A camera whose parallel rays start
    /// on a plane images the points in front of the plane; if the rays come from infinity, it images all points. Any
    /// other [`Lens`] images the points in its valid region, up to the angle beyond which its model is not one-to-one;
    /// these points may be behind the camera. All other points have the pixel NaN.
    ///
    /// For a camera with a rolling shutter, a point's pixel is on the line that shows the point in the middle of the
    /// line's exposure. If there are several such lines, the first is used; if there is none, the point has no pixel.
    pub fn project(&self, point: DVec3) -> (DVec2, bool) {
        self.project_moving(|_| point)
    }

    /// Same as [`Camera::project`], for a point that moves while the lines are read. `point` returns its position in
    /// the middle of the exposure of the line at a fraction of the image, from 0 to 1; 0.5 if all lines are open at
    /// once.
    pub fn project_moving(&self, point: impl Fn(f64) -> DVec3) -> (DVec2, bool) {
        match &self.motion {
            Some(motion) if motion.readout() > 0.0 => self.project_rolling(motion, point),
            _ => self.project_from(&self.pose(), point(0.5)),
        }
    }

    #[inline]
    fn pose(&self) -> Pose {
        Pose { r: self.r, c: self.c }
    }

    /// Pose at a fraction of the exposure of a pixel's line.
    #[inline]
    fn pose_at(&self, pixel: DVec2, part: f64) -> Pose {
        match &self.motion {
            None => self.pose(),
            Some(motion) => motion.pose_at(motion.line_time(self.offset_from_corner(pixel), self.size, part)),
        }
    }

    fn project_from(&self, pose: &Pose, point: DVec3) -> (DVec2, bool) {
        let x = pose.r * (point - pose.c);
        if self.center != Center::Point {
            let at = self.k * x.truncate().extend(1.0);
            let pixel = DVec2::new(at.x / at.z, at.y / at.z);
            let seen = match self.center {
                Center::Plane => x.z > 0.0,
                _ => pixel.is_finite(),
            };
            return (pixel, seen);
        }
        if let Lens::Pinhole = self.lens {
            let x = self.k * x;
            return (DVec2::new(x.x / x.z, x.y / x.z), x.z > 0.0);
        }
        match self.lens.distort(x) {
            Some(image) => ((self.k * image.extend(1.0)).truncate(), true),
            None => (DVec2::NAN, false),
        }
    }

    /// Finds the line, from 0 to 1, that shows the point at the line's own time.
    fn project_rolling(&self, motion: &ShutterMotion, point: impl Fn(f64) -> DVec3) -> (DVec2, bool) {
        let seen_at = |line: f64| {
            let time = line * motion.readout() + 0.5 * motion.exposure();
            let (pixel, seen) = self.project_from(&motion.pose_at(time), point(line));
            let off = motion.line_fraction(self.offset_from_corner(pixel), self.size) - line;
            (seen && off.is_finite()).then_some((pixel, off))
        };
        // The secant method takes only a few steps, because a point's projection changes little from line to line.
        let (mut before, mut at) = (0.5, 0.5);
        let mut off_before = None;
        for _ in 0..20 {
            let Some((pixel, off)) = seen_at(at) else { break };
            if off.abs() <= 4.0 * f64::EPSILON {
                return (pixel, true);
            }
            let slope = off_before.map_or(-1.0, |last: f64| (off - last) / (at - before));
            let next = (at - off / slope).clamp(0.0, 1.0);
            if next == at {
                return (pixel, off.abs() <= 1e-12);
            }
            (before, off_before, at) = (at, Some(off), next);
        }
        // For fast motion, search for the two lines that enclose the point.
        let line = |step: u32| f64::from(step) / f64::from(LINE_STEPS);
        for step in 0..LINE_STEPS {
            let (mut low, mut high) = (line(step), line(step + 1));
            let (Some((pixel, first)), Some((_, last))) = (seen_at(low), seen_at(high)) else { continue };
            if first == 0.0 {
                return (pixel, true);
            }
            if first < 0.0 || last > 0.0 {
                continue;
            }
            let mut found = pixel;
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let Some((pixel, off)) = seen_at(middle) else { return (DVec2::NAN, false) };
                found = pixel;
                if off > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            return (found, true);
        }
        (DVec2::NAN, false)
    }

    /// Returns the ray of a pixel coordinate: its origin and its unit direction, both in world coordinates. The inverse
    /// of [`Camera::project`], through the middle of the aperture in the middle of the exposure.
    ///
    /// The ray starts at the camera's centre or, for parallel rays, on the plane through the centre. If no point
    /// projects to the pixel, the direction is NaN and the ray hits nothing: this happens outside the region in which
    /// the lens model is one-to-one, never with a pinhole camera.
    #[inline]
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        self.ray_from(&self.pose_at(pixel, 0.5), pixel)
    }

    /// Returns the rays of many pixel coordinates, each equal to [`Camera::ray`]. For a static pinhole, this function
    /// takes half the time, and even less if neighbouring pixels are in one row.
    #[inline]
    pub fn rays(&self, pixels: impl Iterator<Item = DVec2>, mut take: impl FnMut((DVec3, DVec3))) {
        if !self.is_static_pinhole() {
            return pixels.for_each(|pixel| take(self.ray(pixel)));
        }
        let world_from_camera = self.r.transpose();
        let origin = self.c + world_from_camera * DVec3::ZERO;
        // The order of operations is the same as in [`Camera::ray_from`], so that the results have the same bits.
        let (mut row, mut y, mut down) = (f64::NAN, 0.0, DVec3::ZERO);
        for pixel in pixels {
            if pixel.y != row {
                row = pixel.y;
                y = (pixel.y - self.k.z_axis.y) / self.k.y_axis.y;
                down = world_from_camera.y_axis * y;
            }
            let x = (pixel.x - self.k.z_axis.x - self.k.y_axis.x * y) / self.k.x_axis.x;
            let direction = world_from_camera.x_axis * x + down + world_from_camera.z_axis;
            take((origin, direction.normalize()));
        }
    }

    #[inline]
    fn ray_from(&self, pose: &Pose, pixel: DVec2) -> (DVec3, DVec3) {
        let (start, direction) = self.camera_space_ray(pixel);
        (pose.c + pose.r.transpose() * start, (pose.r.transpose() * direction).normalize())
    }

    /// Returns the ray of a pixel coordinate in camera axes: its origin and its direction, which may have any length.
    #[inline]
    fn camera_space_ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        if self.center != Center::Point {
            let at = plane_from_pixel(self.k, pixel);
            let forward = if at.is_nan() { DVec3::NAN } else { DVec3::Z };
            return (at.extend(self.ray_start_depth), forward);
        }
        let image = self.image(pixel);
        let direction = match &self.lens {
            Lens::Pinhole => image.extend(1.0),
            lens if lens.has_iterative_inverse() => {
                let near = self.undistort_table.initial_guess(pixel, self.k, self.size, lens);
                lens.undistort_plane(image, near).and_then(|at| lens.plane_direction(at)).unwrap_or(DVec3::NAN)
            }
            lens => lens.undistort(image).unwrap_or(DVec3::NAN),
        };
        (DVec3::ZERO, direction)
    }

    #[inline]
    fn image(&self, pixel: DVec2) -> DVec2 {
        image_plane_point(self.k, pixel)
    }

    /// Returns the ray of a pixel coordinate through a point of the aperture, at a time within the exposure of the
    /// pixel's line. `lens` selects the point by two random numbers in 0..1; `part` is the time as a fraction of the
    /// exposure.
    pub fn generate_ray(&self, pixel: DVec2, lens: [f64; 2], part: f64) -> CameraRay {
        let pixel = self.wrap_panorama(pixel);
        let pose = self.pose_at(pixel, part);
        let Some(aperture) = &self.aperture else {
            let (origin, direction) = self.ray_from(&pose, pixel);
            return CameraRay { origin, direction };
        };
        let chief = self.camera_space_ray(pixel).1.normalize();
        let (start, direction) = aperture.bend_ray(chief, &self.lens, lens);
        let world_from_camera = pose.r.transpose();
        CameraRay { origin: pose.c + world_from_camera * start, direction: (world_from_camera * direction).normalize() }
    }

    /// Time of a pixel's line at a fraction of its exposure, in seconds from the middle of the shutter's time; 0 for a
    /// camera without a shutter.
    pub fn shutter_offset(&self, pixel: DVec2, part: f64) -> f64 {
        self.motion.as_ref().map_or(0.0, |motion| {
            let pixel = self.offset_from_corner(self.wrap_panorama(pixel));
            motion.line_time(pixel, self.size, part) - 0.5 * motion.total_duration()
        })
    }

    /// Position of a pixel's line in the order of readout, from 0 to 1; 0.5 for a camera without a shutter.
    pub fn line_fraction(&self, pixel: DVec2) -> f64 {
        self.motion.as_ref().map_or(0.5, |motion| motion.line_fraction(self.offset_from_corner(pixel), self.size))
    }

    /// Maps a pixel coordinate beyond the edge of a panorama's image to the coordinate inside the image that shows the
    /// same direction, because a panorama has no edge there.
    fn wrap_panorama(&self, pixel: DVec2) -> DVec2 {
        let sphere = matches!(self.lens, Lens::Equirectangular);
        if !sphere && !matches!(self.lens, Lens::Cylindrical) {
            return pixel;
        }
        let mut at = self.image(pixel);
        if at.x.abs() <= PI && (!sphere || at.y.abs() <= FRAC_PI_2) {
            return pixel;
        }
        if sphere && at.y.abs() > FRAC_PI_2 {
            // The sample is beyond a pole, so it continues down the opposite longitude.
            at = DVec2::new(at.x + PI, PI.copysign(at.y) - at.y);
        }
        at.x -= TAU * (at.x / TAU).round();
        (self.k * at.extend(1.0)).truncate()
    }

    /// Fraction of a pixel's light that remains after vignetting; 1 without vignetting.
    pub fn vignetting_factor(&self, pixel: DVec2) -> f64 {
        let Some(vignetting) = &self.vignetting else { return 1.0 };
        let pixel = self.wrap_panorama(pixel);
        let direction = self.camera_space_ray(pixel).1.normalize();
        if direction.is_nan() {
            return 1.0;
        }
        vignetting.factor(self.image(pixel), direction)
    }

    /// camera_from_world in the middle of the exposure of a pixel's line.
    pub fn rotation_at(&self, pixel: DVec2) -> DMat3 {
        self.pose_at(pixel, 0.5).r
    }

    /// z of a world point along the principal axis in the middle of the exposure of a pixel's line.
    pub fn depth_at(&self, pixel: DVec2, point: DVec3) -> f64 {
        let pose = self.pose_at(pixel, 0.5);
        pose.r.row(2).dot(point - pose.c)
    }

    /// Pixel coordinates relative to the image's corner.
    pub fn offset_from_corner(&self, pixel: DVec2) -> DVec2 {
        pixel + 0.5 - self.pixel_center.offset()
    }
}

/// Point of the image plane of parallel rays, in world units, for a pixel.
fn plane_from_pixel(k: DMat3, pixel: DVec2) -> DVec2 {
    let at = k.inverse() * pixel.extend(1.0);
    at.truncate() / at.z
}
