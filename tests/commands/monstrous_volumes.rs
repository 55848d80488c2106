//! Volumes that are valid and small as files, and hold more than could ever be filled in: each renders within two seconds of one processor and 1 GiB
//! of memory, or is refused with a message.

use crate::program::faults::*;
use crate::program::{Folder, HEAD};

/// A scene within a medium of type `kind` from `file`, with more parameters.
fn scene(kind: &str, file: &str, more: &str) -> String {
    format!(
        "{HEAD}LightSource \"infinite\"\nMakeNamedMedium \"m\" \"string type\" \"{kind}\" \"string filename\" \"{file}\" {more}\n\
         Material \"interface\"\nMediumInterface \"m\" \"\"\nShape \"sphere\" \"float radius\" 3\n"
    )
}

/// Files of NanoVDB's, made here: a root with tiles, not compressed.
mod nanovdb {
    use super::*;

    const TREE: usize = 672;
    const ROOT: usize = TREE + 64;
    const TABLE: usize = ROOT + 64;

    /// A file of one grid of floats with these tiles of 4096³ voxels, by their number along each axis, and `more` bytes at its end.
    fn file(tiles: &[([i32; 3], f32)], voxel: f64) -> Vec<u8> {
        let mut grid = vec![0u8; TABLE + 32 * tiles.len()];
        let mut put = |at: usize, bytes: &[u8]| grid[at..at + bytes.len()].copy_from_slice(bytes);
        let version = 32u32 << 21;
        put(0, b"NanoVDB0");
        put(16, &version.to_le_bytes());
        put(40, b"density\0");
        // The map in double precision: the matrix, and its inverse.
        for i in 0..3 {
            put(384 + 32 * i, &voxel.to_le_bytes());
            put(384 + 72 + 32 * i, &voxel.recip().to_le_bytes());
        }
        put(632, &2u32.to_le_bytes());
        put(636, &1u32.to_le_bytes());
        put(TREE + 24, &((ROOT - TREE) as i64).to_le_bytes());
        put(ROOT + 24, &(tiles.len() as u32).to_le_bytes());
        for (number, (place, value)) in tiles.iter().enumerate() {
            let at = TABLE + 32 * number;
            let part = |axis: usize| u64::from(place[axis] as u32 & 0x1f_ffff);
            put(at, &(part(0) << 42 | part(1) << 21 | part(2)).to_le_bytes());
            put(at + 16, &1u32.to_le_bytes());
            put(at + 20, &value.to_le_bytes());
        }
        let mut file = b"NanoVDB0".to_vec();
        file.extend(version.to_le_bytes());
        file.extend([1, 0, 0, 0]);
        let mut about = [0u8; 176];
        about[..8].copy_from_slice(&(grid.len() as u64).to_le_bytes());
        about[8..16].copy_from_slice(&(grid.len() as u64).to_le_bytes());
        about[136] = 8;
        file.extend(about);
        file.extend(b"density\0");
        file.extend(grid);
        file
    }

