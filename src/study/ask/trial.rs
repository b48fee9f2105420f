//! One trial: everything that is drawn for it is a function of campaign seed and trial index alone.
//!
//! Each quantity has its own ChaCha8 stream, numbered by trial and quantity. So a trial does not depend on which trials
//! ran before it, and making one more quantity random, or adding a new one, does not change the others.

use crate::ask::bounds::PushBounds;
use crate::ask::distribution::Distribution;
use crate::ask::push::SecondPushSpec;
use crate::ask::spec::Campaign;
use crate::ask::variations;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use rand_distr::StandardNormal;
use standfast_sim::episode::{Disturbance, Outcome, Record};
use standfast_sim::noise::Normals;
use standfast_sim::{Push, SensorErrors, Variation};
use std::sync::Arc;

/// Numbers of the streams. What a seed yields depends on them, so they must never be reused.
const IMPULSE: u64 = 0;
const HEADING: u64 = 1;
const HEIGHT: u64 = 2;
const DURATION: u64 = 3;
const START: u64 = 4;
const SENSORS: u64 = 16;
const VARIATION: Variation<u64> = Variation {
    mass_scale: 32,
    trunk_com_x_m: 33,
    trunk_com_y_m: 34,
    friction: 35,
    slope_deg: 36,
    slope_heading_deg: 37,
    ground_step_m: 38,
    kp_scale: 39,
    kd_scale: 40,
    torque_scale: 41,
    speed_scale: 42,
    rotor_scale: 44,
    joint_friction_share: 45,
    joint_damping_share: 46,
    delay_s: 43,
};
const SECOND_IMPULSE: u64 = 48;
const SECOND_HEADING: u64 = 49;
const SECOND_AFTER: u64 = 50;
const REPLICA: u64 = 56;
const CONTROLLER: u64 = 57;
const SEEDS: u64 = 58;
const NORMALS: u64 = 59;
const SHARE: u64 = 60;

fn stream(seed: u64, trial: u64, quantity: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((trial << 8) | quantity);
    rng
}

pub fn push(campaign: &Campaign, trial: u64) -> Push {
    let spec = &campaign.push;
    let bounds = campaign.push_bounds();
    // Lists are taken in turn, each once for every combination of those before it.
    let mut turn = trial;
    let mut draw = |distribution, bounds, quantity| match distribution {
        Distribution::Each { each } => {
            let (values, at) = (each.list(), turn);
            turn /= values.len() as u64;
            values[(at % values.len() as u64) as usize]
        }
        other => draw(other, bounds, &mut stream(campaign.seed, trial, quantity)),
    };
    let impulse_n_s = match &spec.pendulum {
        // The drawback takes the place of the impulse.
        Some(pendulum) => {
            let draw_m = draw(pendulum.draw_m, pendulum.draws_m(), IMPULSE);
            pendulum.bob().momentum_n_s(draw_m)
        }
        None => draw(spec.impulse_n_s, bounds.impulse_n_s, IMPULSE),
    };
    Push {
        impulse_n_s,
        heading_deg: draw(spec.heading_deg, bounds.heading_deg, HEADING),
        height_m: draw(spec.height_m, bounds.height_m, HEIGHT),
        duration_s: draw(spec.duration_s, bounds.duration_s, DURATION),
        start_s: draw(spec.start_s, bounds.start_s, START),
        profile: spec.profile,
        bob: spec.pendulum.map(|pendulum| pendulum.bob()),
    }
}

/// The second push of a trial after `first`; None if the campaign has none.
fn second_push(campaign: &Campaign, trial: u64, first: &Push) -> Option<Push> {
    let spec = &campaign.second_push;
    if !spec.is_any() {
        return None;
    }
    let horizon_s = campaign.episode.horizon_s;
    let bounds = PushBounds::new(horizon_s);
    let draw = |distribution, bounds, quantity| {
        draw(
            distribution,
            bounds,
            &mut stream(campaign.seed, trial, quantity),
        )
    };
    let after_s = draw(
        spec.after_s,
        SecondPushSpec::after_bounds(&campaign.push, horizon_s),
        SECOND_AFTER,
    );
    Some(Push {
        impulse_n_s: draw(spec.impulse_n_s, bounds.impulse_n_s, SECOND_IMPULSE),
        heading_deg: draw(spec.heading_deg, bounds.heading_deg, SECOND_HEADING),
        start_s: first.end_s() + after_s,
        ..*first
    })
}

