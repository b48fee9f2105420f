//! What is simulated and searched for the figures, once for all of them: the paper's scenarios and its gain set's sets.

use crate::campaign::scenario::{Cause, Imposed, Scenario};
use crate::control::estimator::on_ground;
use crate::control::support::Support;
use crate::control::{Design, home_polygon};
use crate::episode::imposed::{self, ImposedRecord};
use crate::episode::{self, Disturbance, Film, Judge, Record, Tick};
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::gains::GainSet;
use crate::lipm::pendulum::State;
use crate::lipm::stepping::Stepping;
use crate::report::motion::MotionSample;
use crate::report::motion_plot::MotionPlot;
use crate::report::progress::Progress;
use crate::robot::{Kinematics, PerFoot, Posture, Robot};
use crate::sim::Push;
use nalgebra::{Isometry2, Vector2};

/// Gain set of the same gains that takes no footstep: what the footstep is worth.
const WITHOUT_FOOTSTEP: &str = "switching";
/// After an episode's end a film goes on (s).
const AFTERMATH_S: f64 = 0.5;
/// Simulations and searches, for the progress.
const PARTS: u64 = 9;

/// Everything that the figures show.
pub struct Study {
    pub robot: Robot,
    pub design: Design,
    pub rules: Stepping,
    /// What "stands still" and "home" are in all runs.
    pub judge: Judge,
    /// Support of both soles at home, control frame; and what of it the ZMP may use.
    pub home: SupportPolygon,
    pub allowed: SupportPolygon,
    pub sets: Vec<CpiSet>,
    pub inclusion: Inclusion,
    /// Sect. VI, Fig. 12 to 14: (a) from behind, (b) from diagonally forward left.
    pub pushes: [Pushed; 2],
    /// Sect. V.C, Fig. 8 and 9: (a), (b).
    pub errors: [ImposedRun; 2],
    /// The same errors, made by a COM that moves.
    pub moving: [ImposedRecord; 2],
}

/// A push in physics.
pub struct Pushed {
    pub push: Push,
    pub film: Film,
    pub motion: MotionPlot,
    /// The last tick on both feet before the first lift, and the first one after its landing.
    pub lift: Option<Stand>,
    pub landing: Option<Stand>,
    /// The same push, by a set that takes no footstep.
    pub without_footstep: Record,
}

impl Pushed {
    /// How far the first footstep goes (m; x forward, y left).
    pub fn way(&self) -> Option<[f64; 2]> {
        let footstep = self.film.record.footsteps.first()?;
        Some([0, 1].map(|axis| footstep.to_m[axis] - footstep.from_m[axis]))
    }
}

/// What the controller knows while it stands on both feet.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    pub time_s: f64,
    pub support: Support,
    /// As estimated, with the ZMP wanted; control frame.
    pub state: State,
    /// Centres and headings of the soles, world.
    pub soles: PerFoot<Isometry2<f64>>,
}

/// An imposed error, without physics.
pub struct ImposedRun {
    pub record: ImposedRecord,
    pub motion: MotionPlot,
    /// Of every tick: time (s), posture, and the gain that acts (None with a foot in the air).
    pub ticks: Vec<(f64, Posture, Option<usize>)>,
}

