//! The statements of an OBJ file that are passed over, so that a notice can name them.

use crate::text;

/// The most keywords that are remembered; a file with more is something else than OBJ.
const LIMIT: usize = 32;

/// Keywords with their first lines.
#[derive(Default)]
pub(crate) struct Skipped(Vec<(Vec<u8>, usize)>);

impl Skipped {
    /// Remembers a keyword once; the message of an error when there are too many.
    pub fn add(&mut self, line: usize, key: &[u8]) -> Result<(), String> {
        let key = &key[..key.len().min(40)];
        if self.0.iter().any(|(known, _)| known == key) {
            return Ok(());
        }
        if self.0.len() == LIMIT {
            return Err(format!(
                "{}: the {}rd unknown keyword; is this an OBJ file?",
                text::shown(key),
                LIMIT + 1
            ));
        }
        self.0.push((key.into(), line));
        Ok(())
    }

    /// What was passed over, if anything was. With normals, smoothing groups have nothing to add.
    pub fn described(&self, has_normals: bool) -> Option<String> {
        let described: Vec<_> = self
            .0
            .iter()
            .filter(|(key, _)| !(has_normals && key == b"s"))
            .map(|(key, line)| {
                let what = match &key[..] {
                    b"p" => " (points)",
                    b"l" => " (lines)",
                    b"s" => " (smoothing groups; only vn makes it smooth)",
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
    fn a_keyword_is_named_once_with_its_first_line() {
        let mut skipped = Skipped::default();
        assert_eq!(skipped.described(false), None);
        for (line, key) in [(3, "l"), (5, "l"), (7, "s")] {
            skipped.add(line, key.as_bytes()).unwrap();
        }
        assert_eq!(skipped.described(true).unwrap(), "l (lines) (line 3)");
        assert!(skipped.described(false).unwrap().ends_with("(line 7)"));
    }
}
