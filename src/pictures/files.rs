//! Pictures as files: PNG, a strip of several pictures, and an animated GIF.

use crate::scene::palette::{Color, Overlay};
use color_quant::NeuQuant;
use gif::{Encoder, Frame, Repeat};
use image::{ImageFormat, RgbImage, imageops};
use standfast_core::error::{Error, Result};
use std::io::Cursor;
use std::iter::repeat_n;

pub fn png(image: &RgbImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    // Writing to memory cannot fail.
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    debug_assert!(written.is_ok());
    bytes.into_inner()
}

/// Pictures side by side, with a fine white line between two. The strip is as wide as all pictures together and as high
/// as the highest one; the space below the others is white.
pub fn strip(images: &[RgbImage]) -> RgbImage {
    let width = images.iter().map(RgbImage::width).sum();
    let height = images.iter().map(RgbImage::height).max().unwrap_or(0);
    let mut strip = RgbImage::from_pixel(width, height, image::Rgb([255; 3]));
    let mut left = 0;
    for picture in images {
        imageops::replace(&mut strip, picture, left, 0);
        if left > 0 {
            // The line is drawn over the edges, so that it adds no width.
            imageops::replace(
                &mut strip,
                &RgbImage::from_pixel(2, height, image::Rgb([255; 3])),
                left - 1,
                0,
            );
        }
        left += i64::from(picture.width());
    }
    strip
}

/// Number of colours of a GIF, and the index after them, which means "unchanged since the last picture".
const COLORS: usize = 255;
const AS_BEFORE: u8 = 255;
/// Number of other colours that a palette learns for each time that it learns the colour of a mark.
const EACH_MARK: usize = 200;

/// The bytes of an endless GIF from pictures of one size, each with the time for which it is shown (1/100 s), in the
/// colours of a palette. Pixels that do not change are stored as unchanged. Fails without a picture, or if a side is
/// longer than 65535 px.
pub(super) fn gif(
    mut palette: Palette,
    images: impl Iterator<Item = (RgbImage, u16)>,
) -> Result<Vec<u8>> {
    let fail = |problem: String| Error::Numeric {
        what: "GIF".into(),
        problem,
    };
    let mut images = images.peekable();
    let (first, _) = images
        .peek()
        .ok_or_else(|| fail("there is no picture to show".into()))?;
    let side =
        |px: u32| u16::try_from(px).map_err(|_| fail(format!("a picture of {px} px is too large")));
    let (width, height) = (side(first.width())?, side(first.height())?);
    let refused = |e: gif::EncodingError| fail(e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height, &palette.colors).map_err(refused)?;
    encoder.set_repeat(Repeat::Infinite).map_err(refused)?;
    let mut before: Option<Vec<u8>> = None;
    for (image, delay) in images {
        let now = palette.indices(&image);
        let frame = changes(before.as_deref(), &now, (width, height), delay);
        encoder.write_frame(&frame).map_err(refused)?;
        before = Some(now);
    }
    drop(encoder);
    Ok(bytes)
}

/// The frame of a picture, in which unchanged pixels have the index "unchanged", since runs of it take almost no space.
fn changes(
    before: Option<&[u8]>,
    now: &[u8],
    (width, height): (u16, u16),
    delay: u16,
) -> Frame<'static> {
    let mut buffer = now.to_vec();
    for (index, old) in buffer.iter_mut().zip(before.unwrap_or_default()) {
        if index == old {
            *index = AS_BEFORE;
        }
    }
    Frame {
        delay,
        ..Frame::from_indexed_pixels(width, height, buffer, before.map(|_| AS_BEFORE))
    }
}

/// The colours that suit some pictures best, learned by a neural network (Dekker 1994).
pub(super) struct Palette {
    network: NeuQuant,
    colors: Vec<u8>,
    /// Index of the colour of each [`bucket`], after its first use.
    nearest: Vec<Option<u8>>,
}

/// Number of a colour. Colours that agree in their upper six bits have the same number.
fn bucket(color: [u8; 3]) -> usize {
    color
        .iter()
        .fold(0, |sum, v| sum << 6 | usize::from(v >> 2))
}

