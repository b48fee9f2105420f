//! Fig. 4: the region of the ZMP and the sets on it, before a footstep and after.

use super::super::html::svg::short;
use super::decision::Home;
use super::figure::Said::Quote;
use super::figure::{Claim, Figure, walked};
use super::panel::{At, Ground, Panel};
use super::study::{Stand, Study};
use crate::error::Result;
use crate::geometry::SupportPolygon;
use crate::lipm::OnlineSets;
use crate::lipm::cpi_set::CpiSet;
use crate::lipm::pendulum::State;
use crate::robot::Foot;
use nalgebra::{Isometry2, Point2};
use serde_json::json;

const WIDTH: f64 = 460.0;

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
pub fn figure(study: &Study) -> Result<Option<Figure>> {
    let pushed = &study.pushes[0];
    let (Some(lift), Some(landing), Some(footstep)) =
        (&pushed.watch.lift, &pushed.watch.landing, pushed.film.record.footsteps.first())
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
    let way = pushed.way().unwrap_or_default();
    let turned_deg = (landing.soles.left.rotation.angle() - landing.soles.right.rotation.angle()).to_degrees().abs();
    let moved = landing.support.frame.translation.vector - lift.support.frame.translation.vector;
    let area = |polygon: &SupportPolygon| short(1e4 * polygon.area(), 0);
    let listed = |ks: &[usize]| ks.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let [slow_before, slow_after] = [&before, &after].map(|region| study.impulses(&region.sets[0]));
    let areas = format!("from {} to {} cm\u{b2}", area(&support_before), area(&support_after));
    let change = |axis: usize| {
        let [old, new] = [slow_before, slow_after].map(|slow| slow[axis]);
        format!("{} from {} to {} N s", if new > old { "rises" } else { "falls" }, short(old, 2), short(new, 2))
    };
    let worth = format!(
        "The largest impulse from rest that the slowest gain's set holds {} forward and {} to the left.",
        change(0),
        change(1)
    );
    let stepped = format!("Pushed from behind the {} foot goes {}.", footstep.foot.name(), walked(way));
    let quoted = Quote("the robot steps the right foot forward", "Fig. 4");
    let is_tie = Home::is_tie(Home::new(study).reaches(footstep.zmp_error_m.into()));
    let stepping = if is_tie && footstep.foot == Foot::Right && way[0] > 0.0 {
        Claim::open(quoted, format!("{stepped} That it is the right one is a choice made here for a tie (Fig. 12)."))
    } else {
        Claim::judged(quoted, footstep.foot == Foot::Right && way[0] > 0.0, stepped.clone(), stepped)
    };
    let horizons = format!("Stored, slow to fast: {}; searched anew: {}.", listed(&stored), listed(&needed));
    let quoted = Quote(
        "After the foot landing, the control coordinate is reset as its origin is located at the center point of both feet.",
        "Fig. 4",
    );
    let origin = if off < 1e-9 {
        let moved = walked(moved.into());
        Claim::open(quoted, format!("Done so by the controller here, and so no finding: its origin moves {moved}."))
    } else {
        let off = format!("Its origin is {} mm off the middle of the feet.", short(1e3 * off, 1));
        Claim::judged(quoted, false, String::new(), off)
    };
    let claims = vec![
        stepping,
        origin,
        Claim::judged(
            Quote(
                "Because the matrix \u{3a6} has been already calculated, we can compute S_max(M_Z) online as follows",
                "Sect. IV, eq. 25",
            ),
            enough,
            format!(
                "What eq. 25 gives is the maximal set here: the k of the stored \u{3a6} (eq. 24: how many periods it looks \
                 ahead) is enough. {horizons}"
            ),
            format!(
                "Online, yes (see the update time); but what eq. 25 gives is not quite the maximal set S_max: the stored \u{3a6} \
                 has the k (eq. 24: how many periods it looks ahead) of the old region. {horizons} The soles have \
                 come to stand at {} degrees to each other, and eq. 25 would hold states that exceed the maximal set by \
                 up to {} %. The controller here stores no k: it rolls the prediction on until it is decided.",
                short(turned_deg, 1),
                short(100.0 * excess, 2)
            ),
        ),
        Claim::judged(
            Quote("it is necessary for the robot to step and enlarge the support region actively", "Sect. V.A"),
            support_after.area() > support_before.area(),
            format!("The footstep enlarges it {areas}. {worth}"),
            format!("The footstep takes it {areas}. {worth}"),
        ),
    ];
    let range = [[-0.155, 0.155], [-0.125, 0.125]];
    let panel = |title: String, stand: &Stand, on: &Region, whole: &SupportPolygon, old: Option<&Isometry2<f64>>| {
        let (mut panel, ground) = Ground::panel(WIDTH, range[0], range[1]);
        ground.draw(&mut panel, &title);
        stand_of(study, &mut panel, &ground, stand, old);
        ground.region(&mut panel, whole, &on.allowed);
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
            "Pushed from behind with {} N s. Each in its own control frame, seen from above: soles, contact \
             region (solid; dashed: what of it the ZMP may use), and in blue the sets of the {} gains for a COM \
             at rest with the ZMP at the origin. On the right the soles are where the controller estimates them; thinly dashed: \
             where they were; teal: the old origin.",
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
        let [x, y] = ground.at((pose * Point2::new(0.0, 0.049 * foot.side())).into());
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
        // In the free ground below the soles that were.
        let [_, below] = ground.at([-0.14, 0.0]);
        panel.line("plan hair", [x, y], [x, below - 12.0]);
        panel.text("plan small halo", [x, below], "old origin");
    }
}

fn frame_axes(panel: &mut Panel, ground: &Ground) {
    for (to, name) in [([0.035, 0.0], "x"), ([0.0, 0.035], "y")] {
        panel.arrow("axis", ground.at([0.0, 0.0]), ground.at(to));
        let [x, y] = ground.at([1.28 * to[0], 1.28 * to[1]]);
        panel.text("small halo", [x, y + 4.0], name);
    }
}
