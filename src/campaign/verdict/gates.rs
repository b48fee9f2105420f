//! The gates of a campaign at work: the trials that each is asked of, and an earlier result that some compare with.

use crate::campaign::ask::gate::{Against, Gate, GateSpec};
use crate::campaign::ask::spec::Stopping;
use crate::campaign::store::manifest::Manifest;
use crate::campaign::verdict::baseline::{Baseline, BaselineId, unlike};
use crate::campaign::verdict::digest::{Digest, Ended};
use crate::campaign::verdict::evidence::{Evidence, GateAnswer, Status};
use crate::campaign::verdict::pairs::every_pair;
use crate::campaign::verdict::standing::{Standing, When, narrowed};
use crate::error::{Error, Result};
use crate::stats::decision::{Decision, PairVerdict, each_of};
use crate::stats::looks::Looks;
use crate::stats::mcnemar::PairedCounts;
use serde::Serialize;
use std::path::Path;

/// What a campaign has to show, and how that is decided.
pub struct Gates {
    spec: GateSpec,
    gates: Vec<Gate>,
    sets: Vec<String>,
    baseline: Option<Baseline>,
    stopping: Stopping,
    /// None if the count of trials is fixed.
    looks: Option<Looks>,
}

/// A gate and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateResult {
    #[serde(flatten)]
    pub judged: GateAnswer,
    /// Whether the campaign may pass with this: a failed gate may not, one that is unresolved as the campaign says.
    pub passes: bool,
    /// The gain set that is asked about.
    pub set: String,
    /// Whether it is asked for a difference of two rates, not for a rate.
    pub is_difference: bool,
    /// Who recovered, a being this set and b the other side; None for a rate.
    pub counts: Option<PairedCounts>,
    /// A trial that it lost: one that the other side recovered from, or else the least hard one.
    pub lost_trial: Option<u64>,
}

/// What a campaign that ends when decided has still to decide: a gate or, without gates, a pair of gain sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    /// Numbers of the gain sets whose trials it takes.
    pub sets: Vec<usize>,
    /// What it is, and what was seen so far.
    pub words: String,
}

impl Gates {
    /// The gates of a campaign's specification; `baseline` is the folder of an earlier result. Errors: a gate that
    /// cannot be read or names no set of the campaign; a baseline gate without a baseline, or one that is not complete,
    /// lacks the set, or met other pushes; nothing to decide in a campaign that ends when decided.
    pub fn new(manifest: &Manifest, baseline: Option<&Path>) -> Result<Gates> {
        let campaign = &manifest.campaign;
        let spec = campaign.gates.clone();
        let gates = spec.require.iter().map(|text| Gate::parse(text, &manifest.sets)).collect::<Result<Vec<_>>>()?;
        let baseline = baseline.map(|path| Baseline::open(path, manifest)).transpose()?;
        for gate in gates.iter().filter(|gate| gate.against == Against::Baseline) {
            let Some(baseline) = &baseline else {
                let accepted = "--baseline with the folder of an earlier result, as an option of `run` or `merge`";
                return Err(Error::value("gates", "--gate", &gate.text, "there is no baseline", accepted));
            };
            if !baseline.manifest.sets.contains(&gate.set) {
                let problem = format!("the baseline has no gain set {}", gate.set);
                return Err(Error::value("gates", "--gate", &gate.text, problem, baseline.manifest.sets.join(", ")));
            }
        }
        if campaign.stopping.until_resolved && gates.is_empty() && manifest.sets.len() < 2 {
            let problem = "there is nothing to decide: one gain set, and no gate";
            let accepted = "a second gain set to compare with, or a gate, e.g. --gate 'catch >= 0.80'";
            return Err(Error::value("campaign", "stopping.until_resolved", true, problem, accepted));
        }
        let (sets, looks) = (manifest.sets.clone(), manifest.looks());
        Ok(Gates { spec, gates, sets, baseline, stopping: campaign.stopping, looks })
    }

