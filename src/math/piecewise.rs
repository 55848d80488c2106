//! A density over distance that is linear from knot to knot: drawing from it, and its value, up to any end.

/// Knots with values, and the integral up to each.
#[derive(Clone, Debug, Default)]
pub struct PiecewiseLinear {
    knots: Vec<Knot>,
}

#[derive(Clone, Copy, Debug)]
struct Knot {
    t: f64,
    value: f64,
    /// ∫ up to here.
    sum: f64,
}

impl PiecewiseLinear {
    /// Forgets all knots; their memory is kept.
    pub fn clear(&mut self) {
        self.knots.clear();
    }

    /// Adds a knot at `t`, which must not be below that of the last one (at the same t the value jumps). `value` is finite and at least 0.
    #[inline]
    pub fn push(&mut self, t: f32, value: f32) {
        let (t, value) = (f64::from(t), f64::from(value));
        let sum = self.knots.last().map_or(0.0, |k| k.sum + 0.5 * (k.value + value) * (t - k.t));
        self.knots.push(Knot { t, value, sum });
    }

    /// Where the last knot is.
    #[inline]
    pub fn end(&self) -> f32 {
        self.knots.last().map_or(0.0, |k| k.t as f32)
    }

    /// The number of knots.
    pub const fn len(&self) -> usize {
        self.knots.len()
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.knots.is_empty()
    }

    /// The value at `t` and the integral up to there.
    #[inline]
    fn at(&self, t: f64) -> (f64, f64) {
        let next = self.knots.partition_point(|k| k.t <= t);
        let Some(a) = next.checked_sub(1).map(|i| self.knots[i]) else { return (0.0, 0.0) };
        let Some(b) = self.knots.get(next) else { return (0.0, a.sum) };
        let value = a.value + (b.value - a.value) * (t - a.t) / (b.t - a.t);
        (value, a.sum + 0.5 * (a.value + value) * (t - a.t))
    }

    /// The pdf of `t` where the density is cut off at `end`; 0 beyond it and where there is no density at all.
    #[inline]
    pub fn pdf(&self, t: f32, end: f32) -> f32 {
        let (_, total) = self.at(f64::from(end));
        if t <= end && total > 0.0 { (self.at(f64::from(t)).0 / total) as f32 } else { 0.0 }
    }

    /// A distance up to `end`, drawn by `u` in [0, 1), and its pdf. `None` where there is no density.
    #[inline]
    pub fn sample(&self, u: f64, end: f32) -> Option<(f32, f32)> {
        let (_, total) = self.at(f64::from(end));
        let target = u * total;
        let next = self.knots.partition_point(|k| k.sum <= target);
        let (a, b) = (self.knots.get(next.checked_sub(1)?)?, self.knots.get(next)?);
        // Root of value·s + slope·s²/2 = rest, in the form that does not cancel.
        let rest = target - a.sum;
        let slope = (b.value - a.value) / (b.t - a.t);
        let root = (a.value * a.value + 2.0 * slope * rest).max(0.0).sqrt();
        let t = ((a.t + 2.0 * rest / (a.value + root)).min(b.t) as f32).min(end);
        let pdf = self.pdf(t, end);
        (pdf > 0.0 && pdf.is_finite()).then_some((t, pdf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::chi2::assert_counts;
    use crate::math::sampler::Stream;

    /// A ramp, a jump, nothing, another ramp.
    fn example() -> PiecewiseLinear {
        let mut density = PiecewiseLinear::default();
        for (t, value) in [(1.0, 0.0), (2.0, 3.0), (2.0, 1.0), (4.0, 1.0), (4.0, 0.0), (6.0, 0.0), (7.0, 8.0)] {
            density.push(t, value);
        }
        density
    }

    #[test]
    fn samples_follow_the_pdf() {
        let density = example();
        for end in [1.7f32, 3.0, 5.0, 6.6, 7.0, 100.0] {
            let bins = 64;
            let width = f64::from(end.min(7.0)) / f64::from(bins);
            let mut counts = vec![0.0; bins as usize];
            let mut stream = Stream::from_seed(3);
            let n = 200_000;
            for _ in 0..n {
                let (t, pdf) = density.sample(f64::from(stream.next_f32()), end).expect("there is density");
                assert!(t <= end && pdf == density.pdf(t, end));
                counts[((f64::from(t) / width) as usize).min(bins as usize - 1)] += 1.0;
            }
            let steps = 500;
            let expected: Vec<f64> = (0..bins)
                .map(|bin| {
                    let at = |k: i32| ((f64::from(bin) + (f64::from(k) + 0.5) / f64::from(steps)) * width) as f32;
                    let mean = (0..steps).map(|k| f64::from(density.pdf(at(k), end))).sum::<f64>() / f64::from(steps);
                    mean * width * f64::from(n)
                })
                .collect();
            assert_counts(&format!("up to {end}"), &counts, &expected);
        }
    }

    #[test]
    fn without_density_there_is_no_sample() {
        let density = example();
        assert_eq!(density.sample(0.5, 0.9), None);
        assert_eq!(density.pdf(0.5, 0.9), 0.0);
        assert_eq!(density.pdf(5.0, 9.0), 0.0);
        assert_eq!(PiecewiseLinear::default().sample(0.5, 1.0), None);
        let mut flat = PiecewiseLinear::default();
        flat.push(0.0, 0.0);
        flat.push(9.0, 0.0);
        assert_eq!(flat.sample(0.3, 5.0), None);
    }
}
