//! Arrays of a fixed length in files.

use serde::de::{Deserialize, Deserializer, Error as _};

/// Reads an array of exactly N numbers. (The reader of serde leaves out what follows the first N.)
///
/// # Errors
/// The array has another length.
pub fn exactly<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error> {
    let list = Vec::deserialize(from)?;
    let count = list.len();
    list.try_into()
        .map_err(|_| D::Error::invalid_length(count, &format!("an array of length {N}").as_str()))
}
