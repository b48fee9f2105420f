//! What is simulated and searched for the figures, once for all of them: the paper's scenarios and its gain set's sets.

use super::watch::Watch;
use crate::campaign::ask::scenario::{Cause, Imposed, Scenario};
use crate::control::stand::Support;
use crate::control::{Design, home_polygon};
use crate::episode::imposed::{self, ImposedRecord};
use crate::episode::{self, Disturbance, EpisodeConfig, Film, Judge, Record};
use crate::error::{Error, Result};
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::gains::GainSet;
use crate::lipm::pendulum::State;
use crate::lipm::stepping::Stepping;
use crate::render::motion::MotionSample;
use crate::render::motion_plot::MotionPlot;
use crate::render::progress::Progress;
use crate::robot::{Foot, Kinematics, PerFoot, Posture, Robot};
use crate::sim::Push;
use nalgebra::{Isometry2, Vector2};
use rayon::prelude::*;

/// Gain set of the same gains that takes no footstep: what the footstep is worth.
const WITHOUT_FOOTSTEP: &str = "switching";
/// And one that does nothing.
const STIFF: &str = "hold";
/// Towards these headings (degrees) the push of Fig. 13 is tried: the paper does not print its own.
const HEADINGS_DEG: [f64; 6] = [-120.0, -130.0, -140.0, -150.0, -160.0, -170.0];
/// Pushes whose ZMP errors come close to those of Sect. V.C.
const LIKE_IMPOSED: [&str; 2] = ["push-error-backward", "push-error-diagonal"];
/// After an episode's end a film goes on (s).
const AFTERMATH_S: f64 = 0.5;
/// A sole that carries no load for less has not lost it (s).
const LIFTED_S: f64 = 0.01;
/// Simulations and searches, for the progress.
const PARTS: u64 = 19;

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
    /// The push of Fig. 13 towards some headings; pushes whose ZMP errors come close to those of Sect. V.C.
    pub headings: Vec<Tried>,
    pub like_imposed: Vec<Tried>,
    /// Sect. V.C, Fig. 8 and 9: (a), (b).
    pub errors: [ImposedRun; 2],
    /// The same errors, made by a COM that moves.
    pub moving: [ImposedRecord; 2],
}

/// A push in physics.
pub struct Pushed {
    pub push: Push,
    pub film: Film,
    /// Its support is what carries load.
    pub motion: MotionPlot,
    pub watch: Watch,
    /// The same push, by a set of the same gains that takes no footstep, and by a robot that keeps its posture.
    pub without_footstep: Record,
    pub stiff: Record,
}

/// A push of which the record is enough.
pub struct Tried {
    pub push: Push,
    pub record: Record,
}

impl Pushed {
    /// How far the first footstep goes (m; x forward, y left).
    pub fn way(&self) -> Option<[f64; 2]> {
        let footstep = self.film.record.footsteps.first()?;
        Some([0, 1].map(|axis| footstep.to_m[axis] - footstep.from_m[axis]))
    }

