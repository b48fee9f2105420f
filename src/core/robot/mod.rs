//! The robot as data: a tree of rigid links with revolute joints, its soles, servos, sensors and home posture.
//!
//! Links that are joined by fixed URDF joints are merged into one. Every URDF link keeps its name and its frame as a
//! [`Frame`], and a joint has the name of its URDF joint.

mod ankle;
pub mod dynamics;
pub mod kinematics;
pub mod mesh;
pub mod model;
pub mod shape;
pub mod size;
pub mod sole_wrenches;
pub mod swing_shape;
pub mod swing_time;

pub use kinematics::{Kinematics, Pose, Posture};
pub use model::{
    Ankle, Around, Foot, Frame, GRAVITY, Joint, LandingRegion, Link, MotorOrigin, PerFoot,
    PushPoint, Robot, SensorNoise, Servo, Sole, Solid,
};
pub use shape::Shape;
pub use size::{SizeRatio, Units};
