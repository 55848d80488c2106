//! Voxels as an OpenVDB tree stores them: leaves of 8³ values as stored (half stays half), tiles of one value never
//! filled in. Look-ups of single voxels and trilinear interpolation (samples lie at whole index positions).
//! Source: Museth 2013, "VDB: high-resolution sparse volumes with dynamic topology", for the shape of the data.

use glam::{DVec3, IVec3, Vec3};
use half::f16;

use super::blocks::{BLOCK_SHIFT, BlockMap, CoordMap, block_of};

/// Edge of a leaf in voxels.
pub const LEAF_EDGE: i32 = 8;
/// Values of a leaf, z fastest.
pub const LEAF_SIZE: usize = 512;
const LEAVES_PER_BLOCK: usize = 4096;
/// log2 of the edge of the largest tiles.
const ROOT_SHIFT: i32 = 12;

/// What a voxel may hold.
pub trait Voxel: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// What it is computed with.
    type Value: Copy
        + std::ops::Add<Output = Self::Value>
        + std::ops::Sub<Output = Self::Value>
        + std::ops::Mul<f32, Output = Self::Value>
        + PartialEq
        + Send
        + Sync
        + std::fmt::Debug;
    /// To it.
    fn get(self) -> Self::Value;
    /// Back again, as exactly as the storage allows.
    fn put(value: Self::Value) -> Self;
    /// The largest component.
    fn maximum(value: Self::Value) -> f32;
    /// Each component, with NaN, infinities and negative numbers replaced by 0; whether there were any.
    fn cleaned(self) -> (Self, bool);
}

fn clean_component(value: f32) -> (f32, bool) {
    if value.is_finite() && value >= 0.0 { (value, false) } else { (0.0, true) }
}

impl Voxel for f32 {
    type Value = f32;
    #[inline]
    fn get(self) -> f32 {
        self
    }
    fn put(value: f32) -> Self {
        value
    }
    fn maximum(value: f32) -> f32 {
        value
    }
    fn cleaned(self) -> (Self, bool) {
        clean_component(self)
    }
}

impl Voxel for f16 {
    type Value = f32;
    /// Exact for the non-negative finite numbers that grids hold after cleaning, and for those cheaper than a general
    /// conversion: shifted into place, the exponent is 112 too small; numbers below the normal range are counts of 2^-24.
    #[inline]
    fn get(self) -> f32 {
        let bits = u32::from(self.to_bits());
        let normal = f32::from_bits((bits << 13) + (112 << 23));
        let small = bits as f32 * (1.0 / 16_777_216.0);
        if bits < 0x400 { small } else { normal }
    }
    fn put(value: f32) -> Self {
        f16::from_f32(value)
    }
    fn maximum(value: f32) -> f32 {
        value
    }
    fn cleaned(self) -> (Self, bool) {
        let (value, bad) = clean_component(self.to_f32());
        (f16::from_f32(value), bad)
    }
}

impl Voxel for [f32; 3] {
    type Value = Vec3;
    #[inline]
    fn get(self) -> Vec3 {
        Vec3::from_array(self)
    }
    fn put(value: Vec3) -> Self {
        value.to_array()
    }
    fn maximum(value: Vec3) -> f32 {
        value.max_element()
    }
    fn cleaned(self) -> (Self, bool) {
        let parts = self.map(clean_component);
        (parts.map(|p| p.0), parts.iter().any(|p| p.1))
    }
}

/// A tile: a cube of one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileOf<V> {
    /// Low corner, a multiple of the edge.
    pub origin: IVec3,
    /// Edge in voxels: 8, 128 or 4096.
    pub edge: i32,
    /// The value.
    pub value: V,
}

/// Where a block's slot points to: a leaf, or a tile with the top bit set, or nothing.
const SLOT_NONE: u32 = u32::MAX;
const SLOT_TILE: u32 = 1 << 31;

