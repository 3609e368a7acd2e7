//! Ray-triangle tests of single rays. Edge functions are shared with packets.

pub(crate) mod edge;
pub(crate) mod single;
