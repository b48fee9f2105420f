//! Picture of a campaign: the share of pushes that each gain set survives, by impulse.

use super::{Area, COLORS, Drawn, axes, beside, text, write_svg};
use crate::campaign::{Summary, verdict::set_summary::ImpulseBin};
use crate::error::Result;
use plotters::prelude::*;
use std::path::Path;

/// Of the picture where names are short.
const SIZE: (u32, u32) = (900, 540);
/// To the right of the chart; more for long names.
const LEGEND_WIDTH: u32 = 170;
/// Left of the names in it.
const LEGEND_INDENT: u32 = 50;
/// Of a letter in a name, about.
const LETTER_WIDTH: u32 = 8;
/// Letters of a name that are shown.
const LETTERS: usize = 40;
/// More sets than this have no bands: they would hide each other.
const MOST_BANDS: usize = 4;
/// Dash and gap.
const DASH: (u32, u32) = (7, 5);

/// Writes success rate against impulse, a curve and a 95 % band per gain set.
pub fn write(path: &Path, summary: &Summary) -> Result<()> {
    let size = (SIZE.0 - LEGEND_WIDTH + legend_width(summary), SIZE.1);
    write_svg(path, size, 1, |area| draw(summary, area))
}

fn draw(summary: &Summary, area: &Area) -> Drawn {
    area.fill(&WHITE)?;
    let bins = || summary.sets.iter().flat_map(|set| &set.by_impulse);
    let least = bins().map(|bin| bin.from_n_s).fold(f64::INFINITY, f64::min);
    let most = bins().map(|bin| bin.to_n_s).fold(f64::NEG_INFINITY, f64::max);
    let (least, most) = if least < most { (least, most) } else { (0.0, 1.0) };
    let middle = |bin: &ImpulseBin| (bin.from_n_s + bin.to_n_s) / 2.0;
    let title = format!("Who stays up: {} pushes per gain set ({})", summary.trials, summary.name);
    let mut chart = ChartBuilder::on(area)
        .margin(18)
        .margin_right(legend_width(summary))
        .caption(title, text(20))
        .margin_top(10)
        .x_label_area_size(52)
        .y_label_area_size(64)
        .build_cartesian_2d(least..most, 0.0..1.0)?;
    let mut mesh = chart.configure_mesh();
    axes(&mut mesh, 1);
    let percent = |rate: &f64| format!("{:.0} %", 100.0 * rate);
    mesh.y_labels(6).x_desc("impulse [N s]").y_desc("recovered").y_label_formatter(&percent).draw()?;
    let banded = summary.sets.iter().filter(|_| has_bands(summary));
    for (set, color) in banded.zip(COLORS.iter().cycle()) {
        let low = set.by_impulse.iter().map(|bin| (middle(bin), bin.count.ci95[0]));
        let high = set.by_impulse.iter().rev().map(|bin| (middle(bin), bin.count.ci95[1]));
        chart.draw_series([Polygon::new(low.chain(high).collect::<Vec<_>>(), color.mix(0.13))])?;
    }
    for (i, (set, color)) in summary.sets.iter().zip(COLORS.iter().cycle()).enumerate() {
        let points = set.by_impulse.iter().map(|bin| (middle(bin), bin.count.success_rate));
        if let ([bin], true) = (&set.by_impulse[..], has_bands(summary)) {
            // A band needs two points.
            let ends = bin.count.ci95.map(|rate| (middle(bin), rate));
            chart.draw_series([PathElement::new(ends, color.mix(0.5).stroke_width(2))])?;
        }
        if i < COLORS.len() {
            chart.draw_series(LineSeries::new(points.clone(), color.stroke_width(2)))?;
            chart.draw_series(points.map(|point| Circle::new(point, 4, color.filled())))?;
        } else {
            chart.draw_series(DashedLineSeries::new(points.clone(), DASH.0, DASH.1, color.stroke_width(2)))?;
            chart.draw_series(points.clone().map(|point| Circle::new(point, 4, WHITE.filled())))?;
            chart.draw_series(points.map(|point| Circle::new(point, 4, color.stroke_width(2))))?;
        }
    }
    legend(summary, area)
}

/// To the right of the chart: which colour is which set, and its rate over all impulses.
fn legend(summary: &Summary, area: &Area) -> Drawn {
    let left = (SIZE.0 - LEGEND_WIDTH) as i32 + 20;
    // Two lines each, closer together where there are many.
    let pitch = 52.min((SIZE.1 as i32 - 110) / summary.sets.len().max(1) as i32);
    for (i, (set, color)) in summary.sets.iter().zip(COLORS.iter().cycle()).enumerate() {
        let y = 70 + pitch * i as i32;
        if i < COLORS.len() {
            area.draw(&PathElement::new(vec![(left, y), (left + 22, y)], color.stroke_width(2)))?;
            area.draw(&Circle::new((left + 11, y), 4, color.filled()))?;
        } else {
            for dash in [left, left + 16] {
                area.draw(&PathElement::new(vec![(dash, y), (dash + 6, y)], color.stroke_width(2)))?;
            }
            area.draw(&Circle::new((left + 11, y), 4, color.stroke_width(2)))?;
        }
        area.draw(&Text::new(shown(&set.name), (left + 30, y), beside(15, 1.0)))?;
        let rate = format!("{:.1} % in all", 100.0 * set.count.success_rate);
        area.draw(&Text::new(rate, (left + 30, y + 19.min(pitch / 2)), beside(13, 0.7)))?;
    }
    let y = 70 + pitch * summary.sets.len() as i32;
    let bands = if has_bands(summary) { "band: 95 %" } else { "intervals: summary.json" };
    area.draw(&Text::new(bands, (left, y), beside(13, 0.7)))
}

fn has_bands(summary: &Summary) -> bool {
    summary.sets.len() <= MOST_BANDS
}

/// A name as far as there is room for it.
fn shown(name: &str) -> String {
    match name.char_indices().nth(LETTERS) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.into(),
    }
}

fn legend_width(summary: &Summary) -> u32 {
    let letters = summary.sets.iter().map(|set| shown(&set.name).chars().count()).max().unwrap_or(0);
    LEGEND_WIDTH.max(LEGEND_INDENT + LETTER_WIDTH * letters as u32)
}
