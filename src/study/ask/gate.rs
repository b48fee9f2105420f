//! Gates: requirements on the result of a campaign, as in CI, the confidence with which they are decided, and what an
//! undecided gate counts as.
//!
//! `catch >= 0.80` requires a rate of recovery. `catch >= hold + 0.10` requires a difference between the rates of two
//! controllers on the same trials. `catch >= baseline - 0.01` requires a difference from the rate of the same
//! controller in an earlier result.

use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};

/// Word for the same controller in an earlier result.
const BASELINE: &str = "baseline";
/// Origin that errors name for a gate that cannot be read.
const SOURCE: &str = "gates";
const FORMS: &str = "SET >= RATE, SET >= SET + SHARE or SET >= baseline - SHARE, for example `catch >= 0.80` or `catch >= hold + 0.10`";

/// The table `[gates]` of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GateSpec {
    /// The gates; see [`Gate::parse`].
    pub require: Vec<String>,
    /// Confidence of the two-sided intervals, as a share. If the true value is exactly the required one, a gate passes
    /// with probability (1 - confidence) / 2, and fails with the same probability.
    pub confidence: f64,
    /// Whether an unresolved gate counts as passed or failed.
    pub unresolved: OnUnresolved,
}

impl Default for GateSpec {
    fn default() -> Self {
        Self {
            require: Vec::new(),
            confidence: 0.95,
            unresolved: OnUnresolved::Pass,
        }
    }
}

impl GateSpec {
    /// Adds the gates that are not in the list yet.
    pub fn add(&mut self, gates: &[String]) {
        for gate in gates {
            if !self.require.contains(gate) {
                self.require.push(gate.clone());
            }
        }
    }

    /// Whether a gate compares with an earlier result. `controllers` are the names of the campaign's controllers.
    pub fn ask_for_baseline(&self, controllers: &[String]) -> bool {
        self.require.iter().any(|gate| {
            Gate::parse(gate, controllers).is_ok_and(|gate| gate.against == Against::Baseline)
        })
    }

