//! What a page asks of the core.

mod request;
