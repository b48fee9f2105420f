//! Applies the gates of a campaign to its trials. Some gates compare the trials with the trials of an earlier result.

use crate::ask::gate::{Against, Gate, GateSpec};
use crate::ask::spec::Stopping;
use crate::store::manifest::Manifest;
use crate::verdict::baseline::{Baseline, BaselineId, unlike};
use crate::verdict::evidence::{Evidence, GateAnswer, Status};
use crate::verdict::pairs::every_pair;
use crate::verdict::standing::PairDecision;
use crate::verdict::trial_columns::{EpisodeEnd, TrialColumns};
use serde::Serialize;
use standfast_core::error::{Error, Result};
use standfast_stats::decision::{Decision, PairVerdict, each_of};
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::sequential::{looks_until, narrowed};
use std::path::Path;

/// The requirements of a campaign, and how they are decided.
pub struct Gates {
    spec: GateSpec,
    gates: Vec<Gate>,
    controllers: Vec<String>,
    baseline: Option<Baseline>,
    stopping: Stopping,
}

/// A gate and its answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateResult {
    #[serde(flatten)]
    pub judged: GateAnswer,
    /// Whether the campaign passes this gate. It does not pass a failed gate. Whether it passes an unresolved gate is a
    /// setting of the campaign.
    pub passes: bool,
    /// The controller for which the gate requires something.
    pub controller: String,
    /// Whether the gate requires something of a difference of two rates, and not of one rate.
    pub is_difference: bool,
    /// Numbers of trials in which this controller (a) and the controller with which it is compared (b) recovered. It is
    /// None for a rate.
    pub counts: Option<PairedCounts>,
    /// A trial that this controller lost: the first one from which the other controller recovered or, if there is none,
    /// the easiest one.
    pub lost_trial: Option<u64>,
}

/// A question that a campaign that ends when decided has still to decide: a gate or, without gates, which of two
/// controllers is better.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    /// Numbers of the controllers that need more trials for this decision.
    pub controllers: Vec<usize>,
    /// The question in words, with what the trials show so far.
    pub words: String,
}

impl Gates {
    /// Reads the gates of a campaign. `baseline` is the folder of an earlier result. It fails if a gate cannot be read
    /// or names a controller that the campaign does not have. It fails if a gate needs a baseline and there is none, or
    /// if the baseline is not complete, lacks the controller, or has other pushes. It also fails if a campaign that
    /// ends when decided has nothing to decide.
    pub fn new(manifest: &Manifest, baseline: Option<&Path>) -> Result<Gates> {
        let campaign = &manifest.campaign;
        let spec = campaign.gates.clone();
        let gates = spec
            .require
            .iter()
            .map(|text| Gate::parse(text, &manifest.controllers))
            .collect::<Result<Vec<_>>>()?;
        let baseline = baseline
            .map(|path| Baseline::open(path, manifest))
            .transpose()?;
        for gate in gates
            .iter()
            .filter(|gate| gate.against == Against::Baseline)
        {
            let Some(baseline) = &baseline else {
                let accepted = "--baseline with the folder of an earlier result, as an option of `run` or `merge`";
                return Err(Error::value(
                    "gates",
                    "--gate",
                    &gate.text,
                    "there is no baseline",
                    accepted,
                ));
            };
            if !baseline.manifest.controllers.contains(&gate.controller) {
                let problem = format!("the baseline has no controller {}", gate.controller);
                return Err(Error::value(
                    "gates",
                    "--gate",
                    &gate.text,
                    problem,
                    baseline.manifest.controllers.join(", "),
                ));
            }
        }
        if campaign.stopping.until_resolved && gates.is_empty() && manifest.controllers.len() < 2 {
            let problem = "there is nothing to decide: one controller, and no gate";
            let accepted =
                "a second controller to compare with, or a gate, e.g. --gate 'catch >= 0.80'";
            return Err(Error::value(
                "campaign",
                "stopping.until_resolved",
                true,
                problem,
                accepted,
            ));
        }
        Ok(Gates {
            spec,
            gates,
            controllers: manifest.controllers.clone(),
            baseline,
            stopping: campaign.stopping,
        })
    }

    /// The identity of the earlier result, if there is one.
    pub fn baseline(&self) -> Option<BaselineId> {
        self.baseline.as_ref().map(Baseline::id)
    }

