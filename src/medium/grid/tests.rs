//! Grids against each other and against brute force: look-ups, bounds along rays, coverage of rays.

use std::sync::Arc;

use glam::{DAffine3, DVec3, IVec3, Vec3};

use super::emission::{BlackbodyScale, BlackbodyTable, Emission, EmissionShape};
use super::field::{AnyGrid, Field, ScalarGrid};
use super::map::{Frustum, IndexMap};
use super::sparse::{SparseGrid, TileOf};
use super::{GridMedium, GridMediumParts};
use crate::math::Rgb;
use crate::math::sampler::Stream;
use crate::medium::resolution::limit;

pub(super) fn blob(edge: i32, origin: IVec3, seed: u64) -> (Vec<IVec3>, Vec<f32>) {
    let mut stream = Stream::from_seed(seed);
    let (mut origins, mut values) = (Vec::new(), Vec::new());
    for x in 0..edge {
        for y in 0..edge {
            for z in 0..edge {
                if stream.next_f32() < 0.6 {
                    continue;
                }
                origins.push(origin + IVec3::new(x, y, z) * 8);
                values.extend((0..512).map(|_| if stream.next_f32() < 0.5 { 0.0 } else { stream.next_f32() * 4.0 }));
            }
        }
    }
    (origins, values)
}

pub(super) fn parts(grid: SparseGrid<f32>, map: IndexMap) -> GridMediumParts {
    let grid = ScalarGrid::Single(Arc::new(grid));
    GridMediumParts {
        density: Some(Field { grid, map, scale: 1.0, offset: 0.0 }),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::new(0.1, 0.2, 0.3),
        sigma_s: Rgb::new(1.0, 0.5, 0.25),
        scale: 2.0,
        emission: None,
        g: 0.0,
        clip: None,
        motion: None,
    }
}

pub(super) fn affine(scale: f64, move_by: DVec3) -> IndexMap {
    let turn = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    IndexMap::new(DAffine3::from_translation(move_by) * turn * DAffine3::from_scale(DVec3::splat(scale)), None)
        .expect("invertible")
}

fn direction(stream: &mut Stream) -> Vec3 {
    loop {
        let v = Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32()) * 2.0 - 1.0;
        let axes = Vec3::new(stream.next_f32(), stream.next_f32(), stream.next_f32());
        // Some directions along axes and planes.
        let v = Vec3::select(axes.cmplt(Vec3::splat(0.15)), Vec3::ZERO, v);
        if v.length_squared() > 1e-3 && v.length_squared() <= 1.0 {
            return v.normalize();
        }
    }
}

/// Follows `rays` random rays around `centre`: stretches are in order, end at t_max, and bound μ_t at random points.
pub(super) fn check_rays(medium: &GridMedium, centre: Vec3, size: f32, rays: usize, seed: u64) -> (u64, u64) {
    let mut stream = Stream::from_seed(seed);
    let (mut points, mut dense) = (0u64, 0u64);
    for ray in 0..rays {
        let mut around = |r: f32| centre + direction(&mut stream) * r;
        let distance = [0.3, 1.0, 3.0, 100.0][ray % 4] * size;
        let origin = around(distance);
        let target = around(0.4 * size);
        let d = if ray % 3 == 0 { direction(&mut stream) } else { (target - origin).normalize() };
        let (t_min, t_max) = (0.1 * size * stream.next_f32(), distance + 2.0 * size);
        let mut start = t_min;
        // What is limited where a stretch begins is so all along it.
        let limited = |mu: f32, start: f32| if medium.is_limited() { limit(mu, origin + d * start) } else { mu };
        for segment in medium.majorants(origin, d, t_min, t_max) {
            assert!(segment.t_end > start, "{segment:?} after {start}");
            assert!(segment.majorant >= 0.0 && segment.majorant.is_finite());
            for _ in 0..6 {
                let t = start + (segment.t_end - start) * stream.next_f32();
                let point = medium.point(origin + d * t, stream.next_f32());
                let extinction = limited((point.absorption + point.scattering).max_channel(), start);
                assert!(
                    extinction <= segment.majorant,
                    "{extinction} exceeds {segment:?} at {t} from {origin} along {d}"
                );
                points += 1;
                dense += u64::from(extinction > 0.0);
            }
            start = segment.t_end;
        }
        assert_eq!(start, t_max, "the whole ray is covered");
    }
    (points, dense)
}

