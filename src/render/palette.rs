//! What can be drawn over the robot: its colour, its key and its name, the same in the window, in pictures and in replays.

use serde_json::{Map, Value, json};

/// One thing to see beside the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlay {
    Com,
    Dcm,
    Zmp,
    ZmpRef,
    Support,
    Slices,
    Footstep,
    Contacts,
    Push,
}

/// How an overlay is told apart.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Its name in a page's script.
    pub id: &'static str,
    /// Shows and hides it; lower case.
    pub key: char,
    pub name: &'static str,
    /// sRGB, 0xrrggbb.
    pub color: u32,
}

impl Overlay {
    pub const ALL: [Self; 9] = [
        Self::Com,
        Self::Dcm,
        Self::Zmp,
        Self::ZmpRef,
        Self::Support,
        Self::Slices,
        Self::Footstep,
        Self::Contacts,
        Self::Push,
    ];

    pub const fn look(self) -> Look {
        let (id, key, name, color) = match self {
            Self::Com => ("com", 'c', "COM", 0x7b3fa0),
            Self::Dcm => ("dcm", 'd', "DCM", 0x0b7a3b),
            Self::Zmp => ("zmp", 'z', "ZMP", 0xd62728),
            Self::ZmpRef => ("zmpRef", 'w', "ZMP wanted", 0xff9f1c),
            Self::Support => ("support", 's', "support", 0x5b6b7b),
            Self::Slices => ("sets", 'i', "CPI sets", 0x2f6fdd),
            Self::Footstep => ("footstep", 'f', "footstep", 0x00a3a3),
            Self::Contacts => ("contacts", 'g', "ground forces", 0x4fb84f),
            Self::Push => ("push", 'p', "push", 0xe4002b),
        };
        Look { id, key, name, color }
    }

    pub const fn color(self) -> u32 {
        self.look().color
    }

    /// The colour as CSS has it.
    pub fn css(self) -> String {
        format!("#{:06x}", self.color())
    }
}

/// Everything of it, for a page's script.
pub fn json() -> Value {
    let looks = Overlay::ALL.map(|overlay| {
        let Look { id, key, name, .. } = overlay.look();
        (id.to_string(), json!({ "id": id, "key": key, "name": name, "color": overlay.css() }))
    });
    json!({ "overlays": Map::from_iter(looks) })
}

/// The variables of a page's style.
pub fn css() -> String {
    let variables = Overlay::ALL.map(|overlay| format!("--{}:{}", overlay.look().id, overlay.css()));
    format!(":root{{{}}}\n", variables.join(";"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlays_can_be_told_apart() {
        for (i, a) in Overlay::ALL.into_iter().map(Overlay::look).enumerate() {
            assert!(a.key.is_ascii_lowercase());
            for b in Overlay::ALL.into_iter().skip(i + 1).map(Overlay::look) {
                assert!(a.id != b.id && a.key != b.key && a.name != b.name && a.color != b.color, "{a:?} {b:?}");
            }
        }
    }
}
