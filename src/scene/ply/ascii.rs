//! The elements of text PLY files, read word by word: as in pbrt-v4 line ends mean no more than blanks, so an element may stand on several lines and a
//! line may hold several. Numbers may be written in all ways that Rust knows, `nan` and `inf` among them.

use std::str::FromStr;

use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};

/// Longer words are no numbers.
const LONGEST_WORD: usize = 400;

/// The next element from what is left of the file.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn read_element<E: PropertyAccess>(rest: &mut &[u8], element: &ElementDef) -> Result<E, String> {
    let mut out = E::new();
    for (name, property) in &element.properties {
        let value = match &property.data_type {
            PropertyType::Scalar(scalar) => one(rest, scalar),
            PropertyType::List(count, scalar) => {
                let count = count_of(rest, count)?;
                // A list takes no memory before it is known that so many words may follow.
                if count > rest.len() {
                    return Err(format!("a list of {count} numbers is longer than the file"));
                }
                several(rest, scalar, count)
            }
        };
        let value = value.map_err(|what| format!("{name}: {what}"))?;
        if let PropertyAccessResult::UnsupportedType = out.set_property(name, value) {
            return Err(format!("property {name} has a type that it cannot have"));
        }
    }
    Ok(out)
}

fn one(rest: &mut &[u8], scalar: &ScalarType) -> Result<Property, String> {
    Ok(match scalar {
        ScalarType::Char => Property::Char(number(rest)?),
        ScalarType::UChar => Property::UChar(number(rest)?),
        ScalarType::Short => Property::Short(number(rest)?),
        ScalarType::UShort => Property::UShort(number(rest)?),
        ScalarType::Int => Property::Int(number(rest)?),
        ScalarType::UInt => Property::UInt(number(rest)?),
        ScalarType::Float => Property::Float(number(rest)?),
        ScalarType::Double => Property::Double(number(rest)?),
    })
}

fn several(rest: &mut &[u8], scalar: &ScalarType, count: usize) -> Result<Property, String> {
    Ok(match scalar {
        ScalarType::Char => Property::ListChar(numbers(rest, count)?),
        ScalarType::UChar => Property::ListUChar(numbers(rest, count)?),
        ScalarType::Short => Property::ListShort(numbers(rest, count)?),
        ScalarType::UShort => Property::ListUShort(numbers(rest, count)?),
        ScalarType::Int => Property::ListInt(numbers(rest, count)?),
        ScalarType::UInt => Property::ListUInt(numbers(rest, count)?),
        ScalarType::Float => Property::ListFloat(numbers(rest, count)?),
        ScalarType::Double => Property::ListDouble(numbers(rest, count)?),
    })
}

/// The length of a list; some exporters declare it as a float.
fn count_of(rest: &mut &[u8], scalar: &ScalarType) -> Result<usize, String> {
    if !matches!(scalar, ScalarType::Float | ScalarType::Double) {
        return number(rest);
    }
    let count: f64 = number(rest)?;
    if count >= 0.0 && count.fract() == 0.0 {
        Ok(count as usize)
    } else {
        Err(format!("{count} is no length of a list"))
    }
}

fn numbers<T: FromStr>(rest: &mut &[u8], count: usize) -> Result<Vec<T>, String> {
    (0..count).map(|_| number(rest)).collect()
}

fn number<T: FromStr>(rest: &mut &[u8]) -> Result<T, String> {
    let blank = rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    let after = &rest[blank..];
    let length = after.iter().take(LONGEST_WORD).take_while(|byte| !byte.is_ascii_whitespace()).count();
    let (word, left) = after.split_at(length);
    if left.first().is_some_and(|byte| !byte.is_ascii_whitespace()) {
        return Err(format!("a word has more than {LONGEST_WORD} characters"));
    }
    *rest = left;
    if word.is_empty() {
        return Err("the file ends".to_owned());
    }
    let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    parsed.ok_or_else(|| format!("`{}` is no number that can stand here", String::from_utf8_lossy(word).escape_debug()))
}
