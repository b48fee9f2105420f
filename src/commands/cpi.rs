//! `standfast cpi`: computes the maximal CPI sets of a gain set, prints their sizes, horizons and inclusion, and draws
//! or exports them.

use super::arguments::{ControllerArgs, MotorsArgs, check_output};
use super::terminal::print;
use serde::Deserialize;
use standfast_core::control::home_polygon;
use standfast_core::error::{Error, Result};
use standfast_core::geometry::SupportPolygon;
use standfast_core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast_core::lipm::{GainFamily, Pendulum};
use standfast_core::robot::{Robot, Units};
use standfast_files::assets::{DEFAULT_ROBOT, Source, parse_toml};
use standfast_report::{figure, text::cpi::Sets};
use standfast_robots::urdf::Files;
use standfast_sim::episode::CONTROL_PERIOD_S;
use standfast_study::ask::bounds::in_range;
use std::path::PathBuf;
use std::process::ExitCode;

/// Accepted frequencies of the pendulum (rad/s): COM heights from 10 um to a kilometre.
const OMEGAS_RAD_S: [f64; 2] = [0.1, 1000.0];
/// Accepted control periods in 1/omega. Half the period takes four times as long to search, half a minute with the
/// least; with the largest the pendulum falls within a period.
const PHASES: [f64; 2] = [0.002, 1.0];

#[derive(Debug, clap::Args)]
#[command(mut_arg("first_controller", |arg| arg.default_value("switching")))]
#[command(after_help = "Examples:
  standfast cpi                             the sets of `switching`
  standfast cpi mine.toml --plot sets.svg   those of a file, as a picture
  standfast cpi robust --out sets           as matrices, one file for each
  standfast cpi fixed:gains.0.x=[0.5,1,5]   with one value changed
  standfast cpi --robot my.urdf             for a robot of yours
  standfast cpi --set omega_rad_s=3.13 --set support_m=[-0.1,0.1,-0.1,0.1]

The pendulum has the natural frequency of the robot at home, and the ZMP may be
where both soles are, less the gain set's margin. --set changes omega_rad_s, the
control period period_s, and support_m, a rectangle: [xmin, xmax, ymin, ymax].
The folder of --out gets gain-0-set.csv, gain-0-closed-loop.csv, gain-1-set.csv
and so on.")]
pub struct CpiArgs {
    #[command(flatten)]
    pub gains: ControllerArgs,
    /// Robot by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_ROBOT)]
    pub robot: String,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Change the pendulum: omega_rad_s, period_s or support_m
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder for the sets as matrices
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw the sets to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &CpiArgs) -> Result<ExitCode> {
    print(&answer(args)?)
}

/// What `--set` changes.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Changes {
    /// Natural frequency of the pendulum, sqrt(g / COM height).
    omega_rad_s: Option<f64>,
    /// Control period.
    period_s: Option<f64>,
    /// The rectangle in which the ZMP may be: xmin, xmax, ymin, ymax.
    support_m: Option<[f64; 4]>,
}

/// Searches the sets, writes the files that were asked for, and returns what to print. Pendulum and support are those
/// of the robot unless they are given. Nothing is written if an input is bad.
fn answer(args: &CpiArgs) -> Result<String> {
    let robot = Files::open(&args.robot)?
        .with_motors(args.motors.file.as_deref())?
        .load()?;
    let changes: Changes = parse_toml(&Source {
        file: "--set".into(),
        text: args.set.join("\n"),
    })?;
    if let Some(path) = &args.plot {
        check_output("--plot", path, &["svg"])?;
    }
    let gains = args.gains.name();
    let set = standfast_controllers::gain_set(gains)?;
    let family = GainFamily::design(
        &set,
        pendulum(&changes, &robot)?,
        Units::of(&robot).half_sole_m,
    )?;
    let support = match changes.support_m {
        Some(corners) => rectangle(corners)?,
        None => family.allowed_support(&home_polygon(&robot), gains)?,
    };
    family.check_disturbance(&support, gains)?;
    let sets = CpiSet::search_family(&family, &support)?;
    let undisturbed = match family.zmp_disturbance.is_none() {
        true => Vec::new(),
        false => CpiSet::search_family(&family.undisturbed(), &support)?,
    };
    let (inclusion, support) = (Inclusion::of(&sets)?, &support);
    let answer = Sets {
        set: &set,
        family: &family,
        support,
        inclusion,
        sets: &sets,
        undisturbed: &undisturbed,
    };
    if let Some(folder) = &args.out {
        answer.export(folder)?;
    }
    if let Some(file) = &args.plot {
        figure::cpi::write(file, &set.name, &sets, &undisturbed)?;
    }
    Ok(if args.json {
        standfast_report::json(&answer.as_json())
    } else {
        answer.text()
    })
}

