//! The paper's own simulation (Sect. V.C): a ZMP error is imposed on the ideal pendulum, and the whole body follows by
//! inverse kinematics. The simulation has no physics but eq. 1 and 2. The controller reads the pendulum's state, the
//! ZMP equals the desired ZMP, and a foot lands when its path ends.
//!
//! The paper does not give the state to which the error belongs, so there are two variants. With [`Start::AtRest`] the
//! COM starts at rest, and the error is only handed to the footwork rule: the paper's section is about generating the
//! motion, and its second error is more than one footstep can recover. With [`Start::Moving`] the COM has the velocity
//! at which the slowest gain produces the error.

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};
use standfast::core::control::estimate::{Estimate, Estimator};
use standfast::core::control::{Balance, Design, FootworkRules, home_polygon};
use standfast::core::error::{Error, Result};
use standfast::core::lipm::pendulum::State;
use standfast::core::lipm::{OnlineSets, Pendulum};
use standfast::core::robot::{Kinematics, PerFoot, Robot};
use standfast::core::socket::{Command, TickError};
use standfast::sim::episode::footsteps::FootstepLog;
use standfast::sim::episode::{EpisodeConfig, Footstep, Lifted, Tick, home_distance};
use standfast::sim::{Ground, Truth};
use std::sync::Arc;

/// How the COM moves when the error is imposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// The COM rests at home, and only the footwork rule is given the error.
    #[default]
    AtRest,
    /// The COM has the velocity at which the slowest gain asks for a ZMP that is outside of the support polygon by the
    /// error.
    Moving,
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ImposedRecord {
    /// The imposed error, control frame.
    pub zmp_error_m: [f64; 2],
    /// Velocity of the COM at the start, and the impulse that produces it.
    pub com_vel_m_s: [f64; 2],
    pub impulse_n_s: f64,
    pub footsteps: Vec<Footstep>,
    /// The footstep in the air at the end.
    pub unfinished_footstep: Option<Lifted>,
    /// Time from which the COM stays within the judge's radius of the point midway between the soles; None if the COM
    /// does not come home.
    pub home_at_s: Option<f64>,
    /// Time at which the DCM was farther from the point midway between the soles than any footstep reaches. The run
    /// ends then.
    pub lost_at_s: Option<f64>,
    /// Largest horizontal distance between the body's COM and the pendulum's.
    pub worst_com_error_m: f64,
    /// Lowest height of the body's COM.
    pub lowest_com_m: f64,
}

/// Imposes `zmp_error` (m, control frame) at t = 0 on a robot at home. The gain set's patience is taken as 0. The truth
/// that `observe` sees is the pendulum's COM and ZMP, and the posture from inverse kinematics. It returns an error if
/// the gain set takes no footsteps or none for this error, or if no COM velocity produces the error.
pub fn run(
    robot: &Robot,
    design: &Design,
    config: &EpisodeConfig,
    zmp_error: Vector2<f64>,
    start: Start,
    observe: &mut dyn FnMut(&Tick),
) -> Result<ImposedRecord> {
    let design = without_patience(design);
    let com = Estimate::at_home(robot).com_xy();
    let com_vel = match start {
        Start::AtRest => Vector2::zeros(),
        Start::Moving => velocity_for(robot, &design, com, zmp_error)?,
    };
    let mut ideal = Ideal::new(robot, &design, State::new(com, com_vel, com));
    if start == Start::AtRest && !ideal.balance.lift_for(&mut ideal.estimator, zmp_error) {
        return Err(refused(
            &design,
            zmp_error,
            "leads to no footstep with this gain set",
        ));
    }
    let mut log = FootstepLog::default();
    let mut kinematics = Kinematics::new(robot);
    let mut record = ImposedRecord {
        zmp_error_m: zmp_error.into(),
        com_vel_m_s: com_vel.into(),
        impulse_n_s: robot.mass() * com_vel.norm(),
        lowest_com_m: robot.home_com_height(),
        ..ImposedRecord::default()
    };
    for _ in 0..=(config.horizon_s / config.control_period_s).round() as u64 {
        let tick = ideal.tick();
        observe(&tick);
        let Truth {
            time_s,
            com,
            soles,
            posture,
            ..
        } = tick.truth;
        log.watch(*time_s, soles, &tick.report);
        kinematics.update(robot, posture);
        record.lowest_com_m = record.lowest_com_m.min(kinematics.com().z);
        record.worst_com_error_m = record
            .worst_com_error_m
            .max((kinematics.com().xy() - com.xy()).norm());
        let away = tick.report.footstep.is_some()
            || home_distance(com.xy(), soles) > config.judge.home_radius_m;
        record.home_at_s = if away {
            None
        } else {
            record.home_at_s.or(Some(*time_s))
        };
        let is_lost = home_distance(tick.dcm, soles) > LOST_HEIGHTS * robot.home_com_height();
        record.lost_at_s = is_lost.then_some(*time_s);
        if is_lost {
            break;
        }
        ideal.advance();
    }
    if let Some(error) = ideal.failed {
        return Err(Error::Numeric {
            what: design.family.name,
            problem: error.to_string(),
        });
    }
    record.footsteps = log.taken;
    record.unfinished_footstep = log.lifted;
    Ok(record)
}

