//! Distances between links.

use nalgebra::Point3;
use standfast_core::geometry::gap::gap_m;
use standfast_core::robot::{Kinematics, Robot};

/// The collision geometry of each link as points, whose convex hulls collide.
pub struct Hulls {
    links: Vec<Vec<Hull>>,
}

struct Hull {
    points: Vec<Point3<f64>>,
    center: Point3<f64>,
    radius_m: f64,
}

impl Hulls {
    pub fn of(robot: &Robot) -> Self {
        let mut links = Vec::with_capacity(robot.links.len());
        for link in &robot.links {
            let mut hulls = Vec::new();
            for solid in &link.collisions {
                let (center, radius_m) = solid.shape.ball();
                hulls.push(Hull {
                    points: solid.points().collect(),
                    center: solid.pose * center,
                    radius_m,
                });
            }
            links.push(hulls);
        }
        Self { links }
    }

    /// The gap between two links (m), or `enough_m` if it is larger.
    pub fn gap_m(&self, kinematics: &Kinematics, [a, b]: [usize; 2], enough_m: f64) -> f64 {
        let [at_a, at_b] = [a, b].map(|link| kinematics.link_pose(link));
        // Link b is moved into the frame of link a.
        let between = at_a.inv_mul(at_b);
        let mut least = enough_m;
        for one in &self.links[a] {
            for other in &self.links[b] {
                let apart =
                    (one.center - between * other.center).norm() - one.radius_m - other.radius_m;
                if apart < least {
                    let moved: Vec<_> = other.points.iter().map(|point| between * point).collect();
                    least = least.min(gap_m(&one.points, &moved));
                }
            }
        }
        least
    }
}
