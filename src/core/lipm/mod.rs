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

/// Helpers for unit tests.
#[cfg(test)]
pub(crate) mod testing {
    use super::{GainFamily, GainSet, Pendulum};
    use crate::error::{Error, Result};
    use nalgebra::SVector;
    use proptest::prelude::ProptestConfig;
    use proptest::test_runner::RngSeed;

    pub const PENDULUM: Pendulum = Pendulum {
        omega: 5.63,
        dt: 0.002,
    };

    pub fn family() -> GainFamily {
        GainFamily::design(&built_in("switching"), PENDULUM, 0.048).unwrap()
    }

    /// A gain set from the text of its file, `g.toml`.
    pub fn parse(text: &str) -> Result<GainSet> {
        let read = toml::from_str(text);
        let gains: GainSet = read.map_err(|e| Error::Syntax {
            file: "g.toml".into(),
            message: e.to_string().trim_end().into(),
        })?;
        gains.validate("g.toml")?;
        Ok(gains)
    }

    /// A built-in gain set.
    pub fn built_in(name: &str) -> GainSet {
        let file = format!(
            "{}/../../assets/controllers/{name}.toml",
            env!("CARGO_MANIFEST_DIR")
        );
        parse(&std::fs::read_to_string(file).unwrap()).unwrap()
    }

    /// A built-in gain set with another value, in TOML, in the place of a dotted key.
    pub fn changed(name: &str, key: &str, value: &str) -> Result<GainSet> {
        let mut tree = toml::Value::try_from(built_in(name)).unwrap();
        let mut place = &mut tree;
        for part in key.split('.') {
            place = match part.parse::<usize>() {
                Ok(index) => &mut place[index],
                Err(_) => &mut place[part],
            };
        }
        *place =
            toml::from_str::<toml::Table>(&format!("value = {value}")).unwrap()["value"].clone();
        parse(&toml::to_string(&tree).unwrap())
    }

    /// The same cases in every run.
    pub fn cases(seed: u64, count: u32) -> ProptestConfig {
        let rng_seed = RngSeed::Fixed(seed);
        ProptestConfig {
            rng_seed,
            failure_persistence: None,
            ..ProptestConfig::with_cases(count)
        }
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
