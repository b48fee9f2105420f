//! `[gates]` of a campaign file: what a result has to show, how sure one has to be, and what counts as a failure.

use crate::campaign::verdict::gate::{Against, Gate};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// `[gates]` of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GateSpec {
    /// See [`Gate::parse`].
    pub require: Vec<String>,
    /// Of the two-sided intervals (a share): of gates whose truth is just what is required, about half of the rest pass,
    /// and half fail.
    pub confidence: f64,
    /// What an unresolved gate counts as.
    pub unresolved: OnUnresolved,
}

impl Default for GateSpec {
    fn default() -> Self {
        Self { require: Vec::new(), confidence: 0.95, unresolved: OnUnresolved::Pass }
    }
}

impl GateSpec {
    /// Adds gates that are not there yet.
    pub fn add(&mut self, gates: &[String]) {
        for gate in gates {
            if !self.require.contains(gate) {
                self.require.push(gate.clone());
            }
        }
    }

    /// Whether a gate compares with an earlier result; `sets` are the names of the campaign's.
    pub fn ask_for_baseline(&self, sets: &[String]) -> bool {
        let is_baseline = |gate: &String| Gate::parse(gate, sets).is_ok_and(|gate| gate.against == Against::Baseline);
        self.require.iter().any(is_baseline)
    }

    /// Checks what can be checked without knowing the gain sets; `file` is whose values they are.
    ///
    /// # Errors
    /// [`Error::Value`] for a confidence that is none.
    pub fn check(&self, file: &str) -> Result<()> {
        if (0.5..1.0).contains(&self.confidence) {
            return Ok(());
        }
        let accepted = "at least 0.5, below 1";
        Err(Error::value(file, "gates.confidence", self.confidence, "is not a confidence", accepted))
    }
}

/// What an unresolved gate counts as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnUnresolved {
    #[default]
    Pass,
    Fail,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::gate::Status;

    #[test]
    fn a_campaign_says_what_it_requires() {
        let spec: GateSpec = toml::from_str("require = [\"catch >= 0.8\"]\nunresolved = \"fail\"").unwrap();
        assert_eq!(spec.confidence, 0.95);
        assert_eq!(spec.require, ["catch >= 0.8"]);
        assert!(Status::Unresolved.fails(spec.unresolved) && !Status::Passed.fails(spec.unresolved));
        assert!(!Status::Unresolved.fails(OnUnresolved::default()) && Status::Failed.fails(OnUnresolved::Pass));
        assert!(toml::from_str::<GateSpec>("requires = []").is_err());
        for confidence in [0.4, 1.0, f64::NAN] {
            let error = GateSpec { confidence, ..GateSpec::default() }.check("c.toml").unwrap_err().to_string();
            assert!(error.starts_with("c.toml: gates.confidence = "), "{error}");
        }
        GateSpec::default().check("c.toml").unwrap();
    }

    #[test]
    fn a_gate_is_there_once_and_asks_for_a_baseline_or_not() {
        let mut spec = GateSpec::default();
        let gates = ["catch >= 0.8", "catch >= 0.8", "catch >= baseline-2"].map(String::from);
        spec.add(&gates);
        assert_eq!(spec.require.len(), 2);
        let sets = ["catch", "baseline-2"].map(String::from);
        assert!(!spec.ask_for_baseline(&sets));
        spec.add(&["catch >= baseline - 0.01".into()]);
        assert!(spec.ask_for_baseline(&sets));
    }
}
