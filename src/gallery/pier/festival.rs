//! The pier on the night of a festival: what there is beyond [`super::DEFAULT_LIGHTS`] lights, up to millions. Stalls and people
//! on the pier, bulbs strung everywhere, many more lanterns adrift, a fairground on the far shore, bonfires on rafts, and a
//! town that covers the hills behind, lit by more points of light than anything else has.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::super::GalleryError;
use super::super::furniture;
use super::super::glow::Glow;
use super::super::mesh::Mesh;
use super::super::text::{Dice, Point, SceneText, on_rope, share};
use super::lanterns::Cup;
use super::{BOATS, DECK, EDGES, EYE, FIRE, FIRE_BOX, POST_TOP, crowd, fair, post_rows, town};

/// How many lights each part has.
pub struct Shares {
    /// Bulbs on the pier and the boats.
    pub bulbs: u32,
    /// Lanterns adrift.
    pub adrift: u32,
    /// Bulbs of the fairground.
    pub fair: u32,
    /// Lit windows on the hills.
    pub windows: u32,
    /// Points of light in the town.
    pub points: u32,
}

impl Shares {
    /// Of `more` lights. Beyond some ten thousand all go to the town, most of them as points: what is seen of it are windows.
    pub fn of(more: u32) -> Self {
        let part = |tenths: u32, most: u32| (more as u64 * u64::from(tenths) / 10).min(u64::from(most)) as u32;
        let (bulbs, adrift, fair) = (part(3, 4000), part(2, 2600), part(2, 7000));
        let left = more - bulbs - adrift - fair;
        let windows = (left / 3).min(12_000);
        Self { bulbs, adrift, fair, windows, points: left - windows }
    }
}

/// Adds the festival to the scene's text `t`, and its town in files of its own.
pub fn write(folder: &Path, t: &mut SceneText, more: u32) -> Result<(), GalleryError> {
    let shares = Shares::of(more);
    let mut dice = Dice::new(1212);
    furniture::define(t);
    let stalls = crowd::write(t, &mut dice, more);
    bulbs(t, &mut dice, &stalls, shares.bulbs);
    adrift(t, &mut dice, shares.adrift);
    fair::write(t, &mut dice, shares.fair);
    if more > 2000 {
        bonfires(t);
    }
    town::write(folder, t, &shares)
}

/// A line that bulbs hang from.
type Line = (Vec3, Vec3, f32);

/// Bulbs on lines between the posts, outside and below the deck's edges, over the stalls and in the boats' rigging.
fn bulbs(t: &mut SceneText, dice: &mut Dice, stalls: &[Line], count: u32) {
    t.add(format_args!("\n# Strings of bulbs"));
    let rows: Vec<f32> = post_rows().collect();
    let top = |x: f32, z: f32| Vec3::new(x, POST_TOP - 0.35, z);
    let [left, right] = EDGES;
    let mut lines: Vec<Line> = vec![];
    for pair in rows.windows(2) {
        lines.push((top(left, pair[0]), top(right, pair[1]), 0.25));
        lines.push((top(right, pair[0]), top(left, pair[1]), 0.25));
        for x in EDGES {
            lines.push((top(x, pair[0]), top(x, pair[1]), 0.75));
            let out = if x == left { -0.4 } else { 0.4 };
            let rail = Vec3::new(x + out, DECK - 0.25, pair[0]);
            lines.push((rail, rail.with_z(pair[1]), 0.06));
        }
    }
    for (place, heading, has_mast) in BOATS {
        let on_boat = |p: Vec3| place + glam::Quat::from_rotation_y(heading.to_radians()) * p;
        if has_mast {
            let masthead = on_boat(Vec3::new(0.0, 5.3, 0.3));
            for (x, z) in [(0.85, 1.6), (-0.85, 1.6), (0.85, -1.4), (-0.85, -1.4)] {
                lines.push((masthead, on_boat(Vec3::new(x, 0.85, z)), 0.2));
            }
        }
    }
    lines.extend(stalls);
    let glows = [
        Glow::Kelvin(2000.0),
        Glow::Kelvin(2300.0),
        Glow::Kelvin(2700.0),
        Glow::Paper([1.4, 0.25, 0.1]),
        Glow::Paper([0.3, 1.1, 0.8]),
    ];
    for (i, &(a, b, sag)) in lines.iter().enumerate() {
        let here = share(count, lines.len() as u32, i as u32);
        if here == 0 {
            continue;
        }
        t.of("rope", |t| t.rope(a, b, sag, 0.012));
        let places: Vec<Vec3> = (0..here)
            .map(|k| on_rope(a, b, sag, 0.06 + 0.88 * (k as f32 + 0.5) / here as f32) - Vec3::new(0.0, 0.09, 0.0))
            .collect();
        dice.pick(&glows).bulbs(t, &places, 0.04, 3.3);
    }
}

