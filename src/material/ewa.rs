//! The elliptically weighted average: what a pixel covers of an image, seen at any angle. Sources: Heckbert 1989, "Fundamentals of Texture Mapping and Image Warping", section 3.5;
//! pbrt-v4, section 10.4.4, for the choice of level and the limit of anisotropy.

use glam::Vec2;

use super::image_texture::{ImageMap, lerp, level_of, texels};
use super::mip_map::View;
use super::texture_mapping::TextureCoordinates;

/// The Gaussian falls off as exp(−this · r²), and is lowered so as to end at r = 1.
const FALLOFF: f32 = 2.0;

impl ImageMap {
    /// The mean over an ellipse whose half axes are `at.change`, but which is at most so many times as long as wide.
    pub(super) fn ewa(&self, view: &View, at: &TextureCoordinates, most_anisotropy: f32) -> [f32; 4] {
        let shape = &view.levels()[0];
        let size = Vec2::new(shape.width as f32, shape.height as f32);
        let mut axes = at.change.map(|change| change * size);
        if axes[0].length_squared() < axes[1].length_squared() {
            axes.swap(0, 1);
        }
        let longer = axes[0].length();
        let mut shorter = axes[1].length();
        if !(longer.is_finite() && shorter > 0.0) {
            return self.bilinear(view, 0, at.st);
        }
        // Rather blurred than slow: a longer ellipse is made wider.
        if shorter * most_anisotropy < longer {
            let scale = longer / (shorter * most_anisotropy);
            axes[1] *= scale;
            shorter *= scale;
        }
        let level = level_of(view, shorter);
        let whole = level as usize;
        let [fine, coarse] = [whole, whole + 1].map(|level| axes.map(|axis| axis * scale_of(view, level)));
        let t = level - whole as f32;
        let average = self.ellipse(view, whole, at.st, fine);
        if t == 0.0 { average } else { lerp(average, self.ellipse(view, whole + 1, at.st, coarse), t) }
    }

    /// The mean over an ellipse around `st` with half axes given in texels of the level.
    fn ellipse(&self, view: &View, level: usize, st: Vec2, [a, b]: [Vec2; 2]) -> [f32; 4] {
        let last = view.levels().len() - 1;
        if level >= last {
            return self.texel(view, last, 0, 0);
        }
        let centre = texels(view, level, st);
        // t goes up and rows go down.
        let [a, b] = [a, b].map(|axis| Vec2::new(axis.x, -axis.y));
        // A x² + B x y + C y² = 1 on the ellipse, widened by one texel (Heckbert, section 3.5.8).
        let (qa, qb, qc) = (a.y * a.y + b.y * b.y + 1.0, -2.0 * (a.x * a.y + b.x * b.y), a.x * a.x + b.x * b.x + 1.0);
        let scale = 1.0 / (qa * qc - 0.25 * qb * qb);
        let (qa, qb, qc) = (qa * scale, qb * scale, qc * scale);
        let spread = 4.0 * qa * qc - qb * qb;
        let (half_x, half_y) = (2.0 * (qc / spread).sqrt(), 2.0 * (qa / spread).sqrt());
        let range = |middle: f32, half: f32| (middle - half).ceil() as i64..=(middle + half).floor() as i64;
        let end = (-FALLOFF).exp();
        let (mut sum, mut weights) = ([0.0; 4], 0.0);
        for y in range(centre.y, half_y) {
            let dy = y as f32 - centre.y;
            for x in range(centre.x, half_x) {
                let dx = x as f32 - centre.x;
                let r2 = qa * dx * dx + qb * dx * dy + qc * dy * dy;
                if r2 < 1.0 {
                    let weight = (-FALLOFF * r2).exp() - end;
                    for (sum, value) in sum.iter_mut().zip(self.texel(view, level, x, y)) {
                        *sum += weight * value;
                    }
                    weights += weight;
                }
            }
        }
        if weights > 0.0 { sum.map(|value| value / weights) } else { self.bilinear(view, level, st) }
    }
}

/// How long in texels of a level is what is one texel of the image long.
fn scale_of(view: &View, level: usize) -> Vec2 {
    let (image, level) = (&view.levels()[0], &view.levels()[level.min(view.levels().len() - 1)]);
    Vec2::new(level.width as f32 / image.width as f32, level.height as f32 / image.height as f32)
}
