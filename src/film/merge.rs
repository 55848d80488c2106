//! Pixels of several images joined: each pixel's mean and variance are those of all its samples, as if one render had taken them.
//! Source: Chan, Golub, LeVeque 1979 (eq. 2.1), as for the passes of one render ([`super::accumulate`]).

use glam::DVec3;

use super::accumulate::Moments;
use super::exr::ChannelImage;

/// Of which samples a channel is the mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    All,
    /// Those of finite depth.
    Depth,
    /// Those that met a surface first.
    Surface,
}

impl Over {
    /// The channel that counts them.
    const fn channel(self) -> &'static str {
        match self {
            Self::All => "samples",
            Self::Depth => "depth.samples",
            Self::Surface => "surface.samples",
        }
    }
}

const COUNTS: [Over; 3] = [Over::All, Over::Depth, Over::Surface];

/// What a channel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Beauty(usize),
    VarianceOfMean(usize),
    /// Of a single sample.
    Variance(usize),
    /// That over the square of the mean.
    RelativeVariance(usize),
    Count(Over),
    Mean(Over),
}

impl Role {
    fn of(name: &str) -> Self {
        let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
        let colour = ["R", "G", "B"].iter().position(|c| *c == channel);
        match (layer, colour) {
            ("", Some(c)) => Self::Beauty(c),
            ("variance", Some(c)) => Self::VarianceOfMean(c),
            ("Variance", Some(c)) => Self::Variance(c),
            ("RelativeVariance", Some(c)) => Self::RelativeVariance(c),
            ("P" | "N" | "Ns", _) => Self::Mean(Over::Surface),
            _ => match name {
                "u" | "v" | "dzdx" | "dzdy" => Self::Mean(Over::Surface),
                "depth.Z" => Self::Mean(Over::Depth),
                _ => COUNTS.into_iter().find(|over| over.channel() == name).map_or(Self::Mean(Over::All), Self::Count),
            },
        }
    }
}

/// What some images come to.
pub struct Sums {
    /// The first image's, without values.
    shape: ChannelImage,
    beauty: Vec<Moments>,
    counts: [Vec<f64>; COUNTS.len()],
    /// Of each channel that is a mean; empty for the others.
    means: Vec<Vec<f64>>,
}

impl Sums {
    /// Those of one image.
    ///
    /// # Errors
    /// In words, where it lacks channels.
    pub fn new(image: &ChannelImage) -> Result<Self, String> {
        let pixels = image.bounds.area();
        let means = image.channels.iter().map(|(name, _)| match Role::of(name) {
            Role::Mean(_) => vec![0.0; pixels],
            _ => vec![],
        });
        let means = means.collect();
        let names = image.channels.iter().map(|(name, _)| (name.clone(), vec![])).collect();
        let shape = ChannelImage { channels: names, attributes: vec![], bounds: image.bounds, display: image.display };
        let counts = std::array::from_fn(|_| vec![0.0; pixels]);
        let mut sums = Self { shape, beauty: vec![Moments::default(); pixels], counts, means };
        sums.add(image)?;
        Ok(sums)
    }

    /// Joins another image.
    ///
    /// # Errors
    /// In words, where it has other pixels or channels.
    pub fn add(&mut self, image: &ChannelImage) -> Result<(), String> {
        let names = |image: &ChannelImage| image.channels.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        if image.bounds != self.shape.bounds || image.display != self.shape.display {
            return Err("it has other pixels than the rest".to_owned());
        }
        if names(image) != names(&self.shape) {
            return Err("it has other channels than the rest".to_owned());
        }
        let count_of = |over: Over| image.channel(over.channel());
        let (Some(samples), Some(colour), Some(variance)) = (count_of(Over::All), image.rgb(""), image.rgb("variance"))
        else {
            return Err("it has no channels R, G, B, variance and samples".to_owned());
        };
        // Before the counts: means are moved by the share that the new samples have of all.
        for ((name, values), means) in image.channels.iter().zip(&mut self.means) {
            let Role::Mean(over) = Role::of(name) else { continue };
            let counts = count_of(over).ok_or_else(|| format!("it has no channel {}", over.channel()))?;
            let so_far = &self.counts[COUNTS.iter().position(|o| *o == over).unwrap_or(0)];
            for (((mean, value), new), old) in means.iter_mut().zip(values).zip(counts).zip(so_far) {
                let new = f64::from(*new);
                if new > 0.0 {
                    *mean += (f64::from(*value) - *mean) * (new / (old + new));
                }
            }
        }
        for (over, so_far) in COUNTS.into_iter().zip(&mut self.counts) {
            let counts = count_of(over).into_iter().flatten();
            so_far.iter_mut().zip(counts).for_each(|(so_far, count)| *so_far += f64::from(*count));
        }
        for (pixel, moments) in self.beauty.iter_mut().enumerate() {
            let n = f64::from(samples[pixel]);
            let at = |planes: [&[f32]; 3]| DVec3::from_array(planes.map(|plane| f64::from(plane[pixel])));
            let squares = at(variance) * (n * (n - 1.0).max(0.0));
            moments.merge(&Moments { count: n as u64, mean: at(colour), squares });
        }
        Ok(())
    }

