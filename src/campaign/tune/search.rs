//! The search, whatever candidates are and wherever they compete: generations of candidates around a mean that moves to
//! where the better ones are ([`Cma`]), each a [race](super::race) on fresh trials.
//!
//! Outcomes are random, so ranks may be wrong. Where the candidates of a generation differ no more than by chance, the next
//! one gets more trials, and fewer where they differ clearly. All generations together tell what a single one does not: a
//! quadratic is fitted to everything that was tried ([`Response`]). It sets how far the samples spread, which are to be a little
//! worse than their mean: if they are nearer they teach nothing, and if they are farther away they only fall. What the search
//! proposes is halfway between the best of that quadratic and the average of the last means, since both are less at the
//! mercy of chance than any candidate. The incumbent and the mean run in every generation, so how much the mean is better is
//! told by trials that did not choose it.

use super::race::{Drawn, Race, Standing, Tally};
use super::response::{Response, Tried};
use super::team::Team;
use crate::campaign::ask::trial;
use crate::campaign::cma::Cma;
use crate::contest::tunable::Tunable;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Where candidates compete.
pub trait Arena: Sync {
    /// A candidate that is ready to run.
    type Entrant: Send + Sync;

    /// The candidate with these values. Fails if there can be none.
    fn enter(&self, values: &[f64]) -> Result<Self::Entrant>;

    /// So many trials of a generation, for each case.
    fn draw(&self, generation: u64, count: usize) -> Vec<Vec<Drawn>>;

    /// What happens in a trial of a case to each of these candidates.
    fn judge(&self, case: usize, trial: u64, entrants: &[&Self::Entrant]) -> Vec<Tally>;
}

/// How far samples are from the first mean, as a share of the ranges: the root of the sum over all numbers.
const DISTANCE: f64 = 0.4;
/// By how much samples are to be worse than their mean, as a share of the trials; how fast their spread follows that; and the
/// widest spread, as a share of a range.
const LOSS: f64 = 0.06;
const NARROWER: f64 = 0.6;
const WIDER: f64 = 1.25;
const WIDEST: f64 = 0.3;
/// Trials of a generation: at first, at least and at most.
const TRIALS: [usize; 3] = [48, 32, 256];
/// By what factor they change, and the [signals](super::race::Raced::signal) below and above which they do.
const MORE: f64 = 1.25;
const SIGNAL: [f64; 2] = [1.25, 3.0];
/// The candidates that are no samples: the incumbent and the mean.
const GUESTS: usize = 2;
/// How often a sample is drawn again that can be no candidate.
const ATTEMPTS: u64 = 100;
/// The share of the generations whose means are averaged in the end.
const LAST: f64 = 1.0 / 3.0;
/// Fewest generations of which anything is to be expected.
const LEAST_GENERATIONS: u64 = 6;

/// A generation, as it is written down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    pub number: u64,
    /// Trials of each case.
    pub trials: usize,
    /// The incumbent, the mean, and the samples.
    pub candidates: Vec<Candidate>,
    /// The numbers of the samples, the best one first.
    pub order: Vec<usize>,
    pub signal: f64,
    pub episodes: u64,
}

/// A candidate and how it did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// In the order of the tunable numbers.
    pub values: Vec<f64>,
    #[serde(flatten)]
    pub standing: Standing,
}

/// Fewest episodes of a search of which anything is to be expected.
pub fn least_episodes(tunables: usize, cases: usize) -> u64 {
    LEAST_GENERATIONS * ((Cma::samples_of(tunables) + GUESTS) * TRIALS[0] * cases) as u64
}

/// A search on its way.
pub struct Search<'a, A: Arena> {
    arena: &'a A,
    tunables: &'a [Tunable],
    seed: u64,
    cases: usize,
    start: Vec<f64>,
    cma: Cma,
    means: Vec<Vec<f64>>,
    tried: Vec<Tried>,
    response: Option<Response>,
    trials: usize,
}

