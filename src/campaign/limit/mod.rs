//! The largest recoverable impulse by heading, beside what the pendulum allows ([`crate::lipm::capture`]).
//!
//! For each gain set and heading a [psychometric search](crate::stats::psychometric) finds the impulse of 50 % recovery. Each
//! of its trials is a trial of the campaign in everything but the push's impulse and heading. Trial k at a heading is the
//! same disturbance for every gain set, so that sets are compared on the same robot, noise and variations. Searches
//! run side by side and know nothing of each other: the result does not depend on the count of threads.

use crate::campaign::run::{Plan, pool};
use crate::campaign::{Campaign, ask::trial, ask::vary};
use crate::control::Design;
use crate::episode::{self, Outcome};
use crate::error::{Error, Result};
use crate::lipm::capture::{self, LandingBox, SteppingPendulum};
use crate::robot::{Foot, Kinematics, PerFoot, Reach, Robot};
use crate::sim::Profile;
use crate::stats::psychometric::{Posterior, Rule};
use nalgebra::Point2;
use rayon::ThreadPool;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Between the first trials of two headings. Part of what a seed means.
const TRIALS_APART: u64 = 1 << 20;
/// Most headings, and most trials of one search.
pub const MOST_HEADINGS: usize = 360;
pub const MOST_TRIALS: u64 = 100_000;
/// Impulses are looked for up to this multiple of the bound with any number of footsteps.
const BEYOND_THE_BOUND: f64 = 3.0;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Headings from 0, evenly spaced.
    pub headings: usize,
    /// Half width of the 95 % interval at which a search ends (N s),
    pub precision_n_s: f64,
    /// or after so many trials.
    pub max_trials: u64,
    /// 0: one per core.
    pub threads: usize,
}

/// Searches to run, with all that they need: one for each gain set and heading.
pub struct Searches<'a> {
    campaign: &'a Campaign,
    options: Options,
    plan: Plan,
    yardstick: Yardstick,
    headings: Vec<Heading>,
    pool: ThreadPool,
    designs: Vec<Design>,
}

/// The result. Lengths in the control frame: origin midway between the soles' centres, x forward, y left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    pub campaign: String,
    pub robot: String,
    pub seed: u64,
    pub precision_n_s: f64,
    pub max_trials: u64,
    /// Whether trials differ in anything but the impulse.
    pub random: bool,
    /// Episodes in all.
    pub episodes: u64,
    #[serde(flatten)]
    pub yardstick: Yardstick,
    pub headings: Vec<Heading>,
}

/// What the bounds are computed from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Yardstick {
    pub mass_kg: f64,
    pub omega_rad_s: f64,
    pub com_height_m: f64,
    /// COM at home less the origin: x, y.
    pub com_offset_m: [f64; 2],
    /// Least and most, about the sole's centre.
    pub sole_x_m: [f64; 2],
    pub sole_y_m: [f64; 2],
    /// Between the soles' centres.
    pub stance_width_m: f64,
    pub min_step_time_s: f64,
    /// From the stance sole's centre to that of the landing one.
    pub reach_m: ReachM,
    /// Mean of the campaign's.
    pub push_duration_s: f64,
    /// Mean of the campaign's, above the COM.
    pub push_height_m: f64,
    pub push_profile: Profile,
    /// By how much a push of this duration may be harder than an instantaneous one.
    pub push_factor: f64,
    /// 1 / (1 + push_height / com_height) for a push above the COM, else 1: what is left of a bound if the angular
    /// momentum that the push brings is paid back through the ankles.
    pub height_factor: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReachM {
    pub forward: f64,
    pub outward: f64,
    pub inward: f64,
}

/// One heading: bounds for the campaign's push (its duration counted in, its height not), and what gain sets take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Heading {
    pub heading_deg: f64,
    pub bound_no_step_n_s: f64,
    pub bound_one_step_n_s: f64,
    pub bound_n_step_n_s: f64,
    /// Bounds times `height_factor`.
    pub bound_no_step_at_height_n_s: f64,
    pub bound_one_step_at_height_n_s: f64,
    pub bound_n_step_at_height_n_s: f64,
    pub sets: Vec<SetLimit>,
}