    /// Checks what does not depend on the controllers. Errors name `file` as the origin of the values. It fails if the
    /// confidence is out of range.
    pub fn check(&self, file: &str) -> Result<()> {
        if (0.5..1.0).contains(&self.confidence) {
            return Ok(());
        }
        let accepted = "at least 0.5 and below 1";
        Err(Error::value(
            file,
            "gates.confidence",
            self.confidence,
            "is not a valid confidence",
            accepted,
        ))
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

/// One requirement.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    /// The gate as it was written.
    pub text: String,
    /// The controller that must meet the requirement.
    pub controller: String,
    pub against: Against,
    /// Smallest accepted rate, or smallest accepted difference to `against` (shares).
    pub offset: f64,
}

/// What the rate of the controller is compared with.
#[derive(Debug, Clone, PartialEq)]
pub enum Against {
    /// Nothing: the rate itself must reach `offset`.
    Rate,
    /// Another controller of the campaign, on the same trials.
    Controller(String),
    /// The same controller in an earlier result, on the same trials.
    Baseline,
}

impl Gate {
    /// Reads `SET >= RATE`, `SET >= OTHER`, `SET >= OTHER + SHARE` or `SET >= OTHER - SHARE`. OTHER is a controller or
    /// `baseline`, and RATE and SHARE are written as `0.8` or `80 %`. `controllers` are the names of the campaign's
    /// controllers. A name may contain `+` and `-`, and the longest name that fits is taken. Anything else is an error.
    pub fn parse(text: &str, controllers: &[String]) -> Result<Self> {
        let text = text.trim();
        let refuse = |problem: String, accepted: String| {
            Err(Error::value(SOURCE, "gate", text, problem, accepted))
        };
        let names = || controllers.join(", ");
        let fits = controllers.iter().filter_map(|controller| {
            let rest = text.strip_prefix(controller.as_str())?;
            Some((controller, rest.trim_start().strip_prefix(">=")?))
        });
        let Some((controller, right)) = fits.max_by_key(|(controller, _)| controller.len()) else {
            return match text.split_once(">=") {
                Some((controller, _)) => refuse(
                    format!("no controller is named `{}`", controller.trim()),
                    names(),
                ),
                None => refuse("has no `>=`".into(), FORMS.into()),
            };
        };

        let right = right.trim();
        let is_other = |name: &str| {
            name == BASELINE || controllers.iter().any(|controller| controller == name)
        };
        let (other, offset) = match (number(right), split_offset(right, is_other)) {
            _ if is_other(right) => (right, 0.0),
            (Some(rate), _) if (0.0..=1.0).contains(&rate) => {
                return Ok(Self {
                    text: text.into(),
                    controller: controller.clone(),
                    against: Against::Rate,
                    offset: rate,
                });
            }
            (Some(_), _) => {
                return refuse(
                    format!("`{right}` is not a rate"),
                    "0 to 1, or 0 % to 100 %".into(),
                );
            }
            (None, Some((other, _, share))) if is_other(other) && number(share).is_none() => {
                return refuse(format!("`{share}` is not a number"), FORMS.into());
            }
            (None, Some((other, sign, share))) => (other, sign * number(share).unwrap_or_default()),
            (None, None) => (right, 0.0),
        };
        if !is_other(other) {
            return refuse(
                format!("no controller is named `{other}`"),
                format!("{}, {BASELINE}, or a rate", names()),
            );
        }
        if !(-1.0..=1.0).contains(&offset) {
            return refuse(
                format!("`{offset}` is not a difference of rates"),
                "-1 to 1, or -100 % to 100 %".into(),
            );
        }
        let against = match other {
            BASELINE if controllers.iter().any(|controller| controller == BASELINE) => {
                let problem = "a controller of this campaign is itself named `baseline`".into();
                return refuse(problem, "another name for that controller".into());
            }
            BASELINE => Against::Baseline,
            other if other == controller => {
                return refuse(
                    "compares a controller with itself".into(),
                    "another controller, or baseline".into(),
                );
            }
            other => Against::Controller(other.into()),
        };
        Ok(Self {
            text: text.into(),
            controller: controller.clone(),
            against,
            offset,
        })
    }
}

fn number(text: &str) -> Option<f64> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok()? / 100.0,
        None => text.parse::<f64>().ok()?,
    };
    value.is_finite().then_some(value)
}

