//! From render space to a grid's index space: affine maps, and OpenVDB's tapered frustum
//! (source: OpenVDB's documentation of `NonlinearFrustumMap`). Composed in double precision, so that a grid far from the
//! world's origin keeps its place.

use glam::{DAffine3, DVec3, Vec3};

/// The tapering part of a frustum map: index space to the unit-width frustum that an affine map then places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Low corner of the box in index space.
    pub min: DVec3,
    /// High corner.
    pub max: DVec3,
    /// Width of the near plane over that of the far plane.
    pub taper: f64,
    /// Depth in widths of the near plane.
    pub depth: f64,
}

impl Frustum {
    fn gamma(&self) -> f64 {
        (1.0 / self.taper - 1.0) / self.depth
    }

    /// Whether the parameters describe a frustum at all.
    pub fn is_valid(&self) -> bool {
        let size = self.max - self.min;
        size.is_finite() && size.min_element() > 0.0 && self.gamma().is_finite() && self.depth != 0.0
    }

    /// Index space to frustum space.
    pub fn forward(&self, index: DVec3) -> DVec3 {
        let size = self.max - self.min;
        let p = index - self.min - DVec3::new(0.5 * size.x, 0.5 * size.y, 0.0);
        let z = p.z * self.depth / size.z;
        let scale = (self.gamma() * z + 1.0) / size.x;
        DVec3::new(p.x * scale, p.y * scale, z)
    }

    /// Frustum space to index space; `None` at or behind the apex.
    pub fn inverse(&self, p: DVec3) -> Option<DVec3> {
        let size = self.max - self.min;
        let s = self.gamma() * p.z + 1.0;
        if !(s > 0.0) {
            return None;
        }
        let unscale = size.x / s;
        let q = DVec3::new(p.x * unscale + 0.5 * size.x, p.y * unscale + 0.5 * size.y, p.z * size.z / self.depth);
        Some(q + self.min)
    }
}

/// A grid's place in render space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexMap {
    /// Render space to index space, or to frustum space where there is a frustum.
    local_from_render: DAffine3,
    render_from_local: DAffine3,
    frustum: Option<Frustum>,
}

impl IndexMap {
    /// The map whose inverse is `render_from_local` after the frustum, if any; `None` if it cannot be inverted.
    pub fn new(render_from_local: DAffine3, frustum: Option<Frustum>) -> Option<Self> {
        let local_from_render = render_from_local.inverse();
        let usable = render_from_local.is_finite() && local_from_render.is_finite();
        (usable && render_from_local.matrix3.determinant() != 0.0 && frustum.is_none_or(|f| f.is_valid()))
            .then_some(Self { local_from_render, render_from_local, frustum })
    }

    /// Whether straight lines stay straight.
    pub fn is_linear(&self) -> bool {
        self.frustum.is_none()
    }

    /// The index position of a point of render space.
    #[inline]
    pub fn to_index(&self, p: Vec3) -> Option<DVec3> {
        let local = self.local_from_render.transform_point3(p.as_dvec3());
        match &self.frustum {
            None => Some(local),
            Some(frustum) => frustum.inverse(local),
        }
    }

    /// The point of render space at an index position.
    pub fn to_render(&self, index: DVec3) -> DVec3 {
        self.render_from_local.transform_point3(self.frustum.map_or(index, |f| f.forward(index)))
    }

    /// The affine part, render space to local space.
    pub fn local_from_render(&self) -> &DAffine3 {
        &self.local_from_render
    }

    /// A box of render space that holds the image of the box `low..=high` of index space. (Linear in each
    /// index coordinate alone, so the corners bound the image.)
    pub fn render_box(&self, low: DVec3, high: DVec3) -> (DVec3, DVec3) {
        box_of_corners(low, high, |p| self.to_render(p))
    }
}

/// The bounding box of the images of a box's corners.
pub fn box_of_corners(low: DVec3, high: DVec3, image: impl Fn(DVec3) -> DVec3) -> (DVec3, DVec3) {
    let mut result = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let p = image(DVec3::new(pick(0), pick(1), pick(2)));
        result = (result.0.min(p), result.1.max(p));
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frustum_maps_invert() {
        let frustum =
            Frustum { min: DVec3::new(-3.0, 2.0, 5.0), max: DVec3::new(61.0, 40.0, 90.0), taper: 0.25, depth: 1.7 };
        let place = DAffine3::from_translation(DVec3::new(5.0, -7.0, 1e6)) * DAffine3::from_scale(DVec3::splat(2.5));
        let map = IndexMap::new(place, Some(frustum)).expect("invertible");
        let index = DVec3::new(10.5, 30.25, 77.0);
        let there = map.to_render(index);
        let back = frustum.inverse(map.local_from_render().transform_point3(there)).expect("in front of the apex");
        assert!((back - index).length() < 1e-6, "{back} is not {index}");
        // The far face is 1/taper times as wide as the near one.
        let width = |z| frustum.forward(DVec3::new(61.0, 21.0, z)).x - frustum.forward(DVec3::new(-3.0, 21.0, z)).x;
        assert!((width(5.0) - 1.0).abs() < 1e-12);
        assert!((width(90.0) - 4.0).abs() < 1e-12);
    }
}
