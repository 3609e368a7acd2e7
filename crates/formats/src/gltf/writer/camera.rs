//! Cameras: perspective and orthographic, with notices for properties that glTF does not support.

use glam::DAffine3;
use raycam_scene::camera::{Center, NamedCamera, intrinsics_from_focal};
use raycam_scene::{Lens, NoticeCode};
use serde_json::json;

use crate::gltf::world::camera::{flip_yz, image_size};
use crate::gltf::writer::document::Writer;

/// Distance of the near clipping plane. glTF requires this value; raycam does not clip.
const ZNEAR: f64 = 0.01;

impl Writer<'_> {
    /// Adds a camera; returns its index and world_from_node. `None` if glTF does not support the camera.
    pub(super) fn camera(&mut self, named: &NamedCamera) -> Option<(usize, DAffine3)> {
        let (name, camera) = (&named.name, &named.camera);
        let (k, size) = (camera.k(), camera.size());
        let [width, height] = size.map(f64::from);
        let [x, y] = [k.x_axis.x, k.y_axis.y];
        let aspect = width * y / (height * x);
        let mut lost = Vec::new();
        if image_size(aspect) != size {
            lost.push(format!("its size of {width} x {height} pixels"));
        }
        if !matches!(camera.lens(), Lens::Pinhole) {
            lost.push("its distortion".into());
        }
        lost.extend(camera.further_properties().map(|what| format!("its {what}")));
        let plain = intrinsics_from_focal(y, size, camera.pixel_center());
        let shift = (k.z_axis - plain.z_axis).abs().max_element();
        if shift > 1e-6 * width.max(height) || k.y_axis.x.abs() > 1e-9 * x {
            lost.push("a principal point off the centre, or skew".into());
        }
        let (kind, lens) = match camera.center() {
            Center::Point => {
                let fov = 2.0 * (height / (2.0 * y)).atan();
                let lens = json!({ "yfov": fov, "aspectRatio": aspect, "znear": ZNEAR });
                ("perspective", lens)
            }
            Center::Plane => {
                let (xmag, ymag) = (width / (2.0 * x), height / (2.0 * y));
                // raycam does not clip, so `far` need not depend on the world's size.
                let far = 1e6 * xmag.max(ymag);
                let lens = json!({ "xmag": xmag, "ymag": ymag, "znear": 0.0, "zfar": far });
                ("orthographic", lens)
            }
            Center::Infinity => {
                self.note(
                    NoticeCode::NotWritten,
                    format!("camera {name:?} omitted: its centre is at infinity, which glTF does not support"),
                );
                return None;
            }
        };
        if !lost.is_empty() {
            let lost = lost.join(", ");
            self.note(
                NoticeCode::NotWritten,
                format!(
                    "camera {name:?}: {lost} cannot be represented in glTF and is \
                omitted"
                ),
            );
        }
        let json = json!({ "name": name, "type": kind, kind: lens });
        let index = self.push("cameras", json);
        let world_from_camera = camera.r().transpose() * flip_yz();
        let place = DAffine3::from_mat3_translation(world_from_camera, camera.c());
        Some((index, place))
    }
}
