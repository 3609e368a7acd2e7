//! Targets around objects that focus light.

use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustic_map::CausticMap;

/// Casters and their caustic maps.
#[derive(Debug, Default)]
pub(crate) struct Caustics {
    pub casters: Vec<CausticCaster>,
    /// Caustic map of each caster; empty for a world at one time within an exposure.
    pub maps: Vec<CausticMap>,
    pub spots: Vec<CausticCaster>,
}

/// Returns no targets.
pub(crate) static NO_CAUSTICS: Caustics = Caustics { casters: vec![], maps: vec![], spots: vec![] };
