//! How far two engines agree, as text.

use crate::campaign::Summary;
use crate::campaign::verdict::agreement::{Agreement, PartedTrial};
use crate::episode::parting::{Loaded, Part, Parting};
use crate::render::text::layout::{align, compared, percent, table, whole_names, wrapped};
use crate::sim::Engine;
use crate::stats::kappa::Agreed;
use crate::stats::mcnemar::PairedCounts;

/// So many trials of each gain set are told where there is little room.
const FEW: usize = 3;
/// With more sets than this, the sets are the rows of tables, not the columns.
const MANY: usize = 4;

/// How far two engines agree, after what holds in one of them only; empty if the summary is not of two engines.
pub fn with_warnings(summary: &Summary, full: bool) -> String {
    let Some(agreement) = &summary.agreement else { return String::new() };
    let warnings: String = agreement.warnings().iter().map(|warning| wrapped("warning: ", warning)).collect();
    warnings + &text(agreement, full)
}

/// The tables of a result in two engines. `full` adds those by heading and impulse, and all trials that were traced.
pub(super) fn text(agreement: &Agreement, full: bool) -> String {
    let [a, b] = &agreement.versions;
    let mut text = "\n".to_string() + &wrapped("", &format!("{a} and {b}, trial by trial:"));
    let [a, b] = agreement.engines.map(|engine| format!("only {}", engine.title()));
    let mut counts = table(["gain set", "both", &a, &b, "neither", "agree", "kappa", "95 %"]);
    for set in &agreement.sets {
        counts.add_row([set.set.clone()].into_iter().chain(agreement_cells(&set.counts, &set.agreed)));
    }
    text += &format!("{}\n", whole_names(align(counts)));
    text += &wrapped(" ", ABOUT_AGREEMENT);
    if full {
        text += &by_stratum(agreement, "heading");
        text += &by_stratum(agreement, "impulse");
    }
    text + &where_they_part(agreement, full)
}

/// What the columns mean.
pub const ABOUT_AGREEMENT: &str = "A trial counts under both, one or neither of the engines in which the robot recovered. \
                               Agree is the share of trials with the same outcome in both. Cohen's kappa is that share \
                               beyond chance: 1 if the engines always agree, 0 if no more often than two that know \
                               nothing of each other. Its interval is at 95 %.";

/// Cells of a row: both, only a, only b, neither, the share of agreement, kappa, and its interval.
pub fn agreement_cells(counts: &PairedCounts, agreed: &Agreed) -> [String; 7] {
    let PairedCounts { both, only_a, only_b, neither } = counts;
    let [both, only_a, only_b, neither] = [both, only_a, only_b, neither].map(|count| count.to_string());
    let kappa = agreed.kappa.map_or("-".into(), |kappa| format!("{kappa:.2}"));
    let interval = agreed.kappa_ci95.map_or("-".into(), |[least, most]| {
        let to = if least < 0.0 { " to " } else { "-" };
        format!("{least:.2}{to}{most:.2}")
    });
    [both, only_a, only_b, neither, percent(agreed.agree), kappa, interval]
}

/// The share of agreement by kind of trial; empty if there are no such kinds.
fn by_stratum(agreement: &Agreement, by: &str) -> String {
    let Some(first) = agreement.sets.first() else { return String::new() };
    let row = |i: usize| {
        let shares = agreement.sets.iter().map(|set| percent(set.strata[i].agreed.agree));
        (first.strata[i].label.clone(), shares.collect())
    };
    let rows: Vec<_> = (0..first.strata.len()).filter(|&i| first.strata[i].by == by).map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let names = agreement.sets.iter().map(|set| set.set.as_str());
    format!("\n{}\n", compared(&format!("agree, by {by}"), names, rows, agreement.sets.len() > MANY))
}

/// The trials on which the engines disagree: those that were traced, or the first few of each gain set.
fn where_they_part(agreement: &Agreement, full: bool) -> String {
    let mut text = String::new();
    for set in &agreement.sets {
        let traced = set.parted.iter().filter(|of| of.traced).count();
        let told = if full { traced.max(FEW) } else { FEW };
        for of in set.parted.iter().take(told) {
            text += &wrapped(" - ", &format!("{}, {}", set.set, parted(agreement, of)));
        }
    }
    let all: usize = agreement.sets.iter().map(|set| set.parted.len()).sum();
    if all == 0 {
        return "\nThe engines agree on every trial.\n".into();
    }
    let head = format!("Where they part company (all {all} trials are in summary.json){}", about_traces(agreement));
    format!("\n{}{text}", wrapped("", &head))
}

