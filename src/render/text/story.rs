//! The story of one episode, in a few lines: what happened to the robot, when, and why.

use crate::control::Design;
use crate::episode::{AT_LIMIT, EpisodeConfig, Footstep, Lifted, Outcome, Record, Tick};
use crate::render::text::thresholds;
use crate::render::with_fields_of;
use crate::robot::{Robot, Servo};
use crate::sim::{Push, Variation};
use serde_json::{Value, json};
use std::fmt::Write;

/// What is seen on the way, for the story.
#[derive(Debug, Default)]
pub struct Witness {
    /// Since when the DCM has been outside of the support.
    dcm_outside_since_s: Option<f64>,
    /// First time and joint at its torque limit.
    torque_limited: Option<(f64, String)>,
}

impl Witness {
    /// Takes note of a tick.
    pub fn watch(&mut self, robot: &Robot, tick: &Tick) {
        let time = tick.truth.time_s;
        if tick.dcm_outside_m <= 0.0 {
            self.dcm_outside_since_s = None;
        } else if self.dcm_outside_since_s.is_none() {
            self.dcm_outside_since_s = Some(time);
        }
        if self.torque_limited.is_none() {
            let at_limit = |(tau, servo): (&f64, &Servo)| tau.abs() >= AT_LIMIT * servo.torque_n_m;
            let joint = tick.truth.tau.iter().zip(&robot.servos).position(at_limit);
            self.torque_limited = joint.map(|i| (time, robot.joints[i].name.clone()));
        }
    }
}

/// The story in one line: the title of a picture.
pub fn headline(pushes: &[Push], gain_set: &str, record: &Record) -> String {
    let outcome = match record.outcome {
        Outcome::Recovered if let Some(at) = record.settled_at_s => format!("recovered, still from {at:.2} s"),
        Outcome::Fell => format!("fell at {:.2} s", record.fell_at_s.unwrap_or(record.end_s)),
        outcome => outcome.name().into(),
    };
    let told =
        |push: &Push| format!("{} N s towards {} degrees", short(push.impulse_n_s, 2), short(push.heading_deg, 2));
    let came: Vec<String> = pushes.iter().filter(|push| came(push, record)).map(told).collect();
    match &came[..] {
        [] => format!("gain set {gain_set}: {outcome}, before any push"),
        _ => format!("{}, gain set {gain_set}: {outcome}", came.join(", then ")),
    }
}

/// Whether a push came before the fall.
fn came(push: &Push, record: &Record) -> bool {
    record.fell_at_s.is_none_or(|fell_at_s| push.start_s < fell_at_s)
}

/// Rounded to so many digits after the point: numbers of a campaign's pushes have sixteen.
fn short(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    // Plus 0: no -0.
    (value * unit).round() / unit + 0.0
}

/// A line for each footstep.
pub fn footsteps(taken: &[Footstep], unfinished: Option<&Lifted>) -> Vec<String> {
    // Plus 0: no -0.
    let round = |m: f64| (1000.0 * m).round() + 0.0;
    let mm = |p: &[f64]| format!("({}, {})", round(p[0]), round(p[1]));
    let mut lines: Vec<String> = taken
        .iter()
        .map(|footstep| {
            let Footstep { foot, lift_s, land_s, from_m, to_m, zmp_error_m, in_set_at_landing } = footstep;
            format!(
                "{:<5} {lift_s:.3} to {land_s:.3} s, {} to {} mm, ZMP error {} mm; landed {} the new sets",
                foot.name(),
                mm(from_m),
                mm(to_m),
                mm(zmp_error_m),
                if *in_set_at_landing { "inside" } else { "outside" }
            )
        })
        .collect();
    lines.extend(unfinished.map(|Lifted { foot, lift_s, zmp_error_m, .. }| {
        format!("{:<5} {lift_s:.3} s, ZMP error {} mm; not landed", foot.name(), mm(zmp_error_m))
    }));
    lines
}

/// What became of an episode, to be told.
pub struct Told<'a> {
    pub design: &'a Design,
    pub config: &'a EpisodeConfig,
    pub pushes: Vec<Push>,
    pub variation: Variation,
    pub record: Record,
    pub witness: Witness,
}

