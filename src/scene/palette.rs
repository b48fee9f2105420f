//! The overlays: the robot's body and all marks beside it, with their colours, keys, names and styles. They are the same in
//! the window and in replays.

use super::sign::Sign;
use nalgebra::Point2;
use serde::Serialize;
use serde_json::{Map, Value, json};
use standfast_sim::episode::Snapshot;
use standfast_sim::episode::snapshot::Arrow;

/// Style of the dashed line between the COM and the ground.
pub const PLUMB: Plumb = Plumb {
    width: 1.5,
    opacity: 0.8,
    dash: 5.0,
    gap: 4.0,
};

/// A dashed line, with lengths in points of a screen and an opacity from 0 to 1.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Plumb {
    pub width: f64,
    pub opacity: f64,
    pub dash: f64,
    pub gap: f64,
}

/// The looks of a ghost: the robot of a second entrant in the same trial, in one transparent colour.
pub const GHOST: Ghost = Ghost {
    key: 'e',
    hint: "the second robot, with its COM and its ZMP",
    color: Color::hex(0x4a7dbf),
    opacity: 0.42,
    marks: [Overlay::Com, Overlay::Zmp],
    marks_opacity: 0.55,
};

/// Key, colour and opacities (0 to 1) of a ghost and of its marks.
#[derive(Debug, Clone, Copy)]
pub struct Ghost {
    pub key: char,
    pub hint: &'static str,
    pub color: Color,
    pub opacity: f64,
    pub marks: [Overlay; 2],
    pub marks_opacity: f64,
}

/// Time for which a push stays in the picture after its end (s), since it may be shorter than a frame.
pub const AFTERGLOW_S: f64 = 0.3;

/// Length and breadth of an arrow's head, as multiples of the width of its shaft.
pub const HEAD: [f64; 2] = [3.6, 3.2];

/// A colour in sRGB, 8 bits each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    pub const WHITE: Self = Self(255, 255, 255);

    pub const fn hex(rgb: u32) -> Self {
        let [_, r, g, b] = rgb.to_be_bytes();
        Self(r, g, b)
    }

    pub fn css(self) -> String {
        let Self(r, g, b) = self;
        format!("#{r:02x}{g:02x}{b:02x}")
    }

    /// The code values, from 0 to 1.
    pub fn parts(self) -> [f64; 3] {
        [self.0, self.1, self.2].map(|v| f64::from(v) / 255.0)
    }

    /// The colour at a share (0 to 1) of the way to another one.
    pub fn towards(self, other: Self, share: f32) -> Self {
        let mix =
            |a: u8, b: u8| (f32::from(a) + share * (f32::from(b) - f32::from(a))).round() as u8;
        Self(
            mix(self.0, other.0),
            mix(self.1, other.1),
            mix(self.2, other.2),
        )
    }
}

/// One kind of mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlay {
    Support,
    Slices,
    Footstep,
    Contacts,
    Push,
    Com,
    Dcm,
    ZmpRef,
    Zmp,
    Trail,
    Body,
}

/// Name, key, colour and style of an overlay.
#[derive(Debug, Clone, Copy)]
pub struct OverlayLook {
    /// Name of the overlay in the script of a page, where the data of a moment have the same name.
    pub id: &'static str,
    /// The key that shows and hides the overlay, in lower case.
    pub key: char,
    pub name: &'static str,
    /// A short explanation.
    pub hint: &'static str,
    pub color: Color,
    pub style: Style,
}

/// The part of a snapshot that an overlay shows, and its style. Widths are in points of a screen.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Style {
    /// A convex polygon on the ground.
    Polygon {
        #[serde(skip)]
        of: fn(&Snapshot) -> Vec<Point2<f64>>,
        sheet: Sheet,
    },
    /// The slices of the CPI sets on the ground, with the slice of the active gain over the others.
    Sets { resting: Sheet, acting: Sheet },
    /// A point of the ground.
    Spot {
        #[serde(skip)]
        of: fn(&Snapshot) -> Option<Point2<f64>>,
        sign: Sign,
    },
    /// The COM: a sign in the air, a plumb line from the COM to the ground, and a sign at the end of the line.
    Com { sign: Sign, foot: Sign },
    /// Forces. If `ends`, an arrow ends at the point where its force acts, or else it begins there. Its length (m/N) is
    /// for a robot of the size of UT-mu2.
    Arrow {
        #[serde(skip)]
        of: fn(&Snapshot) -> Vec<Arrow>,
        m_per_n: f64,
        ends: bool,
        width: f64,
    },
    /// The paths of COM and DCM over the ground up to the present moment.
    Trail { width: f64, opacity: f64 },
    /// The robot itself, and its opacity while it is switched off.
    Body { opacity: f64 },
}

/// Style of a polygon on the ground: the opacity of its filling, and the opacity and width of its edge.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Sheet {
    pub fill: f64,
    pub edge: f64,
    pub width: f64,
}

impl Overlay {
    /// All overlays in the order in which they are drawn, one over the other. The signs of points get smaller from one
    /// to the next, so that all are visible at rest, when the points coincide.
    pub const ALL: [Self; 11] = [
        Self::Support,
        Self::Slices,
        Self::Footstep,
        Self::Contacts,
        Self::Push,
        Self::Com,
        Self::Dcm,
        Self::ZmpRef,
        Self::Zmp,
        Self::Trail,
        Self::Body,
    ];

