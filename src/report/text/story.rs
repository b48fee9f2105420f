//! The story of one episode in a few lines: what happened to the robot, when, and why.

use crate::text::layout::{entry, velocity_change};
use crate::text::thresholds;
use crate::with_fields_of;
use serde_json::{Value, json};
use standfast_core::robot::{Robot, Units};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{
    AT_LIMIT, EpisodeConfig, Footstep, Lifted, Membership, Outcome, Record, Tick,
};
use standfast_sim::{Engine, Profile, Push, Variation};

/// Collects from an episode the data that the story needs beyond the record.
#[derive(Debug, Default)]
pub struct Witness {
    /// Time from which on the DCM has been outside of the support (s).
    dcm_outside_since_s: Option<f64>,
    /// Time (s) when a joint was at its torque limit for the first time, and name of the joint.
    torque_limited: Option<(f64, String)>,
    /// Largest torque of a joint as a share of its limit, and name of the joint.
    most_torque: (f64, String),
}

impl Witness {
    /// Takes note of a tick, up to the end of the episode.
    pub fn watch(&mut self, robot: &Robot, tick: &Tick) {
        if tick.is_after {
            return;
        }
        let time = tick.truth.time_s;
        if tick.dcm_outside_m <= 0.0 {
            self.dcm_outside_since_s = None;
        } else if self.dcm_outside_since_s.is_none() {
            self.dcm_outside_since_s = Some(time);
        }
        for ((tau, servo), joint) in tick.truth.tau.iter().zip(&robot.servos).zip(&robot.joints) {
            let ratio = tau.abs() / servo.torque_n_m;
            if ratio >= AT_LIMIT && self.torque_limited.is_none() {
                self.torque_limited = Some((time, joint.name.clone()));
            }
            if ratio > self.most_torque.0 {
                self.most_torque = (ratio, joint.name.clone());
            }
        }
    }
}

/// The story on one line, for the title of a picture.
pub fn headline(pushes: &[Push], controller: &str, record: &Record) -> String {
    let outcome = outcome(record);
    let came: Vec<String> = pushes
        .iter()
        .filter(|push| came(push, record))
        .map(how_hard)
        .collect();
    match &came[..] {
        [] => format!("controller {controller}: {outcome}, before any push"),
        _ => format!(
            "{}, controller {controller}: {outcome}",
            came.join(", then ")
        ),
    }
}

/// The outcome with its time.
pub fn outcome(record: &Record) -> String {
    match record.outcome {
        Outcome::Recovered if let Some(at) = record.settled_at_s => {
            format!("recovered, still from {at:.2} s")
        }
        outcome if outcome.is_lost() => format!(
            "{} at {:.2} s",
            outcome.name(),
            record.fell_at_s.unwrap_or(record.end_s)
        ),
        outcome => outcome.name().into(),
    }
}

/// Impulse and heading of a push, rounded.
fn how_hard(push: &Push) -> String {
    format!(
        "{} N s towards {} degrees",
        short(push.impulse_n_s, 2),
        short(push.heading_deg, 1)
    )
}

/// Whether a push came before the fall.
fn came(push: &Push, record: &Record) -> bool {
    record
        .fell_at_s
        .is_none_or(|fell_at_s| push.start_s < fell_at_s)
}

/// Rounds a value to some decimals, since the drawn numbers of a campaign have sixteen.
fn short(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    // Adding 0 turns -0 into 0.
    (value * unit).round() / unit + 0.0
}

