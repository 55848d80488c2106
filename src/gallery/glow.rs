//! What lights look like: black bodies and coloured paper, as area lights on bulbs and panels or as many points at once.

use std::fmt;

use glam::Vec3;

use super::text::{Dice, Number, Point, SceneText};

/// Candles behind paper, in kelvin.
pub const CANDLES: [f32; 5] = [1900.0, 2050.0, 2200.0, 2350.0, 2600.0];

/// The colour of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glow {
    /// A black body in kelvin.
    Kelvin(f32),
    /// A colour.
    Paper([f32; 3]),
}

/// Coloured paper; most lanterns have none.
pub const PAPERS: [Glow; 4] = [
    Glow::Paper([1.0, 0.13, 0.04]),
    Glow::Paper([1.0, 0.3, 0.05]),
    Glow::Paper([0.2, 0.75, 0.55]),
    Glow::Paper([0.85, 0.25, 0.5]),
];

/// As the values of a spectrum parameter called `name`.
struct Spectrum<'a>(Glow, &'a str);

impl fmt::Display for Spectrum<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.1;
        match self.0 {
            Glow::Kelvin(kelvin) => write!(f, "\"blackbody {name}\" [{kelvin}]"),
            Glow::Paper([r, g, b]) => write!(f, "\"rgb {name}\" [{r} {g} {b}]"),
        }
    }
}

impl Glow {
    /// A candle, or with the chance `coloured` one behind coloured paper.
    pub fn throw(dice: &mut Dice, coloured: f32) -> Self {
        if dice.between(0.0, 1.0) < coloured { dice.pick(&PAPERS) } else { Self::Kelvin(dice.pick(&CANDLES)) }
    }

    /// The shapes that follow emit, with a radiance of luminance `scale` (of colours: `scale` times the colour).
    pub fn area_light(self, t: &mut SceneText, scale: f32) {
        t.add(format_args!("AreaLightSource \"diffuse\" {} \"float scale\" {}", Spectrum(self, "L"), Number(scale)));
    }

    /// A glowing sphere.
    pub fn bulb(self, t: &mut SceneText, p: Vec3, radius: f32, scale: f32) {
        self.bulbs(t, &[p], radius, scale);
    }

    /// Glowing spheres, each a light.
    pub fn bulbs(self, t: &mut SceneText, places: &[Vec3], radius: f32, scale: f32) {
        if places.is_empty() {
            return;
        }
        t.block(|t| {
            self.area_light(t, scale);
            let radius = Number(radius);
            for p in places {
                let p = Point(*p);
                t.add(format_args!(
                    "AttributeBegin Translate {p} Shape \"sphere\" \"float radius\" {radius} AttributeEnd"
                ));
            }
        });
    }

    /// A glowing parallelogram; it shines to the side that `a` × `b` points to.
    pub fn panel(self, t: &mut SceneText, corner: Vec3, a: Vec3, b: Vec3, scale: f32) {
        t.block(|t| {
            self.area_light(t, scale);
            let [p, q, r, s] = [corner, corner + a, corner + a + b, corner + b].map(Point);
            t.add(format_args!(
                "Shape \"trianglemesh\" \"point3 P\" [{p}  {q}  {r}  {s}] \"integer indices\" [0 1 2 0 2 3]"
            ));
        });
    }

    /// Points of light, each a light, of radiant intensity `scale`.
    pub fn points(self, t: &mut SceneText, places: &[Vec3], scale: f32) {
        if places.is_empty() {
            return;
        }
        t.add(format_args!("LightSource \"point\" {} \"float scale\" {}", Spectrum(self, "I"), Number(scale)));
        t.add(format_args!("  \"point3 P\" ["));
        for row in places.chunks(8) {
            let row: Vec<String> = row.iter().map(|p| Point(*p).to_string()).collect();
            t.add(format_args!("  {}", row.join("  ")));
        }
        t.add(format_args!("  ]"));
    }
}
