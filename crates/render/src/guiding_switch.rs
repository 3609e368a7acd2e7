//! Switch of path guiding: the only file outside the folder `guiding` that uses this folder.

use crate::path_guiding::PathGuiding;
use crate::prepare::world::PreparedWorld;

/// Path guiding of a world; created if necessary.
///
/// To build without path guiding, delete the folder `guiding` and its line in `lib.rs`, and return `None` from the
/// closure.
pub(crate) fn install_guiding(world: &PreparedWorld) -> Option<&dyn PathGuiding> {
    world.guiding.install(|is_within_exposure| Some(Box::new(crate::guiding::LearnedGuiding::new(is_within_exposure))))
}
