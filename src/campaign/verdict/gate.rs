//! Gates: what a campaign has to show, as in CI, and whether it has shown it.
//!
//! `catch >= 0.80` asks for a rate of recovery; `catch >= hold + 0.10` for a difference of two sets on the same trials;
//! `catch >= baseline - 0.01` for the difference to the same set in an earlier result.
//!
//! A gate has three answers. It passes if the whole interval of what was observed lies at or above what is required, fails
//! if the whole interval lies below, and is unresolved else: more trials may tell. To hold the observed value itself
//! against the requirement raises alarms by chance: between two results of 1000 trials, of a set that recovers in 97 %
//! in both, "half a point lower" is seen in every fourth. At a confidence of 95 % at most 2.5 % of campaigns pass wrongly,
//! and at most 2.5 % fail wrongly: of a rate never more, of a difference about: its interval is approximate. It
//! errs in up to 5.6 % on the side away from zero where next to all trials that differ are of one kind and these are few (see
//! [`mcnemar`](crate::stats::mcnemar)): `catch >= baseline - 0.01` with a true loss of one point and no gains, 400 trials, fails in
//! 5.3 %. Intervals that hold at every look err in 5 % at most, on both sides together.

use crate::campaign::verdict::gate_spec::OnUnresolved;
use crate::error::{Error, Result};
use crate::stats::rate::clopper_pearson;
use crate::stats::sequential;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// What stands for the same set in an earlier result.
const BASELINE: &str = "baseline";
/// Who is told of a gate that cannot be read.
const SOURCE: &str = "--gate or gates.require";
/// What a gate looks like.
const FORMS: &str =
    "SET >= RATE, SET >= SET + SHARE or SET >= baseline - SHARE (spaces around + and -), as `catch >= 0.80`";
/// Standard normal at 80 %: the chance that `more_trials` resolve.
const Z80: f64 = 0.841_621_233_572_914_3;
/// An interval that holds at every look is wider, at the same confidence, than one for a fixed number of trials: about
/// so much (1000 to 10,000 trials at 95 %).
const WIDER: f64 = 1.7;
/// Distances to a requirement below this are of rounding.
const ROUNDING: f64 = 1e-9;

/// A requirement.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    /// As it was written.
    pub text: String,
    /// The gain set that has to show something.
    pub set: String,
    pub against: Against,
    /// Least rate, or least difference to what it is held against (shares).
    pub offset: f64,
}

/// What a set's rate is held against.
#[derive(Debug, Clone, PartialEq)]
pub enum Against {
    /// Nothing: the rate itself is asked for.
    Rate,
    /// Another set of the campaign, on the same trials.
    Set(String),
    /// The same set in an earlier result, on the same trials.
    Baseline,
}

