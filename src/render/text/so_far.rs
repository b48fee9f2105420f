//! What a running campaign has found so far: lines above the progress bar of a terminal, and sentences for a log.

use crate::campaign::verdict::so_far::{PairSoFar, SoFar};
use crate::render::text::layout::{signed, wrapped};
use crate::stats::decision::PairVerdict;
use crate::stats::rate::SuccessCount;

/// Lines of the terminal that the progress bar and a message need.
const OTHER_LINES: usize = 3;
/// Columns that the line of a set, and that of a pair, need beside the names.
const NUMBERS: [usize; 2] = [34, 41];
/// Most sets that are named in a log.
const NAMED: usize = 4;

/// A line for each gain set and each pair, within the width and height of a terminal. If there are too many sets, only
/// those that recover most are shown. Empty if there is no room, or if no trial is finished.
pub fn lines(so_far: &SoFar, width: usize, height: usize) -> Vec<String> {
    let room = height.saturating_sub(OTHER_LINES);
    if room < 3 || so_far.trials == 0 {
        return Vec::new();
    }
    let (mut sets, mut pairs): (Vec<_>, Vec<_>) = (so_far.sets.iter().collect(), so_far.pairs.iter().collect());
    if 1 + sets.len() + pairs.len() > room {
        sets = by_rate(so_far);
        sets.truncate((room / 2).max(1));
        let is_shown = |name: &String| sets.iter().any(|(shown, _)| shown == name);
        pairs.retain(|pair| is_shown(&pair.a) && is_shown(&pair.b));
        pairs.truncate(room.saturating_sub(1 + sets.len()));
    }
    let [for_set, for_pair] = NUMBERS.map(|numbers| width.saturating_sub(numbers));
    let longest = sets.iter().map(|(name, _)| name.chars().count()).max().unwrap_or_default();
    let name_width = longest.min(for_set);
    let more = match so_far.sets.len() - sets.len() {
        0 => String::new(),
        more => format!("; {more} more sets recover less often"),
    };
    let title = format!("So far, after {} trials (not final){more}:", so_far.trials);
    let set = |(name, count): &&(String, SuccessCount)| {
        let SuccessCount { trials, recovered, success_rate, ci95 } = count;
        let [rate, least, most] = [*success_rate, ci95[0], ci95[1]].map(|share| 100.0 * share);
        let (name, of) = (tail(name, name_width), format!("{recovered}/{trials}"));
        format!(" {name:<name_width$} {of:>9} {rate:>4.0} % ({least:.0}-{most:.0} %)")
    };
    let told: Vec<(String, String)> = pairs.iter().map(|pair| (words(pair, for_pair / 2), difference(pair))).collect();
    let words_width = told.iter().map(|(words, _)| words.chars().count()).max().unwrap_or_default();
    let pair = |(words, difference): &(String, String)| format!(" {words:<words_width$} {difference}");
    let lines = std::iter::once(title).chain(sets.iter().map(set)).chain(told.iter().map(pair));
    lines.map(|line| line.chars().take(width).collect()).collect()
}

/// The same in a sentence or two, for a log. Empty if no trial is finished.
pub fn sentence(so_far: &SoFar) -> String {
    if so_far.trials == 0 {
        return String::new();
    }
    let rate = |(name, count): &&(String, SuccessCount)| {
        let [rate, least, most] = [count.success_rate, count.ci95[0], count.ci95[1]].map(|share| 100.0 * share);
        format!("{name} {rate:.0} % ({least:.0}-{most:.0})")
    };
    let mut sets: Vec<String> = by_rate(so_far).iter().take(NAMED).map(rate).collect();
    if so_far.sets.len() > NAMED {
        sets.push(format!("{} more less often", so_far.sets.len() - NAMED));
    }
    let decided = so_far.pairs.iter().filter(|pair| pair.verdict != PairVerdict::Open).count();
    let told = match (so_far.pairs.len(), decided) {
        (0, _) => String::new(),
        (_, 0) => "; no two can be told apart yet".into(),
        (pairs, decided) => format!("; {decided} of {pairs} pairs can be told apart"),
    };
    let text = format!("after {} trials, not final: {}{told}", so_far.trials, sets.join(", "));
    wrapped("  ", &text).trim_end().into()
}