impl Study {
    /// Runs it all. Errors: the solver gives up, or a scenario is not what it was.
    pub fn run() -> Result<Self> {
        let progress = Progress::start(PARTS, "simulations and searches", false);
        let first = Scenario::load("push-behind")?;
        let robot = Robot::load(&first.robot)?;
        let (period_s, judge) = (first.episode().control_period_s, first.episode().judge);
        let design = Design::new(&robot, &GainSet::load(&first.gains)?, period_s)?;
        let standing = Design::new(&robot, &GainSet::load(WITHOUT_FOOTSTEP)?, period_s)?;
        let Some(rules) = design.family.stepping else {
            return Err(Error::value(&first.gains, "stepping", "none", "takes no footstep", "a gain set that does"));
        };
        let home = home_polygon(&robot);
        let allowed = design.family.allowed_support(&home, &design.family.name)?;
        let sets = CpiSet::search_family(&design.family, &allowed)?;
        let inclusion = Inclusion::of(&sets)?;
        progress.tick();
        let pushed = |name: &str| -> Result<Pushed> {
            let scenario = Scenario::load(name)?;
            let Cause::Push(push) = scenario.cause()? else { return Err(is_not(&scenario, "a push")) };
            let config = scenario.episode();
            let disturbance = || Disturbance { pushes: vec![push], ..Disturbance::default() };
            let mut motion = MotionPlot { pushes: vec![[push.start_s, push.end_s()]], ..MotionPlot::default() };
            let mut watch = Watch::default();
            let film =
                Film::take(&robot, &design, &config, disturbance(), (config.until(), AFTERMATH_S), &mut |tick| {
                    motion.push(&robot, tick);
                    watch.see(tick);
                });
            progress.tick();
            let without_footstep = episode::run(&robot, &standing, &config, disturbance(), config.until(), &mut |_| {});
            let Watch { lift, landing, .. } = watch;
            progress.tick();
            Ok(Pushed { push, film, motion, lift, landing, without_footstep })
        };
        let pushes = [pushed("push-behind")?, pushed("push-diagonal")?];
        let imposed = |name: &str| -> Result<ImposedRun> {
            let scenario = Scenario::load(name)?;
            let Cause::Imposed(Imposed { zmp_error_m, start }) = scenario.cause()? else {
                return Err(is_not(&scenario, "an imposed error"));
            };
            let (mut motion, mut ticks) = (MotionPlot::default(), Vec::new());
            let record = imposed::run(&robot, &design, &scenario.episode(), zmp_error_m.into(), start, &mut |tick| {
                motion.samples.push(MotionSample::of_imposed(tick));
                let gain = tick.controller.swing.is_none().then_some(tick.controller.supervisor.gain);
                ticks.push((tick.time_s, tick.posture.clone(), gain));
            })?;
            progress.tick();
            Ok(ImposedRun { record, motion, ticks })
        };
        let errors = [imposed("error-backward")?, imposed("error-diagonal")?];
        let moving = [imposed("moving-backward")?.record, imposed("moving-diagonal")?.record];
        progress.finish();
        Ok(Self { robot, design, rules, judge, home, allowed, sets, inclusion, pushes, errors, moving })
    }

    /// From the right sole's centre to the left's at home (m).
    pub fn stance(&self) -> Vector2<f64> {
        let mut kinematics = Kinematics::new(&self.robot);
        kinematics.update(&self.robot, &self.robot.home_posture());
        let soles = PerFoot::from_fn(|foot| kinematics.sole_pose(&self.robot, foot).translation.vector);
        (soles.left - soles.right).xy()
    }

    /// Largest impulse from rest that a set holds: forward, and to the left (N s).
    pub fn impulses(&self, set: &CpiSet) -> [f64; 2] {
        [Vector2::x(), Vector2::y()].map(|direction| self.robot.mass() * set.largest_com_vel_from_rest(direction))
    }

    /// Corners of a sole about its centre (m).
    pub fn sole(&self) -> [[f64; 2]; 4] {
        self.robot.soles.left.corners().map(|corner| [corner.x, corner.y])
    }
}

fn is_not(scenario: &Scenario, accepted: &str) -> Error {
    Error::value(&scenario.name, "cause", "another", "is not what the figures are made from", accepted)
}

/// What is seen of the first footstep.
#[derive(Default)]
struct Watch {
    lift: Option<Stand>,
    has_swung: bool,
    landing: Option<Stand>,
}

impl Watch {
    fn see(&mut self, tick: &Tick) {
        let controller = tick.controller;
        let estimate = &controller.estimator.now;
        if controller.swing.is_some() {
            self.has_swung = true;
        } else if estimate.in_contact.left && estimate.in_contact.right && self.landing.is_none() {
            let frame = controller.support.frame;
            let stand = Stand {
                time_s: tick.truth.time_s,
                support: controller.support,
                state: State::new(
                    frame.inverse_transform_point(&estimate.com_xy()),
                    frame.inverse_transform_vector(&estimate.com_vel_xy()),
                    frame.inverse_transform_point(&controller.supervisor.zmp_ref),
                ),
                soles: PerFoot::from_fn(|foot| on_ground(&estimate.footholds[foot])),
            };
            *(if self.has_swung { &mut self.landing } else { &mut self.lift }) = Some(stand);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One robot and one gain set stand for all scenarios of the study.
    #[test]
    fn the_papers_scenarios_share_robot_and_gain_set() {
        let same = |scenario: &Scenario| {
            (scenario.robot.clone(), scenario.gains.clone(), scenario.episode().control_period_s.to_bits())
        };
        let first = same(&Scenario::load("push-behind").unwrap());
        for name in ["push-diagonal", "error-backward", "error-diagonal", "moving-backward", "moving-diagonal"] {
            assert_eq!(same(&Scenario::load(name).unwrap()), first, "{name}");
        }
    }
}
