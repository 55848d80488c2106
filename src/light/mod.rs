//! Lights: where they are, what they send to a point, how a direction to them is drawn; and how one is chosen ([`selector`]).
//!
//! Units and parameters are pbrt-v4's, in RGB. A light is a [`LightId`]; area lights come first, in the order in which their
//! shapes were given, so that shapes can carry their light's number before the lights are built. Each type has its own
//! array: a point light takes 24 bytes. One light is one thing to choose, also a mesh of a million triangles.

pub mod area;
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
pub mod moving;
pub mod point;
pub mod portal;
pub mod projection;
pub mod sample;
pub mod selector;
pub mod sphere_image;
pub mod spot;
#[cfg(test)]
mod tests;
pub mod tree;
pub mod volume;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use prefetch_index::prefetch_index;

use self::handles::{Handles, Kind};
use self::moving::Punctual;
use crate::geometry::trace::Opacity;
use crate::geometry::{Geometry, InstanceId, ShapeId};
use crate::math::Rgb;
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
pub use sample::{LightEnd, LightSample};
pub use selector::{LightSelector, SelectorKind, SelectorScratch};
pub use spot::SpotLight;
pub use volume::VolumeLight;

/// A light, by its place in [`Lights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct LightId(pub u32);

/// A point on an emitter that a ray has met.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// The emitting shape.
    pub shape: ShapeId,
    /// Its primitive.
    pub primitive: u32,
    /// The primitive's own parameters there: [`crate::geometry::RayHit::uv`].
    pub parameters: [f32; 2],
    /// Its instance.
    pub instance: Option<InstanceId>,
    /// Where, in render space.
    pub p: Vec3,
    /// Oriented geometric normal there.
    pub ng: Vec3,
    /// Texture coordinates there.
    pub uv: Vec2,
    /// The ray's time, 0..=1.
    pub time: f32,
}

/// Where light is received.
#[derive(Clone, Copy, Debug)]
pub enum Receiver {
    /// A surface: position, unit shading normal (towards the viewer's side), whether it also transmits.
    Surface {
        /// Position.
        p: Vec3,
        /// Shading normal, on the side that light is gathered from.
        ns: Vec3,
        /// Light from behind counts too.
        two_sided: bool,
        /// The lights that light it.
        links: LinkSet,
    },
    /// A point in a medium.
    Medium {
        /// Position.
        p: Vec3,
        /// The lights that light it.
        links: LinkSet,
    },
}

impl Receiver {
    /// A point in a medium that every ordinary light lights.
    pub fn medium(p: Vec3) -> Self {
        Self::Medium { p, links: LinkSet::ORDINARY }
    }

    /// A point on a surface that every ordinary light lights.
    pub fn surface(p: Vec3, ns: Vec3, two_sided: bool) -> Self {
        Self::Surface { p, ns, two_sided, links: LinkSet::ORDINARY }
    }

    /// Its position, render space.
    pub fn p(&self) -> Vec3 {
        match *self {
            Self::Surface { p, .. } | Self::Medium { p, .. } => p,
        }
    }

    /// The lights that light it.
    pub fn links(&self) -> LinkSet {
        match *self {
            Self::Surface { links, .. } | Self::Medium { links, .. } => links,
        }
    }
}

