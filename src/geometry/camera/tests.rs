//! Tests of cameras.

use glam::{DMat4, DVec3};

use super::*;
use crate::film::FilmOverrides;
use crate::film::tests::{entity, scene};
use crate::math::transform::Animated;
use crate::scene::ParamValue;

fn floats(name: &'static str, values: &[f32]) -> (&'static str, &'static str, ParamValue) {
    (name, "float", ParamValue::Float(values.to_vec()))
}

fn world(params: Vec<(&str, &str, ParamValue)>, size: [i32; 2]) -> SceneDescription {
    let film = vec![
        ("xresolution", "integer", ParamValue::Integer(vec![size[0]])),
        ("yresolution", "integer", ParamValue::Integer(vec![size[1]])),
    ];
    scene(entity("perspective", params), entity("rgb", film), entity("box", vec![]))
}

fn of_kind(kind: &str, params: Vec<(&str, &str, ParamValue)>, size: [i32; 2]) -> Camera {
    let mut scene = world(params, size);
    scene.camera.kind = kind.into();
    build(&scene).expect("a valid camera")
}

fn text(name: &'static str, value: &str) -> (&'static str, &'static str, ParamValue) {
    (name, "string", ParamValue::String(vec![value.to_owned()]))
}

fn build(scene: &SceneDescription) -> Result<Camera> {
    let film = FilmSettings::build(scene, &FilmOverrides::default(), &mut Warnings::default())?;
    let space = RenderSpace { origin: scene.camera_position() };
    Camera::build(scene, &film, &space, &mut Warnings::default())
}

fn camera(params: Vec<(&str, &str, ParamValue)>, size: [i32; 2]) -> Camera {
    build(&world(params, size)).expect("a valid camera")
}

fn close(a: Vec3, b: Vec3) {
    assert!((a - b).abs().max_element() < 1e-6, "{a} is not {b}");
}

#[test]
fn fov_spans_the_shorter_axis() {
    let t = 30f32.to_radians().tan();
    let wide = camera(vec![floats("fov", &[60.0])], [200, 100]);
    close(wide.ray(Vec2::ZERO, [0.5; 2], 0.0).direction, Vec3::new(-2.0 * t, t, 1.0).normalize());
    close(wide.ray(Vec2::new(200.0, 100.0), [0.5; 2], 0.0).direction, Vec3::new(2.0 * t, -t, 1.0).normalize());
    close(wide.ray(Vec2::new(100.0, 50.0), [0.5; 2], 0.0).direction, Vec3::Z);
    let tall = camera(vec![floats("fov", &[60.0])], [100, 200]);
    close(tall.ray(Vec2::new(100.0, 0.0), [0.5; 2], 0.0).direction, Vec3::new(t, 2.0 * t, 1.0).normalize());
    let ray = wide.ray(Vec2::ZERO, [0.1, 0.9], 0.5);
    assert_eq!((ray.origin, ray.t_max, ray.opacity_seed), (Vec3::ZERO, f32::INFINITY, 0));
}

#[test]
fn aspect_and_screen_window_override_the_resolution() {
    let squeezed = camera(vec![floats("frameaspectratio", &[4.0])], [100, 100]);
    close(squeezed.ray(Vec2::ZERO, [0.5; 2], 0.0).direction, Vec3::new(-4.0, 1.0, 1.0).normalize());
    let window = camera(vec![floats("screenwindow", &[-1.0, 0.5, -0.25, 2.0])], [300, 100]);
    close(window.ray(Vec2::ZERO, [0.5; 2], 0.0).direction, Vec3::new(-1.0, 2.0, 1.0).normalize());
    close(window.ray(Vec2::new(300.0, 100.0), [0.5; 2], 0.0).direction, Vec3::new(0.5, -0.25, 1.0).normalize());
}

#[test]
fn projecting_undoes_rays() {
    let camera = camera(vec![], [40, 30]);
    for film in [Vec2::new(3.5, 20.25), Vec2::new(39.0, 0.5)] {
        let ray = camera.ray(film, [0.5; 2], 0.0);
        let seen = camera.project(ray.origin + 7.0 * ray.direction).expect("it is in front");
        assert!(seen.distance(film) < 1e-3, "{seen} {film}");
        assert_eq!(camera.project(ray.origin - ray.direction), None);
    }
}

