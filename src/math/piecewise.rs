//! A density over distance that is linear from knot to knot: its value, its integral, and where that reaches a number.

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

    /// The value at `t` and the integral up to there.
    #[inline]
    fn at(&self, t: f64) -> (f64, f64) {
        let next = self.knots.partition_point(|k| k.t <= t);
        let Some(a) = next.checked_sub(1).map(|i| self.knots[i]) else { return (0.0, 0.0) };
        let Some(b) = self.knots.get(next) else { return (0.0, a.sum) };
        let value = a.value + (b.value - a.value) * (t - a.t) / (b.t - a.t);
        (value, a.sum + 0.5 * (a.value + value) * (t - a.t))
    }

    /// The value at `t`; 0 before the first knot and from the last one on.
    #[inline]
    pub fn value(&self, t: f32) -> f64 {
        self.at(f64::from(t)).0
    }

    /// The integral up to `t`.
    #[inline]
    pub fn integral(&self, t: f32) -> f64 {
        let t = f64::from(t);
        match self.knots.last() {
            Some(last) if t >= last.t => last.sum,
            _ => self.at(t).1,
        }
    }

    /// Where the integral is `target`, and the value there. `target` is at least 0 and below the integral up to the last knot, else there may be no such
    /// place.
    #[inline]
    pub fn inverse(&self, target: f64) -> Option<(f32, f64)> {
        let next = self.knots.partition_point(|k| k.sum <= target);
        let (a, b) = (self.knots.get(next.checked_sub(1)?)?, self.knots.get(next)?);
        // Root of value·s + slope·s²/2 = rest, in the form that does not cancel.
        let rest = target - a.sum;
        let slope = (b.value - a.value) / (b.t - a.t);
        let root = (a.value * a.value + 2.0 * slope * rest).max(0.0).sqrt();
        let t = (a.t + 2.0 * rest / (a.value + root)).min(b.t);
        Some((t as f32, a.value + slope * (t - a.t)))
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
    fn places_follow_the_density() {
        let density = example();
        let (end, bins) = (7.0, 64);
        let total = density.integral(end);
        let width = f64::from(end) / f64::from(bins);
        let mut counts = vec![0.0; bins as usize];
        let mut stream = Stream::from_seed(3);
        let n = 200_000;
        for _ in 0..n {
            let (t, value) = density.inverse(f64::from(stream.next_f32()) * total).expect("there is density");
            // But where t rounds onto a jump; t as f32 is off by up to 2.4e-7 where the slope is 8.
            if t.fract() != 0.0 {
                assert!((value - density.value(t)).abs() < 4e-6, "{t}: {value}, not {}", density.value(t));
            }
            counts[((f64::from(t) / width) as usize).min(bins as usize - 1)] += 1.0;
        }
        let steps = 500;
        let expected: Vec<f64> = (0..bins)
            .map(|bin| {
                let at = |k: i32| ((f64::from(bin) + (f64::from(k) + 0.5) / f64::from(steps)) * width) as f32;
                let mean = (0..steps).map(|k| density.value(at(k))).sum::<f64>() / f64::from(steps);
                mean / total * width * f64::from(n)
            })
            .collect();
        assert_counts("all of it", &counts, &expected);
    }

    #[test]
    fn the_integral_is_that_of_the_value() {
        let density = example();
        let steps = 7000;
        let mut sum = 0.0;
        for k in 0..steps {
            let t = (f64::from(k) + 0.5) * 1e-3;
            sum += 1e-3 * density.value(t as f32);
            if k % 500 == 499 {
                let integral = density.integral((t + 0.5e-3) as f32);
                assert!((sum - integral).abs() < 1e-2, "{t}: {sum} {integral}");
            }
        }
        assert_eq!(density.integral(9.0), density.integral(7.0));
    }

    #[test]
    fn without_density_there_is_no_place() {
        let density = example();
        assert_eq!((density.value(0.9), density.integral(0.9)), (0.0, 0.0));
        assert_eq!((density.value(5.0), density.value(9.0)), (0.0, 0.0));
        assert_eq!(PiecewiseLinear::default().inverse(0.0), None);
        let mut flat = PiecewiseLinear::default();
        flat.push(0.0, 0.0);
        flat.push(9.0, 0.0);
        assert_eq!(flat.inverse(0.0), None);
    }
}
