//! Images compared block by block. Each is rendered with several seeds, so that the noise of a block's mean is seen and not assumed; two
//! lists of means are compared by Welch's form of Student's t-test. All comparisons of a test are a family: its false-alarm rate
//! is that of the test, by Šidák's correction (which for comparisons that share a reference is on the safe side).

use lanternfish::film::Film;
use lanternfish::render::Job;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Options, SLACK, render_job};

/// The means of an image's blocks, row by row, and of the whole image at the end: a list for each seed.
pub struct Blocks(pub Vec<Vec<f64>>);

/// The means of one image's blocks (all channels together), `columns` × `rows` of them, and of the whole. What is seen of the lights
/// themselves is left out: it is all noise of the camera's.
fn means(film: &Film, [columns, rows]: [usize; 2]) -> Vec<f64> {
    assert_eq!(film.rejected().0, 0, "samples were NaN or infinite");
    let image = film.channels();
    let (width, height) = (image.bounds.width() as usize, image.bounds.height() as usize);
    let (mut sums, mut counts) = (vec![0.0; columns * rows + 1], vec![0.0; columns * rows + 1]);
    for layer in ["direct", "indirect", "volume"] {
        for colour in ["R", "G", "B"] {
            let values = image.channel(&format!("{layer}.{colour}")).expect("every layer is there");
            for (i, value) in values.iter().enumerate() {
                let (x, y) = (i % width, i / width);
                for block in [y * rows / height * columns + x * columns / width, columns * rows] {
                    sums[block] += f64::from(*value) / 3.0;
                    counts[block] += 1.0 / 9.0;
                }
            }
        }
    }
    sums.iter().zip(counts).map(|(sum, count)| sum / count).collect()
}

impl Blocks {
    /// Renders `job` with `seeds` seeds, from that of `options` on. Cache points go on learning: given what they know, each image's mean is
    /// right whatever it is.
    #[track_caller]
    pub fn render(job: &mut Job, options: &Options, grid: [usize; 2], seeds: u32) -> Self {
        let seeds = options.seed..options.seed + seeds;
        Self(seeds.map(|seed| means(&render_job(job, &Options { seed, ..options.clone() }).film, grid)).collect())
    }

    /// The mean of a block over seeds, and the square of its standard error.
    fn moments(&self, block: usize) -> (f64, f64) {
        let count = self.0.len() as f64;
        let mean = self.0.iter().map(|image| image[block]).sum::<f64>() / count;
        let squares: f64 = self.0.iter().map(|image| (image[block] - mean).powi(2)).sum();
        (mean, squares / (count - 1.0) / count)
    }
}

/// One block of one comparison.
struct Comparison {
    what: String,
    /// How likely so great a difference is by chance.
    p: f64,
}

/// All comparisons of a test.
#[derive(Default)]
pub struct Family(Vec<Comparison>);

impl Family {
    /// Compares every block of `image` with that of `reference`. The standard error of the whole image must be below `precision` (relative),
    /// so that the test can see errors of about six times that.
    #[track_caller]
    pub fn compare(&mut self, what: &str, image: &Blocks, reference: &Blocks, precision: f64) {
        let [m, n] = [image, reference].map(|blocks| blocks.0.len() as f64);
        let count = reference.0[0].len();
        let mut worst = f64::INFINITY;
        for block in 0..count {
            let [(a, va), (b, vb)] = [image, reference].map(|blocks| blocks.moments(block));
            let error = (va + vb).sqrt();
            let is_whole = block + 1 == count;
            assert!(!is_whole || (b > 0.0 && error < precision * b), "{what}: {a} ± {error} is too vague beside {b}");
            // Blocks without noise may differ by rounding.
            let beyond = (a - b).abs() - SLACK * b;
            let p = if beyond <= 0.0 {
                1.0
            } else {
                let freedom = (va + vb).powi(2) / (va.powi(2) / (m - 1.0) + vb.powi(2) / (n - 1.0));
                StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(0.0, |t| 2.0 * t.cdf(-beyond / error))
            };
            let place = if is_whole { "the whole".to_owned() } else { format!("block {block}") };
            let text = format!("{what}, {place}: {a:.6} ± {:.6} and {b:.6} ± {:.6}, p = {p:.1e}", va.sqrt(), vb.sqrt());
            if is_whole {
                println!("{text}; least p of all blocks {worst:.1e}");
            }
            worst = worst.min(p);
            self.0.push(Comparison { what: text, p });
        }
    }

    /// Fails where a difference is not chance; although all is well with probability `rate`.
    #[track_caller]
    pub fn assert(&self, rate: f64) {
        assert!(!self.0.is_empty());
        let threshold = -(-rate).ln_1p() / self.0.len() as f64;
        let threshold = -(-threshold).exp_m1();
        let wrong: Vec<&str> = self.0.iter().filter(|c| c.p < threshold).map(|c| c.what.as_str()).collect();
        assert!(wrong.is_empty(), "{} of {} blocks differ:\n{}", wrong.len(), self.0.len(), wrong.join("\n"));
    }
}
