//! OpenEXR files with any number of float channels, read and written whole.
//!
//! Layers follow the convention of OpenEXR's documentation ("The OpenEXR Image File Layout"): one part whose channel names
//! carry the layer before a dot (`direct.R`, `variance.G`); the beauty is `R`, `G`, `B` without one. The data window is the
//! crop, the display window the full image. Files appear whole or not at all.

use std::io::{BufReader, BufWriter, Cursor, Read, Seek};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, IntegerBounds, Text};
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, ImageAttributes, Layer, LayerAttributes, LineOrder,
    ReadChannels, ReadLayers, Vec2, WritableImage, read,
};

use super::PixelBounds;
use super::image::{ImageError, MAX_PIXELS};
use super::stored_image::check_expansion;
use crate::system::input::open_regular;
use crate::system::memory::available;
use crate::system::output::{OutputError, write_atomically};

/// No more floats than this are held for one file: 8 GiB.
const MAX_VALUES: usize = 1 << 31;

/// Named float channels over a rectangle of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelImage {
    /// The pixels that are there, in the coordinates of the full image (OpenEXR's data window).
    pub bounds: PixelBounds,
    /// The full image (OpenEXR's display window).
    pub display: PixelBounds,
    /// Name (`R`, `direct.R`, …) and `bounds.area()` values in rows from the top.
    pub channels: Vec<(String, Vec<f32>)>,
    /// Text attributes of the header, in the order of their names once read.
    pub attributes: Vec<(String, String)>,
}

impl ChannelImage {
    /// The values of the channel `name`.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    /// The three channels of a colour layer; the root layer for an empty name.
    pub fn rgb(&self, layer: &str) -> Option<[&[f32]; 3]> {
        let of = |c: &str| self.channel(&if layer.is_empty() { c.to_owned() } else { format!("{layer}.{c}") });
        Some([of("R")?, of("G")?, of("B")?])
    }

