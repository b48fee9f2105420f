//! The COG-ZMP inverted pendulum (paper, Sect. II), its feedback gains, and their maximal CPI sets (Sect. III, IV).
//!
//! [`cpi_set`] computes a CPI set for one polygon by linear programs and keeps its matrix, for tables, plots, inclusion
//! tests and export. [`online`] tests at every tick whether the same CPI set contains a state, on any polygon and
//! without a search; the controller uses this. [`disturbance`] makes both of them robust. [`stepping`] and
//! [`relaxation`] are for states in no CPI set: where the foot may land, and how COM and ZMP move while it is in the
//! air (Sect. V). [`catching`] plans landing place and ZMP anew at every tick. [`capture`] gives the bounds by which
//! all of this is measured: the largest impulses that the pendulum can take.

pub mod axis_loop;
pub mod capture;
pub mod catching;
pub mod cpi_set;
pub mod disturbance;
pub mod gains;
pub mod online;
pub mod pendulum;
pub mod relaxation;
pub mod stepping;

pub use cpi_set::CpiSet;
pub use gains::{Gain, GainFamily, GainSet};
pub use online::OnlineSets;
pub use pendulum::{Pendulum, State};

/// Helpers for the tests of this room.
#[cfg(test)]
mod testing {
    use super::{GainFamily, GainSet, Pendulum};
    use crate::assets;
    use crate::error::Result;
    use nalgebra::SVector;
    use proptest::prelude::ProptestConfig;
    use proptest::test_runner::RngSeed;

    pub const PENDULUM: Pendulum = Pendulum { omega: 5.63, dt: 0.002 };

    pub fn family() -> GainFamily {
        GainFamily::design(&GainSet::load("switching").unwrap(), PENDULUM, 0.048).unwrap()
    }

    /// A built-in gain set with another value, in TOML, in the place of a dotted key.
    pub fn changed(name: &str, key: &str, value: &str) -> Result<GainSet> {
        let mut tree = toml::Value::try_from(GainSet::load(name)?).unwrap();
        *assets::place(&mut tree, key).unwrap() = assets::toml_value(value);
        GainSet::parse(&assets::Source { file: "g.toml".into(), text: toml::to_string(&tree).unwrap() })
    }

    /// The same cases in every run.
    pub fn cases(seed: u64, count: u32) -> ProptestConfig {
        let rng_seed = RngSeed::Fixed(seed);
        ProptestConfig { rng_seed, failure_persistence: None, ..ProptestConfig::with_cases(count) }
    }

    /// Integrates `x` with the given rate of change until `until_s`, by the Runge-Kutta method.
    pub fn integrated<const N: usize>(
        rate: impl Fn(f64, SVector<f64, N>) -> SVector<f64, N>,
        mut x: SVector<f64, N>,
        until_s: f64,
    ) -> SVector<f64, N> {
        const STEPS: usize = 400;
        let dt = until_s / STEPS as f64;
        for k in 0..STEPS {
            let t = k as f64 * dt;
            let a = rate(t, x);
            let b = rate(t + 0.5 * dt, x + a * (0.5 * dt));
            let c = rate(t + 0.5 * dt, x + b * (0.5 * dt));
            let d = rate(t + dt, x + c * dt);
            x += (a + (b + c) * 2.0 + d) * (dt / 6.0);
        }
        x
    }
}