#[test]
fn all_lens_points_meet_in_the_focal_plane() {
    let camera = camera(vec![floats("lensradius", &[0.3]), floats("focaldistance", &[7.0])], [100, 100]);
    let film = Vec2::new(80.0, 10.0);
    let expected = Vec3::new(0.6, 0.8, 1.0) * 7.0;
    let mut widest = 0.0f32;
    for i in 0..64 {
        let lens = [(i % 8) as f32 / 7.0, (i / 8) as f32 / 7.0];
        let ray = camera.ray(film, lens, 0.0);
        let t = (7.0 - ray.origin.z) / ray.direction.z;
        close((ray.origin + ray.direction * t) / 7.0, expected / 7.0);
        assert!(ray.origin.z == 0.0 && (ray.direction.length() - 1.0).abs() < 1e-6);
        widest = widest.max(ray.origin.length());
    }
    assert!((widest - 0.3).abs() < 1e-6, "the lens reaches {widest}");
}

#[test]
fn a_camera_far_away_sits_at_the_origin_of_render_space() {
    let mut scene = world(vec![], [10, 10]);
    let to_world = DMat4::from_translation(DVec3::new(1e8, -3e7, 12.5)) * DMat4::from_rotation_y(0.7);
    scene.camera_transform = Animated::fixed(to_world.inverse());
    let ray = build(&scene).expect("valid").ray(Vec2::splat(5.0), [0.5; 2], 0.0);
    assert_eq!(ray.origin, Vec3::ZERO);
    close(ray.direction, Vec3::new(0.7f32.sin(), 0.0, 0.7f32.cos()));
}

#[test]
fn a_moving_camera_turns_on_the_arc_between_its_keys() {
    let mut scene = world(vec![floats("shutteropen", &[0.5]), floats("shutterclose", &[1.0])], [10, 10]);
    let start = DMat4::IDENTITY;
    let end = DMat4::from_translation(DVec3::new(2.0, 0.0, 0.0)) * DMat4::from_rotation_y(1.0);
    scene.camera_transform = Animated { start: start.inverse(), end: end.inverse() };
    scene.transform_times = [0.0, 2.0];
    let camera = build(&scene).expect("valid");
    assert!(camera.is_moving());
    // The shutter covers a quarter to a half of the keys' interval.
    let (first, last) = (camera.ray(Vec2::splat(5.0), [0.5; 2], 0.0), camera.ray(Vec2::splat(5.0), [0.5; 2], 1.0));
    assert_eq!((first.time, last.time), (0.25, 0.5));
    close(first.origin, Vec3::new(0.5, 0.0, 0.0));
    close(last.direction, Vec3::new(0.5f32.sin(), 0.0, 0.5f32.cos()));
}

#[test]
fn what_is_not_supported_is_named() {
    let mut scene = world(vec![], [10, 10]);
    scene.camera.kind = "panini".into();
    let error = build(&scene).expect_err("no such camera");
    assert!(matches!(&error.kind, SceneErrorKind::Unsupported(m) if m.contains("panini")));
    for (name, value) in [("fov", 180.0), ("fov", 0.0), ("lensradius", -1.0), ("focaldistance", f32::NAN)] {
        assert!(build(&world(vec![floats(name, &[value])], [10, 10])).is_err(), "{name} {value}");
    }
    assert!(build(&world(vec![floats("screenwindow", &[0.0, 0.0, 1.0, 2.0])], [10, 10])).is_err());
    // What is in focus matters where there is a lens.
    let focus =
        |radius: f32| build(&world(vec![floats("lensradius", &[radius]), floats("focaldistance", &[0.0])], [10, 10]));
    assert!(focus(0.1).is_err() && focus(0.0).is_ok());
    let mut flat = world(vec![], [10, 10]);
    flat.camera_transform = Animated::fixed(DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)));
    assert!(build(&flat).is_err());
}

