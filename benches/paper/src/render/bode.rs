//! A picture of a frequency response: gain above, phase below, with the limits that define the bandwidth.

use crate::render::response::Response;
use crate::response::Point;
use standfast::core::error::Result;
use standfast::report::figure;
use standfast::report::figure::axes::Axis;
use standfast::report::figure::panel::{Panel, PanelPoint, short};
use std::path::Path;

/// Frequencies with a number on the axis.
const LABELLED_HZ: [f64; 9] = [0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0];

/// Draws the response, and the fastest pole of the gains. Fails if the file cannot be written.
pub fn write(path: &Path, response: &Response) -> Result<()> {
    let pole_hz = response.fastest_pole_rad_s() / std::f64::consts::TAU;
    let gain = panel(
        &response.points,
        ("gain", "dB"),
        -3.0,
        |p| 20.0 * p.gain.log10(),
        pole_hz,
    );
    let phase = panel(
        &response.points,
        ("phase", "degrees"),
        -45.0,
        |p| p.phase_deg,
        pole_hz,
    );
    let heading = format!(
        "How the ZMP follows the commanded ZMP: gain set {}, {} axis",
        response.family.name,
        response.axis_name()
    );
    figure::write(path, &heading, &[gain, phase], 1)
}

/// The panel of one quantity over frequency, with the limit of its bandwidth.
fn panel(
    points: &[Point],
    (quantity, unit): (&str, &str),
    limit: f64,
    of: fn(&Point) -> f64,
    pole_hz: f64,
) -> Panel {
    let ends = |values: &mut dyn Iterator<Item = f64>, from: PanelPoint| -> PanelPoint {
        values.fold(from, |[low, high], value| [low.min(value), high.max(value)])
    };
    let [low, high] = ends(&mut points.iter().map(of), [limit, 0.0]);
    let hz = ends(
        &mut points.iter().map(|p| p.frequency_hz),
        [0.5, pole_hz.max(20.0)],
    );
    let room = 0.1 * (high - low);
    let mut panel = Panel::new(860.0, 290.0);
    // On the x axis, places are the logarithms of frequencies.
    let ticks = LABELLED_HZ
        .into_iter()
        .filter(|labelled| (hz[0]..=hz[1]).contains(labelled))
        .map(|labelled| (labelled.log10(), short(labelled, 1)))
        .collect();
    let (from, to) = (hz[0].log10(), hz[1].log10());
    let x = Axis {
        name: "frequency [Hz]".into(),
        ends: [from, to],
        ticks,
    };
    panel.axes(
        [60.0, 10.0, 844.0, 246.0],
        &x,
        &Axis::new(&format!("{quantity} [{unit}]"), [low - room, high + room]),
    );
    panel.line("limit", [from, limit], [to, limit]);
    panel.text(
        "limit start small halo",
        [from, limit],
        [6.0, -5.0],
        &format!("bandwidth: down to {} {unit}", short(limit, 0)),
    );
    panel.line(
        "axis thin",
        [pole_hz.log10(), low - room],
        [pole_hz.log10(), high + room],
    );
    let words = format!("fastest pole of the gains, {} Hz", short(pole_hz, 1));
    panel.text(
        "small start halo",
        [pole_hz.log10(), low - room],
        [5.0, -6.0],
        &words,
    );
    let place = |p: &Point| [p.frequency_hz.log10(), of(p)];
    panel.polyline("s0", points.iter().map(place));
    for point in points {
        panel.circle("s0", place(point), 4.0);
    }
    panel
}
