//! The search at one heading with one controller, by trials of the campaign with another impulse and heading of the
//! push.

use crate::ask::pendulum::{PendulumSpec, robocup_m};
use crate::ask::spec::Campaign;
use crate::ask::trial;
use crate::batch::Batch;
use crate::plan::PreparedCampaign;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use standfast_core::error::Result;
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{ClosedLoop, Disturbance, Outcome, Record};
use standfast_stats::psychometric::{ImpulseEstimate, Posterior, Rule};

/// Result for one controller at one heading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerLimit {
    pub name: String,
    pub impulse50_n_s: f64,
    pub ci95: [f64; 2],
    /// Impulse with 90 % recovery; None if nothing is random.
    pub impulse90_n_s: Option<f64>,
    pub impulse90_ci95: Option<[f64; 2]>,
    /// The change of velocity by `impulse50_n_s`, over the robot's mass (m/s) and as a multiple of sqrt(g h).
    pub dv_m_s: f64,
    pub dv_over_sqrt_g_h: f64,
    /// Time over which the starts of the pushes were spread (s).
    pub start_spread_s: f64,
    /// Largest difference of the heading of a push of the search for `impulse50_n_s` (degrees).
    pub heading_spread_deg: f64,
    /// Ratio of `impulse50_n_s` to the bound with one footstep.
    pub of_one_step_bound: Option<f64>,
    /// Whether the interval of `impulse50_n_s` is as narrow as requested.
    pub resolved: bool,
    /// What the limit is for a pendulum, whose momentum is the impulse; None for a force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pendulum: Option<PendulumLimit>,
    /// The largest impulse of the grid up to which nothing was lost; None if there was no search for the first loss.
    pub safe_n_s: Option<f64>,
    /// The largest impulse from which the robot recovered; None if there was no search above the limit, which ends where
    /// nothing more is recovered from.
    pub none_above_n_s: Option<f64>,
    /// Number of trials of that search.
    pub none_above_trials: u64,
    /// The loss that ended the search for the first loss; None if nothing was lost, or if there was no such search.
    pub first_loss: Option<FirstLoss>,
    /// Number of trials of the search for the first loss.
    pub safe_trials: u64,
    /// The pushes of the map at this heading, from weak to hard; empty without a map.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub map: Vec<MapPoint>,
    /// Number of trials of the search for `impulse50_n_s`, and the number of each outcome.
    pub trials: u64,
    pub recovered: u64,
    pub survived: u64,
    pub fell: u64,
    #[serde(default)]
    pub broke: u64,
    pub timed_out: u64,
    pub diverged: u64,
    pub failed: u64,
}

/// The limit of a push by a pendulum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PendulumLimit {
    /// Drawback with 50 % recovery (m), and its 95 % interval.
    pub draw50_m: f64,
    pub draw50_ci95_m: [f64; 2],
    /// Impulse on the robot from that drawback (N s), in the first trial of the search; None if the robot fell before.
    pub transmitted_n_s: Option<f64>,
    /// The metric [`robocup_m`] at the drawback.
    pub robocup_m: f64,
}

/// A push that was lost, exactly as `standfast push` can repeat it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FirstLoss {
    pub impulse_n_s: f64,
    pub heading_deg: f64,
    pub start_s: f64,
    /// Index of the trial of this search, which fixes everything else; `push` takes it by `--trial`.
    pub trial: u64,
    /// Impulse with 50 % recovery at this heading (N s), and the number of trials that found it.
    pub limit_n_s: f64,
    pub limit_trials: u64,
    /// Ratio of `impulse_n_s` to `limit_n_s`.
    pub of_limit: f64,
}

/// A push of the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MapPoint {
    pub impulse_n_s: f64,
    /// Start of the push (s).
    pub start_s: f64,
    /// Index of the trial of this search, which fixes all but impulse, heading and start; `push` takes it by `--trial`.
    pub trial: u64,
    #[serde(serialize_with = "by_name", deserialize_with = "of_name")]
    pub outcome: Outcome,
}

