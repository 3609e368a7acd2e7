//! Overlapping objects of a world.

use raycam_scene::World;

use crate::bodies::Obstacle;
use crate::request::Physics;

/// Two objects that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Indices of the objects.
    pub objects: [usize; 2],
    /// Depth in metres.
    pub depth: f64,
}

/// Pairs of visible objects of different groups that penetrate each other by more than `limit` metres. `groups`
/// contains a number for each object; objects of one group may overlap, such as the links of a robot.
pub fn overlaps(world: &World, groups: &[usize], limit: f64) -> Vec<Overlap> {
    let visible = world.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let surfaces: Vec<Obstacle> = visible.filter_map(|(i, _)| Obstacle::new(world, i, Physics::default())).collect();
    let mut found = Vec::new();
    for (i, one) in surfaces.iter().enumerate() {
        for other in &surfaces[i + 1..] {
            if groups[one.object] == groups[other.object] {
                continue;
            }
            let depth = one.placed().penetration(&other.placed());
            if depth > limit {
                found.push(Overlap { objects: [one.object, other.object], depth });
            }
        }
    }
    found
}
