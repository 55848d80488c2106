//! Where a GIF's first frame lies. Source: the GIF89a specification (CompuServe 1990), sections 18 to 26.
//!
//! The decoder takes as much memory as that frame says, whatever the screen's size is, so it is looked at first.

/// What is wrong with the first frame of a GIF, if it does not lie within the screen or there is none.
pub(super) fn check_first_frame(gif: &[u8]) -> Result<(), String> {
    let (screen, frame) = first_frame(gif).ok_or("it is cut short before its first frame")?;
    let lies_within = (0..2).all(|axis| frame[axis] + frame[axis + 2] <= screen[axis]);
    if lies_within {
        return Ok(());
    }
    let [left, top, width, height] = frame;
    Err(format!(
        "its first frame, {width} × {height} pixels at ({left}, {top}), does not lie within its screen of {} × {}",
        screen[0], screen[1]
    ))
}

/// Width and height of the screen; left, top, width and height of the first frame.
fn first_frame(gif: &[u8]) -> Option<([u32; 2], [u32; 4])> {
    let number = |at: usize| Some(u32::from(u16::from_le_bytes([*gif.get(at)?, *gif.get(at + 1)?])));
    let screen = [number(6)?, number(8)?];
    // The table of colours, 3 bytes each, follows the screen's descriptor.
    let packed = *gif.get(10)?;
    let mut at = 13 + if packed & 0x80 != 0 { 3 << ((packed & 7) + 1) } else { 0 };
    loop {
        match *gif.get(at)? {
            0x2c => return Some((screen, [number(at + 1)?, number(at + 3)?, number(at + 5)?, number(at + 7)?])),
            // An extension: a label, and blocks up to an empty one.
            0x21 => {
                at += 2;
                while let length @ 1.. = usize::from(*gif.get(at)?) {
                    at += 1 + length;
                }
                at += 1;
            }
            _ => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gif(screen: [u16; 2], frame: [u16; 4]) -> Vec<u8> {
        let mut bytes = b"GIF89a".to_vec();
        bytes.extend(screen.iter().flat_map(|n| n.to_le_bytes()));
        // Two colours, and an extension before the frame.
        bytes.extend([0x80, 0, 0, 0, 0, 0, 9, 9, 9, 0x21, 0xf9, 4, 0, 0, 0, 0, 0, 0x2c]);
        bytes.extend(frame.iter().flat_map(|n| n.to_le_bytes()));
        bytes
    }

    #[test]
    fn frames_lie_within_the_screen() {
        assert_eq!(check_first_frame(&gif([4, 3], [1, 0, 3, 3])), Ok(()));
        let large = check_first_frame(&gif([1, 1], [0, 0, 32767, 32767])).expect_err("it is larger");
        assert!(large.contains("32767 × 32767"), "{large}");
        let whole = gif([4, 3], [0, 0, 4, 3]);
        for length in 0..whole.len() {
            assert!(check_first_frame(&whole[..length]).is_err(), "{length}");
        }
        assert!(check_first_frame(b"GIF89a\x01\0\x01\0\0\0\0;").is_err());
    }
}
