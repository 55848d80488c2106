//! What grows where, and the bulbs in it: an orchard over the whole hillside, hedges along the path. Every tree and hedge has
//! bulbs of its own, of one colour, so that a place is lit by those of the few plants around it.

use glam::{Affine3A, Vec2, Vec3};

use super::super::glow::Glow;
use super::super::text::{Dice, Number, Point, SceneText, share};
use super::ground::{Ground, across, path_at};
use super::leaf::Bunch;
use super::tree::Tree;

/// Bulbs of a tree, about; a hedge has a share of [`HEDGE`] of [`TREE`] of that.
pub const BULBS: u32 = 210;
const TREE: u32 = 5;
const HEDGE: u32 = 1;
/// Bulbs that can be seen: of more than this, those of the farthest plants are points.
const SPHERES: u32 = 100_000;
/// How far above the ground bulbs are.
const ABOVE_GROUND: f32 = 0.3;
/// How far a plant of size 1 reaches from its foot, about.
const REACH: f32 = 7.0;
/// Kinds of trees, and of hedges, which come after them.
pub const TREES: usize = 4;
pub const HEDGES: usize = 2;
/// The least and the most trees.
const COUNTS: [u32; 2] = [3, 260];

/// A tree or a hedge, where it stands.
pub struct Place {
    kind: usize,
    at: Vec3,
    degrees: f32,
    size: f32,
}

impl Place {
    fn shares(&self) -> u32 {
        if self.kind < TREES { TREE } else { HEDGE }
    }

    /// Where it stands, level.
    pub fn foot(&self) -> Vec2 {
        Vec2::new(self.at.x, self.at.z)
    }

    fn to_world(&self) -> Affine3A {
        Affine3A::from_translation(self.at)
            * Affine3A::from_rotation_y(self.degrees.to_radians())
            * Affine3A::from_scale(Vec3::splat(self.size))
    }
}

/// The kinds of plants: trees, then hedges.
pub fn kinds(dice: &mut Dice, forks: u32) -> Vec<Tree> {
    let mut kinds: Vec<Tree> = (0..TREES).map(|_| Tree::grow(dice, forks)).collect();
    kinds.extend((0..HEDGES).map(|_| Tree::hedge(dice)));
    kinds
}

/// Where plants stand that take so many lights, nearest ones first: none on the path or before the camera.
pub fn places(dice: &mut Dice, ground: &Ground, lights: u32) -> Vec<Place> {
    let count = (lights * 4 / (5 * BULBS)).clamp(COUNTS[0], COUNTS[1]);
    // Two trees frame the view; others in lanes, of which many make the orchard wide and deep.
    let mut sites = vec![Vec2::new(-6.0, 0.5), Vec2::new(7.2, 4.0)];
    let far = if count < 20 { 30.0 } else { 103.0 };
    let mut z = 14.0;
    while z < far {
        let lane = 7.3 + 0.01 * z;
        let half = 9.0 + 0.66 * z;
        let mut x = -half + dice.between(0.0, lane);
        while x < half {
            let site = Vec2::new(x + dice.between(-1.6, 1.6), z + dice.between(-2.2, 2.2));
            if (site.x - path_at(site.y)).abs() > 4.6 {
                sites.push(site);
            }
            x += lane;
        }
        z += lane;
    }
    sites.sort_by(|a, b| a.y.total_cmp(&b.y));
    sites.truncate(count as usize);
    let last = sites.last().map_or(0.0, |site| site.y);
    let mut places: Vec<Place> = sites
        .iter()
        .map(|site| Place {
            kind: dice.below(TREES),
            at: ground.at(site.x, site.y) - 0.1 * Vec3::Y,
            degrees: dice.between(0.0, 360.0),
            size: dice.between(0.8, 1.15),
        })
        .collect();
    let mut z = -3.0;
    while z < last.min(90.0) {
        for side in [-1.0, 1.0] {
            let out = across(z);
            let p = Vec3::new(path_at(z), 0.0, z) + side * 2.0 * out;
            let degrees = out.x.atan2(out.z).to_degrees() + dice.between(-6.0, 6.0);
            let size = dice.between(0.85, 1.1);
            if dice.happens(0.85) {
                let at = ground.at(p.x, p.z) - 0.05 * Vec3::Y;
                places.push(Place { kind: TREES + dice.below(HEDGES), at, degrees, size });
            }
        }
        z += 3.0;
    }
    places.sort_by(|a, b| a.at.z.total_cmp(&b.at.z));
    places
}

