//! What other mixes of the techniques would have found, by what was found at the vertices of first scattering: so that several variances are known
//! of the same paths. **Ours.**
//!
//! Such a vertex is found by null tracking with density p_null and by in-scatter sampling with density p_drawn (times the points drawn). D is what
//! its light sample brings times that density, C what the path that goes on from it does. A [`Mix`] says which of the vertices sample lights and
//! which paths go on from, and so by which densities p_D and p_C either is divided. With r = p_null / (p_null + p_drawn), the shares
//! s_D = p_D / (p_null + p_drawn), likewise s_C, and d and c being D and C over all density, a vertex of null tracking brings d/s_D + c/s_C
//! and a point that was drawn does as well, as far as they sample lights and go on. Its square is expected to be
//!
//! ```text
//! r (d/s_D + c/s_C)² + (1 − r) (d/s_D + c/s_C)²
//! ```
//!
//! whichever technique found the vertex: so what null tracking finds once in a thousand paths does not come as a surprise. The mean is the same for
//! all mixes: variances differ as the squares of whole samples do, of what the points bring times all else that the same path brings too.

use crate::math::Rgb;

/// Which vertices of first scattering sample lights, and which paths go on from. They go on from null tracking's in any case.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mix {
    /// Points that are drawn sample lights: there are some.
    pub draws: bool,
    /// Null tracking's vertices sample lights.
    pub null_lights: bool,
    /// Paths go on from points.
    pub goes_on: bool,
}

impl Mix {
    /// Null tracking alone.
    pub const NULL: Self = Self { draws: false, null_lights: true, goes_on: false };
    /// Points do all they can, beside null tracking.
    pub const FULL: Self = Self { draws: true, null_lights: true, goes_on: true };
    /// Points that sample lights beside null tracking's vertices, which alone paths go on from: the paper's.
    pub const LIGHTS: Self = Self { draws: true, null_lights: true, goes_on: false };
    /// In-scatter sampling alone, as far as light is concerned that is scattered once.
    pub const POINTS: Self = Self { draws: true, null_lights: false, goes_on: false };
    /// What may be better than [`Mix::FULL`], which tells of them all.
    pub const OTHERS: [Self; 4] =
        [Self::NULL, Self::POINTS, Self::LIGHTS, Self { draws: true, null_lights: false, goes_on: true }];

    /// What a vertex of null tracking and a point bring, whose share of all density is `r`, of `found` = d and c.
    fn brings(self, r: f64, [d, c]: [f64; 2]) -> [f64; 2] {
        if r >= 1.0 {
            // No points are drawn there.
            return [d + c, 0.0];
        }
        let on = |is_on: bool, share: f64| if is_on { share } else { 0.0 };
        let over = |value: f64, share: f64| if share > 0.0 { value / share } else { 0.0 };
        let d = over(d, on(self.null_lights, r) + on(self.draws, 1.0 - r));
        let c = over(c, r + on(self.goes_on, 1.0 - r));
        [on(self.null_lights, d) + c, on(self.draws, d) + on(self.goes_on, c)]
    }
}

/// A vertex of first scattering that the path itself came to.
pub(in crate::integrator) struct OwnVertex {
    /// Null tracking's share of the densities.
    pub share: f64,
    /// All that came before it.
    pub before: Rgb,
    /// What its light sample brought.
    pub light: Rgb,
}

/// One path's vertices of first scattering in luminance, as one mix would have it.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// What the points bring, and the sum of its squares.
    drawn: f64,
    drawn_squares: f64,
    /// What the path's own vertex brings.
    own: f64,
    /// Expected squares.
    squares: f64,
}

/// The vertices of one path where [`Mix::FULL`] is in use.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alternatives {
    full: Sums,
    others: [Sums; Mix::OTHERS.len()],
}

impl Alternatives {
    fn add(&mut self, share: f64, found: [Rgb; 2], is_drawn: bool) {
        let found = found.map(|part| f64::from(part.luminance()));
        let mixes = std::iter::once((&mut self.full, Mix::FULL)).chain(self.others.iter_mut().zip(Mix::OTHERS));
        for (sums, mix) in mixes {
            let [own, drawn] = mix.brings(share, found);
            if is_drawn {
                sums.drawn += drawn;
                sums.drawn_squares += drawn * drawn;
            } else {
                sums.own = own;
            }
            sums.squares += share * own * own + (1.0 - share) * drawn * drawn;
        }
    }

