//! The result of `standfast limit` as text: the largest recoverable impulse by heading.

use crate::table::{Table, cell, number, texts, words};
use crate::text::layout::{plant_options, signed, sole_impulse, velocity_change, wrapped};
use standfast_study::limit::{ControllerLimit, Heading, LimitEngine, Limits, first_trial};
use std::fmt::Display;

/// The limits beside the pendulum bounds. `changes` are the options that changed the campaign, which the commands that
/// show a push again need.
pub fn text(limits: &Limits, changes: &str) -> String {
    let Limits {
        robot,
        campaign,
        seed,
        sole_impulse_n_s,
        ..
    } = limits;
    let mut text =
        format!("Largest recoverable impulse [N s]: {robot}, campaign {campaign}, seed {seed}\n");
    let velocity = velocity_change(&limits.pendulum_bounds.units(), *sole_impulse_n_s);
    text += &wrapped(
        "unit:     ",
        &format!("{}, {velocity}", sole_impulse(*sole_impulse_n_s)),
    );
    for LimitEngine {
        engine,
        physics_step_s,
    } in &limits.engines
    {
        text += &wrapped(
            "engine:   ",
            &format!(
                "{engine}, with a physics step of {} ms",
                1e3 * physics_step_s
            ),
        );
    }
    for warning in &limits.warnings {
        text += &wrapped("warning:  ", warning);
    }
    text + &beside_bounds(limits, changes)
}

/// An impulse with the digits that its precision justifies, as far as they fit into five columns.
fn n_s(limits: &Limits, impulse_n_s: f64) -> String {
    let worth = (1.0 - limits.precision_n_s.log10().floor()).clamp(0.0, 4.0) as usize;
    let texts = (0..=worth)
        .rev()
        .map(|decimals| format!("{impulse_n_s:.decimals$}"));
    texts
        .into_iter()
        .find(|text| text.len() <= 5)
        .unwrap_or_else(|| format!("{impulse_n_s:.0}"))
}

