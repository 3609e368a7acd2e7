//! The finite projective camera, P = K R [I | -C] (Hartley and Zisserman, Multiple View Geometry, chapter 6).

mod decompose;
mod intrinsics;
mod lens;

pub use intrinsics::{intrinsics_from_focal, intrinsics_from_fov};
pub use lens::{
    Division, DoubleSphere, Eucm, Fisheye, Fov, Lens, LensModel, Omni, OpenCv, PrismFisheye,
    colmap_from_lens, lens_from_colmap,
};

use glam::{DMat3, DMat4, DQuat, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::intrinsics::checked_intrinsics;
use crate::error::SceneError;
use crate::pose;
use crate::world::Up;

/// Where the centre of the first pixel lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PixelCenter {
    /// At (0, 0), as in OpenCV.
    #[default]
    Integer,
    /// At (0.5, 0.5), as in COLMAP and OpenGL.
    Half,
}

impl PixelCenter {
    /// What is added to a column or row to get the coordinate of its centre: 0 or 0.5.
    pub fn offset(self) -> f64 {
        match self {
            PixelCenter::Integer => 0.0,
            PixelCenter::Half => 0.5,
        }
    }
}

/// A camera: `x = K R (X - C)`, with what its lens does between R and K. Axes x right, y down, z forward. All float64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    k: DMat3,
    r: DMat3,
    c: DVec3,
    /// `K R [I | -C]`, or what [`Camera::from_matrix`] was given: an ill-conditioned matrix survives to the last digits.
    p: [[f64; 4]; 3],
    size: [u32; 2],
    pixel_center: PixelCenter,
    lens: Lens,
}

/// The largest width and height.
pub const MAX_SIDE: u32 = 65_536;
/// The most pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 28;

impl Camera {
    /// A camera from intrinsics `k` (upper triangular, focal lengths > 0, `K[2][2]` any but 0), rotation `r`
    /// (camera_from_world) and centre `c` in the world. `size` is columns and rows.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where a value is not finite, `k` is not such a matrix, `r` is further than 1e-6 from a
    /// rotation (nearer ones become the nearest rotation), or the size is 0 or beyond [`MAX_SIDE`] and [`MAX_PIXELS`].
    pub fn new(
        k: DMat3,
        r: DMat3,
        c: DVec3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        check_size(size)?;
        let k = checked_intrinsics(k)?;
        let r = checked_rotation(r)?;
        if !c.is_finite() {
            return Err(SceneError::Camera(format!(
                "the camera centre {c} is not finite"
            )));
        }
        let m = k * r;
        let p4 = -(m * c);
        let p = [0, 1, 2].map(|i| [m.row(i).x, m.row(i).y, m.row(i).z, p4[i]]);
        if !p.as_flattened().iter().all(|v| v.is_finite()) {
            return Err(SceneError::Camera(
                "K R [I | -C] overflows: K or the camera centre is too large".into(),
            ));
        }
        Ok(Self {
            k,
            r,
            c,
            p,
            size,
            pixel_center,
            lens: Lens::Pinhole,
        })
    }

    /// A camera from any finite 3x4 camera matrix, of any scale and sign, by RQ decomposition (Hartley and Zisserman,
    /// section 6.2.4). The third row of its left 3x3 part, times the sign of that part's determinant, points forward.
    ///
    /// # Errors
    /// [`SceneError::Camera`] where a value is not finite, the rank is below 3, or the centre is at infinity (affine).
    pub fn from_matrix(
        p: [[f64; 4]; 3],
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        check_size(size)?;
        let decompose::Decomposed { k, r, c, p } = decompose::decompose(p)?;
        Ok(Self {
            k: checked_intrinsics(k)?,
            r: checked_rotation(r)?,
            c,
            p,
            size,
            pixel_center,
            lens: Lens::Pinhole,
        })
    }

