//! Fig. 6: which foot swings, and how far: the paper's two examples, and all directions.

use super::super::html::svg::short;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure};
use super::panel::{At, Ground, Panel};
use super::study::{Pushed, Study};
use crate::control::step::PlannedFootstep;
use crate::control::step::paper::{StanceState, choose};
use crate::lipm::pendulum::State;
use crate::robot::{Foot, GRAVITY, PerFoot};
use nalgebra::{Isometry2, Point2, Vector2};
use serde_json::json;

const WIDTH: f64 = 460.0;
/// Directions of the examples (degrees): the paper's arrows are in its picture only.
const EXAMPLES_DEG: [f64; 2] = [45.0, -45.0];
/// Of the fan (degrees).
const STEP_DEG: usize = 1;
/// Ways that differ by less are equal, as for the controller (m).
const TIE_M: f64 = 1e-4;
/// So far ahead a ZMP is looked for (s).
const AHEAD_S: f64 = 3.0;
/// Finer, to find where the foot changes (parts of a degree).
const PARTS: u32 = 10;

/// The feet at home, on which the decision is made.
pub struct Home<'a> {
    study: &'a Study,
    stance: Vector2<f64>,
}

impl<'a> Home<'a> {
    pub fn new(study: &'a Study) -> Self {
        Self { study, stance: study.stance() }
    }

    /// The paper's procedure for a ZMP error (m), both feet equally loaded.
    pub fn choose(&self, zmp_error: Vector2<f64>) -> Option<PlannedFootstep> {
        let load_n = 0.5 * GRAVITY * self.study.robot.mass();
        self.choose_under(PerFoot { left: load_n, right: load_n }, zmp_error)
    }

    /// The same with a load on each foot (N), which decides a tie.
    fn choose_under(&self, load_n: PerFoot<f64>, zmp_error: Vector2<f64>) -> Option<PlannedFootstep> {
        let necessity = StanceState {
            frame: &Isometry2::identity(),
            soles: PerFoot::from_fn(|foot| self.center(foot)),
            stance: self.stance,
            zmp_error,
            load_n,
            can_lift: PerFoot { left: true, right: true },
        };
        choose(&self.study.rules, &necessity)
    }

    /// How far the foot of the paper's procedure is sent (m; x forward, y left).
    pub fn stride(&self, zmp_error: Vector2<f64>) -> Option<Vector2<f64>> {
        self.choose(zmp_error).map(|footstep| footstep.to - self.center(footstep.foot))
    }

    /// Whether two ways are equal for the choice of the foot.
    pub fn is_tie([left, right]: [f64; 2]) -> bool {
        (left - right).abs() <= TIE_M
    }

    fn center(&self, foot: Foot) -> Point2<f64> {
        Point2::from(0.5 * foot.side() * self.stance)
    }

    /// Length of Delta_max of a foot (m).
    fn reach(&self, foot: Foot, direction: Vector2<f64>) -> f64 {
        let side = |v: Vector2<f64>| Vector2::new(v.x, v.y * foot.side());
        self.study.rules.range.reach(side(self.stance * foot.side()), side(direction))
    }

    /// Lengths of Delta_max of the left and the right foot along an error (m).
    pub fn reaches(&self, zmp_error: Vector2<f64>) -> [f64; 2] {
        Foot::BOTH.map(|foot| zmp_error.try_normalize(0.0).map_or(0.0, |direction| self.reach(foot, direction)))
    }

    /// Outline of D_L or D_R (eq. 27, 28), seen from the middle of the feet (m).
    fn range(&self, foot: Foot) -> Vec<At> {
        let range = &self.study.rules.range;
        let stance = self.center(foot.other());
        let arc = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 60.0).sin_cos();
            let outward = range.least_m + (range.outward_m - range.least_m) * sin;
            [stance.x + range.forward_m * cos, stance.y + foot.side() * outward]
        };
        (0..=60).map(arc).collect()
    }
}

fn unit(degrees: f64) -> Vector2<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vector2::new(cos, sin)
}