/// The pendulum that is asked for; what is not changed is that of `robot` at home.
fn pendulum(changes: &Changes, robot: &Robot) -> Result<Pendulum> {
    let pendulum = Pendulum {
        omega: changes.omega_rad_s.unwrap_or(robot.omega()),
        dt: changes.period_s.unwrap_or(CONTROL_PERIOD_S),
    };
    in_range("--set", "omega_rad_s", pendulum.omega, OMEGAS_RAD_S)?;
    let [least, most] = PHASES.map(|phase| phase / pendulum.omega);
    in_range("--set", "period_s", pendulum.dt, [least, most])?;
    Ok(pendulum)
}

/// Largest coordinate of a support (m), as for the soles of a robot. Much larger coordinates are lost in rounding.
const MOST_SUPPORT_M: f64 = 100.0;

/// The rectangle with these sides (m). Fails unless the origin is strictly inside.
fn rectangle([xmin, xmax, ymin, ymax]: [f64; 4]) -> Result<SupportPolygon> {
    let sides = [-xmin, xmax, -ymin, ymax];
    let polygon = sides
        .iter()
        .all(|side| *side > 0.0 && *side <= MOST_SUPPORT_M)
        .then(|| SupportPolygon::rectangle(xmin, xmax, ymin, ymax))
        .flatten();
    polygon.ok_or_else(|| {
        Error::value(
            "--set",
            "support_m",
            format!("[{xmin}, {xmax}, {ymin}, {ymax}]"),
            "is no rectangle around the origin",
            format!("xmin < 0 < xmax and ymin < 0 < ymax, up to {MOST_SUPPORT_M} m"),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    use clap::Parser;
    use standfast_report::text::cpi::HEADER;

    #[derive(Parser)]
    struct CpiLine {
        #[command(flatten)]
        cpi: CpiArgs,
    }

    fn run_with(args: &[&str]) -> Result<String> {
        let cli =
            CpiLine::try_parse_from([&["cpi"], args].concat()).map_err(|e| Error::Syntax {
                file: "command line".into(),
                message: e.to_string(),
            })?;
        answer(&cli.cpi)
    }

    #[test]
    fn the_exported_rows_make_the_set_and_the_exported_loop_keeps_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sets");
        let pendulum = [
            "--set=omega_rad_s=5.63",
            "--set=period_s=0.002",
            "--set=support_m=[-0.03,0.06,-0.08,0.08]",
        ];
        let args = [
            &["fixed", "--json", "--out", path.to_str().unwrap()],
            &pendulum[..],
        ]
        .concat();
        let object: serde_json::Value = serde_json::from_str(&run_with(&args).unwrap()).unwrap();
        let read = |name: &str| -> Vec<Vec<f64>> {
            let text = std::fs::read_to_string(path.join(name)).unwrap();
            assert_eq!(text.lines().next(), Some(HEADER));
            text.lines()
                .skip(1)
                .map(|l| l.split(',').map(|c| c.parse().unwrap()).collect())
                .collect()
        };
        let (rows, closed) = (read("gain-0-set.csv"), read("gain-0-closed-loop.csv"));
        let k = object["sets"][0]["horizon"].as_u64().unwrap() as usize;
        assert_eq!(rows.len(), 4 * (k + 1));
        assert_eq!(object["sets"][0]["rows"], rows.len());
        // Row block j + 1 is row block j times the closed loop (eq. 21).
        for (row, next) in rows.iter().zip(&rows[4..]) {
            for c in 0..6 {
                let product: f64 = (0..6).map(|i| row[i] * closed[i][c]).sum();
                assert!((product - next[c]).abs() < 1e-9);
            }
        }
        let forward = object["sets"][0]["largest_impulse_over_m_omega_d"]["forward"]
            .as_f64()
            .unwrap();
        let largest = rows.iter().map(|r| r[1]).fold(0.0, f64::max);
        assert!((forward - 1.0 / (largest * 5.63 * 0.06)).abs() < 1e-12);
    }

    #[test]
    fn robust_sets_stand_beside_those_of_the_paper() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sets.svg");
        let text = run_with(&["robust", "--plot", file.to_str().unwrap()]).unwrap();
        for words in [
            "Maximal robust CPI sets of gain set robust",
            "4.1 mm in x and 5.0 mm in y",
            "Without disturbances",
            "The family nests",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let svg = std::fs::read_to_string(file).unwrap();
        let gains = standfast_controllers::gain_set("robust")
            .unwrap()
            .gains
            .len();
        assert_eq!(svg.matches("slice undisturbed").count(), 2 * gains, "{svg}");
        assert!(svg.contains("dashed: without disturbances"), "{svg}");

        let object: serde_json::Value =
            serde_json::from_str(&run_with(&["robust", "--json"]).unwrap()).unwrap();
        let half_sole_m = Units::of(&standfast_robots::load(DEFAULT_ROBOT).unwrap()).half_sole_m;
        let bounds = standfast_controllers::gain_set("robust")
            .unwrap()
            .zmp_disturbance
            .bounds()
            * half_sole_m;
        assert_eq!(
            object["zmp_disturbance_m"],
            serde_json::json!([bounds.x, bounds.y])
        );
        let size = |kind: &str| {
            object[kind][0]["largest_impulse_over_m_omega_d"]["forward"]
                .as_f64()
                .unwrap()
        };
        assert!(
            size("sets") < 0.99 * size("sets_without_disturbances"),
            "{object}"
        );
        assert!(
            object["sets"][0]["zmp_spread_m"][0].as_f64().unwrap() > 0.008,
            "{object}"
        );
    }

    #[test]
    fn bad_input_is_one_error_of_exit_code_2_and_nothing_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sets");
        for (args, words) in [
            (
                vec!["hold"],
                "gain set = hold: has no gains, so no CPI sets",
            ),
            (vec!["nosuch"], "hold, fixed, switching"),
            (
                vec!["robust:zmp_disturbance=[0.02,2.0]"],
                "no set at home; accepted: less than [0.00",
            ),
            (
                vec!["robust", "--set=support_m=[-0.005,0.05,-0.05,0.05]"],
                "zmp_disturbance = [0.0850, 0.1050]: leaves gain",
            ),
            (vec!["--set=omega_rad_s=-5"], "omega_rad_s = -5"),
            (vec!["--set=period_s=0"], "period_s = 0"),
            (vec!["--set=period_s=1"], "period_s = 1"),
            (
                vec!["--set=support_m=[0.01,0.05,-0.05,0.05]"],
                "is no rectangle around the origin",
            ),
            (
                vec!["--set=support_m=[-1e308,1e308,-1e308,1e308]"],
                "up to 100 m",
            ),
            (vec!["--set=support_m=[-0.05,0.05,-0.05]"], "length 3"),
            (vec!["--set=omega=5"], "unknown field `omega`"),
            (vec!["--robot=nosuch"], "nosuch"),
        ] {
            let all = [&args[..], &["--out", path.to_str().unwrap()]].concat();
            let error = run_with(&all).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{args:?}: {error}");
            assert!(error.to_string().contains(words), "{args:?}: {error}");
            assert!(!path.exists());
        }
    }
}
