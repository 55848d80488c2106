//! The images and photometric files that lights name. What many lights share is read and worked out once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{Mat3, Vec3};

use super::{Builder, Result};
use crate::film::image::{Encoding, Image, ImageError, read_image};
use crate::film::stored_image::read_header;
use crate::light::area::pattern::{EmissionImage, ImageSums};
use crate::light::goniometric::IntensityDistribution;
use crate::light::ies::IesProfile;
use crate::light::ies::read::read_ies;
use crate::light::projection::Slide;
use crate::light::sphere_image::{Layout, SphereImage};
use crate::scene::{ParamSet, SceneError, SceneErrorKind};
use crate::system::memory::available;

/// What a pixel takes while a light is made of its image, beside the image itself.
const BYTES_A_PIXEL: u64 = 40;

/// What has been read so far.
#[derive(Default)]
pub(super) struct Files {
    /// By file and the bits of the luminaire's tilt.
    profiles: HashMap<(PathBuf, u32), Arc<IesProfile>>,
    /// Of profiles, by their address, alone and within spots, by the bits of their cosines.
    pub luminaires: HashMap<(usize, Option<[u32; 2]>), Arc<IntensityDistribution>>,
    /// Images around points.
    pub spheres: HashMap<PathBuf, Arc<IntensityDistribution>>,
    /// Images in projectors.
    slides: HashMap<PathBuf, Arc<Slide>>,
    /// Images on emitters.
    emissions: HashMap<PathBuf, (Arc<EmissionImage>, Arc<ImageSums>)>,
}

/// An image as lights take it: RGB, nothing negative, nothing infinite.
pub(super) struct Colours {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 3]>,
}