/// Distance beyond which the robot is lost, in COM heights at home.
const LOST_HEIGHTS: f64 = 1.5;

/// The ideal pendulum in a closed loop with the controller, with a body that follows it.
struct Ideal<'a> {
    robot: &'a Robot,
    pendulum: Pendulum,
    balance: Balance,
    estimator: Estimator,
    command: Command,
    state: State,
    ticks: u64,
    truth: Truth,
    failed: Option<TickError>,
}

impl<'a> Ideal<'a> {
    fn new(robot: &'a Robot, design: &Design, state: State) -> Self {
        let estimator = Estimator::new(robot, design.family.pendulum.dt);
        Self {
            robot,
            pendulum: design.family.pendulum,
            balance: Balance::new(Arc::new(design.clone()), estimator.now()),
            command: design.home_command().clone(),
            state,
            ticks: 0,
            truth: Truth::at_rest(robot.home_posture(), estimator.now().com, Ground::default()),
            failed: None,
            estimator,
        }
    }

    /// Sets the estimate of an ideal robot: the pendulum's state, with a foot loaded once its path has ended.
    fn sense(&mut self) {
        let in_air = self
            .balance
            .swing()
            .filter(|swing| !swing.is_due())
            .map(|swing| swing.footstep.foot);
        let share = 0.5 * self.robot.weight_n();
        let load_n = PerFoot::from_fn(|foot| if in_air == Some(foot) { 0.0 } else { share });
        self.estimator.set_motion(&self.state, load_n);
    }
}

impl Ideal<'_> {
    /// Runs one tick of the controller on the present state, and returns the tick. It is called once per control
    /// period.
    fn tick(&mut self) -> Tick<'_> {
        self.sense();
        if let Err(error) = self.balance.tick(&mut self.estimator, &mut self.command) {
            self.failed = Some(error);
        }
        let Self {
            robot,
            balance,
            estimator,
            truth,
            state,
            ..
        } = self;
        let account = balance.account(estimator.now());
        let zmp = account.zmp_ref;
        truth.posture.clone_from(account.posture_ref);
        estimator.place(robot, &truth.posture);
        let estimate = estimator.now();
        truth.time_s = self.ticks as f64 * self.pendulum.dt;
        (truth.com.x, truth.com.y) = (state.com().x, state.com().y);
        truth.com_vel = estimate.com_vel;
        (truth.zmp, truth.soles) = (Some(zmp.into()), estimate.soles);
        Tick::new(
            robot,
            self.pendulum.omega,
            truth,
            balance.account(estimate).report(),
            &self.command,
        )
    }

    /// Moves the pendulum, with its ZMP equal to the desired one.
    fn advance(&mut self) {
        let zmp = self.balance.account(self.estimator.now()).zmp_ref;
        let held = State::new(self.state.com(), self.state.com_vel(), zmp);
        self.state = State {
            x: self.pendulum.step(&held.x, 0.0),
            y: self.pendulum.step(&held.y, 0.0),
        };
        self.ticks += 1;
    }
}

/// The same design with a patience of 0: a footstep starts at the first tick at which the state is in no CPI set.
fn without_patience(design: &Design) -> Design {
    let mut design = design.clone();
    if let Some(FootworkRules::Stepping(rules)) = &mut design.footwork {
        rules.patience_s = 0.0;
    }
    design
}

