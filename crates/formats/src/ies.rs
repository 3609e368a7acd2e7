//! IES files: the luminous intensities of a luminaire (ANSI/IES LM-63-2019, and its editions of 1986, 1991, 1995 and
//! 2002), type C photometry.

use std::path::Path;

use raycam_scene::{ErrorCode, IesProfile, Message};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::io::InputFile;

/// Reads the profile in a file. Candela values are the values of the tested luminaire: multiplier and ballast factors
/// are applied.
///
/// # Errors
/// [`FormatError::Syntax`] with the line; [`FormatError::Unsupported`] for photometry other than type C and for a tilt
/// that changes the lamp's output; [`FormatError::Budget`].
pub(crate) fn read(source: &InputFile, budget: &mut Budget) -> Result<IesProfile> {
    let path = source.path.as_path();
    // Keywords may have any legacy encoding; the numbers are ASCII.
    let text = String::from_utf8_lossy(&source.bytes);
    let mut lines = text.lines().enumerate();
    let tilt = lines.by_ref().find_map(|(i, line)| Some((i + 1, line.trim().strip_prefix("TILT=")?.trim())));
    match tilt {
        Some((_, "NONE")) => {}
        Some((_, other)) => {
            return Err(FormatError::unsupported(
                path,
                format!(
                    "TILT={other}; expected TILT=NONE (a lamp whose output depends on its orientation is not \
                    supported)"
                ),
            ));
        }
        None => {
            return Err(FormatError::whole(
                path,
                ErrorCode::WrongFormat.message("the line TILT= is missing, so this is not an IES file"),
            ));
        }
    }
    let mut numbers = NumberReader {
        path,
        last: text.lines().count(),
        tokens: lines.flat_map(|(i, line)| {
            let tokens = line.split(|c: char| c.is_whitespace() || c == ',');
            tokens.filter(|token| !token.is_empty()).map(move |token| (i + 1, token))
        }),
    };
    numbers.next("the number of lamps")?;
    numbers.next("lumens per lamp")?;
    let multiplier = numbers.next("the candela multiplier")?;
    let verticals = numbers.count("the number of vertical angles")?;
    let horizontals = numbers.count("the number of horizontal angles")?;
    let kind = numbers.next("the photometric type")?;
    if kind != 1.0 {
        return Err(FormatError::unsupported(path, format!("photometric type {kind}; expected 1 (type C)")));
    }
    for what in ["units", "width", "length", "height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.next("the ballast factor")?;
    let photometric = numbers.next("the ballast-lamp photometric factor")?;
    numbers.next("the input watts")?;
    let count = verticals.saturating_mul(horizontals);
    budget.take_elements(path, count.saturating_add(verticals).saturating_add(horizontals))?;
    // The file must contain at least one byte per value.
    if count > source.bytes.len() as u64 {
        let message = format!("{horizontals} x {verticals} intensities are declared, more than the file can contain");
        return Err(FormatError::whole(path, ErrorCode::ImplausibleSize.message(message)));
    }
    let vertical = numbers.list(verticals, "a vertical angle")?;
    let horizontal = numbers.list(horizontals, "a horizontal angle")?;
    let factor = multiplier * ballast * photometric;
    let candela = numbers.list(count, "an intensity")?;
    let profile = IesProfile { vertical, horizontal, candela: candela.iter().map(|v| (v * factor) as f32).collect() };
    profile.validate().map_err(|error| FormatError::whole(path, Message::from(error)))?;
    Ok(profile)
}

/// Numbers of a file, one after the other, independent of line ends.
struct NumberReader<'a, I> {
    path: &'a Path,
    last: usize,
    tokens: I,
}

impl<'a, I: Iterator<Item = (usize, &'a str)>> NumberReader<'a, I> {
    fn next(&mut self, what: &str) -> Result<f64> {
        let Some((line, token)) = self.tokens.next() else {
            return Err(FormatError::line(
                self.path,
                self.last,
                ErrorCode::TruncatedFile.message(format!("unexpected end of file; expected {what}")),
            ));
        };
        match token.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(FormatError::line(
                self.path,
                line,
                ErrorCode::WrongType.message(format!("{token:?}; expected {what}")),
            )),
        }
    }

    fn count(&mut self, what: &str) -> Result<u64> {
        let value = self.next(what)?;
        if value.fract() == 0.0 && (1.0..=1e9).contains(&value) {
            return Ok(value as u64);
        }
        let message = format!("{what} is {value}; expected a whole number from 1 to 1e9");
        Err(FormatError::whole(self.path, ErrorCode::OutOfRange.message(message)))
    }

    fn list(&mut self, count: u64, what: &str) -> Result<Vec<f64>> {
        (0..count).map(|_| self.next(what)).collect()
    }
}
