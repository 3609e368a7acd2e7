//! Conversion of panics in third-party decoders to errors.

use raycam_scene::ErrorCode;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use crate::error::{FormatError, Result};

thread_local! {
    static IN_DECODER: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder of a library, and returns its panic as the error of a damaged file, without a message on the
/// terminal.
///
/// Data that `decode` changes must not be used after an error, because the decoder may have stopped halfway.
pub(crate) fn catch_decoder_panic<T>(path: &Path, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IN_DECODER.get() {
                before(info);
            }
        }));
    });
    let outer = IN_DECODER.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(decode));
    IN_DECODER.set(outer);
    result.unwrap_or_else(|_| {
        Err(FormatError::whole(path, ErrorCode::DamagedData.message("damaged file: its decoder failed")))
    })
}
