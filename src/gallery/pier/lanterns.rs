//! The scene's lights apart from fire and sky: spheres of paper on lines and in rigging, open paper cups adrift, lamps
//! under the cross lines, windows on the far shore.

use glam::{Vec2, Vec3};

use super::super::glow::{CANDLES, Glow};
use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText, on_rope, share};
use super::{BOATS, DEFAULT_LIGHTS, EDGES, EYE, FIRE, FIXED_LIGHTS, POST_TOP, post_rows};

/// Which of the lanterns are there: all of them, or, in a small version of the scene, some spread evenly over the rest.
pub struct Keep {
    wanted: u32,
    seen: u32,
}

impl Keep {
    /// How many there are to choose from.
    const ALL: u32 = DEFAULT_LIGHTS - FIXED_LIGHTS;

    /// Keeps `wanted` of them.
    pub fn new(wanted: u32) -> Self {
        Self { wanted: wanted.min(Self::ALL), seen: 0 }
    }

    /// Whether the next one is there.
    fn next(&mut self) -> bool {
        self.seen += 1;
        share(self.wanted, Self::ALL, self.seen - 1) > 0
    }
}

/// A paper sphere that hangs at `p`, with its frame.
fn ball(t: &mut SceneText, p: Vec3, radius: f32, glow: Glow, scale: f32) {
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(p)));
        let size = Number(radius);
        t.block(|t| t.add(format_args!("Scale {size} {size} {size} ObjectInstance \"frame\"")));
        glow.area_light(t, scale);
        t.add(format_args!("NamedMaterial \"paper\" Shape \"sphere\" \"float radius\" {size}"));
    });
}

/// Lanterns along both sides of the pier and across it; the lines across also carry brighter globes of frosted glass.
pub fn hung(t: &mut SceneText, dice: &mut Dice, keep: &mut Keep) {
    t.add(format_args!("\n# Lanterns on the pier's lines"));
    let rows: Vec<f32> = post_rows().collect();
    let top = |x: f32, z: f32| Vec3::new(x, POST_TOP - 0.06, z);
    let mut string = |a: Vec3, b: Vec3, sag: f32, count: u32, lamps: bool| {
        t.block(|t| {
            t.add(format_args!("NamedMaterial \"rope\""));
            t.rope(a, b, sag, 0.022);
        });
        for i in 0..count {
            let at = on_rope(a, b, sag, (i as f32 + 0.5) / count as f32);
            let radius = dice.between(0.11, 0.16);
            let p = at - Vec3::new(0.0, 1.45 * radius, 0.0);
            let glow = Glow::throw(dice, 0.3);
            let scale = dice.between(2.0, 3.2);
            if keep.next() {
                ball(t, p, radius, glow, scale);
            }
            if lamps && keep.next() {
                let p = on_rope(a, b, sag, (i as f32 + 0.1) / count as f32) - Vec3::new(0.0, 0.25, 0.0);
                Glow::Kelvin(2300.0).bulb(t, p, 0.12, 6.6);
            }
        }
    };
    for pair in rows.windows(2) {
        for x in EDGES {
            string(top(x, pair[0]), top(x, pair[1]), 0.42, 4, false);
        }
    }
    for &z in &rows[1..] {
        string(top(EDGES[0], z), top(EDGES[1], z), 0.3, 3, true);
    }
}

/// Lights along the stays of the boats with masts, a stern lantern on the others.
pub fn rigging(t: &mut SceneText, dice: &mut Dice, keep: &mut Keep) {
    t.add(format_args!("\n# Lights of the boats"));
    for (place, heading, has_mast) in BOATS {
        let on_boat = |p: Vec3| place + glam::Quat::from_rotation_y(heading.to_radians()) * p;
        if !has_mast {
            if keep.next() {
                ball(t, on_boat(Vec3::new(0.0, 1.2, -1.5)), 0.12, Glow::Kelvin(2200.0), 3.0);
            }
            continue;
        }
        let masthead = Vec3::new(0.0, 5.6, 0.3);
        for end in [Vec3::new(0.0, 0.95, 2.9), Vec3::new(0.0, 0.85, -2.6)] {
            for i in 0..8 {
                let p = on_boat(on_rope(masthead, end, 0.15, (i as f32 + 0.3) / 8.0)) - Vec3::new(0.0, 0.08, 0.0);
                let kelvin = dice.pick(&CANDLES) + 300.0;
                if keep.next() {
                    ball(t, p, 0.055, Glow::Kelvin(kelvin), 3.5);
                }
            }
        }
    }
}

