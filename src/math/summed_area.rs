//! Summed-area tables: the integral of a function that is constant over each pixel of a grid, over any rectangle; and points drawn in proportion
//! to the function within a rectangle. Sources: Crow, "Summed-Area Tables for Texture Mapping", SIGGRAPH 1984; Bitterli, Novák,
//! Jarosz, "Portal-Masked Environment Map Sampling", EGSR 2015, section 4; Pharr, Jakob, Humphreys (4th ed.) section A.5.6.

/// Sums over all rectangles from the grid's corner. 8 bytes a pixel.
#[derive(Clone, Debug)]
pub struct SummedArea {
    width: usize,
    height: usize,
    /// (`width` + 1) × (`height` + 1).
    sums: Box<[f64]>,
}

impl SummedArea {
    /// Over `width` × `height` pixels, at least one each way, whose values (finite, not negative) `value(x, y)` gives, row by row.
    pub fn new(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> f64) -> Self {
        let stride = width + 1;
        let mut sums = vec![0.0; stride * (height + 1)].into_boxed_slice();
        for y in 0..height {
            let mut row = 0.0;
            for x in 0..width {
                row += value(x, y);
                sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
            }
        }
        Self { width, height, sums }
    }

    /// The integral over the rectangle `x` by `y` (from, to), in pixels, within the grid.
    pub fn integral(&self, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> f64 {
        (self.up_to(x1, y1) - self.up_to(x0, y1) - (self.up_to(x1, y0) - self.up_to(x0, y0))).max(0.0)
    }

    /// The integral from the corner up to (x, y): within a pixel it is bilinear.
    #[inline]
    fn up_to(&self, x: f64, y: f64) -> f64 {
        let (i, j) = ((x as usize).min(self.width - 1), (y as usize).min(self.height - 1));
        let (fx, fy) = (x - i as f64, y - j as f64);
        let row = |j: usize| {
            let start = j * (self.width + 1) + i;
            self.sums[start] + (self.sums[start + 1] - self.sums[start]) * fx
        };
        let (top, bottom) = (row(j), row(j + 1));
        top + (bottom - top) * fy
    }

    /// The value of the pixel that holds (x, y).
    pub fn value(&self, x: f64, y: f64) -> f64 {
        let (i, j) = ((x as usize).min(self.width - 1) as f64, (y as usize).min(self.height - 1) as f64);
        self.integral([i, i + 1.0], [j, j + 1.0])
    }

    /// The density, for each unit of area in pixels, with which [`SummedArea::sample`] draws (x, y) from the window; 0 outside.
    pub fn pdf(&self, x: [f64; 2], y: [f64; 2], at: [f64; 2]) -> f64 {
        if !(at[0] >= x[0] && at[0] <= x[1] && at[1] >= y[0] && at[1] <= y[1]) {
            return 0.0;
        }
        let total = self.integral(x, y);
        if total > 0.0 { self.value(at[0], at[1]) / total } else { 0.0 }
    }

    /// A point within the window `x` by `y` in proportion to the function, by `u` in [0, 1), and its density. `None` where there is nothing.
    pub fn sample(&self, x: [f64; 2], y: [f64; 2], u: [f64; 2]) -> Option<([f64; 2], f64)> {
        let total = self.integral(x, y);
        if !(total > 0.0) {
            return None;
        }
        let at_x = invert(x, u[0] * total, |end| self.integral([x[0], end], y));
        let i = (at_x as usize).min(self.width - 1) as f64;
        let column = [i, i + 1.0];
        let at_y = invert(y, u[1] * self.integral(column, y), |end| self.integral(column, [y[0], end]));
        let pdf = self.value(at_x, at_y) / total;
        (pdf > 0.0).then_some(([at_x, at_y], pdf))
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        size_of_val(&*self.sums)
    }
}

/// Where in `from` to `to` a rising function, straight within pixels and 0 at `from`, reaches `target`.
fn invert([from, to]: [f64; 2], target: f64, function: impl Fn(f64) -> f64) -> f64 {
    // The last border of a pixel where the function is not yet beyond the target.
    let (mut low, mut high) = (from.floor(), to.ceil());
    while high - low > 1.0 {
        let middle = (0.5 * (low + high)).floor();
        if function(middle.clamp(from, to)) <= target { low = middle } else { high = middle }
    }
    let (start, end) = (low.max(from), high.min(to));
    let (below, above) = (function(start), function(end));
    let share = if above > below { ((target - below) / (above - below)).clamp(0.0, 1.0) } else { 0.5 };
    // Not the far border itself, which belongs to the next pixel.
    (start + (end - start) * share).clamp(start, end.next_down().max(start))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::chi2::assert_counts;
    use crate::math::sampler::Stream;

    const WIDTH: usize = 12;
    const HEIGHT: usize = 7;

    fn value(x: usize, y: usize) -> f64 {
        // A dark column, a dark row, and a bright pixel.
        if x == 4 || y == 2 {
            0.0
        } else if (x, y) == (7, 5) {
            40.0
        } else {
            1.0 + ((x * 7 + y * 3) % 5) as f64
        }
    }

    #[test]
    fn integrals_are_those_of_the_pixels() {
        let table = SummedArea::new(WIDTH, HEIGHT, value);
        for ([x0, x1], [y0, y1]) in [([0.0, 12.0], [0.0, 7.0]), ([1.25, 9.5], [0.5, 6.75]), ([4.2, 4.9], [0.0, 7.0])] {
            let overlap = |k: usize, a: f64, b: f64| (b.min(k as f64 + 1.0) - a.max(k as f64)).max(0.0);
            let expected: f64 = (0..WIDTH * HEIGHT)
                .map(|i| (i % WIDTH, i / WIDTH))
                .map(|(x, y)| value(x, y) * overlap(x, x0, x1) * overlap(y, y0, y1))
                .sum();
            assert!((table.integral([x0, x1], [y0, y1]) - expected).abs() < 1e-9);
        }
        assert!((table.value(7.5, 5.5) - 40.0).abs() < 1e-9);
    }

    #[test]
    fn points_follow_the_function_within_the_window() {
        let table = SummedArea::new(WIDTH, HEIGHT, value);
        let n = 200_000;
        for (seed, (x, y)) in
            [([0.0, 12.0], [0.0, 7.0]), ([0.3, 8.6], [1.2, 5.9]), ([7.1, 7.2], [5.3, 5.9])].into_iter().enumerate()
        {
            // Bins across the window, each of 9 midpoints.
            let bins = 24usize;
            let mut counts = vec![0.0; bins * bins];
            let mut stream = Stream::from_seed(seed as u64);
            for _ in 0..n {
                let u = [f64::from(stream.next_f32()), f64::from(stream.next_f32())];
                let ([at_x, at_y], pdf) = table.sample(x, y, u).expect("there is something");
                assert!((table.pdf(x, y, [at_x, at_y]) / pdf - 1.0).abs() < 1e-9);
                let bin = |t: f64, [a, b]: [f64; 2]| (((t - a) / (b - a) * bins as f64) as usize).min(bins - 1);
                counts[bin(at_y, y) * bins + bin(at_x, x)] += 1.0;
            }
            let total = table.integral(x, y);
            let edge = |k: usize, [a, b]: [f64; 2]| a + (b - a) * k as f64 / bins as f64;
            let expected: Vec<f64> = (0..bins * bins)
                .map(|i| {
                    let [kx, ky] = [i % bins, i / bins];
                    table.integral([edge(kx, x), edge(kx + 1, x)], [edge(ky, y), edge(ky + 1, y)]) / total
                        * f64::from(n)
                })
                .collect();
            assert_counts(&format!("window {seed}"), &counts, &expected);
        }
        assert!(table.sample([4.1, 4.9], [0.0, 7.0], [0.3, 0.6]).is_none(), "a dark window");
    }
}
