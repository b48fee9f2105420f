//! `standfast response`: how well the ZMP follows the one wanted, and what that means for the poles.

use super::response_plot;
use crate::assets::DEFAULT_ROBOT;
use crate::control::Design;
use crate::episode::EpisodeConfig;
use crate::episode::response::{self, Axis, Bandwidth, Experiment, Point};
use crate::error::{Error, Result};
use crate::lipm::gains::{GainFamily, GainSet};
use crate::render;
use crate::robot::Robot;
use crate::sim::plant::Clock;
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

/// Frequencies measured: from, to, how many.
const FREQUENCIES_HZ: (f64, f64, usize) = (0.5, 40.0, 13);
/// A larger sine leaves the soles.
const AMPLITUDES_M: [f64; 2] = [0.0001, 0.05];

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:
  standfast response                            the standard gains, forward
  standfast response --axis y --gains fixed
  standfast response --plot response.svg        gain and phase over frequency")]
pub struct ResponseArgs {
    /// Gain set by name or file
    #[arg(long, value_name = "NAME|FILE", default_value = "switching")]
    pub gains: String,
    /// Robot by name or URDF file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_ROBOT)]
    pub robot: String,
    /// Direction of the sine: x forward, y to the left
    #[arg(long, value_parser = super::one_of::<Axis>(["x", "y"]), default_value = "x")]
    pub axis: Axis,
    /// Amplitude of the sine that is added to the wanted ZMP (m)
    #[arg(long, value_name = "M", default_value_t = 0.005, allow_negative_numbers = true)]
    pub amplitude: f64,
    /// Draw gain and phase
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// Measures, draws if asked, and returns what to print.
pub fn run(args: &ResponseArgs) -> Result<String> {
    let [least, most] = AMPLITUDES_M;
    if !(least..=most).contains(&args.amplitude) {
        let accepted = format!("{least} to {most}");
        return Err(Error::value("arguments", "--amplitude", args.amplitude, "out of range", accepted));
    }
    let config = EpisodeConfig::default();
    let robot = Robot::load(&args.robot)?;
    let design = Design::new(&robot, &GainSet::load(&args.gains)?, config.control_period_s)?;
    if let Some(warning) = &design.warning {
        log::warn!("{warning}");
    }
    let experiment = Experiment {
        axis: args.axis,
        amplitude_m: args.amplitude,
        clock: Clock { physics_step_s: config.physics_step_s, control_period_s: config.control_period_s },
        settle_s: 2.0,
        measure_s: 2.0,
    };
    let (from, to, count) = FREQUENCIES_HZ;
    let points = response::measure(&robot, &design, &experiment, &response::log_spaced(from, to, count))?;
    let bandwidth = response::bandwidth(&points);
    let fastest = fastest_pole(&design.family, args.axis);
    if let Some(path) = &args.plot {
        let omega = design.family.pendulum.omega;
        let title = format!("From the ZMP wanted to the ZMP: {}, {} axis", design.family.name, axis_name(args.axis));
        response_plot::write(path, &title, &points, fastest * omega)?;
    }
    Ok(if args.json {
        render::json(&as_json(args, &design.family, &points, bandwidth, fastest))
    } else {
        text(args, &design.family, &points, bandwidth, fastest)
    })
}

fn axis_name(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
    }
}

/// The fastest pole of a family on an axis, as a multiple of -omega.
fn fastest_pole(family: &GainFamily, axis: Axis) -> f64 {
    let poles = |gain: &crate::lipm::gains::Gain| match axis {
        Axis::X => gain.x.poles,
        Axis::Y => gain.y.poles,
    };
    family.gains.iter().flat_map(poles).fold(0.0, f64::max)
}

fn as_json(
    args: &ResponseArgs,
    family: &GainFamily,
    points: &[Point],
    bandwidth: Bandwidth,
    fastest: f64,
) -> serde_json::Value {
    json!({
        "gains": family.name,
        "robot": args.robot,
        "axis": args.axis,
        "amplitude_m": args.amplitude,
        "omega_rad_s": family.pendulum.omega,
        "points": points,
        "bandwidth_3db_rad_s": bandwidth.gain_rad_s,
        "bandwidth_45deg_rad_s": bandwidth.phase_rad_s,
        "fastest_pole_rad_s": fastest * family.pendulum.omega,
    })
}

