//! How far it is from an empty cell to the nearest that is not: around it lies an empty cube that a ray may cross in one step, however it
//! lies to the hierarchy of cells. Source: Cohen & Sheffer 1994, "Proximity clouds"; distances are Chebyshev's, which make cubes, and are found
//! axis by axis as those of Saito & Toriwaki 1994 are.

use glam::IVec3;

use super::majorants::{CELLS, fine_slot};

/// Distances are known up to this one, in cells.
pub const FARTHEST: usize = 8;
/// Cells that are looked at on each side of a block.
const MARGIN: usize = FARTHEST - 1;
/// Cells along a block.
const EDGE: usize = 16;
const WIDE: usize = EDGE + 2 * MARGIN;

/// Of each cell of `block` (16³ cells, as [`fine_slot`] numbers them): 0 where it is not empty, else the distance to the nearest that is not, at most
/// [`FARTHEST`]. `is_empty` tells of a cell of any block, by its number.
pub fn measure(block: IVec3, is_empty: impl Fn(IVec3, usize) -> bool) -> [u8; CELLS] {
    let corner: IVec3 = block * EDGE as i32 - MARGIN as i32;
    let far = FARTHEST as u8;
    // Along z, of all rows that can matter.
    let mut along_z = vec![far; WIDE * WIDE * EDGE];
    let mut row = [far; WIDE];
    for x in 0..WIDE {
        for y in 0..WIDE {
            for (z, value) in row.iter_mut().enumerate() {
                let cell = corner + IVec3::new(x as i32, y as i32, z as i32);
                *value = if is_empty(cell >> 4i32, fine_slot(cell)) { far } else { 0 };
            }
            for z in 0..EDGE {
                along_z[(x * WIDE + y) * EDGE + z] = nearest(|i| row[z + i]);
            }
        }
    }
    let mut along_y = vec![far; WIDE * EDGE * EDGE];
    for x in 0..WIDE {
        for y in 0..EDGE {
            for z in 0..EDGE {
                along_y[(x * EDGE + y) * EDGE + z] = nearest(|i| along_z[(x * WIDE + y + i) * EDGE + z]);
            }
        }
    }
    let mut clear = [0; CELLS];
    for (slot, clear) in clear.iter_mut().enumerate() {
        let (x, rest) = (slot / (EDGE * EDGE), slot % (EDGE * EDGE));
        *clear = nearest(|i| along_y[(x + i) * EDGE * EDGE + rest]);
    }
    clear
}

/// The least of max(distance, value) over the cells on both sides of the middle one, whose number is [`MARGIN`].
fn nearest(value: impl Fn(usize) -> u8) -> u8 {
    let mut least = value(MARGIN);
    for distance in 1..=MARGIN {
        if usize::from(least) <= distance {
            break;
        }
        let beside = value(MARGIN - distance).min(value(MARGIN + distance));
        least = least.min(beside.max(distance as u8));
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::mix;

    #[test]
    fn distances_match_brute_force() {
        for rarity in [7, 300, 100_000] {
            let filled = |cell: IVec3| {
                let hashed = cell.to_array().iter().fold(rarity, |h, &c| mix(h ^ u64::from(c as u32)));
                hashed % rarity == 0
            };
            let block = IVec3::new(-1, 2, 0);
            let place = |block: IVec3, slot: usize| {
                block * 16 + IVec3::new(slot as i32 >> 8, slot as i32 >> 4 & 15, slot as i32 & 15)
            };
            let clear = measure(block, |block, slot| !filled(place(block, slot)));
            for slot in (0..CELLS).step_by(37) {
                let cell = place(block, slot);
                let within = |distance: i32| {
                    let side = 2 * distance + 1;
                    let mut all = (0..side.pow(3)).map(|i| IVec3::new(i / side / side, i / side % side, i % side));
                    all.any(|offset| filled(cell + offset - distance))
                };
                let expected = (0..FARTHEST as i32).find(|&distance| within(distance)).unwrap_or(FARTHEST as i32);
                assert_eq!(i32::from(clear[slot]), expected, "one in {rarity}, {cell}");
            }
        }
    }
}
