//! Gain sets: our own controller ([`standfast_core::control`]), which stands and steps by maximal CPI sets.

use super::spec::ControllerSpec;
use super::tunable::Tunable;
use standfast_core::control::{CpiController, Design};
use standfast_core::error::Result;
use standfast_core::lipm::GainSet;
use standfast_core::lipm::catching::{CatchingTable, Departure};
use standfast_core::lipm::stepping::SteppingTable;
use standfast_core::robot::Robot;
use standfast_core::socket::{PreparedController, Report};
use std::sync::Arc;
use toml::{Table, Value};

/// Continues from the state of `now` with the gains and rules of `next`, for the same robot.
pub fn switch(now: &mut CpiController, next: &CpiController) {
    now.switch_to(Arc::clone(next.design()));
}

impl ControllerSpec for GainSet {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        self.validate(file)
    }

    fn tree(&self) -> Table {
        let mut tree = Table::try_from(self).expect("it was read from a table");
        if let (Some(catching), Some(Value::Table(table))) =
            (&self.catching, tree.get_mut("catching"))
        {
            // The file leaves out zeros, but a key that can be changed must be in the table.
            let Departure {
                lift,
                left,
                crossed,
                place,
                zmp,
                slower,
                tilt,
                lower,
            } = catching.every;
            let [place, zmp, tilt] = [place, zmp, tilt].map(|pair| Value::from(pair.to_vec()));
            let numbers = [
                ("lift", lift),
                ("left", left),
                ("crossed", crossed),
                ("slower", slower),
                ("lower", lower),
            ];
            let numbers = numbers.map(|(name, number)| (name, Value::from(number)));
            let every = numbers
                .into_iter()
                .chain([("place", place), ("zmp", zmp), ("tilt", tilt)]);
            table.insert(
                "every".into(),
                Value::Table(every.map(|(name, value)| (name.into(), value)).collect()),
            );
        }
        tree
    }

    fn text(&self) -> String {
        toml::to_string(self).expect("it was read from a table")
    }

    fn totals(&self) -> &'static [&'static str] {
        &Report::TOTALS
    }

    /// The margin, the slowest pole of each gain, and the most important numbers of footsteps. The ranges, like the
    /// values, hold for robots of every size.
    fn tunables(&self) -> Vec<Tunable> {
        let mut tunables = vec![Tunable::new("zmp_margin", self.zmp_margin, [0.0, 0.3])];
        for (i, gain) in self.gains.iter().enumerate() {
            for (axis, poles) in [("x", gain.x), ("y", gain.y)] {
                tunables.push(Tunable::new(
                    format!("gains.{i}.{axis}.0"),
                    poles[0],
                    [poles[0] / 2.5, poles[0] * 2.5],
                ));
            }
        }
        if let Some(CatchingTable {
            pause,
            transfer,
            settle,
            every,
            ..
        }) = &self.catching
        {
            let mut of = |key: &str, now: f64, range: [f64; 2]| {
                tunables.push(Tunable::new(format!("catching.{key}"), now, range));
            };
            of("pause", *pause, [0.03, 0.8]);
            of("transfer", *transfer, [0.08, 0.8]);
            of("settle", *settle, [0.15, 1.2]);
            of("every.crossed", every.crossed, [-0.02, 0.06]);
            of("every.place.0", every.place[0], [-0.05, 0.05]);
            of("every.place.1", every.place[1], [-0.05, 0.05]);
            of("every.slower", every.slower, [-0.3, 0.3]);
            of("every.tilt.1", every.tilt[1], [-0.2, 0.2]);
            of("every.lower", every.lower, [-0.03, 0.06]);
        }
        if let Some(SteppingTable {
            alpha,
            swing_time,
            lift,
            pause,
            ..
        }) = &self.stepping
        {
            tunables.push(Tunable::new("stepping.alpha", *alpha, [1.0, 60.0]));
            tunables.push(Tunable::new("stepping.swing_time", *swing_time, [0.6, 3.0]));
            tunables.push(Tunable::new("stepping.lift", *lift, [0.03, 0.13]));
            tunables.push(Tunable::new("stepping.pause", *pause, [0.0, 1.0]));
        }
        tunables
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        Ok(Design::new(robot, self, period_s)?.into())
    }
}
