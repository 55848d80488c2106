//! What lights take.

use std::sync::Arc;

use super::{
    AreaLight, DistantLight, GoniometricLight, InfiniteLight, LightId, Lights, MovingLight, PointLight, SpotLight,
    VolumeLight,
};

impl Lights {
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
