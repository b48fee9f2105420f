//! Footsteps that are planned anew at every tick while the foot is in the air. The paper leaves this out.
//!
//! A foot is lifted as soon as the state is in no CPI set and the DCM is outside of the support polygon. Of all
//! footsteps, of either foot to any [landing region](LandingRegion), the footstep with the least cost is taken
//! ([`plan`]). If the legs cross, the foot goes around the stance leg, and the trunk turns (`TURN`). At every tick after
//! the lift, landing place and ZMP are planned anew from the estimate, so both follow the DCM. The torques are those of
//! the moving body ([`InverseDynamics`]), since a leg that swings within 0.2 s pushes the rest of the body off its
//! course. They also bring the swing foot back to its path (`RETURNING`), and so do the joints of its leg, from the
//! trunk as it is (`AS_IT_IS`). Until the next lift, a foot that hangs in the air is kept there (`SINKS`). In a footstep
//! home the foot is led in the same way: as soon as the footstep would not catch the DCM, its landing place is planned
//! anew.

use super::footwork::{Footwork, StepState};
use super::home::WayHome;
use super::quintic::Quintic;
use super::reach::{aimed_m, time_s};
use super::swing::{LATE_SPEED, PlannedFootstep, Swing, SwingTiming, Way};
use crate::control::body::{
    Body, BodyTargets, ContactModel, DesiredAcceleration, InverseDynamics, InverseKinematics,
    RISING, SoleReference,
};
use crate::control::design::Design;
use crate::control::estimate::on_ground;
use crate::lipm::catching::{CatchPlan, CatchProblem, Catching, Departure, Departures, plan};
use crate::robot::swing_shape::least_jerk;
use crate::robot::{Foot, LandingRegion, PerFoot, Pose};
use crate::socket::{Command, TickError};
use nalgebra::{Isometry2, Point2, Point3, Vector2, Vector3};

/// Least time to the landing that the plan assumes, in ticks. It matters for a foot that is late.
const LATE_TICKS: f64 = 5.0;
/// Number of Newton steps per tick for the posture at landing, which changes with the landing place.
const AHEAD_STEPS: usize = 3;
/// Time after a landing during which its impact changes the velocity of the COM, in 1/omega.
const IMPACT: f64 = 0.11;
/// Lead of the swing ([`SwingTiming::lead`]). A foot often comes down before its time, and then hits the ground at the
/// speed of its path.
const LEAD: f64 = 0.15;
/// Rate at which a swing sole returns to its path (critically damped), in omega. The joints follow a robot whose stance
/// sole is flat and whose trunk is upright. A push turns both, so that the foot would come down early and short.
const RETURNING: f64 = 6.0;
/// Share of the angles of the swing leg that follow from the trunk as it is; the rest follows from an upright trunk. A push
/// turns the trunk. If the swing leg helped to stand it up, it would swing back at the lift, and land late and short.
const AS_IT_IS: f64 = 0.85;
/// The same for the rest of the body. If a swing stood the trunk up at once, the body would be thrown off the ground.
const TRUNK_AS_IT_IS: f64 = 0.5;
/// Drop of the target of a foot that hangs in the air while the other one stands, below the foot (COM heights), and by how
/// much it grows per 1/omega once `HANGS` has passed since the landing (1/omega). Sooner, fewer pushes are caught.
const SINKS: [f64; 2] = [0.02, 0.2];
const HANGS: f64 = 0.5;
/// Largest turn of the trunk in a swing that crosses the legs (rad): the hip of the swing leg goes to the side of the stance
/// leg on which the foot passes, and the other hip gives way. So the knees stay apart.
const TURN: f64 = 0.15;
/// Number of times that a footstep is planned until its travel and its swing time agree.
const TRAVEL_ROUNDS: usize = 4;
/// Share of each sole's length and width that inverse dynamics uses.
const SOLE_SHARE: f64 = 0.98;
/// Swing time of a foot that goes home, as a multiple of the swing time of a foot that catches.
const HOMEWARD_TIME_RATIO: f64 = 2.0;