fn beside_bounds(limits: &Limits, changes: &str) -> String {
    let y = &limits.pendulum_bounds;
    let [x_mm, y_mm] = y.com_offset_m.map(|offset_m| signed(1e3 * offset_m, 1));
    let mut text = wrapped(
        "robot:    ",
        &format!(
            "{:.3} kg, omega {:.3} rad/s, COM {:.4} m high and at {x_mm}, {y_mm} mm (x, y) from the middle of the feet",
            y.mass_kg, y.omega_rad_s, y.com_height_m
        ),
    );
    let reach = y.reach.iter().map(|region| {
        let ([x0, x1], [y0, y1], time_s) = (region.x_m, region.y_m, region.swing_time_s);
        format!(
            "{} x {x0} to {x1} m and y {y0} to {y1} m in {time_s} s",
            region.name
        )
    });
    let reach = reach.collect::<Vec<_>>().join(", ");
    let at_home = format!("at home the feet are {:.3} m apart", y.stance_width_m);
    let landing = match reach.is_empty() {
        true => {
            "; where one can land is not known, so that there are no bounds with footsteps".into()
        }
        false => format!(", and one can land, x ahead of the other and y beside it, {reach}"),
    };
    text += &wrapped("footstep: ", &(at_home + &landing));
    let push = format!(
        "{:.0} ms long, so that the pendulum bounds are {:.3} times those of a push of no duration; {} mm above the COM, on {}",
        1e3 * y.push_duration_s,
        y.push_factor,
        signed(1e3 * y.push_height_m, 0),
        y.push_link
    );
    text += &wrapped("push:     ", &push);
    if let Some(pendulum) = &limits.pendulum {
        let bob = format!(
            "a bob of {} kg on a rope of {} m; impulses are the momentum with which it strikes",
            pendulum.mass_kg, pendulum.rope_m
        );
        text += &wrapped("pendulum: ", &bob);
    }
    let columns = ["heading", "none", "one", "early"]
        .map(number)
        .into_iter()
        .chain([words("controller")]);
    let mut table = Table::new(
        "",
        columns.chain(["50 % recover", "90 %", "safe up to", "none above"].map(number)),
    );
    let factors = if y.height_factor < 1.0 {
        &[1.0, y.height_factor][..]
    } else {
        &[1.0]
    };
    for heading in &limits.headings {
        let bounds_n_s = [
            Some(heading.bound_no_step_n_s),
            heading.bound_one_step_n_s,
            heading.bound_early_n_s,
        ];
        for i in 0..heading.controllers.len().max(factors.len()) {
            let [none, one, early] =
                bounds_n_s.map(|bound_n_s| match (factors.get(i), bound_n_s) {
                    (Some(factor), Some(bound_n_s)) => n_s(limits, factor * bound_n_s),
                    _ => String::new(),
                });
            let mark = if by_torque(heading) && !none.is_empty() {
                "t"
            } else {
                ""
            };
            let at = if i == 0 {
                format!("{:.1}", heading.heading_deg)
            } else {
                String::new()
            };
            let mut of_controller = [const { String::new() }; 5];
            if let Some(controller) = heading.controllers.get(i) {
                let [ninety, safe, none_above] = [
                    controller.impulse90_n_s,
                    controller.safe_n_s,
                    controller.none_above_n_s,
                ]
                .map(|impulse| impulse.map_or("-".into(), |impulse_n_s| n_s(limits, impulse_n_s)));
                of_controller = [
                    controller.name.clone(),
                    fifty_of(limits, controller),
                    ninety,
                    safe,
                    none_above,
                ];
            }
            let bounds = [none, one, early + mark];
            table.row(
                std::iter::once(cell(at))
                    .chain(texts(bounds))
                    .chain(texts(of_controller)),
            );
        }
    }
    text += &format!("\n{}", table.text());
    if limits.pendulum.is_some() {
        text += &format!("\n{}", draws(limits).text());
        text += &wrapped(
            "",
            "A strike has the momentum of the bob as its impulse. The pendulum bounds are for the impulse that goes to the robot.",
        );
    }
    if y.height_factor < 1.0 {
        let factor = format!("it is the first times {:.3}.", y.height_factor);
        text += &wrapped(
            "",
            &format!(
                "The second line of pendulum bounds takes the height of the push into account: {factor}"
            ),
        );
    }
    let safe = match limits.replicas {
        0 => "`safe up to` and `none above` were not searched (--replicas 0).".into(),
        replicas => format!(
            "`safe up to` is the impulse up to which nothing was lost, in steps of {} N s with {replicas} pushes each, whose \
             headings differ by up to {} degrees to either side (of n pushes without a loss, fewer than 3 in n are lost, with \
             95 % confidence). `none above` is the largest impulse from which it recovered, among as many pushes at each step \
             of 3 %, up to eight steps without any.",
            limits.precision_n_s,
            (100.0 * limits.sector_deg).round() / 100.0
        ),
    };
    let torque = match limits.headings.iter().any(by_torque) {
        true => " t: the torque of the ankles limits them; the soles would allow more.",
        false => "",
    };
    let spread_s = limits
        .headings
        .iter()
        .flat_map(|heading| &heading.controllers)
        .map(|controller| controller.start_spread_s)
        .fold(0.0, f64::max);
    let starts = match spread_s {
        0.0 => String::new(),
        s => format!(
            " With controllers that take footsteps the starts of the pushes are spread over {} s, and their headings over {} \
             degrees to either side.",
            (1e3 * s).round() / 1e3,
            (100.0 * limits.sector_deg).round() / 100.0
        ),
    };
    text += &checked(limits, changes);
    text += &lost_early(limits, changes);
    text += &of_map(limits, changes);
    text += "\n";
    text + &wrapped(
        "",
        &format!(
            "`none`, `one` and `early` are pendulum bounds: the largest impulses from which an ideal pendulum recovers with no \
             footstep, with one, and with any number. It keeps its height and has no angular momentum. The one footstep has the \
             reach and the time of the robot's settings. Those of `early` reach as far as `catch` aims its feet, and land as \
             early as `catch` counts a landing. (The bound `any`, in the picture and in limit.json, has footsteps as the settings state them.) A robot may \
             take more.{torque} `50 % recover` is the impulse \
             from which the controller recovers in half of the trials, with its 95 % interval, and `90 %` that of nine in ten. \
             {safe}{starts} {} episodes were run.{}",
            limits.episodes,
            marked(limits)
        ),
    )
}

