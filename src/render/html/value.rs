//! Values of a summary and of the template, as far as they are what they should be.

use minijinja::Value as Cell;
use serde_json::Value;

/// Elements of an array; of anything else, none.
pub(super) fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

pub(super) fn number(cell: &Cell) -> Option<f64> {
    f64::try_from(cell.clone()).ok().filter(|x| x.is_finite())
}

pub(super) fn interval(cell: &Cell) -> Option<[f64; 2]> {
    let end = |i| number(&cell.get_item_by_index(i).ok()?);
    Some([end(0)?, end(1)?])
}

/// Of a bar: `[class, share, words]`.
pub(super) fn part(cell: &Cell) -> Option<(String, f64, String)> {
    let item = |i| cell.get_item_by_index(i).ok();
    Some((item(0)?.to_string(), number(&item(1)?)?, item(2)?.to_string()))
}