/// A sparse grid.
#[derive(Debug)]
pub struct SparseGrid<V: Voxel> {
    background: V::Value,
    origins: Vec<IVec3>,
    values: Vec<[V; LEAF_SIZE]>,
    tiles: Vec<TileOf<V::Value>>,
    /// By block: a node, or a tile with the top bit set.
    blocks: BlockMap,
    nodes: Vec<Box<[u32; LEAVES_PER_BLOCK]>>,
    roots: CoordMap<u32>,
    /// Bounding box of leaves and tiles, inclusive.
    bounds: Option<(IVec3, IVec3)>,
    bad: u64,
}

impl<V: Voxel> SparseGrid<V> {
    /// A grid of leaves (512 values each, z fastest) and tiles. NaN, infinite and negative values become 0 and are counted.
    ///
    /// # Panics
    /// If there are not 512 values per leaf.
    pub fn new(background: V, origins: Vec<IVec3>, values: Vec<V>, tiles: Vec<TileOf<V>>) -> Self {
        assert_eq!(values.len(), origins.len() * LEAF_SIZE, "512 values per leaf");
        let mut bad = 0u64;
        let mut clean = |v: V| {
            let (v, was_bad) = v.cleaned();
            bad += u64::from(was_bad);
            v
        };
        let background = clean(background).get();
        let values: Vec<[V; LEAF_SIZE]> = values.as_chunks().0.iter().map(|leaf| leaf.map(&mut clean)).collect();
        let tiles: Vec<TileOf<V::Value>> =
            tiles.into_iter().map(|t| TileOf { origin: t.origin, edge: t.edge, value: clean(t.value).get() }).collect();
        let mut bounds: Option<(IVec3, IVec3)> = None;
        let boxes = origins.iter().map(|&o| (o, LEAF_EDGE)).chain(tiles.iter().map(|t| (t.origin, t.edge)));
        for (origin, edge) in boxes {
            let high = origin.saturating_add(IVec3::splat(edge - 1));
            let (a, b) = bounds.unwrap_or((origin, high));
            bounds = Some((a.min(origin), b.max(high)));
        }

        let mut nodes: Vec<Box<[u32; LEAVES_PER_BLOCK]>> = Vec::new();
        let mut of_block: CoordMap<u32> = CoordMap::default();
        let mut roots = CoordMap::default();
        let mut put = |of_block: &mut CoordMap<u32>, origin: IVec3, slot: u32| {
            let node = *of_block.entry(block_of(origin)).or_insert_with(|| {
                nodes.push(Box::new([SLOT_NONE; LEAVES_PER_BLOCK]));
                nodes.len() as u32 - 1
            });
            // A damaged file may put a leaf under a tile: the first one stays.
            if node & SLOT_TILE == 0 {
                nodes[node as usize][slot_of(origin)] = slot;
            }
        };
        for (number, tile) in tiles.iter().enumerate() {
            let code = number as u32 | SLOT_TILE;
            match tile.edge {
                LEAF_EDGE => put(&mut of_block, tile.origin, code),
                128 => {
                    of_block.entry(block_of(tile.origin)).or_insert(code);
                }
                _ => {
                    roots.insert(tile.origin >> ROOT_SHIFT, number as u32);
                }
            }
        }
        for (number, origin) in origins.iter().enumerate() {
            put(&mut of_block, *origin, number as u32);
        }
        let pairs: Vec<(IVec3, u32)> = of_block.into_iter().collect();
        Self { background, origins, values, tiles, blocks: BlockMap::new(&pairs), nodes, roots, bounds, bad }
    }

    /// The value where nothing is stored.
    pub fn background(&self) -> V::Value {
        self.background
    }

    /// Bounding box of what is stored, inclusive, in index space.
    pub fn bounds(&self) -> Option<(IVec3, IVec3)> {
        self.bounds
    }

    /// Values that were NaN, infinite or negative.
    pub fn bad_voxels(&self) -> u64 {
        self.bad
    }

