//! A push by a pendulum, as in a lab: a padded bob on a rope is drawn back and released, and strikes the robot as its rope
//! comes to hang straight down.
//!
//! The plant moves the bob, and not an engine: Rapier has one stiffness for all contacts, which is that of soles on the
//! ground, and MuJoCo states the stiffness of a contact as a time. With the law below the padding is the same in both. It
//! goes both ways: at every physics step the force on the link that is struck is the opposite of the force on the bob.
//!
//! The bob is a point mass, and around it a sphere of foam without friction. Into the solid of the robot in which the
//! sphere is deepest, by `d` (m), the foam presses with `stiffness d (1 + damping d')`, the law of Hunt and Crossley; with
//! its damping the bob has the same restitution, whatever the masses. The rope does not stretch, and can hang loose. As
//! soon as the bob has left the robot and swings back, a hand catches it. On two parallel wires in place of the rope the bob does
//! not turn. That is the same pendulum, since nothing turns a sphere without friction, and its centre moves on the same arc.

use super::bob::Bob;
use super::push::Push;
use super::rapier::shape::{Nearest, Surface};
use nalgebra::{DVector, Matrix6xX, Point3, Vector3};
use standfast_core::robot::dynamics::Dynamics;
use standfast_core::robot::{GRAVITY, Kinematics, Robot};
use std::sync::Arc;

/// Names of the numbers of a strike in a record.
pub const TOTALS: [&str; 5] = [
    "bob_draw_m",
    "bob_impulse_n_s",
    "bob_share",
    "bob_peak_n",
    "bob_width_s",
];

/// The bob of a push, before, while and after it strikes.
#[derive(Debug, Clone)]
pub struct Strike {
    push: Push,
    bob: Bob,
    surface: Arc<Surface>,
    damping_s_m: f64,
    pivot: Point3<f64>,
    /// None before the start of the push.
    moving: Option<Moving>,
    is_over: bool,
    impulse: Vector3<f64>,
    forces: Vec<FoamForce>,
}

/// A force of the foam on the robot, constant for a small part of a physics step.
#[derive(Debug, Clone, Copy)]
pub struct FoamForce {
    pub from_s: f64,
    pub for_s: f64,
    pub link: usize,
    /// On the robot (N).
    pub force: Vector3<f64>,
}

/// Position (m) and velocity (m/s) of the centre of a bob.
#[derive(Debug, Clone, Copy)]
struct Moving {
    at: Point3<f64>,
    velocity: Vector3<f64>,
}

/// What the bob does to the robot in a physics step.
pub struct Blow {
    pub link: usize,
    pub point: Point3<f64>,
    /// Mean force on the link (N).
    pub force: Vector3<f64>,
}

/// The part of the robot that the bob touches, along the line between the two.
pub struct Struck {
    /// Velocity of its point towards the bob (m/s).
    pub speed_m_s: f64,
    /// Change of that velocity by an impulse (1/kg), for a robot in the air.
    pub mobility_per_kg: f64,
}

impl Struck {
    /// A point of a link that is touched from the direction of `normal`.
    pub fn of(
        robot: &Robot,
        kinematics: &Kinematics,
        velocity: &DVector<f64>,
        (link, point, normal): (usize, Point3<f64>, Vector3<f64>),
    ) -> Self {
        let mut jacobian = Matrix6xX::zeros(velocity.len());
        kinematics.point_jacobian(robot, link, &point, &mut jacobian);
        let along = jacobian.fixed_rows::<3>(0).tr_mul(&normal);
        let mut dynamics = Dynamics::new(robot);
        dynamics.update(robot, kinematics, velocity);
        let mass = dynamics.mass_matrix().clone().cholesky();
        Self {
            speed_m_s: along.dot(velocity),
            mobility_per_kg: mass.map_or(0.0, |mass| along.dot(&mass.solve(&along))),
        }
    }
}

