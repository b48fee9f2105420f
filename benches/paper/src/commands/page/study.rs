//! Runs all simulations and all searches of CPI sets of the page, once for all figures.

use super::gauge;
use super::watch::PushedWatch;
use crate::imposed::{self, ImposedRecord};
use crate::render::page::study::{ImposedRun, Pushed, Study};
use crate::scenario::{Cause, Imposed, Scenario};
use rayon::prelude::*;
use standfast::commands::progress::Progress;
use standfast::controllers;
use standfast::core::control::{Design, home_polygon};
use standfast::core::error::{Error, Result};
use standfast::core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast::core::robot::{Kinematics, PerFoot, Robot};
use standfast::core::socket::PreparedController;
use standfast::report::figure::motion::MotionPlot;
use standfast::sim::Push;
use standfast::sim::episode::{self, Disturbance, EpisodeConfig, Film, Snapshot};

/// Gain set with the same gains that takes no footstep, to show what the footstep is worth.
const WITHOUT_FOOTSTEP: &str = "switching";
/// Gain set that only holds the posture.
const STIFF: &str = "hold";
/// Headings towards which the push of Fig. 13 is tried (degrees), since the paper does not state its own.
pub const HEADINGS_DEG: [f64; 6] = [-120.0, -130.0, -140.0, -150.0, -160.0, -170.0];
/// Scenarios with pushes whose ZMP errors come close to the imposed errors of Sect. V.C.
const LIKE_IMPOSED: [&str; 2] = ["push-error-backward", "push-error-diagonal"];
/// Scenarios with the gauge that hangs on wires.
const STRUCK: [&str; 2] = ["gauge-behind", "gauge-diagonal"];
/// How long a film goes on after the end of its episode (s).
const AFTERMATH_S: f64 = 0.5;
/// Number of simulations and searches, for the progress bar.
const PARTS: u64 = 21;

