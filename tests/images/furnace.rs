//! White furnaces: whatever neither absorbs nor emits cannot be told from a surrounding of radiance 1. Every test renders through the whole
//! program. Assertions fail by chance with probability 1e-6 each (see `common::assert_mean`), and none is made on an image
//! whose standard error is above 0.3 %, mostly much less; where nothing is gained but something may be lost, the error may be up to 0.5 %, and means above 1 by
//! five standard errors fail (by chance with probability 3e-7 each).

use crate::common::{CUBE, Framed, SLACK, Shot, View, boundary, integrate, shuffled_grid};
use std::f64::consts::PI;

/// An environment of radiance 1.
const DOME: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
const SPHERE: &str = "Shape \"sphere\" \"float radius\" 1\n";
/// Bounces without limit in practice.
const FOREVER: u32 = 2_000_000_000;

fn shot() -> Shot {
    Shot { depth: FOREVER, size: 8, ..Shot::default() }
}

fn white(what: &str, shot: &impl View, world: &str, spp: u32) {
    shot.assert(what, &format!("{DOME}{world}"), spp, [1.0; 3], 3e-3);
}

#[test]
fn surfaces_that_absorb_nothing_are_invisible() {
    let materials = [
        ("diffuse", "Material \"diffuse\" \"rgb reflectance\" [1 1 1]\n", 256),
        ("dielectric", "Material \"dielectric\" \"float eta\" 1.5\n", 64),
        ("dense dielectric", "Material \"dielectric\" \"float eta\" 2.4\n", 64),
        ("pane", "Material \"thindielectric\"\n", 64),
        (
            "cloth",
            "Material \"diffusetransmission\" \"rgb reflectance\" [0.3 0.3 0.3] \"rgb transmittance\" [0.7 0.7 0.7]\n",
            600,
        ),
        ("hair", "Material \"hair\" \"rgb sigma_a\" [0 0 0]\n", 600),
        ("dielectric of index 1", "Material \"dielectric\" \"float eta\" 1\n", 16),
        (
            "mix",
            "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [1 1 1]
             MakeNamedMaterial \"b\" \"string type\" \"dielectric\"
             Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 0.3\n",
            256,
        ),
    ];
    for (name, material, spp) in materials {
        white(&format!("{name} sphere"), &shot(), &format!("{material}{SPHERE}"), spp);
        white(&format!("{name} cube"), &shot(), &format!("{material}Rotate 30 1 2 3 {}", CUBE), spp);
    }
}

/// pbrt's `reflectance` of a conductor stops at 0.9999, whose index is given back by the inverse of Fresnel's formula.
#[test]
fn a_smooth_conductor_reflects_what_its_fresnel_term_says() {
    for r in [1.0, 0.5f64] {
        let k = (r.min(0.9999)).sqrt() * 2.0 / (1.0 - r.min(0.9999)).sqrt();
        // A sphere's points at distance b from the axis are seen at sin θ = b; here only its middle fills the image.
        let fresnel = |cosine: f64| {
            let (c2, s2) = (cosine * cosine, 1.0 - cosine * cosine);
            let t0 = 1.0 - k * k - s2;
            let ab = (t0 * t0 + 4.0 * k * k).sqrt();
            let a = ((0.5 * (ab + t0)).max(0.0)).sqrt();
            let rs = (ab + c2 - 2.0 * cosine * a) / (ab + c2 + 2.0 * cosine * a);
            let rp = rs * (c2 * ab + s2 * s2 - 2.0 * cosine * a * s2) / (c2 * ab + s2 * s2 + 2.0 * cosine * a * s2);
            0.5 * (rs + rp)
        };
        for angle in [0.0, 60.0, 85.0f64] {
            let (mean, _) = tilted(angle)
                .mean(&format!("{DOME}Material \"conductor\" \"rgb reflectance\" [{r} {r} {r}]\n{PLATE}"), 16);
            let expected = fresnel(angle.to_radians().cos());
            assert!((mean[0] - expected).abs() < 2e-4, "r = {r} at {angle}°: {} instead of {expected}", mean[0]);
        }
    }
}

