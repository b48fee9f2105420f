//! Mass and inertia of links.

use super::problems::Problems;
use super::xml::isometry;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use standfast_core::robot::mesh::bounds;
use standfast_core::robot::model::{Joint, Link, Solid};

/// Error of the triangle inequality, as a share of the largest moment, below which an inertia counts as rounded to a
/// few digits, and is corrected without a note.
const ROUNDED_SHARE: f64 = 1e-3;
/// By which share of the largest moment the two others together exceed it at least, and after a correction: an engine that
/// computes the principal moments anew must find a body, too.
const MARGINS: [f64; 2] = [1e-9, 1e-6];
/// Least principal moment of a corrected inertia, as a share of the largest one.
const LEAST_SHARE: f64 = 1e-3;
/// Ratio of the radius of gyration to the size of a link at which it is noted. No body has more than 1, but a link may
/// be drawn smaller than it is.
const LARGE: f64 = 2.0;
/// Ratio of the radius of gyration to the size of the robot, whose shapes a URDF may leave out, at which it is refused.
const IMPOSSIBLE: f64 = 3.0;

/// Mass and inertia of a URDF link.
pub struct LinkInertia {
    /// Mass (kg).
    mass: f64,
    /// Pose of the COM and its axes in the frame of the link (m).
    origin: Isometry3<f64>,
    /// Inertia about the COM in those axes (kg m^2).
    inertia: Matrix3<f64>,
}

impl LinkInertia {
    /// Returns None for a link without mass. An inertia that no body can have is corrected, with a note.
    pub fn of(link: &urdf_rs::Link, line: usize, problems: &mut Problems) -> Option<Self> {
        let mass = link.inertial.mass.value;
        if mass < 0.0 {
            let field = format!("link {}: mass", link.name);
            problems.add(
                line,
                field,
                mass,
                "must not be negative",
                "a number > 0, or no <inertial>",
            );
        }
        if mass <= 0.0 {
            return None;
        }
        let i = &link.inertial.inertia;
        let mut inertia = Matrix3::new(
            i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz,
        );
        // A link without moments may be a point mass that is fixed to another link.
        mend(&mut inertia, mass, false, &link.name, problems);
        Some(LinkInertia {
            mass,
            origin: isometry(&link.inertial.origin),
            inertia,
        })
    }
}

/// Corrects an inertia that no body has, with a note. No principal moment may be negative or exceed the sum of the
/// other two. If `all`, the inertia is that of a whole moving body, and no moment may be zero.
fn mend(inertia: &mut Matrix3<f64>, mass: f64, all: bool, name: &str, problems: &mut Problems) {
    if let Some([before, after]) = raise(inertia, mass, all) {
        let rounded = ROUNDED_SHARE * after[2];
        if before
            .iter()
            .zip(after)
            .all(|(before, after)| (before - after).abs() < rounded)
        {
            return;
        }
        let list = |moments: [f64; 3]| moments.map(|moment| format!("{moment:.3e}")).join(", ");
        problems
            .mended
            .push(format!("{name} (from {} to {})", list(before), list(after)));
    }
}

/// Raises the smaller principal moments as little as necessary. Returns the moments before and after, in increasing
/// order, or None if there was nothing to correct.
fn raise(inertia: &mut Matrix3<f64>, mass: f64, all: bool) -> Option<[[f64; 3]; 2]> {
    let eigen = inertia.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let before = order.map(|i| eigen.eigenvalues[i]);
    let [a, b, most] = before;
    let rounded = ROUNDED_SHARE * most.abs();
    let is_body =
        a >= -rounded * ROUNDED_SHARE && (most <= 0.0 || a + b > most * (1.0 + MARGINS[0]));
    if is_body && (!all || a > rounded * ROUNDED_SHARE) {
        return None;
    }
    // A body without any moment is taken as a ball of water.
    let radius_m = (mass / (1000.0 * 4.0 / 3.0 * std::f64::consts::PI)).cbrt();
    let most = if most > 0.0 {
        most
    } else {
        0.4 * mass * radius_m * radius_m
    };
    let floor = if before[2] > 0.0 {
        LEAST_SHARE * most
    } else {
        most
    };
    let (a, b) = (a.max(floor), b.max(floor));
    let missing = (0.5 * (most * (1.0 + MARGINS[1]) - a - b)).max(0.0);
    let after = [a + missing, b + missing, most];
    let mut moments = Vector3::zeros();
    for (&i, moment) in order.iter().zip(after) {
        moments[i] = moment;
    }
    *inertia =
        eigen.eigenvectors * Matrix3::from_diagonal(&moments) * eigen.eigenvectors.transpose();
    Some([before, after])
}

/// The link that consists of these parts, each with its pose in the link's frame.
pub fn merged(
    name: String,
    parts: &[(&LinkInertia, Isometry3<f64>)],
    [collisions, visuals]: [Vec<Solid>; 2],
    problems: &mut Problems,
) -> Link {
    let parts = parts.iter().map(|(part, pose)| (part, pose * part.origin));
    let mass_kg: f64 = parts.clone().map(|(part, _)| part.mass).sum();
    let com = parts
        .clone()
        .map(|(part, pose)| pose.translation.vector * part.mass)
        .sum::<Vector3<f64>>()
        / mass_kg;
    let mut inertia_kg_m2 = parts.fold(Matrix3::zeros(), |sum, (part, pose)| {
        let turn = pose.rotation.to_rotation_matrix();
        let d = pose.translation.vector - com;
        sum + turn * part.inertia * turn.transpose()
            + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * part.mass
    });
    mend(&mut inertia_kg_m2, mass_kg, true, &name, problems);
    Link {
        name,
        mass_kg,
        com_m: Point3::from(com),
        inertia_kg_m2,
        collisions,
        visuals,
    }
}

