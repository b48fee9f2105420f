//! A card for a lab: what a robot with a controller takes, what costs most of it, how it is lost, and which pushes to try on
//! hardware first. [`observed`] compares what was seen there with the card.
//!
//! Three lists of jobs follow each other, since each needs what the one before it found. The [limits](crate::limit) by
//! heading come first. Then trials near these limits tell what costs most: on the robot as it was designed, with each
//! quantity spread as in the campaign `harsh`, one at a time, and with all of them, each time with the same pushes. Last
//! come replicas of the pushes for hardware, whose share of survivals is the prediction.

pub mod observed;

use crate::ask::bounds::in_range;
use crate::ask::distribution::Distribution;
use crate::ask::push::SecondPushSpec;
use crate::ask::spec::{Campaign, Overrides};
use crate::ask::trial;
use crate::ask::variations::{VariationSpec, Varied};
use crate::batch::{Batch, Jobs, SearchTask};
use crate::limit::{ControllerLimit, LimitOptions, Limits, Searches, pushed, two_digits};
use crate::store::row::TrialRow;
use crate::verdict::failures::Failures;
use serde::{Deserialize, Serialize};
use serde_json::json;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_robots::urdf::Files;
use standfast_sim::episode::Record;
use standfast_stats::decision::each_of;
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::rate::{SuccessCount, clopper_pearson};
use standfast_stats::sheet::{Chance, most_telling, power};
use std::collections::BTreeMap;

/// The card and the sheet of observations in the folder of a card.
pub const CARD: &str = "card.json";
pub const OBSERVED: &str = "observed.csv";

/// Settings of the card.
#[derive(Debug, Clone, Copy)]
pub struct CardOptions {
    /// Number of headings, evenly spaced from 0.
    pub headings: usize,
    /// As in [`LimitOptions`].
    pub precision_n_s: Option<f64>,
    /// Number of trials for each difference, and the most of a search for a limit.
    pub trials: u64,
    /// Number of replicas of each push for hardware.
    pub replicas: u64,
    /// Number of pushes for hardware.
    pub pushes: usize,
    /// Number of threads; 0 means one per core.
    pub threads: usize,
    /// Whether a controller runs that has not been tried without a push.
    pub untried: bool,
}

/// Most trials and replicas.
pub const MOST_TRIALS: u64 = 10_000;
/// Most trials of a search for a limit, and pushes at each step of the search for the first loss.
const MOST_OF_SEARCH: u64 = 150;
const SAFE_REPLICAS: u64 = 2;
/// First numbers of the trials, beyond those of any search for a limit.
const FIRST_TRIAL: u64 = 1 << 41;
const FIRST_REPLICA: u64 = 1 << 40;
/// Impulses of the trials, as shares of the limit at their heading: most are survived on the robot as designed.
const NEAR_LIMIT: [f64; 2] = [0.7, 1.1];
/// Impulses of the pushes for hardware to choose from, as shares of the limit. Harder ones could damage a robot.
const LEVELS: [f64; 9] = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3];
/// Slopes of the log odds over the logarithm of the impulse beyond which none is believed.
const SLOPES: [f64; 2] = [2.0, 60.0];
/// The scale of the limits of a robot that the pushes should tell from the predicted one.
pub const WORSE: f64 = 0.8;

