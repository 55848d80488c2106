//! What a scene says about its image: size, crop, sensor and output name. Source: pbrt-v4's file format (Film) and its
//! section 5.4 (film and imaging).

use glam::Mat3;

use crate::math::Rgb;
use crate::math::spectrum::white_balance;
use crate::scene::older::with_upgrade;
use crate::scene::{Entity, SceneDescription, SceneError, SceneErrorKind, Warnings};

use super::filter::PixelFilter;
use super::gbuffer::Coordinates;
use super::image::MAX_PIXELS;
use super::{PixelBounds, SampleResult};

/// The image to make.
#[derive(Clone, Debug)]
pub struct FilmSettings {
    /// Width and height of the full image in pixels.
    pub resolution: [u32; 2],
    /// The pixels to render; never empty.
    pub bounds: PixelBounds,
    /// The output file that the scene names.
    pub filename: Option<String>,
    /// From radiance to pixel values.
    pub sensor: Sensor,
    /// How samples spread over neighbouring pixels.
    pub filter: PixelFilter,
    /// Whether it records the surfaces that are seen first, and relative to what.
    pub gbuffer: Option<Coordinates>,
}

/// What the command line puts in place of what the scene says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmOverrides {
    /// Width and height. A crop by pixels in the scene is then scaled along.
    pub resolution: Option<[u32; 2]>,
    /// Crop as fractions x0, x1, y0, y1 of the image, in 0..=1.
    pub crop: Option<[f32; 4]>,
}

/// From radiance to pixel values (pbrt-v4's sensor `cie1931`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Exposure time (shutter close − open) × ISO / 100.
    pub imaging_ratio: f32,
    /// Samples whose largest channel exceeds this are scaled down to it. Finite values make the image biased.
    pub max_component: f32,
    /// What colours are multiplied by after that, to balance white.
    pub balance: Option<Mat3>,
}

impl Default for Sensor {
    fn default() -> Self {
        Self { imaging_ratio: 1.0, max_component: f32::INFINITY, balance: None }
    }
}

impl Sensor {
    /// The pixel values of a sample that counts `weight`. The parts of the beauty shrink with it, so that they still sum to it.
    #[inline]
    pub fn expose(&self, sample: &SampleResult, weight: f32) -> SampleResult {
        let peak = sample.beauty.max_channel() * self.imaging_ratio;
        let scale = if peak > self.max_component {
            self.imaging_ratio * (self.max_component / peak)
        } else {
            self.imaging_ratio
        } * weight;
        let exposed = |radiance: Rgb| match &self.balance {
            None => radiance * scale,
            Some(matrix) => Rgb(*matrix * (radiance.0 * scale)),
        };
        SampleResult {
            beauty: exposed(sample.beauty),
            direct: exposed(sample.direct),
            indirect: exposed(sample.indirect),
            emission: exposed(sample.emission),
            volume: exposed(sample.volume),
            ..*sample
        }
    }

    /// Whether bright samples are cut, which makes the image darker than it should be.
    pub fn is_biased(&self) -> bool {
        self.max_component.is_finite()
    }
}

impl FilmSettings {
    /// The film, sensor and filter of `scene`. Film type `spectral` is made as `rgb` with a warning; real
    /// sensors as `cie1931`. `savefp16` has no effect, since files are always 32-bit, and `diagonal` only where the camera has a lens
    /// of many surfaces.
    ///
    /// # Errors
    /// Unknown film types and parameters out of range.
    pub fn build(
        scene: &SceneDescription,
        overrides: &FilmOverrides,
        warnings: &mut Warnings,
    ) -> Result<Self, Box<SceneError>> {
        let film = &scene.film;
        let params = &film.params;
        match film.kind.as_str() {
            "rgb" | "" => {}
            "gbuffer" => {}
            "spectral" => {
                for name in ["nbuckets", "lambdamin", "lambdamax"] {
                    params.get(name);
                }
                warnings.add(Some(film.span()), format!("film type \"{}\" is rendered as \"rgb\"", film.kind));
            }
            other => {
                let message = format!("film type \"{other}\" is not known");
                return Err(SceneError::at(film.span(), SceneErrorKind::Unsupported(message)).help(with_upgrade(
                    "Film",
                    other,
                    "use a film of type \"rgb\"",
                )));
            }
        }
        let stated = [extent(film, "xresolution", 1280)?, extent(film, "yresolution", 720)?];
        let resolution = overrides.resolution.unwrap_or(stated);
        if resolution[0] as usize * resolution[1] as usize > MAX_PIXELS {
            let message = format!("{} × {} pixels are more than {MAX_PIXELS}", resolution[0], resolution[1]);
            return Err(SceneError::at(film.span(), SceneErrorKind::Limit(message)));
        }
        let bounds = crop(film, overrides, stated, resolution, warnings)?;
        let filename = params.string("filename")?.map(str::to_owned);
        let sensor = sensor(scene, warnings)?;
        let gbuffer = if film.kind == "gbuffer" { Some(coordinates(film)?) } else { None };
        // The realistic camera asks for the first; files hold floats of 32 bits, whatever the second says.
        for name in ["diagonal", "savefp16"] {
            params.get(name);
        }
        params.warn_unused(warnings);
        let filter = PixelFilter::build(&scene.filter, warnings)?;
        Ok(Self { resolution, bounds, filename, sensor, filter, gbuffer })
    }
}

