//! Fig. 3: the sets of the gains, one in the other. Fig. 4: the region of the ZMP and the sets on it, before a footstep
//! and after.

use super::super::cpi_plot;
use super::super::html::svg::short;
use super::figure::{Claim, Figure, Table};
use super::panel::{At, Axes, Ground, Panel};
use super::study::{Pushed, Stand, Study};
use crate::error::Result;
use crate::geometry::SupportPolygon;
use crate::lipm::cpi_set::{CpiSet, Inclusion};
use crate::lipm::gains::{Gain, GainPoles};
use crate::lipm::pendulum::State;
use crate::lipm::{GainFamily, OnlineSets};
use crate::robot::Foot;
use nalgebra::{Isometry2, Point2, Vector2};
use serde_json::json;

/// Poles over -omega of two gains, slow to fast, whose sets do not nest.
const NOT_NESTED: [[f64; 3]; 2] = [[0.5, 1.0, 1.0], [1.0, 1.0, 1.0]];
const WIDTH: f64 = 460.0;

/// Fig. 3.
pub fn inclusion(study: &Study) -> Result<Figure> {
    let (sets, family) = (&study.sets, &study.design.family);
    let omega = family.pendulum.omega;
    let nests = study.inclusion.failures().is_empty();
    let impulses: Vec<[f64; 2]> = sets.iter().map(|set| impulses(study, set)).collect();
    let shrinks = impulses.windows(2).all(|pair| (0..2).all(|axis| pair[1][axis] < pair[0][axis]));
    let others = others_nest(family, &study.allowed)?;
    let (slow, fast) = (impulses[0], impulses[impulses.len() - 1]);
    let told = |poles: [f64; 3]| format!("({})", poles.map(|p| short(p, 2)).join(", "));
    let pairs = sets.len() * (sets.len() - 1) / 2;
    let claims = vec![
        Claim::judged(
            "The gains are designed so that the sets lie one in the other, that of the fastest innermost.",
            nests,
            format!("Proved by linear programs for all {pairs} pairs of the {} gains: each set lies inside every slower one.", sets.len()),
            study.inclusion.warning().unwrap_or_default(),
        ),
        Claim::judged(
            "A gain with a higher convergence speed has the smaller set.",
            shrinks,
            format!(
                "The largest impulse that a robot at rest can take within the set falls with every faster gain: forward from {} to {} N s, to the left from {} to {} N s.",
                short(slow[0], 2), short(fast[0], 2), short(slow[1], 2), short(fast[1], 2)
            ),
            "The largest impulse from rest does not fall with every faster gain.".into(),
        ),
        Claim::judged(
            "In general a low convergence speed makes the set large, a high one small.",
            others,
            "So it is for the pair of other poles that was tried.".into(),
            format!(
                "Not for poles in general: of the sets of poles {} and {} times \u{2212}\u{3c9} neither lies in the other. The family here nests because its gains share a pole at \u{2212}\u{3c9} and a fast one, and differ in the slow one alone.",
                told(NOT_NESTED[0]), told(NOT_NESTED[1])
            ),
        ),
        Claim::open(
            "The paper prints neither its gains nor their k.",
            "The table has those of this run. Fig. 3 also shows the block diagram of switching, a drawing: Fig. 5 shows it at work.".into(),
        ),
    ];
    let rows = sets.iter().zip(&family.gains).zip(&impulses).map(|((set, gain), impulse)| {
        vec![
            set.gain.clone(),
            told(gain.x.poles),
            format!("{} ({} ms)", set.horizon, short(1e3 * family.pendulum.dt * set.horizon as f64, 0)),
            set.set.rows.nrows().to_string(),
            short(impulse[0], 2),
            short(impulse[1], 2),
        ]
    });
    let head = ["gain", "poles / \u{2212}\u{3c9}", "k", "rows of S", "forward [N s]", "left [N s]"];
    Ok(Figure {
        number: "3",
        file: "fig03-inclusion.svg",
        title: "Inclusion of the maximal CPI sets",
        reading: format!(
            "Two slices of the six-dimensional sets on the soles at home. Left: COM over the middle of the feet; a push moves a robot at rest along the horizontal line, the controller moves the ZMP. Right, seen from above: where a resting COM may be, with the ZMP in the middle. Names are the slow pole over \u{2212}\u{3c9}; \u{3c9} = {} rad/s. The sets are for the soles less {} mm (dashed).",
            short(omega, 2),
            short(1e3 * family.zmp_margin, 1)
        ),
        panels: vec![velocity_slice(study), com_slice(study)],
        columns: 2,
        table: Some(Table { head: head.map(String::from).into(), rows: rows.collect() }),
        claims,
        numbers: json!({
            "nested": nests,
            "gains": sets.iter().map(|set| set.gain.clone()).collect::<Vec<_>>(),
            "horizon_k": sets.iter().map(|set| set.horizon).collect::<Vec<_>>(),
            "largest_impulse_from_rest_n_s": { "forward": impulses.iter().map(|i| i[0]).collect::<Vec<_>>(), "left": impulses.iter().map(|i| i[1]).collect::<Vec<_>>() },
            "other_poles_over_minus_omega": NOT_NESTED,
            "other_poles_nest": others,
        }),
    })
}

