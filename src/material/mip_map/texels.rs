//! Texels in memory: as bytes, halves or floats, whichever loses nothing, and what they stand for.

use half::f16;
use half::slice::HalfFloatSliceExt;

use crate::film::image::{Encoding, to_byte};
use crate::film::stored_image::{StoredImage, Values, from_byte};

/// A run of texels, channel after channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// Encoded: 255 stands for 1.
    Bytes(Box<[u8]>),
    /// Linear.
    Halves(Box<[f16]>),
    /// Linear.
    Floats(Box<[f32]>),
}

/// How values are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// In one byte, encoded.
    Bytes,
    /// In two.
    Halves,
    /// In four.
    Floats,
}

impl Kind {
    /// Bytes of one value.
    pub const fn size(self) -> usize {
        match self {
            Self::Bytes => 1,
            Self::Halves => 2,
            Self::Floats => 4,
        }
    }
}

/// How texels are read.
#[derive(Clone, Debug)]
pub struct Format {
    /// 1 (grey), 3 (RGB) or 4 (RGBA).
    pub channels: usize,
    /// How each value is held.
    pub kind: Kind,
    /// The linear value of each byte; alpha is linear anyway.
    linear: Box<[f32; 256]>,
    /// From linear values back, where bytes are encoded.
    nearest: Option<Box<NearestByte>>,
}

/// Finds the byte that comes nearest to a linear value, without the encoding's powers.
#[derive(Clone, Debug)]
struct NearestByte {
    /// Where one byte ends to be the nearest and the next begins.
    ends: [f32; 255],
    /// The first that may be the nearest, by equal steps of the linear value.
    first: [u8; STEPS],
}

/// Steps of [`NearestByte`].
const STEPS: usize = 1024;

impl NearestByte {
    fn new(encoding: Encoding) -> Self {
        let ends = std::array::from_fn(|byte| encoding.to_linear((byte as f32 + 0.5) / 255.0));
        let first = std::array::from_fn(|step| {
            let value = step as f32 / STEPS as f32;
            ends.iter().take_while(|&&end| end <= value).count() as u8
        });
        Self { ends, first }
    }

    #[inline]
    fn of(&self, linear: f32) -> u8 {
        let step = (linear.clamp(0.0, 1.0) * STEPS as f32) as usize;
        let mut byte = usize::from(self.first[step.min(STEPS - 1)]);
        while byte < 255 && linear >= self.ends[byte] {
            byte += 1;
        }
        byte as u8
    }
}

impl Format {
    /// Texels of that many channels, held so, and where they are bytes encoded so.
    pub fn new(channels: usize, kind: Kind, encoding: Encoding) -> Self {
        let mut linear = Box::new([0.0; 256]);
        for (byte, linear) in (0..=u8::MAX).zip(linear.iter_mut()) {
            *linear = encoding.to_linear(from_byte(byte));
        }
        let is_encoded = kind == Kind::Bytes && encoding != Encoding::Linear;
        let nearest = is_encoded.then(|| Box::new(NearestByte::new(encoding)));
        Self { channels, kind, linear, nearest }
    }

    /// Bytes of one texel.
    pub fn texel_bytes(&self) -> usize {
        self.channels * self.kind.size()
    }

    /// The linear value of a byte in the given channel.
    #[inline]
    fn linear_of(&self, byte: u8, channel: usize) -> f32 {
        if channel == 3 { from_byte(byte) } else { self.linear[usize::from(byte)] }
    }

    /// The nearest byte to a linear value.
    fn to_byte(&self, linear: f32, channel: usize) -> u8 {
        match &self.nearest {
            Some(nearest) if channel < 3 => nearest.of(linear),
            _ => to_byte(linear),
        }
    }
}

impl Texels {
    /// The texels of an image row by row, and how to read them.
    pub fn of(image: StoredImage, encoding: Encoding) -> (Self, Format) {
        let (channels, of_bytes) = (image.channels, image.encoding(encoding));
        let rows = Self::in_kind(image, encoding, None);
        let (kind, encoding) = match rows {
            Self::Bytes(_) => (Kind::Bytes, of_bytes),
            Self::Halves(_) => (Kind::Halves, Encoding::Linear),
            Self::Floats(_) => (Kind::Floats, Encoding::Linear),
        };
        (rows, Format::new(channels, kind, encoding))
    }