impl Builder<'_> {
    /// Says so where an image stands beside the colour that it could be in place of.
    pub(super) fn warn_of_both(&mut self, params: &ParamSet) {
        if params.has("L") {
            let what = "pbrt-v4 refuses \"L\" beside \"filename\": here it multiplies the image";
            self.warnings.add(Some(params.span), what);
        }
    }

    /// The image `name`; what of it is negative or not finite becomes 0, with a warning. An image that is not there is magenta, as those on surfaces.
    pub(super) fn colours(&mut self, params: &ParamSet, name: &str) -> Result<Colours> {
        let path = self.scene.resolve(name);
        if !self.strict && !path.exists() {
            let message = format!("there is no file {}: the light is magenta", path.display());
            self.warnings.add(Some(params.span), message);
            return Ok(Colours { width: 1, height: 1, pixels: vec![[1.0, 0.0, 1.0]] });
        }
        let failed = |error: ImageError| {
            let kind = match error.is_limit {
                true => SceneErrorKind::Limit(error.to_string()),
                false => SceneErrorKind::File { path: error.path, reason: error.reason },
            };
            SceneError::at(params.span, kind)
        };
        let header = read_header(&path).map_err(failed)?;
        if let Some(message) = header.warning(&path) {
            self.warnings.add(Some(params.span), message);
        }
        let image = read_image(&path, Encoding::Auto).map_err(failed)?;
        // The triples, and what they are chosen by.
        let needed = (image.width * image.height) as u64 * BYTES_A_PIXEL;
        if available().is_some_and(|left| needed > left) {
            let what =
                format!("a light's image of {} × {} pixels takes more memory than is left", image.width, image.height);
            return Err(SceneError::at(params.span, SceneErrorKind::Limit(what)));
        }
        let (pixels, bad) = rgb_pixels(&image, header.to_rec709.matrix());
        if bad > 0 {
            let message = format!("{bad} pixels of \"{name}\" are negative or not finite: taken as 0");
            if self.strict {
                return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
            }
            self.warnings.add(Some(params.span), message);
        }
        Ok(Colours { width: image.width, height: image.height, pixels })
    }

    /// `colours` of the image `name` as an image around the sphere: how it lies there follows from its shape.
    pub(super) fn sphere_image(&mut self, params: &ParamSet, name: &str, colours: Colours) -> Result<SphereImage> {
        let Colours { width, height, pixels } = colours;
        let layout = if width == height {
            Layout::Octahedral
        } else if width == 2 * height {
            self.warnings.add(
                Some(params.span),
                format!("\"{name}\" is twice as wide as high: taken as latitude and longitude (pbrt-v4 wants a square, equal-area image)"),
            );
            Layout::LatLong
        } else {
            let message = format!(
                "environment image \"{name}\" is {width}×{height}, neither square (equal-area) nor 2:1 (latitude, longitude)"
            );
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
        };
        Ok(SphereImage::new(layout, width, height, pixels))
    }

    /// The slide `name`.
    pub(super) fn slide(&mut self, params: &ParamSet, name: &str) -> Result<Arc<Slide>> {
        let path = self.scene.resolve(name);
        if let Some(slide) = self.files.slides.get(&path) {
            return Ok(slide.clone());
        }
        let Colours { width, height, pixels } = self.colours(params, name)?;
        let slide = Arc::new(Slide::new(width, height, pixels));
        self.files.slides.insert(path, slide.clone());
        Ok(slide)
    }

    /// The image `name` on an emitter.
    pub(super) fn emission_image(
        &mut self,
        params: &ParamSet,
        name: &str,
    ) -> Result<(Arc<EmissionImage>, Arc<ImageSums>)> {
        let path = self.scene.resolve(name);
        if let Some(found) = self.files.emissions.get(&path) {
            return Ok(found.clone());
        }
        let Colours { width, height, pixels } = self.colours(params, name)?;
        let image = EmissionImage::new(width, height, pixels);
        let sums = ImageSums::new(&image);
        let both = (Arc::new(image), Arc::new(sums));
        self.files.emissions.insert(path, both.clone());
        Ok(both)
    }

    /// The photometric file that `params` names as `ies`, for a luminaire tilted by `iestilt`.
    pub(super) fn profile(&mut self, params: &ParamSet) -> Result<Option<Arc<IesProfile>>> {
        let Some(name) = params.string("ies")? else { return Ok(None) };
        let tilt = params.float("iestilt", 0.0)?;
        let path = self.scene.resolve(name);
        let key = (path, tilt.to_bits());
        if let Some(profile) = self.files.profiles.get(&key) {
            return Ok(Some(profile.clone()));
        }
        let span = params.get("ies").map_or(params.span, |param| param.span);
        let profile = read_ies(&key.0, tilt).map_err(|error| {
            SceneError::at(span, SceneErrorKind::File { path: key.0.clone(), reason: error.to_string() })
        })?;
        let profile = Arc::new(profile);
        self.files.profiles.insert(key, profile.clone());
        Ok(Some(profile))
    }
}

/// The pixels of `image` in Rec. 709, and how many of them were negative or not finite, of which that is made 0. Colours outside the gamut, which come of a
/// wider one, come to its edge.
fn rgb_pixels(image: &Image, to_rec709: Option<Mat3>) -> (Vec<[f32; 3]>, usize) {
    let mut bad = 0;
    let pixels = image
        .pixels
        .chunks_exact(image.channels.max(1))
        .map(|pixel| {
            let rgb = if pixel.len() >= 3 { [pixel[0], pixel[1], pixel[2]] } else { [pixel[0]; 3] };
            let rgb = match to_rec709 {
                None => rgb,
                Some(matrix) => {
                    let inside = rgb.into_iter().all(|c| c >= 0.0);
                    let converted: [f32; 3] = (matrix * Vec3::from(rgb)).into();
                    if inside { converted.map(|c| if c < 0.0 { 0.0 } else { c }) } else { converted }
                }
            };
            let good = |c: f32| c >= 0.0 && c.is_finite();
            bad += usize::from(!rgb.into_iter().all(good));
            rgb.map(|c| if good(c) { c } else { 0.0 })
        })
        .collect();
    (pixels, bad)
}
