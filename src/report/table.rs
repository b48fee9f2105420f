//! The result of a campaign as text.

use crate::campaign::Summary;
use crate::campaign::foretold::{Foretold, MarginBin};
use crate::campaign::stats::{Count, SetSummary};
use crate::episode::Judge;
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use std::fmt::Write;
use std::path::Path;

/// Width of text that does not go to a terminal.
const PLAIN_WIDTH: u16 = 80;

/// Causes of a fall that are named; the others are summed up.
const CAUSES: usize = 5;

/// What counts as recovered and as a fall, in words: three lines.
pub fn thresholds(judge: &Judge) -> String {
    format!(
        "recovered: tilt under {} deg, COM under {} m/s, DCM in the support, for {} s\n\
         fell:      a link at the ground other than the soles, tilt over {} deg,\n           \
         or COM under {} of its height at home\n",
        judge.standing_tilt_deg,
        judge.standing_com_speed_m_s,
        judge.standing_time_s,
        judge.fallen_tilt_deg,
        judge.fallen_com_height_ratio,
    )
}

/// What was asked, how many trials recovered per gain set and impulse, how fast, as foretold or not, and where the sets
/// differ. `folder` holds the result, for the command that replays a trial.
pub fn campaign(summary: &Summary, folder: &Path) -> String {
    let push = &summary.push;
    let mut text = String::new();
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "campaign {}: {} pushes, the same for each gain set; seed {}, configuration {}\n\
         push: impulse {} N s, heading {} deg,\n      \
         height {} m above the COM, duration {} s, start {} s, {}\n\
         sensors: noise x {}, bias x {}; horizon {} s\n{}",
        summary.name,
        summary.trials,
        summary.seed,
        &summary.config_hash[..summary.config_hash.len().min(12)],
        push.impulse_n_s,
        push.heading_deg,
        push.height_m,
        push.duration_s,
        push.start_s,
        crate::campaign::row::profile_name(push.profile),
        summary.sensors.noise_scale,
        summary.sensors.bias_scale,
        summary.episode.horizon_s,
        thresholds(&summary.episode.judge),
    );
    let _ = writeln!(text, "{}\n{}\n{}", sets(summary), falls(summary), by_impulse(summary));
    let _ = write!(text, "\n{}\n{}", times(summary), times_explained(summary));
    text += &foretold(summary);
    text += &differences(summary, folder);
    let _ = writeln!(text, "\n95 % intervals: {}", summary.interval.trim_start_matches("95 %: "));
    text
}

fn sets(summary: &Summary) -> Table {
    let mut table = table(["gain set", "recovered", "rate", "95 %", "fell", "diverged", "timed out"]);
    for set in &summary.sets {
        let Count { trials, recovered, success_rate, ci95: [low, high] } = set.count;
        table.add_row([
            set.name.clone(),
            format!("{recovered}/{trials}"),
            percent(success_rate),
            format!("{:.1}-{}", 100.0 * low, percent(high)),
            set.fell.to_string(),
            set.diverged.to_string(),
            set.timed_out.to_string(),
        ]);
    }
    align(table)
}

fn by_impulse(summary: &Summary) -> Table {
    let names = summary.sets.iter().map(|set| set.name.clone());
    let mut table = table(["impulse [N s]".into(), "pushes".into()].into_iter().chain(names));
    let bins = summary.sets.first().map_or(0, |set| set.by_impulse.len());
    for bin in 0..bins {
        // Every set met the same pushes: their bins are the same.
        let first = &summary.sets[0].by_impulse[bin];
        let rates = summary.sets.iter().map(|set| percent(set.by_impulse[bin].count.success_rate));
        let range = format!("{} to {}", first.from_n_s, first.to_n_s);
        table.add_row([range, first.count.trials.to_string()].into_iter().chain(rates));
    }
    align(table)
}

/// On what the sets fell; empty if none did.
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
    let row = |label: &str, of: &dyn Fn(&str) -> bool| -> Vec<String> {
        std::iter::once(label.to_string()).chain(summary.sets.iter().map(|set| sum(set, of).to_string())).collect()
    };
    let mut table = table(["fell on".to_string()].into_iter().chain(summary.sets.iter().map(|set| set.name.clone())));
    for &(cause, _) in &causes {
        table.add_row(row(cause, &|c| c == cause));
    }
    let others = |c: &str| !named(c);
    if summary.sets.iter().any(|set| sum(set, &others) > 0) {
        table.add_row(row("others", &others));
    }
    format!("\n{}\n", align(table))
}

