//! Says where each controller of a result stands among those of a packed baseline.

use crate::verdict::controller_summary::ControllerSummary;
use crate::verdict::listed::listed;
use crate::verdict::pairs::PairSummary;
use standfast_stats::decision::PairVerdict;

/// A sentence for each controller of `own`: its place by rate among those of `theirs` with which it is paired, and which
/// of them are better, worse or not told apart. `baseline` is their result.
pub(super) fn of(
    own: &[ControllerSummary],
    theirs: &[ControllerSummary],
    pairs: &[PairSummary],
    baseline: &str,
) -> String {
    let mut sentences = Vec::new();
    for controller in own {
        let name = controller.name.as_str();
        let (mut ahead, mut worse, mut better, mut open) = (1, Vec::new(), Vec::new(), Vec::new());
        for pair in pairs {
            // The first of a pair recovers more often.
            let (is_first, other) = match (pair.a == name, pair.b == name) {
                (true, _) => (true, pair.b.as_str()),
                (_, true) => (false, pair.a.as_str()),
                _ => continue,
            };
            if !theirs.iter().any(|their| their.name == other) {
                continue;
            }
            ahead += u32::from(!is_first && pair.difference > 0.0);
            match (pair.verdict == PairVerdict::Better, is_first) {
                (true, true) => worse.push(other),
                (true, false) => better.push(other),
                (false, _) => open.push(other),
            }
        }
        let count = worse.len() + better.len() + open.len();
        let told = [
            ("better than ", worse),
            ("worse than ", better),
            ("not told apart from ", open),
        ]
        .into_iter()
        .filter(|(_, others)| !others.is_empty())
        .map(|(how, others)| format!("{how}{}", listed(&others, "and")));
        let told: Vec<String> = told.collect();
        sentences.push(format!(
            "Among the {count} of {baseline}, {name} would be number {ahead} by its rate: {}.",
            told.join("; ")
        ));
    }
    sentences.join(" ")
}
