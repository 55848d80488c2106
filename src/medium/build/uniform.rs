//! `uniformgrid` and `rgbgrid`: dense arrays in the scene file, samples at the cells' centres, nothing outside the box.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::{
    Result, anisotropy, coefficient, emission_factor, factor, radiance, report_bad, temperature_offset, wrong,
};
use crate::math::Rgb;
use crate::medium::Medium;
use crate::medium::grid::emission::{BlackbodyScale, BlackbodyTable, Emission, EmissionShape, PHOTOMETRIC};
use crate::medium::grid::field::{AnyGrid, Field, ScalarGrid};
use crate::medium::grid::map::IndexMap;
use crate::medium::grid::sparse::SparseGrid;
use crate::medium::grid::{GridMedium, GridMediumParts};
use crate::scene::{ParamSet, ParamValue, SceneError, SceneErrorKind, Warnings};

/// Where the samples of a dense grid lie.
pub(super) struct Lattice {
    size: [u32; 3],
    map: IndexMap,
    clip: (DVec3, DVec3),
}

impl Lattice {
    fn new(params: &ParamSet, render_from_medium: &DAffine3) -> Result<Self> {
        let mut size = [0u32; 3];
        for (n, name) in size.iter_mut().zip(["nx", "ny", "nz"]) {
            let value = params.integer(name, 1)?;
            *n = u32::try_from(value).ok().filter(|&n| n > 0).ok_or_else(|| wrong(params, name, "must be positive"))?;
        }
        let p0 = Vec3::from_array(params.vec3("p0")?.unwrap_or([0.0; 3])).as_dvec3();
        let p1 = Vec3::from_array(params.vec3("p1")?.unwrap_or([1.0; 3])).as_dvec3();
        Self::within(params, render_from_medium, p0, p1, size)
    }

    /// So many cells between two corners.
    pub fn within(
        params: &ParamSet,
        render_from_medium: &DAffine3,
        p0: DVec3,
        p1: DVec3,
        size: [u32; 3],
    ) -> Result<Self> {
        // pbrt orders the corners.
        let (p0, p1) = (p0.min(p1), p0.max(p1));
        let n = DVec3::new(f64::from(size[0]), f64::from(size[1]), f64::from(size[2]));
        let cell = (p1 - p0) / n;
        let medium_from_index = DAffine3::from_translation(p0 + 0.5 * cell) * DAffine3::from_scale(cell);
        let map = IndexMap::new(*render_from_medium * medium_from_index, None)
            .ok_or_else(|| wrong(params, "p1", "the grid's box (or its transform) has no volume"))?;
        Ok(Self { size, map, clip: (DVec3::splat(-0.5), n - 0.5) })
    }

    fn count(&self) -> u64 {
        self.size.iter().fold(1, |product, &n| product.saturating_mul(u64::from(n)))
    }

    fn check(&self, params: &ParamSet, name: &str, found: usize) -> Result<()> {
        if found as u64 == self.count() {
            return Ok(());
        }
        let [nx, ny, nz] = self.size;
        Err(wrong(params, name, format!("{nx}×{ny}×{nz} = {} values expected, found {found}", self.count())))
    }

    fn scalars(&self, params: &ParamSet, name: &str) -> Result<Option<Arc<SparseGrid<f32>>>> {
        let values = params.floats(name)?;
        if values.is_empty() {
            return Ok(None);
        }
        self.check(params, name, values.len())?;
        Ok(Some(Arc::new(SparseGrid::from_dense(self.size, |i| values[i], 0.0))))
    }

    fn colours(&self, params: &ParamSet, name: &str, as_light: bool) -> Result<Option<Vec<[f32; 3]>>> {
        let values = params.spectra(name)?;
        if values.is_empty() {
            return Ok(None);
        }
        self.check(params, name, values.len())?;
        let reduce = |s: &crate::math::spectrum::Spectrum| if as_light { s.to_illuminant() } else { s.to_unbounded() };
        Ok(Some(values.iter().map(|s| reduce(s).to_array()).collect()))
    }

    /// A grid in this place.
    pub fn field<G>(&self, grid: G) -> Field<G> {
        Field { grid, map: self.map, scale: 1.0, offset: 0.0 }
    }

    /// Outside of this, in index space, there is nothing.
    pub fn clip(&self) -> (DVec3, DVec3) {
        self.clip
    }

    fn vectors(&self, values: &[[f32; 3]]) -> Field<AnyGrid> {
        self.field(AnyGrid::Vector(Arc::new(SparseGrid::from_dense(self.size, |i| values[i], [0.0; 3]))))
    }
}