/// What one gain set takes at one heading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetLimit {
    pub name: String,
    pub impulse50_n_s: f64,
    pub ci95: [f64; 2],
    /// None where nothing is left to chance.
    pub impulse90_n_s: Option<f64>,
    pub impulse90_ci95: Option<[f64; 2]>,
    /// impulse50 over the bound with one footstep.
    pub of_one_step_bound: f64,
    /// Whether the interval of impulse50 is as narrow as asked for.
    pub resolved: bool,
    pub trials: u64,
    pub recovered: u64,
    pub fell: u64,
    pub timed_out: u64,
    pub diverged: u64,
}

impl<'a> Searches<'a> {
    /// Reads and designs, and runs nothing. Errors: a wrong option or input, or a robot whose reach is not known.
    pub fn new(campaign: &'a Campaign, options: Options) -> Result<Self> {
        check(&options)?;
        let plan = Plan::new(campaign)?;
        let (yardstick, mut headings) = (Yardstick::new(&plan.robot, campaign)?, Vec::new());
        for i in 0..options.headings {
            headings.push(yardstick.heading(360.0 * i as f64 / options.headings as f64)?);
        }
        let pool = pool(options.threads)?;
        let designs = pool.install(|| plan.designs())?;
        Ok(Self { campaign, options, plan, yardstick, headings, pool, designs })
    }

    pub fn count(&self) -> u64 {
        (self.headings.len() * self.designs.len()) as u64
    }

    /// Runs all of them; `on_search` is called after each, from any thread. Errors: `stop` was set from outside.
    pub fn run(self, stop: &AtomicBool, on_search: &(dyn Fn() + Sync)) -> Result<Limits> {
        let Self { campaign, options, plan, yardstick, mut headings, pool, designs } = self;
        let sets = &plan.manifest.sets;
        let random = is_random(campaign);
        let jobs: Vec<(usize, usize)> =
            (0..headings.len()).flat_map(|h| (0..sets.len()).map(move |s| (h, s))).collect();
        let search = |&(h, s): &(usize, usize)| {
            let heading: &Heading = &headings[h];
            let rule = Rule {
                most_n_s: (BEYOND_THE_BOUND * heading.bound_n_step_n_s).max(10.0 * options.precision_n_s),
                precision_n_s: options.precision_n_s,
                max_trials: options.max_trials,
                random,
            };
            let first_trial = h as u64 * TRIALS_APART;
            let point = Point { campaign, robot: &plan.robot, heading, first_trial, stop };
            let limit = point.search(&sets[s], &designs[s], rule)?;
            on_search();
            Ok(limit)
        };
        // One by one, so that no core is left with several searches at the end.
        let found = pool.install(|| jobs.par_iter().with_max_len(1).map(search).collect::<Result<Vec<SetLimit>>>())?;
        let mut found = found.into_iter();
        headings.iter_mut().for_each(|heading| heading.sets = found.by_ref().take(sets.len()).collect());
        Ok(Limits {
            campaign: campaign.name.clone(),
            robot: campaign.robot.clone(),
            seed: campaign.seed,
            precision_n_s: options.precision_n_s,
            max_trials: options.max_trials,
            random,
            episodes: headings.iter().flat_map(|heading| &heading.sets).map(|set| set.trials).sum(),
            yardstick,
            headings,
        })
    }
}

fn check(options: &Options) -> Result<()> {
    let wrong = |option: &str, value: &dyn ToString, accepted: String| {
        Err(Error::value("arguments", option, value.to_string(), "out of range", accepted))
    };
    if !(1..=MOST_HEADINGS).contains(&options.headings) {
        return wrong("--headings", &options.headings, format!("1 to {MOST_HEADINGS}"));
    }
    if !(0.005..=100.0).contains(&options.precision_n_s) {
        return wrong("--precision", &options.precision_n_s, "0.005 to 100".into());
    }
    if !(1..=MOST_TRIALS).contains(&options.max_trials) {
        return wrong("--max-trials", &options.max_trials, format!("1 to {MOST_TRIALS}"));
    }
    Ok(())
}

/// Whether two trials with the same impulse and heading can differ.
fn is_random(campaign: &Campaign) -> bool {
    let (push, sensors) = (&campaign.push, &campaign.sensors);
    let noisy = sensors.noise_scale != 0.0 || sensors.bias_scale != 0.0;
    let varied = vary::drawn(&campaign.variations).list().into_iter().filter_map(|(_, distribution)| distribution);
    let mut drawn = [push.height_m, push.duration_s, push.start_s].into_iter().chain(varied);
    noisy || campaign.second_push.is_random() || drawn.any(|distribution| !distribution.is_constant())
}

