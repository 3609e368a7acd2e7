//! COLMAP's text files: `cameras.txt`, `images.txt` and, if they exist, `rigs.txt` and `frames.txt`. Each line is a
//! record.

use std::path::Path;
use std::str::{FromStr, Lines, SplitAsciiWhitespace};

use crate::colmap::records::{self, ModelFormat, RecordReader, RecordWriter};
use crate::document::number_format::yaml_float;
use crate::{Calibration, CameraRecord, OutputFiles, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};
use raycam_scene::counted;

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    source.path.file_name().is_some_and(|name| Text::NAMES.iter().any(|known| name == *known))
        && !["{", "# kapture format"].iter().any(|other| text.trim_start().starts_with(other))
        && text.lines().find(|line| !line.starts_with('#')).is_none_or(|line| line.split_whitespace().count() != 4)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    records::read::<Text>(source, assets)
}

pub(crate) fn write(cameras: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    records::write::<Text>(cameras)
}

struct Text;

impl ModelFormat for Text {
    const NAMES: [&'static str; 5] = ["cameras.txt", "images.txt", "rigs.txt", "frames.txt", "points3D.txt"];
    type Reader<'a> = LineTokens<'a>;
    type Writer = LineWriter;

    fn is_image_name(name: &str) -> bool {
        !name.contains(|c: char| c.is_whitespace() || c == '\0')
    }

    fn reader(file: &InputFile) -> Result<LineTokens<'_>> {
        Ok(LineTokens {
            path: &file.path,
            lines: file.text()?.lines().enumerate(),
            line: 0,
            text: "",
            words: "".split_ascii_whitespace(),
        })
    }
}

/// Reader of a text file: the words of the current line, and the lines after it.
pub(crate) struct LineTokens<'a> {
    path: &'a Path,
    lines: std::iter::Enumerate<Lines<'a>>,
    /// Line number, from 1.
    line: usize,
    text: &'a str,
    words: SplitAsciiWhitespace<'a>,
}

impl<'a> LineTokens<'a> {
    /// Moves to the next line that is not a comment; `None` at the end of the file.
    fn next_line(&mut self) -> Option<()> {
        let comment = |line: &str| line.trim_ascii_start().starts_with('#');
        let (i, line) = self.lines.find(|(_, line)| !comment(line))?;
        self.line = i + 1;
        self.text = line;
        self.words = line.split_ascii_whitespace();
        Some(())
    }

    fn is_empty(&self) -> bool {
        self.words.clone().next().is_none()
    }

    fn word(&mut self, field: &str) -> Result<&'a str> {
        self.words.next().ok_or_else(|| self.fail(format!("{field} is missing")))
    }

    fn parse<T: FromStr>(&mut self, field: &str) -> Result<T> {
        let word = self.word(field)?;
        word.parse().map_err(|_| self.fail(format!("invalid {field} {word:?}; expected a number")))
    }
}

impl RecordReader for LineTokens<'_> {
    fn records<T>(&mut self, mut read: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>> {
        let mut records = Vec::new();
        while self.next_line().is_some() {
            if !self.is_empty() {
                records.push(read(self)?);
            }
        }
        Ok(records)
    }

    fn fail(&self, message: String) -> FormatError {
        FormatError::line(self.path, self.line, message)
    }

    fn u32(&mut self, field: &str) -> Result<u32> {
        self.parse(field)
    }

    fn size(&mut self, field: &str, _: &str) -> Result<u32> {
        self.parse(field)
    }

    fn f64(&mut self, field: &str) -> Result<f64> {
        self.parse(field)
    }

    fn flag(&mut self, field: &str) -> Result<bool> {
        Ok(self.parse::<u8>(field)? != 0)
    }

    fn is_camera(&mut self) -> Result<bool> {
        Ok(self.word("SENSOR_TYPE")? == "CAMERA")
    }

    fn camera_model(&mut self, _: u32) -> Result<String> {
        Ok(self.word("MODEL")?.to_owned())
    }

    fn camera_params(&mut self, _: &str) -> Result<Vec<f64>> {
        let mut params = Vec::new();
        while let Some(word) = self.words.next() {
            let param = word.parse();
            params.push(param.map_err(|_| self.fail(format!("{word:?} is not a number")))?);
        }
        Ok(params)
    }

    /// Reads an image's name: the last field of a line, which may contain spaces.
    fn image_name(&mut self) -> Result<String> {
        let first = self.word("NAME")?;
        let start = first.as_ptr().addr() - self.text.as_ptr().addr();
        let name = self.text[start..].trim();
        self.words = "".split_ascii_whitespace();
        Ok(name.to_owned())
    }

    fn end_record(&mut self) -> Result<()> {
        match self.words.next() {
            Some(word) => Err(self.fail(format!("unexpected {word:?} at the end of the line"))),
            None => Ok(()),
        }
    }

    /// Skips the line of points, which may be empty, and may be missing at the end of a file without a final newline.
    fn skip_points2d(&mut self) -> Result<()> {
        if self.next_line().is_none() {
            return Ok(());
        }
        let is_image = self.words.clone().nth(9).is_some_and(|name| name.parse::<f64>().is_err());
        if is_image || !self.words.clone().count().is_multiple_of(3) {
            let count = self.words.clone().count();
            let mut message = format!("{}; expected X Y POINT3D_ID, three numbers per point", counted(count, "value"));
            if is_image {
                message.push_str(
                    " (the line may be empty); this is the line of the next image, so the points line of \
                    the previous image is missing",
                );
            }
            return Err(self.fail(message));
        }
        Ok(())
    }
}

/// Writer of a text file with one record per line and spaces between the fields.
pub(crate) struct LineWriter(String);

impl LineWriter {
    fn field(&mut self, field: &str) {
        if !self.0.ends_with('\n') {
            self.0.push(' ');
        }
        self.0.push_str(field);
    }
}

impl RecordWriter for LineWriter {
    fn new(head: &str, _: usize) -> Self {
        Self(head.to_owned())
    }

    fn u32(&mut self, value: u32) {
        self.field(&value.to_string());
    }

    fn size(&mut self, value: u32) {
        self.field(&value.to_string());
    }

    fn f64s(&mut self, values: &[f64]) {
        for &value in values {
            self.field(&yaml_float(value));
        }
    }

    fn flag(&mut self) {
        self.field("1");
    }

    fn camera_sensor(&mut self, id: u32) {
        self.field("CAMERA");
        self.u32(id);
    }

    fn camera_model(&mut self, name: &str) {
        self.field(name);
    }

    fn image_name(&mut self, name: &str) {
        self.field(name);
    }

    fn end_record(&mut self) {
        self.0.push('\n');
    }

    fn no_points2d(&mut self) {
        self.0.push('\n');
    }

    fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}
