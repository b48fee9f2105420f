//! Differences of the simulated robot and ground from the design of the controller. The controller does not know them:
//! only the plant uses [`Variation::robot`] and [`Ground::new`](super::Ground::new).

use serde::{Deserialize, Serialize};
use standfast_core::robot::Robot;

/// One `T` for each quantity that may vary. By default it is the value of the quantity, and None means as designed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(
    deny_unknown_fields,
    default,
    bound(deserialize = "T: Deserialize<'de> + Default")
)]
pub struct Variation<T = Option<f64>> {
    /// Factor on mass and inertia of every link, without the rotors.
    pub mass_scale: T,
    /// Shift of the trunk's COM in its link's frame (m), forward.
    pub trunk_com_x_m: T,
    /// Shift of the trunk's COM in its link's frame (m), to the left.
    pub trunk_com_y_m: T,
    /// Friction coefficient between soles and ground, instead of the robot's.
    pub friction: T,
    /// Angle of the slope, after it has tilted (degrees).
    pub slope_deg: T,
    /// Heading in which the ground rises (degrees): 0 is forward, 90 to the left.
    pub slope_heading_deg: T,
    /// Height of the ground around the patch under the feet above the patch (m); see [`Ground`](super::Ground).
    pub ground_step_m: T,
    /// Factor on the servos' stiffness.
    pub kp_scale: T,
    /// Factor on the servos' damping.
    pub kd_scale: T,
    /// Factor on the servos' torque limit.
    pub torque_scale: T,
    /// Factor on both speeds of the servos' torque-speed curve.
    pub speed_scale: T,
    /// Factor on the motors' rotor inertias.
    pub rotor_scale: T,
    /// Dry friction in each joint, added to its own, as a share of the torque limit of its motor as designed.
    pub joint_friction_share: T,
    /// Viscous damping in each joint, added to its own, as a share of the quotient of torque limit and speed without
    /// torque of its motor as designed.
    pub joint_damping_share: T,
    /// Delay from sensing to torque (s), instead of the robot's. The plant rounds it to whole physics steps.
    pub delay_s: T,
}

impl<T> Variation<T> {
    /// Applies `f` to the name and the value of each field.
    pub fn map<U>(self, mut f: impl FnMut(&'static str, T) -> U) -> Variation<U> {
        Variation {
            mass_scale: f("mass_scale", self.mass_scale),
            trunk_com_x_m: f("trunk_com_x_m", self.trunk_com_x_m),
            trunk_com_y_m: f("trunk_com_y_m", self.trunk_com_y_m),
            friction: f("friction", self.friction),
            slope_deg: f("slope_deg", self.slope_deg),
            slope_heading_deg: f("slope_heading_deg", self.slope_heading_deg),
            ground_step_m: f("ground_step_m", self.ground_step_m),
            kp_scale: f("kp_scale", self.kp_scale),
            kd_scale: f("kd_scale", self.kd_scale),
            torque_scale: f("torque_scale", self.torque_scale),
            speed_scale: f("speed_scale", self.speed_scale),
            rotor_scale: f("rotor_scale", self.rotor_scale),
            joint_friction_share: f("joint_friction_share", self.joint_friction_share),
            joint_damping_share: f("joint_damping_share", self.joint_damping_share),
            delay_s: f("delay_s", self.delay_s),
        }
    }

    /// The fields, to be changed.
    pub fn each_mut(&mut self) -> Variation<&mut T> {
        Variation {
            mass_scale: &mut self.mass_scale,
            trunk_com_x_m: &mut self.trunk_com_x_m,
            trunk_com_y_m: &mut self.trunk_com_y_m,
            friction: &mut self.friction,
            slope_deg: &mut self.slope_deg,
            slope_heading_deg: &mut self.slope_heading_deg,
            ground_step_m: &mut self.ground_step_m,
            kp_scale: &mut self.kp_scale,
            kd_scale: &mut self.kd_scale,
            torque_scale: &mut self.torque_scale,
            speed_scale: &mut self.speed_scale,
            rotor_scale: &mut self.rotor_scale,
            joint_friction_share: &mut self.joint_friction_share,
            joint_damping_share: &mut self.joint_damping_share,
            delay_s: &mut self.delay_s,
        }
    }

    /// Pairs each field with the same field of `other`.
    pub fn zip<U>(self, other: Variation<U>) -> Variation<(T, U)> {
        let mut others = other.list().into_iter();
        self.map(|_, value| (value, others.next().expect("as many").1))
    }

    /// Names and values of the fields, in order.
    pub fn list(self) -> Vec<(&'static str, T)> {
        let mut list = Vec::new();
        self.map(|name, value| list.push((name, value)));
        list
    }
}

impl Variation {
    /// The robot to be simulated instead of `nominal`.
    pub fn robot(&self, nominal: &Robot) -> Robot {
        let scale = |factor: Option<f64>| factor.unwrap_or(1.0);
        let mut robot = nominal.clone();
        for link in &mut robot.links {
            link.mass_kg *= scale(self.mass_scale);
            link.inertia_kg_m2 *= scale(self.mass_scale);
        }
        let trunk = &mut robot.links[nominal.trunk];
        trunk.com_m.x += self.trunk_com_x_m.unwrap_or(0.0);
        trunk.com_m.y += self.trunk_com_y_m.unwrap_or(0.0);
        let share = |share: Option<f64>| share.unwrap_or(0.0);
        for servo in &mut robot.servos {
            let designed = *servo;
            servo.friction_n_m += share(self.joint_friction_share) * designed.torque_n_m;
            servo.damping_n_m_s_rad += share(self.joint_damping_share) * designed.torque_n_m
                / designed.no_torque_speed_rad_s;
            servo.kp *= scale(self.kp_scale);
            servo.kd *= scale(self.kd_scale);
            servo.torque_n_m *= scale(self.torque_scale);
            servo.full_torque_speed_rad_s *= scale(self.speed_scale);
            servo.no_torque_speed_rad_s *= scale(self.speed_scale);
            servo.rotor_inertia_kg_m2 *= scale(self.rotor_scale);
        }
        robot.friction = self.friction.unwrap_or(nominal.friction);
        robot.delay_s = self.delay_s.unwrap_or(nominal.delay_s);
        robot
    }

    /// Names and values of the quantities that differ from the design.
    pub fn varied(self) -> Vec<(&'static str, f64)> {
        self.list()
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)))
            .collect()
    }
}