fn coordinates(film: &Entity) -> Result<Coordinates, Box<SceneError>> {
    match film.params.string("coordinatesystem")? {
        None | Some("camera") => Ok(Coordinates::Camera),
        Some("world") => Ok(Coordinates::World),
        Some(_) => Err(film.params.wrong("coordinatesystem", "\"camera\" or \"world\"")),
    }
}

fn sensor(scene: &SceneDescription, warnings: &mut Warnings) -> Result<Sensor, Box<SceneError>> {
    let film = &scene.film;
    let params = &film.params;
    let iso = params.positive("iso", 100.0)?;
    let max_component = params.positive("maxcomponentvalue", f32::INFINITY)?;
    if let Some(name) = params.string("sensor")?.filter(|name| *name != "cie1931") {
        let span = params.get("sensor").map(|p| p.span);
        warnings
            .add(span, format!("sensor \"{name}\" is rendered as \"cie1931\": its response curves are not modelled"));
    }
    let kelvin = params.float("whitebalance", 0.0)?;
    let balance = if kelvin == 0.0 { None } else { white_balance(kelvin) };
    if kelvin != 0.0 && balance.is_none() {
        let message = format!("\"whitebalance\" of {kelvin} K is not applied: it is for 1000 to 25000 K");
        warnings.add(params.get("whitebalance").map(|p| p.span), message);
    }
    let camera = &scene.camera.params;
    let exposure = camera.float("shutterclose", 1.0)? - camera.float("shutteropen", 0.0)?;
    if exposure.is_nan() || exposure <= 0.0 {
        let message = "\"shutterclose\" must be after \"shutteropen\"".to_owned();
        return Err(SceneError::at(scene.camera.span(), SceneErrorKind::Parameter(message))
            .help("the image would be black: exposure is proportional to the time that the shutter is open"));
    }
    if max_component.is_finite() {
        let span = params.get("maxcomponentvalue").map(|p| p.span);
        let message = format!("the image is biased: samples brighter than {max_component} are cut down to it");
        warnings.add(span, message);
    }
    if scene.film_color_space != "srgb" {
        let message =
            format!("the image is written in sRGB's primaries, not in those of \"{}\"", scene.film_color_space);
        warnings.add(Some(film.span()), message);
    }
    Ok(Sensor { imaging_ratio: exposure * iso / 100.0, max_component, balance })
}

/// The pixels to render. Later sources win: `pixelbounds`, `cropwindow`, the command line.
fn crop(
    film: &Entity,
    overrides: &FilmOverrides,
    stated: [u32; 2],
    resolution: [u32; 2],
    warnings: &mut Warnings,
) -> Result<PixelBounds, Box<SceneError>> {
    let params = &film.params;
    let mut bounds = PixelBounds::full(resolution[0], resolution[1]);
    match *params.integers("pixelbounds")? {
        [] => {}
        [x0, x1, y0, y1] => {
            if [x0, x1].iter().any(|x| !(0..=stated[0] as i32).contains(x))
                || [y0, y1].iter().any(|y| !(0..=stated[1] as i32).contains(y))
            {
                warnings.add(Some(film.span()), "\"pixelbounds\" reach beyond the image: they are cut off there");
            }
            // Pixels of the stated resolution; an overridden one scales them.
            let scale = |v: i32, axis: usize| v as f32 / stated[axis] as f32;
            bounds = fraction(resolution, [scale(x0, 0), scale(x1, 0), scale(y0, 1), scale(y1, 1)]);
            if resolution == stated {
                let at = |v: i32, axis: usize| v.clamp(0, stated[axis] as i32) as u32;
                bounds = PixelBounds { x0: at(x0, 0), x1: at(x1, 0), y0: at(y0, 1), y1: at(y1, 1) };
            }
        }
        _ => params.pass_over("pixelbounds", "four integers x0 x1 y0 y1", "they are ignored", warnings),
    }
    match *params.floats("cropwindow")? {
        [] => {}
        [a, b, c, d] => {
            if params.has("pixelbounds") {
                warnings.add(Some(film.span()), "\"cropwindow\" is used, \"pixelbounds\" is not");
            }
            // In either order, as pbrt-v4 takes them.
            bounds = fraction(resolution, [a.min(b), a.max(b), c.min(d), c.max(d)]);
        }
        _ => params.pass_over("cropwindow", "four numbers x0 x1 y0 y1", "it is ignored", warnings),
    }
    if let Some(window) = overrides.crop {
        bounds = fraction(resolution, window);
    }
    if bounds.x0 >= bounds.x1 || bounds.y0 >= bounds.y1 {
        let message = "the crop leaves no pixel to render".to_owned();
        return Err(SceneError::at(film.span(), SceneErrorKind::Parameter(message)).help("give x0 < x1 and y0 < y1"));
    }
    Ok(bounds)
}

/// pbrt's rounding: the pixels from ⌈x0 · width⌉ up to but without ⌈x1 · width⌉. Adjoining crops share no pixel.
fn fraction(resolution: [u32; 2], [x0, x1, y0, y1]: [f32; 4]) -> PixelBounds {
    let at = |v: f32, axis: usize| (v.clamp(0.0, 1.0) * resolution[axis] as f32).ceil() as u32;
    PixelBounds { x0: at(x0, 0), x1: at(x1, 0), y0: at(y0, 1), y1: at(y1, 1) }
}

fn extent(film: &Entity, name: &str, default: i32) -> Result<u32, Box<SceneError>> {
    match film.params.integer(name, default)? {
        n @ 1..=0x00ff_ffff => Ok(n as u32),
        _ => Err(film.params.wrong(name, "from 1 to 16777215")),
    }
}
