//! Gain sets: our own controller ([`crate::control`]), which stands and steps by maximal CPI sets.

use super::settings::Settings;
use crate::control::{CpiController, Design};
use crate::error::Result;
use crate::lipm::GainSet;
use crate::robot::{Factory, Robot};
use std::sync::Arc;
use toml::Table;

/// Continues from the state of `now` with the gains and rules of `next`, for the same robot.
pub fn switch(now: &mut CpiController, next: &CpiController) {
    now.switch_to(Arc::clone(next.design()));
}

impl Settings for GainSet {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, file: &str) -> Result<()> {
        self.validate(file)
    }

    fn tree(&self) -> Table {
        Table::try_from(self).expect("it was read from a table")
    }

    fn totals(&self) -> &'static [&'static str] {
        &["gain_switches", "left_sets_at_s"]
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<Factory> {
        Ok(Design::new(robot, self, period_s)?.into())
    }
}
