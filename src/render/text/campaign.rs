//! The result of a campaign as text for the terminal.

use super::{agreement, comparison};
use crate::campaign::Summary;
use crate::campaign::ask::bounds::digits;
use crate::campaign::ask::variations;
use crate::campaign::verdict::failures::Failures;
use crate::campaign::verdict::pairs::Pair;
use crate::campaign::verdict::prediction::{MarginBin, Prediction};
use crate::campaign::verdict::set_summary::{FittedCurve, SetSummary};
use crate::episode::Judge;
use crate::render::replay_command;
use crate::render::text::layout::{align, compared, percent, table, unit_of_impulses, whole_names, wrapped};
use crate::stats::rate::SuccessCount;
use comfy_table::Table;
use std::fmt::Write;
use std::path::Path;

/// Number of causes of falls that have a row of their own; all others are summed up.
const CAUSES: usize = 5;

/// With more sets than this, the sets are the rows of tables, not the columns.
const FEW: usize = 4;

/// What counts as recovered and as a fall, in words (three lines of 80 columns).
pub fn thresholds(judge: &Judge) -> String {
    let Judge { standing_tilt_deg, standing_com_speed_m_s, standing_time_s, .. } = judge;
    let Judge { fallen_tilt_deg, fallen_com_height_ratio, .. } = judge;
    let [standing_com_speed_m_s, standing_time_s] = [standing_com_speed_m_s, standing_time_s].map(|v| digits(*v));
    let recovered = format!(
        "tilt under {standing_tilt_deg} deg, COM under {standing_com_speed_m_s} m/s, DCM in the support, for \
         {standing_time_s} s"
    );
    let fell = format!(
        "a link at the ground other than the soles, tilt over {fallen_tilt_deg} deg, or COM under \
         {fallen_com_height_ratio} of its height at home"
    );
    wrapped("recovered: ", &recovered) + &wrapped("fell:      ", &fell)
}

/// The result of a campaign: its settings, how often each gain set recovered, which is better, and the gates. `full`
/// adds the tables behind that. `folder` is the result folder, for the command that replays a trial.
pub fn campaign(summary: &Summary, folder: &Path, full: bool) -> String {
    let mut text = head(summary, full);
    text += "\n";
    for warning in &summary.warnings {
        text += &wrapped("warning: ", warning);
    }
    text += if summary.warnings.is_empty() { "" } else { "\n" };
    let _ = writeln!(text, "{}", sets(summary));
    text += &summary.stopped.as_ref().map_or(String::new(), |stopped| wrapped(" ", stopped));
    text += "\n";
    text += &wrapped("", &summary.headline);
    text += &comparison::verdicts(summary);
    if full {
        text += &comparison::pairs(summary);
    }
    text += &comparison::gates(summary);
    if full {
        let _ = write!(text, "\n{}\n", by_impulse(summary));
        text += &by_heading(summary);
        let _ = write!(text, "\n{}\n{}", limits(summary), wrapped(" ", LIMITS_EXPLAINED));
        text += &failures(summary);
        text += &falls(summary);
        text += &stepped(summary);
        text += &foretold(summary);
    }
    text += &summary.agreement.as_ref().map_or(String::new(), |agreement| agreement::text(agreement, full));
    text += &replay(summary, folder);
    if full {
        let _ = write!(text, "\n{}", wrapped("", &format!("Intervals: {}", summary.interval)));
    }
    text
}

