//! The phase of the controller in words, for replays and the window.

/// The phases of our own controllers, each with the activity of the controller, and with the reason why no gain is in
/// use.
pub const PHASES: [(&str, &str, &str); 5] = [
    ("posture", "posture held", "none, the posture is held"),
    ("switching", "standing", "none"),
    ("out-of-sets", "outside of all sets", "none"),
    (
        "swing-left",
        "left foot in the air",
        "none, a foot is in the air",
    ),
    (
        "swing-right",
        "right foot in the air",
        "none, a foot is in the air",
    ),
];

/// The activity of the controller in a phase. For a phase of a foreign controller, it is the name of the phase.
pub fn doing(phase: &str) -> String {
    let known = PHASES.iter().find(|(name, ..)| *name == phase);
    known.map_or_else(
        || phase.replace('-', " "),
        |(_, doing, _)| doing.to_string(),
    )
}

/// Why no gain is in use in a phase.
pub fn without_gain(phase: &str) -> &'static str {
    PHASES
        .iter()
        .find(|(name, ..)| *name == phase)
        .map_or("none", |(.., why)| why)
}