/// Runs everything. Fails if the solver gives up, or if a built-in scenario is not of the kind that the figures need.
pub fn run() -> Result<Study> {
    let progress = Progress::of(PARTS, 0, "simulations and searches");
    let first = Scenario::load("push-behind")?;
    let robot = standfast::robots::load(&first.robot)?;
    let EpisodeConfig {
        control_period_s: period_s,
        judge,
        ..
    } = first.episode(&robot);
    let design_of = |gains: &str| Design::new(&robot, &crate::gain_set(gains)?, period_s);
    let factory_of = |name: &str| controllers::load(name)?.prepare(&robot, period_s);
    let design = design_of(&first.gains)?;
    let (factory, standing, stiff) = (
        PreparedController::from(design.clone()),
        factory_of(WITHOUT_FOOTSTEP)?,
        factory_of(STIFF)?,
    );
    let Some(rules) = design.stepping().copied() else {
        return Err(is_not(&first.name, "a gain set that takes footsteps"));
    };
    let home = home_polygon(&robot);
    let allowed = design.family.allowed_support(&home, &design.family.name)?;
    let sets = CpiSet::search_family(&design.family, &allowed)?;
    let inclusion = Inclusion::of(&sets)?;
    progress.tick();
    let run = |factory: &PreparedController, (push, config): &(Push, EpisodeConfig)| {
        let record = episode::run(
            &robot,
            factory,
            config,
            by(*push),
            config.until(),
            &mut |_| {},
        );
        progress.tick();
        record
    };
    let pushed = |name: &str| -> Result<Pushed> {
        let asked = push_of(&robot, name)?;
        let (push, config) = asked;
        let mut motion = MotionPlot::of_pushes(&[push]);
        let mut watch = PushedWatch::default();
        let film = Film::take(
            &robot,
            &factory,
            &config,
            by(push),
            (config.until(), AFTERMATH_S),
            &mut |tick| {
                let support = watch.see(&robot, period_s, tick);
                motion.moments.push(Snapshot {
                    support,
                    ..Snapshot::of(&robot, tick)
                });
            },
        )?;
        progress.tick();
        let seen = watch.seen;
        let (Some(lift), Some(landing), Some(&footstep)) =
            (seen.lift, seen.landing, film.record.footsteps.taken.first())
        else {
            return Err(is_not(name, "one that leads to a footstep"));
        };
        let (without_footstep, stiff) = (run(&standing, &asked)?, run(&stiff, &asked)?);
        Ok(Pushed {
            push,
            film,
            footstep,
            motion,
            lift,
            landing,
            seen,
            without_footstep,
            stiff,
        })
    };
    let (diagonal, config) = push_of(&robot, "push-diagonal")?;
    let mut asked = HEADINGS_DEG
        .map(|heading_deg| {
            (
                Push {
                    heading_deg,
                    ..diagonal
                },
                config,
            )
        })
        .to_vec();
    for name in LIKE_IMPOSED {
        asked.push(push_of(&robot, name)?);
    }

    // The runs do not depend on each other.
    let (((behind, diagonal), struck), tried): (_, Result<Vec<_>>) = rayon::join(
        || {
            rayon::join(
                || rayon::join(|| pushed("push-behind"), || pushed("push-diagonal")),
                || {
                    STRUCK.map(|name| {
                        let strikes = gauge::strikes(&robot, &factory, name);
                        progress.tick();
                        strikes
                    })
                },
            )
        },
        || {
            let each = asked.par_iter().with_max_len(1);
            each.map(|asked| Ok((asked.0, run(&factory, asked)?)))
                .collect()
        },
    );
    let [behind_struck, diagonal_struck] = struck;
    let pushes = [behind?, diagonal?];
    let impose = |name: &str| -> Result<(ImposedRecord, MotionPlot)> {
        let scenario = Scenario::load(name)?;
        let Cause::Imposed(Imposed { zmp_error_m, start }) = scenario.cause()? else {
            return Err(is_not(name, "an imposed error"));
        };
        let mut motion = MotionPlot::default();
        let record = imposed::run(
            &robot,
            &design,
            &scenario.episode(&robot),
            zmp_error_m.into(),
            start,
            &mut |tick| {
                motion.push(&robot, tick);
            },
        )?;
        progress.tick();
        Ok((record, motion))
    };
    let at_rest = |name: &str| -> Result<ImposedRun> {
        let (record, motion) = impose(name)?;
        let Some(&footstep) = record.footsteps.first() else {
            return Err(is_not(name, "one that leads to a footstep"));
        };
        Ok(ImposedRun {
            record,
            footstep,
            motion,
        })
    };
    let errors = [at_rest("error-backward")?, at_rest("error-diagonal")?];
    let moving = [impose("moving-backward")?.0, impose("moving-diagonal")?.0];
    progress.finish();
    let landed_allowed = design
        .family
        .allowed_support(&pushes[0].landing.polygon, &design.family.name)?;
    let landed_sets = CpiSet::search_family(&design.family, &landed_allowed)?;
    let kinematics = Kinematics::at_home(&robot);
    let soles = PerFoot::from_fn(|foot| kinematics.sole_pose(&robot, foot).translation.vector.xy());
    Ok(Study {
        stance: soles.left - soles.right,
        com: kinematics.com().xy(),
        robot,
        design,
        rules,
        judge,
        home,
        allowed,
        sets,
        inclusion,
        landed_allowed,
        landed_sets,
        pushes,
        tried: tried?,
        struck: [behind_struck?, diagonal_struck?],
        errors,
        moving,
    })
}

pub fn push_of(robot: &Robot, name: &str) -> Result<(Push, EpisodeConfig)> {
    let scenario = Scenario::load(name)?;
    let Cause::Push(push) = scenario.cause()? else {
        return Err(is_not(name, "a push"));
    };
    Ok((push, scenario.episode(robot)))
}

pub fn by(push: Push) -> Disturbance {
    Disturbance {
        pushes: vec![push],
        ..Disturbance::default()
    }
}

/// The error for a scenario that is not of the kind that the figures need.
pub fn is_not(scenario: &str, accepted: &str) -> Error {
    Error::value(
        "standfast-paper page",
        "scenario",
        scenario,
        "the figures cannot be made from it",
        accepted,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The study loads one robot and one gain set for all its scenarios.
    #[test]
    fn the_papers_scenarios_share_robot_and_gain_set() {
        let same = |scenario: &Scenario| (scenario.robot.clone(), scenario.gains.clone());
        let first = same(&Scenario::load("push-behind").unwrap());
        let others = [
            "push-diagonal",
            "error-backward",
            "error-diagonal",
            "moving-backward",
            "moving-diagonal",
        ];
        for name in others.into_iter().chain(LIKE_IMPOSED).chain(STRUCK) {
            assert_eq!(same(&Scenario::load(name).unwrap()), first, "{name}");
        }
    }
}
