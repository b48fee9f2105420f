//! The trials of a campaign as the page needs them: one push and what each gain set made of it.

use crate::campaign::TrialRow;
use crate::campaign::store::row::by_trial;
use crate::episode::Outcome;
use serde_json::{Value, json};

/// More trials than this are not drawn one by one.
const MOST_DOTS: usize = 2000;
/// The last count of footsteps stands for all beyond it.
const FOOTSTEPS: usize = 4;

/// All rows, sorted by trial, then by set.
pub(super) struct Trials<'a> {
    pub sets: &'a [&'a str],
    pub rows: &'a [TrialRow],
}

impl<'a> Trials<'a> {
    pub fn iter(&self) -> impl Iterator<Item = &'a [TrialRow]> {
        by_trial(self.rows, self.sets.len())
    }

    /// Count of trials.
    pub fn len(&self) -> usize {
        self.iter().count()
    }

    /// Whether there are few enough to be drawn one by one.
    pub fn as_dots(&self) -> bool {
        self.len() <= MOST_DOTS
    }

    /// For the script: names of the sets, what stands before and after the number of a trial in the command that
    /// replays it, and for each trial its number, impulse (N s), heading (degrees), a letter for each set's outcome
    /// (R, F, D, T) and each set's footsteps. Safe inside a `script` element.
    pub fn as_json(&self, commands: &[[String; 2]]) -> String {
        let round = |x: f64, digits: f64| (x * digits).round() / digits;
        let trials: Vec<Value> = self
            .iter()
            .map(|trial| {
                let first = &trial[0];
                let outcomes: String = trial.iter().map(|row| letter(row.outcome)).collect();
                let footsteps: Vec<u32> = trial.iter().map(|row| row.footsteps).collect();
                let (impulse, heading) = (round(first.impulse_n_s, 1e3), round(first.heading_deg, 1e1));
                json!([first.trial, impulse, heading, outcomes, footsteps])
            })
            .collect();
        json!({ "sets": self.sets, "commands": commands, "trials": trials }).to_string().replace('<', "\\u003c")
    }

    /// For each set, its recovered trials with 0, 1, 2 ... footsteps.
    pub fn footsteps(&self) -> Vec<[u64; FOOTSTEPS + 1]> {
        let mut counts = vec![[0; FOOTSTEPS + 1]; self.sets.len()];
        for trial in self.iter() {
            for (count, row) in counts.iter_mut().zip(trial).filter(|(_, row)| row.outcome == Outcome::Recovered) {
                count[(row.footsteps as usize).min(FOOTSTEPS)] += 1;
            }
        }
        counts
    }
}

fn letter(outcome: Outcome) -> char {
    match outcome {
        Outcome::Recovered => 'R',
        Outcome::Fell => 'F',
        Outcome::Diverged => 'D',
        Outcome::TimedOut => 'T',
    }
}
