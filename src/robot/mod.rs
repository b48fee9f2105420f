//! The robot as data: a tree of rigid links moved by revolute joints (from URDF), and what a URDF cannot say
//! (soles, servos, sensors, home posture; from a TOML file beside it).
//!
//! Links joined by fixed URDF joints are merged into the link that carries them; every URDF link keeps its name and
//! its frame as a [`Frame`]. A joint bears the name of its URDF joint.

pub mod dynamics;
pub mod io;
pub mod kinematics;
pub mod model;
mod settings;
pub mod urdf;
mod xml;

pub use io::{Command, Imu, Sensed, SensedError, Wrench};
pub use kinematics::{Kinematics, Pose, Posture};
pub use model::{Foot, Frame, GRAVITY, Joint, Link, PerFoot, Reach, Robot, SensorNoise, Servo, Shape, Sole, Solid};
