//! Instances' transforms for Embree.
//!
//! [`MotionTransform`] interpolates M = T R S with a symmetric stretch S. Embree interpolates M = T R U with U upper triangular
//! (scale and skew): the same motion where the stretch is constant or diagonal at both ends (then two keys agree to the
//! rounding of f32, 2e-6 of the largest column at nearly half a turn), another one otherwise. So a motion is sampled at as
//! many keys, exact there, as bring the error between them below [`TOLERANCE`], up to Embree's limit. The error falls by 4
//! with each doubling; what remains at the limit for a skewed stretch that changes by a third while turning 1.2 rad is 4e-6.

use std::sync::Arc;

use ::embree::{Device, Error, Geometry, QuaternionKey, Scene};
use glam::{Affine3A, DAffine3, DMat3, DQuat, DVec3};

use super::scale::Scale;
use crate::geometry::MotionTransform;
use crate::math::transform::Decomposed;

/// The largest error accepted in the linear part between keys, relative to its largest column.
const TOLERANCE: f32 = 1e-6;

/// The most steps between keys: Embree allows 129 keys. A half turn then has steps of 1.4°.
const MAX_STEPS: usize = 128;

/// The instance of `scene`, whose space has the scale `within`, in a render space of the scale `outside`; `None` where the transform flattens it to
/// nothing or is not finite.
pub(super) fn instance(
    device: &Arc<Device>,
    scene: &Arc<Scene>,
    transform: &MotionTransform,
    outside: Scale,
    within: Scale,
) -> Result<Option<Geometry>, Error> {
    let units = Units { length: outside.to_embree, linear: outside.to_embree * within.from_embree };
    match transform {
        MotionTransform::Fixed(affine) => {
            let affine =
                Affine3A { matrix3: affine.matrix3 * units.linear, translation: affine.translation * units.length };
            // Embree inverts in f32; an inverse that is not finite would make rays of NaN. (Scenes with such are refused before.)
            if !affine.is_finite() || !affine.matrix3.determinant().recip().is_finite() {
                return Ok(None);
            }
            Geometry::instance(device, scene, affine.to_cols_array()).map(Some)
        }
        MotionTransform::Moving { start, end } => {
            let mut steps = 1;
            loop {
                let Some(keys) = keys(start, end, units, steps) else {
                    return Ok(None);
                };
                let made = Geometry::moving_instance(device, scene, &keys)?;
                if steps == MAX_STEPS || error(&made, transform, units, steps)? <= TOLERANCE {
                    return Ok(Some(made));
                }
                steps *= 2;
            }
        }
    }
}

/// What transforms are multiplied by for Embree.
#[derive(Clone, Copy)]
struct Units {
    /// Their translations.
    length: f32,
    /// Their linear parts.
    linear: f32,
}

/// `steps` + 1 keys; `None` where one is not finite.
fn keys(start: &Decomposed, end: &Decomposed, units: Units, steps: usize) -> Option<Vec<QuaternionKey>> {
    let at = |step: usize| {
        let affine = start.interpolate(end, step as f64 / steps as f64);
        let (linear, length) = (f64::from(units.linear), f64::from(units.length));
        DAffine3 { matrix3: affine.matrix3 * linear, translation: affine.translation * length }
    };
    (0..=steps).map(|step| key(&at(step))).collect()
}

/// M = T Q U by Gram–Schmidt; Q is a rotation, so that U takes up a reflection.
fn key(affine: &DAffine3) -> Option<QuaternionKey> {
    let m = affine.matrix3;
    let e0 = m.x_axis.try_normalize().unwrap_or(DVec3::X);
    let across = m.y_axis - e0 * e0.dot(m.y_axis);
    let e1 = across.try_normalize().unwrap_or_else(|| e0.any_orthonormal_vector());
    let e2 = e0.cross(e1);
    let q = DQuat::from_mat3(&DMat3::from_cols(e0, e1, e2)).normalize();
    let key = QuaternionKey {
        scale: [e0.dot(m.x_axis), e1.dot(m.y_axis), e2.dot(m.z_axis)].map(|x| x as f32),
        skew: [e0.dot(m.y_axis), e0.dot(m.z_axis), e1.dot(m.z_axis)].map(|x| x as f32),
        rotation: [q.w, q.x, q.y, q.z].map(|x| x as f32),
        translation: affine.translation.as_vec3().to_array(),
    };
    let all = [key.scale.as_slice(), &key.skew, &key.rotation, &key.translation].concat();
    all.iter().all(|x| x.is_finite()).then_some(key)
}

/// The largest relative error of the linear part, looked for in the middle of the steps and at their quarters.
fn error(instance: &Geometry, transform: &MotionTransform, units: Units, steps: usize) -> Result<f32, Error> {
    let mut largest = 0.0f32;
    for quarter in (0..4 * steps).filter(|quarter| quarter % 4 != 0) {
        let time = quarter as f32 / (4 * steps) as f32;
        let found = Affine3A::from_cols_array(&instance.transform_at(time)?).matrix3;
        let wanted = transform.at(time).matrix3 * units.linear;
        let columns = |m: glam::Mat3A| [m.x_axis, m.y_axis, m.z_axis];
        let scale = columns(wanted).map(|c| c.length()).into_iter().fold(f32::MIN_POSITIVE, f32::max);
        for (found, wanted) in columns(found).into_iter().zip(columns(wanted)) {
            largest = largest.max((found - wanted).length() / scale);
        }
    }
    Ok(largest)
}