/// The drawbacks that the limits stand for, with the metric M of RoboCup's push recovery for each.
fn draws(limits: &Limits) -> Table {
    let columns = [number("heading"), words("controller")];
    let numbers = ["D 50 % [m]", "momentum [N s]", "to the robot [N s]", "M"].map(number);
    let mut table = Table::new("", columns.into_iter().chain(numbers));
    for heading in &limits.headings {
        for controller in &heading.controllers {
            let Some(limit) = &controller.pendulum else {
                continue;
            };
            let [low, high] = limit.draw50_ci95_m;
            let transmitted = limit.transmitted_n_s;
            table.row(texts([
                format!("{:.1}", heading.heading_deg),
                controller.name.clone(),
                format!("{:.3} ({low:.3}-{high:.3})", limit.draw50_m),
                n_s(limits, controller.impulse50_n_s),
                transmitted.map_or("-".into(), |impulse_n_s| n_s(limits, impulse_n_s)),
                format!("{:.3}", limit.robocup_m),
            ]));
        }
    }
    table
}

/// Whether the ankles limit the bounds.
fn by_torque(heading: &Heading) -> bool {
    heading.limited_by != "soles"
}

/// The command that checks the first limit; empty if pushes of the same impulse can end differently.
fn checked(limits: &Limits, changes: &str) -> String {
    let first = limits.headings.iter().flat_map(|heading| {
        heading
            .controllers
            .iter()
            .map(move |controller| (heading, controller))
    });
    let Some((heading, controller)) = first
        .into_iter()
        .find(|(_, controller)| controller.resolved && controller.impulse90_n_s.is_none())
    else {
        return String::new();
    };
    // The ends have one digit more than the precision justifies, and are rounded outwards, so that both are beyond the
    // bracket.
    let digits = (1.0 - limits.precision_n_s.log10().floor()).max(0.0);
    let unit = 10_f64.powf(digits);
    let [low, high] = [
        (controller.ci95[0] * unit).floor(),
        (controller.ci95[1] * unit).ceil(),
    ];
    let [low, high] = [low, high].map(|n_s| format!("{:.*}", digits as usize, n_s / unit));
    let check = format!(
        "{} recovers from this push at {:.1} degrees, and loses it with {}:",
        controller.name,
        heading.heading_deg,
        hard(limits, &high)
    );
    let command = replay(
        limits,
        changes,
        &controller.name,
        first_trial(heading.heading_deg),
        [&low, &heading.heading_deg.to_string()],
    );
    format!("\n{}  {command}\n", wrapped("check: ", &check))
}

/// The holes: losses far below the limit, each with the command that repeats it.
fn lost_early(limits: &Limits, changes: &str) -> String {
    let mut text = String::new();
    let all = limits.headings.iter().flat_map(|heading| {
        heading
            .controllers
            .iter()
            .map(move |controller| (heading, controller))
    });
    for (heading, controller) in all {
        let (Some(safe_n_s), Some(loss)) = (controller.safe_n_s, controller.hole()) else {
            continue;
        };
        let hole = format!(
            "{} about {:.1} degrees is safe only up to {} N s. It loses {} N s at {:.1} degrees, where its limit is {} N s; to \
             see that:",
            controller.name,
            heading.heading_deg,
            n_s(limits, safe_n_s),
            n_s(limits, loss.impulse_n_s),
            loss.heading_deg,
            n_s(limits, loss.limit_n_s)
        );
        let command = replay(
            limits,
            changes,
            &controller.name,
            loss.trial,
            [&loss.impulse_n_s, &loss.heading_deg],
        );
        text += &format!(
            "\n{}  {command} --set push.start_s={}\n",
            wrapped("hole: ", &hole),
            loss.start_s
        );
    }
    text
}

/// Largest number of holes of a map that are named.
const MOST_HOLES: usize = 6;

/// The map in numbers, and its holes; empty without a map.
fn of_map(limits: &Limits, changes: &str) -> String {
    let controllers = limits
        .headings
        .iter()
        .flat_map(|heading| &heading.controllers);
    let pushes: usize = controllers.map(|controller| controller.map.len()).sum();
    if pushes == 0 {
        return String::new();
    }
    let count = limits.holes().count();
    let holes = match count {
        0 => "no hole".into(),
        1 => "a hole; to see it:".into(),
        _ => format!("{count} holes; to see them:"),
    };
    let mut text = format!("\nmap: {pushes} pushes, {holes}\n");
    for (heading_deg, controller, hole) in limits.holes().take(MOST_HOLES) {
        text += &format!(
            "  {} --set push.start_s={}\n",
            replay(
                limits,
                changes,
                &controller.name,
                hole.trial,
                [&hole.impulse_n_s, &heading_deg]
            ),
            hole.start_s
        );
    }
    if count > MOST_HOLES {
        text += &format!("  and {} more: --json has them all\n", count - MOST_HOLES);
    }
    text
}