    /// The earlier result, if there is one.
    pub fn baseline(&self) -> Option<BaselineId> {
        self.baseline.as_ref().map(Baseline::told)
    }

    /// Whether a gate waits for more trials than the baseline has.
    pub fn outlasts_baseline(&self, rows: &Digest) -> bool {
        let is_open = |gate: &Gate| self.judge(gate, rows).judged.status == Status::Unresolved;
        self.gates.iter().any(|gate| self.is_used_up(gate, rows) && is_open(gate))
    }

    /// Number of a set of the campaign; a gate names no others.
    fn number(&self, set: &str) -> usize {
        self.sets.iter().position(|name| name == set).unwrap_or_default()
    }

    /// Whether a gate compares with a baseline that has no more trials of the set than these rows.
    fn is_used_up(&self, gate: &Gate, rows: &Digest) -> bool {
        let trials = rows.of(self.number(&gate.set)).len();
        let is_used_up = |baseline: &Baseline| baseline.rows_of(&gate.set).len() <= trials;
        gate.against == Against::Baseline && self.baseline.as_ref().is_some_and(is_used_up)
    }

    /// What the baseline cannot support, for a result with these rows.
    pub fn warnings(&self, manifest: &Manifest, rows: &Digest) -> Vec<String> {
        let Some(baseline) = &self.baseline else { return Vec::new() };
        let mut found = unlike(&baseline.manifest, manifest);
        let gates = self.gates.iter().filter(|gate| gate.against == Against::Baseline);
        let mut counts: Vec<[u64; 2]> = gates
            .map(|gate| [baseline.rows_of(&gate.set).len(), rows.of(self.number(&gate.set)).len()])
            .map(|counts| counts.map(|count| count as u64))
            .collect();
        if counts.is_empty() {
            found.push("no gate compares with the baseline: it has no part in this result".into());
            counts.push([baseline.trials(), rows.trials()]);
        }
        counts.sort_unstable();
        counts.dedup();
        for [have, trials] in counts {
            let some = if have == baseline.trials() { "" } else { " of some gain sets" };
            if have < trials {
                found.push(format!(
                    "the baseline has {have} trials{some}: gates that compare with it go by the first {have}"
                ));
            } else if have == trials && trials < manifest.campaign.trials {
                found.push(format!(
                    "the baseline has {have} trials{some}: more trials would not change the gates that compare with it"
                ));
            }
        }
        found
    }

    /// What became of each gate.
    pub fn judged(&self, rows: &Digest) -> Vec<GateResult> {
        self.gates.iter().map(|gate| self.judge(gate, rows)).collect()
    }

    /// What a campaign that ends when decided has still to decide after these trials: gates or, without gates, pairs of
    /// sets. A gate that compares with a baseline is left as it is when that has no more trials. What is not open after
    /// some of the looks is not open after more of them.
    pub fn open(&self, rows: &Digest) -> Vec<Open> {
        if !self.gates.is_empty() {
            let open = |gate: &Gate| {
                let GateResult { judged, is_difference, .. } = self.judge(gate, rows);
                let unit = if is_difference { "points" } else { "%" };
                let other = match &gate.against {
                    Against::Set(other) => Some(self.number(other)),
                    Against::Rate | Against::Baseline => None,
                };
                (judged.status == Status::Unresolved).then(|| Open {
                    sets: std::iter::once(self.number(&gate.set)).chain(other).collect(),
                    words: words(&judged.name, judged.observed, judged.interval, unit),
                })
            };
            return self.gates.iter().filter(|gate| !self.is_used_up(gate, rows)).filter_map(open).collect();
        }
        let pairs = every_pair(self.sets.len());
        let when = self.looks.map_or(When::AnyTime, When::At);
        let open = |pair: (usize, usize)| {
            let Standing { a, b, counts, decision: Decision { ci95, verdict, .. }, .. } =
                Standing::of(rows, pair, pairs.len(), when, self.stopping.margin);
            let pair = format!("{} - {}", self.sets[a], self.sets[b]);
            (verdict == PairVerdict::Open)
                .then(|| Open { sets: vec![a, b], words: words(&pair, counts.difference(), ci95, "points") })
        };
        pairs.iter().copied().filter_map(open).collect()
    }

