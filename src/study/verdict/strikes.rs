//! What the strikes of a pendulum came to. RoboCup's push recovery asks a team to declare a drawback D from which the robot
//! withstands three strikes, from the front and from behind. EUROBENCH's DysTurbance protocol strikes ten times in each
//! condition, calls a condition unstable in which 30 % or more fall, and states the energy that the robot absorbed. Here a
//! strike from which the robot does not recover counts as a fall, as everywhere in a result.

use crate::ask::distribution::Distribution;
use crate::ask::pendulum::{PendulumSpec, robocup_m};
use crate::ask::push::PushedPoint;
use crate::ask::spec::Campaign;
use crate::verdict::trial_columns::TrialColumns;
use serde::Serialize;
use standfast_stats::curve::{Level, NoCurve, Pushes};
use standfast_stats::rate::SuccessCount;

/// The chance of a strike to be withstood with which three are withstood in 95 % of cases: 0.95^(1/3).
pub const OF_THREE: f64 = 0.983_047_572_491_559;
/// Share of falls from which DysTurbance calls a condition unstable.
const UNSTABLE: f64 = 0.3;

/// The strikes that one controller met.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Strikes {
    pub controller: String,
    /// By heading, if the campaign lists headings, or else all together.
    pub towards: Vec<Towards>,
    /// The drawback to declare for three strikes; None if there is none.
    pub declared: Option<Declared>,
    /// Heading by heading, from weak to hard; empty unless the campaign lists drawbacks.
    pub conditions: Vec<Condition>,
}

/// The strikes towards one heading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Towards {
    /// None for all headings.
    pub heading_deg: Option<f64>,
    #[serde(flatten)]
    pub count: SuccessCount,
    /// Drawback with 50 % recovery (m), by a logistic curve.
    pub draw50_m: DrawAt,
    /// Drawback with [`OF_THREE`].
    pub draw_of_three_m: DrawAt,
    /// The largest energy of the bob (J) up to which no condition had a loss.
    pub stable_to_j: Option<f64>,
    /// The smallest energy of the bob (J) of an unstable condition.
    pub unstable_from_j: Option<f64>,
}

/// A drawback, or why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DrawAt {
    pub level: Option<Level>,
    pub none_because: Option<NoCurve>,
}

/// The smallest of the drawbacks at which three strikes are withstood in 95 % of cases, over the headings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Declared {
    pub draw_m: f64,
    /// 95 % interval (m) at the heading of this drawback.
    pub ci95_m: [Option<f64>; 2],
    /// Whether it is the farthest of a side, because nothing shows that a farther one would not do.
    pub is_farthest: bool,
    pub momentum_n_s: f64,
    /// RoboCup's ranking metric M, [`robocup_m`]; None if the height of the strike above the COM is not stated.
    pub robocup_m: Option<f64>,
    /// Strikes up to this drawback, and those of them that were withstood.
    pub up_to_it: SuccessCount,
}

/// The strikes towards one heading from one drawback.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Condition {
    pub heading_deg: f64,
    pub draw_m: f64,
    /// Energy of the bob as it strikes (J).
    pub energy_j: f64,
    #[serde(flatten)]
    pub count: SuccessCount,
    /// None without strikes.
    pub stability: Option<Stability>,
    /// Mean over the strikes of the energy that the bob lost along its way, to robot and padding, as a share of `energy_j`.
    /// None if it is not known.
    pub absorbed: Option<f64>,
}

/// How DysTurbance sorts conditions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// Nothing was lost.
    Stable,
    /// Fewer than 30 % were lost.
    Partly,
    Unstable,
}

