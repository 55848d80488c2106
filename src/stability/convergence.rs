//! Convergence: renders long enough for an error that does not fall to be seen.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::case::{Case, FAMILY_RATE, Image, MOST_COMPARISONS, Stop, Trial};
use super::scene::{CUBE, FOREVER, How, Shot, boundary, homogeneous, list};

pub(super) const CASES: &[Case] = &[Case {
    name: "convergence.foggy-room",
    checks: "A room of six walls of unlike brightness, filled with thin fog that scatters and glows, is at radiance 1: from 2^8 to 2^14 samples a pixel the \
             error falls with their root, without a floor.",
    seconds: 8.0,
    known: None,
    run: foggy_room,
}];

/// Walls emit e and reflect 1 − e, and fog emits what it absorbs: everything in there is in equilibrium at radiance 1, however often it is reflected
/// and scattered.
fn room() -> String {
    let walls = [
        ("", 0.9),
        ("Rotate 90 1 0 0", 0.1),
        ("Rotate 180 1 0 0", 0.3),
        ("Rotate 270 1 0 0", 0.6),
        ("Rotate 90 0 0 1", 0.2),
        ("Rotate -90 0 0 1", 0.7),
    ];
    let walls = walls.map(|(turn, e)| {
        let (emission, reflectance) = (list(&[e; 3]), list(&[1.0 - e; 3]));
        format!(
            "AttributeBegin {turn} Translate 0 1 0 AreaLightSource \"diffuse\" \"rgb L\" [{emission}] \"bool twosided\" true
             Material \"diffuse\" \"rgb reflectance\" [{reflectance}]
             Shape \"bilinearmesh\" \"point3 P\" [-1 0 -1  1 0 -1  -1 0 1  1 0 1] AttributeEnd\n"
        )
    });
    let fog = homogeneous("fog", [0.05; 3], [0.15; 3], "\"rgb Le\" [1 1 1] \"float g\" 0.4");
    format!("{}{fog}{}", walls.concat(), boundary("fog", "", &format!("Scale 0.9 0.9 0.9 {CUBE}")))
}

/// The mean over pixels of the squared distance from 1, and of the same in units of each pixel's variance.
fn squares(image: &Image) -> [f64; 2] {
    let channels = image.film.channels();
    let of = |name: &str| channels.channel(name).unwrap_or_default().iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
    let (values, variances) = (of("G"), of("variance.G"));
    let count = values.len() as f64;
    let squares: Vec<f64> = values.iter().map(|v| (v - 1.0).powi(2)).collect();
    let shares = squares.iter().zip(&variances).map(|(square, variance)| square / variance);
    [squares.iter().sum::<f64>() / count, shares.sum::<f64>() / count]
}

/// Each comparison fails by chance with a probability of [`FAMILY_RATE`] over [`MOST_COMPARISONS`] at most: a mean of squares in units of their variances
/// is χ² over its degrees of freedom, a ratio of two means of squares is Fisher's F. Renders have seeds of their own.
fn foggy_room(trial: &mut Trial) -> Result<(), Stop> {
    let shot = Shot { from: [0.3, 0.1, -0.7], to: [0.0, 0.0, 1.0], fov: 90.0, size: 8, depth: FOREVER };
    let pixels = f64::from(shot.size * shot.size);
    let confidence = 1.0 - FAMILY_RATE / MOST_COMPARISONS as f64;
    let failed = |error: &dyn std::fmt::Display| Stop::Failed(error.to_string());
    let chi = ChiSquared::new(pixels).map_err(|error| failed(&error))?.inverse_cdf(confidence) / pixels;
    let fisher = FisherSnedecor::new(pixels, pixels).map_err(|error| failed(&error))?.inverse_cdf(confidence);
    let mut first = None;
    for (seed, power) in (1..).zip([8, 10, 12, 14]) {
        let image = trial.render(&shot, &room(), &How { seed, ..How::spp(1 << power) })?;
        let what = format!("2^{power} samples");
        trial.expect(&format!("mean, {what}"), image.mean(), 1.0, 0.01, "equilibrium");
        let [square, share] = squares(&image);
        trial.equal(&format!("squared errors by their variances, {what}"), share, 1.0, chi - 1.0, "χ² of 64 pixels");
        let (start, at_first) = *first.get_or_insert((power, square));
        if power > start {
            let falls = (square / at_first).sqrt() * 2f64.powi(power - start).sqrt();
            let (what, allowed) = (format!("RMSE × √n by that of 2^{start}, {what}"), fisher.sqrt() - 1.0);
            trial.equal(&what, falls, 1.0, allowed, "n^-1/2, F of 64 and 64 pixels");
        }
    }
    Ok(())
}
