//! For tests: Pearson's χ² test of a sampling routine on the sphere against its density, and quadrature over the sphere.
//!
//! The false-alarm rate of all such tests together is [`FAMILY_RATE`], shared out by Šidák's correction over at most
//! [`FAMILY`] of them; seeds are fixed, so a test that passes once passes always.

use std::f64::consts::TAU;

use glam::Vec3;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// The chance that any correct routine fails.
pub const FAMILY_RATE: f64 = 1e-4;
/// At least the number of statistical tests in the library.
pub const FAMILY: f64 = 2000.0;

/// The chance that one correct routine fails.
pub fn threshold() -> f64 {
    -(f64::ln_1p(-FAMILY_RATE) / FAMILY).exp_m1()
}

/// Asserts that counts follow expectations: χ² over the cells, those of expectation below 5 pooled.
pub fn assert_counts(name: &str, counts: &[f64], expected: &[f64]) {
    let (mut statistic, mut cells) = (0.0, 0usize);
    let (mut pooled, mut pooled_expected) = (0.0, 0.0);
    for (&count, &expected) in counts.iter().zip(expected) {
        assert!(expected > 1e-4 || count <= 2.0, "{name}: {count} samples where {expected} are expected");
        if expected < 5.0 {
            pooled += count;
            pooled_expected += expected;
        } else {
            statistic += (count - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pooled_expected > 5.0 {
        statistic += (pooled - pooled_expected).powi(2) / pooled_expected;
        cells += 1;
    }
    assert!(cells > 1, "{name}: nothing to compare");
    let p = ChiSquared::new((cells - 1) as f64).unwrap().sf(statistic);
    assert!(p > threshold(), "{name}: χ² = {statistic:.1} over {cells} cells, p = {p:.2e}");
}

/// Asserts that the mean of n values with this mean and sample variance is `expected`, two-sided.
pub fn assert_mean(name: &str, mean: f64, variance: f64, n: f64, expected: f64) {
    let error = (variance / n).sqrt().max(1e-6);
    let p = 2.0 * Normal::standard().sf(((mean - expected) / error).abs());
    assert!(p > threshold(), "{name}: {mean} ± {error}, expected {expected}, p = {p:.2e}");
}

/// Mean and variance as values come in.
#[derive(Default)]
pub struct Moments {
    /// How many.
    pub n: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    /// One more.
    pub fn add(&mut self, value: f64) {
        self.n += 1.0;
        self.sum += value;
        self.squares += value * value;
    }
    /// Their mean.
    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }
    /// Their variance.
    pub fn variance(&self) -> f64 {
        (self.squares / self.n - self.mean().powi(2)).max(0.0)
    }
    /// See [`assert_mean`].
    pub fn assert_mean(&self, name: &str, expected: f64) {
        assert_mean(name, self.mean(), self.variance(), self.n, expected);
    }
}

const ROWS: usize = 24;
const COLUMNS: usize = 32;

/// Tests `n` directions (or `None`, where the routine gives up) against their solid-angle pdf.
pub fn assert_sphere(name: &str, n: usize, mut sample: impl FnMut() -> Option<Vec3>, pdf: impl Fn(Vec3) -> f64) {
    let mut counts = vec![0.0; ROWS * COLUMNS + 1];
    for _ in 0..n {
        let cell = sample().map_or(ROWS * COLUMNS, |w| {
            assert!((w.length() - 1.0).abs() < 1e-3, "{name}: {w} is not a unit vector");
            let row = ((f64::from(w.z) + 1.0) * 0.5 * ROWS as f64) as usize;
            let column = (f64::from(w.y).atan2(f64::from(w.x)).rem_euclid(TAU) / TAU * COLUMNS as f64) as usize;
            row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
        });
        counts[cell] += 1.0;
    }
    let mut expected = cells(&pdf);
    let total: f64 = expected.iter().sum();
    assert!(total < 1.0 + 2e-3, "{name}: the pdf integrates to {total}");
    expected.push((1.0 - total).max(0.0));
    for cell in &mut expected {
        *cell *= n as f64;
    }
    // Where the pdf integrates to 1, quadrature alone leaves a few samples' worth in the last cell.
    if expected[ROWS * COLUMNS] < 1e-3 * n as f64 && counts[ROWS * COLUMNS] < 1e-3 * n as f64 {
        expected.pop();
        counts.pop();
    }
    assert_counts(name, &counts, &expected);
}

/// ∫ f dω over the sphere.
pub fn integrate_sphere(f: impl Fn(Vec3) -> f64) -> f64 {
    cells(&f).iter().sum()
}

fn cells(f: &impl Fn(Vec3) -> f64) -> Vec<f64> {
    let at = |z: f64, phi: f64| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        f(Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32).normalize())
    };
    let mut cells = Vec::with_capacity(ROWS * COLUMNS);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let z = [row, row + 1].map(|i| 2.0 * i as f64 / ROWS as f64 - 1.0);
            let phi = [column, column + 1].map(|i| TAU * i as f64 / COLUMNS as f64);
            let whole = gauss(&at, z, phi);
            cells.push(refine(&at, z, phi, whole, 7));
        }
    }
    cells
}

/// Adaptive quadrature: halves until the halves agree with the whole.
fn refine(f: &impl Fn(f64, f64) -> f64, z: [f64; 2], phi: [f64; 2], whole: f64, depth: u32) -> f64 {
    let (zm, pm) = (0.5 * (z[0] + z[1]), 0.5 * (phi[0] + phi[1]));
    let parts = [
        ([z[0], zm], [phi[0], pm]),
        ([zm, z[1]], [phi[0], pm]),
        ([z[0], zm], [pm, phi[1]]),
        ([zm, z[1]], [pm, phi[1]]),
    ];
    let values = parts.map(|(z, phi)| gauss(f, z, phi));
    let sum: f64 = values.iter().sum();
    if depth == 0 || (sum - whole).abs() < 1e-6 + 1e-4 * sum.abs() * f64::from(depth < 6) {
        return sum;
    }
    parts.iter().zip(values).map(|(&(z, phi), value)| refine(f, z, phi, value, depth - 1)).sum()
}

/// Gauss-Legendre, 4 × 4 points.
fn gauss(f: &impl Fn(f64, f64) -> f64, z: [f64; 2], phi: [f64; 2]) -> f64 {
    const POINTS: [(f64, f64); 4] = [
        (-0.861_136_311_594_053, 0.347_854_845_137_454),
        (-0.339_981_043_584_856, 0.652_145_154_862_546),
        (0.339_981_043_584_856, 0.652_145_154_862_546),
        (0.861_136_311_594_053, 0.347_854_845_137_454),
    ];
    let half = [0.5 * (z[1] - z[0]), 0.5 * (phi[1] - phi[0])];
    let mut sum = 0.0;
    for (x, wx) in POINTS {
        for (y, wy) in POINTS {
            sum += wx * wy * f(z[0] + half[0] * (1.0 + x), phi[0] + half[1] * (1.0 + y));
        }
    }
    sum * half[0] * half[1]
}

#[test]
fn a_wrong_density_is_noticed() {
    let mut rng = crate::math::sampler::Stream::from_seed(1);
    let mut sample = || Some(crate::math::warp::uniform_sphere([rng.next_f32(), rng.next_f32()]));
    let wrong = |w: Vec3| f64::from(1.0 + 0.1 * w.z) / (2.0 * TAU);
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        assert_sphere("wrong", 100_000, &mut sample, wrong);
    }));
    assert!(result.is_err());
}