/// The strikes that each controller met, or nothing for a campaign without a pendulum.
pub(super) fn of(campaign: &Campaign, all: &TrialColumns, until_resolved: bool) -> Vec<Strikes> {
    let Some(pendulum) = campaign.push.pendulum else {
        return Vec::new();
    };
    let controllers = all.names.iter().enumerate();
    controllers
        .map(|(controller, name)| {
            let met = Met {
                campaign,
                pendulum,
                all,
                controller,
                until_resolved,
            };
            let headings = match campaign.push.heading_deg {
                Distribution::Each { each } => each.list().iter().copied().map(Some).collect(),
                Distribution::Constant(heading_deg) => vec![Some(heading_deg)],
                _ => vec![None],
            };
            let mut conditions = Vec::new();
            let mut towards = Vec::new();
            for heading_deg in headings {
                let of_heading = met.conditions(heading_deg);
                towards.push(met.towards(heading_deg, &of_heading));
                conditions.extend(of_heading);
            }
            Strikes {
                controller: name.clone(),
                declared: met.declared(&towards),
                towards,
                conditions,
            }
        })
        .collect()
}

/// The strikes that one controller met.
struct Met<'a> {
    campaign: &'a Campaign,
    pendulum: PendulumSpec,
    all: &'a TrialColumns,
    controller: usize,
    until_resolved: bool,
}

