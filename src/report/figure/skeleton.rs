//! The robot as lines: bones from joint to joint, soles, and the marks of a moment, in parallel projection. A replay shows
//! the solids; this is for small pictures, and for pages that have to be SVG alone.

use super::panel::{Panel, PanelPoint, px};
use nalgebra::{Point3, Vector3};
use standfast_core::robot::{Foot, Kinematics, Posture, Robot};
use standfast_scene::palette::{Color, Overlay};
use standfast_scene::{Drawing, FlatShape, ScreenPoint, Stage, pendulum, strokes};
use standfast_sim::Push;
use standfast_sim::episode::{Film, Snapshot};

/// Size of a small picture, and the space around the robot (px).
const SIZE: [f64; 2] = [200.0, 150.0];
const MARGIN: f64 = 12.0;
/// Directions to the eye of small pictures (degrees), of which the one that looks more across the push is used.
const SIDES_DEG: [f64; 2] = [52.0, -38.0];
const ELEVATION_DEG: f64 = 17.0;
/// The marks of small pictures.
const MARKS: [Overlay; 4] = [
    Overlay::Support,
    Overlay::Footstep,
    Overlay::Push,
    Overlay::Com,
];

/// Where a point of the world is seen.
#[derive(Debug, Clone, Copy)]
pub struct View {
    right: Vector3<f64>,
    up: Vector3<f64>,
    pub px_per_m: f64,
    /// Place of the origin of the world (px).
    pub origin: PanelPoint,
}

impl View {
    /// The view from an azimuth (degrees; 0 is before the robot, 90 at its left) and an elevation (degrees), with
    /// `target` (m) at `middle` (px).
    pub fn new(
        [azimuth_deg, elevation_deg]: [f64; 2],
        px_per_m: f64,
        target: Point3<f64>,
        middle: PanelPoint,
    ) -> Self {
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
        let mut view = Self {
            right: Vector3::new(-sin_a, cos_a, 0.0),
            up: Vector3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e),
            px_per_m,
            origin: [0.0, 0.0],
        };
        let [x, y] = view.at(&target);
        view.origin = [middle[0] - x, middle[1] - y];
        view
    }

    /// The place of a point (px).
    pub fn at(&self, point: &Point3<f64>) -> PanelPoint {
        [
            self.origin[0] + self.px_per_m * self.right.dot(&point.coords),
            self.origin[1] - self.px_per_m * self.up.dot(&point.coords),
        ]
    }
}

/// The bones of a robot (m, world frame): to each joint from the joint before it, and on to where nothing follows: to a
/// sole, or to the COM of the last link.
pub fn bones(robot: &Robot, kinematics: &Kinematics) -> Vec<[Point3<f64>; 2]> {
    let start = |link: usize| match link {
        0 => kinematics.link_com(0),
        link => kinematics.joint_position(link - 1),
    };
    let mut bones = Vec::new();
    for (i, joint) in robot.joints.iter().enumerate() {
        bones.push([start(joint.parent), start(i + 1)]);
        if !robot.joints.iter().any(|next| next.parent == i + 1) {
            let foot = Foot::BOTH
                .into_iter()
                .find(|foot| robot.soles[*foot].link == i + 1);
            let end = foot.map_or(kinematics.link_com(i + 1), |foot| {
                kinematics.sole_pose(robot, foot).translation.vector.into()
            });
            bones.push([start(i + 1), end]);
        }
    }
    bones
}

/// Draws the bones and the soles of a robot.
pub fn draw(panel: &mut Panel, robot: &Robot, posture: &Posture, view: &View) {
    let kinematics = Kinematics::at(robot, posture);
    for foot in Foot::BOTH {
        let pose = kinematics.sole_pose(robot, foot);
        let corners = robot.soles[foot].corners();
        panel.polygon("sole", corners.map(|corner| view.at(&(pose * corner))));
    }
    for [from, to] in bones(robot, &kinematics) {
        panel.line("bone", view.at(&from), view.at(&to));
    }
}

