//! The result of `standfast limit` as a table: the largest recoverable impulse by heading.

use crate::campaign::limit::{Heading, Limits, SetLimit};
use crate::render::text::layout::signed;
use std::fmt::Write;

/// The table, which is at most 80 columns wide if no name has more than 18 letters.
pub fn text(limits: &Limits) -> String {
    let mut text = String::new();
    let y = &limits.yardstick;
    // Writing to a String cannot fail.
    let mut line = |s: String| _ = writeln!(text, "{s}");
    line(format!(
        "Largest recoverable impulse [N s]: {}, campaign {}, seed {}",
        limits.robot, limits.campaign, limits.seed
    ));
    line(format!(
        "robot:    {:.3} kg, omega {:.3} rad/s, COM {:.4} m high and at {}, {} mm\n          (x, y) from the middle of the feet",
        y.mass_kg,
        y.omega_rad_s,
        y.com_height_m,
        signed(1e3 * y.com_offset_m[0], 1),
        signed(1e3 * y.com_offset_m[1], 1)
    ));
    line(format!(
        "footstep: takes {} s and reaches {} m fore and aft, {} to {} m sideways;\n          at home the feet are {:.3} m apart",
        y.min_step_time_s, y.reach_m.forward, y.reach_m.inward, y.reach_m.outward, y.stance_width_m
    ));
    line(format!(
        "push:     {:.0} ms long, so that the bounds are {:.3} times those of a push of no\n          duration; {} mm above the COM\n",
        1e3 * y.push_duration_s,
        y.push_factor,
        signed(1e3 * y.push_height_m, 0)
    ));
    line(format!(
        "{:>7}  {:>17}   {:18} {:>17} {:>5} {:>5}",
        "", "bounds by footsteps", "", "50 % recover", "90 %", "of"
    ));
    line(format!(
        "{:>7} {:>6} {:>6} {:>6}  {:18} {:>17} {:>5} {:>5}",
        "heading", "none", "one", "any", "gain set", "(95 % interval)", "", "one"
    ));
    for heading in &limits.headings {
        let bounds = bounds_of(heading.heading_deg, heading, 1.0);
        let raised = y.height_factor < 1.0;
        let mut left = vec![bounds];
        if raised {
            left.push(bounds_of(f64::NAN, heading, y.height_factor));
        }
        for i in 0..heading.sets.len().max(left.len()) {
            let bounds = left.get(i).cloned().unwrap_or_else(|| " ".repeat(28));
            line(format!("{bounds}  {}", heading.sets.get(i).map_or(String::new(), set_of)).trim_end().into());
        }
    }
    if y.height_factor < 1.0 {
        line(format!(
            "\nThe second line of bounds takes the height of the push into account: it is the\nfirst times {:.3}.",
            y.height_factor
        ));
    }
    let marked = limits.headings.iter().flat_map(|h| &h.sets).filter(|set| !set.resolved).count();
    if marked > 0 {
        line(format!(
            "\n* The interval is wider than +-{} N s: the search ran out of trials, or left the\nrange of impulses.",
            limits.precision_n_s
        ));
    }
    line(format!(
        "\nImpulses are in N s. The bounds are the largest impulses from which a pendulum\n\
         recovers with no footstep, with one, and with any number of them. `50 %\n\
         recover` is the impulse from which the gain set recovers in half of the trials,\n\
         `90 %` that of nine in ten, and `of one` the former over the bound with one\n\
         footstep. {} episodes were run. The intervals are within +-{} N s, except where\n\
         marked with *.",
        limits.episodes, limits.precision_n_s
    ));
    text
}

/// The bounds at a heading, times `factor`. Without a heading (NaN), its column is empty.
fn bounds_of(heading_deg: f64, heading: &Heading, factor: f64) -> String {
    let name = if heading_deg.is_nan() { String::new() } else { format!("{heading_deg:.1}") };
    let [no, one, n] = [heading.bound_no_step_n_s, heading.bound_one_step_n_s, heading.bound_n_step_n_s];
    format!("{name:>7} {:6.2} {:6.2} {:6.2}", factor * no, factor * one, factor * n)
}

/// The limits of a gain set.
fn set_of(set: &SetLimit) -> String {
    let mark = if set.resolved { ' ' } else { '*' };
    let ninety = set.impulse90_n_s.map_or("-".into(), |impulse| format!("{impulse:.2}"));
    format!(
        "{:18} {:5.2} ({:.2}-{:.2}){mark}{ninety:>5} {:5.2}",
        set.name, set.impulse50_n_s, set.ci95[0], set.ci95[1], set.of_one_step_bound
    )
}
