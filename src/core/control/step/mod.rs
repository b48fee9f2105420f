//! Stepping: what the robot does with its feet when the state is in no CPI set. A footwork rule decides when to lift
//! which foot, and where to put it ([`Footwork::lift`]); what to command with a foot in the air ([`Footwork::swing`]);
//! and when the foot has landed ([`Footwork::landing`]). There are two rules: the paper's ([`paper`]), and one that
//! continues to plan during the swing ([`catch`]) and leads the feet home when the robot has come to rest (`home.rs`).
//! A new rule is a new file here and a line in [`footwork()`].

pub mod catch;
mod footwork;
mod home;
pub mod paper;
mod quintic;
pub mod reach;
mod swing;

use crate::control::design::{Design, FootworkRules};
pub use footwork::{Footwork, Landing, LastLanding, StepState};
pub use swing::{PlannedFootstep, Swing, SwingTiming, Way};

/// The footwork rule of a gain set; None if it takes no footsteps.
pub fn footwork(design: &Design) -> Option<Box<dyn Footwork>> {
    Some(match design.footwork? {
        FootworkRules::Stepping(rules) => Box::new(paper::PaperFootwork::new(rules)),
        FootworkRules::Catching(rules) => Box::new(catch::CatchFootwork::new(rules, design)),
    })
}