    /// How this overlay looks.
    pub const fn look(self) -> OverlayLook {
        const fn sheet(fill: f64, edge: f64, width: f64) -> Sheet {
            Sheet { fill, edge, width }
        }
        const fn spot(sign: Sign, of: fn(&Snapshot) -> Option<Point2<f64>>) -> Style {
            Style::Spot { of, sign }
        }
        let (id, key, name, hint, color, style) = match self {
            Self::Support => {
                let style = Style::Polygon {
                    of: |now| now.support.clone(),
                    sheet: sheet(0.1, 1.0, 2.5),
                };
                (
                    "support",
                    's',
                    "support",
                    "hull of the soles on the ground",
                    0x5b6b7b,
                    style,
                )
            }
            Self::Slices => {
                let style = Style::Sets {
                    resting: sheet(0.05, 0.55, 1.25),
                    acting: sheet(0.4, 1.0, 2.25),
                };
                (
                    "sets",
                    'i',
                    "CPI sets",
                    "for each gain, where its set lets the COM be; that of the gain in use is filled",
                    0x2f6fdd,
                    style,
                )
            }
            Self::Footstep => {
                let style = Style::Polygon {
                    of: |now| {
                        let corners = now.footstep.iter().flatten();
                        corners.map(|corner| corner.xy()).collect()
                    },
                    sheet: sheet(0.28, 1.0, 2.5),
                };
                (
                    "footstep",
                    'f',
                    "footstep",
                    "where the foot in the air is to land",
                    0x00a3a3,
                    style,
                )
            }
            Self::Contacts => {
                let style = Style::Arrow {
                    of: |now| {
                        let contacts = [now.contacts.left, now.contacts.right];
                        contacts.into_iter().flatten().collect()
                    },
                    m_per_n: 0.002,
                    ends: false,
                    width: 3.0,
                };
                (
                    "contacts",
                    'g',
                    "ground forces",
                    "the force on each sole",
                    0x4fb84f,
                    style,
                )
            }
            Self::Push => {
                let style = Style::Arrow {
                    of: |now| now.push.into_iter().collect(),
                    m_per_n: 0.004,
                    ends: true,
                    width: 4.0,
                };
                (
                    "push",
                    'p',
                    "push",
                    "the force of the push, which fades after its end",
                    0xe4002b,
                    style,
                )
            }
            Self::Com => {
                let style = Style::Com {
                    sign: Sign::Quartered,
                    foot: Sign::Cross,
                };
                (
                    "com",
                    'c',
                    "COM",
                    "centre of mass, and its projection on the ground",
                    0x7b3fa0,
                    style,
                )
            }
            Self::Dcm => {
                let style = spot(Sign::Diamond, |now| Some(now.dcm));
                (
                    "dcm",
                    'd',
                    "DCM",
                    "divergent component of motion (capture point)",
                    0x0b7a3b,
                    style,
                )
            }
            Self::ZmpRef => {
                let style = spot(Sign::Ring, |now| now.zmp_ref);
                (
                    "zmpRef",
                    'w',
                    "ZMP wanted",
                    "the ZMP that the controller asks for",
                    0xff9f1c,
                    style,
                )
            }
            Self::Zmp => {
                let style = spot(Sign::Disc, |now| now.zmp);
                (
                    "zmp",
                    'z',
                    "ZMP",
                    "the ZMP that the forces under the soles have",
                    0xd62728,
                    style,
                )
            }
            Self::Trail => {
                let style = Style::Trail {
                    width: 1.8,
                    opacity: 0.75,
                };
                (
                    "trail",
                    't',
                    "trails",
                    "the paths of COM and DCM over the ground up to now",
                    0x7f8894,
                    style,
                )
            }
            Self::Body => (
                "body",
                'b',
                "body",
                "the robot; without it, its transparent shape",
                0x593399,
                Style::Body { opacity: 0.22 },
            ),
        };
        OverlayLook {
            id,
            key,
            name,
            hint,
            color: Color::hex(color),
            style,
        }
    }

    pub const fn color(self) -> Color {
        self.look().color
    }
}

/// All overlays as JSON, for the script of a page.
pub fn json() -> Value {
    let looks = Overlay::ALL.map(|overlay| {
        let OverlayLook { id, key, name, hint, color, style } = overlay.look();
        let look = json!({ "id": id, "key": key, "name": name, "hint": hint, "color": color.css(), "style": style });
        (id.to_string(), look)
    });
    let Ghost {
        key,
        hint,
        color,
        opacity,
        marks,
        marks_opacity,
    } = GHOST;
    let ghost = json!({
        "id": "ghost", "key": key, "hint": hint, "color": color.css(), "opacity": opacity,
        "marks": marks.map(|mark| mark.look().id), "marks_opacity": marks_opacity,
    });
    let overlays = Map::from_iter(looks);
    json!({ "overlays": overlays, "ghost": ghost, "plumb": PLUMB, "head": HEAD, "afterglow_s": AFTERGLOW_S })
}

/// The colours of the overlays as variables of a style sheet.
pub fn css() -> String {
    let variables =
        Overlay::ALL.map(|overlay| format!("--{}:{}", overlay.look().id, overlay.color().css()));
    format!(":root{{{}}}\n", variables.join(";"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlays_can_be_told_apart() {
        for (i, a) in Overlay::ALL.into_iter().map(Overlay::look).enumerate() {
            assert!(a.key.is_ascii_lowercase() && a.key != GHOST.key);
            for b in Overlay::ALL.into_iter().skip(i + 1).map(Overlay::look) {
                assert!(
                    a.id != b.id && a.key != b.key && a.name != b.name && a.color != b.color,
                    "{a:?} {b:?}"
                );
            }
        }
    }
}
