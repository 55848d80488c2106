//! Image maps over texture coordinates: placement, wrapping, filtering. Source: pbrt-v4, section 10.4.
//!
//! As in pbrt-v4 each filter works on the level of detail whose texels are about as large as twice what the ray covers; where nothing is known of
//! that, on the image itself.

use std::sync::Arc;

use glam::{Mat3, Vec2};

use super::TexturePoint;
use super::mip_map::{MipMap, View};
use super::texture_mapping::{Mapping2d, TextureCoordinates};
use crate::math::Rgb;

/// What stands for a colour whose image is missing.
pub const MAGENTA: Rgb = Rgb::new(1.0, 0.0, 1.0);

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

/// How texels become a continuous function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The nearest texel of one level.
    Point,
    /// Linear between the four nearest texels of one level.
    Bilinear,
    /// That, and linear between two levels.
    Trilinear,
    /// A mean over an ellipse, at most so many times as long as wide (see [`super::ewa`]).
    Ewa(f32),
}

/// An image, placed and scaled.
#[derive(Clone, Debug)]
pub struct ImageMap {
    /// The texels, shared by all maps of one file.
    pub image: Arc<MipMap>,
    /// Beyond the edge.
    pub wrap: Wrap,
    /// Between texels.
    pub filter: Filter,
    /// Where on the image a point of a surface is.
    pub mapping: Mapping2d,
    /// Values are multiplied by this …
    pub scale: f32,
    /// … and then taken from 1.
    pub invert: bool,
    /// What colours are multiplied by first, for their primaries.
    pub to_rec709: Option<Mat3>,
}

impl ImageMap {
    /// The colour at `point`, not negative; greys are repeated, alpha is left out. Magenta where the image cannot be read.
    pub fn rgb(&self, point: &TexturePoint) -> Rgb {
        self.colour(point).unwrap_or(MAGENTA)
    }

    /// The colour at `point`, if the image can be read.
    pub fn colour(&self, point: &TexturePoint) -> Option<Rgb> {
        let view = self.image.view()?;
        let [r, g, b, _] = self.filtered(&view, &self.mapping.across(point));
        let value = if view.channels == 1 { Rgb::splat(r) } else { Rgb::new(r, g, b) };
        let value = self.to_rec709.map_or(value, |matrix| Rgb(matrix * value.0));
        let value = value * self.scale;
        let value = if self.invert { Rgb::WHITE - value } else { value };
        Some(value.map(|c| c.max(0.0)))
    }

    /// The float at `point`: the grey of an image without colours; of others alpha where they have it, else the mean of the channels. Inverted, it is not
    /// negative. 1 where the image cannot be read.
    pub fn float(&self, point: &TexturePoint) -> f32 {
        let Some(view) = self.image.view() else { return 1.0 };
        let texel = self.filtered(&view, &self.mapping.across(point));
        let value = match (view.channels, texel) {
            (1, [grey, ..]) => grey,
            // As in pbrt-v4, also with alpha. That of colours is taken as it is, not decoded as in pbrt-v4: edges are meant so.
            (_, [grey, ..]) if self.image.is_grey() => grey,
            (3, [r, g, b, _]) => (r + g + b) / 3.0,
            (_, [.., alpha]) => alpha,
        };
        let value = value * self.scale;
        // Heights may be negative (and in pbrt-v4, which limits inverted values alone, any float).
        if self.invert { (1.0 - value).max(0.0) } else { value }
    }

    /// Half the size of a texel in texture coordinates, at most a half.
    pub fn half_texel(&self) -> Vec2 {
        let size = Vec2::new(self.image.width() as f32, self.image.height() as f32);
        // How far the surface's coordinates go across an image that lies otherwise is not known.
        let Mapping2d::Uv { scale, .. } = self.mapping else { return Vec2::INFINITY };
        (0.5 / (size * scale.abs())).clamp(Vec2::splat(f32::MIN_POSITIVE), Vec2::splat(0.5))
    }

