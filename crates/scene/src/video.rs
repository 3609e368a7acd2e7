//! Videos: orbits and keyframes, and the world at a time.

/// What `[video]` says.
#[derive(Clone, Debug, PartialEq)]
pub struct Video {}
