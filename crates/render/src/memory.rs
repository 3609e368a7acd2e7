//! Checks for available memory before allocations, because a failed allocation would end the process.

use crate::error::RenderError;

/// Checks that the system provides this many bytes, by reserving and releasing them.
///
/// # Errors
/// [`RenderError::OutOfMemory`].
pub fn check_memory(what: impl FnOnce() -> String, bytes: u64) -> Result<(), RenderError> {
    /// Size in bytes below which allocations are not checked.
    const SMALL: u64 = 1 << 20;
    let given =
        bytes < SMALL || usize::try_from(bytes).is_ok_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
    if given { Ok(()) } else { Err(RenderError::OutOfMemory { what: what(), bytes }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn allocations_beyond_memory_are_refused_with_their_size() {
        assert_eq!(check_memory(|| "little".into(), 1 << 24), Ok(()));
        for bytes in [1 << 62, u64::MAX] {
            let error = check_memory(|| "everything".into(), bytes).unwrap_err();
            assert!(error.to_string().contains(&format!("everything requires {bytes} bytes")), "{error}");
        }
    }
}