#[test]
fn bounds_hold_along_random_rays() {
    for (number, (scale, place)) in
        [(1.0, DVec3::ZERO), (0.013, DVec3::new(5.0, -3.0, 2.0)), (40.0, DVec3::splat(1e4)), (1e-6, DVec3::ZERO)]
            .into_iter()
            .enumerate()
    {
        let (origins, values) = blob(6, IVec3::new(-16, 120, -24), 7);
        let tiles = vec![
            TileOf { origin: IVec3::new(32, 120, 0), edge: 8, value: 9.0 },
            TileOf { origin: IVec3::new(128, 128, 0), edge: 128, value: 0.5 },
        ];
        let map = affine(scale, place);
        let medium = GridMedium::new(parts(SparseGrid::new(0.0, origins, values, tiles), map));
        let centre = map.to_render(DVec3::new(8.0, 144.0, 0.0)).as_vec3();
        let (points, dense) = check_rays(&medium, centre, 60.0 * scale as f32, 20_000, number as u64);
        assert!(points > 500_000 && dense * 20 > points, "{dense} of {points} points met something");
    }
}

#[test]
fn bounds_hold_across_empty_space() {
    for (share, place) in [(0.01, DVec3::ZERO), (0.0005, DVec3::splat(-300.0))] {
        let mut stream = Stream::from_seed(5);
        let leaves = (0..40i32.pow(3)).map(|i| IVec3::new(i / 1600, i / 40 % 40, i % 40) * 8 - 64);
        let origins: Vec<IVec3> = leaves.filter(|_| f64::from(stream.next_f32()) < share).collect();
        let values = vec![1.0f32; 512 * origins.len()];
        let map = affine(0.2, place);
        let medium = GridMedium::new(parts(SparseGrid::new(0.0, origins.clone(), values, vec![]), map));
        let centre = map.to_render(DVec3::splat(96.0)).as_vec3();
        let (points, dense) = check_rays(&medium, centre, 50.0, 20_000, 3);
        assert!(dense * 2000 > points, "{dense} of {points} points met something");
        // Rays past everything but one leaf, from outside: they find it.
        for &origin in &origins {
            let target = map.to_render(origin.as_dvec3() + 3.5).as_vec3();
            let from = target + direction(&mut stream) * 60.0;
            let to = (target - from).normalize();
            let at = from.distance(target);
            let mut segments = medium.majorants(from, to, 0.0, 100.0);
            let there = segments.find(|segment| segment.t_end > at).expect("the ray goes on");
            assert!(there.majorant > 0.0, "{origin}");
        }
    }
}

#[test]
fn bounds_hold_in_frustums_and_with_direct_emission() {
    let (origins, values) = blob(5, IVec3::ZERO, 3);
    let frustum = Frustum { min: DVec3::ZERO, max: DVec3::splat(40.0), taper: 0.4, depth: 1.5 };
    let map = IndexMap::new(DAffine3::from_scale(DVec3::splat(10.0)), Some(frustum)).expect("invertible");
    let mut given = parts(SparseGrid::new(0.0, origins.clone(), values.clone(), Vec::new()), map);
    let elsewhere = affine(0.5, DVec3::new(30.0, 0.0, 0.0));
    let flame = AnyGrid::Scalar(ScalarGrid::Single(Arc::new(SparseGrid::new(0.0, origins, values, Vec::new()))));
    let shape = EmissionShape::Grid(Field { grid: flame, map: elsewhere, scale: 1.0, offset: 0.0 });
    given.emission = Some(Emission { radiance: Rgb::WHITE, shape, direct: true });
    let medium = GridMedium::new(given);
    let (points, dense) = check_rays(&medium, Vec3::new(0.0, 0.0, 8.0), 20.0, 20_000, 11);
    assert!(dense * 50 > points, "{dense} of {points}");
    check_gathering(&medium, elsewhere.to_render(DVec3::splat(20.0)).as_vec3(), 20.0, 20_000, 12);
}

