//! The largest recoverable impulse by heading, beside the pendulum bounds ([`standfast_core::lipm::capture`]).
//!
//! For each controller and heading, a [psychometric search](standfast_stats::psychometric) finds the impulse with 50 %
//! recovery. A second one goes up from small impulses to the first that is lost: below it nothing was, and it looks between
//! the headings, too. A map tries every impulse. Each of their trials is a trial of the campaign with another impulse and
//! heading of the push. Trial k at a heading has the same noise and variations for every controller. The searches know
//! nothing of each other: they are the jobs of a [batch](crate::batch).

mod pendulum_bounds;
mod search;

use crate::ask::bounds::in_range;
use crate::ask::pendulum::PendulumSpec;
use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::batch::{Batch, Jobs, SearchTask};
use crate::limit::search::{LimitSearch, MAP_TO, is_random};
use crate::plan::{Pool, PreparedCampaign, pool};
use serde::Serialize;
use serde_json::json;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_robots::urdf::Files;
use standfast_sim::Engine;
use standfast_sim::episode::EpisodeConfig;
use standfast_stats::psychometric::Rule;
use std::time::Instant;

pub use pendulum_bounds::{Heading, PendulumBounds};
pub(crate) use search::pushed;
pub use search::{
    ControllerLimit, FirstLoss, MOST_REPLICAS, MOST_TRIALS, MapPoint, PendulumLimit, first_trial,
};

/// Largest number of headings.
pub const MOST_HEADINGS: usize = 360;
/// Largest impulse of a search, as a multiple of the bound with any number of footsteps.
const BEYOND_THE_BOUND: f64 = 3.0;

/// Usual precision, in sole impulses: 0.1 N s for UT-mu2.
pub const USUAL_PRECISION: f64 = 0.0463;
/// Largest distance of a heading, in the search for the first loss, from the heading of its search (degrees). If
/// headings are closer, it is half the distance between two of them.
const SECTOR_DEG: f64 = 11.25;

/// Time over which starts are spread, in units of the robot's time: 0.6 s for UT-mu2, which is longer than a stride.
const SPREAD: f64 = 3.4;

/// Limits of the precision: 20 times finer and 1000 times coarser than usual.
const FINER: f64 = 20.0;
const COARSER: f64 = 1000.0;

/// Settings of the searches.
#[derive(Debug, Clone, Copy)]
pub struct LimitOptions {
    /// Number of headings, evenly spaced from 0.
    pub headings: usize,
    /// Half width of the 95 % interval at which a search ends (N s); None for [`USUAL_PRECISION`].
    pub precision_n_s: Option<f64>,
    /// Number of trials after which a search ends in any case.
    pub max_trials: u64,
    /// Number of episodes for each impulse of the search for the first loss, and of that above the limit; 0 leaves both
    /// out.
    pub replicas: u64,
    /// Whether to try every impulse, for a map.
    pub is_dense: bool,
    /// Number of threads; 0 means one per core.
    pub threads: usize,
    /// Whether controllers run that have not been tried without a push.
    pub untried: bool,
}

/// The searches, one for each controller and heading, with all that they need.
pub struct Searches<'a> {
    campaign: &'a Campaign,
    options: LimitOptions,
    precision_n_s: f64,
    pub(crate) plan: PreparedCampaign,
    pendulum_bounds: PendulumBounds,
    headings: Vec<Heading>,
    pub(crate) pool: Pool,
    /// One for each heading and controller.
    pub jobs: Jobs,
}

/// The result. Lengths are in the control frame: origin midway between the soles' centres, x forward, y left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    pub campaign: String,
    pub robot: String,
    /// The engine of the controllers that name none.
    pub engine: Engine,
    /// The engines of the controllers.
    pub engines: Vec<LimitEngine>,
    pub seed: u64,
    /// The robot's unit of impulses, the sole impulse (N s).
    pub sole_impulse_n_s: f64,
    pub precision_n_s: f64,
    pub max_trials: u64,
    pub replicas: u64,
    /// Largest distance of a heading, in the search for the first loss, from the heading of its search (degrees).
    pub sector_deg: f64,
    /// Whether trials with the same impulse and start can differ.
    pub random: bool,
    /// What to know of the controllers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Number of episodes in all searches.
    pub episodes: u64,
    /// The pendulum that pushes; None for a force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pendulum: Option<PendulumSpec>,
    #[serde(flatten)]
    pub pendulum_bounds: PendulumBounds,
    pub headings: Vec<Heading>,
}

/// An engine in which controllers were searched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitEngine {
    /// Name and version.
    pub engine: String,
    pub physics_step_s: f64,
}

