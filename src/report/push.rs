//! `standfast push`: one push, what happened, and why.

use crate::assets::DEFAULT_ROBOT;
use crate::campaign::trial;
use crate::campaign::{Campaign, Overrides, PushBounds, check_episode};
use crate::columns;
use crate::control::Design;
use crate::episode::{self, Disturbance, EpisodeConfig, Outcome, Record, Tick, Until};
use crate::error::{Error, Result};
use crate::lipm::gains::GainSet;
use crate::report::{self, table::thresholds, trace::Trace};
use crate::robot::Robot;
use crate::sim::{Profile, Push};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "Examples:
  standfast push --impulse 2.2                      from behind
  standfast push --impulse 3 --heading -135 --gains hold
  standfast push --impulse 2 --trace push.csv       every tick, to plot
  standfast push --campaign standard --trial 17     a trial of a campaign, as it was")]
pub struct PushArgs {
    /// Impulse (N s)
    #[arg(long, value_name = "N_S", required_unless_present = "trial")]
    pub impulse: Option<f64>,
    /// Direction (degrees): 0 pushes forward, 90 to the left [default: 0]
    #[arg(long, value_name = "DEG")]
    pub heading: Option<f64>,
    /// Height above the COM at home (m) [default: 0]
    #[arg(long, value_name = "M")]
    pub height: Option<f64>,
    /// Duration (s) [default: 0.05]
    #[arg(long, value_name = "S")]
    pub duration: Option<f64>,
    /// Start (s) [default: 0.5]
    #[arg(long, value_name = "S")]
    pub start: Option<f64>,
    /// Course of the force; the impulse is the same [default: rectangular]
    #[arg(long, value_enum)]
    pub profile: Option<Profile>,
    /// Gain set by name or file, or a variant NAME:KEY=VALUE; of a campaign, also by its name in the results
    #[arg(long, value_name = "NAME|FILE", default_value = "switching")]
    pub gains: String,
    /// Robot by name or URDF file [default: that of the campaign, or ut-mu2]
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Take sensor noise and thresholds from this campaign; without it sensors are ideal
    #[arg(long, value_name = "NAME|FILE")]
    pub campaign: Option<String>,
    /// Take the push and the noise of this trial of the campaign, as it was in `run`
    #[arg(long, value_name = "I", requires = "campaign")]
    pub trial: Option<u64>,
    /// Seed of the campaign's noise [default: its own]; ideal sensors have none
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Length of the episode (s) [default: that of the campaign, or 6]
    #[arg(long, value_name = "S")]
    pub horizon: Option<f64>,
    /// Write every tick here; the episode then runs to its horizon
    #[arg(long, value_name = "FILE.csv|.parquet")]
    pub trace: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// Runs the episode and returns what to print.
pub fn run(args: &PushArgs) -> Result<String> {
    let campaign = match &args.campaign {
        Some(name) => Some(Campaign::load(name, &Overrides { seed: args.seed, ..Overrides::default() })?),
        None => None,
    };
    let mut config = campaign.as_ref().map_or_else(EpisodeConfig::default, |c| c.episode);
    config.horizon_s = args.horizon.unwrap_or(config.horizon_s);
    check_episode("arguments", &config)?;
    let push = the_push(args, campaign.as_ref(), &config)?;
    let robot_name = args.robot.as_ref().or(campaign.as_ref().map(|c| &c.robot));
    let robot = Robot::load(robot_name.map_or(DEFAULT_ROBOT, String::as_str))?;
    let gains = campaign.as_ref().map_or_else(|| args.gains.clone(), |c| c.gains_named(&args.gains));
    let design = Design::new(&robot, &GainSet::load(&gains)?, config.control_period_s)?;
    if let Some(warning) = &design.warning {
        log::warn!("{warning}");
    }
    if let Some(path) = &args.trace {
        check_trace_path(path)?;
    }

    let mut trace = args.trace.as_ref().map(|_| Trace::new(&robot));
    let mut witness = Witness::default();
    let sensor_errors = campaign.as_ref().and_then(|c| trial::sensor_errors(c, args.trial.unwrap_or(0)));
    let until = if trace.is_some() { Until::Horizon } else { config.until() };
    let disturbance = Disturbance { pushes: vec![push], sensor_errors };
    let record = episode::run(&robot, &design, &config, disturbance, until, &mut |tick| {
        witness.watch(&robot, tick);
        trace.iter_mut().for_each(|t| t.push(tick));
    });
    if let (Some(path), Some(trace)) = (&args.trace, trace) {
        columns::write(path, &trace.columns())?;
    }
    Ok(if args.json {
        report::json(&as_json(&push, &design, &config, &record))
    } else {
        story(&push, &design, &config, &record, &witness)
    })
}

/// The push asked for: that of the campaign's trial if one is named, changed by what else is given.
fn the_push(args: &PushArgs, campaign: Option<&Campaign>, config: &EpisodeConfig) -> Result<Push> {
    let base = match (campaign, args.trial) {
        (Some(campaign), Some(index)) if index >= campaign.trials => {
            let accepted = format!("0 to {}", campaign.trials.saturating_sub(1));
            return Err(Error::value("arguments", "--trial", index, "the campaign has no such trial", accepted));
        }
        (Some(campaign), Some(index)) => trial::push(campaign, index),
        _ => Push::default(),
    };
    let bounds = PushBounds::new(config.horizon_s);
    let within = |name: &str, value: f64, [least, most]: [f64; 2]| {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        Err(Error::value("arguments", name, value, "out of range", format!("{least} to {most}")))
    };
    let push = Push {
        impulse_n_s: within("--impulse", args.impulse.unwrap_or(base.impulse_n_s), bounds.impulse_n_s)?,
        heading_deg: within("--heading", args.heading.unwrap_or(base.heading_deg), bounds.heading_deg)?,
        height_m: within("--height", args.height.unwrap_or(base.height_m), bounds.height_m)?,
        duration_s: within("--duration", args.duration.unwrap_or(base.duration_s), [1e-3, config.horizon_s])?,
        start_s: within("--start", args.start.unwrap_or(base.start_s), [0.0, config.horizon_s])?,
        profile: args.profile.unwrap_or(base.profile),
    };
    if push.end_s() > config.horizon_s {
        let accepted = format!("more than {}, the end of the push", push.end_s());
        return Err(Error::value(
            "arguments",
            "--horizon",
            config.horizon_s,
            "the push does not end in time",
            accepted,
        ));
    }
    Ok(push)
}

/// A path that cannot be written fails before the episode, not after it.
fn check_trace_path(path: &Path) -> Result<()> {
    if !matches!(path.extension().and_then(|e| e.to_str()), Some("csv" | "parquet")) {
        let accepted = "a name that ends in .csv or .parquet";
        return Err(Error::value("arguments", "--trace", path.display(), "unknown kind of file", accepted));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Error::value(
            "arguments",
            "--trace",
            path.display(),
            "its folder does not exist",
            "a folder that does",
        ));
    }
    Ok(())
}

