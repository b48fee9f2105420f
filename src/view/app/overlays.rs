//! Which of the overlays are shown.

use crate::render::palette::Overlay;

/// One switch for each overlay.
#[derive(Debug, Clone, Copy)]
pub struct Shown([bool; Overlay::ALL.len()]);

impl Default for Shown {
    /// All.
    fn default() -> Self {
        Self([true; Overlay::ALL.len()])
    }
}

impl Shown {
    pub fn has(&self, overlay: Overlay) -> bool {
        self.0[overlay as usize]
    }

    pub fn toggle(&mut self, overlay: Overlay) {
        self.0[overlay as usize] ^= true;
    }
}