/// The command that repeats a trial of a search with this impulse (N s) and heading (degrees) of its push. All other
/// quantities are those of the trial.
fn replay(
    limits: &Limits,
    changes: &str,
    gains: &str,
    trial: u64,
    [impulse_n_s, heading_deg]: [&dyn Display; 2],
) -> String {
    let Limits {
        campaign,
        robot,
        seed,
        engine,
        ..
    } = limits;
    let plant = plant_options(robot, engine.title());
    format!(
        "standfast push --campaign {campaign} --seed {seed}{changes} --trial {trial} --controller {gains}{plant} \\\n  \
         {} --heading {heading_deg}",
        hard(limits, &impulse_n_s.to_string())
    )
}

/// The option for the impulse in this text (N s): the drawback of a pendulum, or the impulse.
fn hard(limits: &Limits, impulse_n_s: &str) -> String {
    match (&limits.pendulum, impulse_n_s.parse()) {
        (Some(pendulum), Ok(momentum_n_s)) => {
            format!("--draw {:.4}", pendulum.bob().draw_m(momentum_n_s))
        }
        _ => format!("--impulse {impulse_n_s}"),
    }
}

/// The impulse with 50 % recovery and its interval, and a mark if the interval is too wide.
fn fifty_of(limits: &Limits, controller: &ControllerLimit) -> String {
    let mark = if controller.resolved { "" } else { "*" };
    let [at, low, high] = [
        controller.impulse50_n_s,
        controller.ci95[0],
        controller.ci95[1],
    ]
    .map(|impulse_n_s| n_s(limits, impulse_n_s));
    format!("{at} ({low}-{high}){mark}")
}