/// What is seen on the way, for the story.
#[derive(Debug, Default)]
struct Witness {
    /// Since when the DCM has been outside of the support.
    dcm_outside_since_s: Option<f64>,
    /// First time and joint at its torque limit.
    torque_limited: Option<(f64, String)>,
}

impl Witness {
    fn watch(&mut self, robot: &Robot, tick: &Tick) {
        let time = tick.truth.time_s;
        if tick.dcm_outside_m <= 0.0 {
            self.dcm_outside_since_s = None;
        } else if self.dcm_outside_since_s.is_none() {
            self.dcm_outside_since_s = Some(time);
        }
        if self.torque_limited.is_none() {
            let at_limit = |(tau, servo): (&f64, &crate::robot::Servo)| tau.abs() >= 0.999 * servo.torque_n_m;
            let joint = tick.truth.tau.iter().zip(&robot.servos).position(at_limit);
            self.torque_limited = joint.map(|i| (time, robot.joints[i].name.clone()));
        }
    }
}

fn as_json(push: &Push, design: &Design, config: &EpisodeConfig, record: &Record) -> Value {
    json!({
        "gains": design.family.name,
        "push": push,
        "judge": config.judge,
        "outcome": record.outcome,
        "fell_at_s": record.fell_at_s,
        "fall_cause": record.fall_cause,
        "settled_at_s": record.settled_at_s,
        "home_at_s": record.home_at_s,
        "end_s": record.end_s,
        "peak_tilt_deg": record.peak_tilt_deg,
        "peak_torque_n_m": record.peak_torque_n_m,
        "peak_torque_ratio": record.peak_torque_ratio,
        "peak_joint_speed_rad_s": record.peak_joint_speed_rad_s,
        "peak_dcm_outside_m": record.peak_dcm_outside_m,
        "left_sets_at_s": record.left_sets_at_s,
        "set_after_push": record.set_after_push,
        "cpi_margin_after_push": record.cpi_margin_after_push,
        "cpi_margin_after_push_est": record.cpi_margin_after_push_est,
        "gain_switches": record.gain_switches,
        "footsteps": record.footsteps,
    })
}

