//! Draws a moment of an episode, or a posture, as a picture.

use super::camera::Camera;
use super::canvas::Canvas;
use super::marks;
use crate::scene::Stage;
use crate::scene::palette::Overlay;
use image::RgbImage;
use standfast_core::robot::{Posture, Robot};
use standfast_sim::Ground;
use standfast_sim::episode::Snapshot;

/// Shorter side of a picture in which one pixel is one point of a screen (px).
const FULL_PX: f64 = 480.0;

/// Draws a moment of an episode with some marks, in a picture of `size` (width, height; px). `robot` is the simulated
/// robot. The ground has the slope of the snapshot, and no step.
pub fn draw(
    robot: &Robot,
    snapshot: &Snapshot,
    camera: &Camera,
    size: [u32; 2],
    marks: &[Overlay],
) -> RgbImage {
    draw_on(
        &Stage::new(robot, Ground::default()),
        snapshot,
        None,
        camera,
        size,
        marks,
    )
}

/// Like [`draw`], with the ground of a stage at the slope of the snapshot, and with a ghost.
pub(super) fn draw_on(
    stage: &Stage,
    snapshot: &Snapshot,
    ghost: Option<&Snapshot>,
    camera: &Camera,
    size: [u32; 2],
    marks: &[Overlay],
) -> RgbImage {
    let (mut canvas, ground) = (Canvas::new(camera, size), stage.ground(snapshot));
    let marks = stage.marks(snapshot, marks);
    canvas
        .triangles
        .extend(marks::on_the_ground(&canvas.view, &marks));
    canvas.robot(stage, &stage.kinematics(&snapshot.posture));
    if let Some(ghost) = ghost {
        canvas.ghost(stage, &stage.kinematics(&ghost.posture));
    }
    canvas
        .triangles
        .extend(marks::over_all(&canvas.view, point_px(size), &marks));
    canvas.paint(size, &ground)
}

/// Number of pixels for each point of a screen. Marks grow with a large picture, and shrink less than a small one.
fn point_px(size: [u32; 2]) -> f64 {
    let share = f64::from(size[0].min(size[1])) / FULL_PX;
    share.max(share.sqrt())
}

/// Draws a robot on a level floor without marks, in a picture of `size` (width, height; px).
pub fn draw_posture(robot: &Robot, posture: &Posture, camera: &Camera, size: [u32; 2]) -> RgbImage {
    let (mut canvas, stage) = (
        Canvas::new(camera, size),
        Stage::new(robot, Ground::default()),
    );
    canvas.robot(&stage, &stage.kinematics(posture));
    canvas.paint(size, &Ground::default())
}
