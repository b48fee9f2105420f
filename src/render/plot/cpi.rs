//! Picture of nested CPI sets.
//!
//! The slice com = 0 in the plane of com_vel and zmp, one panel for each axis: a robot at rest sits at the centre, an
//! impulse moves it along the horizontal line, and the ZMP is what the controller moves.

use crate::error::{Error, Result};
use crate::lipm::CpiSet;
use plotters::prelude::*;
use std::path::Path;

/// Directions in which the boundary of a slice is looked for.
const DIRECTIONS: usize = 720;
/// Width and height (px).
const SIZE: (u32, u32) = (1000, 460);

/// Draws the sets (slow to fast, largest first) into an SVG file. Errors: the file cannot be written.
pub fn write(file: &Path, sets: &[CpiSet]) -> Result<()> {
    let mut svg = String::new();
    draw_panels(&mut svg, sets).map_err(|problem| Error::Numeric { what: "plot".into(), problem })?;
    std::fs::write(file, svg).map_err(|source| Error::Write { path: file.into(), source })
}

fn draw_panels(svg: &mut String, sets: &[CpiSet]) -> Result<(), String> {
    let Some(first) = sets.first() else { return Err("no sets".into()) };
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE).map_err(|e| e.to_string())?;
    let panels = root.split_evenly((1, 2));
    for (axis, panel) in panels.iter().enumerate() {
        let name = ["x", "y"][axis];
        let reach = first.polygon.vertices().iter().map(|v| v.coords[axis].abs()).fold(0.0, f64::max) * 1.15;
        let speed = reach * first.pendulum.omega;
        // The legend stands beside the sets of the last panel.
        let room = if axis == 1 { 1.6 } else { 1.0 };
        let mut chart = ChartBuilder::on(panel)
            .caption(format!("{name} axis, slice com = 0"), ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(56)
            .build_cartesian_2d(-speed..speed * room, -reach * 1e3..reach * 1e3)
            .map_err(|e| e.to_string())?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc(format!("com_vel_{name} [m/s]"))
            .y_desc(format!("zmp_{name} [mm]"))
            .draw()
            .map_err(|e| e.to_string())?;
        for (i, set) in sets.iter().enumerate() {
            let outline = outline(set, axis, speed, reach);
            let shade = 0.10 + 0.90 * (i + 1) as f64 / sets.len() as f64;
            let color =
                RGBColor((255.0 - 225.0 * shade) as u8, (255.0 - 155.0 * shade) as u8, (255.0 - 75.0 * shade) as u8);
            chart
                .draw_series([Polygon::new(outline.clone(), color.filled())])
                .map_err(|e| e.to_string())?
                .label(format!("gain {}", set.gain))
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], color.filled()));
            let closed: Vec<_> = outline.iter().chain(outline.first()).copied().collect();
            chart.draw_series(LineSeries::new(closed, BLACK.mix(0.5))).map_err(|e| e.to_string())?;
        }
        let edge = |sign: f64| {
            let d = if axis == 0 { nalgebra::Vector2::x() } else { nalgebra::Vector2::y() } * sign;
            first.polygon.distance_along(nalgebra::Point2::origin(), d).unwrap_or(0.0) * sign * first.pendulum.omega
        };
        for (k, v) in [edge(-1.0), edge(1.0)].into_iter().enumerate() {
            let line = DashedLineSeries::new([(v, -reach * 1e3), (v, reach * 1e3)], 6, 4, RED.stroke_width(1));
            let drawn = chart.draw_series(line).map_err(|e| e.to_string())?;
            if k == 0 {
                drawn
                    .label("omega d")
                    .legend(|(x, y)| PathElement::new(vec![(x, y), (x + 12, y)], RED.stroke_width(1)));
            }
        }
        if axis == 1 {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::MiddleRight)
                .background_style(WHITE.mix(0.8))
                .draw()
                .map_err(|e| e.to_string())?;
        }
    }
    root.present().map_err(|e| e.to_string())
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