fn text(args: &ResponseArgs, family: &GainFamily, points: &[Point], bandwidth: Bandwidth, fastest: f64) -> String {
    let omega = family.pendulum.omega;
    let mut text = format!(
        "{} on {}: from the ZMP wanted to the ZMP under the soles, {} axis, sine of {} mm, omega {omega:.2} rad/s\n\n\
         frequency  in omega   gain    phase    delay  wanted/sine\n",
        family.name,
        args.robot,
        axis_name(args.axis),
        1e3 * args.amplitude,
    );
    let mut line = |what: String| _ = writeln!(text, "{what}");
    for p in points {
        line(format!(
            "{:6.2} Hz  {:8.2}  {:5.3}  {:5.1} deg  {:4.1} ms  {:11.2}",
            p.frequency_hz,
            p.angular_frequency() / omega,
            p.gain,
            p.phase_deg,
            1e3 * p.delay_s(),
            p.sensitivity
        ));
    }
    let most = points.last().map_or(0.0, Point::angular_frequency);
    let shown = |limit: Option<f64>| match limit {
        Some(w) => format!("at {w:.1} rad/s ({:.1} omega)", w / omega),
        None => format!("above {most:.0} rad/s ({:.0} omega)", most / omega),
    };
    line(format!("\nbandwidth: -3 dB {}, -45 degrees {}", shown(bandwidth.gain_rad_s), shown(bandwidth.phase_rad_s)));
    let pole = fastest * omega;
    let [gain, phase] = [bandwidth.gain_rad_s, bandwidth.phase_rad_s].map(|w| w.unwrap_or(most));
    let side = |limit: f64| if pole < limit { "below" } else { "above" };
    line(format!(
        "poles:     the fastest pole, {fastest} omega = {pole:.1} rad/s, is {} the -45 degrees bandwidth and \
         {} the -3 dB one: {}",
        side(phase),
        side(gain),
        if pole < phase.min(gain) {
            "the ZMP can follow what it promises"
        } else {
            "the ZMP comes later than the sets assume"
        }
    ));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(gains: &str) -> ResponseArgs {
        ResponseArgs {
            gains: gains.into(),
            robot: "ut-mu2".into(),
            axis: Axis::Y,
            amplitude: 0.005,
            plot: None,
            json: false,
        }
    }

    #[test]
    fn what_is_wrong_is_said_before_anything_runs() {
        for amplitude in [-0.005, 0.0, 0.2, f64::NAN] {
            let error = run(&ResponseArgs { amplitude, ..args("switching") }).unwrap_err();
            assert!(error.to_string().contains("--amplitude = "), "{error}");
            assert_eq!(error.exit_code(), 2);
        }
        assert!(run(&args("best")).unwrap_err().to_string().contains("gain set \"best\" not found"));
    }

    #[test]
    fn the_pole_is_judged_by_the_bandwidth() {
        let gains = GainSet::load("switching").unwrap();
        let robot = Robot::load("ut-mu2").unwrap();
        let family = GainFamily::design(&gains, crate::lipm::Pendulum { omega: robot.omega(), dt: 0.002 }).unwrap();
        let fastest = fastest_pole(&family, Axis::Y);
        let say = |gain_rad_s, phase_rad_s| {
            text(&args("switching"), &family, &[], Bandwidth { gain_rad_s, phase_rad_s }, fastest)
        };
        let pole = fastest * family.pendulum.omega;
        assert!(say(Some(2.0 * pole), Some(1.5 * pole)).contains("can follow"));
        let mixed = say(Some(2.0 * pole), Some(0.5 * pole));
        assert!(mixed.contains("is above the -45 degrees bandwidth and below the -3 dB one"), "{mixed}");
        assert!(mixed.contains("later than the sets assume"), "{mixed}");
    }
}