/// A quantity, and how a campaign takes its spread from `harsh`.
type Factor = (&'static str, fn(&mut Campaign, &Campaign));
const FACTORS: [Factor; 8] = [
    ("friction", |to, harsh| {
        to.variations.friction = harsh.variations.friction;
    }),
    ("torque and speed of the motors", |to, harsh| {
        to.variations.torque_scale = harsh.variations.torque_scale;
        to.variations.speed_scale = harsh.variations.speed_scale;
    }),
    ("gains of the servos", |to, harsh| {
        to.variations.kp_scale = harsh.variations.kp_scale;
        to.variations.kd_scale = harsh.variations.kd_scale;
    }),
    ("delay", |to, harsh| {
        to.variations.delay_s = harsh.variations.delay_s;
    }),
    ("load", |to, harsh| {
        to.variations.mass_scale = harsh.variations.mass_scale;
        to.variations.trunk_com_x_m = harsh.variations.trunk_com_x_m;
        to.variations.trunk_com_y_m = harsh.variations.trunk_com_y_m;
    }),
    ("slope", |to, harsh| {
        to.variations.slope_deg = harsh.variations.slope_deg;
    }),
    ("steps in the ground", |to, harsh| {
        to.variations.ground_step_m = harsh.variations.ground_step_m;
    }),
    ("height of the push", |to, harsh| {
        to.push.height_m = harsh.push.height_m;
    }),
];

/// The card.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Card {
    pub controller: String,
    pub limits: Limits,
    /// The largest impulse up to which nothing was lost at any heading.
    pub safe_n_s: f64,
    /// Impulses of the trials of `factors` and `losses`, as shares of the limit at their heading.
    pub near_limit: [f64; 2],
    /// Trials on the robot as designed.
    pub designed: SuccessCount,
    /// What each quantity costs, the most expensive first.
    pub factors: Vec<Cost>,
    /// What all quantities cost together.
    pub together: Cost,
    pub losses: Vec<Loss>,
    /// From what the heights of the pushes count.
    pub height_from: String,
    pub replicas: u64,
    /// Variance of the number of survivals over robots each of which gets all pushes, as a multiple of that of independent
    /// pushes; None if that is 0.
    pub overdispersion: Option<f64>,
    /// The chance that the pushes tell a robot whose limits are [`WORSE`] times the predicted ones.
    pub power: f64,
    /// The pushes for hardware, from the one that is most surely survived to the one that is least so.
    pub pushes: Vec<CardPush>,
}

/// What a quantity costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    pub name: String,
    /// Its spread in words.
    pub spread: String,
    pub survived: u64,
    /// Success rate less that of the robot as designed, over the same trials (a share), and its interval. All intervals
    /// together hold at 95 %.
    pub difference: f64,
    pub difference_ci: [f64; 2],
}

/// Number of trials that were lost in one way, by the name that it has in a [`Failures`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Loss {
    pub way: String,
    pub as_designed: u64,
    pub together: u64,
}

/// A push for hardware.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CardPush {
    pub push: u64,
    /// Impulse (N s), or momentum of a bob.
    pub impulse_n_s: f64,
    /// Drawback of the bob (m); None for a force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draw_m: Option<f64>,
    pub heading_deg: f64,
    pub height_m: f64,
    pub duration_s: f64,
    /// Predicted chance of survival: of k among n replicas (k + 1/2) / (n + 1), the mean of what they leave to be
    /// believed. So it is never 0 or 1, and it allows for the small number of replicas.
    pub predicted: f64,
    pub predicted_ci95: [f64; 2],
    /// Chance that is left however weak or hard a push is: that of no survival among the replicas.
    pub lapse: f64,
    /// By how much the log odds of survival rise with the logarithm of the limit.
    pub slope: f64,
    /// The limit at this heading (N s).
    pub limit_n_s: f64,
}

impl CardPush {
    pub fn chance(&self) -> Chance {
        Chance {
            predicted: self.predicted,
            lapse: self.lapse,
            slope: self.slope,
            below_limit: (self.limit_n_s / self.impulse_n_s).ln(),
        }
    }
}

/// How a trial ended: None if it was survived, or the names of the counts of [`Failures`] to which it belongs.
type End = Option<Vec<String>>;

/// The jobs of a card.
pub struct CardSearch<'a> {
    campaign: &'a Campaign,
    options: CardOptions,
    searches: Searches<'a>,
    /// The quantities of the variants.
    factors: Vec<&'static str>,
    /// The robot as designed, with each quantity in turn, and with all.
    variants: Vec<Campaign>,
    pub limit_jobs: Jobs,
    /// One for each trial, with all variants.
    pub trial_jobs: Jobs,
    /// One for each push for hardware, with all its replicas.
    pub push_jobs: Jobs,
}

