//! Which trials a search runs: more of those that are undecided.
//!
//! Every candidate recovers from a push far below the limit, and none recovers from one far above, so both tell
//! nothing. The outcomes of the incumbent in a sample of the campaign, from trials with similar pushes, give an
//! estimate p of the chance that a trial is won. A trial is drawn with a chance in proportion to the standard deviation
//! of its outcome, sqrt(p (1 - p)), and its weight is the inverse of that chance. So the weighted rate estimates the
//! rate of the campaign without a bias, whatever p is, and with a smaller error.

use super::race::WeightedTrial;
use crate::ask::spec::Campaign;
use crate::ask::trial;
use standfast_sim::Push;

/// Widths of the kernel that makes pushes similar: in the logarithm of the impulse, and in the heading (degrees).
const SIMILAR_IMPULSE: f64 = 0.12;
const SIMILAR_HEADING_DEG: f64 = 20.0;
/// Weight of one supposed win and of one supposed loss, which decide p where there is no similar push.
const SUPPOSED: f64 = 0.3;
/// Least chance with which a trial is drawn. p is only an estimate, and a single outcome with a large weight would
/// outweigh many others.
const LEAST: f64 = 0.4;
/// Distance between the first trials of two generations. The trials of the sample come before those of generation 1.
const TRIALS_APART: u64 = 1 << 32;

/// The outcomes of the incumbent in a sample of a campaign.
pub struct IncumbentSample<'a> {
    campaign: &'a Campaign,
    won: Vec<(Push, bool)>,
}

impl<'a> IncumbentSample<'a> {
    /// Takes the incumbent's outcomes of the first trials.
    pub fn new(campaign: &'a Campaign, won: &[bool]) -> Self {
        let won = (0..)
            .zip(won)
            .map(|(trial, won)| (trial::push(campaign, trial), *won))
            .collect();
        Self { campaign, won }
    }

    /// The estimated chance that the incumbent recovers from a push.
    fn chance(&self, push: &Push) -> f64 {
        let (mut all, mut won) = (2.0 * SUPPOSED, SUPPOSED);
        for (other, has_won) in &self.won {
            let turned = (push.heading_deg - other.heading_deg + 180.0).rem_euclid(360.0) - 180.0;
            let harder = (push.impulse_n_s.max(1e-9) / other.impulse_n_s.max(1e-9)).ln();
            let near = (-0.5
                * ((turned / SIMILAR_HEADING_DEG).powi(2) + (harder / SIMILAR_IMPULSE).powi(2)))
            .exp();
            all += near;
            won += if *has_won { near } else { 0.0 };
        }
        won / all
    }

    /// The trials of a generation. Generations are numbered from 1.
    pub fn draw(&self, generation: u64, count: usize) -> Vec<WeightedTrial> {
        let numbers = generation * TRIALS_APART..;
        let kept = numbers.filter_map(|trial| {
            let chance = self.chance(&trial::push(self.campaign, trial));
            let kept = (2.0 * (chance * (1.0 - chance)).sqrt()).clamp(LEAST, 1.0);
            let is_kept = trial::share(self.campaign.seed, trial) < kept;
            is_kept.then_some(WeightedTrial {
                trial,
                weight: 1.0 / kept,
            })
        });
        kept.take(count).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::campaign;

    /// Trials near the limit of 2 N s are drawn more often, and the weighted rate equals the rate of the campaign.
    #[test]
    fn undecided_trials_are_drawn_more_often_and_weigh_less() {
        let campaign = campaign("standard", &["push.impulse_n_s={uniform=[0.5, 6]}"]);
        let is_won = |trial: u64| trial::push(&campaign, trial).impulse_n_s < 2.0;
        let won: Vec<bool> = (0..200).map(is_won).collect();
        let drawn = IncumbentSample::new(&campaign, &won).draw(3, 4000);
        let near = |trial: u64| (1.8..2.2).contains(&trial::push(&campaign, trial).impulse_n_s);
        let share =
            drawn.iter().filter(|drawn| near(drawn.trial)).count() as f64 / drawn.len() as f64;
        assert!(share > 1.4 * 0.4 / 5.5, "{share}");
        let sum = |of: &dyn Fn(u64) -> bool| {
            drawn
                .iter()
                .filter(|d| of(d.trial))
                .map(|d| d.weight)
                .sum::<f64>()
        };
        let rate = sum(&is_won) / sum(&|_| true);
        assert!((rate - 1.5 / 5.5).abs() < 0.03, "{rate}");
        assert!(
            drawn
                .iter()
                .all(|drawn| drawn.trial >= 3 * TRIALS_APART && drawn.trial < 4 * TRIALS_APART)
        );
    }
}
