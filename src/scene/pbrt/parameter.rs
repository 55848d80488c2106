//! Parameter lists: `"type name" value` or `"type name" [values]`, read straight into packed arrays of the declared
//! type.

use std::path::Path;

use super::lexer::{self, TokenKind, shown, unescape};
use super::older::UPGRADE;
use super::reader::{Reader, folder_of};
use crate::math::Rgb;
use crate::math::spectrum::{RgbColorSpace, Spectrum, named_spectrum_names};
use crate::scene::source::lines;
use crate::scene::{Param, ParamValue, SceneError, SceneErrorKind, Span, Warnings, locate};

/// The most parameters of one directive.
const MOST_PARAMETERS: usize = 4096;

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// What surrounds a parameter list.
pub struct Context<'a> {
    /// The colour space that RGB is given in.
    pub color_space: &'a RgbColorSpace,
    /// The folder of the main scene file, where spectrum files are looked for.
    pub base: &'a Path,
}

fn syntax<T>(span: Span, message: impl Into<String>) -> Result<T> {
    Err(SceneError::at(span, SceneErrorKind::Syntax(message.into())))
}

fn wrong<T>(span: Span, message: impl Into<String>) -> Result<T> {
    Err(SceneError::at(span, SceneErrorKind::Parameter(message.into())))
}

/// Reads parameters until something else than a quoted declaration follows. Of two with one name the later counts, but a texture before what is none, as
/// in pbrt-v4.
///
/// # Errors
/// Anything that is not a well-formed parameter, at its place.
pub fn parse_list(reader: &mut Reader, context: &Context, warnings: &mut Warnings) -> Result<Vec<Param>> {
    let mut params: Vec<Param> = Vec::new();
    while let Some(token) = reader.peek()? {
        match token.kind {
            TokenKind::Quoted => {}
            TokenKind::Word if !lexer::looks_like_number(reader.text(&token)) => break,
            _ => {
                let found = shown(reader.text(&token));
                return syntax(
                    token.span,
                    format!("expected a parameter (\"type name\") or a directive, found {found}"),
                );
            }
        }
        reader.next()?;
        let declaration = unescape(reader.text(&token), token.span)?;
        let param = parse_one(reader, &declaration, token.span, context, warnings)?;
        if let Some(earlier) = params.iter_mut().find(|p| p.name == param.name) {
            let is_texture = |param: &Param| matches!(param.value, ParamValue::Texture(_));
            let counts = if is_texture(earlier) && !is_texture(&param) { "texture" } else { "later one" };
            warnings.add(Some(param.span), format!("parameter \"{}\" is given twice; the {counts} counts", param.name));
            if counts == "later one" {
                *earlier = param;
            }
        } else {
            params.push(param);
        }
        if params.len() > MOST_PARAMETERS {
            let what = SceneErrorKind::Limit(format!("more than {MOST_PARAMETERS} parameters in one directive"));
            return Err(SceneError::at(token.span, what));
        }
    }
    Ok(params)
}