impl<'a> Searches<'a> {
    /// Reads the controllers for the robot of these files, and runs nothing. It fails if an option or an input is wrong,
    /// or if the reach of the robot's feet is not known.
    pub fn new(campaign: &'a Campaign, files: Files, options: LimitOptions) -> Result<Self> {
        check(&options)?;
        let plan = PreparedCampaign::with(campaign, files)?;
        let pendulum_bounds = PendulumBounds::new(&plan.robot, campaign);
        let usual_n_s = two_digits(USUAL_PRECISION * campaign.units.impulse_n_s());
        let precision_n_s = options.precision_n_s.unwrap_or(usual_n_s);
        in_range(
            "command line",
            "--precision",
            precision_n_s,
            [usual_n_s / FINER, usual_n_s * COARSER],
        )?;
        let headings: Vec<Heading> = (0..options.headings)
            .map(|i| pendulum_bounds.heading(360.0 * i as f64 / options.headings as f64))
            .collect();
        let jobs =
            Jobs::kept_one_by_one("search", headings.len() * plan.manifest.controllers.len());
        Ok(Self {
            campaign,
            options,
            precision_n_s,
            pool: pool(options.threads, plan.open_episodes())?,
            plan,
            pendulum_bounds,
            headings,
            jobs,
        })
    }

    /// The task, on which the folder of a result depends.
    pub fn task(&self) -> SearchTask {
        let LimitOptions {
            headings,
            max_trials,
            replicas,
            is_dense,
            ..
        } = self.options;
        SearchTask {
            command: "limit".into(),
            options: json!({
                "headings": headings,
                "precision_n_s": self.precision_n_s,
                "max_trials": max_trials,
                "replicas": replicas,
                "dense": is_dense,
            }),
            manifest: self.plan.manifest.clone(),
        }
    }

    /// Prepares the controllers and tries each without a push, unless that is done. Fails if a robot falls.
    pub fn controllers(&self) -> Result<&[PreparedController]> {
        self.pool
            .install(|| self.plan.tried_factories(self.options.untried))
    }

    /// The robot, the controller of this name, and the settings of its episodes.
    pub fn case(&self, name: &str) -> Result<Option<(&Robot, &PreparedController, EpisodeConfig)>> {
        let factories = self.controllers()?;
        let controller = self
            .plan
            .manifest
            .controllers
            .iter()
            .position(|controller| controller == name);
        Ok(controller.map(|controller| {
            (
                &self.plan.robot,
                &factories[controller],
                self.plan.episode(controller),
            )
        }))
    }

    /// A rough estimate of the time of `searches` on this machine (s). It runs some pushes, and supposes that each limit is
    /// the bound with one footstep.
    pub fn estimated_s(&self, searches: usize) -> Result<f64> {
        const SAMPLE: usize = 16;
        const LONG_S: f64 = 0.5;
        /// Number of trials of a usual search for the limit: first if trials can differ, then if they cannot.
        const OF_SEARCH: [f64; 2] = [80.0, 8.0];
        let factories = self.controllers()?;
        let opening = self.plan.opening(factories);
        let (start, mut pushes) = (Instant::now(), 0);
        for (controller, heading) in (0..factories.len())
            .cycle()
            .zip(self.headings.iter().cycle())
            .take(SAMPLE)
        {
            if pushes > 0 && start.elapsed().as_secs_f64() > LONG_S {
                break;
            }
            let heading_deg = heading.heading_deg;
            let disturbance = pushed(
                self.campaign,
                first_trial(heading_deg),
                0.5 * heading.with_one_step_n_s(),
                heading_deg,
                0.0,
            );
            self.plan
                .records(factories, opening.as_ref(), disturbance, &[controller])?;
            pushes += 1;
        }
        let of_search =
            OF_SEARCH[usize::from(!is_random(self.campaign))].min(self.options.max_trials as f64);
        let of_loss = if self.options.replicas > 0 {
            of_search
        } else {
            0.0
        };
        let (replicas, precision_n_s) = (self.options.replicas as f64, self.precision_n_s);
        let is_dense = f64::from(self.options.is_dense);
        let of_headings: f64 = self
            .headings
            .iter()
            .map(|heading| {
                let bound_n_s = heading.with_one_step_n_s();
                let of_safe = replicas * bound_n_s / precision_n_s + of_loss;
                of_search + of_safe + is_dense * MAP_TO * bound_n_s / precision_n_s
            })
            .sum();
        let of_push_s = start.elapsed().as_secs_f64() / pushes as f64;
        let of_search = of_headings / self.headings.len() as f64;
        Ok(of_push_s * of_search * searches as f64 / self.pool.threads as f64)
    }

