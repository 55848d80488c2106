//! The shape of an open fire: tongues of flame (kelvin and soot), smoke above.

use fastnoise_lite::FastNoiseLite;
use glam::{FloatExt, Vec3};

use super::volume::{at, noise, smoothstep};

/// What the fire is at a point, in metres from the middle of its brazier's rim.
pub struct Fire {
    sway: FastNoiseLite,
    tongues: FastNoiseLite,
    smoke: FastNoiseLite,
}

impl Fire {
    /// The names of its grids, in the order of [`Fire::at`].
    pub const GRIDS: [&str; 2] = ["density", "temperature"];
    /// The highest temperature of [`Fire::fanned`], about.
    pub const HOTTEST: f32 = 2250.0;
    /// How high the flames are above their foot, which is 0.3 below the rim.
    const HEIGHT: f32 = 2.5;

    /// Another seed, another shape.
    pub fn new(seed: i32) -> Self {
        Self { sway: noise(seed, 0.9, 2), tongues: noise(seed + 1, 1.9, 4), smoke: noise(seed + 2, 0.9, 4) }
    }

    /// Density and temperature.
    pub fn at(&self, p: Vec3) -> [f32; 2] {
        [self.density(p), self.temperature(p)]
    }

    /// The same of a fire with more draught, which burns hotter.
    pub fn fanned(&self, p: Vec3) -> [f32; 2] {
        [self.density(p), 1.2 * self.temperature(p)]
    }

    /// How deep inside the flames: above 0 within.
    fn depth(&self, p: Vec3) -> f32 {
        let h = (p.y + 0.3) / Self::HEIGHT;
        if !(0.0..=1.15).contains(&h) {
            return -1.0;
        }
        // Rising gas sways more the higher it is, and is drawn out along its way.
        let slow = p * Vec3::new(1.0, 0.55, 1.0);
        let sway = Vec3::new(at(&self.sway, slow), 0.0, at(&self.sway, slow + 17.0)) * 0.55 * h;
        let q = p + sway - Vec3::new(0.12 * h * h, 0.0, 0.0);
        let radius = 0.56 * (1.0 - h).max(0.0).powf(0.75) * (0.8 + 0.9 * h.min(0.35));
        let radial = (q.x * q.x + q.z * q.z).sqrt();
        let tongues = at(&self.tongues, q * Vec3::new(1.0, 0.42, 1.0));
        (radius - radial) / 0.35 + (0.25 + 1.3 * h) * tongues
    }

    /// Kelvin; 0 where nothing glows.
    fn temperature(&self, p: Vec3) -> f32 {
        let depth = self.depth(p);
        if depth <= 0.0 {
            return 0.0;
        }
        let h = ((p.y + 0.3) / Self::HEIGHT).clamp(0.0, 1.0);
        let core = smoothstep(0.0, 1.1, depth);
        1250.0 + 620.0 * core * 1.0f32.lerp(0.55, h) + 60.0 * at(&self.tongues, 2.0 * p)
    }

    /// Soot in the flames, smoke above them.
    fn density(&self, p: Vec3) -> f32 {
        let depth = self.depth(p);
        let soot =
            if depth > 0.0 { smoothstep(0.0, 0.35, depth) * (0.75 + 0.5 * at(&self.tongues, 1.7 * p)) } else { 0.0 };
        let above = p.y - 1.3;
        let smoke = if above > 0.0 {
            let drift = Vec3::new(0.06 * above * above, 0.0, 0.0);
            let q = p - drift + 0.25 * above.sqrt() * Vec3::new(at(&self.smoke, p), 0.0, at(&self.smoke, p + 9.0));
            let radius = 0.28 + 0.16 * above;
            let radial = (q.x * q.x + q.z * q.z).sqrt();
            let billows = at(&self.smoke, q * 1.6);
            let fade = smoothstep(0.0, 0.8, above) * smoothstep(4.6, 2.0, above);
            0.55 * fade * smoothstep(0.0, 0.6, (radius - radial) / 0.4 + 0.9 * billows)
        } else {
            0.0
        };
        soot.max(smoke)
    }
}
