//! Walking a ray through the cells of [`Majorants`]: stretches of constant bound, empty space in big steps.
//! Source: Amanatides & Woo 1987 for the idea; here in double precision, over cells of varying size, and with the walk
//! tied to integers: at every step one coordinate moves on strictly and none moves back, so it ends whatever rounding does.

use glam::{DVec3, IVec3, Vec3};

use super::majorants::Majorants;
use crate::medium::{MajorantSegment, resolution};

/// A ray's points in single precision may be this far from their places, relative to |origin| + t; boundaries are
/// shifted by as much towards the side with the smaller bound.
const POINT_ERROR: f64 = 3.0e-7;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Before,
    Inside,
    After,
}

/// The majorants along a ray through a grid. See [`crate::medium::MajorantIter`].
#[derive(Debug)]
pub struct GridMajorants<'a> {
    cells: &'a Majorants,
    origin: DVec3,
    direction: DVec3,
    inverse: DVec3,
    /// The walk's region: voxels, inclusive.
    low: IVec3,
    high: IVec3,
    outside: f32,
    voxel: IVec3,
    stage: Stage,
    t: f64,
    t_leave: f64,
    /// The stretch in hand: where it ends, and its bound.
    piece: (f64, f32),
    last: f32,
    t_max: f32,
    done: bool,
    reach: f64,
    /// The ray in render space, where bounds are limited ([`resolution`]).
    limited: Option<[Vec3; 2]>,
}

