//! Robots of the same build and another size move alike ("dynamic similarity"): no figure of one robot stands in
//! controller, simulation, judge or gain sets.
//!
//! UT-mu2 is made L times as long and its masses M times as large, and a campaign is changed to match: times are
//! sqrt(L) times as long, impulses M sqrt(L) times as large, and so on. Both robots then have the same outcomes, trial
//! by trial.

mod common;

use rayon::prelude::*;
use standfast::campaign::ask::trial;
use standfast::campaign::{Campaign, Overrides};
use standfast::control::Design;
use standfast::episode::{self, Disturbance, EpisodeConfig, Judge, Outcome};
use standfast::lipm::GainSet;
use standfast::robot::{Robot, Scale};
use standfast::sim::{PhysicsStep, Push, Variation};

/// A robot with the settings of its episodes.
struct Bench {
    robot: Robot,
    scale: Scale,
    campaign: Campaign,
    config: EpisodeConfig,
}

impl Bench {
    /// UT-mu2 in the campaign `standard`, scaled.
    fn new(scale: Scale) -> Self {
        let campaign = Campaign::load("standard", &Overrides::default()).unwrap();
        let (usual, time) = (EpisodeConfig { engine: common::engine(), ..campaign.episode }, scale.time());
        let judge = Judge {
            standing_com_speed_m_s: usual.judge.standing_com_speed_m_s * time,
            standing_time_s: usual.judge.standing_time_s * time,
            home_radius_m: usual.judge.home_radius_m * scale.length,
            ..usual.judge
        };
        let config = EpisodeConfig {
            horizon_s: usual.horizon_s * time,
            physics_step_s: PhysicsStep {
                rapier: usual.physics_step_s.rapier * time,
                mujoco: usual.physics_step_s.mujoco * time,
            },
            control_period_s: usual.control_period_s * time,
            judge,
            ..usual
        };
        Self { robot: Robot::load("ut-mu2").unwrap().scaled(scale), scale, campaign, config }
    }

    fn design(&self, gains: &str) -> Design {
        Design::new(&self.robot, &GainSet::load(gains).unwrap(), self.config.control_period_s).unwrap()
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
        Disturbance { pushes: usual.pushes.into_iter().map(push).collect(), variation, ..usual }
    }

    /// Outcome of a trial, and for every tick what describes the motion best: the DCM and the desired ZMP, in units of
    /// UT-mu2.
    fn run(&self, design: &Design, trial: u64) -> (Outcome, Vec<[f64; 4]>) {
        let mut ticks = Vec::new();
        let length = self.scale.length;
        let disturbance = self.disturbance(trial);
        let record = episode::run(&self.robot, design, &self.config, disturbance, self.config.until(), &mut |tick| {
            let zmp = tick.account.zmp_ref;
            ticks.push([tick.dcm.x, tick.dcm.y, zmp.x, zmp.y].map(|v| v / length));
        });
        (record.outcome, ticks)
    }
}

/// How a robot of another size fares in `trials`: how many outcomes differ from those of UT-mu2, and the first tick of
/// any trial at which DCM or ZMP are more than a micrometre apart (in units of UT-mu2), with the number of that trial.
fn compare(scale: Scale, gains: &str, trials: u64) -> (usize, Option<(usize, u64)>) {
    let benches = [Bench::new(Scale { length: 1.0, mass: 1.0 }), Bench::new(scale)];
    let designs = benches.each_ref().map(|bench| bench.design(gains));
    let parted: Vec<(bool, Option<usize>)> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let [(one, ticks), (other, scaled)] = [0, 1].map(|i| benches[i].run(&designs[i], trial));
            let far = |(a, b): (&[f64; 4], &[f64; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6);
            (one != other, ticks.iter().zip(&scaled).position(far))
        })
        .collect();
    let differ = parted.iter().filter(|(differs, _)| *differs).count();
    let first = (0..trials).zip(&parted).filter_map(|(trial, (_, tick))| Some(((*tick)?, trial))).min();
    (differ, first)
}

const SCALES: [Scale; 4] = [
    Scale { length: 0.5, mass: 0.125 },
    Scale { length: 2.0, mass: 8.0 },
    Scale { length: 3.0, mass: 27.0 },
    Scale { length: 1.0, mass: 3.0 },
];

/// `SIMILAR_TRIALS=200 cargo test --release --test similarity -- --ignored --nocapture` prints how many of so many trials
/// differ.
#[test]
#[ignore = "it takes minutes"]
fn table_of_differences() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let trials = number("SIMILAR_TRIALS").unwrap_or(200.0) as u64;
    let own = number("SIMILAR_LENGTH").map(|length| Scale { length, mass: number("SIMILAR_MASS").unwrap_or(1.0) });
    let sets = std::env::var("SIMILAR_SETS").unwrap_or("hold switching robust paper catch".into());
    for scale in own.map_or(SCALES.to_vec(), |own| vec![own]) {
        for gains in sets.split(' ') {
            let (differ, first) = compare(scale, gains, trials);
            println!(
                "L = {}, M = {}, {gains}: {differ} of {trials} differ, first parting {first:?}",
                scale.length, scale.mass
            );
        }
    }
}
