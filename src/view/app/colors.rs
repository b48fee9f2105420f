//! Colours of the window: those of the palette that pictures and replays have too, and of what is around the robot.

use super::mesh::Rgb;
use crate::render::palette::Overlay;
use kiss3d::color::Color;
use kiss3d::egui::Color32;

/// A colour by its red, green and blue (sRGB, 0 to 255).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Named(pub u8, pub u8, pub u8);

pub const COM: Named = Named::of(Overlay::Com);
pub const ZMP: Named = Named::of(Overlay::Zmp);
pub const ZMP_REF: Named = Named::of(Overlay::ZmpRef);
pub const DCM: Named = Named::of(Overlay::Dcm);
pub const SUPPORT: Named = Named::of(Overlay::Support);
pub const SLICE: Named = Named::of(Overlay::Slices);
pub const FOOTSTEP: Named = Named::of(Overlay::Footstep);
pub const CONTACT: Named = Named::of(Overlay::Contacts);
pub const PUSH: Named = Named::of(Overlay::Push);

pub const SKY: Named = Named(0xe9, 0xed, 0xf2);
pub const FLOOR: Named = Named(0xcf, 0xd6, 0xde);
pub const GRID: Named = Named(0xb4, 0xbe, 0xc9);
pub const SHADOW: Named = Named(0xb3, 0xbb, 0xc5);
pub const INK: Named = Named(0x1f, 0x29, 0x33);

impl Named {
    pub const fn of(overlay: Overlay) -> Self {
        let [_, r, g, b] = overlay.color().to_be_bytes();
        Self(r, g, b)
    }

    pub fn egui(self) -> Color32 {
        Color32::from_rgb(self.0, self.1, self.2)
    }

    /// With an opacity, 0 to 1.
    pub fn faint(self, opacity: f32) -> Color32 {
        self.egui().gamma_multiply(opacity)
    }

    /// For what the material draws: light, not code values.
    pub fn linear(self) -> Rgb {
        let [r, g, b] = [self.0, self.1, self.2].map(|v| linear(f32::from(v) / 255.0));
        Rgb::new(r, g, b)
    }

    /// For lines and the background, which are drawn as light too.
    pub fn line(self) -> Color {
        let rgb = self.linear();
        Color::new(rgb.x, rgb.y, rgb.z, 1.0)
    }

    /// This much (0 to 1) of the way to another colour.
    pub fn towards(self, other: Named, share: f32) -> Named {
        let mix = |a: u8, b: u8| (f32::from(a) + share * (f32::from(b) - f32::from(a))).round() as u8;
        Named(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }
}

/// From an sRGB code value (0 to 1) to light.
pub fn linear(code: f32) -> f32 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_mix_and_become_light() {
        assert_eq!(Named::of(Overlay::Com), Named(0x7b, 0x3f, 0xa0));
        assert_eq!(Named(0, 100, 255).towards(Named(100, 0, 255), 0.5), Named(50, 50, 255));
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        // Middle grey of the standard's table.
        assert!((linear(0.5) - 0.214).abs() < 1e-3);
    }
}