/// A few sentences on each footstep: its time, its ZMP error if the controller reports it, and the start and the end of
/// the sole's way (mm, world frame).
pub fn footsteps(taken: &[Footstep], unfinished: Option<&Lifted>) -> Vec<String> {
    // Adding 0 turns -0 into 0.
    let round = |m: f64| (1000.0 * m).round() + 0.0;
    let mm = |p: &[f64]| format!("({}, {})", round(p[0]), round(p[1]));
    let reason = |error: &Option<[f64; 2]>| {
        error.map_or(String::new(), |error| {
            format!(" for a ZMP error of {} mm", mm(&error))
        })
    };
    let mut lines: Vec<String> = taken
        .iter()
        .map(|footstep| {
            let Footstep { foot, lift_s, land_s, from_m, to_m, zmp_error_m, in_set_at_landing } = footstep;
            let landing = in_set_at_landing.map(|is_in| {
                let side = if is_in { "in" } else { "outside of" };
                format!(". At the landing the state was {side} the new CPI sets")
            });
            format!(
                "{} foot: lifted at t = {lift_s:.3} s{}, landed at t = {land_s:.3} s. The sole moved from {} to {} mm{}",
                foot.name(),
                reason(zmp_error_m),
                mm(from_m),
                mm(to_m),
                landing.unwrap_or_default()
            )
        })
        .collect();
    lines.extend(unfinished.map(
        |Lifted {
             foot,
             lift_s,
             zmp_error_m,
             ..
         }| {
            format!(
                "{} foot: lifted at t = {lift_s:.3} s{}, and did not land",
                foot.name(),
                reason(zmp_error_m)
            )
        },
    ));
    lines
}

/// An episode and all data that its story needs.
pub struct EpisodeReport<'a> {
    pub factory: &'a PreparedController,
    pub config: &'a EpisodeConfig,
    /// The robot as the controller knows it.
    pub robot: &'a Robot,
    pub pushes: Vec<Push>,
    pub variation: Variation,
    pub record: Record,
    pub witness: Witness,
}

