//! Errors of settling.

/// Reasons why objects do not settle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SettleError {
    /// A number is outside its range.
    #[error("{0}")]
    OutOfRange(String),
    /// An object without volume cannot fall.
    #[error("object {name:?} has no volume, so it cannot fall; {remedy}", remedy = "use a mesh that encloses a volume")]
    NoVolume {
        /// Name of the object.
        name: String,
    },
    /// No attempt passed the checks.
    #[error("{message}{}", attempts_and_remedy(*attempts))]
    NotSettled {
        /// The first check that failed, with object and value.
        message: String,
        /// Number of attempts; 1 without a target.
        attempts: usize,
    },
    /// The caller stopped the work.
    #[error("settling was cancelled")]
    Cancelled,
}

/// Number of attempts, if several, and the remedy. Without a target, there is only one attempt.
fn attempts_and_remedy(attempts: usize) -> String {
    match attempts {
        1 => "; increase seconds, or place the objects closer to where they come to rest".into(),
        _ => {
            format!(" (last of {attempts} attempts); use fewer objects, a larger region, more seconds or another seed")
        }
    }
}

/// Result of settling.
pub type Result<T> = std::result::Result<T, SettleError>;

impl SettleError {
    /// Kind of error, as raycam's error code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::OutOfRange(_) => "out_of_range",
            Self::NoVolume { .. } => "no_volume",
            Self::NotSettled { .. } => "not_settled",
            Self::Cancelled => "cancelled",
        }
    }
}
