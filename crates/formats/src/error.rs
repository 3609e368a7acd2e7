//! Errors of reading and writing files, with the position in the file.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use raycam_scene::{ErrorCode, Message, SceneError};

/// An error of reading or writing. Programs should test [`FormatError::code`]; the message states the position, the
/// value found, the expectation and a remedy.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The file cannot be read; `source.kind()` is the reason (`NotFound`, `IsADirectory`, `PermissionDenied`, ...).
    #[error("{}: {source}{}", path.display(), broken_link(path))]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The file does not follow its format.
    #[error("{}{location}: {message}", path.display())]
    Syntax {
        /// Path of the file.
        path: PathBuf,
        /// Position in the file.
        location: Location,
        /// The value found and the value expected.
        message: Message,
    },
    /// A world file has a value that the schema does not allow.
    #[error("{}:{line}: {}{message}", path.display(), prefix(key))]
    Schema {
        /// Path of the world file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// Key, such as `object[2].diffuse`; empty for the whole file.
        key: String,
        /// The value expected, with the nearest valid name.
        message: Message,
    },
    /// The file requires more than the budget allows.
    #[error(
        "{}: {amount} {what} exceed the remaining budget of {left}; use smaller files, or set texture_memory if \
         textures are large",
        path.display()
    )]
    Budget {
        /// Path of the file.
        path: PathBuf,
        /// The exhausted resource.
        what: &'static str,
        /// The amount that the file requires.
        amount: u64,
        /// The amount that remains in the budget.
        left: u64,
    },
    /// The file is valid, but raycam does not support its format or one of its features.
    #[error("{}: {message}", path.display())]
    Unsupported {
        /// Path of the file.
        path: PathBuf,
        /// The format of the file, and the supported formats.
        message: Message,
    },
    /// A name inside a file refers to a location outside the folders from which files may be read.
    #[error("file name {reference:?}: {message}")]
    Reference {
        /// The name as written.
        reference: String,
        /// The reason why the name is rejected.
        message: Message,
    },
    /// A file that a world file or another description refers to is invalid.
    #[error("{}{key}: {source}", place.as_ref().map(|(path, line)| format!("{}:{line}: ", path.display())).unwrap_or_default())]
    Named {
        /// The world file and the line (from 1) that refers to the file, if any.
        place: Option<(PathBuf, usize)>,
        /// Key, such as `object[2].mesh`.
        key: String,
        /// The error of the file.
        source: Box<FormatError>,
    },
    /// A description is well-formed, but `raycam_scene` rejects its values.
    #[error("{}{source}", path.as_ref().map(|p| format!("{}: ", p.display())).unwrap_or_default())]
    Scene {
        /// The file to which the error belongs, if any.
        path: Option<PathBuf>,
        /// The error of the description.
        source: SceneError,
    },
    /// The data cannot be written: the output format does not support them, or they are inconsistent.
    #[error("{0}")]
    Encode(Message),
}

/// Result of reading or writing.
pub type Result<T, E = FormatError> = std::result::Result<T, E>;

/// Position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// Line of a text file, from 1.
    Line(usize),
    /// Byte of a binary file, from 0.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": byte {byte}"),
            Self::Whole => Ok(()),
        }
    }
}

/// "; it is a symbolic link to ..." for a link whose target does not exist, otherwise empty.
pub fn broken_link(path: &Path) -> String {
    let Some(target) = path.read_link().ok().filter(|_| !path.exists()) else { return String::new() };
    format!("; it is a symbolic link to {}, which does not exist", target.display())
}

fn prefix(key: &str) -> String {
    if key.is_empty() { String::new() } else { format!("{key}: ") }
}

impl FormatError {
    /// Creates the error for data that cannot be written.
    pub fn encode(message: impl Into<Message>) -> Self {
        Self::Encode(message.into())
    }

    /// Returns the error's code, by which programs distinguish errors.
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Io { source, .. } => match source.kind() {
                io::ErrorKind::NotFound => ErrorCode::FileNotFound,
                _ => ErrorCode::FileUnreadable,
            },
            Self::Syntax { message, .. } => message.code_or(ErrorCode::Syntax),
            Self::Schema { message, .. } => message.code_or(ErrorCode::InvalidValue),
            Self::Budget { .. } => ErrorCode::BudgetExceeded,
            Self::Unsupported { message, .. } => message.code_or(ErrorCode::UnsupportedFeature),
            Self::Reference { message, .. } => message.code_or(ErrorCode::OutsideRoot),
            Self::Named { source, .. } => source.code(),
            Self::Scene { source, .. } => source.code(),
            Self::Encode(message) => message.code_or(ErrorCode::CannotWrite),
        }
    }

    /// Creates a syntax error in a line, counted from 1.
    pub fn line(path: &Path, line: usize, message: impl Into<Message>) -> Self {
        Self::Syntax { path: path.into(), location: Location::Line(line), message: message.into() }
    }

    /// Creates a syntax error at a byte, counted from 0.
    pub fn byte(path: &Path, byte: usize, message: impl Into<Message>) -> Self {
        Self::Syntax { path: path.into(), location: Location::Byte(byte as u64), message: message.into() }
    }

    /// Creates a syntax error of the file as a whole.
    pub fn whole(path: &Path, message: impl Into<Message>) -> Self {
        Self::Syntax { path: path.into(), location: Location::Whole, message: message.into() }
    }

    /// Creates the error of a valid file that raycam does not support.
    pub fn unsupported(path: &Path, message: impl Into<Message>) -> Self {
        Self::Unsupported { path: path.into(), message: message.into() }
    }
}

impl From<SceneError> for FormatError {
    fn from(source: SceneError) -> Self {
        Self::Scene { path: None, source }
    }
}
