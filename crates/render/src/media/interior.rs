//! The bodies that contain a point, such as the water around a camera.

use glam::DVec3;
use raycam_bvh::ExactRay;

use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::geometry::Geometry;
use crate::prepare::one_instance::OneInstance;

impl Geometry {
    /// The media that contain a scene-local point: larger bodies first. Open meshes contain nothing.
    pub(crate) fn interior_at(&self, point: DVec3) -> InteriorList {
        let mut interior = InteriorList::default();
        if self.bodies.is_empty() || !point.is_finite() {
            return interior;
        }
        let point = point + self.origin;
        for &(instance, [lower, upper]) in &self.bodies {
            let is_near = point.cmpge(lower).all() && point.cmple(upper).all();
            if is_near && self.body_contains(instance, point) {
                interior = interior.push(self.instances[instance].materials[0] as u32);
            }
        }
        interior
    }

    fn body_contains(&self, instance: usize, point: DVec3) -> bool {
        let object = &self.instances[instance];
        if self.dielectric_bounds()[object.materials[0]].is_none() {
            return false;
        }
        let scene = match &self.boundaries {
            Some(boundaries) if object.is_boundary => boundaries,
            _ => self.two_level(),
        };
        let ray =
            ExactRay { origin: point.to_array(), direction: DVec3::Z.to_array(), t_min: 0.0, t_max: f64::INFINITY };
        let mut count = [0];
        scene.count_crossings(&[ray], self, Some(&OneInstance(instance as u32)), true, &mut count);
        count[0] != 0
    }
}
