//! The controller and the robot as numbers, with robots and gain sets from files.

mod cpi_sets;
mod design;
mod estimate;
mod inverse_dynamics;
mod inverse_kinematics;
mod robot_kinematics;
mod sole_wrenches;
