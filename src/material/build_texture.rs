//! From `Texture` directives to [`Textures`]: only what something refers to is built, each once, and each image file is read
//! once for each encoding.
//!
//! Kinds: `constant`, `scale`, `imagemap`, and those of `build_procedural.rs`. Any other kind is named in a warning and stands for 1 (float) or 50 % grey
//! (spectrum). A file that cannot be read is named in a warning and stands for 1 or magenta; under `strict` it is an error.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::image_texture::{Filter, ImageMap, MAGENTA, Wrap};
use super::mip_map::MipMap;
use super::mip_map::memory::TextureMemory;
use super::procedural::{Marble, NoiseTexture, Weight};
use super::texture::{FloatInput, FloatTexture, RgbInput, RgbTexture, Textures};
use crate::film::image::Encoding;
use crate::film::stored_image::read_header;
use crate::math::Rgb;
use crate::scene::{
    Param, ParamSet, SceneDescription, SceneError, SceneErrorKind, Span, TextureEntity, TextureOr, Warnings,
};

pub(super) type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Textures within textures beyond this are refused: a file may nest as deeply as it likes, the stack may not.
const DEEPEST: usize = 64;

/// The longest ellipse of the EWA filter, in its widths: more only takes more time.
const MOST_ANISOTROPY: f32 = 64.0;

/// Look-ups of images, of noise and of blends that one look-up of a texture may come to: textures that name each other twice double it at every level.
const MOST_LOOKUPS: u32 = 1024;

/// What has been built and read so far.
#[derive(Debug, Default)]
pub struct Loader {
    /// Places in the scene's list by name and kind (whether it yields spectra); of several with one name, the last.
    places: HashMap<(String, bool), usize>,
    floats: HashMap<String, FloatInput>,
    rgbs: HashMap<String, RgbInput>,
    images: HashMap<(PathBuf, EncodingKey), Option<Arc<MipMap>>>,
}

/// [`Encoding`] in a form that can be looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum EncodingKey {
    Auto,
    Linear,
    Srgb,
    Gamma(u32),
}

impl From<Encoding> for EncodingKey {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Auto => Self::Auto,
            Encoding::Linear => Self::Linear,
            Encoding::Srgb => Self::Srgb,
            Encoding::Gamma(gamma) => Self::Gamma(gamma.to_bits()),
        }
    }
}

impl Loader {
    /// Has read nothing yet.
    pub fn new(scene: &SceneDescription) -> Self {
        let key = |(place, texture): (usize, &TextureEntity)| ((texture.name.clone(), texture.is_spectrum), place);
        Self { places: scene.textures.iter().enumerate().map(key).collect(), ..Self::default() }
    }

    /// The images that something refers to.
    pub fn images(&self) -> impl Iterator<Item = &MipMap> {
        self.images.values().flatten().map(|image| &**image)
    }
}

/// Builds textures on demand.
pub(super) struct TextureBuilder<'a> {
    pub scene: &'a SceneDescription,
    pub strict: bool,
    pub warnings: &'a mut Warnings,
    pub textures: &'a mut Textures,
    pub loader: &'a mut Loader,
    pub memory: &'a Arc<TextureMemory>,
    /// The textures being built, to notice those that contain themselves.
    pub open: Vec<(String, bool)>,
    /// Whether any input so far is a texture.
    pub is_textured: bool,
}

impl<'a> TextureBuilder<'a> {
    /// The input that `value` states; `default` where it states nothing.
    pub fn float(&mut self, value: Option<TextureOr<f32>>, default: f32) -> Result<FloatInput> {
        match value {
            None => Ok(FloatInput::Constant(default)),
            Some(TextureOr::Value(value)) => Ok(FloatInput::Constant(value)),
            Some(TextureOr::Texture(name, span)) => {
                let input = self.named_float(&name, span)?;
                self.is_textured |= matches!(input, FloatInput::Texture(_));
                Ok(input)
            }
        }
    }

