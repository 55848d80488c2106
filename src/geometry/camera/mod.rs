//! Cameras: from film positions to rays, with depth of field and motion.
//!
//! Source: pbrt-v4, chapter 5, and section 3.11 for animated transforms. Camera space looks along +z with x to the right and y up, before whatever
//! the camera transform does to it.

pub(crate) mod prescription;
mod projection;
#[cfg(test)]
mod tests;

use glam::{Affine3A, DAffine3, DMat4, Vec2, Vec3};

use self::prescription::Prescription;
pub use self::projection::PixelSpan;
use self::projection::{Lens, Mapping, Projection, Screen};
use super::Ray;
use crate::film::FilmSettings;
use crate::math::transform::{Decomposed, RenderSpace};
use crate::scene::older::with_upgrade;
use crate::scene::{ParamSet, SceneDescription, SceneError, SceneErrorKind, Warnings};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// A camera in render space.
#[derive(Clone, Debug)]
pub struct Camera {
    to_render: CameraMotion,
    projection: Projection,
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
    /// Unknown camera types, senseless parameters, lens files that are none, and transforms that cannot be inverted.
    pub fn build(
        scene: &SceneDescription,
        film: &FilmSettings,
        space: &RenderSpace,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        let entity = &scene.camera;
        let params = &entity.params;
        let size = Vec2::from_array(film.resolution.map(|n| n as f32));
        let projection = match entity.kind.as_str() {
            // A scene without a Camera directive gets pbrt's default.
            "perspective" | "" => perspective(params, size, warnings)?,
            "orthographic" => {
                Projection::Orthographic { screen: screen(params, size, 1.0, warnings)?, lens: lens(params)? }
            }
            "spherical" => {
                // pbrt-v4 reads these and makes nothing of them.
                for name in ["lensradius", "focaldistance", "screenwindow", "frameaspectratio"] {
                    params.get(name);
                }
                Projection::Spherical { per_pixel: size.recip(), mapping: mapping(params)? }
            }
            "realistic" => realistic(scene, size, warnings)?,
            other => {
                let message = format!("camera type \"{other}\" is not known");
                return Err(SceneError::at(entity.span(), SceneErrorKind::Unsupported(message)).help(with_upgrade(
                    "Camera",
                    other,
                    "use \"perspective\", \"orthographic\", \"spherical\" or \"realistic\"",
                )));
            }
        };
        let shutter = shutter(scene)?;
        params.warn_unused(warnings);
        Ok(Self { to_render: CameraMotion::build(scene, space)?, projection, shutter })
    }

    /// The ray through `film_position` (in pixels of the full image from its top left corner, y downwards), `lens` in the
    /// unit square, `u_time` in 0..1 from shutter opening to closing. The direction is unit length, `t_max` infinite.
    #[inline]
    pub fn ray(&self, film_position: Vec2, lens: [f32; 2], u_time: f32) -> Ray {
        let (origin, direction) = self.projection.ray(film_position, lens);
        let time = self.time(u_time);
        let to_render = self.to_render(time);
        Ray {
            origin: to_render.transform_point3(origin),
            direction: to_render.transform_vector3(direction).normalize(),
            t_max: f32::INFINITY,
            time,
            opacity_seed: 0,
        }
    }

    /// From camera space to render space at the normalised `time`.
    #[inline]
    pub fn to_render(&self, time: f32) -> Affine3A {
        match &self.to_render {
            CameraMotion::Fixed(to_render) => *to_render,
            CameraMotion::Moving(keys) => to_f32(&keys.0.interpolate(&keys.1, f64::from(time))),
        }
    }

    /// The normalised time (0..=1 over the interval of the transforms' keys) for `u_time` in 0..1 of the open shutter.
    #[inline]
    pub fn time(&self, u_time: f32) -> f32 {
        let [open, close] = self.shutter;
        (open + u_time * (close - open)).clamp(0.0, 1.0)
    }

    /// Where on the film (in pixels of the full image) the point `p` of render space is seen when the shutter opens, through the lens's
    /// middle; `None` where it is not, behind the camera say.
    pub fn project(&self, p: Vec3) -> Option<Vec2> {
        let p = self.to_render(self.time(0.0)).inverse().transform_point3(p);
        self.projection.film(p)
    }

    /// What a pixel in the middle of the image spans.
    pub fn pixel_span(&self) -> PixelSpan {
        self.projection.pixel_span()
    }

    /// Shutter opening and closing as normalised times; nothing moves outside 0..=1.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    /// Whether rays start all over a lens; if not, `lens` is not looked at.
    pub fn has_lens(&self) -> bool {
        self.projection.has_lens()
    }

    /// Whether the camera itself moves while the shutter is open.
    pub fn is_moving(&self) -> bool {
        matches!(self.to_render, CameraMotion::Moving(_))
    }
}

