//! Photometric data of luminaires, as IES files hold it ([`read`]): luminous intensity by direction.
//!
//! Sources: ANSI/IESNA LM-63-2002, section 3 (the three systems of coordinates); IES LM-75-01. In all three systems the space of a
//! profile is turned so that the angles (0, 0) are +z and, in the plane of horizontal angle 0, vertical angles grow towards +x:
//!
//! ```text
//! type C:  (sin V cos H, sin V sin H, cos V)        planes around z, which is the nadir of the luminaire
//! type B:  (cos H sin V, −sin H, cos H cos V)       planes around y
//! type A:  (sin V, −cos V sin H, cos V cos H)       planes around x
//! ```
//!
//! so horizontal angles go from +x to +y for type C (counterclockwise from above), the other way for A and B, as the standard has it.
//! Every table becomes one of spherical coordinates: angles from a pole, and around it. Between angles, values are bilinear.

pub mod read;
#[cfg(test)]
mod tests;

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// The systems of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Photometry {
    /// Headlights and signals.
    A,
    /// Floodlights.
    B,
    /// All other luminaires.
    C,
}

/// A table as a file has it: angles in degrees, rising; values by horizontal, then by vertical angle.
#[derive(Clone, Debug)]
pub struct Table {
    /// The system of its angles.
    pub photometry: Photometry,
    /// Two or more; within 0 to 180 for type C, −90 to 90 for the others.
    pub vertical: Vec<f32>,
    /// For type C one, or from 0 to 90, 180 or more, or from 90 to 270; for the others two or more within −180 to 180.
    pub horizontal: Vec<f32>,
    /// Candela, finite and not negative.
    pub candela: Vec<f32>,
}

/// Luminous intensity by direction.
#[derive(Clone, Debug)]
pub struct IesProfile {
    photometry: Photometry,
    /// Angles from the pole, rising, in radians.
    polar: Box<[f32]>,
    /// Angles around the pole, rising, in radians; one where all around is alike.
    azimuth: Box<[f32]>,
    /// Beyond the last angle around the pole the first follows. Else there is nothing.
    periodic: bool,
    /// By angle around the pole, then by angle from it.
    candela: Box<[f32]>,
    greatest: f32,
    flux: f32,
    forward: f32,
    cone: (Vec3, f32),
}

/// Pieces that an interval between angles is integrated in.
const PIECES: u32 = 8;

impl IesProfile {
    /// The profile of `table`. Parts that symmetry stands for are written out: types A and B whose angles begin at 0 are mirrored there, type
    /// C is repeated as its last horizontal angle says.
    pub fn new(table: &Table) -> Self {
        let Table { photometry, vertical, horizontal, candela } = table;
        let value = |h: usize, v: usize| candela[h * vertical.len() + v];
        let rows: Vec<(f32, usize)> = vertical.iter().copied().zip(0..).collect();
        let columns: Vec<(f32, usize)> = horizontal.iter().copied().zip(0..).collect();
        let from_pole = |list: Vec<(f32, usize)>| list.into_iter().map(|(angle, i)| (angle + 90.0, i)).collect();
        let (polar, azimuth, transposed): (Vec<_>, Vec<_>, bool) = match photometry {
            Photometry::A => (from_pole(mirrored(rows)), mirrored(columns), false),
            Photometry::B => (from_pole(mirrored(columns)), mirrored(rows), true),
            Photometry::C => (rows, around(&columns), false),
        };
        let at = |&(_, a): &(f32, usize), &(_, p): &(f32, usize)| if transposed { value(p, a) } else { value(a, p) };
        let candela: Box<[f32]> = azimuth.iter().flat_map(|a| polar.iter().map(move |p| at(a, p))).collect();
        let radians = |list: &[(f32, usize)]| list.iter().map(|(angle, _)| angle.to_radians()).collect();
        let mut profile = Self {
            photometry: *photometry,
            polar: radians(&polar),
            azimuth: radians(&azimuth),
            periodic: *photometry == Photometry::C,
            greatest: candela.iter().fold(0.0, |a, &b| a.max(b)),
            candela,
            flux: 0.0,
            forward: 0.0,
            cone: (Vec3::Z, -1.0),
        };
        profile.flux = profile.integrate(|_| 1.0) as f32;
        profile.forward = profile.integrate(|w| f64::from(w.z.max(0.0))) as f32;
        profile.cone = profile.lit_cone();
        profile
    }

