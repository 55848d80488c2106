//! How much the lights below a node may matter at a receiver: energy over squared distance, times bounds of the cosines at the receiver
//! and at the emitters. Source: Conty Estevez & Kulla, HPG 2018, section 4.2, equation 3.
//!
//! Conservative: positive wherever a light below can contribute. Distances are never taken as less than the node's radius, and from
//! within its sphere any direction may lead to a light and any side may show, so the value is finite everywhere.

use glam::Vec3;

use super::node::Node;
use crate::light::Receiver;
use crate::light::emitters::{INSIDE, cos_less, larger};

/// Above this no importance goes, so that two of them have a finite sum.
const MAX_IMPORTANCE: f32 = f32::MAX / 4.0;

/// What a cosine may be off by rounding.
const SLACK: f32 = 1e-6;

impl Node {
    /// The importance of the lights below for `receiver`: 0 only where none of them can contribute.
    #[inline(always)]
    pub fn importance(&self, receiver: &Receiver) -> f32 {
        let to_light = self.centre - receiver.p();
        let square = to_light.length_squared();
        let radius_squared = self.radius * self.radius;
        let outer = larger(larger(square, radius_squared), f32::MIN_POSITIVE);
        // The mean of 1/d² over a ball is 3/r² at its centre, 3/(2r²) at its surface and 1/d² far away: this follows it to 5 %.
        let mean_square = if square > radius_squared {
            square - radius_squared * (1.0 / 3.0)
        } else {
            (square + radius_squared) * (1.0 / 3.0)
        };
        let near = larger(mean_square, f32::MIN_POSITIVE);
        let sin_squared = radius_squared / outer;
        let cosines = if square <= radius_squared * INSIDE {
            self.mean_cosines(receiver)
        } else {
            let largest = self.cosines(receiver, to_light * (1.0 / outer.sqrt()), sin_squared);
            if largest > 0.0 { largest + sin_squared * (self.mean_cosines(receiver) - largest) } else { 0.0 }
        };
        if cosines > 0.0 { (self.energy / near * cosines).clamp(f32::MIN_POSITIVE, MAX_IMPORTANCE) } else { 0.0 }
    }

    /// The product of both cosines' means over all directions.
    #[inline(always)]
    fn mean_cosines(&self, receiver: &Receiver) -> f32 {
        let received = match *receiver {
            Receiver::Medium { .. } => 1.0,
            Receiver::Surface { two_sided: false, .. } => 0.25,
            Receiver::Surface { two_sided: true, .. } => 0.5,
        };
        received
            * match (self.is_lambertian(), self.is_two_sided()) {
                (false, _) => 1.0,
                (true, false) => 0.25,
                (true, true) => 0.5,
            }
    }

    /// The largest product of the cosines at both ends that the bounds allow, seen from outside the sphere: its centre in the unit
    /// direction `wi`, the squared sine of its angular radius given.
    #[inline(always)]
    fn cosines(&self, receiver: &Receiver, wi: Vec3, sin_squared: f32) -> f32 {
        let cos_spread = larger(1.0 - sin_squared, 0.0).sqrt();
        let received = match *receiver {
            Receiver::Medium { .. } => 1.0,
            Receiver::Surface { ns, two_sided: false, .. } => cos_less(ns.dot(wi), cos_spread) + SLACK,
            Receiver::Surface { ns, two_sided: true, .. } => cos_less(ns.dot(wi).abs(), cos_spread) + SLACK,
        };
        if received <= 0.0 || self.faces_all_ways() {
            return larger(received, 0.0);
        }
        let cos = -self.axis().dot(wi);
        let cos = if self.is_two_sided() { cos.abs() } else { cos };
        // The normals' cone, widened by what the sphere spans.
        let facing = cos_less(cos_less(cos, self.cos_normals()), cos_spread);
        if facing + SLACK < self.cos_emission() {
            return 0.0;
        }
        received * if self.is_lambertian() { larger(facing, SLACK) } else { 1.0 }
    }

    /// Squared radius over squared distance, below 1 outside the sphere: all that the spread of 1/d² depends on.
    #[inline(always)]
    pub(super) fn squared_extent(&self, receiver: &Receiver) -> f32 {
        let square = (self.centre - receiver.p()).length_squared();
        let radius_squared = self.radius * self.radius;
        // No extent where there is no radius, also at the very spot.
        if radius_squared > 0.0 { radius_squared / larger(square, f32::MIN_POSITIVE) } else { 0.0 }
    }
}
