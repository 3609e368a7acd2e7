//! Codes of errors, and messages with a code.

use std::fmt;
use std::ops::Deref;

use crate::codes::codes;

codes! {
    /// Kind of an error. The documentation of each variant states the cause and what to do.
    ErrorCode {
        InvalidValue "invalid_value":
            "A value is not one of the allowed values.",
            "Use one of the values that the message states.";
        OutOfRange "out_of_range":
            "A number is infinite, NaN or outside its range.",
            "Use a number in the range that the message states.";
        WrongType "wrong_type":
            "A value has the wrong type.",
            "Use the type that the message states.";
        WrongShape "wrong_shape":
            "A list or an array has the wrong number of entries or dimensions.",
            "Use the shape that the message states.";
        MissingValue "missing_value":
            "A required key, value or argument is missing.",
            "Add it.";
        MissingArgument "missing_argument":
            "A file lacks a value that an argument can provide: an image size, intrinsics, or a pose's direction.",
            "Pass the argument that the message names.";
        UnknownKey "unknown_key":
            "A key or an argument does not exist.",
            "Correct its spelling; the message lists the valid names.";
        UnknownName "unknown_name":
            "No option, object, camera or other part has the given name.",
            "Correct its spelling; the message lists the valid names.";
        IndexOutOfRange "index_out_of_range":
            "An index refers to a part that does not exist.",
            "Use an index below the number of parts.";
        DuplicateName "duplicate_name":
            "A name or key is used twice where it must be unique.",
            "Rename or remove one of them.";
        ConflictingValues "conflicting_values":
            "Two values or arguments cannot be used together.",
            "Remove one of them.";
        InvalidCamera "invalid_camera":
            "The parameters of a camera do not describe a camera.",
            "Correct the parameter that the message names.";
        InvalidMatrix "invalid_matrix":
            "A matrix does not have the required form, for example K or a projection matrix.",
            "Check the order of the values, the convention and the unit.";
        NotARotation "not_a_rotation":
            "A matrix or a quaternion is not a rotation.",
            "Check the order of its values; write poses with more digits.";
        InvalidLens "invalid_lens":
            "The coefficients of a lens model are invalid, or the lens cannot be inverted within the image.",
            "Check the order and number of the coefficients, and the image size.";
        InvalidWorld "invalid_world":
            "The parts of a world are inconsistent.",
            "Correct the part that the message names.";
        InvalidMesh "invalid_mesh":
            "The arrays of a mesh are inconsistent.",
            "Give each array as many entries as the mesh has vertices, corners or faces.";
        InvalidMaterial "invalid_material":
            "The values of a material do not describe a physical surface.",
            "Use reflectances of 0 to 1 and the ranges that the message states.";
        InvalidLight "invalid_light":
            "The values of a light are invalid.",
            "Correct the value that the message names.";
        NothingVisible "nothing_visible":
            "There is nothing to show, because no object or face exists.",
            "Add an object, or check that the file contains surfaces.";
        Syntax "syntax":
            "A file does not follow its format.",
            "Check the location that the message names, or write the file again.";
        EmptyFile "empty_file":
            "A file is empty.",
            "Copy, download or export the file again.";
        PlaceholderFile "placeholder_file":
            "A file is a pointer of Git LFS or git-annex, an HTML page or a server's error message instead of the data.",
            "Download the file itself, for example with git lfs pull.";
        WrongFormat "wrong_format":
            "The content of a file has a different format from the one that its name or its use requires.",
            "Rename the file, or use a file of the expected format.";
        NotText "not_text":
            "A text file contains bytes that are not UTF-8.",
            "Save the file as UTF-8.";
        DamagedData "damaged_data":
            "Compressed or encoded data in a file cannot be decoded.",
            "Copy, download or export the file again.";
        ImplausibleSize "implausible_size":
            "A file declares far more data than its bytes can contain.",
            "Check that the file is complete, or write it with less compression.";
        CyclicReference "cyclic_reference":
            "Parts of a file contain each other in a cycle, or a part belongs to two others.",
            "Give each part one parent.";
        InvalidUri "invalid_uri":
            "A URI in a file is malformed.",
            "Correct the URI at the location that the message names.";
        TruncatedFile "truncated_file":
            "A file ends before its declared content.",
            "Copy or download the file again.";
        BudgetExceeded "budget_exceeded":
            "A file would require more memory or more elements than the budget allows.",
            "Use smaller files, or set texture_memory if textures are large.";
        UnsupportedFeature "unsupported_feature":
            "A valid file uses a feature that is not supported.",
            "Export the file without this feature.";
        UnknownFormat "unknown_format":
            "The format of a file is unknown.",
            "Convert it to one of the formats that the message lists.";
        OutsideRoot "outside_root":
            "A file name inside a file points outside its folder.",
            "Set folder= to a folder that contains all files, or move the file into the folder of the file that names it.";
        FileNotFound "file_not_found":
            "A file does not exist.",
            "Check the path.";
        FileUnreadable "file_unreadable":
            "The operating system denies reading or writing a file.",
            "Check permissions, free space, and that the path is a file.";
        Storage "storage":
            "The temporary file of textures cannot be created, written or read.",
            "Set TMPDIR to a folder with enough space, or raise texture_memory.";
        CannotWrite "cannot_write":
            "The file format to be written cannot store some of the values.",
            "Use another format, or change the values.";
        InvalidSettings "invalid_settings":
            "Render settings or arguments are invalid.",
            "Correct the argument that the message names.";
        TooLarge "too_large":
            "A result or a part of a file is larger than the limit.",
            "Render the image in regions, request fewer channels, or divide the file.";
        OutOfMemory "out_of_memory":
            "The operating system does not provide the required memory.",
            "Request less data at a time.";
        Cancelled "cancelled":
            "A call was cancelled.",
            "Call it again for the complete result.";
        NoThreads "no_threads":
            "The operating system denies starting threads.",
            "Use fewer threads.";
        Internal "internal":
            "A bug in raycam.",
            "Report it with the message and the input.";
    }
}

/// Text of an error, with its code if the code is more specific than the error's kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    text: String,
    code: Option<ErrorCode>,
}

impl Message {
    /// Returns the message's code, or `code` if the message has none.
    pub fn code_or(&self, code: ErrorCode) -> ErrorCode {
        self.code.unwrap_or(code)
    }

    /// Returns a message with the same code and another text.
    #[must_use]
    pub fn with_text(self, text: impl Into<String>) -> Self {
        Self { text: text.into(), ..self }
    }
}

impl ErrorCode {
    /// Creates a message with this code.
    pub fn message(self, text: impl Into<String>) -> Message {
        Message { text: text.into(), code: Some(self) }
    }
}

impl From<String> for Message {
    fn from(text: String) -> Self {
        Self { text, code: None }
    }
}

impl From<&str> for Message {
    fn from(text: &str) -> Self {
        Self { text: text.into(), code: None }
    }
}

impl Deref for Message {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_codes_have_unique_names_and_complete_sentences() {
        let all = ErrorCode::ALL;
        assert!(all.iter().all(|code| code.cause().ends_with('.') && code.remedy().ends_with('.')));
        let mut names: Vec<_> = all.iter().map(|code| code.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
    }

    #[test]
    fn message_without_code_uses_the_default() {
        let (plain, coded) = (Message::from("text"), ErrorCode::OutOfRange.message("text"));
        assert_eq!(plain.code_or(ErrorCode::Syntax), ErrorCode::Syntax);
        assert_eq!(coded.with_text("other").code_or(ErrorCode::Syntax), ErrorCode::OutOfRange);
    }
}
