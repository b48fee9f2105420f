//! One closed loop of plant and controller, and its judge.

use crate::control::{Controller, Design, Phase};
use crate::geometry::SupportPolygon;
use crate::robot::{Command, Foot, PerFoot, Robot};
use crate::sim::plant::Clock;
use crate::sim::{Plant, Push, SensorErrors, Truth};
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

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

/// What disturbs the robot in one episode.
pub struct Disturbance {
    pub pushes: Vec<Push>,
    /// None: ideal sensors (the delay of the robot remains).
    pub sensor_errors: Option<SensorErrors>,
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

    /// From the margin of [`crate::control::supervisor::Supervisor`].
    fn of_margin(margin: f64) -> Self {
        match margin {
            m if m >= 0.0 => Membership::Inside,
            m if m.is_finite() => Membership::Outside,
            _ => Membership::Empty,
        }
    }
}

/// A footstep that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Footstep {
    pub foot: Foot,
    pub lift_s: f64,
    pub land_s: f64,
    /// Centre of the sole in the world, at lift and at landing.
    pub from_m: [f64; 3],
    pub to_m: [f64; 3],
    /// Whether the state at landing was inside a set of the new support.
    pub in_set_at_landing: bool,
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
    pub peak_joint_speed_rad_s: f64,
    /// Largest distance of the DCM outside of the support (m); 0 when it never left it.
    pub peak_dcm_outside_m: f64,
    /// Time at which the state first left every set.
    pub left_sets_at_s: Option<f64>,
    /// Whether the slowest gain's set holds the true state at the end of the last push (with the ZMP that the
    /// controller wants, on the support that it sees); None without gains.
    pub set_after_push: Option<Membership>,
    /// The margin of that set (negative: outside); None also where the set is empty.
    pub cpi_margin_after_push: Option<f64>,
    /// The same for the state as estimated, by which the controller chooses its gain.
    pub cpi_margin_after_push_est: Option<f64>,
    pub gain_switches: u32,
    pub footsteps: Vec<Footstep>,
}

/// One control tick, as an observer sees it: the truth now (with means over the tick that ends now), and what the
/// controller makes of what it senses now.
pub struct Tick<'a> {
    pub truth: &'a Truth,
    /// True divergent component of motion, world.
    pub dcm: Point2<f64>,
    /// Its distance outside of the soles on the ground (m); negative inside, infinite in flight.
    pub dcm_outside_m: f64,
    pub controller: &'a Controller<'a>,
    pub command: &'a Command,
}

/// Runs one episode. The same arguments give the same record, to the bit.
pub fn run(
    robot: &Robot,
    design: &Design,
    config: &EpisodeConfig,
    disturbance: Disturbance,
    until: Until,
    observe: &mut dyn FnMut(&Tick),
) -> Record {
    let Disturbance { pushes, sensor_errors } = disturbance;
    let clock = Clock { physics_step_s: config.physics_step_s, control_period_s: config.control_period_s };
    let mut plant = Plant::new(robot, clock, sensor_errors, design.home_command().clone());
    let mut controller = Controller::new(robot, design);
    let mut referee = Referee::new(robot, config, &pushes);
    let ticks = (config.horizon_s / config.control_period_s).round() as u64;
    for k in 0..=ticks {
        let sensed = plant.sense();
        let command = controller.tick(&sensed);
        let truth = plant.truth();
        let dcm = truth.com.xy() + truth.com_vel.xy() / design.family.pendulum.omega;
        let support = support_on_ground(robot, truth);
        let dcm_outside_m = support.map_or(f64::INFINITY, |polygon| polygon.signed_distance(dcm));
        let tick = Tick { truth, dcm, dcm_outside_m, controller: &controller, command: &command };
        observe(&tick);
        referee.watch(&tick);
        let done = match until {
            Until::Decided => referee.is_decided(),
            Until::Fallen => referee.record.outcome == Outcome::Fell,
            Until::Horizon => false,
        };
        if done || !tick.truth.is_finite() {
            break;
        }
        if k < ticks {
            plant.advance(command, &pushes);
        }
    }
    referee.finish()
}

