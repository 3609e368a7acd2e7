//! `[camera]`.

use std::sync::Arc;

use glam::{DMat3, DVec2};
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess};
use serde::{Deserialize, Serialize};

use crate::camera::{
    Background, BackgroundFit, Camera, Center, Lens, LensModel, PixelCenter, Pose, Vignetting, intrinsics_from_focal,
    intrinsics_from_fov,
};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::model::AssetLoader;
use crate::schema::keys::{Keys, by_key};
use crate::schema::shorthand::Splat;
use crate::schema::spec::optics::{ApertureSpec, ShutterSpec};
use crate::schema::spec::pose::{POSE, PoseSpec, pose_of, with_pose};
use crate::up::Up;
use crate::written::{written, written_schema};

/// Projection of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Projection {
    /// All rays start at one point.
    #[default]
    Perspective,
    /// Parallel rays that start on the plane through the location.
    Orthographic,
}

with_pose! {
    /// A camera: its size, its intrinsics and its pose. Intrinsics are exactly one of `focal`, `fov` and `K`; `height`
    /// for an orthographic camera; none for a full panorama. The pose is `location` with angles or a `target`, or `R`
    /// with `C` or `t`. One `matrix` can replace both.
    pub struct CameraSpec {
        /// The camera's name; default `camera`.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub name: Option<String>,
        /// Columns and rows of the image; default 640 x 480.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub size: Option<[u32; 2]>,
        /// The focal length in pixels: one number, or one each for x and y.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub focal: Option<Splat<2>>,
        /// The vertical field of view in degrees, with square pixels.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub fov: Option<f64>,
        /// The intrinsic matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.
        #[serde(rename = "K", skip_serializing_if = "Option::is_none")]
        pub k: Option<[[f64; 3]; 3]>,
        /// Height of an orthographic camera's image in world units.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub height: Option<f64>,
        /// "perspective", or "orthographic": `focal` and `K` are then in pixels per unit of the world.
        pub projection: Projection,
        /// The whole 3x4 camera matrix P, of any scale and sign.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub matrix: Option<[[f64; 4]; 3]>,
        /// The skew for `focal` or `fov`, in pixels; default 0.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub skew: Option<f64>,
        /// The principal point for `focal` or `fov`, in pixels; default: the image centre.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub principal_point: Option<[f64; 2]>,
        /// The lens's distortion coefficients, in the order that `lens` specifies; default: no distortion.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub distortion: Option<Vec<f64>>,
        /// The model of `distortion`: "opencv" (4, 5, 8, 12 or 14 coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 taux
        /// tauy), "fisheye" (k1 k2 k3 k4), "thin_prism_fisheye" (k1 k2 p1 p2 k3 k4 sx1 sy1),
        /// "rad_tan_thin_prism_fisheye" (k0 to k5, p0 p1, s0 to s3), "fov" (omega), "division" (k), "omni" (xi, or xi
        /// k1 k2 p1 p2), "eucm" (alpha beta), "ds" (xi alpha); or a panorama without coefficients, "equirectangular" or
        /// "cylindrical". Default: "opencv".
        #[serde(skip_serializing_if = "Option::is_none")]
        pub lens: Option<LensModel>,
        /// Position of the first pixel's centre: "integer" for (0, 0) as in OpenCV, "half" for (0.5, 0.5) as in COLMAP.
        pub pixel_center: PixelCenter,
    }
    camera pose
    {
        /// The lens opening, for depth of field; default: a pinhole.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub aperture: Option<ApertureSpec>,
        /// Light falloff away from the image centre; default: none.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub vignetting: Option<Vignetting>,
        /// Exposure, rolling shutter, and the camera's motion during the exposure; default: no motion.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub shutter: Option<ShutterSpec>,
        /// Background photo: a PNG or JPEG file, or a table { image, camera, fit }.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub background: Option<BackgroundSpec>,
    }
}

/// Keys that define the camera's intrinsics; each of the first five defines all of them.
const INTRINSICS: [&str; 7] = ["focal", "fov", "K", "height", "matrix", "skew", "principal_point"];

