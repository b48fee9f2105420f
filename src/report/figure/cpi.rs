//! A picture of nested CPI sets, as in the paper's Fig. 3, in the plane of COM velocity (horizontal) and ZMP
//! (vertical). A robot at rest is in the middle. An impulse moves it along the horizontal line, and the controller
//! moves the ZMP. Dashed lines show the CPI sets of the same gains without disturbances, if the CPI sets are robust.

use super::axes::Axis;
use super::panel::{Panel, PanelPoint};
use nalgebra::{Point2, Vector2};
use standfast_core::error::Result;
use standfast_core::lipm::CpiSet;
use std::path::Path;

/// Number of directions in which the boundary of a slice is computed.
const DIRECTIONS: usize = 720;
/// End of the axes, as a multiple of the largest ZMP.
const ROOM: f64 = 1.25;
/// Approximate width of a letter (px).
const LETTER: f64 = 7.0;

/// Draws the CPI sets of a gain set (slow to fast, largest first) and, if there are any, the CPI sets of the same gains
/// without disturbances. Fails if the file cannot be written.
pub fn write(path: &Path, gain_set: &str, sets: &[CpiSet], undisturbed: &[CpiSet]) -> Result<()> {
    let titles = ["Fore and aft (\u{3c9}: natural frequency)", "Sideways"];
    let panels = [0, 1].map(|axis| {
        let mut panel = slice(sets, axis, titles[axis]);
        for set in undisturbed {
            let [speed, reach] = ends(set, axis);
            panel.polygon("slice undisturbed", outline(set, axis, speed, reach));
        }
        if let Some(set) = undisturbed.first() {
            let bottom = -1e3 * ends(set, axis)[1];
            panel.text(
                "slice small",
                [0.0, bottom],
                [0.0, -24.0],
                "dashed: without disturbances",
            );
        }
        panel
    });
    let robust = if undisturbed.is_empty() {
        ""
    } else {
        "robust "
    };
    let heading = format!(
        "Maximal {robust}CPI sets of gain set {gain_set}, with the COM over the middle of the feet"
    );
    super::write(path, &heading, &panels, 2)
}

/// The slice at com = 0 along an axis (0: x, 1: y), in the plane of COM velocity and ZMP.
pub fn slice(sets: &[CpiSet], axis: usize, title: &str) -> Panel {
    let mut panel = Panel::new(460.0, 430.0);
    let Some(first) = sets.first() else {
        return panel;
    };
    let (pendulum, [least, most], [speed, reach]) =
        (first.pendulum, edges(first, axis), ends(first, axis));
    let letters = sets
        .iter()
        .map(|set| set.gain.chars().count())
        .max()
        .unwrap_or(0);
    let right = panel.width - 14.0 - LETTER * letters as f64;
    let way = ["forward", "to the left"][axis];
    let x = Axis::new(&format!("COM velocity, {way} [m/s]"), [-speed, speed]);
    let y = Axis::new(&format!("ZMP, {way} [mm]"), [-1e3 * reach, 1e3 * reach]);
    panel.text("title start", [60.0, 20.0], [0.0, 0.0], title);
    panel.axes([60.0, 34.0, right, 380.0], &x, &y);
    for set in sets {
        panel.polygon("slice", outline(set, axis, speed, reach));
    }
    for (i, set) in sets.iter().enumerate() {
        let zmp = 0.5 * (least + most) + 0.36 * (most - least) * spread(i, sets.len());
        let edge = largest_velocity(set, axis, speed, zmp);
        leader(&mut panel, [edge, 1e3 * zmp], [speed, 1e3 * zmp], &set.gain);
        if i == 0 {
            panel.text("start tick", [speed, 1e3 * zmp], [4.0, -12.0], "gain");
        }
    }
    for zmp in [least, most] {
        let velocity = pendulum.omega * zmp;
        panel.line("limit", [velocity, -1e3 * reach], [velocity, 1e3 * reach]);
        panel.line("allowed", [-speed, 1e3 * zmp], [speed, 1e3 * zmp]);
    }
    let words = "\u{3c9}d: beyond, a footstep is needed";
    let words_of_d = "d: edge for the ZMP";
    panel.text("halo small", [0.0, 1e3 * most], [0.0, -5.0], words_of_d);
    panel.text(
        "limit end halo small",
        [pendulum.omega * most, -1e3 * reach],
        [-5.0, -8.0],
        words,
    );
    panel
}

/// How far the ZMP can move to both edges along an axis (m).
fn edges(set: &CpiSet, axis: usize) -> [f64; 2] {
    let ahead = [Vector2::x(), Vector2::y()][axis];
    [-1.0, 1.0].map(|sign| {
        sign * set
            .polygon
            .distance_along(Point2::origin(), sign * ahead)
            .unwrap_or(0.0)
    })
}

/// Ends of the axes of a slice: COM velocity (m/s) and ZMP (m).
fn ends(set: &CpiSet, axis: usize) -> [f64; 2] {
    let [least, most] = edges(set, axis);
    let reach = ROOM * most.max(-least);
    [reach * set.pendulum.omega, reach]
}

/// Draws the name of a CPI set, and a line from the name to the edge of the CPI set.
pub fn leader(panel: &mut Panel, edge: PanelPoint, name: PanelPoint, words: &str) {
    panel.line("slice", edge, name);
    panel.circle("slice", edge, 2.0);
    panel.text("slice small start", name, [4.0, 4.0], words);
}

/// Position of item `i` of `count`, from 1 for the first to -1 for the last.
pub fn spread(i: usize, count: usize) -> f64 {
    1.0 - 2.0 * i as f64 / (count - 1).max(1) as f64
}

/// Boundary of the slice along an axis, as COM velocities (m/s) and ZMPs (mm). `speed` and `reach` are the ends of the
/// axes (m/s, m).
fn outline(set: &CpiSet, axis: usize, speed: f64, reach: f64) -> impl Iterator<Item = PanelPoint> {
    (0..DIRECTIONS).map(move |i| {
        let (sin, cos) = (i as f64 / DIRECTIONS as f64 * std::f64::consts::TAU).sin_cos();
        let size = 1.0 / set.set.gauge(&state(axis, cos * speed, sin * reach));
        [cos * speed * size, sin * reach * size * 1e3]
    })
}

/// The largest COM velocity (m/s, up to `most`) that a CPI set contains together with a ZMP (m).
fn largest_velocity(set: &CpiSet, axis: usize, most: f64, zmp: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        let holds = set.set.contains(&state(axis, middle, zmp));
        *(if holds { &mut inside } else { &mut outside }) = middle;
    }
    inside
}

/// The state with the COM over the origin, and a velocity (m/s) and a ZMP (m) along an axis.
fn state(axis: usize, velocity: f64, zmp: f64) -> [f64; 6] {
    let mut state = [0.0; 6];
    (state[3 * axis + 1], state[3 * axis + 2]) = (velocity, zmp);
    state
}
