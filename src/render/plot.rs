//! Pictures (SVG) of a campaign, and what all pictures share: their colours, and how they are written.

use crate::campaign::{Summary, verdict::set_summary::ImpulseBin};
use crate::error::{Error, Result};
use crate::files::write_atomic;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

/// Told apart by most colour-blind readers too (Okabe and Ito). Sets beyond these have the same again, dashed.
pub(super) const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
];
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
pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
pub(super) const FAINT: RGBColor = RGBColor(225, 225, 225);

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Draws a picture of `size` (px) and writes it whole. Errors: the file cannot be written.
pub(super) fn write_svg(
    path: &Path,
    size: (u32, u32),
    units_per_px: u32,
    draw: impl FnOnce(&Area) -> Drawn,
) -> Result<()> {
    write_atomic(path, svg(size, units_per_px, draw)?.as_bytes())
}

/// Draws a picture of `size` (px). `draw` works in units of 1 / `units_per_px`: the backend rounds to whole units, which at
/// 1 shows as stairs in a curve of many points. Errors: it cannot be drawn.
pub(super) fn svg(size: (u32, u32), units_per_px: u32, draw: impl FnOnce(&Area) -> Drawn) -> Result<String> {
    let units = (size.0 * units_per_px, size.1 * units_per_px);
    let header = |(width, height): (u32, u32)| format!(r#"<svg width="{width}" height="{height}""#);
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, units).into_drawing_area();
    draw(&area).map_err(|e| Error::Numeric { what: "picture".into(), problem: e.to_string() })?;
    drop(area);
    Ok(svg.replacen(&header(units), &header(size), 1))
}

/// Writes success rate against impulse, a curve and a 95 % band per gain set.
pub fn write_success(summary: &Summary, path: &Path) -> Result<()> {
    let size = (SIZE.0 - LEGEND_WIDTH + legend_width(summary), SIZE.1);
    write_svg(path, size, 1, |area| draw_success(summary, area))
}

fn draw_success(summary: &Summary, area: &Area) -> Drawn {
    area.fill(&WHITE)?;
    let bins = || summary.sets.iter().flat_map(|set| &set.by_impulse);
    let least = bins().map(|bin| bin.from_n_s).fold(f64::INFINITY, f64::min);
    let most = bins().map(|bin| bin.to_n_s).fold(f64::NEG_INFINITY, f64::max);
    let (least, most) = if least < most { (least, most) } else { (0.0, 1.0) };
    let middle = |bin: &ImpulseBin| (bin.from_n_s + bin.to_n_s) / 2.0;
    let font = |size: u32| ("sans-serif", size).into_font().color(&INK);
    let title = format!("Who stays up: {} pushes per gain set ({})", summary.trials, summary.name);
    let mut chart = ChartBuilder::on(area)
        .margin(18)
        .margin_right(legend_width(summary))
        .caption(title, font(20))
        .margin_top(10)
        .x_label_area_size(52)
        .y_label_area_size(64)
        .build_cartesian_2d(least..most, 0.0..1.0)?;
    chart
        .configure_mesh()
        .y_labels(6)
        .bold_line_style(FAINT)
        .light_line_style(TRANSPARENT)
        .axis_style(INK)
        .x_desc("impulse [N s]")
        .y_desc("recovered")
        .label_style(font(14))
        .axis_desc_style(font(15))
        .y_label_formatter(&|rate| format!("{:.0} %", 100.0 * rate))
        .draw()?;
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
    let text = |size: u32, opacity: f64| {
        let color = INK.mix(opacity);
        ("sans-serif", size).into_font().color(&color).pos(Pos::new(HPos::Left, VPos::Center))
    };
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
        area.draw(&Text::new(shown(&set.name), (left + 30, y), text(15, 1.0)))?;
        let rate = format!("{:.1} % in all", 100.0 * set.count.success_rate);
        area.draw(&Text::new(rate, (left + 30, y + 19.min(pitch / 2)), text(13, 0.7)))?;
    }
    let y = 70 + pitch * summary.sets.len() as i32;
    let bands = if has_bands(summary) { "band: 95 %" } else { "intervals: summary.json" };
    area.draw(&Text::new(bands, (left, y), text(13, 0.7)))
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