    /// The input that `value` states; `default` where it states nothing.
    pub fn rgb(&mut self, value: Option<TextureOr<Rgb>>, default: Rgb) -> Result<RgbInput> {
        match value {
            None => Ok(RgbInput::Constant(default)),
            Some(TextureOr::Value(value)) => Ok(RgbInput::Constant(value)),
            Some(TextureOr::Texture(name, span)) => {
                let input = self.named_rgb(&name, span)?;
                self.is_textured |= matches!(input, RgbInput::Texture(_));
                Ok(input)
            }
        }
    }

    fn named_float(&mut self, name: &str, span: Span) -> Result<FloatInput> {
        if let Some(&built) = self.loader.floats.get(name) {
            return Ok(built);
        }
        let texture = self.begin(name, span, false)?;
        let params = &texture.entity.params;
        let built = match texture.entity.kind.as_str() {
            "constant" => FloatInput::Constant(params.float("value", 1.0)?),
            "scale" => {
                let a = self.float(params.float_texture("tex")?, 1.0)?;
                let b = self.float(params.float_texture("scale")?, 1.0)?;
                match (a, b) {
                    (FloatInput::Constant(a), FloatInput::Constant(b)) => FloatInput::Constant(a * b),
                    _ => self.add_float(FloatTexture::Scale(a, b), span)?,
                }
            }
            "imagemap" => match self.image_map(texture, "1 is used instead")? {
                Some(map) => self.add_float(FloatTexture::Image(Arc::new(map)), span)?,
                None => FloatInput::Constant(1.0),
            },
            kind => match self.procedural_float(texture)? {
                Some(procedural) => self.add_float(procedural, span)?,
                None => {
                    let message = unsupported(name, kind, &["marble"], "a spectrum", "1");
                    self.warnings.add(Some(texture.entity.span()), message);
                    params.iter().for_each(Param::mark_used);
                    FloatInput::Constant(1.0)
                }
            },
        };
        self.end(texture);
        self.loader.floats.insert(name.to_owned(), built);
        Ok(built)
    }

    fn named_rgb(&mut self, name: &str, span: Span) -> Result<RgbInput> {
        if let Some(&built) = self.loader.rgbs.get(name) {
            return Ok(built);
        }
        let texture = self.begin(name, span, true)?;
        let params = &texture.entity.params;
        let built = match texture.entity.kind.as_str() {
            "constant" => self.rgb(params.albedo_texture("value")?, Rgb::WHITE)?,
            "scale" => {
                let a = self.rgb(params.albedo_texture("tex")?, Rgb::WHITE)?;
                let b = self.float(params.float_texture("scale")?, 1.0)?;
                match (a, b) {
                    (RgbInput::Constant(a), FloatInput::Constant(b)) => RgbInput::Constant(a * b),
                    _ => self.add_rgb(RgbTexture::Scale(a, b), span)?,
                }
            }
            "imagemap" => match self.image_map(texture, "magenta is used instead")? {
                Some(map) => self.add_rgb(RgbTexture::Image(Arc::new(map)), span)?,
                None => RgbInput::Constant(MAGENTA),
            },
            kind => match self.procedural_rgb(texture)? {
                Some(procedural) => self.add_rgb(procedural, span)?,
                None => {
                    let message = unsupported(name, kind, &["fbm", "wrinkled", "windy"], "a float", "50 % grey");
                    self.warnings.add(Some(texture.entity.span()), message);
                    params.iter().for_each(Param::mark_used);
                    RgbInput::Constant(Rgb::splat(0.5))
                }
            },
        };
        self.end(texture);
        self.loader.rgbs.insert(name.to_owned(), built);
        Ok(built)
    }

    fn add_float(&mut self, texture: FloatTexture, span: Span) -> Result<FloatInput> {
        let lookups = match texture {
            FloatTexture::Scale(a, b) => self.textures.float_lookups(a) + self.textures.float_lookups(b),
            FloatTexture::Image(_) => 1,
            FloatTexture::Blend(a, b, weight) => {
                1 + self.textures.float_lookups(a) + self.textures.float_lookups(b) + self.weight_lookups(weight)
            }
            FloatTexture::Bilinear(..) => 1,
            FloatTexture::Noise(NoiseTexture { kind, .. }) => kind.lookups(),
        };
        check_lookups(lookups, span)?;
        Ok(FloatInput::Texture(self.textures.add_float(texture, lookups)))
    }

