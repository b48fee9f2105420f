//! What must not be hidden by the robot: points, forces and names, drawn over the picture.

use super::aim::Aim;
use super::colors::{self, Named};
use super::mesh::vec3;
use super::overlays::Shown;
use super::pick::Sight;
use super::scene;
use crate::episode::Snapshot;
use crate::episode::snapshot::Arrow;
use crate::render::palette::Overlay;
use crate::render::scale::Scale;
use crate::robot::Foot;
use crate::sim::Ground;
use kiss3d::camera::Camera3d;
use kiss3d::egui::epaint::PathShape;
use kiss3d::egui::{Align2, Color32, FontId, Painter, Pos2, Shape, Stroke, Vec2, pos2, vec2};
use kiss3d::glamx;
use nalgebra::{Point2, Point3, Unit, Vector3};
use std::f32::consts::{FRAC_PI_2, PI};

/// From the world to the picture (points of egui), and back.
pub struct Lens {
    to_clip: glamx::Mat4,
    from_clip: glamx::Mat4,
    eye: Point3<f64>,
    size: Vec2,
}

impl Lens {
    pub fn new(camera: &impl Camera3d, size: Vec2) -> Self {
        let eye = camera.eye();
        let eye = Point3::new(f64::from(eye.x), f64::from(eye.y), f64::from(eye.z));
        Self { to_clip: camera.transformation(), from_clip: camera.inverse_transformation(), eye, size }
    }

    /// None behind the viewer.
    pub fn project(&self, at: &Point3<f64>) -> Option<Pos2> {
        let clip = self.to_clip * vec3(at).extend(1.0);
        (clip.w > 1e-3)
            .then(|| pos2((1.0 + clip.x / clip.w) * self.size.x / 2.0, (1.0 - clip.y / clip.w) * self.size.y / 2.0))
    }

    /// From the eye through a point of the picture.
    pub fn sight(&self, at: Pos2) -> Sight {
        let (x, y) = (2.0 * at.x / self.size.x - 1.0, 1.0 - 2.0 * at.y / self.size.y);
        let far = self.from_clip * glamx::Vec4::new(x, y, 0.9, 1.0);
        let far = Point3::new(f64::from(far.x), f64::from(far.y), f64::from(far.z)) / f64::from(far.w);
        Sight { origin: self.eye, direction: Unit::new_normalize(far - self.eye) }
    }

    /// Where the middle of the picture looks.
    pub fn looking(&self) -> Unit<Vector3<f64>> {
        self.sight((self.size / 2.0).to_pos2()).direction
    }
}

/// Of names and sizes.
const FONT: FontId = FontId::proportional(13.0);

/// A picture with marks on it.
pub struct Marks<'a> {
    pub painter: Painter,
    pub lens: &'a Lens,
    pub ground: Ground,
    /// Of the robot.
    pub scale: Scale,
}