/// The campaign of a card: `standard` with these changes, but with pushes of one height and duration, which a lab can
/// repeat.
pub fn campaign(robot: &Robot, overrides: &Overrides) -> Result<Campaign> {
    let mut overrides = overrides.clone();
    let usual = ["push.height=0.0", "push.duration=0.2813"].map(String::from);
    overrides.set.splice(0..0, usual);
    let mut campaign = Campaign::load_for(robot, "standard", &overrides)?;
    let push = &mut campaign.push;
    push.height_m = Distribution::Constant(two_digits(push.height_m.mean()));
    if push.pendulum.is_none() {
        push.duration_s = Distribution::Constant(two_digits(push.duration_s.mean()));
    }
    Ok(campaign)
}

impl<'a> CardSearch<'a> {
    /// Reads the controller, and runs nothing. Fails if an option or an input is wrong.
    pub fn new(campaign: &'a Campaign, files: Files, options: CardOptions) -> Result<Self> {
        in_range(
            "command line",
            "--trials",
            options.trials as f64,
            [1.0, MOST_TRIALS as f64],
        )?;
        let robot = files.robot()?;
        let harsh = Campaign::load_for(&robot, "harsh", &Overrides::default())?;
        let of_limits = LimitOptions {
            headings: options.headings,
            precision_n_s: options.precision_n_s,
            max_trials: options.trials.min(MOST_OF_SEARCH),
            replicas: SAFE_REPLICAS,
            is_dense: false,
            threads: options.threads,
            untried: options.untried,
        };
        let searches = Searches::new(campaign, files, of_limits)?;
        let mut designed = campaign.clone();
        designed.variations = VariationSpec::default();
        designed.second_push = SecondPushSpec::none(&campaign.units);
        // The ground may need the time to tilt.
        designed.push.start_s = harsh.push.start_s;
        let mut variants = vec![designed.clone()];
        let mut together = designed.clone();
        let mut factors = Vec::new();
        for (name, change) in FACTORS {
            let mut variant = designed.clone();
            change(&mut variant, &harsh);
            // At some height a bob may pass the robot by.
            if variant.push.on(&robot, "harsh").is_ok() {
                change(&mut together, &harsh);
                factors.push(name);
                variants.push(variant);
            }
        }
        variants.push(together);
        Ok(Self {
            campaign,
            limit_jobs: searches.jobs.clone(),
            searches,
            factors,
            variants,
            trial_jobs: Jobs::kept_one_by_one("trial", options.trials as usize),
            push_jobs: Jobs::kept_one_by_one("push", options.pushes),
            options,
        })
    }

    /// The task, on which the folder of a result depends.
    pub fn task(&self) -> SearchTask {
        let mut task = self.searches.task();
        task.command = "card".into();
        task.options["card"] = json!({
            "trials": self.options.trials,
            "replicas": self.options.replicas,
            "pushes": self.options.pushes,
        });
        task
    }

    /// Prepares the controller and tries it without a push, unless that is done. Fails if the robot falls.
    pub fn prepare(&self) -> Result<()> {
        self.searches.controllers().map(drop)
    }

    /// The limits by heading. None if it was not run to its end here.
    pub fn limits(&self, batch: &Batch) -> Result<Option<Limits>> {
        self.searches.run(batch)
    }

    /// How the trials end with each variant. None as in [`limits`](Self::limits).
    pub fn trials(&self, limits: &Limits, batch: &Batch) -> Result<Option<Vec<Vec<End>>>> {
        let run = |job: usize| {
            let number = FIRST_TRIAL + job as u64;
            let heading_deg = trial::push(&self.variants[0], number).heading_deg;
            let share = trial::share(self.campaign.seed, number);
            let [least, most] = NEAR_LIMIT;
            let impulse_n_s = limit_at(limits, heading_deg) * (least + (most - least) * share);
            let mut ends = Vec::new();
            for variant in &self.variants {
                let row = self.row(variant, number, impulse_n_s, heading_deg, limits, batch)?;
                ends.push(end(&row));
            }
            Ok(ends)
        };
        self.gather(&self.trial_jobs, run, batch)
    }

