//! TODO: what is here.

pub(crate) mod center_rays;
pub(crate) mod channels;
pub(crate) mod transparent;
