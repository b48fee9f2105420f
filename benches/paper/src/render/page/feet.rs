//! Fig. 6, which foot swings and how far, for the paper's two examples and for all directions. Also the part of Fig. 7
//! that shows how the feet stand.

use super::footwork::{Choice, EXAMPLES_DEG};
use super::ground::Ground;
use super::study::Study;
use nalgebra::{Point2, Vector2};
use standfast::core::robot::Foot;
use standfast::report::figure::panel::{Panel, PanelPoint, short};

/// Width of a panel (px).
const WIDTH: f64 = 460.0;

/// The panels of Fig. 6.
pub fn decision(study: &Study) -> Vec<Panel> {
    let [a, b] = EXAMPLES_DEG.map(|deg| study.choice(deg));
    vec![
        example(study, &a, "(A)"),
        example(study, &b, "(B)"),
        fan(study),
    ]
}

/// Outline of D_L or D_R (eq. 27, 28), from the middle of the feet (m; x forward, y left).
fn range(study: &Study, foot: Foot) -> Vec<Point2<f64>> {
    let (range, stance) = (&study.rules.range, study.sole_at_home(foot.other()));
    let mut arc = Vec::new();
    for i in 0..=60 {
        let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 60.0).sin_cos();
        let outward = range.least_m + (range.outward_m - range.least_m) * sin;
        arc.push(stance + Vector2::new(range.forward_m * cos, foot.side() * outward));
    }
    arc
}

/// An example: both ranges, the arrow of each foot, and the landing place of the chosen one.
fn example(study: &Study, choice: &Choice, name: &str) -> Panel {
    let Choice {
        direction,
        reach,
        chosen,
    } = choice;
    let title = format!(
        "{name}  |\u{394}L| = {} {} |\u{394}R| = {} mm: {} foot",
        short(1e3 * reach.left, 0),
        if reach.left >= reach.right {
            "\u{2265}"
        } else {
            "<"
        },
        short(1e3 * reach.right, 0),
        chosen.map_or("no", |(foot, _)| foot.name())
    );
    let (mut ground, sole) = (Panel::ground(WIDTH, [0.16, 0.168], &title), study.sole());
    for foot in Foot::BOTH {
        ground.polygon(&format!("{} reach", foot.name()), range(study, foot));
    }
    for foot in Foot::BOTH {
        ground.sole("sole", &sole, study.sole_at_home(foot).coords.into());
        if let Some((_, to)) = chosen.filter(|(chosen, _)| *chosen == foot) {
            ground.sole("sole ghost", &sole, to.coords.into());
        }
    }
    for (foot, way, range) in [
        (Foot::Left, "\u{394}L", "D_L"),
        (Foot::Right, "\u{394}R", "D_R"),
    ] {
        let class = format!("{} halo", foot.name());
        let center = study.sole_at_home(foot);
        let end = center + direction * reach[foot];
        ground.arrow(foot.name(), center, end);
        let beside = Vector2::new(0.008 * direction.x.signum(), 0.012 * direction.y.signum());
        ground.text(&class, end + beside, [0.0, 4.0], way);
        ground.text(&class, [-0.075, foot.side() * 0.075], [0.0, 0.0], range);
    }
    ground.arrow("push", [0.0, 0.0], direction * 0.05);
    ground.text("push halo", direction * 0.062, [0.0, 4.0], "d");
    ground
}

/// How far each foot can go in every direction, with the chosen foot as colour.
fn fan(study: &Study) -> Panel {
    let mut ground = Panel::ground(
        WIDTH,
        [0.16, 0.168],
        "All directions: how far each foot can go",
    );
    let tip = |choice: &Choice, foot: Foot| PanelPoint::from(choice.direction * choice.reach[foot]);
    let fan: Vec<Choice> = (0..=720)
        .map(|half_deg| study.choice(0.5 * f64::from(half_deg)))
        .collect();
    // A sector spans one degree, and has the colour of the foot that is chosen in its middle.
    for sector in fan.windows(3).step_by(2) {
        if let Some((foot, _)) = sector[1].chosen {
            let outline = [[0.0, 0.0], tip(&sector[0], foot), tip(&sector[2], foot)];
            ground.polygon(&format!("{} sector", foot.name()), outline);
        }
    }
    for foot in Foot::BOTH {
        ground.polyline(
            foot.name(),
            fan.iter().step_by(2).map(|choice| tip(choice, foot)),
        );
        let class = format!("{} halo", foot.name());
        ground.text(
            &class,
            [-0.112, foot.side() * 0.1],
            [0.0, 0.0],
            &format!("{} foot", foot.name()),
        );
    }
    let imposed = study.errors.iter().map(|run| run.record.zmp_error_m);
    let pushed = study
        .pushes
        .iter()
        .map(|pushed| pushed.footstep.zmp_error_m.unwrap_or_default());
    for (error, name) in imposed.chain(pushed).zip(["8 (a)", "8 (b)", "12", "13"]) {
        let direction = Vector2::from(error).normalize();
        ground.arrow("push", direction * 0.115, direction * 0.132);
        // A name near the edge is moved below its arrow, so that it stays in the frame.
        let beyond = (ground.view.at(direction * 0.148)[0] - (WIDTH - 48.0)).max(0.0);
        let offset = [-beyond, if beyond > 0.0 { 15.0 } else { 4.0 }];
        ground.text(
            "push small halo",
            direction * 0.148,
            offset,
            &format!("Fig. {name}"),
        );
    }
    ground
}

/// The initial placement of the feet, in a panel of a given width (px).
pub fn placement(study: &Study, width: f64) -> Panel {
    let mut ground = Panel::ground(width, [0.115, 0.11], "Initial foot placement");
    let mm = |m: f64| format!("{} mm", short(1e3 * m, 1));
    for foot in Foot::BOTH {
        let center = study.sole_at_home(foot);
        ground.sole("sole", &study.sole(), center.coords.into());
        ground.circle("frame", center, 3.0);
        ground.text(
            "",
            center + Vector2::new(0.018, 0.0),
            [0.0, 0.0],
            foot.name(),
        );
    }
    ground.polygon("support", study.home.vertices().iter().copied());
    let ([length, breadth], side) = (study.robot.soles.left.half_m, 0.5 * study.stance.y);
    ground.arrow("axis", [-0.022, side], [-0.022, -side]);
    ground.arrow("axis", [-0.022, -side], [-0.022, side]);
    ground.text("small halo", [-0.031, 0.0], [0.0, 0.0], &mm(2.0 * side));
    ground.text(
        "small",
        [length + 0.006, side],
        [0.0, 0.0],
        &mm(2.0 * breadth),
    );
    ground.turned_text(
        "small",
        [0.0, side + breadth + 0.006],
        -90.0,
        &mm(2.0 * length),
    );
    ground.circle("com", study.com, 4.0);
    ground.text(
        "com small halo",
        study.com + Vector2::new(0.008, 0.0),
        [0.0, 0.0],
        "COM",
    );
    ground
}
