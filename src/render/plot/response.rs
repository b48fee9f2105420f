//! Picture (SVG) of a frequency response: gain above, phase below.

use super::{Area, COLORS, Drawn, INK, axes, text, write_svg};
use crate::episode::response::Point;
use crate::error::Result;
use crate::render::text::response::Response;
use plotters::prelude::*;
use std::path::Path;

const SIZE: (u32, u32) = (900, 620);
/// Not every grid line has room for its number.
const LABELLED_HZ: [f64; 9] = [0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0];
const TRUTH: RGBColor = COLORS[0];
const LIMIT: RGBColor = COLORS[1];

/// Draws it, with the fastest pole. Errors: the file cannot be written.
pub fn write(path: &Path, response: &Response) -> Result<()> {
    write_svg(path, SIZE, 1, |area| draw(area, response))
}

fn draw(area: &Area, response: &Response) -> Drawn {
    let (points, pole_rad_s) = (&response.points, response.fastest_pole_rad_s());
    let title = &format!("From the ZMP wanted to the ZMP: {}, {} axis", response.family.name, response.axis_name());
    area.fill(&WHITE)?;
    let (above, below) = area.titled(title, text(20))?.split_vertically(275);
    let decibel = |p: &Point| (p.frequency_hz, 20.0 * p.gain.log10());
    let phase = |p: &Point| (p.frequency_hz, p.phase_deg);
    panel(&above, points.iter().map(decibel).collect(), ("gain [dB]", -3.0), pole_rad_s)?;
    panel(&below, points.iter().map(phase).collect(), ("phase [degrees]", -45.0), pole_rad_s)
}

/// One quantity over frequency, with the limit that bandwidth means.
fn panel(area: &Area, values: Vec<(f64, f64)>, (name, limit): (&str, f64), pole_rad_s: f64) -> Drawn {
    let pole_hz = pole_rad_s / std::f64::consts::TAU;
    let fold = |pick: fn(&(f64, f64)) -> f64, with: fn(f64, f64) -> f64, from| values.iter().map(pick).fold(from, with);
    let (left, right) = (fold(|v| v.0, f64::min, 0.5), fold(|v| v.0, f64::max, 20.0));
    let (low, high) = (fold(|v| v.1, f64::min, limit), fold(|v| v.1, f64::max, 0.0));
    let room = 0.08 * (high - low);
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .margin_right(24)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((left..right.max(pole_hz)).log_scale(), low - room..high + room)?;
    let mut mesh = chart.configure_mesh();
    axes(&mut mesh, 1);
    let some = |hz: &f64| if LABELLED_HZ.contains(hz) { hz.to_string() } else { String::new() };
    mesh.x_desc("frequency [Hz]").x_label_formatter(&some).y_desc(name).draw()?;
    let bound = [(left, limit), (right.max(pole_hz), limit)];
    chart.draw_series(DashedLineSeries::new(bound, 6, 4, LIMIT.stroke_width(1)))?;
    let pole = [(pole_hz, low - room), (pole_hz, high + room)];
    chart.draw_series(DashedLineSeries::new(pole, 2, 4, INK.stroke_width(1)))?;
    chart.draw_series([Text::new("fastest pole", (pole_hz * 1.02, high + 0.6 * room), text(13))])?;
    chart.draw_series(LineSeries::new(values.iter().copied(), TRUTH.stroke_width(2)))?;
    chart.draw_series(values.iter().map(|&v| Circle::new(v, 4, TRUTH.filled())))?;
    Ok(())
}
