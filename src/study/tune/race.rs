//! One generation: all candidates go through the same trials, and those that have certainly lost stop early.
//!
//! A trial counts by its weight, since trials are drawn more often where they are undecided ([`super::draw`]).
//! Candidates are compared by their advantage over the incumbent: the difference of the weighted rates or, with several
//! cases (robots, engines), the smallest of these differences. As in an F-race (Birattari et al. 2002), a candidate
//! stops early if its advantage is smaller than the leader's by more than `CERTAIN` standard errors. The standard error
//! follows from the trials on which the candidate and the leader differ: it is the root of the sum of their squared
//! weights, over the sum of all weights.

use crate::batch::Batch;
use serde::{Deserialize, Serialize};
use standfast_core::error::{Error, Result};
use std::cmp::Ordering;

/// Number of standard errors by which a candidate that stops must be behind the leader.
const CERTAIN: f64 = 2.0;
/// Least number of trials on which a candidate that stops and the leader must differ.
const LEAST_DIFFERENT: usize = 6;
/// The looks of a race, as shares of its trials.
const LOOKS: [f64; 3] = [0.25, 0.5, 1.0];

/// A trial of a race.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedTrial {
    pub trial: u64,
    /// The inverse of the chance with which it was drawn.
    pub weight: f64,
}

/// The result of an episode, as far as it counts in a race.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EpisodeScore {
    pub won: bool,
    pub footsteps: u64,
    /// Largest joint torque, as a share of the joint's torque limit.
    pub torque: f64,
}

/// The result of a candidate in a race.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateScore {
    /// Weighted rate of the candidate less the weighted rate of the incumbent, in the candidate's worst case; and the
    /// standard error of this difference.
    pub advantage: f64,
    pub error: f64,
    /// Means over the candidate's trials.
    pub footsteps: f64,
    pub torque: f64,
    /// Number of the candidate's trials in each case.
    pub trials: usize,
}

/// Runs the episodes of a case and trial with some candidates, given by their numbers in ascending order.
pub type TrialJudge<'a> = dyn Fn(usize, u64, &[usize]) -> Result<Vec<EpisodeScore>> + Sync + 'a;

/// The candidates and the trials of a race. The first candidates, of which the incumbent is number 0, run to the end.
pub struct Race<'a> {
    pub candidates: usize,
    pub guests: usize,
    /// The trials of each case. All cases have the same number of trials.
    pub cases: &'a [Vec<WeightedTrial>],
    pub judge: &'a TrialJudge<'a>,
    pub batch: Batch<'a>,
    /// The name of the race, which no other race of the search has.
    pub name: String,
}

/// The result of a race.
#[derive(Debug, Clone, PartialEq)]
pub struct Raced {
    pub standings: Vec<CandidateScore>,
    /// The candidates that are no guests, the best one first.
    pub order: Vec<usize>,
    pub episodes: u64,
}

