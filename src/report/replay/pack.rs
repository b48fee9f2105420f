//! Numbers of a film, packed for a page: 16 bits each, in base 64.
//!
//! Each column has a grid of its own: a value is `least + step * n`, n from 0 to 65 534, and n = 65 535 stands for none.
//! The grid spans what the column holds, so that the error, half a step, is 8 µm for each metre that it spans.

use base64::prelude::{BASE64_STANDARD, Engine};
use nalgebra::Point2;
use serde_json::{Value, json};

const NONE: u16 = u16::MAX;
/// The finest grid that is of use: of positions 1 µm, of angles 1 µrad.
const LEAST_STEP: f64 = 1e-6;
/// Of corners of polygons (m): coarse enough that one at rest stays the same.
const CORNER_STEP_M: f64 = 5e-5;

/// A value for each moment. A column of one and the same value, or of none at all, holds no data.
pub fn column(values: &[Option<f64>]) -> Value {
    on_grid(values, LEAST_STEP)
}

/// Columns of vectors of one size, or of none.
pub fn columns<const N: usize>(vectors: &[Option<[f64; N]>]) -> Vec<Value> {
    (0..N).map(|i| column(&vectors.iter().map(|vector| Some(vector.as_ref()?[i])).collect::<Vec<_>>())).collect()
}

fn on_grid(values: &[Option<f64>], least_step: f64) -> Value {
    let finite = |value: &Option<f64>| value.filter(|x| x.is_finite());
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values.iter().filter_map(finite) {
        (least, most) = (least.min(value), most.max(value));
    }
    let all = values.iter().all(|value| finite(value).is_some());
    if least > most || (all && least == most) {
        return json!({ "least": finite(&Some(least)) });
    }
    let step = ((most - least) / f64::from(NONE - 1)).max(least_step);
    let number = |value: &Option<f64>| finite(value).map_or(NONE, |x| ((x - least) / step).round() as u16);
    json!({ "least": least, "step": step, "data": base64(values.iter().map(number)) })
}

/// A polygon in the plane for each moment, empty ones included: those that differ from the one before, and for each moment
/// which of them holds.
pub fn polygons<'a>(moments: impl Iterator<Item = &'a [Point2<f64>]>) -> Value {
    let on_grid_of_corners = |corner: &Point2<f64>| [corner.x, corner.y].map(|x| (x / CORNER_STEP_M).round() as i64);
    let (mut which, mut counts, mut corners) = (Vec::new(), Vec::new(), Vec::new());
    let mut last: Option<Vec<[i64; 2]>> = None;
    for polygon in moments {
        let now: Vec<_> = polygon.iter().map(on_grid_of_corners).collect();
        if last.as_ref() != Some(&now) {
            counts.push(now.len() as u16);
            corners.extend_from_slice(polygon);
            last = Some(now);
        }
        which.push((counts.len() - 1) as u16);
    }
    let axis = |i: usize| on_grid(&corners.iter().map(|corner| Some(corner[i])).collect::<Vec<_>>(), CORNER_STEP_M);
    json!({ "which": base64(which.into_iter()), "counts": base64(counts.into_iter()), "x": axis(0), "y": axis(1) })
}

/// Little-endian numbers in base 64, padded.
fn base64(numbers: impl Iterator<Item = u16>) -> String {
    BASE64_STANDARD.encode(numbers.flat_map(u16::to_le_bytes).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the page reads them.
    #[test]
    fn numbers_are_little_endian() {
        // "Mann".
        assert_eq!(base64([0x614d, 0x6e6e].into_iter()), "TWFubg==");
    }

    #[test]
    fn a_column_that_does_not_change_holds_no_data() {
        assert_eq!(column(&[Some(2.5), Some(2.5)]), json!({ "least": 2.5 }));
        assert_eq!(column(&[None, Some(f64::INFINITY)]), json!({ "least": null }));
        assert_eq!(column(&[]), json!({ "least": null }));
        assert!(column(&[Some(2.5), None])["data"].is_string(), "a gap must show");
        let full = column(&[Some(-1.0), Some(1.0), None]);
        // 0, 65534, none.
        assert_eq!(full["data"], base64([0, 65534, 65535].into_iter()));
    }

    #[test]
    fn polygons_that_stay_the_same_are_held_once() {
        let at = |x: f64| vec![Point2::new(x, 0.0), Point2::new(x + 1.0, 0.0), Point2::new(x, 1.0)];
        let moments = [at(0.0), at(1e-6), vec![], at(0.0), at(0.1)];
        let packed = polygons(moments.iter().map(Vec::as_slice));
        assert_eq!(packed["which"], base64([0, 0, 1, 2, 3].into_iter()));
        assert_eq!(packed["counts"], base64([3, 0, 3, 3].into_iter()));
    }
}