impl EpisodeReport<'_> {
    /// The story on one line, for the title of a picture.
    pub fn headline(&self) -> String {
        let line = headline(&self.pushes, &self.factory.name, &self.record);
        let engine = self.config.engine;
        if engine == Engine::default() {
            line
        } else {
            format!("{line}, in {}", engine.title())
        }
    }

    pub fn as_json(&self) -> Value {
        let [dv_m_s, dv_over_sqrt_g_h] =
            Units::of(self.robot).velocity_of(self.pushes[0].impulse_n_s);
        let mut head = json!({
            "controller": self.factory.name,
            "engine": self.config.engine.with_version(),
            "push": self.pushes[0],
            "push_point": self.robot.unusual_push_point(),
            "dv_m_s": dv_m_s,
            "dv_over_sqrt_g_h": dv_over_sqrt_g_h,
            "judge": self.config.judge,
            "horizon_s": self.config.horizon_s,
        });
        if let Some(second) = self.pushes.get(1) {
            head["second_push"] = json!(second);
        }
        let varied = self.variation.varied().into_iter();
        head["variation"] = varied
            .map(|(name, value)| (name.to_string(), json!(value)))
            .collect();
        let mut report = with_fields_of(head, &self.record);
        report["footsteps"] = json!(self.record.footsteps.taken);
        report["unfinished_footstep"] = json!(self.record.footsteps.lifted);
        report["totals"] = json!(self.record.totals.0);
        report
    }

    /// A few lines on what happened and why, and on the meaning of the outcomes.
    pub fn text(&self) -> String {
        format!("{}\n{}", self.story(), thresholds(&self.config.judge))
    }

    /// A few lines on what happened and why.
    pub fn story(&self) -> String {
        let (record, factory) = (&self.record, self.factory);
        let mut text = String::new();
        let mut line = |label: &str, what: String| text += &entry(label, &what);
        for push in &self.pushes {
            let [height_m, start_s] = [push.height_m, push.start_s].map(|value| short(value, 3));
            let duration_s = short(push.duration_s, 4);
            let from = match self.robot.pushed.point_m {
                Some(_) => "that point",
                None => "the COM",
            };
            let at = match height_m {
                0.0 => format!("level with {from}"),
                below if below < 0.0 => format!("{} m below {from}", -below),
                above => format!("{above} m above {from}"),
            };
            let at = match self.robot.unusual_push_point() {
                Some(point) => format!("{point}, {at}"),
                None => at,
            };
            let course = match (push.bob, push.profile) {
                (Some(_), _) | (_, Profile::Rectangular) => String::new(),
                (_, other) => format!(", {}", other.name()),
            };
            let by = match push.bob {
                Some(bob) => format!(
                    "by a bob of {} kg on {} m, drawn back by {} m,",
                    short(bob.mass_kg, 4),
                    short(bob.rope_m, 4),
                    short(bob.draw_m(push.impulse_n_s), 4)
                ),
                None => format!("for {duration_s} s"),
            };
            let late = if came(push, record) {
                ""
            } else {
                "; the robot was lost by then"
            };
            let dv = velocity_change(&Units::of(self.robot), push.impulse_n_s);
            line(
                "push",
                format!(
                    "{} ({dv}) {by} from t = {start_s} s, {at}{course}{late}",
                    how_hard(push)
                ),
            );
        }
        if let [Some(impulse_n_s), Some(share), Some(peak_n), Some(width_s)] =
            ["bob_impulse_n_s", "bob_share", "bob_peak_n", "bob_width_s"]
                .map(|name| record.totals.get(name))
        {
            line(
                "strike",
                format!(
                    "{impulse_n_s:.2} N s went to the robot, {:.0} % of what the bob had; up to {peak_n:.0} N, half of that or \
                     more for {:.1} ms",
                    100.0 * share,
                    1e3 * width_s
                ),
            );
        }
        let horizon_s = short(self.config.horizon_s, 2);
        line(
            "horizon",
            format!("{horizon_s} s: the episode ends then if it is not decided before"),
        );
        let varied: Vec<String> = self
            .variation
            .varied()
            .iter()
            .map(|(name, value)| format!("{name} {}", short(*value, 4)))
            .collect();
        if !varied.is_empty() {
            line("varied", varied.join(", "));
        }
        line("controller", format!("{}, {}", factory.name, factory.about));
        if self.config.engine != Engine::default() {
            line("engine", self.config.engine.with_version());
        }
        line("outcome", self.outcome());
        if let Some(at) = record.home_at_s {
            let mm = short(1000.0 * self.config.judge.home_radius_m, 1);
            line(
                "home",
                format!(
                    "from t = {at:.3} s on the COM is within {mm} mm of the middle of the soles"
                ),
            );
        }
        if let Some(sets) = self.sets() {
            line("sets", sets);
        }
        for text in footsteps(&record.footsteps.taken, record.footsteps.lifted.as_ref()) {
            line("footstep", text);
        }
        match (record.outcome, self.witness.dcm_outside_since_s) {
            (Outcome::Fell, Some(at)) => {
                line(
                    "DCM",
                    format!("com + com_vel / omega left the support for good at t = {at:.3} s"),
                );
            }
            _ if record.peak_dcm_outside_m > 0.0 => {
                let mm = 1000.0 * record.peak_dcm_outside_m;
                line(
                    "DCM",
                    format!("com + com_vel / omega was up to {mm:.1} mm outside of the support"),
                );
            }
            _ => {}
        }
        if let (Some(at), Some(links)) = (record.legs_met_at_s, &record.legs_met) {
            line("legs", format!("they met at t = {at:.3} s: {links}"));
        }
        if let Some(torque) = self.torque() {
            line("torque", torque);
        }
        line(
            "peaks",
            format!(
                "tilt {:.1} degrees, joint speed {:.1} rad/s, {:.1} weights on a sole, {:.0} % of the torque limit on a gear",
                record.peak_tilt_deg,
                record.peak_joint_speed_rad_s,
                record.peak_sole_force_n.unwrap_or(0.0) / self.robot.weight_n(),
                100.0 * record.peak_gear_torque_ratio.unwrap_or(0.0)
            ),
        );
        if let (Some(switches), true) = (
            record.totals.get("gain_switches"),
            factory.regions.len() > 1,
        ) {
            let switched = match switches as u64 {
                0 => "none: the fastest gain acted all the time".into(),
                1 => "the controller switched or restarted its gain once".into(),
                n => format!("the controller switched or restarted its gain {n} times"),
            };
            line("switches", switched);
        }
        text
    }

    /// The outcome in a sentence.
    fn outcome(&self) -> String {
        let Record {
            end_s,
            settled_at_s,
            fell_at_s,
            fall_cause,
            ..
        } = &self.record;
        match self.record.outcome {
            Outcome::Recovered => {
                let since_s = settled_at_s.unwrap_or(*end_s);
                let pushed_until_s = self.pushes.iter().map(Push::end_s).fold(0.0, f64::max);
                let after = self.after_the_push();
                format!(
                    "recovered: it stands still from t = {since_s:.3} s on, {:.3} s {after}",
                    since_s - pushed_until_s
                )
            }
            outcome @ (Outcome::Fell | Outcome::Broke) => {
                let cause = fall_cause.as_deref().unwrap_or("out of bounds");
                let at_s = fell_at_s.unwrap_or(*end_s);
                format!("{} at t = {at_s:.3} s: {cause}", outcome.name())
            }
            Outcome::Diverged => {
                format!(
                    "diverged at t = {end_s:.3} s: {}",
                    fall_cause.as_deref().unwrap_or("cause unknown")
                )
            }
            Outcome::Failed => {
                let cause = fall_cause.as_deref().unwrap_or("cause unknown");
                format!("the controller failed at t = {end_s:.3} s: {cause}")
            }
            Outcome::Survived => {
                format!("survived: at t = {end_s:.3} s it had not fallen, but did not stand still")
            }
            Outcome::TimedOut => {
                format!("timed out: at t = {end_s:.3} s it had neither fallen nor come to a stand")
            }
        }
    }

    fn after_the_push(&self) -> &'static str {
        if self.pushes.len() > 1 {
            "after the last push"
        } else {
            "after the push"
        }
    }

    /// The prediction of the CPI sets at the end of the push, and whether the robot did otherwise. None without gains,
    /// and if the CPI sets made no prediction.
    fn sets(&self) -> Option<String> {
        let record = &self.record;
        let the_set = match self.factory.regions.len() {
            0 => return None,
            1 => "the CPI set of the gain",
            _ => "the largest CPI set",
        };
        let end = if self.pushes.len() > 1 {
            "at the end of the last push"
        } else {
            "at the end of the push"
        };
        let left_at_s = record.totals.get("left_sets_at_s");
        let Some(side) = record.promise_margin.map(Membership::of_margin) else {
            return left_at_s.map(|at| format!("the state left {the_set} at t = {at:.3} s"));
        };
        let [margin, margin_est] =
            [record.promise_margin, record.promise_margin_est].map(|margin| match margin {
                Some(margin) if margin.is_finite() => format!("{margin:.2}"),
                _ => "none".into(),
            });
        let margins = format!("(margin {margin}; of the estimated state {margin_est})");
        let stepped = record.footsteps.has_begun();
        let recovered = record.outcome == Outcome::Recovered;
        Some(match side {
            Membership::Empty => {
                format!("{end} there was no CPI set, for there was nothing to stand on")
            }
            Membership::Inside => {
                let yet = if recovered {
                    ""
                } else {
                    ", but the robot did not recover"
                };
                format!(
                    "{end} the state was in {the_set} {margins}. By the pendulum model no footstep was needed{yet}"
                )
            }
            Membership::Outside => {
                let left = left_at_s.map(|at| format!(", which it left at t = {at:.3} s"));
                let left = left.unwrap_or_default();
                let yet = match (recovered, stepped) {
                    (true, false) => ", but the robot recovered without one",
                    (false, false) if !self.factory.takes_footsteps => {
                        ", which this controller does not take"
                    }
                    _ => "",
                };
                format!(
                    "{end} the state was outside of {the_set} {margins}{left}. By the pendulum model a footstep was needed{yet}"
                )
            }
        })
    }

    /// The largest torques in a sentence or two. None if there were none, for example if the controller fails at its
    /// first tick.
    fn torque(&self) -> Option<String> {
        let (ratio, joint) = &self.witness.most_torque;
        let percent = 100.0 * ratio;
        let Some((at, first)) = &self.witness.torque_limited else {
            return (*ratio > 0.0)
                .then(|| format!("at most {percent:.0} % of the limit, at {joint}"));
        };
        let limited = format!("{first} was the first joint at its limit, at t = {at:.3} s");
        Some(match percent.round() > 100.0 {
            // A torque beyond the limit is possible if a rotor is so light that its servo needs implicit damping.
            true => format!(
                "{limited}. The peak, {percent:.0} % of the limit at {joint}, lasted one physics step, as when an impact \
                 stops a joint"
            ),
            false => limited,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_sim::episode::{Disturbance, Until, run};

    /// The story of a push with a controller: its title and its text.
    fn story(gains: &str, impulse_n_s: f64, heading_deg: f64) -> [String; 2] {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig::of(&standfast_core::robot::Units::of(&robot));
        let factory = standfast_controllers::load(gains)
            .unwrap()
            .prepare(&robot, config.control_period_s)
            .unwrap();
        let pushes = vec![Push {
            impulse_n_s,
            heading_deg,
            ..Push::default()
        }];
        let mut witness = Witness::default();
        let disturbance = Disturbance {
            pushes: pushes.clone(),
            ..Disturbance::default()
        };
        let record = run(
            &robot,
            &factory,
            &config,
            disturbance,
            Until::Decided,
            &mut |tick| witness.watch(&robot, tick),
        )
        .unwrap();
        let told = EpisodeReport {
            factory: &factory,
            config: &config,
            robot: &robot,
            pushes,
            variation: Variation::default(),
            record,
            witness,
        };
        [told.headline(), told.text()]
    }

    /// The text on one line.
    fn read(text: &str) -> String {
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// The guide has the story of a push that takes a footstep, with a test of its own.
    #[test]
    fn stories_state_what_happened() {
        // The state is outside of its CPI set, and yet the robot recovers without a footstep.
        let [title, text] = story("catch", 3.000_123_456_789, 90.0);
        assert!(
            title.starts_with("3 N s towards 90 degrees, controller catch: recovered"),
            "{title}"
        );
        let text = read(&text);
        let begins = "push 3 N s towards 90 degrees (dv = 0.38 m/s = 0.22 sqrt(g h)) for 0.05 s from t = 0.5 s, level with the \
                      COM horizon 6 s: the episode ends then if it is not decided before controller catch";
        assert!(text.starts_with(begins), "{text}");
        assert!(
            text.contains(
                "By the pendulum model a footstep was needed, but the robot recovered without one"
            ),
            "{text}"
        );
        assert!(
            !text.contains("footstep left") && !text.contains("switches"),
            "{text}"
        );
        // The state is inside of its CPI sets.
        let [_, text] = story("switching", 3.0, -135.0);
        assert!(
            read(&text)
                .contains("in the largest CPI set (margin 0.16; of the estimated state 0.20)"),
            "{text}"
        );
        assert!(
            read(&text).contains("switches the controller switched or restarted its gain 6 times"),
            "{text}"
        );
        // Without gains, the story mentions neither CPI sets nor switches.
        let [_, text] = story("hold", 3.0, 0.0);
        assert!(
            !text.contains("\nsets") && !text.contains("\nswitches"),
            "{text}"
        );
        assert!(
            read(&text).contains("controller hold, which keeps its posture outcome fell at t = "),
            "{text}"
        );
    }
}