/// The rule with the models by which it plans.
#[derive(Debug, Clone)]
pub struct CatchFootwork {
    rules: Catching,
    departures: Departures,
    /// Number of the landing region of the footstep in the air.
    region: usize,
    way_home: WayHome,
    /// Whether the footstep in the air goes home.
    goes_home: bool,
    /// Number of footsteps that were taken and do not go home, and the departure of the footstep in the air.
    taken: usize,
    departure: Departure,
    /// The tilt of the trunk (rad) at the last lift.
    tilt_at_lift: Vector2<f64>,
    /// The posture at landing. If the feet will be far apart, the legs reach the ground only with a lower body, so the
    /// body sinks during the swing. If it were pulled down only at the end, the robot would leave the ground.
    at_landing: InverseKinematics,
    dynamics: InverseDynamics,
    wanted: DesiredAcceleration,
}

impl CatchFootwork {
    /// The rule for a checked design, whose robot states how far its feet reach.
    pub fn new(rules: Catching, design: &Design) -> Self {
        let robot = &*design.robot;
        let contact = ContactModel {
            friction: robot.friction,
            sole_share: SOLE_SHARE,
        };
        Self {
            rules,
            departures: design.departures,
            region: 0,
            way_home: WayHome::default(),
            goes_home: false,
            taken: 0,
            departure: Departure::default(),
            tilt_at_lift: Vector2::zeros(),
            at_landing: InverseKinematics::new(robot),
            dynamics: InverseDynamics::new(robot, contact),
            wanted: DesiredAcceleration::rest(robot, PerFoot::default()),
        }
    }
}

impl Footwork for CatchFootwork {
    fn copy(&self) -> Box<dyn Footwork> {
        Box::new(self.clone())
    }

    fn impact_s(&self, design: &Design) -> f64 {
        IMPACT * design.units.time_s()
    }

    fn depart(&mut self, departures: &Departures) {
        self.departures = *departures;
    }

    /// Lifts the foot whose footstep has the least cost. It lifts none while the DCM is inside of the support polygon, and
    /// no foot if the other one is not in contact. It also lifts none if the DCM would end nearer to the support if the
    /// robot only stood.
    fn lift(&mut self, now: &StepState, body: &mut Body) -> Option<Swing> {
        let (rules, estimate, robot) = (self.rules, now.estimate, &now.design.robot);
        self.way_home.give_up();
        if !now.has_waited(0.0, rules.pause_s) {
            return None;
        }
        let departure = rules
            .every
            .and(&self.departures.get(self.taken).copied().unwrap_or_default());
        let support = now.support();
        let length_m = now.design.units.length_m;
        let outside = support
            .polygon?
            .signed_distance(support.frame.inverse_transform_point(&dcm_in(0.0, now)))
            - departure.lift * length_m;
        if outside <= 0.0 {
            return None;
        }
        let mut best: Option<FootstepCandidate> = None;
        for foot in Foot::BOTH
            .into_iter()
            .filter(|foot| estimate.in_contact[foot.other()])
        {
            let stance = on_ground(&estimate.footholds[foot.other()]);
            let carried = (estimate.load_n[foot] / (estimate.load_n.left + estimate.load_n.right))
                .clamp(0.0, 1.0);
            let transfer_s = if carried.is_finite() {
                carried * rules.transfer_s
            } else {
                0.0
            };
            let dcm = to_side(
                foot,
                stance.inverse_transform_point(&dcm_in(transfer_s, now)),
            );
            let from = to_side(
                foot,
                stance
                    .inverse_transform_point(&estimate.place(foot).translation.vector.xy().into()),
            );
            for (number, region) in robot.reach.iter().enumerate() {
                let Some((way, region_s)) = way_to(region, from, now.design) else {
                    continue;
                };
                let problem = problem(region, foot, now);
                let mut swing_time_s = region_s;
                let mut catch = plan(&problem, dcm, swing_time_s - transfer_s);
                if way == Way::STRAIGHT {
                    for _ in 1..TRAVEL_ROUNDS {
                        let travel = (catch.place - from).norm() / length_m;
                        swing_time_s = time_s(region_s, travel);
                        catch = plan(&problem, dcm, swing_time_s - transfer_s);
                    }
                }
                let crossed = if region.crosses() {
                    departure.crossed
                } else {
                    0.0
                };
                catch.cost +=
                    problem.cost_of_miss((crossed + departure.left * foot.side()) * length_m);
                if best
                    .as_ref()
                    .is_none_or(|best| catch.cost < best.catch.cost)
                {
                    best = Some(FootstepCandidate {
                        foot,
                        stance,
                        number,
                        way,
                        swing_time_s,
                        catch,
                    });
                }
            }
        }
        let FootstepCandidate {
            foot,
            stance,
            number,
            way,
            swing_time_s,
            catch,
        } = best?;
        // A robot that only stands keeps its ZMP at the edge of the support, and the DCM diverges from there.
        let miss_if_it_stands = outside * (now.design.family.pendulum.omega * swing_time_s).exp();
        if catch.miss > miss_if_it_stands {
            return None;
        }
        (self.region, self.goes_home) = (number, false);
        (self.taken, self.departure) = (self.taken + 1, departure);
        let place = catch.place + Vector2::from(departure.place) * length_m;
        let to = stance * Point2::from(to_side(foot, place.into()));
        let swing_time_s = swing_time_s * departure.slower.exp();
        Some(self.start(
            now,
            body,
            PlannedFootstep {
                foot,
                to,
                zmp_error: now.zmp_error,
            },
            way,
            swing_time_s,
        ))
    }

