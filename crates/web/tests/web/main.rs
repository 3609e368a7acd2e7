//! Requests of pages.

mod request;
