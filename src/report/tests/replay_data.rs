//! The data in the page of a film: they agree with the film, and they are small.

use crate::common::browser::Browser;
use crate::common::films::{
    assert_no_problems, fallen, film, ghost, head, look, look_at, stepping, text, written,
    written_with,
};
use crate::common::{Bench, config, push};
use base64::prelude::{BASE64_STANDARD, Engine};
use nalgebra::{Isometry3, Point2, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use standfast_core::robot::mesh::Mesh;
use standfast_core::robot::{Foot, Kinematics, Shape};
use standfast_core::socket::RecoveryRegion;
use standfast_report::replay::page;
use standfast_sim::episode::parting::Parting;
use standfast_sim::episode::snapshot::Arrow;
use standfast_sim::episode::{Disturbance, EpisodeConfig, Film, Until};
use standfast_sim::{Bob, Ground, Push, Variation};
use std::sync::Arc;

/// Largest error of positions in a page (m).
const NEAR_M: f64 = 1e-4;

#[test]
fn what_the_page_shows_is_what_the_film_holds() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let film = stepping();
    let file = written(&folder, film, &head());
    let mut tab = browser.tab(600, 600, "light");
    tab.open(&file);
    const EVERY: usize = 5;
    let shown = tab.evaluate(&format!(
        "Array.from({{ length: Math.ceil(replay.film.count / {EVERY}) }}, (_, k) => replay.film.at(replay.film.time({EVERY} * k)))"
    ));
    let shown = shown.as_array().unwrap();
    assert_eq!(
        shown.len(),
        film.snapshots.len().div_ceil(EVERY),
        "a moment for each tick"
    );
    let mut worst = Worst::default();
    let mut kinematics = Kinematics::new(&film.robot);
    for (shown, snapshot) in shown.iter().zip(film.snapshots.iter().step_by(EVERY)) {
        kinematics.update(&film.robot, &snapshot.posture);
        for (i, link) in film.robot.links.iter().enumerate() {
            let pose = pose(&shown["poses"][i]);
            for solid in &link.visuals {
                for corner in solid.points() {
                    worst.see(
                        "robot",
                        (pose * corner - kinematics.link_pose(i) * corner).norm(),
                    );
                }
            }
        }
        let flat = |p: Point2<f64>| vec![p.x, p.y];
        worst.compare(
            "com",
            &shown["com"],
            Some(vec![snapshot.com.x, snapshot.com.y, snapshot.com.z]),
        );
        worst.compare("dcm", &shown["dcm"], Some(flat(snapshot.dcm)));
        worst.compare("zmp", &shown["zmp"], snapshot.zmp.map(flat));
        worst.compare("zmp_ref", &shown["zmpRef"], snapshot.zmp_ref.map(flat));
        let all = |points: &[Point2<f64>]| Some(points.iter().flat_map(|p| [p.x, p.y]).collect());
        worst.compare(
            "support",
            &flattened(&shown["support"]),
            all(&snapshot.support),
        );
        for gain in 0..film.regions.len() {
            let slice = snapshot
                .regions
                .get(gain)
                .map_or(&[][..], |region| &region.corners);
            worst.compare("slices", &flattened(&shown["sets"][gain]), all(slice));
        }
        let landing: Vec<_> = snapshot
            .footstep
            .iter()
            .flatten()
            .map(|corner| corner.xy())
            .collect();
        worst.compare("footstep", &flattened(&shown["footstep"]), all(&landing));
        for (i, foot) in Foot::BOTH.into_iter().enumerate() {
            let at = snapshot.contacts[foot].map(|arrow| arrow.point.coords.as_slice().to_vec());
            worst.compare("contacts", &shown["contacts"][i]["point"], at);
        }
        worst.compare(
            "push",
            &shown["push"]["point"],
            snapshot
                .push
                .map(|push| push.point.coords.as_slice().to_vec()),
        );
        assert_eq!(shown["phase"]["id"].as_str(), Some(&*snapshot.phase));
        let gain = film
            .regions
            .iter()
            .position(|name| Some(name) == snapshot.gain.as_ref());
        assert_eq!(shown["gain"].as_u64(), gain.map(|gain| gain as u64));
    }
    eprintln!("largest differences (m): {:?}", worst.0);
    assert!(
        worst.0.len() >= 9 && worst.0.iter().all(|(_, error)| *error < NEAR_M),
        "{:?}",
        worst.0
    );
    let marks = tab.evaluate("replay.film.events.map((event) => [event.kind, event.from_s])");
    let marked = |kind: &str| -> Vec<f64> {
        let of_kind = marks
            .as_array()
            .unwrap()
            .iter()
            .filter(|mark| mark[0] == kind);
        of_kind.map(|mark| mark[1].as_f64().unwrap()).collect()
    };
    assert_eq!(marked("push"), [0.5]);
    assert_eq!(
        marked("footstep"),
        film.record
            .footsteps
            .taken
            .iter()
            .map(|step| step.lift_s)
            .collect::<Vec<_>>()
    );
    assert!(
        !marked("footstep").is_empty() && !marked("switch").is_empty(),
        "{marks}"
    );
    assert_eq!(
        tab.evaluate("document.querySelectorAll('#marks i').length"),
        marks.as_array().unwrap().len()
    );
    // One moment in the words of the page.
    let swinging = film
        .snapshots
        .iter()
        .find(|s| s.footstep.is_some())
        .unwrap();
    look_at(&mut tab, swinging.time_s);
    assert_eq!(text(&mut tab, "phase"), "right foot in the air");
    assert_eq!(text(&mut tab, "gain"), "none, a foot is in the air");
    assert_eq!(text(&mut tab, "clock"), format!("{:.3} s", swinging.time_s));
    assert_no_problems(&mut tab, &file);
}