    /// A foot that hangs in the air after the other one has landed is kept where it is, and sinks. It is not drawn to its
    /// foothold: a push may have kicked it far from there, and the body would turn away from it.
    fn standing_soles(&self, now: &StepState) -> PerFoot<Pose> {
        let mut poses = now.estimate.footholds;
        if let Some(landing) = now.last_landing {
            let foot = landing.foot.other();
            let ground_m = poses[foot].translation.z;
            poses[foot] = now.estimate.place(foot);
            let hangs = landing.ago_s * now.design.family.pendulum.omega;
            let sinks = SINKS[0] + SINKS[1] * (hangs - HANGS).max(0.0);
            let height_m = &mut poses[foot].translation.z;
            *height_m = (*height_m - sinks * now.design.units.length_m).max(ground_m);
        }
        poses
    }

    fn lean(&mut self, now: &StepState, margin: f64) -> Vector2<f64> {
        self.way_home.lean(now, margin)
    }

    /// Lifts the foot that goes home.
    fn lift_at_ease(&mut self, now: &StepState, body: &mut Body) -> Option<Swing> {
        let foot = self.way_home.unloaded(now)?;
        self.way_home.give_up();
        let (estimate, region) = (now.estimate, &now.design.robot.reach[0]);
        let stance = on_ground(&estimate.footholds[foot.other()]);
        let from = stance
            .inverse_transform_point(&estimate.footholds[foot].translation.vector.xy().into());
        let (way, swing_time_s) = way_to(region, to_side(foot, from), now.design)?;
        (self.region, self.goes_home, self.departure) = (0, true, Departure::default());
        let to = stance * Point2::from(to_side(foot, problem(region, foot, now).home.into()));
        let footstep = PlannedFootstep {
            foot,
            to,
            zmp_error: now.zmp_error,
        };
        Some(self.start(now, body, footstep, way, HOMEWARD_TIME_RATIO * swing_time_s))
    }