impl<'a, A: Arena> Search<'a, A> {
    pub fn new(arena: &'a A, tunables: &'a [Tunable], seed: u64, cases: usize) -> Self {
        let start: Vec<f64> = tunables.iter().map(|tunable| tunable.share_of(tunable.now)).collect();
        let count = tunables.len();
        let first_step = (DISTANCE / (count as f64).sqrt()).min(WIDEST);
        let cma = Cma::new(&start, first_step, Cma::samples_of(count));
        let (means, tried, response, trials) = (Vec::new(), Vec::new(), None, TRIALS[0]);
        Self { arena, tunables, seed, cases, start, cma, means, tried, response, trials }
    }

    /// Most episodes of the next generation.
    pub fn next_episodes(&self) -> u64 {
        ((Cma::samples_of(self.tunables.len()) + GUESTS) * self.trials * self.cases) as u64
    }

    /// The spread of the samples, as a share of the ranges on average.
    pub fn spread(&self) -> f64 {
        self.cma.spread().iter().sum::<f64>() / self.tunables.len() as f64
    }

    fn values(&self, shares: &[f64]) -> Vec<f64> {
        self.tunables.iter().zip(shares).map(|(tunable, share)| tunable.at(*share)).collect()
    }

    fn shares(&self, values: &[f64]) -> Vec<f64> {
        self.tunables.iter().zip(values).map(|(tunable, value)| tunable.share_of(*value)).collect()
    }

    /// Runs the next generation. Fails as [`Team::gather`] does, or if no sample can be a candidate.
    pub fn generation(&mut self, team: Team) -> Result<Generation> {
        let number = self.means.len() as u64 + 1;
        let now: Vec<f64> = self.tunables.iter().map(|tunable| tunable.now).collect();
        let mean = self.values(self.cma.mean());
        let incumbent = (now.clone(), self.arena.enter(&now)?);
        let mean = match self.arena.enter(&mean) {
            Ok(entrant) => (mean, entrant),
            Err(_) => (now.clone(), self.arena.enter(&now)?),
        };
        let samples = (0..Cma::samples_of(self.tunables.len()) as u64).map(|slot| self.sample(number, slot));
        let samples = samples.collect::<Result<Vec<_>>>()?;
        let (values, entrants): (Vec<_>, Vec<_>) = [incumbent, mean].into_iter().chain(samples).unzip();
        let cases = self.arena.draw(number, self.trials);
        let judge = |case: usize, trial: u64, active: &[usize]| {
            let entrants: Vec<&A::Entrant> = active.iter().map(|&i| &entrants[i]).collect();
            self.arena.judge(case, trial, &entrants)
        };
        let (candidates, name) = (values.len(), format!("generation-{number:03}"));
        let race = Race { candidates, guests: GUESTS, cases: &cases, judge: &judge, team, name };
        let raced = race.run()?;
        let candidates = values.into_iter().zip(raced.standings);
        let generation = Generation {
            number,
            trials: self.trials,
            candidates: candidates.map(|(values, standing)| Candidate { values, standing }).collect(),
            order: raced.order,
            signal: raced.signal,
            episodes: raced.episodes,
        };
        self.follow(&generation);
        Ok(generation)
    }

    /// The first of the samples for a place in a generation that can be a candidate.
    fn sample(&self, generation: u64, slot: u64) -> Result<(Vec<f64>, A::Entrant)> {
        let mut refused = None;
        for attempt in 0..ATTEMPTS {
            let normal = trial::normals(self.seed, generation, slot * ATTEMPTS + attempt, self.tunables.len());
            let shares: Vec<f64> = self.cma.sample(&normal).into_iter().map(mirrored).collect();
            let values = self.values(&shares);
            match self.arena.enter(&values) {
                Ok(entrant) => return Ok((values, entrant)),
                Err(error) => refused = Some(error),
            }
        }
        let (what, problem) = ("tune".into(), "no values within the ranges can be used, such as these: ".to_string());
        Err(Error::Numeric { what, problem: problem + &refused.map_or(String::new(), |error| error.to_string()) })
    }