    /// Whether each replica of each push for hardware is survived, push by push. None as in [`limits`](Self::limits).
    /// Fails if the robot stands no push at all.
    pub fn replicas(&self, limits: &Limits, batch: &Batch) -> Result<Option<Vec<Vec<bool>>>> {
        let chosen = self.chosen(limits)?;
        let run = |job: usize| {
            let (push, _) = chosen[job];
            let (impulse_n_s, heading_deg) = (push.impulse_n_s, push.heading_deg);
            let mut survived = Vec::new();
            for replica in 0..self.options.replicas {
                let number = FIRST_REPLICA + replica;
                let row = self.row(
                    self.campaign,
                    number,
                    impulse_n_s,
                    heading_deg,
                    limits,
                    batch,
                )?;
                survived.push(row.record.outcome.is_success());
            }
            Ok(survived)
        };
        self.gather(&self.push_jobs, run, batch)
    }

    fn gather<T: Serialize + serde::de::DeserializeOwned + Send>(
        &self,
        jobs: &Jobs,
        run: impl Fn(usize) -> Result<T> + Sync + Send,
        batch: &Batch,
    ) -> Result<Option<Vec<T>>> {
        if !batch.lacks(jobs).is_empty() {
            self.prepare()?;
            self.searches.pool.install(|| batch.run(jobs, run))?;
        }
        batch.results(jobs)
    }

    /// A trial of a campaign with another impulse and heading, and with a start that is spread as in the limits.
    fn row(
        &self,
        campaign: &Campaign,
        number: u64,
        impulse_n_s: f64,
        heading_deg: f64,
        limits: &Limits,
        batch: &Batch,
    ) -> Result<TrialRow> {
        batch.go_on()?;
        let [.., later] = trial::replica(campaign.seed, number);
        let late_s = later * limits.headings[0].controllers[0].start_spread_s;
        let disturbance = pushed(campaign, number, impulse_n_s, heading_deg, late_s);
        let (pushes, variation) = (disturbance.pushes.clone(), disturbance.variation);
        let factories = self.searches.controllers()?;
        let mut records: Vec<Record> =
            self.searches
                .plan
                .records(factories, None, disturbance, &[0])?;
        (batch.on_episode)();
        let name = &factories[0].name;
        Ok(TrialRow::new(
            number,
            name,
            &pushes,
            None,
            variation,
            records.remove(0),
        ))
    }