fn by_name<S: Serializer>(
    outcome: &Outcome,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(outcome.name())
}

fn of_name<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Outcome, D::Error> {
    let name = String::deserialize(deserializer)?;
    let outcome = Outcome::ALL
        .into_iter()
        .find(|outcome| outcome.name() == name);
    outcome.ok_or_else(|| de::Error::custom(format!("{name} is no outcome")))
}

/// A loss at an impulse below this share of the impulse with 50 % recovery is a hole.
const HOLE: f64 = 0.95;

impl ControllerLimit {
    /// The first loss, if the robot survives harder pushes although it loses this one.
    pub fn hole(&self) -> Option<&FirstLoss> {
        self.first_loss.as_ref().filter(|loss| loss.of_limit < HOLE)
    }

    /// The holes of the map. Of each run of adjacent lost impulses below the limit, this is the smallest one.
    pub fn holes(&self) -> impl Iterator<Item = &MapPoint> {
        let is_lost = |tried: &MapPoint| {
            !tried.outcome.is_success() && tried.impulse_n_s < HOLE * self.impulse50_n_s
        };
        self.map
            .iter()
            .enumerate()
            .filter(move |&(i, tried)| is_lost(tried) && (i == 0 || !is_lost(&self.map[i - 1])))
            .map(|(_, tried)| tried)
    }

    /// Number of episodes of its searches.
    pub fn episodes(&self) -> u64 {
        let of_loss = self.first_loss.map_or(0, |loss| loss.limit_trials);
        self.trials + self.safe_trials + of_loss + self.none_above_trials + self.map.len() as u64
    }
}

/// Whether trials with the same impulse and heading can differ.
pub(super) fn is_random(campaign: &Campaign) -> bool {
    let push = &campaign.push;
    let drawn = [push.height_m, push.duration_s]
        .into_iter()
        .any(|distribution| !distribution.is_constant());
    drawn || campaign.second_push.is_random() || !trial::begin_alike(campaign)
}

/// Distance between the first trials of two headings that are a thousandth of a degree apart. The drawn trials depend
/// on it, so it must not change.
const TRIALS_APART: u64 = 1 << 20;
/// Largest number of trials in one search.
pub const MOST_TRIALS: u64 = 100_000;
/// Largest number of episodes for each impulse of the search for the first loss.
pub const MOST_REPLICAS: u64 = 100;

/// The result of the search for the first loss.
struct Safe {
    up_to_n_s: f64,
    first_loss: Option<FirstLoss>,
    trials: u64,
}

/// The result of the search above the limit.
struct Above {
    none_above_n_s: f64,
    trials: u64,
}

/// Offset of the trials of the search for the first loss from the first trial of their heading; and the largest number
/// of impulses in that search or in a map.
const SAFE_TRIAL_OFFSET: u64 = 2 * MOST_TRIALS;
const MOST_GRID_POINTS: u64 = 8_000;
/// Offset of the trials of the search above the limit from the first trial of their heading; the ratio of two adjacent
/// impulses there; and the number of adjacent impulses, all lost, at which it ends.
const ABOVE_TRIALS: u64 = SAFE_TRIAL_OFFSET + MOST_REPLICAS * (MOST_GRID_POINTS + 1);
const ABOVE_RATIO: f64 = 1.03;
const ABOVE_LOST: u64 = 8;
const MOST_ABOVE: u64 = 200;
/// Largest difference of a replica in the impulse (relative). The push starts within a control period, or within the
/// spread of the starts.
const REPLICA_IMPULSE_SHARE: f64 = 0.01;
/// Offset of the trials of the map from the first trial of their heading; and the largest impulse of the map, as a
/// multiple of the impulse with 50 % recovery.
const MAP_TRIALS: u64 = MOST_TRIALS;
pub(super) const MAP_TO: f64 = 1.15;

