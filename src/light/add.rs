//! Adding lights, and what concerns all of them, while a scene is built.

use std::sync::Arc;

use glam::Vec3;

use super::handles::Kind;
use super::{
    DistantLight, GoniometricLight, InfiniteLight, LightId, Lights, Linking, MovingLight, PointLight, SpotLight,
    VolumeLight,
};
use crate::geometry::trace::Opacity;
use crate::scene::Span;

/// No more places of dark lights are remembered.
const DARK_PLACES: usize = 8;

impl Lights {
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

    /// Links lights to objects.
    pub fn set_linking(&mut self, linking: Option<Linking>) {
        self.linking = linking.map(Box::new);
    }

    /// Remembers the place of a dark light, unless enough are known.
    pub(super) fn note_dark(&mut self, place: Span) {
        if self.dark_places.len() < DARK_PLACES && !self.dark_places.contains(&place) {
            self.dark_places.push(place);
        }
    }
}