/// Instances of the objects `plant0`, `plant1`, ….
pub fn plant(t: &mut SceneText, places: &[Place]) {
    t.add(format_args!("\n# Trees and hedges"));
    for Place { kind, at, degrees, size } in places {
        let (at, degrees, size) = (Point(*at), Number(*degrees), Number(*size));
        t.block(|t| {
            t.add(format_args!(
                "Translate {at} Rotate {degrees} 0 1 0 Scale {size} {size} {size} ObjectInstance \"plant{kind}\""
            ));
        });
    }
}

/// Bulbs in the plants, of one colour each: frosted globes that hang clear of bark, leaves and ground.
pub fn bulbs(
    t: &mut SceneText,
    dice: &mut Dice,
    ground: &Ground,
    (kinds, bunches): (&[Tree], &[Bunch]),
    places: &[Place],
    count: u32,
) {
    t.add(format_args!("\n# Bulbs"));
    let units: u32 = places.iter().map(Place::shares).sum();
    // How many there are of those that there should be.
    let density = count.max(1) as f32 * TREE as f32 / (BULBS * units) as f32;
    // The fewer, the larger; as bright together.
    let radius = (0.033 * (1.0 / density).clamp(1.0, 60.0).sqrt()).min(0.1);
    let intensity = 0.018 / density.max(0.1);
    let clear = radius + 0.15;
    let (mut unit, mut seen) = (0, 0);
    for place in places {
        let bulbs: u32 = (unit..unit + place.shares()).map(|i| share(count, units, i)).sum();
        unit += place.shares();
        let near = |other: &&Place| other.foot().distance(place.foot()) < REACH;
        let others: Vec<&Place> = places.iter().filter(near).collect();
        let space = |p: Vec3| {
            let above = p.y - ground.height(p.x, p.z) - (ABOVE_GROUND - clear);
            others.iter().fold(above.min(clear), |space, other| {
                let q = other.to_world().inverse().transform_point3(p);
                space.min(other.size * kinds[other.kind].space(q, bunches, space.max(0.0) / other.size))
            })
        };
        let (to_world, kind) = (place.to_world(), &kinds[place.kind]);
        let throw = |dice: &mut Dice| to_world.transform_point3(kind.throw_bulb(dice, clear / place.size));
        seen += bulbs;
        // Points need no room, and millions of them would take long to find it.
        let is_seen = seen <= SPHERES;
        let mut hang = || if is_seen { freest(dice, throw, space, clear) } else { throw(dice) };
        let list: Vec<Vec3> = (0..bulbs).map(|_| hang()).collect();
        let glow = colour(dice, place);
        // Those up the hill are dimmer, so that the eye stays with what is near, and so that a place is lit by what is around it.
        let intensity = intensity * 15.0 / place.at.z.clamp(15.0, 30.0);
        if is_seen {
            t.of("globe", |t| glow.bulbs(t, &list, radius, intensity / (radius * radius)));
        } else {
            glow.points(t, &list, std::f32::consts::PI * intensity);
        }
    }
}

/// A place with at least `clear` around it if one is soon found, else the freest of many.
fn freest(dice: &mut Dice, throw: impl Fn(&mut Dice) -> Vec3, space: impl Fn(Vec3) -> f32, clear: f32) -> Vec3 {
    let mut best = (f32::NEG_INFINITY, Vec3::ZERO);
    for _ in 0..40 {
        let p = throw(dice);
        let free = space(p);
        if free > best.0 {
            best = (free, p);
        }
        if free >= 0.999 * clear {
            break;
        }
    }
    best.1
}

/// Warm in hedges and in most trees.
fn colour(dice: &mut Dice, place: &Place) -> Glow {
    if place.kind >= TREES {
        return Glow::Kelvin(dice.pick(&[2000.0, 2200.0]));
    }
    dice.pick(&[
        Glow::Kelvin(2000.0),
        Glow::Kelvin(2200.0),
        Glow::Kelvin(2600.0),
        Glow::Kelvin(3200.0),
        Glow::Kelvin(2200.0),
        Glow::Paper([1.7, 0.45, 0.18]),
        Glow::Paper([0.5, 1.2, 1.1]),
        Glow::Paper([1.5, 0.55, 1.0]),
    ])
}
