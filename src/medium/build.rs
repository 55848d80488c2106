//! From a scene's `MakeNamedMedium` to a [`Medium`]: pbrt-v4's `homogeneous`, `uniformgrid`, `rgbgrid`, `cloud` and `nanovdb` with its defaults
//! (pbrt-v4's file format documentation and section 11.4), and this renderer's `openvdb`.

mod cloud;
mod nanovdb;
mod openvdb;
mod uniform;

use glam::DAffine3;

use super::homogeneous::HomogeneousMedium;
use super::measured::MeasuredMatter;
use super::{Medium, MediumPoint};
use crate::math::Rgb;
use crate::scene::did_you_mean;
use crate::scene::older::with_upgrade;
use crate::scene::{MediumEntity, ParamSet, ParamValue, SceneDescription, SceneError, SceneErrorKind, Warnings};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Builds the medium that `entity` declares. Grids lie where `render_from_medium` puts their medium space. NaN, infinite
/// and negative voxels become 0 with a warning that counts them, or are an error if `strict`.
///
/// Extinction is per unit length of **render space** (as in pbrt-v4): a transform that scales a grid does not make it
/// thinner or denser.
///
/// # Errors
/// Wrong parameters, unreadable files, types that are not supported, with the place in the scene file.
pub fn build_medium(
    entity: &MediumEntity,
    render_from_medium: &DAffine3,
    scene: &SceneDescription,
    strict: bool,
    warnings: &mut Warnings,
) -> Result<Medium> {
    let params = &entity.entity.params;
    if entity.transform.is_animated() {
        warnings.add(Some(params.span), format!("medium \"{}\" moves; it is rendered where it starts", entity.name));
    }
    let medium = match entity.entity.kind.as_str() {
        "homogeneous" => homogeneous(params, warnings)?,
        "uniformgrid" => uniform::uniform_grid(params, render_from_medium, strict, warnings)?,
        "rgbgrid" => uniform::rgb_grid(params, render_from_medium, strict, warnings)?,
        "openvdb" => openvdb::openvdb(params, render_from_medium, scene, strict, warnings)?,
        "cloud" => cloud::cloud(params, render_from_medium, warnings)?,
        "nanovdb" => nanovdb::nanovdb(params, render_from_medium, scene, strict, warnings)?,
        other => {
            let message = format!("\"{other}\" is not a type of medium");
            let known =
                "media are \"homogeneous\", \"uniformgrid\", \"rgbgrid\", \"cloud\", \"nanovdb\" and \"openvdb\"";
            return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)).help(with_upgrade(
                "MakeNamedMedium",
                other,
                known,
            )));
        }
    };
    params.warn_unused(warnings);
    check_extinction(params, &medium)?;
    Ok(medium)
}

/// The largest optical depth of a voxel that tracking gets through: where a voxel this dense lies beside an empty one, a ray
/// takes as many steps as its bound says.
const DENSEST_VOXEL: f32 = 1e6;

/// Refuses extinctions that no free flight can be sampled in.
fn check_extinction(params: &ParamSet, medium: &Medium) -> Result<()> {
    let refuse = |message: String| {
        Err(SceneError::at(params.span, SceneErrorKind::Parameter(message))
            .help("are the coefficients (and \"scale\") per unit length of the scene?"))
    };
    match medium {
        Medium::Homogeneous(HomogeneousMedium { point, .. }) => {
            if (point.absorption + point.scattering).is_finite() && point.emission.is_finite() {
                return Ok(());
            }
            refuse(format!("the coefficients of {} are not finite", params.owner))
        }
        Medium::Grid(grid) => {
            let (largest, edge) = (grid.largest_extinction(), grid.voxel_edge());
            if largest * edge <= DENSEST_VOXEL {
                return Ok(());
            }
            refuse(format!(
                "{} has an extinction of up to {largest:e}: {:e} over a voxel of {edge:e}, where {DENSEST_VOXEL:e} is the most",
                params.owner,
                largest * edge
            ))
        }
    }
}