/// All pushes of a trial, in order of time.
pub fn pushes(campaign: &Campaign, trial: u64) -> Vec<Push> {
    let first = push(campaign, trial);
    std::iter::once(first)
        .chain(second_push(campaign, trial, &first))
        .collect()
}

/// The differences of a replica from the push that it repeats, as shares of the largest differences: in impulse and
/// heading (-1 to 1), and in the start of the push (0 to 1).
pub fn replica(seed: u64, trial: u64) -> [f64; 3] {
    let mut rng = stream(seed, trial, REPLICA);
    let [more, turned, later]: [f64; 3] = std::array::from_fn(|_| rng.random::<f64>());
    [2.0 * more - 1.0, 2.0 * turned - 1.0, later]
}

/// Seed number `number` of the seeds that follow from `seed`. It has at most 63 bits, as the seed of a campaign.
pub fn derived_seed(seed: u64, number: u64) -> u64 {
    stream(seed, number, SEEDS).random::<u64>() >> 1
}

/// `count` standard normal numbers for one sample of one generation of a search.
pub fn normals(seed: u64, generation: u64, sample: u64, count: usize) -> Vec<f64> {
    let mut rng = stream(seed, generation << 24 | sample, NORMALS);
    (0..count).map(|_| rng.sample(StandardNormal)).collect()
}

/// A random number of a trial, uniform from 0 to 1.
pub fn share(seed: u64, trial: u64) -> f64 {
    stream(seed, trial, SHARE).random()
}

/// Variation of robot and ground in a trial.
pub fn variation(campaign: &Campaign, trial: u64) -> Variation {
    let drawn = variations::drawn(&campaign.variations);
    drawn
        .zip(variations::bounds(&campaign.units))
        .zip(VARIATION)
        .map(|_, ((distribution, bounds), quantity)| {
            distribution.map(|distribution| {
                draw(
                    distribution,
                    bounds,
                    &mut stream(campaign.seed, trial, quantity),
                )
            })
        })
}

/// Sensor errors of a trial; None if the campaign has ideal sensors.
pub fn sensor_errors(campaign: &Campaign, trial: u64) -> Option<SensorErrors> {
    let sensors = campaign.sensors;
    if sensors.noise_scale == 0.0 && sensors.bias_scale == 0.0 {
        return None;
    }
    Some(SensorErrors {
        noise_scale: sensors.noise_scale,
        bias_scale: sensors.bias_scale,
        normal: Arc::new(Normals(stream(campaign.seed, trial, SENSORS))),
    })
}

/// Whether all trials are alike, to the bit, until the first push starts: same start, robot and ground, and ideal
/// sensors.
pub fn begin_alike(campaign: &Campaign) -> bool {
    let varied = variations::drawn(&campaign.variations)
        .list()
        .into_iter()
        .filter_map(|(_, varied)| varied);
    let mut drawn = std::iter::once(campaign.push.start_s).chain(varied);
    sensor_errors(campaign, 0).is_none() && drawn.all(|distribution| distribution.is_constant())
}

/// The disturbance of trial 0 on the robot and the ground as they are designed.
pub fn as_designed(campaign: &Campaign) -> Disturbance {
    Disturbance {
        variation: Variation::default(),
        ..disturbance(campaign, 0)
    }
}

/// All disturbances of a trial. They are the same for every controller, so controllers are compared on the same trials.
pub fn disturbance(campaign: &Campaign, trial: u64) -> Disturbance {
    Disturbance {
        pushes: pushes(campaign, trial),
        sensor_errors: sensor_errors(campaign, trial),
        variation: variation(campaign, trial),
        seed: stream(campaign.seed, trial, CONTROLLER).random(),
    }
}

/// One of `count` (2 or more) disturbances near that of a trial, for the same robot and ground: the first push is up to 3 %
/// weaker or harder, all pushes come up to 10 ms earlier or later, and the errors of the sensors are others.
pub fn neighbour(campaign: &Campaign, trial: u64, number: usize, count: usize) -> Disturbance {
    const IMPULSE_SHARE: f64 = 0.03;
    const LATE_S: f64 = 0.01;
    /// Spreads the starts over the impulses.
    const STRIDE: usize = 3;
    let spread = |number: usize| 2.0 * (number % count) as f64 / (count - 1) as f64 - 1.0;
    let mut near = disturbance(campaign, trial);
    near.pushes[0].impulse_n_s *= 1.0 + IMPULSE_SHARE * spread(number);
    for push in &mut near.pushes {
        push.start_s = (push.start_s + LATE_S * spread(STRIDE * number)).max(0.0);
    }
    let other = Campaign {
        seed: derived_seed(campaign.seed, number as u64),
        ..campaign.clone()
    };
    near.sensor_errors = sensor_errors(&other, trial);
    near
}

