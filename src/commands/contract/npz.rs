//! The arrays of NumPy that hold recorded observations and actions.

use ndarray::{Array2, Ix2, OwnedRepr};
use ndarray_npy::ReadNpyExt;
use ndarray_npy::npy::header::Header;
use standfast_core::error::{Error, Result};
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Largest size of one array that is read, and of all arrays of a file together (bytes).
const MOST_BYTES: u64 = 400_000_000;
/// Largest head of an array (bytes). NumPy writes 118 bytes.
const MOST_HEAD_BYTES: usize = 1000;

/// The pairs of an `.npz` file: the only array whose rows have `size` numbers, or the one whose name begins with `obs`,
/// and the only other array, or the one whose name begins with `act`.
pub fn pairs(file: &str, bytes: Vec<u8>, size: usize) -> Result<Vec<(usize, Vec<f64>)>> {
    let arrays = arrays(bytes).map_err(|message| Error::Syntax {
        file: file.to_string(),
        message,
    })?;

    let one_of = |word: &str, fits: &dyn Fn(&Array2<f64>) -> bool| {
        let fitting: Vec<usize> = (0..arrays.len()).filter(|&i| fits(&arrays[i].1)).collect();
        let named = fitting
            .iter()
            .copied()
            .find(|&i| arrays[i].0.to_lowercase().starts_with(word));
        named.or(if let [only] = fitting[..] {
            Some(only)
        } else {
            None
        })
    };
    let observed = one_of("obs", &|array| array.ncols() == size);
    let rows = observed.map(|i| arrays[i].1.nrows());
    let actions = one_of("act", &|array| {
        Some(array.nrows()) == rows && observed.is_none_or(|i| *array != arrays[i].1)
    });
    let (Some(observed), Some(actions)) = (observed, actions) else {
        let accepted = format!(
            "an array `obs` of float32 or float64, of rows of {size} numbers, and an array `act` with as many rows"
        );
        let shapes: Vec<String> = arrays
            .iter()
            .map(|(name, array)| format!("{name} ({} x {})", array.nrows(), array.ncols()))
            .collect();
        let shapes = match shapes.is_empty() {
            true => "(none)".into(),
            false => shapes.join(", "),
        };
        return Err(Error::value(
            file,
            "arrays",
            shapes,
            "are no observations and actions",
            accepted,
        ));
    };
    let rows = arrays[observed]
        .1
        .rows()
        .into_iter()
        .zip(arrays[actions].1.rows());
    Ok(rows
        .enumerate()
        .map(|(i, (seen, done))| (i + 1, seen.iter().chain(done).copied().collect()))
        .collect())
}

/// The arrays of two dimensions and of float32 or float64, by their names. Errors are in words.
fn arrays(bytes: Vec<u8>) -> Result<Vec<(String, Array2<f64>)>, String> {
    let mut zip = ZipArchive::new(Cursor::new(bytes))
        .map_err(|e| format!("is no file of NumPy's arrays: {e}"))?;
    let mut left = MOST_BYTES;
    let mut arrays = Vec::new();
    for i in 0..zip.len() {
        let entry = zip.by_index(i).map_err(|e| e.to_string())?;
        let name = entry
            .name()
            .strip_suffix(".npy")
            .unwrap_or(entry.name())
            .to_string();
        // A packed array may unpack to any size, whatever size the file states.
        let mut array = Vec::new();
        entry
            .take(left + 1)
            .read_to_end(&mut array)
            .map_err(|e| format!("array {name:?}: {e}"))?;
        left = left.checked_sub(array.len() as u64).ok_or_else(|| {
            format!(
                "array {name:?}: the arrays have more than {} MB",
                MOST_BYTES / 1_000_000
            )
        })?;
        if is_whole(&array).map_err(|problem| format!("array {name:?} {problem}"))? {
            arrays.extend(read(&array).map(|array| (name, array)));
        }
    }
    Ok(arrays)
}

/// The array in the content of a file `.npy`; None if the array is of another kind.
fn read(content: &[u8]) -> Option<Array2<f64>> {
    let wide = ndarray::ArrayBase::<OwnedRepr<f64>, Ix2>::read_npy(content);
    wide.ok().or_else(|| {
        let narrow = ndarray::ArrayBase::<OwnedRepr<f32>, Ix2>::read_npy(content).ok()?;
        Some(narrow.mapv(f64::from))
    })
}

/// Whether the content is an array of float32 or float64. Fails, in words, if the head states more numbers than the
/// content has, because the reader would first take memory for the stated numbers.
fn is_whole(content: &[u8]) -> Result<bool, String> {
    let length = match content {
        [_, _, _, _, _, _, 1, _, a, b, ..] => usize::from(u16::from_le_bytes([*a, *b])),
        [_, _, _, _, _, _, 2 | 3, _, a, b, c, d, ..] => {
            u32::from_le_bytes([*a, *b, *c, *d]) as usize
        }
        _ => return Ok(false),
    };
    if length > MOST_HEAD_BYTES {
        return Err(format!(
            "has a head of {length} bytes; accepted: up to {MOST_HEAD_BYTES}"
        ));
    }
    let mut rest = content;
    let Ok(head) = Header::from_reader(&mut rest) else {
        return Ok(false);
    };
    let kind = head.type_descriptor.to_string();
    let Some(width) = [4, 8]
        .into_iter()
        .find(|width| kind.ends_with(&format!("f{width}'")))
    else {
        return Ok(false);
    };
    let stated = head
        .shape
        .iter()
        .try_fold(width, |product: usize, size| product.checked_mul(*size));
    if stated.is_some_and(|stated| stated <= rest.len()) {
        return Ok(true);
    }
    Err(format!(
        "states a shape of {:?}, but has {} bytes",
        head.shape,
        rest.len()
    ))
}
