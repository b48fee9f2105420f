//! The search, independent of what candidates are: generations of candidates around a middle, each a
//! [race](super::race) on fresh trials.
//!
//! Outcomes are random, and a generation has too few trials to rank its candidates. So nothing is concluded from one
//! generation alone: after each, a quadratic is fitted to all candidates so far ([`Response`]). The best point of the
//! fit is the next middle (the response surfaces of Box and Wilson 1951). The fit also sets the spread of the
//! candidates: they shall be a little worse than their middle, since nearer ones teach nothing and farther ones only
//! fall. The search proposes the average of its last middles. The incumbent and the middle run in every generation, so
//! the advantage of the middle is measured on trials that did not choose it.

use super::race::{CandidateScore, EpisodeScore, Race, WeightedTrial};
use super::response::{Effect, EvaluatedCandidate, Response};
use crate::ask::trial;
use crate::batch::Batch;
use serde::{Deserialize, Serialize};
use standfast_controllers::tunable::Tunable;
use standfast_core::error::{Error, Result};

/// Where candidates compete.
pub trait Arena: Sync {
    /// A candidate that is ready to run.
    type Entrant: Send + Sync;

    /// The candidate with these values. Fails if there can be none.
    fn enter(&self, values: &[f64]) -> Result<Self::Entrant>;

    /// Draws `count` trials of a generation for each case.
    fn draw(&self, generation: u64, count: usize) -> Vec<Vec<WeightedTrial>>;

    /// The tallies of these candidates in a trial of a case. Fails if a trial ends without an outcome.
    fn judge(
        &self,
        case: usize,
        trial: u64,
        entrants: &[&Self::Entrant],
    ) -> Result<Vec<EpisodeScore>>;
}

/// First spread of the samples: root of the sum of the squared spreads of all numbers, each as a share of its range.
const DISTANCE: f64 = 0.4;
/// Mean loss of the samples at which the spread aims, as a share of the trials; smallest and largest factor by which
/// the spread changes after a generation; and the largest spread, as a share of a range.
const LOSS: f64 = 0.06;
const NARROWER: f64 = 0.6;
const WIDER: f64 = 1.25;
const WIDEST: f64 = 0.3;
/// Cost, as a share of the trials, of one more footstep in each trial, and of more torque by one torque limit. It is
/// small, so that it decides only where rates hardly differ.
const EFFORT: f64 = 0.01;
/// Least variance of a trial's outcome in the fit. Candidates that did not differ in their trials may still differ.
const LEAST_VARIANCE: f64 = 0.01;
/// Smallest and largest number of trials of a generation. Trials are what several machines share.
const TRIALS: [usize; 2] = [32, 256];
/// Number of generations at which the number of trials aims, and the smallest number of generations of a useful search.
const GENERATIONS: usize = 40;
const LEAST_GENERATIONS: usize = 8;
/// Number of candidates in a generation that are not samples: the incumbent and the middle.
const GUEST_COUNT: usize = 2;
/// Largest number of draws for one sample, until its values are accepted as a candidate.
const ATTEMPTS: u64 = 100;
/// Share of the generations whose middles are averaged for the proposal.
const AVERAGED_SHARE: f64 = 1.0 / 3.0;

/// A generation, as it is written down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    pub number: u64,
    /// Number of trials of each case.
    pub trials: usize,
    /// The incumbent, the middle, and the samples.
    pub candidates: Vec<ScoredCandidate>,
    /// The numbers of the samples, the best one first.
    pub order: Vec<usize>,
    pub episodes: u64,
}

/// The values of a candidate and its result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScoredCandidate {
    /// The values, in the order of the tunable numbers.
    pub values: Vec<f64>,
    #[serde(flatten)]
    pub standing: CandidateScore,
}