    /// Plans landing place and ZMP anew until shortly before the landing, and then only the ZMP.
    fn swing(
        &mut self,
        now: &StepState,
        swing: &mut Swing,
        body: &mut Body,
        command: &mut Command,
    ) -> Result<Point2<f64>, TickError> {
        let (robot, pendulum, estimate) = (
            &*now.design.robot,
            &now.design.family.pendulum,
            now.estimate,
        );
        let (foot, stance, left_s) = (swing.footstep.foot, swing.stance, swing.time_left_s());
        let region = &robot.reach[self.region];
        let mut problem = problem(region, foot, now);
        if left_s <= self.rules.settle_s {
            problem = problem.landing_at(to_side(
                foot,
                stance.inverse_transform_point(&swing.footstep.to),
            ));
        }
        let dcm = to_side(foot, stance.inverse_transform_point(&dcm_in(0.0, now)));
        let left_or_late_s = left_s.max(LATE_TICKS * pendulum.dt);
        let to_home = plan(&problem.landing_at(problem.home), dcm, left_or_late_s);
        self.goes_home &= to_home.miss == 0.0;
        let mut catch = if self.goes_home {
            to_home
        } else {
            plan(&problem, dcm, left_or_late_s)
        };
        let Departure {
            place, zmp, tilt, ..
        } = self.departure;
        let length_m = now.design.units.length_m;
        catch.place += Vector2::from(place) * length_m;
        catch.zmp += Vector2::from(zmp) * length_m;
        for (zmp, [low, high]) in catch.zmp.iter_mut().zip(problem.zmp) {
            *zmp = zmp.clamp(low, high);
        }
        body.tilt = self
            .tilt_at_lift
            .lerp(&tilt.into(), least_jerk(swing.share()));
        body.turn = if region.crosses() {
            let [turn, ..] = swing.bump(TURN, LEAD);
            -foot.side() * region.x_m[0].signum() * turn
        } else {
            0.0
        };
        if left_s > self.rules.settle_s {
            swing.aim(stance * Point2::from(to_side(foot, catch.place.into())));
        }
        let zmp = stance * Point2::from(to_side(foot, catch.zmp.into()));
        self.lower_body(now, swing, zmp, body);
        let acceleration = body.com.advance(pendulum, estimate, zmp);
        let mut soles = SoleReference {
            poses: estimate.footholds,
            velocities: PerFoot::default(),
        };
        let (pose, velocity) = swing.sole();
        (soles.poses[foot], soles.velocities[foot]) = (pose, velocity);
        body.follow(robot, pendulum, estimate, soles, TRUNK_AS_IT_IS, command);
        let wanted = &mut self.wanted;
        wanted.standing = PerFoot::from_fn(|f| f != foot);
        wanted.sole_acc = PerFoot::default();
        let rate = RETURNING * pendulum.omega;
        let off = pose.translation.vector - estimate.soles[foot].translation.vector;
        let slow = velocity - estimate.sole_vel[foot];
        let back = (off * rate + slow * 2.0) * rate;
        wanted.sole_acc[foot][0] = swing.sole_acc() + back;
        wanted.com_acc = Vector3::new(acceleration.x, acceleration.y, body.com.height[2]);
        let solved = self
            .dynamics
            .solve(robot, &estimate.posture, body.velocity(), wanted);
        solved.ok_or(TickError::Unsolvable)?;
        command.tau_ff.copy_from_slice(&self.dynamics.tau);
        for (j, step_rad) in self.dynamics.leg_step(robot, foot, &pose, length_m) {
            let joint = &robot.joints[j];
            let q = (estimate.posture.q[j] + step_rad).clamp(joint.lower_rad, joint.upper_rad);
            command.q_ref[j] += AS_IT_IS * (q - command.q_ref[j]);
        }
        Ok(zmp)
    }
}

impl CatchFootwork {
    /// Starts a swing with the body as it is.
    fn start(
        &mut self,
        now: &StepState,
        body: &mut Body,
        footstep: PlannedFootstep,
        way: Way,
        swing_time_s: f64,
    ) -> Swing {
        let Catching { lift_m, late_s, .. } = self.rules;
        self.tilt_at_lift = body.tilt;
        body.com.start(now.estimate);
        self.at_landing.start_at(body.posture());
        body.com.height = [self.at_landing.com_height(&now.design.robot), 0.0, 0.0];
        let late_speed_m_s = LATE_SPEED * now.design.units.speed_m_s();
        let timing = SwingTiming {
            swing_time_s,
            lift_m,
            lead: LEAD,
            late_s,
            late_speed_m_s,
        };
        let mut from = now.estimate.footholds;
        from[footstep.foot] = now.estimate.place(footstep.foot);
        Swing::new(timing, way, footstep, &from)
    }