/// The settings of the campaign; all of them if `full`.
fn head(summary: &Summary, full: bool) -> String {
    let push = &summary.push;
    let most = match summary.most_trials > summary.trials {
        true => format!(" (of {} at most)", summary.most_trials),
        false => String::new(),
    };
    let Summary { name, trials, seed, .. } = summary;
    let trials = match summary.stopped {
        None => format!("{trials} trials{most}, the same for each gain set"),
        Some(_) => format!("up to {trials} trials{most} for each gain set"),
    };
    let mut asked = format!("{name}: {trials}; robot {}, seed {seed}", summary.robot);
    let unit = unit_of_impulses(summary.units.impulse_n_s());
    let mut pushed = format!("impulse {} N s ({unit}), heading {} deg", push.impulse_n_s, push.heading_deg);
    let varied = variations::described(&summary.variations);
    let mut head = Vec::new();
    if full {
        let hash = &summary.config_hash[..summary.config_hash.len().min(12)];
        asked += &format!(", configuration {hash}");
        pushed += &format!(
            ", height {} m above the COM, duration {} s, start {} s, {}",
            push.height_m,
            push.duration_s,
            push.start_s,
            crate::campaign::store::row::as_text(&push.profile)
        );
    }
    head.extend([("campaign ", asked), ("engine: ", summary.engine.clone()), ("push:   ", pushed)]);
    if summary.second_push.is_any() {
        head.push(("then:   ", summary.second_push.to_string()));
    }
    if !varied.is_empty() {
        // The short text has only the names of the varied quantities.
        let names = varied.iter().map(|varied| if full { varied } else { varied.split(' ').next().unwrap_or(varied) });
        head.push(("varied: ", names.collect::<Vec<_>>().join(", ")));
    }
    if full {
        let (sensors, horizon_s) = (&summary.sensors, digits(summary.episode.horizon_s));
        let told = format!("noise x {}, bias x {}; horizon {horizon_s} s", sensors.noise_scale, sensors.bias_scale);
        head.push(("sensors: ", told));
    }
    let text: String = head.iter().map(|(mark, words)| wrapped(mark, words)).collect();
    if full { text + &thresholds(&summary.episode.judge) } else { text }
}

