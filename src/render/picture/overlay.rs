//! What a snapshot knows beside the posture: marks on the floor, and balls and arrows in space.

use super::camera::View;
use super::floor::across;
use super::mesh::{arrow, rod, sphere};
use super::raster::{Corner, Light, Triangle, linear};
use super::{Paint, Scene};
use crate::episode::Snapshot;
use crate::episode::snapshot::Arrow;
use crate::render::palette::Overlay;
use crate::render::scale::Scale;
use crate::robot::Foot;
use crate::sim::Ground;
use nalgebra::{Isometry3, Point2, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};

const COM: u32 = Overlay::Com.color();
const ZMP: u32 = Overlay::Zmp.color();
const ZMP_WANTED: u32 = Overlay::ZmpRef.color();
const DCM: u32 = Overlay::Dcm.color();
const SUPPORT: u32 = Overlay::Support.color();
const SLICES: u32 = Overlay::Slices.color();
const FOOTSTEP: u32 = Overlay::Footstep.color();
const CONTACT: u32 = Overlay::Contacts.color();
const PUSH: u32 = Overlay::Push.color();
const WHITE: u32 = 0xffffff;

/// How much of a mark is seen through what hides it.
pub(super) const THROUGH: f32 = 0.7;
/// Marks on the floor lie so high above it (m),
const LIFT_M: f64 = 0.0005;
/// and have such sizes, all of a robot as large as UT-mu2.
const DOT_M: f64 = 0.009;
const RIM_M: f64 = 0.002;
const LINE_M: f64 = 0.0025;
const COM_RADIUS_M: f64 = 0.014;
const SHAFT_M: f64 = 0.0045;
/// Corners of a round mark.
const ROUND: usize = 24;

fn light(color: u32) -> Light {
    linear([16, 8, 0].map(|shift| f64::from(color >> shift & 0xff) / 255.0))
}

/// Marks on the floor, lowest first.
pub(super) fn on_floor(
    view: &View,
    ground: &Ground,
    scale: Scale,
    snapshot: &Snapshot,
    marks: &[Overlay],
) -> Vec<Triangle> {
    let mut sheet = Sheet { view, ground, scale, triangles: Vec::new() };
    let has = |mark: Overlay| marks.contains(&mark);
    if has(Overlay::Slices) {
        // Slow to fast: the set of a slower gain is larger, mostly.
        for (i, slice) in snapshot.slices.iter().enumerate() {
            let acts = snapshot.gain == Some(i);
            sheet.polygon(slice, SLICES, if acts { 0.45 } else { 0.06 });
            sheet.outline(slice, LINE_M * if acts { 0.8 } else { 0.5 }, SLICES, if acts { 1.0 } else { 0.5 });
        }
    }
    if has(Overlay::Support) {
        sheet.polygon(&snapshot.support, SUPPORT, 0.10);
        sheet.outline(&snapshot.support, LINE_M, SUPPORT, 1.0);
    }
    if let Some(corners) = snapshot.footstep.filter(|_| has(Overlay::Footstep)) {
        let corners = corners.map(|corner| corner.xy());
        sheet.polygon(&corners, FOOTSTEP, 0.25);
        sheet.outline(&corners, LINE_M, FOOTSTEP, 1.0);
    }
    if has(Overlay::Com) {
        sheet.ring(snapshot.com.xy(), DOT_M + RIM_M, RIM_M, COM);
    }
    if has(Overlay::ZmpRef) {
        sheet.dot(snapshot.zmp_ref, ZMP_WANTED);
    }
    if let Some(zmp) = snapshot.zmp.filter(|_| has(Overlay::Zmp)) {
        sheet.dot(zmp, ZMP);
    }
    if has(Overlay::Dcm) {
        sheet.dot(snapshot.dcm, DCM);
    }
    sheet.triangles
}

/// The ball of the COM, and arrows.
pub(super) fn in_space(scene: &mut Scene, ground: &Ground, scale: Scale, snapshot: &Snapshot, marks: &[Overlay]) {
    let [com_m, shaft_m] = [COM_RADIUS_M, SHAFT_M].map(|m| m * scale.length());
    let has = |mark: Overlay| marks.contains(&mark);
    let paint = |color: u32, through: f32| Paint { light: light(color), cover: 1.0, through, throws_shadow: false };
    if has(Overlay::Com) {
        let on_floor = on_ground(snapshot.com.xy(), ground);
        let plumb = snapshot.com - on_floor;
        if plumb.norm() > com_m {
            let line = rod(0.3 * shaft_m, plumb.norm());
            scene.body(&line, &pose_along(on_floor, plumb), &paint(COM, 0.5));
        }
        scene.body(&sphere(com_m), &Isometry3::from(snapshot.com.coords), &paint(COM, 0.8));
    }
    if has(Overlay::Contacts) {
        for Arrow { point, force } in Foot::BOTH.into_iter().filter_map(|foot| snapshot.contacts[foot]) {
            let mesh = arrow(scale.contact_m_per_n() * force.norm(), shaft_m);
            scene.body(&mesh, &pose_along(point, force), &paint(CONTACT, 0.3));
        }
    }
    if let Some(Arrow { point, force }) = snapshot.push.filter(|_| has(Overlay::Push)) {
        let length = scale.push_m_per_n() * force.norm();
        let tail = point - force.normalize() * length;
        scene.body(&arrow(length, 1.4 * shaft_m), &pose_along(tail, force), &paint(PUSH, 0.6));
    }
}

