//! Targets around objects that focus light, to which samples are guided.

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustic_map::CausticMap;

/// Caustic casters with their caustic maps, and caustic spots.
#[derive(Debug, Default)]
pub(crate) struct Caustics {
    pub casters: Vec<CausticCaster>,
    /// Caustic map of each caster; empty for a world at one time within an exposure.
    pub maps: Vec<CausticMap>,
    pub spots: Vec<CausticCaster>,
}

/// Caustics without any targets.
pub(crate) static NO_CAUSTICS: Caustics = Caustics { casters: vec![], maps: vec![], spots: vec![] };
