//! What the controller is doing, in words, for replays, the labels of pictures, and the window.

use crate::control::Phase;
use crate::episode::Snapshot;
use crate::robot::Foot;

/// What the controller does in a phase.
pub fn doing(phase: Phase) -> &'static str {
    match phase {
        Phase::Posture => "posture held",
        Phase::Switching => "standing",
        Phase::OutOfSets => "outside of all sets",
        Phase::Swing(Foot::Left) => "left foot in the air",
        Phase::Swing(Foot::Right) => "right foot in the air",
    }
}

/// Why no gain is in use in a phase.
pub fn without_gain(phase: Phase) -> &'static str {
    match phase {
        Phase::Swing(_) => "none, a foot is in the air",
        Phase::Posture => "none, the posture is held",
        Phase::Switching | Phase::OutOfSets => "none",
    }
}

/// The label of a moment: the name of the gain in use or, if there is none, what the controller does.
pub fn in_short(now: &Snapshot, gains: &[String]) -> String {
    match now.gain.and_then(|gain| gains.get(gain)).filter(|_| now.phase == Phase::Switching) {
        Some(gain) => format!("gain {gain}"),
        None => doing(now.phase).into(),
    }
}