/// At `from`, z along `direction`.
fn pose_along(from: Point3<f64>, direction: Vector3<f64>) -> Isometry3<f64> {
    let (x, y) = across(&direction);
    let axes = Rotation3::from_basis_unchecked(&[x, y, direction.normalize()]);
    Isometry3::from_parts(from.into(), UnitQuaternion::from_rotation_matrix(&axes))
}

/// The point of the floor below or above a point of the plan.
fn on_ground(at: Point2<f64>, ground: &Ground) -> Point3<f64> {
    Point3::new(at.x, at.y, ground.height_m(at))
}

/// Flat marks just above the floor.
struct Sheet<'a> {
    view: &'a View,
    ground: &'a Ground,
    scale: Scale,
    triangles: Vec<Triangle>,
}

impl Sheet<'_> {
    fn triangle(&mut self, corners: [Point2<f64>; 3], light: Light, cover: f32) {
        let lift = self.ground.slope * Vector3::z() * (LIFT_M * self.scale.length());
        let corners = corners.map(|at| {
            let seen = self.view.project(on_ground(at, self.ground) + lift);
            seen.map(|[x, y, near]| Corner { at: [x, y], near, light })
        });
        if let [Some(a), Some(b), Some(c)] = corners {
            self.triangles.push(Triangle { corners: [a, b, c], cover, through: 0.0, hides: false });
        }
    }

    /// A convex polygon.
    fn polygon(&mut self, corners: &[Point2<f64>], color: u32, cover: f32) {
        for pair in corners.windows(2).skip(1) {
            self.triangle([corners[0], pair[0], pair[1]], light(color), cover);
        }
    }

    /// The band between a closed line and another inside of it with as many corners.
    fn band(&mut self, outer: &[Point2<f64>], inner: &[Point2<f64>], color: u32, cover: f32) {
        for i in 0..outer.len() {
            let next = (i + 1) % outer.len();
            self.triangle([outer[i], outer[next], inner[next]], light(color), cover);
            self.triangle([outer[i], inner[next], inner[i]], light(color), cover);
        }
    }

    /// The border of a convex polygon, inside of it; corners counter-clockwise or clockwise.
    fn outline(&mut self, corners: &[Point2<f64>], breadth: f64, color: u32, cover: f32) {
        let breadth = breadth * self.scale.length();
        let mut corners = corners.to_vec();
        corners.dedup_by(|a, b| (*a - *b).norm() < 1e-6);
        if corners.len() < 3 {
            return;
        }
        let n = corners.len();
        let along = |i: usize| (corners[(i + 1) % n] - corners[i]).normalize();
        let turn: f64 = (0..n).map(|i| along(i).perp(&along((i + 1) % n))).sum();
        let inwards = |i: usize| Vector2::new(-along(i).y, along(i).x) * turn.signum();
        let inner: Vec<_> = (0..n)
            .map(|i| {
                let (a, b) = (inwards((i + n - 1) % n), inwards(i));
                // The mitre of a sharp corner is cut.
                corners[i] + (a + b) * (breadth / (1.0 + a.dot(&b)).max(0.3))
            })
            .collect();
        self.band(&corners, &inner, color, cover);
    }

    fn dot(&mut self, at: Point2<f64>, color: u32) {
        self.polygon(&circle(at, DOT_M * self.scale.length()), color, 1.0);
        self.ring(at, DOT_M + RIM_M, RIM_M, WHITE);
    }

    fn ring(&mut self, at: Point2<f64>, radius: f64, breadth: f64, color: u32) {
        let [outer, inner] = [radius, radius - breadth].map(|m| circle(at, m * self.scale.length()));
        self.band(&outer, &inner, color, 1.0);
    }
}

fn circle(at: Point2<f64>, radius: f64) -> Vec<Point2<f64>> {
    let corner = |k: usize| {
        let (sin, cos) = (360.0 * k as f64 / ROUND as f64).to_radians().sin_cos();
        at + Vector2::new(cos, sin) * radius
    };
    (0..ROUND).map(corner).collect()
}
