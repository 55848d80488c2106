//! pbrt's medium type `nanovdb`: the grids "density" and "temperature" of a .nvdb file, or those that `gridname` and `temperaturename` name.
//!
//! Source: pbrt-v4's file format, and its section 11.4.2 for what temperatures emit: L_e = Lescale times a black body whose largest value is 1, of
//! (temperature - temperatureoffset) · temperaturescale kelvin.

use glam::DAffine3;

use super::{Result, anisotropy, coefficient, emission_factor, factor, report_bad, temperature_offset, wrong};
use crate::math::Rgb;
use crate::medium::Medium;
use crate::medium::grid::emission::{BlackbodyScale, BlackbodyTable, Emission, EmissionShape};
use crate::medium::grid::field::{Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::nanovdb::{NanoFile, read};
use crate::medium::grid::{GridMedium, GridMediumParts};
use crate::scene::{ParamSet, SceneDescription, SceneError, SceneErrorKind, Warnings};

/// A file that has been read, and whom to tell about it.
struct Source<'a> {
    params: &'a ParamSet,
    file: NanoFile,
    render_from_medium: &'a DAffine3,
    strict: bool,
}

impl Source<'_> {
    fn list(&self) -> String {
        let read = self.file.grids.iter().map(|grid| format!("\"{}\"", grid.name));
        let skipped = self.file.skipped.iter().map(|grid| format!("\"{}\" ({})", grid.name, grid.reason));
        let all: Vec<String> = read.chain(skipped).collect();
        if all.is_empty() { "the file has no grids".to_owned() } else { format!("the file has {}", all.join(", ")) }
    }

    /// The grid of that name, if the file has it.
    fn find(&self, name: &str, warnings: &mut Warnings) -> Result<Option<Field<ScalarGrid>>> {
        if let Some(skipped) = self.file.skipped.iter().find(|grid| grid.name == name) {
            let message = format!("grid \"{name}\" cannot be used: {}", skipped.reason);
            return Err(wrong(self.params, "filename", message));
        }
        let Some(grid) = self.file.grids.iter().find(|grid| grid.name == name) else { return Ok(None) };
        if grid.was_level_set {
            let message = format!("grid \"{name}\" is a level set: it is converted to a fog volume");
            warnings.add(Some(self.params.span), message);
        }
        let map = IndexMap::new(*self.render_from_medium * grid.world_from_index, None).ok_or_else(|| {
            wrong(self.params, "filename", format!("the transform of grid \"{name}\" cannot be inverted"))
        })?;
        report_bad(self.params, &format!("grid \"{name}\""), grid.voxels.bad_voxels(), self.strict, warnings)?;
        if grid.voxels.bounds().is_none() {
            let message = format!("grid \"{name}\" of {} has no voxels", self.params.owner);
            warnings.add(Some(self.params.span), message);
        }
        Ok(Some(Field { grid: ScalarGrid::Single(grid.voxels.clone()), map, scale: 1.0, offset: 0.0 }))
    }
}

/// What emission is multiplied by: `Lescale`, or by its older name `LeScale`.
fn emission_scale(params: &ParamSet, warnings: &mut Warnings) -> Result<f32> {
    if !params.has("Lescale") {
        return emission_factor(params, "LeScale");
    }
    params.warn_ignored("LeScale", "\"Lescale\" is given too", warnings);
    emission_factor(params, "Lescale")
}

/// Builds the medium.
pub fn nanovdb(
    params: &ParamSet,
    render_from_medium: &DAffine3,
    scene: &SceneDescription,
    strict: bool,
    warnings: &mut Warnings,
) -> Result<Medium> {
    let Some(filename) = params.string("filename")? else {
        let message = format!("{} needs a \"filename\"", params.owner);
        return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
    };
    let path = scene.resolve(filename);
    let span = params.iter().find(|p| p.name == "filename").map_or(params.span, |p| p.span);
    let file = read(&path).map_err(|reason| SceneError::at(span, SceneErrorKind::File { path, reason }))?;
    let source = Source { params, file, render_from_medium, strict };
    let name = params.string("gridname")?.unwrap_or("density");
    let density = source.find(name, warnings)?.ok_or_else(|| {
        let stated = if params.has("gridname") { "gridname" } else { "filename" };
        wrong(params, stated, format!("the file has no grid \"{name}\"")).help(source.list())
    })?;
    let le_scale = emission_scale(params, warnings)?;
    let scale = params.float("temperaturescale", 1.0)?;
    let offset = temperature_offset(params, warnings)?;
    for (name, value) in [("temperaturescale", scale), ("temperatureoffset", offset)] {
        if !value.is_finite() {
            return Err(wrong(params, name, "must be finite"));
        }
    }
    let name = params.string("temperaturename")?.unwrap_or("temperature");
    let temperature = source.find(name, warnings)?;
    if let (None, Some(stated)) = (&temperature, params.get("temperaturename")) {
        let what = format!("{}: the file has no grid \"{name}\"; {}", params.owner, source.list());
        warnings.add_fault(stated.span, what, "the medium does not glow");
    }
    let emission = temperature.map(|field| {
        let kelvin = Field { scale, offset: -offset * scale, ..field };
        let table = BlackbodyTable::new(kelvin.bound(kelvin.grid.largest()), BlackbodyScale::Peak);
        let shape = EmissionShape::Temperature { kelvin, table, scale: None };
        Emission { radiance: Rgb::splat(le_scale), shape, direct: false }
    });
    let parts = GridMediumParts {
        density: Some(density),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: coefficient(params, "sigma_a", Rgb::WHITE)?,
        sigma_s: coefficient(params, "sigma_s", Rgb::WHITE)?,
        scale: factor(params, "scale", 1.0)?,
        emission,
        g: anisotropy(params, warnings)?,
        clip: None,
        motion: None,
    };
    Ok(Medium::Grid(Box::new(GridMedium::new(parts))))
}
