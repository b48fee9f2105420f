//! Stepping: what the robot does with its feet when no set holds the state. A footwork rule has one life cycle: when to lift,
//! which foot and where to ([`Footwork::lift`]); what a tick with a foot in the air commands ([`Footwork::swing`]); when the foot has
//! landed ([`Footwork::landing`]). There are the paper's rule ([`paper`]) and one that catches the robot ([`catch`]); a new one is a
//! file here and a line in [`footwork()`].

pub mod catch;
mod footwork;
pub mod paper;
mod quintic;
mod swing;

use crate::control::design::Design;
use crate::lipm::gains::FootworkRules;
pub use footwork::{Footwork, Landing, LastLanding, StepState};
pub use swing::{PlannedFootstep, Swing, SwingTiming};

/// The rule that a gain set asks for.
pub fn footwork(design: &Design) -> Option<Box<dyn Footwork>> {
    Some(match design.family.footwork? {
        FootworkRules::Stepping(rules) => Box::new(paper::PaperFootwork::new(rules)),
        FootworkRules::Catching(rules) => Box::new(catch::CatchFootwork::new(rules, design)),
    })
}
