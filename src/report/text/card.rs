//! The texts of a card and of what was observed on hardware.

use super::layout::{signed, together, wrapped};
use crate::table::{Cell, Table, TableColumn};
use standfast_files::shell_word;
use standfast_study::card::observed::{Observed, ObservedVerdict};
use standfast_study::card::{Card, Cost, OBSERVED, WORSE};
use standfast_study::limit::Heading;
use std::path::Path;

/// How a trial is lost, by the names of the counts, in the order in which they are told.
pub const WAYS: [(&str, &str); 11] = [
    ("fell_before_any_footstep", "falls without a footstep"),
    ("fell_in_swing", "falls with a foot in the air"),
    ("fell_after_landing", "falls after a landing"),
    ("timed_out", "does not stand at the end"),
    ("broke", "a sole bears too much"),
    ("diverged", "the simulation fails"),
    ("failed", "the controller fails"),
    ("fell_slipped", "of the falls: a sole slips"),
    (
        "fell_torque_limited",
        "of the falls: a motor is at its torque limit",
    ),
    ("fell_legs_met", "of the falls: the legs meet"),
    ("fell_otherwise", "of the falls: none of these"),
];

/// The heading with the smallest limit.
pub fn weakest(card: &Card) -> &Heading {
    let limit = |heading: &&Heading| heading.controllers[0].impulse50_n_s;
    let headings = card.limits.headings.iter();
    let weakest = headings.min_by(|a, b| limit(a).total_cmp(&limit(b)));
    weakest.expect("a search has a heading")
}

/// The result in a sentence.
pub fn conclusion(card: &Card) -> String {
    let weakest = weakest(card);
    let limit = &weakest.controllers[0];
    let safe = if card.safe_n_s > 0.0 {
        format!("was never lost up to {:.2} N s", card.safe_n_s)
    } else {
        "was lost by the weakest push that was tried".into()
    };
    let hard = match limit.pendulum {
        Some(of_bob) => format!("drawn back by {:.2} m", of_bob.draw50_m),
        None => format!("{:.2} m/s", limit.dv_m_s),
    };
    format!(
        "{} with {} {safe}, and is weakest at {:.0} degrees, where it survives {:.2} N s ({hard}) half of the time.",
        card.limits.robot, card.controller, weakest.heading_deg, limit.impulse50_n_s
    )
}

/// Which quantity costs most.
pub fn most_expensive(card: &Card) -> String {
    let costs: Vec<&Cost> = card
        .factors
        .iter()
        .filter(|cost| cost.difference_ci[1] < 0.0)
        .collect();
    let told = |cost: &Cost| format!("{} ({})", cost.name, points(cost));
    match &costs[..] {
        [] => format!(
            "No single quantity costs so much that {} pushes show it; all together change the rate of survival by {}.",
            card.designed.trials,
            points(&card.together)
        ),
        [most, rest @ ..] => {
            let others: Vec<String> = rest.iter().map(|cost| told(cost)).collect();
            let others = match others.is_empty() {
                true => "no other quantity costs so much that it shows".into(),
                false => format!("less so {}", others.join(", ")),
            };
            format!(
                "What costs most: {}; {others}. All together change the rate of survival by {}.",
                told(most),
                points(&card.together)
            )
        }
    }
}

/// A difference in percentage points and its interval.
pub fn points(cost: &Cost) -> String {
    let [least, most] = cost.difference_ci.map(|end| signed(100.0 * end, 0));
    format!(
        "{} points, {least} to {most}",
        signed(100.0 * cost.difference, 1)
    )
}

/// What the sheet can tell.
pub fn power(card: &Card) -> String {
    format!(
        "If the limits of the robot are {:.0} % lower than here, these {} pushes show it with a chance of {}.",
        100.0 * (1.0 - WORSE),
        card.pushes.len(),
        share(card.power)
    )
}