/// The sets, those that recover most first.
fn by_rate(so_far: &SoFar) -> Vec<&(String, SuccessCount)> {
    let mut sets: Vec<_> = so_far.sets.iter().collect();
    sets.sort_by(|(_, a), (_, b)| b.success_rate.total_cmp(&a.success_rate));
    sets
}

/// Which of two sets is better, with names of at most `most` letters.
fn words(pair: &PairSoFar, most: usize) -> String {
    let [a, b] = [&pair.a, &pair.b].map(|name| tail(name, most.max(4)));
    match pair.verdict {
        PairVerdict::Better => format!("{a} better than {b}"),
        PairVerdict::Same => format!("{a} and {b} the same"),
        PairVerdict::Open => format!("{a} and {b} open"),
    }
}

/// By how much the first set recovers more often.
fn difference(pair: &PairSoFar) -> String {
    let [seen, least, most] = [pair.difference, pair.ci95[0], pair.ci95[1]].map(|share| signed(100.0 * share, 0));
    format!("{seen} points ({least} to {most})")
}

/// The end of a name, in at most `most` letters, since the names of variants differ at their ends.
fn tail(name: &str, most: usize) -> String {
    match name.chars().count() {
        letters if letters <= most => name.into(),
        letters => format!("…{}", name.chars().skip(letters + 1 - most.max(1)).collect::<String>()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::so_far::tests::so_far;

    const NAMES: [&str; 4] = ["hold", "switching", "paper", "catch"];

    #[test]
    fn a_line_for_each_set_and_each_pair_of_them() {
        let found = so_far(4, 600, |set| NAMES[set].into());
        let text = lines(&found, 60, 24).join("\n");
        assert!(text.starts_with("So far, after 600 trials (not final):\n hold        300/600   50 % ("), "{text}");
        assert_eq!(text.lines().count(), 1 + 4 + 6, "{text}");
        let pair = text.lines().find(|line| line.starts_with(" catch better than hold ")).expect(&text);
        assert!(pair.contains(" +30 points (+"), "{pair}");
        assert!(text.contains(" catch and paper open "), "{text}");
        assert!(lines(&so_far(4, 0, |set| NAMES[set].into()), 60, 24).is_empty());
    }

    #[test]
    fn it_keeps_within_a_terminal() {
        for (sets, width, height) in [(4, 60, 24), (4, 60, 8), (4, 100, 5), (30, 60, 24), (30, 80, 10), (2, 40, 3)] {
            let found = so_far(sets, 100_000, |set| format!("switching zmp_margin=0.0{set}"));
            let text = lines(&found, width, height);
            assert!(text.len() < height, "{height}: {text:?}");
            assert!(text.iter().all(|line| line.chars().count() <= width), "{width}: {text:#?}");
            // Those that recover most, by the end of their names.
            assert!(height < 6 || text.iter().any(|line| line.contains(&format!("0{} ", sets - 1))), "{text:#?}");
        }
    }

    #[test]
    fn a_log_has_the_same_in_a_sentence() {
        let text = sentence(&so_far(4, 600, |set| NAMES[set].into())).replace("\n  ", " ");
        assert!(text.starts_with("  after 600 trials, not final: catch 80 % ("), "{text}");
        assert!(text.ends_with("; 4 of 6 pairs can be told apart"), "{text}");
        assert_eq!(sentence(&so_far(2, 0, |set| NAMES[set].into())), "");
        let few = sentence(&so_far(2, 6, |set| NAMES[set].into())).replace("\n  ", " ");
        assert!(few.ends_with("; no two can be told apart yet"), "{few}");
        let many = sentence(&so_far(30, 100, |set| set.to_string())).replace("\n  ", " ");
        assert!(many.contains(", 26 more less often; "), "{many}");
    }
}
