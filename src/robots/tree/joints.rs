//! The joints of a URDF: which of them move, and where the others are locked.

use super::problems::Problems;
use super::xml::isometry;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use standfast_core::robot::model::Joint;
use urdf_rs::JointType;

/// The reason for which a joint with equal limits is locked.
pub const WITHOUT_RANGE: &str = "without a range";

/// How a joint of a URDF is simulated.
pub enum JointKind {
    /// A joint with a servo. `parent` and `origin` are those of the URDF.
    Moves(Joint, Motor),
    /// A fixed joint, whose links are one. It has the pose of the child in the parent.
    Fixed(Isometry3<f64>),
    /// A joint that the URDF lets move, but that is treated as fixed; with the reason.
    Locked(Isometry3<f64>, &'static str),
}

/// The figures of a joint's motor as they are written, which need not be true; None if they are missing or not
/// positive. Of a URDF they are those of `<limit>`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motor {
    /// Largest torque (N m).
    pub effort_n_m: Option<f64>,
    /// Largest speed (rad/s).
    pub velocity_rad_s: Option<f64>,
    /// Rotor inertia seen at the joint (kg m^2).
    pub rotor_inertia_kg_m2: Option<f64>,
    /// Dry friction (N m).
    pub friction_n_m: Option<f64>,
    /// Viscous damping (N m s/rad).
    pub damping_n_m_s_rad: Option<f64>,
}

impl JointKind {
    /// What becomes of a joint whose child carries something with mass or not. If its limits leave it no range, it has
    /// one of `range_rad` to both sides (rad), or else is locked.
    pub fn of(
        joint: &urdf_rs::Joint,
        line: usize,
        has_mass: bool,
        range_rad: Option<f64>,
        problems: &mut Problems,
    ) -> Self {
        use JointType::{Continuous, Fixed, Floating, Planar, Prismatic, Revolute, Spherical};
        let origin = isometry(&joint.origin);
        let kind = &joint.joint_type;
        if matches!(kind, Fixed | Spherical) {
            return JointKind::Fixed(origin);
        }
        let xyz = Vector3::from(*joint.axis.xyz);
        let Some(axis) = Unit::try_new(xyz, 1e-9) else {
            let (field, value) = (
                format!("joint {}: axis", joint.name),
                format!("{} {} {}", xyz.x, xyz.y, xyz.z),
            );
            problems.add(
                line,
                field,
                value,
                "has no direction",
                "a vector of non-zero length",
            );
            return JointKind::Fixed(origin);
        };
        let (lower, upper) = match kind {
            Revolute | Prismatic => (joint.limit.lower, joint.limit.upper),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let needs_range = matches!(kind, Revolute) && lower == upper && joint.mimic.is_none();
        let (lower, upper) = range_rad
            .filter(|_| needs_range)
            .map_or((lower, upper), |range_rad| {
                (lower - range_rad, upper + range_rad)
            });
        let locked = |why: &'static str, at: f64| {
            // The limits of a prismatic joint are often left out.
            let at = if lower < upper {
                at.clamp(lower, upper)
            } else {
                at
            };
            let moved = match kind {
                Prismatic => Isometry3::from(Translation3::from(axis.into_inner() * at)),
                Planar | Floating => Isometry3::identity(),
                _ => Isometry3::from_parts(
                    Translation3::identity(),
                    UnitQuaternion::from_axis_angle(&axis, at),
                ),
            };
            JointKind::Locked(origin * moved, why)
        };
        match kind {
            _ if joint.mimic.is_some() => {
                let offset = joint.mimic.as_ref().and_then(|mimic| mimic.offset);
                return locked(
                    "mimic of another joint, which it does not follow",
                    offset.unwrap_or(0.0),
                );
            }
            Prismatic => return locked("prismatic", 0.0),
            Planar => return locked("planar", 0.0),
            Floating => return locked("floating", 0.0),
            Revolute if lower > upper => {
                let (field, value) = (
                    format!("joint {}: limit", joint.name),
                    format!("{lower} to {upper}"),
                );
                problems.add(line, field, value, "is not a range", "lower < upper [rad]");
                return JointKind::Fixed(origin);
            }
            Revolute if lower == upper => return locked(WITHOUT_RANGE, lower),
            _ if !has_mass => return locked("without mass", 0.0),
            Revolute | Continuous | Fixed | Spherical => {}
        }
        let stated = |figure: f64| (figure > 0.0).then_some(figure);
        // The <dynamics> of a URDF are not read, but friction and damping of an MJCF.
        let dynamics = joint.dynamics.as_ref();
        let motor = Motor {
            effort_n_m: stated(joint.limit.effort),
            velocity_rad_s: stated(joint.limit.velocity),
            rotor_inertia_kg_m2: None,
            friction_n_m: dynamics.and_then(|dynamics| stated(dynamics.friction)),
            damping_n_m_s_rad: dynamics.and_then(|dynamics| stated(dynamics.damping)),
        };
        let name = joint.name.clone();
        JointKind::Moves(
            Joint {
                name,
                parent: 0,
                origin,
                axis,
                lower_rad: lower,
                upper_rad: upper,
            },
            motor,
        )
    }
}

/// A sentence on the joints that are locked, given with the reason of each.
pub fn note(locked: &[(&str, &'static str)]) -> Option<String> {
    const MOST_NAMED: usize = 12;
    let mut reasons: Vec<&str> = Vec::new();
    for (_, why) in locked {
        if !reasons.contains(why) {
            reasons.push(why);
        }
    }
    let mut groups: Vec<String> = Vec::new();
    for why in reasons {
        let names: Vec<&str> = locked
            .iter()
            .filter(|(_, other)| *other == why)
            .map(|(name, _)| *name)
            .collect();
        let more = if names.len() > MOST_NAMED {
            format!(" and {} more", names.len() - MOST_NAMED)
        } else {
            String::new()
        };
        groups.push(format!(
            "{}{more} ({why})",
            names[..names.len().min(MOST_NAMED)].join(", ")
        ));
    }
    (!locked.is_empty()).then(|| {
        format!(
            "Joints that no servo drives are locked at zero, their nearest limit or their offset: {}.",
            groups.join("; ")
        )
    })
}