    /// Whether a gate waits for more trials than the baseline has.
    pub fn outlasts_baseline(&self, rows: &TrialColumns) -> bool {
        self.gates.iter().any(|gate| {
            self.is_used_up(gate, rows)
                && self.judge(gate, rows).judged.status == Status::Unresolved
        })
    }

    /// Number of a controller in the campaign. A gate names only controllers of the campaign.
    fn number(&self, controller: &str) -> usize {
        self.controllers
            .iter()
            .position(|name| name == controller)
            .unwrap_or_default()
    }

    /// Whether a gate compares with a baseline that has no more trials of the gate's controller than these rows have.
    fn is_used_up(&self, gate: &Gate, rows: &TrialColumns) -> bool {
        let trials = rows.of(self.number(&gate.controller)).len();
        gate.against == Against::Baseline
            && self
                .baseline
                .as_ref()
                .is_some_and(|baseline| baseline.rows_of(&gate.controller).len() <= trials)
    }

    /// Warns of what the baseline cannot support for a result with these rows.
    pub fn warnings(&self, manifest: &Manifest, rows: &TrialColumns) -> Vec<String> {
        let Some(baseline) = &self.baseline else {
            return Vec::new();
        };
        let mut warnings = unlike(&baseline.manifest, manifest);
        let mut counts = Vec::new();
        for gate in &self.gates {
            if gate.against == Against::Baseline {
                let have = baseline.rows_of(&gate.controller).len() as u64;
                counts.push([have, rows.of(self.number(&gate.controller)).len() as u64]);
            }
        }
        if counts.is_empty() {
            warnings
                .push("no gate compares with the baseline: it has no part in this result".into());
            counts.push([baseline.trials(), rows.trials()]);
        }
        counts.sort_unstable();
        counts.dedup();
        for [have, trials] in counts {
            let some = if have == baseline.trials() {
                ""
            } else {
                " of some controllers"
            };
            if have < trials {
                warnings.push(format!(
                    "the baseline has {have} trials{some}: gates that compare with it go by the first {have}"
                ));
            } else if have == trials && trials < manifest.campaign.trials {
                warnings.push(format!(
                    "the baseline has {have} trials{some}: more trials would not change the gates that compare with it"
                ));
            }
        }
        warnings
    }

    /// The answer to each gate.
    pub fn judged(&self, rows: &TrialColumns) -> Vec<GateResult> {
        self.gates
            .iter()
            .map(|gate| self.judge(gate, rows))
            .collect()
    }

    /// The questions that a campaign that ends when decided has still to decide after these trials: gates or, without
    /// gates, pairs of controllers. A gate that compares with a baseline is left out if the baseline has no further
    /// trials. A question that is decided at one look stays decided at all later ones.
    pub fn open(&self, rows: &TrialColumns) -> Vec<Open> {
        let mut open = Vec::new();
        for gate in &self.gates {
            if self.is_used_up(gate, rows) {
                continue;
            }
            let GateResult {
                judged,
                is_difference,
                ..
            } = self.judge(gate, rows);
            if judged.status != Status::Unresolved {
                continue;
            }
            let mut controllers = vec![self.number(&gate.controller)];
            if let Against::Controller(other) = &gate.against {
                controllers.push(self.number(other));
            }
            let unit = if is_difference { "points" } else { "%" };
            open.push(Open {
                controllers,
                words: words(&judged.name, judged.observed, judged.interval, unit),
            });
        }
        if !self.gates.is_empty() {
            return open;
        }
        let pairs = every_pair(self.controllers.len());
        for &pair in &pairs {
            let PairDecision {
                a,
                b,
                counts,
                decision: Decision { ci95, verdict, .. },
                ..
            } = PairDecision::of(rows, pair, pairs.len(), true, self.stopping.margin);
            if verdict == PairVerdict::Open {
                let pair = format!("{} - {}", self.controllers[a], self.controllers[b]);
                open.push(Open {
                    controllers: vec![a, b],
                    words: words(&pair, counts.difference(), ci95, "points"),
                });
            }
        }
        open
    }