    /// Soles that carry no load again between the landing and when the robot stands still: each with its time (s), and
    /// whether the controller took both soles for support all the while.
    pub fn unloaded(&self) -> Vec<(Foot, [f64; 2], bool)> {
        let record = &self.film.record;
        let Some(footstep) = record.footsteps.first() else { return Vec::new() };
        let span_s = footstep.land_s..=record.settled_at_s.unwrap_or(record.end_s);
        let ticks = self.motion.samples.iter().zip(&self.watch.loaded).zip(&self.watch.on_both);
        let after: Vec<_> = ticks.filter(|((sample, _), _)| span_s.contains(&sample.time_s)).collect();
        let mut off = Vec::new();
        for foot in Foot::BOTH {
            for run in after.chunk_by(|((_, a), _), ((_, b), _)| a[foot] == b[foot]) {
                let ((first, loaded), _) = run[0];
                let span = [first.time_s, run[run.len() - 1].0.0.time_s];
                if !loaded[foot] && span[1] - span[0] >= LIFTED_S {
                    off.push((foot, span, run.iter().all(|(_, on_both)| **on_both)));
                }
            }
        }
        off
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
    /// On each sole (N).
    pub load_n: PerFoot<f64>,
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
        let Some(rules) = design.family.stepping().copied() else {
            return Err(Error::value(&first.gains, "stepping", "none", "takes no footstep", "a gain set that does"));
        };
        let home = home_polygon(&robot);
        let allowed = design.family.allowed_support(&home, &design.family.name)?;
        let sets = CpiSet::search_family(&design.family, &allowed)?;
        let inclusion = Inclusion::of(&sets)?;
        progress.tick();
        let stiff = Design::new(&robot, &GainSet::load(STIFF)?, period_s)?;
        let push_of = |name: &str| -> Result<(Push, EpisodeConfig)> {
            let scenario = Scenario::load(name)?;
            let Cause::Push(push) = scenario.cause()? else { return Err(is_not(&scenario, "a push")) };
            Ok((push, scenario.episode()))
        };
        let (behind, diagonal) = (push_of("push-behind")?, push_of("push-diagonal")?);
        let run = |design: &Design, push: Push, config: &EpisodeConfig| {
            let record = episode::run(&robot, design, config, by(push), config.until(), &mut |_| {});
            progress.tick();
            record
        };
        let pushed = |(push, config): &(Push, EpisodeConfig)| {
            let mut motion = MotionPlot { pushes: vec![[push.start_s, push.end_s()]], ..MotionPlot::default() };
            let mut watch = Watch::default();
            let how_long = (config.until(), AFTERMATH_S);
            let film = Film::take(&robot, &design, config, by(*push), how_long, &mut |tick| {
                let support = watch.see(&robot, period_s, tick);
                motion.samples.push(MotionSample { support, ..MotionSample::of(&robot, tick) });
            });
            progress.tick();
            let [without_footstep, stiff] = [&standing, &stiff].map(|design| run(design, *push, config));
            Pushed { push: *push, film, motion, watch, without_footstep, stiff }
        };
        let turned = |heading_deg: f64| (Push { heading_deg, ..diagonal.0 }, diagonal.1);
        let mut asked: Vec<_> = HEADINGS_DEG.map(turned).into();
        for name in LIKE_IMPOSED {
            asked.push(push_of(name)?);
        }
        let try_out =
            |(push, config): &(Push, EpisodeConfig)| Tried { push: *push, record: run(&design, *push, config) };
        // Side by side: no run knows of another.
        let (pushes, mut headings): (_, Vec<Tried>) = rayon::join(
            || rayon::join(|| pushed(&behind), || pushed(&diagonal)),
            || asked.par_iter().with_max_len(1).map(try_out).collect(),
        );
        let (pushes, like_imposed) = (<[Pushed; 2]>::from(pushes), headings.split_off(HEADINGS_DEG.len()));
        let imposed = |name: &str| -> Result<ImposedRun> {
            let scenario = Scenario::load(name)?;
            let Cause::Imposed(Imposed { zmp_error_m, start }) = scenario.cause()? else {
                return Err(is_not(&scenario, "an imposed error"));
            };
            let (mut motion, mut ticks) = (MotionPlot::default(), Vec::new());
            let record = imposed::run(&robot, &design, &scenario.episode(), zmp_error_m.into(), start, &mut |tick| {
                motion.samples.push(MotionSample::of_imposed(tick));
                let gain = tick.account.gain.filter(|_| tick.account.stands());
                ticks.push((tick.time_s, tick.posture.clone(), gain));
            })?;
            progress.tick();
            Ok(ImposedRun { record, motion, ticks })
        };
        let errors = [imposed("error-backward")?, imposed("error-diagonal")?];
        let moving = [imposed("moving-backward")?.record, imposed("moving-diagonal")?.record];
        progress.finish();
        Ok(Self {
            robot,
            design,
            rules,
            judge,
            home,
            allowed,
            sets,
            inclusion,
            pushes,
            headings,
            like_imposed,
            errors,
            moving,
        })
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

/// One push and nothing else.
fn by(push: Push) -> Disturbance {
    Disturbance { pushes: vec![push], ..Disturbance::default() }
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
        let others = ["push-diagonal", "error-backward", "error-diagonal", "moving-backward", "moving-diagonal"];
        for name in others.into_iter().chain(LIKE_IMPOSED) {
            assert_eq!(same(&Scenario::load(name).unwrap()), first, "{name}");
        }
    }
}
