//! The referee: watches every tick of an episode and writes its record.

use super::config::{Counts, EpisodeConfig, Judge, Until};
use super::record::{Outcome, Record};
use super::slip::Slip;
use super::tick::{Failure, Tick, home_distance};
use crate::pendulum::Strike;
use crate::{Push, Truth};
use standfast_core::robot::{Foot, Robot};
use std::sync::Arc;

/// Share of the torque limit from which on a joint counts as being at the limit.
pub const AT_LIMIT: f64 = 0.999;
/// Largest rounding error of a time, as a share of a control period.
const ROUNDING: f64 = 5e-4;

/// Watches the ticks of an episode and writes its record.
#[derive(Clone)]
pub struct Referee {
    pub(super) robot: Arc<Robot>,
    judge: Judge,
    control_period_s: f64,
    home_height: f64,
    /// Weight of the robot as it is designed, since no sole bears more because its robot is heavier (N).
    weight_n: f64,
    /// Start of the first push and end of the last one.
    pushed_s: [f64; 2],
    /// Time since which the robot has been standing without a break.
    standing_since_s: Option<f64>,
    slip: Slip,
    /// The record up to now.
    pub record: Record,
}

impl Referee {
    /// A referee for an episode of a robot as it is designed, which is simulated as `robot`, with these pushes.
    pub fn new(
        designed: &Robot,
        robot: Arc<Robot>,
        config: &EpisodeConfig,
        pushes: &[Push],
    ) -> Self {
        Self {
            judge: config.judge,
            weight_n: designed.weight_n(),
            control_period_s: config.control_period_s,
            home_height: robot.home_com_height(),
            pushed_s: from_first_to_last(pushes),
            standing_since_s: None,
            slip: Slip::new(Arc::clone(&robot)),
            robot,
            record: Record::default(),
        }
    }

    /// Replaces the pushes, none of which may have started.
    pub(super) fn expect(&mut self, pushes: &[Push]) {
        self.pushed_s = from_first_to_last(pushes);
    }

    /// Whether an episode that runs `until` this condition ends now, before its horizon.
    pub fn is_over(&self, until: Until) -> bool {
        let lost = self.record.outcome.is_lost();
        match until {
            Until::Decided => lost || self.record.settled_at_s.is_some(),
            Until::Fallen => lost,
            Until::Horizon => false,
        }
    }

    /// Takes note of a tick.
    pub fn watch(&mut self, tick: &Tick) {
        let truth = tick.truth;
        self.record.end_s = truth.time_s;
        // After a fall the numbers describe a body on the ground, and are not recorded.
        if self.record.outcome.is_lost() {
            return;
        }
        if tick.is_broken() {
            let (outcome, cause) = match tick.failure {
                Some(Failure::OfController(cause)) => (Outcome::Failed, &cause[..]),
                Some(Failure::OfSimulation(cause)) => (Outcome::Diverged, &cause[..]),
                None => (
                    Outcome::Diverged,
                    "a number of the simulation was not finite",
                ),
            };
            (self.record.outcome, self.record.fall_cause) = (outcome, Some(cause.into()));
            self.record.settled_at_s = None;
            self.record.home_at_s = None;
            return;
        }
        // The last tick before the push starts, which need not be at a tick.
        let is_last = truth.time_s + self.control_period_s
            > self.pushed_s[0] + ROUNDING * self.control_period_s;
        if is_last && self.record.com_speed_at_push_m_s.is_none() {
            self.record.com_speed_at_push_m_s = Some(truth.com_vel.norm());
        }
        self.note_peaks(tick);
        self.record
            .footsteps
            .watch(truth.time_s, &truth.soles, &tick.report);
        let broke = self.break_cause(truth).map(|cause| (Outcome::Broke, cause));
        let fell = || Some((Outcome::Fell, self.fall_cause(truth)?));
        if let Some((outcome, cause)) = broke.or_else(fell) {
            self.record.outcome = outcome;
            self.record.fell_at_s = Some(truth.time_s);
            self.record.fall_cause = Some(cause);
            self.record.settled_at_s = None;
            self.record.home_at_s = None;
            return;
        }
        self.note_home(truth);
        let standing = truth.time_s >= self.pushed_s[1]
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
        let near = home_distance(truth.com.xy(), &truth.soles) <= self.judge.home_radius_m;
        if !near || truth.time_s < self.pushed_s[1] {
            self.record.home_at_s = None;
        } else if self.record.home_at_s.is_none() {
            self.record.home_at_s = Some(truth.time_s);
        }
    }