/// Medians of each set's own survivors, and of the trials that all survive.
fn times(summary: &Summary) -> Table {
    let common = &summary.common_survivors;
    let mut header = vec!["gain set", "settles", "settles (1)"];
    if !summary.episode.end_early {
        header.extend(["gets home", "gets home (1)", "home at end (1)"]);
    }
    let mut table = table(header);
    for (set, shared) in summary.sets.iter().zip(&common.sets) {
        let mut row = vec![set.name.clone(), seconds(set.times.median_settling_s), seconds(shared.median_settling_s)];
        if let Some(home) = shared.home {
            row.extend([
                seconds(set.times.median_homing_s),
                seconds(shared.median_homing_s),
                format!("{home}/{}", common.trials),
            ]);
        }
        table.add_row(row);
    }
    align(table)
}

fn times_explained(summary: &Summary) -> String {
    let judge = &summary.episode.judge;
    let mut text = format!(
        " medians from the end of the push, over what each set survives; the ones to\n \
         compare are (1), over the {} pushes that every set survives\n",
        summary.common_survivors.trials
    );
    if !summary.episode.end_early {
        let mm = 1000.0 * judge.home_radius_m;
        let _ = writeln!(text, " home: COM within {mm} mm of the middle of the soles until the horizon");
    }
    text
}

/// How well the sets foretell what happens; empty if no gain set has any.
fn foretold(summary: &Summary) -> String {
    let with_sets = || summary.sets.iter().filter_map(|set| Some((set, set.foretold.as_ref()?)));
    if with_sets().next().is_none() {
        return String::new();
    }
    let mut table =
        table(["slowest CPI set after the push".to_string()].into_iter().chain(with_sets().map(|s| s.0.name.clone())));
    let of = |count: &Count| match count.trials {
        0 => "-".into(),
        trials => format!("{}/{trials} {:>7}", count.recovered, percent(count.success_rate)),
    };
    type Pick = fn(&Foretold) -> &Count;
    for (label, pick) in [("holds the state", (|f| &f.inside) as Pick), ("does not", |f| &f.outside)] {
        table.add_row(std::iter::once(label.to_string()).chain(with_sets().map(|(_, f)| of(pick(f)))));
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
        let cell = |f: &Foretold| f.by_margin.iter().find(|bin| bin.from == *from).map_or("-".into(), |b| of(&b.count));
        table.add_row(std::iter::once(label).chain(with_sets().map(|(_, f)| cell(f))));
    }
    let agreement = |(set, f): (&SetSummary, &Foretold)| {
        format!(" {}: {} ({} by the state as estimated then)", set.name, percent(f.agreement), percent(f.agreement_est))
    };
    format!(
        "\n{}\n recovered where the set holds the true state at the end of the push, and where\n \
         it does not (margin 1: rest, 0: border of the set); trials that did as it says:\n{}\n",
        align(table),
        with_sets().map(agreement).collect::<Vec<_>>().join("\n")
    )
}

/// Pushes that one set survives and another does not, and how to replay one.
fn differences(summary: &Summary, folder: &Path) -> String {
    let mut table = table(["recovers", "does not", "pushes", "first trials"]);
    let mut replay = None;
    for pair in &summary.pairs {
        for (winner, loser) in [(0, 1), (1, 0)] {
            let only = &pair.only[winner];
            let examples: Vec<String> = only.examples.iter().map(u64::to_string).collect();
            let more = if only.trials > only.examples.len() as u64 { ", ..." } else { "" };
            let (winner, loser) = (&pair.sets[winner], &pair.sets[loser]);
            if let (None, Some(trial)) = (&replay, only.examples.first()) {
                replay = Some((trial, loser));
            }
            table.add_row([winner, loser, &only.trials.to_string(), &format!("{}{more}", examples.join(", "))]);
        }
    }
    let Some((trial, set)) = replay else { return String::new() };
    let campaign = folder.join("campaign.toml");
    format!(
        "\n{}\n to replay one: standfast push --campaign {} \\\n                  --trial {trial} --gains {set}\n",
        align(table),
        campaign.display()
    )
}

fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or("-".into(), |s| format!("{s:.2} s"))
}

fn table<T: Into<comfy_table::Cell>>(header: impl IntoIterator<Item = T>) -> Table {
    let mut table = Table::new();
    let rule = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
    table.load_style(rule).set_content_arrangement(ContentArrangement::Dynamic);
    if !table.is_tty() {
        table.set_width(PLAIN_WIDTH);
    }
    table.set_header(header.into_iter().map(Into::into).collect::<Vec<comfy_table::Cell>>());
    table
}

/// Names to the left, numbers to the right.
fn align(mut table: Table) -> Table {
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((1, 0));
        column.set_cell_alignment(if i == 0 { CellAlignment::Left } else { CellAlignment::Right });
    }
    table
}

fn percent(rate: f64) -> String {
    format!("{:.1} %", 100.0 * rate)
}
