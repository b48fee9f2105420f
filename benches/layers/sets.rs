//! The CPI sets: the search that runs once, compared with what runs at every tick and after a landing.

use criterion::{Criterion, SamplingMode};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use standfast::core::control::Design;
use standfast::core::control::stand::Support;
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::relaxation::{AxisPlan, Boundary};
use standfast::core::lipm::{CpiSet, GainFamily, OnlineSets, Pendulum, State};
use standfast::core::robot::PerFoot;
use std::hint::black_box;
use std::time::Duration;

const PENDULUM: Pendulum = Pendulum {
    omega: 5.63,
    dt: 0.002,
};

fn family(gains: &str) -> GainFamily {
    GainFamily::design(
        &standfast::controllers::gain_set(gains).expect("built in"),
        PENDULUM,
        0.048,
    )
    .expect("valid")
}

fn at_home() -> SupportPolygon {
    SupportPolygon::rectangle(-0.0481, 0.0481, -0.0831, 0.0831).expect("a rectangle")
}

fn off_centre() -> SupportPolygon {
    SupportPolygon::rectangle(-0.003, 0.093, -0.0831, 0.0831).expect("a rectangle")
}

/// The search by linear programs, for all gains of `switching`.
pub fn search(c: &mut Criterion) {
    let family = family("switching");
    let mut group = c.benchmark_group("sets/search by linear programs");
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .measurement_time(Duration::from_secs(3));
    for (name, polygon) in [("at home", at_home()), ("off centre 1:31", off_centre())] {
        group.bench_function(name, |b| {
            b.iter(|| CpiSet::search_family(&family, black_box(&polygon)))
        });
    }
}

pub fn update(c: &mut Criterion) {
    let mut online = OnlineSets::new(&family("switching"));
    let polygon = off_centre();
    c.bench_function("sets/update on a new polygon", |b| {
        b.iter(|| online.update(black_box(&polygon)))
    });
}

pub fn membership(c: &mut Criterion) {
    let family = family("switching");
    let mut online = OnlineSets::new(&family);
    online.update(&at_home());
    // The harder push is just inside the slowest gain's CPI set, so that the prediction of every CPI set runs to its
    // end.
    for (name, share) in [("hard push", 0.95), ("soft push", 0.3)] {
        let x = Vector3::new(0.0, share * 0.8 * PENDULUM.omega * 0.0481, 0.0);
        let state = State {
            x,
            y: Vector3::new(0.01, 0.02, -0.01),
        };
        c.bench_function(
            &format!("sets/membership, fastest gain that holds/{name}"),
            |b| b.iter(|| online.fastest_holding(black_box(&state))),
        );
        c.bench_function(
            &format!("sets/membership, margins of all gains/{name}"),
            |b| {
                b.iter(|| {
                    (0..family.gains.len())
                        .map(|i| online.margin(i, black_box(&state)))
                        .fold(0.0, f64::min)
                })
            },
        );
    }
}

/// The plan of a footstep, and the work after its landing, for which the paper took 0.15 ms: from footholds to support
/// polygon and frame, the CPI sets of all gains, and the fastest gain whose CPI set contains the state.
pub fn footstep(c: &mut Criterion) {
    let (robot, family) = (
        standfast::robots::load("ut-mu2").expect("built in"),
        family("paper"),
    );
    let design = Design::new(
        &robot,
        &standfast::controllers::gain_set("paper").expect("built in"),
        PENDULUM.dt,
    )
    .expect("valid");
    let rules = design.stepping().expect("it steps");
    let [x, y] = [(0.01, 0.4, 0.13), (0.05, 0.02, 0.0)].map(|(com, com_vel, to)| {
        let most = robot.soles.left.half_m[0] - family.zmp_margin;
        Boundary {
            com,
            com_vel,
            target: 0.5 * to,
            zmp: [-most, most],
        }
    });
    c.bench_function("sets/plan of a footstep", |b| {
        b.iter(|| [x, y].map(|axis| AxisPlan::new(PENDULUM.omega, rules, black_box(&axis))))
    });

    let foothold = |x: f64, y: f64, yaw: f64| {
        Isometry3::from_parts(
            Vector3::new(x, y, 0.0).into(),
            UnitQuaternion::from_euler_angles(0.0, 0.0, yaw),
        )
    };
    let landed = PerFoot {
        left: foothold(0.0, 0.0485, 0.0),
        right: foothold(0.13, -0.06, 0.1),
    };
    let both = PerFoot {
        left: true,
        right: true,
    };
    let mut online = OnlineSets::new(&family);
    let state = State {
        x: Vector3::new(-0.01, 0.2, 0.02),
        y: Vector3::new(0.01, -0.05, 0.0),
    };
    c.bench_function("sets/after a landing: support, update, membership", |b| {
        b.iter(|| {
            let support = Support::of(&robot, black_box(&landed), &both);
            let allowed = support
                .polygon
                .and_then(|polygon| polygon.inset(family.zmp_margin));
            online.update(&allowed.expect("two soles"));
            online.fastest_holding(black_box(&state))
        })
    });
}
