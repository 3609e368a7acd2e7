//! TODO: what is here.

pub(crate) mod dispatch;
pub(crate) mod huge_page_vec;
pub(crate) mod streaming_store;
