//! Gain sets against each other, and gates, as text.

use crate::campaign::Summary;
use crate::campaign::gate::Status;
use crate::campaign::gates::GateResult;
use crate::campaign::paired::{Pair, p_value};
use crate::campaign::ranks::Shift;
use crate::report::layout::{align, table, whole_names, wrapped};
use comfy_table::Table;
use std::fmt::Write;
use std::path::Path;

/// With more pairs than this, each set is compared with the first alone.
const FEW_PAIRS: usize = 6;

/// Verdicts in sentences, one for each pair; then the counts and intervals behind them.
pub(super) fn pairs(summary: &Summary) -> String {
    let shown = shown(summary);
    if shown.is_empty() {
        return String::new();
    }
    let mut text = String::from("\n");
    for pair in &shown {
        text += &wrapped(" - ", &pair.words);
    }
    let _ = writeln!(text, "\n{}", counts(&shown));
    let mut notes =
        String::from("a - b: rate of a less rate of b (points), above with its 95 % interval; p: exact McNemar test");
    notes += if summary.pairs.len() > 1 { ", adjusted for the count of pairs (Holm)" } else { "" };
    notes += if summary.stopping.until_resolved { "; the intervals hold at every look, p does not" } else { "" };
    notes +=
        if shown.len() < summary.pairs.len() { "; each set against the first, others in summary.json" } else { "" };
    text + &wrapped(" ", &notes)
}

fn shown(summary: &Summary) -> Vec<&Pair> {
    let first = summary.sets.first().map(|set| &set.name);
    let few = summary.pairs.len() <= FEW_PAIRS;
    summary.pairs.iter().filter(|pair| few || Some(&pair.a) == first || Some(&pair.b) == first).collect()
}

fn counts(pairs: &[&Pair]) -> Table {
    let mut table = table(["a", "b", "both", "only a", "only b", "neither", "a - b", "p"]);
    for pair in pairs {
        table.add_row([
            pair.a.clone(),
            pair.b.clone(),
            pair.counts.both.to_string(),
            pair.counts.only_a.to_string(),
            pair.counts.only_b.to_string(),
            pair.counts.neither.to_string(),
            signed(100.0 * pair.difference, 1),
            p_cell(pair.holm_p),
        ]);
    }
    whole_names(align(table))
}

/// A p-value without its name.
pub(super) fn p_cell(p: f64) -> String {
    p_value(p).trim_start_matches("p ").trim_start_matches("= ").into()
}

/// How much sooner, and with how many footsteps, over the trials that both sets of a pair recovered from.
pub(super) fn shifts(summary: &Summary) -> String {
    let shown: Vec<&Pair> = shown(summary).into_iter().filter(|pair| pair.settling_s.is_some()).collect();
    if shown.is_empty() {
        return String::new();
    }
    let mut table = table(["a", "b", "settles", "95 %", "p", "footsteps", "p"]);
    for pair in shown {
        let cells = |shift: &Option<Shift>, text: &dyn Fn(&Shift) -> String| match shift {
            Some(shift) => [text(shift), p_cell(shift.p)],
            None => ["-".into(), "-".into()],
        };
        let interval = pair.settling_s.and_then(|shift| shift.ci95).map_or("-".into(), |ends| {
            let [least, most] = ends.map(|s| signed(s, 2));
            format!("{least} to {most}")
        });
        let [settling, p] = cells(&pair.settling_s, &|shift| format!("{} s", signed(shift.median, 2)));
        let [footsteps, p_footsteps] = cells(&pair.footsteps, &|shift| signed(shift.mean, 2));
        table.add_row([pair.a.clone(), pair.b.clone(), settling, interval, p, footsteps, p_footsteps]);
    }
    let notes = "a less b, over the pushes that both survive: median of the differences of settling times (Hodges-Lehmann) \
                 with its 95 % interval, mean of those of footsteps; p: Wilcoxon's signed-rank test, not adjusted";
    format!("\n{}\n{}", whole_names(align(table)), wrapped(" ", notes))
}

/// A number with its sign; zero has none, however it was rounded.
fn signed(x: f64, digits: usize) -> String {
    let text = format!("{x:+.digits$}");
    if text.trim_start_matches(['+', '-', '0', '.']).is_empty() { text[1..].into() } else { text }
}

/// What became of each gate; empty without gates.
pub(super) fn gates(summary: &Summary) -> String {
    if summary.gates.is_empty() {
        return String::new();
    }
    let mut table = table(["gate", "", "seen", "interval", "trials", "more"]);
    for GateResult { judged, .. } in &summary.gates {
        let [least, most] = judged.interval.map(|share| format!("{:.1}", 100.0 * share));
        table.add_row([
            judged.name.clone(),
            status(judged.status).to_string(),
            format!("{:.1} %", 100.0 * judged.observed),
            format!("{least} to {most}"),
            judged.trials.to_string(),
            judged.more_trials.map_or("-".into(), |more| format!("about {more}")),
        ]);
    }
    let confidence = summary.gates.first().map_or(0.95, |gate| gate.judged.confidence);
    let level = format!("{:.6}", 100.0 * confidence);
    let level = level.trim_end_matches('0').trim_end_matches('.');
    let notes = format!("passes if its whole {level} % interval is at least what is asked, fails if none of it is");
    format!("\n{}\n{}", align(table), wrapped(" ", &notes))
}

pub(super) fn status(status: Status) -> &'static str {
    match status {
        Status::Passed => "passed",
        Status::Failed => "FAILED",
        Status::Unresolved => "unresolved",
    }
}

/// For every gate that did not pass, a sentence and the command that replays a trial that was lost. `folder` holds the
/// result.
pub fn failed_gates(summary: &Summary, folder: &Path) -> Vec<String> {
    let failed = summary.gates.iter().filter(|gate| gate.judged.status == Status::Failed);
    failed.map(|gate| format!("gate failed: {}{}", gate_words(gate), replay_line(summary, gate, folder))).collect()
}

/// What was seen, in words.
pub(super) fn gate_words(GateResult { judged, .. }: &GateResult) -> String {
    let [least, most] = judged.interval.map(|share| 100.0 * share);
    format!(
        "{}: {:.1} % seen, {least:.1} to {most:.1} % at {:.6} % confidence, {:.1} % asked, {} trials",
        judged.name,
        100.0 * judged.observed,
        100.0 * judged.confidence,
        100.0 * judged.required,
        judged.trials,
    )
    .replace(".000000 %", " %")
}

fn replay_line(summary: &Summary, gate: &GateResult, folder: &Path) -> String {
    let Some(trial) = gate.lost_trial else { return String::new() };
    format!("\n  a trial that it lost: {}", super::replay_command(summary, &gate.set, trial, folder))
}
