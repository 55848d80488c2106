//! The part of a density along a ray that is laid out once for many: from one ray of a pixel to the next it hardly differs, nor does it from one pixel to
//! those beside and below it. **Ours**; the paper lays it out once per pixel.

use glam::Vec3;

use super::density::Place;
use crate::geometry::Ray;
use crate::math::piecewise::PiecewiseLinear;

/// Parts that are kept for rays to come: in small images those of a few rows of a tile's pixels, in large ones all of it.
const MOST_KEPT: usize = 16;
/// How often it is laid out anew for a pixel because a ray reaches farther than the ones before.
const MOST_LAYOUTS: u32 = 3;

/// Such a part, and the rays that it serves.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub curve: PiecewiseLinear,
    /// Where its knots are; none where there are no beams.
    pub places: Vec<Place>,
    /// From where and where to the ray went that it was laid out for.
    pub origin: Vec3,
    pub direction: Vec3,
    /// How far that ray went; 0 where there was none.
    pub reach: f32,
    /// How far of that was looked at.
    pub length: f32,
    /// How far from there another ray may go, in radians.
    pub angle: f32,
}

impl Shared {
    fn reaches(&self, ray: &Ray) -> bool {
        ray.t_max <= 1.02 * self.reach
    }

    /// Whether `ray` is almost the same.
    fn serves(&self, ray: &Ray) -> bool {
        self.reaches(ray)
            && self.direction.distance_squared(ray.direction) < self.angle * self.angle
            && self.origin.distance_squared(ray.origin) <= (self.angle * self.length).powi(2)
    }
}

/// Those that were laid out in a tile before the one in use.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// The first `used` of them; the others' memory waits.
    parts: Vec<Shared>,
    used: usize,
    /// Which is given up next.
    next: usize,
    /// Layouts made for the current pixel.
    count: u32,
    /// Whether the one in use is one of those.
    is_own: bool,
}

impl Kept {
    /// Forgets all.
    pub fn clear(&mut self) {
        (self.used, self.next) = (0, 0);
        self.begin_pixel();
    }

    /// A new pixel begins.
    pub fn begin_pixel(&mut self) {
        (self.count, self.is_own) = (0, false);
    }

    /// Whether `current` serves `ray`, number `number` of a path, or may do so after it was exchanged with one that is kept.
    pub fn find(&mut self, current: &mut Shared, ray: &Ray, number: u32) -> bool {
        // The samples of a pixel always share theirs: it may be large. What one mirror sends here and another there has nothing in common, not even
        // within a pixel.
        let is_of_pixel = number == 1 && (self.count >= MOST_LAYOUTS || self.is_own && current.reaches(ray));
        if is_of_pixel || current.serves(ray) {
            return true;
        }
        let Some(other) = self.parts[..self.used].iter_mut().find(|part| part.serves(ray)) else { return false };
        std::mem::swap(other, current);
        self.is_own = false;
        true
    }

    /// Keeps `current`, in whose place there is an empty one then.
    pub fn keep(&mut self, current: &mut Shared) {
        (self.count, self.is_own) = (self.count + 1, true);
        if current.reach > 0.0 {
            let i = if self.used < MOST_KEPT { self.used } else { self.next };
            if i == self.parts.len() {
                self.parts.push(Shared::default());
            }
            std::mem::swap(&mut self.parts[i], current);
            if self.used < MOST_KEPT {
                self.used += 1;
            } else {
                self.next = (self.next + 1) % MOST_KEPT;
            }
        }
        current.curve.clear();
        current.places.clear();
        current.reach = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: Vec3, angle: f32, t_max: f32) -> Ray {
        Ray { origin, direction: Vec3::new(angle.sin(), 0.0, angle.cos()), t_max, time: 0.0, opacity_seed: 0 }
    }

    /// As [`super::super::layout`] does.
    fn lay_out(kept: &mut Kept, current: &mut Shared, ray: &Ray, number: u32) -> bool {
        if kept.find(current, ray, number) {
            return false;
        }
        kept.keep(current);
        assert!(current.reach == 0.0);
        let Ray { origin, direction, t_max, .. } = *ray;
        *current =
            Shared { origin, direction, reach: t_max, length: t_max.min(10.0), angle: 0.01, ..Shared::default() };
        true
    }

    #[test]
    fn rays_share_what_was_laid_out_for_one_that_is_almost_the_same() {
        let (mut kept, mut current) = (Kept::default(), Shared::default());
        let mut is_new = |kept: &mut Kept, x: f32, angle: f32, t_max: f32, number: u32| {
            lay_out(kept, &mut current, &ray(Vec3::new(x, 0.0, 0.0), angle, t_max), number)
        };
        assert!(is_new(&mut kept, 0.0, 0.0, 4.0, 1));
        // The pixel's own samples, however far apart.
        assert!(!is_new(&mut kept, 0.0, 0.5, 4.0, 1));
        // One that reaches farther, another pixel in another direction, and back.
        assert!(is_new(&mut kept, 0.0, 0.0, 5.0, 1));
        kept.begin_pixel();
        assert!(is_new(&mut kept, 0.0, 0.2, 4.0, 1));
        kept.begin_pixel();
        assert!(!is_new(&mut kept, 0.0, 0.001, 5.0, 1));
        // That one is not this pixel's own: a sample elsewhere has no use for it.
        assert!(is_new(&mut kept, 0.0, 0.4, 5.0, 1));
        kept.begin_pixel();
        // Side by side, as rays of an orthographic camera are.
        assert!(!is_new(&mut kept, 0.03, 0.4, 5.0, 1));
        assert!(is_new(&mut kept, 0.3, 0.4, 5.0, 1));
        kept.begin_pixel();
        // What mirrors send here and there is no pixel's own, and infinite reach is no leave to begin anywhere.
        assert!(is_new(&mut kept, 0.0, 0.6, f32::INFINITY, 2) && is_new(&mut kept, 9.0, 0.6, f32::INFINITY, 2));
        assert!(!is_new(&mut kept, 0.05, 0.6, f32::INFINITY, 2));
        kept.clear();
    }

    #[test]
    fn so_many_are_kept_and_no_more() {
        let (mut kept, mut current) = (Kept::default(), Shared::default());
        let pixel = |kept: &mut Kept, current: &mut Shared, k: usize| {
            kept.begin_pixel();
            lay_out(kept, current, &ray(Vec3::ZERO, 0.03 * k as f32, 1.0), 1)
        };
        assert!((0..=MOST_KEPT).all(|k| pixel(&mut kept, &mut current, k)));
        assert!((0..=MOST_KEPT).all(|k| !pixel(&mut kept, &mut current, k)), "all are there");
        assert!(pixel(&mut kept, &mut current, MOST_KEPT + 1));
        assert!((0..=MOST_KEPT).any(|k| pixel(&mut kept, &mut current, k)), "one had to go");
        assert_eq!(kept.parts.len(), MOST_KEPT);
        // A pixel is laid out for so often, then its samples take what there is.
        kept.begin_pixel();
        let reach = |k: u32| ray(Vec3::ZERO, 2.0, (k + 1) as f32);
        assert_eq!((0..9).filter(|&k| lay_out(&mut kept, &mut current, &reach(k), 1)).count(), MOST_LAYOUTS as usize);
        kept.clear();
        current.reach = 0.0;
        assert!(pixel(&mut kept, &mut current, 0), "what is cleared serves none");
    }
}
