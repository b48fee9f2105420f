//! The command that holds a robot at home.

use super::Command;
use crate::robot::dynamics::load_torques;
use crate::robot::sole_wrenches::share;
use crate::robot::{Kinematics, PerFoot, Robot};
use nalgebra::Vector3;

impl Robot {
    /// Holds the home posture, with the torques that carry the weight there.
    pub fn home_command(&self) -> Command {
        let kinematics = Kinematics::at_home(self);
        let weight = Vector3::new(0.0, 0.0, self.weight_n());
        let both = PerFoot {
            left: true,
            right: true,
        };
        let wrenches = share(
            self,
            &kinematics.sole_poses(self),
            &both,
            kinematics.com().xy(),
            weight,
        );
        let mut command = Command::hold(&self.home_rad);
        load_torques(
            &kinematics,
            self,
            -weight / self.mass(),
            &wrenches,
            &mut command.tau_ff,
        );
        command
    }
}
