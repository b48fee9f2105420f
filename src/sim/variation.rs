//! How the simulated robot and its ground differ from those that the controller was designed for. The controller is
//! told nothing of it: only the plant is built from what [`Variation::robot`] and [`Ground::new`](super::Ground::new)
//! make of it.

use crate::robot::Robot;
use serde::{Deserialize, Serialize};

/// One of a thing for each quantity that may vary; as it is, the quantities themselves: None is as designed for.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, bound(deserialize = "T: Deserialize<'de> + Default"))]
pub struct Variation<T = Option<f64>> {
    /// Factor of the masses and inertias of all links (rotors not included).
    pub mass_scale: T,
    /// By how much the COM of the trunk lies off in its link's frame (m): forward,
    pub trunk_com_x_m: T,
    /// and to the left.
    pub trunk_com_y_m: T,
    /// Coulomb friction between soles and ground, in place of the robot's.
    pub friction: T,
    /// Angle by which the ground rises, once it has tilted (degrees),
    pub slope_deg: T,
    /// towards this heading: 0 rises forward, 90 to the left.
    pub slope_heading_deg: T,
    /// How much higher the ground is around the patch on which the robot starts (m): see [`Ground`](super::Ground).
    pub ground_step_m: T,
    /// Factors of the servos' stiffness,
    pub kp_scale: T,
    /// damping,
    pub kd_scale: T,
    /// torque limit,
    pub torque_scale: T,
    /// and of both speeds of the torque-speed curve.
    pub speed_scale: T,
    /// From sensing to torque (s), in place of the robot's; the plant takes it to the nearest physics step.
    pub delay_s: T,
}

impl<T> Variation<T> {
    /// Does the same to each, given the name of its field.
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
            delay_s: f("delay_s", self.delay_s),
        }
    }

    /// Each with its counterpart.
    pub fn zip<U>(self, other: Variation<U>) -> Variation<(T, U)> {
        let mut others = other.list().into_iter();
        self.map(|_, value| (value, others.next().expect("as many").1))
    }

    /// Names of the fields and values, in order.
    pub fn list(self) -> Vec<(&'static str, T)> {
        let mut list = Vec::new();
        self.map(|name, value| list.push((name, value)));
        list
    }
}

impl Variation {
    /// The robot that is simulated in place of `nominal`.
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
        for servo in &mut robot.servos {
            servo.kp *= scale(self.kp_scale);
            servo.kd *= scale(self.kd_scale);
            servo.torque_n_m *= scale(self.torque_scale);
            servo.full_torque_speed_rad_s *= scale(self.speed_scale);
            servo.no_torque_speed_rad_s *= scale(self.speed_scale);
        }
        robot.friction = self.friction.unwrap_or(nominal.friction);
        robot.delay_s = self.delay_s.unwrap_or(nominal.delay_s);
        robot
    }

    /// What is not as designed for, by name.
    pub fn varied(self) -> Vec<(&'static str, f64)> {
        self.list().into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }
}
