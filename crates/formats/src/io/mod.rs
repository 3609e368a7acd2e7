//! Input: files of one folder, bytes in memory or on disk, text, and parallel work. Independent of formats.

pub(crate) mod asset_root;
pub(crate) mod byte_source;
pub(crate) mod catch_panic;
pub(crate) mod companion;
pub(crate) mod diagnostics;
pub(crate) mod file_kind;
pub(crate) mod input_file;
pub(crate) mod lexer;
pub(crate) mod memory_files;
pub(crate) mod parallel;
pub(crate) mod reference;
pub(crate) mod stand_in;

pub use self::asset_root::AssetRoot;
pub(crate) use self::byte_source::ByteSource;
pub(crate) use self::diagnostics::Diagnostics;
pub use self::input_file::InputFile;
pub use self::lexer::without_utf16;