    fn has_stood(&self, since_s: f64) -> bool {
        self.record.end_s - since_s >= self.judge.standing_time_s - ROUNDING * self.control_period_s
    }

    fn break_cause(&self, truth: &Truth) -> Option<String> {
        let most = self.judge.max_sole_force_weights?;
        let foot = Foot::BOTH
            .into_iter()
            .find(|&foot| truth.loads.soles_n[foot] > most * self.weight_n)?;
        Some(format!(
            "{} sole bore more than {most} weights",
            foot.name()
        ))
    }

    fn fall_cause(&self, truth: &Truth) -> Option<String> {
        let tilt = truth.tilt_rad().to_degrees();
        let height = self.com_height_ratio(truth);
        if let Some(link) = truth.touching {
            Some(format!(
                "{} touched the ground",
                self.robot.links[link].name
            ))
        } else if tilt > self.judge.fallen_tilt_deg {
            Some(format!(
                "trunk tilted by more than {} degrees",
                self.judge.fallen_tilt_deg
            ))
        } else if height < self.judge.fallen_com_height_ratio {
            Some(format!(
                "COM below {} of its height at home",
                self.judge.fallen_com_height_ratio
            ))
        } else {
            None
        }
    }

    /// Height of the COM above the ground, as a share of its height at home.
    fn com_height_ratio(&self, truth: &Truth) -> f64 {
        (truth.com.z - truth.ground.height_m(truth.com.xy())) / self.home_height
    }

    fn note_peaks(&mut self, tick: &Tick) {
        let (truth, report, height) = (tick.truth, &tick.report, self.com_height_ratio(tick.truth));
        let record = &mut self.record;
        let tilt_deg = truth.tilt_rad().to_degrees();
        record.peak_tilt_deg = record.peak_tilt_deg.max(tilt_deg);
        record.lowest_com_height_ratio = Some(
            record
                .lowest_com_height_ratio
                .map_or(height, |least| least.min(height)),
        );
        let mut torque_ratio = 0.0_f64;
        for (i, (tau, servo)) in truth.tau.iter().zip(&self.robot.servos).enumerate() {
            record.peak_torque_n_m = record.peak_torque_n_m.max(tau.abs());
            torque_ratio = torque_ratio.max(tau.abs() / servo.torque_n_m);
            record.peak_joint_speed_rad_s = record
                .peak_joint_speed_rad_s
                .max(truth.velocity[6 + i].abs());
        }
        record.peak_torque_ratio = record.peak_torque_ratio.max(torque_ratio);
        let loads = &truth.loads;
        let sole_n = loads.soles_n.left.max(loads.soles_n.right);
        for (peak, load) in [
            (&mut record.peak_sole_force_n, sole_n),
            (&mut record.peak_gear_torque_ratio, loads.gear_ratio),
        ] {
            *peak = Some(peak.map_or(load, |peak| peak.max(load)));
        }
        let slip_m = self.slip.watch(truth);
        if tilt_deg <= self.judge.standing_tilt_deg {
            record.peak_slip_m = record.peak_slip_m.max(slip_m);
            record.torque_limited_s += if torque_ratio >= AT_LIMIT {
                self.control_period_s
            } else {
                0.0
            };
        }
        if let (Some(meeting), None) = (
            truth.meeting.filter(|meeting| meeting.of_legs),
            record.legs_met_at_s,
        ) {
            let [a, b] = meeting.links.map(|link| &self.robot.links[link].name);
            record.legs_met_at_s = Some(truth.time_s);
            record.legs_met = Some(format!("{a} and {b}"));
        }
        if tick.dcm_outside_m.is_finite() {
            record.peak_dcm_outside_m = record.peak_dcm_outside_m.max(tick.dcm_outside_m);
        }
        let of_bob = truth.strike.iter().flat_map(Strike::totals);
        for (name, total) in report.totals().chain(of_bob) {
            match record.totals.0.get_mut(name) {
                Some(known) => *known = total,
                None => _ = record.totals.0.insert(name.to_string(), total),
            }
        }
        if let (Some(promise), None) = (report.promise, record.promise_margin)
            && truth.time_s >= self.pushed_s[1]
        {
            record.promise_margin = Some(promise.margin_at(truth.com.xy(), truth.com_vel.xy()));
            let estimate = report.com.zip(report.com_vel);
            record.promise_margin_est =
                estimate.map(|(com, com_vel)| promise.margin_at(com.xy(), com_vel.xy()));
        }
    }