    fn filtered(&self, view: &View, at: &TextureCoordinates) -> [f32; 4] {
        if !at.st.is_finite() {
            return [0.0; 4];
        }
        if let Filter::Ewa(most_anisotropy) = self.filter {
            return self.ewa(view, at, most_anisotropy);
        }
        let level = level_of(view, at.extent(view));
        let whole = level as usize;
        match self.filter {
            Filter::Point => {
                let p = texels(view, whole, at.st).round();
                self.texel(view, whole, p.x as i64, p.y as i64)
            }
            Filter::Trilinear => {
                let t = level - whole as f32;
                let fine = self.bilinear(view, whole, at.st);
                if t == 0.0 { fine } else { lerp(fine, self.bilinear(view, whole + 1, at.st), t) }
            }
            Filter::Bilinear | Filter::Ewa(_) => self.bilinear(view, whole, at.st),
        }
    }

    /// Linear between the four nearest texels of a level.
    #[inline]
    pub(super) fn bilinear(&self, view: &View, level: usize, st: Vec2) -> [f32; 4] {
        let p = texels(view, level, st);
        let corner = p.floor();
        let t = p - corner;
        let (x, y) = (corner.x as i64, corner.y as i64);
        let (right, below) = (x.saturating_add(1), y.saturating_add(1));
        let top = lerp(self.texel(view, level, x, y), self.texel(view, level, right, y), t.x);
        let bottom = lerp(self.texel(view, level, x, below), self.texel(view, level, right, below), t.x);
        lerp(top, bottom, t.y)
    }

    /// A texel of a level; those beyond the edge as the wrap mode says.
    #[inline]
    pub(super) fn texel(&self, view: &View, level: usize, x: i64, y: i64) -> [f32; 4] {
        let place = |i: i64, n: usize| match self.wrap {
            _ if (0..n as i64).contains(&i) => Some(i as usize),
            Wrap::Repeat => Some(i.rem_euclid(n as i64) as usize),
            Wrap::Clamp => Some(i.clamp(0, n as i64 - 1) as usize),
            Wrap::Black => None,
        };
        let shape = &view.levels()[level];
        match (place(x, shape.width), place(y, shape.height)) {
            (Some(x), Some(y)) => view.texel(level, x, y),
            _ => [0.0; 4],
        }
    }
}

/// The level of detail whose texels are as large as `extent` texels of the image, between 0 and the last.
#[inline]
pub(super) fn level_of(view: &View, extent: f32) -> f32 {
    let last = view.levels().len() - 1;
    // Also where `extent` is no number.
    if extent > 1.0 { extent.log2().min(last as f32) } else { 0.0 }
}

/// The coordinates in texels of a level, integers at their centres.
#[inline]
pub(super) fn texels(view: &View, level: usize, st: Vec2) -> Vec2 {
    // (0, 0) is the lower left of the texture and the upper left of the image.
    let shape = &view.levels()[level];
    Vec2::new(st.x, 1.0 - st.y) * Vec2::new(shape.width as f32, shape.height as f32) - 0.5
}

