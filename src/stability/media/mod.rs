//! Media: extinctions of eighteen decades side by side, steep gradients, albedo 1 and nearly 1, |g| → 1, huge, tiny, sparse and far-away ones.

mod emission;
mod scattering;
mod transmission;

use super::case::Case;
use super::scene::{CUBE, DOME, FOREVER, Shot, boundary};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "media.stiff",
        checks: "Absorbing blocks of one size side by side, extinctions from 1e-9 to 1e9 (homogeneous) and to 1e5 (grids), transmit by Beer's law.",
        seconds: 2.0,
        known: None,
        run: transmission::stiff,
    },
    Case {
        name: "media.stiff-white",
        checks: "White blocks side by side, extinctions from 1e-9 to 1e3, are invisible under a white sky.",
        seconds: 2.0,
        known: None,
        run: scattering::stiff_white,
    },
    Case {
        name: "media.gradient",
        checks: "Densities that change by twelve decades from one voxel to the next transmit what quadrature says, to the camera and to shadow rays.",
        seconds: 1.5,
        known: None,
        run: transmission::gradient,
    },
    Case {
        name: "media.deep-paths",
        checks: "Paths of more than 10,000 bounces in a white ball bring back exactly 1, and on average with light sampling.",
        seconds: 12.0,
        known: None,
        run: scattering::deep_paths,
    },
    Case {
        name: "media.nearly-white",
        checks: "Half-spaces of albedo 0.99, 0.999 and 0.9999 reflect what Chandrasekhar's H function says.",
        seconds: 3.0,
        known: None,
        run: scattering::nearly_white,
    },
    Case {
        name: "media.lobes",
        checks: "Lobes of |g| from 0.9 to 0.999, thin and dense, neither gain nor lose: exactly where paths find the light, on average where lights are sampled.",
        seconds: 8.0,
        known: None,
        run: scattering::lobes,
    },
    Case {
        name: "media.colours",
        checks: "Media whose extinction is 1000 times as large in one channel as in another transmit by Beer's law in each, and are invisible if white.",
        seconds: 1.0,
        known: None,
        run: transmission::colours,
    },
    Case {
        name: "media.split",
        checks: "A medium cut into two that touch, or into two of half its coefficients in one place, is the medium.",
        seconds: 1.2,
        known: None,
        run: scattering::split,
    },
    Case {
        name: "media.sizes",
        checks: "Balls of radius 1e-8 to 1e8 and of optical depth 1 around the camera transmit 1/e.",
        seconds: 0.3,
        known: None,
        run: transmission::sizes,
    },
    Case {
        name: "media.glow",
        checks: "Slabs of depth 2e-9 to 2e3 that emit as much as makes their radiance 1 have radiance 1.",
        seconds: 3.0,
        known: None,
        run: emission::glow,
    },
    Case {
        name: "media.fire",
        checks: "Fires of depth 1e-6 to 10 light a floor alike as lights and found by chance.",
        seconds: 1.5,
        known: None,
        run: emission::fire,
    },
    Case {
        name: "media.one-voxel",
        checks: "Grids of one voxel, 1e-6 to 1e6 large and as far away as the camera sees them alike, transmit what trilinear interpolation says.",
        seconds: 0.3,
        known: None,
        run: transmission::one_voxel,
    },
    Case {
        name: "media.nothing",
        checks: "Media without density, without coefficients, or with denormal ones, are not there.",
        seconds: 0.2,
        known: None,
        run: transmission::nothing,
    },
    Case {
        name: "media.far",
        checks: "Smoke and lamps are the same a million and a thousand million units away.",
        seconds: 0.4,
        known: None,
        run: scattering::far,
    },
    Case {
        name: "media.sparse",
        checks: "Two clouds of 64³ voxels, 2 million voxels apart in one OpenVDB grid, transmit 1/e each; the void between them takes no steps.",
        seconds: 1.2,
        known: None,
        run: transmission::sparse,
    },
];

/// Blocks side by side across the image, one unit deep along the view; `medium` makes the medium of a name and an extinction.
fn blocks(count: usize, medium: impl Fn(&str, usize) -> String) -> (Shot, String) {
    let width = 2.0 / count as f64;
    let world = (0..count).map(|i| {
        let name = format!("m{i}");
        let middle = -1.0 + (i as f64 + 0.5) * width;
        let shape = format!("Translate {middle} 0 0 Scale {} 1.2 0.5 {CUBE}", 0.45 * width);
        medium(&name, i) + &boundary(&name, "", &shape)
    });
    let fov = 2.0 * 0.01f64.atan().to_degrees();
    let shot = Shot { from: [0.0, 0.0, -100.0], to: [0.0; 3], fov, size: (3 * count) as u32, depth: FOREVER };
    (shot, format!("{DOME}{}", world.collect::<String>()))
}
