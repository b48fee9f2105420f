//! The result of `standfast limit` as a table: the largest recoverable impulse by heading.

use crate::campaign::limit::{FirstLoss, Heading, Limits, SetLimit};
use crate::render::text::layout::{signed, unit_of_impulses};
use crate::stats::rate::median;
use std::fmt::Write;

/// The limits in one physics engine beside the bounds of the pendulum, or those in two engines side by side. A line has
/// at most 80 columns if no name has more than 18 letters.
pub fn text(limits: &[Limits]) -> String {
    match limits {
        [one] => beside_bounds(one),
        [first, second, ..] => side_by_side(first, second),
        [] => String::new(),
    }
}

/// What was searched, and with what.
fn head(limits: &Limits) -> String {
    let Limits { robot, campaign, seed, .. } = limits;
    format!(
        "Largest recoverable impulse [N s]: {robot}, campaign {campaign}, seed {seed}\n\
         unit:     {}\n",
        unit_of_impulses(limits.unit_n_s)
    )
}

/// An impulse, with as many digits as the precision of the limits is worth and five columns hold.
fn n_s(limits: &Limits, impulse_n_s: f64) -> String {
    let worth = (1.0 - limits.precision_n_s.log10().floor()).clamp(0.0, 4.0) as usize;
    let texts = (0..=worth).rev().map(|decimals| format!("{impulse_n_s:.decimals$}"));
    texts.into_iter().find(|text| text.len() <= 5).unwrap_or_else(|| format!("{impulse_n_s:.0}"))
}

fn engine(limits: &Limits) -> String {
    format!("{}, with a physics step of {} ms", limits.engine, 1e3 * limits.physics_step_s)
}

fn beside_bounds(limits: &Limits) -> String {
    let mut text = head(limits);
    let y = &limits.yardstick;
    // Writing to a String cannot fail.
    let mut line = |s: String| _ = writeln!(text, "{s}");
    line(format!("engine:   {}", engine(limits)));
    line(format!(
        "robot:    {:.3} kg, omega {:.3} rad/s, COM {:.4} m high and at {}, {} mm\n          (x, y) from the middle of the feet",
        y.mass_kg,
        y.omega_rad_s,
        y.com_height_m,
        signed(1e3 * y.com_offset_m[0], 1),
        signed(1e3 * y.com_offset_m[1], 1)
    ));
    line(format!(
        "footstep: at home the feet are {:.3} m apart, and one can land, x ahead of the\n          other and y beside it,",
        y.stance_width_m
    ));
    for region in &y.reach {
        let ([x0, x1], [y0, y1]) = (region.x_m, region.y_m);
        let swing_time_s = region.swing_time_s;
        line(format!("          {}: x {x0} to {x1} m, y {y0} to {y1} m, in {swing_time_s} s", region.name));
    }
    line(format!(
        "push:     {:.0} ms long, so that the bounds are {:.3} times those of a push of no\n          duration; {} mm above the COM\n",
        1e3 * y.push_duration_s,
        y.push_factor,
        signed(1e3 * y.push_height_m, 0)
    ));
    line(format!("{:>7} {:^17} {:18} {:>17}   {:>5} {:>5}", "", "bounds by steps", "", "50 % recover", "90 %", "safe"));
    line(format!(
        "{:>7} {:>5} {:>5} {:>5} {:18} {:>17}   {:>5} {:>5}",
        "heading", "none", "one", "any", "gain set", "(95 % interval)", "", "up to"
    ));
    for heading in &limits.headings {
        let bounds = bounds_of(limits, heading, 1.0);
        let raised = y.height_factor < 1.0;
        let mut left = vec![bounds];
        if raised {
            left.push(bounds_of(limits, heading, y.height_factor));
        }
        for i in 0..heading.sets.len().max(left.len()) {
            let bounds = left.get(i).cloned().unwrap_or_else(|| " ".repeat(25));
            line(
                format!("{bounds} {}", heading.sets.get(i).map_or(String::new(), |set| set_of(limits, set)))
                    .trim_end()
                    .into(),
            );
        }
    }
    if y.height_factor < 1.0 {
        line(format!(
            "\nThe second line of bounds takes the height of the push into account: it is the\nfirst times {:.3}.",
            y.height_factor
        ));
    }
    line(marked(&[limits]) + &lost_early(limits));
    line(format!(
        "Impulses are in N s. The bounds are the largest impulses from which a pendulum\n\
         recovers with no footstep, with one, and with any number of them; it keeps its\n\
         height and has no angular momentum. `50 % recover` is the impulse from which the\n\
         gain set recovers in half of the trials, and `90 %` that of nine in ten. {}\n\
         {} episodes were run. The intervals are within +-{} N s, except\n\
         where marked with *.",
        safe_means(limits),
        limits.episodes,
        limits.precision_n_s,
    ));
    text
}

