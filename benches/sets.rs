//! Cost of the sets: what runs at every tick beside what is searched once.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use standfast::assets::{self, Kind};
use standfast::geometry::SupportPolygon;
use standfast::lipm::{CpiSet, GainFamily, GainSet, OnlineSets, Pendulum, State};
use std::hint::black_box;

fn sets(c: &mut Criterion) {
    let source = assets::open(Kind::Gains, "switching").expect("built in");
    let set = GainSet::parse(&source).expect("valid");
    let family = GainFamily::design(&set, Pendulum { omega: 5.63, dt: 0.002 }).expect("valid");
    let home = SupportPolygon::rectangle(-0.0481, 0.0481, -0.0831, 0.0831).expect("a rectangle");
    let off_centre = SupportPolygon::rectangle(-0.003, 0.093, -0.0831, 0.0831).expect("a rectangle");
    let mut online = OnlineSets::new(&family);
    online.update(&home);
    // Just inside the slowest set: every set is rolled to its end.
    let pushed = |share: f64| {
        let x = Vector3::new(0.0, share * 0.8 * 5.63 * 0.0481, 0.0);
        State { x, y: Vector3::new(0.01, 0.02, -0.01) }
    };
    let (hard, soft) = (pushed(0.95), pushed(0.3));

    c.bench_function("update on a new polygon, all gains", |b| b.iter(|| online.update(black_box(&off_centre))));
    online.update(&home);
    for (name, state) in [("hard push", hard), ("soft push", soft)] {
        c.bench_function(&format!("membership, fastest gain that holds, {name}"), |b| {
            b.iter(|| online.fastest_holding(black_box(&state)))
        });
        c.bench_function(&format!("margins of all gains, {name}"), |b| {
            b.iter(|| (0..online.len()).map(|i| online.margin(i, black_box(&state))).fold(0.0, f64::min))
        });
    }
    let mut slow = c.benchmark_group("search by linear programs, all gains");
    slow.sample_size(10);
    for (name, polygon) in [("home", home), ("off centre 1:31", off_centre)] {
        slow.bench_function(name, |b| b.iter(|| CpiSet::search_family(&family, black_box(&polygon))));
    }
    slow.finish();
}

criterion_group!(benches, sets);
criterion_main!(benches);
