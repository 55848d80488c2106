//! Fresnel reflectance of unpolarised light and Snell's law. Source: pbrt-v4, sections 9.3.4 to 9.3.6 (after Hecht, "Optics").

use glam::Vec3;

use crate::math::Rgb;

/// Reflectance in 0..=1 of a boundary between dielectrics. `eta` is η_inside/η_outside with "outside" on the normal's side;
/// `cos` is the cosine between the normal and the direction of incidence: negative means from inside.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    let (cos_i, eta) = if cos < 0.0 { (-cos, 1.0 / eta) } else { (cos, eta) };
    let cos_i = cos_i.min(1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).max(0.0).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Reflectance of a conductor with relative index η − ik, per channel. `cos` in 0..=1.
///
/// Real arithmetic form: with a² + b² = √((η² − k² − sin²)² + 4η²k²), see Lagarde, "Memo on Fresnel equations", 2013.
#[inline]
pub fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    Rgb::new(conductor_one(cos, eta[0], k[0]), conductor_one(cos, eta[1], k[1]), conductor_one(cos, eta[2], k[2]))
}

#[inline]
fn conductor_one(cos: f32, eta: f32, k: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = (t0 * t0 + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (a2_plus_b2 + t0)).max(0.0).sqrt();
    let t1 = a2_plus_b2 + cos2;
    let t2 = 2.0 * a * cos;
    if t1 + t2 == 0.0 {
        return 1.0;
    }
    let perpendicular = (t1 - t2) / (t1 + t2);
    let t3 = cos2 * a2_plus_b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let parallel = if t3 + t4 == 0.0 { 1.0 } else { perpendicular * (t3 - t4) / (t3 + t4) };
    (0.5 * (perpendicular + parallel)).clamp(0.0, 1.0)
}

/// The k for which a conductor with η = 1 reflects `reflectance` at normal incidence (pbrt-v4's `reflectance` parameter).
#[inline]
pub fn k_from_reflectance(reflectance: Rgb) -> Rgb {
    // At r = 1, k is infinite.
    reflectance.clamp(0.0, 0.9999).map(|r| 2.0 * r.sqrt() / (1.0 - r).sqrt())
}

/// The direction into which `wi` (pointing away from the surface) refracts at normal `n`, and the relative index of
/// refraction along the way, η_t/η_i. `None` for total internal reflection. `eta` as in [`dielectric`].
#[inline]
pub fn refract(wi: Vec3, n: Vec3, eta: f32) -> Option<(Vec3, f32)> {
    let cos = n.dot(wi);
    let (n, cos, eta) = if cos < 0.0 { (-n, -cos, 1.0 / eta) } else { (n, cos, eta) };
    let sin2_i = (1.0 - cos * cos).max(0.0);
    let sin2_t = sin2_i / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((-wi / eta + n * (cos / eta - cos_t), eta))
}

/// The mirror direction of `w` about `n`, both pointing away from the surface.
#[inline]
pub fn reflect(w: Vec3, n: Vec3) -> Vec3 {
    2.0 * w.dot(n) * n - w
}

/// The mean internal reflectance of diffuse light at a smooth boundary of index `eta` ≥ 1 (Egan & Hilgeman's fit, as in
/// Jensen et al. 2001).
#[inline]
pub fn mean_internal(eta: f32) -> f32 {
    (-1.4399 / (eta * eta) + 0.7099 / eta + 0.6681 + 0.0636 * eta).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_is_the_textbook_value() {
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
        assert!((dielectric(-1.0, 1.5) - 0.04).abs() < 1e-6);
        let (eta, k) = (0.2f32, 3.9f32);
        let expected = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((conductor_one(1.0, eta, k) - expected).abs() < 1e-5);
    }

    #[test]
    fn brewster_and_total_reflection() {
        // At Brewster's angle only the perpendicular half is reflected: ((η²−1)/(η²+1))²/2.
        let cos = 1.0 / (1.0f32 + 1.5 * 1.5).sqrt();
        let expected = 0.5 * ((1.5f32 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0)).powi(2);
        assert!((dielectric(cos, 1.5) - expected).abs() < 1e-6);
        assert_eq!(dielectric(-0.5, 1.5), 1.0);
        assert!(refract(Vec3::new(0.75f32.sqrt(), 0.0, -0.5), Vec3::Z, 1.5).is_none());
    }

    #[test]
    fn a_conductor_without_absorption_is_a_dielectric() {
        for i in 1..=20 {
            let cos = i as f32 / 20.0;
            assert!((conductor_one(cos, 1.5, 0.0) - dielectric(cos, 1.5)).abs() < 2e-6, "at {cos}");
        }
    }

    #[test]
    fn reflectance_survives_the_way_through_k() {
        for r in [0.0, 0.04, 0.5, 0.9, 0.99] {
            let k = k_from_reflectance(Rgb::splat(r));
            assert!((conductor(1.0, Rgb::WHITE, k)[0] - r).abs() < 1e-5, "{r}");
        }
    }

    #[test]
    fn refraction_obeys_snell_and_reverses() {
        let wi = Vec3::new(0.6, 0.0, 0.8);
        let (wt, eta) = refract(wi, Vec3::Z, 1.5).unwrap();
        assert!((wt.x + 0.6 / 1.5).abs() < 1e-6 && wt.z < 0.0 && (wt.length() - 1.0).abs() < 1e-6);
        assert_eq!(eta, 1.5);
        let (back, eta) = refract(wt, Vec3::Z, 1.5).unwrap();
        assert!((back - wi).length() < 1e-6 && (eta - 1.0 / 1.5).abs() < 1e-6);
    }

    #[test]
    fn mean_internal_reflectance_fits_quadrature() {
        for eta in [1.1f32, 1.33, 1.5, 1.8] {
            let n = 20_000;
            // ∫ F(cos) 2 cos dcos from inside.
            let sum: f32 = (0..n).map(|i| (i as f32 + 0.5) / n as f32).map(|c| dielectric(-c, eta) * 2.0 * c).sum();
            assert!((sum / n as f32 - mean_internal(eta)).abs() < 0.02, "{eta}");
        }
    }
}