    /// The value of a text attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

fn refuse(path: &Path, reason: impl Into<String>) -> ImageError {
    ImageError::new(path, reason.into())
}

/// Writes `image` as 32-bit floats with ZIP compression. Takes it, so that its values are in memory only once.
pub fn write_exr(path: &Path, image: ChannelImage) -> Result<(), OutputError> {
    let bounds = image.bounds;
    if bounds.area() == 0 || image.channels.is_empty() {
        return Err(OutputError::new(path, "an OpenEXR file needs at least one pixel and one channel"));
    }
    let list = image
        .channels
        .into_iter()
        .map(|(name, values)| {
            assert_eq!(values.len(), bounds.area(), "channel {name} must cover the bounds");
            AnyChannel::new(text(&name), FlatSamples::F32(values))
        })
        .collect();
    let mut attributes = LayerAttributes {
        layer_position: Vec2(bounds.x0 as i32, bounds.y0 as i32),
        software_name: Some(text(concat!("lanternfish ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in &image.attributes {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        line_order: LineOrder::Increasing,
        blocks: exr::image::Blocks::ScanLines,
    };
    let layer =
        Layer::new((bounds.width() as usize, bounds.height() as usize), attributes, encoding, AnyChannels::sort(list));
    let display = IntegerBounds::new(
        (image.display.x0 as i32, image.display.y0 as i32),
        (image.display.width() as usize, image.display.height() as usize),
    );
    let file = exr::image::Image::empty(ImageAttributes::new(display)).with_layer(layer);
    write_atomically(path, |out| {
        // The library seeks back to write its offset table.
        file.write().to_buffered(BufWriter::new(out)).map_err(|e| e.to_string())
    })
}

/// Text as OpenEXR stores it: bytes. Anything outside ASCII goes in as UTF-8, which viewers show.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn untext(value: &Text) -> String {
    String::from_utf8_lossy(value.bytes()).into_owned()
}

/// Reads all flat channels of an OpenEXR file as floats. Channels of the second and further parts get the part's name in
/// front; parts with another data window than the first and subsampled channels are left out.
pub fn read_exr_layers(path: &Path) -> Result<ChannelImage, ImageError> {
    let (file, length) = open_regular(path).map_err(|e| refuse(path, e.to_string()))?;
    read_exr_from(path, BufReader::new(file), length)
}

/// The text attributes of an OpenEXR file's header, without its pixels.
pub fn read_exr_attributes(path: &Path) -> Result<Vec<(String, String)>, ImageError> {
    let (file, _) = open_regular(path).map_err(|e| refuse(path, e.to_string()))?;
    let meta = MetaData::read_from_buffered(BufReader::new(file), false).map_err(|e| refuse(path, e.to_string()))?;
    let Some(first) = meta.headers.first() else { return Err(refuse(path, "the file holds no image")) };
    Ok(texts(first.shared_attributes.other.iter().chain(first.own_attributes.other.iter())))
}

/// Those of the attributes that are text, in the order of their names.
fn texts<'a>(attributes: impl Iterator<Item = (&'a Text, &'a AttributeValue)>) -> Vec<(String, String)> {
    let text = |(name, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(value) => Some((untext(name), untext(value))),
        _ => None,
    };
    let mut attributes: Vec<(String, String)> = attributes.filter_map(text).collect();
    attributes.sort();
    attributes.dedup_by(|a, b| a.0 == b.0);
    attributes
}

/// Reads an OpenEXR file that is already in memory; `path` is for messages.
pub fn read_exr_bytes(path: &Path, bytes: &[u8]) -> Result<ChannelImage, ImageError> {
    read_exr_from(path, Cursor::new(bytes), bytes.len() as u64)
}

fn read_exr_from(path: &Path, mut source: impl Read + Seek + Send, length: u64) -> Result<ChannelImage, ImageError> {
    let meta = MetaData::read_from_buffered(&mut source, false).map_err(|e| refuse(path, e.to_string()))?;
    source.rewind().map_err(|e| refuse(path, e.to_string()))?;
    let mut values = 0usize;
    // Those of the largest block: the library makes room for as many as a block says that it has, whether or not they are there.
    let mut in_block = 0usize;
    for header in &meta.headers {
        let (channels, block) = (header.channels.list.len(), header.max_block_pixel_size());
        let pixels = header.layer_size.width().saturating_mul(header.layer_size.height());
        values = values.saturating_add(pixels.saturating_mul(channels));
        in_block = in_block.max(block.width().saturating_mul(block.height()).saturating_mul(channels));
        if pixels > MAX_PIXELS || values > MAX_VALUES {
            return Err(refuse(path, format!("{pixels} pixels in {channels} channels are too many")));
        }
    }
    check_expansion(values.max(in_block), length).map_err(|reason| refuse(path, reason))?;
    // Once as the library decodes them and once as floats.
    let needed = values as u64 * 8;
    if available().is_some_and(|left| needed > left) {
        return Err(ImageError::limit(path, format!("its {values} values take more memory than is left")));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(source)
        .map_err(|e| refuse(path, e.to_string()))?;

    let Some(first) = image.layer_data.first() else { return Err(refuse(path, "the file holds no image")) };
    let bounds = rectangle(path, first.attributes.layer_position, first.size)?;
    let window = image.attributes.display_window;
    let display = rectangle(path, window.position, window.size)?;
    let mut channels = Vec::new();
    for (index, layer) in image.layer_data.iter().enumerate() {
        if rectangle(path, layer.attributes.layer_position, layer.size)? != bounds {
            continue;
        }
        let prefix = match &layer.attributes.layer_name {
            Some(name) if index > 0 => format!("{}.", untext(name)),
            _ => String::new(),
        };
        for channel in &layer.channel_data.list {
            if channel.sample_data.len() == bounds.area() {
                let name = format!("{prefix}{}", untext(&channel.name));
                channels.push((name, channel.sample_data.values_as_f32().collect()));
            }
        }
    }
    let shared = image.attributes.other.iter();
    let attributes = texts(shared.chain(first.attributes.other.iter()));
    Ok(ChannelImage { bounds, display, channels, attributes })
}

/// A window with its corner at or right of the origin; windows that begin at negative coordinates are moved there, because
/// nothing here depends on where a foreign image lies.
fn rectangle(path: &Path, position: Vec2<i32>, size: Vec2<usize>) -> Result<PixelBounds, ImageError> {
    let (x0, y0) = (position.x().max(0) as u32, position.y().max(0) as u32);
    let extent = |size: usize| u32::try_from(size).ok();
    match (extent(size.width()).and_then(|w| x0.checked_add(w)), extent(size.height()).and_then(|h| y0.checked_add(h)))
    {
        (Some(x1), Some(y1)) => Ok(PixelBounds { x0, y0, x1, y1 }),
        _ => Err(refuse(path, "the data window lies too far away")),
    }
}
