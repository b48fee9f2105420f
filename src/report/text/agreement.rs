//! The agreement of two engines, as text.

use crate::tables;
use crate::text::layout::wrapped;
use standfast_sim::episode::parting::{Parting, PartingPoint, SoleContact};
use standfast_study::Summary;
use standfast_study::verdict::agreement::{Agreement, PartedTrial};

/// Number of trials of each controller that the short text names.
const FEW: usize = 3;

/// The agreement of two engines, after warnings of verdicts that hold in one engine only. It is empty if the summary is
/// not of two engines. `full` adds the table by kind of trial, and all trials that were traced.
pub fn with_warnings(summary: &Summary, full: bool) -> String {
    let Some(agreement) = &summary.agreement else {
        return String::new();
    };
    let warnings: String = agreement
        .warnings()
        .iter()
        .map(|warning| wrapped("warning: ", warning))
        .collect();
    let tables = tables::of_agreement(summary, full).map(|table| format!("\n{}", table.text()));
    warnings + &tables.collect::<String>() + &where_they_part(agreement, full)
}

/// The trials on which the engines disagree: those that were traced, or the first few of each controller.
pub(super) fn where_they_part(agreement: &Agreement, full: bool) -> String {
    let mut text = String::new();
    for set in &agreement.sets {
        let traced = set.parted.iter().filter(|trial| trial.traced).count();
        let most = if full { traced.max(FEW) } else { FEW };
        for trial in set.parted.iter().take(most) {
            text += &wrapped(" - ", &format!("{}, {}", set.set, parted(agreement, trial)));
        }
    }
    let all: usize = agreement.sets.iter().map(|set| set.parted.len()).sum();
    if all == 0 {
        return "\nThe engines agree on every trial.\n".into();
    }
    let head = format!(
        "Where they part company (all {all} trials are in summary.json){}",
        about_traces(agreement)
    );
    format!("\n{}{text}", wrapped("", &head))
}

/// The meaning of parting traces, as the end of a sentence.
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
pub fn parted(agreement: &Agreement, trial: &PartedTrial) -> String {
    let [a, b] = agreement.engines.map(|engine| engine.title());
    let [in_a, in_b] = trial.outcomes.map(|outcome| outcome.name());
    let push = format!(
        "trial {}, {:.2} N s at {:.0} deg",
        trial.trial, trial.impulse_n_s, trial.heading_deg
    );
    let parts = match &trial.parting {
        Some(parting) => {
            format!(
                " {}",
                in_words(
                    parting,
                    &agreement
                        .engines
                        .map(|engine| format!("in {}", engine.title()))
                )
            )
        }
        None => String::from(if trial.traced {
            " The traces nowhere part."
        } else {
            ""
        }),
    };
    format!("{push}: {in_a} in {a}, {in_b} in {b}.{parts}")
}

/// The time at which two episodes of a trial part, and the states that differ then, each with the time since which it
/// has been so, in sentences. The episodes are named by words such as "in Rapier".
pub fn in_words(parting: &Parting, [a, b]: &[String; 2]) -> String {
    let Parting {
        at_s,
        phases,
        loaded,
        ..
    } = parting;
    let what = match parting.of {
        PartingPoint::Com => "COMs",
        PartingPoint::LeftSole => "left soles",
        PartingPoint::RightSole => "right soles",
    };
    let mut text = format!("At {at_s:.3} s the {what} part.");
    let states = [
        (
            "Then the controller is in phase",
            phases.each_ref().map(|phase| &**phase),
            parting.phases_since_s,
        ),
        ("The load is on", loaded.map(words), parting.loaded_since_s),
    ];
    for (what, [now_a, now_b], [since_a, since_b]) in states {
        if now_a != now_b {
            text += &format!(
                " {what} {now_a} {a} (since {since_a:.3} s) and {now_b} {b} (since {since_b:.3} s)."
            );
        }
    }
    text
}

fn words(loaded: SoleContact) -> &'static str {
    match loaded {
        SoleContact::BothSoles => "both soles",
        SoleContact::LeftSole => "the left sole",
        SoleContact::RightSole => "the right sole",
        SoleContact::NoSole => "no sole",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::compared;

    #[test]
    fn the_text_has_counts_warnings_and_where_the_traces_part() {
        let recovered: Vec<[bool; 4]> = (0..40).map(|i| [i < 10, true, i < 30, true]).collect();
        let mut summary = compared(&recovered).0;
        let words = |summary: &Summary, full| {
            let text = with_warnings(summary, full);
            assert!(
                text.lines().all(|line| line.chars().count() <= 80),
                "{text}"
            );
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let [short, full] = [false, true].map(|full| words(&summary, full));
        assert!(
            short.starts_with("controller both only only neither agree kappa 95 % Rapier MuJoCo ")
                && short.contains(", trial by trial."),
            "{short}"
        );
        assert!(short.contains(" hold 10 0 20 10 50.0 % 0.20 "), "{short}");
        assert!(short.contains(" catch 40 0 0 0 100.0 % - - "), "{short}");
        assert!(
            !short.contains("heading: forward") && full.contains("heading: forward"),
            "{full}"
        );
        assert!(
            short.contains(
                "all 20 trials are in summary.json): - hold, trial 10, 2.00 N s at 90 deg: fell"
            ),
            "{short}"
        );
        let agreement = summary.agreement.as_mut().unwrap();
        agreement.part_beyond_m = Some(0.035);
        let traced = &mut agreement.sets[0].parted[0];
        traced.traced = true;
        traced.parting = Some(Parting {
            at_s: 1.25,
            of: PartingPoint::LeftSole,
            distance_m: 0.036,
            phases: ["swing-left".into(), "switching".into()],
            phases_since_s: [1.1, 0.0],
            loaded: [SoleContact::RightSole; 2],
            loaded_since_s: [1.12, 1.14],
        });
        agreement.sets[0].parted[1].traced = true;
        let told = words(&summary, false);
        assert!(
            told.contains("more than 35 mm apart, which is half the width of a sole."),
            "{told}"
        );
        let parts = "fell in Rapier, recovered in MuJoCo. At 1.250 s the left soles part. Then the controller is in phase \
                     swing-left in Rapier (since 1.100 s) and switching in MuJoCo (since 0.000 s). - hold, trial 11";
        assert!(
            told.contains(parts) && told.contains("The traces nowhere part."),
            "{told}"
        );
    }
}
