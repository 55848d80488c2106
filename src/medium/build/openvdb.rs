//! The medium type `openvdb`: grids of a .vdb file.
//!
//! | parameter | meaning | default |
//! |---|---|---|
//! | string `filename` | the file, beside the scene file unless absolute | required |
//! | string `density` | name or name\\[index\\] of the density grid | `density`, else the only fog volume |
//! | string `temperature`, `emission`, `color` | names of further grids | none |
//! | `sigma_a`, `sigma_s` | coefficients where density is 1, per unit length | 1 |
//! | float `scale` | factor on both | 1 |
//! | float `densityscale`, `densityoffset` | density = scale · value + offset, at least 0 | 1, 0 |
//! | `Le` | radiance (with a temperature or emission grid: factor on it) | 1 with such a grid, else none |
//! | float `temperaturescale`, `temperatureoffset` | kelvin = scale · value + offset | 1, 0 |
//! | float `temperaturereference` | a black body of this temperature has luminance 1 | 1500 |
//! | float `emissionscale`, `emissionoffset` | as for density | 1, 0 |
//! | bool `emissiondirect` | emission per unit length, not multiplied by μ_a | false |
//! | string `velocity` | name of a grid of vectors by which all grids move, or names of three grids of its components | none |
//! | float `velocityscale` | factor on it: units of the medium's space per unit of the scene's time | 1 |
//! | float `velocitytime` | the time at which the grids are where they are | that of the transforms' first key |
//! | float `g` | Henyey-Greenstein's mean cosine | 0 |
//!
//! The colour grid multiplies σ_s. A black body's radiance is its chromaticity times its luminance over that of the
//! reference temperature (Planck's law under ȳ): doubling kelvin brightens a flame as physics does.

#[cfg(not(feature = "openvdb"))]
use {
    super::Result,
    crate::medium::Medium,
    crate::scene::{ParamSet, SceneDescription, SceneError, SceneErrorKind, Warnings},
    glam::DAffine3,
};

/// Refuses: this build cannot read .vdb files.
#[cfg(not(feature = "openvdb"))]
pub fn openvdb(params: &ParamSet, _: &DAffine3, _: &SceneDescription, _: bool, _: &mut Warnings) -> Result<Medium> {
    let message = format!("{}: {}", params.owner, crate::medium::grid::file::LEFT_OUT);
    Err(SceneError::at(params.span, SceneErrorKind::Unsupported(message))
        .help("build with the cargo feature \"openvdb\", or give the grid as \"uniformgrid\""))
}

#[cfg(feature = "openvdb")]
pub use reading::openvdb;

#[cfg(feature = "openvdb")]
mod reading {
    use glam::{DAffine3, DMat3};
    use openvdb::{GridClass, VdbGrid};

    use super::super::{Result, anisotropy, coefficient, factor, radiance, report_bad, wrong};
    use crate::math::Rgb;
    use crate::medium::Medium;
    use crate::medium::grid::emission::{BlackbodyScale, BlackbodyTable, Emission, EmissionShape, HOTTEST};
    use crate::medium::grid::field::{AnyGrid, Field, ScalarGrid};
    use crate::medium::grid::map::IndexMap;
    use crate::medium::grid::motion::{FARTHEST, Motion};
    use crate::medium::grid::velocity::VelocityField;
    use crate::medium::grid::{GridMedium, GridMediumParts, file};
    use crate::scene::{ParamSet, SceneDescription, SceneError, SceneErrorKind, Warnings};