/// The ghost is at the place that the second film has at the time of the first, and the page says where the two part.
#[test]
fn the_ghost_is_the_robot_of_the_second_film() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (film, ghost) = (stepping(), ghost());
    let file = written_with(&folder, film, Some(&ghost), &head());
    let mut tab = browser.tab(600, 600, "light");
    tab.open(&file);
    let mut worst = Worst::default();
    let mut kinematics = Kinematics::new(&ghost.robot);
    // After the end of its film, the ghost stays where it was.
    for k in (0..film.snapshots.len()).step_by(50) {
        let snapshot = ghost
            .snapshots
            .get(k)
            .unwrap_or_else(|| ghost.snapshots.last().unwrap());
        let shown = tab.evaluate(&format!(
            "replay.film.at({}).ghost",
            film.snapshots[k].time_s
        ));
        kinematics.update(&ghost.robot, &snapshot.posture);
        for i in 0..ghost.robot.links.len() {
            let apart = pose(&shown["poses"][i]).translation.vector
                - kinematics.link_pose(i).translation.vector;
            worst.see("ghost", apart.norm());
        }
        worst.compare(
            "com",
            &shown["com"],
            Some(vec![snapshot.com.x, snapshot.com.y, snapshot.com.z]),
        );
    }
    assert!(
        worst.0.len() == 2 && worst.0.iter().all(|(_, error)| *error < NEAR_M),
        "{:?}",
        worst.0
    );
    let parting = Parting::of_films(film, &ghost).unwrap();
    let marked = tab.evaluate(
        "replay.film.events.filter((event) => event.kind === 'parting').map((e) => e.from_s)",
    );
    assert_eq!(marked, serde_json::json!([parting.at_s]));
    let told = text(&mut tab, "parting");
    let parted = format!("At {:.3} s the ", parting.at_s);
    let [solid, other] = [
        format!("Solid: {}", film.controller),
        format!("Ghost: {}", ghost.controller),
    ];
    for part in [&solid, "recovered, still from", &other, "fell at", &parted] {
        assert!(told.contains(part), "no {part:?} in {told}");
    }
    tab.evaluate("new Promise((done) => { addEventListener('hashchange', done); document.querySelector('#parting a').click(); })");
    let time_s = tab.evaluate("replay.state.time").as_f64().unwrap();
    assert!((time_s - parting.at_s).abs() < 1e-9, "{time_s}");
    assert_no_problems(&mut tab, &file);
    // Without a ghost there is no such data.
    assert!(
        packed(film)["ghost"].is_null()
            && !page(film, None, &head())
                .unwrap()
                .contains("id=\"parting\"")
    );
}

