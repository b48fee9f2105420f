//! Transparent robots, each with its pendulum: the ghost, and the robot whose body is switched off. They are drawn over
//! the picture, so that the solid robot does not hide them.

use super::camera::Lens;
use super::colors::OnScreen as _;
use super::space::{brightness, to_sun};
use kiss3d::egui::{Mesh, Shape};
use nalgebra::{Isometry3, Point3};
use standfast_core::robot::Kinematics;
use standfast_scene::palette::{Color, GHOST, Overlay};
use standfast_scene::{Stage, Surface, pendulum};

/// Distance from the same part of the solid robot at which a part of the ghost has its full opacity, for a robot of the
/// size of UT-mu2 (m). Nearer parts are fainter, so that a ghost at the same place does not tint the robot.
const APART_M: f64 = 0.02;

/// A rope, from pivot to bob (m), if there is one.
type Rope = Option<[Point3<f64>; 2]>;

/// The colour and the opacity (0 to 1) of the parts of a ghost beside the solid robot and its rope, by their poses.
pub fn ghost(
    stage: &Stage,
    (robot, rope): (&Kinematics, Rope),
) -> impl Fn(&Surface, &Isometry3<f64>) -> (Color, f64) {
    let hanging = rope.map(pendulum::pose);
    move |Surface { link, ball, .. }, pose| {
        let beside = link.map_or(hanging, |link| Some(*robot.link_pose(link)));
        let apart_m = beside.map_or(f64::INFINITY, |beside| {
            (pose * ball.0 - beside * ball.0).norm() / stage.scale.length
        });
        (
            Overlay::Ghost.color(),
            GHOST.opacity * (apart_m / APART_M).min(1.0),
        )
    }
}

/// A robot of the stage with its rope with the colours and opacities of `paint`, as seen from `eye` (m, world frame).
pub fn shape(
    stage: &Stage,
    (robot, rope): (&Kinematics, Rope),
    paint: impl Fn(&Surface, &Isometry3<f64>) -> (Color, f64),
    lens: &Lens,
    eye: Point3<f64>,
) -> Shape {
    let mut out = Mesh::default();
    let away_m = |at: &Point3<f64>| (at - eye).norm();
    let mut parts: Vec<_> = stage.solids(robot, rope).collect();
    // The farthest parts are painted first.
    parts.sort_by(|(a, at_a), (b, at_b)| {
        away_m(&(at_b * b.ball.0)).total_cmp(&away_m(&(at_a * a.ball.0)))
    });
    for (solid, pose) in parts {
        let (color, opacity) = paint(solid, &pose);
        let mesh = &solid.mesh;
        let corners: Vec<_> = mesh
            .corners
            .iter()
            .map(|(at, normal)| (pose * at, pose * normal))
            .collect();
        for face in &mesh.faces {
            let [a, b, c] = face.map(|i| corners[i].0);
            if (b - a).cross(&(c - a)).dot(&(eye - a)) <= 0.0 {
                continue;
            }
            let [Some(a), Some(b), Some(c)] = [a, b, c].map(|at| lens.project(&at)) else {
                continue;
            };
            let first = out.vertices.len() as u32;
            for (place, (at, normal)) in [a, b, c].into_iter().zip(face.map(|i| &corners[i])) {
                let bright = brightness(normal, &(eye - at).normalize(), &to_sun());
                let color = color.towards(Color::WHITE, (bright - 0.5) as f32);
                out.colored_vertex(place, color.faint(opacity as f32));
            }
            out.add_triangle(first, first + 1, first + 2);
        }
    }
    Shape::mesh(out)
}

#[cfg(test)]
mod tests {
    use super::super::camera::camera;
    use super::*;
    use kiss3d::egui::vec2;
    use standfast_core::robot::Posture;
    use standfast_sim::Ground;

    #[test]
    fn a_ghost_is_the_fainter_the_nearer_it_is_to_the_robot() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let stage = Stage::new(&robot, Ground::default());
        let (home, lens) = (
            robot.home_posture(),
            Lens::new(&camera(stage.scale), vec2(860.0, 720.0)),
        );
        let most = |away_m: f64| {
            let mut posture = Posture { ..home.clone() };
            posture.base.translation.vector.x += away_m;
            let [there, here] = [&posture, &home].map(|posture| stage.kinematics(posture));
            let Shape::Mesh(mesh) = shape(
                &stage,
                (&there, None),
                ghost(&stage, (&here, None)),
                &lens,
                Point3::new(2.0, 1.0, 1.0),
            ) else {
                panic!()
            };
            assert!(mesh.indices.len() > 500, "{} corners", mesh.indices.len());
            mesh.vertices
                .iter()
                .map(|corner| corner.color.a())
                .max()
                .unwrap()
        };
        let alpha = (255.0 * GHOST.opacity).round() as u8;
        assert_eq!([most(0.0), most(0.5)], [0, alpha]);
        assert!((1..alpha).contains(&most(0.01)), "{}", most(0.01));
    }
}
