//! What is in an OpenEXR file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::film::PixelBounds;
use crate::film::exr::read_exr_layers;
use crate::film::image::ImageError;

/// An OpenEXR file in numbers.
#[derive(Clone, Debug, Serialize)]
pub struct ExrInfo {
    /// Full image (display window).
    pub display: PixelBounds,
    /// Pixels that are there (data window).
    pub bounds: PixelBounds,
    /// Each channel, in the file's order.
    pub channels: Vec<ChannelInfo>,
    /// Text attributes of the header.
    pub attributes: BTreeMap<String, String>,
}

/// A channel in numbers.
#[derive(Clone, Debug, Serialize)]
pub struct ChannelInfo {
    /// Its name with its layer: `direct.R`.
    pub name: String,
    /// Smallest finite value; 0 where none is finite.
    pub min: f32,
    /// Mean of the finite values.
    pub mean: f64,
    /// Largest finite value; 0 where none is finite.
    pub max: f32,
    /// Values that are NaN or infinite.
    pub not_finite: usize,
}

/// Reads a whole OpenEXR file and sums it up.
pub fn info_exr(path: &Path) -> Result<ExrInfo, ImageError> {
    let image = read_exr_layers(path)?;
    let describe = |(name, values): &(String, Vec<f32>)| {
        let (mut min, mut max, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0f64, 0usize);
        for &value in values.iter().filter(|v| v.is_finite()) {
            (min, max) = (min.min(value), max.max(value));
            sum += f64::from(value);
            count += 1;
        }
        if count == 0 {
            (min, max) = (0.0, 0.0);
        }
        let mean = sum / count.max(1) as f64;
        ChannelInfo { name: name.clone(), min, mean, max, not_finite: values.len() - count }
    };
    Ok(ExrInfo {
        display: image.display,
        bounds: image.bounds,
        channels: image.channels.iter().map(describe).collect(),
        attributes: image.attributes.iter().cloned().collect(),
    })
}

impl fmt::Display for ExrInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "OpenEXR image, {} × {} pixels", self.display.width(), self.display.height())?;
        if self.bounds != self.display {
            let PixelBounds { x0, y0, x1, y1 } = self.bounds;
            writeln!(f, "crop: columns {x0}..{x1}, rows {y0}..{y1}")?;
        }
        writeln!(f, "{:<20} {:>12} {:>12} {:>12}", "channel", "min", "mean", "max")?;
        for c in &self.channels {
            write!(f, "{:<20} {:>12.5} {:>12.5} {:>12.5}", c.name, c.min, c.mean, c.max)?;
            writeln!(f, "{}", if c.not_finite > 0 { format!("  {} not finite", c.not_finite) } else { String::new() })?;
        }
        self.attributes.iter().try_for_each(|(name, value)| writeln!(f, "{name}: {value}"))
    }
}