/// Each robot has its own bob: that of the ghost is moved here.
#[test]
fn ground_and_pendulum_are_those_of_the_trial() {
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let bench = Bench::new("hold");
    let slope = (Some(2.0), Some(-60.0));
    let variation = Variation {
        slope_deg: slope.0,
        slope_heading_deg: slope.1,
        ground_step_m: Some(0.004),
        ..Variation::default()
    };
    let bob = Bob {
        mass_kg: 3.0,
        rope_m: 1.75,
        radius_m: 0.08,
        stiffness_n_m: 9e4,
        restitution: 0.5,
    };
    let struck = Push {
        bob: Some(bob),
        ..push(1.0, 30.0)
    };
    let disturbance = Disturbance {
        pushes: vec![struck],
        variation,
        ..Disturbance::default()
    };
    let mut ropes = Vec::new();
    let film = Film::take(
        &bench.robot,
        &bench.factory,
        &config(1.0),
        disturbance,
        (Until::Decided, 0.0),
        &mut |tick| {
            let strike = tick.truth.strike.as_ref();
            ropes.push(strike.and_then(|strike| strike.rope_at(tick.truth.time_s)));
        },
    )
    .unwrap();
    let aside = Vector3::new(0.0, 0.2, 0.0);
    let mut ghost = film.clone();
    for end in ghost.snapshots.iter_mut().flat_map(|now| &mut now.rope) {
        *end = end.map(|at| at + aside);
    }
    let file = written_with(&folder, &film, Some(&ghost), &head());
    let mut tab = browser.tab(400, 400, "light");
    tab.open(&file);
    let shown = tab.evaluate(
        "Array.from({ length: Math.ceil(replay.film.count / 5) }, (_, i) => replay.film.at(replay.film.time(5 * i)))
            .map(({ pendulum, ghost }) => [pendulum, ghost.pendulum])",
    );
    let mut worst = Worst::default();
    for (i, rope) in ropes.iter().step_by(5).enumerate() {
        for (k, of) in ["bob", "bob of the ghost"].into_iter().enumerate() {
            let shown = &shown[i][k];
            let Some([pivot, bob_at]) = rope else {
                assert!(shown.is_null(), "{of} is not caught: {shown}");
                continue;
            };
            let (pose, by) = (pose(shown), aside * k as f64);
            let end = pose * Point3::new(0.0, 0.0, bob.rope_m);
            worst.see(of, (pose.translation.vector - bob_at.coords - by).norm());
            worst.see("pivot", (end - pivot - by).norm());
        }
    }
    assert!(
        worst.0.len() == 3 && worst.0.iter().all(|(_, error)| *error < NEAR_M),
        "{:?}",
        worst.0
    );
    let [drawn_back, last] = [ropes[0], *ropes.last().unwrap()];
    assert!(
        drawn_back.is_some() && last.is_none(),
        "{drawn_back:?} {last:?}"
    );
    let with = look_at(&mut tab, 0.0);
    tab.evaluate("replay.film.hanging = () => null");
    let without = look(&mut tab, "view");
    assert_ne!(with["hash"], without["hash"], "it is not drawn");
    assert!(
        packed(stepping())["hanging"].is_null(),
        "no data without a bob"
    );
    for (i, snapshot) in film.snapshots.iter().enumerate().step_by(100) {
        let ground = Ground {
            slope: snapshot.slope,
            ..Ground::new(&film.robot, &variation)
        };
        for (x, y) in [(0.0, 0.0), (0.03, -0.05), (0.3, 0.1), (-0.2, 0.4)] {
            let script = format!(
                "replay.film.height(replay.film.at(replay.film.time({i})).slope, {x}, {y}) + 0"
            );
            let shown_m = tab.evaluate(&script).as_f64().unwrap();
            let height_m = ground.height_m(Point2::new(x, y));
            assert!(
                (shown_m - height_m).abs() < NEAR_M,
                "at ({x}, {y}): {shown_m} m, not {height_m} m"
            );
        }
    }
    assert!(with["purple"].as_f64().unwrap() > 0.02, "{with}");
    assert_no_problems(&mut tab, &file);
}

/// The largest error of each kind (m).
#[derive(Default)]
struct Worst(std::collections::BTreeMap<&'static str, f64>);

impl Worst {
    fn see(&mut self, what: &'static str, error: f64) {
        let worst = self.0.entry(what).or_default();
        *worst = worst.max(error);
    }

    fn compare(&mut self, what: &'static str, shown: &Value, held: Option<Vec<f64>>) {
        let Some(held) = held else {
            return assert!(shown.is_null(), "{what}: {shown}, but there is none");
        };
        let shown: Vec<f64> = shown
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect();
        assert_eq!(shown.len(), held.len(), "{what}");
        for (a, b) in shown.iter().zip(held) {
            self.see(what, (a - b).abs());
        }
    }
}

fn flattened(corners: &Value) -> Value {
    corners
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|corner| corner.as_array().unwrap().clone())
        .collect()
}