    /// The pushes for hardware, in their order and yet without predictions, with their chances by the limits alone.
    fn chosen(&self, limits: &Limits) -> Result<Vec<(CardPush, Chance)>> {
        let mut candidates: Vec<(CardPush, Chance, usize)> = Vec::new();
        for (group, heading) in limits.headings.iter().enumerate() {
            let limit = &heading.controllers[0];
            for level in LEVELS {
                let impulse_n_s = level * limit.impulse50_n_s;
                let bob = self.campaign.push.pendulum.map(|pendulum| pendulum.bob());
                // What is set by hand has few digits.
                let draw_m = bob.map(|bob| (100.0 * bob.draw_m(impulse_n_s)).round() / 100.0);
                let impulse_n_s = match (bob, draw_m) {
                    (Some(bob), Some(draw_m)) => bob.momentum_n_s(draw_m),
                    _ => two_digits(impulse_n_s),
                };
                // Two levels can be one push, as rounded.
                let is_again = candidates.last().is_some_and(|(before, ..)| {
                    [before.heading_deg, before.impulse_n_s] == [heading.heading_deg, impulse_n_s]
                });
                if impulse_n_s <= 0.0 || is_again {
                    continue;
                }
                let push = CardPush {
                    push: 0,
                    impulse_n_s,
                    draw_m,
                    heading_deg: heading.heading_deg,
                    height_m: self.campaign.push.height_m.mean(),
                    duration_s: self.campaign.push.duration_s.mean(),
                    predicted: 0.0,
                    predicted_ci95: [0.0, 1.0],
                    lapse: 0.5 / (self.options.replicas as f64 + 1.0),
                    slope: slope(limit),
                    limit_n_s: limit.impulse50_n_s,
                };
                // By the limit and its slope alone.
                let even = Chance {
                    predicted: 0.5,
                    ..push.chance()
                };
                let predicted = even.at(limit.impulse50_n_s / impulse_n_s);
                let chance = Chance { predicted, ..even };
                candidates.push((push, chance, group));
            }
        }
        let pushes = self.options.pushes;
        let chances: Vec<(Chance, usize)> = candidates
            .iter()
            .map(|(_, chance, group)| (*chance, *group))
            .collect();
        let of_heading = pushes.div_ceil(limits.headings.len());
        let numbers = most_telling(&chances, pushes, of_heading);
        if numbers.len() < pushes {
            return Err(Error::option(
                "--tries",
                pushes,
                format!(
                    "only {} pushes can be chosen, at {} headings",
                    numbers.len(),
                    limits.headings.len()
                ),
                "fewer pushes or more --headings; a robot that stands no push has none",
            ));
        }
        let mut chosen: Vec<_> = numbers
            .into_iter()
            .map(|number| (candidates[number].0, candidates[number].1))
            .collect();
        chosen.sort_by(|a, b| b.1.predicted.total_cmp(&a.1.predicted));
        Ok(chosen)
    }

    /// The card, from what the three lists of jobs found.
    pub fn card(
        &self,
        limits: Limits,
        trials: &[Vec<End>],
        replicas: &[Vec<bool>],
    ) -> Result<Card> {
        let survived = |variant: usize| {
            let ends = trials.iter().filter(|ends| ends[variant].is_none());
            ends.count() as u64
        };
        let level = each_of(self.factors.len() + 1, 0.95);
        let cost = |variant: usize, name: &str, spread: String| {
            let outcomes = trials.iter();
            let outcomes = outcomes.map(|ends| (ends[variant].is_none(), ends[0].is_none()));
            let counts = PairedCounts::of(outcomes);
            Cost {
                name: name.into(),
                spread,
                survived: survived(variant),
                difference: counts.difference(),
                difference_ci: counts.difference_interval(level),
            }
        };
        let mut factors = Vec::new();
        for (i, name) in self.factors.iter().enumerate() {
            factors.push(cost(
                i + 1,
                name,
                spread(&self.variants[i + 1], &self.variants[0]),
            ));
        }
        factors.sort_by(|a, b| a.difference.total_cmp(&b.difference));
        let last = self.variants.len() - 1;
        let mut ways: BTreeMap<&str, [u64; 2]> = BTreeMap::new();
        for ends in trials {
            for (place, variant) in [0, last].into_iter().enumerate() {
                for way in ends[variant].iter().flatten() {
                    ways.entry(way).or_default()[place] += 1;
                }
            }
        }
        let losses = ways.into_iter().map(|(way, [as_designed, together])| Loss {
            way: way.into(),
            as_designed,
            together,
        });
        let chosen = self.chosen(&limits)?;
        let n = self.options.replicas;
        let mut pushes = Vec::new();
        let mut independent = 0.0;
        for (i, (push, _)) in chosen.iter().enumerate() {
            let k = replicas[i].iter().filter(|survived| **survived).count() as u64;
            let share = k as f64 / n as f64;
            independent += share * (1.0 - share);
            let predicted = (k as f64 + 0.5) / (n as f64 + 1.0);
            pushes.push(CardPush {
                push: i as u64 + 1,
                // As many digits as the sheet has.
                predicted: (1e4 * predicted).round() / 1e4,
                predicted_ci95: clopper_pearson(k, n, 0.95),
                ..*push
            });
        }
        let of_robot =
            |robot: usize| replicas.iter().filter(|of_push| of_push[robot]).count() as f64;
        let counts: Vec<f64> = (0..n as usize).map(of_robot).collect();
        let mean = counts.iter().sum::<f64>() / n as f64;
        let variance = counts
            .iter()
            .map(|count| (count - mean).powi(2))
            .sum::<f64>()
            / n as f64;
        let chances: Vec<Chance> = pushes.iter().map(CardPush::chance).collect();
        let safe_n_s = limits
            .headings
            .iter()
            .filter_map(|h| h.controllers[0].safe_n_s);
        Ok(Card {
            controller: limits.headings[0].controllers[0].name.clone(),
            safe_n_s: safe_n_s.fold(f64::INFINITY, f64::min),
            near_limit: NEAR_LIMIT,
            designed: SuccessCount::new(survived(0), trials.len() as u64),
            factors,
            together: cost(last, "all of these", "as above".into()),
            losses: losses.collect(),
            height_from: self.campaign.push.from_what().into(),
            replicas: n,
            overdispersion: (independent > 0.0).then_some(variance / independent),
            power: power(&chances, WORSE),
            pushes,
            limits,
        })
    }
}