/// The colour in the middle of a bucket, opaque.
fn middle(bucket: usize) -> [u8; 4] {
    let [r, g, b] = [12, 6, 0].map(|shift| (bucket >> shift << 2 & 0xff | 2) as u8);
    [r, g, b, 255]
}

impl Palette {
    pub fn of(images: &[RgbImage]) -> Self {
        let mut counts = vec![0_usize; 1 << 18];
        for pixel in images.iter().flat_map(RgbImage::pixels) {
            counts[bucket(pixel.0)] += 1;
        }
        // A colour is learned as often as the square root of its number of pixels. Colours of marks are learned more
        // often, since marks are small and would lose their colours to the many greys of the floor.
        let seen = counts
            .iter()
            .enumerate()
            .flat_map(|(bucket, count)| repeat_n(middle(bucket), count.isqrt()));
        let mut lesson: Vec<_> = seen.collect();
        let count = lesson.len() / EACH_MARK;
        let marks = Overlay::ALL
            .into_iter()
            .map(Overlay::color)
            .chain([Color::WHITE]);
        lesson.extend(marks.flat_map(|Color(r, g, b)| repeat_n([r, g, b, 255], count)));
        let network = NeuQuant::new(1, COLORS, lesson.as_flattened());
        Self {
            colors: network.color_map_rgb(),
            network,
            nearest: vec![None; counts.len()],
        }
    }

    /// The index of the nearest colour for each pixel.
    fn indices(&mut self, image: &RgbImage) -> Vec<u8> {
        let Self {
            network, nearest, ..
        } = self;
        let indices = image.pixels().map(|pixel| {
            let bucket = bucket(pixel.0);
            *nearest[bucket].get_or_insert_with(|| network.index_of(&middle(bucket)) as u8)
        });
        indices.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::gif::GifDecoder;
    use image::{AnimationDecoder, Rgb};

    fn plain(width: u32, height: u32, color: [u8; 3]) -> RgbImage {
        RgbImage::from_pixel(width, height, Rgb(color))
    }

    #[test]
    fn a_strip_has_the_width_of_its_parts_and_shows_them_in_order() {
        let strip = strip(&[
            plain(30, 20, [255, 0, 0]),
            plain(7, 25, [0, 255, 0]),
            plain(10, 20, [0, 0, 255]),
        ]);
        assert_eq!(strip.dimensions(), (47, 25));
        let at = |x, y| strip.get_pixel(x, y).0;
        assert_eq!(
            [at(28, 19), at(31, 24), at(38, 0)],
            [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
        );
        assert_eq!([at(0, 24), at(29, 3), at(30, 3)], [[255; 3]; 3]);
    }

    /// A small square moves over a gradient, and the last two pictures are equal.
    #[test]
    fn a_gif_shows_each_picture_for_its_time_with_its_colours() {
        let gradient = RgbImage::from_fn(240, 160, |x, y| {
            Rgb([150 + x as u8 / 4, 160 + y as u8 / 4, 200])
        });
        let pictures: Vec<RgbImage> = [16, 80, 160, 160]
            .iter()
            .map(|&left| {
                let mut picture = gradient.clone();
                imageops::replace(&mut picture, &plain(20, 20, [230, 0, 40]), left, 40);
                picture
            })
            .collect();
        let delays = [4, 8, 4, 100];
        // The palette was learned from the first picture only.
        let made = || {
            gif(
                Palette::of(&pictures[..1]),
                pictures.iter().cloned().zip(delays),
            )
        };
        let bytes = made().unwrap();
        assert_eq!(bytes, made().unwrap());
        let frames = GifDecoder::new(Cursor::new(&bytes))
            .unwrap()
            .into_frames()
            .collect_frames()
            .unwrap();
        assert_eq!(frames.len(), 4);
        for ((frame, picture), delay) in frames.iter().zip(&pictures).zip(delays) {
            assert_eq!(frame.delay().numer_denom_ms(), (10 * u32::from(delay), 1));
            for (x, y, pixel) in picture.enumerate_pixels() {
                let shown = frame.buffer().get_pixel(x, y);
                let off = (0..3).map(|i| pixel[i].abs_diff(shown[i])).max().unwrap();
                assert!(off <= 20, "at {x}, {y}: {shown:?} for {pixel:?}");
            }
        }
        assert!(gif(Palette::of(&[]), std::iter::empty()).is_err());
    }
}