/// The text before the last `+` or `-` that follows a name, the sign, and the text after it. If no sign follows a name,
/// it is the last one with spaces around it.
fn split_offset(text: &str, is_name: impl Fn(&str) -> bool) -> Option<(&str, f64, &str)> {
    let split = |at: usize| {
        let sign = if text[at..].starts_with('+') {
            1.0
        } else {
            -1.0
        };
        (text[..at].trim_end(), sign, text[at + 1..].trim_start())
    };
    let of_name = text
        .rmatch_indices(['+', '-'])
        .map(|(at, _)| split(at))
        .find(|(name, ..)| is_name(name));
    of_name.or_else(|| Some(split(text.rfind(" + ").max(text.rfind(" - "))? + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controllers(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    #[test]
    fn gates_are_read() {
        let names = [
            "catch",
            "hold",
            "my-gains",
            "paper:stepping.alpha=2",
            "a, b [1]",
            "a >= a",
            "a - b",
            "a",
            "c+d",
        ];
        let names = controllers(&names);
        let controller = |name: &str| Against::Controller(name.into());
        for (text, left, against, offset) in [
            ("catch >= 0.80", "catch", Against::Rate, 0.8),
            (" catch>=80%  ", "catch", Against::Rate, 0.8),
            ("catch >= 97.5 %", "catch", Against::Rate, 0.975),
            ("catch >= hold", "catch", controller("hold"), 0.0),
            ("catch >= hold + 0.10", "catch", controller("hold"), 0.1),
            ("catch >= hold - 10 %", "catch", controller("hold"), -0.1),
            ("catch>=hold+0.1", "catch", controller("hold"), 0.1),
            ("catch >= hold -1e-3", "catch", controller("hold"), -1e-3),
            (
                "catch >= my-gains-10%",
                "catch",
                controller("my-gains"),
                -0.1,
            ),
            ("catch >= c+d-0.2", "catch", controller("c+d"), -0.2),
            (
                "catch >= baseline - 0.01",
                "catch",
                Against::Baseline,
                -0.01,
            ),
            ("my-gains >= baseline", "my-gains", Against::Baseline, 0.0),
            (
                "catch >= my-gains - 0.5",
                "catch",
                controller("my-gains"),
                -0.5,
            ),
            (
                "paper:stepping.alpha=2 >= c+d + 0.2",
                "paper:stepping.alpha=2",
                controller("c+d"),
                0.2,
            ),
            (
                "a, b [1] >= paper:stepping.alpha=2 - 2 %",
                "a, b [1]",
                controller("paper:stepping.alpha=2"),
                -0.02,
            ),
            // The longest name that fits is taken.
            ("catch >= a - b", "catch", controller("a - b"), 0.0),
            ("catch >= a - b - 0.1", "catch", controller("a - b"), -0.1),
            ("catch >= a - 0.1", "catch", controller("a"), -0.1),
            ("a >= a >= 0.5", "a >= a", Against::Rate, 0.5),
        ] {
            let read = Gate::parse(text, &names).unwrap();
            assert_eq!(
                read,
                Gate {
                    text: text.trim().into(),
                    controller: left.into(),
                    against,
                    offset
                }
            );
        }
    }

    #[test]
    fn what_is_no_gate_is_refused_with_what_would_be_accepted() {
        for (text, said) in [
            ("catch > 0.8", "has no `>=`; accepted: SET >= RATE"),
            ("", "has no `>=`; accepted: SET >= RATE"),
            (
                "catcher >= 0.8",
                "no controller is named `catcher`; accepted: catch, hold",
            ),
            (
                "catch - 0.1 >= 0.8",
                "no controller is named `catch - 0.1`; accepted: catch, hold",
            ),
            (
                "catch >= fold",
                "no controller is named `fold`; accepted: catch, hold, baseline, or a rate",
            ),
            ("catch >=", "no controller is named ``"),
            ("catch >= fold-0.1", "no controller is named `fold-0.1`"),
            (
                "catch >= hold-much",
                "`much` is not a number; accepted: SET >= RATE",
            ),
            (
                "catch >= 80",
                "`80` is not a rate; accepted: 0 to 1, or 0 % to 100 %",
            ),
            (
                "catch >= hold + 10",
                "`10` is not a difference of rates; accepted: -1 to 1",
            ),
            (
                "catch >= hold - much",
                "`much` is not a number; accepted: SET >= RATE",
            ),
            (
                "catch >= catch - 0.1",
                "compares a controller with itself; accepted: another controller",
            ),
        ] {
            let error = Gate::parse(text, &controllers(&["catch", "hold"])).unwrap_err();
            assert!(matches!(error, Error::Value { .. }));
            let (error, start) = (error.to_string(), format!("gates: gate = {text}: "));
            assert!(error.starts_with(&start) && error.contains(said), "{error}");
        }
        // On the left, `baseline` is the controller of that name. On the right `baseline` is ambiguous.
        let names = controllers(&["catch", "baseline"]);
        let error = Gate::parse("catch >= baseline - 0.1", &names)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("itself named `baseline`; accepted: another name"),
            "{error}"
        );
        assert_eq!(
            Gate::parse("baseline >= 0.8", &names).unwrap().against,
            Against::Rate
        );
    }
}