impl CameraMotion {
    fn build(scene: &SceneDescription, space: &RenderSpace) -> Result<Self> {
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

/// [`Camera::shutter`] of the scene's camera.
///
/// # Errors
/// Parameters of the wrong type.
pub fn shutter(scene: &SceneDescription) -> Result<[f32; 2]> {
    let params = &scene.camera.params;
    let times = [params.float("shutteropen", 0.0)?, params.float("shutterclose", 1.0)?];
    Ok(times.map(|time| normalised_time(f64::from(time), scene.transform_times)))
}

/// `time` as a number that is 0 at `start` and 1 at `end`; outside them where the shutter opens before the motion or closes after it.
fn normalised_time(time: f64, [start, end]: [f64; 2]) -> f32 {
    if end > start { ((time - start) / (end - start)) as f32 } else { 0.0 }
}

/// The plane that pbrt's cameras stretch the image over: its shorter axis spans ±`half`.
fn screen(params: &ParamSet, size: Vec2, half: f32, warnings: &mut Warnings) -> Result<Screen> {
    let aspect = params.positive("frameaspectratio", size.x / size.y)?;
    let default = if aspect > 1.0 { [-aspect, aspect, -1.0, 1.0] } else { [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect] };
    let window = match *params.floats("screenwindow")? {
        [] => default,
        [x0, x1, y0, y1] if x0 != x1 && y0 != y1 => [x0, x1, y0, y1],
        [_, _, _, _] => return Err(params.wrong("screenwindow", "four numbers x0 x1 y0 y1 that span an area")),
        _ => {
            params.pass_over("screenwindow", "four numbers x0 x1 y0 y1", "the whole window is taken", warnings);
            default
        }
    };
    let [x0, x1, y0, y1] = window.map(|s| s * half);
    Ok(Screen { corner: Vec2::new(x0, y1), per_pixel: Vec2::new((x1 - x0) / size.x, (y0 - y1) / size.y) })
}

fn lens(params: &ParamSet) -> Result<Lens> {
    let radius = params.float("lensradius", 0.0)?;
    if radius < 0.0 {
        return Err(params.wrong("lensradius", "a radius of at least 0"));
    }
    let focal_distance = params.float("focaldistance", 1e6)?;
    // Without a lens nothing is focused, and exporters write 0 then.
    if focal_distance.is_nan() || (radius > 0.0 && focal_distance <= 0.0) {
        return Err(params.wrong("focaldistance", "above 0"));
    }
    Ok(Lens { radius, focal_distance })
}

fn perspective(params: &ParamSet, size: Vec2, warnings: &mut Warnings) -> Result<Projection> {
    let fov = params.float("fov", 90.0)?;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(params.wrong("fov", "an angle above 0 and below 180 degrees"));
    }
    let screen = screen(params, size, (0.5 * fov).to_radians().tan(), warnings)?;
    Ok(Projection::Perspective { screen, lens: lens(params)? })
}

fn mapping(params: &ParamSet) -> Result<Mapping> {
    match params.string("mapping")? {
        None | Some("equalarea") => Ok(Mapping::EqualArea),
        Some("equirectangular") => Ok(Mapping::Equirectangular),
        Some(_) => Err(params.wrong("mapping", "\"equalarea\" or \"equirectangular\"")),
    }
}

/// A thin lens with the focal length, the aperture and the distance in focus of pbrt's lens of many surfaces, before a film of its diagonal.
fn realistic(scene: &SceneDescription, size: Vec2, warnings: &mut Warnings) -> Result<Projection> {
    const METRES: f32 = 1e-3;
    let params = &scene.camera.params;
    let Some(name) = params.string("lensfile")? else {
        return Err(params.wrong("lensfile", "the file that describes the lens"));
    };
    let span = params.get("lensfile").map_or(params.span, |param| param.span);
    let lens = Prescription::read(&scene.resolve(name), span)?;
    // pbrt-v4 takes an aperture wider than the stop as the stop.
    let opening = params.positive("aperturediameter", 1.0)?.min(lens.stop_diameter);
    let radius = 0.5 * opening * lens.pupil_magnification * METRES;
    let focal_distance = params.positive("focusdistance", 10.0)?;
    let focal_length = lens.focal_length * METRES;
    if focal_distance <= focal_length {
        return Err(params.wrong("focusdistance", &format!("above the lens's focal length, {focal_length} metres")));
    }
    let film_distance = 1.0 / (1.0 / focal_length - 1.0 / focal_distance);
    let diagonal = scene.film.params.positive("diagonal", 35.0)? * METRES;
    params.warn_ignored("aperture", "it is round", warnings);
    let message = format!(
        "the realistic camera is rendered as a thin lens of {} mm: it has no distortion and no vignetting",
        lens.focal_length
    );
    warnings.add(Some(span), message);
    // At the distance 1, the film's size is divided by its own distance.
    let per_pixel = diagonal / size.length() / film_distance;
    let screen =
        Screen { corner: Vec2::new(-0.5, 0.5) * size * per_pixel, per_pixel: Vec2::new(per_pixel, -per_pixel) };
    Ok(Projection::Perspective { screen, lens: Lens { radius, focal_distance } })
}
