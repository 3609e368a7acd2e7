//! Lens, aperture, vignetting and shutter of a camera, and copies with another pose.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::camera::intrinsics::validated_intrinsics;
use crate::camera::lens::Lens;
use crate::camera::undistort_table::UndistortTable;
use crate::camera::validate::{camera_matrix, check_size, validated_rotation};
use crate::camera::{Aperture, Background, Camera, Center, Pose, ShutterMotion, Vignetting};
use crate::error::{Result, SceneError};

impl Camera {
    /// Names of the properties that the camera has in addition to K, lens and pose.
    pub fn further_properties(&self) -> impl Iterator<Item = &'static str> {
        let has = [
            ("aperture", self.aperture().is_some()),
            ("vignetting", self.vignetting().is_some()),
            ("shutter", self.motion().is_some()),
            ("background", self.background().is_some()),
        ];
        has.into_iter().filter(|(_, has)| *has).map(|(what, _)| what)
    }

    /// Returns a copy with another lens; every constructor creates a pinhole.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the camera's rays are parallel, because a lens bends rays that start at one point.
    pub fn with_lens(self, lens: Lens) -> Result<Self> {
        if self.center != Center::Point && lens != Lens::Pinhole {
            return Err(parallel_rays_error("a lens"));
        }
        Ok(Self { lens, undistort_table: UndistortTable::default(), ..self })
    }

    /// Returns a copy with an aperture, or as a pinhole.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if the camera's rays are parallel.
    pub fn with_aperture(self, aperture: Option<Aperture>) -> Result<Self> {
        if self.center != Center::Point && aperture.is_some() {
            return Err(parallel_rays_error("an aperture"));
        }
        Ok(Self { aperture, ..self })
    }

    /// Returns a copy with this background image, or without one.
    pub fn with_background(self, background: Option<Background>) -> Self {
        Self { background: background.map(Arc::new), ..self }
    }

    /// Returns a copy with or without vignetting.
    ///
    /// # Errors
    /// [`SceneError::Camera`] for coefficients that are not finite, or if the camera's rays are parallel.
    pub fn with_vignetting(self, vignetting: Option<Vignetting>) -> Result<Self> {
        if let Some(vignetting) = &vignetting {
            vignetting.validate()?;
            if self.center != Center::Point {
                return Err(parallel_rays_error("vignetting"));
            }
        }
        Ok(Self { vignetting, ..self })
    }

    /// Returns a moving copy: its pose becomes the pose in the middle of the motion.
    ///
    /// # Errors
    /// [`SceneError::Camera`] if a pose is not a rotation with a finite centre, or if the camera's matrix has its
    /// centre at infinity, so that it has no position to move from.
    pub fn with_motion(self, motion: ShutterMotion) -> Result<Self> {
        if self.center == Center::Infinity {
            return Err(SceneError::camera(
                "a camera created from a matrix P with a centre at infinity has no position and cannot move; use an \
                 orthographic camera",
            ));
        }
        for (_, pose) in motion.poses() {
            self.clone().at_pose(pose.r, pose.c)?;
        }
        let middle = motion.mid_exposure_pose();
        let still = Self { motion: None, ..self };
        Ok(Self { motion: Some(motion), ..still.at_pose(middle.r, middle.c)? })
    }

    /// Returns a copy with another pose: camera_from_world, and the centre. The motion of a moving camera is moved too.
    ///
    /// # Errors
    /// Errors of [`Camera::new`] about R and C.
    pub fn at_pose(&self, r: DMat3, c: DVec3) -> Result<Self> {
        let r = validated_rotation(r)?;
        if self.center == Center::Infinity {
            let p = camera_matrix(self.k, r, c, self.center)?;
            let moved = Self::from_matrix(p, self.size, self.pixel_center)?;
            return Ok(moved.with_background(self.background().cloned()));
        }
        if !c.is_finite() {
            return Err(SceneError::camera(format!("the camera centre {c} is not finite")));
        }
        let motion = self.motion.as_ref().map(|motion| {
            // Rotation of the world that moves the old pose to the new pose.
            let turn = r.transpose() * self.r;
            motion.map_poses(|pose| Pose { r: pose.r * turn.transpose(), c: c + turn * (pose.c - self.c) })
        });
        Ok(Self { r, c, p: camera_matrix(self.k, r, c, self.center)?, matrix: None, motion, ..self.clone() })
    }

    /// Returns a copy with new intrinsics and a new image size.
    ///
    /// # Errors
    /// Errors of [`Camera::new`] about K and the size.
    pub fn with_intrinsics(&self, k: DMat3, size: [u32; 2]) -> Result<Self> {
        check_size(size)?;
        let k = match self.center {
            // K of such a camera may be a general homography, so it is not checked.
            Center::Infinity => k,
            _ => validated_intrinsics(k)?,
        };
        Ok(Self {
            k,
            size,
            p: camera_matrix(k, self.r, self.c, self.center)?,
            matrix: None,
            undistort_table: UndistortTable::default(),
            ..self.clone()
        })
    }

    /// Returns a copy whose rays, if they come from infinity, start in front of the given sphere. Rays of other cameras
    /// start at their usual origin.
    pub fn with_ray_origins_outside(&self, center: DVec3, radius: f64) -> Self {
        let start = match self.center {
            Center::Infinity => (center - self.c).dot(self.forward()) - 1.5 * radius,
            _ => 0.0,
        };
        Self { ray_start_depth: start, ..self.clone() }
    }

    /// Depth at which rays start: 0 except after [`Camera::with_ray_origins_outside`].
    pub fn ray_start_depth(&self) -> f64 {
        self.ray_start_depth
    }

    /// Lens model, which acts between R and K.
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Aperture; `None` for a pinhole.
    pub fn aperture(&self) -> Option<&Aperture> {
        self.aperture.as_ref()
    }

    /// Vignetting; `None` if the image does not darken away from its centre.
    pub fn vignetting(&self) -> Option<&Vignetting> {
        self.vignetting.as_ref()
    }

    /// Shutter, and motion while it is open; `None` for a camera without a shutter.
    pub fn motion(&self) -> Option<&ShutterMotion> {
        self.motion.as_ref()
    }

    /// Origin of the camera's rays.
    pub fn center(&self) -> Center {
        self.center
    }

    /// Matrix that the camera was created from, with its original scale and sign; `None` for cameras from other
    /// constructors.
    pub fn matrix(&self) -> Option<[[f64; 4]; 3]> {
        self.matrix
    }
}

fn parallel_rays_error(what: &str) -> SceneError {
    SceneError::camera(format!(
        "a camera with parallel rays (orthographic, or created from a matrix P with a centre at infinity) cannot \
         have {what}"
    ))
}