    /// The image that they are together, without attributes.
    pub fn resolved(self) -> ChannelImage {
        let Self { mut shape, beauty, counts, means } = self;
        let of_colour = |c: usize, value: &dyn Fn(&Moments) -> DVec3| -> Vec<f32> {
            beauty.iter().map(|moments| bounded(value(moments)[c])).collect()
        };
        let variance = |moments: &Moments| moments.variance_of_mean() * moments.count as f64;
        for ((name, values), means) in shape.channels.iter_mut().zip(means) {
            *values = match Role::of(name) {
                Role::Beauty(c) => of_colour(c, &|moments| moments.mean),
                Role::VarianceOfMean(c) => of_colour(c, &Moments::variance_of_mean),
                Role::Variance(c) => of_colour(c, &variance),
                Role::RelativeVariance(c) => of_colour(c, &|moments| {
                    let squared = moments.mean * moments.mean;
                    DVec3::select(squared.cmpgt(DVec3::ZERO), variance(moments) / squared, DVec3::ZERO)
                }),
                Role::Count(over) => {
                    counts[COUNTS.iter().position(|o| *o == over).unwrap_or(0)].iter().map(|&n| n as f32).collect()
                }
                Role::Mean(_) => means.into_iter().map(bounded).collect(),
            };
        }
        shape
    }
}

/// Finite sums may be beyond what an f32 holds: the variance of very bright pixels.
pub fn bounded(value: f64) -> f32 {
    if value > f64::from(f32::MAX) { f32::MAX } else { value as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::film_settings;
    use crate::film::{Film, FilmOverrides, PixelSamples, SampleResult, Sensor};
    use crate::math::Rgb;

    /// The samples of these numbers, some of which see nothing, of every pixel of an image.
    fn image(kind: &str, samples: std::ops::Range<u32>) -> ChannelImage {
        let overrides = FilmOverrides { resolution: Some([20, 3]), crop: None };
        let mut settings = film_settings(vec![], &overrides);
        settings.gbuffer = (kind == "gbuffer").then_some(crate::film::gbuffer::Coordinates::World);
        let mut film = Film::new(settings, true);
        for tile in film.tiles_mut() {
            for pixel in tile.bounds().pixels() {
                let mut of_pixel = PixelSamples::new(Sensor::default());
                for sample in samples.clone() {
                    let value = (sample * 7 + pixel[0] * 3 + pixel[1]) % 11;
                    let sees = value % 3 != 0 && pixel[0] != 5;
                    let surface = crate::film::gbuffer::SurfaceSample {
                        p: glam::Vec3::splat(value as f32),
                        ..Default::default()
                    };
                    let beauty = Rgb(glam::Vec3::new(value as f32, 0.5, 1e-3 * value as f32));
                    of_pixel.add(
                        sample,
                        &SampleResult {
                            beauty,
                            emission: beauty,
                            depth: if sees { 2.0 + value as f32 } else { f32::INFINITY },
                            surface: sees.then_some(surface),
                            ..SampleResult::default()
                        },
                    );
                }
                tile.merge(pixel, &of_pixel);
            }
        }
        film.channels()
    }

    #[test]
    fn parts_come_to_what_one_render_has() {
        for kind in ["rgb", "gbuffer"] {
            let whole = image(kind, 0..23);
            let mut sums = Sums::new(&image(kind, 0..5)).expect("an image");
            for part in [5..6, 6..7, 7..23] {
                sums.add(&image(kind, part)).expect("of the same kind");
            }
            let merged = sums.resolved();
            for ((name, expected), (same, values)) in whole.channels.iter().zip(&merged.channels) {
                assert_eq!(name, same);
                for (pixel, (a, b)) in expected.iter().zip(values).enumerate() {
                    assert!((a - b).abs() <= 2e-6 * a.abs().max(1e-3), "{kind} {name}, pixel {pixel}: {b}, not {a}");
                }
            }
        }
    }

    #[test]
    fn other_pixels_and_channels_are_refused() {
        let mut sums = Sums::new(&image("rgb", 0..2)).expect("an image");
        assert!(sums.add(&image("gbuffer", 2..3)).is_err());
        let mut other = image("rgb", 2..3);
        other.bounds.x1 -= 1;
        assert!(sums.add(&other).is_err());
        other = image("rgb", 2..3);
        other.channels.retain(|(name, _)| name != "samples");
        assert!(Sums::new(&other).is_err());
    }
}