/// No more places of dark lights are remembered.
const DARK_PLACES: usize = 8;

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

    /// Adds a point light.
    pub fn add_point(&mut self, light: PointLight) -> LightId {
        self.points.push(light);
        self.add_other(Kind::Point)
    }

    /// Makes room for `count` more point lights.
    pub fn reserve_points(&mut self, count: usize) {
        self.points.reserve(count);
    }

    /// Adds a spot light.
    pub fn add_spot(&mut self, light: SpotLight) -> LightId {
        self.spots.push(light);
        self.add_other(Kind::Spot)
    }

    /// Adds a light whose intensity depends on the direction.
    pub fn add_goniometric(&mut self, light: GoniometricLight) -> LightId {
        self.goniometrics.push(light);
        self.add_other(Kind::Goniometric)
    }

    /// Adds a distant light.
    pub fn add_distant(&mut self, light: DistantLight) -> LightId {
        self.distants.push(light);
        self.add_other(Kind::Distant)
    }

    /// Adds a background.
    pub fn add_infinite(&mut self, light: InfiniteLight) -> LightId {
        self.infinites.push(light);
        let id = self.add_other(Kind::Infinite);
        self.infinite.push(id);
        id
    }

    /// Adds a medium that emits.
    pub fn add_volume(&mut self, light: VolumeLight) -> LightId {
        let medium = light.medium.0 as usize;
        self.volumes.push(light);
        let id = self.add_other(Kind::Volume);
        if self.of_media.len() <= medium {
            self.of_media.resize(medium + 1, None);
        }
        self.of_media[medium] = Some(id);
        id
    }

    /// Adds a light that moves.
    pub fn add_moving(&mut self, light: MovingLight) -> LightId {
        self.moving.push(light);
        self.add_other(Kind::Moving)
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

    fn add_other(&mut self, kind: Kind) -> LightId {
        self.others.push(kind);
        LightId(self.len() as u32 - 1)
    }

    /// The box around all geometry, render space: gives infinite and distant lights their power.
    pub fn set_scene_bounds(&mut self, min: Vec3, max: Vec3) {
        let half = (max - min) * 0.5;
        if half.is_finite() && half.min_element() >= 0.0 {
            self.scene_radius = half.length();
        }
    }

    /// Who decides whether a point of a shape with an `alpha` is there, so that masked emitters shine only where they are.
    pub fn set_opacity(&mut self, opacity: Arc<dyn Opacity>) {
        self.opacity = Some(opacity);
    }

    /// Declares that no ray can meet the area light `id`: its shape has a constant `alpha` of 0. As in pbrt-v4 it still lights
    /// the scene, by sampling alone.
    pub fn set_invisible(&mut self, id: LightId) {
        if let Some(light) = self.area.get_mut(id.0 as usize) {
            light.invisible = true;
        }
    }

    /// Which lights light which objects, where not all light all.
    pub fn linking(&self) -> Option<&Linking> {
        self.linking.as_deref()
    }

    /// Links lights to objects.
    pub fn set_linking(&mut self, linking: Option<Linking>) {
        self.linking = linking.map(Box::new);
    }

    /// Whether the light `id` lights the objects of `set`.
    #[inline]
    pub fn is_linked(&self, set: LinkSet, id: LightId) -> bool {
        self.linking.as_ref().is_none_or(|linking| linking.is_linked(set, id))
    }

    /// A direction from `p` to the light `id` at `time`, drawn with `u` and, for a choice among the light's parts, `u_part`, all in
    /// [0, 1). `None` where nothing arrives. `u_part` is f64 because a mesh may have millions of parts.
    #[inline]
    pub fn sample(
        &self,
        geometry: &Geometry,
        id: LightId,
        p: Vec3,
        time: f32,
        u: [f32; 2],
        u_part: f64,
    ) -> Option<LightSample> {
        match self.get(id) {
            LightRef::Area(light) => light.sample(geometry, self.opacity.as_deref(), p, time, u, u_part),
            LightRef::Point(light) => light.sample(p),
            LightRef::Spot(light) => light.sample(p),
            LightRef::Goniometric(light) => light.sample(p),
            LightRef::Distant(light) => light.sample(),
            LightRef::Infinite(light) => light.sample(p, u, u_part),
            LightRef::Volume(light) => light.sample(p, u, u_part),
            LightRef::Moving(light) => light.sample(p, time),
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` (the very same point) draws the unit direction `wi` of a ray that
    /// has met the area light `id` at `hit`. 0 for lights that no ray meets.
    #[inline]
    pub fn pdf(&self, geometry: &Geometry, id: LightId, p: Vec3, hit: &EmitterHit, wi: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Area(light) => light.pdf(geometry, p, hit, wi),
            _ => 0.0,
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` draws `direction` for the light `id` that is a medium.
    #[inline]
    pub fn volume_pdf(&self, id: LightId, p: Vec3, direction: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Volume(light) => light.pdf(p, direction),
            _ => 0.0,
        }
    }

    /// The bounds of all area lights, for selectors that ask every light.
    pub fn emitter_table(&self) -> emitters::EmitterTable {
        emitters::EmitterTable::new(&self.area)
    }

    /// The radiance that the area light `id` emits at a point of oriented normal `ng` and texture coordinates `uv` towards the viewer, in unit
    /// direction `wo`.
    #[inline]
    pub fn emitted(&self, id: LightId, ng: Vec3, wo: Vec3, uv: Vec2) -> Rgb {
        match self.get(id) {
            LightRef::Area(light) => light.emitted(ng, wo, uv),
            _ => Rgb::BLACK,
        }
    }

    /// The lights that a ray which leaves the scene sees.
    pub fn infinite(&self) -> &[LightId] {
        &self.infinite
    }

    /// What the infinite light `id` sends to `p` from the unit direction `direction`.
    #[inline]
    pub fn background(&self, id: LightId, p: Vec3, direction: Vec3) -> Rgb {
        match self.get(id) {
            LightRef::Infinite(light) => light.radiance(p, direction),
            _ => Rgb::BLACK,
        }
    }

    /// The solid-angle pdf with which [`Lights::sample`] from `p` draws `direction` for the infinite light `id`.
    #[inline]
    pub fn background_pdf(&self, id: LightId, p: Vec3, direction: Vec3) -> f32 {
        match self.get(id) {
            LightRef::Infinite(light) => light.pdf(p, direction),
            _ => 0.0,
        }
    }

    /// Emitted power Φ in watts. Light from infinity counts as far as it enters the sphere around the scene.
    pub fn power(&self, id: LightId) -> Rgb {
        use std::f32::consts::PI;
        let disk = PI * self.scene_radius * self.scene_radius;
        match self.get(id) {
            LightRef::Area(light) => light.power(),
            LightRef::Point(light) => light.power(),
            LightRef::Spot(light) => light.power(),
            LightRef::Goniometric(light) => light.power(),
            LightRef::Distant(light) => light.irradiance * disk,
            LightRef::Infinite(light) => light.power(disk),
            LightRef::Volume(light) => light.power(),
            LightRef::Moving(light) => light.still().power(),
        }
    }

    /// Whether the light emits nothing at all.
    #[inline]
    pub fn is_dark(&self, id: LightId) -> bool {
        match self.get(id) {
            LightRef::Area(light) => light.mean.is_black() || light.sampler.is_none(),
            LightRef::Point(light) => light.intensity.is_black(),
            LightRef::Spot(light) => light.intensity.is_black(),
            LightRef::Goniometric(light) => light.power().is_black(),
            LightRef::Distant(light) => light.irradiance.is_black(),
            LightRef::Infinite(light) => light.is_dark(),
            LightRef::Volume(light) => light.is_dark(),
            LightRef::Moving(light) => light.still().power().is_black(),
        }
    }

    /// Where the first few directives of a scene stand of whose lights one or more [are dark](Lights::is_dark), in the order of the lights.
    pub fn dark_places(&self) -> &[Span] {
        &self.dark_places
    }

    /// Remembers the place of a dark light, unless enough are known.
    fn note_dark(&mut self, place: Span) {
        if self.dark_places.len() < DARK_PLACES && !self.dark_places.contains(&place) {
            self.dark_places.push(place);
        }
    }

    /// Bytes held on the heap, but for [`Lights::linking`].
    pub fn memory(&self) -> usize {
        let area: usize = self.area.iter().map(AreaLight::memory).sum();
        let infinite: usize = self.infinites.iter().map(InfiniteLight::memory).sum();
        area + infinite
            + self.shared_memory()
            + self.area.capacity() * size_of::<AreaLight>()
            + self.others.memory()
            + self.points.capacity() * size_of::<PointLight>()
            + self.spots.capacity() * size_of::<SpotLight>()
            + self.goniometrics.capacity() * size_of::<GoniometricLight>()
            + self.distants.capacity() * size_of::<DistantLight>()
            + self.infinites.capacity() * size_of::<InfiniteLight>()
            + self.infinite.capacity() * size_of::<LightId>()
            + self.volumes.capacity() * size_of::<VolumeLight>()
            + self.moving.capacity() * size_of::<MovingLight>()
            + self.of_media.capacity() * size_of::<Option<LightId>>()
    }

    /// Bytes that lights share: distributions of intensity and patterns of emission, each once.
    fn shared_memory(&self) -> usize {
        let mut seen = std::collections::HashSet::new();
        let of_moving = self.moving.iter().filter_map(|light| light.still().shared());
        let distributions = self.goniometrics.iter().map(|light| &light.distribution).chain(of_moving);
        let distributions: usize =
            distributions.filter(|d| seen.insert(Arc::as_ptr(d) as usize)).map(|d| d.memory()).sum();
        let patterns = self.area.iter().filter_map(|light| light.pattern.as_ref());
        let patterns: usize = patterns.filter(|p| seen.insert(Arc::as_ptr(p) as usize)).map(|p| p.memory()).sum();
        distributions + patterns
    }
}