pub(super) struct LimitSearch<'a> {
    pub campaign: &'a Campaign,
    pub plan: &'a PreparedCampaign,
    pub factories: &'a [PreparedController],
    /// The beginning of all trials, if they begin alike.
    pub opening: Option<&'a ClosedLoop<'a>>,
    /// Number of the controller.
    pub controller: usize,
    pub heading_deg: f64,
    /// The pendulum's bound with one footstep (N s), if it is known.
    pub bound_one_step_n_s: Option<f64>,
    pub replicas: u64,
    /// Time over which the starts of the pushes are spread (s), and the angle to either side over which their headings are
    /// (degrees), in the searches for the limit and above it; 0 without footsteps.
    pub start_spread_s: f64,
    pub heading_spread_deg: f64,
    /// Largest difference of a replica in the heading (degrees).
    pub sector_deg: f64,
    /// Whether to try every impulse, for a map.
    pub is_dense: bool,
    /// Largest impulse that there can be (N s): infinite, or that of a pendulum.
    pub possible_n_s: f64,
    pub batch: &'a Batch<'a>,
}

impl LimitSearch<'_> {
    pub fn run(&self, rule: Rule) -> Result<ControllerLimit> {
        let [
            mut recovered,
            mut survived,
            mut fell,
            mut broke,
            mut timed_out,
            mut diverged,
            mut failed,
        ] = [0; 7];
        let mut none_above_n_s = 0.0_f64;
        let posterior = self.limit(rule, self.heading_deg, |impulse_n_s, outcome| {
            if outcome.is_success() {
                none_above_n_s = none_above_n_s.max(impulse_n_s);
            }
            *match outcome {
                Outcome::Recovered => &mut recovered,
                Outcome::Survived => &mut survived,
                Outcome::Fell => &mut fell,
                Outcome::Broke => &mut broke,
                Outcome::TimedOut => &mut timed_out,
                Outcome::Diverged => &mut diverged,
                Outcome::Failed => &mut failed,
            } += 1;
        })?;
        let (random, grid_n_s) = (rule.random, rule.precision_n_s);
        let safe = self.safe(rule)?;
        let (impulse50, impulse90) = (posterior.impulse50(), posterior.impulse90());
        let above = self.above(impulse50.at_n_s)?;
        let map = if self.is_dense {
            self.map(grid_n_s, self.possible_n_s.min(MAP_TO * impulse50.at_n_s))?
        } else {
            Vec::new()
        };
        let [dv_m_s, dv_over_sqrt_g_h] = self.campaign.units.velocity_of(impulse50.at_n_s);
        let pendulum = match &self.campaign.push.pendulum {
            Some(pendulum) => Some(self.of_pendulum(pendulum, &impulse50)?),
            None => None,
        };
        Ok(ControllerLimit {
            name: self.plan.manifest.controllers[self.controller].clone(),
            impulse50_n_s: impulse50.at_n_s,
            ci95: impulse50.ci95,
            impulse90_n_s: random.then_some(impulse90.at_n_s),
            impulse90_ci95: random.then_some(impulse90.ci95),
            dv_m_s,
            dv_over_sqrt_g_h,
            start_spread_s: self.start_spread_s,
            heading_spread_deg: self.heading_spread_deg,
            of_one_step_bound: self
                .bound_one_step_n_s
                .map(|bound_n_s| impulse50.at_n_s / bound_n_s),
            resolved: posterior.is_resolved(),
            pendulum,
            safe_n_s: (self.replicas > 0).then_some(safe.up_to_n_s),
            none_above_n_s: (self.replicas > 0)
                .then_some(none_above_n_s.max(above.none_above_n_s).max(safe.up_to_n_s)),
            none_above_trials: above.trials,
            first_loss: safe.first_loss,
            safe_trials: safe.trials,
            map,
            trials: posterior.trials(),
            recovered,
            survived,
            fell,
            broke,
            timed_out,
            diverged,
            failed,
        })
    }

    /// What the limit is for a pendulum.
    fn of_pendulum(
        &self,
        pendulum: &PendulumSpec,
        limit: &ImpulseEstimate,
    ) -> Result<PendulumLimit> {
        let (bob, heading_deg) = (pendulum.bob(), self.heading_deg);
        let trial = first_trial(heading_deg);
        let disturbance = pushed(self.campaign, trial, limit.at_n_s, heading_deg, 0.0);
        let (height_m, draw50_m) = (disturbance.pushes[0].height_m, bob.draw_m(limit.at_n_s));
        let totals = self.record(disturbance)?.totals;
        Ok(PendulumLimit {
            robocup_m: robocup_m(&bob, draw50_m, height_m, &self.campaign.units),
            draw50_m,
            draw50_ci95_m: limit.ci95.map(|n_s| bob.draw_m(n_s)),
            transmitted_n_s: totals.get("bob_impulse_n_s"),
        })
    }

    /// Searches the impulse with 50 % recovery at a heading. It calls `on_outcome` after each trial.
    fn limit(
        &self,
        rule: Rule,
        heading_deg: f64,
        mut on_outcome: impl FnMut(f64, Outcome),
    ) -> Result<Posterior> {
        let mut posterior = Posterior::new(rule);
        while let Some(impulse_n_s) = posterior.next_impulse() {
            let [later, turned] = spread_evenly(posterior.trials());
            let disturbance = pushed(
                self.campaign,
                first_trial(heading_deg) + posterior.trials(),
                impulse_n_s,
                turn(heading_deg, self.heading_spread_deg * turned),
                self.start_spread_s * later,
            );
            let outcome = self.outcome(disturbance)?;
            on_outcome(impulse_n_s, outcome);
            posterior.observe(impulse_n_s, outcome.is_success());
        }
        Ok(posterior)
    }

    /// Goes up from small impulses, in steps of the precision, to the first loss. At each step it tries `replicas`
    /// pushes, because the robot may recover from a single one by luck. Their headings differ by up to `sector_deg`;
    /// otherwise they are almost the same.
    fn safe(&self, rule: Rule) -> Result<Safe> {
        let (grid_n_s, most_n_s) = (rule.precision_n_s, rule.most_n_s);
        let mut safe = Safe {
            up_to_n_s: 0.0,
            first_loss: None,
            trials: 0,
        };
        let points = ((most_n_s / grid_n_s) as u64).min(MOST_GRID_POINTS);
        for point in 1..=if self.replicas > 0 { points } else { 0 } {
            let impulse_n_s = grid_n_s * point as f64;
            for replica in 0..self.replicas {
                let trial = first_trial(self.heading_deg)
                    + SAFE_TRIAL_OFFSET
                    + point * MOST_REPLICAS
                    + replica;
                let [more, turned, later] = trial::replica(self.campaign.seed, trial);
                let impulse_n_s = impulse_n_s * (1.0 + REPLICA_IMPULSE_SHARE * more);
                let heading_deg = turn(self.heading_deg, self.sector_deg * turned);
                let late_s = later * self.late_s();
                let disturbance = pushed(self.campaign, trial, impulse_n_s, heading_deg, late_s);
                let start_s = disturbance.pushes[0].start_s;
                safe.trials += 1;
                if !self.outcome(disturbance)?.is_success() {
                    let posterior = self.limit(rule, heading_deg, |_, _| ())?;
                    let limit_n_s = posterior.impulse50().at_n_s;
                    safe.first_loss = Some(FirstLoss {
                        impulse_n_s,
                        heading_deg,
                        start_s,
                        trial,
                        limit_n_s,
                        limit_trials: posterior.trials(),
                        of_limit: impulse_n_s / limit_n_s,
                    });
                    return Ok(safe);
                }
            }
            safe.up_to_n_s = impulse_n_s;
        }
        Ok(safe)
    }

    /// The time within which the pushes of replicas start (s).
    fn late_s(&self) -> f64 {
        let period_s = self.campaign.episode.control_period_s;
        self.start_spread_s.max(period_s)
    }

    /// Goes up from an impulse in steps of a share of it, until nothing was recovered from at many steps. At each step it
    /// tries `replicas` pushes, which differ as those of the search for the first loss, and in the heading as those of the
    /// search for the limit.
    fn above(&self, from_n_s: f64) -> Result<Above> {
        let mut above = Above {
            none_above_n_s: 0.0,
            trials: 0,
        };
        let (mut impulse_n_s, mut lost) = (from_n_s, 0);
        for point in 0..MOST_ABOVE {
            let is_possible = impulse_n_s > 0.0 && impulse_n_s <= self.possible_n_s;
            if lost >= ABOVE_LOST || self.replicas == 0 || !is_possible {
                break;
            }
            lost += 1;
            for replica in 0..self.replicas {
                let trial =
                    first_trial(self.heading_deg) + ABOVE_TRIALS + point * MOST_REPLICAS + replica;
                let [more, turned, later] = trial::replica(self.campaign.seed, trial);
                let tried_n_s = impulse_n_s * (1.0 + REPLICA_IMPULSE_SHARE * more);
                let late_s = later * self.late_s();
                let heading_deg = turn(self.heading_deg, self.heading_spread_deg * turned);
                let disturbance = pushed(self.campaign, trial, tried_n_s, heading_deg, late_s);
                above.trials += 1;
                if self.outcome(disturbance)?.is_success() {
                    above.none_above_n_s = above.none_above_n_s.max(tried_n_s);
                    lost = 0;
                }
            }
            impulse_n_s *= ABOVE_RATIO;
        }
        Ok(above)
    }

    /// Tries the impulses up to `to_n_s`, in steps of `grid_n_s`.
    fn map(&self, grid_n_s: f64, to_n_s: f64) -> Result<Vec<MapPoint>> {
        let points = ((to_n_s / grid_n_s) as u64).min(MOST_GRID_POINTS);
        let mut map = Vec::new();
        for point in 1..=points {
            let impulse_n_s = grid_n_s * point as f64;
            let trial = first_trial(self.heading_deg) + MAP_TRIALS + point;
            let [later, _] = spread_evenly(point);
            let late_s = self.start_spread_s * later;
            let disturbance = pushed(self.campaign, trial, impulse_n_s, self.heading_deg, late_s);
            map.push(MapPoint {
                impulse_n_s,
                start_s: disturbance.pushes[0].start_s,
                trial,
                outcome: self.outcome(disturbance)?,
            });
        }
        Ok(map)
    }

    fn outcome(&self, disturbance: Disturbance) -> Result<Outcome> {
        Ok(self.record(disturbance)?.outcome)
    }

    /// Fails if the searches are to stop.
    fn record(&self, disturbance: Disturbance) -> Result<Record> {
        self.batch.go_on()?;
        let mut records = self.plan.records(
            self.factories,
            self.opening,
            disturbance,
            &[self.controller],
        )?;
        (self.batch.on_episode)();
        Ok(records.remove(0))
    }
}

