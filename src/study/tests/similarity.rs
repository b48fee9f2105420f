//! Robots of the same build and another size move alike ("dynamic similarity"): no figure of one robot is fixed in
//! simulation, judge or controllers.
//!
//! UT-mu2 is made L times as long and its masses M times as large, and a campaign is changed to match: times are
//! sqrt(L) times as long, impulses M sqrt(L) times as large, and so on. Both robots then move alike in every trial. If
//! L and M are powers of 4 and 2, they do so to the bit, since a product with a power of 2 is not rounded. Otherwise
//! rounding errors grow in contacts, and now and then a trial near the limit ends differently.

use rayon::prelude::*;
use standfast_core::robot::{Robot, SizeRatio};
use standfast_core::socket::PreparedController;
use standfast_sim::episode::{self, Disturbance, EpisodeConfig, Judge, Outcome};
use standfast_sim::{Push, Variation};
use standfast_study::ask::trial;
use standfast_study::{Campaign, Overrides};

const OWN_SIZE: SizeRatio = SizeRatio {
    length: 1.0,
    mass: 1.0,
};

/// A robot with the settings of its episodes.
struct Bench {
    robot: Robot,
    scale: SizeRatio,
    campaign: Campaign,
    config: EpisodeConfig,
}

impl Bench {
    /// UT-mu2 with joints that lose torque, in a built-in campaign, scaled.
    fn new(campaign: &str, scale: SizeRatio) -> Self {
        let campaign = Campaign::load(campaign, &Overrides::default()).unwrap();
        let usual = EpisodeConfig {
            engine: crate::common::engine(),
            ..campaign.episode
        };
        let time = scale.time();
        let judge = Judge {
            standing_com_speed_m_s: usual.judge.standing_com_speed_m_s * time,
            standing_time_s: usual.judge.standing_time_s * time,
            home_radius_m: usual.judge.home_radius_m * scale.length,
            ..usual.judge
        };
        let config = EpisodeConfig {
            horizon_s: usual.horizon_s * time,
            physics_step_s: usual.physics_step_s * time,
            control_period_s: usual.control_period_s * time,
            judge,
            ..usual
        };
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        for servo in &mut robot.servos {
            servo.friction_n_m = 0.02 * servo.torque_n_m;
            servo.damping_n_m_s_rad = 0.02 * servo.kd;
        }
        Self {
            robot: robot.scaled(scale),
            scale,
            campaign,
            config,
        }
    }

    fn factory(&self, gains: &str) -> PreparedController {
        standfast_controllers::load(gains)
            .unwrap()
            .prepare(&self.robot, self.config.control_period_s)
            .unwrap()
    }

    fn disturbance(&self, trial: u64) -> Disturbance {
        let (scale, time) = (self.scale, self.scale.time());
        let usual = trial::disturbance(&self.campaign, trial);
        let push = |push: Push| Push {
            impulse_n_s: push.impulse_n_s * scale.impulse(),
            height_m: push.height_m * scale.length,
            duration_s: push.duration_s * time,
            start_s: push.start_s * time,
            ..push
        };
        let by = |factor: f64, value: Option<f64>| value.map(|value| value * factor);
        let variation = Variation {
            trunk_com_x_m: by(scale.length, usual.variation.trunk_com_x_m),
            trunk_com_y_m: by(scale.length, usual.variation.trunk_com_y_m),
            ground_step_m: by(scale.length, usual.variation.ground_step_m),
            delay_s: by(time, usual.variation.delay_s),
            ..usual.variation
        };
        Disturbance {
            pushes: usual.pushes.into_iter().map(push).collect(),
            variation,
            ..usual
        }
    }

    /// Runs the first trials with a controller.
    fn run(&self, gains: &str, trials: u64) -> Vec<Motion> {
        let factory = self.factory(gains);
        (0..trials)
            .into_par_iter()
            .map(|trial| self.run_trial(&factory, trial))
            .collect()
    }

    fn run_trial(&self, factory: &PreparedController, trial: u64) -> Motion {
        let (mut ticks, length) = (Vec::new(), self.scale.length);
        let disturbance = self.disturbance(trial);
        let record = episode::run(
            &self.robot,
            factory,
            &self.config,
            disturbance,
            self.config.until(),
            &mut |tick| {
                let zmp = tick.report.zmp_ref.unwrap_or_default();
                ticks.push(
                    [tick.dcm.x, tick.dcm.y, zmp.x, zmp.y, tick.dcm_outside_m].map(|v| v / length),
                );
            },
        )
        .unwrap();
        Motion {
            outcome: record.outcome,
            ticks,
        }
    }
}

