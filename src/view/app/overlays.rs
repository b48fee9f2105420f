//! What can be drawn over the robot, each to be toggled.

use super::colors::{self, Named};

/// One thing to see beside the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlay {
    Com,
    Zmp,
    ZmpRef,
    Dcm,
    Support,
    Slices,
    Footstep,
    Contacts,
    Push,
}

/// Every overlay: key, name, colour.
pub const OVERLAYS: [(Overlay, char, &str, Named); 9] = [
    (Overlay::Com, 'C', "COM", colors::COM),
    (Overlay::Zmp, 'Z', "ZMP measured", colors::ZMP),
    (Overlay::ZmpRef, 'W', "ZMP wanted", colors::ZMP_REF),
    (Overlay::Dcm, 'D', "DCM", colors::DCM),
    (Overlay::Support, 'S', "support", colors::SUPPORT),
    (Overlay::Slices, 'G', "CPI sets", colors::SLICE),
    (Overlay::Footstep, 'F', "footstep", colors::FOOTSTEP),
    (Overlay::Contacts, 'K', "contact forces", colors::CONTACT),
    (Overlay::Push, 'A', "push", colors::PUSH),
];

/// Which are shown.
#[derive(Debug, Clone, Copy)]
pub struct Shown([bool; OVERLAYS.len()]);

impl Default for Shown {
    /// All.
    fn default() -> Self {
        Self([true; OVERLAYS.len()])
    }
}

impl Shown {
    pub fn has(&self, overlay: Overlay) -> bool {
        OVERLAYS.iter().zip(self.0).any(|((other, ..), shown)| *other == overlay && shown)
    }

    pub fn toggle(&mut self, overlay: Overlay) {
        for ((other, ..), shown) in OVERLAYS.iter().zip(&mut self.0) {
            *shown ^= *other == overlay;
        }
    }
}