    #[test]
    fn monstrous_files() {
        let folder = Folder::new("monstrous-nvdb");
        let mut faults = Faults::default();
        let box_of = |n: i32, step: i32| -> Vec<([i32; 3], f32)> {
            let all = (0..n * n * n).map(|i| [i / n / n, i / n % n, i % n].map(|c| (c - n / 2) * step));
            all.enumerate().map(|(i, place)| (place, 0.01 + 0.001 * (i % 7) as f32)).collect()
        };
        for (what, tiles, voxel) in [
            ("5.5e11 voxels in 8 tiles", box_of(2, 1), 0.001),
            ("6.9e13 voxels in 1000 tiles", box_of(10, 1), 0.001),
            ("2.2e15 voxels in 32,768 tiles", box_of(32, 1), 1e-5),
            ("1000 tiles apart from each other", box_of(10, 3), 1e-5),
            ("32,768 tiles apart from each other", box_of(32, 2), 1e-5),
            ("tiles at all ends", box_of(2, 1 << 19), 1e-9),
            ("tiles at all ends, in huge voxels", box_of(2, 1 << 19), 1.0),
        ] {
            folder.write("a.nvdb", file(&tiles, voxel));
            for more in ["", "\"float scale\" 0.001 \"rgb sigma_s\" [1 1 1]"] {
                folder.write("scene.pbrt", scene("nanovdb", "a.nvdb", more));
                faults.render(&folder, what, Orderly);
            }
            println!("{what:<44} {}", faults.tally());
        }
        // An enormous number of bytes, promised.
        let mut lie = file(&box_of(1, 1), 1.0);
        lie[16..24].copy_from_slice(&(1u64 << 29).to_le_bytes());
        folder.write("a.nvdb", &lie);
        folder.write("scene.pbrt", scene("nanovdb", "a.nvdb", ""));
        faults.render(&folder, "half a gigabyte that is not there", Refused("a.nvdb"));
    }
}

#[cfg(feature = "openvdb")]
mod openvdb_files {
    use openvdb::{Compression, GridClass, Precision, Tile, VdbWriter};

    use super::*;

    fn tile(origin: [i32; 3], size: i32, value: f32) -> Tile {
        Tile { origin, size, value: [value; 3], active: true }
    }

    /// Tiles of `size`³ side by side in a cube of `count` along each edge, `step` sizes apart.
    fn cube(count: i32, size: i32, step: i32) -> Vec<Tile> {
        let all = (0..count * count * count).map(|i| [i / count / count, i / count % count, i % count]);
        all.enumerate()
            .map(|(i, place)| tile(place.map(|c| (c - count / 2) * size * step), size, 0.01 + 0.001 * (i % 7) as f32))
            .collect()
    }

    /// What the grid `name` is made of: a type, a voxel's edge, tiles, and leaves of ones.
    struct Grid {
        name: &'static str,
        vectors: bool,
        class: GridClass,
        voxel: f64,
        tiles: Vec<Tile>,
        leaves: Vec<[i32; 3]>,
    }

    fn fog(name: &'static str, voxel: f64, tiles: Vec<Tile>) -> Grid {
        Grid { name, vectors: false, class: GridClass::FogVolume, voxel, tiles, leaves: vec![] }
    }

    fn write(folder: &Folder, grids: Vec<Grid>) {
        let mut writer = VdbWriter::new().expect("a writer");
        for grid in grids {
            match grid.vectors {
                true => writer.vec3_grid(grid.name, Precision::Single, [0.0; 3], grid.voxel, [0.0; 3]),
                false => writer.scalar_grid(grid.name, grid.class, 0.0, grid.voxel, [0.0; 3]),
            }
            .expect("a grid");
            writer.tiles(&grid.tiles).expect("tiles");
            let numbers = vec![1.0; 512 * grid.leaves.len()];
            match grid.vectors {
                true => writer.vec3_leaves(&grid.leaves, &vec![[1.0; 3]; numbers.len()]),
                false => writer.leaves(&grid.leaves, &numbers),
            }
            .expect("leaves");
        }
        writer.write(&folder.path("a.vdb"), Compression::Zip).expect("a file");
    }

