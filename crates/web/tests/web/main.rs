//! Tests of the requests that web pages send.

mod request;
