//! Image maps over texture coordinates: placement, wrapping, filtering. Source: pbrt-v4, section 10.4.
//!
//! Lookups use the full-resolution image: there are no ray differentials to choose a pyramid level by, so `trilinear` and
//! `EWA` are read as `bilinear`. Many samples a pixel do the rest of the filtering.

use std::sync::Arc;

use glam::Vec2;

use super::texture_mapping::Mapping2d;
use crate::film::image::Image;
use crate::math::Rgb;

/// What lies beyond the image's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// Zero.
    Black,
    /// The nearest edge pixel.
    Clamp,
}

/// How pixels become a continuous function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The nearest pixel.
    Point,
    /// Linear between the four nearest pixels.
    Bilinear,
}

/// An image, placed and scaled.
#[derive(Clone, Debug)]
pub struct ImageMap {
    /// The pixels, shared by all maps of one file.
    pub image: Arc<Image>,
    /// Beyond the edge.
    pub wrap: Wrap,
    /// Between pixels.
    pub filter: Filter,
    /// Where on the image a point of a surface is.
    pub mapping: Mapping2d,
    /// Values are multiplied by this …
    pub scale: f32,
    /// … and then taken from 1.
    pub invert: bool,
}

impl ImageMap {
    /// The colour at the coordinates `st`, not negative; greys are repeated, alpha is left out.
    pub fn rgb(&self, st: Vec2) -> Rgb {
        let value = self.filtered(st, |texel| match *texel {
            [grey] | [grey, _] => Rgb::splat(grey),
            [r, g, b, ..] => Rgb::new(r, g, b),
            [] => Rgb::BLACK,
        });
        let value = value * self.scale;
        let value = if self.invert { Rgb::WHITE - value } else { value };
        value.map(|c| c.max(0.0))
    }

    /// The float at the coordinates `st`: alpha where the image has it, else the mean of the channels. Inverted, it is not negative.
    pub fn float(&self, st: Vec2) -> f32 {
        let value = self.filtered(st, |texel| {
            Rgb::splat(match *texel {
                [grey] => grey,
                [.., alpha] if texel.len() % 2 == 0 => alpha,
                _ => texel.iter().sum::<f32>() / texel.len().max(1) as f32,
            })
        })[0];
        let value = value * self.scale;
        // Heights may be negative (and in pbrt-v4, which limits inverted values alone, any float).
        if self.invert { (1.0 - value).max(0.0) } else { value }
    }

    /// Half the size of a texel in texture coordinates, at most a half.
    pub fn half_texel(&self) -> Vec2 {
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        // How far the surface's coordinates go across an image that lies otherwise is not known.
        let Mapping2d::Uv { scale, .. } = self.mapping else { return Vec2::INFINITY };
        (0.5 / (size * scale.abs())).clamp(Vec2::splat(f32::MIN_POSITIVE), Vec2::splat(0.5))
    }

    #[inline]
    fn filtered(&self, st: Vec2, read: impl Fn(&[f32]) -> Rgb) -> Rgb {
        // (0, 0) is the lower left of the texture and the upper left of the image.
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        let p = Vec2::new(st.x, 1.0 - st.y) * size - 0.5;
        if !p.is_finite() {
            return Rgb::BLACK;
        }
        match self.filter {
            Filter::Point => self.texel(p.x.round() as i64, p.y.round() as i64, &read),
            Filter::Bilinear => {
                let corner = p.floor();
                let t = p - corner;
                let (x, y) = (corner.x as i64, corner.y as i64);
                let top = self.texel(x, y, &read).lerp(self.texel(x.saturating_add(1), y, &read), t.x);
                let bottom = self
                    .texel(x, y.saturating_add(1), &read)
                    .lerp(self.texel(x.saturating_add(1), y.saturating_add(1), &read), t.x);
                top.lerp(bottom, t.y)
            }
        }
    }

