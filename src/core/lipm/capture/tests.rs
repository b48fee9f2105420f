use super::*;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng};

const BESIDE_REGION: SwingRegion = SwingRegion {
    x_m: [-0.15, 0.15],
    y_m: [0.075, 0.18],
    swing_time_s: 0.2,
};
const IN_FRONT: SwingRegion = SwingRegion {
    x_m: [0.145, 0.15],
    y_m: [-0.075, 0.075],
    swing_time_s: 0.2,
};

/// Relative tolerance for the impulse that more than [`MOST_STEPS`] footsteps would add.
const NEARLY: f64 = 1e-3;

/// UT-mu2 in round numbers, with feet that do not cross.
fn ut_mu2() -> SteppingPendulum {
    SteppingPendulum {
        mass_kg: 8.0,
        omega: 5.63,
        com: Point2::origin(),
        sole_x_m: [-0.048086, 0.048086],
        sole_y_m: [-0.034586, 0.034586],
        both_x_m: [-0.048086, 0.048086],
        both_y_m: [-0.034586, 0.034586],
        stance_width_m: 0.097,
        regions: vec![BESIDE_REGION],
    }
}

#[test]
fn ut_mu2_has_the_bounds_that_others_found() {
    let beside = SteppingPendulum {
        com: Point2::new(0.06, 0.0),
        ..ut_mu2()
    };
    assert_eq!(beside.at_most_n_s(0.0, 0), 0.0, "a COM beside the support");
    let factor = rectangular_push_factor(5.63, 0.05);
    for (heading_deg, no_step, one_step) in [
        (0.0, 2.49, 5.0),
        (45.0, 3.51, 5.2),
        (90.0, 4.29, 4.29),
        (135.0, 3.51, 5.2),
        (180.0, 2.49, 5.0),
    ] {
        for heading_deg in [heading_deg, -heading_deg] {
            let bounds = ut_mu2().bounds(heading_deg);
            let (no, one) = (factor * bounds.no_step_n_s, factor * bounds.one_step_n_s);
            assert!((no - no_step).abs() < 0.01, "{heading_deg}: no step {no}");
            assert!(
                (one - one_step).abs() < 0.05,
                "{heading_deg}: one step {one}"
            );
        }
    }
}

/// One ankle holds the ZMP within 2 cm until the last foot has landed, and both within 4 cm after that.
#[test]
fn weak_ankles_hold_less_on_one_foot_than_on_both() {
    let weak = SteppingPendulum {
        sole_x_m: [-0.02, 0.02],
        both_x_m: [-0.04, 0.04],
        ..ut_mu2()
    };
    let weak = SteppingPendulum {
        regions: vec![SwingRegion {
            y_m: [0.0, 1.0],
            ..BESIDE_REGION
        }],
        ..weak
    };
    let q = (-5.63_f64 * 0.2).exp();
    let one_step = (1.0 - q) * 0.02 + q * (0.15 + 0.04);
    let two_steps = (1.0 - q * q) * 0.02 + q * 0.15 + q * q * (0.15 + 0.04);
    for (steps, expected) in [(0, 0.04), (1, one_step), (2, two_steps)] {
        let bound_m = weak.at_most_n_s(0.0, steps) / (8.0 * 5.63);
        assert!(
            (bound_m / expected - 1.0).abs() < 1e-9,
            "{steps}: {bound_m}, not {expected}"
        );
    }
}

fn with(regions: &[SwingRegion]) -> SteppingPendulum {
    SteppingPendulum {
        regions: regions.to_vec(),
        ..ut_mu2()
    }
}

#[test]
fn in_one_dimension_it_is_the_closed_form() {
    // The feet land on the same line, so there is no demand sideways.
    let pendulum = with(&[SwingRegion {
        y_m: [0.0, 1.0],
        ..BESIDE_REGION
    }]);
    let (r, q) = (0.048086, (-5.63_f64 * 0.2).exp());
    let mut d = r;
    for steps in 1..=6 {
        d = (0.15 - r + d) * q + r;
        let bound_m = pendulum.at_most_n_s(0.0, steps) / (8.0 * 5.63);
        assert!(
            (bound_m / d - 1.0).abs() < NEARLY,
            "{steps}: {bound_m}, not {d}"
        );
    }
    let d_infinite = ((0.15 - r) * q + r) / (1.0 - q);
    let bound_m = pendulum.bounds(0.0).n_step_n_s / (8.0 * 5.63);
    assert!(
        (bound_m / d_infinite - 1.0).abs() < NEARLY,
        "{bound_m}, not {d_infinite}"
    );
}

