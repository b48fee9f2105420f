//! The arrays of NumPy that hold recorded observations and actions.

use crate::error::{Error, Result};
use ndarray::Array2;
use ndarray_npy::NpzReader;
use std::io::Cursor;

/// The pairs of an `.npz` file: the only array whose rows have `size` numbers, or the one whose name begins with `obs`, and
/// the only other array, or the one whose name begins with `act`.
pub fn pairs(file: &str, bytes: Vec<u8>, size: usize) -> Result<Vec<(usize, Vec<f64>)>> {
    let syntax = |message: String| Error::Syntax { file: file.to_string(), message };
    let mut npz = NpzReader::new(Cursor::new(bytes)).map_err(|e| syntax(e.to_string()))?;
    let mut arrays = Vec::new();
    for name in npz.names().map_err(|e| syntax(e.to_string()))? {
        let wide = npz.by_name::<ndarray::OwnedRepr<f64>, ndarray::Ix2>(&name);
        let array: Option<Array2<f64>> = wide.ok().or_else(|| {
            let narrow = npz.by_name::<ndarray::OwnedRepr<f32>, ndarray::Ix2>(&name).ok()?;
            Some(narrow.mapv(f64::from))
        });
        arrays.extend(array.map(|array| (name, array)));
    }
    let shapes = || {
        let shape = |(name, array): &(String, Array2<f64>)| format!("{name} ({} x {})", array.nrows(), array.ncols());
        let shapes: Vec<String> = arrays.iter().map(shape).collect();
        if shapes.is_empty() { "(none)".into() } else { shapes.join(", ") }
    };
    let one_of = |word: &str, fits: &dyn Fn(&Array2<f64>) -> bool| {
        let fitting: Vec<usize> = (0..arrays.len()).filter(|&i| fits(&arrays[i].1)).collect();
        let named = fitting.iter().copied().find(|&i| arrays[i].0.to_lowercase().starts_with(word));
        named.or(if let [only] = fitting[..] { Some(only) } else { None })
    };
    let observed = one_of("obs", &|array| array.ncols() == size);
    let rows = observed.map(|i| arrays[i].1.nrows());
    let actions = one_of("act", &|array| Some(array.nrows()) == rows && observed.is_none_or(|i| *array != arrays[i].1));
    let (Some(observed), Some(actions)) = (observed, actions) else {
        let accepted = format!(
            "an array `obs` of float32 or float64, of rows of {size} numbers, and an array `act` with as many rows"
        );
        return Err(Error::value(file, "arrays", shapes(), "are no observations and actions", accepted));
    };
    let rows = arrays[observed].1.rows().into_iter().zip(arrays[actions].1.rows());
    Ok(rows.enumerate().map(|(i, (seen, done))| (i + 1, seen.iter().chain(done).copied().collect())).collect())
}
