//! What pixels need besides where a filter has negative lobes, and samples count ±c.
//!
//! The mean of w L over a pixel's samples is unbiased, but w is 1 only in the mean: a constant image would be noisy. Any L₀ that has nothing to do with the
//! pixel's own samples may be taken off first: w (L − L₀) + L₀ has the same mean, since that of w is 1 (a control variate; Glasserman, "Monte Carlo
//! Methods in Financial Engineering", section 4.1, with its coefficient held at 1). L₀ is what the pixels around have gathered, without signs, so that a constant image
//! is exact.

use glam::DVec3;

use super::accumulate::{AovSums, Moments, SampleResult};

/// Sums over a pixel's samples, exposed, without signs.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SignedSums {
    count: u64,
    /// Of the samples' weights.
    weights: f64,
    /// Of their squares.
    squares: f64,
    beauty: DVec3,
    layers: [DVec3; 4],
}

impl SignedSums {
    /// Adds a sample that counts `weight`, as it is without.
    pub fn add(&mut self, plain: &SampleResult, weight: f32) {
        self.count += 1;
        self.weights += f64::from(weight);
        self.squares += f64::from(weight) * f64::from(weight);
        self.beauty += plain.beauty.0.as_dvec3();
        let layers = [plain.direct, plain.indirect, plain.emission, plain.volume];
        for (sum, layer) in self.layers.iter_mut().zip(layers) {
            *sum += layer.0.as_dvec3();
        }
    }

    /// Joins the samples of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.weights += other.weights;
        self.squares += other.squares;
        self.beauty += other.beauty;
        for (sum, layer) in self.layers.iter_mut().zip(other.layers) {
            *sum += layer;
        }
    }

    /// What `moments` and `aovs` of this pixel become with the means of `around` it for L₀.
    pub fn correct(&self, around: &Self, moments: &mut Moments, aovs: Option<&mut AovSums>) {
        if self.count == 0 || around.count == 0 {
            return;
        }
        let n = self.count as f64;
        let mean = |sum: DVec3| sum / around.count as f64;
        let missing = n - self.weights;
        let level = mean(around.beauty);
        let before = moments.mean;
        moments.mean += level * (missing / n);
        // Σ (w (L − L₀))² less n times the square of its mean.
        let raw = moments.squares + before * before * n;
        // All weights have the same square.
        let about = raw - level * self.beauty * (2.0 * self.squares / n) + level * level * self.squares;
        let shift = before - level * (self.weights / n);
        moments.squares = (about - shift * shift * n).max(DVec3::ZERO);
        if let Some(aovs) = aovs {
            let sums = [&mut aovs.direct, &mut aovs.indirect, &mut aovs.emission, &mut aovs.volume];
            for (sum, layer) in sums.into_iter().zip(around.layers) {
                *sum += mean(layer) * missing;
            }
        }
    }
}