impl Generation {
    /// The reason, in words, why this cannot be generation `number` of a search of `tunables` numbers on `cases` cases,
    /// with `trials` trials in each case. It is None if it can.
    pub fn problem(
        &self,
        number: u64,
        trials: usize,
        tunables: usize,
        cases: usize,
    ) -> Option<&'static str> {
        let count = samples_of(tunables) + GUEST_COUNT;
        let has_values = |candidate: &ScoredCandidate| {
            candidate.values.len() == tunables
                && candidate.values.iter().all(|value| value.is_finite())
        };
        let can_be = |(i, candidate): (usize, &ScoredCandidate)| {
            let CandidateScore {
                advantage,
                error,
                footsteps,
                torque,
                trials: own,
            } = candidate.standing;
            let are_shares = (-1.0..=1.0).contains(&advantage) && (0.0..=1.0).contains(&error);
            let are_means = [footsteps, torque]
                .iter()
                .all(|mean| mean.is_finite() && *mean >= 0.0);
            are_shares
                && are_means
                && (1..=trials).contains(&own)
                && (own == trials || i >= GUEST_COUNT)
        };
        let mut order = self.order.clone();
        order.sort_unstable();
        // A candidate has the same number of trials in all cases.
        let episodes = || {
            cases
                * self
                    .candidates
                    .iter()
                    .map(|candidate| candidate.standing.trials)
                    .sum::<usize>()
        };
        match () {
            () if self.number != number => Some("`number` is not that of its name"),
            () if self.trials != trials => Some("`trials` are not those that the budget allows"),
            () if self.candidates.len() != count => {
                Some("`candidates` are not as many as there are in a generation")
            }
            () if !self.candidates.iter().all(has_values) => {
                Some("`values` are not a finite number for each key")
            }
            () if !self.candidates.iter().enumerate().all(can_be) => {
                Some("a candidate cannot have done so")
            }
            () if !order.into_iter().eq(GUEST_COUNT..count) => {
                Some("`order` does not name each sample once")
            }
            () if self.episodes != episodes() as u64 => {
                Some("`episodes` are not those of its candidates")
            }
            () => None,
        }
    }
}

/// Number of trials of a generation, for a search of `tunables` numbers on `cases` cases with a budget of `episodes`.
pub fn trials_of(tunables: usize, cases: usize, episodes: u64) -> usize {
    let trials = episodes as usize / (GENERATIONS * episodes_a_trial(tunables, cases));
    trials.clamp(TRIALS[0], TRIALS[1])
}

/// Number of samples of a generation, for a search of `tunables` numbers. It is the usual population size of CMA-ES.
fn samples_of(tunables: usize) -> usize {
    4 + (3.0 * (tunables as f64).ln()) as usize
}

/// Largest number of episodes of a generation for each of its trials.
fn episodes_a_trial(tunables: usize, cases: usize) -> usize {
    (samples_of(tunables) + GUEST_COUNT) * cases
}

/// Smallest number of episodes of a useful search.
pub fn least_episodes(tunables: usize, cases: usize) -> u64 {
    (LEAST_GENERATIONS * TRIALS[0] * episodes_a_trial(tunables, cases)) as u64
}

/// The state of a search.
pub struct TuneSearch<'a, A: Arena> {
    arena: &'a A,
    tunables: &'a [Tunable],
    seed: u64,
    cases: usize,
    /// Number of trials of a generation, for each case.
    trials: usize,
    start: Vec<f64>,
    /// The middles of all generations so far and of the next one, and the spread of the next one, as shares of the
    /// ranges.
    middles: Vec<Vec<f64>>,
    spread: f64,
    tried: Vec<Vec<EvaluatedCandidate>>,
    response: Option<Response>,
}

impl<'a, A: Arena> TuneSearch<'a, A> {
    /// A search on `cases` cases with a budget of `episodes`.
    pub fn new(
        arena: &'a A,
        tunables: &'a [Tunable],
        seed: u64,
        cases: usize,
        episodes: u64,
    ) -> Self {
        let trials = trials_of(tunables.len(), cases, episodes);
        let start: Vec<f64> = tunables
            .iter()
            .map(|tunable| tunable.share_of(tunable.now))
            .collect();
        let spread = (DISTANCE / (tunables.len() as f64).sqrt()).min(WIDEST);
        Self {
            arena,
            tunables,
            seed,
            cases,
            trials,
            middles: vec![start.clone()],
            start,
            spread,
            tried: Vec::new(),
            response: None,
        }
    }

    /// Largest number of episodes of the next generation.
    pub fn next_episodes(&self) -> u64 {
        (self.trials * episodes_a_trial(self.tunables.len(), self.cases)) as u64
    }

