//! Picture (SVG) of `standfast limit`, seen from above: forward is up, left is to the left.

use super::{Area, COLORS, Drawn, FAINT, INK, beside, text, write_svg};
use crate::campaign::limit::{Limits, SetLimit};
use crate::error::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

const SIZE: (u32, u32) = (860, 640);
/// Finer than a pixel, for curves without stairs.
const UNITS_PER_PX: u32 = 8;
const CENTRE: (f64, f64) = (315.0, 340.0);
const RADIUS_PX: f64 = 265.0;
const LEGEND_PX: f64 = 640.0;
/// Bounds are drawn every so many degrees.
const BOUND_EVERY_DEG: usize = 3;
const BOUNDS: [(&str, f64); 3] = [("any number of footsteps", 0.10), ("one footstep", 0.16), ("no footstep", 0.26)];
const LETTERS: usize = 22;

/// Draws bounds and gain sets. Errors: the solver gives up on a bound, or the file cannot be written.
pub fn write(path: &Path, limits: &Limits) -> Result<()> {
    let mut outlines = [Vec::new(), Vec::new(), Vec::new()];
    for heading_deg in (0..360).step_by(BOUND_EVERY_DEG).map(|deg| deg as f64) {
        let heading = limits.yardstick.heading(heading_deg)?;
        let bounds = [heading.bound_n_step_n_s, heading.bound_one_step_n_s, heading.bound_no_step_n_s];
        outlines.iter_mut().zip(bounds).for_each(|(outline, bound)| outline.push((heading_deg, bound)));
    }
    write_svg(path, SIZE, UNITS_PER_PX, |area| draw(area, limits, &outlines))
}

/// From N s and degrees to units of the picture.
struct Scale {
    px_per_n_s: f64,
}

impl Scale {
    fn at(&self, heading_deg: f64, impulse_n_s: f64) -> (i32, i32) {
        let ((sin, cos), r) = (heading_deg.to_radians().sin_cos(), impulse_n_s * self.px_per_n_s);
        units(CENTRE.0 - r * sin, CENTRE.1 - r * cos)
    }

    fn outline(&self, points: &[(f64, f64)]) -> Vec<(i32, i32)> {
        points.iter().map(|&(heading_deg, impulse_n_s)| self.at(heading_deg, impulse_n_s)).collect()
    }
}

fn units(x_px: f64, y_px: f64) -> (i32, i32) {
    let scale = f64::from(UNITS_PER_PX);
    ((x_px * scale).round() as i32, (y_px * scale).round() as i32)
}

fn px(width: u32) -> u32 {
    width * UNITS_PER_PX
}

fn draw(area: &Area, limits: &Limits, outlines: &[Vec<(f64, f64)>; 3]) -> Drawn {
    area.fill(&WHITE)?;
    let sets = || limits.headings.iter().flat_map(|heading| heading.sets.iter());
    let bounds = outlines.iter().flatten().map(|point| point.1);
    let most = sets().map(|set| set.ci95[1]).chain(bounds).fold(0.1, f64::max);
    let ring = ring_n_s(most);
    let scale = Scale { px_per_n_s: RADIUS_PX / (ring * (most / ring).ceil()) };
    for (outline, (_, opacity)) in outlines.iter().zip(BOUNDS) {
        area.draw(&Polygon::new(scale.outline(outline), INK.mix(opacity)))?;
        closed(area, scale.outline(outline), INK.mix(0.35).stroke_width(px(1)))?;
    }
    rings(area, &scale, ring, (most / ring).ceil() as usize)?;
    for (i, color) in (0..limits.headings.first().map_or(0, |heading| heading.sets.len())).zip(COLORS.iter().cycle()) {
        let of = |set: fn(&SetLimit) -> f64| -> Vec<(f64, f64)> {
            limits.headings.iter().map(|heading| (heading.heading_deg, set(&heading.sets[i]))).collect()
        };
        closed(area, scale.outline(&of(|set| set.impulse50_n_s)), color.stroke_width(px(2)))?;
        let (low, high) = (scale.outline(&of(|set| set.ci95[0])), scale.outline(&of(|set| set.ci95[1])));
        for whisker in low.into_iter().zip(high) {
            area.draw(&PathElement::new([whisker.0, whisker.1], color.mix(0.6).stroke_width(px(4))))?;
        }
        for (heading, at) in limits.headings.iter().zip(scale.outline(&of(|set| set.impulse50_n_s))) {
            let style = if heading.sets[i].resolved { color.filled() } else { WHITE.filled() };
            area.draw(&Circle::new(at, px(4), style))?;
            area.draw(&Circle::new(at, px(4), color.stroke_width(px(1))))?;
        }
    }
    words(area, limits)
}