    fn add_rgb(&mut self, texture: RgbTexture, span: Span) -> Result<RgbInput> {
        let lookups = match texture {
            RgbTexture::Scale(a, b) => self.textures.rgb_lookups(a) + self.textures.float_lookups(b),
            RgbTexture::Image(_) => 1,
            RgbTexture::Blend(a, b, weight) => {
                1 + self.textures.rgb_lookups(a) + self.textures.rgb_lookups(b) + self.weight_lookups(weight)
            }
            RgbTexture::Bilinear(..) => 1,
            RgbTexture::Marble(Marble { octaves, .. }) => octaves,
        };
        check_lookups(lookups, span)?;
        Ok(RgbInput::Texture(self.textures.add_rgb(texture, lookups)))
    }

    fn weight_lookups(&self, weight: Weight) -> u32 {
        match weight {
            Weight::Input(input) => self.textures.float_lookups(input),
            Weight::Dots(_) => 3,
            Weight::Direction(_) | Weight::Squares(_) | Weight::Cubes(_) => 0,
        }
    }

    /// Finds a texture by name (the last one declared so) and marks it as being built.
    fn begin(&mut self, name: &str, span: Span, is_spectrum: bool) -> Result<&'a TextureEntity> {
        let key = (name.to_owned(), is_spectrum);
        let Some(&place) = self.loader.places.get(&key) else {
            let kind = if is_spectrum { "spectrum" } else { "float" };
            let error = SceneErrorKind::Undefined(format!("there is no {kind} texture \"{name}\""));
            let error = SceneError::at(span, error);
            let other = self.loader.places.contains_key(&(name.to_owned(), !is_spectrum));
            return Err(if other {
                error.help(format!("\"{name}\" is a texture, but not of type {kind}"))
            } else {
                error
            });
        };
        if self.open.contains(&key) {
            let message = format!("texture \"{name}\" contains itself");
            return Err(SceneError::at(span, SceneErrorKind::Parameter(message)));
        }
        if self.open.len() >= DEEPEST {
            let message = format!("more than {DEEPEST} textures within each other");
            return Err(SceneError::at(span, SceneErrorKind::Limit(message)));
        }
        self.open.push(key);
        Ok(&self.scene.textures[place])
    }

    fn end(&mut self, texture: &TextureEntity) {
        self.open.pop();
        if texture.transform.is_animated() && lies_in_space(texture) {
            let message =
                format!("texture \"{}\" moves; it is looked up where it starts (as in pbrt-v4)", texture.name);
            self.warnings.add(Some(texture.entity.span()), message);
        }
        texture.entity.params.warn_unused(self.warnings);
    }

    /// An `imagemap`; `None` where its file cannot be read (and that was warned about).
    fn image_map(&mut self, texture: &TextureEntity, instead: &'static str) -> Result<Option<ImageMap>> {
        let params = &texture.entity.params;
        let Some(file) = params.string("filename")? else {
            let message = format!("{} has no \"filename\"", params.owner);
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
        };
        let wrap = match params.string("wrap")? {
            None | Some("repeat") => Wrap::Repeat,
            Some("black") => Wrap::Black,
            Some("clamp") => Wrap::Clamp,
            Some("octahedralsphere") => {
                params.warn_ignored("wrap", "\"octahedralsphere\" is done as \"clamp\"", self.warnings);
                Wrap::Clamp
            }
            Some(other) => return Err(bad_word(params, "wrap", other, "repeat, black, clamp or octahedralsphere")),
        };
        let filter = match params.string("filter")? {
            None | Some("bilinear") => Filter::Bilinear,
            Some("trilinear") => Filter::Trilinear,
            Some("EWA" | "ewa") => {
                let most = params.float("maxanisotropy", 8.0)?;
                if !(1.0..=MOST_ANISOTROPY).contains(&most) {
                    let expected = format!("from 1 to {MOST_ANISOTROPY}");
                    params.pass_over("maxanisotropy", &expected, "the nearer of these is taken", self.warnings);
                }
                Filter::Ewa(most.clamp(1.0, MOST_ANISOTROPY))
            }
            Some("point") => Filter::Point,
            Some(other) => {
                let expected = format!("point, bilinear, trilinear or EWA, found \"{other}\"");
                params.pass_over("filter", &expected, "bilinear is taken", self.warnings);
                Filter::Bilinear
            }
        };
        // Exporters state it for all filters.
        params.get("maxanisotropy");
        let mapping = self.mapping(texture)?;
        let encoding = encoding(params)?;
        let scale = params.float("scale", 1.0)?;
        let invert = params.bool("invert", false)?;
        let span = params.get("filename").map_or(params.span, |p| p.span);
        let image = self.image(file, encoding, span, instead)?;
        Ok(image.map(|image| ImageMap { to_rec709: image.to_rec709(), image, wrap, filter, mapping, scale, invert }))
    }

    /// The image of a file, once for each encoding, of which only the header is read; `None` where that cannot be read (and that was warned about, with
    /// `instead` for what happens).
    pub fn image(
        &mut self,
        file: &str,
        encoding: Encoding,
        span: Span,
        instead: &'static str,
    ) -> Result<Option<Arc<MipMap>>> {
        let path = self.scene.resolve(file);
        let key = (path.clone(), EncodingKey::from(encoding));
        if let Some(image) = self.loader.images.get(&key) {
            return Ok(image.clone());
        }
        let image = match read_header(&path) {
            Ok(header) => {
                if let Some(message) = header.warning(&path) {
                    self.warnings.add(Some(span), message);
                }
                Some(Arc::new(MipMap::new(path, encoding, span, instead, &header, self.memory)))
            }
            Err(error) if error.is_limit => {
                return Err(SceneError::at(span, SceneErrorKind::Limit(error.to_string())));
            }
            Err(error) if self.strict => {
                return Err(SceneError::at(span, SceneErrorKind::File { path, reason: error.reason }));
            }
            Err(error) => {
                let message = format!("cannot read {}: {}; {instead}", path.display(), error.reason);
                self.warnings.add(Some(span), message);
                None
            }
        };
        self.loader.images.insert(key, image.clone());
        Ok(image)
    }
}

