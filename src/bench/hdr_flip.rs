//! HDR-FLIP: Andersson et al., "Visualizing Errors in Rendered High Dynamic Range Images" (Eurographics 2021).
//!
//! Both images are mapped to pictures at several exposures, from the one that shows the reference's brightest pixel just below white to the one
//! that does so with its median, and each pixel's error is the largest of its FLIP errors. FLIP itself is NVIDIA's, by the crate `nv-flip`. It takes 8 bits a channel, which
//! the original does not round to: that moves errors by less than a hundredth.

use crate::film::image::{linear_to_srgb, to_byte};
use crate::report::compare::Side;

/// What "just below white" is.
const WHITE: f64 = 0.85;
/// No more exposures than this, however wide the range between the median and the brightest pixel.
const MOST: usize = 20;
/// The tone curve (Narkowicz 2016, "ACES filmic tone mapping curve", without its exposure of 0.6): numerator and denominator from x² to x⁰.
const ABOVE: [f64; 3] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0];
const BELOW: [f64; 3] = [0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

/// Judges images by one reference.
pub struct HdrFlip {
    exposures: Vec<f32>,
    size: [u32; 2],
    /// The reference's picture at each exposure.
    shown: Vec<Vec<u8>>,
}

impl HdrFlip {
    /// By this reference.
    pub fn new(reference: &Side) -> Self {
        let exposures = exposures(reference);
        let shown = exposures.iter().map(|&exposure| picture(reference, exposure)).collect();
        Self { exposures, size: [reference.bounds.width(), reference.bounds.height()], shown }
    }

    /// The error of each pixel, 0 (alike) to 1. `image` must be as large as the reference.
    pub fn errors(&self, image: &Side) -> Vec<f32> {
        let [width, height] = self.size;
        let mut worst = vec![0.0f32; width as usize * height as usize];
        for (&exposure, reference) in self.exposures.iter().zip(&self.shown) {
            let rgb = |bytes: &[u8]| nv_flip::FlipImageRgb8::with_data(width, height, bytes);
            let map = nv_flip::flip(rgb(reference), rgb(&picture(image, exposure)), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
            worst.iter_mut().zip(map.to_vec()).for_each(|(worst, error)| *worst = worst.max(error));
        }
        worst
    }
}

/// The powers of two by which images are scaled.
fn exposures(reference: &Side) -> Vec<f32> {
    let mut luminances: Vec<f32> = (0..reference.bounds.area()).map(|i| reference.luminance(i)).collect();
    let middle = luminances.len() / 2;
    luminances.sort_by(f32::total_cmp);
    let (median, most) = (f64::from(luminances[middle]), f64::from(luminances[luminances.len() - 1]));
    if most <= 0.0 {
        return vec![0.0];
    }
    // Where the curve reaches WHITE: a x² + b x + c = 0.
    let [a, b, c] = [0, 1, 2].map(|i| ABOVE[i] - WHITE * BELOW[i]);
    let root = (b * b - 4.0 * a * c).sqrt();
    let white = ((-b - root) / (2.0 * a)).max((-b + root) / (2.0 * a));
    let start = (white / most).log2();
    let stop = (white / median.max(most * 1e-30)).log2();
    let count = ((stop - start).ceil() as usize).clamp(2, MOST);
    let step = (stop - start) / (count - 1) as f64;
    // With too wide a range, the darkest part is left out.
    let step = step.min(1.5);
    (0..count).map(|i| (start + step * i as f64) as f32).collect()
}

/// The image as it is shown, 8 bits a channel.
fn picture(image: &Side, exposure: f32) -> Vec<u8> {
    let scale = exposure.exp2();
    let shown = |value: f32| {
        let x = f64::from((value * scale).clamp(0.0, 1e15));
        let polynomial = |p: [f64; 3]| (p[0] * x + p[1]) * x + p[2];
        to_byte(linear_to_srgb((polynomial(ABOVE) / polynomial(BELOW)) as f32))
    };
    (0..image.bounds.area()).flat_map(|i| [0, 1, 2].map(|c| shown(image.colour[c][i]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelBounds;

    fn image(value: impl Fn(usize) -> f32) -> Side {
        let bounds = PixelBounds::full(16, 16);
        let plane: Vec<f32> = (0..bounds.area()).map(value).collect();
        Side { bounds, display: bounds, colour: [plane.clone(), plane.clone(), plane], variance: None, emission: None }
    }

    #[test]
    fn alike_is_0_and_an_error_shows_at_the_exposure_that_shows_it() {
        // Not quite half of it is a thousand times brighter than the rest.
        let reference = image(|i| if i % 16 < 9 { 0.01 } else { 10.0 });
        let flip = HdrFlip::new(&reference);
        assert!(flip.exposures.len() >= 9 && flip.exposures.len() <= MOST, "{:?}", flip.exposures);
        let mean = |image: &Side| flip.errors(image).iter().sum::<f32>() / 256.0;
        assert_eq!(mean(&reference), 0.0);
        // Each half wrong in turn, which a single exposure would hide in one of them.
        let dark = image(|i| if i % 16 < 9 { 0.03 } else { 10.0 });
        let bright = image(|i| if i % 16 < 9 { 0.01 } else { 30.0 });
        assert!(mean(&dark) > 0.05 && mean(&bright) > 0.02, "{} {}", mean(&dark), mean(&bright));
    }

    #[test]
    fn black_and_huge_images_do_no_harm() {
        for value in [0.0, 1e30] {
            let same = image(|_| value);
            assert!(HdrFlip::new(&same).errors(&same).iter().all(|&error| error == 0.0));
        }
        let lamp = image(|i| if i == 0 { 1e9 } else { 0.0 });
        assert!(HdrFlip::new(&lamp).errors(&image(|_| 1.0)).iter().all(|error| error.is_finite()));
    }
}
