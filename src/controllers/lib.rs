//! The kinds of controllers, each behind the socket ([`Controller`]).
//!
//! The file of a controller says of which kind it is: `kind = "posture"`. A file without a kind is a gain set, of the kind
//! `cpi`. A new kind is a file here and a line in `kinds.rs`, or a crate of its own that [adds](kinds::add) it. Whoever drives, judges or compares controllers gets a
//! [`PreparedController`] and knows nothing of kinds.

#![forbid(unsafe_code)]

mod child;
mod command;
pub mod companion_files;
mod cpi;
pub mod kinds;
pub mod permission;
mod policy_file;
mod posture;
mod process;
mod python;
pub mod spec;
pub mod tunable;
pub mod turns;
pub mod values;
pub mod variant;

use standfast_core::control::CpiController;
use standfast_core::error::{Error, Result};
use standfast_core::lipm::GainSet;
use standfast_core::lipm::catching::Departures;
use standfast_core::socket::{Controller, PreparedController};
use standfast_files::assets::{self, InputKind, Source, parse_toml};
use std::any::Any;
use variant::ControllerName;

pub use child::STOP;
pub use kinds::read;
pub use policy_file::PolicyFile;
pub use spec::{ControllerSpec, Own};

/// Loads a built-in controller, a file, or a variant of either.
pub fn load(entry: &str) -> Result<Box<dyn ControllerSpec>> {
    let entry = ControllerName::split(entry);
    entry.of(read(&assets::open(InputKind::Controller, entry.base)?)?)
}

/// Loads a gain set as [`load`] does. Fails for a controller of another kind.
pub fn gain_set(entry: &str) -> Result<GainSet> {
    let any: Box<dyn Any> = load(entry)?;
    let gains = any.downcast::<GainSet>().map(|gains| *gains);
    gains.map_err(|_| {
        let problem = "has no gains, so no CPI sets";
        let accepted = "a controller of kind \"cpi\", such as switching";
        Error::value("command line", "gain set", entry, problem, accepted)
    })
}

/// Reads a gain set. Errors name the file, the field, its value and what is accepted.
pub fn parse_gain_set(source: &Source) -> Result<GainSet> {
    let gains: GainSet = parse_toml(source)?;
    gains.validate(&source.file)?;
    Ok(gains)
}

/// Replaces the controller during an episode. If both are gain sets, the new one continues from the state of the old
/// one. Otherwise the new one starts as if the robot were at home and at rest.
pub fn replace(controller: &mut Box<dyn Controller>, factory: &PreparedController, seed: u64) {
    let next = factory.start(seed);
    let both = (
        (&mut **controller as &mut dyn Any).downcast_mut(),
        (&*next as &dyn Any).downcast_ref(),
    );
    match both {
        (Some(now), Some(next)) => cpi::switch(now, next),
        _ => *controller = next,
    }
}

/// Makes the first footsteps of a gain set's controller depart from its rule. It must be called before these footsteps.
pub fn depart(controller: &mut Box<dyn Controller>, departures: &Departures) {
    let controller: Option<&mut CpiController> = (&mut **controller as &mut dyn Any).downcast_mut();
    controller
        .expect("a gain set is driven by this controller")
        .depart(departures);
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_files::assets::Source;

    fn read_text(text: &str) -> Result<Box<dyn ControllerSpec>> {
        read(&Source {
            file: "c.toml".into(),
            text: text.into(),
        })
    }

    #[test]
    fn a_file_says_of_which_kind_it_is_and_is_a_gain_set_if_it_does_not() {
        let gain_set = "name = 'mine'\n[[gains]]\nname = 'one'\nx = [1, 1, 5]\ny = [1, 1, 5]\n";
        for text in [
            gain_set,
            &format!("kind = 'cpi'\n{gain_set}"),
            "kind = 'posture'\nname = 'mine'\n",
        ] {
            assert_eq!(read_text(text).unwrap().name(), "mine");
        }
        for (text, words) in [
            (
                "kind = 'walk'\nname = 'mine'",
                "c.toml: kind = \"walk\": is no kind of controller; accepted: \"cpi\", \"posture\", \"process\"",
            ),
            (
                "kind = 3\nname = 'mine'",
                "c.toml: kind = 3: is no kind of controller",
            ),
            (
                "kind = 'posture'\nname = 'mine'\nstiff = 1",
                "unknown field `stiff`",
            ),
            (
                "kind = 'posture'\nname = ' '",
                "c.toml: name = \" \": is empty; accepted: a name",
            ),
        ] {
            let message = read_text(text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn every_built_in_controller_can_be_prepared() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        for name in InputKind::Controller.names() {
            let settings = load(name).unwrap();
            let factory = settings.prepare(&robot, 0.002).unwrap();
            assert_eq!(
                (settings.name(), &factory.name[..], &factory.warning),
                (name, name, &None)
            );
            let controller = factory.start(0);
            let report = controller.report();
            assert!(
                report
                    .totals()
                    .all(|(total, _)| settings.totals().contains(&total)),
                "{report:?}"
            );
        }
    }
}