#[inline]
pub(super) fn lerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i])
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Vec3};

    use super::*;
    use crate::film::image::Image;
    use crate::material::footprint::Footprint;

    /// Where the texture coordinates are that, and rays cover `duv` to either side.
    fn covering(uv: Vec2, duv: [Vec2; 2]) -> TexturePoint {
        let dp = duv.map(|duv| duv.extend(0.0));
        TexturePoint { p: uv.extend(0.0), n: Vec3::Z, uv, footprint: Footprint { dp, duv } }
    }

    fn at(uv: Vec2) -> TexturePoint {
        TexturePoint { footprint: Footprint::NONE, ..covering(uv, [Vec2::ZERO; 2]) }
    }

    fn map(width: usize, height: usize, channels: usize, pixels: Vec<f32>) -> ImageMap {
        ImageMap {
            image: Arc::new(MipMap::in_memory(Image { width, height, channels, pixels })),
            wrap: Wrap::Repeat,
            filter: Filter::Bilinear,
            mapping: Mapping2d::IDENTITY,
            scale: 1.0,
            invert: false,
            to_rec709: None,
        }
    }

    #[test]
    fn the_first_row_is_the_top_of_the_texture() {
        let map = map(1, 2, 1, vec![1.0, 0.0]);
        assert_eq!(map.float(&at(Vec2::new(0.5, 0.75))), 1.0);
        assert_eq!(map.float(&at(Vec2::new(0.5, 0.25))), 0.0);
        assert_eq!(map.float(&at(Vec2::new(0.5, 0.5))), 0.5);
    }

    #[test]
    fn wrapping_and_filtering() {
        let mut map = map(2, 1, 1, vec![1.0, 3.0]);
        let value = |map: &ImageMap, u: f32| map.float(&at(Vec2::new(u, 0.5)));
        assert_eq!(value(&map, 0.25), 1.0);
        assert_eq!(value(&map, 0.75), 3.0);
        assert_eq!(value(&map, 0.5), 2.0);
        assert_eq!(value(&map, 1.0), 2.0);
        assert_eq!(value(&map, -0.75), 1.0);
        map.wrap = Wrap::Clamp;
        assert_eq!(value(&map, 1.0), 3.0);
        assert_eq!(value(&map, -9.0), 1.0);
        map.wrap = Wrap::Black;
        assert_eq!(value(&map, 1.0), 1.5);
        map.filter = Filter::Point;
        assert_eq!(value(&map, 0.4), 1.0);
        assert_eq!(value(&map, 0.6), 3.0);
        assert_eq!(value(&map, 1.6), 0.0);
    }

    #[test]
    fn placement_scale_and_invert() {
        let mut map = map(4, 1, 1, vec![0.0, 0.25, 0.5, 0.75]);
        map.mapping = Mapping2d::Uv { scale: Vec2::new(2.0, 1.0), delta: Vec2::new(0.125, 0.0) };
        let place = at(Vec2::new(0.25, 0.5));
        map.filter = Filter::Point;
        assert_eq!(map.float(&place), 0.5);
        map.scale = 0.5;
        map.invert = true;
        assert_eq!(map.float(&place), 0.75);
        assert_eq!(map.rgb(&place), Rgb::splat(0.75));
    }

    #[test]
    fn floats_come_from_alpha_or_the_mean() {
        assert_eq!(map(1, 1, 4, vec![0.1, 0.2, 0.3, 0.7]).float(&at(Vec2::ZERO)), 0.7);
        assert!((map(1, 1, 3, vec![0.1, 0.2, 0.6]).float(&at(Vec2::ZERO)) - 0.3).abs() < 1e-6);
        assert_eq!(map(1, 1, 4, vec![0.1, 0.2, 0.3, 0.7]).rgb(&at(Vec2::ZERO)), Rgb::new(0.1, 0.2, 0.3));
        assert_eq!(map(1, 1, 1, vec![0.1]).rgb(&at(Vec2::ZERO)), Rgb::splat(0.1));
    }

    #[test]
    fn coordinates_out_of_all_bounds_do_not_panic() {
        let map = map(3, 2, 1, vec![0.5; 6]);
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30, f32::MIN_POSITIVE] {
            let value = map.float(&at(Vec2::splat(u)));
            assert!(value == 0.5 || value == 0.0);
        }
    }

    /// A board of single black and white texels.
    fn board(size: usize, filter: Filter) -> ImageMap {
        let pixels = (0..size * size).map(|i| ((i % size + i / size) % 2) as f32).collect();
        ImageMap { filter, ..map(size, size, 1, pixels) }
    }

    #[test]
    fn what_covers_many_texels_is_their_mean() {
        let texel = 1.0 / 64.0;
        let places = [Vec2::new(0.21, 0.4), Vec2::new(0.9, 0.05), Vec2::new(0.52, 0.77)];
        for filter in [Filter::Point, Filter::Bilinear, Filter::Trilinear, Filter::Ewa(8.0)] {
            let map = board(64, filter);
            for place in places {
                let fine = covering(place, [Vec2::X * 0.01 * texel, Vec2::Y * 0.01 * texel]);
                let expected = if filter == Filter::Point {
                    map.float(&at(place))
                } else {
                    board(64, Filter::Bilinear).float(&at(place))
                };
                // The ellipse reaches a texel farther to all sides.
                let tolerance = if matches!(filter, Filter::Ewa(_)) { 0.45 } else { 0.0 };
                assert!((map.float(&fine) - expected).abs() <= tolerance, "{filter:?} {place}");
                for wide in [3.0, 20.0, 1e9] {
                    let coarse = covering(place, [Vec2::X * wide * texel, Vec2::Y * wide * texel]);
                    assert!((map.float(&coarse) - 0.5).abs() < 0.02, "{filter:?} {place} {wide}");
                }
            }
        }
    }

    #[test]
    fn levels_go_over_into_each_other() {
        // Black but for one white texel: the wider the ray, the darker, without a step.
        let pixels: Vec<f32> = (0..32 * 32).map(|i| if i == 16 * 32 + 16 { 1.0 } else { 0.0 }).collect();
        for filter in [Filter::Trilinear, Filter::Ewa(8.0)] {
            let map = ImageMap { filter, ..map(32, 32, 1, pixels.clone()) };
            let place = Vec2::new(16.5, 15.5) / 32.0;
            let value = |wide: f32| map.float(&covering(place, [Vec2::X * wide / 32.0, Vec2::Y * wide / 32.0]));
            let mut last = value(0.5);
            for step in 1..400 {
                let next = value(0.5 * 1.01_f32.powi(step));
                assert!((next - last).abs() < 0.05, "{filter:?} {step}: {last} {next}");
                last = next;
            }
            assert!(last < 0.01);
        }
    }

    #[test]
    fn an_ellipse_is_no_wider_than_the_ray() {
        // Stripes along t. A ray that is long along them and thin across sees them; other filters are as wide as it is long.
        let pixels = (0..64 * 64).map(|i| (i % 64 / 8 % 2) as f32).collect::<Vec<f32>>();
        let long = covering(Vec2::new(12.0 / 64.0, 0.5), [Vec2::X * 1.5 / 64.0, Vec2::Y * 12.0 / 64.0]);
        let seen = |filter| ImageMap { filter, ..map(64, 64, 1, pixels.clone()) }.float(&long);
        assert!(seen(Filter::Ewa(8.0)) > 0.97 && seen(Filter::Trilinear) < 0.8);
        // Where it may not be so long, it is made wider.
        assert!(seen(Filter::Ewa(1.0)) < 0.8);
    }

    #[test]
    fn mappings_tell_what_rays_cover() {
        let to_texture = Affine3A::from_scale(Vec3::splat(2.0));
        let planar = Mapping2d::Planar { to_texture, axes: [Vec3::X, Vec3::Y], delta: Vec2::ZERO };
        let point = covering(Vec2::new(1.0, 0.01), [Vec2::new(0.0, -0.02), Vec2::new(0.03, 0.0)]);
        assert!((planar.across(&point).change[1] - Vec2::new(0.06, 0.0)).length() < 1e-5);
        // Across the seam, where the angle begins anew.
        for mapping in [Mapping2d::Spherical(to_texture), Mapping2d::Cylindrical(to_texture)] {
            let change = mapping.across(&point).change[0];
            assert!(change.length() < 0.01 && change.length() > 0.001, "{mapping:?} {change}");
        }
    }
}