impl Told<'_> {
    /// In one line: the title of a picture.
    pub fn headline(&self) -> String {
        headline(&self.pushes, &self.design.family.name, &self.record)
    }

    pub fn as_json(&self) -> Value {
        let mut head = json!({
            "gains": self.design.family.name,
            "push": self.pushes[0],
            "judge": self.config.judge,
        });
        if let Some(second) = self.pushes.get(1) {
            head["second_push"] = json!(second);
        }
        let varied = self.variation.varied().into_iter();
        head["variation"] = varied.map(|(name, value)| (name.to_string(), json!(value))).collect();
        with_fields_of(head, &self.record)
    }

    /// A few lines on what happened and why.
    pub fn text(&self) -> String {
        let record = &self.record;
        let mut text = String::new();
        let mut line = |label: &str, what: String| _ = writeln!(text, "{label:<10}{what}");
        for push in &self.pushes {
            let Push { impulse_n_s, heading_deg, height_m, duration_s, start_s, .. } = push;
            let [impulse, heading, height, duration, start] =
                [impulse_n_s, heading_deg, height_m, duration_s, start_s].map(|&value| short(value, 4));
            let late = if came(push, record) { "" } else { "; the robot had fallen by then" };
            line(
                "push",
                format!(
                    "{impulse} N s towards {heading} degrees over {duration} s from t = {start} s, {height} m above the \
                     COM{late}"
                ),
            );
        }
        for (i, pair) in self.variation.varied().chunks(3).enumerate() {
            let told: Vec<String> = pair.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
            line(if i == 0 { "varied" } else { "" }, told.join(", "));
        }
        let count = self.design.family.gains.len();
        line("gains", format!("{} ({count} gain{})", self.design.family.name, if count == 1 { "" } else { "s" }));
        let pushed_until_s = self.pushes.iter().map(Push::end_s).fold(0.0, f64::max);
        let outcome = match record.outcome {
            Outcome::Recovered => match record.settled_at_s {
                Some(at) => {
                    format!(
                        "recovered: standing still since t = {at:.3} s, {:.3} s after the push",
                        at - pushed_until_s
                    )
                }
                None => "recovered".into(),
            },
            Outcome::Fell => format!(
                "fell at t = {:.3} s: {}",
                record.fell_at_s.unwrap_or(record.end_s),
                record.fall_cause.as_deref().unwrap_or("out of bounds")
            ),
            Outcome::Diverged => format!("diverged at t = {:.3} s: numbers are not finite", record.end_s),
            Outcome::TimedOut => format!("timed out: neither fallen nor standing still at t = {:.3} s", record.end_s),
        };
        line("outcome", outcome);
        if let Some(at) = record.home_at_s {
            let (mm, end) = (1000.0 * self.config.judge.home_radius_m, record.end_s);
            line(
                "home",
                format!("COM within {mm} mm of the middle of the soles from t = {at:.3} s to the end, {end:.3} s"),
            );
        }
        match (record.set_after_push, record.cpi_margin_after_push) {
            (Some(side), Some(margin)) => {
                let side = side.name();
                let est = record.cpi_margin_after_push_est.map_or(String::new(), |m| format!(", as estimated {m:.2}"));
                line("sets", format!("{side} the slowest gain's set at the end of the push (margin {margin:.2}{est})"));
            }
            (Some(_), None) => line("sets", "all empty at the end of the push: nothing to stand on".into()),
            (None, _) => {}
        }
        if let Some(at) = record.left_sets_at_s {
            line("", format!("no set held the state from t = {at:.3} s: the pendulum says that a footstep is needed"));
        }
        for text in footsteps(&record.footsteps, record.unfinished_footstep.as_ref()) {
            line("footstep", text);
        }
        if record.peak_dcm_outside_m > 0.0 {
            let mm = 1000.0 * record.peak_dcm_outside_m;
            line("DCM", format!("at most {mm:.1} mm outside of the support"));
        }
        if let (Outcome::Fell, Some(at)) = (record.outcome, self.witness.dcm_outside_since_s) {
            line("lost", format!("t = {at:.3} s: from there on the DCM was outside of the support for good"));
        }
        if let Some((at, joint)) = &self.witness.torque_limited {
            line("torque", format!("{joint} was the first at its limit, at t = {at:.3} s"));
        }
        line(
            "peaks",
            format!(
                "tilt {:.1} degrees, torque {:.2} N m ({:.0} % of the limit), joint speed {:.1} rad/s",
                record.peak_tilt_deg,
                record.peak_torque_n_m,
                100.0 * record.peak_torque_ratio,
                record.peak_joint_speed_rad_s
            ),
        );
        line("switches", record.gain_switches.to_string());
        text.push('\n');
        text.push_str(&thresholds(&self.config.judge));
        text
    }
}