/// The course of a trial: its outcome and, for every tick, the DCM, the desired ZMP and the distance of the DCM from
/// the support (m), in the size of UT-mu2.
struct Motion {
    outcome: Outcome,
    ticks: Vec<[f64; 5]>,
}

impl Motion {
    /// The first tick at which this motion differs from another one.
    fn parts_from(&self, other: &Self) -> Option<usize> {
        let differs = |k: &usize| self.ticks.get(*k) != other.ticks.get(*k);
        (0..self.ticks.len().max(other.ticks.len())).find(differs)
    }
}

/// Number of outcomes that differ.
fn differences(some: &[Motion], others: &[Motion]) -> usize {
    some.iter()
        .zip(others)
        .filter(|(one, other)| one.outcome != other.outcome)
        .count()
}

#[test]
#[ignore = "runs a campaign twice, half a minute"]
fn a_robot_four_times_as_long_moves_alike_to_the_bit() {
    for scale in [
        SizeRatio {
            length: 4.0,
            mass: 64.0,
        },
        SizeRatio {
            length: 0.25,
            mass: 1.0,
        },
    ] {
        for (campaign, controllers) in [
            ("standard", ["switching", "paper", "catch"]),
            ("harsh", ["hold", "robust", "catch"]),
        ] {
            let [own, similar] = [OWN_SIZE, scale].map(|scale| Bench::new(campaign, scale));
            for gains in controllers {
                let pairs = own.run(gains, 10).into_iter().zip(similar.run(gains, 10));
                for (trial, (one, other)) in pairs.enumerate() {
                    assert_eq!(
                        one.parts_from(&other),
                        None,
                        "{gains}, trial {trial} of {campaign}, {scale:?}"
                    );
                    assert_eq!(
                        one.outcome, other.outcome,
                        "{gains}, trial {trial} of {campaign}, {scale:?}"
                    );
                }
            }
        }
    }
}

/// Loads of 1e9 N, trunks of 5 mm and of 80 m: a comparison with a fixed number of newtons, metres or seconds is found
/// here.
#[test]
fn robots_of_any_size_move_alike_to_the_bit() {
    let [light, heavy] = [-30, 26].map(|power| SizeRatio {
        length: 1.0,
        mass: 2.0_f64.powi(power),
    });
    let [small, large] = [-3, 4].map(|power| SizeRatio {
        length: 4.0_f64.powi(power),
        mass: 64.0_f64.powi(power),
    });
    let own = Bench::new("standard", OWN_SIZE).run("catch", 12);
    for scale in [light, heavy, small, large] {
        for (trial, (one, other)) in own
            .iter()
            .zip(Bench::new("standard", scale).run("catch", 12))
            .enumerate()
        {
            assert_eq!(one.parts_from(&other), None, "trial {trial}, {scale:?}");
            assert_eq!(one.outcome, other.outcome, "trial {trial}, {scale:?}");
        }
    }
}

const SIZES: [SizeRatio; 4] = [
    SizeRatio {
        length: 0.5,
        mass: 0.125,
    },
    SizeRatio {
        length: 2.0,
        mass: 8.0,
    },
    SizeRatio {
        length: 3.0,
        mass: 27.0,
    },
    SizeRatio {
        length: 1.0,
        mass: 3.0,
    },
];

#[test]
#[ignore = "runs campaigns of several sizes, half a minute"]
fn robots_of_other_sizes_have_the_same_outcomes() {
    const TRIALS: u64 = 24;
    for gains in ["hold", "paper", "catch"] {
        let own = Bench::new("standard", OWN_SIZE).run(gains, TRIALS);
        for scale in SIZES {
            let differ = differences(&own, &Bench::new("standard", scale).run(gains, TRIALS));
            assert!(
                differ <= 1,
                "{gains}, {scale:?}: {differ} of {TRIALS} outcomes differ"
            );
        }
    }
}

/// Prints the table of the guide.
#[test]
#[ignore = "it takes a quarter of an hour"]
fn table_of_other_sizes() {
    const TRIALS: u64 = 200;
    println!("outcomes of {TRIALS} trials of `standard` that differ from those of UT-mu2");
    println!(
        "| controller | {} |",
        SIZES
            .map(|SizeRatio { length, mass }| format!("L = {length}, M = {mass}"))
            .join(" | ")
    );
    for gains in ["hold", "switching", "robust", "paper", "catch"] {
        let own = Bench::new("standard", OWN_SIZE).run(gains, TRIALS);
        let of = |scale| {
            differences(&own, &Bench::new("standard", scale).run(gains, TRIALS)).to_string()
        };
        println!("| `{gains}` | {} |", SIZES.map(of).join(" | "));
    }
}