    /// Moves the COM height towards a height at which the legs reach the landing place.
    fn lower_body(&mut self, now: &StepState, swing: &Swing, zmp: Point2<f64>, body: &mut Body) {
        let (robot, pendulum, estimate) =
            (&now.design.robot, &now.design.family.pendulum, now.estimate);
        let (foot, left_s, dt) = (swing.footstep.foot, swing.time_left_s(), pendulum.dt);
        let com = pendulum.com_in(
            left_s.max(0.0),
            estimate.com_xy(),
            estimate.com_vel_xy(),
            zmp,
        );
        let mut soles = estimate.footholds;
        soles[foot] = swing.landing();
        let targets = BodyTargets {
            com: Point3::new(com.x, com.y, now.design.units.length_m),
            rise: f64::INFINITY,
            com_vel: Vector3::zeros(),
            soles,
            sole_vel: PerFoot::default(),
            trunk: body.trunk(estimate),
        };
        for _ in 0..AHEAD_STEPS {
            self.at_landing.follow(robot, &targets);
        }
        let lower_m = self.departure.lower * now.design.units.length_m;
        let height = &mut body.com.height;
        *height = if left_s > LATE_TICKS * dt {
            let at_landing = (self.at_landing.com_height(robot) - lower_m)
                .min(height[0] + RISING * now.design.units.speed_m_s() * left_s);
            Quintic::new(*height, at_landing, 0.0, left_s).at(dt)
        } else {
            [height[0], 0.0, 0.0]
        };
    }
}

/// The DCM (m, world frame) after `time_s`, if the ZMP stays where it is.
fn dcm_in(time_s: f64, now: &StepState) -> Point2<f64> {
    let (estimate, omega) = (now.estimate, now.design.family.pendulum.omega);
    let dcm = estimate.com_xy() + estimate.com_vel_xy() / omega;
    estimate.zmp + (dcm - estimate.zmp) * (omega * time_s).exp()
}

/// A footstep that could be taken.
#[derive(Debug, Clone)]
struct FootstepCandidate {
    foot: Foot,
    stance: Isometry2<f64>,
    /// Number of the landing region.
    number: usize,
    way: Way,
    swing_time_s: f64,
    catch: CatchPlan,
}

/// The planning problem for a footstep of `foot` to a landing region.
fn problem(region: &LandingRegion, foot: Foot, now: &StepState) -> CatchProblem {
    let Design {
        robot,
        family,
        stance,
        ..
    } = now.design;
    let weight_n = robot.weight_n();
    let home = Vector2::new(stance.x * foot.side(), stance.y);
    let pressable = |standing: Foot, load_n: f64| {
        let [x, [low, high]] = robot.soles[standing].pressable_m(load_n);
        [
            x,
            if foot == Foot::Left {
                [low, high]
            } else {
                [-high, -low]
            },
        ]
    };
    CatchProblem {
        omega: family.pendulum.omega,
        zmp: pressable(foot.other(), weight_n).map(|[low, high]| {
            let margin = family.zmp_margin.min(0.5 * (high - low));
            [low + margin, high - margin]
        }),
        support: pressable(foot, 0.5 * weight_n),
        reach: aimed_m(region, home.y),
        home,
    }
}

/// The way of a foot to a landing region from its place `from` (m, axes of the stance sole with y to the side of the
/// foot), and its time (s). A foot whose leg crosses the other one goes back the way that it came. It is None if the
/// foot would have to go around to the other side of the stance foot.
fn way_to(region: &LandingRegion, from: Vector2<f64>, design: &Design) -> Option<(Way, f64)> {
    /// Distance by which a foot that has crossed is nearer to the stance foot than the nearest place beside it; in COM
    /// heights.
    const CROSSED: f64 = 0.032;
    let reach = &design.robot.reach;
    let same_side = |region: &&LandingRegion| region.x_m[0] * from.x > 0.0;
    let has_crossed = from.y < reach[0].y_m[0] - CROSSED * design.units.length_m;
    match (has_crossed, region.crosses()) {
        (true, true) => {
            same_side(&region).then(|| (Way::around(region.around()), region.swing_time_s))
        }
        (true, false) => {
            let back = reach.iter().filter(|r| r.crosses()).find(same_side);
            let (way, back_s) = back.map_or((Way::STRAIGHT, 0.0), |b| {
                (Way::back_around(b.around()), b.swing_time_s)
            });
            Some((way, region.swing_time_s.max(back_s)))
        }
        (false, true) => Some((Way::around(region.around()), region.swing_time_s)),
        (false, false) => Some((Way::STRAIGHT, region.swing_time_s)),
    }
}

/// Changes between the axes of a stance sole and axes with y to the side of `foot`. It is its own inverse.
fn to_side(foot: Foot, v: Point2<f64>) -> Vector2<f64> {
    Vector2::new(v.x, v.y * foot.side())
}