impl CameraSpec {
    /// Describes a camera exactly, with R and C, or with the matrix that it was created from.
    pub fn from_camera(camera: &Camera) -> Self {
        let lens = camera.lens().coefficients();
        let mut spec = Self {
            size: Some(camera.size()),
            pixel_center: camera.pixel_center(),
            lens: lens.map(|(model, _)| model),
            distortion: lens.filter(|(model, _)| !model.is_panorama()).map(|(_, given)| given.to_vec()),
            aperture: camera.aperture().map(ApertureSpec::from_aperture),
            vignetting: camera.vignetting().cloned(),
            shutter: camera.motion().map(ShutterSpec::from_motion),
            background: camera.background().map(BackgroundSpec::from_background),
            ..Self::default()
        };
        let matrix = match camera.center() {
            Center::Infinity => Some(camera.matrix().unwrap_or(camera.p())),
            _ => camera.matrix().filter(|_| lens.is_none()),
        };
        if matrix.is_some() {
            spec.matrix = matrix;
            return spec;
        }
        spec.k = Some(camera.k().transpose().to_cols_array_2d());
        if camera.center() == Center::Plane {
            spec.projection = Projection::Orthographic;
        }
        if spec.shutter.is_none() {
            let pose = PoseSpec::from_pose(&Pose { r: camera.r(), c: camera.c() });
            (spec.r, spec.c) = (pose.r, pose.c);
        }
        spec
    }

    /// Returns the described camera.
    ///
    /// # Errors
    /// [`SceneError`] if intrinsics or pose are missing or given twice, and the errors of [`Camera`]'s constructors.
    pub fn build(&self, up: Up) -> Result<Camera> {
        let mut camera = self.build_static(up)?;
        if let Some(aperture) = &self.aperture {
            let aperture = aperture.build().map_err(|error| error.in_context("aperture"))?;
            camera = camera.with_aperture(Some(aperture))?;
        }
        camera = camera.with_vignetting(self.vignetting.clone())?;
        if let Some(shutter) = &self.shutter {
            let start = Pose { r: camera.r(), c: camera.c() };
            let motion = shutter.build(start, |pose| pose.build(up));
            let mut motion = motion.map_err(|error| error.in_context("shutter"))?;
            if let Some(mount) = &shutter.mount {
                // The mount is in the axes of a body: x forward and z up.
                let mount = mount.build(Up::Z);
                motion = motion.with_camera_from_body(mount.map_err(|error| error.in_context("shutter.mount"))?);
            }
            camera = camera.with_motion(motion)?;
        }
        let background = self.background.as_ref().map(|spec| spec.build(up)).transpose();
        Ok(camera.with_background(background.map_err(|error| error.in_context("background"))?))
    }

    /// Replaces the name of the background image by the file's full path.
    ///
    /// # Errors
    /// Errors of `files`.
    pub fn find_background<F: AssetLoader>(&mut self, files: &mut F) -> Result<(), F::Error> {
        if let Some(BackgroundSpec(background)) = &mut self.background {
            background.image = files.picture(&background.image)?;
        }
        Ok(())
    }

    /// Builds the camera without its motion.
    fn build_static(&self, up: Up) -> Result<Camera> {
        let size = self.size.unwrap_or([640, 480]);
        let keys = self.keys();
        let lens = self.lens(&keys)?;
        let pose = pose_of!(self);
        if let Some(matrix) = self.matrix {
            keys.refuse(
                &["distortion", "lens"],
                "cannot be combined with \"matrix\", which describes a pinhole; for a lens, use K and R with C or t",
            )?;
            let again = "cannot be combined with \"matrix\", which already contains it; use only one of them";
            keys.refuse(&["focal", "fov", "K", "height", "skew", "principal_point"], again)?;
            pose.keys().refuse(&POSE, again)?;
            if self.projection == Projection::Orthographic {
                return Err(SceneError::schema(ErrorCode::ConflictingValues, "projection", again));
            }
            return Camera::from_matrix(matrix, size, self.pixel_center).map_err(|error| error.in_context("matrix"));
        }
        let k = self.intrinsics(size, &keys, &lens)?;
        let pose = match self.shutter.as_ref().and_then(|shutter| shutter.first_pose()) {
            None => pose.build(up)?,
            Some(first) => {
                pose.keys().refuse(
                    &POSE,
                    "cannot be combined with \"shutter.track\", which already contains the camera's pose; use only \
                     one of them",
                )?;
                first.build(up).map_err(|error| error.in_context("shutter.track[0].pose"))?
            }
        };
        match self.projection {
            Projection::Perspective => Camera::new(k, pose.r, pose.c, size, self.pixel_center)?.with_lens(lens),
            Projection::Orthographic => {
                Camera::orthographic(k, pose.r, pose.c, size, self.pixel_center)?.with_lens(lens)
            }
        }
    }

    fn lens(&self, keys: &Keys<9>) -> Result<Lens> {
        match (&self.distortion, self.lens) {
            (Some(distortion), lens) => {
                Lens::new(lens.unwrap_or_default(), distortion).map_err(|error| error.in_context("distortion"))
            }
            (None, Some(panorama)) if panorama.is_panorama() => Lens::new(panorama, &[]),
            (None, _) => {
                let message = "\"distortion\", the coefficients of the lens, is missing; use [0, 0, 0, 0] for an \
                    equidistant fisheye";
                keys.refuse_as(ErrorCode::MissingValue, &["lens"], message)?;
                Ok(Lens::Pinhole)
            }
        }
    }