fn wrong(params: &ParamSet, name: &str, what: impl std::fmt::Display) -> Box<SceneError> {
    let span = params.iter().find(|p| p.name == name).map_or(params.span, |p| p.span);
    let message = format!("parameter \"{name}\" of {}: {what}", params.owner);
    SceneError::at(span, SceneErrorKind::Parameter(message))
}

/// A coefficient per unit length: not negative, finite. A plain float serves for a grey one.
fn coefficient(params: &ParamSet, name: &str, default: Rgb) -> Result<Rgb> {
    let value = match params.get(name).map(|p| &p.value) {
        None => return Ok(default),
        Some(ParamValue::Float(_) | ParamValue::Integer(_)) => Rgb::splat(params.float(name, 0.0)?),
        Some(_) => params.spectrum(name)?.map_or(default, |s| s.to_unbounded()),
    };
    if !value.is_finite() {
        return Err(wrong(params, name, "must be finite"));
    }
    // Spectra reduced to RGB may leave its gamut a little.
    Ok(value.map(|c| c.max(0.0)))
}

/// The measured matter that the parameter `name` names, if it is given. A name that is not known is warned of (pbrt-v4: so for media, for
/// `subsurface` it gives up).
pub fn measured_matter(params: &ParamSet, name: &str, warnings: &mut Warnings) -> Result<Option<MeasuredMatter>> {
    let Some(matter) = params.string(name)?.filter(|matter| !matter.is_empty()) else { return Ok(None) };
    let found = MeasuredMatter::named(matter);
    if found.is_none() {
        let names: Vec<&str> = MeasuredMatter::names().collect();
        let message =
            format!("no measured matter of {} is called \"{matter}\": {}", params.owner, did_you_mean(matter, &names));
        warnings.add(Some(params.span), message);
    }
    Ok(found)
}

/// Emitted radiance, if given.
fn radiance(params: &ParamSet, name: &str) -> Result<Option<Rgb>> {
    let value = match params.get(name).map(|p| &p.value) {
        None => return Ok(None),
        Some(ParamValue::Float(_) | ParamValue::Integer(_)) => Rgb::splat(params.float(name, 0.0)?),
        Some(_) => params.spectrum(name)?.map_or(Rgb::BLACK, |s| s.to_illuminant()),
    };
    if !value.is_finite() {
        return Err(wrong(params, name, "must be finite"));
    }
    Ok(Some(value.map(|c| c.max(0.0))))
}

/// A factor that must be finite and not negative.
fn factor(params: &ParamSet, name: &str, default: f32) -> Result<f32> {
    let value = params.float(name, default)?;
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(wrong(params, name, "must not be negative")) }
}

/// A factor of emission: one that leaves finite what it is applied to.
fn emission_factor(params: &ParamSet, name: &str) -> Result<f32> {
    const MOST: f32 = 1e30;
    let value = factor(params, name, 1.0)?;
    if value <= MOST { Ok(value) } else { Err(wrong(params, name, "must be at most 1e30")) }
}

/// What is taken from temperatures: `temperatureoffset`, or by its older name `temperaturecutoff`.
fn temperature_offset(params: &ParamSet, warnings: &mut Warnings) -> Result<f32> {
    let older = params.float("temperaturecutoff", 0.0)?;
    let Some(offset) = params.float_opt("temperatureoffset")? else { return Ok(older) };
    params.warn_ignored("temperaturecutoff", "\"temperatureoffset\" is given too", warnings);
    Ok(offset)
}

/// g of the Henyey-Greenstein phase function, strictly between -1 and 1 (what lies beyond ±0.999 is set to that).
fn anisotropy(params: &ParamSet, warnings: &mut Warnings) -> Result<f32> {
    let g = params.float("g", 0.0)?;
    if !(-1.0..=1.0).contains(&g) {
        return Err(wrong(params, "g", "must lie between -1 and 1"));
    }
    if g.abs() > 0.999 {
        warnings.add(Some(params.span), format!("g = {g} of {} is set to {}", params.owner, 0.999f32.copysign(g)));
    }
    Ok(g.clamp(-0.999, 0.999))
}