    /// The grids of one file, and whom to tell about them.
    struct Source<'a> {
        params: &'a ParamSet,
        grids: Vec<VdbGrid>,
        render_from_medium: &'a DAffine3,
        strict: bool,
    }

    impl Source<'_> {
        fn list(&self) -> String {
            let names: Vec<String> = self
                .grids
                .iter()
                .map(|g| {
                    let h = &g.header;
                    let repeated = self.grids.iter().filter(|other| other.header.name == h.name).count() > 1;
                    let number = if repeated { format!("[{}]", h.index) } else { String::new() };
                    format!("\"{}{number}\" ({})", h.name, h.value_type)
                })
                .collect();
            format!("the file has {}", names.join(", "))
        }

        /// The grid called `wanted`: a name, or `name[index]`.
        fn find(&self, parameter: &str, wanted: &str) -> Result<usize> {
            let exact = self.grids.iter().position(|g| g.header.name == wanted && g.header.index == 0);
            let indexed = || {
                let (name, digits) = wanted.strip_suffix(']')?.rsplit_once('[')?;
                let index: u32 = digits.parse().ok()?;
                self.grids.iter().position(|g| g.header.name == name && g.header.index == index)
            };
            exact.or_else(indexed).ok_or_else(|| {
                wrong(self.params, parameter, format!("the file has no grid \"{wanted}\"")).help(self.list())
            })
        }

        /// The density grid where none is named.
        fn default_density(&self) -> Result<usize> {
            if let Some(found) =
                self.grids.iter().position(|g| g.header.name == "density" && g.header.skipped.is_none())
            {
                return Ok(found);
            }
            let is_fog = |g: &&VdbGrid| {
                let h = &g.header;
                h.skipped.is_none()
                    && matches!(h.value_type.as_str(), "float" | "double")
                    && (h.was_level_set || h.class == GridClass::FogVolume)
            };
            let scalar =
                |g: &&VdbGrid| g.header.skipped.is_none() && matches!(g.header.value_type.as_str(), "float" | "double");
            let only = |test: &dyn Fn(&&VdbGrid) -> bool| {
                let mut found = self.grids.iter().enumerate().filter(|(_, g)| test(g));
                let first = found.next().map(|(i, _)| i);
                first.filter(|_| found.next().is_none())
            };
            only(&is_fog).or_else(|| only(&scalar)).ok_or_else(|| {
                let message = format!("{}: which grid is the density?", self.params.owner);
                SceneError::at(self.params.span, SceneErrorKind::Parameter(message))
                    .help(format!("name it with \"string density\"; {}", self.list()))
            })
        }

        fn take(
            &mut self,
            parameter: &str,
            number: usize,
            [scale, offset]: [f32; 2],
            warnings: &mut Warnings,
        ) -> Result<Field<AnyGrid>> {
            let grid = &mut self.grids[number];
            let name = grid.header.name.clone();
            if let Some(reason) = &grid.header.skipped {
                return Err(wrong(self.params, parameter, format!("grid \"{name}\" cannot be used: {reason}")));
            }
            if grid.header.was_level_set {
                let message = format!("grid \"{name}\" is a level set: it is converted to a fog volume");
                warnings.add(Some(self.params.span), message);
            }
            let map = file::place(grid, self.render_from_medium).ok_or_else(|| {
                wrong(self.params, parameter, format!("the transform of grid \"{name}\" cannot be inverted"))
            })?;
            if grid.header.active_voxels == 0 {
                let message = format!("grid \"{name}\" of {} has no active voxels", self.params.owner);
                warnings.add(Some(self.params.span), message);
            }
            // A grid may serve twice, so the file's copy stays.
            let any = file::voxels(&mut grid.clone())
                .ok_or_else(|| wrong(self.params, parameter, format!("grid \"{name}\" holds nothing")))?;
            report_bad(self.params, &format!("grid \"{name}\""), any.bad_voxels(), self.strict, warnings)?;
            Ok(Field { grid: any, map, scale, offset })
        }

        fn scalar(
            &mut self,
            parameter: &str,
            number: usize,
            adjust: [f32; 2],
            warnings: &mut Warnings,
        ) -> Result<Field<ScalarGrid>> {
            let Field { grid, map, scale, offset } = self.take(parameter, number, adjust, warnings)?;
            match grid {
                AnyGrid::Scalar(grid) => Ok(Field { grid, map, scale, offset }),
                AnyGrid::Vector(_) => {
                    Err(wrong(self.params, parameter, "a grid of numbers is needed, not of vectors").help(self.list()))
                }
            }
        }

        fn optional(
            &mut self,
            parameter: &str,
            adjust: [f32; 2],
            warnings: &mut Warnings,
        ) -> Result<Option<Field<AnyGrid>>> {
            let Some(name) = self.params.string(parameter)? else { return Ok(None) };
            let number = self.find(parameter, name)?;
            self.take(parameter, number, adjust, warnings).map(Some)
        }

        /// The place of the grid `name`, and the velocities that `of` finds in it.
        fn moving<T>(&self, name: &str, of: fn(&VdbGrid) -> Option<T>, needed: &str) -> Result<(IndexMap, T)> {
            let grid = &self.grids[self.find("velocity", name)?];
            let refuse = |reason: String| wrong(self.params, "velocity", format!("grid \"{name}\" {reason}"));
            if let Some(reason) = &grid.header.skipped {
                return Err(refuse(format!("cannot be used: {reason}")));
            }
            let map = file::place(grid, self.render_from_medium)
                .ok_or_else(|| refuse("has a transform that cannot be inverted".to_owned()))?;
            let velocities =
                of(grid).ok_or_else(|| refuse(format!("will not do: {needed} is needed")).help(self.list()))?;
            Ok((map, velocities))
        }

        /// The motion that velocity grids describe; `times` are those of the transforms' keys.
        fn motion(&self, [start, end]: [f64; 2], warnings: &mut Warnings) -> Result<Option<Motion>> {
            let params = self.params;
            let scale = params.float("velocityscale", 1.0)?;
            let written = f64::from(params.float("velocitytime", start as f32)?);
            let names = params.strings("velocity")?;
            if names.is_empty() {
                return Ok(None);
            }
            for (parameter, is_fine) in [("velocityscale", scale.is_finite()), ("velocitytime", written.is_finite())] {
                if !is_fine {
                    return Err(wrong(params, parameter, "must be finite"));
                }
            }
            let field = match names {
                [name] => {
                    let (map, grid) =
                        self.moving(name, file::velocities, "a grid of vectors, or the names of three of numbers,")?;
                    report_bad(params, &format!("grid \"{name}\""), grid.bad_voxels(), self.strict, warnings)?;
                    VelocityField::Vectors(grid, map)
                }
                [x, y, z] => {
                    let mut part = |name: &String| -> Result<_> {
                        let (map, grid) =
                            self.moving(name, file::component, "a grid of numbers, where there are three,")?;
                        report_bad(params, &format!("grid \"{name}\""), grid.bad_voxels(), self.strict, warnings)?;
                        Ok((grid, map))
                    };
                    VelocityField::Components(Box::new([part(x)?, part(y)?, part(z)?]))
                }
                _ => {
                    let message = format!("one grid of vectors or three of numbers are needed, not {}", names.len());
                    return Err(wrong(params, "velocity", message).help(self.list()));
                }
            };
            if !(end > start) || scale == 0.0 {
                return Ok(None);
            }
            let length = end - start;
            let linear =
                self.render_from_medium.matrix3 * DMat3::from_diagonal(glam::DVec3::splat(f64::from(scale) * length));
            let motion = Motion {
                field,
                render_from_velocity: linear.as_mat3(),
                written_at: ((written - start) / length) as f32,
            };
            Ok(Some(motion))
        }
    }

    fn adjustment(params: &ParamSet, what: &str) -> Result<[f32; 2]> {
        let value = |suffix: &str, default| {
            let name = format!("{what}{suffix}");
            let value = params.float(&name, default)?;
            if value.is_finite() { Ok(value) } else { Err(wrong(params, &name, "must be finite")) }
        };
        Ok([value("scale", 1.0)?, value("offset", 0.0)?])
    }

    /// Builds the medium.
    pub fn openvdb(
        params: &ParamSet,
        render_from_medium: &DAffine3,
        scene: &SceneDescription,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Medium> {
        let filename = params.string("filename")?.ok_or_else(|| {
            let message = format!("{} needs a \"filename\"", params.owner);
            SceneError::at(params.span, SceneErrorKind::Parameter(message))
        })?;
        let path = scene.resolve(filename);
        let span = params.iter().find(|p| p.name == "filename").map_or(params.span, |p| p.span);
        let grids = file::read(&path).map_err(|kind| SceneError::at(span, kind))?;
        let mut source = Source { params, grids, render_from_medium, strict };
        let number = match params.string("density")? {
            Some(name) => source.find("density", name)?,
            None => source.default_density()?,
        };
        let density = source.scalar("density", number, adjustment(params, "density")?, warnings)?;
        let scattering_colour = source.optional("color", [1.0, 0.0], warnings)?;
        let emission_grid = source.optional("emission", adjustment(params, "emission")?, warnings)?;
        let le = radiance(params, "Le")?;
        let direct = params.bool("emissiondirect", false)?;
        let kelvin = adjustment(params, "temperature")?;
        let reference = params.positive("temperaturereference", 1500.0)?;
        let emission = match (params.string("temperature")?, emission_grid) {
            (Some(name), scale) => {
                let number = source.find("temperature", name)?;
                let kelvin = source.scalar("temperature", number, kelvin, warnings)?;
                if direct {
                    return Err(wrong(
                        params,
                        "emissiondirect",
                        "needs an \"emission\" grid without a \"temperature\"",
                    ));
                }
                let hottest = kelvin.bound(kelvin.grid.largest());
                if hottest > HOTTEST {
                    let message = format!("temperatures of up to {hottest:e} K are taken as {HOTTEST:e} K");
                    warnings.add(Some(params.span), message);
                }
                let table = BlackbodyTable::new(hottest, BlackbodyScale::Relative(reference));
                let shape = EmissionShape::Temperature { kelvin, table, scale };
                Some(Emission { radiance: le.unwrap_or(Rgb::WHITE), shape, direct: false })
            }
            (None, Some(field)) => {
                let shape = EmissionShape::Grid(field);
                Some(Emission { radiance: le.unwrap_or(Rgb::WHITE), shape, direct })
            }
            (None, None) if direct => {
                return Err(wrong(params, "emissiondirect", "needs an \"emission\" grid"));
            }
            (None, None) => le.map(|radiance| Emission { radiance, shape: EmissionShape::Constant, direct: false }),
        };
        let motion = source.motion(scene.transform_times, warnings)?;
        if let Some(motion) = &motion {
            let voxels = motion.farthest(&density.map);
            if voxels > FARTHEST {
                let message = format!(
                    "moves by up to {voxels:.0} voxels while the shutter may be open, more than {FARTHEST} are too many"
                );
                return Err(
                    wrong(params, "velocity", message).help("\"velocityscale\" is what velocities are multiplied by")
                );
            }
        }
        let parts = GridMediumParts {
            density: Some(density),
            absorption_colour: None,
            scattering_colour,
            bound: None,
            sigma_a: coefficient(params, "sigma_a", Rgb::WHITE)?,
            sigma_s: coefficient(params, "sigma_s", Rgb::WHITE)?,
            scale: factor(params, "scale", 1.0)?,
            emission,
            g: anisotropy(params, warnings)?,
            clip: None,
            motion,
        };
        Ok(Medium::Grid(Box::new(GridMedium::new(parts))))
    }
}
