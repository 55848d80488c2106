//! Point, spot and distant lights, and the constant background.

use super::*;
use crate::math::warp::uniform_sphere;

fn spot() -> SpotLight {
    let cos = |degrees: f32| degrees.to_radians().cos();
    SpotLight { p: Vec3::ZERO, axis: Vec3::Z, intensity: Rgb::splat(2.0), cos_start: cos(20.0), cos_end: cos(30.0) }
}

#[test]
fn a_point_light_falls_off_with_the_square_of_distance() {
    let light = PointLight { p: Vec3::new(0.0, 0.0, 2.0), intensity: Rgb::splat(8.0) };
    let s = light.sample(Vec3::ZERO).expect("it is somewhere else");
    assert_eq!((s.wi, s.radiance, s.pdf, s.is_delta), (Vec3::Z, Rgb::splat(2.0), 1.0, true));
    assert!((1.999..2.0).contains(&s.segment(Vec3::ZERO).1));
    assert_eq!(s.segment(Vec3::Z * 2.5).1, 0.0, "the offset reached beyond it");
    assert!(light.sample(light.p).is_none(), "no direction from its own place");
    assert!((light.power()[0] / (32.0 * std::f32::consts::PI) - 1.0).abs() < 1e-6);
}

#[test]
fn a_spot_is_full_inside_zero_outside_and_smooth_between() {
    let at = |degrees: f32| {
        let angle = degrees.to_radians();
        spot().sample(Vec3::new(angle.sin(), 0.0, angle.cos())).map_or(0.0, |s| s.radiance[0])
    };
    assert!((at(0.0) - 2.0).abs() < 1e-5 && (at(19.99) - 2.0).abs() < 1e-4);
    assert_eq!(at(30.01), 0.0);
    assert!(at(29.99) < 1e-4);
    assert_eq!(at(180.0), 0.0);
    let middle = 0.5 * (spot().cos_start + spot().cos_end);
    assert!((spot().falloff(middle) - 0.5).abs() < 1e-5);
    let hard = SpotLight { cos_end: spot().cos_start, ..spot() };
    assert_eq!((hard.falloff(hard.cos_start), hard.falloff(hard.cos_start - 1e-4)), (1.0, 0.0));
}

#[test]
fn a_spot_emits_its_power() {
    let mut stream = Stream::from_seed(1);
    let mut mean = Mean::default();
    for _ in 0..2_000_000 {
        let w = uniform_sphere(pair(&mut stream));
        mean.add(spot().sample(w).map_or(0.0, |s| f64::from(s.radiance[0])) * 4.0 * std::f64::consts::PI);
    }
    mean.must_be(f64::from(spot().power()[0]), "spot");
}

#[test]
fn distant_light_is_the_same_everywhere() {
    let mut lights = Lights::default();
    let id = lights.add_distant(DistantLight { wi: Vec3::Y, irradiance: Rgb::splat(3.0) });
    let s = lights.sample(&Geometry::default(), id, Vec3::splat(7.0), 0.0, [0.0; 2], 0.0).expect("it is everywhere");
    assert_eq!((s.wi, s.radiance, s.pdf, s.is_delta), (Vec3::Y, Rgb::splat(3.0), 1.0, true));
    assert_eq!(s.segment(Vec3::ONE), (Vec3::Y, f32::INFINITY));
    lights.set_scene_bounds(Vec3::splat(-1.0), Vec3::splat(1.0));
    assert!((lights.power(id)[0] / (3.0 * std::f32::consts::PI * 3.0) - 1.0).abs() < 1e-6);
    assert!(lights.infinite().is_empty(), "no ray that leaves the scene sees it");
}

#[test]
fn a_constant_dome_gives_pi_times_its_radiance() {
    let mut lights = Lights::default();
    let id = lights.add_infinite(InfiniteLight::Constant(Rgb::splat(0.5)));
    let geometry = Geometry::default();
    let normal = Vec3::new(0.6, 0.0, -0.8);
    irradiance(&geometry, &lights, id.0, Vec3::ZERO, normal, 200_000, 2).must_be(0.5 * std::f64::consts::PI, "dome");
    assert_eq!(lights.infinite(), [id]);
    assert_eq!(lights.background(id, Vec3::ZERO, Vec3::X), Rgb::splat(0.5));
    let s = lights.sample(&geometry, id, Vec3::ZERO, 0.0, [0.1, 0.2], 0.0).expect("it shines");
    assert_eq!(lights.background_pdf(id, Vec3::ZERO, s.wi), s.pdf);
}