    /// Candela in the unit direction `w` of the profile's space.
    #[inline]
    pub fn candela(&self, w: Vec3) -> f32 {
        let (around, pole) = match self.photometry {
            Photometry::A => ([-w.y, w.z], -w.x),
            Photometry::B => ([w.x, w.z], w.y),
            Photometry::C => ([w.y, w.x], w.z),
        };
        // The arc cosine would lose what narrow beams are made of.
        let polar = around[0].hypot(around[1]).atan2(pole);
        let Some((row, fy)) = interval(&self.polar, polar) else { return 0.0 };
        let count = self.polar.len();
        let column = |x: usize| {
            let start = x * count + row;
            self.candela[start] + (self.candela[start + 1] - self.candela[start]) * fy
        };
        if self.azimuth.len() == 1 {
            return column(0);
        }
        let mut azimuth = around[0].atan2(around[1]);
        if self.periodic && azimuth < self.azimuth[0] {
            azimuth += TAU;
        }
        let Some((x, fx)) = interval(&self.azimuth, azimuth) else { return 0.0 };
        let (left, right) = (column(x), column(x + 1));
        left + (right - left) * fx
    }

    /// The largest value in candela.
    pub fn greatest(&self) -> f32 {
        self.greatest
    }

    /// Luminous flux in lumens: the integral over all directions.
    pub fn flux(&self) -> f32 {
        self.flux
    }

    /// The integral over the directions around +z, times their cosine to it: the flux of a surface whose luminance has this profile.
    pub fn forward(&self) -> f32 {
        self.forward
    }