/// Where a search is made.
struct Point<'a> {
    campaign: &'a Campaign,
    robot: &'a Robot,
    heading: &'a Heading,
    /// Index of its trial 0 in the campaign.
    first_trial: u64,
    stop: &'a AtomicBool,
}

impl Point<'_> {
    fn search(&self, name: &str, design: &Design, rule: Rule) -> Result<SetLimit> {
        let random = rule.random;
        let mut posterior = Posterior::new(rule);
        let [mut recovered, mut fell, mut timed_out, mut diverged] = [0; 4];
        while let Some(impulse_n_s) = posterior.next_impulse() {
            if self.stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let outcome = self.outcome(design, self.first_trial + posterior.trials(), impulse_n_s);
            *match outcome {
                Outcome::Recovered => &mut recovered,
                Outcome::Fell => &mut fell,
                Outcome::TimedOut => &mut timed_out,
                Outcome::Diverged => &mut diverged,
            } += 1;
            posterior.observe(impulse_n_s, outcome == Outcome::Recovered);
        }
        let (impulse50, impulse90) = (posterior.impulse50(), posterior.impulse90());
        Ok(SetLimit {
            name: name.into(),
            impulse50_n_s: impulse50.at_n_s,
            ci95: impulse50.ci95,
            impulse90_n_s: random.then_some(impulse90.at_n_s),
            impulse90_ci95: random.then_some(impulse90.ci95),
            of_one_step_bound: impulse50.at_n_s / self.heading.bound_one_step_n_s,
            resolved: posterior.is_resolved(),
            trials: posterior.trials(),
            recovered,
            fell,
            timed_out,
            diverged,
        })
    }

    /// A trial of the campaign with another first push.
    fn outcome(&self, design: &Design, trial: u64, impulse_n_s: f64) -> Outcome {
        let mut disturbance = trial::disturbance(self.campaign, trial);
        if let Some(push) = disturbance.pushes.first_mut() {
            (push.impulse_n_s, push.heading_deg) = (impulse_n_s, self.heading.heading_deg);
        }
        let config = &self.campaign.episode;
        episode::run(self.robot, design, config, disturbance, config.until(), &mut |_| {}).outcome
    }
}

