//! Alias tables: O(1) draws from a fixed discrete distribution. Source: Vose, "A Linear Algorithm for Generating Random
//! Numbers with a Given Distribution", IEEE TSE 17(9), 1991; after Walker 1977.

/// A table of n bins, each shared by at most two outcomes. 8 bytes an outcome.
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    bins: Box<[Bin]>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// The share of the bin that belongs to the outcome of the same number.
    keep: f32,
    /// The outcome that the rest belongs to.
    other: u32,
}

impl AliasTable {
    /// A table for outcomes with probabilities proportional to `weights` (finite, not negative, fewer than 2³²), in O(n).
    /// `None` where nothing has a positive weight.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if total <= 0.0 || !total.is_finite() {
            return None;
        }
        let to_bins = weights.len() as f64 / total;
        // `rest[i]` is how many bins outcome i still has to fill.
        let mut rest: Vec<f64> = weights.iter().map(|&w| f64::from(w) * to_bins).collect();
        let mut bins: Box<[Bin]> = (0..weights.len() as u32).map(|other| Bin { keep: 1.0, other }).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            (0..weights.len() as u32).partition(|&i| rest[i as usize] < 1.0);
        while let (Some(&lesser), Some(&greater)) = (small.last(), large.last()) {
            small.pop();
            bins[lesser as usize] = Bin { keep: rest[lesser as usize] as f32, other: greater };
            rest[greater as usize] -= 1.0 - rest[lesser as usize];
            if rest[greater as usize] < 1.0 {
                large.pop();
                small.push(greater);
            }
        }
        // What is left fills its own bin up to rounding; an outcome of weight 0 must not be drawn even so.
        let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))? as u32;
        for &left in small.iter().filter(|&&left| weights[left as usize] == 0.0) {
            bins[left as usize] = Bin { keep: 0.0, other: heaviest };
        }
        Some(Self { bins })
    }

    /// The outcome for `u` in [0, 1), and a number in [0, 1) that is uniform given the outcome. f64, because millions of outcomes
    /// leave nothing of the 24 bits of an f32.
    #[inline]
    pub fn sample(&self, u: f64) -> (u32, f64) {
        let scaled = u * self.bins.len() as f64;
        let index = (scaled as usize).min(self.bins.len() - 1);
        let within = (scaled - index as f64).clamp(0.0, 1.0);
        let bin = self.bins[index];
        let keep = f64::from(bin.keep);
        let (outcome, rest) = if within < keep {
            (index as u32, within / keep)
        } else {
            (bin.other, (within - keep) / (1.0 - keep).max(f64::MIN_POSITIVE))
        };
        (outcome, rest.min(1.0 - f64::EPSILON))
    }

    /// The number of outcomes.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether there is no outcome.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        std::mem::size_of_val(&*self.bins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_holds_the_distribution_exactly() {
        let weights = [0.0f32, 3.0, 1e-6, 0.5, 0.0, 7.25, 0.5];
        let table = AliasTable::new(&weights).expect("there are positive weights");
        let mut held = vec![0.0f64; weights.len()];
        for (i, bin) in table.bins.iter().enumerate() {
            held[i] += f64::from(bin.keep);
            held[bin.other as usize] += 1.0 - f64::from(bin.keep);
        }
        let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        for (held, &weight) in held.iter().zip(&weights) {
            let expected = f64::from(weight) / total;
            assert!((held / weights.len() as f64 - expected).abs() < 1e-7, "{held} {expected}");
        }
        assert_eq!(held[0], 0.0);
        assert_eq!(held[4], 0.0);
    }

    #[test]
    fn nothing_to_choose_from_gives_no_table() {
        assert!(AliasTable::new(&[]).is_none());
        assert!(AliasTable::new(&[0.0, 0.0]).is_none());
    }

    #[test]
    fn the_rest_of_the_number_is_uniform_given_the_outcome() {
        let table = AliasTable::new(&[1.0, 2.0, 5.0]).expect("there are positive weights");
        let mut sums = [(0u32, 0.0f64); 3];
        for i in 0..24_000 {
            let (outcome, rest) = table.sample((f64::from(i) + 0.5) / 24_000.0);
            sums[outcome as usize].0 += 1;
            sums[outcome as usize].1 += rest;
        }
        for (count, sum) in sums {
            assert!((sum / f64::from(count) - 0.5).abs() < 1e-3);
        }
        assert_eq!(sums.map(|s| s.0), [3000, 6000, 15000]);
    }
}
