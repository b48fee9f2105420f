//! Paints triangles over the ground, with a depth buffer of [`SAMPLES`] x [`SAMPLES`] samples for each pixel, which are
//! averaged in linear light.
//!
//! Each band of rows is painted separately, so that a picture has the same bytes with any number of threads.

use super::floor::Floor;
use super::triangle::{Light, Triangle, for_each_inside, stored};
use image::RgbImage;
use rayon::prelude::*;

/// Samples along a side of a pixel.
const SAMPLES: usize = 3;
/// Number of rows of pixels in a band, whose samples stay in the cache.
const BAND: usize = 8;

/// Light and one over the depth (1/m) of a sample.
#[derive(Clone, Copy)]
struct PixelSample {
    light: Light,
    near: f32,
}

/// Paints triangles over floor and background, in a picture of `size` (px).
pub(super) fn paint(size: [u32; 2], floor: &Floor, triangles: &[Triangle]) -> RgbImage {
    let mut image = RgbImage::new(size[0], size[1]);
    let (width, row) = (size[0] as usize, size[0] as usize * SAMPLES);
    if image.is_empty() {
        return image;
    }
    image
        .par_chunks_mut(3 * width * BAND)
        .enumerate()
        .for_each(|(band, pixels)| {
            let (top, rows) = (band * BAND * SAMPLES, pixels.len() / (3 * width) * SAMPLES);
            let at = |x: usize, y: usize| [x, top + y].map(|n| (n as f64 + 0.5) / SAMPLES as f64);
            let mut samples: Vec<PixelSample> = Vec::with_capacity(row * rows);
            for i in 0..row * rows {
                let (x, y) = (i % row, i / row);
                // Light changes little within a pixel, so the light of its middle is enough.
                let light = match (x % SAMPLES, y % SAMPLES) {
                    (0, 0) => floor.light(at(x + SAMPLES / 2, y + SAMPLES / 2)),
                    (0, _) => samples[i - row].light,
                    _ => samples[i - 1].light,
                };
                samples.push(PixelSample {
                    light,
                    near: floor.near(at(x, y)),
                });
            }
            for Triangle {
                corners,
                cover,
                hides,
            } in triangles
            {
                let places = corners.map(|corner| corner.at.map(|px| px * SAMPLES as f64));
                for_each_inside(places, [0, top, row, top + rows], |x, y, weights| {
                    let sample = &mut samples[(y - top) * row + x];
                    let near = weights
                        .iter()
                        .zip(corners)
                        .map(|(w, corner)| w * corner.near)
                        .sum::<f64>() as f32;
                    if near <= sample.near {
                        return;
                    }
                    for (i, value) in sample.light.iter_mut().enumerate() {
                        let light: f32 = weights
                            .iter()
                            .zip(corners)
                            .map(|(w, corner)| *w as f32 * corner.light[i])
                            .sum();
                        *value += cover * (light - *value);
                    }
                    if *hides {
                        sample.near = near;
                    }
                });
            }
            for (i, byte) in pixels.iter_mut().enumerate() {
                let (pixel, channel) = (i / 3, i % 3);
                let first = pixel / width * SAMPLES * row + pixel % width * SAMPLES;
                let light: f32 = (0..SAMPLES * SAMPLES)
                    .map(|k| samples[first + k / SAMPLES * row + k % SAMPLES].light[channel])
                    .sum();
                *byte = stored(light / (SAMPLES * SAMPLES) as f32);
            }
        });
    image
}
