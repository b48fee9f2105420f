//! Published pushes: the guide shows what the program computes, and the bounds are right for pushes of any duration.

use crate::common::program::{folder, standfast as program, stdout};
use nalgebra::Point2;
use standfast::core::lipm::capture::{SteppingPendulum, SwingRegion, rectangular_push_factor};
use standfast_paper::published::{Answer, Case, Published, Strength};
use std::fs;
use std::path::Path;

#[test]
fn the_guide_shows_the_tables_that_are_computed() {
    let tables = stdout(&program(folder().path(), &["published"]).success());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let chapter = fs::read_to_string(root.join("src/guide/published.md")).unwrap();
    let tables: Vec<&str> = tables.trim_end().split("\n\n").collect();
    assert_eq!(tables.len(), 2);
    for table in tables {
        assert!(
            chapter.contains(table),
            "src/guide/published.md: its tables are not those of `standfast-paper published`:\n\n{table}"
        );
    }
}

/// Caron's point mass: omega 3.50 rad/s times the half width of its foot, 0.05 m.
#[test]
fn a_point_mass_of_constant_height_holds_0_175_m_s() {
    let published = Published::builtin().unwrap();
    let (case, answer) = answers(&published).next().unwrap();
    assert_eq!(case.robot, "point mass");
    let speed_m_s = answer.none_n_s / published.robot(case).unwrap().mass_kg;
    assert!((speed_m_s / 0.175 - 1.0).abs() < 0.01, "{speed_m_s}");
}

/// What was held elsewhere is ruled out by no bound of ours, but for a height that may vary, which no pendulum of constant
/// height has. A push that is ruled out fell.
#[test]
fn what_was_held_is_not_ruled_out() {
    let published = Published::builtin().unwrap();
    let passed: Vec<_> = answers(&published)
        .filter(|(case, answer)| case.held() && answer.share > 1.0)
        .map(|(case, _)| (&case.robot[..], &case.what[..], case.strength))
        .collect();
    assert_eq!(
        passed,
        [("point mass", "height may vary", Strength::SpeedMS(0.18))]
    );
}

fn answers(published: &Published) -> impl Iterator<Item = (&Case, Answer)> {
    let all = published.cases.iter();
    all.map(|case| (case, case.answer(published.robot(case).unwrap())))
}

/// A constant force whose impulse is the bound brings the DCM of a pendulum exactly to the edge of its last sole, where it
/// stays, if the ZMP is at the far edge of each sole: whether the force ends before the footstep or long after it.
#[test]
fn the_bounds_hold_for_pushes_of_any_duration() {
    let (half_m, reach_m, step_s, omega) = (0.048, 0.15, 0.2, 5.63);
    let sole_m = [-half_m, half_m];
    let pendulum = SteppingPendulum {
        mass_kg: 8.0,
        omega,
        com: Point2::origin(),
        sole_x_m: sole_m,
        sole_y_m: [-0.035, 0.035],
        both_x_m: sole_m,
        both_y_m: [-0.035, 0.035],
        stance_width_m: 0.097,
        regions: vec![SwingRegion {
            x_m: [-reach_m, reach_m],
            y_m: [0.075, 0.18],
            swing_time_s: step_s,
        }],
    };
    for steps in [0, 1, 2] {
        for duration_s in [0.0001, 0.05, 0.15, 0.2, 1.0, 3.0] {
            let impulse_n_s =
                pendulum.at_most_n_s(0.0, steps) * rectangular_push_factor(omega, duration_s);
            let end_s = f64::max(duration_s, steps as f64 * step_s);
            let last_m = half_m + steps as f64 * reach_m;
            let after = |impulse_n_s: f64| {
                let offset_m = impulse_n_s / duration_s / (8.0 * omega * omega);
                let mut times_s: Vec<f64> = (0..=steps).map(|k| k as f64 * step_s).collect();
                times_s.extend([duration_s, end_s]);
                times_s.sort_by(f64::total_cmp);
                let mut dcm_m = 0.0;
                for at in times_s.windows(2) {
                    let middle_s = 0.5 * (at[0] + at[1]);
                    let landed = ((middle_s / step_s) as usize).min(steps);
                    let pushed_m = if middle_s < duration_s { offset_m } else { 0.0 };
                    // With this ZMP and force the DCM moves away from the point at which it would stay.
                    let stays_m = half_m + landed as f64 * reach_m - pushed_m;
                    dcm_m = stays_m + (dcm_m - stays_m) * (omega * (at[1] - at[0])).exp();
                }
                dcm_m
            };
            let (at_bound_m, above_m) = (after(impulse_n_s), after(1.01 * impulse_n_s));
            assert!(
                (at_bound_m - last_m).abs() < 1e-6,
                "{steps} footsteps, {duration_s} s: {at_bound_m}, not {last_m}"
            );
            assert!(above_m > last_m + 1e-4, "{steps}, {duration_s}: {above_m}");
        }
    }
}
