//! A medium whose coefficients vary as grids say:
//! μ_a = scale · density · σ_a · a, μ_s = scale · density · σ_s · s, where density, a and s are grids or 1.

use std::sync::Arc;

use glam::{DAffine3, DVec3, IVec3, Vec3};

use super::bounds::{Lattice, source, voxel_edge};
use super::dda::{GridMajorants, reach_of};
use super::emission::{Emission, EmissionShape};
use super::energy::EnergyGrid;
use super::field::{AnyGrid, Field, ScalarGrid};
use super::gathering::Gathering;
use super::majorants::Majorants;
use super::map::{IndexMap, box_of_corners};
use super::motion::Motion;
use super::survey::Survey;
use crate::math::Rgb;
use crate::medium::{MajorantIter, MediumPoint, resolution};

/// What a grid medium is made of.
#[derive(Debug)]
pub struct GridMediumParts {
    /// Density; 1 everywhere if absent.
    pub density: Option<Field<ScalarGrid>>,
    /// Absorption by place: σ_a is multiplied by it.
    pub absorption_colour: Option<Field<AnyGrid>>,
    /// Scattering by place: σ_s is multiplied by it.
    pub scattering_colour: Option<Field<AnyGrid>>,
    /// Where there is no density grid: a grid of the largest channel of μ_t (on the colours' lattice) to take bounds from.
    pub bound: Option<Field<ScalarGrid>>,
    /// σ_a, per unit length of render space.
    pub sigma_a: Rgb,
    /// σ_s, per unit length of render space.
    pub sigma_s: Rgb,
    /// Factor on both.
    pub scale: f32,
    /// Emission.
    pub emission: Option<Emission>,
    /// Mean cosine of the Henyey-Greenstein phase function.
    pub g: f32,
    /// How all of it moves, if it does.
    pub motion: Option<Motion>,
    /// A box, in the index space of the density (or else bound) grid, outside which the medium is nothing.
    pub clip: Option<(DVec3, DVec3)>,
}

/// Where there is something everywhere, the least channel of μ_t outside all grids may be this share of its bound for rays without end to be ended by
/// it: a ray takes some ten times the inverse in steps.
const LEAST_BACKGROUND: f32 = 1e-3;

/// The time at which moving media are surveyed for what they emit.
const HALF_WAY: f32 = 0.5;

/// A medium whose coefficients vary as grids say.
#[derive(Debug)]
pub struct GridMedium {
    parts: GridMediumParts,
    /// Bounds of μ_t.
    majorants: Majorants,
    /// How densely emission is gathered, in the same cells, if there is any: above 0 wherever it is.
    gathering: Option<Majorants>,
    /// Render space to the majorants' index space.
    cells_from_render: DAffine3,
    /// The clip box in whole voxels, outwards.
    clip_voxels: Option<(IVec3, IVec3)>,
    /// The bound of μ_t outside everything; and for rays without end, which would never be done with a medium that lets a channel through.
    outside: [f32; 2],
    /// The gathering rate there, likewise.
    gathering_outside: [f32; 2],
    /// Where it emits.
    energy: Option<Arc<EnergyGrid>>,
    bounds: Option<(Vec3, Vec3)>,
    /// It scatters, and is so dense somewhere that [`resolution`] limits it.
    is_limited: bool,
    /// All grids lie on the lattice of the density (or else of the bound).
    shared: bool,
    /// μ_t where density is 1, if no colour grid changes it from place to place.
    plain_extinction: Option<Rgb>,
}