impl Gate {
    /// Reads `SET >= RATE`, `SET >= OTHER`, `SET >= OTHER + SHARE`, `SET >= OTHER - SHARE`, where OTHER is a set or
    /// `baseline`, and RATE and SHARE are as `0.8` or `80 %`. `sets` are the names of the campaign's sets; since a name may
    /// hold `+` and `-`, there are spaces around those of a gate, and the longest name that fits is meant.
    ///
    /// # Errors
    /// [`Error::Value`] for anything else.
    pub fn parse(text: &str, sets: &[String]) -> Result<Self> {
        let text = text.trim();
        let refuse = |problem: String, accepted: String| Err(Error::value(SOURCE, "gate", text, problem, accepted));
        let names = || sets.join(", ");

        let after = |set: &str| text.strip_prefix(set).and_then(|rest| rest.trim_start().strip_prefix(">="));
        let fits = sets.iter().filter_map(|set| Some((set, after(set)?)));
        let Some((set, right)) = fits.max_by_key(|(set, _)| set.len()) else {
            return match text.split_once(">=") {
                Some((set, _)) => refuse(format!("no set is named `{}`", set.trim()), names()),
                None => refuse("no `>=`".into(), FORMS.into()),
            };
        };

        let right = right.trim();
        let is_other = |name: &str| name == BASELINE || sets.iter().any(|set| set == name);
        let (other, offset) = match (number(right), split_offset(right)) {
            _ if is_other(right) => (right, 0.0),
            (Some(rate), _) if (0.0..=1.0).contains(&rate) => {
                return Ok(Self { text: text.into(), set: set.clone(), against: Against::Rate, offset: rate });
            }
            (Some(_), _) => return refuse(format!("`{right}` is not a rate"), "0 to 1, or 0 % to 100 %".into()),
            (None, Some((other, _, share))) if is_other(other) && number(share).is_none() => {
                return refuse(format!("`{share}` is not a number"), FORMS.into());
            }
            (None, Some((other, sign, share))) => (other, sign * number(share).unwrap_or_default()),
            (None, None) => (right, 0.0),
        };
        if !is_other(other) {
            return refuse(format!("no set is named `{other}`"), format!("{}, {BASELINE}, or a rate", names()));
        }
        if !(-1.0..=1.0).contains(&offset) {
            return refuse(format!("`{offset}` is not a difference of rates"), "-1 to 1, or -100 % to 100 %".into());
        }
        let against = match other {
            BASELINE if sets.iter().any(|set| set == BASELINE) => {
                let problem = "a set of this campaign is itself named `baseline`".into();
                return refuse(problem, "another name for that set".into());
            }
            BASELINE => Against::Baseline,
            other if other == set => {
                return refuse("holds a set against itself".into(), "another set, or baseline".into());
            }
            other => Against::Set(other.into()),
        };
        Ok(Self { text: text.into(), set: set.clone(), against, offset })
    }

    /// The answer, by evidence whose interval is of this `confidence` (a share), two-sided: of the rate, or of the
    /// difference (rate of the set less that of what it is held against).
    pub fn judged(&self, evidence: &Evidence, confidence: f64) -> GateAnswer {
        let &Evidence { observed, interval: [least, most], trials, sequential } = evidence;
        let status = match self.offset {
            required if least >= required => Status::Passed,
            required if most < required => Status::Failed,
            _ => Status::Unresolved,
        };
        GateAnswer {
            name: self.text.clone(),
            status,
            observed,
            interval: evidence.interval,
            required: self.offset,
            confidence,
            trials,
            more_trials: if status == Status::Unresolved {
                // A campaign with a fixed count of trials cannot be taken up again: a new one has to have them all.
                let more = evidence.more_trials(self.offset, confidence);
                more.map(|more| if sequential { more } else { trials + more })
            } else {
                None
            },
            sequential,
        }
    }
}

/// `0.8`, or `80 %`.
fn number(text: &str) -> Option<f64> {
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok()? / 100.0,
        None => text.parse::<f64>().ok()?,
    };
    value.is_finite().then_some(value)
}

/// What stands before the last ` + ` or ` - `, its sign, and what stands after it.
fn split_offset(text: &str) -> Option<(&str, f64, &str)> {
    let at = text.rfind(" + ").max(text.rfind(" - "))?;
    let sign = if text[at..].starts_with(" + ") { 1.0 } else { -1.0 };
    Some((text[..at].trim_end(), sign, text[at + 3..].trim_start()))
}

/// What was seen of a rate, or of a difference of two on the same trials (shares).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    pub observed: f64,
    pub interval: [f64; 2],
    pub trials: u64,
    /// Whether the interval holds at every look, as one of [`sequential`] does, or for a fixed number of trials only.
    pub sequential: bool,
}

impl Evidence {
    /// Of a rate, with an interval of this `confidence` (a share): for a fixed number of trials that of Clopper and Pearson,
    /// which errs at most as often as it says.
    pub fn rate(recovered: u64, trials: u64, confidence: f64, sequential: bool) -> Self {
        let interval = if sequential { sequential::rate_interval } else { clopper_pearson };
        let observed = recovered as f64 / trials.max(1) as f64;
        Self { observed, interval: interval(recovered, trials, confidence), trials, sequential }
    }