impl Strike {
    /// The bob of `push` at the time 0. `aim` is the point at which it is swung.
    pub fn new(
        push: &Push,
        bob: Bob,
        robot: &Robot,
        kinematics: &Kinematics,
        aim: Point3<f64>,
    ) -> Self {
        let surface = Arc::new(Surface::of(robot));
        let touching = touching(&surface, kinematics, push, &bob, aim);
        Self {
            push: *push,
            bob,
            damping_s_m: bob.damping_s_m(push.impulse_n_s / bob.mass_kg),
            pivot: touching.unwrap_or(aim) + Vector3::z() * bob.rope_m,
            surface,
            moving: None,
            is_over: false,
            impulse: Vector3::zeros(),
            forces: Vec::new(),
        }
    }

    /// Whether it is the bob of a push.
    pub fn is_of(&self, push: &Push) -> bool {
        self.push == *push
    }

    /// Where rope and bob are at a time (m): pivot, and centre of the bob. It is None as soon as the bob is caught.
    pub fn rope_at(&self, time_s: f64) -> Option<[Point3<f64>; 2]> {
        let at = match self.moving {
            Some(moving) => moving.at,
            None => {
                let before_s = self.push.start_s - time_s;
                let (sin, cos) = self
                    .bob
                    .angle_rad(self.push.impulse_n_s, before_s)
                    .sin_cos();
                self.pivot - (self.push.direction() * sin + Vector3::z() * cos) * self.bob.rope_m
            }
        };
        (!self.is_over).then_some([self.pivot, at])
    }

    pub fn bob(&self) -> &Bob {
        &self.bob
    }