/// The velocity (m/s) of a COM at `com` (world and control frame) for which the slowest gain produces `zmp_error`.
fn velocity_for(
    robot: &Robot,
    design: &Design,
    com: Point2<f64>,
    zmp_error: Vector2<f64>,
) -> Result<Vector2<f64>> {
    let family = &design.family;
    if family.gains.is_empty() {
        return Err(refused(design, zmp_error, "the gain set has no gains"));
    }
    let z = family.allowed_support(&home_polygon(robot), &family.name)?;
    let mut sets = OnlineSets::new(family);
    sets.update(&z);
    let Some(edge) = z.distance_along(Point2::origin(), zmp_error) else {
        return Err(refused(design, zmp_error, "has no direction"));
    };
    // The first guess has the DCM at the ZMP that the error asks for, which is close. Each round corrects it by the
    // missing part of the error.
    let farthest = Point2::from(zmp_error.normalize() * edge) + zmp_error;
    let mut velocity = (farthest - com) * family.pendulum.omega;
    for _ in 0..1000 {
        let missing = zmp_error - sets.zmp_error(0, &State::new(com, velocity, com));
        if missing.norm() < 1e-5 * zmp_error.norm() {
            return Ok(velocity);
        }
        velocity += missing * family.pendulum.omega;
    }
    Err(refused(design, zmp_error, "no COM velocity produces it"))
}

