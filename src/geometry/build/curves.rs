//! `curve`: Bézier curves and B-splines of degree 2 and 3, all turned into cubic Bézier segments.
//!
//! Widths follow the transform's mean scale (the cube root of its volume): exact for uniform scales.

use glam::Vec3;

use super::super::{ShapeKind, curve::CurveKind, curve::Curves};
use super::{Placement, Result};
use crate::scene::{ParamSet, Warnings};

pub(super) fn curve(params: &ParamSet, placement: &Placement, warnings: &mut Warnings) -> Result<ShapeKind> {
    let kind = match params.string("type")?.unwrap_or("flat") {
        "flat" => CurveKind::Flat,
        "cylinder" => CurveKind::Cylinder,
        "ribbon" => CurveKind::Ribbon,
        other => {
            let what = format!("{}: \"type\" is \"{other}\", not \"flat\", \"cylinder\" or \"ribbon\"", params.owner);
            warnings.add_fault(params.span, what, "it is taken for \"cylinder\"");
            CurveKind::Cylinder
        }
    };
    let degree = params.integer("degree", 3)?;
    if degree != 2 && degree != 3 {
        return Err(placement.unusable(params, format!("\"degree\" must be 2 or 3, found {degree}")));
    }
    let degree = degree as usize;
    let points = placement.points(params, "P", params.vec3s("P")?)?;
    let control_points = match params.string("basis")?.unwrap_or("bezier") {
        "bezier" => bezier_segments(&points, degree).ok_or_else(|| {
            let what = format!(
                "a Bézier curve of degree {degree} takes {} control points and {degree} for each further segment, found {}",
                degree + 1,
                points.len()
            );
            placement.unusable(params, what)
        })?,
        "bspline" => spline_segments(&points, degree).ok_or_else(|| {
            let what = format!(
                "a B-spline of degree {degree} takes at least {} control points, found {}",
                degree + 1,
                points.len()
            );
            placement.unusable(params, what)
        })?,
        other => {
            let what = format!("\"basis\" is \"{other}\", expected \"bezier\" or \"bspline\"");
            return Err(placement.unusable(params, what));
        }
    };
    let count = control_points.len();
    let width = params.float("width", 1.0)?;
    let ends = [params.float("width0", width)?, params.float("width1", width)?];
    let scale = placement.affine.matrix3.determinant().abs().cbrt() as f32;
    let [start, end] = ends.map(|w| w * scale);
    let sane = |w: f32| (0.0..=super::MAX_COORDINATE).contains(&w);
    if !sane(start) || !sane(end) || (start == 0.0 && end == 0.0) {
        let what = format!("widths must not be negative nor both 0, found {} and {}", ends[0], ends[1]);
        return Err(placement.unusable(params, what));
    }
    // Of no effect: the intersection decides itself how finely a curve is cut.
    params.get("splitdepth");
    let normals: Vec<Vec3> = placement.normals(params, params.vec3s("N")?, false)?;
    let normals: Vec<Vec3> = normals.into_iter().map(Vec3::normalize_or_zero).collect();
    let normals = match kind {
        CurveKind::Ribbon if normals.len() == count + 1 => {
            if let Some(i) = normals.iter().position(|n| *n == Vec3::ZERO) {
                return Err(placement.unusable(params, format!("\"N\" number {i} is zero")));
            }
            normals.windows(2).map(|n| [n[0], n[1]]).collect()
        }
        CurveKind::Ribbon => {
            let what =
                format!("a ribbon of {count} segments takes {} normals in \"N\", found {}", count + 1, normals.len());
            return Err(placement.unusable(params, what));
        }
        CurveKind::Flat | CurveKind::Cylinder => {
            if !normals.is_empty() {
                warnings
                    .add(Some(params.span), format!("{}: only ribbons have normals; \"N\" is ignored", params.owner));
            }
            Vec::new()
        }
    };
    let at = |i: usize| i as f32 / count as f32;
    let intervals: Vec<[f32; 2]> = (0..count).map(|i| [at(i), at(i + 1)]).collect();
    let mix = |v: f32| start + (end - start) * v;
    Ok(ShapeKind::Curves(Curves {
        kind,
        control_points,
        widths: intervals.iter().map(|v| v.map(mix)).collect(),
        parameters: intervals,
        normals,
    }))
}

/// A quadratic Bézier segment as a cubic one.
fn elevated([a, b, c]: [Vec3; 3]) -> [Vec3; 4] {
    [a, (a + 2.0 * b) / 3.0, (2.0 * b + c) / 3.0, c]
}

/// Segments that share their end points; `None` where the number of points does not fit.
fn bezier_segments(points: &[Vec3], degree: usize) -> Option<Vec<[Vec3; 4]>> {
    if points.len() < degree + 1 || !(points.len() - 1).is_multiple_of(degree) {
        return None;
    }
    let starts = (0..points.len() - 1).step_by(degree);
    Some(match degree {
        2 => starts.map(|i| elevated([points[i], points[i + 1], points[i + 2]])).collect(),
        _ => starts.map(|i| [points[i], points[i + 1], points[i + 2], points[i + 3]]).collect(),
    })
}

/// The segments of a uniform B-spline, by its blossom at the knots (Farin, "Curves and Surfaces for CAGD", chapter 8).
fn spline_segments(points: &[Vec3], degree: usize) -> Option<Vec<[Vec3; 4]>> {
    if points.len() < degree + 1 {
        return None;
    }
    let quadratic = |p: &[Vec3]| elevated([0.5 * (p[0] + p[1]), p[1], 0.5 * (p[1] + p[2])]);
    let cubic = |p: &[Vec3]| {
        let (a, b) = ((2.0 * p[1] + p[2]) / 3.0, (p[1] + 2.0 * p[2]) / 3.0);
        let before = (p[0] + 2.0 * p[1]) / 3.0;
        let after = (2.0 * p[2] + p[3]) / 3.0;
        [0.5 * (before + a), a, b, 0.5 * (b + after)]
    };
    Some(match degree {
        2 => points.windows(3).map(quadratic).collect(),
        _ => points.windows(4).map(cubic).collect(),
    })
}
