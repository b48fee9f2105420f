//! What the controller is doing, in words, for replays, the labels of pictures, and the window.

use standfast_sim::episode::Snapshot;

/// The phases of our own controllers, with what the controller does in them and why no gain is then in use.
pub const PHASES: [(&str, &str, &str); 5] = [
    ("posture", "posture held", "none, the posture is held"),
    ("switching", "standing", "none"),
    ("out-of-sets", "outside of all sets", "none"),
    ("swing-left", "left foot in the air", "none, a foot is in the air"),
    ("swing-right", "right foot in the air", "none, a foot is in the air"),
];

/// What the controller does in a phase: for one of another controller, its name.
pub fn doing(phase: &str) -> String {
    let known = PHASES.iter().find(|(name, ..)| *name == phase);
    known.map_or_else(|| phase.replace('-', " "), |(_, doing, _)| doing.to_string())
}

/// Why no gain is in use in a phase.
pub fn without_gain(phase: &str) -> &'static str {
    PHASES.iter().find(|(name, ..)| *name == phase).map_or("none", |(.., why)| why)
}

/// The label of a moment: the name of the gain in use or, if there is none, what the controller does.
pub fn in_short(now: &Snapshot) -> String {
    match now.gain.as_ref().filter(|_| now.phase == "switching") {
        Some(gain) => format!("gain {gain}"),
        None => doing(&now.phase),
    }
}
