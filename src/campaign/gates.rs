//! The gates of a campaign at work: the trials that each is asked of, and an earlier result that some compare with.

use crate::campaign::compare::{Baseline, Earlier, every_pair};
use crate::campaign::gate::{Against, Evidence, Gate, GateSpec, Judged, Status};
use crate::campaign::mcnemar::PairedCounts;
use crate::campaign::parts::Manifest;
use crate::campaign::sequential::{self, Verdict};
use crate::campaign::{Row, paired};
use crate::episode::Outcome;
use crate::error::{Error, Result};
use serde::Serialize;
use std::path::Path;

/// What a campaign has to show, and how that is decided.
pub struct Gates {
    spec: GateSpec,
    gates: Vec<Gate>,
    sets: Vec<String>,
    baseline: Option<Baseline>,
    /// Whether the campaign ends when decided, so that intervals must hold at every look.
    sequential: bool,
    margin: f64,
}

/// A gate and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateResult {
    #[serde(flatten)]
    pub judged: Judged,
    /// Whether the campaign may pass with this: a failed gate may not, one that is unresolved as the campaign says.
    pub passes: bool,
    /// The gain set that is asked about.
    pub set: String,
    /// A trial that it lost: one that the other side recovered from, or else the least hard one.
    pub lost_trial: Option<u64>,
}

impl Gates {
    /// The gates of a campaign's specification; `baseline` is the folder of an earlier result. Errors: a gate that
    /// cannot be read or names no set of the campaign; a baseline gate without a baseline, or one that is not complete,
    /// lacks the set, or met other pushes.
    pub fn new(manifest: &Manifest, baseline: Option<&Path>) -> Result<Gates> {
        let campaign = &manifest.campaign;
        let spec = campaign.gates.clone();
        let gates = spec.require.iter().map(|text| Gate::parse(text, &manifest.sets)).collect::<Result<Vec<_>>>()?;
        let baseline = baseline.map(|path| Baseline::open(path, campaign)).transpose()?;
        for gate in gates.iter().filter(|gate| gate.against == Against::Baseline) {
            let Some(baseline) = &baseline else {
                let accepted = "the folder of an earlier result: --baseline DIR";
                return Err(Error::value("gates", "--gate", &gate.text, "there is no baseline", accepted));
            };
            if !baseline.sets().contains(&gate.set) {
                let problem = format!("the baseline has no gain set {}", gate.set);
                return Err(Error::value("gates", "--gate", &gate.text, problem, baseline.sets().join(", ")));
            }
        }
        let stopping = campaign.stopping;
        let sequential = stopping.until_resolved || baseline.as_ref().is_some_and(Baseline::is_sequential);
        let margin = stopping.margin;
        Ok(Gates { spec, gates, sets: manifest.sets.clone(), baseline, sequential, margin })
    }

    /// The earlier result, if there is one.
    pub fn baseline(&self) -> Option<Earlier> {
        self.baseline.as_ref().map(Baseline::told)
    }

    /// Of rows sorted by trial, then by set.
    pub fn judged(&self, rows: &[Row]) -> Vec<GateResult> {
        self.gates.iter().map(|gate| self.judge(gate, rows)).collect()
    }

    /// What a campaign that ends when decided has still to decide, in words: gates or, without gates, pairs of sets.
    pub fn open(&self, rows: &[Row]) -> Vec<String> {
        if !self.gates.is_empty() {
            let open = self.judged(rows).into_iter().filter(|gate| gate.judged.status == Status::Unresolved);
            return open
                .map(|GateResult { judged, .. }| words(&judged.name, judged.observed, judged.interval))
                .collect();
        }
        let pairs = every_pair(self.sets.len());
        let level = sequential_level(pairs.len());
        let open = |(a, b): (usize, usize)| {
            let counts = paired::counts(paired::trials(rows, self.sets.len()), a, b);
            let interval = counts.interval(level, true);
            let is_open = sequential::verdict(interval, self.margin) == Verdict::Open;
            is_open.then(|| words(&format!("{} - {}", self.sets[a], self.sets[b]), counts.difference(), interval))
        };
        pairs.into_iter().filter_map(open).collect()
    }

    fn judge(&self, gate: &Gate, rows: &[Row]) -> GateResult {
        let own: Vec<&Row> = rows.iter().filter(|row| row.set == gate.set).collect();
        let other: Option<Vec<&Row>> = match &gate.against {
            Against::Rate => None,
            Against::Set(set) => Some(rows.iter().filter(|row| row.set == *set).collect()),
            Against::Baseline => self.baseline.as_ref().map(|baseline| baseline.rows_of(&gate.set)),
        };
        let recovered = |row: &&Row| row.outcome == Outcome::Recovered;
        let level = self.spec.confidence;
        let evidence = match &other {
            None => {
                let k = own.iter().filter(|row| recovered(row)).count() as u64;
                Evidence::rate(k, own.len() as u64, level, self.sequential)
            }
            Some(other) => {
                let counts = PairedCounts::of(own.iter().zip(other).map(|(a, b)| (recovered(a), recovered(b))));
                let (observed, trials) = (counts.difference(), counts.trials());
                let interval = counts.interval(level, self.sequential);
                Evidence { observed, interval, trials, sequential: self.sequential }
            }
        };
        let saved_by_other = |i: usize| other.as_ref().is_some_and(|other| other.get(i).is_some_and(recovered));
        let lost = || own.iter().enumerate().filter(|(_, row)| !recovered(row));
        let least_hard = || lost().min_by(|(_, a), (_, b)| a.hardness().total_cmp(&b.hardness()));
        let lost_trial = lost().find(|&(i, _)| saved_by_other(i)).or_else(least_hard).map(|(_, row)| row.trial);
        let judged = gate.judged(&evidence, level);
        let passes = !judged.status.fails(self.spec.unresolved);
        GateResult { judged, passes, set: gate.set.clone(), lost_trial }
    }
}

fn words(what: &str, observed: f64, [least, most]: [f64; 2]) -> String {
    format!("{what}: {:.1} % ({:.1} to {:.1})", 100.0 * observed, 100.0 * least, 100.0 * most)
}

/// Level of each of so many intervals, so that all of them hold together with 95 % (Bonferroni).
pub fn sequential_level(pairs: usize) -> f64 {
    1.0 - 0.05 / pairs.max(1) as f64
}