/// Largest impulse from rest that a set holds: forward, and to the left (N s).
fn impulses(study: &Study, set: &CpiSet) -> [f64; 2] {
    [Vector2::x(), Vector2::y()].map(|d| study.robot.mass() * set.largest_com_vel_from_rest(d))
}

/// Whether the sets of `NOT_NESTED` nest after all.
fn others_nest(family: &GainFamily, polygon: &SupportPolygon) -> Result<bool> {
    let sets = NOT_NESTED.map(|poles| {
        let gain = Gain::design(&family.pendulum, &GainPoles { name: "other".into(), x: poles, y: poles });
        CpiSet::search(&gain, family.pendulum, polygon)
    });
    let [slow, fast] = sets;
    let inclusion = Inclusion::of(&[slow?, fast?])?;
    Ok(inclusion.inside[1][0] || inclusion.inside[0][1])
}

/// Slice com = 0 of the fore and aft axis.
fn velocity_slice(study: &Study) -> Panel {
    let sets = &study.sets;
    let omega = study.design.family.pendulum.omega;
    let most = study.home.vertices().iter().map(|v| v.x).fold(0.0, f64::max);
    let (reach, speed) = (1.18 * most, 1.18 * most * omega);
    let mut panel = Panel::new(WIDTH, 430.0);
    let axes = Axes { x: [-speed, speed], y: [-1e3 * reach, 1e3 * reach], frame: [60.0, 34.0, WIDTH - 8.0, 380.0] };
    axes.draw(&mut panel, "COM velocity, forward [m/s]", "ZMP, forward [mm]");
    panel.text("title start", [60.0, 20.0], "COM over the middle of the feet");
    let outlines: Vec<Vec<At>> =
        sets.iter().map(|set| cpi_plot::outline(set, 0, speed, reach).into_iter().map(At::from).collect()).collect();
    for outline in &outlines {
        panel.polygon("slice", &axes.all(outline.iter().copied()));
    }
    for (i, set) in sets.iter().enumerate() {
        let zmp = 0.45 * reach * (1.0 - 2.0 * i as f64 / (sets.len() - 1).max(1) as f64);
        let edge = edge(set, speed, zmp);
        leader(&mut panel, axes.at([edge, 1e3 * zmp]), axes.at([0.87 * speed, 1e3 * zmp]), &set.gain);
    }
    let limit = most - study.design.family.zmp_margin;
    for side in [-1.0, 1.0] {
        let x = side * omega * limit;
        panel.line("limit", axes.at([x, -1e3 * reach]), axes.at([x, 1e3 * reach]));
        panel.line("allowed", axes.at([-speed, side * 1e3 * limit]), axes.at([speed, side * 1e3 * limit]));
    }
    let [x, y] = axes.at([omega * limit, -1e3 * reach]);
    panel.text("limit end halo small", [x - 5.0, y - 8.0], "\u{3c9} d: most that standing can take");
    panel
}