/// The ZMP error at the lift of a pushed run if far and near were by plain distance (m, control frame), and the footstep
/// that it would ask for. None: there is none.
pub fn by_plain_distance(study: &Study, pushed: &Pushed) -> Option<(Vector2<f64>, PlannedFootstep)> {
    let (stand, family) = (pushed.watch.lift.as_ref()?, &study.design.family);
    let allowed = stand.support.polygon?.inset(family.zmp_margin)?;
    let State { x, y } = stand.state;
    let mut state = State::new(Point2::new(x[0], y[0]), Vector2::new(x[1], y[1]), allowed.nearest(stand.state.zmp()));
    let mut farthest = Vector2::<f64>::zeros();
    for _ in 0..(AHEAD_S / family.pendulum.dt) as usize {
        let outside = state.zmp() - allowed.nearest(state.zmp());
        if outside.norm() > farthest.norm() {
            farthest = outside;
        }
        state = family.gains[0].successor(&state);
    }
    Some((farthest, Home::new(study).choose_under(stand.load_n, farthest)?))
}

/// Of all footsteps of the runs on this page: how many eq. 29 gives all that the range has, and how many there are.
fn at_most(home: &Home) -> [usize; 2] {
    let study = home.study;
    let records = study.pushes.iter().map(|pushed| &pushed.film.record);
    let records = records.chain(study.headings.iter().chain(&study.like_imposed).map(|tried| &tried.record));
    let imposed = study.errors.iter().map(|run| &run.record).chain(&study.moving);
    let footsteps: Vec<_> = records.flat_map(|record| &record.footsteps).collect();
    let footsteps = footsteps.into_iter().chain(imposed.flat_map(|record| &record.footsteps));
    let asks = footsteps.map(|footstep| {
        let error = Vector2::from(footstep.zmp_error_m);
        let reach = home.reach(footstep.foot, error.normalize());
        study.rules.alpha * error.norm() >= reach
    });
    let asks: Vec<bool> = asks.collect();
    [asks.iter().filter(|most| **most).count(), asks.len()]
}