    fn intrinsics(&self, size: [u32; 2], keys: &Keys<9>, lens: &Lens) -> Result<DMat3> {
        let orthographic = self.projection == Projection::Orthographic;
        if orthographic {
            let message = "\"projection\" is orthographic; expected height, focal or K";
            keys.refuse(&["fov"], message)?;
        } else {
            let message = "requires projection = \"orthographic\"";
            keys.refuse(&["height"], message)?;
        }
        if let Some(k) = lens.full_panorama(size, self.pixel_center)
            && keys.given(&INTRINSICS).is_empty()
        {
            return Ok(k);
        }
        keys.exactly_one("intrinsics", &INTRINSICS[..5])?;
        if let Some(k) = self.k {
            keys.refuse(
                &["skew", "principal_point"],
                "cannot be combined with \"K\", which already contains it; use only one of them",
            )?;
            return Ok(DMat3::from_cols_array_2d(&k).transpose());
        }
        let mut k = match (self.fov, self.height, self.focal) {
            (Some(fov), ..) => {
                intrinsics_from_fov(fov, size, self.pixel_center).map_err(|error| error.in_context("fov"))?
            }
            (None, Some(height), _) => {
                if !(height > 0.0 && height.is_finite()) {
                    let message = format!("{height}; expected a finite length > 0");
                    return Err(SceneError::schema(ErrorCode::OutOfRange, "height", message));
                }
                intrinsics_from_focal(f64::from(size[1]) / height, size, self.pixel_center)
            }
            (None, None, focal) => {
                let [fx, fy] = focal.unwrap_or(Splat([1.0; 2])).0;
                let mut k = intrinsics_from_focal(fx, size, self.pixel_center);
                k.y_axis.y = fy;
                k
            }
        };
        k.y_axis.x = self.skew.unwrap_or(0.0);
        if let Some(center) = self.principal_point {
            k.z_axis = DVec2::from(center).extend(1.0);
        }
        Ok(k)
    }

    /// Returns the present keys, except for the keys of the pose.
    fn keys(&self) -> Keys<9> {
        Keys(by_key! { self, is_some:
            focal, fov, "K" k, height, matrix, skew, principal_point, distortion, lens,
        })
    }
}

/// Background image of a camera: only its file, or a table.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct BackgroundSpec(pub BackgroundTable);

/// Background image of a camera, as a table.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BackgroundTable {
    /// A PNG or JPEG file in the world file's folder or below.
    pub image: String,
    /// "exact": a photo with the size of the camera, or of the key `camera`. "cover": any image, scaled and cropped so
    /// that it fills the camera's image.
    #[serde(default)]
    pub fit: BackgroundFit,
    /// The camera that took the photo, if it is a different one: its size, intrinsics and lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Box<CameraSpec>>,
}

impl BackgroundSpec {
    /// Describes a background.
    pub fn from_background(background: &Background) -> Self {
        Self(BackgroundTable {
            image: background.image.clone(),
            fit: background.fit,
            camera: background.camera.as_deref().map(CameraSpec::from_camera).map(Box::new),
        })
    }

    /// Returns the described background.
    ///
    /// # Errors
    /// Errors of [`CameraSpec::build`], and an error if `camera` is combined with the fit "cover".
    pub fn build(&self, up: Up) -> Result<Background> {
        let BackgroundTable { image, fit, camera } = &self.0;
        if *fit == BackgroundFit::Cover && camera.is_some() {
            let message = "cannot be combined with fit = \"cover\", which uses no camera; use only one of them";
            return Err(SceneError::schema(ErrorCode::ConflictingValues, "camera", message));
        }
        let built = camera.as_ref().map(|spec| spec.build(up)).transpose();
        let built = built.map_err(|error| error.in_context("camera"))?;
        Ok(Background { image: image.clone(), fit: *fit, camera: built.map(Arc::new) })
    }
}

written! {
    BackgroundSpec: "the name of an image file or a table { image, camera, fit }",

    fn visit_str<E: Error>(self, v: &str) -> Result<BackgroundSpec, E> {
        Ok(BackgroundSpec(BackgroundTable { image: v.into(), fit: BackgroundFit::default(), camera: None }))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<BackgroundSpec, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(map)).map(BackgroundSpec)
    }
}

written_schema!(BackgroundSpec, "Background", |generator| {
    let table = generator.subschema_for::<BackgroundTable>();
    schemars::json_schema!({ "anyOf": [{ "type": "string" }, table] })
});
