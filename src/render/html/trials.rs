//! The trials of a campaign in the form that the page needs: one push, and the outcome with each gain set.

use crate::campaign::TrialRow;
use crate::campaign::store::row::by_trial;
use crate::episode::Outcome;
use serde_json::{Value, json};

/// With more trials than this, no trial is drawn by itself.
const MOST_DOTS: usize = 2000;
/// Numbers of footsteps from this one on are counted together.
const FOOTSTEPS: usize = 4;

/// All rows of a campaign, sorted by trial, then by set.
pub(super) struct Trials<'a> {
    pub sets: &'a [&'a str],
    pub rows: &'a [TrialRow],
}

impl<'a> Trials<'a> {
    pub fn iter(&self) -> impl Iterator<Item = &'a [TrialRow]> {
        by_trial(self.rows, self.sets.len())
    }

    /// Number of trials.
    pub fn len(&self) -> usize {
        self.iter().count()
    }

    /// Whether there are few enough trials to draw each by itself.
    pub fn as_dots(&self) -> bool {
        self.len() <= MOST_DOTS
    }

    /// The data of the page's script: names of the sets, the parts of the replay command before and after the number of
    /// a trial, and for each trial its number, impulse (N s), heading (degrees), a letter for each set's outcome (R, F,
    /// D, T) and each set's number of footsteps. The text is safe inside a `script` element.
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

    /// For each set, the number of its recovered trials with 0, 1, 2 ... footsteps.
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