/// Fig. 6.
pub fn figure(study: &Study) -> Figure {
    let home = Home::new(study);
    let rules = &study.rules;
    let saturates_m = |degrees: f64| {
        let direction = unit(degrees);
        home.reach(Foot::Left, direction).max(home.reach(Foot::Right, direction)) / rules.alpha
    };
    let chosen = |degrees: f64| home.choose(unit(degrees) * 0.03).map(|footstep| footstep.foot);
    // Near fore and aft the foot on the other side may go farther: it goes inward, where its range is longer.
    let crosses = |deg: f64| chosen(deg) == Some(Foot::Right) || chosen(-deg) == Some(Foot::Left);
    let tenths = 1..90 * PARTS;
    let near_deg = |mirror: fn(f64) -> f64| {
        let crossing = tenths.clone().map(|i| f64::from(i) / f64::from(PARTS)).filter(|deg| crosses(mirror(*deg)));
        crossing.fold(0.0, f64::max)
    };
    let other_side_deg = near_deg(|deg| deg).max(near_deg(|deg| 180.0 - deg));
    let tie = chosen(0.0);
    let name = |foot: Option<Foot>| foot.map_or("no", Foot::name);
    let [a, b] = EXAMPLES_DEG;
    let told = |degrees: f64| {
        let reach = Foot::BOTH.map(|foot| short(1e3 * home.reach(foot, unit(degrees)), 0));
        format!("left {} mm, right {} mm: the {} foot", reach[0], reach[1], name(chosen(degrees)))
    };
    let lengths = |degrees: f64| home.reaches(unit(degrees));
    let in_json = |deg: f64| json!({ "direction_deg": deg, "foot": chosen(deg), "reach_left_right_m": lengths(deg) });
    let [limited, all] = at_most(&home);
    let mm = |[x, y]: [f64; 2]| format!("({}, {}) mm", short(1e3 * x, 1), short(1e3 * y, 1));
    let diagonal = &study.pushes[1];
    let of_diagonal = diagonal.film.record.footsteps.first().map_or("none".into(), |f| mm(f.zmp_error_m));
    let by_distance = by_plain_distance(study, diagonal).map_or("none".into(), |(error, _)| mm(error.into()));
    let claims = vec![
        Claim::open(
            Quote(
                "When d is given by the arrow shown in (A) of Fig. 6 \u{2026} the left foot is chosen. On the other hand, \
                 when d is given by the arrow shown in (B) \u{2026} the right foot is chosen.",
                "Sect. V.B",
            ),
            format!(
                "The arrows are in the paper's picture only; the directions here are chosen to be like its words. (A) {} \
                 degrees from forward to the left: {}; (B) {} degrees: {}.",
                short(a, 0),
                told(a),
                short(b, 0),
                told(b)
            ),
        ),
        Claim::judged(
            Quote(
                "if \u{2016}\u{394}L_max\u{2016} \u{2265} \u{2016}\u{394}R_max\u{2016}, the left foot is chosen as \
                   swinging foot. Otherwise, the right foot is chosen.",
                "Sect. V.B, step 4",
            ),
            tie == Some(Foot::Left),
            "So it is, also for a tie: an error straight fore or aft.".into(),
            format!(
                "So it is but for a tie, an error straight fore or aft: the paper's own \
                 experiment (Fig. 12) then moves the right foot. \
                 Here the less loaded foot goes, with equal loads the {} one. {}",
                name(tie),
                if other_side_deg > 0.0 {
                    format!(
                        "Up to {} degrees to the side it is the foot on the other side, by the rule itself: \
                         going inward it has the longer way. Beyond, it is the foot on the side of the error.",
                        short(other_side_deg, 1)
                    )
                } else {
                    "In all other directions it is the foot on the side of the error.".into()
                }
            ),
        ),
        Claim::open(
            Remark("\u{3b1} of eq. 29 and a, b, y of eq. 27 and 28 are not printed."),
            format!(
                "Here \u{3b1} = {}, a = {} mm, y = {} mm, b = {} mm. So an error of {} mm straight forward, or \
                 of {} mm to the side, asks for all that the range gives. {limited} of the {all} footsteps of the runs on this \
                 page do: {}.",
                short(rules.alpha, 1),
                short(1e3 * rules.range.forward_m, 0),
                short(1e3 * rules.range.least_m, 0),
                short(1e3 * (rules.range.outward_m - rules.range.least_m), 0),
                short(1e3 * saturates_m(0.0), 1),
                short(1e3 * saturates_m(90.0), 1),
                if limited == all {
                    "the branch of eq. 29 that is proportional to the error is never used"
                } else {
                    "only in the rest the stride is proportional to the error"
                }
            ),
        ),
        Claim::open(
            Remark("The paper does not define the ZMP error \u{394}p_Z."),
            format!(
                "Here: of the ZMPs that the slowest gain is going to ask for the one farthest outside of the region, less the \
                 region's nearest point; far and near by the region's own gauge, towards its middle. In Fig. 13 that is \
                 {of_diagonal}; by plain distance it would be {by_distance}."
            ),
        ),
        Claim::open(
            Quote(
                "we set motion range of the right foot D_L by a semi-ellipsoid assuming the left foot is fixed",
                "Sect. V.B, eq. 27",
            ),
            "Read as its formula has it: D_L is where the left foot may land, seen from the right one.".into(),
        ),
    ];
    Figure {
        number: "6",
        file: "fig06-swing-foot.svg",
        title: "Which foot swings",
        reading: "Seen from above. D_L and D_R: where each foot may land beside the other. An arrow d for the \
        direction (45 degrees to the left of forward in A, to the right in B: a choice of this page) of the ZMP error; from each sole the way along it to the border of its range; dashed, where \
         the chosen foot lands at most. Last: how far each foot can go in every direction, as the distance \
         from the centre; filled with the colour of the foot that is chosen, with the directions of the runs on \
         this page."
            .into(),
        panels: vec![example(&home, a, "(A)"), example(&home, b, "(B)"), fan(&home, study)],
        columns: 3,
        table: None,
        claims,
        numbers: json!({
            "alpha": rules.alpha,
            "examples": EXAMPLES_DEG.map(in_json),
            "tie_foot": tie,
            "footsteps_at_most": limited,
            "footsteps": all,
            "other_side_up_to_deg": other_side_deg,
        }),
    }
}

fn class(foot: Foot) -> &'static str {
    foot.name()
}

