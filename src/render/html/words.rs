//! Filters of the template that write numbers. A value that is missing or not finite becomes a dash.

use crate::render::figure::panel::short;
use crate::render::html_page::together;
use crate::render::text::{layout, p_cell};
use minijinja::{Environment, Value as Cell};

const NOTHING: &str = "\u{2013}";

pub(super) fn add_to(environment: &mut Environment) {
    environment.add_filter("pct", |x: Cell| written(&x, |x| format!("{:.1}\u{a0}%", 100.0 * x)));
    environment.add_filter("points", |x: Cell| written(&x, |x| signed(100.0 * x, 1)));
    environment.add_filter("seconds", |x: Cell| written(&x, |x| format!("{x:.2}\u{a0}s")));
    environment.add_filter("signed", |x: Cell| written(&x, |x| signed(x, 2)));
    environment.add_filter("fixed", |x: Cell, digits: usize| {
        written(&x, |x| format!("{x:.digits$}").replace('-', "\u{2212}"))
    });
    environment.add_filter("p_value", |x: Cell| written(&x, p_cell));
    environment.add_filter("whole", |x: Cell| written(&x, |x| short(x, 6)));
    environment.add_filter("drawn", drawn);
    environment.add_filter("signs", |text: String| signs(&text));
    environment.add_filter("kind", |by: String| kind(&by));
}

fn written(x: &Cell, write: impl Fn(f64) -> String) -> String {
    number(x).map_or(NOTHING.into(), write)
}

/// The number in a cell, if it is finite.
pub(super) fn number(cell: &Cell) -> Option<f64> {
    f64::try_from(cell.clone()).ok().filter(|x| x.is_finite())
}

/// The two ends in a cell, if both are finite.
pub(super) fn interval(cell: &Cell) -> Option<[f64; 2]> {
    let end = |i| number(&cell.get_item_by_index(i).ok()?);
    Some([end(0)?, end(1)?])
}

/// A part of a bar, from `[class, share, text]`.
pub(super) fn part(cell: &Cell) -> Option<(String, f64, String)> {
    let item = |i| cell.get_item_by_index(i).ok();
    Some((item(0)?.to_string(), number(&item(1)?)?, item(2)?.to_string()))
}

fn signed(x: f64, digits: usize) -> String {
    layout::signed(x, digits).replace('-', "\u{2212}")
}

/// The text with minus signs before negative numbers, and numbers that stay with their units. Hyphens in names stay.
fn signs(text: &str) -> String {
    let mut parts = text.split('-');
    let mut told = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let is_sign = part.starts_with(|c: char| c.is_ascii_digit()) && (told.is_empty() || told.ends_with([' ', '(']));
        told.push(if is_sign { '\u{2212}' } else { '-' });
        told += part;
    }
    together(&told)
}

/// The quantity of a stratum in words, without its unit, which the labels below it have.
fn kind(by: &str) -> String {
    let name = by.strip_suffix("_m").or(by.strip_suffix("_s")).unwrap_or(by);
    name.replace("_scale", " (times nominal)").replace("_com_", "_COM_").replace('_', " ")
}

/// A distribution in words. It is `2.5`, `{ uniform = [a, b] }`, `{ normal = [mean, sd] }`, or a word such as a
/// profile.
fn drawn(value: Cell) -> String {
    let two = |key: &str| interval(&value.get_attr(key).ok()?);
    if let Some([a, b]) = two("uniform") {
        return format!("uniform, {} to {}", short(a, 6), short(b, 6));
    }
    if let Some([mean, sd]) = two("normal") {
        return format!("normal, mean {}, standard deviation {}", short(mean, 6), short(sd, 6));
    }
    match number(&value) {
        Some(x) => short(x, 6),
        None if value.is_undefined() || value.is_none() => NOTHING.into(),
        None => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_signs_units_and_words() {
        assert_eq!([12.34, -0.04, -3.0].map(|x| signed(x, 1)), ["+12.3", "0.0", "\u{2212}3.0"]);
        assert_eq!([1e-9, 0.0042, 0.25].map(p_cell), ["< 0.0001", "0.0042", "0.25"]);
        assert_eq!(written(&Cell::UNDEFINED, |x| x.to_string()), NOTHING);
        let uniform = Cell::from(minijinja::value::Serde(serde_json::json!({ "uniform": [-180.0, 180.0] })));
        assert_eq!(drawn(uniform), "uniform, \u{2212}180 to 180");
        assert_eq!(drawn(Cell::from("rectangular")), "rectangular");
        assert_eq!(
            signs("a-1 and b: -2.0 points (-11.3 to 7.2)"),
            "a-1 and b: \u{2212}2.0 points (\u{2212}11.3 to 7.2)"
        );
        assert_eq!(["trunk_com_x_m", "mass_scale"].map(kind), ["trunk COM x", "mass (times nominal)"]);
    }
}