/// The meaning of the mark `*`, if there is any mark.
fn marked(limits: &Limits) -> String {
    if limits
        .headings
        .iter()
        .flat_map(|heading| &heading.controllers)
        .all(|controller| controller.resolved)
    {
        return String::new();
    }
    format!(
        " *: the interval is wider than +-{} N s, since the search ran out of trials or left the range of impulses.",
        limits.precision_n_s
    )
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::fixtures::campaign;
    use standfast_sim::Engine;
    use standfast_sim::episode::Outcome;
    use standfast_study::limit::{FirstLoss, MapPoint, PendulumBounds};

    /// Two headings with limits of two controllers (N s).
    fn limits(engine: Engine, impulses_n_s: [[f64; 2]; 2]) -> Limits {
        let controller = |(name, impulse50_n_s): (&str, f64)| ControllerLimit {
            name: name.into(),
            impulse50_n_s,
            ci95: [impulse50_n_s - 0.1, impulse50_n_s + 0.1],
            impulse90_n_s: None,
            impulse90_ci95: None,
            dv_m_s: 0.0,
            dv_over_sqrt_g_h: 0.0,
            start_spread_s: 0.0,
            heading_spread_deg: 0.0,
            of_one_step_bound: Some(impulse50_n_s / 5.0),
            resolved: impulse50_n_s < 9.0,
            safe_n_s: Some(2.4),
            first_loss: Some(FirstLoss {
                impulse_n_s: 2.5125,
                heading_deg: 359.25,
                start_s: 0.501,
                trial: 202_500,
                limit_n_s: impulse50_n_s,
                limit_trials: 8,
                of_limit: 2.5125 / impulse50_n_s,
            }),
            safe_trials: 25,
            none_above_n_s: Some(impulse50_n_s),
            pendulum: None,
            none_above_trials: 36,
            map: Vec::new(),
            trials: 10,
            recovered: 5,
            survived: 0,
            fell: 5,
            broke: 0,
            timed_out: 0,
            diverged: 0,
            failed: 0,
        };
        let nominal = campaign("nominal", &[]);
        let pendulum_bounds =
            PendulumBounds::new(&standfast_robots::load("ut-mu2").unwrap(), &nominal);
        let heading = |(heading_deg, of_controllers): (f64, [f64; 2])| Heading {
            controllers: ["hold", "paper:stepping.x=2"]
                .into_iter()
                .zip(of_controllers)
                .map(controller)
                .collect(),
            ..pendulum_bounds.heading(heading_deg)
        };
        Limits {
            campaign: nominal.name,
            robot: nominal.robot,
            engine,
            engines: vec![LimitEngine {
                engine: engine.title().into(),
                physics_step_s: 0.002,
            }],
            seed: 1,
            sole_impulse_n_s: 2.164,
            precision_n_s: 0.1,
            max_trials: 150,
            replicas: 1,
            sector_deg: 11.25,
            random: false,
            warnings: Vec::new(),
            episodes: 40,
            pendulum: None,
            headings: [0.0, 180.0]
                .into_iter()
                .zip(impulses_n_s)
                .map(heading)
                .collect(),
            pendulum_bounds,
        }
    }

    /// The map of the first controller forward has four pushes. With a limit of 2.5 N s, the second one is a hole.
    pub fn with_hole() -> Limits {
        let mut limits = limits(Engine::Mujoco, [[2.5, 5.0], [2.5, 9.5]]);
        let pushes = [
            (0.8, Outcome::Recovered),
            (1.6, Outcome::Fell),
            (2.4, Outcome::Recovered),
            (3.2, Outcome::Fell),
        ];
        let tried = |(impulse_n_s, outcome)| MapPoint {
            impulse_n_s,
            start_s: 0.5,
            trial: 100_002,
            outcome,
        };
        limits.headings[0].controllers[0].map = pushes.map(tried).to_vec();
        limits
    }

    #[test]
    fn a_hole_of_the_map_is_told_with_the_command_that_shows_it() {
        let told = text(&with_hole(), " --set push.height_m=0.02");
        let hole = "\nmap: 4 pushes, a hole; to see it:\n  standfast push --campaign nominal --seed 1 --set \
                    push.height_m=0.02 --trial 100002 --controller hold \
                    --engine mujoco \\\n  --impulse 1.6 --heading 0 --set push.start_s=0.5\n";
        assert!(told.contains(hole), "{told}");
        let mut solid = with_hole();
        solid.headings[0].controllers[0].map.remove(1);
        assert!(text(&solid, "").contains("\nmap: 3 pushes, no hole\n"));
    }

    #[test]
    fn limits_are_told_beside_the_bounds_with_what_is_dubious() {
        let a = limits(Engine::Rapier, [[2.5, 5.0], [2.5, 9.5]]);
        let mut weak = a.clone();
        weak.headings[0].limited_by = "ankle torque";
        let alone = text(&a, "");
        assert!(
            alone.contains("9.50 (9.40-9.60)*") && alone.contains("*: the interval is wider"),
            "{alone}"
        );
        assert!(
            alone.contains(
                "\nunit:     1 sole impulse = 2.16 N s, dv = 0.27 m/s = 0.16 sqrt(g h)\n"
            ),
            "{alone}"
        );
        assert!(
            alone.contains("engine:   Rapier, with a physics step of 2 ms\n"),
            "{alone}"
        );
        let early = "hole: paper:stepping.x=2 about 0.0 degrees is safe only up to 2.40 N s. It loses\n      \
                     2.51 N s at 359.2 degrees, where its limit is 5.00 N s; to see that:\n  standfast push --campaign nominal --seed 1 --trial 202500 --controller paper:stepping.x=2 \\\n  \
                     --impulse 2.5125 --heading 359.25 --set push.start_s=0.501\n";
        assert!(
            alone.contains(early) && !alone.contains("hole: hold"),
            "{alone}"
        );
        let weak = text(&weak, "");
        assert!(
            weak.contains("t  hold") && weak.contains("t: the torque of the ankles"),
            "{weak}"
        );
        assert!(
            !alone.contains("t  hold") && !alone.contains("t: the torque"),
            "{alone}"
        );
        // A command may be longer, and a table with a long name.
        let alone: Vec<&str> = alone
            .lines()
            .filter(|line| !line.starts_with("  standfast push"))
            .collect();
        assert!(
            alone.iter().all(|line| line.chars().count() <= 86),
            "{alone:?}"
        );
    }
}