/// A share as whole percent.
pub fn share(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// The command that compares the sheet in a folder with its card.
pub fn compare_command(folder: &Path) -> String {
    let sheet = folder.join(OBSERVED).display().to_string();
    format!("standfast compare --observed {}", shell_word(&sheet))
}

/// A card on the terminal. `folder` is where it was written.
pub fn card(card: &Card, folder: &Path) -> String {
    let mut text = wrapped("", &together(&conclusion(card)));
    text += &wrapped("", &together(&most_expensive(card)));
    let has_bob = card.limits.pendulum.is_some();
    let hard = if has_bob { "D [m]" } else { "N s" };
    let columns = ["push", hard, "heading", "survived"].map(number);
    let mut table = Table {
        title: "To try on hardware first".into(),
        columns: columns.into(),
        note: power(card),
        ..Table::default()
    };
    for push in &card.pushes {
        let [least, most] = push.predicted_ci95.map(share);
        table.rows.push(vec![
            cell(push.push),
            cell(push.draw_m.unwrap_or(push.impulse_n_s)),
            cell(push.heading_deg),
            cell(format!("{} ({least} to {most})", share(push.predicted))),
        ]);
    }
    text += &format!("\n{}\n{}\n", table.title, table.text());
    text + &wrapped(
        "",
        &format!(
            "Print card.html, fill in {OBSERVED}, and compare:\n  {}",
            compare_command(folder)
        ),
    )
}

fn number(heading: &str) -> TableColumn {
    TableColumn {
        heading: heading.into(),
        ..TableColumn::default()
    }
}

fn cell(text: impl ToString) -> Cell {
    Cell {
        text: text.to_string(),
        ..Cell::default()
    }
}

/// The verdict on what was observed, in a sentence.
pub fn verdict(observed: &Observed) -> String {
    let (of, n) = (&observed.agreement, observed.agreement.pushes);
    let (robot, controller) = (&observed.robot, &observed.controller);
    let pushes = if n == 1 { "push" } else { "pushes" };
    match observed.verdict {
        ObservedVerdict::Agrees => format!(
            "{robot} with {controller} agrees with the prediction: its limits are those predicted, to a quarter, by {n} {pushes}."
        ),
        ObservedVerdict::Worse => format!(
            "{robot} with {controller} stands worse than predicted: so few of {n} {pushes} are survived with a probability of {}.",
            probability(of.so_few_p)
        ),
        ObservedVerdict::Better => format!(
            "{robot} with {controller} stands better than predicted: so many of {n} {pushes} are survived with a probability of {}.",
            probability(of.so_many_p)
        ),
        ObservedVerdict::Otherwise => format!(
            "{robot} with {controller} does not agree with the prediction: as many {pushes} are survived as predicted, but others."
        ),
        ObservedVerdict::CannotBeTold => format!(
            "Whether {robot} with {controller} agrees with the prediction cannot be told from {n} {pushes}: nothing speaks against it."
        ),
    }
}

/// What was observed against its card.
pub fn observed(observed: &Observed) -> String {
    let of = &observed.agreement;
    let mut text = wrapped("", &together(&verdict(observed)));
    let scale = match of.scale_ci95 {
        [Some(least), Some(most)] => format!("{least:.2} to {most:.2} times"),
        [Some(least), None] => format!("at least {least:.2} times"),
        [None, Some(most)] => format!("at most {most:.2} times"),
        [None, None] => "any multiple of".into(),
    };
    let lines = [
        format!(
            "survived: {} of {}, and {:.1} were expected; as few or fewer with a probability of {}, as many or more with one of {}",
            of.survived,
            of.pushes,
            of.expected,
            probability(of.so_few_p),
            probability(of.so_many_p)
        ),
        format!("limits: {scale} the predicted ones (exact interval at 95 %)"),
        format!(
            "which pushes: log likelihood {:.2}, and {:.2} was expected; so improbable an outcome, or more so, with a probability of {}",
            of.log_likelihood,
            of.expected_log_likelihood,
            probability(of.so_unlikely_p)
        ),
    ];
    for line in &lines {
        text += &wrapped(" - ", line);
    }
    let columns = ["predicted", "pushes", "expected", "survived", "rate"].map(number);
    let mut table = Table {
        title: "Predicted and observed".into(),
        columns: columns.into(),
        ..Table::default()
    };
    for bin in observed.calibration.iter().filter(|bin| bin.pushes > 0) {
        let [from, to] = bin.range.map(|end| format!("{:.0}", 100.0 * end));
        let [least, most] = bin.rate_ci95.map(|end| format!("{:.0}", 100.0 * end));
        table.rows.push(vec![
            cell(format!("{from}-{to} %")),
            cell(bin.pushes),
            cell(format!("{:.1}", bin.expected)),
            cell(bin.survived),
            cell(format!("{least}-{most} %")),
        ]);
    }
    table.note = "`rate` is the exact 95 % interval of the rate of survival.".into();
    text + &format!("\n{}\n{}", table.title, table.text())
}

/// A probability with two digits, but not below 0.0001.
fn probability(p: f64) -> String {
    match p {
        p if p < 1e-4 => "less than 0.0001".into(),
        p if p < 0.01 => format!("{p:.4}"),
        _ => format!("{p:.2}"),
    }
}
