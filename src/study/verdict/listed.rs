//! Names in a sentence.

/// Largest number of controllers that a list names. A longer list gives their number instead.
const NAMED: usize = 5;

/// Lists names as in "a, b and c". If there are more than [`NAMED`], it gives only their number.
pub(super) fn listed(names: &[&str], last: &str) -> String {
    match names {
        many if many.len() > NAMED => format!("{} controllers", many.len()),
        [init @ .., end] if !init.is_empty() => format!("{} {last} {end}", init.join(", ")),
        few => few.concat(),
    }
}
