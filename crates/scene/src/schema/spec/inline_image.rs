//! Images written as rows of texels, and NumPy arrays.

use std::sync::Arc;

use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess};

use crate::schema::spec::texture::ImageSpec;
use crate::texture::{Image, Texels};
use crate::written::{written, written_schema};

/// One number of a texel.
#[derive(Clone, Copy)]
enum TexelNumber {
    Byte(u8),
    Linear(f32),
}

/// A texel of one to four numbers: grey; grey and alpha; red, green and blue; or red, green, blue and alpha.
struct Texel {
    numbers: [TexelNumber; 4],
    count: usize,
}

struct TexelRow(Vec<Texel>);

written! {
    ImageSpec: "an image file, or rows of texels",

    fn visit_str<E: Error>(self, file: &str) -> Result<ImageSpec, E> {
        Ok(ImageSpec::File(file.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<ImageSpec, A::Error> {
        let mut rows: Vec<TexelRow> = Vec::new();
        while let Some(row) = seq.next_element()? {
            rows.push(row);
        }
        image(rows).map(|image| ImageSpec::Texels(Arc::new(image)))
    }
}

fn image<E: Error>(rows: Vec<TexelRow>) -> Result<Image, E> {
    let [width, height] = [rows.first().map_or(0, |row| row.0.len()), rows.len()];
    if let Some((y, row)) = rows.iter().enumerate().find(|(_, row)| row.0.len() != width) {
        let given = row.0.len();
        return Err(E::custom(format_args!(
            "row {y} has {given} texels, the first row has {width}; expected equal \
            lengths"
        )));
    }
    if width == 0 || width > 65_536 || height > 65_536 {
        return Err(E::custom(format_args!("{width} x {height} texels; expected 1 to 65536 columns and rows")));
    }
    let texels = || rows.iter().flat_map(|row| &row.0);
    let bytes = texels().all(|texel| {
        let numbers = &texel.numbers[..texel.count];
        numbers.iter().all(|n| matches!(n, TexelNumber::Byte(_)))
    });
    let texels = if bytes {
        Texels::Srgb8(
            texels()
                .map(|texel| {
                    texel.spread(255, |n| match n {
                        TexelNumber::Byte(v) => v,
                        TexelNumber::Linear(v) => v as u8,
                    })
                })
                .collect(),
        )
    } else {
        Texels::Float(
            texels()
                .map(|texel| {
                    texel.spread(1.0, |n| match n {
                        TexelNumber::Byte(v) => f32::from(v),
                        TexelNumber::Linear(v) => v,
                    })
                })
                .collect(),
        )
    };
    Ok(Image::new("", [width as u32, height as u32], texels))
}

impl Texel {
    /// Returns red, green, blue and alpha; missing alpha becomes `opaque`.
    fn spread<T: Copy>(&self, opaque: T, of: impl Fn(TexelNumber) -> T) -> [T; 4] {
        let [a, b, c, d] = self.numbers.map(of);
        match self.count {
            1 => [a, a, a, opaque],
            2 => [a, a, a, b],
            3 => [a, b, c, opaque],
            _ => [a, b, c, d],
        }
    }
}

impl<'de> Deserialize<'de> for TexelRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(Self)
    }
}

written! {
    TexelNumber: "a whole number from 0 to 255, or a linear value with a decimal point",

    fn visit_i64<E: Error>(self, v: i64) -> Result<TexelNumber, E> {
        u8::try_from(v)
            .map(TexelNumber::Byte)
            .map_err(|_| E::invalid_value(serde::de::Unexpected::Signed(v), &self))
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<TexelNumber, E> {
        Ok(TexelNumber::Linear(v as f32))
    }
}

written! {
    Texel: "a number (whole numbers 0 to 255), or a list of 1 to 4 numbers: grey, grey and alpha, RGB or RGBA",

    fn visit_i64<E: Error>(self, v: i64) -> Result<Texel, E> {
        let number = u8::try_from(v).map_err(|_| E::invalid_value(serde::de::Unexpected::Signed(v), &self))?;
        Ok(Texel { numbers: [TexelNumber::Byte(number); 4], count: 1 })
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<Texel, E> {
        Ok(Texel { numbers: [TexelNumber::Linear(v as f32); 4], count: 1 })
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Texel, A::Error> {
        let mut texel = Texel { numbers: [TexelNumber::Byte(0); 4], count: 0 };
        while let Some(number) = seq.next_element()? {
            let Some(place) = texel.numbers.get_mut(texel.count) else {
                return Err(A::Error::invalid_length(texel.count + 1, &self));
            };
            *place = number;
            texel.count += 1;
        }
        if texel.count == 0 {
            return Err(A::Error::invalid_length(0, &self));
        }
        Ok(texel)
    }
}

written_schema!(ImageSpec, "Image", |_| {
    let texel = schemars::json_schema!({ "anyOf": [
        { "type": "number" },
        { "type": "array", "items": { "type": "number" }, "minItems": 1, "maxItems": 4 },
    ] });
    schemars::json_schema!({ "anyOf": [
        { "type": "string" },
        { "type": "array", "items": { "type": "array", "items": texel, "minItems": 1 }, "minItems": 1 },
    ] })
});