#[test]
fn rays_of_an_orthographic_camera_are_parallel() {
    let camera = of_kind("orthographic", vec![floats("screenwindow", &[-2.0, 2.0, -3.0, 1.0])], [40, 20]);
    let ray = camera.ray(Vec2::new(10.0, 5.0), [0.1, 0.9], 0.0);
    assert_eq!((ray.origin, ray.direction), (Vec3::new(-1.0, 0.0, 0.0), Vec3::Z));
    assert_eq!(camera.project(Vec3::new(-1.0, 0.0, 5.0)), Some(Vec2::new(10.0, 5.0)));
    assert_eq!(camera.project(Vec3::new(-1.0, 0.0, -5.0)), None);
    assert_eq!(camera.pixel_span(), PixelSpan { width: 0.2, angle: 0.0 });
    // With a lens, what is at the focal distance stays sharp.
    let lens = vec![floats("lensradius", &[0.5]), floats("focaldistance", &[7.0])];
    let camera = of_kind("orthographic", lens, [20, 20]);
    for lens in [[0.1, 0.9], [0.7, 0.3], [0.5, 0.5]] {
        let ray = camera.ray(Vec2::new(15.0, 5.0), lens, 0.0);
        close(ray.origin + ray.direction * ((7.0 - ray.origin.z) / ray.direction.z), Vec3::new(0.5, 0.5, 7.0));
    }
    assert!(camera.has_lens());
}

#[test]
fn a_spherical_camera_sees_everything_once() {
    for mapping in ["equalarea", "equirectangular"] {
        let camera = of_kind("spherical", vec![text("mapping", mapping)], [64, 32]);
        // The second moments of directions over the sphere are thirds, by the solid angle of each pixel.
        let (mut sum, mut whole) = ([0.0f64; 3], 0.0f64);
        for pixel in 0..64 * 32 {
            let film = Vec2::new((pixel % 64) as f32 + 0.5, (pixel / 64) as f32 + 0.5);
            let ray = camera.ray(film, [0.5; 2], 0.0);
            let angle =
                if mapping == "equalarea" { 1.0 } else { f64::from((film.y / 32.0 * std::f32::consts::PI).sin()) };
            whole += angle;
            for (axis, part) in sum.iter_mut().enumerate() {
                *part += angle * f64::from(ray.direction[axis] * ray.direction[axis]);
            }
            let back = camera.project(ray.origin + 3.0 * ray.direction).expect("everything is seen");
            assert!(back.distance(film) < 1e-2, "{mapping} {film} {back}");
        }
        for part in sum {
            assert!((part / whole - 1.0 / 3.0).abs() < 2e-3, "{mapping} {sum:?} {whole}");
        }
        // The image's edges are where it joins itself: a filter that reaches over them finds its neighbours.
        let beyond = camera.ray(Vec2::new(-0.25, 9.0), [0.5; 2], 0.0).direction;
        let within = if mapping == "equalarea" { Vec2::new(0.25, 23.0) } else { Vec2::new(63.75, 9.0) };
        close(beyond, camera.ray(within, [0.5; 2], 0.0).direction);
    }
    // As pbrt-v4 has it, +y is up.
    let camera = of_kind("spherical", vec![text("mapping", "equirectangular")], [64, 32]);
    close(camera.ray(Vec2::new(11.0, 0.0), [0.5; 2], 0.0).direction, Vec3::Y);
    close(camera.ray(Vec2::new(0.0, 16.0), [0.5; 2], 0.0).direction, Vec3::X);
    close(camera.ray(Vec2::new(16.0, 16.0), [0.5; 2], 0.0).direction, Vec3::Z);
}

#[test]
fn a_lens_of_many_surfaces_becomes_a_thin_one() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("lens.dat"), "# one\n100 1e-6 1.5 40\n-100 50 1 40\n0 50 0 10\n")
        .expect("written");
    let mut scene = world(vec![text("lensfile", "lens.dat"), floats("focusdistance", &[1.0])], [30, 40]);
    scene.camera.kind = "realistic".into();
    scene.base = folder.path().to_owned();
    let camera = build(&scene).expect("a camera");
    // f = 100 mm, so the film is 1/9 m behind: 35 mm over 50 pixels.
    let per_pixel = 0.035 / 50.0 * 9.0;
    let ray = camera.ray(Vec2::new(30.0, 20.0), [0.5; 2], 0.0);
    close(ray.direction, Vec3::new(15.0 * per_pixel, 0.0, 1.0).normalize());
    // The default opening of 1 mm at the stop is 2 mm in front of it.
    assert!((camera.ray(Vec2::splat(1.0), [1.0, 0.5], 0.0).origin.length() - 1e-3).abs() < 1e-7);
    scene.camera.params = entity("realistic", vec![text("lensfile", "none.dat")]).params;
    assert!(build(&scene).is_err());
    scene.camera.params = entity("realistic", vec![]).params;
    assert!(build(&scene).is_err());
}
