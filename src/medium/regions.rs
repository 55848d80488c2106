//! Which media a point lies in. A path carries [`Regions`] and updates them as it crosses boundaries.
//!
//! A *region* is the inside of one boundary shape (of one instance). A region with interface (inside, outside) adds its inside medium and
//! takes away its outside medium. For scenes that follow pbrt's rule (the outside named is the medium around) exactly one medium
//! is active at a time, as in pbrt; regions that merely overlap add up, which pbrt cannot do: nested, overlapping and ambient media all fall
//! out of this one rule. Entering a region twice is entering it once, so a ray through a shared edge, or an origin on
//! the wrong side of a boundary by a rounding error, mends itself at the next crossing.

use arrayvec::ArrayVec;

use super::MediumId;
use crate::geometry::{InstanceId, ShapeId};

/// The media on the two sides of a boundary; `None` is vacuum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Interface {
    /// On the side that the normal points away from.
    pub inside: Option<MediumId>,
    /// On the side that the normal points to.
    pub outside: Option<MediumId>,
}

impl Interface {
    /// Whether crossing changes anything.
    pub fn is_transition(&self) -> bool {
        self.inside != self.outside
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Region {
    shape: ShapeId,
    instance: Option<InstanceId>,
    interface: Interface,
}

/// How many regions may overlap at one point; entering more is ignored (and [`Regions::enter`] says so).
pub const MAX_OVERLAP: usize = 32;

/// The regions around a point, and the media that follow from them.
#[derive(Clone, Debug, Default)]
pub struct Regions {
    ambient: Option<MediumId>,
    regions: ArrayVec<Region, MAX_OVERLAP>,
    media: ArrayVec<MediumId, { MAX_OVERLAP + 1 }>,
}

impl Regions {
    /// Outside every region, in the medium that surrounds the whole scene.
    pub fn new(ambient: Option<MediumId>) -> Self {
        let mut regions = Self { ambient, ..Self::default() };
        regions.update();
        regions
    }

    /// Becomes equal to `other`, moving no more than there is.
    #[inline]
    pub fn copy_from(&mut self, other: &Self) {
        self.ambient = other.ambient;
        self.regions.clone_from(&other.regions);
        self.media.clone_from(&other.media);
    }

    /// Whether this is outside every region, with no medium around the scene.
    #[inline]
    pub fn are_none(&self) -> bool {
        self.ambient.is_none() && self.regions.is_empty()
    }

    /// The medium that surrounds the whole scene.
    pub fn ambient(&self) -> Option<MediumId> {
        self.ambient
    }

    /// The media here, each once, in rising order.
    #[inline]
    pub fn media(&self) -> &[MediumId] {
        &self.media
    }

    /// Enters the inside of a boundary. False where [`MAX_OVERLAP`] regions are active already.
    pub fn enter(&mut self, shape: ShapeId, instance: Option<InstanceId>, interface: Interface) -> bool {
        if self.position(shape, instance).is_some() {
            return true;
        }
        let fits = self.regions.try_push(Region { shape, instance, interface }).is_ok();
        self.update();
        fits
    }

    /// Leaves the inside of a boundary.
    pub fn leave(&mut self, shape: ShapeId, instance: Option<InstanceId>) {
        if let Some(place) = self.position(shape, instance) {
            self.regions.remove(place);
            self.update();
        }
    }

    /// [`Regions::enter`] or [`Regions::leave`].
    pub fn cross(
        &mut self,
        shape: ShapeId,
        instance: Option<InstanceId>,
        interface: Interface,
        entering: bool,
    ) -> bool {
        if entering {
            self.enter(shape, instance, interface)
        } else {
            self.leave(shape, instance);
            true
        }
    }

    fn position(&self, shape: ShapeId, instance: Option<InstanceId>) -> Option<usize> {
        self.regions.iter().position(|r| r.shape == shape && r.instance == instance)
    }

    fn update(&mut self) {
        self.media.clear();
        let present = self.ambient.into_iter().chain(self.regions.iter().filter_map(|r| r.interface.inside));
        for medium in present {
            let taken_away =
                self.regions.iter().any(|r| r.interface.outside == Some(medium) && r.interface.inside != Some(medium));
            if !taken_away && !self.media.contains(&medium) {
                self.media.push(medium);
            }
        }
        self.media.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOG: MediumId = MediumId(0);
    const FIRE: MediumId = MediumId(1);

    fn interface(inside: Option<MediumId>, outside: Option<MediumId>) -> Interface {
        Interface { inside, outside }
    }

    #[test]
    fn nested_media_as_pbrt_declares_them_replace_each_other() {
        let mut regions = Regions::new(None);
        regions.enter(ShapeId(0), None, interface(Some(FOG), None));
        assert_eq!(regions.media(), [FOG]);
        regions.enter(ShapeId(1), None, interface(Some(FIRE), Some(FOG)));
        assert_eq!(regions.media(), [FIRE]);
        regions.leave(ShapeId(1), None);
        assert_eq!(regions.media(), [FOG]);
        regions.leave(ShapeId(0), None);
        assert_eq!(regions.media(), []);
    }

    #[test]
    fn overlapping_media_add_up_in_any_order_of_crossing() {
        let mut regions = Regions::new(None);
        regions.enter(ShapeId(1), None, interface(Some(FIRE), None));
        regions.enter(ShapeId(0), None, interface(Some(FOG), None));
        assert_eq!(regions.media(), [FOG, FIRE]);
        regions.leave(ShapeId(1), None);
        assert_eq!(regions.media(), [FOG]);
    }

    #[test]
    fn an_ambient_medium_is_displaced_by_what_names_it_as_outside() {
        let mut regions = Regions::new(Some(FOG));
        regions.enter(ShapeId(3), None, interface(None, Some(FOG)));
        assert_eq!(regions.media(), []);
        regions.leave(ShapeId(3), None);
        assert_eq!(regions.media(), [FOG]);
    }

    #[test]
    fn crossing_twice_is_crossing_once() {
        let mut regions = Regions::new(None);
        for _ in 0..3 {
            regions.enter(ShapeId(0), None, interface(Some(FOG), None));
        }
        regions.leave(ShapeId(0), None);
        assert_eq!(regions.media(), []);
        regions.leave(ShapeId(0), None);
        assert_eq!(regions.media(), []);
    }

    #[test]
    fn one_medium_in_two_overlapping_regions_is_there_once_and_until_both_are_left() {
        let mut regions = Regions::new(None);
        regions.enter(ShapeId(0), None, interface(Some(FOG), None));
        regions.enter(ShapeId(1), None, interface(Some(FOG), None));
        assert_eq!(regions.media(), [FOG]);
        regions.leave(ShapeId(0), None);
        assert_eq!(regions.media(), [FOG]);
    }

    #[test]
    fn more_overlap_than_fits_is_said() {
        let mut regions = Regions::new(None);
        for shape in 0..MAX_OVERLAP as u32 {
            assert!(regions.enter(ShapeId(shape), None, interface(Some(MediumId(shape)), None)));
        }
        assert!(!regions.enter(ShapeId(99), None, interface(Some(FOG), None)));
    }
}
