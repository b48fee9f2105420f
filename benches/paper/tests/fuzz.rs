//! A scenario's file with any content is read or refused in words, and a scenario that is read can be simulated.

use crate::mutations::{fuzz, simulated};
use standfast::core::control::Design;
use standfast::core::lipm::GainSet;
use standfast::files::assets::Source;
use standfast::sim::episode::{Disturbance, EpisodeConfig};
use standfast_paper::imposed;
use standfast_paper::scenario::{BUILTIN, Cause, Scenario};

#[test]
fn scenarios() {
    let valid = BUILTIN.map(|(_, text)| text.to_string());
    fuzz("scenario", &valid, |text| {
        let scenario = Scenario::parse(&Source {
            file: "mine.toml".into(),
            text: text.into(),
        })?;
        let (robot, gains) = (
            standfast::robots::load(&scenario.robot)?,
            standfast_paper::gain_set(&scenario.gains)?,
        );
        let config = EpisodeConfig {
            horizon_s: scenario.horizon_s.min(0.05),
            ..scenario.episode(&robot)
        };
        match scenario.cause()? {
            Cause::Push(push) => simulated(
                &robot,
                &gains,
                &config,
                Disturbance {
                    pushes: vec![push],
                    ..Disturbance::default()
                },
            ),
            Cause::Imposed(error) => {
                let gains = GainSet {
                    gains: gains.gains.iter().take(1).cloned().collect(),
                    ..gains
                };
                let design = Design::new(&robot, &gains, config.control_period_s)?;
                imposed::run(
                    &robot,
                    &design,
                    &config,
                    error.zmp_error_m.into(),
                    error.start,
                    &mut |_| {},
                )
                .map(|_| ())
            }
        }
    });
}
