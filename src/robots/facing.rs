//! The axis of the base along which a robot looks, and the axes of its trunk. Everything behind the URDF takes x to point
//! forward and z up, so that other frames are turned on reading.

use super::tree::Tree;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_2, PI};

/// An axis of the base that points forward; x by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub(super) enum Forward {
    #[default]
    #[serde(rename = "x")]
    X,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "-y")]
    MinusY,
}

impl Forward {
    /// The name in the settings.
    pub fn name(self) -> &'static str {
        match self {
            Forward::X => "x",
            Forward::MinusX => "-x",
            Forward::Y => "y",
            Forward::MinusY => "-y",
        }
    }

    /// The axis in the frame of the URDF's base.
    pub fn axis(self) -> Vector3<f64> {
        match self {
            Forward::X => Vector3::x(),
            Forward::MinusX => -Vector3::x(),
            Forward::Y => Vector3::y(),
            Forward::MinusY => -Vector3::y(),
        }
    }

    /// The opposite direction.
    pub fn back(self) -> Self {
        match self {
            Forward::X => Forward::MinusX,
            Forward::MinusX => Forward::X,
            Forward::Y => Forward::MinusY,
            Forward::MinusY => Forward::Y,
        }
    }
}

/// Turns the base about z, so that `forward` becomes its x axis.
pub(super) fn turn(tree: &mut Tree, forward: Forward) {
    let yaw_rad = match forward {
        Forward::X => return,
        Forward::MinusX => PI,
        Forward::Y => -FRAC_PI_2,
        Forward::MinusY => FRAC_PI_2,
    };
    turn_link(
        tree,
        0,
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
    );
}

/// Gives the trunk the axes that the base has at zero joint angles, if its own are far from them, since its tilt is that of its
/// z axis.
pub(super) fn straighten(tree: &mut Tree, trunk: usize) {
    /// Largest angle (rad) between the axes of base and trunk for which the trunk keeps its own: that of a waist that leans.
    const LEANS_RAD: f64 = 0.35;
    let mut turn = UnitQuaternion::identity();
    let mut link = trunk;
    while link > 0 {
        let joint = &tree.joints[link - 1];
        (turn, link) = (joint.origin.rotation * turn, joint.parent);
    }
    if turn.angle() > LEANS_RAD {
        turn_link(tree, trunk, turn);
    }
}

/// Turns all that a link's frame has within it.
fn turn_link(tree: &mut Tree, link: usize, turn: UnitQuaternion<f64>) {
    let turned = |pose: &mut Isometry3<f64>| *pose = turn * *pose;
    if let Some(carrier) = link.checked_sub(1) {
        let joint = &mut tree.joints[carrier];
        joint.origin *= turn.inverse();
        joint.axis = turn * joint.axis;
    }
    let body = &mut tree.links[link];
    body.com_m = turn * body.com_m;
    let axes = turn.to_rotation_matrix();
    body.inertia_kg_m2 = axes * body.inertia_kg_m2 * axes.transpose();
    let solids = body.collisions.iter_mut().chain(&mut body.visuals);
    solids.for_each(|solid| turned(&mut solid.pose));
    let frames = tree.frames.iter_mut().filter(|frame| frame.link == link);
    frames.for_each(|frame| turned(&mut frame.pose));
    let joints = tree.joints.iter_mut().filter(|joint| joint.parent == link);
    joints.for_each(|joint| turned(&mut joint.origin));
}