    /// Adds a point that was drawn: `share` is r, `found` d and c.
    pub fn add_drawn(&mut self, share: f64, found: [Rgb; 2]) {
        self.add(share, found, true);
    }

    /// Adds the path's own vertex, after which `rest` came.
    pub(in crate::integrator) fn add_own(&mut self, vertex: &OwnVertex, rest: Rgb) {
        self.add(vertex.share, [vertex.light, rest], false);
    }

    /// What the points drawn bring.
    pub fn drawn(&self) -> f64 {
        self.full.drawn
    }

    /// By how much the square of the sample would be larger with each of [`Mix::OTHERS`], `rest` being what paths bring that no medium scatters first.
    pub fn more(&self, rest: f64) -> [f64; Mix::OTHERS.len()] {
        // A path goes on to the surface or has a vertex of its own, and the points bring theirs beside either. The squares of vertices are
        // those expected, not those of this path.
        let square = |sums: &Sums| {
            sums.squares + sums.drawn * sums.drawn - sums.drawn_squares + 2.0 * sums.drawn * (sums.own + rest)
        };
        let in_use = (self.full.drawn + self.full.own).powi(2) + 2.0 * self.full.drawn * rest;
        self.others.map(|sums| square(&sums) - in_use)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::Stream;

    /// A vertex at x in (0, 1): null tracking comes to one with probability 0.3, evenly; points are drawn with density 0.2 + 1.6x. A light sample
    /// brings D = x, the path that goes on C = 2 - x with some noise; the surface behind brings 1.
    fn sample(mix: Mix, stream: &mut Stream) -> (f64, Alternatives, f64) {
        let mut u = || f64::from(stream.next_f32());
        let p_null = 0.3;
        let mut alternatives = Alternatives::default();
        let (mut sum, mut rest) = (0.0, 1.0);
        let mut add = |x: f64, u: f64, is_drawn: bool| {
            let all = p_null + 0.2 + 1.6 * x;
            let found = [x / all, (2.0 - x) * if u < 0.5 { 0.0 } else { 2.0 } / all];
            alternatives.add(p_null / all, found.map(|part| Rgb::splat(part as f32)), is_drawn);
            mix.brings(p_null / all, found)[usize::from(is_drawn)]
        };
        // Where none are drawn, a point still tells of it: it brings nothing.
        let x = ((0.04 + 3.2 * u()).sqrt() - 0.2) / 1.6;
        sum += add(x, u(), true);
        let x = u() / p_null;
        if x < 1.0 {
            sum += add(x, u(), false);
            rest = 0.0;
        }
        (sum + rest, alternatives, rest)
    }

    fn mean(mix: Mix, mut of: impl FnMut(f64, Alternatives, f64) -> f64) -> f64 {
        let mut stream = Stream::from_seed(4);
        let n = 400_000;
        let values =
            (0..n).map(|_| sample(mix, &mut stream)).map(|(value, alternatives, rest)| of(value, alternatives, rest));
        values.sum::<f64>() / f64::from(n)
    }

    /// All mixes have the same mean, and their squares are those that the full mix tells.
    #[test]
    fn squares_are_those_of_the_other_mixes() {
        let expected = 0.5 + 1.5 + 0.7;
        let full = mean(Mix::FULL, |value, _, _| value);
        assert!((full - expected).abs() < 0.01 * expected, "{full} {expected}");
        for (k, mix) in Mix::OTHERS.into_iter().enumerate() {
            let (own, square) = (mean(mix, |value, _, _| value), mean(mix, |value, _, _| value * value));
            assert!((own - expected).abs() < 0.01 * expected, "{mix:?}: {own} {expected}");
            let told = mean(Mix::FULL, |value, alternatives, rest| value * value + alternatives.more(rest)[k]);
            assert!((told - square).abs() < 0.02 * square, "{mix:?}: {told} {square}");
        }
    }
}
