//! `summary.md`: the result as a CI service shows it on the page of a job.

use crate::campaign::Summary;
use crate::campaign::gate::Status;
use crate::campaign::gates::GateResult;
use crate::campaign::paired::Pair;
use crate::report::comparison::{gate_words, p_cell, status};
use crate::report::layout::{percent, seconds};
use crate::report::replay_command;
use std::fmt::Write;
use std::path::Path;

/// What GitHub takes is 1 MiB; more than these rows nobody reads.
const MOST_ROWS: usize = 100;

/// Verdicts and gates first, then the numbers behind them. Commands are to be run in the result folder.
pub fn text(summary: &Summary) -> String {
    let mut text = format!("## standfast: {}\n\n", escaped(&summary.name));
    for warning in &summary.warnings {
        let _ = writeln!(text, "> **Note** {}\n", escaped(warning));
    }
    for pair in summary.pairs.iter().take(MOST_ROWS) {
        let _ = writeln!(text, "- {}", escaped(&pair.words));
    }
    text += &gates(summary);
    text += "\n| gain set | recovered | rate | 95 % | 50 % impulse | settles (median) |\n|---|--:|--:|--:|--:|--:|\n";
    for set in summary.sets.iter().take(MOST_ROWS) {
        let [low, high] = set.count.ci95.map(|share| 100.0 * share);
        let _ = writeln!(
            text,
            "| {} | {}/{} | {} | {low:.1} to {high:.1} % | {} | {} |",
            escaped(&set.name),
            set.count.recovered,
            set.count.trials,
            percent(set.count.success_rate),
            super::table::impulse_at(&set.curve, true),
            seconds(set.times.median_settling_s),
        );
    }
    text += &pairs(&summary.pairs);
    let push = &summary.push;
    let _ = writeln!(
        text,
        "\n{} pushes of {} N s, heading {} deg, the same for each gain set; robot {}, seed {}, standfast {}, \
         configuration `{}`. Intervals, {}. `report.html` has pictures, strata and trials to replay.",
        summary.trials,
        push.impulse_n_s,
        push.heading_deg,
        escaped(&summary.robot),
        summary.seed,
        summary.standfast,
        &summary.config_hash[..summary.config_hash.len().min(12)],
        summary.interval,
    );
    text
}

fn gates(summary: &Summary) -> String {
    if summary.gates.is_empty() {
        return String::new();
    }
    let mut text = String::from("\n| gate | | seen | interval | trials |\n|---|---|--:|--:|--:|\n");
    for GateResult { judged, .. } in summary.gates.iter().take(MOST_ROWS) {
        let [least, most] = judged.interval.map(|share| 100.0 * share);
        let _ = writeln!(
            text,
            "| `{}` | **{}** | {:.1} % | {least:.1} to {most:.1} % | {} |",
            judged.name.replace('|', "\\|"),
            status(judged.status),
            100.0 * judged.observed,
            judged.trials
        );
    }
    let told = summary.gates.iter().filter(|gate| gate.judged.status != Status::Passed);
    for gate in told.take(MOST_ROWS) {
        let _ = writeln!(text, "\n{}", escaped(&gate_words(gate)));
        if let Some(more) = gate.judged.more_trials {
            let _ = writeln!(text, "About {more} more trials would resolve it.");
        }
        if let Some(trial) = gate.lost_trial {
            let command = replay_command(summary, &gate.set, trial, Path::new(""));
            let _ = writeln!(text, "A trial that it lost, again:\n\n```sh\n{command}\n```");
        }
    }
    text
}

fn pairs(pairs: &[Pair]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n| a | b | both | only a | only b | neither | a - b (points) | 95 % | p |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for pair in pairs.iter().take(MOST_ROWS) {
        let [least, most] = pair.ci95.map(|share| 100.0 * share);
        let counts = pair.counts;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {:+.1} | {least:.1} to {most:.1} | {} |",
            escaped(&pair.a),
            escaped(&pair.b),
            counts.both,
            counts.only_a,
            counts.only_b,
            counts.neither,
            100.0 * pair.difference,
            p_cell(pair.holm_p),
        );
    }
    if pairs.len() > MOST_ROWS {
        let _ = writeln!(text, "\n{} pairs more are in `summary.json`.", pairs.len() - MOST_ROWS);
    }
    text
}

/// Without what Markdown or HTML would read as its own.
fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '#' | '~' => out.extend(['\\', c]),
            '\n' | '\r' => out.push(' '),
            _ => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::summary::tests::summary;
    use crate::episode::Outcome::{Fell, Recovered};

    #[test]
    fn verdicts_and_gates_come_first_and_names_are_text() {
        let outcomes: Vec<_> = (0..100).map(|i| [Recovered, if i < 50 { Recovered } else { Fell }]).collect();
        let mut summary = summary(&outcomes, &[], &["b >= 0.8"]);
        summary.name = "<b>|x|`_".into();
        let text = text(&summary);
        let place = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part} not in {text}"));
        assert!(place("- a is better than b by 50.0 points") < place("| `b >= 0.8` | **FAILED** |"));
        assert!(place("--trial 50 --gains b") < place("| a | b | 50 | 50 | 0 | 0 | +50.0 |"));
        assert!(text.starts_with("## standfast: &lt;b&gt;\\|x\\|\\`\\_"), "{text}");
    }

    #[test]
    fn a_service_takes_it_however_many_sets_there_are() {
        let mut summary = summary(&[[Recovered, Fell]], &[], &["b >= 0.8"]);
        summary.pairs = vec![summary.pairs[0].clone(); 10_000];
        summary.sets = vec![summary.sets[0].clone(); 10_000];
        assert!(text(&summary).len() < 100_000);
    }
}