fn refused(design: &Design, zmp_error: Vector2<f64>, problem: &str) -> Error {
    let value = format!("[{}, {}]", zmp_error.x, zmp_error.y);
    let accepted = "a ZMP error of a few centimetres, and a gain set with a [stepping] table";
    Error::value(&design.family.name, "zmp_error_m", value, problem, accepted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast::core::control::FootworkRules;

    use standfast::core::lipm::stepping::{LandingRange, RelaxationWeights, Stepping};
    use standfast::core::robot::Foot;

    /// Rules that do not depend on the tuning of a gain set.
    const EXAMPLE: Stepping = Stepping {
        patience_s: 0.0,
        alpha: 4.0,
        range: LandingRange {
            forward_m: 0.15,
            outward_m: 0.18,
            least_m: 0.075,
        },
        swing_time_s: 0.2,
        lift_m: 0.025,
        lambda: 5.0,
        weights: RelaxationWeights {
            dcm: 1.0,
            com: 0.1,
            zmp: 0.01,
        },
        late_s: 0.12,
        pause_s: 0.03,
        same_foot_pause_s: 0.3,
    };

    /// The gain set `paper`, with its own stepping rules or with those given.
    fn bench(stepping: Option<Stepping>) -> (Robot, Design) {
        let robot = standfast::robots::load("ut-mu2").unwrap();
        let mut design = Design::new(&robot, &crate::gain_set("paper").unwrap(), 0.002).unwrap();
        design.footwork = stepping.map(FootworkRules::Stepping).or(design.footwork);
        (robot, design)
    }

    fn config(robot: &Robot) -> EpisodeConfig {
        EpisodeConfig {
            horizon_s: 3.0,
            ..EpisodeConfig::of(&standfast::core::robot::Units::of(robot))
        }
    }

    fn impose(
        (robot, design): &(Robot, Design),
        error: [f64; 2],
        start: Start,
    ) -> Result<ImposedRecord> {
        run(
            robot,
            design,
            &config(robot),
            error.into(),
            start,
            &mut |_| {},
        )
    }

    /// The errors of Fig. 8 (a) and (b) in Sect. V.C.
    #[test]
    fn the_papers_two_errors_make_the_right_foot_step_that_way() {
        for rules in [None, Some(EXAMPLE)] {
            let bench = bench(rules);
            for error in [[-0.03, 0.0], [-0.03, -0.0685]] {
                let record = impose(&bench, error, Start::AtRest).unwrap();
                let [footstep] = record.footsteps[..] else {
                    panic!("{record:?}")
                };
                assert_eq!(footstep.foot, Foot::Right);
                assert_eq!(footstep.zmp_error_m, Some(error));
                assert!(
                    footstep.in_set_at_landing.unwrap() && record.home_at_s.is_some(),
                    "{record:?}"
                );
                assert_eq!(record.lost_at_s, None);
                assert_eq!(record.com_vel_m_s, [0.0, 0.0]);
                // The foot moves along the error.
                let [x, y] = [0, 1].map(|i| footstep.to_m[i] - footstep.from_m[i]);
                let (along, across) = (x * error[0] + y * error[1], x * error[1] - y * error[0]);
                assert!(along > 0.0 && across.abs() < 1e-3 * along, "{footstep:?}");
                assert!(record.worst_com_error_m < 2e-3, "{record:?}");
            }
        }
    }

    #[test]
    fn a_mirrored_error_moves_the_other_foot() {
        let bench = bench(Some(EXAMPLE));
        let [one, other] =
            [-0.0685, 0.0685].map(|y| impose(&bench, [-0.03, y], Start::AtRest).unwrap());
        assert_eq!(other.footsteps[0].foot, Foot::Left);
        let ([x, y, _], [mirrored_x, mirrored_y, _]) =
            (one.footsteps[0].to_m, other.footsteps[0].to_m);
        // In the robot's model the two legs differ by some micrometres.
        assert!(
            (x - mirrored_x).abs() < 1e-4 && (y + mirrored_y).abs() < 1e-4,
            "{one:?} {other:?}"
        );
    }

    /// The footstep follows from the CPI sets and the motion of the COM; the caller imposes none.
    #[test]
    fn a_moving_com_makes_the_error_that_was_asked_for() {
        for error in [[-0.03, 0.0], [0.03, 0.0], [0.0, -0.02], [-0.02, -0.02]] {
            let record = impose(&bench(Some(EXAMPLE)), error, Start::Moving).unwrap();
            let seen = record.footsteps[0].zmp_error_m.unwrap();
            assert!(
                (0..2).all(|i| (seen[i] - error[i]).abs() < 1e-4),
                "{seen:?} for {error:?}"
            );
            assert_eq!(record.footsteps[0].lift_s, 0.0);
            let [vx, vy] = record.com_vel_m_s;
            assert!(vx * error[0] + vy * error[1] > 0.0, "{record:?}");
            let robot = standfast::robots::load("ut-mu2").unwrap();
            assert!((record.impulse_n_s - robot.mass() * vx.hypot(vy)).abs() < 1e-12);
        }
        let record = impose(&bench(None), [-0.03, 0.0], Start::Moving).unwrap();
        assert!(
            record.footsteps[0].in_set_at_landing.unwrap() && record.home_at_s.is_some(),
            "{record:?}"
        );
        assert!(record.worst_com_error_m < 2e-3, "{record:?}");
    }

    /// The COM that the observer sees obeys eq. 1 with the ZMP that it sees.
    #[test]
    fn the_pendulum_obeys_eq_1_at_every_tick() {
        let (robot, design) = bench(Some(EXAMPLE));
        let omega = design.family.pendulum.omega;
        let mut ticks = Vec::new();
        run(
            &robot,
            &design,
            &config(&robot),
            [-0.03, -0.0685].into(),
            Start::AtRest,
            &mut |tick| {
                let zmp = Point2::from(tick.truth.zmp.unwrap());
                ticks.push((tick.truth.com.xy(), tick.truth.com_vel.xy(), zmp));
            },
        )
        .unwrap();
        assert_eq!(ticks.len(), 1501);
        for (k, pair) in ticks.windows(2).enumerate() {
            let [(com, vel, zmp), (_, next_vel, _)] = pair else {
                unreachable!()
            };
            let acceleration = (next_vel - vel) / 0.002;
            let wanted = (com + vel * 0.001 - zmp) * (omega * omega);
            assert!(
                (acceleration - wanted).norm() < 1e-3,
                "tick {k}: {acceleration} {wanted}"
            );
        }
    }

    #[test]
    fn what_makes_no_footstep_is_refused() {
        let with = bench(None);
        for (error, start, words) in [
            (
                [0.0, 0.0],
                Start::AtRest,
                "paper: zmp_error_m = [0, 0]: leads to no footstep with this gain set; accepted: a ZMP error",
            ),
            (
                [f64::NAN, 0.0],
                Start::Moving,
                "paper: zmp_error_m = [NaN, 0]: no COM velocity produces it",
            ),
        ] {
            let message = impose(&with, error, start).unwrap_err().to_string();
            assert!(message.starts_with(words), "{message}");
        }
        let robot = standfast::robots::load("ut-mu2").unwrap();
        for (gains, start) in [("switching", Start::AtRest), ("fixed", Start::AtRest)] {
            let design = Design::new(&robot, &crate::gain_set(gains).unwrap(), 0.002).unwrap();
            let refused = run(
                &robot,
                &design,
                &config(&robot),
                [-0.03, 0.0].into(),
                start,
                &mut |_| {},
            );
            assert!(refused.is_err(), "{gains}");
        }
    }
}