    /// The spread of the next samples, as a share of the ranges.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    fn values(&self, shares: &[f64]) -> Vec<f64> {
        self.tunables
            .iter()
            .zip(shares)
            .map(|(tunable, share)| tunable.at(*share))
            .collect()
    }

    fn shares(&self, values: &[f64]) -> Vec<f64> {
        self.tunables
            .iter()
            .zip(values)
            .map(|(tunable, value)| tunable.share_of(*value))
            .collect()
    }

    /// Runs the next generation. Fails as [`Batch::gather`] does, or if no sample can be a candidate.
    pub fn generation(&mut self, batch: Batch) -> Result<Generation> {
        let number = self.tried.len() as u64 + 1;
        let now: Vec<f64> = self.tunables.iter().map(|tunable| tunable.now).collect();
        let middle = self.values(&self.middles[self.middles.len() - 1]);
        let incumbent = (now.clone(), self.arena.enter(&now)?);
        let middle = match self.arena.enter(&middle) {
            Ok(entrant) => (middle, entrant),
            Err(error) => {
                error.refusal()?;
                (now.clone(), self.arena.enter(&now)?)
            }
        };
        let (mut values, mut entrants): (Vec<_>, Vec<_>) = [incumbent, middle].into_iter().unzip();
        for slot in 0..samples_of(self.tunables.len()) as u64 {
            let (of_sample, entrant) = self.sample(number, slot)?;
            values.push(of_sample);
            entrants.push(entrant);
        }
        let cases = self.arena.draw(number, self.trials);
        let race = Race {
            candidates: values.len(),
            guests: GUEST_COUNT,
            cases: &cases,
            judge: &|case, trial, active| {
                let entrants: Vec<&A::Entrant> = active.iter().map(|&i| &entrants[i]).collect();
                self.arena.judge(case, trial, &entrants)
            },
            batch,
            name: format!("generation-{number:03}"),
        };
        let raced = race.run()?;
        let mut candidates = Vec::new();
        for (values, standing) in values.into_iter().zip(raced.standings) {
            candidates.push(ScoredCandidate { values, standing });
        }
        let generation = Generation {
            number,
            trials: self.trials,
            candidates,
            order: raced.order,
            episodes: raced.episodes,
        };
        self.follow(&generation);
        Ok(generation)
    }

    /// Draws sample number `slot` of a generation again and again, until its values are accepted as a candidate.
    fn sample(&self, generation: u64, slot: u64) -> Result<(Vec<f64>, A::Entrant)> {
        let mut refused = None;
        for attempt in 0..ATTEMPTS {
            let normal = trial::normals(
                self.seed,
                generation,
                slot * ATTEMPTS + attempt,
                self.tunables.len(),
            );
            let middle = &self.middles[self.middles.len() - 1];
            let shares: Vec<f64> = middle
                .iter()
                .zip(&normal)
                .map(|(x, z)| mirrored(x + self.spread * z))
                .collect();
            let values = self.values(&shares);
            match self.arena.enter(&values) {
                Ok(entrant) => return Ok((values, entrant)),
                Err(error) => refused = Some(error.refusal()?),
            }
        }
        let refused = refused.map_or(String::new(), |error| error.to_string());
        Err(Error::Numeric {
            what: "tune".into(),
            problem: format!("no values within the ranges can be used, such as these: {refused}"),
        })
    }

    /// Updates the state by a generation, which was run now or earlier.
    pub fn follow(&mut self, generation: &Generation) {
        let incumbent = &generation.candidates[0].standing;
        // All candidates get the same error of a trial, because the error of a single candidate may be small by chance.
        // Half of the variance of a difference comes from the incumbent.
        let others = &generation.candidates[1..];
        let variance = others
            .iter()
            .map(|other| 0.5 * other.standing.error.powi(2) * other.standing.trials as f64)
            .sum::<f64>()
            / others.len() as f64;
        let mut tried = Vec::new();
        for candidate in &generation.candidates {
            let standing = &candidate.standing;
            let effort =
                standing.footsteps - incumbent.footsteps + standing.torque - incumbent.torque;
            tried.push(EvaluatedCandidate {
                shares: self.shares(&candidate.values),
                rate: standing.advantage - EFFORT * effort,
                error: (variance.max(LEAST_VARIANCE) / standing.trials as f64).sqrt(),
            });
        }
        self.tried.push(tried);
        self.response = Response::fit(&self.start, &self.tried);
        let Some(response) = &self.response else {
            return;
        };
        self.middles.push(response.best());
        let factor = (LOSS / response.loss(self.spread).max(f64::MIN_POSITIVE)).sqrt();
        self.spread = (self.spread * factor.clamp(NARROWER, WIDER)).min(WIDEST);
    }

    /// The values that the search proposes: the average of the last middles or, if the average cannot be a candidate,
    /// the last middle that can. The first middle is the incumbent. Fails if the machine or a user ends the work.
    pub fn proposed(&self) -> Result<Vec<f64>> {
        let count = (((self.middles.len() - 1) as f64 * AVERAGED_SHARE).ceil() as usize).max(1);
        let last = &self.middles[self.middles.len() - count..];
        let average: Vec<f64> = (0..self.tunables.len())
            .map(|i| last.iter().map(|middle| middle[i]).sum::<f64>() / count as f64)
            .collect();
        for shares in std::iter::once(&average).chain(self.middles.iter().rev()) {
            let values = self.values(shares);
            match self.arena.enter(&values) {
                Ok(_) => return Ok(values),
                Err(error) => _ = error.refusal()?,
            }
        }
        Ok(self.tunables.iter().map(|tunable| tunable.now).collect())
    }

    /// The fitted effect of each number, and the gain by its value in `values`.
    pub fn effects(&self, values: &[f64]) -> Vec<Effect> {
        let shares = self.shares(values);
        match &self.response {
            Some(response) => (0..shares.len())
                .map(|i| response.effect(i, shares[i]))
                .collect(),
            None => vec![Effect::default(); shares.len()],
        }
    }
}