    /// Moves on after a generation, which was run now or earlier.
    pub fn follow(&mut self, generation: &Generation) {
        let shares = |candidate: &Candidate| self.shares(&candidate.values);
        let ranked: Vec<Vec<f64>> = generation.order.iter().map(|i| shares(&generation.candidates[*i])).collect();
        let tried = generation.candidates.iter().skip(1).map(|candidate| {
            let Standing { advantage, error, trials, .. } = candidate.standing;
            // That nothing differed in so many trials is no proof that nothing does.
            Tried { shares: shares(candidate), advantage, error: error.max(1.0 / trials as f64) }
        });
        self.tried.extend(tried.collect::<Vec<_>>());
        let step = self.cma.step();
        self.cma.tell(&ranked.iter().map(Vec::as_slice).collect::<Vec<_>>());
        self.means.push(self.cma.mean().to_vec());
        self.cma.set_step(step);
        self.response = Response::fit(&self.start, &self.tried);
        let loss = self.response.as_ref().map_or(LOSS, |response| response.loss(&self.cma.spread()));
        let factor = (LOSS / loss.max(f64::MIN_POSITIVE)).sqrt().clamp(NARROWER, WIDER);
        self.cma.set_step((step * factor).min(WIDEST));
        let [_, least, most] = TRIALS;
        let trials = match generation.signal {
            signal if signal < SIGNAL[0] => (self.trials as f64 * MORE) as usize,
            signal if signal > SIGNAL[1] => (self.trials as f64 / MORE) as usize,
            _ => self.trials,
        };
        self.trials = trials.clamp(least, most);
    }

    /// What the search proposes: halfway between the average of the last means and the best of what is fitted or, if that can
    /// be no candidate, that average, or the last mean that can; without one the present values.
    pub fn proposed(&self) -> Vec<f64> {
        let count = ((self.means.len() as f64 * LAST).ceil() as usize).max(1);
        let last = &self.means[self.means.len().saturating_sub(count)..];
        let sum = |i: usize| last.iter().map(|mean| mean[i]).sum::<f64>();
        let average = (!last.is_empty())
            .then(|| (0..self.tunables.len()).map(|i| sum(i) / last.len() as f64).collect::<Vec<f64>>());
        let halfway = average.iter().zip(&self.response).map(|(average, response)| {
            average.iter().zip(response.best()).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<f64>>()
        });
        let choices = halfway.chain(average.clone()).chain(self.means.iter().rev().cloned());
        let mut values = choices.map(|shares| self.values(&shares));
        let now = || self.tunables.iter().map(|tunable| tunable.now).collect();
        values.find(|values| self.arena.enter(values).is_ok()).unwrap_or_else(now)
    }

    /// By how much each of these values alone is better than the present one, with the standard error.
    pub fn worth(&self, values: &[f64]) -> Vec<[f64; 2]> {
        let response = Response::fit(&self.start, &self.tried);
        let worth =
            |(i, share): (usize, &f64)| response.as_ref().map_or([0.0; 2], |response| response.worth(i, *share));
        self.shares(values).iter().enumerate().map(worth).collect()
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
    use crate::stats::mcnemar::PairedCounts;
    use std::hash::{DefaultHasher, Hasher};
    use std::path::Path;
    use std::sync::atomic::AtomicBool;

    static GO_ON: AtomicBool = AtomicBool::new(false);
    fn alone() -> Team<'static> {
        Team { shard: None, folder: Path::new("."), stop: &GO_ON, on_wait: &|_| {} }
    }

    /// Trials that are won with a chance that depends on the values.
    struct Landscape {
        seed: u64,
        chance: fn(&[f64]) -> f64,
    }

    impl Landscape {
        /// Half of the luck is that of the trial, which all candidates share.
        fn is_won(&self, values: &[f64], trial: u64) -> bool {
            let mut own = DefaultHasher::new();
            values.iter().for_each(|value| own.write_u64(value.to_bits() ^ trial.rotate_left(20)));
            let luck = 0.5 * (trial::share(self.seed, trial) + trial::share(self.seed + 1, own.finish() >> 8));
            luck < (self.chance)(values)
        }
    }

    impl Arena for Landscape {
        type Entrant = Vec<f64>;

        fn enter(&self, values: &[f64]) -> Result<Vec<f64>> {
            Ok(values.to_vec())
        }