    /// How many more trials, about, resolve with a chance of 80 % whether what is `required` holds, if the truth is as
    /// observed; None if that is just what is required, for then no number does. By the normal approximation: the
    /// interval narrows with the root of the trials.
    pub fn more_trials(&self, required: f64, confidence: f64) -> Option<u64> {
        let distance = (self.observed - required).abs();
        if self.trials == 0 || distance < ROUNDING {
            return None;
        }
        let [least, most] = self.interval;
        // The side towards the requirement is the shorter one where the rate is near 0 or 1, but will not stay so.
        let towards = if self.observed > required { self.observed - least } else { most - self.observed };
        let half_width = towards.max((most - least) / 2.0);
        // Half the interval's width in standard errors; it takes the requirement to be so many and 0.84 away.
        let z = Normal::standard().inverse_cdf(0.5 + confidence / 2.0) * if self.sequential { WIDER } else { 1.0 };
        let times = (half_width * (1.0 + Z80 / z) / distance).powi(2);
        Some((self.trials as f64 * (times - 1.0)).ceil().max(1.0) as u64)
    }
}

/// Whether a gate's requirement holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    Passed,
    Failed,
    Unresolved,
}

impl Status {
    /// Whether it counts as a failure.
    pub fn fails(self, unresolved: OnUnresolved) -> bool {
        self == Status::Failed || (self == Status::Unresolved && unresolved == OnUnresolved::Fail)
    }
}