/// Reads the values of the parameter whose declaration (`float fov`) stands at `span`.
///
/// # Errors
/// A malformed declaration, an unknown type, or values that do not fit it.
pub fn parse_one(
    reader: &mut Reader,
    declaration: &str,
    span: Span,
    context: &Context,
    warnings: &mut Warnings,
) -> Result<Param> {
    let mut words = declaration.split_ascii_whitespace();
    let (Some(type_name), Some(name)) = (words.next(), words.next()) else {
        return syntax(span, format!("expected \"type name\", found \"{declaration}\"")).map_err(
            |e: Box<SceneError>| {
                e.help("a parameter is declared as its type and its name in one pair of quotes: \"float fov\" 40")
            },
        );
    };
    if words.next().is_some() {
        let what = format!("expected \"type name\", found {}", shown(declaration));
        warnings.add_fault(span, what, "the words after these two are ignored");
    }
    let value = match type_name {
        "float" => ParamValue::Float(floats(reader, span, warnings)?),
        "integer" => {
            let mut values = Vec::new();
            each_value(reader, span, |kind, text, at| {
                values.push(word(kind, text, at, "an integer", lexer::integer)?);
                Ok(())
            })?;
            ParamValue::Integer(values)
        }
        "point2" | "vector2" => ParamValue::Vec2(vectors(reader, span, type_name, warnings)?),
        "point3" | "vector3" | "normal3" | "point" | "vector" | "normal" => {
            ParamValue::Vec3(vectors(reader, span, type_name, warnings)?)
        }
        "bool" => {
            let mut values = Vec::new();
            each_value(reader, span, |_, text, at| {
                values.push(match text {
                    "true" => true,
                    "false" => false,
                    _ => return wrong(at, format!("expected true or false, found {}", shown(text))),
                });
                Ok(())
            })?;
            ParamValue::Bool(values)
        }
        "string" => {
            let mut values = Vec::new();
            each_value(reader, span, |kind, text, at| {
                values.push(quoted(kind, text, at)?);
                Ok(())
            })?;
            ParamValue::String(values)
        }
        "texture" => {
            let mut values = Vec::new();
            each_value(reader, span, |kind, text, at| {
                values.push(quoted(kind, text, at)?);
                Ok(())
            })?;
            let count = values.len();
            match values.pop() {
                Some(texture) if count == 1 => ParamValue::Texture(texture),
                _ => return wrong(span, format!("parameter \"{name}\" takes the name of one texture, found {count}")),
            }
        }
        "rgb" => {
            let triples: Vec<[f32; 3]> = vectors(reader, span, type_name, warnings)?;
            ParamValue::Spectrum(
                triples.into_iter().map(|t| Spectrum::Rgb(context.color_space.to_rec709(Rgb::from(t)))).collect(),
            )
        }
        "blackbody" => {
            let kelvins = floats(reader, span, warnings)?;
            if let Some(bad) = kelvins.iter().find(|&&t| t <= 0.0) {
                return wrong(span, format!("a black body's temperature is in kelvin and above 0, found {bad}"));
            }
            ParamValue::Spectrum(kelvins.into_iter().map(Spectrum::Blackbody).collect())
        }
        "spectrum" => ParamValue::Spectrum(spectra(reader, span, context)?),
        "color" | "xyz" => {
            return wrong(span, format!("\"{type_name}\" is no parameter type of pbrt-v4"))
                .map_err(|e: Box<SceneError>| e.help(format!("give the colour as linear \"rgb\"; {UPGRADE}")));
        }
        _ => {
            let known = [
                "float",
                "integer",
                "bool",
                "string",
                "point2",
                "point3",
                "vector2",
                "vector3",
                "normal",
                "rgb",
                "spectrum",
                "blackbody",
                "texture",
            ];
            return wrong(span, format!("unknown parameter type \"{type_name}\""))
                .map_err(|e: Box<SceneError>| e.help(super::directive::did_you_mean(type_name, &known)));
        }
    };
    Ok(Param::new(reader.name(name), reader.name(type_name), value, span))
}

/// Calls `each` with kind, text and place of the values: one token, or those between brackets.
fn each_value(
    reader: &mut Reader,
    declaration: Span,
    mut each: impl FnMut(TokenKind, &str, Span) -> Result<()>,
) -> Result<()> {
    let first = reader.expect("the parameter's value")?;
    match first.kind {
        TokenKind::Word | TokenKind::Quoted => each(first.kind, reader.text(&first), first.span),
        TokenKind::Close => syntax(first.span, "found ] where the parameter's value should stand"),
        TokenKind::Open => loop {
            let Some(token) = reader.next()? else {
                return syntax(first.span, "this [ is never closed");
            };
            match token.kind {
                TokenKind::Close => return Ok(()),
                TokenKind::Open => {
                    return syntax(token.span, "brackets within brackets").map_err(|e: Box<SceneError>| {
                        e.help(format!("is the ] of the parameter on line {} missing?", declaration.line))
                    });
                }
                kind => each(kind, reader.text(&token), token.span)?,
            }
        },
    }
}

fn word<T>(
    kind: TokenKind,
    text: &str,
    at: Span,
    wanted: &str,
    parse: impl FnOnce(&str) -> std::result::Result<T, String>,
) -> Result<T> {
    if kind == TokenKind::Quoted {
        return wrong(at, format!("expected {wanted}, found the string \"{}\"", shown(text).trim_matches('`')));
    }
    parse(text).or_else(|message| wrong(at, message))
}

fn quoted(kind: TokenKind, text: &str, at: Span) -> Result<String> {
    match kind {
        TokenKind::Quoted => unescape(text, at),
        _ => wrong(at, format!("expected a string in quotes, found {}", shown(text))),
    }
}

/// Numbers. Of those that only double precision holds the largest of single precision is taken, with a warning.
fn floats(reader: &mut Reader, span: Span, warnings: &mut Warnings) -> Result<Vec<f32>> {
    let mut values = Vec::new();
    each_value(reader, span, |kind, text, at| {
        values.push(word(kind, text, at, "a number", |text| {
            lexer::number::<f32>(text).or_else(|message| match lexer::number::<f64>(text) {
                Ok(large) => {
                    let largest = f32::MAX.copysign(large as f32);
                    warnings.add(Some(at), format!("{message}: {largest:e} is taken"));
                    Ok(largest)
                }
                Err(_) => Err(message),
            })
        })?);
        Ok(())
    })?;
    Ok(values)
}