impl GridMedium {
    /// Builds the bounds of μ_t for `parts`, and of what they emit. One of `density` and `bound` must be there.
    ///
    /// # Panics
    /// If neither density nor bound is given.
    pub fn new(parts: GridMediumParts) -> Self {
        let lattice = Lattice::of(&parts);
        let still = lattice.extinction(&parts);
        let majorants = match &parts.motion {
            Some(motion) => motion.moved(&lattice, &still),
            None => still,
        };
        let clip_voxels = parts.clip.map(|(low, high)| {
            (low.floor().as_ivec3().saturating_sub(IVec3::ONE), high.ceil().as_ivec3().saturating_add(IVec3::ONE))
        });
        let map = source(&parts).map;
        let same = |field: &Option<Field<AnyGrid>>| field.as_ref().is_none_or(|f| f.map == map);
        let glows_there = parts.emission.as_ref().is_none_or(|emission| emission.lies_on(&map));
        let is_plain =
            parts.density.is_some() && parts.absorption_colour.is_none() && parts.scattering_colour.is_none();
        let mut medium = Self {
            gathering: None,
            cells_from_render: lattice.cells_from_render,
            clip_voxels,
            outside: [0.0; 2],
            gathering_outside: [0.0; 2],
            energy: None,
            bounds: None,
            is_limited: false,
            shared: same(&parts.absorption_colour) && same(&parts.scattering_colour) && glows_there,
            plain_extinction: is_plain.then(|| (parts.sigma_a + parts.sigma_s) * parts.scale),
            majorants,
            parts,
        };
        if medium.is_emissive() {
            medium.find_emission(&lattice);
        }
        if medium.parts.clip.is_none() {
            let bound = medium.majorants.background();
            let ends = medium.background().min_channel() >= LEAST_BACKGROUND * bound;
            medium.outside = [bound, if ends { bound } else { 0.0 }];
            let gathering = medium.gathering.as_ref().map_or(0.0, Majorants::background);
            medium.gathering_outside = [gathering, if gathering > 0.0 { medium.outside[1] } else { 0.0 }];
        }
        let voxels = match (medium.majorants.bounds(), medium.gathering.as_ref().and_then(Majorants::bounds)) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (bounds, None) | (None, bounds) => bounds,
        };
        if medium.outside[0] <= 0.0 && medium.gathering_outside[0] <= 0.0 {
            medium.bounds = Some(render_bounds(voxels, &lattice.cells_from_render, clip_voxels));
        }
        let farthest = medium.bounds.map_or(f32::INFINITY, |(low, high)| low.abs().max(high.abs()).length());
        medium.is_limited = medium.scatters() && medium.largest_extinction() > resolution::largest(farthest);
        medium
    }

    /// Works out how densely emission is gathered, and notes where it is.
    fn find_emission(&mut self, lattice: &Lattice) {
        let Some(emission) = &self.parts.emission else { return };
        let mut bounds = lattice.emission(emission, &self.majorants);
        if let Some(motion) = &self.parts.motion {
            bounds = motion.moved(lattice, &bounds);
        }
        let survey = Survey::new(&bounds, &lattice.cells_from_render, self.clip_voxels, |p| self.point(p, HALF_WAY));
        let typical = survey.as_ref().map_or(0.0, Survey::typical);
        let gathering = Gathering::new(typical, bounds.largest(), voxel_edge(&lattice.cells_from_render));
        self.energy = survey.as_ref().and_then(EnergyGrid::new).map(Arc::new);
        self.gathering = Some(bounds.combined(&self.majorants, |e, extinction| gathering.rate(e, extinction)));
    }

    /// Whether it scatters light anywhere.
    pub fn scatters(&self) -> bool {
        !self.parts.sigma_s.is_black() && self.largest_extinction() > 0.0
    }

    fn source_map(&self) -> &IndexMap {
        &source(&self.parts).map
    }

    /// Where the grids have what is at `p` at that time.
    #[inline]
    fn written(&self, p: Vec3, time: f32) -> Vec3 {
        self.parts.motion.as_ref().map_or(p, |motion| motion.back(p, time))
    }

    /// The coefficients at `p` of render space, at a time between 0 and 1, as [`resolution`] limits them.
    #[inline]
    pub fn point(&self, p: Vec3, time: f32) -> MediumPoint {
        let point = self.point_written(self.written(p, time));
        if self.is_limited { point.limited(p) } else { point }
    }

    /// The coefficients where the grids have them.
    #[inline]
    fn point_written(&self, p: Vec3) -> MediumPoint {
        let Some(index) = self.index_inside(p) else { return MediumPoint::default() };
        let [absorption, scattering] = self.coefficients(p, index);
        let mut point = MediumPoint { absorption, scattering, emission: Rgb::BLACK };
        if let Some(emission) = &self.parts.emission {
            let index_of = |map: &IndexMap| self.index_under(map, p, index);
            if emission.direct {
                point.emission = emission.at(index_of);
            } else if !absorption.is_black() {
                point.emission = absorption * emission.at(index_of);
            }
        }
        point
    }

    /// As [`GridMedium::point`], without the emission.
    #[inline]
    pub fn dark_point(&self, p: Vec3, time: f32) -> MediumPoint {
        let p = self.written(p, time);
        let Some(index) = self.index_inside(p) else { return MediumPoint::default() };
        let [absorption, scattering] = self.coefficients(p, index);
        MediumPoint { absorption, scattering, emission: Rgb::BLACK }
    }

    /// μ_t at `p` of render space: [`GridMedium::point`] without the emission.
    #[inline]
    pub fn extinction(&self, p: Vec3, time: f32) -> Rgb {
        let p = self.written(p, time);
        self.index_inside(p).map_or(Rgb::BLACK, |index| {
            if let Some(extinction) = self.plain_extinction {
                return extinction * self.density_at(index);
            }
            let [absorption, scattering] = self.coefficients(p, index);
            absorption + scattering
        })
    }

    /// The index position of `p` (`Some(None)` behind a frustum's apex); `None` outside the clip box.
    #[inline]
    fn index_inside(&self, p: Vec3) -> Option<Option<DVec3>> {
        let index = self.source_map().to_index(p);
        let inside =
            self.parts.clip.is_none_or(|(low, high)| index.is_some_and(|i| i.cmpge(low).all() && i.cmple(high).all()));
        inside.then_some(index)
    }

    /// The index position of `p` under a grid's map, `index` being that under the density's.
    #[inline]
    fn index_under(&self, map: &IndexMap, p: Vec3, index: Option<DVec3>) -> Option<DVec3> {
        if self.shared { index } else { map.to_index(p) }
    }

    /// The density at an index position, adjusted; the background's behind a frustum's apex; 1 without a grid.
    #[inline]
    fn density_at(&self, index: Option<DVec3>) -> f32 {
        match &self.parts.density {
            Some(field) => index.map_or_else(|| field.adjust(field.grid.background()), |index| field.at(index)),
            None => 1.0,
        }
    }

    /// μ_a and μ_s.
    #[inline]
    fn coefficients(&self, p: Vec3, index: Option<DVec3>) -> [Rgb; 2] {
        let parts = &self.parts;
        let density = self.density_at(index);
        if !(density > 0.0) {
            return [Rgb::BLACK; 2];
        }
        let scaled = parts.scale * density;
        let tinted = |sigma: Rgb, colour: &Option<Field<AnyGrid>>| match colour {
            Some(field) => sigma * scaled * Rgb(field.at_index(self.index_under(&field.map, p, index))),
            None => sigma * scaled,
        };
        [tinted(parts.sigma_a, &parts.absorption_colour), tinted(parts.sigma_s, &parts.scattering_colour)]
    }

    /// The density alone at `p` of render space, as the grid (adjusted) has it.
    #[inline]
    pub fn density(&self, p: Vec3) -> f32 {
        let Some(field) = &self.parts.density else { return 1.0 };
        field.map.to_index(p).map_or(0.0, |index| field.at(index))
    }

    /// Mean cosine of the phase function.
    pub fn g(&self) -> f32 {
        self.parts.g
    }

    /// Whether it glows.
    pub fn is_emissive(&self) -> bool {
        self.parts.emission.as_ref().is_some_and(|e| !e.radiance.is_black())
    }

    /// Bounds of μ_t along a ray: see [`crate::medium::Medium::majorants`].
    #[inline]
    pub fn majorants(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> MajorantIter<'_> {
        let outside = self.outside[usize::from(t_max == f32::INFINITY)];
        let mut walk = self.along(&self.majorants, outside, origin, direction, [t_min, t_max]);
        if self.is_limited {
            walk.limit_on([origin, direction]);
        }
        MajorantIter::Grid(walk)
    }

    /// How densely emission is gathered along a ray: see [`crate::medium::Medium::gathering_rates`].
    #[inline]
    pub fn gathering_rates(&self, origin: Vec3, direction: Vec3, t_min: f32, t_max: f32) -> Option<MajorantIter<'_>> {
        let outside = self.gathering_outside[usize::from(t_max == f32::INFINITY)];
        Some(MajorantIter::Grid(self.along(self.gathering.as_ref()?, outside, origin, direction, [t_min, t_max])))
    }

    #[inline]
    fn along<'m>(
        &self,
        cells: &'m Majorants,
        outside: f32,
        origin: Vec3,
        direction: Vec3,
        stretch: [f32; 2],
    ) -> GridMajorants<'m> {
        let ray = [
            self.cells_from_render.transform_point3(origin.as_dvec3()),
            self.cells_from_render.transform_vector3(direction.as_dvec3()),
        ];
        let reach = reach_of(origin);
        GridMajorants::new(cells, ray, self.clip_voxels, outside, reach, stretch)
    }

    /// Where it emits, if it does anywhere that is stored.
    pub fn energy(&self) -> Option<&Arc<EnergyGrid>> {
        self.energy.as_ref()
    }

    /// A box of render space outside which there is nothing; `None` if there is something everywhere.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// Whether it is so dense somewhere that [`resolution`] limits it.
    #[cfg(test)]
    pub fn is_limited(&self) -> bool {
        self.is_limited
    }

    /// Whether it is (or emits) something everywhere, and yet too little in some channel to end a ray that goes on for ever: what such a ray would
    /// gather has no bound, or takes for ever to find. Rays without end then meet nothing outside the grids.
    pub fn never_ends(&self) -> bool {
        self.bounds.is_none() && self.outside[1] <= 0.0
    }

    /// μ_t outside all grids.
    fn background(&self) -> Rgb {
        let parts = &self.parts;
        let density = parts.density.as_ref().map_or(1.0, |field| field.adjust(field.grid.background()));
        let tinted = |sigma: Rgb, colour: &Option<Field<AnyGrid>>| {
            colour.as_ref().map_or(sigma, |field| sigma * Rgb(field.at_index(None)))
        };
        (tinted(parts.sigma_a, &parts.absorption_colour) + tinted(parts.sigma_s, &parts.scattering_colour))
            * (parts.scale * density)
    }

    /// An upper bound of μ_t anywhere, per unit length of render space.
    pub fn largest_extinction(&self) -> f32 {
        self.majorants.largest()
    }

    /// Edge of a voxel in render space (the shortest).
    pub fn voxel_edge(&self) -> f32 {
        voxel_edge(self.source_map().local_from_render())
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        let parts = &self.parts;
        let any = |field: &Option<Field<AnyGrid>>| field.as_ref().map_or(0, |f| f.grid.memory());
        parts.density.as_ref().map_or(0, |f| f.grid.memory())
            + any(&parts.absorption_colour)
            + any(&parts.scattering_colour)
            + parts.emission.as_ref().map_or(0, Emission::memory)
            + parts.motion.as_ref().map_or(0, |motion| motion.field.memory())
            + self.majorants.memory()
            + self.gathering.as_ref().map_or(0, Majorants::memory)
            + self.energy.as_ref().map_or(0, |energy| energy.memory())
    }

    /// One line for people.
    pub fn summary(&self) -> String {
        let parts = &self.parts;
        let mut words = Vec::new();
        if let Some(field) = &parts.density {
            let precision = if matches!(field.grid, ScalarGrid::Half(_)) { "half" } else { "single" };
            let size = field.grid.bounds().map_or("empty".to_owned(), |(low, high)| {
                let size = high.as_i64vec3() - low.as_i64vec3() + 1;
                format!("{}×{}×{}", size.x, size.y, size.z)
            });
            words.push(format!("density grid {size} ({precision} precision, voxel {:.4})", self.voxel_edge()));
        }
        if parts.absorption_colour.is_some() || parts.scattering_colour.is_some() {
            words.push("colour grids".to_owned());
        }
        match parts.emission.as_ref().map(|e| &e.shape) {
            Some(EmissionShape::Constant) => words.push("emission".to_owned()),
            Some(EmissionShape::Grid(_)) => words.push("emission grid".to_owned()),
            Some(EmissionShape::Temperature { .. }) => words.push("temperature grid".to_owned()),
            None => {}
        }
        if parts.motion.is_some() {
            words.push("velocity grid".to_owned());
        }
        words.push(format!("largest extinction {:.4}", self.largest_extinction()));
        words.join(", ")
    }
}

/// A box of render space around these voxels; empty without any.
fn render_bounds(
    voxels: Option<(IVec3, IVec3)>,
    cells_from_render: &DAffine3,
    clip: Option<(IVec3, IVec3)>,
) -> (Vec3, Vec3) {
    let Some((low, high)) = voxels else { return (Vec3::ZERO, Vec3::ZERO) };
    let (low, high) = clip.map_or((low, high), |(a, b)| (low.max(a), high.min(b)));
    if low.cmpgt(high).any() {
        return (Vec3::ZERO, Vec3::ZERO);
    }
    let render_from_cells = cells_from_render.inverse();
    let corners = |p: DVec3| render_from_cells.transform_point3(p);
    let (a, b) = box_of_corners(low.as_dvec3(), high.as_dvec3() + 1.0, corners);
    let outwards = (b - a).max_element() * 1e-6;
    ((a - outwards).as_vec3(), (b + outwards).as_vec3())
}
