//! What happened after a ZMP error was imposed on the pendulum, as text and JSON.

use crate::imposed::{ImposedRecord, Start};
use serde_json::{Value, json};
use standfast::report::text::{layout::entry, story};
use standfast::report::with_fields_of;

/// An imposed error and its record.
pub struct ImposedStory<'a> {
    pub scenario: &'a str,
    pub gain_set: &'a str,
    pub start: Start,
    pub record: ImposedRecord,
}

impl ImposedStory<'_> {
    /// The story on one line, for the title of a picture.
    pub fn headline(&self) -> String {
        let [x, y] = self.record.zmp_error_m.map(|v| 1000.0 * v);
        format!(
            "ZMP error ({x:.1}, {y:.1}) mm imposed, controller {}: {}",
            self.gain_set,
            self.outcome()
        )
    }

    fn outcome(&self) -> String {
        match (self.record.lost_at_s, self.record.home_at_s) {
            (Some(at), _) => format!("lost at {at:.2} s: the DCM is out of reach"),
            (None, Some(at)) => format!("recovered, COM home from {at:.2} s"),
            (None, None) => "the COM does not get home".into(),
        }
    }

    pub fn as_json(&self) -> Value {
        let head =
            json!({ "scenario": self.scenario, "gains": self.gain_set, "start": self.start });
        with_fields_of(head, &self.record)
    }

    /// The story in a few lines.
    pub fn text(&self) -> String {
        let record = &self.record;
        let mut text = String::new();
        let mut line = |label: &str, what: String| text += &entry(label, &what);
        let [x, y] = record.zmp_error_m.map(|v| 1000.0 * v);
        line(
            "error",
            format!(
                "({x:.1}, {y:.1}) mm, imposed on the ideal pendulum. The body follows by inverse kinematics"
            ),
        );
        let [vx, vy] = record.com_vel_m_s;
        line(
            "start",
            match self.start {
                Start::AtRest => {
                    "the COM is at rest; only the rule for footsteps is told of the error".into()
                }
                Start::Moving => format!(
                    "the COM moves at ({vx:.3}, {vy:.3}) m/s, as after a push of {:.2} N s without duration, for which the \
                     slowest gain asks for that error",
                    record.impulse_n_s
                ),
            },
        );
        line("gains", self.gain_set.into());
        line("outcome", self.outcome());
        for footstep in story::footsteps(&record.footsteps, record.unfinished_footstep.as_ref()) {
            line("footstep", footstep);
        }
        line(
            "body",
            format!(
                "its COM is up to {:.1} mm from that of the pendulum, and at least {:.0} mm high",
                1000.0 * record.worst_com_error_m,
                1000.0 * record.lowest_com_m
            ),
        );
        text
    }
}
