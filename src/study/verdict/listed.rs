//! Names in a sentence.

/// If there are more controllers than this, a list gives their number instead of their names.
const NAMED: usize = 5;

/// Lists names as in "a, b and c". Of many names it gives only the number.
pub(super) fn listed(names: &[&str], last: &str) -> String {
    match names {
        many if many.len() > NAMED => format!("{} controllers", many.len()),
        [init @ .., end] if !init.is_empty() => format!("{} {last} {end}", init.join(", ")),
        few => few.concat(),
    }
}