/// How often each gain set recovered.
fn sets(summary: &Summary) -> Table {
    // An outcome that no set had gets no column.
    type Outcome = (&'static str, fn(&SetSummary) -> u64);
    let rare: [Outcome; 2] = [("diverged", |set| set.diverged), ("timed out", |set| set.timed_out)];
    let rare: Vec<_> = rare.into_iter().filter(|(_, of)| summary.sets.iter().any(|set| of(set) > 0)).collect();
    let header = ["gain set", "recovered", "rate", "95 %", "fell"];
    let mut table = table(header.into_iter().chain(rare.iter().map(|(label, _)| *label)));
    for set in &summary.sets {
        let SuccessCount { trials, recovered, success_rate, ci95: [low, high] } = set.count;
        let cells = [
            set.name.clone(),
            format!("{recovered}/{trials}"),
            percent(success_rate),
            format!("{:.1}-{}", 100.0 * low, percent(high)),
            set.fell.to_string(),
        ];
        table.add_row(cells.into_iter().chain(rare.iter().map(|(_, of)| of(set).to_string())));
    }
    align(table)
}

fn by_impulse(summary: &Summary) -> Table {
    let names = std::iter::once("pushes").chain(names(summary));
    let bins = summary.sets.first().map_or(0, |set| set.by_impulse.len());
    let row = |bin: usize| {
        // The bins of all sets are the same.
        let first = &summary.sets[0].by_impulse[bin];
        let counts = || summary.sets.iter().map(|set| set.by_impulse[bin].count);
        let rate = |count| own_rate(summary, count, if many(summary) { 0 } else { 1 });
        let cells = std::iter::once(most_trials(counts())).chain(counts().map(rate));
        let to = if many(summary) { "-" } else { " to " };
        // Edges are sums of widths, with rounding errors.
        let short = |edge: f64| (1e3 * edge).round() / 1e3;
        (format!("{}{to}{}", short(first.from_n_s), short(first.to_n_s)), cells.collect())
    };
    compared("impulse [N s]", names, (0..bins).map(row).collect(), many(summary))
}

/// A rate in percent; where gain sets have different numbers of trials, with its own.
fn own_rate(summary: &Summary, count: SuccessCount, digits: usize) -> String {
    let rate = format!("{:.digits$} %", 100.0 * count.success_rate);
    match (&summary.stopped, count.trials) {
        (None, _) => rate,
        (Some(_), 0) => "-".into(),
        (Some(_), trials) => format!("{rate} of {trials}"),
    }
}

/// A row of a table of counts: how many trials they are of, where gain sets have different numbers of them.
fn own_trials(summary: &Summary) -> Option<(String, Vec<String>)> {
    let trials = || summary.sets.iter().map(|set| set.count.trials.to_string()).collect();
    summary.stopped.is_some().then(|| ("trials".into(), trials()))
}

/// The number of trials of the set that has most.
fn most_trials(counts: impl Iterator<Item = SuccessCount>) -> String {
    counts.map(|count| count.trials).max().unwrap_or(0).to_string()
}

fn names(summary: &Summary) -> impl Iterator<Item = &str> {
    summary.sets.iter().map(|set| set.name.as_str())
}

fn many(summary: &Summary) -> bool {
    summary.sets.len() > FEW
}

/// The causes of the falls of each set; empty if none fell.
fn falls(summary: &Summary) -> String {
    let mut causes: Vec<(&str, u64)> = Vec::new();
    for fall in summary.sets.iter().flat_map(|set| &set.fall_causes) {
        match causes.iter_mut().find(|(cause, _)| *cause == fall.cause) {
            Some((_, trials)) => *trials += fall.trials,
            None => causes.push((&fall.cause, fall.trials)),
        }
    }
    if causes.is_empty() {
        return String::new();
    }
    causes.sort_by_key(|&(_, trials)| std::cmp::Reverse(trials));
    causes.truncate(CAUSES);
    let named = |cause: &str| causes.iter().any(|&(known, _)| known == cause);
    let sum = |set: &SetSummary, of: &dyn Fn(&str) -> bool| -> u64 {
        set.fall_causes.iter().filter(|fall| of(&fall.cause)).map(|fall| fall.trials).sum()
    };
    let row = |label: &str, of: &dyn Fn(&str) -> bool| {
        // In a narrow column, a name with spaces can be wrapped.
        let label = if many(summary) { label.replace('_', " ") } else { label.into() };
        (label, summary.sets.iter().map(|set| sum(set, of).to_string()).collect())
    };
    let mut rows: Vec<_> = causes.iter().map(|&(cause, _)| row(cause, &|c| c == cause)).collect();
    let others = |c: &str| !named(c);
    if summary.sets.iter().any(|set| sum(set, &others) > 0) {
        rows.push(row("others", &others));
    }
    rows.splice(..0, own_trials(summary));
    format!("\n{}\n", compared("cause of the fall", names(summary), rows, many(summary)))
}

fn by_heading(summary: &Summary) -> String {
    let of_heading = |set: &SetSummary| set.strata.iter().filter(|s| s.by == "heading").cloned().collect::<Vec<_>>();
    let strata: Vec<_> = summary.sets.iter().map(of_heading).collect();
    let Some(first) = strata.first().filter(|first| !first.is_empty()) else { return String::new() };
    let row = |i: usize| {
        let counts = || strata.iter().map(|set| set[i].count);
        let all = std::iter::once(most_trials(counts())).chain(counts().map(|count| own_rate(summary, count, 1)));
        let all = all.collect();
        (first[i].label.clone(), all)
    };
    let names = std::iter::once("pushes").chain(names(summary));
    format!("\n{}\n", compared("heading", names, (0..first.len()).map(row).collect(), many(summary)))
}

/// The impulses of which 50 % and 90 % are survived.
fn limits(summary: &Summary) -> Table {
    let mut table = table(["gain set", "50 % [N s]", "90 % [N s]", "50 % [m w d]"]);
    for set in &summary.sets {
        let (curve, normalized) = (&set.curve, &set.normalized_curve);
        let levels = [impulse_at(curve, true), impulse_at(curve, false), impulse_at(normalized, true)];
        table.add_row(std::iter::once(set.name.clone()).chain(levels));
    }
    whole_names(align(table))
}

const LIMITS_EXPLAINED: &str = "Impulses at which 50 % and 90 % of the pushes are survived, with 95 % intervals, by a \
                                logistic curve fitted over all headings. m w d is mass times omega times the distance \
                                from the COM to the edge of the support: the most that a pendulum takes without a \
                                footstep of a push that has no duration.";

/// The impulse (N s, or over m omega d) at which 50 % of the pushes are survived (`half`), or else 90 %, with its
/// interval. If there is none, the reason.
pub fn impulse_at(curve: &FittedCurve, half: bool) -> String {
    let Some(fit) = &curve.fit else {
        return curve.none_because.map_or("-".into(), |why| why.to_string());
    };
    let (level, why) = if half { (fit.impulse50, fit.no_impulse50) } else { (fit.impulse90, fit.no_impulse90) };
    match (level, why) {
        (Some(level), _) => {
            let [least, most] = level.ci95.map(|end| end.map_or("?".into(), |x| format!("{x:.2}")));
            format!("{:.2} ({least}-{most})", level.at)
        }
        (None, why) => why.map_or("-".into(), |why| why.to_string()),
    }
}

/// How the trials of each set were lost; empty if none was.
fn failures(summary: &Summary) -> String {
    type Pick = fn(&Failures) -> u64;
    let kinds: [(&str, Pick); 9] = [
        ("fell without a footstep", |f| f.fell_before_any_footstep),
        ("fell with a foot in the air", |f| f.fell_in_swing),
        ("fell after a landing", |f| f.fell_after_landing),
        ("not standing at the end", |f| f.timed_out),
        ("diverged", |f| f.diverged),
        ("  falls: slipped", |f| f.fell_slipped),
        ("  falls: torque at its limit", |f| f.fell_torque_limited),
        ("  falls: legs met", |f| f.fell_legs_met),
        ("  falls: none of these", |f| f.fell_otherwise),
    ];
    let any = |pick: &Pick| summary.sets.iter().any(|set| pick(&set.failures) > 0);
    let row = |(label, pick): (&str, Pick)| {
        (label.to_string(), summary.sets.iter().map(|set| pick(&set.failures).to_string()).collect())
    };
    let mut rows: Vec<_> = kinds.into_iter().filter(|(_, pick)| any(pick)).map(row).collect();
    if rows.is_empty() {
        String::new()
    } else {
        rows.splice(..0, own_trials(summary));
        format!("\n{}\n", compared("lost", names(summary), rows, many(summary)))
    }
}

/// Recovered trials by number of footsteps; empty if no gain set took any.
fn stepped(summary: &Summary) -> String {
    let steppers = || summary.sets.iter().filter_map(|set| Some((set, set.stepped.as_ref()?)));
    if steppers().next().is_none() {
        return String::new();
    }
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    for (i, label) in ["none", "one", "two", "three or more"].into_iter().enumerate() {
        rows.push((label.into(), steppers().map(|(_, stepped)| rate_of(&stepped.by_footsteps[i])).collect()));
    }
    let names = steppers().map(|(set, _)| set.name.as_str());
    format!("\n{}\n", compared("recovered, by footsteps", names, rows, many(summary)))
}

/// Number of recovered trials of all, and the rate.
fn rate_of(count: &SuccessCount) -> String {
    match count.trials {
        0 => "-".into(),
        trials => format!("{}/{trials} {:>7}", count.recovered, percent(count.success_rate)),
    }
}

/// How well the CPI sets predict the outcome; empty if no gain set has CPI sets.
fn foretold(summary: &Summary) -> String {
    let with_sets = || summary.sets.iter().filter_map(|set| Some((set, set.foretold.as_ref()?)));
    if with_sets().next().is_none() {
        return String::new();
    }
    type Pick = fn(&Prediction) -> &SuccessCount;
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    for (label, pick) in [("holds the state", (|f| &f.inside) as Pick), ("does not", |f| &f.outside)] {
        rows.push((label.into(), with_sets().map(|(_, f)| rate_of(pick(f))).collect()));
    }
    let names = with_sets().map(|(set, _)| set.name.as_str());
    let corner = "slowest CPI set after the push";
    if many(summary) {
        rows.push(("as foretold".into(), with_sets().map(|(_, f)| percent(f.agreement)).collect()));
        rows.push(("by the estimate".into(), with_sets().map(|(_, f)| percent(f.agreement_est)).collect()));
        let notes = "First how many recovered of the trials in which the set holds the true state at the end of the push, \
                     and of those in which it does not. Then the share of trials that end as the set says, by the true \
                     state and by the one estimated then. Rates by margin are in summary.json.";
        return format!("\n{}\n{}", compared(corner, names, rows, true), wrapped(" ", notes));
    }
    let mut bins: Vec<&MarginBin> = Vec::new();
    for bin in with_sets().flat_map(|(_, f)| &f.by_margin) {
        if !bins.iter().any(|known| known.from == bin.from) {
            bins.push(bin);
        }
    }
    bins.sort_by(|a, b| a.from.unwrap_or(f64::NEG_INFINITY).total_cmp(&b.from.unwrap_or(f64::NEG_INFINITY)));
    for MarginBin { from, to, .. } in bins {
        let label = match (from, to) {
            (Some(from), Some(to)) => format!("  margin {from} to {to}"),
            (Some(from), None) => format!("  margin over {from}"),
            (None, to) => format!("  margin under {}", to.unwrap_or(f64::INFINITY)),
        };
        let cell =
            |f: &Prediction| f.by_margin.iter().find(|bin| bin.from == *from).map_or("-".into(), |b| rate_of(&b.count));
        rows.push((label, with_sets().map(|(_, f)| cell(f)).collect()));
    }
    let agreement = |(set, f): (&SetSummary, &Prediction)| {
        format!("{} {} ({})", set.name, percent(f.agreement), percent(f.agreement_est))
    };
    let agreement = with_sets().map(agreement).collect::<Vec<_>>().join(", ");
    let notes = format!(
        "How many trials recovered: of those in which the set holds the true state at the end of the push, and of those in \
         which it does not. The margin is 1 at rest and 0 at the border of the set. Share of the trials that ended as the \
         set says, by the true state and (in brackets) by the state estimated then: {agreement}."
    );
    format!("\n{}\n{}", compared(corner, names, rows, false), wrapped(" ", &notes))
}

/// The command that replays a trial in which two sets end differently, or else one that was lost.
fn replay(summary: &Summary, folder: &Path) -> String {
    let differ = |pair: &Pair| {
        let lost =
            |trials: &[u64], by: &str| Some((*trials.first()?, by.to_string(), "in which two sets end differently"));
        lost(&pair.first_only_a, &pair.b).or_else(|| lost(&pair.first_only_b, &pair.a))
    };
    // The telling trials of a set begin with those that it lost.
    let lost = |set: &SetSummary| {
        let first = set.telling.first().filter(|_| set.count.recovered < set.count.trials)?;
        Some((first.trial, set.name.clone(), "that was lost"))
    };
    let found = summary.pairs.iter().find_map(differ).or_else(|| summary.sets.iter().find_map(lost));
    let Some((trial, set, which)) = found else { return String::new() };
    let what = format!("to replay a trial {which} (report.html has more):");
    // The command has a line of its own, however long, so that it can be copied.
    format!("\n{} {}\n", wrapped("", &what), replay_command(summary, &set, trial, folder))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::summary::tests::{ragged, summary};
    use crate::episode::Outcome::{Diverged, Fell, Recovered, TimedOut};

    #[test]
    fn rates_over_different_trials_are_told_with_their_number() {
        let (summary, _) = ragged(&[]);
        let text = campaign(&summary, Path::new("out"), true);
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("campaign smoke: up to 100 trials (of 200 at most) for each gain set; robot"), "{text}");
        for told in [" 5/25 ", "b after 25 trials. Each rate", "% of 13 ", " trials 100 25 100 "] {
            assert!(words.contains(told), "{told} in {text}");
        }
        let row = text.lines().find(|line| line.starts_with(" 2.5 to 2.75 ")).unwrap();
        assert!(row.contains("% of 13") && row.split_whitespace().any(|cell| cell == "-"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }

    /// The short text has the settings, rates, verdicts and gates; the full one adds everything else.
    #[test]
    fn the_short_text_has_the_verdicts_and_the_full_one_all_tables() {
        let summary = summary(&[[Recovered, Fell]; 30], &["variations.mass_scale=1.1"], &["a >= 0.1"]);
        let [short, full] = [false, true].map(|full| campaign(&summary, Path::new("out"), full));
        for words in ["campaign smoke: 30 trials", "gain set", "30/30", "a is better than b", "a >= 0.1", "--gains b"] {
            assert!(short.contains(words) && full.contains(words), "{words} in {short} {full}");
        }
        for words in ["impulse [N s]", "50 % [N s]", "only a", "fell:  ", "Wilson", "mass_scale 1.1"] {
            assert!(!short.contains(words) && full.contains(words), "{words} in {short} {full}");
        }
        assert!(short.contains("varied: mass_scale\n") && short.lines().count() < 28, "{short}");
    }

    #[test]
    fn an_outcome_of_no_set_has_no_column() {
        let heads = |outcomes| {
            let text = campaign(&summary(&[outcomes; 3], &[], &[]), Path::new("out"), false);
            ["diverged", "timed out"].map(|head| text.contains(head))
        };
        assert_eq!(heads([Recovered, Fell]), [false, false]);
        assert_eq!(heads([TimedOut, Fell]), [false, true]);
        assert_eq!(heads([Recovered, Diverged]), [true, false]);
    }

    #[test]
    fn the_trial_to_replay_is_described() {
        let text = |outcomes| replay(&summary(&[outcomes; 3], &[], &[]), Path::new("out"));
        assert!(text([Recovered, Fell]).contains("to replay a trial in which two sets end differently (report"));
        assert!(text([Recovered, Fell]).ends_with("--campaign out/campaign.toml --trial 0 --gains b\n"));
        assert!(text([Fell, Fell]).contains("to replay a trial that was lost (report"));
        assert_eq!(text([Recovered, Recovered]), "");
    }
}