fn vectors<const N: usize>(
    reader: &mut Reader,
    span: Span,
    type_name: &str,
    warnings: &mut Warnings,
) -> Result<Vec<[f32; N]>> {
    let flat = floats(reader, span, warnings)?;
    let (vectors, rest) = flat.as_chunks::<N>();
    if !rest.is_empty() {
        return wrong(
            span,
            format!("{type_name} values come in groups of {N}; {} numbers do not divide by that", flat.len()),
        );
    }
    Ok(vectors.to_vec())
}

/// Named spectra, spectrum files, or one spectrum as pairs of wavelength and value.
fn spectra(reader: &mut Reader, span: Span, context: &Context) -> Result<Vec<Spectrum>> {
    let mut numbers = Vec::new();
    let mut names = Vec::new();
    each_value(reader, span, |kind, text, at| {
        match kind {
            TokenKind::Quoted => names.push((unescape(text, at)?, at)),
            _ => {
                numbers.push(word(kind, text, at, "a wavelength, a value or a spectrum's name", lexer::number::<f32>)?)
            }
        }
        Ok(())
    })?;
    if !names.is_empty() && !numbers.is_empty() {
        return wrong(span, "a spectrum is either a name or pairs of numbers, found both");
    }
    if names.is_empty() {
        return Ok(vec![pairs(&numbers, span)?]);
    }
    let folder = reader.folder();
    names.into_iter().map(|(name, at)| named_or_file(&name, at, context, &folder, reader)).collect()
}

fn pairs(numbers: &[f32], span: Span) -> Result<Spectrum> {
    let (pairs, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() || pairs.is_empty() {
        return wrong(
            span,
            format!("a spectrum is pairs of wavelength (nm) and value, found {} numbers", numbers.len()),
        );
    }
    if let Some(falling) = pairs.windows(2).find(|w| w[0][0] >= w[1][0]) {
        return wrong(
            span,
            format!("a spectrum's wavelengths must rise, found {} after {}", falling[1][0], falling[0][0]),
        );
    }
    Ok(Spectrum::Samples(pairs.iter().map(|&[wavelength, value]| (wavelength, value)).collect()))
}

fn named_or_file(name: &str, at: Span, context: &Context, folder: &Path, reader: &mut Reader) -> Result<Spectrum> {
    // A name stands for one thing all over a scene, a path for one file.
    if let Some(spectrum) = reader.spectra.get(Path::new(name)) {
        return Ok(spectrum.clone());
    }
    if let Some(spectrum) = Spectrum::named(name) {
        reader.spectra.insert(name.into(), spectrum.clone());
        return Ok(spectrum);
    }
    let beside_scene = locate(context.base, name);
    let path = if beside_scene.exists() { beside_scene } else { locate(folder, name) };
    if let Some(spectrum) = reader.spectra.get(&path) {
        return Ok(spectrum.clone());
    }
    if !path.is_file() {
        return Err(SceneError::at(
            at,
            SceneErrorKind::Undefined(format!("\"{name}\" is neither a named spectrum nor a file")),
        )
        .help(super::directive::did_you_mean(name, named_spectrum_names())));
    }
    let placed = |mut e: Box<SceneError>| {
        e.span.get_or_insert(at);
        e
    };
    let Some(text) = reader.aside(&path).map_err(placed)? else {
        return wrong(at, format!("the spectrum file {} is not text", folder_of(&path).join(name).display()));
    };
    let numbers = spectrum_of_file(text, &path).or_else(|message| wrong(at, message))?;
    let spectrum = pairs(&numbers, at).map_err(|mut e| {
        e.help = Some(format!("in the spectrum file {}", path.display()));
        e
    })?;
    reader.spectra.insert(path, spectrum.clone());
    Ok(spectrum)
}

/// The numbers in the text of the spectrum file `path`, pairs of wavelength and value; what follows a `#` on its line is a comment.
///
/// # Errors
/// Something that is no number, with its place in the file.
pub(crate) fn spectrum_of_file(text: &str, path: &Path) -> std::result::Result<Vec<f32>, String> {
    let mut numbers = Vec::new();
    for (index, line) in lines(text).enumerate() {
        let code = line.split('#').next().unwrap_or("");
        for entry in code.split([' ', '\t', '\r', ',']).filter(|w| !w.is_empty()) {
            let value =
                lexer::number(entry).map_err(|message| format!("{}:{}: {message}", path.display(), index + 1))?;
            numbers.push(value);
        }
    }
    Ok(numbers)
}
