//! Numbers of a film, packed for a page: 16 bits each, in base 64.
//!
//! Each column has its own grid: a value is `least + step * n` with n from 0 to 65 534, and n = 65 535 means that there
//! is no value. The grid spans the values of the column, so that the error (half a step) is 8 µm for each metre of
//! their range.

use base64::prelude::{BASE64_STANDARD, Engine};
use nalgebra::Point2;
use serde_json::{Value, json};
use standfast_scene::mesh::DrawnMesh;

const NONE: u16 = u16::MAX;
/// Smallest step of a grid, 1 µm for positions and 1 µrad for angles.
const LEAST_STEP: f64 = 1e-6;
/// Step of the grid for corners of polygons (m), so coarse that a polygon at rest does not change.
const CORNER_STEP_M: f64 = 5e-5;

/// A column with a value for each moment. If all values are equal, or if there is none, it holds no data.
pub fn column(values: &[Option<f64>]) -> Value {
    on_grid(values, LEAST_STEP)
}

pub fn columns<const N: usize>(vectors: &[Option<[f64; N]>]) -> Vec<Value> {
    (0..N)
        .map(|i| {
            column(
                &vectors
                    .iter()
                    .map(|vector| Some(vector.as_ref()?[i]))
                    .collect::<Vec<_>>(),
            )
        })
        .collect()
}

/// A column whose grid has at least this step.
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
    let number =
        |value: &Option<f64>| finite(value).map_or(NONE, |x| ((x - least) / step).round() as u16);
    json!({ "least": least, "step": step, "data": base64(values.iter().map(number)) })
}

/// A polygon in the plane for each moment, which may be empty. A polygon is stored once for as long as it does not
/// change, with the index of the stored polygon for each moment.
#[derive(Default)]
pub struct Polygons {
    which: Vec<u16>,
    counts: Vec<u16>,
    corners: Vec<Point2<f64>>,
}

impl Polygons {
    pub fn of<'a>(moments: impl Iterator<Item = &'a [Point2<f64>]>) -> Self {
        let on_grid =
            |corner: &Point2<f64>| [corner.x, corner.y].map(|x| (x / CORNER_STEP_M).round() as i64);
        let mut polygons = Self::default();
        let mut last: Option<Vec<[i64; 2]>> = None;
        for polygon in moments {
            let now: Vec<_> = polygon.iter().map(on_grid).collect();
            if last.as_ref() != Some(&now) {
                polygons.counts.push(now.len() as u16);
                polygons.corners.extend_from_slice(polygon);
                last = Some(now);
            }
            polygons.which.push((polygons.counts.len() - 1) as u16);
        }
        polygons
    }

    /// Number of corners of all stored polygons.
    pub fn corners(&self) -> usize {
        self.corners.len()
    }

    pub fn packed(&self) -> Value {
        let [x, y] = [0, 1].map(|axis| {
            let values: Vec<_> = self
                .corners
                .iter()
                .map(|corner| Some(corner[axis]))
                .collect();
            on_grid(&values, CORNER_STEP_M)
        });
        let [which, counts] =
            [&self.which, &self.counts].map(|numbers| base64(numbers.iter().copied()));
        json!({ "which": which, "counts": counts, "x": x, "y": y })
    }
}

/// A mesh within the cube from -1 to 1: place and normal of each corner, where n stands for n / 32767 - 1, and the
/// corners of each triangle.
pub fn packed_mesh(mesh: &DrawnMesh) -> Value {
    let numbers = mesh
        .corners
        .iter()
        .flat_map(|(at, normal)| [at.x, at.y, at.z, normal.x, normal.y, normal.z]);
    let corners = base64(numbers.map(|x| ((x + 1.0) * 32767.0).round() as u16));
    json!({ "corners": corners, "faces": base64(mesh.faces.iter().flatten().map(|&corner| corner as u16)) })
}

/// The numbers in little-endian order, in base 64 with padding.
fn base64(numbers: impl Iterator<Item = u16>) -> String {
    BASE64_STANDARD.encode(numbers.flat_map(u16::to_le_bytes).collect::<Vec<_>>())
}
