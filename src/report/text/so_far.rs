//! The findings of a running campaign, in a sentence or two: above the progress bar of a terminal, and in a log.

use standfast_stats::decision::PairVerdict;
use standfast_study::verdict::so_far::SoFar;

/// Largest number of controllers that are named.
const NAMED: usize = 4;

/// The sentences. The text is empty if no trial is finished.
pub fn sentence(so_far: &SoFar) -> String {
    if so_far.trials == 0 {
        return String::new();
    }
    let mut by_rate: Vec<_> = so_far.controllers.iter().collect();
    by_rate.sort_by(|(_, a), (_, b)| b.success_rate.total_cmp(&a.success_rate));
    let mut controllers = Vec::new();
    for (name, count) in by_rate.into_iter().take(NAMED) {
        let [rate, least, most] =
            [count.success_rate, count.ci95[0], count.ci95[1]].map(|share| 100.0 * share);
        controllers.push(format!("{name} {rate:.0} % ({least:.0}-{most:.0})"));
    }
    if so_far.controllers.len() > NAMED {
        controllers.push(format!(
            "{} more less often",
            so_far.controllers.len() - NAMED
        ));
    }
    let decided = so_far
        .pairs
        .iter()
        .filter(|pair| pair.verdict != PairVerdict::Open)
        .count();
    let apart = match (so_far.pairs.len(), decided) {
        (0, _) => String::new(),
        (_, 0) => "; no two can be told apart yet".into(),
        (pairs, decided) => format!("; {decided} of {pairs} pairs can be told apart"),
    };
    format!(
        "after {} trials, not final: {}{apart}",
        so_far.trials,
        controllers.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::so_far;

    const NAMES: [&str; 4] = ["hold", "switching", "paper", "catch"];

    #[test]
    fn the_controllers_that_recover_most_are_named_and_pairs_are_counted() {
        let text = sentence(&so_far(4, 600, |controller| NAMES[controller].into()));
        assert!(
            text.starts_with("after 600 trials, not final: catch 80 % ("),
            "{text}"
        );
        assert!(text.ends_with("; 4 of 6 pairs can be told apart"), "{text}");
        assert_eq!(
            sentence(&so_far(2, 0, |controller| NAMES[controller].into())),
            ""
        );
        let few = sentence(&so_far(2, 6, |controller| NAMES[controller].into()));
        assert!(few.ends_with("; no two can be told apart yet"), "{few}");
        let many = sentence(&so_far(30, 100, |controller| controller.to_string()));
        assert!(many.contains(", 26 more less often; "), "{many}");
    }
}
