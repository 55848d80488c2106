//! Portable float maps. Source: Debevec's description of the format: `PF` (RGB) or `Pf` (grey), width, height and a scale
//! whose sign gives the byte order (negative: little-endian), each followed by one white space; then rows from the bottom.

use super::image::{Image, MAX_PIXELS};

/// Width and height, and the number of channels, that a portable float map's header states.
pub fn read_size(head: &[u8]) -> Result<([usize; 2], usize), String> {
    let (header, _) = Header::read(head)?;
    Ok(([header.width, header.height], header.channels))
}

/// Reads a portable float map. The scale's size is applied where it is not 1.
pub fn read_pfm(bytes: &[u8]) -> Result<Image, String> {
    let (Header { width, height, channels, scale }, rest) = Header::read(bytes)?;
    let pixels = width.checked_mul(height).filter(|&n| n <= MAX_PIXELS);
    let Some(pixels) = pixels else { return Err(format!("{width} × {height} pixels are too many")) };
    let wanted = pixels * channels * 4;
    if rest.len() < wanted {
        return Err(format!("the file is cut short: {} of {wanted} bytes of pixels", rest.len()));
    }
    let read = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        (if scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }) * scale.abs()
    };
    let row = width * channels * 4;
    let values = rest[..wanted].chunks_exact(row).rev().flat_map(|row| row.chunks_exact(4).map(read));
    Ok(Image { width, height, channels, pixels: values.collect() })
}

struct Header {
    width: usize,
    height: usize,
    channels: usize,
    scale: f32,
}

impl Header {
    /// The header and what follows it.
    fn read(bytes: &[u8]) -> Result<(Self, &[u8]), String> {
        let mut rest = bytes;
        let mut word = || -> Result<&str, String> {
            let end = rest.iter().take(64).position(u8::is_ascii_whitespace).ok_or("the PFM header is cut short")?;
            let word = std::str::from_utf8(&rest[..end]).map_err(|_| "the PFM header is not text")?;
            rest = &rest[end + 1..];
            Ok(word)
        };
        let channels = match word()? {
            "PF" => 3,
            "Pf" => 1,
            other => return Err(format!("{other} is not a PFM type")),
        };
        let mut extent = || -> Result<usize, String> {
            let word = word()?;
            word.parse().ok().filter(|&n| n > 0).ok_or(format!("\"{word}\" is not a PFM width or height"))
        };
        let (width, height) = (extent()?, extent()?);
        let scale_word = word()?;
        let scale: f32 = scale_word.parse().map_err(|_| format!("\"{scale_word}\" is not a PFM scale"))?;
        if scale == 0.0 || !scale.is_finite() {
            return Err(format!("\"{scale_word}\" is not a PFM scale"));
        }
        Ok((Self { width, height, channels, scale }, rest))
    }
}