fn pose(shown: &Value) -> Isometry3<f64> {
    let part = |name: &str, i: usize| shown[name][i].as_f64().unwrap();
    let turn = Quaternion::new(part("q", 3), part("q", 0), part("q", 1), part("q", 2));
    let at = Translation3::new(part("p", 0), part("p", 1), part("p", 2));
    Isometry3::from_parts(at, UnitQuaternion::from_quaternion(turn))
}

#[test]
fn a_page_of_four_seconds_is_small_and_always_the_same() {
    let whole = EpisodeConfig {
        end_early: false,
        ..config(4.0)
    };
    let film = film("paper", 3.6, whole);
    assert_eq!(film.snapshots.len(), 2001);
    let html = page(&film, None, &head()).unwrap();
    eprintln!("{} bytes", html.len());
    assert!(html.len() < 600_000, "{} bytes", html.len());
    assert!(html == page(&film, None, &head()).unwrap());
    // A longer film has fewer moments per second.
    let mut long = film.clone();
    for _ in 0..3 {
        long.snapshots.extend(film.snapshots.iter().cloned());
    }
    let mut meshed = long.clone();
    meshed.robot.links[0].visuals[0].shape = Shape::Mesh(Arc::new(ball(70)));
    for long in [&long, &meshed] {
        for ghost in [None, Some(long)] {
            let html = page(long, ghost, &head()).unwrap();
            eprintln!("{} bytes", html.len());
            assert!(html.len() < 1_000_000, "{} bytes", html.len());
        }
    }
}

/// A ball as a mesh with 2 n^2 triangles, which is the largest number that a robot may have.
fn ball(n: u32) -> Mesh {
    let at = |i: u32, k: u32| {
        let [up, around] = [i, k].map(|x| f64::from(x) / f64::from(n) * std::f64::consts::PI);
        Point3::new(
            up.sin() * (2.0 * around).cos(),
            up.sin() * (2.0 * around).sin(),
            up.cos(),
        ) * 0.1
    };
    let points = (0..=n)
        .flat_map(|i| (0..=n).map(move |k| at(i, k)))
        .collect();
    let square = |i: u32, k: u32| {
        let (a, b) = (i * (n + 1) + k, (i + 1) * (n + 1) + k);
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    Mesh::new(
        points,
        (0..n)
            .flat_map(|i| (0..n).flat_map(move |k| square(i, k)))
            .collect(),
    )
}

/// With noise no two moments are alike, and the CPI sets of many gains change at every tick.
#[test]
fn a_noisy_page_of_many_gains_is_small_too() {
    let whole = EpisodeConfig {
        end_early: false,
        ..config(4.0)
    };
    let mut film = film("hold", 1.0, whole);
    film.regions = (1..=16).map(|i| format!("gain {i}")).collect();
    for (k, snapshot) in film.snapshots.iter_mut().enumerate() {
        let corner = |gain: usize, i: usize| {
            let (angle, noise) = (0.6 * i as f64, (k * 37 % 101) as f64 * 1e-4);
            Point2::new(angle.cos(), angle.sin()) * (0.1 + 0.005 * gain as f64 + noise)
        };
        let region = |gain| RecoveryRegion {
            name: format!("gain {gain}"),
            corners: (0..10).map(|i| corner(gain, i)).collect(),
        };
        snapshot.regions = (0..16).map(region).collect();
        // Lifting a foot ends the slices at once.
        if (1000..1051).contains(&k) {
            snapshot.regions.clear();
        }
    }
    let html = page(&film, None, &head()).unwrap();
    eprintln!("{} bytes", html.len());
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
    assert!(
        html.contains("CPI sets are shown every 12 ms."),
        "it says so"
    );
    assert!(
        page(&film, Some(&film), &head()).unwrap().len() < 1_000_000,
        "with a ghost"
    );
    let page = packed(&film);
    let [which, counts] = ["which", "counts"].map(|name| whole_numbers(&page["slices"][3][name]));
    let sizes: Vec<u16> = which
        .iter()
        .map(|&ring| counts[usize::from(ring)])
        .collect();
    let held: Vec<u16> = film
        .snapshots
        .iter()
        .map(|s| s.regions.get(3).map_or(0, |region| region.corners.len()) as u16)
        .collect();
    assert_eq!(sizes, held, "they appear and vanish when they do");
}

#[test]
fn a_push_of_one_tick_is_seen_in_a_long_film() {
    let mut film = stepping().clone();
    for snapshot in &mut film.snapshots {
        snapshot.push = None;
    }
    while film.snapshots.len() < 5100 {
        let again = film.snapshots.clone();
        film.snapshots.extend(again);
    }
    let stride = film.snapshots.len().div_ceil(2500);
    let html = page(&film, None, &head()).unwrap();
    assert!(
        stride >= 3 && html.contains(&format!("shown in moments of {} ms", 2 * stride)),
        "{stride}"
    );
    // The push may lie anywhere within a moment.
    let (force, point) = (Vector3::new(0.0, -90.0, 0.0), Point3::new(0.1, 0.2, 0.3));
    for tick in 3 * stride + 1..=4 * stride {
        film.snapshots[tick].push = Some(Arrow { point, force });
        let page = packed(&film);
        film.snapshots[tick].push = None;
        let seen: Vec<(usize, Vec<f64>)> = (0..page["moments"].as_u64().unwrap() as usize)
            .filter_map(|k| {
                Some((
                    k,
                    (0..6)
                        .map(|i| value(&page["push"][i], k))
                        .collect::<Option<_>>()?,
                ))
            })
            .collect();
        assert_eq!(seen.len(), 1, "tick {tick}: {seen:?}");
        assert_eq!(seen[0].0, 4);
        let expected = [0.1, 0.2, 0.3, 0.0, -90.0 / stride as f64, 0.0];
        assert!(
            seen[0]
                .1
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-9),
            "tick {tick}: {seen:?}"
        );
    }
    assert!(
        !page(stepping(), None, &head())
            .unwrap()
            .contains("shown in moments")
    );
}

