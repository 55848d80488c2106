//! Normal and bump maps: a shading normal of the material's own, from an image of normals or from the slope of a height.
//! Sources: pbrt-v4, sections 10.5.3 and 10.5.4; Blinn 1978, "Simulation of Wrinkled Surfaces". Only shading changes, no point moves.
//!
//! As in pbrt-v4 the normal is turned into the geometric normal's hemisphere, and what is reflection is decided by it alone, so that light may
//! leak through a surface where the two normals disagree about a direction of incidence. **Ours:** a normal that the viewer
//! would see from behind is bent until it is seen, barely: pbrt-v4 has black spots there. The tangents are those of the surface
//! also where a mesh has normals of its own (pbrt-v4: a bitangent as long as the tangent, across it), and by how much displacing a curved
//! surface stretches it is left out.

use glam::{Vec2, Vec3};

use super::footprint::Footprint;
use super::image_texture::ImageMap;
use super::texture::{FloatInput, Textures};
use super::{MaterialId, Materials, TexturePoint};
use crate::geometry::{Partials, SurfacePoint};
use crate::math::{Frame, Rgb};

/// The least cosine between the viewer and a normal of relief.
const LEAST_COSINE: f32 = 0.01;

/// What a material's surface has.
#[derive(Clone, Debug)]
pub enum Relief {
    /// No relief.
    None,
    /// An image of normals in tangent space, each component stored as (1 + n)/2.
    Normals(ImageMap),
    /// A height along the normal, whose slope is taken over a step of the texture coordinates.
    Heights {
        /// In units of length.
        height: FloatInput,
        /// Steps in u and v, above 0.
        step: Vec2,
    },
}

impl Materials {
    /// Turns the shading normal of `point` as the relief of `material` says. `u` chooses among mixed materials as in [`Materials::bsdf`],
    /// `wo` points away from the surface, `partials` are asked for only where they are needed.
    pub fn emboss(
        &self,
        material: MaterialId,
        point: &mut SurfacePoint,
        wo: Vec3,
        u: f32,
        footprint: &Footprint,
        partials: impl FnOnce() -> Partials,
    ) {
        let at = TexturePoint::new(point, footprint);
        let ns = match &self.reliefs[self.resolve_mix(material, &at, u).0 as usize] {
            Relief::None => return,
            Relief::Normals(map) => map.colour(&at).and_then(|stored| mapped(stored, point)),
            Relief::Heights { height, step } => bumped(height, *step, &at, &self.textures, point.ns, &partials()),
        };
        if let Some(ns) = ns {
            let ns = if ns.dot(point.ng) < 0.0 { -ns } else { ns };
            point.ns = seen(ns, if wo.dot(point.ng) < 0.0 { -wo } else { wo });
        }
    }
}

/// The normal that a map holds, around the shading normal and the tangent of `point`; `None` where it holds none.
#[inline]
fn mapped(stored: Rgb, point: &SurfacePoint) -> Option<Vec3> {
    let local = Vec3::new(stored[0], stored[1], stored[2]) * 2.0 - Vec3::ONE;
    Frame::from_zx(point.ns, point.dpdu).to_world(local).try_normalize()
}

/// The normal of the surface p + d(u, v) n, from its tangents ∂p/∂u + ∂d/∂u n and ∂p/∂v + ∂d/∂v n; `None` where there are no tangents.
fn bumped(
    height: &FloatInput,
    step: Vec2,
    at: &TexturePoint,
    textures: &Textures,
    n: Vec3,
    partials: &Partials,
) -> Option<Vec3> {
    let here = height.evaluate(textures, at);
    let slope = |axis: usize, dp: Vec3| {
        let mut uv = at.uv;
        // As far as the ray's neighbours, where they are farther than a texel (pbrt-v4, section 10.5.4).
        let covered = 0.5 * (at.footprint.duv[0][axis].abs() + at.footprint.duv[1][axis].abs());
        uv[axis] += step[axis].max(covered.min(0.5));
        // What rounding left of the step.
        let step = uv[axis] - at.uv[axis];
        let there = height.evaluate(textures, &TexturePoint { p: at.p + dp * step, uv, ..*at });
        if step > 0.0 { (there - here) / step } else { 0.0 }
    };
    let Partials { dpdu, dpdv } = *partials;
    // Across the shading normal, so that without a slope it stays what it is.
    let along = |dp: Vec3, slope: f32| dp + n * (slope - n.dot(dp));
    let across = along(dpdu, slope(0, dpdu)).as_dvec3().cross(along(dpdv, slope(1, dpdv)).as_dvec3());
    let bumped = across.try_normalize()?.as_vec3();
    Some(if bumped.dot(n) < 0.0 { -bumped } else { bumped })
}

