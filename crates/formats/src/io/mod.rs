//! TODO: what is here.

pub(crate) mod asset_root;
pub(crate) mod byte_source;
pub(crate) mod catch_panic;
pub(crate) mod lexer;
pub(crate) mod optional_asset;
pub(crate) mod parallel;