    /// The leaves: low corner and values.
    pub fn leaves(&self) -> impl Iterator<Item = (IVec3, &[V; LEAF_SIZE])> {
        self.origins.iter().copied().zip(&self.values)
    }

    /// The tiles.
    pub fn tiles(&self) -> &[TileOf<V::Value>] {
        &self.tiles
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.values.len() * size_of::<[V; LEAF_SIZE]>()
            + self.origins.len() * size_of::<IVec3>()
            + self.tiles.len() * size_of::<TileOf<V::Value>>()
            + self.nodes.len() * LEAVES_PER_BLOCK * 4
            + self.blocks.memory()
            + self.roots.capacity() * 20
    }

    /// The smallest and the largest stored component (the largest of each voxel's components), the background aside.
    pub fn range(&self) -> Option<(f32, f32)> {
        let stored = self.values.iter().flatten().map(|v| V::maximum(v.get()));
        let all = stored.chain(self.tiles.iter().map(|t| V::maximum(t.value)));
        all.fold(None, |range, v| Some(range.map_or((v, v), |(low, high): (f32, f32)| (low.min(v), high.max(v)))))
    }

    /// An upper bound of every component of every value, the background's included.
    pub fn largest(&self) -> f32 {
        V::maximum(self.background).max(self.range().map_or(0.0, |r| r.1))
    }

    /// What holds the voxel `ijk` (absolute): a leaf's values, or the one value of a tile or the background.
    #[inline(always)]
    fn find(&self, ijk: IVec3) -> Result<&[V; LEAF_SIZE], V::Value> {
        let Some(code) = self.blocks.get(block_of(ijk)) else { return Err(self.outside_blocks(ijk)) };
        if code & SLOT_TILE != 0 {
            return Err(self.tiles[(code & !SLOT_TILE) as usize].value);
        }
        let slot = self.nodes[code as usize][slot_of(ijk)];
        if slot & SLOT_TILE == 0 {
            Ok(&self.values[slot as usize])
        } else if slot == SLOT_NONE {
            Err(self.outside_blocks(ijk))
        } else {
            Err(self.tiles[(slot & !SLOT_TILE) as usize].value)
        }
    }

    #[inline]
    fn outside_blocks(&self, ijk: IVec3) -> V::Value {
        if self.roots.is_empty() {
            return self.background;
        }
        self.roots.get(&(ijk >> ROOT_SHIFT)).map_or(self.background, |&tile| self.tiles[tile as usize].value)
    }

    /// The value of the voxel `ijk` of index space.
    #[inline]
    pub fn value(&self, ijk: IVec3) -> V::Value {
        match self.find(ijk) {
            Ok(leaf) => leaf[offset_of(ijk)].get(),
            Err(value) => value,
        }
    }

    /// Trilinear interpolation at `position` in index space: voxels' centres lie at whole numbers.
    #[inline]
    pub fn sample(&self, position: DVec3) -> V::Value {
        let (x, fx) = split(position.x);
        let (y, fy) = split(position.y);
        let (z, fz) = split(position.z);
        let (low, f) = (IVec3::new(x, y, z), Vec3::new(fx, fy, fz));
        let lerp = |a: V::Value, b: V::Value, t: f32| a + (b - a) * t;
        if (low & 7).cmpne(IVec3::splat(7)).all() {
            let leaf = match self.find(low) {
                Ok(leaf) => leaf,
                Err(value) => return value,
            };
            let o = offset_of(low);
            // The offset is below 512 − 73, as no coordinate within the leaf is 7.
            let corner: &[V; 74] = match leaf[o..].first_chunk() {
                Some(corner) => corner,
                None => return self.background,
            };
            let v = |i: usize| corner[i].get();
            let (x0y0, x0y1) = (lerp(v(0), v(1), f.z), lerp(v(8), v(9), f.z));
            let (x1y0, x1y1) = (lerp(v(64), v(65), f.z), lerp(v(72), v(73), f.z));
            return lerp(lerp(x0y0, x0y1, f.y), lerp(x1y0, x1y1, f.y), f.x);
        }
        self.sample_across(low, f)
    }