/// Follows random rays: wherever there is emission, it is gathered, though not more than once a voxel.
fn check_gathering(medium: &GridMedium, centre: Vec3, size: f32, rays: usize, seed: u64) {
    let mut stream = Stream::from_seed(seed);
    let (mut points, mut glows) = (0u64, 0u64);
    for ray in 0..rays {
        let distance = [0.3, 1.0, 3.0, 100.0][ray % 4] * size;
        let origin = centre + direction(&mut stream) * distance;
        let d = (centre + direction(&mut stream) * (0.4 * size) - origin).normalize();
        let (mut start, t_max) = (0.0, distance + 2.0 * size);
        for segment in medium.gathering_rates(origin, d, start, t_max).expect("it emits") {
            for _ in 0..6 {
                let t = start + (segment.t_end - start) * stream.next_f32();
                let emission = medium.point(origin + d * t, 0.0).emission.max_channel();
                assert!(emission == 0.0 || segment.majorant > 0.0, "{emission} at {t} from {origin} along {d}");
                points += 1;
                glows += u64::from(emission > 0.0);
            }
            start = segment.t_end;
        }
        assert_eq!(start, t_max, "the whole ray is covered");
    }
    assert!(glows * 50 > points, "{glows} of {points} points glow");
}

/// Also where neither the temperature nor the scale lies on the density's lattice.
#[test]
fn emission_is_gathered_along_random_rays() {
    for (scale, place) in [(1.0, DVec3::ZERO), (0.013, DVec3::new(5.0, -3.0, 2.0)), (40.0, DVec3::splat(1e4))] {
        let map = affine(scale, place);
        for other in [map, affine(0.7 * scale, place + scale * 3.0)] {
            let (origins, values) = blob(6, IVec3::ZERO, 7);
            let kelvin: Vec<f32> = values.iter().map(|v| 500.0 * v).collect();
            let kelvin = ScalarGrid::Single(Arc::new(SparseGrid::new(0.0, origins.clone(), kelvin, Vec::new())));
            let kelvin = Field { grid: kelvin, map: other, scale: 1.0, offset: 0.0 };
            let table = BlackbodyTable::new(2000.0, BlackbodyScale::Peak);
            let shape = EmissionShape::Temperature { kelvin, table, scale: None };
            let emission = Some(Emission { radiance: Rgb::WHITE, shape, direct: false });
            let density = parts(SparseGrid::new(0.0, origins, values, Vec::new()), map);
            let medium = GridMedium::new(GridMediumParts { emission, ..density });
            let centre = map.to_render(DVec3::splat(24.0)).as_vec3();
            check_gathering(&medium, centre, 40.0 * scale as f32, 10_000, 13);
        }
    }
}

#[test]
fn scattered_and_huge_grids_are_walked_in_big_steps() {
    let far = [IVec3::splat(-2_000_000_000), IVec3::new(2_000_000_000, 0, 7_000_000), IVec3::ZERO].map(|v| v & !7);
    let tiles: Vec<_> = (0..8).map(|i| TileOf { origin: IVec3::new(0, 4096 * i, 0), edge: 4096, value: 1.0 }).collect();
    let values = vec![1.0f32; 512 * 3];
    let map = IndexMap::new(DAffine3::from_scale(DVec3::splat(1e-6)), None).expect("invertible");
    let medium = GridMedium::new(parts(SparseGrid::new(0.0, far.to_vec(), values, tiles), map));
    assert!(medium.memory() < 64 << 20, "{}", medium.memory());
    let ray = |o: Vec3, d: Vec3| medium.majorants(o, d, 0.0, 1e5).inspect(|s| assert!(s.t_end > 0.0)).count();
    assert!(ray(Vec3::splat(-3000.0), Vec3::ONE.normalize()) >= 2);
    assert_eq!(medium.density(Vec3::new(0.001, 0.02, 0.001)), 1.0);
    assert_eq!(medium.density(Vec3::new(0.001, 0.05, 0.001)), 0.0);
}