/// Lanterns all over the bay, fewer the farther out.
fn adrift(t: &mut SceneText, dice: &mut Dice, count: u32) {
    t.add(format_args!("\n# More lanterns adrift"));
    let mut taken: Vec<Vec2> = vec![];
    while taken.len() < count as usize {
        let z = 2.0 + 64.0 * dice.between(0.0, 1.0).powf(0.8);
        let p = Vec2::new(dice.between(-0.85 * z - 8.0, 0.6 * z + 4.0), z);
        let in_the_way = p.x > EDGES[0] - 2.2 && p.x < EDGES[1] + 2.6
            || p.distance(Vec2::new(FIRE.x, FIRE.z)) < 2.3
            || BONFIRES.iter().any(|fire| p.distance(Vec2::new(fire.x, fire.z)) < 2.3)
            || p.distance(Vec2::new(EYE.x, EYE.z)) < 8.0
            || BOATS.iter().any(|(boat, ..)| p.distance(Vec2::new(boat.x, boat.z)) < 3.0)
            || taken.iter().any(|other| p.distance_squared(*other) < 0.16);
        if !in_the_way {
            taken.push(p);
            Cup::throw(dice, p).write(t);
        }
    }
}

/// Where rafts with bonfires lie.
const BONFIRES: [Vec3; 3] = [Vec3::new(-21.0, 0.3, 30.0), Vec3::new(-9.5, 0.3, 48.0), Vec3::new(9.0, 0.3, 31.0)];

/// The fire's volume again on other rafts. Nothing but the glowing gas gives their light.
fn bonfires(t: &mut SceneText) {
    t.add(format_args!("\n# Bonfires: the fire's grids once more, elsewhere"));
    for (i, place) in BONFIRES.into_iter().enumerate() {
        let by = Point(place - FIRE);
        t.block(|t| {
            t.add(format_args!("Translate {by}"));
            t.add(format_args!(
                "MakeNamedMedium \"bonfire{i}\" \"string type\" \"openvdb\" \"string filename\" \"fire.vdb\""
            ));
            t.add(format_args!("  \"string temperature\" \"temperature\" \"float temperaturereference\" 1800"));
            t.add(format_args!("  \"float Le\" 4.5 \"float sigma_a\" 1.6 \"float sigma_s\" 0.12"));
            t.add(format_args!("Material \"interface\" MediumInterface \"bonfire{i}\" \"\""));
            t.mesh(&Mesh::cuboid(FIRE_BOX[0] + FIRE, FIRE_BOX[1] + FIRE, None));
        });
        t.of("timber", |t| {
            t.add(format_args!("Translate {}", Point(place)));
            t.cuboid(Vec3::new(-1.3, -0.45, -1.3), Vec3::new(1.3, -0.37, 1.3));
            for turn in [0, 60, 120] {
                t.block(|t| {
                    t.add(format_args!("Rotate {turn} 0 1 0"));
                    t.cuboid(Vec3::new(-0.6, -0.37, -0.07), Vec3::new(0.6, -0.23, 0.07));
                });
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_light_is_lost_between_the_parts() {
        for more in [1, 2, 9, 100, 12_345, 4_880_619] {
            let shares = Shares::of(more);
            let Shares { bulbs, adrift, fair, windows, points } = shares;
            assert_eq!(bulbs + adrift + fair + windows + points, more);
        }
    }
}
