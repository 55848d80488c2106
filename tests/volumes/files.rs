//! Volume files written and read back through the worker process; real files where there are any.

#![cfg(feature = "openvdb")]

use std::path::{Path, PathBuf};
use std::process::Command;

use openvdb::{
    Compression, GridClass, GridMap, GridValues, Limits, Precision, Tile, VdbError, VdbGrid, VdbWriter, read_vdb,
    set_worker,
};

fn read(path: &Path) -> Result<Vec<VdbGrid>, VdbError> {
    set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    read_vdb(path, &Limits::default())
}

fn ramp(x: i32, y: i32, z: i32) -> f32 {
    (x * 3 + y * 5 + z * 7).rem_euclid(41) as f32 * 0.125
}

fn writer() -> VdbWriter {
    set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    VdbWriter::new().expect("a writer")
}

fn write_fire(path: &Path, compression: Compression, precision: Precision) {
    let mut writer = writer();
    writer.fog_grid("density", precision, 0.0, 0.25, [1.0, 2.0, 3.0]).expect("a grid");
    writer.dense([-5, 3, 0], [20, 11, 17], 0.0, ramp).expect("voxels");
    writer.tiles(&[Tile { origin: [128, 0, -128], size: 128, value: [0.5, 0.0, 0.0], active: true }]).expect("a tile");
    writer.fog_grid("flame", precision, 0.0, 0.5, [0.0; 3]).expect("a grid");
    writer.dense([0, 0, 0], [8, 8, 8], 0.0, |x, y, z| (x + y + z) as f32).expect("voxels");
    writer.write(path, compression).expect("written");
}

fn value(grid: &VdbGrid, at: [i32; 3]) -> f32 {
    let origin = at.map(|c| c & !7);
    let Some(leaf) = grid.leaf_origins.iter().position(|o| *o == origin) else { return grid.header.background[0] };
    let offset = ((at[0] & 7) * 8 + (at[1] & 7)) * 8 + (at[2] & 7);
    match &grid.values {
        GridValues::F32(v) => v[leaf * 512 + offset as usize],
        GridValues::F16(v) => v[leaf * 512 + offset as usize].to_f32(),
        GridValues::Vec3(v) => v[leaf * 512 + offset as usize][0],
        GridValues::Absent => f32::NAN,
    }
}

#[test]
fn scalars_come_back_in_every_precision_and_compression() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fire.vdb");
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        for precision in [Precision::Half, Precision::Single, Precision::Double] {
            write_fire(&path, compression, precision);
            let grids = read(&path).expect("readable");
            assert_eq!(grids.iter().map(|g| g.header.name.as_str()).collect::<Vec<_>>(), ["density", "flame"]);
            let density = &grids[0];
            assert_eq!(density.header.class, GridClass::FogVolume);
            assert_eq!(matches!(density.values, GridValues::F16(_)), precision == Precision::Half);
            for x in -8..24 {
                for y in 0..16 {
                    for z in -1..20 {
                        let inside = (-5..15).contains(&x) && (3..14).contains(&y) && (0..17).contains(&z);
                        let wanted = if inside { ramp(x, y, z) } else { 0.0 };
                        assert_eq!(value(density, [x, y, z]), wanted, "{x} {y} {z} {compression:?} {precision:?}");
                    }
                }
            }
            assert_eq!(density.tiles.len(), 1);
            assert_eq!((density.tiles[0].size, density.tiles[0].value[0]), (128, 0.5));
            let GridMap::Affine(m) = density.header.map else { panic!("affine expected") };
            assert_eq!([m[0], m[5], m[10], m[12], m[13], m[14]], [0.25, 0.25, 0.25, 1.0, 2.0, 3.0]);
        }
    }
}