/// What `safe up to` means.
fn safe_means(limits: &Limits) -> String {
    let episodes = match limits.replicas {
        0 => return "`safe\nup to` was not searched (--replicas 0).".into(),
        1 => "1 episode".into(),
        replicas => format!("{replicas} episodes"),
    };
    format!(
        "`safe\nup to` is the largest impulse of a grid of {} N s from which, and from all\n\
         smaller ones, it always recovered, in {episodes} for each impulse.",
        limits.precision_n_s
    )
}

/// The holes: losses far below the limit, each with the command that repeats it.
fn lost_early(limits: &Limits) -> String {
    let mut text = String::new();
    let all = limits.headings.iter().flat_map(|heading| heading.sets.iter().map(move |set| (heading, set)));
    for (heading, set) in all.filter(|(_, set)| set.has_hole()) {
        let (Some(safe_n_s), Some(loss)) = (set.safe_n_s, set.first_loss) else { continue };
        _ = writeln!(
            text,
            "\nhole: {} at {:.1} degrees is safe only up to {} N s;\nto see the loss:\n  {}",
            set.name,
            heading.heading_deg,
            n_s(limits, safe_n_s),
            replay(limits, &set.name, &loss)
        );
    }
    text
}

/// The command that repeats a loss.
fn replay(limits: &Limits, gains: &str, loss: &FirstLoss) -> String {
    let Limits { campaign, seed, .. } = limits;
    let FirstLoss { impulse_n_s, heading_deg, start_s, trial } = loss;
    format!(
        "standfast push --campaign {campaign} --seed {seed} --trial {trial} --gains {gains} \\\n  \
         --impulse {impulse_n_s} --heading {heading_deg} --start {start_s}"
    )
}

/// The bounds at a heading, times `factor`. The heading stands beside the bounds as they are.
fn bounds_of(limits: &Limits, heading: &Heading, factor: f64) -> String {
    let [no, one, n] = [heading.bound_no_step_n_s, heading.bound_one_step_n_s, heading.bound_n_step_n_s];
    let [no, one, n] = [no, one, n].map(|bound_n_s| n_s(limits, factor * bound_n_s));
    let bounds = format!("{no:>5} {one:>5} {n:>5}");
    match factor {
        1.0 => format!("{:>7.1} {bounds}", heading.heading_deg),
        _ => format!("{:>7} {bounds}", ""),
    }
}

fn set_of(limits: &Limits, set: &SetLimit) -> String {
    let or_dash = |impulse: Option<f64>| impulse.map_or("-".into(), |impulse| n_s(limits, impulse));
    let [ninety, safe] = [set.impulse90_n_s, set.safe_n_s].map(or_dash);
    format!("{:18} {:20}{ninety:>5} {safe:>5}", set.name, fifty_of(limits, set))
}

/// The impulse with 50 % recovery and its interval, and a mark if that is too wide.
fn fifty_of(limits: &Limits, set: &SetLimit) -> String {
    let mark = if set.resolved { ' ' } else { '*' };
    let [at, low, high] = [set.impulse50_n_s, set.ci95[0], set.ci95[1]].map(|impulse_n_s| n_s(limits, impulse_n_s));
    format!("{at:>5} ({low}-{high}){mark}")
}

/// What the mark `*` means, if there is any.
fn marked(all: &[&Limits]) -> String {
    if all.iter().flat_map(|limits| &limits.headings).flat_map(|heading| &heading.sets).all(|set| set.resolved) {
        return String::new();
    }
    format!(
        "\n* The interval is wider than +-{} N s, since the search ran out of trials or\nleft the range of impulses.\n",
        all[0].precision_n_s
    )
}