    #[test]
    fn monstrous_files() {
        let folder = Folder::new("monstrous-vdb");
        let mut faults = Faults::default();
        let small = || Grid { leaves: vec![[0; 3], [8, 0, 0]], ..fog("density", 0.125, vec![]) };
        let ends = || {
            let far = [i32::MIN, 0, i32::MAX - 7];
            (0..27).map(|i| [far[i / 9], far[i / 3 % 3], far[i % 3]].map(|c| c & !7)).collect::<Vec<_>>()
        };
        let glow = "\"string temperature\" \"temperature\" \"float temperaturescale\" 1e5";
        let flame = "\"string emission\" \"flame\" \"rgb Le\" [1 2 3]";
        let direct = "\"string emission\" \"flame\" \"rgb Le\" [1 2 3] \"bool emissiondirect\" true";
        let moves = "\"string velocity\" \"v\"";
        let vectors = |voxel: f64, tiles: Vec<Tile>| Grid { vectors: true, ..fog("v", voxel, tiles) };
        let colour = |voxel: f64, tiles: Vec<Tile>| Grid { vectors: true, ..fog("colour", voxel, tiles) };
        let cases: Vec<(&str, Vec<Grid>, &str)> = vec![
            ("5.5e11 voxels in 8 tiles", vec![fog("density", 0.001, cube(2, 4096, 1))], ""),
            ("6.9e13 voxels in 1000 tiles", vec![fog("density", 0.001, cube(10, 4096, 1))], ""),
            ("2.7e14 voxels in 4096 tiles apart", vec![fog("density", 1e-4, cube(16, 4096, 2))], ""),
            ("512³ voxels in tiles of 8", vec![fog("density", 0.01, cube(64, 8, 1))], ""),
            ("4096³ voxels in tiles of 128", vec![fog("density", 0.001, cube(32, 128, 1))], ""),
            ("voxels 2^32 apart", vec![Grid { leaves: ends(), ..fog("density", 2e-5, vec![]) }], ""),
            ("voxels 2^32 apart, huge", vec![Grid { leaves: ends(), ..fog("density", 1.0, vec![]) }], ""),
            (
                "a level set of 5.5e11 voxels",
                vec![Grid { class: GridClass::LevelSet, ..fog("density", 0.001, cube(2, 4096, 1)) }],
                "",
            ),
            ("5.5e11 temperatures", vec![small(), fog("temperature", 0.001, cube(2, 4096, 1))], glow),
            ("5.5e11 temperatures in huge voxels", vec![small(), fog("temperature", 1e6, cube(2, 4096, 1))], glow),
            ("5.5e11 temperatures in tiny voxels", vec![small(), fog("temperature", 2e-5, cube(2, 4096, 1))], glow),
            ("512³ temperatures in tiles of 8", vec![small(), fog("temperature", 0.01, cube(64, 8, 1))], glow),
            ("5.5e11 voxels of flame", vec![small(), fog("flame", 0.001, cube(2, 4096, 1))], flame),
            ("5.5e11 huge voxels of flame", vec![small(), fog("flame", 1e6, cube(2, 4096, 1))], flame),
            ("5.5e11 huge voxels of flame by itself", vec![small(), fog("flame", 1e3, cube(2, 4096, 1))], direct),
            ("512³ voxels of flame by itself", vec![small(), fog("flame", 0.01, cube(64, 8, 1))], direct),
            (
                "5.5e11 voxels, of flame too",
                vec![fog("density", 0.001, cube(2, 4096, 1)), fog("flame", 0.001, cube(2, 4096, 1))],
                flame,
            ),
            ("5.5e11 colours", vec![small(), colour(1.0, cube(2, 4096, 1))], "\"string color\" \"colour\""),
            ("5.5e11 velocities", vec![small(), vectors(0.001, cube(2, 4096, 1))], moves),
            ("5.5e11 velocities in huge voxels", vec![small(), vectors(1e6, cube(2, 4096, 1))], moves),
            ("512³ velocities in tiles of 8", vec![small(), vectors(0.01, cube(64, 8, 1))], moves),
            (
                "5.5e11 voxels that move",
                vec![fog("density", 0.001, cube(2, 4096, 1)), vectors(0.001, cube(2, 4096, 1))],
                moves,
            ),
        ];
        for (what, grids, more) in cases {
            write(&folder, grids);
            let bytes = folder.read("a.vdb").len();
            folder.write("scene.pbrt", scene("openvdb", "a.vdb", more));
            faults.render(&folder, what, Orderly);
            println!("{what:<44} {bytes:8} bytes: {}", faults.tally());
        }
    }
}
