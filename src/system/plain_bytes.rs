//! Lists of plain numbers as bytes, for `#[serde(with = "plain_bytes")]`: a film of millions of pixels is copied, not walked through.

use bytemuck::{Pod, pod_collect_to_vec};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

/// Writes the list in this machine's order of bytes.
///
/// # Errors
/// What the serializer says.
pub fn serialize<T: Pod, S: Serializer>(list: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytemuck::cast_slice(list))
}

/// Reads such a list.
///
/// # Errors
/// What the deserializer says, and bytes that are no whole number of elements.
pub fn deserialize<'de, T: Pod, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    let bytes = <&[u8]>::deserialize(deserializer)?;
    if bytes.len() % size_of::<T>() != 0 {
        return Err(D::Error::custom("a list is cut short"));
    }
    Ok(pod_collect_to_vec(bytes))
}