    /// Runs the searches of this shard that the folder lacks. Returns the result as soon as those of all shards are there.
    pub fn run(&self, batch: &Batch) -> Result<Option<Limits>> {
        let Self {
            campaign,
            options,
            precision_n_s,
            plan,
            pendulum_bounds,
            ..
        } = self;
        let (precision_n_s, mut headings) = (*precision_n_s, self.headings.clone());
        let controllers = &plan.manifest.controllers;
        let random = is_random(campaign);
        let pendulum = campaign.push.pendulum;
        let possible_n_s = pendulum.map_or(f64::INFINITY, |pendulum| {
            pendulum.bob().momentum_n_s(pendulum.rope_m)
        });
        let sector_deg = SECTOR_DEG.min(180.0 / options.headings as f64);
        if !batch.lacks(&self.jobs).is_empty() {
            let factories = self.controllers()?;
            let start_spread_s = start_spread_s(campaign, factories);
            let opening = plan.opening(factories);
            let search = |job: usize| {
                let heading = &headings[job / controllers.len()];
                let controller = job % controllers.len();
                let [start_spread_s, heading_spread_deg] =
                    match factories[controller].takes_footsteps {
                        true => [start_spread_s, sector_deg],
                        false => [0.0; 2],
                    };
                let rule = Rule {
                    most_n_s: (BEYOND_THE_BOUND * heading.with_steps_n_s())
                        .max(10.0 * precision_n_s)
                        .min(possible_n_s),
                    precision_n_s,
                    max_trials: options.max_trials,
                    random: random || heading_spread_deg > 0.0,
                };
                LimitSearch {
                    campaign,
                    plan,
                    factories,
                    opening: opening.as_ref(),
                    controller,
                    start_spread_s,
                    heading_spread_deg,
                    heading_deg: heading.heading_deg,
                    bound_one_step_n_s: heading.bound_one_step_n_s,
                    replicas: options.replicas,
                    sector_deg,
                    is_dense: options.is_dense,
                    possible_n_s,
                    batch,
                }
                .run(rule)
            };
            self.pool.install(|| batch.run(&self.jobs, search))?;
        }
        let Some(limits) = batch.results::<ControllerLimit>(&self.jobs)? else {
            return Ok(None);
        };
        let mut limits = limits.into_iter();
        for heading in &mut headings {
            heading.controllers = limits.by_ref().take(controllers.len()).collect();
        }
        Ok(Some(Limits {
            campaign: campaign.name.clone(),
            robot: campaign.robot.clone(),
            engine: campaign.episode.engine,
            engines: campaign
                .different_engines()
                .into_iter()
                .map(|engine| LimitEngine {
                    engine: engine.with_version(),
                    physics_step_s: campaign.episode.physics_step_s,
                })
                .collect(),
            seed: campaign.seed,
            sole_impulse_n_s: campaign.units.impulse_n_s(),
            precision_n_s,
            max_trials: options.max_trials,
            replicas: options.replicas,
            sector_deg,
            random,
            warnings: plan.manifest.warnings(),
            episodes: headings
                .iter()
                .flat_map(|heading| &heading.controllers)
                .map(ControllerLimit::episodes)
                .sum(),
            pendulum,
            pendulum_bounds: pendulum_bounds.clone(),
            headings,
        }))
    }
}

impl Limits {
    /// The holes of the maps with their headings (degrees) and controllers, in the order of the controllers.
    pub fn holes(&self) -> impl Iterator<Item = (f64, &ControllerLimit, &MapPoint)> {
        let controllers = self
            .headings
            .first()
            .map_or(0, |heading| heading.controllers.len());
        (0..controllers)
            .flat_map(|controller| {
                self.headings
                    .iter()
                    .map(move |heading| (heading, controller))
            })
            .flat_map(|(heading, controller)| {
                let limit = &heading.controllers[controller];
                limit
                    .holes()
                    .map(move |hole| (heading.heading_deg, limit, hole))
            })
    }
}

/// The time over which the starts of pushes are spread (s): the longest stride of these controllers, and for those that do not
/// march [`SPREAD`]. It is so short that all pushes end within three quarters of the episode, as those of a campaign do.
fn start_spread_s(campaign: &Campaign, factories: &[PreparedController]) -> f64 {
    let strides = factories.iter().filter_map(|factory| factory.stride_s);
    let spread_s = strides.fold(SPREAD * campaign.units.time_s(), f64::max);
    let ends_s = trial::pushes(campaign, 0)
        .into_iter()
        .map(|push| push.end_s());
    let left_s = 0.75 * campaign.episode.horizon_s - ends_s.fold(0.0, f64::max);
    spread_s.min(left_s.max(0.0))
}

/// Rounds a number to two digits.
pub(crate) fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}")
        .parse()
        .expect("a number that was written is read")
}

fn check(options: &LimitOptions) -> Result<()> {
    in_range(
        "command line",
        "--headings",
        options.headings as f64,
        [1.0, MOST_HEADINGS as f64],
    )?;
    in_range(
        "command line",
        "--replicas",
        options.replicas as f64,
        [0.0, MOST_REPLICAS as f64],
    )?;
    in_range(
        "command line",
        "--trials",
        options.max_trials as f64,
        [1.0, MOST_TRIALS as f64],
    )
}