/// Slice of a resting COM with the ZMP in the middle, seen from above.
fn com_slice(study: &Study) -> Panel {
    let mut sets = OnlineSets::new(&study.design.family);
    sets.update(&study.allowed);
    let (mut panel, ground) = Ground::panel(WIDTH, [-0.08, 0.08], [-0.105, 0.105]);
    ground.draw(&mut panel, "COM at rest, ZMP in the middle");
    let stance = study.stance();
    for foot in Foot::BOTH {
        let center = Vector2::new(0.0, 0.5 * foot.side() * stance.y);
        panel.polygon("sole", &ground.all(study.sole().map(|[x, y]| [x + center.x, y + center.y])));
    }
    region(&mut panel, &ground, &study.home, &study.allowed);
    for (i, set) in study.sets.iter().enumerate() {
        let slice = sets.slice(i, &State::default());
        panel.polygon("slice", &ground.all(slice.iter().map(|p| [p.x, p.y])));
        let x = 0.022 * (1.0 - 2.0 * i as f64 / (study.sets.len() - 1).max(1) as f64);
        let edge = slice.iter().map(|p| p.y).fold(0.0, f64::min);
        leader(&mut panel, ground.at([x, edge]), ground.at([x, -0.091]), &set.gain);
    }
    panel
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

fn region(panel: &mut Panel, ground: &Ground, whole: &SupportPolygon, allowed: &SupportPolygon) {
    for (class, polygon) in [("support", whole), ("allowed", allowed)] {
        panel.polygon(class, &ground.all(polygon.vertices().iter().map(|v| [v.x, v.y])));
    }
}

/// What the sets are on a support.
struct Region {
    allowed: SupportPolygon,
    sets: Vec<CpiSet>,
}

impl Region {
    fn of(study: &Study, support: &SupportPolygon) -> Result<Self> {
        let family = &study.design.family;
        let allowed = family.allowed_support(support, &family.name)?;
        Ok(Self { allowed, sets: CpiSet::search_family(family, &allowed)? })
    }

    fn horizons(&self) -> Vec<usize> {
        self.sets.iter().map(|set| set.horizon).collect()
    }
}

/// Fig. 4. None: there was no footstep.
pub fn regions(study: &Study) -> Result<Option<Figure>> {
    let pushed = &study.pushes[0];
    let (Some(lift), Some(landing), Some(footstep)) =
        (&pushed.lift, &pushed.landing, pushed.film.record.footsteps.first())
    else {
        return Ok(None);
    };
    let (Some(support_before), Some(support_after)) = (lift.support.polygon, landing.support.polygon) else {
        return Ok(None);
    };
    let (before, after) = (Region::of(study, &study.home)?, Region::of(study, &support_after)?);
    let family = &study.design.family;
    let excess = stored_phi_excess(study, &before, &after)?;
    let (stored, needed) = (before.horizons(), after.horizons());
    let enough = stored.iter().zip(&needed).all(|(stored, needed)| needed <= stored);
    let middle = (landing.soles.left.translation.vector + landing.soles.right.translation.vector) / 2.0;
    let off = (landing.support.frame.translation.vector - middle).norm();
    let way = way(pushed).unwrap_or_default();
    let turned_deg = (landing.soles.left.rotation.angle() - landing.soles.right.rotation.angle()).to_degrees().abs();
    let moved = landing.support.frame.translation.vector - lift.support.frame.translation.vector;
    let area = |polygon: &SupportPolygon| short(1e4 * polygon.area(), 0);
    let listed = |ks: &[usize]| ks.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let [slow_before, slow_after] = [&before, &after].map(|region| impulses(study, &region.sets[0]));
    let claims = vec![
        Claim::judged(
            "The example: the robot steps the right foot forward.",
            footstep.foot == Foot::Right && way[0] > 0.0,
            format!("So it does when it is pushed from behind: {}.", told(way)),
            format!("Pushed from behind it moves the {} foot: {}.", footstep.foot.name(), told(way)),
        ),
        Claim::judged(
            "After the landing the control coordinate is reset: its origin is midway between the feet.",
            off < 1e-9,
            format!("Its origin moves to the middle of the feet: {}.", told(moved.into())),
            format!("Its origin is {} mm off the middle of the feet.", short(1e3 * off, 1)),
        ),
        Claim::judged(
            "The sets on the new region have the old number of rows k (eq. 25), without a new search.",
            enough,
            format!(
                "The old k is enough here. Stored, slow to fast: {}; searched anew: {}.",
                listed(&stored),
                listed(&needed)
            ),
            format!(
                "Stored, slow to fast: {}; searched anew: {}. So the old k falls short here, where the soles have come to stand at {} degrees to each other: eq. 25 would call states safe that exceed the set by up to {} %. The controller here stores no k: it rolls the prediction on until it is decided.",
                listed(&stored),
                listed(&needed),
                short(turned_deg, 1),
                short(100.0 * excess, 2)
            ),
        ),
        Claim::open(
            "The region is larger, so the robot can take more: the paper gives no figures.",
            format!(
                "From {} to {} cm\u{b2}; the largest impulse that the slowest gain's set holds from rest goes from {} to {} N s forward, and from {} to {} N s to the left.",
                area(&support_before),
                area(&support_after),
                short(slow_before[0], 2),
                short(slow_after[0], 2),
                short(slow_before[1], 2),
                short(slow_after[1], 2)
            ),
        ),
    ];
    let range = [[-0.155, 0.155], [-0.125, 0.125]];
    let panel = |title: String, stand: &Stand, on: &Region, whole: &SupportPolygon, old: Option<&Isometry2<f64>>| {
        let (mut panel, ground) = Ground::panel(WIDTH, range[0], range[1]);
        ground.draw(&mut panel, &title);
        stand_of(study, &mut panel, &ground, stand, old);
        region(&mut panel, &ground, whole, &on.allowed);
        let mut sets = OnlineSets::new(family);
        sets.update(&on.allowed);
        for gain in 0..sets.len() {
            panel.polygon("slice", &ground.all(sets.slice(gain, &State::default()).iter().map(|p| [p.x, p.y])));
        }
        frame_axes(&mut panel, &ground);
        panel
    };
    let title = |what: &str, stand: &Stand| format!("{what}, t = {} s", short(stand.time_s, 3));
    Ok(Some(Figure {
        number: "4",
        file: "fig04-regions.svg",
        title: "Contact region before and after the footstep",
        reading: format!(
            "Pushed from behind with {} N s. Each in its own control frame, seen from above: soles, contact region (solid; dashed: what of it the ZMP may use), and in blue the sets of the {} gains for a COM at rest with the ZMP at the origin. On the right, dotted: where the soles were, and the old origin.",
            short(pushed.push.impulse_n_s, 2),
            before.sets.len()
        ),
        panels: vec![
            panel(title("Before", lift), lift, &before, &support_before, None),
            panel(title("After the landing", landing), landing, &after, &support_after, Some(&lift.support.frame)),
        ],
        columns: 2,
        table: None,
        claims,
        numbers: json!({
            "foot": footstep.foot,
            "way_m": way,
            "origin_moved_m": [moved.x, moved.y],
            "area_m2": [support_before.area(), support_after.area()],
            "horizon_k_before": stored,
            "horizon_k_after": needed,
            "stored_k_excess": excess,
            "soles_turned_deg": turned_deg,
            "slowest_impulse_from_rest_n_s": { "before": slow_before, "after": slow_after },
        }),
    }))
}

/// By how much states in the sets of eq. 25, with the k of the region before, can exceed the true sets (share).
fn stored_phi_excess(study: &Study, before: &Region, after: &Region) -> Result<f64> {
    let mut excess = 0.0_f64;
    for ((gain, old), new) in study.design.family.gains.iter().zip(&before.sets).zip(&after.sets) {
        if new.horizon > old.horizon {
            let mut programs = CpiSet::stacked(gain, &after.allowed, old.horizon)?.programs()?;
            let missing = after.allowed.vertices().len() * (old.horizon + 1);
            for row in new.set.rows.row_iter().skip(missing) {
                excess = excess.max(programs.maximise(&row.into_owned())?.value - 1.0);
            }
        }
    }
    Ok(excess)
}

/// Soles in the control frame of a stand; dotted, in the frame `old`, where they were at home.
fn stand_of(study: &Study, panel: &mut Panel, ground: &Ground, stand: &Stand, old: Option<&Isometry2<f64>>) {
    let into = stand.support.frame.inverse();
    let corners = |pose: Isometry2<f64>| study.sole().map(|[x, y]| (pose * Point2::new(x, y)).into());
    for foot in Foot::BOTH {
        let pose = into * stand.soles[foot];
        panel.polygon("sole", &ground.all(corners(pose)));
        let [x, y] = ground.at((pose * Point2::new(-0.06, 0.0)).into());
        panel.text("small halo", [x, y], foot.name());
    }
    if let Some(old) = old {
        for foot in Foot::BOTH {
            let home = Isometry2::translation(0.0, 0.5 * foot.side() * study.stance().y);
            panel.polygon("sole ghost", &ground.all(corners(into * old * home)));
        }
        let origin: At = (into * old * Point2::origin()).into();
        let [x, y] = ground.at(origin);
        panel.circle("plan", [x, y], 3.5);
        panel.text("plan small halo start", [x + 7.0, y + 4.0], "old origin");
    }
}

fn frame_axes(panel: &mut Panel, ground: &Ground) {
    for (to, name) in [([0.035, 0.0], "x"), ([0.0, 0.035], "y")] {
        panel.arrow("axis", ground.at([0.0, 0.0]), ground.at(to));
        let [x, y] = ground.at([1.28 * to[0], 1.28 * to[1]]);
        panel.text("small halo", [x, y + 4.0], name);
    }
}

/// How far something went (m; x forward, y left), in words.
pub fn told(way: [f64; 2]) -> String {
    let part = |m: f64, ways: [&str; 2]| format!("{} mm {}", short(1e3 * m.abs(), 0), ways[usize::from(m < 0.0)]);
    let [along, across] = [part(way[0], ["forward", "backward"]), part(way[1], ["to the left", "to the right"])];
    if way[1].abs() < 5e-4 { along } else { format!("{along} and {across}") }
}

/// The first footstep of a pushed run: where to (m; x forward, y left).
pub fn way(pushed: &Pushed) -> Option<[f64; 2]> {
    let footstep = pushed.film.record.footsteps.first()?;
    Some([0, 1].map(|axis| footstep.to_m[axis] - footstep.from_m[axis]))
}