fn homogeneous(params: &ParamSet, warnings: &mut Warnings) -> Result<Medium> {
    let [sigma_a, sigma_s] = match measured_matter(params, "preset", warnings)? {
        Some(matter) => {
            for name in ["sigma_a", "sigma_s"] {
                params.warn_ignored(name, "\"preset\" is given too", warnings);
            }
            [matter.absorption, matter.scattering]
        }
        None => [coefficient(params, "sigma_a", Rgb::WHITE)?, coefficient(params, "sigma_s", Rgb::WHITE)?],
    };
    let scale = factor(params, "scale", 1.0)?;
    let le = radiance(params, "Le")?.unwrap_or(Rgb::BLACK) * factor(params, "Lescale", 1.0)?;
    let point =
        MediumPoint { absorption: sigma_a * scale, scattering: sigma_s * scale, emission: sigma_a * scale * le };
    Ok(Medium::Homogeneous(HomogeneousMedium { point, g: anisotropy(params, warnings)? }))
}

/// Reports values that were NaN, infinite or negative.
fn report_bad(params: &ParamSet, grid: &str, bad: u64, strict: bool, warnings: &mut Warnings) -> Result<()> {
    if bad == 0 {
        return Ok(());
    }
    let message = format!("{grid} of {} has {bad} values that are NaN, infinite or negative", params.owner);
    if strict {
        return Err(
            SceneError::at(params.span, SceneErrorKind::Parameter(message)).help("without --strict they become 0")
        );
    }
    warnings.add(Some(params.span), format!("{message}; they are set to 0"));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{FileId, Param, Span};

    /// A homogeneous medium of these parameters, and what is warned of.
    fn made(params: Vec<Param>) -> (MediumPoint, Vec<String>) {
        let mut warnings = Warnings::default();
        let params = ParamSet::new("medium \"m\"", SPAN, params);
        let Ok(Medium::Homogeneous(medium)) = homogeneous(&params, &mut warnings) else { panic!("it is one") };
        (medium.point, warnings.list().iter().map(|w| w.message.clone()).collect())
    }

    const SPAN: Span = Span { file: FileId(0), line: 1, column: 1, length: 1 };

    fn float(name: &str, value: f32) -> Param {
        Param::new(name, "float", ParamValue::Float(vec![value]), SPAN)
    }

    #[test]
    fn homogeneous_media_have_coefficients_of_1_or_by_name() {
        let (plain, said) = made(vec![float("scale", 3.0), float("sigma_a", 0.5)]);
        assert!(
            plain.absorption == Rgb::splat(1.5) && plain.scattering == Rgb::splat(3.0) && said.is_empty(),
            "{said:?}"
        );
        let preset = |name: &str| Param::new("preset", "string", ParamValue::String(vec![name.to_owned()]), SPAN);
        let (skin, said) = made(vec![preset("Skin1"), float("scale", 2.0)]);
        assert!(skin.absorption == Rgb::new(0.032, 0.17, 0.48) * 2.0 && said.is_empty(), "{said:?}");
        assert!(skin.scattering == Rgb::new(0.74, 0.88, 1.01) * 2.0);
        let (other, said) = made(vec![preset("Skim milk"), float("sigma_s", 0.25)]);
        assert!(
            other.scattering == Rgb::splat(0.25) && said.len() == 1 && said[0].contains("did you mean Skimmilk?"),
            "{said:?}"
        );
        let (skin, said) = made(vec![preset("Skin1"), float("sigma_s", 9.0)]);
        assert!(
            skin.scattering == Rgb::new(0.74, 0.88, 1.01) && said.len() == 1 && said[0].contains("\"sigma_s\""),
            "{said:?}"
        );
    }
}
