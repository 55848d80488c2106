//! Lights: where they are, what they send to a point, how a direction to them is drawn; and how one is chosen ([`selector`]).
//!
//! Units and parameters are pbrt-v4's, in RGB. A light is a [`LightId`]; area lights come first, in the order in which their
//! shapes were given, so that shapes can carry their light's number before the lights are built. Each type has its own
//! array: a point light takes 24 bytes. One light is one thing to choose, also a mesh of a million triangles.

mod add;
pub mod area;
mod ask;
pub mod build;
pub mod contribution;
pub mod distant;
pub mod emitters;
pub mod environment;
pub mod goniometric;
mod handles;
pub mod ies;
pub mod infinite;
pub mod linking;
mod memory;
pub mod moving;
pub mod point;
pub mod portal;
pub mod projection;
mod receiver;
pub mod sample;
pub mod selector;
pub mod sphere_image;
pub mod spot;
#[cfg(test)]
mod tests;
pub mod tree;
pub mod volume;

use std::sync::Arc;

use prefetch_index::prefetch_index;

use self::handles::{Handles, Kind};
use self::moving::Punctual;
use crate::geometry::trace::Opacity;
use crate::medium::MediumId;
use crate::scene::Span;

pub use area::AreaLight;
pub use distant::DistantLight;
pub use environment::Environment;
pub use goniometric::{GoniometricLight, IntensityDistribution};
pub use infinite::InfiniteLight;
pub use linking::{LinkSet, Linking};
pub use moving::MovingLight;
pub use point::PointLight;
pub use portal::Portal;
pub use receiver::{EmitterHit, Receiver};
pub use sample::{LightEnd, LightSample};
pub use selector::{LightSelector, SelectorKind, SelectorScratch};
pub use spot::SpotLight;
pub use volume::VolumeLight;

/// A light, by its place in [`Lights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct LightId(pub u32);

/// All lights of a scene.
#[derive(Default)]
pub struct Lights {
    /// Where the first few directives stand whose lights are dark.
    dark_places: Vec<Span>,
    area: Vec<AreaLight>,
    /// The lights after the area lights.
    others: Handles,
    points: Vec<PointLight>,
    spots: Vec<SpotLight>,
    goniometrics: Vec<GoniometricLight>,
    distants: Vec<DistantLight>,
    infinites: Vec<InfiniteLight>,
    volumes: Vec<VolumeLight>,
    moving: Vec<MovingLight>,
    /// By medium, as far as one has a light.
    of_media: Vec<Option<LightId>>,
    infinite: Vec<LightId>,
    scene_radius: f32,
    opacity: Option<Arc<dyn Opacity>>,
    linking: Option<Box<Linking>>,
}

impl std::fmt::Debug for Lights {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lights")
            .field("area", &self.area.len())
            .field("others", &self.others.len())
            .finish_non_exhaustive()
    }
}

/// One light, whatever its type.
#[derive(Clone, Copy, Debug)]
pub enum LightRef<'a> {
    /// A shape that emits.
    Area(&'a AreaLight),
    /// A point.
    Point(&'a PointLight),
    /// A point with a cone.
    Spot(&'a SpotLight),
    /// A point with an intensity for each direction.
    Goniometric(&'a GoniometricLight),
    /// Parallel light.
    Distant(&'a DistantLight),
    /// A background.
    Infinite(&'a InfiniteLight),
    /// A medium that emits.
    Volume(&'a VolumeLight),
    /// A point, perhaps with a cone or the like, that moves.
    Moving(&'a MovingLight),
}

impl Lights {
    /// How many there are, dark ones included.
    pub fn len(&self) -> usize {
        self.area.len() + self.others.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All of them, in order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = LightId> + Clone + use<> {
        (0..self.len() as u32).map(LightId)
    }

    /// The light `id`.
    #[inline]
    pub fn get(&self, id: LightId) -> LightRef<'_> {
        let id = id.0 as usize;
        if let Some(light) = self.area.get(id) {
            return LightRef::Area(light);
        }
        let (kind, index) = self.others.get(id - self.area.len());
        match kind {
            Kind::Point => LightRef::Point(&self.points[index]),
            Kind::Spot => LightRef::Spot(&self.spots[index]),
            Kind::Goniometric => LightRef::Goniometric(&self.goniometrics[index]),
            Kind::Distant => LightRef::Distant(&self.distants[index]),
            Kind::Infinite => LightRef::Infinite(&self.infinites[index]),
            Kind::Volume => LightRef::Volume(&self.volumes[index]),
            Kind::Moving => LightRef::Moving(&self.moving[index]),
        }
    }

    /// Has fetched what [`Lights::contribution`] reads of the light `id`, at stage 0 what it reads first.
    #[inline]
    fn fetch(&self, id: LightId, stage: u32) {
        let id = id.0 as usize;
        let Some(other) = id.checked_sub(self.area.len()) else {
            return prefetch_index(&self.area, id);
        };
        if stage == 0 {
            return self.others.fetch(other);
        }
        match self.others.get(other) {
            (Kind::Point, index) => prefetch_index(&self.points, index),
            (Kind::Spot, index) => prefetch_index(&self.spots, index),
            (Kind::Goniometric, index) => prefetch_index(&self.goniometrics, index),
            (Kind::Moving, index) => prefetch_index(&self.moving, index),
            _ => {}
        }
    }

    /// Those that are points, with a cone or the like or without, in the order of their ids.
    fn punctual(&self) -> impl Iterator<Item = Punctual> + '_ {
        self.ids().filter_map(|id| match self.get(id) {
            LightRef::Point(light) => Some(Punctual::Point(*light)),
            LightRef::Spot(light) => Some(Punctual::Spot(*light)),
            LightRef::Goniometric(light) => Some(Punctual::Goniometric(light.clone())),
            _ => None,
        })
    }

    /// How many move.
    pub fn moving_count(&self) -> usize {
        self.moving.len()
    }

    /// How many media are lights.
    pub fn volume_count(&self) -> usize {
        self.volumes.len()
    }

    /// The light that a medium is.
    #[inline]
    pub fn of_medium(&self, medium: MediumId) -> Option<LightId> {
        self.of_media.get(medium.0 as usize).copied().flatten()
    }

    /// Which lights light which objects, where not all light all.
    pub fn linking(&self) -> Option<&Linking> {
        self.linking.as_deref()
    }

    /// Whether the light `id` lights the objects of `set`.
    #[inline]
    pub fn is_linked(&self, set: LinkSet, id: LightId) -> bool {
        self.linking.as_ref().is_none_or(|linking| linking.is_linked(set, id))
    }

    /// Where the first few directives of a scene stand of whose lights one or more [are dark](Lights::is_dark), in the order of the lights.
    pub fn dark_places(&self) -> &[Span] {
        &self.dark_places
    }
}