    fn judge(&self, gate: &Gate, rows: &Digest) -> GateResult {
        let own = rows.of(self.number(&gate.set));
        let (other, ends_when_decided): (Option<&[Ended]>, bool) = match (&gate.against, &self.baseline) {
            (Against::Set(set), _) => (Some(rows.of(self.number(set))), false),
            (Against::Baseline, Some(baseline)) => (Some(baseline.rows_of(&gate.set)), baseline.is_sequential()),
            _ => (None, false),
        };
        // An interval has to hold at every look where outcomes have to do with the count of trials. In a campaign that
        // itself ends when decided, all gates hold together, at their confidence.
        let sequential = self.stopping.until_resolved || ends_when_decided;
        let confidence = self.spec.confidence;
        let level = if self.stopping.until_resolved { each_of(self.gates.len(), confidence) } else { confidence };
        let own_and_other = |trials: u64| {
            let recovered = |(a, b): (&Ended, &Ended)| (a.has_recovered(), b.has_recovered());
            let pairs = |other: &[Ended]| PairedCounts::of(own.iter().zip(other).take(trials as usize).map(recovered));
            other.map(pairs)
        };
        let saved = |trials: u64| own.iter().take(trials as usize).filter(|ended| ended.has_recovered()).count() as u64;
        let evidence_at = |trials: u64| match own_and_other(trials) {
            None => Evidence::rate(saved(trials), trials, level, sequential),
            Some(counts) => Evidence::difference(&counts, level, sequential),
        };
        let trials = other.map_or(own.len(), |other| own.len().min(other.len())) as u64;
        let (mut evidence, counts) = (evidence_at(trials), own_and_other(trials));
        if let Some(looks) = self.looks {
            let intervals = looks.until(trials).map(|look| evidence_at(look).interval);
            evidence.interval = narrowed(intervals.chain([evidence.interval]));
        }
        let saved_by_other = |i: &usize| other.is_some_and(|other| other.get(*i).is_some_and(Ended::has_recovered));
        let lost = || (0..own.len()).filter(|&i| !own[i].has_recovered());
        let hardness = |i: &usize| rows.hardness(self.number(&gate.set), *i);
        let least_hard = || lost().min_by(|a, b| hardness(a).total_cmp(&hardness(b)));
        let lost_trial = lost().find(saved_by_other).or_else(least_hard).map(|i| i as u64);
        let judged = evidence.answer(gate, level);
        let passes = !judged.status.fails(self.spec.unresolved);
        let is_difference = gate.against != Against::Rate;
        GateResult { judged, passes, set: gate.set.clone(), is_difference, counts, lost_trial }
    }
}

