//! Errors without a few pixels: where a handful of them hold most of the squared error, the rest says more about how lights are selected.
//!
//! Which pixels are left out is decided once for a scene, by the squared error over all selections and seeds, each selection's relative to
//! its own mean, so that the choice favours none.

/// The share of pixels that is left out.
const SHARE: f64 = 0.001;

/// Squared errors of an image's pixels, as far as a reference tells: the mean is right, one by one they may be negative.
pub type Squares = Vec<f64>;

/// Which pixels are kept, of all images: a list for each selection, of an image for each seed.
pub fn kept(images: &[Vec<Squares>]) -> Vec<bool> {
    let count = images.first().and_then(|seeds| seeds.first()).map_or(0, Vec::len);
    let mut sums = vec![0.0; count];
    for seeds in images {
        let all = seeds.iter().map(|image| mean(image)).sum::<f64>().abs();
        for image in seeds {
            sums.iter_mut().zip(image).for_each(|(sum, square)| *sum += square / all);
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| sums[b].total_cmp(&sums[a]));
    let mut kept = vec![true; count];
    let left_out = (SHARE * count as f64).ceil() as usize;
    order.into_iter().take(left_out).for_each(|pixel| kept[pixel] = false);
    kept
}

/// Mean over the pixels that are kept.
pub fn mean_of(kept: &[bool], squares: &[f64]) -> f64 {
    let values: Vec<f64> = squares.iter().zip(kept).filter(|(_, kept)| **kept).map(|(square, _)| *square).collect();
    mean(&values)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_pixel_of_a_thousand_is_left_out() {
        let mut square = vec![1.0; 1000];
        square[7] = 100.0;
        let kept = kept(&[vec![square.clone()], vec![vec![2.0; 1000]]]);
        assert_eq!(kept.iter().position(|kept| !kept), Some(7));
        assert_eq!((kept.iter().filter(|kept| **kept).count(), mean_of(&kept, &square)), (999, 1.0));
    }
}