#[test]
fn samples_match_brute_force() {
    let (origins, values) = blob(4, IVec3::new(-8, 0, 8), 5);
    let grid =
        SparseGrid::new(0.0, origins, values, vec![TileOf { origin: IVec3::new(64, 0, 0), edge: 8, value: 3.0 }]);
    let mut stream = Stream::from_seed(1);
    for _ in 0..200_000 {
        let p = DVec3::new(
            f64::from(stream.next_f32()) * 90.0 - 12.0,
            f64::from(stream.next_f32()) * 40.0 - 4.0,
            f64::from(stream.next_f32()) * 40.0,
        );
        let (low, mut sum) = (p.floor().as_ivec3(), 0.0f64);
        for corner in 0..8 {
            let at = low + IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let w = 1.0 - (p - at.as_dvec3()).abs();
            sum += w.x * w.y * w.z * f64::from(grid.value(at));
        }
        assert!((f64::from(grid.sample(p)) - sum).abs() < 1e-5);
    }
}

#[test]
fn strange_values_become_zero_and_are_counted() {
    let mut values = vec![1.0f32; 512];
    (values[0], values[1], values[2]) = (f32::NAN, f32::INFINITY, -1.0);
    let grid = SparseGrid::new(0.0, vec![IVec3::ZERO], values.clone(), Vec::new());
    assert_eq!(grid.bad_voxels(), 3);
    assert_eq!(grid.value(IVec3::ZERO), 0.0);
    let halves: Vec<half::f16> = values.iter().map(|&v| half::f16::from_f32(v)).collect();
    assert_eq!(SparseGrid::new(half::f16::ZERO, vec![IVec3::ZERO], halves, Vec::new()).bad_voxels(), 3);
}

#[test]
fn every_half_reads_exactly() {
    use super::sparse::Voxel;
    for bits in 0..0x7c00u16 {
        let h = half::f16::from_bits(bits);
        assert_eq!(Voxel::get(h), h.to_f32());
    }
}

#[test]
fn grids_of_one_voxel_and_of_none_are_fine() {
    let map = affine(1.0, DVec3::ZERO);
    let mut one = vec![0.0f32; 512];
    one[0] = 2.0;
    let medium = GridMedium::new(parts(SparseGrid::new(0.0, vec![IVec3::ZERO], one, Vec::new()), map));
    assert_eq!(medium.density(map.to_render(DVec3::ZERO).as_vec3()), 2.0);
    let none = GridMedium::new(parts(SparseGrid::new(0.0, Vec::new(), Vec::new(), Vec::new()), map));
    let segments: Vec<_> = none.majorants(Vec3::ZERO, Vec3::X, 0.0, 5.0).collect();
    assert_eq!((segments.len(), segments[0].majorant, segments[0].t_end), (1, 0.0, 5.0));
    assert_eq!(none.bounds(), Some((Vec3::ZERO, Vec3::ZERO)));
}

/// Where direct emission is everywhere, by its offset or its background, so are the points that gather it.
#[test]
fn direct_emission_outside_the_stored_voxels_is_met() {
    for (background, offset) in [(0.0, 0.5), (0.25, 0.0)] {
        let density = SparseGrid::new(0.0, vec![IVec3::ZERO], vec![1.0; 512], vec![]);
        let glow = SparseGrid::new(background, vec![IVec3::ZERO], vec![1.0; 512], vec![]);
        let map = IndexMap::new(DAffine3::IDENTITY, None).expect("invertible");
        let grid = AnyGrid::Scalar(ScalarGrid::Single(Arc::new(glow)));
        let shape = EmissionShape::Grid(Field { grid, map, scale: 1.0, offset });
        let emission = Some(Emission { radiance: Rgb::WHITE, shape, direct: true });
        let medium = GridMedium::new(GridMediumParts { emission, ..parts(density, map) });
        let far = Vec3::new(1000.0, 0.0, 0.0);
        assert!(medium.point(far, 0.0).emission[0] > 0.0 && medium.bounds().is_none());
        let mut rates = medium.gathering_rates(far, Vec3::X, 0.0, 10.0).expect("it emits");
        assert!(rates.all(|segment| segment.majorant > 0.0));
    }
}

