//! Trees: a trunk that forks again and again, bunches of leaves at the ends of its branches; and hedges, which are bunches alone.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};
use super::leaf::{Bunch, REACH};

/// A piece of trunk or branch: from, to, and its thickness at both ends.
struct Branch {
    ends: [Vec3; 2],
    radii: [f32; 2],
}

/// A bunch of leaves on the tree.
struct Tip {
    at: Vec3,
    kind: usize,
    degrees: f32,
    size: f32,
}

/// A kind of tree.
pub struct Tree {
    branches: Vec<Branch>,
    tips: Vec<Tip>,
}

impl Tree {
    /// A tree that forks `forks` times, some five metres high.
    pub fn grow(dice: &mut Dice, forks: u32) -> Self {
        let mut tree = Self { branches: vec![], tips: vec![] };
        let bent = Vec3::new(dice.between(-0.15, 0.15), 1.0, dice.between(-0.15, 0.15)).normalize();
        let length = dice_length(dice, 1.75);
        tree.branch(dice, Vec3::ZERO, bent, length, 0.17, forks);
        tree
    }

    /// A piece of hedge along x, without wood: three metres of leaves, waist-high.
    pub fn hedge(dice: &mut Dice) -> Self {
        const LONG: u32 = 6;
        let tip = |i: u32| {
            let middle = Vec3::new(-1.35 + 2.7 * (i / 2) as f32 / (LONG - 1) as f32, 0.3 + 0.42 * (i % 2) as f32, 0.0);
            let at = middle + dice.within(Vec3::new(-0.12, -0.06, -0.1), Vec3::new(0.12, 0.06, 0.1));
            let (kind, degrees, size) = (dice.below(3), dice.between(0.0, 360.0), dice.between(0.6, 0.75));
            Tip { at, kind, degrees, size }
        };
        Self { branches: vec![], tips: (0..2 * LONG).map(tip).collect() }
    }

    fn branch(&mut self, dice: &mut Dice, from: Vec3, direction: Vec3, length: f32, radius: f32, forks: u32) {
        // In two pieces, so that it bends a little.
        let lean = 0.16 * Vec3::new(dice.between(-1.0, 1.0), dice.between(-0.2, 0.9), dice.between(-1.0, 1.0));
        let middle = from + 0.5 * length * direction;
        let direction = (direction + lean).normalize();
        let to = middle + 0.5 * length * direction;
        self.branches.push(Branch { ends: [from, middle], radii: [radius, 0.85 * radius] });
        self.branches.push(Branch { ends: [middle, to], radii: [0.85 * radius, 0.7 * radius] });
        if forks == 0 {
            for at in [to, middle + dice.within(Vec3::splat(-0.25), Vec3::splat(0.25))] {
                let (kind, degrees, size) = (dice.below(3), dice.between(0.0, 360.0), dice.between(0.85, 1.25));
                self.tips.push(Tip { at, kind, degrees, size });
            }
            return;
        }
        let arms = if forks > 2 { 4 } else { 3 };
        let (turn, side) = (dice.between(0.0, TAU), direction.any_orthonormal_vector());
        for arm in 0..arms {
            let around = turn + TAU * arm as f32 / arms as f32 + dice.between(-0.35, 0.35);
            let axis = Quat::from_axis_angle(direction, around) * side;
            let off = Quat::from_axis_angle(axis, dice.between(0.45, 0.95)) * direction;
            let length = dice_length(dice, 0.78 * length);
            self.branch(dice, to, (off + Vec3::Y * 0.12).normalize(), length, 0.58 * radius, forks - 1);
        }
    }

    /// Writes the tree as the object `name`.
    pub fn define(&self, t: &mut SceneText, name: &str) {
        t.object(name, |t| {
            if !self.branches.is_empty() {
                t.add(format_args!("NamedMaterial \"bark\""));
                let mut wood = Mesh::default();
                for branch in &self.branches {
                    branch.add_to(&mut wood);
                }
                t.mesh(&wood);
            }
            for &Tip { at, kind, degrees, size } in &self.tips {
                let (at, turn, size) = (Point(at), Number(degrees), Number(size));
                t.block(|t| {
                    t.add(format_args!(
                        "Translate {at} Rotate {turn} 0 1 0 Scale {size} {size} {size} ObjectInstance \"leaves{kind}\""
                    ));
                });
            }
        });
    }

    /// How far `p` is from branches and leaves, up to `most`.
    pub fn space(&self, p: Vec3, bunches: &[Bunch], most: f32) -> f32 {
        let wood = self.branches.iter().map(|branch| branch.distance(p)).fold(most, f32::min);
        let near = self.tips.iter().filter(|tip| tip.at.distance(p) < REACH * tip.size + most);
        near.fold(wood, |space, &Tip { at, kind, degrees, size }| {
            let q = Quat::from_rotation_y(-degrees.to_radians()) * (p - at) / size;
            bunches[kind].iter().map(|card| size * card.distance(q)).fold(space, f32::min)
        })
    }

    /// A place for a bulb: wound around a branch, or hung among leaves.
    pub fn throw_bulb(&self, dice: &mut Dice, clear: f32) -> Vec3 {
        if !self.branches.is_empty() && dice.happens(0.45) {
            let branch = &self.branches[dice.below(self.branches.len())];
            let (s, around) = (dice.between(0.0, 1.0), dice.between(0.0, TAU));
            let [a, b] = branch.ends;
            let axis = (b - a).normalize();
            let out = Quat::from_axis_angle(axis, around) * axis.any_orthonormal_vector();
            let [r, q] = branch.radii;
            return a.lerp(b, s) + (r + (q - r) * s + 1.2 * clear) * out;
        }
        let tip = &self.tips[dice.below(self.tips.len())];
        let out = dice.within(Vec3::splat(-1.0), Vec3::splat(1.0)).normalize_or(Vec3::Y);
        tip.at + (tip.size * dice.between(0.45, 0.75) + clear) * out
    }
}

/// A length that differs by a sixth or so.
fn dice_length(dice: &mut Dice, length: f32) -> f32 {
    length * dice.between(0.85, 1.18)
}

impl Branch {
    /// How far a point is from its surface.
    fn distance(&self, p: Vec3) -> f32 {
        let ([a, b], [r, q]) = (self.ends, self.radii);
        let s = ((p - a).dot(b - a) / a.distance_squared(b)).clamp(0.0, 1.0);
        p.distance(a.lerp(b, s)) - (r + (q - r) * s)
    }

    fn add_to(&self, mesh: &mut Mesh) {
        const SIDES: u32 = 7;
        let [a, b] = self.ends;
        let axis = (b - a).normalize();
        let side = axis.any_orthonormal_vector();
        let first = mesh.positions.len() as u32;
        for (p, radius) in [(a, self.radii[0]), (b, self.radii[1])] {
            mesh.positions.extend((0..SIDES).map(|i| {
                let angle = -TAU * i as f32 / SIDES as f32;
                p + radius * (Quat::from_axis_angle(axis, angle) * side)
            }));
        }
        for i in 0..SIDES {
            let next = (i + 1) % SIDES;
            let [p, q, r, s] = [i, next, SIDES + i, SIDES + next].map(|corner| first + corner);
            mesh.indices.extend([p, r, q, q, r, s]);
        }
    }
}
