//! Targets around objects that focus light.

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustic_map::CausticMap;

/// Targets around objects that focus light.
#[derive(Debug, Default)]
pub(crate) struct Caustics {
    pub casters: Vec<CausticCaster>,
    /// The caustic map of each caster; empty for a world within an exposure.
    pub maps: Vec<CausticMap>,
    pub spots: Vec<CausticCaster>,
}

/// No targets.
pub(crate) static NO_CAUSTICS: Caustics = Caustics { casters: vec![], maps: vec![], spots: vec![] };