/// Draws a moment: the robot, and the marks that are `shown`, which look as in a replay.
pub fn draw_moment(
    panel: &mut Panel,
    stage: &Stage,
    now: &Snapshot,
    view: &View,
    shown: &[Overlay],
) {
    let marks = stage.marks(now, shown);
    let shape = |path: &[ScreenPoint], look: String| {
        let points: Vec<String> = path
            .iter()
            .map(|[x, y]| format!("{},{}", px(*x), px(*y)))
            .collect();
        format!("<path d=\"M{}{look}/>", points.join("L"))
    };
    for mark in &marks {
        if let Drawing::Polygon { corners, sheet } = &mark.drawing
            && !corners.is_empty()
        {
            let path: Vec<_> = corners.iter().map(|at| view.at(at)).collect();
            let (color, fill) = (mark.overlay.color().css(), sheet.fill);
            panel.add(shape(
                &path,
                format!("Z\" fill=\"{color}\" fill-opacity=\"{fill}\""),
            ));
        }
    }
    draw(panel, stage.robot, &now.posture, view);
    for stroke in marks
        .iter()
        .flat_map(|mark| strokes(mark, |at| Some(view.at(at))))
    {
        let (color, opacity) = (stroke.color.css(), stroke.opacity);
        let line = |end, width: f64| {
            let width = px(width);
            format!(
                "{end}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\""
            )
        };
        panel.add(match &stroke.form {
            FlatShape::Area { path } => shape(
                path,
                format!("Z\" fill=\"{color}\" fill-opacity=\"{opacity}\""),
            ),
            FlatShape::Outline { path, width } => shape(path, line("Z", *width)),
            FlatShape::Line { path, width } => shape(path, line("", *width)),
        });
    }
}

/// A small picture (SVG) of the most important moment of a film: the fall, or else the first landing, or else the end of
/// the push.
pub fn of_film(film: &Film) -> String {
    let pushed_until_s = film.pushes.iter().map(Push::end_s).fold(0.0, f64::max);
    let landed_s = film.record.footsteps.taken.first().map(|step| step.land_s);
    let at_s = film.record.fell_at_s.or(landed_s).unwrap_or(pushed_until_s);
    let seen = &film.snapshots[..film.near()];
    let now = seen.iter().find(|now| now.time_s >= at_s - 1e-9);
    let mut panel = Panel::new(SIZE[0], SIZE[1]);
    let Some(now) = now.or(seen.last()) else {
        return super::document("", &[panel], 1);
    };
    let heading_deg = film.pushes.first().map_or(0.0, |push| push.heading_deg);
    let off = (SIDES_DEG[0] - heading_deg).rem_euclid(180.0);
    let azimuth_deg = SIDES_DEG[usize::from(off.min(180.0 - off) < 30.0)];
    let stage = Stage::new(&film.robot, film.ground);
    let mut view = View::new(
        [azimuth_deg, ELEVATION_DEG],
        1.0,
        Point3::origin(),
        [0.0, 0.0],
    );
    let mut points: Vec<PanelPoint> = bones(&film.robot, &stage.kinematics(&now.posture))
        .iter()
        .flatten()
        .map(|at| view.at(at))
        .collect();
    points.extend(
        now.support
            .iter()
            .map(|at| view.at(&Point3::new(at.x, at.y, 0.0))),
    );
    let ends = [0, 1].map(|i| {
        let along = points.iter().map(|at| at[i]);
        [
            along.clone().fold(f64::INFINITY, f64::min),
            along.fold(f64::NEG_INFINITY, f64::max),
        ]
    });
    let scale = [0, 1].map(|i| (SIZE[i] - 2.0 * MARGIN) / (ends[i][1] - ends[i][0]).max(1e-9));
    view.px_per_m = scale[0].min(scale[1]);
    view.origin = [0, 1].map(|i| SIZE[i] / 2.0 - view.px_per_m * (ends[i][0] + ends[i][1]) / 2.0);
    if let (Some(rope), Some(bob)) = (now.rope, film.pushes.iter().find_map(|push| push.bob)) {
        let [[x, y], [bob_x, bob_y]] = rope.map(|end| view.at(&end).map(px));
        let [color, of_rope] = pendulum::COLORS.map(Color::css);
        let radius = px(bob.radius_m * view.px_per_m);
        panel.add(format_args!(
            "<path d=\"M{x},{y}L{bob_x},{bob_y}\" stroke=\"{of_rope}\"/><circle cx=\"{bob_x}\" cy=\"{bob_y}\" r=\"{radius}\" style=\"fill:{color}\"/>"
        ));
    }
    draw_moment(&mut panel, &stage, now, &view, &MARKS);
    super::alone(&panel)
}
