//! The controller alone, as it is used with another simulator or a robot: it survives any readings, and starts in the
//! robot's posture.

use crate::common::Bench;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use standfast_core::control::{CpiController, Phase};
use standfast_core::robot::{Foot, Kinematics, PerFoot, Posture, Robot};
use standfast_core::socket::{Command, Controller, Imu, Sensed, SensedError, TickError, Wrench};

const SETS: [&str; 3] = ["switching", "paper", "catch"];

/// Readings of a robot at rest whose weight is shared by both feet.
fn at_rest(robot: &Robot, q: &[f64], orientation: UnitQuaternion<f64>) -> Sensed {
    let force = Vector3::new(0.0, 0.0, 0.5 * robot.weight_n());
    let still = [Vector3::zeros(); 2];
    Sensed {
        time_s: 0.0,
        q: q.to_vec(),
        dq: vec![0.0; q.len()],
        imu: Imu::over(0.002, orientation, still, Vector3::zeros()),
        soles: PerFoot::from_fn(|_| Wrench {
            force,
            moment: Vector3::zeros(),
        }),
    }
}

fn home(robot: &Robot) -> Sensed {
    at_rest(robot, &robot.home_rad, UnitQuaternion::identity())
}

/// Readings with one invalid value of each kind, and what the error must say.
fn bad_samples(good: &Sensed) -> Vec<(Sensed, &'static str)> {
    let with = |change: &dyn Fn(&mut Sensed), words| {
        let mut sensed = good.clone();
        change(&mut sensed);
        (sensed, words)
    };
    vec![
        with(&|s| s.q[3] = f64::NAN, "q[3] = NaN: is not a valid reading"),
        with(&|s| s.q[0] = 1e7, "q[0] = 10000000: is not a valid reading"),
        with(
            &|s| s.q.truncate(5),
            "q has 5 values; accepted: one for each of the robot's 20 joints",
        ),
        with(&|s| s.q.push(0.0), "q has 21 values"),
        with(&|s| s.imu.gyro.y = f64::INFINITY, "imu.gyro[1] = inf"),
        with(
            &|s| s.imu.accelerometer.z = f64::NAN,
            "imu.accelerometer[2] = NaN",
        ),
        with(&|s| s.soles.left.force.z = f64::NAN, "soles.force[2] = NaN"),
        with(
            &|s| s.soles.right.moment.x = f64::NEG_INFINITY,
            "soles.moment[0] = -inf",
        ),
        with(
            &|s| {
                s.imu.orientation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(
                    f64::NAN,
                    0.0,
                    0.0,
                    0.0,
                ))
            },
            "imu.orientation[3] = NaN",
        ),
    ]
}

/// An invalid sample is refused and the command stays. Afterwards the controller acts as if the sample had never come.
#[test]
fn a_bad_sample_is_refused_and_leaves_no_trace() {
    for gains in SETS {
        let bench = Bench::new(gains);
        let good = home(&bench.robot);
        let new = || CpiController::new(bench.design().clone());
        let (mut controller, mut twin) = (new(), new());
        let (mut command, mut of_twin) = (
            Command::hold(&bench.robot.home_rad),
            Command::hold(&bench.robot.home_rad),
        );
        controller.tick(&good, &mut command).unwrap();
        twin.tick(&good, &mut of_twin).unwrap();
        for (bad, words) in bad_samples(&good) {
            let before = command.clone();
            let error = controller.tick(&bad, &mut command).unwrap_err();
            assert!(
                error.to_string().starts_with(words),
                "{gains}: {error}\nwanted: {words}"
            );
            assert_eq!(command, before, "{gains}: {words}");
            controller.tick(&good, &mut command).unwrap();
            twin.tick(&good, &mut of_twin).unwrap();
            assert_eq!(command, of_twin, "{gains}: {words}");
        }
        let short = Sensed { q: vec![], ..good };
        let refused = Err(TickError::Sensed(SensedError::WrongLength {
            field: "q",
            length: 0,
            joints: 20,
        }));
        assert_eq!(controller.tick(&short, &mut command), refused);
    }
}