impl Met<'_> {
    /// The drawback (m) of each trial towards a heading, and whether the robot recovered.
    fn trials(&self, heading_deg: Option<f64>) -> Vec<(f64, bool)> {
        let bob = self.pendulum.bob();
        let trials = self.all.of(self.controller).iter().enumerate();
        trials
            .filter(|(trial, _)| heading_deg.is_none_or(|deg| self.all.heading_deg(*trial) == deg))
            .map(|(trial, ended)| {
                let draw_m = bob.draw_m(self.all.impulse_n_s(trial));
                (draw_m, ended.has_recovered())
            })
            .collect()
    }

    fn towards(&self, heading_deg: Option<f64>, conditions: &[Condition]) -> Towards {
        let trials = self.trials(heading_deg);
        let pushes = Pushes::new(&trials);
        let at = |chance: f64| {
            let level = pushes.at(chance);
            DrawAt {
                level: level.ok(),
                none_because: level.err(),
            }
        };
        let struck = || conditions.iter().filter(|of| of.stability.is_some());
        let stable = struck().take_while(|of| of.stability == Some(Stability::Stable));
        let unstable = struck().find(|of| of.stability == Some(Stability::Unstable));
        Towards {
            heading_deg,
            count: self.counted(trials.iter().map(|(_, recovered)| *recovered)),
            draw50_m: at(0.5),
            draw_of_three_m: at(OF_THREE),
            stable_to_j: stable.last().map(|condition| condition.energy_j),
            unstable_from_j: unstable.map(|condition| condition.energy_j),
        }
    }

    /// The conditions of a heading, from weak to hard.
    fn conditions(&self, heading_deg: Option<f64>) -> Vec<Condition> {
        let (Distribution::Each { each }, Some(heading_deg)) = (self.pendulum.draw_m, heading_deg)
        else {
            return Vec::new();
        };
        let mut draws_m: Vec<f64> = each.into();
        draws_m.sort_by(f64::total_cmp);
        let (bob, struck_n_s) = (self.pendulum.bob(), self.all.struck_n_s(self.controller));
        let ended = self.all.of(self.controller);
        let mut conditions = Vec::new();
        for draw_m in draws_m {
            let momentum_n_s = bob.momentum_n_s(draw_m);
            let energy_j = |n_s: f64| 0.5 * n_s * n_s / bob.mass_kg;
            let trials: Vec<usize> = (0..ended.len())
                .filter(|trial| self.all.heading_deg(*trial) == heading_deg)
                .filter(|trial| self.all.impulse_n_s(*trial) == momentum_n_s)
                .collect();
            let count = self.counted(trials.iter().map(|trial| ended[*trial].has_recovered()));
            let left_j: f64 = trials
                .iter()
                .map(|trial| energy_j(momentum_n_s - struck_n_s.get(*trial).unwrap_or(&f64::NAN)))
                .sum();
            let energy_j = energy_j(momentum_n_s);
            let absorbed = 1.0 - left_j / count.trials as f64 / energy_j;
            let stability = match 1.0 - count.success_rate {
                0.0 => Stability::Stable,
                lost if lost >= UNSTABLE => Stability::Unstable,
                _ => Stability::Partly,
            };
            conditions.push(Condition {
                heading_deg,
                draw_m,
                energy_j,
                stability: (count.trials > 0).then_some(stability),
                absorbed: absorbed.is_finite().then_some(absorbed),
                count,
            });
        }
        conditions
    }

    fn declared(&self, towards: &[Towards]) -> Option<Declared> {
        let bob = self.pendulum.bob();
        let mut least = Level {
            at: f64::INFINITY,
            ci95: [None; 2],
        };
        let mut is_farthest = false;
        for heading in towards {
            let of_three = &heading.draw_of_three_m;
            let trials = self.trials(heading.heading_deg);
            let farthest_m = trials
                .iter()
                .fold(0.0, |m: f64, (draw_m, _)| m.max(*draw_m));
            let level = match (of_three.level, of_three.none_because) {
                (Some(level), _) => level,
                (_, Some(NoCurve::AboveRange | NoCurve::AllRecovered)) => Level {
                    at: farthest_m,
                    ci95: [None; 2],
                },
                _ => return None,
            };
            if level.at < least.at {
                (least, is_farthest) = (level, of_three.level.is_none());
            }
        }
        let trials = self.trials(None);
        let up_to_it = trials.iter().filter(|(draw_m, _)| *draw_m <= least.at);
        let push = &self.campaign.push;
        let height_m = matches!(push.point_m, PushedPoint::AtCom(_)).then(|| push.height_m.mean());
        Some(Declared {
            draw_m: least.at,
            ci95_m: least.ci95,
            is_farthest,
            momentum_n_s: bob.momentum_n_s(least.at),
            robocup_m: height_m
                .map(|height_m| robocup_m(&bob, least.at, height_m, &self.campaign.units)),
            up_to_it: self.counted(up_to_it.map(|(_, recovered)| *recovered)),
        })
    }

    fn counted(&self, recovered: impl Iterator<Item = bool>) -> SuccessCount {
        let (mut trials, mut successes) = (0, 0);
        for recovered in recovered {
            trials += 1;
            successes += u64::from(recovered);
        }
        let count = SuccessCount::new(successes, trials);
        match self.until_resolved {
            true => count.at_any_time(),
            false => count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::trial;
    use crate::fixtures::{Changed as _, campaign, columns_of_rows, row};
    use standfast_sim::episode::Outcome::{Fell, Recovered};
    use standfast_sim::episode::Totals;

    /// The strikes of a campaign, of which trial `i` is lost if `is_lost` says so of its heading (degrees) and drawback (m).
    /// The bob stops at the robot in each.
    fn strikes(campaign: &Campaign, mut is_lost: impl FnMut(f64, f64) -> bool) -> Strikes {
        let mut rows = Vec::new();
        for number in 0..campaign.trials {
            let push = trial::push(campaign, number);
            let draw_m = push.bob.unwrap().draw_m(push.impulse_n_s);
            let outcome = match is_lost(push.heading_deg, draw_m) {
                true => Fell,
                false => Recovered,
            };
            rows.push(row(number, "a", push.impulse_n_s, outcome).with(|row| {
                row.push = push;
                let struck = ("bob_impulse_n_s".to_string(), push.impulse_n_s);
                row.record.totals = Totals([struck].into());
            }));
        }
        of(campaign, &columns_of_rows(&rows, &["a"]), false).remove(0)
    }

    #[test]
    fn the_drawback_to_declare_is_that_of_the_weaker_side() {
        let robocup = campaign("robocup", &[]);
        let found = strikes(&robocup, |deg, draw_m| {
            draw_m > if deg == 0.0 { 0.6 } else { 0.9 }
        });
        let [front, behind] = [180.0, 0.0].map(|deg| {
            let at = found
                .towards
                .iter()
                .find(|towards| towards.heading_deg == Some(deg));
            at.unwrap()
        });
        assert_eq!((front.count.trials, behind.count.trials), (200, 200));
        let declared = found.declared.unwrap();
        assert!(
            (declared.draw_m - 0.6).abs() < 0.02 && !declared.is_farthest,
            "{declared:?}"
        );
        assert_eq!(declared.up_to_it.recovered, declared.up_to_it.trials);
        // A bob of 1 kg falls by 0.106 m; the robot has 8 kg, and its COM is 0.31 m high.
        assert!(
            (declared.robocup_m.unwrap() - 0.131).abs() < 3e-3,
            "{declared:?}"
        );
        let all = strikes(&robocup, |_, _| false).declared.unwrap();
        assert!(all.is_farthest && all.draw_m > 1.28, "{all:?}");
        assert_eq!(strikes(&robocup, |_, _| true).declared, None);
    }

    #[test]
    fn a_condition_is_unstable_from_three_losses_of_ten() {
        let rig = campaign("dysturbance", &[]);
        let mut met = [0; 2];
        let found = strikes(&rig, |heading_deg, draw_m| {
            let of_list = [0.5, 0.7]
                .into_iter()
                .position(|m| (m - draw_m).abs() < 0.01);
            match of_list.filter(|_| heading_deg == 90.0) {
                Some(i) => {
                    met[i] += 1;
                    met[i] <= 2 + i
                }
                None => false,
            }
        });
        let all = found.conditions.iter();
        let of = |deg: f64| {
            all.clone()
                .filter(move |condition| condition.heading_deg == deg)
        };
        assert!(
            found
                .conditions
                .iter()
                .all(|condition| condition.count.trials == 10)
        );
        assert!(of(0.0).all(|condition| condition.stability == Some(Stability::Stable)));
        let sorted: Vec<_> = of(90.0).map(|condition| condition.stability).collect();
        let [stable, partly, unstable] =
            [Stability::Stable, Stability::Partly, Stability::Unstable].map(Some);
        assert_eq!(sorted[..3], [stable; 3]);
        assert_eq!(sorted[3..6], [partly, stable, unstable]);
        // A bob of 1.502 kg on 1 m that is drawn back by 0.4 m falls by 0.0835 m, and by 0.7 m, 0.286 m.
        let towards = &found.towards[1];
        let [stable_j, unstable_j] =
            [towards.stable_to_j, towards.unstable_from_j].map(Option::unwrap);
        assert!(
            (stable_j - 1.230).abs() < 5e-3 && (unstable_j - 4.21).abs() < 0.02,
            "{towards:?}"
        );
        // A bob that stops has lost all of its energy.
        assert!(of(180.0).all(|condition| (condition.absorbed.unwrap() - 1.0).abs() < 1e-12));
    }

    /// A direction that was not struck is neither stable nor unstable, and nothing can be declared.
    #[test]
    fn what_was_not_struck_is_not_judged() {
        let few = Campaign {
            trials: 8,
            ..campaign("dysturbance", &[])
        };
        let found = strikes(&few, |_, _| false);
        assert!(found.towards[0].stable_to_j.is_some());
        for towards in &found.towards[1..] {
            assert_eq!((towards.stable_to_j, towards.unstable_from_j), (None, None));
        }
        let untried = found.conditions.iter().filter(|of| of.heading_deg != 0.0);
        assert!(untried.clone().count() == 16 && untried.clone().all(|of| of.stability.is_none()));
        let one = Campaign {
            trials: 1,
            ..campaign("robocup", &[])
        };
        assert_eq!(strikes(&one, |_, _| false).declared, None);
        // One heading needs no list.
        let aside = campaign("dysturbance", &["push.heading_deg=90"]);
        assert_eq!(strikes(&aside, |_, _| false).conditions.len(), 8);
    }
}
