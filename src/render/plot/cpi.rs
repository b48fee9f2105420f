//! Picture of nested CPI sets.
//!
//! The slice com = 0 in the plane of com_vel and zmp, one panel for each axis: a robot at rest sits at the centre, an
//! impulse moves it along the horizontal line, and the ZMP is what the controller moves.

use super::{Area, Drawn, axes, text, write_svg};
use crate::error::Result;
use crate::lipm::CpiSet;
use nalgebra::{Point2, Vector2};
use plotters::prelude::*;
use std::path::Path;

/// Directions in which the boundary of a slice is looked for.
const DIRECTIONS: usize = 720;
/// Width and height (px).
const SIZE: (u32, u32) = (1000, 460);

/// Draws the sets of a family (slow to fast, largest first). Errors: the file cannot be written.
pub fn write(path: &Path, sets: &[CpiSet]) -> Result<()> {
    write_svg(path, SIZE, 1, |area| {
        area.fill(&WHITE)?;
        area.split_evenly((1, 2)).iter().enumerate().try_for_each(|(axis, panel)| draw(panel, axis, sets))
    })
}

fn draw(panel: &Area, axis: usize, sets: &[CpiSet]) -> Drawn {
    let Some(CpiSet { polygon, pendulum, .. }) = sets.first() else { return Ok(()) };
    let name = ["x", "y"][axis];
    let reach = polygon.vertices().iter().map(|v| v.coords[axis].abs()).fold(0.0, f64::max) * 1.15;
    let speed = reach * pendulum.omega;
    // The legend stands beside the sets of the last panel.
    let room = if axis == 1 { 1.6 } else { 1.0 };
    let mut chart = ChartBuilder::on(panel)
        .caption(format!("{name} axis, slice com = 0"), text(18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(-speed..speed * room, -reach * 1e3..reach * 1e3)?;
    let mut mesh = chart.configure_mesh();
    axes(&mut mesh, 1);
    mesh.x_desc(format!("com_vel_{name} [m/s]")).y_desc(format!("zmp_{name} [mm]")).draw()?;
    for (i, set) in sets.iter().enumerate() {
        let outline = outline(set, axis, speed, reach);
        let shade = 0.10 + 0.90 * (i + 1) as f64 / sets.len() as f64;
        let [r, g, b] =
            [(255.0, 225.0), (255.0, 155.0), (255.0, 75.0)].map(|(light, dark)| (light - dark * shade) as u8);
        let color = RGBColor(r, g, b);
        chart
            .draw_series([Polygon::new(outline.clone(), color.filled())])?
            .label(format!("gain {}", set.gain))
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], color.filled()));
        let closed: Vec<_> = outline.iter().chain(outline.first()).copied().collect();
        chart.draw_series(LineSeries::new(closed, BLACK.mix(0.5)))?;
    }
    for sign in [-1.0, 1.0] {
        let toward = sign * [Vector2::x(), Vector2::y()][axis];
        let edge = polygon.distance_along(Point2::origin(), toward).unwrap_or(0.0) * sign * pendulum.omega;
        let ends = [(edge, -reach * 1e3), (edge, reach * 1e3)];
        let drawn = chart.draw_series(DashedLineSeries::new(ends, 6, 4, RED.stroke_width(1)))?;
        if sign < 0.0 {
            drawn.label("omega d").legend(|(x, y)| PathElement::new(vec![(x, y), (x + 12, y)], RED.stroke_width(1)));
        }
    }
    if axis == 1 {
        let mut legend = chart.configure_series_labels();
        legend
            .label_font(text(14))
            .position(SeriesLabelPosition::MiddleRight)
            .background_style(WHITE.mix(0.8))
            .draw()?;
    }
    Ok(())
}

/// Boundary of the slice of one axis as (com_vel (m/s), zmp (mm)).
pub fn outline(set: &CpiSet, axis: usize, speed: f64, reach: f64) -> Vec<(f64, f64)> {
    (0..DIRECTIONS)
        .map(|i| {
            let (sin, cos) = (i as f64 / DIRECTIONS as f64 * std::f64::consts::TAU).sin_cos();
            let mut state = [0.0; 6];
            (state[3 * axis + 1], state[3 * axis + 2]) = (cos * speed, sin * reach);
            let size = 1.0 / set.set.gauge(&state);
            (cos * speed * size, sin * reach * size * 1e3)
        })
        .collect()
}