/// The record that a synthetic trial has with controller number `controller`. It takes no simulation. A higher number is a
/// better controller. `hardness` is the first push as a multiple of the hardest push without a footstep.
pub fn synthetic(campaign: &Campaign, trial: u64, set: usize, hardness: f64) -> Record {
    let [luck, ..] = replica(campaign.seed, trial);
    let recovers = hardness * (1.0 + 0.3 * luck) < 1.0 + 0.05 * set as f64;
    let end_s = campaign.episode.horizon_s;
    let pushed_s = push(campaign, trial).end_s();
    Record {
        outcome: if recovers {
            Outcome::Recovered
        } else {
            Outcome::Fell
        },
        end_s,
        settled_at_s: recovers.then_some(pushed_s + 0.1 * hardness),
        fell_at_s: (!recovers).then_some(pushed_s + 0.5),
        fall_cause: (!recovers).then(|| "made up".into()),
        ..Record::default()
    }
}

/// Draws a value. Normal values are drawn again until they are within the bounds. The mean is within the bounds, so at
/// worst every second draw is kept.
fn draw(distribution: Distribution, [least, most]: [f64; 2], rng: &mut ChaCha8Rng) -> f64 {
    match distribution {
        Distribution::Constant(value) => value,
        Distribution::Uniform { uniform: [a, b] } => a + (b - a) * rng.random::<f64>(),
        Distribution::Normal { normal: [mean, sd] } => loop {
            let value = mean + sd * rng.sample::<f64, _>(StandardNormal);
            if (least..=most).contains(&value) {
                return value;
            }
        },
        // Only a push has lists, and takes them in turn.
        Distribution::Each { each } => each.list()[0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::fixtures::campaign as with;
    use standfast_sim::{NoiseDraw, Sensor};

    fn campaign(set: &[&str]) -> Campaign {
        Campaign {
            seed: 7,
            ..with("standard", set)
        }
    }

    fn noise(campaign: &Campaign, trial: u64) -> Vec<f64> {
        let errors = sensor_errors(campaign, trial).unwrap();
        let mut numbers = vec![0.0; 8];
        errors
            .normal
            .draw(NoiseDraw::Tick(5), Sensor::Gyro, &mut numbers);
        numbers
    }

    #[test]
    fn draws_are_the_same_on_every_machine_and_version() {
        let campaign = campaign(&["push.impulse_n_s={uniform=[1,3]}"]);
        assert_eq!(stream(7, 3, IMPULSE).random::<u64>(), 620569656280253422);
        assert_eq!(push(&campaign, 3).impulse_n_s, 1.0672822969517632);
        assert_eq!(
            noise(&campaign, 3)[..2],
            [-0.5153864478030405, 0.3668892082252608]
        );
    }

    #[test]
    fn a_trial_depends_on_no_other_and_on_the_seed() {
        let campaign = campaign(&[]);
        let forward: Vec<Push> = (0..50).map(|i| push(&campaign, i)).collect();
        let fewer = Campaign {
            trials: 50,
            ..campaign.clone()
        };
        assert!(
            (0..50)
                .rev()
                .all(|i| push(&fewer, i) == forward[i as usize])
        );
        assert_ne!(forward[0].impulse_n_s, forward[1].impulse_n_s);
        assert_ne!(noise(&campaign, 0), noise(&campaign, 1));
        assert_ne!(
            push(
                &Campaign {
                    seed: 8,
                    ..campaign
                },
                0
            ),
            forward[0]
        );
    }

    /// Each quantity is drawn from its own random numbers: to draw one more, or from another range, changes no other.
    #[test]
    fn each_quantity_has_a_stream_of_its_own() {
        let all = |changed: Option<&str>| {
            let mut set = vec![
                "second_push={impulse_n_s={uniform=[0, 1]}, after_s={uniform=[0, 1]}}".to_string(),
            ];
            // The push starts after the ground has tilted.
            set.push("push.start_s=1".into());
            set.push("push.height_m={uniform=[0, 0.02]}".into());
            for (field, [least, most]) in variations::bounds(&with("standard", &[]).units).list() {
                let middle = 0.5 * (least + most);
                let [a, b] = if changed == Some(field) {
                    [middle, most]
                } else {
                    [least, middle]
                };
                set.push(format!("variations.{field}={{uniform=[{a}, {b}]}}"));
            }
            set.extend(changed.filter(|key| key.contains('=')).map(String::from));
            campaign(&set.iter().map(String::as_str).collect::<Vec<_>>())
        };
        let before = all(None);
        for (name, what) in VARIATION.list() {
            let after = all(Some(name));
            for i in 0..5 {
                let (a, b) = (variation(&before, i).list(), variation(&after, i).list());
                assert!(
                    a.iter().zip(&b).all(|(a, b)| (a.1 == b.1) == (a.0 != name)),
                    "{name}: {a:?} {b:?}"
                );
                assert_eq!(
                    (pushes(&before, i), noise(&before, i)),
                    (pushes(&after, i), noise(&after, i))
                );
            }
            assert_eq!(
                VARIATION
                    .list()
                    .iter()
                    .filter(|(_, other)| *other == what)
                    .count(),
                1,
                "{name}"
            );
        }
        let after = all(Some("push.height_m=0"));
        for i in 0..5 {
            let (a, b) = (push(&before, i), push(&after, i));
            assert!(
                a.height_m != b.height_m
                    && a == Push {
                        height_m: a.height_m,
                        ..b
                    }
            );
        }
        // No two quantities are drawn from the same random numbers.
        let shares = variation(&before, 0)
            .zip(variations::bounds(&before.units))
            .list();
        let shares: Vec<f64> = shares
            .iter()
            .map(|(_, (v, [least, most]))| (v.unwrap() - least) / (most - least))
            .collect();
        for (i, share) in shares.iter().enumerate() {
            let mut others = shares[..i].iter();
            assert!(
                others.all(|other| (other - share).abs() > 1e-6),
                "{shares:?}"
            );
        }
    }

    #[test]
    fn draws_fill_their_range_and_stay_in_bounds() {
        let normal = campaign(&["push.impulse_n_s={normal=[0.5, 1]}"]);
        assert!((0..2000).all(|i| push(&normal, i).impulse_n_s >= 0.0));
        let standard = campaign(&[]);
        let drawn: Vec<_> = (0..400).map(|i| variation(&standard, i).list()).collect();
        for (k, (name, variations::Varied(distribution))) in
            standard.variations.list().into_iter().enumerate()
        {
            let values: Vec<f64> = drawn.iter().filter_map(|values| values[k].1).collect();
            let Some(Distribution::Uniform { uniform: [a, b] }) = distribution else {
                assert!(values.is_empty(), "{name}");
                continue;
            };
            let [low, high] =
                [f64::min, f64::max].map(|f| values.iter().copied().reduce(f).unwrap());
            let slack = 0.02 * (b - a);
            assert!(
                low >= a && high <= b && low < a + slack && high > b - slack,
                "{name}: {low} to {high}"
            );
        }
        let nominal = with("nominal", &[]);
        assert_eq!(
            (variation(&nominal, 3), pushes(&nominal, 3).len()),
            (Variation::default(), 1)
        );
        let ideal = campaign(&["sensors.noise_scale=0", "sensors.bias_scale=0"]);
        assert!(
            [nominal, ideal]
                .iter()
                .all(|campaign| sensor_errors(campaign, 3).is_none())
        );
    }

    #[test]
    fn lists_are_taken_in_turn_in_all_combinations() {
        let listed = campaign(&[
            "push.impulse_n_s={each=[1, 2, 3]}",
            "push.heading_deg={each=[0, 90]}",
        ]);
        let drawn = (0..6).map(|i| push(&listed, i));
        let pairs: Vec<_> = drawn
            .map(|push| (push.impulse_n_s, push.heading_deg))
            .collect();
        let first = [(1.0, 0.0), (2.0, 0.0), (3.0, 0.0)];
        assert_eq!(pairs[..3], first);
        assert_eq!(
            pairs[3..],
            first.map(|(impulse_n_s, _)| (impulse_n_s, 90.0))
        );
        assert_eq!(push(&listed, 605).impulse_n_s, 3.0);
        for (set, words) in [
            (
                "variations.friction={each=[0.5, 1]}",
                "only [push] takes a list",
            ),
            (
                "push.heading_deg={each=[0, 400]}",
                "push.heading_deg.each = 400",
            ),
            (
                "push.heading_deg={each=[]}",
                "a list of 0 values, expected 1 to 24",
            ),
        ] {
            let overrides = crate::ask::spec::Overrides {
                set: vec![set.into()],
                ..Default::default()
            };
            let error = Campaign::load("standard", &overrides).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn neighbours_differ_a_little_in_push_and_noise_alone() {
        const COUNT: usize = 8;
        let campaign = campaign(&[]);
        let of_trial = disturbance(&campaign, 3);
        let near: Vec<_> = (0..COUNT)
            .map(|i| neighbour(&campaign, 3, i, COUNT))
            .collect();
        let shares = near
            .iter()
            .map(|near| near.pushes[0].impulse_n_s / of_trial.pushes[0].impulse_n_s - 1.0);
        let late_s = near
            .iter()
            .map(|near| near.pushes[0].start_s - of_trial.pushes[0].start_s);
        for (differences, most) in [
            (shares.collect::<Vec<f64>>(), 0.03),
            (late_s.collect(), 0.01),
        ] {
            let mut sorted = differences.clone();
            sorted.sort_by(f64::total_cmp);
            sorted.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            assert_eq!(sorted.len(), COUNT, "{differences:?}");
            assert!((sorted[0] + most).abs() < 1e-12 && (sorted[COUNT - 1] - most).abs() < 1e-12);
        }
        let first_noise = |disturbance: &Disturbance| {
            let mut numbers = [0.0; 3];
            let errors = disturbance.sensor_errors.as_ref().unwrap();
            errors
                .normal
                .draw(NoiseDraw::Tick(5), Sensor::Gyro, &mut numbers);
            numbers
        };
        for near in &near {
            assert_eq!(near.variation, of_trial.variation);
            assert_ne!(first_noise(near), first_noise(&of_trial));
        }
    }

    #[test]
    fn a_second_push_comes_after_the_first() {
        let campaign =
            campaign(&["second_push={impulse_n_s={uniform=[1, 2]}, after_s={normal=[0.5, 0.5]}}"]);
        for i in 0..50 {
            let [first, second] = pushes(&campaign, i)[..] else {
                panic!()
            };
            assert!(
                second.start_s >= first.end_s() && second.end_s() <= 0.75 * 6.0 + 1e-9,
                "{first:?} {second:?}"
            );
            assert_eq!(
                (second.height_m, second.duration_s),
                (first.height_m, first.duration_s)
            );
            assert_eq!(first, push(&campaign, i));
        }
    }

    /// The numbers of a sensor are standard normal and independent, over ticks, channels and sensors. A reading does
    /// not depend on earlier readings.
    #[test]
    fn noise_is_white_and_a_function_of_trial_tick_sensor_and_channel() {
        let normal = sensor_errors(&campaign(&[]), 3).unwrap().normal;
        let draw = |tick: u64, sensor: Sensor| {
            let mut numbers = [0.0; 3];
            normal.draw(NoiseDraw::Tick(tick), sensor, &mut numbers);
            numbers
        };
        const TICKS: u64 = 20_000;
        let mut sums = [0.0; 4];
        for tick in 0..TICKS {
            let (a, b) = (draw(tick, Sensor::Gyro), draw(tick, Sensor::JointSpeeds));
            let products = [
                a[0],
                a[0] * a[0],
                a[0] * b[0] + a[0] * a[1],
                a[0] * draw(tick + 1, Sensor::Gyro)[0],
            ];
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += product / TICKS as f64;
            }
        }
        // Five standard errors of each mean.
        let limits =
            [1.0, 2.0, 2.0, 1.0].map(|variance: f64| 5.0 * (variance / TICKS as f64).sqrt());
        let expected = [0.0, 1.0, 0.0, 0.0];
        assert!(
            (0..4).all(|i| (sums[i] - expected[i]).abs() < limits[i]),
            "{sums:?}, within {limits:?}"
        );
        let again = draw(7, Sensor::Accelerometer);
        assert_eq!(draw(7, Sensor::Accelerometer), again);
        let mut one = [0.0];
        normal.draw(NoiseDraw::Tick(7), Sensor::Accelerometer, &mut one);
        assert_eq!(one[0], again[0], "another channel changes no other");
    }
}