#[test]
fn vectors_repeated_names_frustums_and_level_sets_come_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("odd.vdb");
    let mut writer = writer();
    for (number, precision) in [Precision::Half, Precision::Single, Precision::Double].into_iter().enumerate() {
        writer.vec3_grid("Cd", precision, [0.0; 3], 1.0, [number as f64, 0.0, 0.0]).expect("a grid");
        let values: Vec<[f32; 3]> = (0..512).map(|i| [i as f32, 0.5, -1.0]).collect();
        writer.vec3_leaves(&[[8, 16, -24]], &values).expect("a leaf");
    }
    writer.frustum_grid("fog", [[0.0; 3], [32.0, 24.0, 16.0]], 0.5, 2.0, 3.0, [1.0, 0.0, 0.0]).expect("a grid");
    writer.dense([0, 0, 0], [32, 24, 16], 0.0, |_, _, _| 1.0).expect("voxels");
    writer.scalar_grid("surface", GridClass::LevelSet, 3.0, 1.0, [0.0; 3]).expect("a grid");
    let distance = |x: i32, y: i32, z: i32| {
        let r2 = (x * x + y * y + z * z) as f32;
        (r2.sqrt() - 10.0).clamp(-3.0, 3.0)
    };
    writer.dense([-16; 3], [32; 3], 3.0, distance).expect("voxels");
    writer.write(&path, Compression::Blosc).expect("written");
    let grids = read(&path).expect("readable");
    let names: Vec<(&str, u32)> = grids.iter().map(|g| (g.header.name.as_str(), g.header.index)).collect();
    assert_eq!(names, [("Cd", 0), ("Cd", 1), ("Cd", 2), ("fog", 0), ("surface", 0)]);
    for grid in &grids[..3] {
        let GridValues::Vec3(v) = &grid.values else { panic!("vectors expected") };
        assert_eq!((v.len(), v[300]), (512, [300.0, 0.5, -1.0]));
    }
    let GridMap::Frustum { max, taper, depth, .. } = grids[3].header.map else { panic!("a frustum expected") };
    assert_eq!((max, taper, depth), ([32.0, 24.0, 16.0], 0.5, 2.0));
    let surface = &grids[4];
    assert!(surface.header.was_level_set && surface.header.class == GridClass::LevelSet);
    assert_eq!(value(surface, [0, 0, 0]).max(surface.tiles.iter().map(|t| t.value[0]).fold(0.0, f32::max)), 1.0);
    assert!((value(surface, [9, 0, 0]) - 1.0 / 3.0).abs() < 1e-5, "one voxel below the surface of a band of three");
    assert_eq!(value(surface, [15, 0, 0]), 0.0);
}

#[test]
fn huge_tiles_stay_tiles() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("huge.vdb");
    let mut writer = writer();
    writer.fog_grid("density", Precision::Single, 0.0, 1.0, [0.0; 3]).expect("a grid");
    let tiles: Vec<Tile> =
        (0..8).map(|i| Tile { origin: [i * 4096, 0, 0], size: 4096, value: [1.0, 0.0, 0.0], active: true }).collect();
    writer.tiles(&tiles).expect("tiles");
    writer.write(&path, Compression::Zip).expect("written");
    let grids = read(&path).expect("readable");
    assert_eq!(grids[0].tiles.len(), 8);
    assert_eq!(grids[0].header.active_voxels, 8 << 36);
}

#[test]
fn what_is_no_vdb_file_is_said_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = folder.path().join("text.vdb");
    std::fs::write(&text, "not a volume").expect("written");
    assert!(matches!(read(&text), Err(VdbError::Damaged { .. })));
    assert!(matches!(read(&folder.path().join("absent.vdb")), Err(VdbError::Io { .. })));
    assert!(matches!(read(folder.path()), Err(VdbError::Io { .. } | VdbError::Damaged { .. })));
}

#[test]
fn the_worker_explains_itself_to_people() {
    for arguments in [&[][..], &["--help"], &["read", "1", "2"], &["write", "a", "b", "c", "d"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_lanternfish-vdb")).args(arguments).output().expect("started");
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(text.lines().count() == 1 && text.contains("lanternfish"), "{text}");
    }
}

fn real_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/vdb");
    let mut files = Vec::new();
    for sub in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        for file in std::fs::read_dir(sub.path()).into_iter().flatten().flatten() {
            if file.path().extension().is_some_and(|e| e == "vdb") {
                files.push(file.path());
            }
        }
    }
    files.sort();
    files
}

/// Skipped where there are none.
#[test]
fn real_files_load_or_say_why_not() {
    for path in real_files() {
        let grids = read(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(!grids.is_empty(), "{}", path.display());
        for grid in &grids {
            let h = &grid.header;
            println!(
                "{} {}[{}] {} {} {} voxels, {} leaves, {} tiles, {}{}",
                path.file_name().unwrap_or_default().display(),
                h.name,
                h.index,
                h.value_type,
                h.class.word(),
                h.active_voxels,
                h.leaf_count,
                h.tile_count,
                h.map_name,
                h.skipped.as_ref().map_or(String::new(), |s| format!(", skipped: {s}"))
            );
            assert_eq!(h.skipped.is_some(), grid.values == GridValues::Absent);
        }
    }
}