/// How a trial ended.
fn end(row: &TrialRow) -> End {
    if row.record.outcome.is_success() {
        return None;
    }
    let mut failures = Failures::default();
    failures.add(row);
    let counted = serde_json::to_value(failures).unwrap_or_default();
    let ways = counted.as_object().into_iter().flatten();
    let ways = ways.filter(|(_, count)| count.as_u64() != Some(0));
    Some(ways.map(|(way, _)| way.clone()).collect())
}

/// Words before and after the values of a quantity, where the name of the factor does not say them.
const WORDS: [(&str, &str, &str); 11] = [
    ("torque_scale", "torque times ", ""),
    ("speed_scale", "speed times ", ""),
    ("kp_scale", "stiffness times ", ""),
    ("kd_scale", "damping times ", ""),
    ("delay_s", "", " s"),
    ("mass_scale", "mass times ", ""),
    ("trunk_com_x_m", "COM of the trunk forward by ", " m"),
    ("trunk_com_y_m", "to the left by ", " m"),
    ("slope_deg", "", "\u{b0}"),
    ("ground_step_m", "", " m"),
    ("height_m", "", " m"),
];

/// What a variant varies that the robot as designed does not, in words.
fn spread(variant: &Campaign, designed: &Campaign) -> String {
    let mut spreads = variant.variations.list();
    if variant.push.height_m != designed.push.height_m {
        spreads.push(("height_m", Varied(Some(variant.push.height_m))));
    }
    let mut all = Vec::new();
    for (quantity, Varied(distribution)) in spreads {
        let Some(distribution) = distribution else {
            continue;
        };
        let words = WORDS.iter().find(|(name, ..)| *name == quantity);
        let (before, unit) = words.map_or(("", ""), |(_, before, unit)| (before, unit));
        all.push(format!("{before}{distribution}{unit}").replace("uniform ", ""));
    }
    all.join(", ")
}

/// The limit at a heading, on the straight line between those of the headings beside it (N s).
fn limit_at(limits: &Limits, heading_deg: f64) -> f64 {
    let count = limits.headings.len();
    let place = heading_deg.rem_euclid(360.0) / 360.0 * count as f64;
    let (before, share) = (place as usize, place.fract());
    let at = |i: usize| limits.headings[i % count].controllers[0].impulse50_n_s;
    at(before) * (1.0 - share) + at(before + 1) * share
}

/// By how much the log odds of survival fall if the logarithm of the impulse rises by 1.
fn slope(limit: &ControllerLimit) -> f64 {
    let impulse90_n_s = limit.impulse90_n_s.unwrap_or(limit.ci95[0]);
    let slope = 9.0_f64.ln() / (limit.impulse50_n_s / impulse90_n_s).ln();
    if slope.is_finite() {
        slope.clamp(SLOPES[0], SLOPES[1])
    } else {
        SLOPES[1]
    }
}
