use super::*;
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng};

/// UT-mu2 in round numbers.
fn ut_mu2() -> SteppingPendulum {
    SteppingPendulum {
        mass_kg: 8.0,
        omega: 5.63,
        com: Point2::origin(),
        sole_x_m: [-0.048086, 0.048086],
        sole_y_m: [-0.034586, 0.034586],
        stance_width_m: 0.097,
        reach: LandingBox { forward_m: 0.15, outward_m: 0.18, inward_m: 0.075 },
        step_time_s: 0.2,
    }
}

#[test]
fn ut_mu2_has_the_bounds_that_others_found() {
    let factor = rectangular_push_factor(5.63, 0.05);
    for (heading_deg, no_step, one_step) in
        [(0.0, 2.49, 5.0), (45.0, 3.51, 5.2), (90.0, 4.29, 4.29), (135.0, 3.51, 5.2), (180.0, 2.49, 5.0)]
    {
        for heading_deg in [heading_deg, -heading_deg] {
            let bounds = ut_mu2().bounds(heading_deg).unwrap();
            let (no, one) = (factor * bounds.no_step_n_s, factor * bounds.one_step_n_s);
            assert!((no - no_step).abs() < 0.01, "{heading_deg}: no step {no}");
            assert!((one - one_step).abs() < 0.05, "{heading_deg}: one step {one}");
        }
    }
}

#[test]
fn in_one_dimension_it_is_the_closed_form() {
    // The feet land on the same line, so there is no demand sideways.
    let reach = LandingBox { forward_m: 0.15, outward_m: 1.0, inward_m: 0.0 };
    let pendulum = SteppingPendulum { reach, ..ut_mu2() };
    let (r, q) = (0.048086, (-5.63_f64 * 0.2).exp());
    let mut d = r;
    for steps in 1..=6 {
        d = (0.15 - r + d) * q + r;
        let found = pendulum.exactly_n_s(0.0, steps).unwrap() / (8.0 * 5.63);
        assert!((found - d).abs() < 1e-7, "{steps}: {found}, not {d}");
    }
    let bounds = pendulum.bounds(0.0).unwrap();
    let d_infinite = ((0.15 - r) * q + r) / (1.0 - q);
    assert!((bounds.n_step_n_s / (8.0 * 5.63 * d_infinite) - 1.0).abs() < NO_MORE, "{bounds:?}, not {d_infinite}");
    assert!((5..15).contains(&bounds.steps));
}

#[test]
fn the_bound_follows_the_com() {
    let ahead = SteppingPendulum { com: Point2::new(0.01, 0.0), ..ut_mu2() };
    for steps in 0..4 {
        let of = |pendulum: &SteppingPendulum, heading_deg| match steps {
            0 => pendulum.no_step_n_s(heading_deg),
            n => pendulum.exactly_n_s(heading_deg, n).unwrap(),
        };
        let moved = 8.0 * 5.63 * 0.01;
        assert!((of(&ahead, 0.0) - (of(&ut_mu2(), 0.0) - moved)).abs() < 1e-6);
        assert!((of(&ahead, 180.0) - (of(&ut_mu2(), 180.0) + moved)).abs() < 1e-6);
    }
    let beside = SteppingPendulum { com: Point2::new(0.06, 0.0), ..ut_mu2() };
    assert_eq!(beside.no_step_n_s(0.0), 0.0);
}

#[test]
fn a_longer_push_may_be_harder() {
    for (duration_s, factor) in [(0.05, 1.147), (0.1, 1.31), (0.2, 1.67)] {
        assert!((rectangular_push_factor(5.63, duration_s) - factor).abs() < 6e-3);
    }
    assert_eq!(rectangular_push_factor(5.63, 0.0), 1.0);
    // By quadrature: the effect of f(t) is the integral of f e^(-omega t).
    let (omega, duration_s, n) = (5.63, 0.15, 20_000);
    let mean = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f((i as f64 + 0.5) / n as f64)).sum::<f64>() / n as f64;
    let counts = |course: &dyn Fn(f64) -> f64| mean(&|s| course(s) * (-omega * duration_s * s).exp()) / mean(course);
    assert!((rectangular_push_factor(omega, duration_s) * counts(&|_| 1.0) - 1.0).abs() < 1e-7);
    assert!((half_sine_push_factor(omega, duration_s) * counts(&|s| (PI * s).sin()) - 1.0).abs() < 1e-7);
}

/// A dcm from which footsteps recover, by the pendulum's equation backwards from a final position between two soles,
/// through any ZMPs and landings. Most are at the same end of their ranges, since the extremes are sought.
fn caught(pendulum: &SteppingPendulum, steps: usize, stance: f64, chance: &mut TestRng) -> Point2<f64> {
    let LandingBox { forward_m, outward_m, inward_m } = pendulum.reach;
    let ([x0, x1], [y0, y1]) = (pendulum.sole_x_m, pendulum.sole_y_m);
    let ends = [chance.random::<f64>() < 0.5, chance.random::<f64>() < 0.5];
    let mut pick = |axis: usize, a: f64, b: f64| {
        let share = chance.random::<f64>();
        let end = if ends[axis] { a.max(b) } else { a.min(b) };
        if chance.random::<f64>() < 0.8 { end } else { a + (b - a) * share }
    };
    let mut soles = vec![(Point2::new(0.0, stance * pendulum.stance_width_m / 2.0), stance)];
    for k in 0..steps {
        let (at, side) = soles[k];
        let way = Vector2::new(pick(0, -forward_m, forward_m), pick(1, -side * inward_m, -side * outward_m));
        soles.push((at + way, -side));
    }
    let mut inside = |at: Point2<f64>| at + Vector2::new(pick(0, x0, x1), pick(1, y0, y1));
    let zmps: Vec<Point2<f64>> = soles.iter().map(|&(at, _)| inside(at)).collect();
    let (last, before) = (zmps[steps], inside(soles[steps - 1].0));
    let share = [0.0, chance.random::<f64>(), 1.0][(3.0 * chance.random::<f64>()) as usize];
    let mut dcm = before + (last - before) * share;
    for zmp in zmps[..steps].iter().rev() {
        dcm = zmp + (dcm - zmp) * (-pendulum.omega * pendulum.step_time_s).exp();
    }
    dcm
}

