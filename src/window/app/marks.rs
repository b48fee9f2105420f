//! Marks and names in the window, drawn over the picture, so that the robot does not hide them.

use super::aim::Aim;
use super::camera::Lens;
use super::colors::OnScreen as _;
use super::{colors, space};
use kiss3d::egui::epaint::PathShape;
use kiss3d::egui::{self, Align2, Color32, FontId, Painter, Pos2, Shape, pos2, vec2};
use nalgebra::{Point2, Point3};
use standfast_core::robot::SizeRatio;
use standfast_scene::palette::{Color, GHOST, Overlay, Style};
use standfast_scene::{
    Drawing, FlatShape, SceneMark, ScreenPoint, Stroke, arrow, on_ground, strokes,
};
use standfast_sim::Ground;
use standfast_sim::episode::Snapshot;

/// Font of names and sizes.
const FONT: FontId = FontId::proportional(13.0);

/// Draws marks on a picture.
pub struct Marks<'a> {
    pub painter: Painter,
    pub lens: &'a Lens,
    pub ground: Ground,
    pub scale: SizeRatio,
}

impl Marks<'_> {
    pub fn draw(&self, mark: &SceneMark) {
        for stroke in strokes(mark, |at| self.seen(at)) {
            self.stroke(&stroke);
        }
        // Only pushes and pulls have their size written at the end of the arrow that is farther from the robot.
        if let (
            Overlay::Push,
            Drawing::Arrow {
                tail,
                along,
                ends,
                force_n,
                ..
            },
        ) = (mark.overlay, &mark.drawing)
            && let (Some(from), Some(to)) =
                (self.lens.project(tail), self.lens.project(&(tail + along)))
        {
            let size = format!("{force_n:.1} N");
            let half = self
                .painter
                .layout_no_wrap(size.clone(), FONT, Color32::BLACK)
                .size()
                / 2.0;
            let (at, away) = if *ends {
                (from, from - to)
            } else {
                (to, to - from)
            };
            let away = away.normalized();
            self.text(
                &self.painter,
                at + away * 6.0 + away * half,
                &size,
                mark.overlay.color(),
            );
        }
    }

    /// Draws the marks of a ghost.
    pub fn faint(&self, marks: &[SceneMark]) {
        for stroke in marks
            .iter()
            .flat_map(|mark| strokes(mark, |at| self.seen(at)))
        {
            self.stroke(&Stroke {
                opacity: GHOST.marks_opacity * stroke.opacity,
                ..stroke
            });
        }
    }

    /// Draws the path of a point over the ground, in the colour of its mark.
    pub fn trail(&self, path: impl Iterator<Item = Point2<f64>>, of: Overlay) {
        let Style::Trail { width, opacity } = Overlay::Trail.look().style else {
            return;
        };
        let places = path.filter_map(|at| self.lens.project(&self.on_ground(&at)));
        let stroke = egui::Stroke::new(width as f32, of.color().faint(opacity as f32));
        self.painter.add(Shape::line(places.collect(), stroke));
    }

    /// Place in the picture of a point in the world.
    fn seen(&self, at: &Point3<f64>) -> Option<ScreenPoint> {
        self.lens.project(at).map(|at| [at.x.into(), at.y.into()])
    }

    fn stroke(
        &self,
        Stroke {
            form,
            color,
            opacity,
        }: &Stroke,
    ) {
        let color = color.faint(*opacity as f32);
        let stroke = |width: f64| egui::Stroke::new(width as f32, color);
        let points = |path: &[ScreenPoint]| {
            path.iter()
                .map(|[x, y]| pos2(*x as f32, *y as f32))
                .collect::<Vec<Pos2>>()
        };
        self.painter.add(match form {
            FlatShape::Area { path } => Shape::Path(PathShape::convex_polygon(
                points(path),
                color,
                egui::Stroke::NONE,
            )),
            FlatShape::Outline { path, width } => Shape::closed_line(points(path), stroke(*width)),
            FlatShape::Line { path, width } => Shape::line(points(path), stroke(*width)),
        });
    }

    /// Draws the next push as an arrow on the floor, outside of the feet.
    pub fn aim(&self, now: &Snapshot, aim: &Aim) {
        let (sin, cos) = aim.heading_deg.to_radians().sin_cos();
        let middle = nalgebra::center(&now.soles.left.xy(), &now.soles.right.xy());
        let along = nalgebra::Vector2::new(cos, sin) * self.scale.length;
        let at = |m: f64| self.on_ground(&(middle + along * m));
        let text = format!("{:.1} N s", aim.impulse_n_s);
        let faint = colors::PUSH.towards(colors::FLOOR, 0.35);
        if let (Some(from), Some(to)) = (self.seen(&at(-0.31)), self.seen(&at(-0.19))) {
            for form in arrow(from, to, 2.5) {
                self.stroke(&Stroke {
                    form,
                    color: faint,
                    opacity: 1.0,
                });
            }
        }
        self.at(at(-0.34), |painter, place| {
            self.text(painter, place, &text, faint)
        });
    }

    /// Writes the names of the axes at the ends of the grid.
    pub fn axes(&self) {
        let end_m = space::grid_m(self.scale) + 0.05 * self.scale.length;
        for (name, x, y) in [("x, forward", end_m, 0.0), ("y, left", 0.0, end_m)] {
            let color = colors::GRID.towards(colors::INK, 0.4);
            self.at(self.on_ground(&Point2::new(x, y)), |painter, at| {
                self.text(painter, at, name, color)
            });
        }
    }

    /// Writes the name of a link beside the mouse.
    pub fn name(&self, at: Pos2, text: &str) {
        self.text(&self.painter, at + vec2(14.0, -14.0), text, colors::INK);
    }

    fn on_ground(&self, at: &Point2<f64>) -> Point3<f64> {
        on_ground(*at, &self.ground)
    }

    fn at(&self, place: Point3<f64>, draw: impl FnOnce(&Painter, Pos2)) {
        if let Some(at) = self.lens.project(&place) {
            draw(&self.painter, at);
        }
    }

    fn text(&self, painter: &Painter, at: Pos2, text: &str, color: Color) {
        for (x, y) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            painter.text(
                at + vec2(x, y),
                Align2::CENTER_CENTER,
                text,
                FONT,
                Color32::from_white_alpha(150),
            );
        }
        painter.text(at, Align2::CENTER_CENTER, text, FONT, color.egui());
    }
}
