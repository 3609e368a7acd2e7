//! Text files with one row of numbers per line.

use std::path::Path;

use raycam_formats::{FormatError, Result};
use raycam_scene::counted;

/// Lines that are neither empty nor comments (`#`, `%`, `//`), with their line numbers from 1. Comments after numbers are
/// removed.
pub(crate) fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.trim_start_matches('\u{feff}');
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, without_comment(line.trim())));
    numbered.filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%']) && !line.starts_with("//"))
}

/// Returns a row of numbers without the comment after them, as in `0.5 1 2 3 # first`; other lines are returned unchanged.
pub(crate) fn without_comment(line: &str) -> &str {
    let Some((numbers, _)) = line.split_once('#') else { return line };
    let mut words = numbers.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty()).peekable();
    let has_numbers = words.peek().is_some() && words.all(|word| word.parse::<f64>().is_ok());
    if has_numbers { numbers.trim_end() } else { line }
}

/// Returns the first line whose numbers have decimal commas, as in `0,5 1,25 2,0`, with its line number: at least three
/// words, each with one comma between digits. Only the first data lines are examined.
pub(crate) fn line_with_decimal_commas(text: &str) -> Option<(usize, &str)> {
    const EXAMINED_LINES: usize = 4;
    let is_number = |word: &str| {
        let (whole, fraction) = word.split_once(',').unwrap_or(("", ""));
        let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
        digits(whole.trim_start_matches(['-', '+'])) && digits(fraction)
    };
    data_lines(text).take(EXAMINED_LINES).find(|(_, line)| {
        let words = line.split(|c: char| c.is_whitespace() || c == ';').filter(|word| !word.is_empty());
        words.clone().count() >= 3 && words.clone().all(is_number)
    })
}

/// Reads the `N` finite numbers of a line.
pub(crate) fn numbers<const N: usize>(path: &Path, line: usize, text: &str) -> Result<[f64; N]> {
    let mut values = Vec::with_capacity(N);
    for word in text.split_whitespace() {
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() && values.len() <= N => values.push(value),
            Ok(_) if values.len() > N => break,
            _ => return Err(FormatError::line(path, line, format!("{word:?}; expected a finite number"))),
        }
    }
    let count = counted(values.len(), "number");
    values.try_into().map_err(|_| FormatError::line(path, line, format!("{count}; expected {N}")))
}

/// True if each of the first three data lines has `count` numbers.
pub(crate) fn looks_like(text: &str, count: usize) -> bool {
    let mut first = data_lines(text).take(3).peekable();
    first.peek().is_some()
        && first.all(|(_, line)| {
            let mut words = line.split_whitespace();
            words.clone().count() == count && words.all(|word| word.parse::<f64>().is_ok())
        })
}

/// True for a text with a line that contains a matrix of KITTI. OpenCV's reader would accept such a text by mistake.
pub(crate) fn has_kitti_matrix(text: &str) -> bool {
    let numbers = |values: &str, count: usize| {
        let mut words = values.split_whitespace();
        words.clone().count() == count && words.all(|word| word.parse::<f64>().is_ok())
    };
    let counts = [("P0:", 12), ("P2:", 12), ("P_rect_00:", 12), ("K_00:", 9)];
    data_lines(text).any(|(_, line)| {
        counts.iter().any(|&(key, count)| line.strip_prefix(key).is_some_and(|values| numbers(values, count)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comment_after_numbers_is_removed_and_other_lines_are_unchanged() {
        assert_eq!(without_comment("0.5 1, -2e3 # first"), "0.5 1, -2e3");
        assert_eq!(without_comment("1 2 3#x"), "1 2 3");
        for line in ["# 1 2", "1 a.png # b", "1 2 3", "frame#2 1 2"] {
            assert_eq!(without_comment(line), line);
        }
    }
}