impl<'a> GridMajorants<'a> {
    /// The stretches of `t_min..=t_max` along `origin + t·direction` in index space. `clip` bounds the walk further;
    /// `outside` is the bound outside. `distance` is the length of the render-space origin.
    pub fn new(
        cells: &'a Majorants,
        [origin, direction]: [DVec3; 2],
        clip: Option<(IVec3, IVec3)>,
        outside: f32,
        distance: f64,
        [t_min, t_max]: [f32; 2],
    ) -> Self {
        let mut walk = Self {
            cells,
            origin,
            direction,
            inverse: direction.recip(),
            low: IVec3::ZERO,
            high: IVec3::ZERO,
            outside,
            voxel: IVec3::ZERO,
            stage: Stage::After,
            t: f64::from(t_min),
            t_leave: f64::from(t_min),
            piece: (f64::INFINITY, outside),
            last: t_min,
            t_max,
            done: !(t_max > t_min),
            reach: distance,
            limited: None,
        };
        let bounds = cells.bounds().map(|(low, high)| match clip {
            Some((a, b)) => (low.max(a), high.min(b)),
            None => (low, high),
        });
        let Some((low, high)) = bounds.filter(|(low, high)| low.cmple(*high).all()) else { return walk };
        if !(origin.is_finite() && direction.is_finite()) {
            walk.piece = (f64::INFINITY, cells.largest().max(outside));
            return walk;
        }
        (walk.low, walk.high) = (low, high);
        let (box_low, box_high) = (low.as_dvec3(), high.as_dvec3() + 1.0);
        let (mut enter, mut leave) = (f64::from(t_min), f64::from(t_max));
        for axis in 0..3 {
            if direction[axis] == 0.0 {
                if origin[axis] < box_low[axis] || origin[axis] > box_high[axis] {
                    return walk;
                }
                continue;
            }
            let a = (box_low[axis] - origin[axis]) * walk.inverse[axis];
            let b = (box_high[axis] - origin[axis]) * walk.inverse[axis];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if !(enter < leave) {
            return walk;
        }
        walk.t_leave = leave;
        walk.t = enter;
        walk.voxel = floor(origin + direction * enter).clamp(low, high);
        if enter > f64::from(t_min) {
            walk.stage = Stage::Before;
            walk.piece = (enter, outside);
        } else {
            walk.stage = Stage::Inside;
            walk.piece = walk.step();
        }
        walk
    }

    /// From here on bounds are limited as [`resolution`] says on the ray `origin + t·direction` of render space.
    #[inline]
    pub fn limit_on(&mut self, ray: [Vec3; 2]) {
        self.limited = Some(ray);
    }

    /// The stretch that begins where the last one ended.
    #[inline]
    fn segment(&self, t_end: f32, majorant: f32) -> MajorantSegment {
        let majorant = match self.limited {
            Some([origin, direction]) => resolution::limit(majorant, origin + direction * self.last),
            None => majorant,
        };
        MajorantSegment { t_end, majorant }
    }

    /// The cell in which the walk stands: where the ray leaves it, and its bound. Moves on to the next cell.
    #[inline]
    fn step(&mut self) -> (f64, f32) {
        let (corner, size, bound) = self.cells.cube(self.voxel);
        let edge = size as f64;
        let low = corner.as_dvec3();
        let mut exit = f64::INFINITY;
        let mut exit_axis = 3;
        for axis in 0..3 {
            let d = self.direction[axis];
            if d != 0.0 {
                let side = if d > 0.0 { low[axis] + edge } else { low[axis] };
                let t = (side - self.origin[axis]) * self.inverse[axis];
                if t < exit {
                    exit = t;
                    exit_axis = axis;
                }
            }
        }
        let exit = exit.max(self.t);
        if exit_axis == 3 || exit >= self.t_leave {
            self.stage = Stage::After;
            return (self.t_leave, bound);
        }
        let cell_high = corner.saturating_add(IVec3::splat((size - 1) as i32));
        let at = floor(self.origin + self.direction * exit).clamp(corner, cell_high);
        for axis in 0..3 {
            let d = self.direction[axis];
            let old = self.voxel[axis];
            self.voxel[axis] = if axis == exit_axis {
                if d > 0.0 { cell_high[axis].saturating_add(1) } else { corner[axis].saturating_sub(1) }
            } else if d > 0.0 {
                at[axis].max(old)
            } else {
                at[axis].min(old)
            };
        }
        self.t = exit;
        if self.voxel.cmplt(self.low).any() || self.voxel.cmpgt(self.high).any() {
            self.stage = Stage::After;
        }
        (exit, bound)
    }

    fn advance(&mut self) -> (f64, f32) {
        match self.stage {
            Stage::Before => {
                self.stage = Stage::Inside;
                self.step()
            }
            Stage::Inside => self.step(),
            Stage::After => (f64::INFINITY, self.outside),
        }
    }

    fn boundary(&self, t: f64, rises: bool) -> f32 {
        let error = POINT_ERROR * (self.reach + t.abs());
        if rises { ((t - error) as f32).next_down() } else { ((t + error) as f32).next_up() }
    }
}

/// Rounded down, saturating, without a call into the mathematics library.
#[inline]
fn floor(p: DVec3) -> IVec3 {
    let truncated = p.as_ivec3();
    let back = truncated.as_dvec3();
    let less = |a: f64, b: f64| i32::from(a < b);
    truncated.saturating_sub(IVec3::new(less(p.x, back.x), less(p.y, back.y), less(p.z, back.z)))
}

impl Iterator for GridMajorants<'_> {
    type Item = MajorantSegment;

    #[inline]
    fn next(&mut self) -> Option<MajorantSegment> {
        if self.done {
            return None;
        }
        loop {
            let (exit, majorant) = self.piece;
            if exit >= f64::from(self.t_max) {
                self.done = true;
                return Some(self.segment(self.t_max, majorant));
            }
            self.piece = self.advance();
            if self.piece.1 == majorant {
                continue;
            }
            let t_end = self.boundary(exit, self.piece.1 > majorant);
            if t_end >= self.t_max {
                self.done = true;
                return Some(self.segment(self.t_max, majorant));
            }
            if t_end > self.last {
                let segment = self.segment(t_end, majorant);
                self.last = t_end;
                return Some(segment);
            }
        }
    }
}

/// A length that no rounding of `p` exceeds: for the tolerance of points along a ray.
pub fn reach_of(p: Vec3) -> f64 {
    f64::from(p.abs().max_element())
}