/// Footsteps of a stride of 0.15 m, all but the first of which travel by two of them. Without travel, and with a second place
/// that is out of the way, the closed form of one region.
#[test]
fn footsteps_that_travel_far_take_longer() {
    let stride = |time_s| Place {
        at: Vector2::new(0.15, 0.097),
        time_s,
    };
    let bound_m = |places: &[Place]| ut_mu2().early_n_s(0.0, places) / (8.0 * 5.63);
    let q = |time_s: f64| (-5.63 * time_s).exp();
    let nowhere = Place {
        at: Vector2::new(-0.15, 0.3),
        time_s: [0.1, 0.0],
    };
    for (places, first, later) in [
        (vec![stride([0.1, 0.5])], q(0.175), q(0.25)),
        (vec![stride([0.2, 0.0]), nowhere], q(0.2), q(0.2)),
    ] {
        let expected = 0.048086 + 0.15 * first / (1.0 - later);
        let bound_m = bound_m(&places);
        assert!(
            (bound_m / expected - 1.0).abs() < NEARLY,
            "{bound_m}, not {expected}"
        );
    }
    assert_eq!(bound_m(&[]), 0.048086);
}

/// A foot that crosses by c in T, exactly sideways, and then one outward footstep.
#[test]
fn a_foot_that_crosses_catches_more_from_the_side() {
    let (edge, omega) = (0.0485 + 0.034586, 5.63_f64);
    for (time_s, c) in [(0.2, 0.03), (0.2, 0.075), (0.3, 0.075)] {
        let q = (-omega * time_s).exp();
        // It crosses through the stance sole, so that there is no demand fore and aft.
        let crossing = SwingRegion {
            x_m: [0.0, 0.0],
            y_m: [-c, 0.075],
            swing_time_s: time_s,
        };
        let outward = SwingRegion {
            x_m: [0.0, 0.0],
            y_m: [0.075, 0.18],
            swing_time_s: time_s,
        };
        let pendulum = with(&[outward, crossing]);
        let d = |steps| pendulum.at_most_n_s(90.0, steps) / (8.0 * omega);
        assert!(
            (d(1) - (edge + q * c)).abs() < 1e-7,
            "{time_s} {c}: {}",
            d(1)
        );
        assert!(
            (d(2) - (edge + q * (c + q * 0.18))).abs() < 1e-7,
            "{time_s} {c}: {}",
            d(2)
        );
        // Feet that stay on their sides gain nothing.
        assert!((with(&[outward]).at_most_n_s(90.0, 40) / (8.0 * omega) - edge).abs() < 1e-7);
    }
}

#[test]
fn a_longer_push_may_be_harder() {
    assert_eq!(rectangular_push_factor(5.63, 0.0), 1.0);
    // By quadrature: the effect of f(t) is the integral of f e^(-omega t).
    let (omega, duration_s, n) = (5.63, 0.15, 20_000);
    let mean = |f: &dyn Fn(f64) -> f64| {
        (0..n).map(|i| f((i as f64 + 0.5) / n as f64)).sum::<f64>() / n as f64
    };
    let counts = |course: &dyn Fn(f64) -> f64| {
        mean(&|s| course(s) * (-omega * duration_s * s).exp()) / mean(course)
    };
    assert!((rectangular_push_factor(omega, duration_s) * counts(&|_| 1.0) - 1.0).abs() < 1e-7);
    assert!(
        (half_sine_push_factor(omega, duration_s) * counts(&|s| (PI * s).sin()) - 1.0).abs() < 1e-7
    );
}

/// A dcm from which footsteps recover, by the pendulum's equation backwards from a final position between two soles,
/// through any ZMPs and landings. Most are at the same end of their ranges, since the extremes are sought.
fn caught(
    pendulum: &SteppingPendulum,
    steps: usize,
    stance: f64,
    chance: &mut TestRng,
) -> Point2<f64> {
    let SwingRegion {
        x_m: [backward_m, forward_m],
        y_m: [inward_m, outward_m],
        swing_time_s,
    } = pendulum.regions[0];
    let ([x0, x1], [y0, y1]) = (pendulum.sole_x_m, pendulum.sole_y_m);
    let ends = [chance.random::<f64>() < 0.5, chance.random::<f64>() < 0.5];
    let mut pick = |axis: usize, a: f64, b: f64| {
        let share = chance.random::<f64>();
        let end = if ends[axis] { a.max(b) } else { a.min(b) };
        if chance.random::<f64>() < 0.8 {
            end
        } else {
            a + (b - a) * share
        }
    };
    let mut soles = vec![(
        Point2::new(0.0, stance * pendulum.stance_width_m / 2.0),
        stance,
    )];
    for k in 0..steps {
        let (at, side) = soles[k];
        let way = Vector2::new(
            pick(0, backward_m, forward_m),
            pick(1, -side * inward_m, -side * outward_m),
        );
        soles.push((at + way, -side));
    }
    let mut inside = |at: Point2<f64>| at + Vector2::new(pick(0, x0, x1), pick(1, y0, y1));
    let zmps: Vec<Point2<f64>> = soles.iter().map(|&(at, _)| inside(at)).collect();
    let (last, before) = (zmps[steps], inside(soles[steps - 1].0));
    let share = [0.0, chance.random::<f64>(), 1.0][(3.0 * chance.random::<f64>()) as usize];
    let mut dcm = before + (last - before) * share;
    for zmp in zmps[..steps].iter().rev() {
        dcm = zmp + (dcm - zmp) * (-pendulum.omega * swing_time_s).exp();
    }
    dcm
}