    fn judge(&self, gate: &Gate, rows: &TrialColumns) -> GateResult {
        let controller = self.number(&gate.controller);
        let own = rows.of(controller);
        let (other, ends_when_decided): (Option<&[EpisodeEnd]>, bool) =
            match (&gate.against, &self.baseline) {
                (Against::Controller(controller), _) => {
                    (Some(rows.of(self.number(controller))), false)
                }
                (Against::Baseline, Some(baseline)) => (
                    Some(baseline.rows_of(&gate.controller)),
                    baseline.is_sequential(),
                ),
                _ => (None, false),
            };
        // If the number of trials depends on outcomes, an interval has to hold at every look. In a campaign that ends
        // when decided, the intervals of all gates hold together at the confidence.
        let sequential = self.stopping.until_resolved || ends_when_decided;
        let confidence = self.spec.confidence;
        let level = if self.stopping.until_resolved {
            each_of(self.gates.len(), confidence)
        } else {
            confidence
        };
        let counts_at = |trials: u64| {
            let pairs = own.iter().zip(other?).take(trials as usize);
            Some(PairedCounts::of(
                pairs.map(|(a, b)| (a.has_recovered(), b.has_recovered())),
            ))
        };
        let evidence_at = |trials: u64| match counts_at(trials) {
            Some(counts) => Evidence::difference(&counts, level, sequential),
            None => {
                let first = own.iter().take(trials as usize);
                let recovered = first.filter(|ended| ended.has_recovered()).count() as u64;
                Evidence::rate(recovered, trials, level, sequential)
            }
        };
        let trials = other.map_or(own.len(), |other| own.len().min(other.len())) as u64;
        let (mut evidence, counts) = (evidence_at(trials), counts_at(trials));
        if self.stopping.until_resolved {
            evidence.interval =
                narrowed(looks_until(trials).map(|look| evidence_at(look).interval));
        }
        let lost: Vec<usize> = (0..own.len())
            .filter(|&trial| !own[trial].has_recovered())
            .collect();
        let lost_trial = lost
            .iter()
            .find(|trial| {
                other
                    .and_then(|other| other.get(**trial))
                    .is_some_and(EpisodeEnd::has_recovered)
            })
            .or_else(|| {
                lost.iter().min_by(|a, b| {
                    rows.hardness(controller, **a)
                        .total_cmp(&rows.hardness(controller, **b))
                })
            })
            .map(|&trial| trial as u64);
        let judged = evidence.answer(gate, level);
        let passes = !judged.status.fails(self.spec.unresolved);
        let is_difference = gate.against != Against::Rate;
        GateResult {
            judged,
            passes,
            controller: gate.controller.clone(),
            is_difference,
            counts,
            lost_trial,
        }
    }
}

fn words(what: &str, observed: f64, [least, most]: [f64; 2], unit: &str) -> String {
    format!(
        "{what}: {:.1} {unit} ({:.1} to {:.1})",
        100.0 * observed,
        100.0 * least,
        100.0 * most
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::spec::Overrides;
    use crate::fixtures::manifest;
    use standfast_sim::episode::Outcome::{Fell, Recovered};

    /// The gates of a campaign with these controllers that ends when decided.
    fn gates(controllers: &[&str], gates: &[&str]) -> Result<Gates> {
        let gates = gates.iter().map(|s| s.to_string()).collect();
        let overrides = Overrides {
            gates,
            until_resolved: true,
            trials: Some(400),
            ..Overrides::default()
        };
        Gates::new(&manifest(controllers, overrides), None)
    }

    #[test]
    fn gates_are_decided_together_and_then_nothing_is_open() {
        // "a" recovers from nine of ten pushes, "b" from six of ten.
        let outcomes: Vec<_> = (0..300)
            .map(|i| [1, 4].map(|lost| if i % 10 < lost { Fell } else { Recovered }))
            .collect();
        let rows = crate::fixtures::columns_of_outcomes(&outcomes);
        let gates_of_two = gates(&["a", "b"], &["a >= 0.8", "a >= b + 0.1", "b >= 0.6"]).unwrap();
        let results = gates_of_two.judged(&rows);
        let found: Vec<_> = results
            .iter()
            .map(|gate| (gate.judged.status, gate.is_difference))
            .collect();
        assert_eq!(
            found,
            [
                (Status::Passed, false),
                (Status::Passed, true),
                (Status::Unresolved, false)
            ]
        );
        assert!(
            results
                .iter()
                .all(|gate| (gate.judged.confidence - (1.0 - 0.05 / 3.0)).abs() < 1e-12)
        );
        let open = gates_of_two.open(&rows);
        assert!(
            open.len() == 1
                && open[0].words.starts_with("b >= 0.6: ")
                && open[0].controllers == [1],
            "{open:?}"
        );
        assert!(
            gates(&["a"], &[]).is_err(),
            "one set, no gate: nothing to decide"
        );
    }
}
