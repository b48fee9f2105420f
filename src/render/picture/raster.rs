//! Rasterises triangles with a depth buffer of [`SAMPLES`] x [`SAMPLES`] samples for each pixel, averaged in linear
//! light.
//!
//! Each band of rows is painted by itself, so that a picture has the same bytes with any number of threads.

use super::floor::Floor;
use super::triangle::{Coverage, Light, Triangle, stored};
use image::RgbImage;
use rayon::prelude::*;

/// Samples along a side of a pixel.
const SAMPLES: usize = 3;
/// Number of rows of pixels in a band, whose samples stay in the cache.
const BAND: usize = 8;

/// Light and one over the depth (1/m) of a sample.
#[derive(Clone, Copy)]
struct Sample {
    light: Light,
    near: f32,
}

/// Paints triangles over floor and background, in a picture of `size` (px).
pub(super) fn paint(size: [u32; 2], floor: &Floor, triangles: &[Triangle]) -> RgbImage {
    let [width, height] = size.map(|px| px as usize);
    let prepared: Vec<(Coverage, &Triangle)> =
        triangles.iter().filter_map(|t| Some((Coverage::new(&t.corners.map(|c| c.at), SAMPLES as f64)?, t))).collect();
    let mut image = RgbImage::new(size[0], size[1]);
    if width == 0 || height == 0 {
        return image;
    }
    image.par_chunks_mut(3 * width * BAND).enumerate().for_each(|(band, pixels)| {
        let top = band * BAND;
        let rows = (pixels.len() / (3 * width)).min(height - top);
        let mut samples = vec![Sample { light: [0.0; 3], near: 0.0 }; width * rows * SAMPLES * SAMPLES];
        let window = [0, (top * SAMPLES) as i64, (width * SAMPLES) as i64, ((top + rows) * SAMPLES) as i64];
        start(&mut samples, window, floor);
        for (area, triangle) in &prepared {
            blend(&mut samples, window, area, triangle);
        }
        resolve(&samples, width, pixels);
    });
    image
}

/// Fills the samples with ground and background. These are smooth, so one evaluation for each pixel is enough, except
/// at the edges of a step. The depth is that of each sample.
fn start(samples: &mut [Sample], window: [i64; 4], floor: &Floor) {
    let row_length = (window[2] - window[0]) as usize;
    let mut parts = vec![None; samples.len()];
    for (part, corners) in &floor.faces {
        for i in 2..corners.len() {
            let [a, b, c] = [0, i - 1, i].map(|i| corners[i]);
            let Some(covered) = Coverage::new(&[a.at, b.at, c.at], SAMPLES as f64) else { continue };
            covered.for_each(window, |x, y, [wa, wb, wc]| {
                let at = (y - window[1]) as usize * row_length + x as usize;
                let near = (wa * a.near + wb * b.near + wc * c.near) as f32;
                if near > samples[at].near {
                    (samples[at].near, parts[at]) = (near, Some(*part));
                }
            });
        }
    }
    for y in (0..samples.len() / row_length).step_by(SAMPLES) {
        for x in (0..row_length).step_by(SAMPLES) {
            let at = |k: usize| (y + k / SAMPLES) * row_length + x + k % SAMPLES;
            let look = |k: usize| {
                let place = [x + k % SAMPLES, window[1] as usize + y + k / SAMPLES].map(|n| n as f64 + 0.5);
                floor.light(place.map(|n| n / SAMPLES as f64), parts[at(k)], samples[at(k)].near.into())
            };
            let middle = SAMPLES * SAMPLES / 2;
            let common = look(middle);
            let lights: [Light; SAMPLES * SAMPLES] =
                std::array::from_fn(|k| if parts[at(k)] == parts[at(middle)] { common } else { look(k) });
            lights.into_iter().enumerate().for_each(|(k, light)| samples[at(k)].light = light);
        }
    }
}

/// Paints a triangle over the samples that it covers, unless they are nearer.
fn blend(samples: &mut [Sample], window: [i64; 4], area: &Coverage, triangle: &Triangle) {
    let row_length = (window[2] - window[0]) as usize;
    let [a, b, c] = &triangle.corners;
    area.for_each(window, |x, y, [wa, wb, wc]| {
        let sample = &mut samples[(y - window[1]) as usize * row_length + x as usize];
        let near = (wa * a.near + wb * b.near + wc * c.near) as f32;
        if near <= sample.near {
            return;
        }
        let weights = [wa, wb, wc].map(|w| w as f32);
        for (i, value) in sample.light.iter_mut().enumerate() {
            let light = weights[0] * a.light[i] + weights[1] * b.light[i] + weights[2] * c.light[i];
            *value += triangle.cover * (light - *value);
        }
        if triangle.hides {
            sample.near = near;
        }
    });
}

/// Stores the mean of the samples of each pixel.
fn resolve(samples: &[Sample], width: usize, pixels: &mut [u8]) {
    let row_length = width * SAMPLES;
    for (rows, line) in samples.chunks(row_length * SAMPLES).zip(pixels.chunks_mut(3 * width)) {
        for (x, pixel) in line.chunks_mut(3).enumerate() {
            let mut sum = [0.0_f32; 3];
            for row in rows.chunks(row_length) {
                for sample in &row[x * SAMPLES..(x + 1) * SAMPLES] {
                    for (s, v) in sum.iter_mut().zip(sample.light) {
                        *s += v;
                    }
                }
            }
            for (byte, s) in pixel.iter_mut().zip(sum) {
                *byte = stored(s / (SAMPLES * SAMPLES) as f32);
            }
        }
    }
}