/// The limits of two engines for every heading and gain set, and for each gain set over all headings. The headings and
/// gain sets of both are the same.
fn side_by_side(a: &Limits, b: &Limits) -> String {
    let mut text = head(a);
    let mut line = |s: String| _ = writeln!(text, "{s}");
    line(format!("engines:  {}\n          {}\n", engine(a), engine(b)));
    line(format!("{:>7}  {:18} {:>17}   {:>17}   {:>5}", "heading", "gain set", a.engine, b.engine, "ratio"));
    for (at_a, at_b) in a.headings.iter().zip(&b.headings) {
        let mut heading = format!("{:.1}", at_a.heading_deg);
        for (in_a, in_b) in at_a.sets.iter().zip(&at_b.sets) {
            let apart = if in_a.is_apart_from(in_b) { "apart" } else { "" };
            let (name, ratio) = (&in_a.name, in_b.impulse50_n_s / in_a.impulse50_n_s);
            let [fifty_a, fifty_b] = [fifty_of(a, in_a), fifty_of(b, in_b)];
            let row = format!("{heading:>7}  {name:18} {fifty_a:20}{fifty_b:20}{ratio:5.2}  {apart}");
            line(row.trim_end().into());
            heading.clear();
        }
    }
    line(format!("\n{:27} {:>6} {:>6} {:>6}   {}", "over all headings", "median", "least", "most", "apart"));
    for (i, set) in a.headings.iter().take(1).flat_map(|heading| &heading.sets).enumerate() {
        let both = || a.headings.iter().zip(&b.headings).map(|(in_a, in_b)| (&in_a.sets[i], &in_b.sets[i]));
        let mut ratios: Vec<f64> = both().map(|(in_a, in_b)| in_b.impulse50_n_s / in_a.impulse50_n_s).collect();
        ratios.sort_by(f64::total_cmp);
        let (least, most) = (ratios[0], ratios[ratios.len() - 1]);
        let apart = both().filter(|(in_a, in_b)| in_a.is_apart_from(in_b)).count();
        let apart = format!("at {apart} of {} headings", ratios.len());
        let median = median(ratios).unwrap_or(f64::NAN);
        line(format!("{:9}{:18} {median:6.2} {least:6.2} {most:6.2}   {apart}", "", set.name));
    }
    line(marked(&[a, b]));
    line(format!(
        "Each impulse is the one from which the gain set recovers in half of the trials,\n\
         with its 95 % interval. `ratio` is the second engine's impulse over that of the\n\
         first, and `apart` says that the intervals do not overlap. The trials are the\n\
         same in both engines; {} episodes were run. The bounds of the pendulum are the\n\
         same, too: --json, --plot and --out have them.",
        a.episodes + b.episodes
    ));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::ask::spec::tests::campaign;
    use crate::campaign::limit::Yardstick;
    use crate::robot::Robot;

    /// Two headings with limits of two gain sets (N s).
    fn limits(engine: &str, impulses_n_s: [[f64; 2]; 2]) -> Limits {
        let set = |(name, impulse50_n_s): (&str, f64)| SetLimit {
            name: name.into(),
            impulse50_n_s,
            ci95: [impulse50_n_s - 0.1, impulse50_n_s + 0.1],
            impulse90_n_s: None,
            impulse90_ci95: None,
            of_one_step_bound: impulse50_n_s / 5.0,
            resolved: impulse50_n_s < 9.0,
            safe_n_s: Some(2.4),
            first_loss: Some(FirstLoss { impulse_n_s: 2.5125, heading_deg: -0.75, start_s: 0.501, trial: 202_500 }),
            safe_trials: 25,
            trials: 10,
            recovered: 5,
            fell: 5,
            timed_out: 0,
            diverged: 0,
        };
        let nominal = campaign("nominal", &[]);
        let yardstick = Yardstick::new(&Robot::load("ut-mu2").unwrap(), &nominal).unwrap();
        let heading = |(heading_deg, of_sets): (f64, [f64; 2])| Heading {
            sets: ["hold", "paper:stepping.x=2"].into_iter().zip(of_sets).map(set).collect(),
            ..yardstick.heading(heading_deg)
        };
        Limits {
            campaign: nominal.name,
            robot: nominal.robot,
            engine: engine.into(),
            physics_step_s: 0.002,
            seed: 1,
            unit_n_s: 2.164,
            precision_n_s: 0.1,
            max_trials: 150,
            replicas: 1,
            random: false,
            episodes: 40,
            headings: [0.0, 180.0].into_iter().zip(impulses_n_s).map(heading).collect(),
            yardstick,
        }
    }

    #[test]
    fn two_engines_stand_side_by_side_and_say_where_they_are_apart() {
        let a = limits("Rapier 0.36.1", [[2.5, 5.0], [2.5, 9.5]]);
        let b = limits("MuJoCo 3.17.0", [[2.5, 4.0], [2.6, 9.5]]);
        let told = text(&[a.clone(), b]);
        for line in [
            "    0.0  hold                2.50 (2.40-2.60)    2.50 (2.40-2.60)    1.00",
            "         paper:stepping.x=2  5.00 (4.90-5.10)    4.00 (3.90-4.10)    0.80  apart",
            "  180.0  hold                2.50 (2.40-2.60)    2.60 (2.50-2.70)    1.04",
            "         paper:stepping.x=2  9.50 (9.40-9.60)*   9.50 (9.40-9.60)*   1.00",
            "         hold                 1.02   1.00   1.04   at 0 of 2 headings",
            "         paper:stepping.x=2   0.90   0.80   1.00   at 1 of 2 headings",
            "* The interval is wider than +-0.1 N s, since the search ran out of trials or",
            "same in both engines; 80 episodes were run. The bounds of the pendulum are the",
        ] {
            assert!(told.lines().any(|told| told == line), "{line:?} is not in\n{told}");
        }
        let alone = text(&[a]);
        assert!(alone.contains("\nunit:     1 m omega d = 2.16 N s\n"), "{alone}");
        assert!(alone.contains("engine:   Rapier 0.36.1, with a physics step of 2 ms\n"), "{alone}");
        let early = "hole: paper:stepping.x=2 at 0.0 degrees is safe only up to 2.40 N s;\nto see the loss:\n  \
                     standfast push --campaign nominal --seed 1 --trial 202500 --gains paper:stepping.x=2 \\\n  \
                     --impulse 2.5125 --heading -0.75 --start 0.501\n";
        assert!(alone.contains(early) && !alone.contains("hole: hold"), "{alone}");
        // A command may be longer.
        let alone: Vec<&str> = alone.lines().filter(|line| !line.starts_with("  standfast push")).collect();
        for text in [told, alone.join("\n")] {
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        }
    }
}
