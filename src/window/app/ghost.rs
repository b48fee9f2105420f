//! The ghost: the robot in another engine, drawn transparent over the picture, so that the solid robot does not hide
//! it.

use super::camera::Lens;
use super::colors::OnScreen as _;
use super::space::{brightness, to_sun};
use kiss3d::egui::{Mesh, Shape};
use nalgebra::Point3;
use standfast_core::robot::Kinematics;
use standfast_scene::palette::{Color, GHOST};
use standfast_scene::{Stage, Surface};

/// Distance from the same part of the solid robot at which a part of the ghost has its full opacity, for a robot of the
/// size of UT-mu2 (m). Nearer parts are fainter, so that a ghost at the same place does not tint the robot.
const APART_M: f64 = 0.02;

/// The ghost beside the solid robot, as seen from `eye` (m, world frame). Both are robots of the stage.
pub fn shape(
    stage: &Stage,
    robot: &Kinematics,
    ghost: &Kinematics,
    lens: &Lens,
    eye: Point3<f64>,
) -> Shape {
    let mut out = Mesh::default();
    let away_m = |at: &Point3<f64>| (at - eye).norm();
    let mut parts: Vec<_> = stage.solids(ghost).zip(stage.solids(robot)).collect();
    // The farthest parts are painted first.
    parts.sort_by(|((a, at_a), _), ((b, at_b), _)| {
        away_m(&(at_b * b.ball.0)).total_cmp(&away_m(&(at_a * a.ball.0)))
    });
    for ((Surface { mesh, ball, .. }, pose), (_, beside)) in parts {
        let apart_m = (pose * ball.0 - beside * ball.0).norm() / stage.scale.length;
        let opacity = GHOST.opacity * (apart_m / APART_M).min(1.0);
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
                let color = GHOST.color.towards(Color::WHITE, (bright - 0.5) as f32);
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
            let Shape::Mesh(mesh) = shape(&stage, &here, &there, &lens, Point3::new(2.0, 1.0, 1.0))
            else {
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
