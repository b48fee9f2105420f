//! Colours of the window, and their conversions for egui and for the graphics card.

use super::triangles::Rgb;
use kiss3d::egui::Color32;
use standfast_scene::palette::{Color, Overlay};

pub const SKY: Color = Color(0xe9, 0xed, 0xf2);
pub const FLOOR: Color = Color(0xcf, 0xd6, 0xde);
pub const GRID: Color = Color(0xb4, 0xbe, 0xc9);
pub const SHADOW: Color = Color(0xb3, 0xbb, 0xc5);
pub const INK: Color = Color(0x1f, 0x29, 0x33);
/// Colour of good news.
pub const WELL: Color = Overlay::Dcm.color();
/// Colour of bad news.
pub const BADLY: Color = Overlay::Zmp.color();
pub const PUSH: Color = Overlay::Push.color();

/// The colour of a solid, without its opacity.
pub fn of([r, g, b, _]: [f64; 4]) -> Color {
    let [r, g, b] = [r, g, b].map(|part| (255.0 * part).round() as u8);
    Color(r, g, b)
}

/// A colour as the window draws it.
pub trait OnScreen {
    /// The colour for egui.
    fn egui(self) -> Color32;

    /// The colour for egui, with an opacity from 0 to 1.
    fn faint(self, opacity: f32) -> Color32;

    /// The colour as linear light, which the material draws.
    fn linear(self) -> Rgb;

    /// The colour for lines and the background, which are drawn as linear light, too.
    fn line(self) -> kiss3d::color::Color;
}

impl OnScreen for Color {
    fn egui(self) -> Color32 {
        Color32::from_rgb(self.0, self.1, self.2)
    }

    fn faint(self, opacity: f32) -> Color32 {
        self.egui().gamma_multiply(opacity)
    }

    fn linear(self) -> Rgb {
        light(self.parts())
    }

    fn line(self) -> kiss3d::color::Color {
        let rgb = self.linear();
        kiss3d::color::Color::new(rgb.x, rgb.y, rgb.z, 1.0)
    }
}

/// Linear light of an sRGB colour (code values from 0 to 1).
pub fn light(color: [f64; 3]) -> Rgb {
    let [r, g, b] = color.map(|code| {
        let light = if code <= 0.04045 {
            code / 12.92
        } else {
            ((code + 0.055) / 1.055).powf(2.4)
        };
        light as f32
    });
    Rgb::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_become_light() {
        // Middle grey has this value in the table of the standard.
        let light = light([0.0, 0.5, 1.0]);
        assert!(
            light.x == 0.0 && (light.y - 0.214).abs() < 1e-3 && (light.z - 1.0).abs() < 1e-6,
            "{light}"
        );
    }
}