const PLATE: &str = "Shape \"disk\" \"float radius\" 50\n";

/// A camera far away that sees the plane z = 0 at an angle to its normal, over a field so narrow that the angle is the same in all pixels.
fn tilted(angle: f64) -> Shot {
    let (s, c) = angle.to_radians().sin_cos();
    Shot { from: [100.0 * s, 0.0, 100.0 * c], fov: 0.1, ..shot() }
}

/// Smith's Λ for an isotropic Trowbridge-Reitz distribution.
fn lambda(alpha: f64, cosine: f64) -> f64 {
    let tan2 = (1.0 - cosine * cosine) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// What single scattering among microfacets sends on from a direction at `cosine` to the normal, as two parts: reflected and
/// refracted. `fresnel` gives the reflectance for the cosine at the facet, `eta` is the index beyond.
/// The integral is over facets: ρ = ∫ D(m) (o·m)/cos θ_o · R · G₂(o, i) dm (Walter et al. 2007 with i as the variable changed to m).
fn facets(alpha: f64, cosine: f64, eta: f64, fresnel: impl Fn(f64) -> f64) -> [f64; 2] {
    let o = [(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
    let g2 = |i_cosine: f64| 1.0 / (1.0 + lambda(alpha, cosine) + lambda(alpha, i_cosine));
    let part = |which: usize| {
        // tan θ_m = α tan ψ makes D cos θ_m dm = 2 sin ψ cos ψ dψ dφ / (2π), which is smooth for every α.
        integrate(0.0, PI / 2.0, 60, |psi| {
            let tan = alpha * psi.tan();
            let cos_m = 1.0 / (1.0 + tan * tan).sqrt();
            let sin_m = tan * cos_m;
            let d_cos = psi.sin() * psi.cos() / PI;
            integrate(0.0, PI, 60, |phi| {
                let m = [sin_m * phi.cos(), sin_m * phi.sin(), cos_m];
                let om = o[0] * m[0] + o[2] * m[2];
                if om <= 0.0 {
                    return 0.0;
                }
                let r = fresnel(om);
                let (i_z, share) = if which == 0 {
                    (2.0 * om * cos_m - cosine, r)
                } else {
                    let cos_t = (1.0 - (1.0 - om * om) / (eta * eta)).max(0.0).sqrt();
                    (-(((om / eta) - cos_t) * cos_m - cosine / eta), 1.0 - r)
                };
                if i_z <= 0.0 {
                    return 0.0;
                }
                2.0 * d_cos / cos_m * om / cosine * share * g2(i_z)
            })
        })
    };
    [part(0), if eta > 0.0 { part(1) } else { 0.0 }]
}

fn fresnel_dielectric(cosine: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cosine * cosine) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let parallel = (eta * cosine - t) / (eta * cosine + t);
    let perpendicular = (cosine - eta * t) / (cosine + eta * t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Rough surfaces scatter once: what bounces into the surface again is lost. The loss must be the one that the integral over facets gives.
#[test]
fn rough_surfaces_lose_what_theory_says() {
    for alpha in [0.1, 0.5, 1.0] {
        for angle in [0.0, 45.0, 80.0f64] {
            let cosine = angle.to_radians().cos();
            let rough = format!("\"float roughness\" {alpha} \"bool remaproughness\" false");

            let metal = format!("Material \"conductor\" \"rgb k\" [1e4 1e4 1e4] \"rgb eta\" [1 1 1] {rough}\n");
            // k = 1e4 absorbs less than 4e-4 at normal incidence.
            let [expected, _] = facets(alpha, cosine, 0.0, |_| 1.0);
            let (mean, error) = tilted(angle).mean(&format!("{DOME}{metal}{PLATE}"), 1024);
            crate::common::assert_mean(&format!("metal {alpha} at {angle}°"), mean[0], error[0], expected, 8e-4);

            let glass = format!("Material \"dielectric\" \"float eta\" 1.5 {rough}\n");
            let [reflected, refracted] = facets(alpha, cosine, 1.5, |c| fresnel_dielectric(c, 1.5));
            // The radiance behind the boundary is 1 in a medium of index 1.5: it is thinned by the index squared on its way out.
            let expected = reflected + refracted / 2.25;
            let (mean, error) = tilted(angle).mean(&format!("{DOME}{glass}{PLATE}"), 1024);
            assert!(error[0] < 3e-3 * expected);
            crate::common::assert_mean(&format!("glass {alpha} at {angle}°"), mean[0], error[0], expected, 1e-4);
        }
    }
}

/// In the limit of no roughness nothing is lost.
#[test]
fn slightly_rough_glass_is_nearly_invisible() {
    let world =
        format!("{DOME}Material \"dielectric\" \"float roughness\" 0.02 \"bool remaproughness\" false\n{SPHERE}");
    let (mean, error) = Shot { fov: 12.0, ..shot() }.mean(&world, 256);
    crate::common::assert_mean("glass", mean[0], error[0], 1.0, 2e-3);
}

/// A smooth coat of no thickness over white diffuse: nothing is absorbed, if walks in the coat may be long.
#[test]
fn a_coat_over_white_loses_nothing() {
    let world = |depth: u32| {
        format!(
            "{DOME}Material \"coateddiffuse\" \"rgb reflectance\" [1 1 1] \"float roughness\" 0
             \"float thickness\" 0 \"integer maxdepth\" {depth} \"integer nsamples\" 1\n{SPHERE}"
        )
    };
    shot().assert("coat", &world(1000), 1024, [1.0; 3], 3e-3);
}

/// Tilted normals turn some light away from where it can go: a white surface may lose by them, and does not gain; nor does what stands for materials that are
/// not modelled. But where glass is tilted, what is refracted may stay on its side and what is reflected change over: radiance that is not scaled by the index
/// squared when it should be, or is when it should not.
#[test]
fn relief_and_stand_ins_gain_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("normals.pfm");
    // Tilted by up to 40° to four sides.
    let mut pfm = b"PF\n2 2\n-1.0\n".to_vec();
    for [x, y] in [[0.6f32, 0.0], [0.0, 0.6], [-0.3, 0.0], [0.0, -0.5]] {
        let z = (1.0 - x * x - y * y).sqrt();
        pfm.extend([x, y, z].map(|c| 0.5 * c + 0.5).into_iter().flat_map(f32::to_le_bytes));
    }
    std::fs::write(&path, pfm).expect("it can be written");
    let map = format!("\"string normalmap\" \"{}\"", path.display());
    let bumps = "Texture \"h\" \"float\" \"wrinkled\" Texture \"s\" \"float\" \"scale\" \"float scale\" 0.1 \"texture tex\" \"h\"\n";
    let bump = "\"texture displacement\" \"s\"";
    let white = "\"rgb reflectance\" [1 1 1]";
    for (what, material, [least, most]) in [
        ("a map of normals", format!("Material \"diffuse\" {white} {map}"), [0.85, 1.0]),
        ("a map of normals on glass", format!("Material \"dielectric\" {map}"), [0.6, 1.02]),
        ("bumps", format!("{bumps}Material \"diffuse\" {white} {bump}"), [0.85, 1.0]),
        (
            "bumps on a coat",
            format!("{bumps}Material \"coateddiffuse\" {white} \"integer maxdepth\" 1000 {bump}"),
            [0.6, 1.0],
        ),
        ("matter that absorbs nothing", "Material \"subsurface\" \"rgb reflectance\" [1 1 1]".to_owned(), [0.95, 1.0]),
        ("matter by its name", "Material \"subsurface\" \"string name\" \"Spectralon\"".to_owned(), [0.95, 1.0]),
        ("what was measured", "Material \"measured\"".to_owned(), [0.2, 1.0]),
    ] {
        for shape in [SPHERE, CUBE] {
            let (mean, error) = shot().mean(&format!("{DOME}{material}\n{shape}"), 512);
            println!("{what}: {mean:?} ± {error:?}");
            for (mean, error) in mean.into_iter().zip(error) {
                assert!(error < 5e-3 && mean > least && mean < most + 5.0 * error + SLACK, "{what}: {mean} ± {error}");
            }
        }
    }
}

/// A closed room whose walls emit 1 − ρ and reflect ρ is at radiance 1 everywhere.
#[test]
fn closed_rooms_are_uniform() {
    for reflectance in [0.2, 0.7] {
        let light = 1.0 - reflectance;
        for (name, shape) in [("sphere", SPHERE), ("cube", CUBE)] {
            let world = format!(
                "AreaLightSource \"diffuse\" \"rgb L\" [{light} {light} {light}] \"bool twosided\" true
                 Material \"diffuse\" \"rgb reflectance\" [{reflectance} {reflectance} {reflectance}]\n{shape}"
            );
            let inside = Shot { from: [0.2, 0.1, -0.5], to: [0.3, 0.0, 0.4], fov: 90.0, ..shot() };
            inside.assert(&format!("{name} of {reflectance}"), &world, 1024, [1.0; 3], 3e-3);
        }
    }
}

/// A medium named "m" of albedo 1.
fn homogeneous(density: f64, g: f64) -> String {
    format!(
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [1 1 1]
         \"float scale\" {density} \"float g\" {g}\n"
    )
}

fn filled(medium: &str, shape: &str) -> String {
    boundary(medium, "", shape)
}

#[test]
fn a_sphere_of_white_medium_is_invisible_at_any_density() {
    for (density, spp) in [(1e-6, 4), (1e-2, 16), (0.3, 160), (3.0, 640), (30.0, 640)] {
        let world = format!("{}{}", homogeneous(density, 0.0), filled("m", SPHERE));
        white(&format!("density {density}"), &shot(), &world, spp);
    }
    for density in [1e-6, 1e-4, 1e-2, 1.0, 10.0, 100.0, 1e3] {
        let world = format!("{SHELL}{}{}", homogeneous(density, 0.0), filled("m", SPHERE));
        exact(&format!("density {density}"), &shot(), &world, 8);
    }
}

/// Glass without refraction hides the surrounding from light sampling: paths find it by themselves, and each must bring back exactly 1.
const SHELL: &str =
    "AttributeBegin Material \"dielectric\" \"float eta\" 1 Shape \"sphere\" \"float radius\" 3 AttributeEnd\n";

fn exact(what: &str, shot: &Shot, world: &str, spp: u32) {
    let (mean, error) = shot.mean(&format!("{DOME}{world}"), spp);
    println!("{what}: {mean:?} ± {error:?}");
    assert!(mean.iter().all(|m| (m - 1.0).abs() < 1e-4), "{what}: {mean:?} ± {error:?}");
}

/// From far away the position of a collision is rounded to a thousandth of the sphere's radius. None may end up beyond the boundary.
#[test]
fn a_distant_white_medium_is_invisible() {
    let world = format!("{}{}", homogeneous(20.0, 0.0), filled("m", SPHERE));
    let far = Shot { from: [0.0, 0.0, -1e4], fov: 0.012, depth: 10_000, ..shot() };
    exact("far away", &far, &format!("{SHELL}{world}"), 64);
}

#[test]
fn a_white_medium_is_invisible_at_any_anisotropy() {
    for g in [-0.9, 0.5, 0.9, 0.99] {
        for density in [1.0, 10.0] {
            let world = format!("{}{}", homogeneous(density, g), filled("m", SPHERE));
            white(&format!("g {g}, density {density}"), &shot(), &world, 512);
        }
        let world = format!("{SHELL}{}{}", homogeneous(100.0, g), filled("m", SPHERE));
        exact(&format!("g {g}"), &shot(), &world, 8);
    }
}

#[test]
fn a_camera_in_a_white_medium_sees_nothing() {
    // Declared or not.
    for before in ["", "MediumInterface \"\" \"m\""] {
        let shot = Shot { from: [0.1, 0.2, -0.3], fov: 80.0, ..shot() };
        let within = Framed { shot, before, ..Framed::default() };
        let world = format!("{}{}", homogeneous(4.0, 0.5), filled("m", SPHERE));
        white("within", &within, &world, 640);
    }
}

/// A grid over the box from −1 to 1.
fn grid(name: &str, scale: f64, [r, g, b]: [f64; 3]) -> String {
    shuffled_grid(name, &format!("\"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [{r} {g} {b}] \"float scale\" {scale}"))
}

#[test]
fn white_grids_are_invisible() {
    for (scale, spp) in [(0.1, 32), (3.0, 640)] {
        let world = format!("Rotate 40 1 2 3\n{}{}", grid("m", scale, [1.0; 3]), filled("m", CUBE));
        white(&format!("grid × {scale}"), &shot(), &world, spp);
    }
    for scale in [1e-3, 1.0, 100.0, 1e3] {
        let world = format!("{SHELL}Rotate 40 1 2 3\n{}{}", grid("m", scale, [1.0; 3]), filled("m", CUBE));
        exact(&format!("grid × {scale}"), &shot(), &world, 8);
    }
}

#[test]
fn chromatic_white_media_are_white() {
    // The extinction of the channels differs by 50; nothing absorbs in any.
    let media = [
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [0.1 1 5]\n"
            .to_owned(),
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [0 1 5]\n"
            .to_owned(),
        grid("m", 5.0, [0.1, 0.5, 1.0]),
    ];
    for medium in media {
        let world = format!("{medium}{}", filled("m", CUBE));
        shot().assert("chromatic", &format!("{DOME}{world}"), 4000, [1.0; 3], 4e-3);
    }
}

#[test]
fn overlapping_and_nested_white_media_are_invisible() {
    let second = "MakeNamedMedium \"n\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [2 3 4] \"float g\" 0.6\n";
    let shifted = format!("Translate 0.5 0.3 0\n{SPHERE}");
    let overlapping = format!(
        "{}{second}{}{}{}",
        homogeneous(2.0, -0.5),
        grid("k", 2.0, [1.0; 3]),
        filled("m", SPHERE),
        filled("n", &shifted)
    );
    white("overlap", &shot(), &format!("{overlapping}{}", filled("k", CUBE)), 2400);

    let nested = format!(
        "{}{second}{}AttributeBegin MediumInterface \"n\" \"m\" Material \"interface\" Scale 0.5 0.5 0.5 {SPHERE} AttributeEnd\n",
        homogeneous(1.0, 0.3),
        filled("m", SPHERE)
    );
    white("nested", &shot(), &nested, 800);

    let in_glass = format!(
        "{}AttributeBegin MediumInterface \"m\" \"\" Material \"dielectric\" \"float eta\" 1.5 {SPHERE} AttributeEnd\n",
        homogeneous(1.0, 0.3)
    );
    white("in glass", &shot(), &in_glass, 128);
}

/// A medium without end in which nothing is absorbed, around a white closed room with an interface sphere and glass in it.
#[test]
fn a_medium_that_fills_everything_is_uniform_in_a_closed_room() {
    let world = format!(
        "{}MakeNamedMedium \"n\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [5 5 5]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [0.5 0.5 0.5] \"bool twosided\" true Scale 3 3 3
         Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] {} AttributeEnd
         AttributeBegin MediumInterface \"n\" \"m\" Material \"interface\" Scale 0.7 0.7 0.7 {SPHERE} AttributeEnd
         AttributeBegin MediumInterface \"\" \"m\" Material \"interface\" Translate 1.5 0 0 Scale 0.5 0.5 0.5 {SPHERE} AttributeEnd
         AttributeBegin MediumInterface \"n\" \"m\" Material \"dielectric\" Translate -1.5 0 0 Scale 0.5 0.5 0.5 {SPHERE} AttributeEnd\n",
        homogeneous(0.4, 0.5),
        CUBE
    );
    let shot = Shot { from: [0.0, 0.5, -2.7], fov: 70.0, ..shot() };
    let inside = Framed { shot, before: "MediumInterface \"\" \"m\"", ..Framed::default() };
    inside.assert("filled room", &world, 800, [1.0; 3], 3e-3);
}

/// A medium without end that one channel does not notice: paths end, and that channel is what it would be without.
#[test]
fn clear_channels_of_endless_media_pass() {
    let world = format!(
        "{DOME}MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0.5] \"rgb sigma_s\" [0 1 0.5]
         Material \"diffuse\" \"rgb reflectance\" [1 1 1] {SPHERE}"
    );
    let shot = Shot { depth: 20, ..shot() };
    let within = Framed { shot, before: "MediumInterface \"\" \"m\"", ..Framed::default() };
    let (mean, error) = within.mean(&world, 256);
    crate::common::assert_mean("clear", mean[0], error[0], 1.0, SLACK);
    // Nothing arrives through an infinite depth.
    assert!(mean[1] < 1e-6 && mean[2] < 1e-6, "{mean:?}");
}

#[test]
fn instances_of_white_media_are_invisible() {
    let object = format!("{}ObjectBegin \"o\"\n{}ObjectEnd\n", homogeneous(3.0, 0.2), filled("m", SPHERE));
    let still = "AttributeBegin Translate -0.6 0 0 Rotate 20 0 0 1 Scale 0.6 0.9 0.7 ObjectInstance \"o\" AttributeEnd
                 AttributeBegin Translate 0.4 0 0.3 Scale -0.6 0.6 0.6 ObjectInstance \"o\" AttributeEnd\n";
    white("instances", &shot(), &format!("{object}{still}"), 512);

    let moving = "AttributeBegin ActiveTransform EndTime Translate 0.8 0.2 0 Rotate 50 0 1 1 ActiveTransform All Scale 0.5 0.8 0.5
                  ObjectInstance \"o\" AttributeEnd\n";
    white("moving instance", &shot(), &format!("{object}{moving}"), 512);
    white("both", &shot(), &format!("{object}{still}{moving}"), 512);
}

/// A grey medium under Russian roulette: what it removes on average it adds elsewhere. The yardstick is a path tracer written for this case:
/// isotropic scattering in a sphere under radiance 1 from everywhere, without roulette.
#[test]
fn roulette_keeps_the_mean() {
    for (albedo, density) in [(0.5, 4.0), (0.9, 20.0)] {
        let (sigma_a, sigma_s) = ((1.0 - albedo) * density, albedo * density);
        let world = format!(
            "{DOME}MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{sigma_a} {sigma_a} {sigma_a}]
             \"rgb sigma_s\" [{sigma_s} {sigma_s} {sigma_s}]\n{}",
            filled("m", SPHERE)
        );
        // Seen from so far that all rays are parallel, within the sphere's silhouette.
        let shot = Shot { from: [0.0, 0.0, -1000.0], fov: 0.08, ..shot() };
        let half = 1000.0 * (0.04f64).to_radians().tan();
        let (mean, error) = shot.mean(&world, 4000);
        let (expected, expected_error) = random_walks(albedo, density, half, 800_000);
        let both = error[0].hypot(expected_error);
        println!("{} ± {} vs {expected} ± {expected_error}", mean[0], error[0]);
        assert!(both < 4e-3 * expected, "{both} of {expected}");
        crate::common::assert_mean(&format!("albedo {albedo}"), mean[0], both, expected, SLACK);
    }
}

/// Mean and standard error of albedo^(number of collisions) for walks that enter the unit sphere in parallel over a square.
fn random_walks(albedo: f64, density: f64, half: f64, count: u64) -> (f64, f64) {
    let mut state = 7u64;
    let mut uniform = || {
        // SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..count {
        let (x, y) = (half * (2.0 * uniform() - 1.0), half * (2.0 * uniform() - 1.0));
        let mut p = [x, y, -(1.0 - x * x - y * y).sqrt()];
        let mut d = [0.0, 0.0, 1.0];
        let mut weight = 1.0;
        loop {
            let t = -(1.0 - uniform()).ln() / density;
            for k in 0..3 {
                p[k] += t * d[k];
            }
            if p.iter().map(|v| v * v).sum::<f64>() >= 1.0 {
                break;
            }
            weight *= albedo;
            let z = 2.0 * uniform() - 1.0;
            let (s, c) = (2.0 * PI * uniform()).sin_cos();
            let r = (1.0 - z * z).sqrt();
            d = [r * c, r * s, z];
        }
        sum += weight;
        squares += weight * weight;
    }
    let mean = sum / count as f64;
    (mean, ((squares / count as f64 - mean * mean) / count as f64).sqrt())
}