/// The samples contain the vertices of the set of DCMs from which footsteps recover. The hull of a stance sole and a
/// second sole ahead of it and across is diagonal.
#[test]
fn sampled_footsteps_catch_up_to_the_bound_and_no_more() {
    let normals: Vec<Vector2<f64>> = (0..360).map(|i| direction(i as f64)).collect();
    for (region, most) in [(BESIDE_REGION, 3), (IN_FRONT, 1)] {
        let pendulum = SteppingPendulum {
            com: Point2::new(0.004, -0.003),
            ..with(&[region])
        };
        let mut chance = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        let mut hulls = Vec::new();
        for steps in 1..=most {
            for stance in [1.0, -1.0] {
                let samples: Vec<_> = (0..20_000)
                    .map(|_| caught(&pendulum, steps, stance, &mut chance))
                    .collect();
                let ahead = |n: &Vector2<f64>, at: &Point2<f64>| n.dot(&at.coords);
                let mut vertices: Vec<Point2<f64>> = Vec::new();
                for n in &normals {
                    let farthest = samples
                        .iter()
                        .max_by(|a, b| ahead(n, a).total_cmp(&ahead(n, b)));
                    vertices.push(*farthest.unwrap());
                }
                vertices.dedup_by(|a, b| (*a - *b).norm() < 1e-6);
                hulls.push(SupportPolygon::hull(&vertices).unwrap());
            }
            for heading_deg in [
                0.0, 30.0, 60.0, 75.0, 90.0, 100.0, 120.0, 135.0, -20.0, -70.0, -100.0, -150.0,
            ] {
                let along = direction(heading_deg);
                let stands_m = pendulum
                    .both_soles()
                    .farthest(along, &pendulum.both_soles());
                let ways_m = hulls
                    .iter()
                    .filter_map(|hull| hull.distance_along(pendulum.com, along));
                let sampled_m = ways_m.fold(stands_m, f64::max);
                let bound_m =
                    pendulum.at_most_n_s(heading_deg, steps) / (pendulum.mass_kg * pendulum.omega);
                assert!(
                    (sampled_m - bound_m).abs() < 1e-6,
                    "{steps} steps, {heading_deg}: {sampled_m} m, {bound_m} m"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn more_footsteps_longer_reach_shorter_times_and_more_regions_never_bring_less(
        heading_deg in -180.0..180.0, forward_m in 0.0..0.3_f64, more in 0.0..0.1, x in -0.03..0.03, y in -0.05..0.05,
        faster in 0.6..1.0,
    ) {
        let region = SwingRegion { x_m: [-1.0, 1.0].map(|way: f64| way * forward_m), ..BESIDE_REGION };
        let pendulum = |regions: &[SwingRegion]| SteppingPendulum { com: Point2::new(x, y), ..with(regions) };
        let enough = |a: f64, b: f64| a >= b * (1.0 - 1e-9) - 1e-9;
        let b = pendulum(&[region]).bounds(heading_deg);
        prop_assert!(b.no_step_n_s <= b.one_step_n_s && b.one_step_n_s <= b.n_step_n_s, "{b:?}");
        let longer = SwingRegion { x_m: [-1.0, 1.0].map(|way: f64| way * (forward_m + more)), y_m: [0.075, 0.18 + more], ..region };
        let quicker = SwingRegion { swing_time_s: 0.2 * faster, ..region };
        for regions in [&[longer][..], &[quicker], &[region, IN_FRONT]] {
            let m = pendulum(regions).bounds(heading_deg);
            prop_assert!(enough(m.one_step_n_s, b.one_step_n_s) && enough(m.n_step_n_s, b.n_step_n_s), "{b:?} {m:?}");
        }
    }

    /// A region that is reached too late, or whose landing places are the present ones, adds nothing to the bounds.
    #[test]
    fn feet_that_cross_too_slowly_or_reach_nowhere_bring_nothing(
        heading_deg in -180.0..180.0, x in -0.03..0.03, y in -0.05..0.05,
    ) {
        let bounds = |regions: &[SwingRegion]| SteppingPendulum { com: Point2::new(x, y), ..with(regions) }.bounds(heading_deg);
        let (without, slow) = (bounds(&[BESIDE_REGION]), bounds(&[BESIDE_REGION, SwingRegion { swing_time_s: 9.0, ..IN_FRONT }]));
        prop_assert!((slow.n_step_n_s / without.n_step_n_s - 1.0).abs() < NEARLY);
        prop_assert!((slow.one_step_n_s / without.one_step_n_s - 1.0).abs() < 1e-9);
        for sideways in [0.0, 0.097] {
            let b = bounds(&[SwingRegion { x_m: [0.0, 0.0], y_m: [sideways, sideways], ..BESIDE_REGION }]);
            prop_assert!(b.one_step_n_s < b.no_step_n_s * (1.0 + 1e-6) + 1e-6, "{sideways}: {b:?}");
        }
    }
}