#[test]
fn sampled_footsteps_catch_up_to_the_bound_and_no_more() {
    let pendulum = SteppingPendulum { com: Point2::new(0.004, -0.003), ..ut_mu2() };
    let mut chance = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    for steps in [1, 2, 3] {
        // How far the samples reach for each stance foot, as the hull in directions all around.
        let normals: Vec<Vector2<f64>> = (0..360).map(|i| direction(i as f64)).collect();
        let mut hulls = [vec![f64::NEG_INFINITY; 360], vec![f64::NEG_INFINITY; 360]];
        for i in 0..40_000 {
            let dcm = caught(&pendulum, steps, [1.0, -1.0][i % 2], &mut chance);
            for (far, normal) in hulls[i % 2].iter_mut().zip(&normals) {
                *far = far.max(normal.dot(&dcm.coords));
            }
        }
        let catches = |dcm: Point2<f64>| {
            hulls.iter().any(|hull| hull.iter().zip(&normals).all(|(far, normal)| normal.dot(&dcm.coords) <= *far))
        };
        for heading_deg in [0.0, 30.0, 75.0, 120.0, -20.0, -100.0, -150.0] {
            let bound_m = pendulum.exactly_n_s(heading_deg, steps).unwrap() / (pendulum.mass_kg * pendulum.omega);
            let at = |share: f64| pendulum.com + direction(heading_deg) * (bound_m * share);
            assert!(catches(at(0.98)), "{steps} steps at {heading_deg}: less than {bound_m} m is not caught");
            assert!(!catches(at(1.002)), "{steps} steps at {heading_deg}: more than {bound_m} m is caught");
        }
    }
}

/// Programs on which the solver alone makes no progress: feet that cannot reach anything, seen from beside the soles.
#[test]
fn what_the_solver_gives_up_is_decided() {
    for (heading_deg, x, y) in [
        (-49.48337274454812, -0.026949666059254022, -0.042285175371695134),
        (131.8930372442295, 0.026375036059389734, 0.03534421265399891),
        (-56.192296129921885, 0.01703688562132756, 0.04881370023893243),
        (-131.27640287686586, 0.029307690406912404, -0.03213146600268822),
        (-37.96617841926238, 0.0028133806815172704, -0.029406477509638998),
    ] {
        let reach = LandingBox { forward_m: 0.0, outward_m: 0.0, inward_m: 0.0 };
        let bounds = SteppingPendulum { com: Point2::new(x, y), reach, ..ut_mu2() }.bounds(heading_deg).unwrap();
        assert!(bounds.one_step_n_s <= bounds.no_step_n_s * (1.0 + 1e-6), "{heading_deg}: {bounds:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn more_footsteps_and_a_longer_reach_never_bring_less(
        heading_deg in -180.0..180.0, forward_m in 0.0..0.3, more in 0.0..0.1, x in -0.03..0.03, y in -0.05..0.05,
    ) {
        let reach = LandingBox { forward_m, ..ut_mu2().reach };
        let pendulum = SteppingPendulum { com: Point2::new(x, y), reach, ..ut_mu2() };
        let b = pendulum.bounds(heading_deg).unwrap();
        prop_assert!(b.no_step_n_s <= b.one_step_n_s && b.one_step_n_s <= b.n_step_n_s, "{b:?}");
        prop_assert!(b.steps < MOST_STEPS);
        let longer = LandingBox { forward_m: forward_m + more, outward_m: 0.18 + more, inward_m: 0.075 };
        let far = SteppingPendulum { reach: longer, ..pendulum }.bounds(heading_deg).unwrap();
        prop_assert!(far.one_step_n_s >= b.one_step_n_s - 1e-6 && far.n_step_n_s >= b.n_step_n_s - 1e-3 * b.n_step_n_s);
    }

    #[test]
    fn feet_that_reach_nowhere_bring_nothing(
        heading_deg in -180.0..180.0, x in -0.03..0.03, y in -0.05..0.05,
    ) {
        for sideways in [0.0, 0.097] {
            let reach = LandingBox { forward_m: 0.0, outward_m: sideways, inward_m: sideways };
            let pendulum = SteppingPendulum { com: Point2::new(x, y), reach, ..ut_mu2() };
            let b = pendulum.bounds(heading_deg).unwrap();
            prop_assert!(b.one_step_n_s < b.no_step_n_s * (1.0 + 1e-6) + 1e-6, "{sideways}: {b:?}");
        }
    }
}