    /// A camera at `location` turned by `roll`, `pitch`, `yaw` in degrees (see [`pose`]).
    ///
    /// # Errors
    /// Those of [`Camera::new`], and angles that are not finite.
    #[allow(
        clippy::too_many_arguments,
        reason = "the six numbers of a pose have names of their own"
    )]
    pub fn from_pose(
        location: DVec3,
        roll: f64,
        pitch: f64,
        yaw: f64,
        up: Up,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        if ![roll, pitch, yaw].iter().all(|v| v.is_finite()) {
            return Err(SceneError::Camera(format!(
                "roll {roll}, pitch {pitch}, yaw {yaw}: angles must be finite"
            )));
        }
        let world_from_body =
            pose::world_from_reference(up) * pose::rotation_from_rpy(roll, pitch, yaw);
        Self::new(
            k,
            pose::CAMERA_FROM_BODY * world_from_body.transpose(),
            location,
            size,
            pixel_center,
        )
    }

    /// A camera at `eye` that sees `target` at its principal point, with `up_vector` upwards in the picture.
    ///
    /// # Errors
    /// Those of [`Camera::new`]; `eye` equal to `target`; `up_vector` zero or parallel to the viewing direction.
    pub fn look_at(
        eye: DVec3,
        target: DVec3,
        up_vector: DVec3,
        k: DMat3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        let direction = target - eye;
        let world_from_body = pose::rotation_towards(direction, up_vector).ok_or_else(|| {
            SceneError::Camera(if direction.try_normalize().is_none() {
                format!("eye {eye} and target {target} must be two different finite points")
            } else {
                format!(
                    "up {up_vector} is zero or parallel to the viewing direction {direction}, so which side of the \
                     picture is up is undetermined: give another up vector, or roll, pitch and yaw"
                )
            })
        })?;
        Self::new(
            k,
            pose::CAMERA_FROM_BODY * world_from_body.transpose(),
            eye,
            size,
            pixel_center,
        )
    }

    /// A camera from OpenCV's extrinsics: a rotation vector (axis times angle in radians) and `t = -R C`.
    ///
    /// # Errors
    /// Those of [`Camera::new`], and values that are not finite.
    pub fn from_opencv(
        k: DMat3,
        rvec: DVec3,
        t: DVec3,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        if !(rvec.is_finite() && t.is_finite()) {
            return Err(SceneError::Camera(format!(
                "rotation vector {rvec} and translation {t} must be finite"
            )));
        }
        let r = DMat3::from_quat(DQuat::from_scaled_axis(rvec));
        Self::new(k, r, -(r.transpose() * t), size, pixel_center)
    }

    /// A camera from OpenGL's, Blender's and NeRF's pose matrix, whose camera axes are x right, y up, z backward.
    ///
    /// # Errors
    /// Those of [`Camera::new`], and a matrix whose last row is not 0 0 0 1.
    pub fn from_opengl(
        k: DMat3,
        world_from_camera: DMat4,
        size: [u32; 2],
        pixel_center: PixelCenter,
    ) -> Result<Self, SceneError> {
        let last = world_from_camera.row(3);
        if last.to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(SceneError::Camera(format!(
                "the last row of world_from_camera is {last}, expected 0 0 0 1: is the matrix transposed?"
            )));
        }
        let world_from_gl = DMat3::from_mat4(world_from_camera);
        let world_from_cv = DMat3::from_cols(
            world_from_gl.x_axis,
            -world_from_gl.y_axis,
            -world_from_gl.z_axis,
        );
        Self::new(
            k,
            world_from_cv.transpose(),
            world_from_camera.w_axis.truncate(),
            size,
            pixel_center,
        )
    }

    /// The same camera with another lens; every constructor gives a pinhole.
    pub fn with_lens(self, lens: Lens) -> Self {
        Self { lens, ..self }
    }

    /// What its lens does.
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Intrinsics: upper triangular, `K[2][2] = 1`, in pixels.
    pub fn k(&self) -> DMat3 {
        self.k
    }

    /// camera_from_world.
    pub fn r(&self) -> DMat3 {
        self.r
    }

    /// The centre in the world.
    pub fn c(&self) -> DVec3 {
        self.c
    }

    /// `-R C`.
    pub fn t(&self) -> DVec3 {
        -(self.r * self.c)
    }

    /// The 3x4 camera matrix `K R [I | -C]`, scaled so that its left 3x3 part has a third row of length 1 that points
    /// forward.
    pub fn p(&self) -> [[f64; 4]; 3] {
        self.p
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Where the centre of the first pixel lies.
    pub fn pixel_center(&self) -> PixelCenter {
        self.pixel_center
    }

    /// The principal axis in the world, unit length: the third row of R.
    pub fn forward(&self) -> DVec3 {
        self.r.row(2)
    }

    /// Roll, pitch and yaw in degrees (see [`pose::rpy_from_rotation`] for straight up and down).
    pub fn roll_pitch_yaw(&self, up: Up) -> [f64; 3] {
        let world_from_body = self.r.transpose() * pose::CAMERA_FROM_BODY;
        pose::rpy_from_rotation(pose::world_from_reference(up).transpose() * world_from_body)
    }

    /// The pixel coordinates of a world point, and whether the camera sees it there.
    ///
    /// A pinhole sees what lies in front (depth > 0); behind it, the pixel is where the line through point and centre
    /// meets the image, and at depth 0 it is not finite. Another [`Lens`] sees what it has an image of, which ends where
    /// its model folds over; the pixel of anything else is NaN.
    pub fn project(&self, point: DVec3) -> (DVec2, bool) {
        let x = self.r * (point - self.c);
        if let Lens::Pinhole = self.lens {
            let x = self.k * x;
            return (DVec2::new(x.x / x.z, x.y / x.z), x.z > 0.0);
        }
        match self.lens.distort(x) {
            Some(image) => ((self.k * image.extend(1.0)).truncate(), true),
            None => (DVec2::NAN, false),
        }
    }

    /// The ray of a pixel coordinate: the centre and the direction of unit length, both in the world. The inverse of
    /// [`Camera::project`]. The direction is NaN, which meets nothing, where no point has this pixel: outside of the
    /// picture's valid region with a lens that folds over; a pinhole has none such.
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let y = (pixel.y - self.k.z_axis.y) / self.k.y_axis.y;
        let x = (pixel.x - self.k.z_axis.x - self.k.y_axis.x * y) / self.k.x_axis.x;
        let direction = match &self.lens {
            Lens::Pinhole => DVec3::new(x, y, 1.0),
            lens => lens.undistort(DVec2::new(x, y)).unwrap_or(DVec3::NAN),
        };
        (self.c, (self.r.transpose() * direction).normalize())
    }

    /// The pixel coordinates of the centre of a pixel.
    pub fn pixel_center_of(&self, column: u32, row: u32) -> DVec2 {
        DVec2::new(f64::from(column), f64::from(row)) + self.pixel_center.offset()
    }
}

