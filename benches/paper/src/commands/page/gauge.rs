//! Strikes by the paper's apparatus (Fig. 10), a force gauge that hangs on wires, and searches of the drawbacks from which
//! on the robot steps, and recovers.

use super::study::{by, is_not, push_of};
use crate::render::page::study::Struck;
use nalgebra::Vector3;
use standfast::core::error::Result;
use standfast::core::robot::Robot;
use standfast::core::socket::PreparedController;
use standfast::sim::Push;
use standfast::sim::episode::{self, EpisodeConfig, Outcome, Record};

/// Largest difference between the two drawbacks that a search ends with (m).
const PRECISION_M: f64 = 0.01;
/// How long the search waits for a footstep after a strike (s).
const WATCHED_S: f64 = 0.4;

/// Strikes from one side, from soft to hard: the hardest one found to which the robot does not respond with a footstep, the
/// softest one to which it does, if it then falls also the softest one from which it recovers, and that of the scenario. Fails
/// if the scenario has no bob, or does not lead to a footstep.
pub fn strikes(robot: &Robot, factory: &PreparedController, name: &str) -> Result<Vec<Struck>> {
    let (push, config) = push_of(robot, name)?;
    let Some(bob) = push.bob else {
        return Err(is_not(name, "one with a bob"));
    };
    let brief = EpisodeConfig {
        horizon_s: push.start_s + WATCHED_S,
        ..config
    };
    let from = |config, draw_m: f64| {
        let impulse_n_s = bob.momentum_n_s(draw_m);
        let push = Push {
            impulse_n_s,
            ..push
        };
        strike(robot, factory, config, push)
    };
    // Halves the drawbacks between one that is too small and one that is large enough.
    let between = |mut ends_m: [f64; 2], config, is_enough: fn(&Record) -> bool| {
        while ends_m[1] - ends_m[0] > PRECISION_M {
            let middle_m = 0.5 * (ends_m[0] + ends_m[1]);
            ends_m[usize::from(is_enough(&from(config, middle_m)?.record))] = middle_m;
        }
        Ok(ends_m)
    };
    let asked = strike(robot, factory, config, push)?;
    let is_caught = |record: &Record| record.outcome == Outcome::Recovered;
    if !(asked.record.footsteps.has_begun() && is_caught(&asked.record)) {
        return Err(is_not(
            name,
            "one that leads to a footstep and is recovered from",
        ));
    }
    let asked_m = bob.draw_m(push.impulse_n_s);
    let [held_m, stepped_m] = between([0.0, asked_m], brief, |r| r.footsteps.has_begun())?;
    let mut found = vec![from(config, held_m)?, from(config, stepped_m)?];
    if !is_caught(&found[1].record) {
        let [_, caught_m] = between([stepped_m, asked_m], config, is_caught)?;
        found.push(from(config, caught_m)?);
    }
    found.push(asked);
    Ok(found)
}

/// A strike, with what the robot gets of it.
fn strike(
    robot: &Robot,
    factory: &PreparedController,
    config: EpisodeConfig,
    push: Push,
) -> Result<Struck> {
    let (mut forces, mut impulse) = (Vec::new(), Vector3::zeros());
    let record = episode::run(
        robot,
        factory,
        &config,
        by(push),
        config.until(),
        &mut |tick| {
            impulse += tick.truth.push_force * config.control_period_s;
            if let Some(strike) = &tick.truth.strike {
                forces.extend(&strike.forces()[forces.len()..]);
            }
        },
    )?;
    Ok(Struck {
        push,
        record,
        forces,
        impulse,
    })
}
