//! The result of a campaign as text.

use crate::campaign::Summary;
use crate::campaign::stats::Count;
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use std::fmt::Write;

/// Width of text that does not go to a terminal.
const PLAIN_WIDTH: u16 = 80;

/// What was asked, and per gain set and impulse how many trials recovered.
pub fn campaign(summary: &Summary) -> String {
    let judge = &summary.episode.judge;
    let push = &summary.push;
    let mut text = String::new();
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "campaign {}: {} pushes, the same for each gain set; seed {}, configuration {}\n\
         push: impulse {} N s, heading {} deg,\n      \
         height {} m above the COM, duration {} s, start {} s, {}\n\
         sensors: noise x {}, bias x {}; horizon {} s\n\
         recovered: tilt under {} deg, COM under {} m/s, DCM in the support, for {} s\n\
         fell:      a link at the ground other than the soles, tilt over {} deg,\n           \
         or COM under {} of its height at home\n",
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
        judge.standing_tilt_deg,
        judge.standing_com_speed_m_s,
        judge.standing_time_s,
        judge.fallen_tilt_deg,
        judge.fallen_com_height_ratio,
    );
    let _ = writeln!(text, "{}\n\n{}", sets(summary), by_impulse(summary));
    let _ = writeln!(text, "\n95 % intervals: {}", summary.interval.trim_start_matches("95 %: "));
    text
}

fn sets(summary: &Summary) -> Table {
    let mut table = table(["gain set", "recovered", "rate", "95 %", "fell", "diverged", "timed out", "settles"]);
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
            set.median_settling_s.map_or("-".into(), |s| format!("{s:.2} s")),
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
