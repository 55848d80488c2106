//! Parts of the images side by side, as many samples each: where the methods are worst, and where they are as usual. Beside each, its
//! HDR-FLIP error in the colours of the map "magma", black for none.

use super::hdr_flip::HdrFlip;
use super::reference::Reference;
use super::trim::Squares;
use crate::film::PixelBounds;
use crate::film::image::{linear_to_srgb, to_byte};
use crate::report::compare::{Side, exposure_scale};

/// Width and height at most.
const SIZE: u32 = 64;

/// Pictures of a scene.
#[derive(Debug, Default)]
pub struct Crops {
    /// Samples a pixel of all of them.
    pub spp: u32,
    /// Width and height of each.
    pub size: [u32; 2],
    /// The parts.
    pub parts: Vec<Part>,
}

/// A part of the image.
#[derive(Debug)]
pub struct Part {
    /// Which one, in words.
    pub name: String,
    /// The reference's, as PNG.
    pub reference: Vec<u8>,
    /// Name, picture and error of each method, as PNG.
    pub methods: Vec<(String, Vec<u8>, Vec<u8>)>,
}

impl Crops {
    /// Of these images, each with its method's name and its samples a pixel; `squares` are the errors of pixels of each method and seed.
    pub fn of<'a>(
        reference: &Reference,
        flip: &HdrFlip,
        squares: &[Vec<Squares>],
        images: impl Iterator<Item = (&'a str, u32, &'a Side)>,
    ) -> Self {
        let bounds = reference.image.bounds;
        let size = [SIZE.min(bounds.width()), SIZE.min(bounds.height())];
        let scale = exposure_scale(&reference.image);
        let images: Vec<(&str, &Side, Vec<f32>, u32)> =
            images.map(|(name, spp, image)| (name, image, flip.errors(image), spp)).collect();
        let parts = chosen(bounds, size, squares).into_iter().map(|(name, part)| Part {
            reference: beauty(&reference.image, part, scale),
            methods: images
                .iter()
                .map(|(name, image, errors, _)| {
                    ((*name).to_owned(), beauty(image, part, scale), error(errors, bounds, part))
                })
                .collect(),
            name: format!("{name}: columns {} to {}, rows {} to {}", part.x0, part.x1 - 1, part.y0, part.y1 - 1),
        });
        Self { spp: images.first().map_or(0, |image| image.3), size, parts: parts.collect() }
    }
}

/// The part with the largest error over all methods, each relative to its own, and the part in the middle of that order.
fn chosen(
    bounds: PixelBounds,
    [width, height]: [u32; 2],
    squares: &[Vec<Squares>],
) -> Vec<(&'static str, PixelBounds)> {
    // The last of a row or column reaches to the edge.
    let starts = |from: u32, to: u32, size: u32| (from..to).step_by(size as usize).map(move |at| at.min(to - size));
    let mut parts: Vec<(f64, PixelBounds)> = starts(bounds.y0, bounds.y1, height)
        .flat_map(|y0| starts(bounds.x0, bounds.x1, width).map(move |x0| [x0, y0]))
        .map(|[x0, y0]| {
            let part = PixelBounds { x0, y0, x1: x0 + width, y1: y0 + height };
            let share = |images: &Vec<Squares>| {
                let sum = |of: &dyn Fn(&Squares) -> f64| images.iter().map(of).sum::<f64>();
                let here = sum(&|image| part.pixels().map(|pixel| image[bounds.index(pixel)]).sum());
                let all = sum(&|image| image.iter().sum());
                if all > 0.0 { here / all } else { 0.0 }
            };
            (squares.iter().map(share).sum(), part)
        })
        .collect();
    parts.sort_by(|a, b| b.0.total_cmp(&a.0));
    match parts.as_slice() {
        [(_, whole)] => vec![("the whole image", *whole)],
        parts => vec![("where it is worst", parts[0].1), ("where it is as usual", parts[parts.len() / 2].1)],
    }
}

/// Shown as `compare --png` shows images.
fn beauty(image: &Side, part: PixelBounds, scale: f32) -> Vec<u8> {
    let shown = |pixel| {
        let i = image.bounds.index(pixel);
        [0, 1, 2].map(|c| to_byte(linear_to_srgb((image.colour[c][i] * scale).clamp(0.0, 1.0))))
    };
    png(part, part.pixels().flat_map(shown).collect())
}

fn error(errors: &[f32], bounds: PixelBounds, part: PixelBounds) -> Vec<u8> {
    let magma = nv_flip::magma_lut().to_vec();
    let shown = |pixel| {
        let first = 3 * usize::from(to_byte(errors[bounds.index(pixel)]));
        [magma[first], magma[first + 1], magma[first + 2]]
    };
    png(part, part.pixels().flat_map(shown).collect())
}

fn png(part: PixelBounds, bytes: Vec<u8>) -> Vec<u8> {
    crate::film::image::encode_png(part.width(), part.height(), &bytes).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_part_is_found_at_the_edge_too() {
        let bounds = PixelBounds { x0: 10, y0: 20, x1: 110, y1: 84 };
        let mut square = vec![1.0; bounds.area()];
        square[bounds.index([109, 83])] = 1e6;
        let found = chosen(bounds, [64, 64], &[vec![square]]);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].1, PixelBounds { x0: 46, y0: 20, x1: 110, y1: 84 });
        assert_eq!(found[1].1, PixelBounds { x0: 10, y0: 20, x1: 74, y1: 84 });
        let small = PixelBounds::full(16, 12);
        assert_eq!(chosen(small, [16, 12], &[vec![vec![1.0; 192]]]), [("the whole image", small)]);
    }
}