/// pbrt's `uniformgrid`. Emission is μ_a L_e · Lescale (or black bodies of `temperature`); where no `Lescale` is given it
/// is 1 everywhere.
pub fn uniform_grid(
    params: &ParamSet,
    render_from_medium: &DAffine3,
    strict: bool,
    warnings: &mut Warnings,
) -> Result<Medium> {
    let lattice = Lattice::new(params, render_from_medium)?;
    let density = lattice.scalars(params, "density")?.ok_or_else(|| {
        let message = format!("{} needs a \"density\"", params.owner);
        SceneError::at(params.span, SceneErrorKind::Parameter(message))
    })?;
    report_bad(params, "\"density\"", density.bad_voxels(), strict, warnings)?;
    let temperature = lattice.scalars(params, "temperature")?;
    let le = radiance(params, "Le")?;
    // One value is a factor, as many as there are cells are a grid.
    let (le_scale, le_grid) = match params.get("Lescale").map(|p| &p.value) {
        Some(ParamValue::Float(v)) if v.len() == 1 && lattice.count() != 1 => {
            (emission_factor(params, "Lescale")?, None)
        }
        _ => (1.0, lattice.scalars(params, "Lescale")?),
    };
    let le_grid = match le_grid {
        Some(grid) => {
            report_bad(params, "\"Lescale\"", grid.bad_voxels(), strict, warnings)?;
            Some(lattice.field(AnyGrid::Scalar(ScalarGrid::Single(grid))))
        }
        None => None,
    };
    let emission = match (temperature, le) {
        (Some(_), Some(_)) => return Err(wrong(params, "temperature", "cannot be given together with \"Le\"")),
        (Some(grid), None) => {
            report_bad(params, "\"temperature\"", grid.bad_voxels(), strict, warnings)?;
            // pbrt: kelvin = (value − offset) · scale.
            let scale = params.float("temperaturescale", 1.0)?;
            let offset = temperature_offset(params, warnings)?;
            let field = lattice.field(ScalarGrid::Single(grid));
            let kelvin = Field { scale, offset: -offset * scale, ..field };
            let table = BlackbodyTable::new(kelvin.bound(kelvin.grid.largest()), BlackbodyScale::Peak);
            let shape = EmissionShape::Temperature { kelvin, table, scale: le_grid };
            Some(Emission { radiance: Rgb::splat(le_scale), shape, direct: false })
        }
        (None, Some(le)) => {
            let shape = le_grid.map_or(EmissionShape::Constant, EmissionShape::Grid);
            Some(Emission { radiance: le * le_scale, shape, direct: false })
        }
        (None, None) => None,
    };
    let parts = GridMediumParts {
        density: Some(lattice.field(ScalarGrid::Single(density))),
        absorption_colour: None,
        scattering_colour: None,
        bound: None,
        sigma_a: coefficient(params, "sigma_a", Rgb::WHITE)?,
        sigma_s: coefficient(params, "sigma_s", Rgb::WHITE)?,
        scale: factor(params, "scale", 1.0)?,
        emission,
        g: anisotropy(params, warnings)?,
        clip: Some(lattice.clip),
        motion: None,
    };
    Ok(Medium::Grid(Box::new(GridMedium::new(parts))))
}

/// pbrt's `rgbgrid`: σ_a and σ_s (and L_e) cell by cell; one of the first two may be left out and is then 1 everywhere. L_e counts [`PHOTOMETRIC`] times.
pub fn rgb_grid(
    params: &ParamSet,
    render_from_medium: &DAffine3,
    strict: bool,
    warnings: &mut Warnings,
) -> Result<Medium> {
    let lattice = Lattice::new(params, render_from_medium)?;
    let sigma_a = lattice.colours(params, "sigma_a", false)?;
    let sigma_s = lattice.colours(params, "sigma_s", false)?;
    if sigma_a.is_none() && sigma_s.is_none() {
        let message = format!("{} needs a \"sigma_a\" or a \"sigma_s\"", params.owner);
        return Err(SceneError::at(params.span, SceneErrorKind::Parameter(message)));
    }
    let le = lattice.colours(params, "Le", true)?;
    if le.is_some() && sigma_a.is_none() {
        return Err(wrong(params, "Le", "needs a \"sigma_a\""));
    }
    let part = |values: &Option<Vec<[f32; 3]>>, i: usize| {
        // The same cleaning as in the grids themselves.
        values
            .as_ref()
            .map_or(Vec3::ONE, |v| Vec3::from_array(v[i].map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 })))
    };
    let extinction = |i: usize| (part(&sigma_a, i) + part(&sigma_s, i)).max_element().min(f32::MAX);
    // A constant 1 does not fade towards the box's sides as this grid does; but bounds are those of whole cells, which do not fade.
    let bound = lattice.field(ScalarGrid::Single(Arc::new(SparseGrid::from_dense(lattice.size, extinction, 0.0))));
    let absorption_colour = sigma_a.as_deref().map(|v| lattice.vectors(v));
    let scattering_colour = sigma_s.as_deref().map(|v| lattice.vectors(v));
    let emission = le.map(|values| Emission {
        radiance: Rgb::splat(1.0),
        shape: EmissionShape::Grid(lattice.vectors(&values)),
        direct: false,
    });
    let mut emission = emission;
    if let Some(emission) = &mut emission {
        emission.radiance = Rgb::splat(emission_factor(params, "Lescale")? * PHOTOMETRIC);
        if let EmissionShape::Grid(field) = &emission.shape {
            report_bad(params, "\"Le\"", field.grid.bad_voxels(), strict, warnings)?;
        }
    }
    for (name, field) in [("\"sigma_a\"", &absorption_colour), ("\"sigma_s\"", &scattering_colour)] {
        let bad = field.as_ref().map_or(0, |f| f.grid.bad_voxels());
        report_bad(params, name, bad, strict, warnings)?;
    }
    let parts = GridMediumParts {
        density: None,
        absorption_colour,
        scattering_colour,
        bound: Some(bound),
        sigma_a: Rgb::WHITE,
        sigma_s: Rgb::WHITE,
        scale: factor(params, "scale", 1.0)?,
        emission,
        g: anisotropy(params, warnings)?,
        clip: Some(lattice.clip),
        motion: None,
    };
    Ok(Medium::Grid(Box::new(GridMedium::new(parts))))
}
