//! `standfast limit`: the largest recoverable impulse by heading, as a table.

use super::{ChangeArgs, check_output, limit_plot};
use crate::campaign::limit::{Heading, Limits, SetLimit};
use crate::error::{Error, Result};
use crate::files::write_atomic;
use std::fmt::Write;
use std::path::PathBuf;

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:
  standfast limit                                   all gain sets, 16 headings, the standard campaign
  standfast limit --gains hold --gains paper --headings 8 --out limits
  standfast limit --campaign nominal                without noise and variations: no impulse is tried twice
  standfast limit --gains hold --headings 4 --precision 0.3 --plot limit.svg             a quick look

For each gain set and heading an adaptive search (Bayesian, least expected entropy) finds the impulse of 50 % recovery,
with a 95 % interval; of the campaign everything is used but the impulse and heading of its first push. Pendulum
bounds hold for the mean duration of that push; where it acts above the COM (on the mean), also bound / (1 + height /
COM height). The robot's settings need a table `reach`. Headings count from 0 (pushed forward), 90 is to the left.

The 50 % and 90 % are of what is not left to chance: 2 % of the trials are taken to be lost, and won, by accident.
Without noise and variations there is no 90 %, and the interval is a bracket: recovered below, lost above.
The trials of a search are not those of `run`: they cannot be replayed by number.

An interrupted run of limit does not go on where it stopped: it starts again.")]
pub struct LimitArgs {
    /// A campaign that is compiled in (smoke, nominal, standard, harsh) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "standard")]
    pub campaign: String,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Count of headings, evenly spaced
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub headings: usize,
    /// A search ends when the 95 % interval of its impulse is no wider than +- this (N s) ...
    #[arg(long, value_name = "N_S", default_value_t = 0.1, allow_negative_numbers = true)]
    pub precision: f64,
    /// ... or after so many trials (then it is marked)
    #[arg(long, value_name = "N", default_value_t = 150)]
    pub max_trials: u64,
    /// Threads; 0: one per core. The result is the same for any
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Write limit.json and limit.svg to this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draw limits and bounds around the robot
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

impl LimitArgs {
    /// Errors: a file that could not be written in the end, or a folder that has a result already.
    pub fn check_outputs(&self) -> Result<()> {
        if let Some(path) = &self.plot {
            check_output("--plot", path, &["svg"])?;
        }
        if let Some(folder) = &self.out {
            let fail =
                |problem| Err(Error::value("arguments", "--out", folder.display(), problem, "a new or empty folder"));
            if folder.exists() && !folder.is_dir() {
                return fail("it is a file");
            }
            if ["limit.json", "limit.svg"].iter().any(|name| folder.join(name).exists()) {
                return fail("it holds a result");
            }
        }
        Ok(())
    }

    /// Writes what was asked for, each file whole, and says what.
    pub fn write(&self, limits: &Limits) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        if let Some(folder) = &self.out {
            let (json, svg) = (folder.join("limit.json"), folder.join("limit.svg"));
            write_atomic(&json, super::json(limits).as_bytes())?;
            limit_plot::write(&svg, limits)?;
            written.extend([json, svg]);
        }
        if let Some(path) = &self.plot {
            limit_plot::write(path, limits)?;
            written.push(path.clone());
        }
        Ok(written)
    }
}

/// A table of at most 80 columns (with names of up to 18 letters).
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
        "{:.3} kg, omega {:.3} rad/s, COM {:.4} m high, {:+.1} {:+.1} mm (x y) from mid-feet",
        y.mass_kg,
        y.omega_rad_s,
        y.com_height_m,
        1e3 * y.com_offset_m[0],
        1e3 * y.com_offset_m[1]
    ));
    line(format!(
        "footstep {} s, {} m fore and aft, {} to {} m sideways; stance {:.3} m wide",
        y.min_step_time_s, y.reach_m.forward, y.reach_m.inward, y.reach_m.outward, y.stance_width_m
    ));
    line(format!(
        "push of {:.0} ms (bounds times {:.3}), {:+.0} mm from the height of the COM\n",
        1e3 * y.push_duration_s,
        y.push_factor,
        1e3 * y.push_height_m
    ));
    line(format!(
        "{:>7}  {:>17}   {:18} {:>17} {:>5} {:>5}",
        "", "pendulum, footsteps", "", "50 % recover", "90 %", "of"
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
        line(format!("\nsecond line of bounds: for the height of the push, times {:.3}", y.height_factor));
    }
    let marked = limits.headings.iter().flat_map(|h| &h.sets).filter(|set| !set.resolved).count();
    if marked > 0 {
        line(format!("\n* not within +-{} N s: too few trials, or beyond the range", limits.precision_n_s));
    }
    line(format!("\n{} episodes; intervals within +-{} N s but where marked", limits.episodes, limits.precision_n_s));
    text
}

fn bounds_of(heading_deg: f64, heading: &Heading, factor: f64) -> String {
    let name = if heading_deg.is_nan() { String::new() } else { format!("{heading_deg:.1}") };
    let [no, one, n] = [heading.bound_no_step_n_s, heading.bound_one_step_n_s, heading.bound_n_step_n_s];
    format!("{name:>7} {:6.2} {:6.2} {:6.2}", factor * no, factor * one, factor * n)
}

fn set_of(set: &SetLimit) -> String {
    let mark = if set.resolved { ' ' } else { '*' };
    let ninety = set.impulse90_n_s.map_or("-".into(), |impulse| format!("{impulse:.2}"));
    format!(
        "{:18} {:5.2} ({:.2}-{:.2}){mark}{ninety:>5} {:5.2}",
        set.name, set.impulse50_n_s, set.ci95[0], set.ci95[1], set.of_one_step_bound
    )
}
