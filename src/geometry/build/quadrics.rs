//! `sphere`, `disk` and `cylinder`.

use std::f32::consts::TAU;

use glam::{Affine3A, DAffine3, DMat3};

use super::super::{ShapeKind, affine, shape::Cylinder, shape::Disk, shape::Sphere};
use super::{Placement, Result};
use crate::scene::ParamSet;

fn rounded(affine: &DAffine3) -> Affine3A {
    Affine3A { matrix3: affine.matrix3.as_mat3().into(), translation: affine.translation.as_vec3a() }
}

impl Placement<'_> {
    /// The transform, rounded, and the inverse of its linear part.
    fn both_ways(&self, params: &ParamSet) -> Result<(Affine3A, DMat3)> {
        let forward = rounded(&self.affine);
        // Of the transform as it is stored, so that both ways agree.
        let back = affine::linear(&forward).inverse();
        if !self.is_invertible() || !forward.is_finite() || !back.is_finite() {
            return Err(self.error(params, "its transformation flattens it or is too large"));
        }
        Ok((forward, back))
    }

    /// "phimax" in degrees, as radians in (0, 2π].
    fn phi_max(&self, params: &ParamSet) -> Result<f32> {
        let degrees = params.float("phimax", 360.0)?;
        if degrees.is_nan() || degrees <= 0.0 {
            return Err(self.error(params, format!("\"phimax\" must be above 0 degrees, found {degrees}")));
        }
        Ok(if degrees >= 360.0 { TAU } else { degrees.to_radians() })
    }
}

pub(super) fn sphere(params: &ParamSet, placement: &Placement) -> Result<ShapeKind> {
    let radius = params.positive("radius", 1.0)?;
    let (a, b) = (params.float("zmin", -radius)?, params.float("zmax", radius)?);
    if a.is_nan() || b.is_nan() {
        return Err(placement.error(params, "\"zmin\" or \"zmax\" is not a number"));
    }
    let (z_min, z_max) = (a.min(b).clamp(-radius, radius), a.max(b).clamp(-radius, radius));
    if z_min >= z_max {
        return Err(placement.error(params, format!("nothing lies between \"zmin\" {a} and \"zmax\" {b}")));
    }
    let phi_max = placement.phi_max(params)?;
    let (to_shape, inverse) = placement.both_ways(params)?;
    Ok(ShapeKind::Sphere(Sphere { radius, z_min, z_max, phi_max, to_shape, inverse }))
}

pub(super) fn disk(params: &ParamSet, placement: &Placement) -> Result<ShapeKind> {
    let height = params.float("height", 0.0)?;
    if !height.is_finite() {
        return Err(placement.error(params, "\"height\" is not finite"));
    }
    let radius = params.positive("radius", 1.0)?;
    let inner_radius = params.float("innerradius", 0.0)?;
    if !(0.0..radius).contains(&inner_radius) {
        let what = format!("\"innerradius\" must be at least 0 and below the radius {radius}, found {inner_radius}");
        return Err(placement.error(params, what));
    }
    let phi_max = placement.phi_max(params)?;
    let (to_shape, inverse) = placement.both_ways(params)?;
    Ok(ShapeKind::Disk(Disk { height, radius, inner_radius, phi_max, to_shape, inverse }))
}

pub(super) fn cylinder(params: &ParamSet, placement: &Placement) -> Result<ShapeKind> {
    let radius = params.positive("radius", 1.0)?;
    let (a, b) = (params.float("zmin", -1.0)?, params.float("zmax", 1.0)?);
    let (z_min, z_max) = (a.min(b), a.max(b));
    if !(z_min.is_finite() && z_max.is_finite() && z_min < z_max) {
        return Err(placement.error(params, format!("nothing lies between \"zmin\" {a} and \"zmax\" {b}")));
    }
    let phi_max = placement.phi_max(params)?;
    let (to_shape, inverse) = placement.both_ways(params)?;
    Ok(ShapeKind::Cylinder(Cylinder { radius, z_min, z_max, phi_max, to_shape, inverse }))
}
