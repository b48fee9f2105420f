//! One closed loop of plant and controller ([`run`]), and its judge; and the paper's simulation without physics
//! ([`imposed`]).

mod closed_loop;
pub mod film;
pub mod footsteps;
pub mod imposed;
mod referee;
pub mod response;
mod slip;
pub mod snapshot;

use crate::control::{Account, Design};
use crate::robot::{Command, PerFoot, Pose, Robot};
use crate::sim::{Push, SensorErrors, Truth, Variation};
pub use closed_loop::ClosedLoop;
pub use film::Film;
pub use footsteps::{Footstep, Lifted};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

pub use referee::{AT_LIMIT, Referee, support_on_ground};
pub use snapshot::Snapshot;

/// How an episode ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// Standing at the horizon: trunk upright, COM slow, DCM inside the support for the last half second.
    Recovered,
    /// A link other than the soles at the ground, or COM height or tilt out of bounds.
    Fell,
    /// Numbers not finite, or absurdly large.
    Diverged,
    /// None of these.
    TimedOut,
}

impl Outcome {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recovered => "recovered",
            Self::Fell => "fell",
            Self::Diverged => "diverged",
            Self::TimedOut => "timed out",
        }
    }
}

/// Thresholds of the judge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Judge {
    /// Recovered: the trunk is within this angle of upright.
    pub standing_tilt_deg: f64,
    /// Recovered: the COM is slower than this.
    pub standing_com_speed_m_s: f64,
    /// Recovered: for how long all this must hold.
    pub standing_time_s: f64,
    /// Fell: the trunk is tilted by more.
    pub fallen_tilt_deg: f64,
    /// Fell: the COM is lower than this share of its height at home.
    pub fallen_com_height_ratio: f64,
    /// Home: the COM over the ground is this near to the middle of the soles' centres.
    pub home_radius_m: f64,
}

impl Default for Judge {
    fn default() -> Self {
        Self {
            standing_tilt_deg: 10.0,
            standing_com_speed_m_s: 0.02,
            standing_time_s: 0.5,
            fallen_tilt_deg: 60.0,
            fallen_com_height_ratio: 0.6,
            home_radius_m: 0.005,
        }
    }
}

/// What is the same for every episode of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EpisodeConfig {
    pub horizon_s: f64,
    pub physics_step_s: f64,
    pub control_period_s: f64,
    /// End an episode once it is settled. False: only a fall ends it before the horizon, so that
    /// [`Record::home_at_s`] means something, and "recovered" is standing at the horizon to the letter.
    pub end_early: bool,
    pub judge: Judge,
}

impl Default for EpisodeConfig {
    fn default() -> Self {
        Self {
            horizon_s: 6.0,
            physics_step_s: 0.001,
            control_period_s: 0.002,
            end_early: true,
            judge: Judge::default(),
        }
    }
}

impl EpisodeConfig {
    /// How long an episode of a campaign goes on.
    pub fn until(&self) -> Until {
        if self.end_early { Until::Decided } else { Until::Fallen }
    }
}

/// What disturbs the robot in one episode. The controller knows nothing of it.
#[derive(Default)]
pub struct Disturbance {
    pub pushes: Vec<Push>,
    /// None: ideal sensors (the delay of the robot remains).
    pub sensor_errors: Option<SensorErrors>,
    /// How the simulated robot and its ground differ from those that the controller was designed for.
    pub variation: Variation,
}

/// Whether an episode goes on after it is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// Stop when settled (after the last push) or fallen.
    Decided,
    /// Stop when fallen.
    Fallen,
    /// Run to the horizon, whatever happens.
    Horizon,
}

/// Where the slowest gain's maximal CPI set, the largest, has the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Membership {
    Inside,
    Outside,
    /// There is no set: nothing to stand on, or less than the margin of the gain set.
    Empty,
}

impl Membership {
    pub fn name(self) -> &'static str {
        match self {
            Membership::Inside => "inside",
            Membership::Outside => "outside",
            Membership::Empty => "empty",
        }
    }

    /// From the margin of [`crate::control::stand::Supervisor`].
    fn of_margin(margin: f64) -> Self {
        match margin {
            m if m >= 0.0 => Membership::Inside,
            m if m.is_finite() => Membership::Outside,
            _ => Membership::Empty,
        }
    }
}

