//! The marks of the scene in the window: drawn over the picture, so that the robot does not hide them. And names.

use super::aim::Aim;
use super::camera::Lens;
use super::{colors, space};
use crate::episode::Snapshot;
use crate::render::scene::palette::{Color, Overlay, Sign};
use crate::render::scene::scale::RobotScale;
use crate::render::scene::{Drawing, Mark, on_ground};
use crate::sim::Ground;
use kiss3d::egui::epaint::PathShape;
use kiss3d::egui::{Align2, Color32, FontId, Painter, Pos2, Shape, Stroke, Vec2, vec2};
use nalgebra::{Point2, Point3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Of names and sizes.
const FONT: FontId = FontId::proportional(13.0);
/// Width of an arrow (points) by the radius of its shaft, for a robot of UT-mu2's size (m).
const ARROW_POINTS_PER_M: f64 = 667.0;

/// A picture with marks on it.
pub struct Marks<'a> {
    pub painter: Painter,
    pub lens: &'a Lens,
    pub ground: Ground,
    /// Of the robot.
    pub scale: RobotScale,
}

impl Marks<'_> {
    pub fn draw(&self, mark: &Mark) {
        let color = mark.overlay.color();
        match &mark.drawing {
            Drawing::Polygon { corners, sheet } => {
                self.outline(
                    corners.iter().map(|at| self.on_ground(at)),
                    color.faint(sheet.edge as f32),
                    sheet.width as f32,
                );
            }
            Drawing::Spot { at, sign, .. } => self.sign(self.on_ground(at), *sign, color),
            Drawing::Ball { center, .. } => {
                let below = self.on_ground(&center.xy());
                self.dashed(*center, below, color);
                self.cross(below, color);
                self.com(*center, color);
            }
            Drawing::Arrow { tail, along, ends, radius_m, force_n, .. } => {
                let width = (ARROW_POINTS_PER_M * radius_m / self.scale.length()) as f32;
                let Some([from, to]) = self.arrow(*tail, tail + along, color, width) else { return };
                // Only a person's force has its size at it: away from the robot, as far as the words reach.
                if mark.overlay == Overlay::Push {
                    let size = format!("{force_n:.1} N");
                    let half = self.painter.layout_no_wrap(size.clone(), FONT, Color32::BLACK).size() / 2.0;
                    let (at, away) = if *ends { (from, from - to) } else { (to, to - from) };
                    let away = away.normalized();
                    self.text(&self.painter, at + away * 6.0 + away * half, &size, color);
                }
            }
        }
    }

    fn outline(&self, corners: impl Iterator<Item = Point3<f64>>, color: Color32, width: f32) {
        let corners: Option<Vec<_>> = corners.map(|corner| self.lens.project(&corner)).collect();
        let (Some(mut corners), stroke) = (corners, Stroke::new(width, color)) else { return };
        corners.dedup_by(|a, b| a.distance(*b) < 1.0);
        let after = |i: usize| corners[(i + 1) % corners.len()];
        let side = |i: usize| (after(i) - corners[i]).normalized();
        let count = corners.len();
        // Joined, the sides of a sole that stands on its edge would make spikes.
        if (0..count).any(|i| side(i).dot(side((i + 1) % count)) < -0.9) {
            self.painter.extend((0..count).map(|i| Shape::line_segment([corners[i], after(i)], stroke)));
        } else {
            self.painter.add(Shape::closed_line(corners, stroke));
        }
    }

    fn sign(&self, place: Point3<f64>, sign: Sign, color: Color) {
        self.at(place, |painter, at| match sign {
            Sign::Disc => _ = painter.circle(at, 4.5, color.egui(), Stroke::new(1.2, Color32::WHITE)),
            Sign::Ring => {
                painter.circle_stroke(at, 6.5, Stroke::new(4.5, Color32::WHITE));
                painter.circle_stroke(at, 6.5, Stroke::new(2.5, color.egui()));
            }
            Sign::Diamond => {
                let corners = [vec2(0.0, -7.0), vec2(7.0, 0.0), vec2(0.0, 7.0), vec2(-7.0, 0.0)].map(|d| at + d);
                let rim = Stroke::new(1.2, Color32::WHITE);
                painter.add(PathShape::convex_polygon(corners.to_vec(), color.egui(), rim));
            }
        });
    }

    /// Where the next push goes: an arrow on the floor, outside of the feet.
    pub fn aim(&self, now: &Snapshot, aim: &Aim) {
        let (sin, cos) = aim.heading_deg.to_radians().sin_cos();
        let middle = nalgebra::center(&now.soles.left.xy(), &now.soles.right.xy());
        let along = nalgebra::Vector2::new(cos, sin) * self.scale.length();
        let at = |m: f64| self.on_ground(&(middle + along * m));
        let text = format!("{:.1} N s", aim.impulse_n_s);
        let faint = colors::PUSH.towards(colors::FLOOR, 0.35);
        self.arrow(at(-0.31), at(-0.19), faint, 2.5);
        self.at(at(-0.34), |painter, place| self.text(painter, place, &text, faint));
    }

    /// The axes' names, at the ends of the grid.
    pub fn axes(&self) {
        let end_m = space::grid_m(self.scale) + 0.05 * self.scale.length();
        for (name, x, y) in [("x, forward", end_m, 0.0), ("y, left", 0.0, end_m)] {
            let color = colors::GRID.towards(colors::INK, 0.4);
            self.at(self.on_ground(&Point2::new(x, y)), |painter, at| self.text(painter, at, name, color));
        }
    }

    /// Names a link at the mouse.
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
            painter.text(at + vec2(x, y), Align2::CENTER_CENTER, text, FONT, Color32::from_white_alpha(150));
        }
        painter.text(at, Align2::CENTER_CENTER, text, FONT, color.egui());
    }

    /// Draws an arrow, and returns its ends in the picture; None if it is too short to be seen.
    fn arrow(&self, from: Point3<f64>, to: Point3<f64>, color: Color, width: f32) -> Option<[Pos2; 2]> {
        let (from, to) = (self.lens.project(&from)?, self.lens.project(&to)?);
        let along = to - from;
        if along.length() < 1.0 {
            return None;
        }
        let (unit, head) = (along.normalized(), (3.2 * width).min(along.length()));
        let neck = to - unit * head;
        self.painter.line_segment([from, neck], Stroke::new(width, color.egui()));
        let side = unit.rot90() * head * 0.45;
        let tip = vec![to, neck + side, neck - side];
        self.painter.add(PathShape::convex_polygon(tip, color.egui(), Stroke::NONE));
        Some([from, to])
    }

    fn dashed(&self, from: Point3<f64>, to: Point3<f64>, color: Color) {
        let (Some(from), Some(to)) = (self.lens.project(&from), self.lens.project(&to)) else { return };
        let stroke = Stroke::new(1.5, color.faint(0.8));
        self.painter.extend(Shape::dashed_line(&[from, to], stroke, 5.0, 4.0));
    }

    fn cross(&self, place: Point3<f64>, color: Color) {
        self.at(place, |painter, at| {
            for (width, color) in [(4.0, Color32::WHITE), (2.0, color.egui())] {
                for d in [vec2(5.0, 5.0), vec2(5.0, -5.0)] {
                    painter.line_segment([at - d, at + d], Stroke::new(width, color));
                }
            }
        });
    }

    /// The sign of a centre of mass: a disc in quarters.
    fn com(&self, place: Point3<f64>, color: Color) {
        self.at(place, |painter, at| {
            let (radius, color) = (8.0_f32, color.egui());
            painter.circle_filled(at, radius, Color32::WHITE);
            for start in [0.0, PI] {
                let arc = (0..=8).map(|i| at + Vec2::angled(start + i as f32 * FRAC_PI_2 / 8.0) * radius);
                let quarter = std::iter::once(at).chain(arc).collect();
                painter.add(PathShape::convex_polygon(quarter, color, Stroke::NONE));
            }
            painter.circle_stroke(at, radius, Stroke::new(1.8, color));
        });
    }
}
