//! Fig. 3, the nested CPI sets of the gains, and Fig. 4, the CPI sets before and after a footstep.

use super::ground::Ground;
use super::study::{Stand, Study};
use nalgebra::{Isometry2, Point2};
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::OnlineSets;
use standfast::core::lipm::pendulum::State;
use standfast::core::robot::Foot;
use standfast::report::figure::cpi::{leader, slice, spread};
use standfast::report::figure::panel::{Panel, short};

/// Width of a panel (px).
const WIDTH: f64 = 460.0;

/// The panels of Fig. 3.
pub fn inclusion(study: &Study) -> Vec<Panel> {
    vec![
        slice(&study.sets, 0, "COM over the middle of the feet"),
        com_slice(study),
    ]
}

/// The slices of the CPI sets for a COM at rest with the ZMP in the middle, seen from above.
fn com_slice(study: &Study) -> Panel {
    let mut ground = Panel::ground(WIDTH, [0.08, 0.105], "COM at rest, ZMP in the middle");
    for foot in Foot::BOTH {
        ground.sole(
            "sole",
            &study.sole(),
            study.sole_at_home(foot).coords.into(),
        );
    }
    ground.region(&study.home, &study.allowed);
    for (i, slice) in slices(study, &study.allowed).into_iter().enumerate() {
        ground.polygon("slice", slice.iter().copied());
        let x = 0.022 * spread(i, study.sets.len());
        let edge = slice.iter().map(|p| p.y).fold(0.0, f64::min);
        leader(&mut ground, [x, edge], [x, -0.091], &study.sets[i].gain);
    }
    ground
}

/// For each gain, the positions of a COM at rest that the gain's CPI set holds with the ZMP at the origin (m, control
/// frame).
fn slices(study: &Study, allowed: &SupportPolygon) -> Vec<Vec<Point2<f64>>> {
    let mut sets = OnlineSets::new(&study.design.family);
    sets.update(allowed);
    (0..study.design.family.gains.len())
        .map(|gain| sets.slice(gain, &State::default()))
        .collect()
}

/// The panels of Fig. 4.
pub fn regions(study: &Study) -> Vec<Panel> {
    let pushed = &study.pushes[0];
    let (lift, landing) = (&pushed.lift, &pushed.landing);
    vec![
        region(study, "Before", lift, &study.allowed, None),
        region(
            study,
            "After the landing",
            landing,
            &study.landed_allowed,
            Some(&lift.frame),
        ),
    ]
}

/// The contact region and the CPI sets of a state, in its control frame. Thin dashed lines show where the soles stood
/// at home, if the control frame of that time, `old`, is given.
fn region(
    study: &Study,
    what: &str,
    stand: &Stand,
    allowed: &SupportPolygon,
    old: Option<&Isometry2<f64>>,
) -> Panel {
    let title = format!("{what}, t = {} s", short(stand.time_s, 3));
    let (mut ground, sole) = (Panel::ground(WIDTH, [0.155, 0.125], &title), study.sole());
    let into = stand.frame.inverse();
    for foot in Foot::BOTH {
        let pose = into * stand.soles[foot];
        ground.sole("sole", &sole, pose);
        ground.text(
            "small halo",
            pose * Point2::new(0.0, 0.049 * foot.side()),
            [0.0, 0.0],
            foot.name(),
        );
    }
    if let Some(old) = old {
        for foot in Foot::BOTH {
            ground.sole(
                "sole ghost",
                &sole,
                into * old * Isometry2::from(study.sole_at_home(foot).coords),
            );
        }
        let origin = into * old * Point2::origin();
        ground.circle("plan", origin, 3.5);
        // The name stands where nothing else is drawn, behind the old soles.
        ground.line("plan hair", origin, [-0.135, origin.y]);
        ground.text(
            "plan small halo",
            [-0.14, origin.y],
            [0.0, 0.0],
            "old origin",
        );
    }
    ground.region(&stand.polygon, allowed);
    for slice in slices(study, allowed) {
        ground.polygon("slice", slice);
    }
    for (to, name) in [([0.035, 0.0], "x"), ([0.0, 0.035], "y")] {
        ground.arrow("axis", [0.0, 0.0], to);
        ground.text("small halo", to.map(|m| 1.28 * m), [0.0, 4.0], name);
    }
    ground
}