    /// The numbers of [`TOTALS`]: the drawback, the impulse on the robot along the heading of the push up to now, that as a
    /// share of the momentum with which the bob came, the largest force, and the time with half of it or more.
    pub fn totals(&self) -> [(&'static str, f64); 5] {
        let impulse_n_s = self.impulse.dot(&self.push.direction());
        let peak_n = self
            .forces
            .iter()
            .fold(0.0, |most: f64, foam| most.max(foam.force.norm()));
        let high = self
            .forces
            .iter()
            .filter(|foam| foam.force.norm() >= 0.5 * peak_n);
        let share = impulse_n_s / self.push.impulse_n_s.max(1e-9);
        let values = [
            self.bob.draw_m(self.push.impulse_n_s),
            impulse_n_s,
            share,
            peak_n,
            high.map(|foam| foam.for_s).sum(),
        ];
        std::array::from_fn(|i| (TOTALS[i], values[i]))
    }

    /// All forces of the foam up to now, in their order. The times when the bob does not touch the robot are left out.
    pub fn forces(&self) -> &[FoamForce] {
        &self.forces
    }

    /// Moves the bob through the physics step from `from_s` to `to_s`, with the robot in the posture of `kinematics`, and
    /// returns what it does to the robot. `aim` is the point at which it is swung. `struck` is asked about the part that it
    /// touches: a link, its point, and the direction from there to the bob.
    pub fn advance(
        &mut self,
        [from_s, to_s]: [f64; 2],
        kinematics: &Kinematics,
        aim: Point3<f64>,
        struck: impl FnOnce(usize, Point3<f64>, Vector3<f64>) -> Struck,
    ) -> Option<Blow> {
        let direction = self.push.direction();
        if self.is_over || to_s <= self.push.start_s {
            return None;
        }
        let Moving {
            mut at,
            mut velocity,
        } = match self.moving {
            Some(moving) => moving,
            None => {
                // The rope hangs straight down where the bob touches the robot as it stands now.
                let Some(at) = touching(&self.surface, kinematics, &self.push, &self.bob, aim)
                else {
                    self.is_over = true;
                    return None;
                };
                self.pivot = at + Vector3::z() * self.bob.rope_m;
                let velocity = direction * (self.push.impulse_n_s / self.bob.mass_kg);
                Moving {
                    at: at - velocity * (self.push.start_s - from_s),
                    velocity,
                }
            }
        };
        let step_s = to_s - from_s;
        let Nearest {
            link,
            point,
            normal,
            gap_m,
        } = self.surface.nearest(kinematics, &at)?;
        // In two steps nothing comes nearer than this.
        let far_m = 2.0 * step_s * (velocity.norm() + GRAVITY * step_s) + 0.1 * self.bob.radius_m;
        let is_near = gap_m - self.bob.radius_m < far_m;
        let Struck {
            mut speed_m_s,
            mobility_per_kg,
        } = match is_near {
            true => struck(link, point, normal),
            false => Struck {
                speed_m_s: 0.0,
                mobility_per_kg: 0.0,
            },
        };
        let stiffness = self.bob.stiffness_n_m;
        let rad_s = (stiffness * (1.0 / self.bob.mass_kg + mobility_per_kg)).sqrt();
        let parts = (PARTS_OF_VIBRATION * rad_s * step_s)
            .ceil()
            .clamp(1.0, MOST_PARTS);
        let part_s = step_s / parts;
        let (start, mut moved_m, mut sum_n_s, mut depth_m) = (at, 0.0, 0.0, 0.0);
        for part in 0..parts as usize {
            depth_m = self.bob.radius_m - gap_m - normal.dot(&(at - start)) + moved_m;
            let rate_m_s = speed_m_s - normal.dot(&velocity);
            let foam = stiffness * depth_m * (1.0 + self.damping_s_m * rate_m_s);
            let force_n = if is_near && depth_m > 0.0 {
                foam.max(0.0)
            } else {
                0.0
            };
            if force_n > 0.0 {
                self.forces.push(FoamForce {
                    from_s: from_s + part as f64 * part_s,
                    for_s: part_s,
                    link,
                    force: -normal * force_n,
                });
            }
            sum_n_s += force_n * part_s;
            velocity +=
                normal * (force_n / self.bob.mass_kg * part_s) - Vector3::z() * (GRAVITY * part_s);
            at += velocity * part_s;
            speed_m_s -= force_n * mobility_per_kg * part_s;
            moved_m += speed_m_s * part_s;
            let rope = at - self.pivot;
            if rope.norm() > self.bob.rope_m {
                let outward = rope.normalize();
                at = self.pivot + outward * self.bob.rope_m;
                velocity -= outward * velocity.dot(&outward).max(0.0);
            }
        }
        self.moving = Some(Moving { at, velocity });
        self.is_over = depth_m < 0.0 && velocity.dot(&direction) <= 0.0;
        let impulse = -normal * sum_n_s;
        self.impulse += impulse;
        (sum_n_s > 0.0).then(|| Blow {
            link,
            point,
            force: impulse / step_s,
        })
    }

    /// Momentum of the bob along the heading of the push (N s); None before it has come.
    pub fn momentum_n_s(&self) -> Option<f64> {
        let moving = self.moving?;
        Some(self.bob.mass_kg * moving.velocity.dot(&self.push.direction()))
    }
}

/// Parts of a physics step, as multiples of 1 / (angular frequency of bob and robot on the foam), and their largest number.
const PARTS_OF_VIBRATION: f64 = 100.0;
const MOST_PARTS: f64 = 1e4;

/// Where the centre of the bob is when it touches the robot, on its way through `aim` in the direction of the push. It is None
/// if it passes the robot by.
fn touching(
    surface: &Surface,
    kinematics: &Kinematics,
    push: &Push,
    bob: &Bob,
    aim: Point3<f64>,
) -> Option<Point3<f64>> {
    const TOUCHING_M: f64 = 1e-6;
    let direction = push.direction();
    let reach_m = surface.farthest_m(kinematics, &aim) + bob.radius_m;
    let (start, mut way_m) = (aim - direction * reach_m, 0.0);
    while way_m < 2.0 * reach_m {
        let at = start + direction * way_m;
        let free_m = surface.nearest(kinematics, &at)?.gap_m - bob.radius_m;
        if free_m < TOUCHING_M {
            return Some(at);
        }
        way_m += free_m;
    }
    None
}

/// The point of a robot at which pushes act, in a posture that is its home posture unless the point is fixed to a link.
pub fn pushed_point(robot: &Robot, kinematics: &Kinematics) -> Point3<f64> {
    match robot.pushed.point_m {
        Some(point_m) => kinematics.link_pose(robot.pushed.link) * point_m,
        None => kinematics.com(),
    }
}

/// Checks that the bob of a push comes freely to the robot at home, and touches it. Fails with the problem, in words, and
/// what would be accepted in place of the height of the push.
pub fn check_at_home(robot: &Robot, push: &Push, bob: &Bob) -> Result<(), [String; 2]> {
    const TRIED: std::ops::RangeInclusive<i32> = -50..=100;
    let (kinematics, surface) = (Kinematics::at_home(robot), Surface::of(robot));
    let comes = |height_m: f64| {
        let push = Push { height_m, ..*push };
        let aim = pushed_point(robot, &kinematics) + Vector3::z() * height_m;
        comes_freely(robot, &surface, &kinematics, &push, bob, aim)
    };
    let Err(problem) = comes(push.height_m) else {
        return Ok(());
    };
    let mut good_m = TRIED
        .map(|i| 0.02 * f64::from(i) * robot.home_com_height())
        .filter(|height_m| comes(*height_m).is_ok());
    let accepted = match good_m.next() {
        Some(least_m) => {
            let most_m = good_m.next_back().unwrap_or(least_m);
            format!("a height from {least_m:.3} to {most_m:.3}")
        }
        None => "another heading, point or bob: no height will do".into(),
    };
    Err([problem, accepted])
}

/// Fails, in words, if the bob does not come freely to the robot, or passes it by.
fn comes_freely(
    robot: &Robot,
    surface: &Surface,
    kinematics: &Kinematics,
    push: &Push,
    bob: &Bob,
    aim: Point3<f64>,
) -> Result<(), String> {
    /// Where it may touch the robot before the lowest point (m).
    const NEAR_M: f64 = 1e-3;
    const LEAST_RAD: f64 = 2e-3;
    let mut free_m = 0.0;
    let Some(touching) = touching(surface, kinematics, push, bob, aim) else {
        return Err(format!("the bob passes {} by", robot.name));
    };
    if touching.z < bob.radius_m {
        return Err("the bob touches the ground".into());
    }
    let most_rad = (bob.draw_m(push.impulse_n_s) / bob.rope_m).asin();
    let mut angle_rad = 0.0;
    while angle_rad < most_rad {
        // Nothing is nearer than the gap, up to a step.
        angle_rad = most_rad.min(angle_rad + LEAST_RAD.max(free_m / bob.rope_m));
        let (sin, cos) = angle_rad.sin_cos();
        let back = (Vector3::z() * (1.0 - cos) - push.direction() * sin) * bob.rope_m;
        let Some(near) = surface.nearest(kinematics, &(touching + back)) else {
            break;
        };
        free_m = near.gap_m - bob.radius_m;
        if free_m < -NEAR_M {
            let link = &robot.links[near.link].name;
            return Err(match angle_rad == most_rad {
                true => format!("the bob starts inside of {link}"),
                false => format!("the bob touches {link} before its rope hangs straight down"),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that does not give way is a wall: the bob comes back with the share of its speed that the padding states.
    #[test]
    fn the_bob_springs_back_from_a_wall_by_its_restitution() {
        const STEP_S: f64 = 0.002;
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let kinematics = Kinematics::at_home(&robot);
        let aim = kinematics.com();
        for (restitution, momentum_n_s) in [(0.1, 1.0), (0.5, 1.0), (0.5, 3.0), (1.0, 2.0)] {
            let bob = Bob {
                mass_kg: 2.0,
                rope_m: 1.75,
                radius_m: 0.08,
                stiffness_n_m: 9e4,
                restitution,
            };
            let push = Push {
                impulse_n_s: momentum_n_s,
                start_s: 0.0031,
                bob: Some(bob),
                ..Push::default()
            };
            let mut strike = Strike::new(&push, bob, &robot, &kinematics, aim);
            for step in 0..50 {
                let times = [step, step + 1].map(|i| f64::from(i) * STEP_S);
                strike.advance(times, &kinematics, aim, |_, _, _| Struck {
                    speed_m_s: 0.0,
                    mobility_per_kg: 0.0,
                });
            }
            let left_n_s = strike.momentum_n_s().unwrap();
            assert!(
                (left_n_s / momentum_n_s + restitution).abs() < 0.01,
                "{restitution}: {left_n_s} N s of {momentum_n_s} N s"
            );
            assert!(strike.rope_at(0.1).is_none(), "it was not caught");
            let [_, (_, impulse_n_s), (_, share), ..] = strike.totals();
            assert!(
                (impulse_n_s - momentum_n_s + left_n_s).abs() < 5e-3 * momentum_n_s
                    && (share - 1.0 - restitution).abs() < 0.01,
                "{impulse_n_s} {share}"
            );
        }
    }
}