        fn draw(&self, generation: u64, count: usize) -> Vec<Vec<Drawn>> {
            vec![(0..count as u64).map(|i| Drawn { trial: generation << 32 | i, weight: 1.0 }).collect()]
        }

        fn judge(&self, _case: usize, trial: u64, entrants: &[&Vec<f64>]) -> Vec<Tally> {
            entrants.iter().map(|values| Tally { won: self.is_won(values, trial), ..Tally::default() }).collect()
        }
    }

    fn tunables(now: f64) -> Vec<Tunable> {
        (0..4).map(|i| Tunable::new(format!("k{i}"), now, [0.0, 1.0])).collect()
    }

    /// Searches with a budget, and judges what is proposed by sealed trials.
    fn sealed(landscape: &Landscape, tunables: &[Tunable], episodes: u64, trials: u64) -> (Vec<f64>, PairedCounts) {
        let mut search = Search::new(landscape, tunables, landscape.seed, 1);
        let mut spent = 0;
        while spent + search.next_episodes() <= episodes {
            spent += search.generation(alone()).unwrap().episodes;
        }
        let (proposed, now) = (search.proposed(), tunables.iter().map(|t| t.now).collect::<Vec<_>>());
        let pair = |trial| (landscape.is_won(&proposed, trial), landscape.is_won(&now, trial));
        let counts = PairedCounts::of((0..trials).map(|i| pair(u64::MAX / 512 - i)));
        (proposed, counts)
    }

    /// Where nothing that is tuned matters, a winner is claimed in at most 5 % of searches.
    #[test]
    fn noise_has_no_winner() {
        let claims = (0..1000).filter(|&seed| {
            let landscape = Landscape { seed: 2 * seed, chance: |_| 0.5 };
            let (_, counts) = sealed(&landscape, &tunables(0.5), 2500, 400);
            counts.difference() > 0.0 && counts.mcnemar_p() < 0.05
        });
        let claims = claims.count();
        assert!(claims <= 50, "{claims} of 1000");
    }

    /// Where it matters, the search finds what is better, and the sealed trials say so.
    #[test]
    fn a_hill_is_climbed() {
        let hill = |values: &[f64]| 0.6 - values.iter().map(|x| (x - 0.7).powi(2)).sum::<f64>().min(0.5);
        for seed in 0..10 {
            let landscape = Landscape { seed: 2 * seed, chance: hill };
            let (proposed, counts) = sealed(&landscape, &tunables(0.4), 12_000, 1000);
            assert!(counts.difference() > 0.1 && counts.mcnemar_p() < 1e-6, "{proposed:?}: {counts:?}");
            assert!(hill(&proposed) > 0.57, "{proposed:?}");
        }
    }

    /// A search that goes on from what was written down is the same search.
    #[test]
    fn a_search_goes_on_where_it_stopped() {
        let landscape = Landscape { seed: 6, chance: |values| 0.4 + 0.2 * values[0] };
        let tunables = tunables(0.5);
        let mut whole = Search::new(&landscape, &tunables, 6, 1);
        let generations: Vec<Generation> = (0..4).map(|_| whole.generation(alone()).unwrap()).collect();
        let mut again = Search::new(&landscape, &tunables, 6, 1);
        let written = serde_json::to_string(&generations[..2]).unwrap();
        let read: Vec<Generation> = serde_json::from_str(&written).unwrap();
        read.iter().for_each(|generation| again.follow(generation));
        assert_eq!([again.generation(alone()).unwrap(), again.generation(alone()).unwrap()], generations[2..]);
        assert_eq!(again.proposed(), whole.proposed());
    }
    #[test]
    fn samples_stay_within_their_ranges() {
        assert_eq!([-0.25, 1.25, 2.5, 0.5].map(mirrored), [0.25, 0.75, 0.5, 0.5]);
        let (landscape, tunables) = (Landscape { seed: 2, chance: |_| 0.5 }, tunables(1.0));
        let generation = Search::new(&landscape, &tunables, 2, 1).generation(alone()).unwrap();
        let is_within = |candidate: &Candidate| candidate.values.iter().all(|value| (0.0..=1.0).contains(value));
        assert!(generation.candidates.iter().all(is_within), "{generation:?}");
    }
}
