//! Judges what a search proposes, by final campaigns of the incumbent and the proposed controller.

use super::{CaseId, Tuned};
use crate::ask::spec::Campaign;
use crate::verdict::summary::Summary;
use serde::Serialize;
use std::path::Path;

/// What the final campaign says of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseVerdict {
    pub robot: String,
    pub engine: String,
    /// The result folder of the case, relative to the folder of the search.
    pub folder: String,
    /// The seed of the pushes, from trial 0 on.
    pub seed: u64,
    pub trials: u64,
    /// Numbers of trials from which the incumbent and the proposed controller recover.
    pub recovered: [u64; 2],
    /// The rate of the proposed controller less the rate of the incumbent, with its 95 % interval, and p of the exact
    /// McNemar test.
    pub difference: f64,
    pub ci95: [f64; 2],
    pub p: f64,
}

/// The level of the final test.
const LEVEL: f64 = 0.05;

impl CaseVerdict {
    /// The verdict from the result of a final campaign with the incumbent and the proposed controller.
    pub fn of(case: &CaseId, folder: &str, summary: &Summary, proposed: &str) -> Option<Self> {
        let pair = summary.pairs.first()?;
        let counts = if pair.a == proposed {
            pair.counts
        } else {
            pair.counts.swapped()
        };
        Some(Self {
            robot: case.robot.clone(),
            engine: case.engine.clone(),
            folder: folder.into(),
            seed: summary.seed,
            trials: counts.trials(),
            recovered: [counts.both + counts.only_b, counts.both + counts.only_a],
            difference: counts.difference(),
            ci95: counts.difference_interval(1.0 - LEVEL),
            p: counts.mcnemar_p(),
        })
    }

    pub fn is_better(&self) -> bool {
        self.difference > 0.0 && self.p < LEVEL
    }
}

impl Tuned {
    /// Whether the proposed values are the present ones, so that there is nothing to judge.
    pub fn is_incumbent(&self) -> bool {
        let mut numbers = self.proposed.iter().zip(&self.task.tunables);
        numbers.all(|(value, tunable)| *value == tunable.now)
    }

    /// The final campaign of a case, with the incumbent of `campaign` and the controller in the file `proposed`.
    pub fn final_campaign(&self, campaign: &Campaign, proposed: &Path) -> Campaign {
        let mut judging = campaign.clone();
        judging.seed = self.task.final_seed;
        judging.trials = self.task.final_trials;
        judging.controllers.push(proposed.display().to_string());
        judging
    }

    /// Adds the verdict of the final campaign of a case, whose result lies in `folder`.
    pub fn add_verdict(&mut self, case: usize, folder: &str, summary: &Summary) {
        let case = &self.task.cases[case];
        self.verdicts
            .extend(CaseVerdict::of(case, folder, summary, &self.name));
        self.is_better =
            !self.verdicts.is_empty() && self.verdicts.iter().all(CaseVerdict::is_better);
    }
}