#[test]
fn what_did_not_come_is_not_marked() {
    let mut film = fallen().clone();
    let last_s = film.snapshots.last().unwrap().time_s;
    let second = Push {
        start_s: last_s + 0.5,
        ..film.pushes[0]
    };
    film.pushes.push(second);
    let marks = packed(&film)["events"].clone();
    let of_kind = |kind: &str| {
        marks
            .as_array()
            .unwrap()
            .iter()
            .filter(|mark| mark["kind"] == kind)
            .count()
    };
    assert_eq!((of_kind("push"), of_kind("fall")), (1, 1), "{marks}");
}

/// One number that diverges must not reduce the digits of earlier numbers.
#[test]
fn a_page_ends_where_the_film_diverges() {
    let mut film = stepping().clone();
    let count = film.snapshots.len();
    for (k, snapshot) in film.snapshots.iter_mut().enumerate().skip(count - 40) {
        let far = 1.5_f64.powi((k + 40 - count) as i32);
        snapshot.com.x += far;
        snapshot.dcm.x += 2.0 * far;
        snapshot.posture.base.translation.vector.x += far;
        snapshot.posture.q[0] -= far;
        snapshot.margin = Some(-1e4 * far);
        snapshot.zmp = Some(Point2::new(100.0, 0.0));
    }
    let page = packed(&film);
    let shown = page["moments"].as_u64().unwrap() as usize;
    assert!(
        (count - 40..count - 30).contains(&shown),
        "{shown} of {count} moments"
    );
    for name in ["base", "turn", "com", "dcm", "zmp", "zmp_ref", "q"] {
        for column in page[name].as_array().unwrap() {
            // A column that does not change has no step.
            let error = column["step"].as_f64().map_or(0.0, |step| step / 2.0);
            assert!(error < NEAR_M, "{name}: {error}");
        }
    }
    assert!(
        page["margin"]["step"].as_f64().unwrap() < 0.005,
        "a margin has two digits"
    );
    let html = standfast_report::replay::page(&film, None, &head()).unwrap();
    let ends = format!("The page ends at {:.3} s", film.snapshots[shown].time_s);
    assert!(html.contains(&ends), "{ends}");
}

/// The data of a page, as its script reads them.
fn packed(film: &Film) -> Value {
    let html = page(film, None, &head()).unwrap();
    let (_, from) = html.split_once("id=\"film\">").unwrap();
    serde_json::from_str(from.split_once("</script>").unwrap().0).unwrap()
}

fn whole_numbers(data: &Value) -> Vec<u16> {
    let bytes = BASE64_STANDARD.decode(data.as_str().unwrap()).unwrap();
    bytes
        .chunks(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}

/// Value of a column at a moment.
fn value(column: &Value, moment: usize) -> Option<f64> {
    let least = column["least"].as_f64();
    if column["data"].is_null() {
        return least;
    }
    let n = whole_numbers(&column["data"])[moment];
    (n != u16::MAX).then(|| least.unwrap() + column["step"].as_f64().unwrap() * f64::from(n))
}
