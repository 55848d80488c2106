//! Trees: a trunk that forks again and again, bunches of leaves at the ends of its branches.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};

/// A piece of trunk or branch: from, to, and its thickness at both ends.
struct Branch {
    ends: [Vec3; 2],
    radii: [f32; 2],
}

/// A kind of tree.
pub struct Tree {
    branches: Vec<Branch>,
    /// Where its bunches of leaves are.
    tips: Vec<Vec3>,
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

    fn branch(&mut self, dice: &mut Dice, from: Vec3, direction: Vec3, length: f32, radius: f32, forks: u32) {
        // In two pieces, so that it bends a little.
        let lean = 0.16 * Vec3::new(dice.between(-1.0, 1.0), dice.between(-0.2, 0.9), dice.between(-1.0, 1.0));
        let middle = from + 0.5 * length * direction;
        let direction = (direction + lean).normalize();
        let to = middle + 0.5 * length * direction;
        self.branches.push(Branch { ends: [from, middle], radii: [radius, 0.85 * radius] });
        self.branches.push(Branch { ends: [middle, to], radii: [0.85 * radius, 0.7 * radius] });
        if forks == 0 {
            self.tips.extend([to, middle + dice.within(Vec3::splat(-0.25), Vec3::splat(0.25))]);
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
    pub fn define(&self, t: &mut SceneText, dice: &mut Dice, name: &str) {
        t.object(name, |t| {
            t.add(format_args!("NamedMaterial \"bark\""));
            let mut wood = Mesh::default();
            for branch in &self.branches {
                branch.add_to(&mut wood);
            }
            t.mesh(&wood);
            for &tip in &self.tips {
                let kind = dice.pick(&[0, 1, 2]);
                let (turn, size) = (Number(dice.between(0.0, 360.0)), Number(dice.between(0.85, 1.25)));
                t.block(|t| {
                    t.add(format_args!(
                        "Translate {} Rotate {turn} 0 1 0 Scale {size} {size} {size} ObjectInstance \"leaves{kind}\"",
                        Point(tip)
                    ));
                });
            }
        });
    }

    /// A place for a bulb: wound around a branch, or hung among leaves.
    pub fn place_of_bulb(&self, dice: &mut Dice) -> Vec3 {
        if dice.happens(0.45) {
            let branch = &self.branches[dice.below(self.branches.len())];
            let (s, around) = (dice.between(0.0, 1.0), dice.between(0.0, TAU));
            let [a, b] = branch.ends;
            let axis = (b - a).normalize();
            let out = Quat::from_axis_angle(axis, around) * axis.any_orthonormal_vector();
            let [r, q] = branch.radii;
            return a.lerp(b, s) + (r + (q - r) * s + 0.03) * out;
        }
        let tip = self.tips[dice.below(self.tips.len())];
        tip + dice.within(Vec3::splat(-0.4), Vec3::splat(0.4))
    }
}

/// A length that differs by a sixth or so.
fn dice_length(dice: &mut Dice, length: f32) -> f32 {
    length * dice.between(0.85, 1.18)
}

impl Branch {
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