fn example(home: &Home, degrees: f64, name: &str) -> Panel {
    let direction = unit(degrees);
    let (mut panel, ground) = Ground::panel(WIDTH, [-0.16, 0.16], [-0.168, 0.168]);
    let chosen = home.choose(direction * home.study.rules.range.outward_m);
    let lengths = home.reaches(direction);
    let relation = if lengths[0] >= lengths[1] { "\u{2265}" } else { "<" };
    let foot = chosen.map_or("no", |footstep| footstep.foot.name());
    let title = format!(
        "{name}  |\u{394}L| = {} {relation} |\u{394}R| = {} mm: {foot} foot",
        short(1e3 * lengths[0], 0),
        short(1e3 * lengths[1], 0)
    );
    ground.draw(&mut panel, &title);
    for foot in Foot::BOTH {
        panel.polygon(&format!("{} range", class(foot)), &ground.all(home.range(foot)));
    }
    for foot in Foot::BOTH {
        let center = home.center(foot);
        panel.polygon("sole", &ground.all(home.study.sole().map(|[x, y]| [x + center.x, y + center.y])));
        if let Some(footstep) = chosen.filter(|footstep| footstep.foot == foot) {
            let landing = home.study.sole().map(|[x, y]| [x + footstep.to.x, y + footstep.to.y]);
            panel.polygon("sole ghost", &ground.all(landing));
        }
    }
    for foot in Foot::BOTH {
        let center = home.center(foot);
        let end = center + direction * home.reach(foot, direction);
        panel.arrow(class(foot), ground.at(center.into()), ground.at(end.into()));
        let [x, y] = ground.at([end.x + 0.008 * direction.x.signum(), end.y + 0.012 * direction.y.signum()]);
        panel.text(
            &format!("{} halo", class(foot)),
            [x, y + 4.0],
            if foot == Foot::Left { "\u{394}L" } else { "\u{394}R" },
        );
        let [x, y] = ground.at([-0.075, foot.side() * 0.075]);
        panel.text(&format!("{} halo", class(foot)), [x, y], if foot == Foot::Left { "D_L" } else { "D_R" });
    }
    panel.arrow("push", ground.at([0.0, 0.0]), ground.at((direction * 0.05).into()));
    let [x, y] = ground.at((direction * 0.062).into());
    panel.text("push halo", [x, y + 4.0], "d");
    panel
}

fn fan(home: &Home, study: &Study) -> Panel {
    let (mut panel, ground) = Ground::panel(WIDTH, [-0.16, 0.16], [-0.168, 0.168]);
    ground.draw(&mut panel, "All directions: how far each foot can go");
    let tip = |foot: Foot, degrees: f64| -> At { (unit(degrees) * home.reach(foot, unit(degrees))).into() };
    let degrees = |i: usize| (i * STEP_DEG) as f64;
    let count = 360 / STEP_DEG;
    for i in 0..count {
        let middle = unit(degrees(i) + 0.5 * STEP_DEG as f64);
        if let Some(footstep) = home.choose(middle * 0.03) {
            let foot = footstep.foot;
            let sector = [[0.0, 0.0], tip(foot, degrees(i)), tip(foot, degrees(i + 1))];
            panel.polygon(&format!("{} sector", class(foot)), &ground.all(sector));
        }
    }
    for foot in Foot::BOTH {
        let curve: Vec<At> = (0..=count).map(|i| tip(foot, degrees(i))).collect();
        panel.polyline(class(foot), &ground.all(curve));
        let [x, y] = ground.at([-0.112, foot.side() * 0.1]);
        panel.text(&format!("{} halo", class(foot)), [x, y], &format!("{} foot", foot.name()));
    }
    let imposed = study.errors.iter().zip(["8 (a)", "8 (b)"]).map(|(run, name)| (run.record.zmp_error_m, name));
    let pushed = study
        .pushes
        .iter()
        .zip(["12", "13"])
        .filter_map(|(pushed, name)| Some((pushed.film.record.footsteps.first()?.zmp_error_m, name)));
    for (error, name) in imposed.chain(pushed) {
        let direction = Vector2::from(error).normalize();
        panel.arrow("push", ground.at((direction * 0.115).into()), ground.at((direction * 0.132).into()));
        let [x, y] = ground.at((direction * 0.148).into());
        // A name near the edge stays inside of the frame, below its arrow.
        let inside = x.min(WIDTH - 48.0);
        panel.text("push small halo", [inside, if inside < x { y + 15.0 } else { y + 4.0 }], &format!("Fig. {name}"));
    }
    panel
}
