//! A medium as a light. Its directions are tested where they come from: [`crate::medium::grid::energy`].

use std::f32::consts::PI;

use glam::{DAffine3, DVec3};

use super::*;
use crate::light::tree::{LightBounds, LightTree};
use crate::medium::grid::emission::{Emission, EmissionShape};
use crate::medium::grid::field::{Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};

/// A cube of glowing gas with an edge of 2 around `centre`, thin.
fn fire(centre: DVec3) -> GridMedium {
    let grid = ScalarGrid::Single(Arc::new(SparseGrid::from_dense([16; 3], |_| 1.0, 0.0)));
    let place = DAffine3::from_translation(centre - 1.0 + 0.0625) * DAffine3::from_scale(DVec3::splat(0.125));
    GridMedium::new(GridMediumParts {
        density: Some(Field { grid, map: IndexMap::new(place, None).expect("invertible"), scale: 1.0, offset: 0.0 }),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: Rgb::splat(1e-4),
        sigma_s: Rgb::BLACK,
        scale: 1.0,
        emission: Some(Emission { radiance: Rgb::splat(1e4), shape: EmissionShape::Constant, direct: false }),
        g: 0.0,
        clip: Some((DVec3::splat(-0.5), DVec3::splat(15.5))),
        motion: None,
    })
}

fn lights() -> (Lights, LightId) {
    let mut lights = Lights::default();
    lights.add_point(PointLight { p: Vec3::ZERO, intensity: Rgb::WHITE });
    let energy = fire(DVec3::new(3.0, 0.0, 0.0)).energy().expect("it emits").clone();
    let id = lights.add_volume(VolumeLight::new(MediumId(2), energy));
    (lights, id)
}

#[test]
fn it_is_a_light_like_others() {
    let (lights, id) = lights();
    assert_eq!(lights.of_medium(MediumId(2)), Some(id));
    assert_eq!([0, 1, 3, 99].map(|m| lights.of_medium(MediumId(m))), [None; 4]);
    assert!(!lights.is_dark(id));
    // The samples at the sides fade to half: a little less than a cube of 2³ with an emission of 1.
    let intensity = lights.power(id).luminance() / (4.0 * PI);
    assert!((6.5..8.1).contains(&intensity), "{intensity}");
    let bounds = LightBounds::of(&lights, id).expect("it is somewhere");
    assert!(bounds.centre().distance(Vec3::new(3.0, 0.0, 0.0)) < 0.2 && bounds.radius < 2.5, "{bounds:?}");
    assert_eq!(LightTree::of(&lights).expect("there are lights").len(), 2);
}

#[test]
fn the_pdf_of_a_direction_is_the_pdf_asked_for() {
    let (lights, id) = lights();
    let geometry = Geometry::default();
    let mut stream = Stream::from_seed(2);
    for p in [Vec3::new(3.0, 0.0, 0.0), Vec3::new(3.9, 0.3, -0.8), Vec3::ZERO, Vec3::new(-5.0, 80.0, 3.0)] {
        for _ in 0..1000 {
            let u = [stream.next_f32(), stream.next_f32()];
            let Some(sample) = lights.sample(&geometry, id, p, 0.0, u, f64::from(stream.next_f32())) else { continue };
            assert!(matches!(sample.end, LightEnd::Volume(MediumId(2))));
            assert!(sample.pdf > 0.0 && !sample.radiance.is_black() && !sample.is_delta);
            assert_eq!(sample.pdf, lights.volume_pdf(id, p, sample.wi));
        }
    }
    assert_eq!(lights.volume_pdf(LightId(0), Vec3::ZERO, Vec3::X), 0.0);
}

#[test]
fn it_contributes_wherever_it_can_be_seen() {
    let (lights, id) = lights();
    let centre = LightBounds::of(&lights, id).expect("it is somewhere").centre();
    let intensity = lights.power(id).luminance() / (4.0 * PI);
    let far = lights.contribution(id, &Receiver::medium(centre + 50.0 * Vec3::Y));
    assert!((far * 2500.0 / intensity - 1.0).abs() < 0.01, "{far}");
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z] {
        // Inside every direction counts.
        assert!(lights.contribution(id, &Receiver::surface(centre + 0.5, normal, false)) > 0.0);
    }
    let at = |normal| lights.contribution(id, &Receiver::surface(centre - 9.0 * Vec3::Y, normal, false));
    assert!(at(Vec3::Y) > 0.0 && at(Vec3::X) > 0.0 && at(Vec3::X) < at(Vec3::Y));
    assert_eq!(at(Vec3::NEG_Y), 0.0);
}
