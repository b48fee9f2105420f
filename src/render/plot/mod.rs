//! Pictures (SVG) of results, a file for each; here is what they share: colours, and how they are written.

pub mod cpi;
pub mod limit;
pub mod motion;
pub mod response;
pub mod success;

use crate::error::{Error, Result};
use crate::files::write_atomic;
use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
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

/// Text in ink. `size` in units of the drawing.
fn text(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// Text beside a place, to the right of it and as high, more or less faint.
fn beside(size: i32, opacity: f64) -> TextStyle<'static> {
    let color = INK.mix(opacity).to_backend_color();
    TextStyle { color, ..text(size).pos(Pos::new(HPos::Left, VPos::Center)) }
}

/// Axes with faint lines at their labels. `px`: units of the drawing to the pixel.
fn axes<'a, X, Y, XT, YT>(mesh: &mut MeshStyle<'a, '_, X, Y, SVGBackend<'a>>, px: i32)
where
    X: Ranged<ValueType = XT> + ValueFormatter<XT>,
    Y: Ranged<ValueType = YT> + ValueFormatter<YT>,
{
    mesh.bold_line_style(FAINT.stroke_width(px as u32))
        .light_line_style(TRANSPARENT)
        .axis_style(INK.stroke_width(px as u32))
        .label_style(text(14 * px))
        .axis_desc_style(text(15 * px));
}
