//! The perspective camera: from film positions to rays, with depth of field and motion.
//!
//! Source: pbrt-v4, sections 5.2 (projective cameras), 5.2.3 (thin lens) and 3.11 (animated transforms). Camera space looks
//! along +z with x to the right and y up, before whatever the camera transform does to it.

use glam::{Affine3A, DAffine3, DMat4, Vec2, Vec3};

use super::Ray;
use crate::film::FilmSettings;
use crate::math::transform::{Decomposed, RenderSpace};
use crate::math::warp::concentric_disk;
use crate::scene::{SceneDescription, SceneError, SceneErrorKind, Warnings};

/// A perspective camera in render space.
#[derive(Clone, Debug)]
pub struct Camera {
    to_render: CameraMotion,
    /// The point of the plane z = 1 in camera space that the image's top left corner looks at.
    corner: Vec2,
    /// What one pixel to the right and one pixel down add to it.
    per_pixel: Vec2,
    lens_radius: f32,
    focal_distance: f32,
    /// Shutter opening and closing as normalised times; nothing moves outside 0..=1.
    shutter: [f32; 2],
}

#[derive(Clone, Debug)]
enum CameraMotion {
    Fixed(Affine3A),
    Moving(Box<(Decomposed, Decomposed)>),
}

impl Camera {
    /// The camera that `scene` describes, for a film of that resolution.
    ///
    /// # Errors
    /// Camera types other than `perspective`, senseless parameters, and transforms that cannot be inverted.
    pub fn build(
        scene: &SceneDescription,
        film: &FilmSettings,
        space: &RenderSpace,
        warnings: &mut Warnings,
    ) -> Result<Self, Box<SceneError>> {
        let entity = &scene.camera;
        let params = &entity.params;
        // A scene without a Camera directive gets pbrt's default.
        if !matches!(entity.kind.as_str(), "perspective" | "") {
            let message = format!("camera type \"{}\" is not supported", entity.kind);
            return Err(SceneError::at(entity.span(), SceneErrorKind::Unsupported(message))
                .help("use a camera of type \"perspective\""));
        }
        let [width, height] = film.resolution.map(|n| n as f32);
        let aspect = params.positive("frameaspectratio", width / height)?;
        let screen = match *params.floats("screenwindow")? {
            // The shorter axis spans −1..=1, so that `fov` is the angle across it.
            [] if aspect > 1.0 => [-aspect, aspect, -1.0, 1.0],
            [] => [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect],
            [x0, x1, y0, y1] if x0 != x1 && y0 != y1 => [x0, x1, y0, y1],
            _ => return Err(params.wrong("screenwindow", "four numbers x0 x1 y0 y1 that span an area")),
        };
        let fov = params.float("fov", 90.0)?;
        if !(fov > 0.0 && fov < 180.0) {
            return Err(params.wrong("fov", "an angle above 0 and below 180 degrees"));
        }
        let lens_radius = params.float("lensradius", 0.0)?;
        if lens_radius < 0.0 {
            return Err(params.wrong("lensradius", "a radius of at least 0"));
        }
        let focal_distance = params.positive("focaldistance", 1e6)?;
        let shutter = [params.float("shutteropen", 0.0)?, params.float("shutterclose", 1.0)?];
        params.warn_unused(warnings);

        let zoom = (0.5 * fov).to_radians().tan();
        let [x0, x1, y0, y1] = screen.map(|s| s * zoom);
        Ok(Self {
            to_render: CameraMotion::build(scene, space)?,
            corner: Vec2::new(x0, y1),
            per_pixel: Vec2::new((x1 - x0) / width, (y0 - y1) / height),
            lens_radius,
            focal_distance,
            shutter: shutter.map(|time| normalised_time(f64::from(time), scene.transform_times)),
        })
    }

