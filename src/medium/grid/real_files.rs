//! Checks on real files, skipped where there are none: the same smoke from a .vdb and as a dense array, and the rate of
//! look-ups through a fire.

use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3, Vec3};

use super::field::{AnyGrid, ScalarGrid, with_scalar};
use super::file::{place, read, voxels};
use super::map::IndexMap;
use super::sparse::SparseGrid;
use crate::math::sampler::Stream;

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    path.is_file().then_some(path)
}

fn density(path: &Path) -> (ScalarGrid, IndexMap) {
    let grids = read(path).expect("readable");
    let mut grid = grids.into_iter().find(|g| g.header.name == "density").expect("a density");
    let map = place(&grid, &DAffine3::IDENTITY).expect("invertible");
    match voxels(&mut grid) {
        Some(AnyGrid::Scalar(scalars)) => (scalars, map),
        _ => panic!("numbers expected"),
    }
}

/// The numbers after `"... name" [`.
fn numbers(text: &str, name: &str) -> Vec<f64> {
    let after = text.split_once(&format!("{name}\"")).expect("given").1.split_once('[');
    let list = after.filter(|(gap, _)| gap.trim().is_empty()).expect("a list").1.split(']').next().unwrap_or_default();
    list.split_whitespace().map(|n| n.parse().expect("a number")).collect()
}

#[test]
fn smoke_is_the_same_from_a_file_and_as_an_array() {
    let (Some(scene), Some(vdb)) = (shared("refs/r10_smoke.pbrt.gz"), shared("data/vdb/openusd/smoke_000002.vdb"))
    else {
        return;
    };
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(scene).expect("there")).read_to_string(&mut text).expect("text");
    let (p0, p1) = (DVec3::from_slice(&numbers(&text, "p0")), DVec3::from_slice(&numbers(&text, "p1")));
    let array = numbers(&text, " density");
    let size = [53u32, 51, 82];
    let dense = SparseGrid::from_dense(size, |i| array[i] as f32, 0.0f32);
    let n = DVec3::new(53.0, 51.0, 82.0);
    let (grid, map) = density(&vdb);
    let mut stream = Stream::from_seed(2);
    let mut most = 0.0f32;
    for _ in 0..100_000 {
        let u = DVec3::new(stream.next_f32().into(), stream.next_f32().into(), stream.next_f32().into());
        let p = p0 + (p1 - p0) * u;
        let a = dense.sample(u * n - 0.5);
        let b = grid.sample(map.to_index(p.as_vec3()).expect("linear"));
        assert!((a - b).abs() < 1e-4, "{a} from the array, {b} from the file at {p}");
        most = most.max(a);
    }
    assert!(most > 0.1, "{most}");
}

/// Prints the rate; asserts only a tenth of what a quiet core does.
#[test]
fn fire_is_looked_up_quickly() {
    let Some(vdb) = shared("data/vdb/blender/fire128_blosc_f16_0035.vdb") else { return };
    let (grid, map) = density(&vdb);
    let (low, high) = grid.bounds().expect("stored");
    let mut stream = Stream::from_seed(3);
    let mut random = || {
        let u = DVec3::new(stream.next_f32().into(), stream.next_f32().into(), stream.next_f32().into());
        map.to_render(low.as_dvec3() + (high - low).as_dvec3() * u).as_vec3()
    };
    let rays: Vec<(Vec3, Vec3)> = (0..4000).map(|_| (random(), random())).collect();
    let start = std::time::Instant::now();
    let (mut sum, mut count) = (0.0f64, 0u64);
    with_scalar!(&grid, grid => for (a, b) in &rays {
        for step in 0..500 {
            let p = *a + (*b - *a) * (step as f32 / 500.0);
            sum += f64::from(grid.sample(map.to_index(p).expect("linear")));
            count += 1;
        }
    });
    let rate = count as f64 / start.elapsed().as_secs_f64() / 1e6;
    println!("{rate:.1} million look-ups a second, mean density {:.3}", sum / count as f64);
    assert!(sum > 0.0 && rate > 1.0);
}