    /// Ends the episode and returns its record.
    pub fn finish(mut self) -> Record {
        if self.record.outcome == Outcome::TimedOut {
            self.record.settled_at_s = self.standing_since_s.filter(|&since| self.has_stood(since));
            self.record.outcome = match (self.record.settled_at_s, self.judge.counts) {
                (Some(_), _) => Outcome::Recovered,
                (None, Counts::Survived) => Outcome::Survived,
                (None, Counts::Recovered) => Outcome::TimedOut,
            };
        }
        self.record
    }
}

/// Start of the first push and end of the last one (s). Without pushes, they are infinity and 0.
fn from_first_to_last(pushes: &[Push]) -> [f64; 2] {
    let start_s = pushes
        .iter()
        .map(|push| push.start_s)
        .fold(f64::INFINITY, f64::min);
    [start_s, pushes.iter().map(Push::end_s).fold(0.0, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::super::{Disturbance, run};
    use super::*;
    use crate::episode::testing::stiff;

    /// The record of half a second in which stiff joints are pushed.
    fn pushed(impulse_n_s: f64, start_s: f64, home_radius_m: f64) -> Record {
        judged(impulse_n_s, start_s, |judge| {
            judge.home_radius_m = home_radius_m
        })
    }

    /// The record with a change of the judge.
    fn judged(impulse_n_s: f64, start_s: f64, change: impl Fn(&mut Judge)) -> Record {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let usual = EpisodeConfig::of(&standfast_core::robot::Units::of(&robot));
        let mut judge = usual.judge;
        change(&mut judge);
        let config = EpisodeConfig {
            horizon_s: 0.5,
            end_early: false,
            judge,
            ..usual
        };
        let push = Push {
            impulse_n_s,
            start_s,
            ..Push::default()
        };
        let disturbance = Disturbance {
            pushes: vec![push],
            ..Disturbance::default()
        };
        run(
            &robot,
            &stiff(),
            &config,
            disturbance,
            config.until(),
            &mut |_| {},
        )
        .unwrap()
    }

    /// The speed at the push is the speed before it, even if the push starts between two ticks.
    #[test]
    fn the_speed_at_the_push_is_that_before_it() {
        for start_s in [0.3, 0.3001, 0.3019] {
            let speed_m_s = pushed(5.0, start_s, 0.005).com_speed_at_push_m_s.unwrap();
            assert!(
                speed_m_s < 0.005,
                "pushed at {start_s} s, it moved at {speed_m_s} m/s"
            );
        }
    }

    #[test]
    fn the_com_is_lowest_on_the_way_to_the_ground() {
        let [stands, falls] =
            [0.0, 4.0].map(|n_s| pushed(n_s, 0.1, 0.005).lowest_com_height_ratio.unwrap());
        assert!(
            (0.99..=1.0).contains(&stands) && falls < 0.98,
            "{stands}, {falls}"
        );
    }

    /// A limit does not change a robot that keeps within it.
    #[test]
    fn a_sole_that_bears_more_than_the_limit_breaks() {
        let limited = |weights| judged(4.0, 0.1, |judge| judge.max_sole_force_weights = weights);
        let free = limited(None);
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let peak = free.peak_sole_force_n.unwrap() / robot.weight_n();
        assert_eq!(limited(Some(1.01 * peak)), free);
        let broke = limited(Some(0.99 * peak));
        assert!(
            broke.outcome == Outcome::Broke && broke.fell_at_s == Some(broke.end_s),
            "{broke:?}"
        );
        let cause = broke.fall_cause.unwrap();
        assert!(
            cause.ends_with(&format!(" sole bore more than {} weights", 0.99 * peak)),
            "{cause}"
        );
    }

    #[test]
    fn home_is_where_the_com_stays_after_the_push() {
        let home_at_s =
            |impulse_n_s, home_radius_m| pushed(impulse_n_s, 0.1, home_radius_m).home_at_s;
        let home_s = home_at_s(0.0, 0.005).unwrap();
        assert!(
            (home_s - 0.15).abs() < 0.003,
            "home all the time counts from the end of the push, not from {home_s}"
        );
        let home_s = home_at_s(1.0, 0.005).unwrap();
        assert!(
            home_s > 0.2,
            "pushed by more than 5 mm, home again at {home_s}"
        );
        assert_eq!(home_at_s(4.0, 0.005), None, "on its way to the ground");
        assert_eq!(home_at_s(0.0, 1e-9), None);
    }
}