impl Yardstick {
    /// Of a robot at home, under the mean push of a campaign. Errors: the robot's file does not tell its reach.
    pub fn new(robot: &Robot, campaign: &Campaign) -> Result<Yardstick> {
        let Some(Reach { forward_m, outward_m, inward_m, min_step_time_s }) = robot.reach else {
            let path = Path::new(&campaign.robot).with_extension("toml");
            let accepted = "a table [reach] with forward_m, outward_m, inward_m and min_step_time_s";
            let problem = "the pendulum's bounds need where a foot can land, and how soon";
            return Err(Error::value(&path.to_string_lossy(), "reach", "(none)", problem, accepted));
        };
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        let centre = PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot).translation.vector);
        let (com, middle) = (kinematics.com(), (centre.left + centre.right) / 2.0);
        let omega_rad_s = robot.omega();
        let com_height_m = robot.home_com_height();
        // Soles of two sizes: the smaller one.
        let half_m = [0, 1].map(|axis| {
            Foot::BOTH.map(|foot| robot.soles[foot].half_m[axis]).into_iter().fold(f64::INFINITY, f64::min)
        });
        let (push_duration_s, push_height_m) = (campaign.push.duration_s.mean(), campaign.push.height_m.mean());
        let push_factor = match campaign.push.profile {
            Profile::Rectangular => capture::rectangular_push_factor,
            Profile::HalfSine => capture::half_sine_push_factor,
        };
        Ok(Yardstick {
            mass_kg: robot.mass(),
            omega_rad_s,
            com_height_m,
            com_offset_m: [com.x - middle.x, com.y - middle.y],
            sole_x_m: [-half_m[0], half_m[0]],
            sole_y_m: [-half_m[1], half_m[1]],
            stance_width_m: (centre.left.y - centre.right.y).abs(),
            min_step_time_s,
            reach_m: ReachM { forward: forward_m, outward: outward_m, inward: inward_m },
            push_duration_s,
            push_height_m,
            push_profile: campaign.push.profile,
            push_factor: push_factor(omega_rad_s, push_duration_s),
            height_factor: 1.0 / (1.0 + push_height_m.max(0.0) / com_height_m),
        })
    }

    /// The bounds at one heading (degrees), no gain sets yet. Errors: the solver gives up.
    pub fn heading(&self, heading_deg: f64) -> Result<Heading> {
        let ReachM { forward, outward, inward } = self.reach_m;
        let pendulum = SteppingPendulum {
            mass_kg: self.mass_kg,
            omega: self.omega_rad_s,
            com: Point2::from(self.com_offset_m),
            sole_x_m: self.sole_x_m,
            sole_y_m: self.sole_y_m,
            stance_width_m: self.stance_width_m,
            reach: LandingBox { forward_m: forward, outward_m: outward, inward_m: inward },
            step_time_s: self.min_step_time_s,
        };
        let bounds = pendulum.bounds(heading_deg)?;
        let [no, one, n] = [bounds.no_step_n_s, bounds.one_step_n_s, bounds.n_step_n_s].map(|j| j * self.push_factor);
        Ok(Heading {
            heading_deg,
            bound_no_step_n_s: no,
            bound_one_step_n_s: one,
            bound_n_step_n_s: n,
            bound_no_step_at_height_n_s: no * self.height_factor,
            bound_one_step_at_height_n_s: one * self.height_factor,
            bound_n_step_at_height_n_s: n * self.height_factor,
            sets: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Overrides;

    fn campaign(name: &str, set: &[&str]) -> Campaign {
        let set = set.iter().map(|s| s.to_string()).collect();
        Campaign::load(name, &Overrides { set, ..Overrides::default() }).unwrap()
    }

    #[test]
    fn random_is_what_lets_two_trials_differ_and_nothing_else() {
        assert!(!is_random(&campaign("nominal", &[])) && is_random(&campaign("standard", &[])));
        for (set, random) in [
            (vec!["sensors.noise_scale=0.1"], true),
            (vec!["sensors.bias_scale=0.1"], true),
            (vec!["push.height_m={uniform=[0, 0.1]}"], true),
            (vec!["push.height_m=0.1", "push.duration_s=0.1"], false),
            (vec!["variations.mass_scale={uniform=[0.9, 1.1]}"], true),
            (vec!["variations.mass_scale={normal=[1.1, 0]}", "variations.friction=0.5"], false),
            (vec!["variations.delay_s={normal=[0.004, 0.001]}"], true),
            // A slope rises towards a heading that is drawn, unless one is given.
            (vec!["push.start_s=1", "variations.slope_deg=1"], true),
            (vec!["push.start_s=1", "variations.slope_deg=1", "variations.slope_heading_deg=30"], false),
            (vec!["variations.slope_deg=0"], false),
            (vec!["second_push.impulse_n_s=1"], false),
            (vec!["second_push={impulse_n_s=1, after_s={uniform=[0.1, 1]}}"], true),
            (vec!["second_push={impulse_n_s=0, after_s={uniform=[0.1, 1]}}"], false),
        ] {
            let campaign = campaign("nominal", &set);
            assert_eq!(is_random(&campaign), random, "{set:?}");
            // As it is drawn (noise apart, which is not compared): the trials of one search differ, or do not.
            let trials: Vec<_> = (0..20)
                .map(|i| {
                    let mut pushes = trial::pushes(&campaign, i);
                    (pushes[0].impulse_n_s, pushes[0].heading_deg) = (1.0, 0.0);
                    (pushes, trial::variation(&campaign, i))
                })
                .collect();
            let noisy = set[0].starts_with("sensors");
            assert!(noisy || trials.iter().any(|trial| *trial != trials[0]) == random, "{set:?}");
        }
    }

    #[test]
    fn the_yardstick_takes_the_mean_push() {
        let robot = Robot::load("ut-mu2").unwrap();
        let of = |set: &[&str]| Yardstick::new(&robot, &campaign("nominal", set)).unwrap();
        let drawn = of(&["push.height_m={uniform=[-0.05, 0.1]}", "push.duration_s={normal=[0.06, 0.02]}"]);
        assert_eq!(drawn, of(&["push.height_m=0.025", "push.duration_s=0.06"]));
        let heading = drawn.heading(0.0).unwrap();
        let factor = 1.0 / (1.0 + 0.025 / robot.home_com_height());
        assert!((heading.bound_one_step_at_height_n_s / heading.bound_one_step_n_s - factor).abs() < 1e-12);
        // Below the COM a bound is not raised.
        assert_eq!(of(&["push.height_m={uniform=[-0.1, 0]}"]).height_factor, 1.0);
    }
}
