//! Mean of the three colour components, by which lobes and directions are sampled.

use glam::Vec3;

/// Mean of a colour's components.
#[inline(always)]
pub(crate) fn mean(color: Vec3) -> f32 {
    color.element_sum() / 3.0
}