/// `n` as it is where its cosine to `w` is at least [`LEAST_COSINE`], else bent towards `w` to have that.
#[inline]
fn seen(n: Vec3, w: Vec3) -> Vec3 {
    let cos = n.dot(w);
    if cos >= LEAST_COSINE {
        return n;
    }
    match (n - w * cos).try_normalize() {
        Some(across) => across * (1.0 - LEAST_COSINE * LEAST_COSINE).sqrt() + w * LEAST_COSINE,
        None => w,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::image::Image;
    use crate::material::image_texture::{Filter, Wrap};
    use crate::material::mip_map::MipMap;
    use crate::material::texture::FloatTexture;
    use crate::material::texture_mapping::Mapping2d;
    use std::sync::Arc;

    /// An image map of one row that rises from 0 to 1 over u, from texel centre to texel centre.
    fn ramp() -> ImageMap {
        let pixels = (0..=100).map(|i| i as f32 / 100.0).collect();
        ImageMap {
            image: Arc::new(MipMap::in_memory(Image { width: 101, height: 1, channels: 1, pixels })),
            wrap: Wrap::Clamp,
            filter: Filter::Bilinear,
            mapping: Mapping2d::IDENTITY,
            scale: 1.0,
            invert: false,
            to_rec709: None,
        }
    }

    #[test]
    fn a_ramp_tilts_the_normal_by_its_slope() {
        let mut textures = Textures::default();
        let map = ramp();
        let step = map.half_texel();
        assert!((step.x - 0.5 / 101.0).abs() < 1e-7 && step.y == 0.5);
        let height = FloatInput::Texture(textures.add_float(FloatTexture::Image(Arc::new(map)), 1));
        let at = TexturePoint { p: Vec3::ZERO, n: Vec3::Z, uv: Vec2::new(0.3, 0.5), footprint: Footprint::NONE };
        // The height rises by 1.01 over a unit of u, which is 4 long.
        for dpdu in [Vec3::new(4.0, 0.0, 0.0), Vec3::new(0.0, -4.0, 0.0), Vec3::new(4.0, 0.0, 7.0)] {
            let partials = Partials { dpdu, dpdv: dpdu.cross(Vec3::Z) * 3.0 };
            for n in [Vec3::Z, -Vec3::Z] {
                let flat = Vec3::new(dpdu.x, dpdu.y, 0.0) / 4.0;
                let expected = (n * 4.0 - flat * 1.01).normalize();
                let found = bumped(&height, step, &at, &textures, n, &partials).expect("there are tangents");
                assert!((found - expected).length() < 1e-4, "{dpdu} {n}: {found} {expected}");
            }
        }
        let flat = Partials { dpdu: Vec3::ZERO, dpdv: Vec3::Y };
        assert_eq!(bumped(&FloatInput::Constant(1.0), step, &at, &textures, Vec3::Z, &flat), None);
    }

    #[test]
    fn normals_are_seen_by_the_viewer() {
        let n = Vec3::new(0.6, 0.0, 0.8);
        assert_eq!(seen(n, Vec3::Z), n);
        for w in [Vec3::new(-0.95, 0.0, 0.1).normalize(), Vec3::new(-0.8, 0.0, 0.6), -n] {
            let bent = seen(n, w);
            assert!((bent.dot(w) - LEAST_COSINE).abs() < 1e-5 || bent == w, "{w}: {bent}");
            assert!((bent.length() - 1.0).abs() < 1e-5);
        }
        // Both kinds of normals agree where the limit is met.
        let w = Vec3::new(-0.8, 0.0, 0.6 + 1.25 * LEAST_COSINE).normalize();
        assert!((seen(n, w) - n).length() < 1e-3);
    }
}
