//! How far an image is from the truth.
//!
//! The truth is known from two independent halves b₁ and b₂ of a reference. For an unbiased image a, (a − b₁)(a − b₂) is on average
//! (a − truth)²: unlike (a − b)² it does not count the reference's own noise. That goes into the RMSE, whole
//! and trimmed; the relative error compares with the mean of the halves as it is. How light is selected has no part in how lamps in plain sight
//! are antialiased, so errors are those of the light that was gathered: the beauty without the layer `emission`.

use std::path::Path;

use lanternfish::bench::trim::Squares;
use lanternfish::film::exr::read_exr_layers;
use serde::Serialize;

use super::run::fail;

/// In the relative error: this share of the mean's square is added to a pixel's.
const EPSILON: f64 = 1e-3;

/// An image: values of all pixels and channels, pixel by pixel.
pub struct Picture {
    beauty: Vec<f64>,
    gathered: Vec<f64>,
}

impl Picture {
    pub fn read(path: &Path) -> Self {
        let image = read_exr_layers(path).unwrap_or_else(|error| fail(&error.to_string()));
        let (beauty, emission) = (image.rgb("").expect("beauty"), image.rgb("emission").expect("emission"));
        let values = |of: &dyn Fn(usize, usize) -> f32| -> Vec<f64> {
            (0..image.bounds.area()).flat_map(|i| [0, 1, 2].map(|c| f64::from(of(c, i)))).collect()
        };
        Self { beauty: values(&|c, i| beauty[c][i]), gathered: values(&|c, i| beauty[c][i] - emission[c][i]) }
    }

    /// Mean of the light that was gathered.
    pub fn mean(&self) -> f64 {
        mean(&self.gathered)
    }
}

/// The errors of one image.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// √ of the mean square over pixels and channels; NaN where the reference is too noisy to tell.
    pub rmse: f64,
    /// The same of the whole beauty, with lamps in plain sight.
    pub rmse_of_beauty: f64,
    /// `rmse` without a few pixels, the same for all images of a scene (`trim`).
    pub rmse_trimmed: f64,
    /// Mean of (a − b)² / (b² + ε), with ε = 0.001 (mean of b)².
    pub relative_mse: f64,
}

impl Errors {
    /// Of `image`, by both halves of a reference; and its pixels' part in the RMSE. Nothing is trimmed yet.
    pub fn of(image: &Picture, [first, second]: [&Picture; 2]) -> (Self, Squares) {
        let squares = |part: fn(&Picture) -> &[f64]| -> Vec<f64> {
            let halves = part(first).iter().zip(part(second));
            part(image).iter().zip(halves).map(|(a, (b, c))| (a - b) * (a - c)).collect()
        };
        // Of a reference that is too noisy, nothing is known.
        let root = |values: &[f64]| mean(values).sqrt();
        let truth: Vec<f64> = first.gathered.iter().zip(&second.gathered).map(|(b, c)| 0.5 * (b + c)).collect();
        let epsilon = EPSILON * mean(&truth).powi(2);
        let relative = |(a, b): (&f64, &f64)| (a - b).powi(2) / (b * b + epsilon);
        let relative: Vec<f64> = image.gathered.iter().zip(&truth).map(relative).collect();
        let gathered = squares(|picture| &picture.gathered);
        let errors = Self {
            rmse: root(&gathered),
            rmse_of_beauty: root(&squares(|picture| &picture.beauty)),
            rmse_trimmed: root(&gathered),
            relative_mse: mean(&relative),
        };
        (errors, gathered.chunks(3).map(mean).collect())
    }

    /// What a reference's own RMSE is: half of what its halves differ by.
    pub fn own([first, second]: [&Picture; 2]) -> f64 {
        let squares: Vec<f64> = first.gathered.iter().zip(&second.gathered).map(|(b, c)| (b - c).powi(2)).collect();
        0.5 * mean(&squares).sqrt()
    }

    /// What `factor` times as many samples would leave.
    pub fn scaled(self, factor: f64) -> Self {
        let root = factor.sqrt();
        Self {
            rmse: self.rmse / root,
            rmse_of_beauty: self.rmse_of_beauty / root,
            rmse_trimmed: self.rmse_trimmed / root,
            relative_mse: self.relative_mse / factor,
        }
    }
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
