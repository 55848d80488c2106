//! Little-endian numbers at offsets that may be wrong.

/// Bytes of a file.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a>(pub &'a [u8]);

/// What is said where something lies outside.
pub(super) fn cut() -> String {
    "it is damaged or cut short".to_owned()
}

impl<'a> Bytes<'a> {
    /// So many bytes from `at`.
    pub fn part(&self, at: usize, length: usize) -> Result<Self, String> {
        let end = at.checked_add(length).ok_or_else(cut)?;
        self.0.get(at..end).map(Self).ok_or_else(cut)
    }

    fn array<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        let part = at.checked_add(N).and_then(|end| self.0.get(at..end));
        part.and_then(|part| part.try_into().ok()).ok_or_else(cut)
    }

    pub fn u16(&self, at: usize) -> Result<u16, String> {
        self.array(at).map(u16::from_le_bytes)
    }

    pub fn u32(&self, at: usize) -> Result<u32, String> {
        self.array(at).map(u32::from_le_bytes)
    }

    pub fn u64(&self, at: usize) -> Result<u64, String> {
        self.array(at).map(u64::from_le_bytes)
    }

    pub fn i64(&self, at: usize) -> Result<i64, String> {
        self.array(at).map(i64::from_le_bytes)
    }

    pub fn f32(&self, at: usize) -> Result<f32, String> {
        self.array(at).map(f32::from_le_bytes)
    }

    pub fn f64(&self, at: usize) -> Result<f64, String> {
        self.array(at).map(f64::from_le_bytes)
    }
}

/// An array, if all of its elements are there.
pub(super) fn all<T: Copy + Default, const N: usize>(
    element: impl Fn(usize) -> Result<T, String>,
) -> Result<[T; N], String> {
    let mut array = [T::default(); N];
    for (i, slot) in array.iter_mut().enumerate() {
        *slot = element(i)?;
    }
    Ok(array)
}