    #[inline]
    fn texel(&self, x: i64, y: i64, read: impl Fn(&[f32]) -> Rgb) -> Rgb {
        let Image { width, height, channels, ref pixels } = *self.image;
        let place = |i: i64, n: usize| match self.wrap {
            Wrap::Repeat => Some(i.rem_euclid(n as i64) as usize),
            Wrap::Clamp => Some(i.clamp(0, n as i64 - 1) as usize),
            Wrap::Black => usize::try_from(i).ok().filter(|&i| i < n),
        };
        match (place(x, width), place(y, height)) {
            (Some(x), Some(y)) => {
                let start = (y * width + x) * channels;
                read(&pixels[start..start + channels])
            }
            _ => Rgb::BLACK,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::material::TexturePoint;

    fn map(width: usize, height: usize, channels: usize, pixels: Vec<f32>) -> ImageMap {
        ImageMap {
            image: Arc::new(Image { width, height, channels, pixels }),
            wrap: Wrap::Repeat,
            filter: Filter::Bilinear,
            mapping: Mapping2d::IDENTITY,
            scale: 1.0,
            invert: false,
        }
    }

    #[test]
    fn the_first_row_is_the_top_of_the_texture() {
        let map = map(1, 2, 1, vec![1.0, 0.0]);
        assert_eq!(map.float(Vec2::new(0.5, 0.75)), 1.0);
        assert_eq!(map.float(Vec2::new(0.5, 0.25)), 0.0);
        assert_eq!(map.float(Vec2::new(0.5, 0.5)), 0.5);
    }

    #[test]
    fn wrapping_and_filtering() {
        let mut map = map(2, 1, 1, vec![1.0, 3.0]);
        let at = |map: &ImageMap, u: f32| map.float(Vec2::new(u, 0.5));
        assert_eq!(at(&map, 0.25), 1.0);
        assert_eq!(at(&map, 0.75), 3.0);
        assert_eq!(at(&map, 0.5), 2.0);
        assert_eq!(at(&map, 1.0), 2.0);
        assert_eq!(at(&map, -0.75), 1.0);
        map.wrap = Wrap::Clamp;
        assert_eq!(at(&map, 1.0), 3.0);
        assert_eq!(at(&map, -9.0), 1.0);
        map.wrap = Wrap::Black;
        assert_eq!(at(&map, 1.0), 1.5);
        map.filter = Filter::Point;
        assert_eq!(at(&map, 0.4), 1.0);
        assert_eq!(at(&map, 0.6), 3.0);
        assert_eq!(at(&map, 1.6), 0.0);
    }

    #[test]
    fn placement_scale_and_invert() {
        let mut map = map(4, 1, 1, vec![0.0, 0.25, 0.5, 0.75]);
        map.mapping = Mapping2d::Uv { scale: Vec2::new(2.0, 1.0), delta: Vec2::new(0.125, 0.0) };
        let st = map.mapping.at(&TexturePoint { p: Vec3::ZERO, n: Vec3::Z, uv: Vec2::new(0.25, 0.5) });
        map.filter = Filter::Point;
        assert_eq!(map.float(st), 0.5);
        map.scale = 0.5;
        map.invert = true;
        assert_eq!(map.float(st), 0.75);
        assert_eq!(map.rgb(st), Rgb::splat(0.75));
    }

    #[test]
    fn floats_come_from_alpha_or_the_mean() {
        assert_eq!(map(1, 1, 4, vec![0.1, 0.2, 0.3, 0.7]).float(Vec2::ZERO), 0.7);
        assert!((map(1, 1, 3, vec![0.1, 0.2, 0.6]).float(Vec2::ZERO) - 0.3).abs() < 1e-6);
        assert_eq!(map(1, 1, 4, vec![0.1, 0.2, 0.3, 0.7]).rgb(Vec2::ZERO), Rgb::new(0.1, 0.2, 0.3));
        assert_eq!(map(1, 1, 1, vec![0.1]).rgb(Vec2::ZERO), Rgb::splat(0.1));
    }

    #[test]
    fn coordinates_out_of_all_bounds_do_not_panic() {
        let map = map(3, 2, 1, vec![0.5; 6]);
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30, f32::MIN_POSITIVE] {
            let value = map.float(Vec2::splat(u));
            assert!(value == 0.5 || value == 0.0);
        }
    }
}