fn check_size(size: [u32; 2]) -> Result<(), SceneError> {
    let [width, height] = size;
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
        return Err(SceneError::Camera(format!(
            "an image of {width} x {height} pixels: expected 1 to {MAX_SIDE} columns and rows"
        )));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(SceneError::Camera(format!(
            "an image of {width} x {height} pixels is more than {MAX_PIXELS}: render it in regions or smaller"
        )));
    }
    Ok(())
}

/// The rotation nearest to `r`, which must be within 1e-6 of one.
fn checked_rotation(r: DMat3) -> Result<DMat3, SceneError> {
    let fail = |message: String| Err(SceneError::Camera(format!("R = {}: {message}", rows(r))));
    if !r.is_finite() {
        return fail("every value must be finite".into());
    }
    let off = deviation(r);
    if off > 1e-6 {
        return fail(format!(
            "not a rotation: R Rᵀ differs from the identity by {off:.3e} (at most 1e-6 is accepted), its determinant \
             is {:.9}",
            r.determinant()
        ));
    }
    if r.determinant() < 0.0 {
        return fail(
            "a reflection (determinant -1), not a rotation: it swaps left and right hand; check the signs of its axes"
                .into(),
        );
    }
    if off <= 1e-14 {
        return Ok(r);
    }
    // Newton-Schulz iteration towards the orthogonal polar factor: the error squares each time.
    let step = |r: DMat3| r * (DMat3::IDENTITY * 3.0 - r.transpose() * r) * 0.5;
    Ok(step(step(step(r))))
}

/// The largest entry of `|R Rᵀ - I|`.
fn deviation(r: DMat3) -> f64 {
    let e = r * r.transpose() - DMat3::IDENTITY;
    e.to_cols_array()
        .into_iter()
        .fold(0.0, |a: f64, v| a.max(v.abs()))
}

/// A matrix as people write it.
fn rows(m: DMat3) -> String {
    let row = |i| {
        let v = m.row(i);
        format!("[{}, {}, {}]", v.x, v.y, v.z)
    };
    format!("[{}, {}, {}]", row(0), row(1), row(2))
}
