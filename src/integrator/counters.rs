//! What the integrator did, in integers, so that sums do not depend on the order of threads.

use derive_more::{Add, AddAssign, Sum};
use serde::Serialize;

/// Counts of events. One set a thread, added up at the end of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Add, AddAssign, Sum, serde::Deserialize)]
pub struct Counters {
    /// Camera paths.
    pub paths: u64,
    /// Closest-hit queries.
    pub closest_rays: u64,
    /// Of those, rays from the camera that asked only what shines straight into it.
    pub view_rays: u64,
    /// Occlusion queries.
    pub shadow_rays: u64,
    /// Occlusion queries that were blocked.
    pub shadow_rays_blocked: u64,
    /// Queries for medium boundaries.
    pub boundary_rays: u64,
    /// Tentative collisions while sampling distances.
    pub flight_steps: u64,
    /// Tentative collisions while estimating transmittance.
    pub transmittance_steps: u64,
    /// Points where the emission of media given by grids was gathered.
    pub emission_points: u64,
    /// Path vertices on surfaces.
    pub surface_vertices: u64,
    /// Path vertices in media.
    pub medium_vertices: u64,
    /// Look-ups of cache points.
    pub cache_lookups: u64,
    /// Vertices in media that used the cache point of the vertex before.
    pub cache_reuses: u64,
    /// Narrow beams that camera rays crossed where scattering points were drawn.
    pub beam_crossings: u64,
    /// Paths that were ended after [`super::path::MOST_BOUNCES`].
    pub cut_paths: u64,
    /// Regions that were not entered because too many overlap.
    pub region_overflows: u64,
}

impl Counters {
    /// All of it in one number: about what it takes, in units of some 50 ns. Fitted to the renders of six scenes with media, within 5 % of their
    /// processor time each.
    pub fn work(&self) -> u64 {
        let beams = 6 * self.beam_crossings;
        let rays = 10 * self.closest_rays + 11 * self.shadow_rays + 6 * self.boundary_rays;
        let vertices = 2 * (self.surface_vertices + self.medium_vertices + self.cache_lookups);
        let steps = 4 * self.flight_steps + 6 * self.transmittance_steps + 6 * self.emission_points;
        rays + beams + vertices + steps
    }
}