/// Watches an episode and writes its record.
struct Referee<'a> {
    robot: &'a Robot,
    judge: Judge,
    home_height: f64,
    last_push_end_s: f64,
    /// Since when the robot has been standing without a break.
    standing_since_s: Option<f64>,
    record: Record,
}

impl<'a> Referee<'a> {
    fn new(robot: &'a Robot, config: &EpisodeConfig, pushes: &[Push]) -> Self {
        Self {
            robot,
            judge: config.judge,
            home_height: robot.home_com_height(),
            last_push_end_s: pushes.iter().map(Push::end_s).fold(0.0, f64::max),
            standing_since_s: None,
            record: Record {
                outcome: Outcome::TimedOut,
                end_s: 0.0,
                fell_at_s: None,
                fall_cause: None,
                settled_at_s: None,
                home_at_s: None,
                peak_tilt_deg: 0.0,
                peak_torque_n_m: 0.0,
                peak_torque_ratio: 0.0,
                peak_joint_speed_rad_s: 0.0,
                peak_dcm_outside_m: 0.0,
                left_sets_at_s: None,
                set_after_push: None,
                cpi_margin_after_push: None,
                cpi_margin_after_push_est: None,
                gain_switches: 0,
                footsteps: Vec::new(),
            },
        }
    }

    fn is_decided(&self) -> bool {
        self.record.outcome == Outcome::Fell || self.record.settled_at_s.is_some()
    }

    fn watch(&mut self, tick: &Tick) {
        let truth = tick.truth;
        self.record.end_s = truth.time_s;
        // After a fall, numbers are those of a body on the ground: of no interest.
        if self.record.outcome == Outcome::Fell {
            return;
        }
        if !truth.is_finite() {
            self.record.outcome = Outcome::Diverged;
            self.record.settled_at_s = None;
            self.record.home_at_s = None;
            return;
        }
        self.note_peaks(tick);
        if let Some(cause) = self.fall_cause(truth) {
            self.record.outcome = Outcome::Fell;
            self.record.fell_at_s = Some(truth.time_s);
            self.record.fall_cause = Some(cause);
            self.record.settled_at_s = None;
            self.record.home_at_s = None;
            return;
        }
        self.note_home(truth);
        let standing = truth.time_s >= self.last_push_end_s
            && truth.tilt_rad().to_degrees() <= self.judge.standing_tilt_deg
            && truth.com_vel.norm() <= self.judge.standing_com_speed_m_s
            && tick.dcm_outside_m <= 0.0;
        match (standing, self.standing_since_s) {
            (false, _) => self.standing_since_s = None,
            (true, None) => self.standing_since_s = Some(truth.time_s),
            (true, Some(since)) if self.has_stood(since) && self.record.settled_at_s.is_none() => {
                self.record.settled_at_s = Some(since);
            }
            _ => {}
        }
    }

    fn note_home(&mut self, truth: &Truth) {
        let middle = (truth.soles.left.translation.vector.xy() + truth.soles.right.translation.vector.xy()) / 2.0;
        let near = (truth.com.coords.xy() - middle).norm() <= self.judge.home_radius_m;
        if !near || truth.time_s < self.last_push_end_s {
            self.record.home_at_s = None;
        } else if self.record.home_at_s.is_none() {
            self.record.home_at_s = Some(truth.time_s);
        }
    }

    fn has_stood(&self, since_s: f64) -> bool {
        // A little grace for the rounding of times.
        self.record.end_s - since_s >= self.judge.standing_time_s - 1e-6
    }

    fn fall_cause(&self, truth: &Truth) -> Option<String> {
        let tilt = truth.tilt_rad().to_degrees();
        let height = truth.com.z / self.home_height;
        if let Some(link) = truth.touching {
            Some(format!("{} touched the ground", self.robot.links[link].name))
        } else if tilt > self.judge.fallen_tilt_deg {
            Some(format!("trunk tilted by more than {} degrees", self.judge.fallen_tilt_deg))
        } else if height < self.judge.fallen_com_height_ratio {
            Some(format!("COM below {} of its height at home", self.judge.fallen_com_height_ratio))
        } else {
            None
        }
    }

