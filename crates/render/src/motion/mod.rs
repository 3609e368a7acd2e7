//! Motion blur: states of a moving world while the shutter is open. Uses the prepared world.

pub(crate) mod shutter;
pub(crate) mod slice_count;