/// Whether a texture is looked up by place or direction, not by the surface's own coordinates.
fn lies_in_space(texture: &TextureEntity) -> bool {
    let params = &texture.entity.params;
    let is = |name: &str, values: &[&str]| matches!(params.string(name), Ok(Some(value)) if values.contains(&value));
    matches!(texture.entity.kind.as_str(), "fbm" | "wrinkled" | "windy" | "marble" | "directionmix")
        || is("mapping", &["planar", "spherical", "cylindrical"])
        || matches!(params.integer("dimension", 2), Ok(3))
}

fn check_lookups(lookups: u32, span: Span) -> Result<()> {
    if lookups <= MOST_LOOKUPS {
        return Ok(());
    }
    let message =
        format!("one look-up of this texture takes {lookups} look-ups of others, at most {MOST_LOOKUPS} are made");
    Err(SceneError::at(span, SceneErrorKind::Limit(message)))
}

/// What is said of a texture whose type is not known, or of those `of_other_kind` alone.
fn unsupported(name: &str, kind: &str, of_other_kind: &[&str], other_kind: &str, instead: &str) -> String {
    if of_other_kind.contains(&kind) {
        format!("a \"{kind}\" texture (\"{name}\") is {other_kind}: {instead} is used instead")
    } else {
        format!("texture type \"{kind}\" (\"{name}\") is not supported: {instead} is used instead")
    }
}

fn bad_word(params: &ParamSet, name: &str, found: &str, expected: &str) -> Box<SceneError> {
    params.wrong(name, &format!("{expected}, found \"{found}\""))
}

fn encoding(params: &ParamSet) -> Result<Encoding> {
    let Some(word) = params.string("encoding")? else { return Ok(Encoding::Auto) };
    match word {
        "sRGB" | "srgb" => Ok(Encoding::Srgb),
        "linear" => Ok(Encoding::Linear),
        other => match other.strip_prefix("gamma").map(|gamma| gamma.trim().parse::<f32>()) {
            Some(Ok(gamma)) if gamma > 0.0 && gamma.is_finite() => Ok(Encoding::Gamma(gamma)),
            _ => Err(bad_word(params, "encoding", other, "sRGB, linear or gamma with a number")),
        },
    }
}
