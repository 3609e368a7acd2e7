//! Cameras: perspective, with what glTF has no words for told.

use glam::{DAffine3, DMat3};
use raycam_scene::camera::{Lens, intrinsics_from_fov};
use raycam_scene::world::NamedCamera;
use serde_json::json;

use super::super::camera::image_size;
use super::Writer;

/// Required by glTF; nothing is cut off here.
const NEAR: f64 = 0.01;

impl Writer<'_> {
    /// Adds a camera: its index, and where it is.
    pub(super) fn camera(&mut self, named: &NamedCamera) -> (usize, DAffine3) {
        let (name, camera) = (&named.name, &named.camera);
        let (k, size) = (camera.k(), camera.size());
        let [width, height] = size.map(f64::from);
        let fov: f64 = 2.0 * (height / (2.0 * k.y_axis.y)).atan();
        let aspect = width * k.y_axis.y / (height * k.x_axis.x);
        let mut lost = Vec::new();
        if image_size(aspect) != size {
            lost.push(format!("its size of {width} x {height} pixels"));
        }
        if !matches!(camera.lens(), Lens::Pinhole) {
            lost.push("its distortion".into());
        }
        let plain = intrinsics_from_fov(fov.to_degrees(), size, camera.pixel_center());
        if let Ok(plain) = plain {
            let shift = (k.z_axis - plain.z_axis).abs().max_element();
            if shift > 1e-6 * width.max(height) || k.y_axis.x.abs() > 1e-9 * k.x_axis.x {
                lost.push("a principal point off the middle, or skew".into());
            }
        }
        if !lost.is_empty() {
            let lost = lost.join(", ");
            self.note(format!(
                "camera {name:?}: {lost}: left out, glTF has no such thing"
            ));
        }
        let perspective = json!({ "yfov": fov, "aspectRatio": aspect, "znear": NEAR });
        let json = json!({ "name": name, "type": "perspective", "perspective": perspective });
        let index = self.push("cameras", json);
        // glTF's look along -z with y up.
        let world_from_camera =
            camera.r().transpose() * DMat3::from_diagonal([1.0, -1.0, -1.0].into());
        (
            index,
            DAffine3::from_mat3_translation(world_from_camera, camera.c()),
        )
    }
}
