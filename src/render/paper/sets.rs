//! Fig. 3, the sets of the gains one in the other, and Fig. 4, the sets before a footstep and after.

use super::super::html::svg::short;
use super::panel::{At, Axes, GroundPlan, Panel};
use super::study::{Stand, Study};
use crate::geometry::SupportPolygon;
use crate::lipm::OnlineSets;
use crate::lipm::cpi_set::CpiSet;
use crate::lipm::pendulum::State;
use crate::render::plot::cpi as cpi_plot;
use crate::robot::Foot;
use nalgebra::{Isometry2, Point2};

const WIDTH: f64 = 460.0;

/// Fig. 3.
pub fn inclusion(study: &Study) -> Vec<Panel> {
    vec![velocity_slice(study), com_slice(study)]
}

/// Slice com = 0 of the fore and aft axis.
fn velocity_slice(study: &Study) -> Panel {
    let (sets, omega) = (&study.sets, study.design.family.pendulum.omega);
    let most = study.home.vertices().iter().map(|v| v.x).fold(0.0, f64::max);
    let (reach, speed) = (1.18 * most, 1.18 * most * omega);
    let mut panel = Panel::new(WIDTH, 430.0);
    let axes = Axes { x: [-speed, speed], y: [-1e3 * reach, 1e3 * reach], frame: [60.0, 34.0, WIDTH - 8.0, 380.0] };
    axes.draw(&mut panel, "COM velocity, forward [m/s]", "ZMP, forward [mm]");
    panel.text("title start", [60.0, 20.0], "COM over the middle of the feet");
    for set in sets {
        panel.polygon("slice", &axes.all(cpi_plot::outline(set, 0, speed, reach).into_iter().map(At::from)));
    }
    for (i, set) in sets.iter().enumerate() {
        let zmp = 0.45 * reach * spread(i, sets.len());
        let to = axes.at([edge(set, speed, zmp), 1e3 * zmp]);
        leader(&mut panel, to, axes.at([0.87 * speed, 1e3 * zmp]), &set.gain);
    }
    let limit = most - study.design.family.zmp_margin;
    for side in [-1.0, 1.0] {
        let x = side * omega * limit;
        panel.line("limit", axes.at([x, -1e3 * reach]), axes.at([x, 1e3 * reach]));
        panel.line("allowed", axes.at([-speed, side * 1e3 * limit]), axes.at([speed, side * 1e3 * limit]));
    }
    let [x, y] = axes.at([omega * limit, -1e3 * reach]);
    panel.text("limit end halo small", [x - 5.0, y - 8.0], "\u{3c9} d: most with the ZMP within d");
    panel
}

/// Slice of a resting COM with the ZMP in the middle, seen from above.
fn com_slice(study: &Study) -> Panel {
    let mut ground = GroundPlan::new(WIDTH, 0.08, 0.105, "COM at rest, ZMP in the middle");
    for foot in Foot::BOTH {
        ground.sole("sole", &study.sole(), study.sole_at_home(foot).coords.into());
    }
    ground.region(&study.home, &study.allowed);
    for (i, slice) in slices(study, &study.allowed).into_iter().enumerate() {
        ground.polygon("slice", slice.iter().copied());
        let x = 0.022 * spread(i, study.sets.len());
        let edge = slice.iter().map(|p| p.y).fold(0.0, f64::min);
        let (to, name) = (ground.at([x, edge]), ground.at([x, -0.091]));
        leader(&mut ground.panel, to, name, &study.sets[i].gain);
    }
    ground.panel
}

/// From 1 for the first to -1 for the last.
fn spread(i: usize, count: usize) -> f64 {
    1.0 - 2.0 * i as f64 / (count - 1).max(1) as f64
}

/// For each gain, where a resting COM may be with the ZMP at the origin, control frame.
fn slices(study: &Study, allowed: &SupportPolygon) -> Vec<Vec<Point2<f64>>> {
    let mut sets = OnlineSets::new(&study.design.family);
    sets.update(allowed);
    (0..sets.len()).map(|gain| sets.slice(gain, &State::default())).collect()
}

/// A name with a line to where it belongs.
fn leader(panel: &mut Panel, to: At, name: At, words: &str) {
    panel.line("slice", to, name);
    panel.circle("slice", to, 2.0);
    panel.text("slice small start", [name[0] + 4.0, name[1] + 4.0], words);
}

/// The largest velocity of a COM over the middle (m/s, up to `most`) that a set holds with a ZMP (m), fore and aft.
fn edge(set: &CpiSet, most: f64, zmp: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, most);
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        let holds = set.set.contains(&[0.0, middle, zmp, 0.0, 0.0, 0.0]);
        *(if holds { &mut inside } else { &mut outside }) = middle;
    }
    inside
}

/// Fig. 4.
pub fn regions(study: &Study) -> Vec<Panel> {
    let pushed = &study.pushes[0];
    let (lift, landing) = (&pushed.lift, &pushed.landing);
    vec![
        region(study, "Before", lift, &study.allowed, None),
        region(study, "After the landing", landing, &study.landed_allowed, Some(&lift.frame)),
    ]
}

/// A stand in its control frame; thinly dashed, in the frame `old`, where the soles were at home.
fn region(study: &Study, what: &str, stand: &Stand, allowed: &SupportPolygon, old: Option<&Isometry2<f64>>) -> Panel {
    let title = format!("{what}, t = {} s", short(stand.time_s, 3));
    let (mut ground, sole) = (GroundPlan::new(WIDTH, 0.155, 0.125, &title), study.sole());
    let into = stand.frame.inverse();
    for foot in Foot::BOTH {
        let pose = into * stand.soles[foot];
        ground.sole("sole", &sole, pose);
        ground.text("small halo", pose * Point2::new(0.0, 0.049 * foot.side()), 0.0, foot.name());
    }
    if let Some(old) = old {
        for foot in Foot::BOTH {
            ground.sole("sole ghost", &sole, into * old * Isometry2::from(study.sole_at_home(foot).coords));
        }
        let [x, y] = ground.at(into * old * Point2::origin());
        ground.panel.circle("plan", [x, y], 3.5);
        // In the free ground below the soles that were.
        let [_, below] = ground.at([-0.14, 0.0]);
        ground.panel.line("plan hair", [x, y], [x, below - 12.0]);
        ground.panel.text("plan small halo", [x, below], "old origin");
    }
    ground.region(&stand.polygon, allowed);
    for slice in slices(study, allowed) {
        ground.polygon("slice", slice);
    }
    for (to, name) in [([0.035, 0.0], "x"), ([0.0, 0.035], "y")] {
        ground.arrow("axis", [0.0, 0.0], to);
        ground.text("small halo", to.map(|m| 1.28 * m), 4.0, name);
    }
    ground.panel
}
