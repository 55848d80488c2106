//! The part of a density along a ray that is laid out once for many: from one ray of a pixel to the next it hardly differs, nor does it from one pixel to
//! those beside and below it. **Ours**; the paper lays it out once per pixel.

use glam::Vec3;

use super::density::Place;
use crate::geometry::Ray;
use crate::math::piecewise::PiecewiseLinear;

/// Parts that are kept for rays to come. A tile of 16 x 16 pixels, each a fifth of [`super::layout`]'s angle wide, takes about ten.
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
    /// How far from there another ray may go, in radians.
    pub angle: f32,
}

impl Shared {
    fn reaches(&self, ray: &Ray) -> bool {
        ray.t_max <= 1.02 * self.reach
    }

    /// Whether `ray`, number `number` of a path, is almost the same.
    fn serves(&self, ray: &Ray, number: u32) -> bool {
        if !self.reaches(ray) || self.direction.distance_squared(ray.direction) >= self.angle * self.angle {
            return false;
        }
        // Camera rays have what is before the camera in common. What one mirror sends here and another there has not, not even within a pixel.
        number == 1 || self.origin.distance_squared(ray.origin) < (self.angle * self.reach).powi(2)
    }
}

/// Those that were laid out in a tile before the one in use.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// The first `used` of them; the others' memory waits.
    parts: Vec<Shared>,
    used: usize,
    /// Which is given up next.
    oldest: usize,
    /// Layouts made for the current pixel.
    count: u32,
}

impl Kept {
    /// Forgets all.
    pub fn clear(&mut self) {
        (self.used, self.oldest, self.count) = (0, 0, 0);
    }

    /// A new pixel begins.
    pub fn begin_pixel(&mut self) {
        self.count = 0;
    }

    /// Whether `current` serves `ray`, number `number` of a path, or may do so after it was exchanged with one that is kept.
    pub fn find(&mut self, current: &mut Shared, ray: &Ray, number: u32) -> bool {
        // The samples of a pixel always share theirs: it may be large.
        let is_own = number == 1 && self.count > 0 && (self.count >= MOST_LAYOUTS || current.reaches(ray));
        if is_own || current.serves(ray, number) {
            return true;
        }
        let other = self.parts[..self.used].iter_mut().find(|part| part.serves(ray, number));
        other.map(|other| std::mem::swap(other, current)).is_some()
    }

    /// Keeps `current`, in whose place there is an empty one then.
    pub fn keep(&mut self, current: &mut Shared) {
        self.count += 1;
        if current.reach > 0.0 {
            let i = if self.used < MOST_KEPT { self.used } else { self.oldest };
            if i == self.parts.len() {
                self.parts.push(Shared::default());
            }
            std::mem::swap(&mut self.parts[i], current);
            if self.used < MOST_KEPT {
                self.used += 1;
            } else {
                self.oldest = (self.oldest + 1) % MOST_KEPT;
            }
        }
        current.curve.clear();
        current.places.clear();
        current.reach = 0.0;
    }
}