/// Plotters closes no path.
fn closed(area: &Area, mut points: Vec<(i32, i32)>, style: ShapeStyle) -> Drawn {
    points.extend(points.first().copied());
    area.draw(&PathElement::new(points, style))
}

/// Between rings (N s): at most eight of them.
fn ring_n_s(most: f64) -> f64 {
    let powers = (-3..6).flat_map(|power| [1.0, 2.0, 5.0].map(|step| step * 10f64.powi(power)));
    powers.into_iter().find(|step| most <= 8.0 * step).unwrap_or(most)
}

fn rings(area: &Area, scale: &Scale, ring: f64, count: usize) -> Drawn {
    let centred = text(px(12) as i32).pos(Pos::new(HPos::Center, VPos::Center));
    for i in 1..=count {
        let impulse_n_s = ring * i as f64;
        let radius = (impulse_n_s * scale.px_per_n_s * f64::from(UNITS_PER_PX)) as i32;
        area.draw(&Circle::new(scale.at(0.0, 0.0), radius, FAINT.stroke_width(px(1))))?;
        let text = format!("{}", (impulse_n_s * 1e3).round() / 1e3);
        area.draw(&Text::new(text, scale.at(-11.0, impulse_n_s), centred.clone()))?;
    }
    let edge = RADIUS_PX / scale.px_per_n_s;
    for (heading_deg, name) in
        [(0.0, "forward, 0"), (90.0, "left, 90"), (180.0, "backward, 180"), (270.0, "right, 270")]
    {
        area.draw(&PathElement::new([scale.at(0.0, 0.0), scale.at(heading_deg, edge)], FAINT.stroke_width(px(1))))?;
        let sideways = [90.0, 270.0].contains(&heading_deg);
        // Beside the chart there is little room: above the line's end.
        let (x, y) = scale.at(heading_deg, edge);
        let raise = units(0.0, if sideways { -12.0 } else { 12.0 * if heading_deg == 0.0 { -1.0 } else { 1.0 } }).1;
        area.draw(&Text::new(name, (x, y + raise), centred.clone()))?;
    }
    Ok(())
}

/// Title and legend.
fn words(area: &Area, limits: &Limits) -> Drawn {
    let font = |size: u32, opacity: f64| beside(px(size) as i32, opacity);
    let title = format!("Largest recoverable impulse [N s]: {}, {}", limits.robot, limits.campaign);
    area.draw(&Text::new(title, units(40.0, 24.0), font(19, 1.0)))?;
    let mut y = 90.0;
    let mut entry = |text: String, size: u32, opacity: f64, mark: &dyn Fn(f64) -> Drawn| {
        mark(y)?;
        let drawn = area.draw(&Text::new(text, units(LEGEND_PX + 34.0, y), font(size, opacity)));
        y += 24.0;
        drawn
    };
    let names = limits.headings.iter().take(1).flat_map(|heading| &heading.sets).map(|set| &set.name);
    for (name, color) in names.zip(COLORS.iter().cycle()) {
        let shown: String = name.chars().take(LETTERS).collect();
        entry(shown, 15, 1.0, &|y| {
            let ends = [units(LEGEND_PX, y), units(LEGEND_PX + 26.0, y)];
            area.draw(&PathElement::new(ends, color.stroke_width(px(2))))?;
            area.draw(&Circle::new(units(LEGEND_PX + 13.0, y), px(4), color.filled()))
        })?;
    }
    entry("50 % recover; bars: 95 %".into(), 13, 0.7, &|_| Ok(()))?;
    if limits.headings.iter().flat_map(|heading| &heading.sets).any(|set| !set.resolved) {
        entry("hollow: not resolved".into(), 13, 0.7, &|_| Ok(()))?;
    }
    entry("what the pendulum allows".into(), 15, 1.0, &|_| Ok(()))?;
    // Each lies over those before it.
    let mut opacity = 0.0;
    for (name, more) in BOUNDS {
        opacity += more * (1.0 - opacity);
        entry(name.into(), 13, 1.0, &|y| {
            let corners = [units(LEGEND_PX, y - 8.0), units(LEGEND_PX + 26.0, y + 8.0)];
            area.draw(&Rectangle::new(corners, INK.mix(opacity).filled()))
        })?;
    }
    Ok(())
}
