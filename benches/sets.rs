//! Cost of the CPI sets: what runs at every tick and after a landing, compared with the search that runs once.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use standfast::assets::{self, Kind};
use standfast::control::stand::Support;
use standfast::geometry::SupportPolygon;
use standfast::lipm::relaxation::{AxisPlan, Boundary};
use standfast::lipm::{CpiSet, GainFamily, GainSet, OnlineSets, Pendulum, State};
use standfast::robot::{PerFoot, Robot};
use std::hint::black_box;

fn sets(c: &mut Criterion) {
    let source = assets::open(Kind::Gains, "switching").expect("built in");
    let set = GainSet::parse(&source).expect("valid");
    let family = GainFamily::design(&set, Pendulum { omega: 5.63, dt: 0.002 }).expect("valid");
    let at_home = SupportPolygon::rectangle(-0.0481, 0.0481, -0.0831, 0.0831).expect("a rectangle");
    let off_centre = SupportPolygon::rectangle(-0.003, 0.093, -0.0831, 0.0831).expect("a rectangle");
    let mut online = OnlineSets::new(&family);
    online.update(&at_home);
    // Just inside the slowest set, so that the prediction of every set runs to its end.
    let pushed = |share: f64| {
        let x = Vector3::new(0.0, share * 0.8 * 5.63 * 0.0481, 0.0);
        State { x, y: Vector3::new(0.01, 0.02, -0.01) }
    };
    let (hard, soft) = (pushed(0.95), pushed(0.3));

    c.bench_function("update on a new polygon, all gains", |b| b.iter(|| online.update(black_box(&off_centre))));
    online.update(&at_home);
    for (name, state) in [("hard push", hard), ("soft push", soft)] {
        c.bench_function(&format!("membership, fastest gain that holds, {name}"), |b| {
            b.iter(|| online.fastest_holding(black_box(&state)))
        });
        c.bench_function(&format!("margins of all gains, {name}"), |b| {
            b.iter(|| (0..family.gains.len()).map(|i| online.margin(i, black_box(&state))).fold(0.0, f64::min))
        });
    }

    // The work after a landing, for which the paper took 0.15 ms: from footholds to support polygon and frame, the sets
    // of all gains, and the fastest gain whose set contains the state. Before it, the plan of the footstep.
    let robot = Robot::load("ut-mu2").expect("built in");
    let paper = GainSet::load("paper").expect("built in");
    let pendulum = Pendulum { omega: robot.omega(), dt: 0.002 };
    let family = GainFamily::design(&paper, pendulum).expect("valid");
    let rules = family.stepping().expect("it steps");
    let foothold = |x: f64, y: f64, yaw: f64| {
        Isometry3::from_parts(Vector3::new(x, y, 0.0).into(), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw))
    };
    let home = PerFoot { left: foothold(0.0, 0.0485, 0.0), right: foothold(0.0, -0.0485, 0.0) };
    let landed = PerFoot { left: home.left, right: foothold(0.13, -0.06, 0.1) };
    let both = PerFoot { left: true, right: true };
    let mut online = OnlineSets::new(&family);
    let state = State { x: Vector3::new(-0.01, 0.2, 0.02), y: Vector3::new(0.01, -0.05, 0.0) };
    c.bench_function("after a landing: support, sets of all gains, membership", |b| {
        b.iter(|| {
            let support = Support::of(&robot, black_box(&landed), &both);
            let allowed = support.polygon.and_then(|polygon| polygon.inset(family.zmp_margin));
            online.update(&allowed.expect("two soles"));
            online.fastest_holding(black_box(&state))
        })
    });
    let [x, y] = [(0.01, 0.4, 0.13), (0.05, 0.02, 0.0)].map(|(com, com_vel, to)| {
        let most = robot.soles.left.half_m[0] - family.zmp_margin;
        Boundary { com, com_vel, target: 0.5 * to, zmp: [-most, most] }
    });
    c.bench_function("plan of a footstep", |b| {
        b.iter(|| [x, y].map(|axis| AxisPlan::new(pendulum.omega, rules, black_box(&axis))))
    });

    let mut slow = c.benchmark_group("search by linear programs, all gains");
    slow.sample_size(10);
    for (name, polygon) in [("home", at_home), ("off centre 1:31", off_centre)] {
        slow.bench_function(name, |b| b.iter(|| CpiSet::search_family(&family, black_box(&polygon))));
    }
    slow.finish();
}

criterion_group!(benches, sets);
criterion_main!(benches);
