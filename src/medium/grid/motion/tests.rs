//! Moving media against the same ones still, and against their bounds.

use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::math::sampler::Stream;
use crate::medium::grid::sparse::{SparseGrid, TileOf, Voxel};
use crate::medium::grid::tests::{affine, blob, check_rays, parts};
use crate::medium::grid::velocity::{Component, ComponentGrid, Velocity, VelocityGrid};
use crate::medium::grid::{GridMedium, GridMediumParts};

fn random(stream: &mut Stream, most: f32) -> Velocity {
    Velocity([(); 3].map(|()| most * (2.0 * stream.next_f32() - 1.0)))
}

/// Random velocities of up to `most` in leaves that are not all there, and a tile.
fn gusts(background: Vec3, most: f32, seed: u64) -> VelocityGrid {
    let mut stream = Stream::from_seed(seed);
    let (origins, _) = blob(6, IVec3::splat(-16), seed);
    let values = (0..512 * origins.len()).map(|_| random(&mut stream, most)).collect();
    let tile = TileOf { origin: IVec3::new(128, 0, 0), edge: 128, value: Velocity([0.5 * most, 0.0, -most]) };
    Arc::new(SparseGrid::new(Velocity(background.to_array()), origins, values, vec![tile]))
}

fn density(seed: u64) -> SparseGrid<f32> {
    let (origins, values) = blob(4, IVec3::new(-8, 0, -8), seed);
    let tile = TileOf { origin: IVec3::new(32, 32, 32), edge: 8, value: 3.0 };
    SparseGrid::new(0.0, origins, values, vec![tile])
}

#[test]
fn moving_media_stay_below_their_bounds() {
    for (number, (most, background, map, written_at)) in [
        (0.2f32, Vec3::ZERO, affine(1.0, DVec3::ZERO), 0.0f32),
        (9.0, Vec3::ZERO, affine(1.0, DVec3::ZERO), 0.0),
        (30.0, Vec3::ZERO, affine(1.7, DVec3::new(3.0, 1.0, -2.0)), 0.4),
        (4.0, Vec3::new(0.0, -12.0, 3.0), affine(0.8, DVec3::ZERO), -1.0),
    ]
    .into_iter()
    .enumerate()
    {
        let grid = gusts(background, most, 40 + number as u64);
        let motion = Motion {
            field: VelocityField::Vectors(grid, map),
            render_from_velocity: Mat3::from_rotation_y(0.3),
            written_at,
        };
        let still = parts(density(7), affine(1.0, DVec3::ZERO));
        let centre = still.density.as_ref().expect("there is one").map.to_render(DVec3::splat(10.0)).as_vec3();
        let medium = GridMedium::new(GridMediumParts { motion: Some(motion), ..still });
        let (points, dense) = check_rays(&medium, centre, 30.0, 20_000, number as u64);
        assert!(dense > 5_000 && points > dense, "{dense} of {points}");
    }
}

#[test]
fn what_moves_evenly_is_where_it_was() {
    let velocity = Vec3::new(5.0, -3.0, 11.0);
    let grid = Arc::new(SparseGrid::new(Velocity(velocity.to_array()), vec![], vec![], vec![]));
    let motion = Motion {
        field: VelocityField::Vectors(grid, affine(1.0, DVec3::ZERO)),
        render_from_velocity: Mat3::IDENTITY * 2.0,
        written_at: 0.25,
    };
    let still = GridMedium::new(parts(density(3), affine(1.0, DVec3::ZERO)));
    let moving =
        GridMedium::new(GridMediumParts { motion: Some(motion), ..parts(density(3), affine(1.0, DVec3::ZERO)) });
    let mut stream = Stream::from_seed(2);
    let mut met = 0;
    for _ in 0..20_000 {
        let p = 60.0 * Vec3::from([(); 3].map(|()| stream.next_f32() - 0.5));
        let time = stream.next_f32();
        let (there, before) = (moving.extinction(p, time), still.extinction(p - 2.0 * velocity * (time - 0.25), 0.0));
        assert!((there - before).max_channel().abs() < 1e-3 * (1.0 + before.max_channel()), "{there:?} {before:?}");
        met += u32::from(!there.is_black());
    }
    assert!(met > 500, "{met}");
}

#[test]
fn what_does_not_move_has_the_same_bounds() {
    let grid = Arc::new(SparseGrid::new(Velocity([0.0; 3]), vec![], vec![], vec![]));
    let motion = Motion {
        field: VelocityField::Vectors(grid, affine(1.0, DVec3::ZERO)),
        render_from_velocity: Mat3::IDENTITY,
        written_at: 0.0,
    };
    let still = GridMedium::new(parts(density(3), affine(1.0, DVec3::ZERO)));
    let moving =
        GridMedium::new(GridMediumParts { motion: Some(motion), ..parts(density(3), affine(1.0, DVec3::ZERO)) });
    assert_eq!(still.bounds(), moving.bounds());
    let ray = (Vec3::new(-90.0, 3.0, 2.0), Vec3::new(0.96, 0.2, 0.1961));
    let of = |medium: &GridMedium| medium.majorants(ray.0, ray.1, 0.0, 200.0).map(|s| s.majorant).collect::<Vec<_>>();
    assert_eq!(of(&still), of(&moving));
}

/// One component of `gusts`.
fn component(gusts: &VelocityGrid, axis: usize) -> ComponentGrid {
    let origins = gusts.leaves().map(|(origin, _)| origin).collect();
    let values = gusts.leaves().flat_map(|(_, leaf)| leaf.iter().map(|v| Component(v.get()[axis]))).collect();
    let tiles =
        gusts.tiles().iter().map(|t| TileOf { origin: t.origin, edge: t.edge, value: Component(t.value[axis]) });
    Arc::new(SparseGrid::new(Component(gusts.background()[axis]), origins, values, tiles.collect()))
}

/// In three grids, half a voxel apart as those of a staggered one are.
#[test]
fn components_move_as_vectors_do_and_below_their_bounds() {
    let map = affine(1.0, DVec3::ZERO);
    let gusts = gusts(Vec3::new(0.0, -2.0, 0.5), 7.0, 91);
    let same = std::array::from_fn(|axis| (component(&gusts, axis), map));
    let [vectors, components] = [VelocityField::Vectors(gusts.clone(), map), VelocityField::Components(Box::new(same))];
    let mut stream = Stream::from_seed(5);
    for _ in 0..2_000 {
        let p = 60.0 * Vec3::from([(); 3].map(|()| stream.next_f32() - 0.4));
        assert!((vectors.at(p) - components.at(p)).length() < 1e-4, "{p}");
        assert!(components.at(p).length() <= components.largest());
    }
    let apart = std::array::from_fn(|axis| (component(&gusts, axis), affine(1.0, -0.5 * DVec3::AXES[axis])));
    let field = VelocityField::Components(Box::new(apart));
    let motion = Motion { field, render_from_velocity: Mat3::from_rotation_y(0.3), written_at: 0.2 };
    let still = parts(density(7), map);
    let centre = still.density.as_ref().expect("there is one").map.to_render(DVec3::splat(10.0)).as_vec3();
    let medium = GridMedium::new(GridMediumParts { motion: Some(motion), ..still });
    let (points, dense) = check_rays(&medium, centre, 30.0, 20_000, 9);
    assert!(dense > 5_000 && points > dense, "{dense} of {points}");
}
