//! The trials of a campaign in the form that the page needs: one push, and the outcome with each controller.

use serde_json::json;
use standfast_sim::episode::Outcome;
use standfast_study::verdict::trial_columns::TrialColumns;

/// Largest number of trials that are drawn one by one.
const MOST_DOTS: usize = 2000;

/// The trials of a result, and their forms for the page.
pub(super) struct Trials<'a>(pub &'a TrialColumns);

impl Trials<'_> {
    pub fn len(&self) -> usize {
        self.0.drawn.trials()
    }

    /// Whether there are few enough trials to draw them one by one.
    pub fn as_dots(&self) -> bool {
        self.len() <= MOST_DOTS
    }

    /// The data of the page's script: names of the controllers, the parts of the replay command before and after the
    /// number of a trial, and for each trial its number, impulse (N s), heading (degrees), a letter for each
    /// controller's outcome (R, F, D, T, or - if the controller had been stopped before) and each controller's number
    /// of footsteps. The text is safe inside a `script` element.
    pub fn as_json(&self, commands: &[[String; 2]]) -> String {
        let round = |x: f64, digits: f64| (x * digits).round() / digits;
        let Self(rows) = self;
        let mut trials = Vec::new();
        for trial in 0..self.len() {
            let (mut outcomes, mut footsteps) = (String::new(), Vec::new());
            for controller in 0..rows.names.len() {
                let ended = rows.of(controller).get(trial);
                outcomes.push(ended.map_or('-', |ended| letter(ended.outcome)));
                footsteps.push(ended.map_or(0, |ended| ended.footsteps));
            }
            let (impulse, heading) = (
                round(rows.impulse_n_s(trial), 1e3),
                round(rows.heading_deg(trial), 1e1),
            );
            trials.push(json!([trial, impulse, heading, outcomes, footsteps]));
        }
        json!({ "sets": rows.names, "commands": commands, "trials": trials })
            .to_string()
            .replace('<', "\\u003c")
    }
}

fn letter(outcome: Outcome) -> char {
    match outcome {
        Outcome::Recovered => 'R',
        Outcome::Survived => 'S',
        Outcome::Fell => 'F',
        Outcome::Broke => 'B',
        Outcome::Diverged => 'D',
        Outcome::Failed => 'E',
        Outcome::TimedOut => 'T',
    }
}
