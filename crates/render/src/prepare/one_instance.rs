//! Filter of queries about a single placed object.

use raycam_bvh::{ExactHit, HitFilter};

/// Filter that accepts only hits on a single instance.
pub(crate) struct OneInstance(pub u32);

impl HitFilter for OneInstance {
    fn accepts_instance(&self, _: usize, instance: u32) -> bool {
        instance == self.0
    }

    fn accepts_every_hit(&self) -> bool {
        true
    }

    fn accepts(&self, _: usize, _: &ExactHit) -> bool {
        true
    }
}