/// Index of the first trial at a heading. It depends on the heading alone, so the result at a heading does so, too.
pub fn first_trial(heading_deg: f64) -> u64 {
    (1e3 * heading_deg).round() as u64 * TRIALS_APART
}

/// What happens to the robot in a trial of the campaign with another impulse and heading of the first push, and with all
/// pushes later by `late_s` (s).
pub fn pushed(
    campaign: &Campaign,
    trial: u64,
    impulse_n_s: f64,
    heading_deg: f64,
    late_s: f64,
) -> Disturbance {
    let mut disturbance = trial::disturbance(campaign, trial);
    for push in &mut disturbance.pushes {
        push.start_s += late_s;
    }
    if let Some(push) = disturbance.pushes.first_mut() {
        (push.impulse_n_s, push.heading_deg) = (impulse_n_s, heading_deg);
    }
    disturbance
}

impl MapPoint {
    /// What happened to the robot at this point.
    pub fn disturbance(&self, campaign: &Campaign, heading_deg: f64) -> Disturbance {
        let late_s = self.start_s - trial::push(campaign, self.trial).start_s;
        pushed(campaign, self.trial, self.impulse_n_s, heading_deg, late_s)
    }
}

/// Number `k` of a sequence of pairs, from 0 to 1 and from -1 to 1, whose first pairs, however many, lie evenly: multiples
/// of the inverse powers of the plastic number. Pair 0 is (0, 0).
fn spread_evenly(k: u64) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let [first, second] = STEPS.map(|step| k as f64 * step);
    [first.fract(), 2.0 * (second + 0.5).fract() - 1.0]
}