impl Marks<'_> {
    /// Draws what is shown of a moment; `force` is the push or pull to be seen.
    pub fn draw(&self, now: &Snapshot, shown: &Shown, force: Option<Arrow>) {
        if shown.has(Overlay::Slices) {
            self.slices(now);
        }
        if shown.has(Overlay::Support) {
            self.outline(now.support.iter().map(|at| self.on_floor(at)), colors::SUPPORT.egui(), 2.5);
        }
        if let Some(corners) = now.footstep.filter(|_| shown.has(Overlay::Footstep)) {
            self.outline(corners.into_iter(), colors::FOOTSTEP.egui(), 2.5);
        }
        if shown.has(Overlay::Contacts) {
            for arrow in Foot::BOTH.into_iter().filter_map(|foot| now.contacts[foot]) {
                let tip = arrow.point + arrow.force * self.scale.contact_m_per_n();
                self.arrow(arrow.point, tip, colors::CONTACT, 3.0, None);
            }
        }
        if shown.has(Overlay::Com) {
            let below = self.on_floor(&now.com.xy());
            self.dashed(now.com, below, colors::COM);
            self.cross(below, colors::COM);
            self.com(now.com);
        }
        if shown.has(Overlay::Dcm) {
            self.diamond(self.on_floor(&now.dcm), colors::DCM);
        }
        if shown.has(Overlay::ZmpRef) {
            self.at(self.on_floor(&now.zmp_ref), |painter, at| {
                painter.circle_stroke(at, 6.5, Stroke::new(4.5, Color32::WHITE));
                painter.circle_stroke(at, 6.5, Stroke::new(2.5, colors::ZMP_REF.egui()));
            });
        }
        if let Some(zmp) = now.zmp.filter(|_| shown.has(Overlay::Zmp)) {
            self.at(self.on_floor(&zmp), |painter, at| {
                painter.circle(at, 4.5, colors::ZMP.egui(), Stroke::new(1.2, Color32::WHITE));
            });
        }
        if let Some(arrow) = force.filter(|_| shown.has(Overlay::Push)) {
            self.force(&arrow);
        }
    }

    /// The sets' slices, one within the other; the one of the gain that acts is lit.
    fn slices(&self, now: &Snapshot) {
        for (i, slice) in now.slices.iter().enumerate() {
            let (opacity, width) = if now.gain == Some(i) { (1.0, 2.5) } else { (0.55, 1.2) };
            self.outline(slice.iter().map(|at| self.on_floor(at)), colors::SLICE.faint(opacity), width);
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

    /// A push or pull, with its size.
    fn force(&self, arrow: &Arrow) {
        let tip = arrow.point + arrow.force * self.scale.push_m_per_n();
        let text = format!("{:.1} N", arrow.force.norm());
        self.arrow(arrow.point, tip, colors::PUSH, 4.0, Some(&text));
        self.at(arrow.point, |painter, at| {
            painter.circle(at, 4.0, colors::PUSH.egui(), Stroke::new(1.2, Color32::WHITE));
        });
    }

    /// Where the next push goes: an arrow on the floor, outside of the feet.
    pub fn aim(&self, now: &Snapshot, aim: &Aim) {
        let (sin, cos) = aim.heading_deg.to_radians().sin_cos();
        let middle = nalgebra::center(&now.soles.left.xy(), &now.soles.right.xy());
        let along = nalgebra::Vector2::new(cos, sin) * self.scale.length();
        let at = |m: f64| self.on_floor(&(middle + along * m));
        let text = format!("{:.1} N s", aim.impulse_n_s);
        let faint = colors::PUSH.towards(colors::FLOOR, 0.35);
        self.arrow(at(-0.31), at(-0.19), faint, 2.5, None);
        self.at(at(-0.34), |painter, place| self.text(painter, place, &text, faint));
    }

    /// The axes' names, at the ends of the grid.
    pub fn axes(&self) {
        let end_m = scene::grid_m(self.scale) + 0.05 * self.scale.length();
        for (name, x, y) in [("x, forward", end_m, 0.0), ("y, left", 0.0, end_m)] {
            let color = colors::GRID.towards(colors::INK, 0.4);
            self.at(self.on_floor(&Point2::new(x, y)), |painter, at| self.text(painter, at, name, color));
        }
    }

    /// Names a link at the mouse.
    pub fn name(&self, at: Pos2, text: &str) {
        self.text(&self.painter, at + vec2(14.0, -14.0), text, colors::INK);
    }

    fn on_floor(&self, at: &Point2<f64>) -> Point3<f64> {
        Point3::new(at.x, at.y, self.ground.height_m(*at))
    }

    fn at(&self, place: Point3<f64>, draw: impl FnOnce(&Painter, Pos2)) {
        if let Some(at) = self.lens.project(&place) {
            draw(&self.painter, at);
        }
    }

    fn text(&self, painter: &Painter, at: Pos2, text: &str, color: Named) {
        for (x, y) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            painter.text(at + vec2(x, y), Align2::CENTER_CENTER, text, FONT, Color32::from_white_alpha(150));
        }
        painter.text(at, Align2::CENTER_CENTER, text, FONT, color.egui());
    }

    fn arrow(&self, from: Point3<f64>, to: Point3<f64>, color: Named, width: f32, text: Option<&str>) {
        let (Some(from), Some(to)) = (self.lens.project(&from), self.lens.project(&to)) else { return };
        let along = to - from;
        if along.length() < 1.0 {
            return;
        }
        let (unit, head) = (along.normalized(), (3.2 * width).min(along.length()));
        let neck = to - unit * head;
        self.painter.line_segment([from, neck], Stroke::new(width, color.egui()));
        let side = unit.rot90() * head * 0.45;
        let tip = vec![to, neck + side, neck - side];
        self.painter.add(PathShape::convex_polygon(tip, color.egui(), Stroke::NONE));
        if let Some(text) = text {
            // Beyond the tip, as far as the words reach.
            let half = self.painter.layout_no_wrap(text.into(), FONT, Color32::BLACK).size() / 2.0;
            self.text(&self.painter, to + unit * 6.0 + unit * half, text, color);
        }
    }

    fn dashed(&self, from: Point3<f64>, to: Point3<f64>, color: Named) {
        let (Some(from), Some(to)) = (self.lens.project(&from), self.lens.project(&to)) else { return };
        let stroke = Stroke::new(1.5, color.faint(0.8));
        self.painter.extend(Shape::dashed_line(&[from, to], stroke, 5.0, 4.0));
    }

    fn cross(&self, place: Point3<f64>, color: Named) {
        self.at(place, |painter, at| {
            for (width, color) in [(4.0, Color32::WHITE), (2.0, color.egui())] {
                for d in [vec2(5.0, 5.0), vec2(5.0, -5.0)] {
                    painter.line_segment([at - d, at + d], Stroke::new(width, color));
                }
            }
        });
    }

    fn diamond(&self, place: Point3<f64>, color: Named) {
        self.at(place, |painter, at| {
            let corners = [vec2(0.0, -7.0), vec2(7.0, 0.0), vec2(0.0, 7.0), vec2(-7.0, 0.0)].map(|d| at + d);
            painter.add(PathShape::convex_polygon(corners.to_vec(), color.egui(), Stroke::new(1.2, Color32::WHITE)));
        });
    }

    /// The sign of a centre of mass: a disc in quarters.
    fn com(&self, place: Point3<f64>) {
        self.at(place, |painter, at| {
            let (radius, color) = (8.0_f32, colors::COM.egui());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scale::tests::THRICE;

    #[test]
    fn a_line_of_sight_goes_through_what_is_seen_there() {
        let camera = scene::camera(Scale::of(&crate::robot::Robot::load("ut-mu2").unwrap()));
        let lens = Lens::new(&camera, vec2(800.0, 600.0));
        for place in [Point3::new(0.0, 0.0, 0.3), Point3::new(0.2, -0.4, 0.0)] {
            let sight = lens.sight(lens.project(&place).unwrap());
            let beside = (place - sight.origin).cross(&sight.direction).norm();
            assert!(beside < 1e-4, "{place}: beside by {beside} m");
        }
        let behind = lens.eye - lens.looking().into_inner();
        assert_eq!(lens.project(&behind), None);
        // Up is up.
        let [low, high] = [0.0, 0.4].map(|z| lens.project(&Point3::new(0.0, 0.0, z)).unwrap().y);
        assert!(high < low - 50.0, "{high} {low}");
    }

    #[test]
    fn a_robot_of_another_size_is_seen_as_large() {
        let at = |scale: Scale, m: f64| {
            let lens = Lens::new(&scene::camera(scale), vec2(800.0, 600.0));
            lens.project(&(Point3::new(0.05, 0.1, 0.31) * m)).unwrap()
        };
        let ut_mu2 = Scale::of(&crate::robot::Robot::load("ut-mu2").unwrap());
        let (one, three) = (at(ut_mu2, 1.0), at(THRICE, 3.0));
        assert!(one.distance(three) < 1.0, "{one} {three}");
    }
}
