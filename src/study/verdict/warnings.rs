//! Warns of conclusions that a campaign cannot support because of its design.

use crate::ask::bounds::digits;
use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::verdict::controller_summary::ControllerSummary;
use crate::verdict::pairs::PairSummary;
use standfast_sim::episode::Counts;
use standfast_stats::decision::PairVerdict;

/// Least number of trials without a warning. With fewer, a rate of 50 % is known to 10 points either way at best.
const FEW_TRIALS: u64 = 100;
/// Largest number of pairs that are named.
const NAMED: usize = 3;
/// Rate near an end: if all rates are above it, or all are below 1 minus it, there is little to compare.
const NEARLY: f64 = 0.98;
/// Largest share of trials that may begin with a robot in motion without a warning.
const MOVING: f64 = 0.02;

/// The warnings as sentences, the gravest first. A sound design has none.
pub fn of(
    campaign: &Campaign,
    trials: u64,
    controllers: &[ControllerSummary],
    pairs: &[PairSummary],
) -> Vec<String> {
    let mut warnings = Vec::new();
    if campaign.synthetic {
        warnings.push("Nothing was simulated: the outcomes are made up (--synthetic).".into());
    }
    let are_alike = trials > 1
        && trial::pushes(campaign, 1) == trial::pushes(campaign, 0)
        && trial::variation(campaign, 1) == trial::variation(campaign, 0);
    let is_noisy = trial::sensor_errors(campaign, 0).is_some();
    if are_alike {
        warnings.push(if is_noisy {
            "Every trial is the same push on the same robot. Only sensor noise differs, so rates say nothing of other \
             pushes. Draw impulse and heading, e.g. push.impulse_n_s = { uniform = [a, b] }."
                .into()
        } else {
            "Every trial is the same, to the bit, so all count as one, and intervals and p-values mean nothing. Draw \
             impulse and heading, e.g. push.impulse_n_s = { uniform = [a, b] }."
                .to_string()
        });
    }
    if trials < FEW_TRIALS {
        let points = 98.0 / (trials as f64).sqrt();
        warnings.push(format!(
            "{trials} trials are few: a rate near 50 % is known to {points:.0} points either way."
        ));
    }
    let rates = || {
        controllers
            .iter()
            .map(|controller| controller.count.success_rate)
    };
    if controllers.len() > 1 && rates().all(|rate| rate > NEARLY) {
        warnings.push(
            "Every controller recovered from nearly every trial: the pushes are too weak to tell the controllers apart."
                .into(),
        );
    } else if controllers.len() > 1 && rates().all(|rate| rate < 1.0 - NEARLY) {
        warnings.push(
            "No controller recovered from more than a few trials: the pushes are too hard to tell the controllers apart."
                .into(),
        );
    }
    // The smallest number k of discordant trials that show a difference if the same controller recovers in all of them:
    // the smallest k for which 2 / 2^k, times the number of pairs, is below 5 %.
    let enough = (2.0 * pairs.len().max(1) as f64 / 0.05).log2().ceil() as u64;
    let mut thin = Vec::new();
    for pair in pairs {
        let discordant = pair.counts.only_a + pair.counts.only_b;
        if pair.verdict == PairVerdict::Open
            && discordant < enough
            && pair.counts.trials() >= FEW_TRIALS
        {
            thin.push(format!("{} and {}", pair.a, pair.b));
        }
    }
    if !thin.is_empty() {
        let more = if thin.len() > NAMED {
            format!(" and {} more pairs", thin.len() - NAMED)
        } else {
            String::new()
        };
        let named = thin[..thin.len().min(NAMED)].join(", ");
        warnings.push(format!(
            "It cannot be said which is better of {named}{more}: fewer than {enough} trials were survived with only one \
             of the two."
        ));
    }
    if campaign.stopping.until_resolved {
        warnings.push(
            "The campaign could end when decided. Intervals of rates, differences and gates allow for that. Curves, kinds \
             of trial and times do not: they lean towards the result at which the campaign ended."
                .into(),
        );
    }
    let moving: Vec<String> = controllers
        .iter()
        .filter(|controller| {
            controller.moving_at_push as f64 > MOVING * controller.count.trials as f64
        })
        .map(
            |ControllerSummary {
                 name,
                 moving_at_push,
                 count,
                 ..
             }| { format!("{name} ({moving_at_push} of {} trials)", count.trials) },
        )
        .collect();
    // A robot that marches is never at rest, and need not be where survival counts.
    let counts = campaign.episode.judge.counts;
    if !moving.is_empty() && counts != Counts::Survived {
        let speed_m_s = digits(campaign.episode.judge.standing_com_speed_m_s);
        warnings.push(format!(
            "The push found a robot that was not at rest (COM faster than {speed_m_s} m/s) with {}. A later push.start_s \
             gives it time to come to rest.",
            moving.join(", ")
        ));
    }
    for controller in controllers
        .iter()
        .filter(|controller| controller.diverged > 0)
    {
        warnings.push(format!(
            "With {}, {} trials diverged numerically and count as lost.",
            controller.name, controller.diverged
        ));
    }
    for ControllerSummary {
        name,
        run_twice,
        not_repeated,
        ..
    } in controllers
        .iter()
        .filter(|controller| controller.not_repeated > 0)
    {
        warnings.push(format!(
            "{name} does not repeat itself: of {run_twice} trials that were run twice, {not_repeated} had another record \
             the second time. Its replays are not exact, and trials cannot be compared one by one."
        ));
    }
    for controller in controllers
        .iter()
        .filter(|controller| controller.failed > 0)
    {
        let told = "trials ended since the controller failed, and count as lost. The causes are in the tables.";
        warnings.push(format!(
            "With {}, {} {told}",
            controller.name, controller.failed
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use crate::fixtures::summary;
    use standfast_sim::episode::Outcome::{Diverged, Failed, Fell, Recovered};

    #[test]
    fn a_design_that_cannot_support_a_claim_is_told_so() {
        let [strong, no_noise] = [
            ["push.impulse_n_s=2", "push.heading_deg=0"],
            ["sensors.noise_scale=0", "sensors.bias_scale=0"],
        ];
        for (words, times, trials, outcomes, set) in [
            ("are few", 1, 99, [Recovered, Fell], &[][..]),
            ("too weak", 1, 100, [Recovered, Recovered], &[]),
            ("too hard", 1, 100, [Fell, Fell], &[]),
            ("cannot be said", 1, 100, [Recovered, Recovered], &[]),
            (
                "same push on the same robot",
                1,
                100,
                [Recovered, Fell],
                &strong,
            ),
            (
                "count as one",
                1,
                100,
                [Recovered, Fell],
                &[strong, no_noise].concat(),
            ),
            (
                "could end when decided",
                1,
                100,
                [Recovered, Fell],
                &["stopping.until_resolved=true"],
            ),
            ("diverged numerically", 1, 100, [Recovered, Diverged], &[]),
            (
                "since the controller failed",
                1,
                100,
                [Recovered, Failed],
                &[],
            ),
            // One warning for both controllers.
            (
                "not at rest",
                1,
                100,
                [Recovered, Fell],
                &["episode.judge.standing_com_speed_m_s=0.0005"],
            ),
            // A sound design has no warning.
            ("", 0, 100, [Recovered, Fell], &[]),
        ] {
            let warnings = summary(&vec![outcomes; trials], set, &[]).warnings;
            let found = warnings
                .iter()
                .filter(|warning| warning.contains(words))
                .count();
            assert_eq!(found, times, "{words}: {warnings:?}");
        }
    }
}
