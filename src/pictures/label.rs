//! Text in pictures, in a bitmap font that is compiled in.

use embedded_graphics::Drawable;
use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{Dimensions, OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::FONT_10X20;
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::text::{Baseline, Text};
use image::{Rgb, RgbImage};
use std::convert::Infallible;

const INK: [u8; 3] = [40, 44, 52];
/// Space between the text and the edge of its plate (px).
const MARGIN: i32 = 3;

/// Writes a line of ASCII text on a translucent white plate, with its upper left corner at `at` (px). Text beyond the
/// edge of the picture is cut off.
pub fn label(image: &mut RgbImage, text: &str, at: [u32; 2]) {
    let style = MonoTextStyle::new(&FONT_10X20, BinaryColor::On);
    let [x, y] = at.map(|px| i32::try_from(px).unwrap_or(i32::MAX / 2));
    let text = Text::with_baseline(text, Point::new(x, y), style, Baseline::Top);
    let plate = text.bounding_box();
    let (from, size) = (plate.top_left, plate.size);
    for y in from.y - MARGIN / 3..from.y + size.height as i32 {
        for x in from.x - MARGIN..from.x + size.width as i32 + MARGIN {
            if let Some(pixel) = pixel_at(image, x, y) {
                pixel.0 = pixel.0.map(|v| 255 - (255 - v) / 3);
            }
        }
    }
    let Ok(_) = text.draw(&mut Ink(image));
}

fn pixel_at(image: &mut RgbImage, x: i32, y: i32) -> Option<&mut Rgb<u8>> {
    image.get_pixel_mut_checked(u32::try_from(x).ok()?, u32::try_from(y).ok()?)
}

/// A picture as a target for the font.
struct Ink<'a>(&'a mut RgbImage);

impl OriginDimensions for Ink<'_> {
    fn size(&self) -> Size {
        Size::new(self.0.width(), self.0.height())
    }
}

impl DrawTarget for Ink<'_> {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(at, color) in pixels {
            if let (BinaryColor::On, Some(pixel)) = (color, pixel_at(self.0, at.x, at.y)) {
                *pixel = Rgb(INK);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_written_where_they_are_wanted_and_cut_off_at_the_edge() {
        let mut image = RgbImage::from_pixel(80, 40, Rgb([200; 3]));
        label(&mut image, "l.", [20, 10]);
        let inked = |image: &RgbImage| -> Vec<(u32, u32)> {
            image
                .enumerate_pixels()
                .filter(|(_, _, pixel)| pixel.0 == INK)
                .map(|(x, y, _)| (x, y))
                .collect()
        };
        let ink = inked(&image);
        assert!(
            ink.len() > 10
                && ink
                    .iter()
                    .all(|&(x, y)| (20..40).contains(&x) && (10..30).contains(&y)),
            "{ink:?}"
        );
        let columns = |from: u32| {
            ink.iter()
                .filter(|(x, _)| (from..from + 10).contains(x))
                .count()
        };
        assert!(
            columns(20) > 2 * columns(30),
            "an l has more ink than a stop"
        );
        assert_eq!(image.get_pixel(70, 35).0, [200; 3], "the rest is as it was");

        let mut small = RgbImage::new(12, 12);
        label(&mut small, "888", [6, 6]);
        assert!(!inked(&small).is_empty());
        label(&mut small, "8", [4000, 4_000_000_000]);
    }
}