/// Around a great many of the largest tiles whole cells of that size are raised.
#[test]
fn bounds_hold_around_many_tiles() {
    for step in [1, 2] {
        let place = |i: i32| IVec3::new(i / 25, i / 5 % 5, i % 5) * step - 2 * step;
        let value = |i: i32| 0.2 + 0.1 * (i % 7) as f32;
        let tile = |i: i32| TileOf { origin: place(i) * 4096, edge: 4096, value: value(i) };
        let map = affine(1e-3, DVec3::new(0.3, 0.0, -0.2));
        let grid = SparseGrid::new(0.0, vec![], vec![], (0..125).map(tile).collect());
        let medium = GridMedium::new(parts(grid, map));
        assert!(medium.memory() < 8 << 20, "{}", medium.memory());
        let (points, dense) = check_rays(&medium, Vec3::ZERO, 12.0, 5000, 31);
        assert!(dense * 20 > points, "{dense} of {points} points met something");
    }
}

/// A temperature of huge voxels over a density of small ones would raise more cells than there is memory for.
#[test]
fn emission_is_gathered_where_its_voxels_are_huge() {
    let (origins, values) = blob(6, IVec3::ZERO, 7);
    let map = affine(1e-3, DVec3::ZERO);
    let centre = map.to_render(DVec3::splat(24.0)).as_vec3();
    for (edge, scale) in [(8, 10.0), (4096, 1.0), (4096, 1e3)] {
        let tiles = vec![
            TileOf { origin: IVec3::splat(-edge), edge, value: 1000.0 },
            TileOf { origin: IVec3::ZERO, edge, value: 1500.0 },
        ];
        let kelvin = ScalarGrid::Single(Arc::new(SparseGrid::new(0.0, vec![], vec![], tiles)));
        let kelvin = Field { grid: kelvin, map: affine(scale, DVec3::ZERO), scale: 1.0, offset: 0.0 };
        let shape = EmissionShape::Temperature {
            kelvin,
            table: BlackbodyTable::new(2000.0, BlackbodyScale::Peak),
            scale: None,
        };
        let emission = Some(Emission { radiance: Rgb::WHITE, shape, direct: false });
        let density = parts(SparseGrid::new(0.0, origins.clone(), values.clone(), vec![]), map);
        let medium = GridMedium::new(GridMediumParts { emission, ..density });
        assert!(medium.memory() < 16 << 20, "{}", medium.memory());
        check_gathering(&medium, centre, 0.04, 3000, 14);
    }
}

/// And around a great many tiles of 128 whole blocks.
#[test]
fn bounds_hold_around_many_smaller_tiles() {
    let place = |i: i32| IVec3::new(i / 324, i / 18 % 18, i % 18) - 9;
    let tile = |i: i32| TileOf { origin: place(i) * 128, edge: 128, value: 0.2 + 0.1 * (i % 7) as f32 };
    let map = affine(1e-2, DVec3::new(0.3, 0.0, -0.2));
    let grid = SparseGrid::new(0.0, vec![IVec3::splat(9 * 128)], vec![1.0; 512], (0..5832).map(tile).collect());
    let medium = GridMedium::new(parts(grid, map));
    assert!(medium.memory() < 4 << 20, "{}", medium.memory());
    let (points, dense) = check_rays(&medium, Vec3::ZERO, 12.0, 5000, 32);
    assert!(dense * 20 > points, "{dense} of {points} points met something");
}