    /// Axis and cosine of the half angle of a cone that holds all directions with light.
    pub fn cone(&self) -> (Vec3, f32) {
        self.cone
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.polar) + size_of_val(&*self.azimuth) + size_of_val(&*self.candela)
    }

    /// The direction with these angles from the pole and around it.
    fn direction(&self, polar: f32, azimuth: f32) -> Vec3 {
        let ((sin, cos), (sin_around, cos_around)) = (polar.sin_cos(), azimuth.sin_cos());
        match self.photometry {
            Photometry::A => Vec3::new(-cos, -sin * sin_around, sin * cos_around),
            Photometry::B => Vec3::new(sin * sin_around, cos, sin * cos_around),
            Photometry::C => Vec3::new(sin * cos_around, sin * sin_around, cos),
        }
    }

    /// Each interval of angles around the pole: its ends, and its columns. All around where there is one column.
    fn sectors(&self) -> impl Iterator<Item = ([f32; 2], [usize; 2])> + '_ {
        let only = (self.azimuth.len() == 1).then_some(([-PI, PI], [0, 0]));
        only.into_iter().chain((1..self.azimuth.len()).map(|k| ([self.azimuth[k - 1], self.azimuth[k]], [k - 1, k])))
    }

    /// ∫ I(ω) `weight`(ω) dω, by midpoints.
    fn integrate(&self, weight: impl Fn(Vec3) -> f64) -> f64 {
        let count = self.polar.len();
        // The weights of type C do not depend on the angle around the pole.
        let around = if self.photometry == Photometry::C { 1 } else { PIECES };
        let middle = |[a, b]: [f32; 2], k: u32, pieces: u32| a + (b - a) * (k as f32 + 0.5) / pieces as f32;
        let mut sum = 0.0;
        for row in 1..count {
            let ends = [self.polar[row - 1], self.polar[row]];
            for k in 0..PIECES {
                let (polar, fy) = (middle(ends, k, PIECES), (k as f32 + 0.5) / PIECES as f32);
                // The exact share of a ring: its midpoint would be off where rings are wide.
                let edge = |k: u32| f64::from(ends[0] + (ends[1] - ends[0]) * k as f32 / PIECES as f32).cos();
                let height = edge(k) - edge(k + 1);
                for (sector, columns) in self.sectors() {
                    let [left, right] = columns.map(|x| {
                        let start = x * count + row - 1;
                        self.candela[start] + (self.candela[start + 1] - self.candela[start]) * fy
                    });
                    for j in 0..around {
                        let value = left + (right - left) * (j as f32 + 0.5) / around as f32;
                        let width = f64::from((sector[1] - sector[0]) / around as f32);
                        if value > 0.0 {
                            let w = self.direction(polar, middle(sector, j, around));
                            sum += f64::from(value) * weight(w) * height * width;
                        }
                    }
                }
            }
        }
        sum
    }

    /// The narrower of the cones around +z and, for type C, −z that hold all cells that are not dark. The height z of a cell is least in
    /// one of its corners.
    fn lit_cone(&self) -> (Vec3, f32) {
        let count = self.polar.len();
        let (mut low, mut high) = (1.0f32, -1.0f32);
        for row in 1..count {
            for (sector, columns) in self.sectors() {
                let is_lit = columns.iter().any(|x| {
                    let start = x * count + row - 1;
                    self.candela[start] > 0.0 || self.candela[start + 1] > 0.0
                });
                if is_lit {
                    for polar in [self.polar[row - 1], self.polar[row]] {
                        for azimuth in sector {
                            let z = self.direction(polar, azimuth).z;
                            (low, high) = (low.min(z), high.max(z));
                        }
                    }
                }
            }
        }
        const SLACK: f32 = 1e-5;
        if self.photometry == Photometry::C && -high > low {
            return (-Vec3::Z, (-high - SLACK).max(-1.0));
        }
        (Vec3::Z, (low - SLACK).clamp(-1.0, 1.0))
    }
}

/// The angles and what they mirror at 0, where they begin there.
fn mirrored(list: Vec<(f32, usize)>) -> Vec<(f32, usize)> {
    if list[0].0 != 0.0 {
        return list;
    }
    let below = list[1..].iter().rev().map(|&(angle, i)| (-angle, i));
    below.chain(list.iter().copied()).collect()
}

/// The angles of type C all around, from the first to itself again.
fn around(list: &[(f32, usize)]) -> Vec<(f32, usize)> {
    let (first, last) = (list[0].0, list[list.len() - 1].0);
    if list.len() == 1 {
        return list.to_vec();
    }
    let copies = |angle: f32| -> Vec<f32> {
        if first == 90.0 && last == 270.0 {
            vec![angle, 180.0 - angle]
        } else if last <= 90.0 {
            vec![angle, 180.0 - angle, 180.0 + angle, -angle]
        } else if last <= 180.0 {
            vec![angle, -angle]
        } else {
            vec![angle]
        }
    };
    let mut all: Vec<(f32, usize)> =
        list.iter().flat_map(|&(angle, i)| copies(angle).into_iter().map(move |a| (a.rem_euclid(360.0), i))).collect();
    // Of 0 and 360 the first stays; in all other cases what falls together is the same.
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|a, b| a.0 == b.0);
    all.push((all[0].0 + 360.0, all[0].1));
    all
}

/// The interval of a rising list that `value` is in, and where in it; `None` outside.
#[inline]
fn interval(list: &[f32], value: f32) -> Option<(usize, f32)> {
    let (first, last) = (list[0], list[list.len() - 1]);
    if !(value >= first && value <= last) {
        return None;
    }
    let next = list.partition_point(|&angle| angle <= value).clamp(1, list.len() - 1);
    let (a, b) = (list[next - 1], list[next]);
    Some((next - 1, ((value - a) / (b - a)).clamp(0.0, 1.0)))
}
