//! What is sent is what is in the file: for files written here, and for real ones where there are any. All are whole, so
//! that this process may read them.

use std::path::PathBuf;

use lanternfish_openvdb::wire::{Kind, NewGrid, Part, Receiver, receive_grid};
use lanternfish_openvdb::{GridClass, Precision, Tile, VdbGrid};

use super::*;
use crate::writer::Writer;
use crate::writing::put;

fn said(fault: Fault) -> String {
    match fault {
        Fault::Said { letter, reason } => format!("{letter}: {reason}"),
        Fault::Pipe => "the pipe broke".into(),
    }
}

/// The grids as they are in the file, and as they are after sending.
fn both_ways(path: &Path) -> [Vec<VdbGrid>; 2] {
    // SAFETY: the file is whole.
    let file = unsafe { File::open(path) }.map_err(said).expect("readable");
    // SAFETY: the file is whole.
    let here = (0..file.grid_count()).map(|n| unsafe { file.load(n, true) }.map_err(said).expect("readable"));
    let mut bytes = Vec::new();
    read(path, true, &mut bytes).map_err(said).expect("readable");
    lanternfish_openvdb::wire::send(&mut bytes, Kind::End, &[]).expect("memory takes it");
    let mut input = Receiver::new(bytes.as_slice(), u64::MAX);
    let mut sent = Vec::new();
    loop {
        let head = input.head().expect("a frame");
        match head.kind {
            Kind::Header => sent.push(receive_grid(&mut input, head).expect("a grid")),
            Kind::End => return [here.collect(), sent],
            kind => panic!("{kind:?} out of order"),
        }
    }
}

#[test]
fn grids_of_every_kind_are_sent_as_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("all.vdb");
    let mut count = 0;
    for compression in 0..3 {
        let mut writer = Writer::new().map_err(said).expect("a writer");
        for vectors in [false, true] {
            for precision in [Precision::Half, Precision::Single, Precision::Double] {
                for class in [GridClass::FogVolume, GridClass::LevelSet, GridClass::Unknown] {
                    count += 1;
                    let mut grid = NewGrid {
                        name: format!("grid {count}"),
                        vectors,
                        precision,
                        class,
                        background: [3.0, 0.0, 1.0],
                        voxel_size: 0.25,
                        translation: [1.0, 2.0, 3.0],
                        frustum: None,
                        parts: Vec::new(),
                    };
                    let tile = Tile { origin: [128, 0, -128], size: 128, value: [0.5; 3], active: true };
                    let values = (0..2 * grid.leaf_numbers()).map(|i| (i % 7) as f32 - 2.0).collect();
                    let leaves = Part::Leaves { origins: vec![[0; 3], [8, -16, 0]], values };
                    grid.parts = vec![leaves, Part::Tiles(vec![tile])];
                    put(&mut writer, &grid).map_err(said).expect("a grid");
                }
            }
        }
        writer.write(&path, compression).map_err(said).expect("written");
        let [here, sent] = both_ways(&path);
        assert_eq!(here.len(), 18);
        // What is converted from a level set may lose what lies outside.
        let has_parts = |grid: &VdbGrid| !grid.leaf_origins.is_empty() && !grid.tiles.is_empty();
        assert!(here.iter().all(|grid| grid.header.was_level_set || has_parts(grid)));
        assert!(here == sent, "compression {compression}");
    }
}

#[test]
fn values_and_grid_must_fit_together() {
    let mut writer = Writer::new().map_err(said).expect("a writer");
    assert!(writer.leaves(&[[0; 3]], &[1.0; 512]).is_err(), "no grid was begun");
    let grid = |vectors| NewGrid {
        name: "v".into(),
        vectors,
        precision: Precision::Single,
        class: GridClass::Unknown,
        background: [0.0; 3],
        voxel_size: 1.0,
        translation: [0.0; 3],
        frustum: None,
        parts: Vec::new(),
    };
    for (vectors, right) in [(false, 512), (true, 3 * 512)] {
        assert!(writer.begin(&grid(vectors)).is_ok());
        for count in [0, 511, 512, 3 * 512, 3 * 512 + 1] {
            assert_eq!(writer.leaves(&[[0; 3]], &vec![1.0; count]).is_ok(), count == right, "{count}");
        }
    }
}

/// Skipped where there are none.
#[test]
fn real_files_are_sent_as_they_are() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/vdb");
    let list = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
    };
    for path in list(&folder).iter().flat_map(|sub| list(sub)).filter(|p| p.extension().is_some_and(|e| e == "vdb")) {
        let [here, sent] = both_ways(&path);
        assert!(!here.is_empty() && here == sent, "{}", path.display());
    }
}