/// A share of a range; what is outside of the range is mirrored into it.
fn mirrored(share: f64) -> f64 {
    let share = share.rem_euclid(2.0);
    if share > 1.0 { 2.0 - share } else { share }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::tests::quiet;
    use standfast_stats::mcnemar::PairedCounts;
    use std::hash::{DefaultHasher, Hasher};
    use std::path::Path;

    fn alone() -> Batch<'static> {
        quiet(Path::new("."), None)
    }

    /// Trials that are won with a chance that depends on the values.
    struct Landscape {
        seed: u64,
        chance: fn(&[f64]) -> f64,
    }

    impl Landscape {
        /// Half of a trial's random number comes from the trial, so all candidates share it.
        fn is_won(&self, values: &[f64], trial: u64) -> bool {
            let mut own = DefaultHasher::new();
            for value in values {
                own.write_u64(value.to_bits() ^ trial.rotate_left(20));
            }
            let luck = 0.5
                * (trial::share(self.seed, trial) + trial::share(self.seed + 1, own.finish() >> 8));
            luck < (self.chance)(values)
        }
    }

    impl Arena for Landscape {
        type Entrant = Vec<f64>;

        fn enter(&self, values: &[f64]) -> Result<Vec<f64>> {
            Ok(values.to_vec())
        }

        fn draw(&self, generation: u64, count: usize) -> Vec<Vec<WeightedTrial>> {
            vec![
                (0..count as u64)
                    .map(|i| WeightedTrial {
                        trial: generation << 32 | i,
                        weight: 1.0,
                    })
                    .collect(),
            ]
        }

        fn judge(
            &self,
            _case: usize,
            trial: u64,
            entrants: &[&Vec<f64>],
        ) -> Result<Vec<EpisodeScore>> {
            let scores = entrants.iter().map(|values| EpisodeScore {
                won: self.is_won(values, trial),
                ..EpisodeScore::default()
            });
            Ok(scores.collect())
        }
    }

    fn tunables(now: f64) -> Vec<Tunable> {
        (0..4)
            .map(|i| Tunable::new(format!("k{i}"), now, [0.0, 1.0]))
            .collect()
    }

    /// Searches with a budget, and judges what is proposed by sealed trials.
    fn sealed(
        landscape: &Landscape,
        tunables: &[Tunable],
        episodes: u64,
        trials: u64,
    ) -> (Vec<f64>, PairedCounts) {
        let mut search = TuneSearch::new(landscape, tunables, landscape.seed, 1, episodes);
        let mut spent = 0;
        while spent + search.next_episodes() <= episodes {
            spent += search.generation(alone()).unwrap().episodes;
        }
        let proposed = search.proposed().unwrap();
        let now: Vec<f64> = tunables.iter().map(|tunable| tunable.now).collect();
        let mut counts = PairedCounts::default();
        for i in 0..trials {
            let trial = u64::MAX / 512 - i;
            counts.add(
                landscape.is_won(&proposed, trial),
                landscape.is_won(&now, trial),
            );
        }
        (proposed, counts)
    }

    /// If no tuned number matters, a winner is claimed in at most 5 % of searches.
    #[test]
    #[ignore = "searches many times, half a minute"]
    fn noise_has_no_winner() {
        let claims = (0..1000).filter(|&seed| {
            let landscape = Landscape {
                seed: 2 * seed,
                chance: |_| 0.5,
            };
            let (_, counts) = sealed(&landscape, &tunables(0.5), 2500, 400);
            counts.difference() > 0.0 && counts.mcnemar_p() < 0.05
        });
        let claims = claims.count();
        assert!(claims <= 50, "{claims} of 1000");
    }

    /// If the tuned numbers matter, the search finds better ones, and the sealed trials show it.
    #[test]
    fn a_hill_is_climbed() {
        let hill = |values: &[f64]| {
            0.6 - values
                .iter()
                .map(|x| (x - 0.7).powi(2))
                .sum::<f64>()
                .min(0.5)
        };
        for seed in 0..10 {
            let landscape = Landscape {
                seed: 2 * seed,
                chance: hill,
            };
            let (proposed, counts) = sealed(&landscape, &tunables(0.4), 12_000, 1000);
            assert!(
                counts.difference() > 0.1 && counts.mcnemar_p() < 1e-6,
                "{proposed:?}: {counts:?}"
            );
            assert!(hill(&proposed) > 0.58, "{proposed:?}");
        }
    }

    /// A search that continues from its written generations is the same search.
    #[test]
    fn a_search_goes_on_where_it_stopped() {
        let landscape = Landscape {
            seed: 6,
            chance: |values| 0.4 + 0.2 * values[0],
        };
        let tunables = tunables(0.5);
        let mut whole = TuneSearch::new(&landscape, &tunables, 6, 1, 4000);
        let generations: Vec<Generation> =
            (0..4).map(|_| whole.generation(alone()).unwrap()).collect();
        let mut again = TuneSearch::new(&landscape, &tunables, 6, 1, 4000);
        let written = serde_json::to_string(&generations[..2]).unwrap();
        let read: Vec<Generation> = serde_json::from_str(&written).unwrap();
        for generation in &read {
            again.follow(generation);
        }
        assert_eq!(
            [
                again.generation(alone()).unwrap(),
                again.generation(alone()).unwrap()
            ],
            generations[2..]
        );
        assert_eq!(again.proposed().unwrap(), whole.proposed().unwrap());
    }

    /// Each case makes a single change to a valid generation.
    #[test]
    fn a_generation_that_no_search_can_have_written_is_told() {
        let landscape = Landscape {
            seed: 6,
            chance: |values| 0.4 + 0.2 * values[0],
        };
        let tunables = tunables(0.5);
        let written = TuneSearch::new(&landscape, &tunables, 6, 1, 4000)
            .generation(alone())
            .unwrap();
        let told = |change: &dyn Fn(&mut Generation)| {
            let mut changed = written.clone();
            change(&mut changed);
            changed
                .problem(1, trials_of(4, 1, 4000), 4, 1)
                .unwrap_or("nothing")
        };
        assert_eq!(told(&|_| {}), "nothing");
        type GenerationChange<'a> = (&'static str, &'a dyn Fn(&mut Generation));
        let changes: [GenerationChange; 16] = [
            ("`number`", &|g| g.number = 2),
            ("`trials`", &|g| g.trials = 31),
            ("`candidates`", &|g| g.candidates.clear()),
            ("`candidates`", &|g| g.candidates.truncate(1)),
            ("`candidates`", &|g| {
                g.candidates.push(g.candidates[0].clone())
            }),
            ("`values`", &|g| g.candidates[3].values.clear()),
            ("`values`", &|g| g.candidates[3].values[1] = f64::NAN),
            ("a candidate", &|g| {
                g.candidates[3].standing.advantage = 1e300
            }),
            ("a candidate", &|g| {
                g.candidates[3].standing.error = f64::NAN
            }),
            ("a candidate", &|g| {
                g.candidates[3].standing.torque = f64::INFINITY
            }),
            ("a candidate", &|g| g.candidates[3].standing.trials = 0),
            ("a candidate", &|g| g.candidates[1].standing.trials -= 1),
            ("`order`", &|g| g.order[0] = 99),
            ("`order`", &|g| g.order[0] = g.order[1]),
            ("`order`", &|g| g.order.clear()),
            ("`episodes`", &|g| g.episodes = 0),
        ];
        for (expected, change) in changes {
            let told = told(change);
            assert!(told.starts_with(expected), "{expected}: {told}");
        }
    }

    #[test]
    fn samples_stay_within_their_ranges() {
        assert_eq!(
            [-0.25, 1.25, 2.5, 0.5].map(mirrored),
            [0.25, 0.75, 0.5, 0.5]
        );
        let landscape = Landscape {
            seed: 2,
            chance: |_| 0.5,
        };
        let tunables = tunables(1.0);
        let generation = TuneSearch::new(&landscape, &tunables, 2, 1, 4000)
            .generation(alone())
            .unwrap();
        let mut values = generation.candidates.iter().flat_map(|c| &c.values);
        assert!(
            values.all(|value| (0.0..=1.0).contains(value)),
            "{generation:?}"
        );
    }
}