impl Race<'_> {
    /// Runs the race. Fails as [`Batch::gather`] does.
    pub fn run(&self) -> Result<Raced> {
        let all = self.cases.iter().map(Vec::len).min().unwrap_or(0);
        let mut board = Board {
            cases: self.cases,
            tallies: vec![Vec::new(); self.cases.len()],
        };
        let mut active: Vec<usize> = (0..self.candidates).collect();
        let (mut stopped, mut episodes, mut from) = (Vec::new(), 0, 0);
        for (look, share) in LOOKS.into_iter().enumerate() {
            let to = ((all as f64 * share).ceil() as usize).min(all);
            let jobs: Vec<(usize, usize)> = (from..to)
                .flat_map(|i| (0..self.cases.len()).map(move |case| (case, i)))
                .collect();
            let name = format!("{}-{}", self.name, look + 1);
            let scores = self.batch.gather(&name, jobs.len(), |job| {
                let (case, i) = jobs[job];
                (self.judge)(case, self.cases[case][i].trial, &active)
            })?;
            if scores.iter().any(|tallies| tallies.len() != active.len()) {
                let problem = format!(
                    "parts of {name} do not have all candidates; remove them, and start all shards again"
                );
                return Err(Error::Parts {
                    path: self.batch.folder.into(),
                    problem,
                });
            }
            for ((case, _), tallies) in jobs.iter().zip(scores) {
                let mut row = vec![None; self.candidates];
                for (&candidate, tally) in active.iter().zip(tallies) {
                    row[candidate] = Some(tally);
                }
                board.tallies[*case].push(row);
            }
            episodes += (jobs.len() * active.len()) as u64;
            from = to;
            if look + 1 < LOOKS.len() {
                stopped.splice(0..0, self.losers(&board, &mut active));
            }
        }
        let mut order: Vec<usize> = active
            .into_iter()
            .filter(|&candidate| candidate >= self.guests)
            .collect();
        order.sort_by(|a, b| board.compare(*a, *b));
        order.extend(stopped);
        let standings = (0..self.candidates)
            .map(|candidate| board.standing(candidate))
            .collect();
        Ok(Raced {
            standings,
            order,
            episodes,
        })
    }

    /// Removes the candidates from `active` that have certainly lost against the leader. Returns them, the best one
    /// first.
    fn losers(&self, board: &Board, active: &mut Vec<usize>) -> Vec<usize> {
        let runners = active
            .iter()
            .copied()
            .filter(|&candidate| candidate >= self.guests);
        let Some(leader) = runners.clone().min_by(|a, b| board.compare(*a, *b)) else {
            return Vec::new();
        };
        let mut losers: Vec<usize> = runners
            .filter(|&other| board.is_beaten(other, leader))
            .collect();
        losers.sort_by(|a, b| board.compare(*a, *b));
        active.retain(|candidate| !losers.contains(candidate));
        losers
    }
}

/// The episodes so far, by case, trial and candidate.
struct Board<'a> {
    cases: &'a [Vec<WeightedTrial>],
    tallies: Vec<Vec<Vec<Option<EpisodeScore>>>>,
}

