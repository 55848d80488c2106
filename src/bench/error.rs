//! How far an image is from the truth.
//!
//! The truth is known from a reference b whose own mean square error is known too: from two independent halves b₁ and b₂ that it is the mean of, or
//! from the variances that its file has. Of an unbiased image a that is independent of both, (a − b)² is on average (a − truth)² + (b − truth)²; so
//! the latter is taken off, pixel by pixel. With halves that is the same as (a − b₁)(a − b₂). The mean is right then, single pixels may come out
//! negative, and so may the mean where the reference is too noisy: nothing is known then. FLIP is no square; of it nothing is taken off.

use serde::Serialize;

use super::hdr_flip::HdrFlip;
use super::reference::{Reference, gathered};
use super::trim::Squares;
use crate::report::compare::Side;

/// In the relative error: this share of the mean's square is added to a pixel's.
const EPSILON: f64 = 0.01;

/// The errors of one image.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Mean square error over pixels and channels, less that of the reference.
    pub mse: f64,
    /// Its root; NaN where the reference is too noisy to tell.
    pub rmse: f64,
    /// The RMSE of what was gathered: without what is seen of lights and fires themselves, whose edges are a matter of antialiasing and the same whatever
    /// chooses lights. Less that of the reference, if it was made here; NaN where images do not tell, or the reference is too noisy.
    pub gathered_rmse: f64,
    /// Mean of (a − b)² / (b² + ε), with ε = 0.01 (mean of b)², less that of the reference; NaN where that leaves nothing.
    pub relative_mse: f64,
    /// Mean HDR-FLIP error.
    pub flip: f64,
    /// Mean of the image less that of the reference.
    pub difference: f64,
    /// The same of gathered light; NaN where images do not tell.
    pub gathered_difference: f64,
}

impl Errors {
    /// Of `image`, and its pixels' part in the mean square error.
    pub fn of(image: &Side, reference: &Reference, flip: &HdrFlip) -> (Self, Squares) {
        let truth = &reference.image;
        let count = truth.bounds.area();
        let epsilon = EPSILON * reference.about.mean.powi(2);
        let mut squares = vec![0.0; count];
        let (mut relative, mut difference) = (0.0, 0.0);
        for c in 0..3 {
            for i in 0..count {
                let (a, b) = (f64::from(image.colour[c][i]), f64::from(truth.colour[c][i]));
                let own = reference.own.as_ref().map_or(0.0, |own| f64::from(own[c][i]));
                let square = (a - b).powi(2) - own;
                squares[i] += square / 3.0;
                relative += ratio(square, b * b + epsilon);
                difference += a - b;
            }
        }
        let mse = squares.iter().sum::<f64>() / count as f64;
        let values = 3.0 * count as f64;
        let relative_mse = Some(relative / values).filter(|mean| *mean >= 0.0).unwrap_or(f64::NAN);
        let errors = flip.errors(image);
        let flip = errors.iter().map(|&error| f64::from(error)).sum::<f64>() / count as f64;
        let [gathered_mse, gathered_difference] = of_gathered(image, reference);
        let errors = Self {
            mse,
            rmse: mse.sqrt(),
            gathered_rmse: gathered_mse.sqrt(),
            relative_mse,
            flip,
            difference: difference / values,
            gathered_difference,
        };
        (errors, squares)
    }
}

/// Mean square error of what was gathered, and its mean less that of the reference; NaN where images do not tell.
fn of_gathered(image: &Side, reference: &Reference) -> [f64; 2] {
    let Some((a, b)) = gathered(image).zip(gathered(&reference.image)) else { return [f64::NAN; 2] };
    let own = |c: usize, i: usize| reference.own_gathered.as_ref().map_or(0.0, |own| f64::from(own[c][i]));
    let (mut square, mut difference) = (0.0, 0.0);
    for c in 0..3 {
        for (i, (a, b)) in a[c].iter().zip(&b[c]).enumerate() {
            let off = f64::from(*a) - f64::from(*b);
            square += off * off - own(c, i);
            difference += off;
        }
    }
    [square, difference].map(|sum| sum / (3 * a[0].len()) as f64)
}

fn ratio(square: f64, of: f64) -> f64 {
    if square == 0.0 { 0.0 } else { square / of }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelBounds;
    use crate::math::sampler::Stream;

    fn noisy(stream: &mut Stream, sigma: f32) -> Side {
        let bounds = PixelBounds::full(64, 64);
        // Uniform noise around 1.
        let mut value = || 1.0 + sigma * 12.0f32.sqrt() * (stream.next_f32() - 0.5);
        let colour = std::array::from_fn(|_| (0..bounds.area()).map(|_| value()).collect());
        let emission = Some(std::array::from_fn(|_| vec![0.25; bounds.area()]));
        Side { bounds, display: bounds, colour, variance: None, emission }
    }

    /// The truth is 1 everywhere, the reference noisier than the image. A product (a − b₁)(a − b₂) has a standard deviation of 0.0128, their
    /// mean over 12288 values one of 1.2e-4: the tolerance of 5e-4 would be exceeded by chance twice in 100,000 runs.
    #[test]
    fn the_references_own_error_is_taken_off() {
        let mut stream = Stream::from_seed(3);
        let halves = [noisy(&mut stream, 0.1), noisy(&mut stream, 0.1)];
        let reference = Reference::of_halves(&halves);
        assert!((reference.about.own_rmse.expect("halves tell") - 0.1 / 2f64.sqrt()).abs() < 2e-3);
        let image = noisy(&mut stream, 0.05);
        let (errors, squares) = Errors::of(&image, &reference, &HdrFlip::new(&reference.image));
        assert!((errors.mse / 0.0025 - 1.0).abs() < 0.2, "{errors:?}");
        assert!((errors.gathered_rmse / errors.rmse - 1.0).abs() < 1e-4, "{errors:?}");
        assert!((errors.relative_mse / (0.0025 / 1.01) - 1.0).abs() < 0.25, "{errors:?}");
        assert!((errors.gathered_difference - errors.difference).abs() < 1e-6, "{errors:?}");
        assert!(errors.difference.abs() < 0.01 && errors.flip > 0.0);
        assert_eq!(squares.len(), 64 * 64);
    }
}