fn words(what: &str, observed: f64, [least, most]: [f64; 2], unit: &str) -> String {
    format!("{what}: {:.1} {unit} ({:.1} to {:.1})", 100.0 * observed, 100.0 * least, 100.0 * most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::ask::spec::Overrides;
    use crate::campaign::store::folder::tests::manifest;
    use crate::campaign::store::row::{TrialRow, tests::row};
    use crate::campaign::verdict::pairs::{DecisionRule, Pair};
    use crate::episode::Outcome;
    use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

    /// Trials of a campaign at most.
    const MOST: u64 = 400;

    /// Of these sets, in a campaign that ends when decided.
    fn gates(sets: &[&str], gates: &[&str]) -> Result<Gates> {
        let gates = gates.iter().map(|s| s.to_string()).collect();
        let overrides = Overrides { gates, until_resolved: true, trials: Some(MOST), ..Overrides::default() };
        Gates::new(&manifest(sets, overrides), None)
    }

    /// Rows of `trials` more trials: each set recovers if one of ten equally likely kinds of push is none of those it
    /// loses.
    fn run(rows: &mut Vec<TrialRow>, trials: u64, loses: &[(&str, [u32; 2])], rng: &mut ChaCha8Rng) {
        let first = (rows.len() / loses.len()) as u64;
        for trial in first..first + trials {
            let kind = rng.random_range(0..10);
            for &(set, [from, to]) in loses {
                let lost = (from..to).contains(&kind);
                rows.push(row(trial, set, 1.0, if lost { Outcome::Fell } else { Outcome::Recovered }));
            }
        }
    }

    /// Looked at until all three pairs are decided, few runs ever claim anything that is not so; the exact test of the one
    /// pair without a difference, at the same looks, claims one in many.
    #[test]
    fn a_run_that_ends_when_decided_is_seldom_wrong_in_any_pair() {
        const RUNS: u32 = 200;
        // The first two lose 10 % each, but not the same; the third one more than either.
        let loses = [("a", [0, 1]), ("b", [1, 2]), ("c", [0, 4])];
        let names = loses.map(|(set, _)| set.to_string());
        let (gates, looks) = (gates(&["a", "b", "c"], &[]).unwrap(), Looks::up_to(MOST));
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (mut wrong, mut wrong_by_peeking) = (0, 0);
        for _ in 0..RUNS {
            let (mut rows, mut look, mut erred, mut peeked) = (Vec::new(), 0, false, false);
            let pairs = |rows: &[TrialRow], pairs: &[(usize, usize)], when| {
                let rows = Digest::of_rows(rows, &names);
                Pair::all(&rows, pairs, &[], DecisionRule { when, margin: 0.02, end_early: true })
            };
            // Neither a nor b is the better one, and c is worse than both.
            let is_wrong = |pair: &Pair| match pair.verdict {
                PairVerdict::Better => pair.b != "c",
                PairVerdict::Same => [&pair.a, &pair.b].iter().any(|set| *set == "c"),
                PairVerdict::Open => false,
            };
            let errs = |pairs: Vec<Pair>| pairs.iter().any(is_wrong);
            while look < MOST && (look == 0 || !gates.open(&Digest::of_rows(&rows, &names)).is_empty()) {
                let next = looks.after(look);
                run(&mut rows, next - look, &loses, &mut rng);
                look = next;
                erred |= errs(pairs(&rows, &every_pair(3), When::At(looks)));
                peeked |= errs(pairs(&rows, &[(0, 1)], When::Once));
            }
            wrong += u32::from(erred);
            wrong_by_peeking += u32::from(peeked);
        }
        // Three standard deviations above 5 %.
        assert!(f64::from(wrong) / f64::from(RUNS) < 0.05 + 3.0 * (0.05 * 0.95 / f64::from(RUNS)).sqrt());
        assert!(wrong_by_peeking > 2 * wrong && f64::from(wrong_by_peeking) > 0.07 * f64::from(RUNS));
    }

    #[test]
    fn gates_are_decided_together_and_then_nothing_is_open() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut rows = Vec::new();
        run(&mut rows, 300, &[("a", [0, 1]), ("b", [0, 4])], &mut rng);
        let gates = gates(&["a", "b"], &["a >= 0.8", "a >= b + 0.1", "b >= 0.6"]).unwrap();
        let names = ["a", "b"].map(String::from);
        let rows = Digest::of_rows(&rows, &names);
        let results = gates.judged(&rows);
        let status = results.iter().map(|gate| gate.judged.status).collect::<Vec<_>>();
        assert_eq!(status, [Status::Passed, Status::Passed, Status::Unresolved]);
        assert!(results.iter().all(|gate| (gate.judged.confidence - (1.0 - 0.05 / 3.0)).abs() < 1e-12));
        assert_eq!(results.iter().map(|gate| gate.is_difference).collect::<Vec<_>>(), [false, true, false]);
        let open = gates.open(&rows);
        assert!(open.len() == 1 && open[0].words.starts_with("b >= 0.6: ") && open[0].sets == [1], "{open:?}");
        assert!(self::gates(&["a"], &[]).is_err(), "one set, no gate: nothing to decide");
    }
}