/// Compares the radius of gyration of each link, sqrt(inertia / mass), with the reach of its solids and joints from its
/// COM, and notes radii that are too large for the link. A radius that is [`IMPOSSIBLE`] is a problem, at the line of
/// the link: such inertias are mostly in another unit. The joints are at zero.
pub fn check_gyration(links: &[Link], joints: &[Joint], lines: &[usize], problems: &mut Problems) {
    let mut poses = vec![Isometry3::identity()];
    let mut points: Vec<Vec<Point3<f64>>> = links
        .iter()
        .map(|link| vec![Point3::origin(), link.com_m])
        .collect();
    for joint in joints {
        poses.push(poses[joint.parent] * joint.origin);
        points[joint.parent].push(joint.origin.translation.vector.into());
    }
    for (link, points) in links.iter().zip(&mut points) {
        points.extend(
            link.collisions
                .iter()
                .chain(&link.visuals)
                .flat_map(Solid::points),
        );
    }
    let all: Vec<_> = points
        .iter()
        .zip(&poses)
        .flat_map(|(points, pose)| points.iter().map(move |p| pose * p))
        .collect();
    let (least, most) = bounds(&all);
    let robot_m = (most - least).norm();
    let mut large = Vec::new();
    for ((link, points), &line) in links.iter().zip(&points).zip(lines) {
        let (moment, mass_kg) = (
            link.inertia_kg_m2.symmetric_eigenvalues().max(),
            link.mass_kg,
        );
        let gyration_m = (moment / mass_kg).sqrt();
        let link_m = points
            .iter()
            .map(|point| (point - link.com_m).norm())
            .fold(0.0, f64::max);
        // A link with hardly any mass is refused for its mass.
        if mass_kg > 1e-12 && gyration_m > IMPOSSIBLE * robot_m {
            let problem = format!(
                "with {mass_kg:.3} kg, its radius of gyration is {gyration_m:.3} m, and the whole robot spans {robot_m:.3} m"
            );
            let accepted = format!(
                "up to {:.1e} kg m^2, {IMPOSSIBLE} times the robot (1 kg mm^2 is 1e-6 kg m^2)",
                mass_kg * (IMPOSSIBLE * robot_m).powi(2)
            );
            problems.add(
                line,
                format!("link {}: inertia", link.name),
                format!("{moment:.3e}"),
                problem,
                accepted,
            );
        } else if gyration_m > LARGE * link_m && !link.drawn().is_empty() {
            large.push(format!(
                "{} ({gyration_m:.3} m, it reaches {link_m:.3} m)",
                link.name
            ));
        }
    }
    if !large.is_empty() {
        let list = large.join("; ");
        problems.notes.push(format!(
            "Inertias are too large for the size of their links: the radius of gyration, sqrt(inertia / mass), of {list}. \
             Are they in kg m^2?"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mended(diagonal: [f64; 3], mass: f64) -> Option<[f64; 3]> {
        let turn = Isometry3::rotation(Vector3::new(0.3, -0.7, 0.2))
            .rotation
            .to_rotation_matrix();
        let mut inertia =
            turn * Matrix3::from_diagonal(&Vector3::from(diagonal)) * turn.transpose();
        let [_, said] = raise(&mut inertia, mass, true)?;
        let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
        moments.sort_by(f64::total_cmp);
        for (moment, said) in moments.iter().zip(said) {
            assert!((moment - said).abs() < 1e-12, "{moments:?} {said:?}");
        }
        Some(moments)
    }

    #[test]
    fn inertias_become_those_of_a_body_by_as_little_as_possible() {
        assert_eq!(mended([3.0, 2.0, 1.1], 1.0), None);
        let near = |moments: Option<[f64; 3]>, expected: [f64; 3]| {
            let moments = moments.unwrap();
            assert!(
                moments
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-5),
                "{moments:?}"
            );
        };
        near(mended([4.0, 2.0, 1.0], 1.0), [1.5, 2.5, 4.0]);
        near(mended([3.002, 2.0, 1.0], 1.0), [1.001, 2.001, 3.002]);
        // A plate, whose moments another engine finds anew with other rounding.
        let [a, b, most] = mended([3.0, 2.0, 1.0 - 1e-16], 1.0).unwrap();
        assert!(a + b > most && a < 1.0 + 1e-5, "{a} {b} {most}");
        near(mended([4.0, 3.9, -1.0], 1.0), [0.052, 3.948, 4.0]);
        near(mended([4.0, -3.0, -1.0], 1.0), [2.0, 2.0, 4.0]);
        near(mended([4.0, 4.0, 1e-9], 1.0), [0.004, 4.0, 4.0]);
        assert_eq!(
            raise(&mut Matrix3::zeros(), 1.0, false),
            None,
            "a point mass"
        );
        // 1 kg of water: a ball with a radius of 62 mm.
        near(
            mended([0.0, 0.0, 0.0], 1.0),
            [0.4 * 0.0620350491_f64.powi(2); 3],
        );
    }
}