    /// The ray through `film_position` (in pixels of the full image from its top left corner, y downwards), `lens` in the
    /// unit square, `u_time` in 0..1 from shutter opening to closing. The direction is unit length, `t_max` infinite.
    #[inline]
    pub fn ray(&self, film_position: Vec2, lens: [f32; 2], u_time: f32) -> Ray {
        let target = (self.corner + film_position * self.per_pixel).extend(1.0);
        let (origin, direction) = if self.lens_radius > 0.0 {
            let on_lens = (concentric_disk(lens) * self.lens_radius).extend(0.0);
            (on_lens, target * self.focal_distance - on_lens)
        } else {
            (Vec3::ZERO, target)
        };
        let time = self.time(u_time);
        let to_render = match &self.to_render {
            CameraMotion::Fixed(to_render) => *to_render,
            CameraMotion::Moving(keys) => to_f32(&keys.0.interpolate(&keys.1, f64::from(time))),
        };
        Ray {
            origin: to_render.transform_point3(origin),
            direction: to_render.transform_vector3(direction).normalize(),
            t_max: f32::INFINITY,
            time,
            opacity_seed: 0,
        }
    }

    /// The normalised time (0..=1 over the interval of the transforms' keys) for `u_time` in 0..1 of the open shutter.
    #[inline]
    pub fn time(&self, u_time: f32) -> f32 {
        let [open, close] = self.shutter;
        (open + u_time * (close - open)).clamp(0.0, 1.0)
    }

    /// Where on the film (in pixels of the full image) the point `p` of render space is seen when the shutter opens, through the lens's
    /// middle; `None` behind the camera.
    pub fn project(&self, p: Vec3) -> Option<Vec2> {
        let to_render = match &self.to_render {
            CameraMotion::Fixed(to_render) => *to_render,
            CameraMotion::Moving(keys) => to_f32(&keys.0.interpolate(&keys.1, f64::from(self.time(0.0)))),
        };
        let p = to_render.inverse().transform_point3(p);
        (p.z > 0.0).then(|| (p.truncate() / p.z - self.corner) / self.per_pixel).filter(|pixel| pixel.is_finite())
    }

    /// What a pixel in the middle of the image spans at distance 1.
    pub fn pixel_angle(&self) -> f32 {
        self.per_pixel.abs().max_element()
    }

    /// Shutter opening and closing as normalised times; nothing moves outside 0..=1.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    /// Whether rays start all over a lens; if not, `lens` is not looked at.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Whether the camera itself moves while the shutter is open.
    pub fn is_moving(&self) -> bool {
        matches!(self.to_render, CameraMotion::Moving(_))
    }
}

impl CameraMotion {
    fn build(scene: &SceneDescription, space: &RenderSpace) -> Result<Self, Box<SceneError>> {
        let key = |world_to_camera: &DMat4| {
            let to_render = space.from_world(&world_to_camera.inverse());
            Decomposed::new(&to_render).map(|decomposed| (to_render, decomposed)).ok_or_else(|| {
                let message = "the camera's transform cannot be inverted".to_owned();
                SceneError::at(scene.camera.span(), SceneErrorKind::Parameter(message))
                    .help("a Scale by 0 or a LookAt along its up vector does this")
            })
        };
        let (fixed, start) = key(&scene.camera_transform.start)?;
        if !scene.camera_transform.is_animated() {
            return Ok(Self::Fixed(to_f32(&fixed)));
        }
        let (_, end) = key(&scene.camera_transform.end)?;
        Ok(Self::Moving(Box::new((start, end))))
    }
}

fn to_f32(affine: &DAffine3) -> Affine3A {
    Affine3A::from_mat3_translation(affine.matrix3.as_mat3(), affine.translation.as_vec3())
}

/// `time` as a number that is 0 at `start` and 1 at `end`; outside them where the shutter opens before the motion or closes after it.
fn normalised_time(time: f64, [start, end]: [f64; 2]) -> f32 {
    if end > start { ((time - start) / (end - start)) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
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

    fn build(scene: &SceneDescription) -> Result<Camera, Box<SceneError>> {
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
        scene.camera.kind = "spherical".into();
        let error = build(&scene).expect_err("not a perspective camera");
        assert!(matches!(&error.kind, SceneErrorKind::Unsupported(m) if m.contains("spherical")));
        for (name, value) in [("fov", 180.0), ("fov", 0.0), ("lensradius", -1.0), ("focaldistance", 0.0)] {
            assert!(build(&world(vec![floats(name, &[value])], [10, 10])).is_err(), "{name} {value}");
        }
        assert!(build(&world(vec![floats("screenwindow", &[0.0, 0.0, 1.0, 2.0])], [10, 10])).is_err());
        let mut flat = world(vec![], [10, 10]);
        flat.camera_transform = Animated::fixed(DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)));
        assert!(build(&flat).is_err());
    }
}
