//! `standfast-paper response`: measures how well the ZMP follows the commanded ZMP, and compares the bandwidth with the
//! poles of the gains.

use crate::render::bode;
use crate::render::response::Response;
use crate::response::{self, Axis, Experiment};
use standfast::commands::arguments::{ENGINES, one_of};
use standfast::commands::terminal::print;
use standfast::core::control::Design;
use standfast::core::error::{Error, Result};
use standfast::core::robot::Units;
use standfast::files::assets::DEFAULT_ROBOT;
use standfast::report;
use standfast::sim::Engine;
use standfast::sim::episode::EpisodeConfig;
use std::path::PathBuf;
use std::process::ExitCode;

/// Lowest and highest frequency that is measured (Hz), and the number of frequencies.
const FREQUENCIES_HZ: (f64, f64, usize) = (0.5, 40.0, 13);
/// Smallest and largest amplitude that is accepted (m). A larger sine would move the ZMP out of the soles.
const AMPLITUDES_M: [f64; 2] = [0.0001, 0.05];

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast-paper response                            gain set `switching`, fore and aft
  standfast-paper response --axis y --controller fixed
  standfast-paper response --plot response.svg        gain and phase over frequency")]
pub struct ResponseArgs {
    /// Gain set by name or file
    #[arg(
        long = "controller",
        visible_alias = "gains",
        value_name = "NAME|FILE",
        default_value = "switching"
    )]
    pub gains: String,
    /// Robot by name or URDF file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_ROBOT)]
    pub robot: String,
    /// Physics engine that simulates the robot
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<Engine, 2>(ENGINES), default_value = "rapier")]
    pub engine: Engine,
    /// Axis along which the ZMP is moved: x is fore and aft, y is sideways
    #[arg(long, value_parser = one_of::<Axis, 2>(["x", "y"]), default_value = "x")]
    pub axis: Axis,
    /// Amplitude of the sine that is added to the commanded ZMP (m)
    #[arg(
        long,
        value_name = "M",
        default_value_t = 0.005,
        allow_negative_numbers = true
    )]
    pub amplitude: f64,
    /// Draw gain and phase over frequency to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &ResponseArgs) -> Result<ExitCode> {
    let [least, most] = AMPLITUDES_M;
    if !(least..=most).contains(&args.amplitude) {
        let accepted = format!("{least} to {most}");
        return Err(Error::option(
            "--amplitude",
            args.amplitude,
            "out of range",
            accepted,
        ));
    }
    let robot = standfast::robots::load(&args.robot)?;
    let config = EpisodeConfig {
        engine: args.engine,
        ..EpisodeConfig::of(&Units::of(&robot))
    };
    config.engine.check(&robot)?;
    let design = Design::new(
        &robot,
        &crate::gain_set(&args.gains)?,
        config.control_period_s,
    )?;
    if let Some(warning) = &design.warning {
        log::warn!("{warning}");
    }
    let experiment = Experiment {
        axis: args.axis,
        amplitude_m: args.amplitude,
        config,
        settle_s: 2.0,
        measure_s: 2.0,
    };
    let (from, to, count) = FREQUENCIES_HZ;
    let points = response::measure(
        &robot,
        &design,
        &experiment,
        &response::log_spaced(from, to, count),
    )?;
    let measured = Response::new(&args.robot, &design.family, &experiment, points);
    if let Some(path) = &args.plot {
        bode::write(path, &measured)?;
    }
    print(&if args.json {
        report::json(&measured.as_json())
    } else {
        measured.text()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(gains: &str) -> ResponseArgs {
        ResponseArgs {
            gains: gains.into(),
            robot: "ut-mu2".into(),
            engine: Engine::Rapier,
            axis: Axis::Y,
            amplitude: 0.005,
            plot: None,
            json: false,
        }
    }

    #[test]
    fn bad_input_is_refused_before_anything_runs() {
        for amplitude in [-0.005, 0.0, 0.2, f64::NAN] {
            let error = run(&ResponseArgs {
                amplitude,
                ..args("switching")
            })
            .unwrap_err();
            assert!(error.to_string().contains("--amplitude = "), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
        assert!(
            run(&args("best"))
                .unwrap_err()
                .to_string()
                .contains("controller \"best\" not found")
        );
    }
}