/// A few lines on what happened and why.
fn story(push: &Push, design: &Design, config: &EpisodeConfig, record: &Record, witness: &Witness) -> String {
    let mut text = format!(
        "push      {} N s towards {} degrees over {} s from t = {} s, {} m above the COM\n",
        push.impulse_n_s, push.heading_deg, push.duration_s, push.start_s, push.height_m
    );
    let mut line = |label: &str, what: String| _ = writeln!(text, "{label:<10}{what}");
    line("gains", format!("{} ({} gains)", design.family.name, design.family.gains.len()));
    let outcome = match record.outcome {
        Outcome::Recovered => match record.settled_at_s {
            Some(at) => {
                format!("recovered: standing still since t = {at:.3} s, {:.3} s after the push", at - push.end_s())
            }
            None => "recovered".into(),
        },
        Outcome::Fell => format!(
            "fell at t = {:.3} s: {}",
            record.fell_at_s.unwrap_or(record.end_s),
            record.fall_cause.as_deref().unwrap_or("out of bounds")
        ),
        Outcome::Diverged => format!("diverged at t = {:.3} s: numbers are not finite", record.end_s),
        Outcome::TimedOut => format!("timed out: neither fallen nor standing still at t = {:.3} s", record.end_s),
    };
    line("outcome", outcome);
    if let Some(at) = record.home_at_s {
        let (mm, end) = (1000.0 * config.judge.home_radius_m, record.end_s);
        line(
            "home",
            format!("COM within {mm} mm of the middle of the soles from t = {at:.3} s to the end, {end:.3} s"),
        );
    }
    match (record.set_after_push, record.cpi_margin_after_push) {
        (Some(side), Some(margin)) => {
            let side = side.name();
            let est = record.cpi_margin_after_push_est.map_or(String::new(), |m| format!(", as estimated {m:.2}"));
            line("sets", format!("{side} the slowest gain's set at the end of the push (margin {margin:.2}{est})"));
        }
        (Some(_), None) => line("sets", "all empty at the end of the push: nothing to stand on".into()),
        (None, _) => {}
    }
    if let Some(at) = record.left_sets_at_s {
        line("", format!("no set held the state from t = {at:.3} s: the pendulum says that a footstep is needed"));
    }
    if record.peak_dcm_outside_m > 0.0 {
        let mm = 1000.0 * record.peak_dcm_outside_m;
        line("DCM", format!("at most {mm:.1} mm outside of the support"));
    }
    if let (Outcome::Fell, Some(at)) = (record.outcome, witness.dcm_outside_since_s) {
        line("lost", format!("t = {at:.3} s: from there on the DCM was outside of the support for good"));
    }
    if let Some((at, joint)) = &witness.torque_limited {
        line("torque", format!("{joint} was the first at its limit, at t = {at:.3} s"));
    }
    line(
        "peaks",
        format!(
            "tilt {:.1} degrees, torque {:.2} N m ({:.0} % of the limit), joint speed {:.1} rad/s",
            record.peak_tilt_deg,
            record.peak_torque_n_m,
            100.0 * record.peak_torque_ratio,
            record.peak_joint_speed_rad_s
        ),
    );
    line("switches", record.gain_switches.to_string());
    text.push('\n');
    text.push_str(&thresholds(&config.judge));
    text
}