    /// The texels of an image row by row. Floats are held as `kind` says, else as halves where that loses nothing.
    pub fn in_kind(image: StoredImage, encoding: Encoding, kind: Option<Kind>) -> Self {
        let encoding = image.encoding(encoding);
        match image.values {
            Values::Bytes(bytes) => Self::Bytes(bytes.into()),
            Values::Floats(mut floats) => {
                crate::film::stored_image::decode(&mut floats, image.channels, encoding);
                let fits = |&value: &f32| f16::from_f32(value).to_f32() == value;
                if kind.map_or_else(|| floats.iter().all(fits), |kind| kind == Kind::Halves) {
                    let mut halves = vec![f16::ZERO; floats.len()];
                    halves.convert_from_f32_slice(&floats);
                    Self::Halves(halves.into())
                } else {
                    Self::Floats(floats.into())
                }
            }
        }
    }

    /// As many values as that, all 0.
    pub fn zeroed(kind: Kind, values: usize) -> Self {
        match kind {
            Kind::Bytes => Self::Bytes(vec![0; values].into()),
            Kind::Halves => Self::Halves(vec![f16::ZERO; values].into()),
            Kind::Floats => Self::Floats(vec![0.0; values].into()),
        }
    }

    /// The linear values of the texel of that number, and 0 for channels that there are not.
    #[inline]
    pub fn get(&self, texel: usize, format: &Format) -> [f32; 4] {
        let mut values = [0.0; 4];
        let range = texel * format.channels..(texel + 1) * format.channels;
        match self {
            Self::Bytes(bytes) => {
                for (channel, (value, &byte)) in values.iter_mut().zip(&bytes[range]).enumerate() {
                    *value = format.linear_of(byte, channel);
                }
            }
            Self::Halves(halves) => {
                for (value, half) in values.iter_mut().zip(&halves[range]) {
                    *value = half.to_f32();
                }
            }
            Self::Floats(floats) => {
                for (value, &float) in values.iter_mut().zip(&floats[range]) {
                    *value = float;
                }
            }
        }
        values
    }

    /// Sets the texel of that number to what comes nearest to linear `values`.
    pub fn set(&mut self, texel: usize, values: &[f32; 4], format: &Format) {
        let range = texel * format.channels..(texel + 1) * format.channels;
        match self {
            Self::Bytes(bytes) => {
                for (channel, (byte, &value)) in bytes[range].iter_mut().zip(values).enumerate() {
                    *byte = format.to_byte(value, channel);
                }
            }
            Self::Halves(halves) => {
                for (half, &value) in halves[range].iter_mut().zip(values) {
                    // A mean of halves is not beyond the largest of them.
                    *half = f16::from_f32(value);
                }
            }
            Self::Floats(floats) => floats[range].copy_from_slice(&values[..format.channels]),
        }
    }

    /// Everything as bytes in memory, in this machine's order.
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Halves(halves) => bytemuck::cast_slice(halves),
            Self::Floats(floats) => bytemuck::cast_slice(floats),
        }
    }

    /// The same, to be overwritten.
    pub fn as_bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Halves(halves) => bytemuck::cast_slice_mut(halves),
            Self::Floats(floats) => bytemuck::cast_slice_mut(floats),
        }
    }

    /// Makes what is not finite 0, and says how many values were not.
    pub fn mend(&mut self) -> usize {
        match self {
            Self::Bytes(_) => 0,
            Self::Halves(halves) => {
                halves.iter_mut().filter(|value| !value.is_finite()).map(|value| *value = f16::ZERO).count()
            }
            Self::Floats(floats) => {
                floats.iter_mut().filter(|value| !value.is_finite()).map(|value| *value = 0.0).count()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_and_what_lies_between_goes_to_the_nearest() {
        for encoding in [Encoding::Linear, Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Gamma(0.5)] {
            let format = Format::new(4, Kind::Bytes, encoding);
            for byte in 0..=u8::MAX {
                for channel in 0..4 {
                    assert_eq!(format.to_byte(format.linear_of(byte, channel), channel), byte, "{encoding:?}");
                }
                let between = |share: f32| encoding.to_linear((f32::from(byte) + share) / 255.0);
                if byte < u8::MAX {
                    let found = [0.45, 0.55].map(|share| format.to_byte(between(share), 0));
                    assert_eq!(found, [byte, byte + 1], "{encoding:?}");
                }
            }
            assert_eq!([-1.0, 2.0, f32::NAN].map(|value| format.to_byte(value, 0)), [0, 255, 0]);
        }
    }
}