fn turn(heading_deg: f64, by_deg: f64) -> f64 {
    (heading_deg + by_deg).rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::campaign;

    #[test]
    fn random_is_what_lets_two_trials_differ_and_nothing_else() {
        assert!(!is_random(&campaign("nominal", &[])) && is_random(&campaign("standard", &[])));
        for (set, random) in [
            (vec!["sensors.noise_scale=0.1"], true),
            (vec!["sensors.bias_scale=0.1"], true),
            (vec!["push.height_m={uniform=[0, 0.1]}"], true),
            (vec!["push.height_m=0.1", "push.duration_s=0.1"], false),
            (vec!["variations.mass_scale={uniform=[0.9, 1.1]}"], true),
            (
                vec![
                    "variations.mass_scale={normal=[1.1, 0]}",
                    "variations.friction=0.5",
                ],
                false,
            ),
            (vec!["variations.delay_s={normal=[0.004, 0.001]}"], true),
            // The heading of a slope is drawn unless it is given.
            (vec!["push.start_s=1", "variations.slope_deg=1"], true),
            (
                vec![
                    "push.start_s=1",
                    "variations.slope_deg=1",
                    "variations.slope_heading_deg=30",
                ],
                false,
            ),
            (vec!["variations.slope_deg=0"], false),
            (vec!["second_push.impulse_n_s=1"], false),
            (
                vec!["second_push={impulse_n_s=1, after_s={uniform=[0.1, 1]}}"],
                true,
            ),
            (
                vec!["second_push={impulse_n_s=0, after_s={uniform=[0.1, 1]}}"],
                false,
            ),
        ] {
            let campaign = campaign("nominal", &set);
            assert_eq!(is_random(&campaign), random, "{set:?}");
            // `random` must agree with whether the drawn trials differ (apart from noise, which is not compared).
            let trials: Vec<_> = (0..20)
                .map(|i| {
                    let mut pushes = trial::pushes(&campaign, i);
                    (pushes[0].impulse_n_s, pushes[0].heading_deg) = (1.0, 0.0);
                    (pushes, trial::variation(&campaign, i))
                })
                .collect();
            let noisy = set[0].starts_with("sensors");
            assert!(
                noisy || trials.iter().any(|trial| *trial != trials[0]) == random,
                "{set:?}"
            );
        }
    }

    /// Of the first 100 pairs, each cell of a grid of 5 by 5 has 4, give or take 2.
    #[test]
    fn starts_and_headings_lie_evenly_and_begin_with_the_heading_of_the_search() {
        assert_eq!(spread_evenly(0), [0.0, 0.0]);
        let mut cells = [0; 25];
        for [late, turned] in (0..100).map(spread_evenly) {
            let place = |share: f64| (5.0 * share) as usize;
            cells[5 * place(late) + place(0.5 * (turned + 1.0))] += 1;
        }
        assert!(cells.iter().all(|n| (2..=6).contains(n)), "{cells:?}");
        assert_eq!([turn(350.0, 11.25), turn(0.0, -11.25)], [1.25, 348.75]);
    }
}
