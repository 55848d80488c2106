//! Photometric files, and what is made of them. What follows a byte of 0 is the file that `TILT=` names, whatever its name.

#![no_main]

use glam::Vec3;
use lanternfish::light::ies::IesProfile;
use lanternfish::light::ies::read::parse;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut parts = data.splitn(2, |&byte| byte == 0);
    let text = String::from_utf8_lossy(parts.next().unwrap_or_default());
    let tilted = parts.next().map(String::from_utf8_lossy);
    let beside = |_: &str| tilted.as_ref().map(|text| text.to_string()).ok_or_else(|| "there is none".to_owned());
    let Ok(table) = parse(&text, 20.0, &beside) else { return };
    let profile = IesProfile::new(&table);
    for w in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, 0.0, -0.8), Vec3::new(-0.48, 0.64, 0.6)] {
        let candela = profile.candela(w);
        assert!(candela >= 0.0 && candela <= profile.greatest() * 1.001, "{candela} of {}", profile.greatest());
    }
    assert!(profile.flux() >= 0.0 && profile.forward() >= 0.0);
});