/// The robot has its joints bent more than at home, is turned and leans. It is found with its feet on the ground, and
/// the first commands are near its posture.
#[test]
fn it_starts_from_the_posture_that_it_senses() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let q: Vec<f64> = robot.home_rad.iter().map(|angle| 1.1 * angle).collect();
    let orientation = UnitQuaternion::from_euler_angles(0.0, 0.05, 0.8);
    let sensed = at_rest(&robot, &q, orientation);
    for gains in SETS {
        let bench = Bench::new(gains);
        let mut controller = CpiController::starting_from(bench.design().clone(), &sensed).unwrap();
        let estimate = controller.account().estimate.clone();
        assert_eq!(estimate.posture.q, q);
        let kinematics = Kinematics::at(
            &robot,
            &Posture {
                base: estimate.posture.base,
                q: q.clone(),
            },
        );
        assert!((estimate.com - kinematics.com()).norm() < 1e-12 && estimate.com_vel.norm() == 0.0);
        assert!(
            kinematics
                .link_pose(robot.trunk)
                .rotation
                .angle_to(&orientation)
                < 1e-12
        );
        assert!(estimate.in_contact.left && estimate.in_contact.right);
        let low = |foot: Foot| {
            let pose: Isometry3<f64> = kinematics.sole_pose(&robot, foot);
            robot.soles[foot]
                .corners()
                .map(|corner| (pose * corner).z)
                .into_iter()
                .fold(f64::INFINITY, f64::min)
        };
        assert!(low(Foot::Left).min(low(Foot::Right)).abs() < 1e-12);
        let mut command = Command::hold(&q);
        controller.tick(&sensed, &mut command).unwrap();
        assert!((controller.account().support().frame.rotation.angle() - 0.8).abs() < 0.01);
        let leap = command
            .q_ref
            .iter()
            .zip(&q)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(leap < 0.25, "{gains}: {leap} rad");
    }
}

/// After a fall and a restart, nothing of the earlier state of the controller remains.
#[test]
fn it_starts_again_after_a_fall() {
    for gains in SETS {
        let bench = Bench::new(gains);
        let robot = &bench.robot;
        let mut controller = CpiController::new(bench.design().clone());
        let mut command = Command::hold(&robot.home_rad);
        for k in 0..300 {
            let lying = UnitQuaternion::from_euler_angles(0.0, (0.01 * f64::from(k)).min(1.5), 0.0);
            let mut sensed = at_rest(robot, &robot.home_rad, lying);
            sensed.soles = PerFoot::default();
            controller.tick(&sensed, &mut command).unwrap();
        }
        controller.restart(&home(robot)).unwrap();
        let mut new = CpiController::starting_from(bench.design().clone(), &home(robot)).unwrap();
        let mut of_new = Command::hold(&robot.home_rad);
        for _ in 0..50 {
            controller.tick(&home(robot), &mut command).unwrap();
            new.tick(&home(robot), &mut of_new).unwrap();
            assert_eq!(command, of_new, "{gains}");
        }
        assert_eq!(controller.account().phase, Phase::Switching, "{gains}");
    }
}

/// Readings of every magnitude, including invalid ones.
fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0f64,
        2 => -1e3..1e3f64,
        1 => -1e6..1e6f64,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(1e-300)],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), failure_persistence: None, cases: 60, ..Default::default() })]

    /// The controller never panics, every command is finite, and good samples work again at once.
    #[test]
    fn nothing_that_it_senses_breaks_it(
        readings in proptest::collection::vec(proptest::collection::vec(wild(), 20 + 4 + 6 + 12), 1..12)
    ) {
        for gains in SETS {
            let bench = bench(gains);
            let good = home(&bench.robot);
            let mut controller = CpiController::new(bench.design().clone());
            let mut command = Command::hold(&bench.robot.home_rad);
            for r in &readings {
                let v = |i: usize| Vector3::new(r[i], r[i + 1], r[i + 2]);
                // Loads may be as large as the square of other readings.
                let load = |i: usize| v(i).map(|x| x * x.abs());
                let turn = nalgebra::Quaternion::new(r[20], r[21], r[22], r[23]);
                let orientation =
                    if r[0] > 0.0 { UnitQuaternion::new_normalize(turn) } else { UnitQuaternion::new_unchecked(turn) };
                let sensed = Sensed {
                    time_s: r[0],
                    q: r[..20].to_vec(),
                    dq: r[20..40].to_vec(),
                    imu: Imu { orientation, gyro: v(24), accelerometer: v(27) },
                    soles: PerFoot {
                        left: Wrench { force: load(30), moment: load(33) },
                        right: Wrench { force: load(36), moment: load(39) },
                    },
                };
                _ = controller.tick(&sensed, &mut command);
                prop_assert!(command.check(20).is_ok(), "{}", gains);
            }
            // After a sample without a solution, the controller needs at most one sample to restart.
            let works = (0..2).any(|_| controller.tick(&good, &mut command).is_ok());
            prop_assert!(works && command.check(20).is_ok(), "{}", gains);
        }
    }
}

/// The benches are prepared once for all cases.
fn bench(gains: &str) -> &'static Bench {
    use std::sync::LazyLock;
    static BENCHES: LazyLock<[Bench; 3]> = LazyLock::new(|| SETS.map(Bench::new));
    &BENCHES[SETS.iter().position(|name| *name == gains).unwrap()]
}