/// Paper cups with candles that drift in shoals.
pub fn adrift(t: &mut SceneText, dice: &mut Dice, keep: &mut Keep) {
    t.add(format_args!("\n# Lanterns adrift"));
    let shoals = [
        (Vec2::new(-4.2, 1.5), 2.2, 16),
        (Vec2::new(-9.0, 11.0), 4.5, 50),
        (Vec2::new(-3.0, 11.5), 2.4, 26),
        (Vec2::new(-16.0, 24.0), 8.0, 60),
        (Vec2::new(-6.0, 27.0), 6.0, 56),
        (Vec2::new(6.0, 18.0), 3.0, 24),
        (Vec2::new(-18.0, 48.0), 16.0, 70),
        (Vec2::new(8.0, 44.0), 7.0, 28),
    ];
    let mut taken: Vec<Vec2> = Vec::new();
    for (centre, spread, count) in shoals {
        let mut left = count;
        // Crowded shoals may not take everyone: then some stay ashore.
        for _ in 0..40 * count {
            if left == 0 {
                break;
            }
            let around = [(); 2].map(|()| (0..3).map(|_| dice.between(-1.0, 1.0)).sum::<f32>() / 1.5);
            let p = centre + spread * Vec2::from(around);
            let in_the_way = p.x > EDGES[0] - 0.4 && p.x < EDGES[1] + 0.4
                || p.distance(Vec2::new(FIRE.x, FIRE.z)) < 2.3
                || p.distance(Vec2::new(EYE.x, EYE.z)) < 3.2
                || BOATS.iter().any(|(boat, ..)| p.distance(Vec2::new(boat.x, boat.z)) < 2.4)
                || taken.iter().any(|other| p.distance(*other) < 0.5);
            if in_the_way {
                continue;
            }
            taken.push(p);
            left -= 1;
            let cup = Cup::throw(dice, p);
            if keep.next() {
                cup.write(t);
            }
        }
    }
}

/// A paper cup with a candle, afloat.
pub struct Cup {
    at: Vec2,
    turn: f32,
    tilt: f32,
    radius: f32,
    height: f32,
    glow: Glow,
    scale: f32,
}

impl Cup {
    /// One at (x, z) as the dice will have it.
    pub fn throw(dice: &mut Dice, at: Vec2) -> Self {
        let (turn, tilt) = (dice.between(0.0, 90.0), dice.between(-5.0, 5.0));
        let (radius, height) = (dice.between(0.11, 0.16), dice.between(0.2, 0.28));
        let glow = Glow::throw(dice, 0.16);
        Self { at, turn, tilt, radius, height, glow, scale: dice.between(1.5, 2.6) }
    }

    /// Writes it.
    pub fn write(&self, t: &mut SceneText) {
        let (r, height) = (self.radius, self.height);
        let profile = [Vec2::new(0.85 * r, 0.0), Vec2::new(r, 0.4 * height), Vec2::new(0.95 * r, height)];
        t.block(|t| {
            let (at, turn, tilt) = (Point(Vec3::new(self.at.x, 0.02, self.at.y)), Number(self.turn), Number(self.tilt));
            t.add(format_args!("Translate {at} Rotate {turn} 0 1 0 Rotate {tilt} 1 0 0"));
            self.glow.area_light(t, self.scale);
            t.add(format_args!("NamedMaterial \"paper\""));
            t.mesh(&Mesh::revolved(&profile, 6));
        });
    }
}

/// Windows and street lamps on the far shore.
pub fn houses(t: &mut SceneText, dice: &mut Dice, keep: &mut Keep) {
    t.add(format_args!("\n# Lights on the far shore"));
    for _ in 0..150 {
        let x = dice.between(-75.0, 45.0);
        let up = dice.between(0.0, 1.0).powi(2);
        let p = Vec3::new(x, 0.7 + 5.5 * up, 78.0 + 9.0 * up);
        let glow = Glow::Kelvin(dice.pick(&[2200.0, 2700.0, 3000.0, 4200.0]));
        let (scale, size) = (dice.between(2.0, 6.0), Number(dice.between(0.09, 0.2)));
        if !keep.next() {
            continue;
        }
        t.block(|t| {
            t.add(format_args!("Translate {}", Point(p)));
            glow.area_light(t, scale);
            t.add(format_args!("NamedMaterial \"paper\" Shape \"sphere\" \"float radius\" {size}"));
        });
    }
}
