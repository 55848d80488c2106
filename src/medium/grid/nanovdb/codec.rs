//! How grids are packed in files: as they are, by zlib, or by Blosc with LZ4.
//!
//! Source: for Blosc, the description of its format, version 1: chunks of a header of 16 bytes and the starts of its blocks, each of one stream or of one for
//! each byte of a value, which may be shuffled: all first bytes, then all second ones …

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::bytes::{Bytes, cut};

/// A grid of `size` bytes from what the file has of it.
pub(super) fn unpack(codec: u16, packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    match codec {
        0 => Ok(Bytes(packed).part(0, size)?.0.to_vec()),
        1 => zip(packed, size),
        2 => blosc(packed, size),
        other => Err(format!("it is compressed in a way (number {other}) that is not known")),
    }
}

fn zip(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let length = usize::try_from(Bytes(packed).u64(0)?).map_err(|_| cut())?;
    let stream = Bytes(packed).part(8, length)?;
    let mut grid = Vec::new();
    ZlibDecoder::new(stream.0).take(size as u64).read_to_end(&mut grid).map_err(|e| format!("{}: {e}", cut()))?;
    if grid.len() == size { Ok(grid) } else { Err(cut()) }
}

fn blosc(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let mut grid = Vec::new();
    let mut rest = Bytes(packed);
    while grid.len() < size {
        let length = usize::try_from(rest.u64(0)?).map_err(|_| cut())?;
        chunk(&rest.part(8, length)?, &mut grid, size)?;
        rest = Bytes(&rest.0[8 + length..]);
    }
    if grid.len() == size { Ok(grid) } else { Err(cut()) }
}

/// Flags of a chunk.
const SHUFFLED: u8 = 1;
const STORED: u8 = 2;
const BIT_SHUFFLED: u8 = 4;
const NOT_SPLIT: u8 = 0x10;
const LZ4: u8 = 1;
/// Streams are split only for values of up to so many bytes, and blocks of at least so many values.
const MOST_SPLITS: usize = 16;
const LEAST_VALUES: usize = 128;

fn chunk(chunk: &Bytes<'_>, grid: &mut Vec<u8>, most: usize) -> Result<(), String> {
    let header = chunk.part(0, 16)?;
    let (flags, width) = (header.0[2], usize::from(header.0[3]).max(1));
    let [length, block_size] = [header.u32(4)? as usize, header.u32(8)? as usize];
    if length == 0 || length > most.saturating_sub(grid.len()) {
        return Err(cut());
    }
    if flags & STORED != 0 {
        grid.extend_from_slice(chunk.part(16, length)?.0);
        return Ok(());
    }
    if flags >> 5 != LZ4 || flags & BIT_SHUFFLED != 0 || block_size == 0 {
        return Err("it is compressed by Blosc in a way other than with LZ4".to_owned());
    }
    for number in 0..length.div_ceil(block_size) {
        let size = block_size.min(length - number * block_size);
        let mut at = chunk.u32(16 + 4 * number)? as usize;
        let is_whole = size == block_size;
        let splits = flags & NOT_SPLIT == 0 && width <= MOST_SPLITS && block_size / width >= LEAST_VALUES && is_whole;
        let streams = if splits { width } else { 1 };
        let mut block = Vec::new();
        for _ in 0..streams {
            let packed = chunk.u32(at)? as usize;
            let part = chunk.part(at + 4, packed)?.0;
            let expected = size / streams;
            if packed == expected {
                block.extend_from_slice(part);
            } else {
                let plain = lz4_flex::block::decompress(part, expected).map_err(|e| format!("{}: {e}", cut()))?;
                block.extend_from_slice(&plain);
            }
            at += 4 + packed;
        }
        if block.len() != size {
            return Err(cut());
        }
        if flags & SHUFFLED != 0 && width > 1 {
            let values = size / width;
            grid.extend((0..values * width).map(|i| block[i % width * values + i / width]));
            // What is left over is not shuffled.
            grid.extend_from_slice(&block[values * width..]);
        } else {
            grid.extend_from_slice(&block);
        }
    }
    Ok(())
}