impl Board<'_> {
    /// The trials of a case that both candidates have run, each with its weight.
    fn both(
        &self,
        case: usize,
        a: usize,
        b: usize,
    ) -> impl Iterator<Item = (f64, EpisodeScore, EpisodeScore)> + '_ {
        let rows = self.cases[case].iter().zip(&self.tallies[case]);
        rows.filter_map(move |(drawn, row)| Some((drawn.weight, row[a]?, row[b]?)))
    }

    /// The weighted rate of candidate `a` in a case less the weighted rate of candidate `b`, and its standard error.
    fn difference(&self, case: usize, a: usize, b: usize) -> (f64, f64) {
        let (mut all, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (weight, a, b) in self.both(case, a, b) {
            let difference = weight * f64::from(i8::from(a.won) - i8::from(b.won));
            all += weight;
            sum += difference;
            squares += difference * difference;
        }
        if all > 0.0 {
            (sum / all, squares.sqrt() / all)
        } else {
            (0.0, 0.0)
        }
    }

    /// The case in which a candidate has the least advantage over the incumbent, and that advantage with its error.
    fn worst(&self, candidate: usize) -> (usize, (f64, f64)) {
        (0..self.cases.len())
            .map(|case| (case, self.difference(case, candidate, 0)))
            .min_by(|a, b| a.1.0.total_cmp(&b.1.0))
            .unwrap_or((0, (0.0, 0.0)))
    }

    fn standing(&self, candidate: usize) -> CandidateScore {
        let (case, (advantage, error)) = self.worst(candidate);
        let own: Vec<EpisodeScore> = self
            .both(case, candidate, candidate)
            .map(|(_, own, _)| own)
            .collect();
        let mean = |of: &dyn Fn(&EpisodeScore) -> f64| {
            own.iter().map(of).sum::<f64>() / own.len().max(1) as f64
        };
        CandidateScore {
            advantage,
            error,
            footsteps: mean(&|tally| tally.footsteps as f64),
            torque: mean(&|tally| tally.torque),
            trials: own.len(),
        }
    }

    /// Orders candidates by larger advantage, then by fewer footsteps, then by less torque.
    fn compare(&self, a: usize, b: usize) -> Ordering {
        let key = |candidate| {
            let standing = self.standing(candidate);
            [-standing.advantage, standing.footsteps, standing.torque]
        };
        let (a_key, b_key) = (key(a), key(b));
        let orders = a_key.iter().zip(&b_key).map(|(a, b)| a.total_cmp(b));
        orders.fold(Ordering::Equal, Ordering::then).then(a.cmp(&b))
    }

    /// Whether a candidate is certainly behind the leader in the candidate's worst case.
    fn is_beaten(&self, candidate: usize, leader: usize) -> bool {
        let ((case, (own, _)), (_, (best, _))) = (self.worst(candidate), self.worst(leader));
        let (_, error) = self.difference(case, leader, candidate);
        let different = self
            .both(case, leader, candidate)
            .filter(|(_, a, b)| a.won != b.won)
            .count();
        different >= LEAST_DIFFERENT && best - own > CERTAIN * error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::tests::quiet;
    use std::path::Path;
    use std::sync::atomic::{AtomicU64, Ordering};

    /// A race of the incumbent, the mean and some samples on 40 trials of each case.
    fn race(candidates: usize, cases: usize, judge: &TrialJudge) -> Raced {
        let trials = vec![
            (0..40)
                .map(|trial| WeightedTrial {
                    trial,
                    weight: 1.0 + (trial % 2) as f64
                })
                .collect();
            cases
        ];
        Race {
            candidates,
            guests: 2,
            cases: &trials,
            judge,
            batch: quiet(Path::new("."), None),
            name: "race".into(),
        }
        .run()
        .unwrap()
    }

    #[test]
    fn who_has_certainly_lost_stops_and_ranks_behind_those_who_go_on() {
        let episodes = AtomicU64::new(0);
        // Candidate 2 loses all, 3 wins all, and 4 wins all but every eighth; the incumbent wins every second.
        let judge = |_: usize, trial: u64, active: &[usize]| {
            episodes.fetch_add(active.len() as u64, Ordering::Relaxed);
            let scores = active.iter().map(|candidate| EpisodeScore {
                won: match candidate {
                    0 | 1 => trial.is_multiple_of(2),
                    2 => false,
                    3 => true,
                    _ => !trial.is_multiple_of(8),
                },
                ..EpisodeScore::default()
            });
            Ok(scores.collect())
        };
        let raced = race(5, 1, &judge);
        assert_eq!(raced.order, [3, 4, 2]);
        let trials: Vec<usize> = raced
            .standings
            .iter()
            .map(|standing| standing.trials)
            .collect();
        assert_eq!(trials, [40, 40, 10, 40, 40]);
        assert_eq!((raced.episodes, episodes.into_inner()), (170, 170));
        // Even trials are a third of the weight. The incumbent wins exactly these, so candidate 3 wins two thirds more.
        assert!(
            (raced.standings[3].advantage - 2.0 / 3.0).abs() < 1e-12
                && raced.standings[1].advantage == 0.0
        );
    }

    #[test]
    fn the_worst_case_counts_and_footsteps_break_a_tie() {
        let judge = |case: usize, trial: u64, active: &[usize]| {
            let scores = active.iter().map(|candidate| EpisodeScore {
                won: match (candidate, case) {
                    (0 | 1, _) => trial.is_multiple_of(2),
                    // Candidate 2 is better in one case, and as much worse in the other.
                    (2, 0) => true,
                    (2, _) => trial.is_multiple_of(4),
                    // The other candidates are a little better in both cases, and one of them takes more footsteps.
                    (_, _) => trial.is_multiple_of(2) || trial % 5 == 1,
                },
                footsteps: if *candidate == 3 { 4 } else { 2 },
                ..EpisodeScore::default()
            });
            Ok(scores.collect())
        };
        let raced = race(5, 2, &judge);
        assert_eq!(raced.order, [4, 3, 2]);
        assert!(
            raced.standings[2].advantage < 0.0 && raced.standings[3].advantage > 0.0,
            "{raced:?}"
        );
    }
}
