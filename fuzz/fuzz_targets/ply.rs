//! Meshes of .ply files.

#![no_main]

use lanternfish::fuzzing::mesh;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(mesh) = mesh(data) else { return };
    let count = mesh.positions.len();
    let corners = mesh.triangles.as_flattened().iter().chain(mesh.quads.as_flattened());
    assert!(corners.into_iter().all(|&corner| (corner as usize) < count));
    assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
    assert!([mesh.normals.len(), mesh.uvs.len()].iter().all(|&n| n == 0 || n == count));
});
