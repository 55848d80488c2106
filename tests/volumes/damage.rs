//! Damaged volume files of every kind, and limits: the worker may crash, the reader gets an error.

#![cfg(feature = "openvdb")]

use std::path::Path;

use openvdb::{Compression, Limits, Precision, Tile, VdbError, VdbWriter, read_vdb, set_worker};

fn write_fire(path: &Path, compression: Compression, precision: Precision) {
    set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    let mut writer = VdbWriter::new().expect("a writer");
    writer.fog_grid("density", precision, 0.0, 0.25, [1.0, 2.0, 3.0]).expect("a grid");
    let ramp = |x: i32, y: i32, z: i32| (x * 3 + y * 5 + z * 7).rem_euclid(41) as f32 * 0.125;
    writer.dense([-5, 3, 0], [20, 11, 17], 0.0, ramp).expect("voxels");
    writer.tiles(&[Tile { origin: [128, 0, -128], size: 128, value: [0.5, 0.0, 0.0], active: true }]).expect("a tile");
    writer.fog_grid("flame", precision, 0.0, 0.5, [0.0; 3]).expect("a grid");
    writer.dense([0, 0, 0], [8, 8, 8], 0.0, |x, y, z| (x + y + z) as f32).expect("voxels");
    writer.write(path, compression).expect("written");
}

/// Every damaged file gives an answer: the grids or an error, within the limits that its length gives it.
fn try_damaged(path: &Path, bytes: &[u8]) -> bool {
    std::fs::write(path, bytes).expect("written");
    // That these keep a reader below 1 GiB and 2 s is what they are for.
    match read_vdb(path, &Limits::default()) {
        Ok(_) => true,
        Err(error) => {
            let text = error.to_string();
            assert!(!matches!(error, VdbError::Reader { .. }), "{text}");
            assert!(text.contains("damaged.vdb") && text.len() < 1000, "{text}");
            false
        }
    }
}

#[test]
fn truncated_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, path) = (folder.path().join("whole.vdb"), folder.path().join("damaged.vdb"));
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        write_fire(&whole, compression, Precision::Single);
        let bytes = std::fs::read(&whole).expect("there");
        assert!(try_damaged(&path, &bytes), "the whole file is fine");
        let early = 0..60;
        let late = (1..30).map(|i| bytes.len() * i / 30);
        for length in early.step_by(4).chain(late).chain([bytes.len() - 1]) {
            assert!(!try_damaged(&path, &bytes[..length]), "{compression:?} cut at {length} of {}", bytes.len());
        }
    }
}

/// Where in a file the places of a grid, of its blocks and of its end stand: in a row, right before the grid.
fn places(bytes: &[u8]) -> Vec<usize> {
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize;
    let is_grid = |&at: &usize| {
        let [grid, blocks, end] = [0, 8, 16].map(|step| number(at + step));
        grid == at + 24 && (grid..end).contains(&blocks) && end <= bytes.len()
    };
    (0..bytes.len() - 24).filter(is_grid).flat_map(|at| [at, at + 8, at + 16]).collect()
}

#[test]
fn places_that_point_back_or_beyond_give_an_answer() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, path) = (folder.path().join("whole.vdb"), folder.path().join("damaged.vdb"));
    for compression in [Compression::Zip, Compression::Blosc] {
        write_fire(&whole, compression, Precision::Single);
        let bytes = std::fs::read(&whole).expect("there");
        let places = places(&bytes);
        assert_eq!(places.len(), 6, "three for each of two grids");
        for (number, &at) in places.iter().enumerate() {
            let old = u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
            for new in [old - 1, old / 2, 0, at as u64, u64::MAX] {
                let mut damaged = bytes.clone();
                damaged[at..at + 8].copy_from_slice(&new.to_le_bytes());
                let read = try_damaged(&path, &damaged);
                // An end before its grid or after the file's.
                let is_nonsense = number % 3 == 2 && new != old - 1;
                assert!(!(read && is_nonsense), "{compression:?}: {new} for {old} at {at}");
            }
        }
    }
}

#[test]
fn flipped_bits_give_an_answer() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, path) = (folder.path().join("whole.vdb"), folder.path().join("damaged.vdb"));
    let mut state = 0x1234_5678_9abc_def1u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let mut refused = 0;
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        write_fire(&whole, compression, Precision::Half);
        let bytes = std::fs::read(&whole).expect("there");
        for round in 0..60 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + round % 4 {
                let at = random() as usize % damaged.len();
                damaged[at] ^= 1 << (random() % 8);
            }
            refused += u32::from(!try_damaged(&path, &damaged));
        }
    }
    assert!(refused > 20, "damage is noticed at least sometimes: {refused}");
}

#[test]
fn the_memory_limit_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fire.vdb");
    write_fire(&path, Compression::Zip, Precision::Single);
    let limits = Limits { memory: Some(1 << 20), ..Limits::default() };
    // With a megabyte not even the libraries' own start-up succeeds: any error will do, but an error it must be.
    assert!(read_vdb(&path, &limits).is_err());
}
