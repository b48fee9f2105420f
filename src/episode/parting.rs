//! Two episodes of one trial side by side, to see when and how they part.

use super::closed_loop::ClosedLoop;
use super::config::{Disturbance, EpisodeConfig};
use super::snapshot::LEAST_N;
use super::tick::{Controlled, Tick};
use crate::control::Design;
use crate::robot::{Foot, PerFoot, Robot};
use nalgebra::Vector2;
use serde::Serialize;

/// How two episodes of one trial run apart. Times are from their beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parting {
    /// The first moment at which the COMs, or the centres of a foot's soles, are horizontally farther apart than is asked.
    pub at_s: f64,
    /// What is so far apart.
    pub of: Apart,
    /// By how much (m).
    pub distance_m: f64,
    /// What the controllers are doing then; if that differs, since when it has, without a break.
    pub phases: [&'static str; 2],
    pub phases_differ_since_s: Option<f64>,
    /// Which soles bear a load then; if that differs, since when it has, without a break.
    pub loaded: [Loaded; 2],
    pub loaded_differ_since_s: Option<f64>,
}

/// What may be apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Apart {
    Com,
    LeftSole,
    RightSole,
}

/// The soles that bear a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loaded {
    BothSoles,
    LeftSole,
    RightSole,
    NoSole,
}

impl Loaded {
    fn at(tick: &Tick) -> Self {
        let bears = |foot: Foot| tick.truth.sole_wrenches[foot].force.norm() >= LEAST_N;
        match (bears(Foot::Left), bears(Foot::Right)) {
            (true, true) => Loaded::BothSoles,
            (true, false) => Loaded::LeftSole,
            (false, true) => Loaded::RightSole,
            (false, false) => Loaded::NoSole,
        }
    }
}

/// Half the width of the narrower sole of a robot, measured along its shorter side (m).
pub fn half_sole_width_m(robot: &Robot) -> f64 {
    let of = |foot: Foot| robot.soles[foot].half_m.into_iter().fold(f64::INFINITY, f64::min);
    of(Foot::Left).min(of(Foot::Right))
}

/// Runs a trial twice, each time with its settings, until COM or soles are farther apart than `limit_m`. None if they
/// never are, up to the horizon or to the first number that is not finite.
pub fn parting(
    robot: &Robot,
    design: &Design,
    configs: [&EpisodeConfig; 2],
    disturbance: impl Fn() -> Disturbance,
    limit_m: f64,
) -> Option<Parting> {
    let simulated = &disturbance().variation.robot(robot);
    let [mut a, mut b] = configs.map(|config| ClosedLoop::new(robot, simulated, design, config, disturbance()));
    let (mut phases_since_s, mut loaded_since_s) = (None, None);
    let ticks = (configs[0].horizon_s / configs[0].control_period_s).round() as u64;
    for _ in 0..=ticks {
        let (in_a, in_b) = (a.tick(), b.tick());
        if !(in_a.truth.is_finite() && in_b.truth.is_finite()) {
            return None;
        }
        let at_s = in_a.truth.time_s;
        let phases = [&in_a, &in_b].map(|tick| tick.account.phase.name());
        let loaded = [&in_a, &in_b].map(Loaded::at);
        let since = |since: Option<f64>, differ: bool| differ.then(|| since.unwrap_or(at_s));
        phases_since_s = since(phases_since_s, phases[0] != phases[1]);
        loaded_since_s = since(loaded_since_s, loaded[0] != loaded[1]);
        let (of, distance_m) = farthest(&in_a, &in_b);
        if distance_m > limit_m {
            let (phases_differ_since_s, loaded_differ_since_s) = (phases_since_s, loaded_since_s);
            return Some(Parting {
                at_s,
                of,
                distance_m,
                phases,
                phases_differ_since_s,
                loaded,
                loaded_differ_since_s,
            });
        }
        a.advance();
        b.advance();
    }
    None
}

/// What is horizontally farthest apart, and by how much (m).
fn farthest(a: &Tick, b: &Tick) -> (Apart, f64) {
    let soles = PerFoot::from_fn(|foot| {
        let at = |tick: &Tick| -> Vector2<f64> { tick.truth.soles[foot].translation.vector.xy() };
        (at(a) - at(b)).norm()
    });
    let com = (a.truth.com.xy() - b.truth.com.xy()).norm();
    let all = [(Apart::Com, com), (Apart::LeftSole, soles.left), (Apart::RightSole, soles.right)];
    all.into_iter().fold(all[0], |most, other| if other.1 > most.1 { other } else { most })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lipm::GainSet;
    use crate::sim::Push;

    /// The same push, and the same judged more coarsely in time: nothing parts with the same step, and a fall does with
    /// another one.
    #[test]
    fn episodes_part_when_they_are_as_far_apart_as_is_asked_and_not_before() {
        let robot = Robot::load("ut-mu2").unwrap();
        let config = EpisodeConfig { horizon_s: 1.0, ..EpisodeConfig::default() };
        let design = Design::new(&robot, &GainSet::load("hold").unwrap(), config.control_period_s).unwrap();
        let push = Push { impulse_n_s: 4.0, start_s: 0.1, ..Push::default() };
        let disturbance = || Disturbance { pushes: vec![push], ..Disturbance::default() };
        let part = |configs, limit_m| parting(&robot, &design, configs, disturbance, limit_m);
        assert_eq!(part([&config; 2], 1e-12), None);
        let other = EpisodeConfig { physics_step_s: crate::sim::PhysicsStep::all(0.001), ..config };
        let [near, far] = [1e-4, 2e-3].map(|limit_m| part([&config, &other], limit_m).unwrap());
        assert!(near.at_s < far.at_s && far.distance_m > 2e-3 && near.distance_m > 1e-4, "{near:?} {far:?}");
        assert!(near.at_s > 0.1 && far.at_s < 1.0, "not before the push: {near:?} {far:?}");
        assert_eq!(far.phases, ["posture"; 2]);
        let half_m = half_sole_width_m(&robot);
        assert!(robot.soles.left.half_m.contains(&half_m) && half_m < 0.05, "{half_m}");
    }
}
