//! Cameras. glTF's cameras look along -z with y up and have an aspect ratio; raycam's cameras have a size in pixels,
//! chosen with as many pixels as 640 x 480.

use glam::{DAffine3, DMat3, DVec3};
use raycam_scene::camera::{intrinsics_from_extent, intrinsics_from_fov};
use raycam_scene::{Camera, ErrorCode, NoticeCode, PixelCenter};

use crate::error::Result;
use crate::gltf::json;
use crate::gltf::world::builder::Builder;

/// Aspect ratio of a camera that does not specify one.
const DEFAULT_ASPECT: f64 = 4.0 / 3.0;
/// Number of pixels in an image.
const IMAGE_PIXELS: f64 = 640.0 * 480.0;

enum Projection {
    /// Vertical field of view in radians, and the size of the image.
    Perspective { yfov: f64, size: [u32; 2] },
    /// Half the width and half the height of the view, and the size of the image.
    Orthographic { half: [f64; 2], size: [u32; 2] },
}

impl Builder<'_, '_> {
    /// Adds the camera that a node refers to, and returns its index.
    pub(crate) fn camera(
        &mut self,
        place: &str,
        index: usize,
        node_name: &str,
        world_from_node: DAffine3,
    ) -> Result<Option<usize>> {
        let document = self.document;
        let json = document.get_valid(&document.root.cameras, index, place, "cameras")?;
        let place = format!("cameras[{index}]");
        let projection = self.projection(&place, json)?;
        let world_from_camera = match rigid(world_from_node) {
            Some((pose, false)) => pose,
            Some((pose, true)) => {
                self.diagnostics.note(NoticeCode::RepairedPose, &place, "mirroring and shear of its node are ignored");
                pose
            }
            None => {
                self.diagnostics.note(
                    NoticeCode::IgnoredElement,
                    &place,
                    "camera omitted: its node has zero scale along an axis",
                );
                return Ok(None);
            }
        };
        // Converts glTF's axes (right, up, back) to raycam's axes (right, down, forward).
        let r = (world_from_camera.matrix3 * flip_yz()).transpose();
        let c = world_from_camera.translation;
        let pixel_center = PixelCenter::default();
        let camera = match projection {
            Projection::Perspective { yfov, size } => intrinsics_from_fov(yfov.to_degrees(), size, pixel_center)
                .and_then(|k| Camera::new(k, r, c, size, pixel_center)),
            Projection::Orthographic { half, size } => {
                let k = intrinsics_from_extent(half, size, pixel_center);
                Camera::orthographic(k, r, c, size, pixel_center)
            }
        };
        let camera = camera.map_err(|error| document.scene(&place, error))?;
        let name = match (&json.name[..], node_name) {
            ("", "") => "camera",
            ("", name) => name,
            (name, _) => name,
        };
        Ok(Some(self.world.add_camera(name, camera)))
    }

    /// Validated projection of a camera.
    fn projection(&mut self, place: &str, json: &json::Camera) -> Result<Projection> {
        let fault = |code, message: &str| self.document.fault(code, format!("{place}{message}"));
        match (&json.kind[..], &json.perspective, &json.orthographic) {
            ("perspective", Some(perspective), _) => {
                let aspect = perspective.aspect_ratio.unwrap_or(DEFAULT_ASPECT);
                if !(aspect.is_normal() && aspect > 0.0) {
                    return Err(fault(
                        ErrorCode::OutOfRange,
                        &format!(
                            ".perspective.aspectRatio: {aspect}; expected a number greater than 0 (VALUE_NOT_IN_RANGE)"
                        ),
                    ));
                }
                let yfov = perspective.yfov;
                if !(yfov.is_finite() && yfov > 0.0) {
                    return Err(fault(
                        ErrorCode::OutOfRange,
                        &format!(".perspective.yfov: {yfov}; expected a number greater than 0 (VALUE_NOT_IN_RANGE)"),
                    ));
                }
                let size = image_size(aspect);
                Ok(Projection::Perspective { yfov, size })
            }
            ("orthographic", _, Some(orthographic)) => {
                let [x, y] = [orthographic.xmag, orthographic.ymag];
                if !(x.is_normal() && y.is_normal()) {
                    return Err(fault(
                        ErrorCode::OutOfRange,
                        &format!(
                            ".orthographic: xmag is {x}, ymag is {y}; expected numbers greater than 0 \
                             (CAMERA_XMAG_YMAG_ZERO)"
                        ),
                    ));
                }
                if x < 0.0 || y < 0.0 {
                    let message = "a negative magnification is treated as positive (CAMERA_XMAG_YMAG_NEGATIVE)";
                    self.diagnostics.note(NoticeCode::ReplacedValue, place, message);
                }
                let half = [x.abs(), y.abs()];
                let size = image_size(half[0] / half[1]);
                Ok(Projection::Orthographic { half, size })
            }
            ("perspective" | "orthographic", ..) => {
                Err(fault(ErrorCode::MissingValue, ": the object required by its type is missing (UNDEFINED_PROPERTY)"))
            }
            _ => Err(fault(
                ErrorCode::UnknownName,
                &format!(".type: {:?}; expected perspective or orthographic (VALUE_NOT_IN_LIST)", json.kind),
            )),
        }
    }
}

/// Image size with this aspect ratio and the usual number of pixels.
pub(crate) fn image_size(aspect: f64) -> [u32; 2] {
    let width = (IMAGE_PIXELS * aspect).sqrt();
    [width, width / aspect].map(|side| side.round().clamp(1.0, 8192.0) as u32)
}

/// Converts the axes of glTF's cameras (right, up, back) to raycam's (right, down, forward), and vice versa.
pub(crate) fn flip_yz() -> DMat3 {
    DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0))
}

/// Rotation and translation of a transform, and true if the transform also contains a shear or a reflection.
fn rigid(transform: DAffine3) -> Option<(DAffine3, bool)> {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis];
    let back = z.try_normalize()?;
    let right = (x - x.dot(back) * back).try_normalize()?;
    let up = back.cross(right);
    let off = |a: DVec3, b: DVec3| a.dot(b).abs() > 1e-5 * a.length() * b.length();
    let more = transform.matrix3.determinant() < 0.0 || off(x, y) || off(y, z) || off(z, x);
    let rotation = DMat3::from_cols(right, up, back);
    let pose = DAffine3::from_mat3_translation(rotation, transform.translation);
    Some((pose, more))
}