/// A gate with its answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateAnswer {
    /// The gate as it was written.
    pub name: String,
    pub status: Status,
    /// Rate, or difference of two (shares), its interval, and what is required of it.
    pub observed: f64,
    pub interval: [f64; 2],
    pub required: f64,
    /// Of the interval, two-sided (a share).
    pub confidence: f64,
    pub trials: u64,
    /// How many trials that are still to be run, about, would resolve it: of this campaign if intervals hold at every look,
    /// else of a new one with another seed. None if it is resolved, or if no number would.
    pub more_trials: Option<u64>,
    /// Whether the interval holds at every look.
    pub sequential: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sets(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    fn gate(text: &str) -> Gate {
        Gate::parse(text, &sets(&["catch", "hold"])).unwrap()
    }

    #[test]
    fn gates_are_read() {
        let names = ["catch", "hold", "my-gains", "paper:stepping.alpha=2", "a, b [1]", "a", "a - b", "a >= a", "c+d"];
        let names = sets(&names);
        let set = |name: &str| Against::Set(name.into());
        for (text, left, against, offset) in [
            ("catch >= 0.80", "catch", Against::Rate, 0.8),
            (" catch>=80%  ", "catch", Against::Rate, 0.8),
            ("catch >= 97.5 %", "catch", Against::Rate, 0.975),
            ("catch >= hold", "catch", set("hold"), 0.0),
            ("catch >= hold + 0.10", "catch", set("hold"), 0.1),
            ("catch >= hold - 10 %", "catch", set("hold"), -0.1),
            ("catch >= baseline - 0.01", "catch", Against::Baseline, -0.01),
            ("my-gains >= baseline", "my-gains", Against::Baseline, 0.0),
            ("catch >= my-gains - 0.5", "catch", set("my-gains"), -0.5),
            ("paper:stepping.alpha=2 >= c+d + 0.2", "paper:stepping.alpha=2", set("c+d"), 0.2),
            ("a, b [1] >= paper:stepping.alpha=2 - 2 %", "a, b [1]", set("paper:stepping.alpha=2"), -0.02),
            // The longest name that fits.
            ("catch >= a - b", "catch", set("a - b"), 0.0),
            ("catch >= a - b - 0.1", "catch", set("a - b"), -0.1),
            ("catch >= a - 0.1", "catch", set("a"), -0.1),
            ("a >= a >= 0.5", "a >= a", Against::Rate, 0.5),
        ] {
            let read = Gate::parse(text, &names).unwrap();
            assert_eq!(read, Gate { text: text.trim().into(), set: left.into(), against, offset });
        }
    }

    #[test]
    fn what_is_no_gate_is_refused_with_what_would_be_accepted() {
        for (text, said) in [
            ("catch > 0.8", "no `>=`; accepted: SET >= RATE"),
            ("catch <= 0.8", "no `>=`; accepted: SET >= RATE"),
            ("", "no `>=`; accepted: SET >= RATE"),
            ("catcher >= 0.8", "no set is named `catcher`; accepted: catch, hold"),
            ("catch - 0.1 >= 0.8", "no set is named `catch - 0.1`; accepted: catch, hold"),
            ("catch >= fold", "no set is named `fold`; accepted: catch, hold, baseline, or a rate"),
            ("catch >=", "no set is named ``"),
            ("catch >= fold - 0.1", "no set is named `fold`"),
            ("catch >= hold-0.1", "no set is named `hold-0.1`"),
            ("catch >= nan", "no set is named `nan`"),
            ("catch >= 80", "`80` is not a rate; accepted: 0 to 1, or 0 % to 100 %"),
            ("catch >= -0.1", "`-0.1` is not a rate"),
            ("catch >= hold + 10", "`10` is not a difference of rates; accepted: -1 to 1"),
            ("catch >= hold - much", "`much` is not a number; accepted: SET >= RATE"),
            ("catch >= hold - inf", "`inf` is not a number; accepted: SET >= RATE"),
            ("catch >= catch - 0.1", "holds a set against itself; accepted: another set"),
        ] {
            let error = Gate::parse(text, &sets(&["catch", "hold"])).unwrap_err();
            assert!(matches!(error, Error::Value { .. }));
            let (error, start) = (error.to_string(), format!("--gate or gates.require: gate = {text}: "));
            assert!(error.starts_with(&start) && error.contains(said), "{error}");
        }
        // Who may be meant by it? On the left, the set.
        let names = sets(&["catch", "baseline"]);
        let error = Gate::parse("catch >= baseline - 0.1", &names).unwrap_err().to_string();
        assert!(error.contains("itself named `baseline`; accepted: another name"), "{error}");
        assert_eq!(Gate::parse("baseline >= 0.8", &names).unwrap().against, Against::Rate);
    }

    #[test]
    fn the_whole_interval_has_to_lie_on_one_side() {
        let judged = |least, most| {
            let evidence = Evidence { observed: 0.1, interval: [least, most], trials: 100, sequential: false };
            gate("catch >= hold + 0.10").judged(&evidence, 0.95)
        };
        assert_eq!(judged(0.1, 0.2).status, Status::Passed);
        assert_eq!(judged(0.0, 0.0999).status, Status::Failed);
        assert_eq!((judged(0.0, 0.1).status, judged(0.0, 0.1).more_trials), (Status::Unresolved, None));
        let json = serde_json::to_value(judged(0.1, 0.2)).unwrap();
        assert_eq!(json["name"], "catch >= hold + 0.10");
        assert_eq!(json["status"], "passed");
        assert_eq!(json["more_trials"], serde_json::Value::Null);
    }

    // Expected values: scipy 1.17.1, `beta.ppf((1 - level) / 2, k, n - k + 1)` and `beta.ppf((1 + level) / 2, k + 1, n - k)`.
    #[test]
    fn the_exact_interval_at_any_level() {
        let close = |a: [f64; 2], b: [f64; 2]| assert!((a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < 1e-9, "{a:?}");
        close(clopper_pearson(80, 100, 0.9), [0.7227997503290862, 0.8633386747541327]);
        close(clopper_pearson(0, 50, 0.99), [0.0, 0.10054508337476258]);
        close(clopper_pearson(997, 1000, 0.8), [0.9933315046629319, 0.9988974393004678]);
        close(clopper_pearson(50, 50, 0.95), [0.9288782635358024, 1.0]);
        assert_eq!(clopper_pearson(0, 0, 0.9), [0.0, 1.0]);
    }
}