/// What is kept of an episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    pub outcome: Outcome,
    /// Simulated time (s).
    pub end_s: f64,
    pub fell_at_s: Option<f64>,
    /// What decided the fall, in words (e.g. the link that touched the ground).
    pub fall_cause: Option<String>,
    /// Start of the stretch of standing at which the episode was decided.
    pub settled_at_s: Option<f64>,
    /// Time after the last push from which the COM over the ground stays within `home_radius_m` of the middle of the
    /// soles' centres until the episode's end (the paper's convergence of the COG to the origin); None if it is not
    /// there at the end. An episode that ends early ends before the COM can leave again, or arrive.
    pub home_at_s: Option<f64>,
    pub peak_tilt_deg: f64,
    /// Largest joint torque, and its share of the limit.
    pub peak_torque_n_m: f64,
    pub peak_torque_ratio: f64,
    /// Time during which the mean torque of some joint over a tick was at its limit, the trunk within
    /// `standing_tilt_deg` of upright: beyond that it is the fall (s).
    pub torque_limited_s: f64,
    pub peak_joint_speed_rad_s: f64,
    /// Largest distance of the DCM outside of the support (m); 0 when it never left it.
    pub peak_dcm_outside_m: f64,
    /// Largest distance by which a sole that carries load (a tenth of the weight or more) has slid over the ground since it
    /// took up that load, the trunk within `standing_tilt_deg` of upright (m): rolling over its edge is not sliding.
    pub peak_slip_m: f64,
    /// Time at which the state first left every set.
    pub left_sets_at_s: Option<f64>,
    /// Whether the slowest gain's set holds the true state at the end of the last push (with the ZMP that the
    /// controller wants, on the support that it sees; both as when it last stood, if a foot is in the air by then: whether
    /// standing would have sufficed); None without gains.
    pub set_after_push: Option<Membership>,
    /// The margin of that set (negative: outside); None also where the set is empty.
    pub cpi_margin_after_push: Option<f64>,
    /// The same for the state as estimated, by which the controller chooses its gain.
    pub cpi_margin_after_push_est: Option<f64>,
    pub gain_switches: u32,
    pub footsteps: Vec<Footstep>,
    /// The footstep that was in the air at the fall, or at the end.
    pub unfinished_footstep: Option<Lifted>,
}

/// One control tick, as an observer sees it: the truth now (with means over the tick that ends now), and what the
/// controller makes of what it senses now.
pub struct Tick<'a> {
    pub truth: &'a Truth,
    /// True divergent component of motion, world.
    pub dcm: Point2<f64>,
    /// Its distance outside of the soles on the ground (m); negative inside, infinite in flight.
    pub dcm_outside_m: f64,
    /// What the controller did, and why.
    pub account: Account<'a>,
    pub command: &'a Command,
}

/// Runs one episode of `robot`, for which `design` was made, as `disturbance` varies it. The same arguments give the same record, to the bit.
pub fn run(
    robot: &Robot,
    design: &Design,
    config: &EpisodeConfig,
    disturbance: Disturbance,
    until: Until,
    observe: &mut dyn FnMut(&Tick),
) -> Record {
    let simulated = &disturbance.variation.robot(robot);
    let closed_loop = ClosedLoop::new(robot, simulated, design, config, disturbance);
    drive(closed_loop, simulated, config, (until, 0.0), &mut |tick, _| observe(tick))
}

/// Drives a loop to its end, and for a while after it, not beyond its horizon. `observe` sees every tick, and whether it is
/// of the aftermath. The record is that of the episode itself.
fn drive(
    mut closed_loop: ClosedLoop,
    simulated: &Robot,
    config: &EpisodeConfig,
    (until, aftermath_s): (Until, f64),
    observe: &mut dyn FnMut(&Tick, bool),
) -> Record {
    let mut referee = Referee::new(simulated, config, &closed_loop.pushes);
    let ticks = (config.horizon_s / config.control_period_s).round() as u64;
    let mut ended_at_s: Option<f64> = None;
    for k in 0..=ticks {
        let tick = closed_loop.tick();
        observe(&tick, ended_at_s.is_some());
        if ended_at_s.is_none() {
            referee.watch(&tick);
            ended_at_s = referee.is_over(until).then_some(tick.truth.time_s);
        }
        let is_over = ended_at_s.is_some_and(|end_s| tick.truth.time_s >= end_s + aftermath_s);
        if is_over || !tick.truth.is_finite() {
            break;
        }
        if k < ticks {
            closed_loop.advance();
        }
    }
    referee.finish()
}

/// Distance of the COM over the ground from the middle of the soles' centres (m).
fn home_distance(com: Point2<f64>, soles: &PerFoot<Pose>) -> f64 {
    let middle = (soles.left.translation.vector.xy() + soles.right.translation.vector.xy()) / 2.0;
    (com.coords - middle).norm()
}