    /// Trilinear interpolation between voxels of different leaves. Corners, and leaves, are numbered by bits: 4 one up in x, 2 in y,
    /// 1 in z. Each leaf is looked for once: two where one face is crossed, as mostly.
    fn sample_across(&self, low: IVec3, f: Vec3) -> V::Value {
        let step = |bits: usize| IVec3::new((bits >> 2) as i32, (bits >> 1 & 1) as i32, (bits & 1) as i32);
        let at = low & (LEAF_EDGE - 1);
        let crossed = usize::from(at.x == 7) << 2 | usize::from(at.y == 7) << 1 | usize::from(at.z == 7);
        let mut leaves = [self.find(low); 8];
        for number in (1..8).filter(|number| number & crossed == *number) {
            leaves[number] = self.find(low.wrapping_add(step(number)));
        }
        let v = |corner: usize| match leaves[corner & crossed] {
            Ok(leaf) => leaf[offset_of(low.wrapping_add(step(corner)))].get(),
            Err(value) => value,
        };
        let lerp = |a: V::Value, b: V::Value, t: f32| a + (b - a) * t;
        let (x0y0, x0y1) = (lerp(v(0), v(1), f.z), lerp(v(2), v(3), f.z));
        let (x1y0, x1y1) = (lerp(v(4), v(5), f.z), lerp(v(6), v(7), f.z));
        lerp(lerp(x0y0, x0y1, f.y), lerp(x1y0, x1y1, f.y), f.x)
    }

    /// The same grid from a dense array of `size` values, x fastest, with index (0, 0, 0) first; 0 outside.
    pub fn from_dense(size: [u32; 3], value: impl Fn(usize) -> V, zero: V) -> Self {
        let [nx, ny, nz] = size.map(|n| n as usize);
        let mut origins = Vec::new();
        let mut values = Vec::new();
        let starts = |n: usize| (0..n).step_by(LEAF_EDGE as usize);
        for x0 in starts(nx) {
            for y0 in starts(ny) {
                for z0 in starts(nz) {
                    let mut leaf = [zero; LEAF_SIZE];
                    let mut stored = false;
                    for x in x0..(x0 + 8).min(nx) {
                        for y in y0..(y0 + 8).min(ny) {
                            for z in z0..(z0 + 8).min(nz) {
                                let v = value((z * ny + y) * nx + x);
                                stored |= v.get() != zero.get();
                                leaf[((x - x0) * 8 + (y - y0)) * 8 + (z - z0)] = v;
                            }
                        }
                    }
                    if stored {
                        origins.push(IVec3::new(x0 as i32, y0 as i32, z0 as i32));
                        values.extend_from_slice(&leaf);
                    }
                }
            }
        }
        Self::new(zero, origins, values, Vec::new())
    }
}

/// Whole part (rounded down, saturating) and rest in 0..=1 of a coordinate.
#[inline(always)]
fn split(x: f64) -> (i32, f32) {
    let truncated = x as i32;
    let whole = truncated.wrapping_sub(i32::from(x < f64::from(truncated)));
    (whole, ((x - f64::from(whole)) as f32).min(1.0))
}

/// Which of its block's 16³ leaves holds `ijk`.
#[inline(always)]
fn slot_of(ijk: IVec3) -> usize {
    let at: IVec3 = (ijk >> 3i32) & 15i32;
    ((at.x << 8) | (at.y << 4) | at.z) as usize
}

/// Which of its leaf's 8³ voxels `ijk` is.
#[inline(always)]
fn offset_of(ijk: IVec3) -> usize {
    let at = ijk & (LEAF_EDGE - 1);
    ((at.x << 6) | (at.y << 3) | at.z) as usize
}

/// log2 of a block's edge over that of a leaf.
const _: () = assert!(1usize << (3 * (BLOCK_SHIFT - 3)) == LEAVES_PER_BLOCK);
