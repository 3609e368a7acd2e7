//! Ignored statements of an OBJ file, for a notice.

use raycam_scene::{ErrorCode, Message};

use crate::io::lexer;

/// Maximum number of keywords; a file with more is not an OBJ file.
const MAX_KEYWORDS: usize = 32;

/// Keywords with their first lines.
#[derive(Default)]
pub(crate) struct IgnoredStatements(Vec<(Vec<u8>, usize)>);

impl IgnoredStatements {
    /// Records a keyword once; returns an error message if there are too many.
    pub fn add(&mut self, line: usize, key: &[u8]) -> Result<(), Message> {
        let key = &key[..key.len().min(40)];
        if self.0.iter().any(|(known, _)| known == key) {
            return Ok(());
        }
        if self.0.len() == MAX_KEYWORDS {
            return Err(ErrorCode::WrongFormat.message(format!(
                "{} is unknown, as are {MAX_KEYWORDS} other keywords; this is probably not an OBJ file",
                lexer::for_message(key)
            )));
        }
        self.0.push((key.into(), line));
        Ok(())
    }

    /// Adds the keywords of a later piece; if there are too many, returns the line and the message.
    pub fn append(&mut self, later: Self) -> Result<(), (usize, Message)> {
        let mut later = later.0.into_iter();
        later.try_for_each(|(key, line)| self.add(line, &key).map_err(|message| (line, message)))
    }

    /// List of ignored keywords, if there are any.
    pub fn message(&self) -> Option<String> {
        let described: Vec<_> = (self.0.iter())
            .map(|(key, line)| {
                let what = match &key[..] {
                    b"p" => " (points)",
                    b"l" => " (lines)",
                    _ => "",
                };
                format!("{}{what} (line {line})", key.escape_ascii())
            })
            .collect();
        (!described.is_empty()).then(|| described.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_keywords_are_listed_once_with_their_first_line() {
        let mut ignored = IgnoredStatements::default();
        assert_eq!(ignored.message(), None);
        for (line, key) in [(3, "l"), (5, "l"), (7, "curv")] {
            ignored.add(line, key.as_bytes()).unwrap();
        }
        assert_eq!(ignored.message().unwrap(), "l (lines) (line 3), curv (line 7)");
    }
}