    fn note_peaks(&mut self, tick: &Tick) {
        let (truth, controller, record) = (tick.truth, tick.controller, &mut self.record);
        record.peak_tilt_deg = record.peak_tilt_deg.max(truth.tilt_rad().to_degrees());
        for (i, (tau, servo)) in truth.tau.iter().zip(&self.robot.servos).enumerate() {
            record.peak_torque_n_m = record.peak_torque_n_m.max(tau.abs());
            record.peak_torque_ratio = record.peak_torque_ratio.max(tau.abs() / servo.torque_n_m);
            record.peak_joint_speed_rad_s = record.peak_joint_speed_rad_s.max(truth.velocity[6 + i].abs());
        }
        if tick.dcm_outside_m.is_finite() {
            record.peak_dcm_outside_m = record.peak_dcm_outside_m.max(tick.dcm_outside_m);
        }
        record.gain_switches = controller.switches;
        if controller.phase == Phase::Posture {
            return;
        }
        if controller.phase == Phase::OutOfSets && record.left_sets_at_s.is_none() {
            record.left_sets_at_s = Some(truth.time_s);
        }
        if truth.time_s >= self.last_push_end_s && record.set_after_push.is_none() {
            let supervisor = &controller.supervisor;
            let margin = supervisor.margin_at(truth.com.xy(), truth.com_vel.xy());
            record.set_after_push = Some(Membership::of_margin(margin));
            record.cpi_margin_after_push = Some(margin).filter(|m| m.is_finite());
            record.cpi_margin_after_push_est = Some(supervisor.margin).filter(|m| m.is_finite());
        }
    }

    fn finish(mut self) -> Record {
        if self.record.outcome == Outcome::TimedOut {
            self.record.settled_at_s = self.standing_since_s.filter(|&since| self.has_stood(since));
            if self.record.settled_at_s.is_some() {
                self.record.outcome = Outcome::Recovered;
            }
        }
        self.record
    }
}

/// Hull of the soles that rest on the ground, world; None in flight.
pub fn support_on_ground(robot: &Robot, truth: &Truth) -> Option<SupportPolygon> {
    /// A sole is on the ground when a corner of it is this low (m).
    const NEAR_M: f64 = 0.003;
    let mut corners = [Point2::origin(); 8];
    let mut count = 0;
    let placed = PerFoot::from_fn(|foot| robot.soles[foot].corners().map(|corner| truth.soles[foot] * corner));
    for foot in Foot::BOTH.into_iter().filter(|&f| placed[f].iter().any(|c| c.z < NEAR_M)) {
        for corner in placed[foot] {
            corners[count] = corner.xy();
            count += 1;
        }
    }
    SupportPolygon::hull(&corners[..count])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lipm::gains::GainSet;

    fn home_at_s(impulse_n_s: f64, home_radius_m: f64) -> Option<f64> {
        let robot = Robot::load("ut-mu2").unwrap();
        let design = Design::new(&robot, &GainSet::load("hold").unwrap(), 0.002).unwrap();
        let judge = Judge { home_radius_m, ..Judge::default() };
        let config = EpisodeConfig { horizon_s: 0.5, end_early: false, judge, ..EpisodeConfig::default() };
        let push = Push { impulse_n_s, start_s: 0.1, ..Push::default() };
        let disturbance = Disturbance { pushes: vec![push], sensor_errors: None };
        run(&robot, &design, &config, disturbance, config.until(), &mut |_| {}).home_at_s
    }

    #[test]
    fn home_is_where_the_com_stays_after_the_push() {
        let at = home_at_s(0.0, 0.005).unwrap();
        assert!((at - 0.15).abs() < 0.003, "home all the time counts from the end of the push, not from {at}");
        let at = home_at_s(1.0, 0.005).unwrap();
        assert!(at > 0.2, "pushed by more than 5 mm, home again at {at}");
        assert_eq!(home_at_s(4.0, 0.005), None, "on its way to the ground");
        assert_eq!(home_at_s(0.0, 1e-9), None);
    }
}