/// What it means that traces part, as the end of a sentence.
pub fn about_traces(agreement: &Agreement) -> String {
    match agreement.part_beyond_m {
        Some(limit_m) => format!(
            ". Traces part when the COMs, or the soles of a foot, are horizontally more than {:.0} mm apart, which is half \
             the width of a sole.",
            1000.0 * limit_m
        ),
        None => ":".into(),
    }
}

/// A trial on which the engines disagree, in sentences.
fn parted(agreement: &Agreement, of: &PartedTrial) -> String {
    let [a, b] = agreement.engines.map(|engine| engine.title());
    let [in_a, in_b] = of.outcomes.map(|outcome| outcome.name());
    let push = format!("trial {}, {:.2} N s at {:.0} deg", of.trial, of.impulse_n_s, of.heading_deg);
    format!("{push}: {in_a} in {a}, {in_b} in {b}. {}", where_it_parts(agreement, of)).trim_end().into()
}

/// Where the traces of a trial part, in sentences; empty if it was not traced.
pub fn where_it_parts(agreement: &Agreement, of: &PartedTrial) -> String {
    let Some(parting) = &of.parting else {
        return if of.traced { "The traces nowhere part.".into() } else { String::new() };
    };
    in_words(parting, agreement.engines)
}

/// When two episodes of a trial part in two engines, and what differs since when, in sentences.
pub fn in_words(parting: &Parting, engines: [Engine; 2]) -> String {
    let [a, b] = engines.map(Engine::title);
    let Parting { at_s, phases, loaded, .. } = parting;
    let what = match parting.of {
        Part::Com => "COMs",
        Part::LeftSole => "left soles",
        Part::RightSole => "right soles",
    };
    let mut told = format!("At {at_s:.3} s the {what} part.");
    let mut differ = |since_s: Option<f64>, what: &str, [in_a, in_b]: [&str; 2]| {
        if let Some(since_s) = since_s {
            told += &format!(" Since {since_s:.3} s {what} {in_a} in {a} and {in_b} in {b}.");
        }
    };
    differ(parting.phases_differ_since_s, "the controller is in phase", phases.each_ref().map(|phase| &**phase));
    differ(parting.loaded_differ_since_s, "the load is on", loaded.map(words));
    told
}

fn words(loaded: Loaded) -> &'static str {
    match loaded {
        Loaded::BothSoles => "both soles",
        Loaded::LeftSole => "the left sole",
        Loaded::RightSole => "the right sole",
        Loaded::NoSole => "no sole",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::verdict::agreement::tests::compared;

    #[test]
    fn the_text_has_counts_warnings_and_where_the_traces_part() {
        let recovered: Vec<[bool; 4]> = (0..40).map(|i| [i < 10, true, i < 30, true]).collect();
        let mut summary = compared(&recovered).0;
        let words = |summary: &Summary, full| {
            let text = with_warnings(summary, full);
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let [short, full] = [false, true].map(|full| words(&summary, full));
        assert!(
            short.starts_with("Rapier ")
                && short.contains(" trial by trial: gain set both only Rapier only MuJoCo neither"),
            "{short}"
        );
        assert!(short.contains(" hold 10 0 20 10 50.0 % 0.20 "), "{short}");
        assert!(short.contains(" catch 40 0 0 0 100.0 % - - "), "{short}");
        assert!(!short.contains("agree, by heading") && full.contains("agree, by heading"), "{full}");
        assert!(
            short.contains("all 20 trials are in summary.json): - hold, trial 10, 2.00 N s at 90 deg: fell"),
            "{short}"
        );
        let agreement = summary.agreement.as_mut().unwrap();
        agreement.part_beyond_m = Some(0.035);
        let traced = &mut agreement.sets[0].parted[0];
        traced.traced = true;
        traced.parting = Some(Parting {
            at_s: 1.25,
            of: Part::LeftSole,
            distance_m: 0.036,
            phases: ["swing-left".into(), "switching".into()],
            phases_differ_since_s: Some(1.1),
            loaded: [Loaded::RightSole, Loaded::BothSoles],
            loaded_differ_since_s: None,
        });
        agreement.sets[0].parted[1].traced = true;
        let told = words(&summary, false);
        assert!(told.contains("more than 35 mm apart, which is half the width of a sole."), "{told}");
        let parts = "fell in Rapier, recovered in MuJoCo. At 1.250 s the left soles part. Since 1.100 s the controller is in \
                     phase swing-left in Rapier and switching in MuJoCo. - hold, trial 11";
        assert!(told.contains(parts) && told.contains("The traces nowhere part."), "{told}");
    }
}
